"""The examples, each run small, against closed forms, other models and what the paper says."""

import inspect
from importlib import import_module
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest

import compare.examples
from compare.examples import (
    choose_the_last,
    delayed_snap,
    fit_a_snap,
    planar_fold,
    ribbon_folds,
    skip_a_shape,
    two_witnesses,
    where_folds_meet,
    which_mesh,
)

FOLDER = Path(compare.examples.__file__).parent
NAMES = sorted(path.stem for path in FOLDER.glob("*.py") if path.stem != "__init__")
# fold of the beam of small slopes over the root of dL/L (tests/test_quasilinear.py takes it to 12 digits)
MU = 1.781776041156


def drawn(module, result):
    """What `look` draws: a figure in which every axes holds something and says what."""
    figure = module.look(result)
    for axes in figure.axes:
        assert axes.has_data()
        assert axes.get_xlabel()
        assert axes.get_ylabel()
    plt.close(figure)
    return figure


def test_a_planar_fold():
    result = planar_fold.main(compression=0.2, elements=(8, 16), compressions=(0.02, 0.1, 0.4))
    assert result.closed_form == pytest.approx(MU * 0.2**0.5, rel=1e-12)
    assert result.order == pytest.approx(4.0, abs=0.15)
    assert max(result.errors) < 2e-3
    # the elastica tends to the closed form with dL, and is not it
    off = np.abs(np.array(result.ratios) - 1.0)
    assert off[0] < 1e-3 < off[1] < off[2] < 5e-3
    drawn(planar_fold, result)


def test_folds_of_a_ribbon():
    result = ribbon_folds.main(elements=8)
    np.testing.assert_allclose(result.limit, result.elements, atol=1e-5)
    # and the rods themselves are a hundred times as far
    assert np.abs(np.array(result.rods[1]) - result.elements).min() > 2e-4
    assert [fold.angle for fold in result.curve.folds if fold.angle > 0.0] == pytest.approx(result.elements)
    drawn(ribbon_folds, result)


def test_a_delayed_snap():
    result = delayed_snap.main(rates=(0.01, 0.1))
    measured, better = np.array(result.measured), np.array(result.next_order)
    assert np.all(np.abs(measured - better) < result.errors)
    # the leading order is late by a time that hardly depends on the rate
    late = (np.array(result.leading) - measured) / result.rates
    assert late == pytest.approx([0.1, 0.1], rel=0.2)
    drawn(delayed_snap, result)


def test_a_filmed_snap_is_fitted():
    result = fit_a_snap.main(frames=101)
    fit = result.fit
    assert fit.met
    assert set(fit.values) == set(result.truth)
    for name, value in result.truth.items():
        assert abs(fit.values[name] - value) < 4.0 * fit.uncertainty[name]
    # and what it began with is far off
    assert abs(fit.begun["young"] - result.truth["young"]) > 10.0 * fit.uncertainty["young"]
    drawn(fit_a_snap, result)


def test_a_shape_is_skipped():
    result = skip_a_shape.main(nodes=31)
    assert result.outcomes == ("no skip", "type 2")
    (slow_first, slow_second), (fast_first, fast_second) = result.snaps
    first, second = result.folds
    assert first < slow_first < second < slow_second < fast_second
    assert fast_first < second
    drawn(skip_a_shape, result)


def test_the_last_shape_is_chosen():
    result = choose_the_last.main(nodes=31)
    assert result.folds[0] < result.stop < result.folds[1]
    assert result.last == ("U+S-", "U-S+")
    # neither can leave it any more
    assert max(result.energies) < result.barrier
    drawn(choose_the_last, result)


def test_two_witnesses():
    result = two_witnesses.main(nodes=(51, 76), elements=6)
    assert abs(result.limit - result.elements) < 5e-5
    assert abs(result.rods[-1] - result.elements) > 2e-4
    drawn(two_witnesses, result)


def test_where_folds_meet():
    result = where_folds_meet.main(elements=8)
    straight = [cusp.parameter for cusp in result.curve.cusps if abs(cusp.control) < 1e-8]
    assert straight == pytest.approx([result.broken, result.merged], abs=1e-8)
    # without shear it is the planar beam's, of the mirror image; of so coarse a mesh to 1e-5
    assert result.curve.at(0.0)[0].control == pytest.approx(-result.planar, abs=1e-5)
    drawn(where_folds_meet, result)


def test_which_mesh():
    result = which_mesh.main(elements=(8, 16, 32), nodes=(21, 41, 81), tolerance=1e-6)
    for convergence in result.refined:
        assert convergence.verified
        assert convergence.order == pytest.approx(convergence.expected, rel=0.1)
    # the chosen prediction is within its error of the rods' limit
    rods = result.refined[-1]
    assert abs(result.chosen - rods.limit) < result.error + 5.0 * rods.uncertainty
    drawn(which_mesh, result)


@pytest.mark.parametrize("name", NAMES)
def test_every_example_is_written_in_the_same_order(name):
    module = import_module(f"compare.examples.{name}")
    text = inspect.getsource(module.main)
    places = [text.find(f"# {part}") for part in ("problem", "discretisation", "solver", "run")]
    assert -1 not in places
    assert places == sorted(places)
    assert module in globals().values(), f"{name} is not tested"
    parameters = inspect.signature(module.main).parameters.values()
    assert all(p.kind is p.KEYWORD_ONLY and p.default is not p.empty for p in parameters)
    for word in ("print(", "savefig", "open("):
        assert word not in inspect.getsource(module)
