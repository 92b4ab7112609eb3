"""The paper's figures and claims: data beside what is drawn, known numbers, verdicts that follow the data."""

import csv
import io
import json
import math
from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np
import pytest

from compare.__main__ import main as command
from compare.archive import from_bytes, to_bytes
from compare.diagrams import diagram, selection_diagram, skipping_diagram
from compare.diagrams.report import Diagrams
from compare.report.registry import publish
from compare.reproduction.cases import settle
from compare.reproduction.delays import Cell, Delays, rates_for
from compare.reproduction.figures import axes as panels
from compare.reproduction.figures import command as figures
from compare.reproduction.figures import main
from compare.reproduction.figures.claims import CHOICES, CLAIMS
from compare.reproduction.figures.in_motion import SCALED, Bound, Motion, Moved, Settled, _turns
from compare.reproduction.figures.result import Figures
from compare.reproduction.figures.verdict import CORRECTED, NO, NOT_ASKED, OPEN, YES
from compare.reproduction.named_runs import CASES
from compare.sweep import Sweep
from ribbonfem.delay import NormalForm
from ribbonfem.output.curve import Curve

CURVE = Curve(np.linspace(0.0, 1.0, 5), np.linspace(0.2, 0.1, 5), np.ones(5, dtype=bool), ())
BOUNDS = (Bound(0.40, 0.5, 0.5), Bound(0.35, 2.6, 2.6))
AT_REST = ("fig2", "fig3", "fig4", "fig15")


@pytest.fixture(scope="module")
def rest():
    with Sweep(processes=1) as sweep:
        return main(only=AT_REST, sweep=sweep)


def verdicts(result, start=""):
    """Verdict by what the paper says, of the claims of a figure."""
    return {claim.says: v for claim, v in figures.judgements(result) if claim.figure.startswith(start)}


def test_known_numbers(rest):
    assert rest.planar.closed == pytest.approx(
        (7.58637843107431, 1.78177604115671, 0.347601404327922), abs=1e-12
    )
    by = {fold.compression: fold for fold in rest.planar.folds}
    assert by[0.40].plain[1] * math.sqrt(0.40) == pytest.approx(1.1230897421, abs=2e-8)
    assert by[0.40].stretched[1] * math.sqrt(0.40) == pytest.approx(1.1227538843, abs=2e-8)
    assert by[0.20].plain[2] * math.sqrt(0.20) == pytest.approx(0.1415531710, abs=1e-8)
    assert by[0.40].rods[1] == pytest.approx(by[0.40].stretched[1], abs=1e-5)
    # Path 2 at (0.40, 0.37), elements without and with EA, and Path 1
    assert [fold.angle for fold in rest.ribbons.path_2.plain] == pytest.approx(
        [0.06588767, 0.56920527], abs=1e-7
    )
    assert rest.ribbons.path_1.plain[0].angle == pytest.approx(0.56920527, abs=1e-7)


def test_shapes_of_both_models_lie_on_each_other(rest):
    shots = {(shot.path, shot.model): [] for shot in rest.snapshots}
    for shot in rest.snapshots:
        shots[shot.path, shot.model].append(shot)
    assert [shot.said for shot in shots[2, "kirchhoff"] if not shot.moving] == ["U+S+", "U+S-", "U-S+"]
    for path in (1, 2):
        for one, two in zip(shots[path, "kirchhoff"], shots[path, "der"], strict=True):
            assert np.abs(one.centre - two.centre).max() < 5e-3
            across = np.linalg.norm(one.edges[0] - one.edges[1], axis=-1)
            assert across == pytest.approx(0.2, abs=1e-9)


def test_verdicts_of_what_lies_at_rest(rest):
    said = verdicts(rest)
    assert said["A planar beam turned at one end snaps at one fold."].verdict == YES
    collapse = said["Rescaled by the root of dL/L, all compressions fall on one curve."]
    assert collapse.verdict == CORRECTED
    assert "mu within 0.34 %, Z within 18.9 %" in collapse.number
    assert "+8.3 % off" in said["Theory and discrete rods agree."].correction
    assert said["The second snap of Path 2 is that of Path 1."].verdict == YES
    assert said["Compression and shear give three phases: U, US and S."].verdict == NOT_ASKED
    assert NO not in {verdict.verdict for verdict in said.values()}


