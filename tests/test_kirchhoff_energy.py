"""The energy of an undamped ribbon in motion, and the method that keeps it."""

from dataclasses import replace

import numpy as np
import pytest

from ribbonfem import Scene, elastica, kirchhoff
from ribbonfem.policy import PolicyError

SNAP = Scene(compression=0.40, shear=0.37, start="U+S-", rate=0.5, stop=0.8, damping=1.0)


def balance(history):
    e = history.energies
    return e["kinetic"] + e["elastic"] + e["dissipated"] - e["work"]


@pytest.mark.parametrize("gyroscopic", [False, True])
@pytest.mark.parametrize("extensible", [False, True])
def test_discrete_gradient_balances_at_any_step(extensible, gyroscopic):
    """Work of a fast clamp and friction included: to what Newton leaves, with steps that resolve little."""
    case = replace(SNAP, rate=2.0, hold=0.5)
    policy = {"elements": 4, "extensible": extensible, "gyroscopic": gyroscopic, "step": 4e-3}
    history = kirchhoff.simulate(case, method="discrete-gradient", configurations=False, **policy)
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
    policy = {"extensible": extensible, "configurations": False}
    history = kirchhoff.simulate(case, method="discrete-gradient", step=1e-3, **policy)
    assert np.ptp(balance(history)) < 1e-5 * kinetic_at_snap(history)


@pytest.mark.slow
@pytest.mark.parametrize(
    "case",
    [
        replace(SNAP, rate=0.1, stop=0.585),
        Scene(compression=0.40, shear=0.0, start="U+", rate=0.1, stop=1.165),
    ],
)
def test_undamped_ringing_keeps_its_energy_for_twenty_seconds(case):
    case = replace(case, damping=0.0, hold=20.0)
    history = kirchhoff.simulate(case, method="discrete-gradient", step=1e-3, configurations=False)
    assert np.ptp(balance(history)) < 1e-4 * kinetic_at_snap(history)


def test_beams_have_no_discrete_gradient():
    case = Scene(compression=0.40, shear=0.0, start="U+", rate=0.5, stop=0.8)
    with pytest.raises(PolicyError, match="discrete-gradient"):
        elastica.simulate(case, method="discrete-gradient", step=1e-3)


def test_discrete_gradient_needs_a_step():
    with pytest.raises(PolicyError, match="step = None"):
        kirchhoff.simulate(SNAP, method="discrete-gradient")
