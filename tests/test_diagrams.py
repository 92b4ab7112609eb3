import math
from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np
import pytest

import compare
import der
from compare.archive import from_bytes, to_bytes
from compare.diagrams import Sample, predictions, sampling, selection_diagram, skipping_diagram, threshold
from compare.diagrams import setup as runs
from compare.diagrams.axes import Axis
from compare.diagrams.boundaries import Line, search
from compare.diagrams.diagram import both
from compare.sweep import Sweep
from ribbonfem import Ribbon, Scene, SceneError, SolverError
from ribbonfem.delay import predict
from ribbonfem.options import OptionError

RATES, DAMPINGS = (0.05, 1.0, 3), (0.5, 30.0, 3)


@pytest.fixture(scope="module")
def diagram():
    with Sweep(processes=1) as sweep:
        return skipping_diagram(0.40, 0.40, RATES, DAMPINGS, nodes=31, samples=8, sweep=sweep)


def test_cells_lie_where_they_should(diagram):
    assert np.allclose(diagram.rates, 0.05 * 20.0 ** (np.arange(3) / 2))
    assert np.allclose(diagram.dampings, 0.5 * 60.0 ** (np.arange(3) / 2))
    half = 0.5 * np.log(20.0) / 2
    inside = [min(abs(math.log(s.rate / r)) for r in diagram.rates) for s in diagram.samples]
    assert max(inside) <= half * (1 + 1e-12)
    assert max(inside) > 0.5 * half


def test_shares_are_of_the_runs_that_ended(diagram):
    assert diagram.shares.shape == (3, 3, len(diagram.outcomes))
    assert np.allclose(diagram.shares.sum(axis=2), 1.0)
    assert set(np.unique(diagram.runs)) <= {3, 8}
    assert diagram.runs.sum() == len(diagram.samples) - len(diagram.failed)
    for j, i in np.ndindex(3, 3):
        if diagram.outcome[j, i] in diagram.outcomes:
            assert diagram.shares[j, i].max() == 1.0
        else:
            assert diagram.outcome[j, i] in ("cut", "mixed")
            assert diagram.runs[j, i] == 8


def test_what_is_sure_is_what_the_paper_says(diagram):
    # slow and overdamped: no skip; fast: type 2
    assert diagram.outcome[2, 0] == "no skip"
    assert diagram.outcome[2, 2] == "type 2"
    assert diagram.outcome[1, 0] == "no skip"


def test_boundaries_are_changes(diagram):
    assert diagram.boundaries
    base = runs.setup(diagram.scene, "der", {"nodes": 31})
    for b in diagram.boundaries:
        assert b.low <= b.value <= b.high or b.low == b.high == b.value
        if b.band or b.below == b.above:
            continue
        assert b.uncertainty <= 0.01 * b.value
        # of this mesh, and it says so
        assert b.mesh == 31
        for value, name in ((b.value - 2 * b.uncertainty, b.below), (b.value + 2 * b.uncertainty, b.above)):
            place = (value, b.other) if b.along == "rate" else (b.other, value)
            assert runs.run_of(base, *place).outcome == name


def test_a_diagram_is_a_value(diagram):
    again = from_bytes(to_bytes(diagram))
    assert again == diagram
    assert hash(again) == hash(diagram)
    assert len(repr(diagram).splitlines()) <= 3
    rows = diagram.to_csv().splitlines()
    assert rows[0].startswith("rate,damping,outcome,share")
    assert len(rows) == 1 + 9 * len(diagram.outcomes)
    with pytest.raises(ValueError, match="read-only"):
        diagram.shares[0, 0, 0] = 2.0


def test_a_resumed_diagram_is_the_same_and_the_centre_is_a_sample(tmp_path):
    options = {"nodes": 31, "samples": 1, "boundaries": False}
    with Sweep(folder=tmp_path, processes=1) as sweep:
        one = skipping_diagram(0.40, 0.40, (0.2, 1.0, 2), (5.0, 30.0, 2), sweep=sweep, **options)
    files = sorted(tmp_path.rglob("*.result"))
    assert len(files) == 4
    files[0].write_bytes(b"spoilt")
    files[1].unlink()
    # (that workers find the same is a test of clusters)
    with Sweep(folder=tmp_path, processes=1) as sweep:
        two = skipping_diagram(0.40, 0.40, (0.2, 1.0, 2), (5.0, 30.0, 2), sweep=sweep, **options)
    assert to_bytes(one) == to_bytes(two)
    assert {(s.rate, s.damping) for s in one.samples} == {(r, d) for r in one.rates for d in one.dampings}


