"""Diagrams over any two numbers of a scene."""

from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np
import pytest

import compare
from compare.diagrams import setup as runs
from compare.diagrams import show
from compare.diagrams.axes import Axis, axes_of, axis_of, label
from compare.diagrams.boundaries import Line, search
from compare.sweep import Sweep
from ribbonfem import Scene, SceneError, SolverError, kirchhoff
from ribbonfem.options import OptionError
from ribbonfem.scene_numbers import with_numbers

RAMP = Scene(compression=0.40, shear=0.40, start="U+S+", rate=0.5, damping=10.0)
ASKED = {"model": "kirchhoff", "extensible": True, "elements": 8}


def drawn(scene, over, **options):
    with Sweep(processes=1) as sweep:
        return compare.outcome_diagram(scene, over, sweep=sweep, **{**ASKED, **options})


@pytest.fixture(scope="module")
def over_shear():
    return drawn(RAMP, {"shear": (0.36, 0.40, 3), "rate": (0.05, 2.0, 3)}, samples=3)


def test_over_rate_and_damping_it_is_the_skipping_diagram():
    grid = {"rate": (0.2, 1.0, 2), "damping": (5.0, 30.0, 2)}
    with Sweep(processes=1) as sweep:
        named = compare.skipping_diagram(0.40, 0.40, *grid.values(), samples=3, sweep=sweep, **ASKED)
    any_two = drawn(RAMP, grid, samples=3)
    # (the scene's own rate and damping count nowhere)
    assert replace(any_two, scene=named.scene) == named
    assert any_two.folds == named.folds
    assert list(any_two.rates) == list(any_two.values("rate")) == list(any_two.x)


def test_turned_over_it_has_the_same_cells():
    """With damping across and rate up, by the same outcomes at the centres."""
    grid = {"rate": (0.2, 1.0, 2), "damping": (5.0, 30.0, 2)}
    one = drawn(RAMP, grid, samples=1, boundaries=False)
    other = drawn(RAMP, dict(reversed(grid.items())), samples=1, boundaries=False)
    assert (other.outcome == one.outcome.T).all()
    assert [sample.first for sample in other.samples] == [one.samples[k].first for k in (0, 2, 1, 3)]


def test_each_run_is_that_of_its_scene(over_shear):
    """Folds, and so what is skipped, are those of the run's own shear."""
    base = runs.setup(replace(RAMP, stop=None), "kirchhoff", {"extensible": True, "elements": 8})
    for sample in over_shear.samples[::5]:
        scene = replace(RAMP, shear=sample.x, rate=sample.y)
        own = runs.setup(scene, "kirchhoff", base.options)
        assert runs.run_of(own, sample.y, RAMP.damping).first == sample.first
        snaps = kirchhoff.simulate(
            replace(scene, stop=2.0), elements=8, extensible=True, until="snap", configurations=False
        )
        assert snaps.crossing("height")[1] == pytest.approx(sample.second, abs=1e-12)
    # cells are areas of the shear itself, and of the logarithm of the rate
    assert np.allclose(over_shear.x, [0.36, 0.38, 0.40])
    assert np.allclose(over_shear.y, [0.05, 0.1**0.5, 2.0])
    for axis, of in zip(over_shear.axes, "xy", strict=True):
        cells = {axis.cell_of(getattr(sample, of)) for sample in over_shear.samples}
        assert cells == {0, 1, 2}


def test_a_change_along_the_shear_is_that_of_a_threshold(over_shear):
    """Solved for between sure cells: the outcome differs on its two sides."""
    assert over_shear.boundaries
    assert {change.along for change in over_shear.boundaries} <= {"shear", "rate"}
    base = runs.setup(RAMP, "kirchhoff", {"extensible": True, "elements": 8}, ("shear", "rate"))
    for change in over_shear.boundaries:
        off = 2.0 * change.uncertainty
        places = [(change.value + sign * off, change.other) for sign in (-1.0, 1.0)]
        if change.along == "rate":
            places = [place[::-1] for place in places]
        assert [runs.run_of(base, *place).outcome for place in places] == [change.below, change.above]
    rates = [change for change in over_shear.boundaries if change.along == "rate" and not change.band]
    for change in rates[:1]:
        with Sweep(processes=1) as sweep:
            ramp = replace(RAMP, shear=change.other)
            ends = change.value / 1.3, change.value * 1.3
            result = compare.threshold(ramp, change.above, "rate", ends, sweep=sweep, **ASKED)
        assert abs(result.value - change.value) <= 2.0 * (change.uncertainty + result.uncertainty)


