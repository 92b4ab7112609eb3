"""The short steps behind a jump of speed, of a material that damps."""

import numpy as np
import pytest

from ribbonfem import Ribbon, Scene, elastica, kirchhoff

NONE = (0.0, 0.0, 0.0)
GIVEN = {
    kirchhoff: {"compression": 0.40, "shear": 0.37, "start": "U+S-"},
    elastica: {"compression": 0.40, "shear": 0.0, "start": "U+"},
}


@pytest.mark.parametrize("method", ["esdirk4", "esdirk3", "tr-bdf2"])
@pytest.mark.parametrize("extensible", [False, True])
@pytest.mark.parametrize("model", [kirchhoff, elastica])
def test_what_newton_leaves_before_a_kink_is_no_velocity_behind_it(model, extensible, method):
    """Within a millionth of a second neither the energy of the motion nor its speed changes."""
    scene = Scene(
        **GIVEN[model], gravity=NONE, rate=0.5, stop=0.3, hold=0.05, ribbon=Ribbon(retardation=0.002)
    )
    run = model.simulate(scene, method=method, extensible=extensible)
    at = int(np.flatnonzero(np.abs(run.time - 0.6) < 1e-12)[0])
    rows = slice(at, at + 4)
    assert run.time[at + 3] - run.time[at] < 2e-6
    kinetic, velocity = run.energies["kinetic"][rows], run.velocity[rows]
    assert np.ptp(kinetic) < 1e-3 * kinetic[0]
    assert np.ptp(velocity) < 1e-2 * abs(velocity[0])
