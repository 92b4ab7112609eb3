import json

import pytest

from compare.__main__ import main
from ribbonfem import Ribbon, Scene, SceneError
from ribbonfem.output.scene_file import read_scene

TEXT = """
compression = 0.40
shear = 0.0
start = "U+"
rate = 0.1
stop = 1.4

[ribbon]
thickness = 0.005
"""


def written(folder, text):
    path = folder / "scene.toml"
    path.write_text(text)
    return path


def test_a_file_is_a_scene(tmp_path):
    scene = read_scene(written(tmp_path, TEXT))
    assert scene == Scene(
        compression=0.40, shear=0.0, start="U+", rate=0.1, stop=1.4, ribbon=Ribbon(thickness=0.005)
    )
    assert read_scene(written(tmp_path, "hold = 0")) == Scene()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("speed = 1", "Scene.speed = 1: not a field; the fields are compression"),
        (
            "compresion = 0.3",
            "Scene.compresion = 0.3: not a field; perhaps 'compression' is meant",
        ),
        ("Rate = 0.3", "perhaps 'rate' is meant"),
        ("thickness = 0.01", "'thickness' belongs below [ribbon]"),
        ("[ribbon]\nrate = 1", "'rate' belongs above [ribbon]"),
        ("thicknes = 0.01", "perhaps Ribbon.thickness is meant"),
        ("[ribbon]\ncolour = 1", "Ribbon.colour = 1: not a field"),
        ("[ribbon]\nbendingratio = 1", "perhaps 'bending_ratio' is meant"),
        ("ribbon = 3", "a table"),
        ("rate = 0", "Scene.rate = 0.0"),
        ("rate = true", "Scene.rate = True"),
        ("[ribbon]\nwidth = -1", "Ribbon.width = -1.0"),
        ("rate =", "not a TOML file"),
        ("", "empty: a scene file holds"),
        ("# nothing", "empty: a scene file holds"),
        ("rate = 1" + 5000 * "0", "scene.toml"),
        ("rate = " + 3000 * "[" + 3000 * "]", "scene.toml"),
    ],
)
def test_what_is_wrong_is_named(tmp_path, text, message):
    path = written(tmp_path, text)
    with pytest.raises(SceneError, match=r"scene\.toml") as caught:
        read_scene(path)
    assert message in str(caught.value)


def test_run_answers_from_the_command_line(tmp_path, capsys):
    path = written(tmp_path, TEXT)
    out = ["--out", str(tmp_path / "report"), "--json"]
    assert main(["run", str(path), "--tolerance", "1e-3", *out]) == 0
    values = json.loads(capsys.readouterr().out)
    assert values["model"] == "prediction"
    assert values["met"]
    assert main(["run", str(path), "--tolerance", "1e-2", "--motion", "--frames", "3", *out]) == 0
    moved = json.loads(capsys.readouterr().out)
    assert abs(moved["value"] - values["value"]) < 1e-2
    assert len(moved["motion"]["angle"]) == len(moved["motion"]["height"])
    assert (tmp_path / "report" / "run-motion.png").exists()
    assert main(["run", str(tmp_path / "none.toml"), *out]) == 1
    assert "none.toml" in capsys.readouterr().err