def test_verdicts_follow_spoilt_data(rest):
    planar = rest.planar
    bad = replace(rest, planar=replace(planar, closed=(7.5, *planar.closed[1:])))
    assert verdicts(bad)[CLAIMS[0].says].verdict == NO
    two = tuple(replace(fold, count=2) for fold in planar.folds)
    assert verdicts(replace(rest, planar=replace(planar, folds=two)), "fig3")[CLAIMS[1].says].verdict == NO
    far = tuple(
        replace(fold, plain=(fold.plain[0], 1.1 * fold.plain[1], fold.plain[2])) for fold in planar.folds
    )
    assert verdicts(replace(rest, planar=replace(planar, folds=far)), "fig3")[CLAIMS[2].says].verdict == NO
    paths = rest.ribbons
    single = replace(rest, ribbons=replace(paths, path_2=replace(paths.path_2, plain=paths.path_2.plain[:1])))
    said = verdicts(single, "fig4")
    assert said["Path 2, U+S+ to U+S- to U-S+, has two folds."].verdict == NO
    assert said["The second snap of Path 2 is that of Path 1."].verdict == NO
    near = replace(paths, two_node=tuple(fold.angle for fold in paths.path_2.stretched))
    assert verdicts(replace(rest, ribbons=near))["Theory and discrete rods agree."].verdict == YES
    fewer = replace(rest.states, stable=(("U+",), ("U+",)))
    assert (
        verdicts(replace(rest, states=fewer))["At (0.40, 0.37) there are four stable states."].verdict == NO
    )


FORM, DAMPINGS = NormalForm(angle=1.0, product=2.4e5), (1e-3, 1.0, 1e2, 1e3)


def f_of(ratio):
    """A curve with the limits of the universal one, at no cost."""
    return (3.41167**3 + (2.33811 * ratio ** (2.0 / 3.0)) ** 3) ** (1.0 / 3.0)


def cells_of(law):
    """Delays that are a law's share of the predicted ones, for the planar systems."""
    made = []
    for name in SCALED["fig7"]:
        for damping in DAMPINGS:
            for rate in rates_for(damping, 5):
                tau = (FORM.product * rate) ** -0.2
                late = rate * tau * f_of(damping * tau)
                made.append(Cell(name, damping, rate, damping * tau, late, late * law(rate, damping), 0.0))
    return Delays({name: FORM for name in SCALED["fig7"]}, DAMPINGS, tuple(made))


def test_verdicts_of_delays_are_of_their_limit():
    def true(rate, damping):
        return 1.0 - 0.2 * rate ** (0.2 if damping < 5.0 else 1.0 / 3.0)

    result = Figures(chosen=("fig7",), delays=cells_of(true))
    said = verdicts(result, "fig7")
    assert NO not in {v.verdict for v in said.values()}
    assert said["Overdamped, the delay goes as nu^(2/3)."].verdict == YES
    assert said["There are two regimes, Lambda << 1 and Lambda >> 1."].verdict == YES
    assert "the other way round" in said["The time delay goes as rate^(-1/5) and rate^(-1/3)."].correction
    off = verdicts(Figures(chosen=("fig7",), delays=cells_of(lambda *_: 0.9)), "fig7")
    for says in (
        "Underdamped, the angle delay goes as rate^(4/5).",
        "Overdamped, the angle delay goes as rate^(2/3).",
    ):
        assert off[says].verdict == NO
    other = cells_of(lambda rate, damping: rate**0.1 * damping**0.2)
    assert (
        verdicts(Figures(chosen=("fig7",), delays=other))["Overdamped, the delay goes as nu^(2/3)."].verdict
        == NO
    )
    few = replace(result, delays=replace(result.delays, cells=result.delays.cells[:1]))
    assert verdicts(few)["Underdamped, the angle delay goes as rate^(4/5)."].verdict == OPEN
    data = figures.motion.scaling(result.delays)
    assert len(data.panels) == 3
    plt.close(panels.draw(data))


@pytest.fixture(scope="module")
def maps():
    grid = ((0.03, 1.0, 2), (0.1, 10.0, 2))
    asked = {"nodes": 51, "samples": 1, "boundaries": False, "tolerance": 1e-3}
    with Sweep(processes=1) as sweep, pytest.MonkeyPatch.context() as patch:
        # the curve that needs no run takes longer than the runs
        patch.setattr(diagram, "predictions", lambda *_: {})
        skipping = [skipping_diagram(value, 0.40, *grid, sweep=sweep, **asked) for value in (0.40, 0.35)]
        one = selection_diagram(0.40, 0.40, 0.36, *grid, sweep=sweep, **asked)
    # the second is that of damping alone
    shares = np.zeros_like(one.shares)
    shares[0, :, one.outcomes.index("U-S+")] = shares[1, :, one.outcomes.index("U+S-")] = 1.0
    selection = one, replace(one, shares=shares)
    return Figures(
        chosen=("fig11", "fig14"),
        skipping=Diagrams(tuple(skipping)),
        selection=Diagrams(selection),
    )


