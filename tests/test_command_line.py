"""The command line and the report as a stranger meets them: spoilt files, closed pipes, odd folders."""

import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from compare.__main__ import main
from compare.archive import load, save
from compare.models import MODELS
from compare.report import folder as report
from compare.report.registry import ORDER, Command, first_line, named, publish
from compare.report.section import Drawing, Picture, Section, Table
from compare.sweep import progress
from ribbonfem.output.scene_file import read_scene
from ribbonfem.output.style import figure

ROOT = Path(__file__).parents[1]
SCENE = 'compression = 0.40\nshear = 0.0\nstart = "U+"\nrate = 0.1\nstop = 1.4\n'
COMMAND = [sys.executable, "-m", "compare"]


def command(*words, environment=(), **more):
    surroundings = {**os.environ, "PYTHONPATH": str(ROOT), **dict(environment)}
    return subprocess.Popen(
        [*COMMAND, *map(str, words)], env=surroundings, stdout=subprocess.PIPE, stderr=subprocess.PIPE, **more
    )


def section(name="crosscheck", title="A title", **more):
    table = Table("t", ["a", "b"], [["x", 1.5], ["y", None]], ["s", ".2f"])
    return Section(name, title, ["one <script>alert(1)</script>"], [table], values={"n": 1}, **more)


@pytest.fixture
def scene(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(SCENE, encoding="utf-8")
    return path


def spoilt():
    """Contents that are no section, of all kinds."""
    rng = random.Random(7)
    good = json.dumps({"name": "delay", "title": "t", "text": [], "tables": [], "pictures": [], "values": {}})
    yield from ("", "{}", "[]", "null", "3", '"text"', good[:20], good[:-1], "\x00\x01", "{" * 5000)
    yield good.replace('"name": "delay"', '"name": "folds"')
    yield good.replace('"text": []', '"text": [1]')
    yield good.replace('"text": []', '"text": "no list"')
    yield good.replace('"tables": []', '"tables": [{"title": "t"}]')
    table = '{"title": "t", "columns": ["a"], "rows": [[[]]], "formats": ["d"], "note": ""}'
    yield good.replace('"tables": []', f'"tables": [{table}]')
    yield good.replace('"pictures": []', '"pictures": [{"file": 3, "caption": "c"}]')
    yield good.replace('"values": {}', '"values": 3, "more": 1')
    for _ in range(60):
        yield "".join(chr(rng.randrange(1, 0x2FF)) for _ in range(rng.randrange(1, 200)))


@pytest.mark.parametrize("content", list(spoilt()))
def test_a_spoilt_section_is_named_and_left_out(tmp_path, content):
    (tmp_path / "delay.json").write_text(content, encoding="utf-8")
    _, left_out = report.write_section(section(), tmp_path, ORDER)
    assert list(left_out) == ["delay.json"]
    page = (tmp_path / report.PAGE).read_text(encoding="utf-8")
    assert "Left out: delay.json" in page
    assert "A title" in page


def test_binary_junk_is_left_out_too(tmp_path):
    (tmp_path / "delay.json").write_bytes(os.urandom(300))
    (tmp_path / "cases.json").mkdir()
    _, left_out = report.write_section(section(), tmp_path, ORDER)
    assert set(left_out) == {"delay.json", "cases.json"}


def test_what_a_section_says_is_text_and_its_pictures_are_its_own(tmp_path):
    outside = tmp_path / "secret.png"
    outside.write_bytes(b"secret")
    folder = tmp_path / "report"
    folder.mkdir()
    (folder / "link.png").symlink_to(outside)
    pictures = [
        Picture(name, "<b>caption</b>") for name in ("../secret.png", str(outside), "link.png", "none.png")
    ]
    report.write_section(section(title="<i>t</i>", pictures=pictures), folder, ORDER)
    page = (folder / report.PAGE).read_text(encoding="utf-8")
    for raw in ("<script>", "<i>", "<b>", "data:image"):
        assert raw not in page
    assert "&lt;script&gt;" in page


def test_numbers_are_written_before_pictures(tmp_path):
    def drawings():
        assert json.loads((tmp_path / "crosscheck.json").read_text(encoding="utf-8"))["values"] == {"n": 1}
        yield Drawing("crosscheck-a.png", "first", figure(1)[0])
        raise OSError(28, "No space left on device")

    with pytest.raises(OSError, match="No space"):
        report.write_section(section(), tmp_path, ORDER, drawings())
    assert json.loads((tmp_path / "crosscheck.json").read_text(encoding="utf-8"))["values"] == {"n": 1}
    assert not [path for path in tmp_path.iterdir() if path.name.startswith(".")]


def test_folders_that_cannot_be_are_told_before_anything_is_computed(tmp_path, scene, capsys, monkeypatch):
    blocked = tmp_path / "file"
    blocked.write_text("in the way", encoding="utf-8")

    def never(*_, **__):
        raise AssertionError("it was computed for")

    monkeypatch.setattr(Command, "section", never)
    for out in (blocked, blocked / "below", "/proc/report", "/dev/null/x"):
        assert main(["run", str(scene), "--out", str(out), "--quiet"]) == 1
        said = capsys.readouterr().err
        assert str(out) in said
        assert len(said.splitlines()) == 1
    usage = shutil.disk_usage(tmp_path)._replace(free=1000)
    monkeypatch.setattr(shutil, "disk_usage", lambda _: usage)
    assert main(["run", str(scene), "--out", str(tmp_path / "full"), "--quiet"]) == 1
    assert "are needed" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "status", "said"),
    [
        (["crosschek"], 2, "did you mean 'crosscheck'?"),
        (["xyz"], 2, "is no command"),
        (["--version"], 0, "ribbonfem"),
        (["cases", "--only", "all-of-it"], 2, "invalid choice"),
        (["skipping", "--rates", "1"], 2, "LOW:HIGH:COUNT"),
        (["crosscheck", "--compressions", "a,b"], 2, "numbers are needed, with commas"),
        (["crosscheck", "--processes", "0"], 2, "at least 1"),
        (["run"], 2, "SCENE.toml"),
        (["report", "--out", "/nowhere/at/all"], 1, "no such folder"),
        (["threshold", "x.toml"], 2, "--between"),
    ],
)
def test_slips_are_answered_in_a_sentence(words, status, said, capsys):
    try:
        result = main(words)
    except SystemExit as stopped:
        result = stopped.code
    told = capsys.readouterr()
    assert result == status
    assert said in told.out + told.err
    assert "Traceback" not in told.err


