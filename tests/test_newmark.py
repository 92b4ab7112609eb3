"""Time stepping of both beams: order, energy, kinks, range."""

from dataclasses import replace

import numpy as np
import pytest

from ribbonfem import Scene, elastica, quasilinear
from ribbonfem.results import SolverError
from ribbonfem.stepping import integrate, methods

SCENE = Scene(compression=0.4, shear=0.0, start="U+", rate=0.1, stop=1.4, damping=1.0)
SMALL = {elastica: 8, quasilinear: 16}
SECOND_ORDER = ("tr-bdf2", "generalised-alpha", "newmark")
BEAMS = pytest.mark.parametrize("model", [elastica, quasilinear], ids=["elastica", "quasilinear"])


def balance(history):
    e = history.energies
    return e["kinetic"] + e["elastic"] + e["dissipated"] - e["work"]


@BEAMS
@pytest.mark.parametrize("method", [*SECOND_ORDER, "implicit-euler"])
def test_order_on_the_snap(model, method):
    """The angle at which z changes sign, at three steps: it converges with the method's declared order."""
    angles = [
        model.simulate(SCENE, elements=SMALL[model], method=method, step=step, until="snap").crossing(
            "height"
        )[1]
        for step in (0.01, 0.005, 0.0025)
    ]
    declared = methods.method_of(method).order
    observed = np.log2(abs(angles[0] - angles[1]) / abs(angles[1] - angles[2]))
    assert declared == (1 if method == "implicit-euler" else 2)
    assert abs(observed - declared) < 0.2, f"observed order {observed:.3f}, declared {declared}"


@BEAMS
@pytest.mark.parametrize("method", ["esdirk3", "esdirk4"])
def test_order_of_runge_kutta_methods(model, method):
    """3 for both: the constraint of length takes one order from "esdirk4", whose stages are of order 2.

    Of the shape at the end of a ramp with so much friction that the waves of the kink are gone.
    """
    case = replace(SCENE, rate=0.5, stop=1.0, damping=30.0)

    def end(method, step):
        history = model.simulate(case, elements=SMALL[model], method=method, step=step)
        return history.configurations["positions"][-1]

    limit = end("esdirk4", 0.0025)
    errors = [np.abs(end(method, step) - limit).max() for step in (0.05, 0.025, 0.0125)]
    observed = 0.5 * np.log2(errors[0] / errors[2])
    assert 2.6 < observed < 3.6, f"observed order {observed:.2f}: {errors}"
    second = np.abs(end("tr-bdf2", 0.0125) - limit).max()
    assert errors[2] < second / (5 if method == "esdirk3" else 100)


@BEAMS
@pytest.mark.parametrize(
    ("method", "quarter"), [("newmark", 7.0), ("generalised-alpha", 6.0), ("tr-bdf2", 3.0)]
)
def test_energy_balance_closes_with_the_step(model, method, quarter):
    """On the way to the fold; what the clamp gives is what the beam has or has lost.

    `quarter` is what a step of a quarter gains at least: 16 at order 2, less where neither the sum
    of the dissipation nor (but with "newmark") the motion resolves the waves that the kink sends.
    """
    case = replace(SCENE, stop=0.6, damping=3.0, rate=0.3)
    gaps = []
    for step in (0.01, 0.005, 0.0025):
        history = model.simulate(case, elements=SMALL[model], method=method, step=step)
        gaps.append(np.ptp(balance(history)))
    assert history.energies["work"][-1] > 1.0
    assert history.energies["dissipated"][-1] > 1e-4
    assert gaps[0] < 1e-4
    assert gaps[0] / gaps[2] > quarter


@BEAMS
def test_undamped_energy_balance_is_of_order_two(model):
    """Without damping nothing is left but the trapezoidal rule's own error."""
    case = replace(SCENE, stop=1.0, damping=0.0)
    gaps = [
        np.ptp(balance(model.simulate(case, elements=SMALL[model], method="newmark", step=step)))
        for step in (0.02, 0.01, 0.005)
    ]
    assert gaps[0] < 1e-5
    assert np.log2(gaps[0] / gaps[1]) == pytest.approx(2.0, abs=0.15)
    assert np.log2(gaps[1] / gaps[2]) == pytest.approx(2.0, abs=0.15)


@BEAMS
@pytest.mark.parametrize("method", SECOND_ORDER)
def test_multiplier_does_not_chatter(model, method):
    """Undamped, a thousand steps after the kink: the alternating part of the force stays below 3e-4 of it.

    Without consistent velocities and multipliers "newmark" has two to four times that.
    """
    case = replace(SCENE, stop=1.0, damping=0.0)
    for step in (0.01, 0.005):
        history = model.simulate(case, elements=SMALL[model], method=method, step=step)
        load = history.load
        alternating = load[1:-1] - (load[:-2] + 2 * load[1:-1] + load[2:]) / 4
        assert np.abs(alternating)[4:].mean() < 3e-4 * load.mean()


@BEAMS
def test_kinks_are_ends_of_steps(model):
    case = replace(SCENE, rate=0.7, stop=0.33, hold=0.2)
    for control in ({"step": 0.03}, {"tolerance": 1e-4}):
        history = model.simulate(case, elements=SMALL[model], **control)
        first = int(np.flatnonzero(history.angle == 0.33)[0])
        assert np.all(history.angle[first:] == 0.33)
        assert history.time[first] == pytest.approx(0.33 / 0.7, rel=1e-14)
        assert history.time[-1] == pytest.approx(0.33 / 0.7 + 0.2, rel=1e-14)
        assert np.allclose(history.angle[:first], 0.7 * history.time[:first], rtol=1e-13)
    # 16 steps of the ramp, shortened to fit, and 7 of the hold
    assert len(model.simulate(case, elements=SMALL[model], step=0.03)) == 1 + 16 + 7