def test_selection_ends_in_shapes_that_exist():
    with Sweep(processes=1) as sweep:
        result = selection_diagram(
            0.40, 0.40, 0.36, (0.1, 1.0, 2), (10.0, 30.0, 2), nodes=31, samples=1, sweep=sweep
        )
    assert result.outcomes == ("U+S+", "U+S-", "U-S+", "U-S-")
    # alpha_c1 lies before the stop: U+S+ is no shape to come to rest in
    assert set(result.outcome.ravel()) == {"U+S-"}


def test_a_run_that_fails_is_recorded(monkeypatch):
    base = runs.setup(Scene(compression=0.40, shear=0.40), "der", {"nodes": 31})

    class Broken:
        @staticmethod
        def simulate(*_, **__):
            raise SolverError("it stopped")

    monkeypatch.setitem(runs.MODELS, "der", Broken)
    sample = runs.run_of(base, 0.1, 1.0)
    assert (sample.outcome, sample.reason) == ("", "it stopped")
    assert math.isnan(sampling.half_interval(0, 0))
    assert sampling.name_of_cell([sample], True, AXES) == ""


AXES = Axis("rate", np.array([0.1, 1.0])), Axis("damping", np.array([0.1, 1.0]))


def made_up(outcomes, points):
    return [
        Sample(math.exp(x), math.exp(y), name, None, None, "")
        for name, (x, y) in zip(outcomes, points, strict=True)
    ]