def test_the_exit_status_of_run_says_how_it_went(tmp_path, scene, capsys):
    out = ["--out", str(tmp_path / "report"), "--json"]
    assert main(["run", str(scene), *out]) == 0
    (tmp_path / "bad.toml").write_text("compression = 2", encoding="utf-8")
    assert main(["run", str(tmp_path / "bad.toml"), *out]) == 1
    capsys.readouterr()


@pytest.mark.parametrize("name", ORDER)
def test_every_question_says_what_it_is_and_how_long_it_takes(name, capsys):
    assert len(first_line(name)) > 20
    command = named(name)
    assert command.name == name
    with pytest.raises(SystemExit):
        main([name, "--help"])
    told = capsys.readouterr().out
    assert command.takes.split(",")[0] in " ".join(told.split())
    for option in ("--out", "--json", "--quiet"):
        assert option in told


@pytest.mark.parametrize(
    ("dL", "shear", "start", "rate"),
    [(0.3, 0.0, "U+", 1.0), (0.4, 0.37, "U+S+", -1.0), (0.4, 0.37, "U-S-", -1.0), (0.4, 0.4, "U+S+", 0.3)],
)
def test_a_motion_without_a_stop_goes_on_to_rest_on_a_curve_that_is_shown(dL, shear, start, rate, tmp_path):
    text = f'compression = {dL}\nshear = {shear}\nstart = "{start}"\nrate = {rate}\ndamping = 8.0\n'
    path = tmp_path / "s.toml"
    path.write_text(text, encoding="utf-8")
    result = named("run").main(path, motion=True, tolerance=1e-2)
    history, curve = result.answer.history, result.curve
    folds = MODELS[history.model].folds(read_scene(path))
    last = abs(float(history.angle[-1]))
    met = [abs(fold.angle) for fold in folds if abs(fold.angle) < 2.0 * np.pi]
    past = last - max(*met, abs(result.answer.value))
    assert 0.05 < past < 0.2
    assert history.energies["kinetic"][-1] < 1e-5 * history.energies["kinetic"].max()
    # the state at the end lies on the curve behind the film
    near = np.hypot(curve.angle - history.angle[-1], 10.0 * (curve.height - history.height[-1]))
    k = int(np.nanargmin(np.where(curve.stable, near, np.nan)))
    rows = [j for j in (k - 1, k, k + 1) if 0 <= j < len(near) and np.isfinite(near[j])]
    order = sorted(rows, key=lambda j: curve.angle[j])
    at = np.interp(history.angle[-1], curve.angle[order], curve.height[order])
    assert at == pytest.approx(float(history.height[-1]), abs=3e-3)


