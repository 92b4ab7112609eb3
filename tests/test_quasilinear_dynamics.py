"""Motion of the quasi-linear beam."""

from dataclasses import replace

import numpy as np
import pytest

from ribbonfem import Scene, SceneError, quasilinear
from ribbonfem.continuation import equilibrium
from ribbonfem.stepping import kernels
from ribbonfem.stepping.newmark import _scratch

SCENE = Scene(compression=0.4, shear=0.0, start="U+", rate=0.1, stop=1.4, damping=1.0)


def test_kernel_is_the_readable_form():
    """One Newton increment of the kernel against the dense equations of scikit-fem's matrices."""
    problem = quasilinear.functions.Statics(SCENE, 9)
    table = quasilinear.functions.tables(problem)
    rng = np.random.default_rng(1)
    size = 20
    q, v, a = (rng.normal(size=size) for _ in range(3))
    w = np.array([33.0])
    b, g, nu = 0.3, 0.6, 1.7
    stiffness, tension, mass = (m.toarray() for m in (problem.stiffness, problem.tension, problem.mass))
    free = slice(2, 18)
    residual = mass @ (a + nu * v) + (stiffness - w[0] * tension) @ q
    dense = np.zeros((17, 17))
    dense[:16, :16] = ((1 + nu * g) / b * mass + stiffness - w[0] * tension)[free, free]
    dense[16, :16] = dense[:16, 16] = -(tension @ q)[free]
    increment = np.linalg.solve(dense, -np.append(residual[free], 1.0 - 0.5 * q @ tension @ q))
    q1, w1 = q.copy(), w.copy()
    kernels.newton_quasilinear(table, _scratch(table, q, w), q1, v.copy(), a.copy(), w1, b, g, nu, 1e9)
    found = np.append((q1 - q)[free], w1 - w)
    assert np.abs(found - increment).max() < 1e-10 * np.abs(increment).max()
    assert np.all(q1[[0, 1, 18, 19]] == q[[0, 1, 18, 19]])


def test_velocities_at_the_kink_are_consistent():
    """The clamp's slope carries mass: its jump moves the rest, with the least kinetic energy that may be."""
    problem = quasilinear.functions.Statics(SCENE, 12)
    table = quasilinear.functions.tables(problem)
    state, _ = equilibrium(problem, problem.start(), 0.0)
    q, w = state.z.copy(), np.array([state.load])
    v, a = np.zeros_like(q), np.zeros_like(q)
    spin, nu = -0.7, 0.9
    impulse = kernels.project_quasilinear(table, _scratch(table, q, w), q, v, a, w, spin, nu)
    mass, tension, stiffness = problem.mass, problem.tension, problem.stiffness
    free = slice(2, 24)
    row = (tension @ q)[free]
    # momentum is left alone but for the constraint's own impulse
    momentum = (mass @ v)[free]
    assert np.abs(momentum - row * (row @ momentum) / (row @ row)).max() < 1e-15
    assert abs(q @ tension @ v) < 1e-13
    assert v[1] == spin
    assert 0.5 * spin * impulse == pytest.approx(0.5 * v @ mass @ v, rel=1e-12)
    # and the accelerations keep the length to second order
    assert abs(q @ tension @ a + v @ tension @ v) < 1e-9
    forces = (mass @ (a + nu * v) + (stiffness - w[0] * tension) @ q)[free]
    assert np.abs(forces).max() < 1e-9


def test_snap_converges_with_the_fourth_power_of_the_mesh():
    angle = {
        n: quasilinear.simulate(SCENE, elements=n, step=0.01, until="snap").crossing("height")[1]
        for n in (8, 16, 64)
    }
    order = np.log2(abs(angle[8] - angle[64]) / abs(angle[16] - angle[64]))
    assert 3.7 < order < 4.4


def test_default_snap_and_its_cost():
    """To 1e-4 of what Richardson's rule in the step gives, in few steps."""
    history = quasilinear.simulate(SCENE, until="snap")
    coarse, fine = (
        quasilinear.simulate(SCENE, step=s, until="snap").crossing("height")[1] for s in (0.005, 0.0025)
    )
    assert abs(history.crossing("height")[1] - (4 * fine - coarse) / 3) < 3e-5
    assert history.stats["steps"] < 800
    assert history.stats["newton_iterations"] < 4000


def test_length_is_kept_and_the_mirror_image_is_one():
    up = quasilinear.simulate(replace(SCENE, rate=2.0), elements=16, step=0.01)
    assert np.abs(up.configurations["positions"][:, -1, 0] - 0.6).max() < 1e-9
    down = quasilinear.simulate(replace(SCENE, rate=-2.0, stop=-1.4, start="U-"), elements=16, step=0.01)
    assert np.abs(up.height + down.height).max() < 1e-9
    assert np.abs(up.slope + down.slope).max() < 1e-9


def test_at_rest_it_stays_in_the_start_state():
    """A clamp that hardly moves leaves the beam where it was, on the side of its name."""
    case = replace(SCENE, rate=1e-9, stop=1e-8, damping=1.0)
    history = quasilinear.simulate(case, elements=33)
    branch = quasilinear.equilibria(SCENE, elements=33)
    height = branch.height[branch.angle == 0.0][0]
    assert np.abs(history.height - height).max() < 1e-7
    assert height > 0.0


def test_refusals():
    with pytest.raises(SceneError, match="stop"):
        quasilinear.simulate(replace(SCENE, stop=None))
    with pytest.raises(SceneError, match="shear"):
        quasilinear.simulate(Scene(stop=1.0))