def test_verdicts_of_diagrams(maps):
    said = verdicts(maps)
    assert said["Type 2 is of fast ramps."].verdict == YES
    assert said["A line in rate and damping separates U+S- from U-S+."].verdict == YES
    one = maps.skipping.diagrams[0]
    shares = np.zeros_like(one.shares)
    shares[..., one.outcomes.index("no skip")] = 1.0
    dull = replace(one, shares=shares, outcome=np.full(one.outcome.shape, "no skip", dtype="<U10"))
    bad = replace(maps, skipping=Diagrams((dull, dull)))
    assert verdicts(bad, "fig11")["Type 2 is of fast ramps."].verdict == NO
    mixed = np.full(one.outcome.shape, "mixed", dtype="<U10")
    loose = replace(
        maps, selection=Diagrams(tuple(replace(d, outcome=mixed) for d in maps.selection.diagrams))
    )
    line = verdicts(loose, "fig14")["A line in rate and damping separates U+S- from U-S+."]
    assert line.verdict == CORRECTED
    assert "in 8 cells" in line.correction


def test_a_diagrams_table_has_its_shares(maps):
    for data in figures.all_figures(maps):
        plt.close(panels.draw(data))
        rows = list(csv.DictReader(io.StringIO(panels.to_csv(data))))
        shares = [float(row["z"]) for row in rows if row["series"].startswith("share of ")]
        every = [d.shares for d in (maps.skipping if data.name == "fig11" else maps.selection).diagrams]
        assert sum(shares) == pytest.approx(sum(float(np.nansum(s)) for s in every))


def test_the_table_beside_a_figure_is_what_is_drawn(rest):
    for data in figures.all_figures(rest):
        rows = list(csv.DictReader(io.StringIO(panels.to_csv(data))))
        drawn = panels.draw(data)
        shown = [panel for panel in data.panels if panel.series]
        assert len(drawn.axes) == len(shown)
        for axes, panel in zip(drawn.axes, shown, strict=True):
            mine = [row for row in rows if row["panel"] == panel.title]
            assert {row["x_axis"] for row in mine} == {axes.get_xlabel()}
            lines = [s for s in panel.series if s.look != "strip"]
            assert len(axes.lines) == len(lines)
            for line, series in zip(axes.lines, lines, strict=True):
                kept = [row for row in mine if row["series"] == series.name]
                written = np.array([[float(row[k] or "nan") for k in "xy"] for row in kept])
                same = [s for s in panel.series if s.name == series.name]
                assert len(kept) == sum(len(s.x) for s in same)
                if len(same) == 1:
                    assert np.allclose(written.T, line.get_data(), rtol=1e-7, atol=1e-12, equal_nan=True)
        plt.close(drawn)


def test_figures_are_written_and_drawn_again_alike(rest, tmp_path):
    small = replace(rest, chosen=("fig4",))
    section, left_out = publish(figures.COMMAND, small, tmp_path)
    assert not left_out
    names = {f"fig4.{kind}" for kind in ("png", "pdf", "csv")}
    kept = {path.name: path.read_bytes() for path in (tmp_path / "figures").iterdir()}
    assert set(kept) == names
    assert 'src="data:image/png' in (tmp_path / "report.html").read_text(encoding="utf-8")
    for path in (tmp_path / "figures").iterdir():
        path.unlink()
    (tmp_path / "figures.json").unlink()
    assert command(["report", "--redraw", "--out", str(tmp_path)]) == 0
    assert {path.name: path.read_bytes() for path in (tmp_path / "figures").iterdir()} == kept
    assert json.loads((tmp_path / "figures.json").read_text(encoding="utf-8"))["values"] == section.values
    # the others are drawn from what is kept as well
    whole = to_bytes(rest)
    assert to_bytes(from_bytes(whole)) == whole


def test_every_claim_stands_with_its_command(rest):
    assert len({claim.says for claim in CLAIMS}) == len(CLAIMS) > 40
    assert {claim.figure for claim in CLAIMS} >= set(figures.NAMES) - {"fig2"}
    assert all(len(row) == 3 for row in CHOICES)
    rows = [row for table in figures.tables(rest)[:-1] for row in table.rows]
    assert len(rows) == sum(claim.figure in AT_REST for claim in CLAIMS)
    assert all(row[-1].startswith("ribbonfem figures --only fig") and row[3] for row in rows)
    assert "were not asked" in figures.summary(rest)[0]


