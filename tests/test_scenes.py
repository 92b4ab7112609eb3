"""The scene files that are shipped: listed, written, read, and run."""

import json
import re
from dataclasses import fields
from importlib.resources import files

import pytest

from compare.__main__ import main
from compare.commands.run import NOT_MET, SENSITIVE
from compare.commands.scenes import MOVIES, NAMES, text, titles, write
from ribbonfem import Scene, SceneError
from ribbonfem.output.scene_file import read_scene

# the angle of the snap, rad, None where it does not snap; and the exit status of `run`
SNAPS = {
    "planar-snap": (1.1595, 0),
    "path-1": (0.6064, 0),
    "path-2": (0.6106, 0),
    "skipping-type-1": (0.2468, 0),
    "skipping-type-2": (0.6000, 0),
    "selection": (None, 0),
}


def test_the_list_is_what_lies_in_the_folder():
    lying = {path.name for path in (files("compare") / "examples").iterdir() if path.name.endswith(".toml")}
    assert {name.removesuffix(".toml") for name in lying} == set(NAMES)
    assert set(titles()) == {*NAMES, *MOVIES}


@pytest.mark.parametrize("name", NAMES)
def test_a_shipped_file_is_a_scene_with_every_field_and_its_unit(name, tmp_path):
    (path,) = write([name], tmp_path)
    scene = read_scene(path)
    assert scene.stop is not None
    for field in fields(Scene):
        if field.name not in ("ribbon", "schedule", "preset", "gravity"):
            assert re.search(rf"^{field.name} = \S+ +# \S", text(name), re.MULTILINE), field.name
    assert max(map(len, text(name).splitlines())) <= 110


def test_the_films_of_the_paper_go_by_their_names(tmp_path):
    for movie, scene in MOVIES.items():
        (path,) = write([movie], tmp_path)
        assert path.name == f"{movie}.toml"
        assert read_scene(path) == read_scene(write([scene], tmp_path)[0])
    assert text("Movie-S2") == text("path-1")


@pytest.mark.parametrize("name", SNAPS)
def test_a_shipped_file_runs(name, tmp_path, capsys):
    (path,) = write([name], tmp_path)
    value, status = SNAPS[name]
    assert main(["run", str(path), "--out", str(tmp_path / "report"), "--json"]) == status
    result = json.loads(capsys.readouterr().out)["value"]
    assert result is None if value is None else abs(result - value) < 1e-3


def test_the_band_of_mixed_outcomes_is_called_what_it_is(tmp_path, capsys):
    (path,) = write(["mixed-outcomes"], tmp_path)
    status = main(["run", str(path), "--out", str(tmp_path / "report"), "--json"])
    # how far refinement gets hangs on the last digit too
    assert status in (SENSITIVE, NOT_MET)
    capsys.readouterr()


def test_the_command_lists_writes_and_overwrites_nothing(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["scenes"]) == 0
    listed = capsys.readouterr().out
    assert all(name in listed for name in NAMES)
    assert main(["scenes", "--json"]) == 0
    assert [row["name"] for row in json.loads(capsys.readouterr().out)] == [*NAMES, *MOVIES]
    assert not list(tmp_path.iterdir())
    assert main(["scenes", "path-2.toml", "path-2"]) == 0
    assert "run it: ribbonfem run path-2.toml" in capsys.readouterr().out
    (tmp_path / "path-2.toml").write_text("mine", encoding="utf-8")
    assert main(["scenes", "path-1", "path-2"]) == 1
    assert "path-2.toml: the file exists" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["path-2.toml"]
    assert (tmp_path / "path-2.toml").read_text(encoding="utf-8") == "mine"
    assert main(["scenes", "--out", "all", "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)
    assert [read_scene(row["file"]).compression for row in rows]
    assert sorted(path.stem for path in (tmp_path / "all").iterdir()) == sorted([*NAMES, *MOVIES])


def test_a_name_that_is_none_is_told_with_the_nearest(capsys):
    with pytest.raises(SceneError, match="perhaps 'path-1' is meant"):
        text("path1")
    assert main(["scenes", "planar"]) == 1
    assert "there are planar-snap, path-1" in capsys.readouterr().err
    with pytest.raises(SystemExit):
        main(["scenes", "--help"])
    told = capsys.readouterr().out
    assert "--out" in told
    assert "--json" in told
