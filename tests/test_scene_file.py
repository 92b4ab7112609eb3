import json
import re

import numpy as np
import pytest

from compare.__main__ import main
from ribbonfem import Drive, Ribbon, Scene, SceneError, Schedule
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


RIG = """
drive = "both"
gravity = [0, 0, -1.0]

[preset]
lift = 0.01

[schedule]
time = [0, 1, 3]
value = [0, 0.1, 0.4]
kind = "linear"

[ribbon]
curvature = [0.0, 1.0]
twist = 0.1
retardation = 0.01
"""


def test_a_file_says_any_rig(tmp_path):
    assert read_scene(written(tmp_path, RIG)) == Scene(
        drive=Drive(left=1, right=1),
        gravity=(0, 0, -1),
        preset={"lift": 0.01},
        schedule=Schedule((0, 1, 3), (0, 0.1, 0.4), "linear"),
        ribbon=Ribbon(curvature=(0, 1), twist=0.1, retardation=0.01),
    )
    table = read_scene(written(tmp_path, "[drive]\nleft = 1\ntwist_right = 0.5"))
    assert table == Scene(drive=Drive(left=1, twist_right=0.5))


def test_a_file_names_measured_values_beside_it(tmp_path):
    (tmp_path / "alpha.csv").write_text("t (ms);angle\n10;0.0\n1010;5.729577951308232\n2010;20\n")
    text = "[schedule]\nfile = 'alpha.csv'\ntime = 't (ms)'\nvalue = 'angle'\nunits = ['ms', 'deg']"
    schedule = read_scene(written(tmp_path, text)).schedule
    assert schedule.time == pytest.approx((0, 1, 2))
    assert schedule.value == pytest.approx((0, 0.1, 0.3490658504))
    for wrong, message in [
        (text.replace("'angle'", "'phi'"), "no column 'phi'; there are t (ms), angle"),
        (text.replace("'deg'", "'degrees'"), "'degrees' is none of rad, deg"),
        ("schedule = 3", "a table is needed"),
        ("[schedule]\ntime = [0, 1]", "schedule.value: is missing"),
        ("[schedule]\ntime = [0, 1]\nvalue = [0, 1]\nspeed = 1", "schedule.speed = 1: not a key"),
        ("[drive]\nup = 1", "'up' is no control"),
    ]:
        with pytest.raises(SceneError, match=re.escape(message)):
            read_scene(written(tmp_path, wrong))
    (tmp_path / "alpha.csv").write_text("0,0\n1,no\n")
    with pytest.raises(SceneError, match=r"row 2: 'no' is no finite number"):
        read_scene(written(tmp_path, "[schedule]\nfile = 'alpha.csv'"))


def test_a_smooth_schedule_has_two_derivatives_and_overshoots_nowhere():
    rng = np.random.default_rng(5)
    for _ in range(20):
        time = np.concatenate(([0.0], np.cumsum(rng.uniform(0.1, 1.0, 8))))
        value = np.cumsum(rng.normal(size=9)) * rng.choice([0.1, 1.0])
        s = Schedule(tuple(time), tuple(value))
        at = np.linspace(0.0, time[-1], 4001)
        inside = np.clip(np.searchsorted(time, at, side="right") - 1, 0, 7)
        low, high = np.minimum(value[inside], value[inside + 1]), np.maximum(value[inside], value[inside + 1])
        assert (s(at) >= low - 1e-9).all()
        assert (s(at) <= high + 1e-9).all()
        assert s(time) == pytest.approx(value, abs=1e-12)
        for left, right, length in zip(s.pieces[:-1], s.pieces[1:], np.diff(time)[:-1], strict=True):
            for order in range(3):
                end = np.polyval(np.polyder(left[::-1], order), length)
                assert end == pytest.approx(np.polyval(np.polyder(right[::-1], order), 0.0), abs=1e-8)


def test_a_motors_ramp_keeps_its_speed_and_acceleration():
    s = Schedule.ramp(0.5, 1.4, 2.0)
    at = np.linspace(0.0, s.time[-1], 20001)
    speed = np.gradient(s(at), at)
    assert speed.max() == pytest.approx(0.5, abs=1e-6)
    assert np.abs(np.gradient(speed, at)).max() == pytest.approx(2.0, rel=1e-3)
    assert s(s.time[-1]) == 1.4
    # too short a way for the full speed
    short = Schedule.ramp(10.0, 0.1, 2.0)
    speed = np.gradient(short(np.linspace(0, short.time[-1], 20001)), short.time[-1] / 20000)
    assert speed.max() < 10.0
    assert np.abs(np.gradient(speed, short.time[-1] / 20000)).max() == pytest.approx(2.0, rel=2e-3)