def test_only_is_of_the_figures(tmp_path, capsys):
    with pytest.raises(ValueError, match=r"only = 'fig17': must be of fig2, fig3, .*fig16"):
        main(only=("fig17",))
    assert command(["figures", "--only", "fig3,skipping", "--out", str(tmp_path)]) == 1
    assert "only = 'skipping': must be of fig2" in capsys.readouterr().err
    for bad in ({"cells": 1}, {"phase_step": 0.9}):
        with pytest.raises(ValueError, match=next(iter(bad))):
            main(only=("fig3",), **bad)


def test_turns_of_a_curve():
    t = np.linspace(0.0, 6.0 * np.pi, 600)
    assert _turns(np.cos(t)) == 5
    assert _turns(1e-3 * np.cos(t)) == 0
    assert _turns(-t) == 0
    assert _turns(np.zeros(0)) == 0


def motion(model, damping, rate, late, turns):
    fold, rows = 1.0, np.linspace(0.0, 1.2, 30)
    snap = (fold + late) / rate, fold + late
    return Motion("planar", model, damping, rate, fold, snap, turns, rows / rate, rows, 0.3 - 0.3 * rows)


def test_verdicts_of_ramps_and_bounds():
    def ramps(power, ringing):
        made = [
            motion(model, damping, rate, 0.3 * rate**power, 0 if damping > 1.0 else ringing)
            for model in ("kirchhoff", "der")
            for damping in (1e3, 1e-3)
            for rate in (1e-2, 0.1, 1.0)
        ]
        return Figures(chosen=("fig6",), moved={"planar": Moved(tuple(made), None)})

    good = verdicts(ramps(0.8, 40), "fig6")
    assert {v.verdict for v in good.values()} == {YES}
    assert {v.verdict for v in verdicts(ramps(1.2, 1), "fig6").values()} == {NO}
    says = "At dL/L = 0.35 the first snap has the energy to pass to U-."
    for low, high, expected in ((2.6, 0.55, CORRECTED), (2.6, -0.5, YES), (-0.1, -0.5, NO)):
        bounds = (Bound(0.40, high, high), Bound(0.35, low, low))
        result = Figures(chosen=("fig10",), settled=Settled((), {}), bounds=bounds)
        claim = next(claim for claim in CLAIMS if claim.says == says)
        assert claim.of(result).verdict == expected


def test_finished_runs_of_another_question_are_taken_over(tmp_path):
    calls = [1, 2, 3]
    with Sweep(folder=tmp_path / "one", processes=1) as sweep:
        sweep("x", math.sqrt, calls)
    done = []

    def prepare():
        done.append(True)

    with Sweep(folder=tmp_path / "two", others=[tmp_path / "one", tmp_path / "none"], processes=1) as sweep:
        assert sweep("x", math.sqrt, calls, prepare=prepare) == [math.sqrt(k) for k in calls]
        assert not done
        sweep("x", math.sqrt, [*calls, 4], prepare=prepare)
    assert done


def test_verdicts_of_named_runs():
    """A run of each kind on coarse meshes, as it is, unsettled by refinement, and of another outcome."""
    wanted = ("(0.40, 0.40) nu 10, rate 1", "(0.40, 0.40) nu 10, rate 1, stop 0.36")
    chosen = [case for case in CASES if case.label in wanted]
    settled = Settled(tuple(settle(case, (31, 51), 1e-4, (1e-2,)) for case in chosen), {0.40: CURVE})
    result = Figures(
        chosen=("fig10", "fig12"), settled=settled, bounds=(Bound(0.40, 0.5, 0.5), Bound(0.35, 2.6, 2.6))
    )
    skip, select = "The same at nu = 10.", "At nu = 10 both end in U+S-."
    said = verdicts(result)
    assert said[skip].verdict == YES
    assert "type 2 (first snap 0.33" in said[skip].number
    assert said[select].verdict == CORRECTED
    for outcome, expected in (("sensitive", OPEN), ("U-S-", NO)):
        changed = tuple(replace(v, outcome=outcome) for v in settled.verdicts)
        other = verdicts(replace(result, settled=replace(settled, verdicts=changed)))
        assert (other[skip].verdict, other[select].verdict) == (expected, expected)
    for data in figures.all_figures(result):
        plt.close(panels.draw(data))


@pytest.mark.slow
def test_figures_small_by_the_command(tmp_path):
    only = ("fig5", "fig7", "fig9", "fig14", "fig16")
    words = [
        "--cells",
        "2",
        "--samples",
        "2",
        "--dampings",
        "1e-3,1e3",
        "--decades",
        "3",
        "--phase-step",
        "0.2",
    ]
    words += ["--only", ",".join(only), "--out", str(tmp_path), "--quiet", "--json"]
    assert command(["figures", *words]) == 0
    for name in only:
        for kind in ("png", "pdf", "csv"):
            assert (tmp_path / "figures" / f"{name}.{kind}").stat().st_size > 1000
