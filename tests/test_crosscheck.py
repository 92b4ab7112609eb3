import json
import subprocess
import sys
import time

import numpy as np
import pytest

from compare.__main__ import main
from compare.commands import crosscheck
from compare.report.folder import PAGE, write_section
from compare.report.registry import ORDER, publish
from compare.report.section import Section, Table


@pytest.fixture(scope="module")
def section(tmp_path_factory):
    out = tmp_path_factory.mktemp("report")
    result = crosscheck.main(compressions=(0.05, 0.4), elements=32, nodes=41)
    return publish(crosscheck.COMMAND, result, out)[0], out / PAGE


def test_every_model_is_near_the_closed_form(section):
    records = section[0].values["folds"]
    assert {r["model"] for r in records} >= {"closed form", "beam FEM", "elastica FEM", "DER", "DER, limit"}
    for record in records:
        if record["model"] == "beam FEM":
            assert abs(record["sigma_error"]) < 4e-6
        # the curves collapse in mu, to 0.5 %
        assert abs(record["mu_error"]) < 5e-3
    limits = {(r["compression"], r["model"]): r["angle"] for r in records}
    for compression in (0.05, 0.4):
        assert abs(limits[compression, "DER, limit"] - limits[compression, "elastica FEM, EA"]) < 5e-6


def test_a_ribbon_snaps_alike_in_both_models(section):
    snaps = {row["model"]: row["difference"] for row in section[0].values["snaps"]}
    # the extrapolation of the rods is good to some 1e-5 there
    assert abs(snaps["Kirchhoff, 8 elements"]) < 2e-5
    assert abs(snaps["DER, N = 101"]) > 1e-4


def test_report_is_self_contained(section):
    text = section[1].read_text(encoding="utf-8")
    assert "data:image/png;base64," in text
    assert 'src="crosscheck' not in text
    assert "closed form" in text
    json.dumps(section[0].values)


def test_sections_add_up(tmp_path):
    table = Table("t", ["a", "b"], [["x", 1.5], ["y", None]], ["s", ".2f"])
    write_section(Section("crosscheck", "First", ["one"], [table]), tmp_path, ORDER)
    write_section(Section("delay", "Second", ["two <3"], []), tmp_path, ORDER)
    report = (tmp_path / PAGE).read_text(encoding="utf-8")
    assert report.index("First") < report.index("Second")
    assert "two &lt;3" in report
    assert "<td>–</td>" in report


def test_command_line_help_is_light():
    begin = time.process_time()
    done = subprocess.run(
        [sys.executable, "-X", "importtime", "-m", "compare", "--help"], capture_output=True, text=True
    )
    assert done.returncode == 0
    assert "crosscheck" in done.stdout
    for heavy in ("numpy", "scipy", "numba", "skfem", "matplotlib", "rich"):
        assert f" {heavy}\n" not in done.stderr, f"{heavy} is imported on the way to --help"
    assert time.process_time() - begin < 5.0


def test_command_line_json_and_errors(tmp_path, capsys, monkeypatch):
    # (the numbers of a motion are the other tests')
    monkeypatch.setattr(crosscheck, "SNAP_NODES", (21, 41))
    command = ["crosscheck", "--out", str(tmp_path), "--json", "--processes", "1"]
    assert main([*command, "--compressions", "0.3", "--elements", "16", "--nodes", "21"]) == 0
    values = json.loads(capsys.readouterr().out)
    assert np.isclose(values["closed_form"]["sigma"], 7.5864, atol=1e-4)
    assert (tmp_path / "report.html").exists()
    assert main([*command, "--compressions", "1.5"]) == 1
    said = capsys.readouterr().err
    assert "compression" in said
    assert "Traceback" not in said
