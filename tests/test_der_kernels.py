import numpy as np
import pytest

from der import kernels

N, REST = 9, 0.1
STIFFNESS = np.array([400.0, 1.0, 1.4562])
STRETCH = np.full(N - 1, 1.2e3 * REST)
STRETCH[[0, -1]] = 0.0


def crumpled(seed=0):
    """A strongly bent, twisted and stretched rod."""
    rng = np.random.default_rng(seed)
    x = np.cumsum(0.3 * rng.normal(size=(N, 3)) + [1.0, 0.0, 0.0], axis=0) * REST
    t = np.diff(x, axis=0)
    m1 = np.cross(t, rng.normal(size=(N - 1, 3)))
    m1 /= np.linalg.norm(m1, axis=1)[:, None]
    twist = np.zeros(N)
    carry(x, m1, twist, x, np.zeros(N), m1, twist)
    return x, m1, twist


def edges(x):
    tangent, inverse = np.empty((N - 1, 3)), np.empty(N - 1)
    kernels.edges(x, tangent, inverse)
    return tangent, inverse


def carry(x_old, m1_old, twist_old, x, turn, m1, twist):
    kernels.carry(edges(x_old)[0], m1_old, twist_old, edges(x)[0], turn, m1, twist)


STRAIGHT, RESTING = np.zeros((N, 2)), np.zeros((N, 4))


def assemble(x, m1, twist, second=True, shape=STRAIGHT, viscous=RESTING, rise=1.0):
    gradient, hessian, energies = np.zeros(4 * N), np.zeros((4 * N + 10, 11)), np.zeros(3)
    sums = gradient, hessian, energies
    kernels.assemble((STIFFNESS, REST, STRETCH, shape), *edges(x), m1, twist, viscous, rise, *sums, second, N)
    return energies.sum(), gradient, hessian


def moved(state, q):
    x, m1, twist = state
    dx, turn = q.reshape(N, 4)[:, :3], np.ascontiguousarray(q.reshape(N, 4)[:, 3])
    new_m1, new_twist = np.empty_like(m1), twist.copy()
    carry(x, m1, twist, x + dx, turn, new_m1, new_twist)
    return x + dx, new_m1, new_twist


def dense(hessian):
    n = 4 * N - 1
    full = np.zeros((n, n))
    for d in range(11):
        for i in range(n - d):
            full[i + d, i] = full[i, i + d] = hessian[i, d]
    return full


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_gradient_and_hessian_against_differences(seed):
    state = crumpled(seed)
    # the last one of a naturally bent and twisted rod
    shape = 0.3 * np.random.default_rng(seed).normal(size=(N, 2)) * (seed == 2)
    _, gradient, hessian = assemble(*state, shape=shape)
    n, h = 4 * N - 1, 1e-5
    slope, curvature = np.zeros(n), np.zeros((n, n))
    for i in range(n):
        unit = np.zeros(4 * N)
        unit[i] = h
        values = [assemble(*moved(state, k * unit), second=False, shape=shape) for k in (-2, -1, 1, 2)]
        weights = np.array([1.0, -8.0, 8.0, -1.0]) / (12 * h)
        slope[i] = sum(w * v[0] for w, v in zip(weights, values, strict=True))
        curvature[:, i] = sum(w * v[1] for w, v in zip(weights, values, strict=True))[:n]
    assert np.abs(slope - gradient[:n]).max() < 1e-10 * np.abs(gradient).max()
    symmetric = 0.5 * (curvature + curvature.T)
    assert np.abs(symmetric - dense(hessian)).max() < 1e-10 * np.abs(curvature).max()
    # what is left out is there, away from equilibrium: the frames' holonomy
    assert np.abs(curvature - curvature.T).max() > 1e-3 * np.abs(curvature).max()


def resist(state, velocity, retardation=0.7):
    strains, viscous = np.zeros((N, 4)), np.zeros((N, 4))
    x, m1, twist = state
    none = np.zeros(0)
    rod = kernels.Rod(STIFFNESS, REST, STRETCH, none, none, STRAIGHT, none, retardation)
    kernels.resist(rod, *edges(x), m1, twist, velocity, strains, viscous)
    return strains, viscous