@BEAMS
def test_rows_do_not_matter(model, monkeypatch):
    """A run that comes back for more memory again and again is bitwise the one that does not."""
    case = replace(SCENE, rate=1.0, stop=1.35)
    for method in ("tr-bdf2", "generalised-alpha"):
        whole = model.simulate(case, elements=SMALL[model], method=method, tolerance=1e-4)
        monkeypatch.setattr(integrate, "ROWS", 3)
        parts = model.simulate(case, elements=SMALL[model], method=method, tolerance=1e-4)
        monkeypatch.undo()
        assert np.array_equal(whole.time, parts.time)
        assert np.array_equal(whole.configurations["positions"], parts.configurations["positions"])


@BEAMS
@pytest.mark.parametrize("damping", [0.0, 1e-3, 10.0, 1e5])
@pytest.mark.parametrize("rate", [1e-5, 1e-2, 1.0, 100.0])
def test_range_of_rates_and_damping(model, damping, rate):
    """Ten orders of magnitude either way, in few steps: what is slow needs no small ones."""
    case = replace(SCENE, rate=rate, damping=damping)
    history = model.simulate(case, elements=SMALL[model], tolerance=1e-4, until="snap")
    assert history.stats["steps"] < 600
    assert np.isfinite(history.configurations["positions"]).all()
    # too fast a ramp, or too much friction, stops before anything has snapped
    late = rate == 100.0 or (damping == 1e5 and rate > 1e-5)
    assert (history.crossing("height") is None) == late
    if rate == 1e-5:
        # snapped within what theory allows of the fold: less than 4 % even at nu = 1e5
        fold = model.folds(case)[0].angle
        assert fold < history.crossing("height")[1] < 1.04 * fold


@BEAMS
@pytest.mark.parametrize("step", [0.1, 1.0, 5.0])
def test_coarse_steps_are_halved_through_the_snap(model, step):
    case = replace(SCENE, rate=0.01, damping=10.0)
    history = model.simulate(case, elements=SMALL[model], step=step)
    assert history.height[-1] == pytest.approx(-0.33 if model is elastica else -0.376, abs=0.002)
    assert history.crossing("height")[1] == pytest.approx(1.1335 if model is elastica else 1.138, abs=0.003)
    if step == 5.0:
        assert history.stats["rejected"] > 0


def test_undamped_after_a_snap_energy_does_not_grow():
    """20 s of vibration with nothing to take the energy out, adaptive, default method."""
    case = replace(SCENE, rate=1.0, stop=1.3, damping=0.0, hold=20.0)
    history = elastica.simulate(case, elements=8, tolerance=1e-4)
    assert history.crossing("height") is not None
    total = history.energies["kinetic"] + history.energies["elastic"]
    held = total[history.angle == 1.3]
    assert len(held) > 1000
    # (of a step at a kink the energy is as good as its tolerance)
    assert held.max() < (1.0 + 1e-5) * held[0]
    # nor by much between any two instants: the local errors of 1e-4 L work against the stiff modes' forces
    assert (held[1:] - np.minimum.accumulate(held)[:-1]).max() < 1e-2 * held[0]


@pytest.mark.slow
@BEAMS
@pytest.mark.parametrize("method", ["tr-bdf2", "generalised-alpha"])
def test_undamped_long_after_a_snap(model, method):
    case = replace(SCENE, rate=1.0, stop=1.35, damping=0.0, hold=20.0)
    # (what more elements of degree 5 ring with, generalised-alpha does not damp at this tolerance)
    elements = 4 if model is elastica else SMALL[model]
    history = model.simulate(case, elements=elements, tolerance=1e-4, method=method)
    total = history.energies["kinetic"] + history.energies["elastic"]
    held = total[history.angle == 1.35]
    # (of a step at a kink the energy is as good as its tolerance)
    assert held.max() < (1.0 + 1e-5) * held[0]
    assert (held[1:] - np.minimum.accumulate(held)[:-1]).max() < 1e-2 * held[0]


def test_growing_energy_raises():
    """Finite garbage is not a result: generalised-alpha at a coarse step, undamped, after a snap."""
    case = replace(SCENE, rate=1.0, stop=1.35, damping=0.0, hold=20.0)
    with pytest.raises(SolverError, match="energy has grown") as caught:
        quasilinear.simulate(case, elements=64, step=0.005, method="generalised-alpha")
    assert caught.value.history is not None
    assert caught.value.history.time[-1] < 21.35


def test_a_step_that_cannot_be_met_raises():
    with pytest.raises(SolverError, match="stopped at t = 0 s") as caught:
        elastica.simulate(SCENE, elements=8, tolerance=1e-40)
    assert len(caught.value.history) == 1


def test_generalised_alpha_coefficients():
    """At radius 1 the auxiliary acceleration leads by 0 and beta, gamma are the trapezoidal rule's."""
    method = methods.generalised_alpha(1.0)
    assert method.positions == (0.25, 0.25)
    assert method.velocities == (0.5, 0.5)
    assert method.alpha_m == method.alpha_f == 0.5
    for radius in (0.2, 0.5, 0.8):
        method = methods.generalised_alpha(radius)
        # order 2 (Chung & Hulbert, eq. 17)
        assert method.velocities[1] == pytest.approx(0.5 - method.alpha_m + method.alpha_f)
