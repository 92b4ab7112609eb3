"""The ribbon at rest: derivatives, order, check values, symmetries, states, independent integration."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import root

import der
from ribbonfem import Ribbon, Scene, SceneError, SolverError, kirchhoff
from ribbonfem.continuation import Steps, first_point, trace
from ribbonfem.drive import CONTROLS
from ribbonfem.ends import Ends
from ribbonfem.kirchhoff.kernels import statics as kernels
from ribbonfem.kirchhoff.problem import Frames, Statics
from ribbonfem.kirchhoff.states import named
from ribbonfem.options import OptionError

PATH2 = Scene(compression=0.40, shear=0.40, start="U+S+")


def lagrangian(problem, g, force, chord, loads):
    """The Lagrangian, written for complex arguments and without the kernel; loads (E, p, 3)."""
    tables, total = problem.tables, force @ chord
    for e in range(tables.elements):
        nodes = g[e * tables.degree : (e + 1) * tables.degree + 1]
        q, p = tables.value @ nodes, tables.slope[e] @ nodes
        w, v, dw, dv = q[:, 0], q[:, 1:], p[:, 0], p[:, 1:]
        square = np.sum(q * q, axis=1)
        kappa = 2 * (w[:, None] * dv - dw[:, None] * v - np.cross(v, dv)) / square[:, None]
        # natural curvature about the width bends towards the normal: -kappa2 is the strain
        curvature, twist = problem.ribbon.natural(tables.points[e])
        kappa = kappa - np.stack((twist, -curvature, 0 * twist), axis=1)
        x, y, z = v.T
        tangent = np.stack((w * w + x * x - y * y - z * z, 2 * (x * y + w * z), 2 * (x * z - w * y)), axis=1)
        pull = np.sum(tangent * (force + loads[e]), axis=1) / square
        density = 0.5 * kappa**2 @ problem.stiffness - pull - 0.5 * problem.compliance * pull**2
        total = total + tables.weights[e] @ density
    return total


def turned(angle, twist):
    """Quaternion of Ry(angle) Rx(twist), one after the other."""
    y, x = np.array([np.cos(angle / 2), np.sin(angle / 2)]), np.array([np.cos(twist / 2), np.sin(twist / 2)])
    return np.array([y[0] * x[0], y[0] * x[1], y[1] * x[0], -y[1] * x[1]])


def random_rod(extensible, vary="left"):
    """A loaded rod of a natural shape, far from equilibrium; its Lagrangian by increments and parameter."""
    rng = np.random.default_rng(3)
    value, fixed = 0.3, 0.3 * rng.normal(size=8)
    moved = np.array([name == vary for name in CONTROLS], dtype=float)
    fixed[moved > 0] = 0.0
    chord, weight = np.array([0.6, -0.3, 0.0]), np.array([1.0, -2.0, -5.0])
    ribbon = Ribbon(thickness=0.1, curvature=(1.0, -2.0, 0.5), twist=0.7)
    problem = Statics(ribbon, Ends(fixed, moved, chord, weight), elements=4, extensible=extensible, degree=3)
    g = np.array([1.0, 0, 0, 0]) + 0.3 * rng.normal(size=(len(problem.tables.nodes), 4))
    g /= np.linalg.norm(g, axis=1)[:, None]
    g[0], g[-1] = problem.ends.left(value)[0], problem.ends.right(value)[0]
    state = Frames(g, 20 * rng.normal(size=3), value)
    basis = problem.assembled(state, value)[2]
    points = problem.tables.points[:, :, None]

    def energy(x, parameter):
        left, right, twist_left, twist_right, compression, shear, lift, force = fixed + moved * parameter
        held = g.astype(complex)
        held[1:-1] += np.einsum("nrs,ns->nr", basis[1:-1], x[:-3].reshape(-1, 3))
        held /= np.sqrt(np.sum(held * held, axis=1))[:, None]
        held[0], held[-1] = turned(left, twist_left), turned(-right, twist_right)
        reach = chord + [-compression, -shear, lift]
        loads = (1.0 - points) * weight + (points < 0.5) * np.array([0.0, 0.0, -force])
        return lagrangian(problem, held, state.force + x[-3:], reach, loads)

    return problem, state, value, energy


def gradient(energy, x, parameter):
    result = np.empty(len(x))
    for i in range(len(x)):
        step = x.astype(complex)
        step[i] += 1e-30j
        result[i] = energy(step, parameter).imag / 1e-30
    return result


def central(function, h):
    """Fourth-order derivative at 0."""
    return (8 * (function(h) - function(-h)) - (function(2 * h) - function(-2 * h))) / (12 * h)


def dense(problem, state, parameter):
    """Hessian in increments, as a full matrix."""
    _, _, _, band, border, corner, *_ = problem.assembled(state, parameter)
    n = len(band)
    matrix = np.zeros((n + 3, n + 3))
    for d in range(band.shape[1]):
        rows = np.arange(n - d)
        matrix[rows + d, rows] = matrix[rows, rows + d] = band[: n - d, d]
    matrix[n:, :n], matrix[:n, n:] = border, border.T
    matrix[n:, n:] = np.triu(corner) + np.triu(corner, 1).T
    return matrix


def in_increments(problem, state, parameter, vector):
    basis = problem.assembled(state, parameter)[2]
    result = np.empty((3 * (len(basis) - 2) + 3, 1))
    kernels.to_increments(basis, np.ascontiguousarray(vector[:, None]), result)
    return result[:, 0]


@pytest.mark.parametrize("extensible", [False, True])
def test_gradient_and_hessian_are_derivatives_of_the_lagrangian(extensible):
    problem, state, value, energy = random_rod(extensible)
    matrix = dense(problem, state, value)
    zero = np.zeros(len(matrix))
    residual = in_increments(problem, state, value, problem.assembled(state, value)[0])
    exact = gradient(energy, zero, value)
    assert np.abs(residual - exact).max() < 1e-13 * np.abs(exact).max()
    for i in [*range(0, len(zero), 4), *range(len(zero) - 3, len(zero))]:
        unit = np.eye(len(zero))[i]
        column = central(lambda h, unit=unit: gradient(energy, h * unit, value), 1e-4)
        assert np.abs(matrix[i] - column).max() < 1e-10 * np.abs(matrix).max(), i


@pytest.mark.parametrize("vary", CONTROLS)
def test_parameter_derivative_of_the_residual(vary):
    problem, state, value, energy = random_rod(True, vary)
    zero = np.zeros(3 * (len(state.g) - 2) + 3)
    column = in_increments(problem, state, value, problem.assembled(state, value)[1])
    exact = central(lambda h: gradient(energy, zero, value + h), 1e-3)
    assert np.abs(column - exact).max() < 1e-9 * max(1.0, np.abs(exact).max())


@pytest.mark.parametrize("extensible", [False, True])
def test_index_is_that_of_dense_eigenvalues(extensible):
    problem, state, value, _ = random_rod(extensible)
    assert (
        problem.linearise(state, value).index
        == np.sum(np.linalg.eigvalsh(dense(problem, state, value)) < 0) - 3
    )
    # and on the way along a real curve, where it is small
    problem, start = named(PATH2, elements=8, extensible=extensible)
    seen = set()
    for segment in trace(problem, first_point(problem, start, 0.0, 1.0), (-1.5, 1.5)):
        end = segment.end
        negative = np.sum(np.linalg.eigvalsh(dense(problem, end.state, end.parameter)) < 0)
        assert end.index == negative - 3
        seen.add(end.index)
    assert seen >= {0, 1, 2}


def test_residual_and_tangent_do_not_depend_on_the_sign_or_path_of_the_frames():
    problem, state, value, _ = random_rod(False)
    rng = np.random.default_rng(0)
    increment = 1e-2 * rng.normal(size=4 * (len(state.g) - 2) + 3)
    there = problem.advance(state, increment, value)
    assert np.allclose(np.linalg.norm(there.g, axis=1), 1.0, atol=1e-15)
    one, two = problem.linearise(there, value), problem.linearise(Frames(-there.g, there.force, value), value)
    assert np.allclose(one.residual[:-3], -two.residual[:-3], atol=1e-10)
    assert one.index == two.index
    assert np.allclose(one.residual[-3:], two.residual[-3:], atol=1e-12)


# field values agreed on by collocation, shooting and extrapolated rods
CHECKS = [
    (Scene(compression=0.20, shear=0.0, start="U+"), False, [(0.7995539543, 0.1415531710)]),
    (Scene(compression=0.40, shear=0.0, start="U+"), False, [(1.1230897421, 0.1782653744)]),
    (PATH2, False, [(0.1607329979, 0.2475209), (0.4458846258, 0.0934660)]),
    (replace(PATH2, start="U+S-"), False, [(0.4458846258, 0.0934660)]),
    (PATH2, True, [(0.160964943, None), (0.444944267, None)]),
    (Scene(compression=0.20, shear=0.0, start="U+"), True, [(0.7988593221, 0.1414246)]),
    (Scene(compression=0.40, shear=0.0, start="U+"), True, [(1.1227538843, 0.1782074)]),
]


@pytest.mark.parametrize(("scene", "extensible", "expected"), CHECKS)
def test_folds_have_their_check_values(scene, extensible, expected):
    result = kirchhoff.folds(scene, extensible=extensible)
    assert len(result) == len(expected)
    for fold, (angle, height) in zip(result, expected, strict=True):
        assert fold.angle == pytest.approx(angle, abs=6e-10)
        if height is not None:
            assert fold.height == pytest.approx(height, abs=6e-8)


def test_fold_converges_with_the_tenth_power_of_the_mesh():
    meshes = np.array([6, 8, 10, 12])
    fine = kirchhoff.folds(PATH2)
    for k in range(2):
        errors = [abs(kirchhoff.folds(PATH2, elements=int(n))[k].angle - fine[k].angle) for n in meshes]
        order = -np.polyfit(np.log(meshes), np.log(errors), 1)[0]
        assert 8.5 < order < 12.5, (order, errors)


def test_whole_branch_has_its_four_folds_at_a_coarse_mesh():
    problem, start = named(PATH2, elements=20, extensible=False)
    result = []
    for segment in trace(problem, first_point(problem, start, 0.0, 1.0), (-1.5, 1.5)):
        result += [event.point.parameter for event in segment.events]
        if len(result) == 4:
            break
    # fifth-degree elements, 64 of them
    assert result == pytest.approx(
        [0.160732997913, -0.517446886131, 0.445884625849, -1.344187015724], abs=1e-8
    )


def test_branch_has_the_start_state_as_a_row_and_its_stable_sheets():
    branch = kirchhoff.equilibria(PATH2, elements=12)
    row = int(np.flatnonzero(branch.angle == 0.0)[0])
    rest = kirchhoff.state(PATH2, elements=12)
    assert branch.height[row] == pytest.approx(rest.height, abs=1e-12)
    assert branch.configurations[row] == pytest.approx(rest.positions, abs=1e-12)
    assert branch.stable[row]
    assert branch.angle[0] == -1.5
    assert np.all(np.abs(branch.angle) <= 1.5)
    # stability changes at folds and nowhere else: U+S+, then U+S- between the second and third fold
    assert np.count_nonzero(np.diff(branch.stable)) == 3
    assert np.abs(branch.configurations[:, -1] - [0.6, -0.4, 0.0]).max() < 1e-9


@pytest.mark.parametrize("extensible", [False, True])
def test_state_solves_the_equations_of_the_rod(extensible):
    """Kirchhoff's differential equations, integrated and shot to the right clamp."""
    section = Ribbon(thickness=0.05, bending_ratio=400.0, twist_ratio=1.4562)
    scene = Scene(compression=0.40, shear=0.37, ribbon=section)
    state = kirchhoff.state(scene, extensible=extensible)
    ribbon = scene.ribbon
    stiffness = np.array([ribbon.bending_ratio, 1.0, ribbon.twist_ratio])
    compliance = 1.0 / ribbon.stretch_ratio if extensible else 0.0

    def rates(s, y):
        directors, moment, force = y[3:12].reshape(3, 3), y[12:15], y[15:18]
        omega = ((directors @ moment) / stiffness) @ directors
        stretched = (1 + compliance * (force @ directors[2])) * directors[2]
        return np.concatenate(
            (stretched, np.cross(omega, directors).ravel(), -np.cross(stretched, force), np.zeros(3))
        )

    clamp = np.array([[0.0, 0, 1], [0, -1, 0], [1, 0, 0]])
    first = np.array(
        [
            np.polyval(np.polyfit(state.points[:6], k[:6], 5), 0)
            for k in (state.kappa1, state.kappa2, state.tau)
        ]
    )
    guess = np.concatenate(((stiffness * first) @ clamp, state.force))

    def shot(x, at=1.0):
        y0 = np.concatenate((np.zeros(3), clamp.ravel(), x))
        return solve_ivp(rates, (0, at), y0, method="DOP853", rtol=1e-12, atol=1e-12).y[:, -1]

    def miss(x):
        end = shot(x)
        d = end[3:12].reshape(3, 3)
        turned = np.array([d[0] @ clamp[1], d[0] @ clamp[2], d[1] @ clamp[2]])
        return np.concatenate((end[:3] - [0.6, -0.37, 0.0], turned))

    solution = root(miss, guess, tol=1e-11)
    assert np.abs(miss(solution.x)).max() < 1e-9
    assert solution.x == pytest.approx(guess, rel=1e-5)
    middle = shot(solution.x, 0.5)
    assert middle[2] == pytest.approx(state.height, abs=1e-9)
    assert middle[11] == pytest.approx(state.slope, abs=1e-8)
    assert solution.x[3:] == pytest.approx(state.force, rel=1e-7)