def test_where_there_is_no_such_state_it_says_so_and_ends_at_the_pitchfork():
    """U+S+ begins at the shear of the pitchfork from the planar state."""
    result = drawn(RAMP, {"shear": (0.30, 0.36, 2), "damping": (3.0, 5.0, 2)}, samples=1)
    assert not result.failed
    assert (result.outcome[:, 0] == "no state").all()
    assert (result.outcome[:, 1] == "no skip").all()
    assert all("not a stable equilibrium" in s.reason for s in result.samples if s.outcome == "no state")
    begins = kirchhoff.pitchforks(0.40, elements=8, extensible=True).broken
    for change in (change for change in result.boundaries if change.along == "shear"):
        assert (change.below, change.above) == ("no state", "no skip")
        assert abs(change.value - begins) <= change.uncertainty
    assert repr(result).startswith("Diagram(skipping at dL/L 0.4, 0.5 rad/s over shear and damping, kirch")


def test_where_no_run_ends_it_says_so(monkeypatch):
    """Also where no outcome is known beforehand, as of a planar start; keys for programs stay."""

    def fails(*_):
        raise SolverError("no step converges")

    monkeypatch.setattr(runs, "_run", fails)
    planar = Scene(compression=0.20, shear=0.0, start="U+", stop=1.0, damping=10.0)
    made = drawn(planar, {"young": (1e8, 2e8, 2), "damping": (5.0, 10.0, 2)}, samples=1)
    assert made.outcomes == ()
    assert made.shares.shape == (2, 2, 0)
    assert np.isnan(made.uncertainty).all()
    assert not made.runs.any()
    assert [failed.reason for failed in made.failed] == ["no step converges"] * 4
    assert show.numbers(made)["failed"][0] == {"x": 1e8, "y": 5.0, "reason": "no step converges"}
    usual = drawn(planar, {"rate": (0.5, 1.0, 2), "damping": (5.0, 10.0, 2)}, samples=1)
    assert show.numbers(usual)["failed"][0] == {"rate": 0.5, "damping": 5.0, "reason": "no step converges"}
    for each in (made, usual):
        plt.close(each.plot().figure)


def test_where_the_stop_varies_it_is_asked_in_which_shape_a_ramp_ends(tmp_path):
    """Below the first fold it stays, between the folds it is U+S-, and beyond both on the other side."""
    first, second = (
        fold.control for fold in kirchhoff.folds(replace(RAMP, shear=0.37), elements=8, extensible=True)
    )
    stops = (0.5 * first, 0.5 * (first + second), 1.2 * second)
    grid = {"stop": (stops[0], stops[2], 3), "thickness": (0.008, 0.012, 2)}
    slow = replace(RAMP, shear=0.37, rate=0.05, damping=30.0)
    result = drawn(slow, grid, samples=1, boundaries=False)
    assert result.kind == "selection"
    for row in result.outcome:
        assert row[0] == "U+S+"
        assert row[1] == "U+S-"
        assert row[2].startswith("U-")
    # in a file, a table, and drawn
    path = tmp_path / "diagram.ribbon"
    compare.save(result, path)
    assert compare.load(path) == result
    frame = result.to_pandas()
    assert list(frame.columns[:2]) == ["stop", "thickness"]
    assert frame.attrs["units"] == {"stop": "rad", "thickness": "m"}
    assert result.to_csv().startswith("stop,thickness,outcome")
    assert "over stop and thickness" in repr(result)
    axes = result.plot()
    assert (axes.get_xscale(), axes.get_yscale()) == ("linear", "log")
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("stop (rad)", "thickness (m)")
    with pytest.raises(OptionError, match="name = 'rate'"):
        _ = result.rates


def test_a_preset_varies_too():
    axes = axes_of(RAMP, {"right": (-0.02, 0.02, 3), "compression": (0.38, 0.40, 2)})
    assert np.allclose(axes[0].values, [-0.02, 0.0, 0.02])
    assert with_numbers(RAMP, {"right": 0.01, "compression": 0.39}) == replace(
        RAMP, preset={"right": 0.01}, compression=0.39
    )
    ribbon = replace(RAMP.ribbon, young=2e8)
    assert with_numbers(RAMP, {"young": 2e8, "rate": 0.2}) == replace(RAMP, ribbon=ribbon, rate=0.2)
    assert label("right", RAMP) == "right (rad)"
    assert label("young", RAMP) == "Young's modulus (Pa)"