def test_viscous_moments_are_of_the_strains_rates():
    """Rates by differences; and the Hessian of stages, at velocities that are increments times a pace."""
    state, h = crumpled(), 1e-6
    velocity = np.random.default_rng(5).normal(size=4 * N)
    velocity[-1] = 0.0
    strains, viscous = resist(state, velocity)
    sides = [resist(moved(state, side * h * velocity), velocity)[0] for side in (-1.0, 1.0)]
    rates = (sides[1] - sides[0]) / (2.0 * h)
    inner = np.arange(1, N - 1)
    for c, stiffness in enumerate((400.0 / REST, 1.0 / REST, 1.4562 / REST)):
        expected = 0.7 * stiffness * rates[inner, c]
        assert np.abs(viscous[inner, c] - expected).max() < 1e-7 * np.abs(expected).max()
    expected = 0.7 * STRETCH[inner] / REST * rates[inner, 3]
    assert np.abs(viscous[inner, 3] - expected).max() < 1e-7 * np.abs(expected).max()
    assert np.array_equal(strains[inner, 2], state[2][inner])
    # the power of the viscous forces is what the strains lose, and never negative
    forces = assemble(*state, second=False, viscous=viscous)[1] - assemble(*state, second=False)[1]
    lengths = np.array([1.0, 1.0, 1.0, REST])
    assert np.isclose(forces @ velocity, (viscous * rates * lengths)[inner].sum(), rtol=1e-7)
    assert forces @ velocity > 0.0
    # of a straight rod in a stage: stiffer by r times the pace
    pace, unit = 3.0, np.zeros(4 * N)
    straight = (
        REST * np.arange(N)[:, None] * [1.0, 0.0, 0.0],
        np.tile([0.0, 0.0, 1.0], (N - 1, 1)),
        np.zeros(N),
    )
    full = dense(assemble(*straight, rise=1.0 + 0.7 * pace)[2])
    for k in (13, 14, 15, 17, 19):
        unit[:] = 0.0
        unit[k] = h
        there = moved(straight, unit)
        force = assemble(*there, second=False, viscous=resist(there, pace * unit)[1])[1]
        assert np.abs(force[:-1] / h - full[:, k]).max() < 1e-4 * np.abs(full[:, k]).max()


def test_rigid_motion():
    x, m1, twist = crumpled()
    energy, gradient, _ = assemble(x, m1, twist, second=False)
    rng = np.random.default_rng(3)
    q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    q *= np.sign(np.linalg.det(q))
    turned, turned_gradient, _ = assemble(x @ q.T + [1.0, 2.0, 3.0], m1 @ q.T, twist, second=False)
    assert np.isclose(turned, energy, rtol=1e-12)
    forces, turned_forces = gradient.reshape(N, 4)[:, :3], turned_gradient.reshape(N, 4)[:, :3]
    assert np.allclose(forces @ q.T, turned_forces, atol=1e-9 * np.abs(forces).max())
    assert np.abs(forces.sum(axis=0)).max() < 1e-11 * np.abs(forces).max()


def test_mirror_leaves_the_energy():
    x, m1, twist = crumpled()
    mirror = np.array([1.0, 1.0, -1.0])
    energy, gradient, _ = assemble(x, m1, twist, second=False)
    # a reflected frame is left-handed: both directors of the pair cannot keep their image
    image, image_gradient, _ = assemble(x * mirror, -m1 * mirror, -twist, second=False)
    assert np.isclose(image, energy, rtol=1e-13)
    assert np.allclose(image_gradient.reshape(N, 4)[:, :3], gradient.reshape(N, 4)[:, :3] * mirror)


def test_pure_twist_and_full_turns():
    x = REST * np.arange(N)[:, None] * np.array([1.0, 0.0, 0.0])
    m1, twist = np.tile([0.0, 0.0, 1.0], (N - 1, 1)), np.zeros(N)
    state = (x, m1, twist)
    # 40 steps of 1/4 turn at the far end, spread evenly: ten full turns
    for _ in range(40):
        q = np.zeros((N, 4))
        q[: N - 1, 3] = 0.5 * np.pi * np.arange(N - 1) / (N - 2)
        state = moved(state, q.ravel())
    energy = assemble(*state, second=False)[0]
    total = 20.0 * np.pi
    assert np.isclose(state[2].sum(), total)
    assert np.isclose(energy, 0.5 * STIFFNESS[2] * total**2 / (REST * (N - 2)))


def test_factor_solve_and_inertia_against_dense():
    _, _, hessian = assemble(*crumpled())
    first, last = kernels.FIRST, 4 * N - 8
    full = dense(hessian)[first:last, first:last]
    factors = hessian.copy()
    negative = kernels.factor(factors, first, last)
    assert negative == (np.linalg.eigvalsh(full) < 0).sum()
    right = np.random.default_rng(1).normal(size=(last - first, 3))
    x = kernels.solve_refined(hessian, factors, first, right)
    assert np.abs(full @ x - right).max() < 1e-9