def test_names_of_cells():
    square = [(0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (1.0, 1.0)]
    assert sampling.name_of_cell(made_up("aaaa", square), True, AXES) == "a"
    assert sampling.name_of_cell(made_up("aaab", square), True, AXES) == "cut"
    # exclusive or: no line separates it
    assert sampling.name_of_cell(made_up("abba", square), True, AXES) == "mixed"
    assert sampling.name_of_cell(made_up("abba", square), False, AXES) == "cut"
    assert sampling.name_of_cell(made_up("aabc", square), True, AXES) == "mixed"


def test_rounds_depend_on_whole_earlier_rounds_alone():
    assert sampling.rounds_up_to(1) == [1]
    assert sampling.rounds_up_to(3) == [3]
    assert sampling.rounds_up_to(24) == [3, 8, 16, 24]
    assert sampling.rounds_up_to(100) == [3, 8, 16, 32, 64, 100]
    a, b = made_up("aaa", [(0, 0)] * 3), made_up("bbb", [(0, 0)] * 3)
    mixed = made_up("aab", [(0, 0)] * 3)
    assert sampling.unsure([[a, a], [a, a]], True) == []
    assert sampling.unsure([[a, b], [a, a]], True) == [(0, 0), (0, 1), (1, 1)]
    assert sampling.unsure([[a, b], [mixed, a]], False) == [(1, 0)]
    points = [sampling.cell_points(AXES, (0, 1), n, (0, 1, 2)) for n in (8, 24)]
    assert points[0] == points[1][:8]


def test_intervals_are_wilsons():
    assert sampling.half_interval(15, 24) == pytest.approx(0.18, abs=0.01)
    low = 1.0 - 2.0 * sampling.half_interval(3, 3)
    assert low == pytest.approx(1.0 / (1.0 + 1.959964**2 / 3.0), abs=1e-6)


@pytest.mark.parametrize(
    ("truth", "band"), [(lambda x: x > 0.3, False), (lambda x: x > 0.31 or 0.28 < x < 0.3, True)]
)
def test_lines_find_points_and_bands(truth, band):
    line = Line((0.1, 1.0), 0.01, {})

    def run(work):
        return ["yes" if truth(value) else "no" for _, value in work]

    search([line], run)
    ((value, uncertainty, low, high, below, above),) = line.changes()
    assert (below, above) == ("no", "yes")
    assert (high > low) == band
    assert abs(value - 0.3) <= (0.02 if band else uncertainty)
    assert band or uncertainty <= 0.01 * value


def test_threshold_of_type_2_in_the_limit_of_the_mesh():
    scene = Scene(compression=0.40, shear=0.40, damping=10.0)
    with Sweep(processes=1) as sweep:
        result = threshold(scene, "type 2", "rate", (0.3, 1.0), 0.02, sweep=sweep)
        # N = 51, 101, 201 give .4995, .507, .5087
        assert result.value == pytest.approx(0.5093, abs=result.uncertainty + 5e-4)
        assert result.uncertainty <= 0.02 * result.value
        assert (result.below, result.above) == ("no skip", "type 2")
        with pytest.raises(SolverError, match=r"'no skip' and 'no skip'\. Look in a wider range"):
            threshold(scene, "type 2", "rate", (0.1, 0.2), nodes=31, sweep=sweep)


@pytest.mark.parametrize(
    ("call", "named"),
    [
        (lambda: skipping_diagram(0.4, 0.4, rates=(1.0, 0.1, 3)), "rates"),
        (lambda: skipping_diagram(0.4, 0.4, rates=(0.1, 1.0)), "rates"),
        (lambda: skipping_diagram(0.4, 0.4, rates=3), "rates"),
        (lambda: skipping_diagram(0.4, 0.4, dampings=(0.1, 1.0, 1)), r"dampings\[2\]"),
        (lambda: skipping_diagram(0.4, 0.4, samples=0), "samples"),
        (lambda: skipping_diagram(0.4, 0.4, seed=-1), "seed"),
        (lambda: skipping_diagram(0.4, 0.4, model="elastica"), "model"),
        (lambda: skipping_diagram(0.4, 0.4, boundaries=1), "boundaries"),
        (lambda: skipping_diagram(0.4, 0.4, nodes=3), "nodes"),
        (lambda: threshold(Scene(), between=(2.0, 1.0)), "between"),
        (lambda: threshold(Scene(), vary="speed"), "vary"),
        (lambda: threshold(Scene(), "type 3"), "outcome"),
        (lambda: threshold(Scene(), "U+S-"), "Scene.stop"),
        (lambda: threshold(replace(Scene(), start="U+S-")), "Scene.start"),
        # of a sweep, and said where it belongs
        (lambda: skipping_diagram(0.4, 0.4, processes=1), "processes = 1: .* are of sweep"),
        (lambda: threshold(Scene(), processes=1), "processes = 1: .* are of sweep"),
        (
            lambda: skipping_diagram(0.4, 0.4, until="snap"),
            "until = 'snap': der.simulate takes initial, nodes, clamp",
        ),
        (
            lambda: threshold(Scene(), configurations=True),
            "configurations = True: der.simulate takes initial, nodes",
        ),
    ],
)
def test_what_cannot_be_is_named(call, named):
    with pytest.raises((OptionError, SceneError), match=named):
        call()


def test_the_pass_is_that_of_the_saddle():
    scene = Scene(compression=0.40, shear=0.40, start="U+S-", rate=1.0)
    needed = predictions.pass_of(der.equilibria(scene, nodes=31))
    (fold,) = der.folds(scene, nodes=31)
    for angle in (0.1, 0.3):
        # along the curve itself: a ramp to the angle, so slow that it is at rest
        ramp = replace(scene, rate=1e-3, stop=angle, damping=1e3)
        rest = der.simulate(ramp, nodes=31, configurations=False, tolerance=1e-4).energies["elastic"][-1]
        assert needed(angle) == pytest.approx(der.saddle(scene, angle, nodes=31).energy - rest, abs=2e-3)
    assert 0.0 < needed(fold.angle - 0.02) < 0.1 * needed(0.1)
    assert math.isnan(needed(fold.angle + 1e-3))


def test_type_1_ends_where_energy_says():
    """Where the first snap frees twenty times what the pass takes, the first swing decides."""
    scene = Scene(compression=0.35, shear=0.40, start="U+S+", rate=0.03)
    rates, dampings = np.array([0.01, 0.1]), np.array([0.1, 30.0])
    base = runs.setup(scene, "der", {"nodes": 31})
    curve = predictions.predictions(base, rates, dampings)
    assert not curve.missing
    at = math.exp(np.interp(math.log(0.03), *np.log(curve[predictions.TYPE_1]).T))
    assert runs.run_of(base, 0.03, at / 1.15).outcome == "type 1"
    assert runs.run_of(base, 0.03, at * 1.15).outcome == "no skip"


def test_the_delays_of_a_diagram_are_the_delay():
    scene = Scene(compression=0.40, shear=0.40, start="U+S+", rate=0.1)
    form = der.normal_forms(scene, nodes=31)[0]
    late = predictions.late_by(form)
    for rate, damping in ((0.01, 0.1), (0.01, 30.0), (0.123, 4.56), (1.0, 0.1)):
        assert late(rate, damping) == pytest.approx(predict(form, rate, damping).time, rel=1e-6)


def test_type_2_begins_where_the_delay_reaches_the_second_fold():
    scene = Scene(compression=0.40, shear=0.40, start="U+S+", rate=0.1)
    base = runs.setup(scene, "der", {"nodes": 31})
    curve = predictions.predictions(base, np.array([0.01, 1.0]), np.array([0.1, 30.0]))[predictions.TYPE_2]
    form = der.normal_forms(scene, nodes=31)[0]
    window = base.folds[1].angle - base.folds[0].angle
    assert len(curve) > 10
    for rate, damping in curve[::6]:
        assert rate * predict(form, float(rate), float(damping)).time == pytest.approx(window, rel=1e-4)


def test_public_names():
    for name in ("skipping_diagram", "selection_diagram", "threshold", "save", "load", "choose"):
        assert name in dir(compare)
        assert callable(getattr(compare, name))


def shares_around(model, rate, damping, count=200, **options):
    """Shares of outcomes around (0.40, 0.40) within 10^(+-0.05) of a rate and a damping."""
    # (it takes 0.3 s to import)
    from scipy.stats import qmc

    base = runs.setup(Scene(compression=0.40, shear=0.40, start="U+S+"), model, options)
    places = 10.0 ** (0.1 * qmc.Halton(2, seed=5).random(count) - 0.05)
    result = [runs.run_of(base, rate * x, damping * y).outcome for x, y in places]
    return np.array([result.count(name) / count for name in runs.SKIPPING])


@pytest.mark.slow
@pytest.mark.parametrize(("rate", "damping"), [(0.01, 0.1), (0.03, 0.2), (0.04, 0.3)])
def test_shares_inside_a_region_do_not_depend_on_mesh_tolerance_or_model(rate, damping):
    """Where the ribbon vibrates far from a boundary: a few percent do not skip, whatever runs them.

    On a boundary itself they do depend on the mesh, as the boundary does: see the guide.
    """
    shares = [
        shares_around("der", rate, damping, nodes=51),
        shares_around("der", rate, damping, nodes=101),
        shares_around("der", rate, damping, nodes=51, tolerance=1e-5),
        shares_around("kirchhoff", rate, damping, extensible=True),
    ]
    assert np.ptp(shares, axis=0).max() < 0.12, shares
    assert min(share[0] for share in shares) > 0.0


def test_elements_draw_what_rods_draw(diagram):
    """Where neither rings on a boundary; with the mesh that elements in motion have by default."""
    with Sweep(processes=1) as sweep:
        result = skipping_diagram(
            0.40,
            0.40,
            (0.05, 1.0, 2),
            (0.5, 30.0, 2),
            model="kirchhoff",
            extensible=True,
            samples=1,
            boundaries=False,
            sweep=sweep,
        )
    assert not result.failed
    assert result.outcome[1, 0] == diagram.outcome[2, 0] == "no skip"
    assert result.outcome[1, 1] == diagram.outcome[2, 2] == "type 2"


def test_models_side_by_side(diagram):
    assert not both({"one": diagram, "two": diagram}).any()


@pytest.mark.parametrize(
    ("ribbon", "lines"),
    [
        (Ribbon(), {predictions.TYPE_1, predictions.TYPE_2}),
        # its own time is a fiftieth of the default's: rates of that many rad/s
        (Ribbon(length=0.18, width=0.012, thickness=2e-4, young=200e9, density=7850.0, poisson=0.3), set()),
    ],
)
def test_a_line_that_is_not_there_is_told_and_a_mark_that_is_has_its_word(ribbon, lines):
    grid = {"rates": (0.01, 1.0, 2), "dampings": (0.1, 30.0, 2)}
    made = skipping_diagram(0.40, 0.40, **grid, ribbon=ribbon, nodes=21, samples=2, sweep=Sweep(processes=1))
    assert {name for name, curve in made.predicted.items() if len(curve)} == lines
    assert set(made.unpredicted) == {predictions.TYPE_1, predictions.TYPE_2} - lines
    assert repr(made).count("no line of") == 2 - len(lines)
    axes = made.plot()
    words = [text.get_text() for text in axes.get_legend().get_texts()]
    drawn = {line.get_marker() for line in axes.lines if line.get_marker() not in ("None", "")}
    told = {
        handle.get_marker() for handle in axes.get_legend().legend_handles if hasattr(handle, "get_marker")
    }
    assert drawn <= told
    assert sum("not within these axes" in word for word in words) == 2 - len(lines)
    plt.close("all")