@pytest.mark.parametrize("extensible", [False, True])
def test_end_force_is_the_derivative_of_the_energy(extensible):
    def energy(compression=0.40, shear=0.37):
        return kirchhoff.state(Scene(compression=compression, shear=shear), extensible=extensible).energy

    force = kirchhoff.state(Scene(), extensible=extensible).force
    assert -force[0] == pytest.approx(central(lambda h: energy(compression=0.40 + h), 2e-3), rel=1e-6)
    assert -force[1] == pytest.approx(central(lambda h: energy(shear=0.37 + h), 2e-3), rel=1e-6)


def test_states_have_their_names_and_are_images_of_one_another():
    states = {name: kirchhoff.state(replace(PATH2, start=name)) for name in ("U+S+", "U+S-", "U-S+", "U-S-")}
    for name, state in states.items():
        assert state.name == name
        assert state.index == 0
        assert (state.height > 0) == (name[:2] == "U+")
        middle = state.positions[len(state.positions) // 2]
        assert (middle[0] > 0.3) == (name[2:] == "S+")
        assert (state.slope > 0) == (name in ("U+S-", "U-S+"))
        assert state.energy == pytest.approx(states["U+S+"].energy, abs=1e-10)
    base = states["U+S+"]
    assert states["U-S+"].positions == pytest.approx(base.positions * [1, 1, -1], abs=1e-10)
    reversed_ = np.array([0.6, -0.4, 0.0]) - base.positions[::-1]
    assert states["U-S-"].positions == pytest.approx(reversed_, abs=1e-10)
    # curvatures under the mirror: of bending about the width and the twist change sign
    assert states["U-S+"].kappa2 == pytest.approx(-base.kappa2, abs=1e-8)
    assert np.abs(states["U-S-"].kappa2) == pytest.approx(np.abs(base.kappa2[::-1]), abs=1e-8)


def test_directors_are_the_clamps_of_the_paper_and_follow_the_curve():
    state = kirchhoff.state(PATH2)
    clamp = np.array([[0.0, 0, 1], [0, -1, 0], [1, 0, 0]])
    assert state.directors[0] == pytest.approx(clamp, abs=1e-14)
    assert state.directors[-1] == pytest.approx(clamp, abs=1e-14)
    assert np.einsum("nij,nkj->nik", state.directors, state.directors) == pytest.approx(
        np.broadcast_to(np.eye(3), state.directors.shape), abs=1e-13
    )
    assert np.linalg.det(state.directors) == pytest.approx(1.0, abs=1e-13)
    turned = named(PATH2, elements=8, extensible=False)[0].ends
    w, _, y, _ = turned.left(0.3)[0]
    assert [w * w - y * y, -2 * w * y] == pytest.approx([np.cos(0.3), -np.sin(0.3)], abs=1e-15)


def test_mirrored_ramps_meet_mirrored_folds():
    down = replace(PATH2, start="U-S+", rate=-0.1)
    for fold, image in zip(kirchhoff.folds(PATH2), kirchhoff.folds(down), strict=True):
        assert image.angle == pytest.approx(-fold.angle, abs=1e-11)
        assert image.height == pytest.approx(-fold.height, abs=1e-9)
        assert image.load == pytest.approx(fold.load, abs=1e-7)
    back = kirchhoff.folds(replace(PATH2, shear=-0.40))
    assert [f.angle for f in back] == pytest.approx([f.angle for f in kirchhoff.folds(PATH2)], abs=1e-11)


def test_negative_shear_is_the_mirror_image():
    state, image = kirchhoff.state(PATH2), kirchhoff.state(replace(PATH2, shear=-0.40))
    assert image.name == "U+S+"
    assert image.positions == pytest.approx(state.positions * [1, -1, 1], abs=1e-10)
    assert image.tau == pytest.approx(-state.tau, abs=1e-8)


def test_planar_state_is_the_elastica_and_the_limit_of_little_shear():
    flat = kirchhoff.state(Scene(shear=0.0, start="U-"))
    assert np.abs(flat.positions[:, 1]).max() < 1e-14
    assert np.abs(flat.kappa1).max() < 1e-12
    assert np.abs(flat.tau).max() < 1e-12
    # Euler's pendulum: kappa2'' + load sin(phi) = 0 has the first integral kappa2^2 / 2 - load cos(phi)
    cosine = np.interp(flat.points, flat.s, flat.directors[:, 2, 0])
    first = 0.5 * flat.kappa2**2 + flat.force[0] * cosine
    assert np.ptp(first) < 2e-2 * np.abs(first).max()
    little = kirchhoff.state(Scene(shear=1e-6, start="U-"))
    assert little.height == pytest.approx(flat.height, abs=1e-11)
    assert little.energy - flat.energy == pytest.approx(0.0, abs=1e-9)


def test_pitchforks_are_where_the_states_change():
    forks = kirchhoff.pitchforks(0.40)
    assert forks.broken == pytest.approx(0.3331031298, abs=1e-8)
    assert forks.merged == pytest.approx(0.4906103490, abs=1e-8)
    assert forks.restored == pytest.approx(0.5694297380, abs=1e-8)
    us = ("U+S+", "U+S-", "U-S+", "U-S-")
    for shear, expected in (
        (forks.broken - 1e-4, ("U+", "U-")),
        (forks.broken + 1e-4, us),
        (forks.merged - 1e-4, us),
        (forks.merged + 1e-4, ("S+", "S-")),
        (forks.restored - 1e-3, ("S+", "S-")),
        (forks.restored + 1e-3, ("U+", "U-", "S+", "S-")),
    ):
        scene = Scene(shear=shear, start="U+")
        assert kirchhoff.stable_states(scene, elements=20) == expected, shear


@pytest.mark.parametrize("compression", [0.2, 0.4])
def test_shear_curves_meet_at_the_pitchforks(compression):
    forks = kirchhoff.pitchforks(compression, elements=12)
    u, us, s = kirchhoff.shear_curves(compression, elements=12)
    assert [curve.family for curve in (u, us, s)] == ["U", "US", "S"]
    unstable = u.shear[~u.stable]
    assert forks.broken < unstable.min()
    assert unstable.max() < forks.restored
    assert np.all(np.diff(us.shear) > 0)
    assert us.shear[[0, -1]] == pytest.approx([forks.broken, forks.merged], abs=1e-6)
    assert us.stable[1:-1].all()
    assert np.all(np.diff(np.abs(us.height)) < 0)
    assert us.height[-1] == pytest.approx(0.0, abs=1e-4)
    assert s.shear[0] == pytest.approx(forks.merged, abs=1e-9)
    assert np.all(np.diff(s.shear) > 0)
    assert np.abs(s.height[1:]).max() < 1e-12
    # US has less energy than the unbroken U beside it, S less than U
    assert np.all(np.interp(us.shear[1:], u.shear, u.energy) > us.energy[1:])
    assert np.all(np.interp(s.shear, u.shear, u.energy)[:-3] > s.energy[:-3])


@pytest.mark.slow
@pytest.mark.parametrize("compression", [0.2, 0.3, 0.5])
def test_pitchforks_do_not_depend_on_the_mesh(compression):
    one, two = (kirchhoff.pitchforks(compression, elements=n) for n in (32, 44))
    for name in ("broken", "merged", "restored"):
        assert getattr(one, name) == pytest.approx(getattr(two, name), abs=2e-9)


@pytest.mark.parametrize("name", ["S+", "S-", "U+", "U-"])
def test_pure_states_have_their_symmetry(name):
    state = kirchhoff.state(Scene(shear=0.60, start=name), elements=20)
    assert state.name == name
    z = state.positions[:, 2]
    if name[0] == "U":
        assert z == pytest.approx(z[::-1], abs=1e-10)
        assert (state.height > 0) == (name == "U+")
    else:
        assert z == pytest.approx(-z[::-1], abs=1e-10)
        # S+ is what U+S+ and U-S- merge into
        assert (state.slope < 0) == (name == "S+")


@pytest.mark.parametrize(
    ("compression", "shear", "expected"), [(0.40, 0.37, -2.28), (0.40, 0.40, 0.55), (0.35, 0.40, 2.60)]
)
def test_static_bound_on_skipping(compression, shear, expected):
    scene = Scene(compression=compression, shear=shear)
    assert kirchhoff.skipping_bound(scene, elements=20) == pytest.approx(expected, abs=0.006)


def test_saddle_meets_its_state_at_the_fold():
    fold = kirchhoff.folds(replace(PATH2, start="U+S-"), elements=16)[0]
    near = kirchhoff.saddle(PATH2, fold.angle - 1e-6, elements=16)
    assert near.index == 1
    assert near.height == pytest.approx(fold.height, abs=3e-3)
    assert near.height < fold.height
    with pytest.raises(SolverError, match=r"its fold is at 0\.44588"):
        kirchhoff.saddle(PATH2, fold.angle + 1e-3, elements=16)


@pytest.mark.parametrize("shear", [0.20, 0.40, 0.52])
def test_a_state_that_is_not_stable_is_refused_with_those_that_are(shear):
    stable = kirchhoff.stable_states(Scene(shear=shear, start="U+"), elements=12)
    for name in {"U+", "S-", "U-S+"} - set(stable):
        with pytest.raises(SceneError, match=r"start = .* the states that are: ") as error:
            kirchhoff.state(Scene(shear=shear, start=name), elements=12)
        assert all(other in str(error.value) for other in stable)


def test_refusals():
    with pytest.raises(OptionError, match="elements = 15: must be even"):
        kirchhoff.folds(PATH2, elements=15)
    with pytest.raises(OptionError, match="elements = 2"):
        kirchhoff.state(PATH2, elements=2)
    with pytest.raises(OptionError, match="extensible = 1"):
        kirchhoff.folds(PATH2, extensible=1)
    with pytest.raises(OptionError, match="span"):
        kirchhoff.equilibria(PATH2, span=(0.1, 1.0))
    with pytest.raises(SceneError, match="compression"):
        kirchhoff.pitchforks(1.2)
    with pytest.raises(SceneError, match="sheared"):
        kirchhoff.saddle(Scene(shear=0.0, start="U+"), 0.1)
    with pytest.raises(SceneError, match="stop"):
        kirchhoff.simulate(PATH2)


@pytest.mark.slow
@pytest.mark.parametrize("compression", [0.2, 0.3, 0.4, 0.5])
def test_folds_are_true_to_1e_9_wherever_the_ribbon_is_feasible(compression):
    forks = kirchhoff.pitchforks(compression)
    for part in (0.02, 0.3, 0.7, 0.98):
        shear = forks.broken + part * (forks.merged - forks.broken)
        scene = Scene(compression=compression, shear=shear)
        for one, two in zip(kirchhoff.folds(scene), kirchhoff.folds(scene, elements=48), strict=True):
            assert one.angle == pytest.approx(two.angle, abs=2e-10)


@pytest.mark.parametrize("compression", [0.30, 0.40])
def test_nearly_perfect_pitchforks_are_not_jumped_across(compression):
    # the other sheets are as near as the shear, which breaks the fork sideways
    compliance = Ribbon(bending_ratio=1.5)
    scene = Scene(compression=compression, shear=1e-6, start="U+", ribbon=compliance)
    plain = kirchhoff.equilibria(scene, elements=16)
    close = kirchhoff.equilibria(scene, elements=16, steps=Steps(turn=0.03, largest=0.02))
    np.testing.assert_allclose([f.angle for f in plain.folds], [f.angle for f in close.folds], atol=1e-7)
    # the rods stay on theirs too, which is its own mirror image
    rods = [f.angle for f in der.equilibria(scene, nodes=51).folds]
    assert len(rods) == 2
    assert abs(rods[0] + rods[1]) < 1e-4
    assert abs(rods[0] - plain.folds[0].angle) < 0.02
