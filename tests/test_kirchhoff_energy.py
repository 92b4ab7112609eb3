"""The energy of an undamped ribbon in motion, and the method that keeps it."""

from dataclasses import replace

import numpy as np
import pytest

from ribbonfem import Scene, kirchhoff, quasilinear
from ribbonfem.options import OptionError

SNAP = Scene(compression=0.40, shear=0.37, start="U+S-", rate=0.5, stop=0.8, damping=1.0)


def balance(history):
    e = history.energies
    return e["kinetic"] + e["elastic"] + e["dissipated"] - e["work"]


@pytest.mark.parametrize("gyroscopic", [False, True])
@pytest.mark.parametrize("extensible", [False, True])
def test_discrete_gradient_balances_at_any_step(extensible, gyroscopic):
    """Work of a fast clamp and friction included: to what Newton leaves, with steps that resolve little."""
    case = replace(SNAP, rate=2.0, hold=0.5)
    options = {"elements": 4, "extensible": extensible, "gyroscopic": gyroscopic, "step": 4e-3}
    history = kirchhoff.simulate(case, method="discrete-gradient", configurations=False, **options)
    assert history.energies["kinetic"].max() > 1.0
    assert history.energies["dissipated"][-1] > 1.0
    # the impulse of each kink is balanced too
    assert np.ptp(balance(history)) < 1e-6


def kinetic_at_snap(history):
    return np.interp(history.crossing()[0], history.time, history.energies["kinetic"])


@pytest.mark.parametrize("extensible", [False, True])
def test_undamped_ringing_keeps_its_energy(extensible):
    """A second beyond a snap that nothing damps."""
    case = replace(SNAP, rate=0.1, stop=0.585, damping=0.0, hold=1.2)
    options = {"extensible": extensible, "configurations": False}
    history = kirchhoff.simulate(case, method="discrete-gradient", step=1e-3, **options)
    assert np.ptp(balance(history)) < 1e-5 * kinetic_at_snap(history)


@pytest.mark.parametrize("extensible", [False, True])
def test_its_steps_adapt(extensible):
    """Short where the ribbon rings after its snap, long before; the snap within what the tolerance leaves."""
    case = replace(SNAP, rate=0.1, stop=0.585, damping=0.0, hold=0.5)
    options = {"extensible": extensible, "configurations": False}
    fine = kirchhoff.simulate(case, tolerance=1e-6, until="snap", **options).crossing()[0]
    errors = []
    for tolerance in (1e-3, 3e-5):
        history = kirchhoff.simulate(case, method="discrete-gradient", tolerance=tolerance, **options)
        steps = np.diff(history.time)
        before = (history.time[1:] > 3.0) & (history.time[1:] < 5.0)
        assert np.median(steps[history.time[1:] > fine + 0.2]) < 0.5 * np.median(steps[before])
        assert np.ptp(balance(history)) < 1e-4 * kinetic_at_snap(history)
        errors.append(abs(history.crossing()[0] - fine))
    assert history.options["tolerance"] == 3e-5
    assert errors[1] < 2e-4
    # of order 2: the error in proportion to the tolerance to the power 2 / 3
    assert errors[1] < 0.2 * errors[0], errors


@pytest.mark.slow
@pytest.mark.parametrize(("steps", "bound"), [({"step": 1e-3}, 1e-4), ({"tolerance": 1e-4}, 1e-3)])
@pytest.mark.parametrize(
    "case",
    [
        replace(SNAP, rate=0.1, stop=0.585),
        Scene(compression=0.40, shear=0.0, start="U+", rate=0.1, stop=1.165),
    ],
)
def test_undamped_ringing_keeps_its_energy_for_twenty_seconds(case, steps, bound):
    case = replace(case, damping=0.0, hold=20.0)
    history = kirchhoff.simulate(case, method="discrete-gradient", configurations=False, **steps)
    drift, seconds = np.ptp(balance(history)) / kinetic_at_snap(history), history.stats["seconds"]
    print(f"{steps}: {drift:.1e} of the kinetic energy at the snap, {seconds:.0f} s")
    assert drift < bound


def test_the_beam_of_small_slopes_has_no_discrete_gradient():
    case = Scene(compression=0.40, shear=0.0, start="U+", rate=0.5, stop=0.8)
    with pytest.raises(OptionError, match="discrete-gradient"):
        quasilinear.simulate(case, method="discrete-gradient", step=1e-3)