@pytest.mark.parametrize(("name", "values"), [("shear", (0.1, 0.2, 0.3)), ("rate", (0.1, 0.2, 0.4))])
def test_coordinates_of_an_axis(name, values):
    axis = Axis(name, np.array(values))
    x = axis.coordinate(axis.values)
    assert np.allclose(np.diff(x), axis.spacing, rtol=1e-12)
    assert np.allclose(axis.value(x), axis.values, rtol=1e-14)
    assert np.allclose(axis.coordinate(axis.moved(0.15, 0.05)) - axis.coordinate(0.15), 0.05)
    assert axis.edges[0] < values[0] < axis.edges[1] < values[1]
    assert axis.cell_of(values[1]) == 1
    assert axis.cell_of(10.0 * values[2]) is None


@pytest.mark.parametrize(
    ("scene", "over", "error", "says"),
    [
        (RAMP, {"rate": (0.1, 1.0, 3)}, OptionError, "two numbers of the scene"),
        (
            RAMP,
            {"rate": (0.1, 1.0, 3), "shear": (0.4, 0.4 + 1e-12, 3)},
            OptionError,
            "a cell must be wider than",
        ),
        (RAMP, {"rate": (0.1, 0.1 + 1e-12, 3), "shear": (0.3, 0.4, 3)}, OptionError, "cell must be wider"),
        (RAMP, {"rate": (0.1, 1.0, 3), "speed": (1, 2, 3)}, OptionError, "over = 'speed': must be one of"),
        (RAMP, {"rate": (0.1, 1.0, 3), "left": (1, 2, 3)}, OptionError, "over = 'left'"),
        (RAMP, {"rate": (0.1, 1.0), "shear": (0.3, 0.4, 3)}, OptionError, r"over\['rate'\] = \(0.1, 1.0\)"),
        (RAMP, {"rate": (0.0, 1.0, 2), "shear": (0.3, 0.4, 3)}, OptionError, r"over\['rate'\]\[0\]"),
        (RAMP, {"rate": (0.1, 1.0, 2), "shear": (0.4, 0.3, 3)}, OptionError, "low must be below high"),
        (RAMP, {"rate": (0.1, 1.0, 2), "compression": (0.3, 1.3, 3)}, SceneError, "Scene.compression = 1.3"),
        (replace(RAMP, rate=-0.1), {"rate": (0.1, 1.0, 2), "shear": (0.3, 0.4, 2)}, SceneError, "Scene.rate"),
        ("ramp", {"rate": (0.1, 1.0, 2), "shear": (0.3, 0.4, 2)}, OptionError, "a Scene is needed"),
    ],
)
def test_what_cannot_be_is_refused(scene, over, error, says):
    with pytest.raises(error, match=says):
        compare.outcome_diagram(scene, over)


@pytest.mark.parametrize(("low", "high"), [(0.4, 0.4 + 3e-9), (-1e9, 1e9), (1e5, 1e5 + 1e-3)])
def test_changes_are_found_in_the_narrowest_cells(low, high):
    """To a hundredth of the coordinate's unit, in some rounds: what is bisected is not rounding."""
    axis = axis_of("shear", (low, high, 3), "over")
    step = axis.values[1] - axis.values[0]
    there = low + 0.3 * step
    line = Line((axis.values[0], axis.values[1]), 0.01, {}, axis=axis)
    rounds = []

    def run(work):
        rounds.append(len(work))
        assert len(rounds) < 20
        return ["below" if value < there else "above" for _, value in work]

    search([line], run)
    (value, uncertainty, *_, below, above), *more = line.changes()
    assert not more
    assert (below, above) == ("below", "above")
    assert abs(value - there) < uncertainty < 0.04 * step


def test_a_threshold_is_of_any_number_too():
    """Of the modulus as of the rate: at rest it has no part, and in motion it is the time that it makes."""
    scene = replace(RAMP, rate=0.5, damping=10.0)
    with Sweep(processes=1) as sweep:
        young = compare.threshold(scene, "type 2", "young", (5e7, 2e8), sweep=sweep, **ASKED)
    # the same ribbon in its own time: a rate and a damping by the square root of the modulus
    share = (young.value / RAMP.ribbon.young) ** 0.5
    own = replace(scene, damping=10.0 / share)
    with Sweep(processes=1) as sweep:
        rate = compare.threshold(own, "type 2", "rate", (0.3 / share, 0.8 / share), sweep=sweep, **ASKED)
    assert abs(rate.value * share / 0.5 - 1.0) < 2.0 * (rate.uncertainty / rate.value + 0.01)