@pytest.mark.parametrize(
    ("quantity", "motion", "unit"),
    [("fold", False, "L"), ("first snap", True, "L"), ("snap", False, "L"), ("snap time", False, "s")],
)
def test_a_control_that_is_no_angle_is_told_in_its_unit(quantity, motion, unit, tmp_path):
    text = 'compression = 0.4\ndrive = "lift"\nrate = 0.1\ndamping = 2.0\n'
    if quantity == "first snap":
        text += 'shear = 0.37\nstart = "U+S+"\nstop = 0.06\n'
    else:
        text += 'shear = 0.0\nstart = "U+"\nstop = 0.3\n[preset]\nleft = 0.8\ntwist_left = 0.01\n'
    path = tmp_path / "lift.toml"
    path.write_text(text, encoding="utf-8")
    command = named("run")
    result = command.main(path, motion=motion, quantity=quantity, tolerance=1e-3, frames=2)
    publish(command, result, tmp_path)
    (told, _) = command.summary(result)
    value = result.answer.value
    assert f"{quantity} at {value:.7f} {unit}, to" in told
    assert result.answer.unit == result.choice.unit == unit
    if motion:
        shown = command.values(result)["motion"]
        assert shown["control"] == result.answer.history.control.tolist()
        assert "angle" not in shown


def test_pictures_drawn_again_from_what_was_found_are_identical(tmp_path, scene, capsys):
    words = ["run", str(scene), "--motion", "--frames", "3", "--tolerance", "1e-2", "--quiet"]
    words += ["--out", str(tmp_path)]
    assert main(words) == 0
    kept = {path.name: path.read_bytes() for path in tmp_path.glob("run*.*")}
    page = (tmp_path / report.PAGE).read_bytes()
    assert {"run.json", "run.result", "run-motion.png"} <= set(kept)
    for name in ("run.json", "run-motion.png", report.PAGE):
        (tmp_path / name).unlink()
    assert main(["report", "--redraw", "--out", str(tmp_path)]) == 0
    assert {path.name: path.read_bytes() for path in tmp_path.glob("run*.*")} == kept
    assert (tmp_path / report.PAGE).read_bytes() == page
    (tmp_path / "run.result").write_bytes(b"spoilt")
    assert main(["report", "--redraw", "--out", str(tmp_path)]) == 0
    assert "run.result" in capsys.readouterr().err


def test_what_was_found_is_read_back_whole(tmp_path, scene):
    command = named("run")
    result = command.main(scene, motion=True, frames=3, tolerance=1e-2)
    publish(command, result, tmp_path)
    again = load(tmp_path / "run.result")
    assert command.values(again) == command.values(result)
    assert again.answer.history == result.answer.history
    assert load(save(result.answer.history, tmp_path / "history")) == result.answer.history


def test_a_closed_pipe_is_one_line(tmp_path, scene):
    process = command("run", scene, "--out", tmp_path / "report", "--json")
    process.stdout.close()
    said = process.stderr.read().decode()
    assert process.wait(timeout=60) == 1
    assert "the output was closed" in said
    assert "Traceback" not in said
    assert (tmp_path / "report" / "run.json").exists()


def test_an_interrupt_is_one_line_and_keeps_what_is_finished(tmp_path):
    # far more runs than end between two looks at the folder, on any machine
    grid = ("--rates", "0.2:2:20", "--dampings", "1:10:20", "--nodes", "31", "--processes", "2")
    # a shell has its background jobs ignore interrupts, and their children would too
    listening = {
        "start_new_session": True,
        "preexec_fn": lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    }
    process = command("skipping", *grid, "--out", tmp_path, "--quiet", **listening)
    kept = tmp_path / ".finished" / "skipping"
    while process.poll() is None and len(list(kept.rglob("*.result"))) < 2:
        time.sleep(0.02)
    os.killpg(process.pid, signal.SIGINT)
    said = process.communicate(timeout=30)[1].decode()
    assert process.returncode == 130, said
    assert "what is finished is kept" in said
    assert len([line for line in said.splitlines() if line.strip()]) == 1, said
    assert len(list(kept.rglob("*.result"))) >= 2


def test_time_left_goes_by_cost_and_not_by_number():
    bar = progress.Progress(visible=False).bar("x", 3, 100.0)
    for cost in (90.0, 5.0):
        bar.advance(cost)
    assert (bar.done, bar.spent) == (2, 95.0)
    assert progress._clock(3725) == "1:02:05"
