"""Statics of the elastica, its kernel against the readable form, and its motion."""

import numpy as np
import pytest
from skfem import Basis, LinearForm, MeshLine

from ribbonfem import Ribbon, Scene, SceneError, elastica, quasilinear
from ribbonfem.continuation import equilibrium
from ribbonfem.continuation.curves import ramp_folds
from ribbonfem.elastica import initial_states
from ribbonfem.elastica.discretisation import MovingBeam, discretised
from ribbonfem.elastica.kernels import (
    condensed,
    consistent_initialisation,
    gauss_point,
    loop,
    residual,
    tangent,
)
from ribbonfem.elastica.kernels.beam import FORCE, PHI, ROWS, P, Z, solver
from ribbonfem.elastica.problem import Statics
from ribbonfem.elements.lobatto import ElementLineLobatto
from ribbonfem.ends import moving
from ribbonfem.ends.planar import Rig
from ribbonfem.jit.decorator import compiled
from ribbonfem.jit.groups import in_groups
from ribbonfem.jit.simd import load, store
from ribbonfem.options import OptionError
from ribbonfem.results import SolverError
from ribbonfem.stepping.methods import method_of

ESDIRK4 = method_of("esdirk4").as_scheme()


def scene(**changes):
    return Scene(**({"compression": 0.4, "shear": 0.0, "start": "U+", "rate": 0.1, "damping": 1.0} | changes))


@pytest.mark.parametrize(
    ("compression", "extensible", "angle", "height"),
    [
        (0.20, False, 0.7995539543, 0.1415531710),
        (0.40, False, 1.1230897421, 0.1782653744),
        (0.20, True, 0.7988593221, 0.1414246),
        (0.40, True, 1.1227538843, 0.1782074),
    ],
)
def test_folds_of_other_methods(compression, extensible, angle, height):
    (fold,) = elastica.folds(scene(compression=compression), extensible=extensible)
    assert abs(fold.angle / angle - 1) < 2e-8
    assert abs(fold.height - height) < 3e-6 if extensible else abs(fold.height - height) < 1e-8


@pytest.mark.parametrize("compression", [0.02, 0.05, 0.1, 0.2, 0.4, 0.6])
def test_folds_at_rest_are_exact(compression):
    """At the default mesh, 16 elements."""
    case = scene(compression=compression)
    assert abs(elastica.folds(case)[0].angle - elastica.folds(case, elements=40)[0].angle) < 1e-10


@pytest.mark.parametrize("compression", [0.1, 0.2, 0.4])
def test_folds_converge_with_the_tenth_power_of_the_mesh(compression):
    """2 p; the slope through many meshes, since the error changes its sign on the way."""
    case, meshes = scene(compression=compression), (4, 5, 6, 7, 8, 10, 12, 14)
    limit = elastica.folds(case, elements=48)[0].angle
    errors = [abs(elastica.folds(case, elements=n)[0].angle - limit) for n in meshes]
    order = -np.polyfit(np.log(meshes), np.log(errors), 1)[0]
    assert abs(order - 10.0) < 0.8, f"expected order 10, observed {order:.2f}: {errors}"


def test_nothing_locks():
    """Thin or not, stretching or not: the error of a coarse mesh is that of the mesh."""
    errors = []
    for thickness in (0.1, 0.01, 0.001):
        case = scene(ribbon=Ribbon(thickness=thickness))
        coarse, fine = (elastica.folds(case, elements=n, extensible=True)[0].angle for n in (16, 64))
        errors.append(abs(coarse / fine - 1))
    assert max(errors) < 2.0 * min(errors) < 2e-6
    thin = elastica.folds(scene(ribbon=Ribbon(thickness=1e-3)), extensible=True)[0].angle
    # the effect of stretch is in proportion to h^2
    effect = elastica.folds(scene(), extensible=True)[0].angle - elastica.folds(scene())[0].angle
    assert thin - elastica.folds(scene())[0].angle == pytest.approx(0.01 * effect, rel=1e-2)


def test_small_compression_is_the_quasilinear_beam():
    """mu of the fold differs from the closed form by a share in proportion to dL/L."""
    closed = quasilinear.closed_form_fold().mu
    off = [elastica.folds(scene(compression=d))[0].angle / d**0.5 / closed - 1 for d in (0.01, 0.005, 0.0025)]
    assert off[0] / off[1] == pytest.approx(2.0, abs=0.02)
    assert off[1] / off[2] == pytest.approx(2.0, abs=0.01)
    assert abs(off[2]) < 1e-4


@pytest.mark.parametrize("extensible", [False, True])
def test_tangent_is_the_derivative_of_the_residual(extensible):
    # a soft section, so that stretch would be seen
    problem = Statics(scene(ribbon=Ribbon(thickness=0.2)), 6, extensible)
    state = problem.advance(problem.start(), 0.1 * np.sin(np.arange(31.0)), 0.3)
    step = np.cos(np.arange(31.0))
    line = problem.linearise(state, 0.3)
    ahead, behind = (problem.linearise(problem.advance(state, e * step, 0.3), 0.3) for e in (1e-5, -1e-5))
    change = (ahead.residual - behind.residual) / 2e-5
    assert np.abs(line.solve(change) - step).max() < 1e-6
    nothing = np.zeros(31)
    turned = [
        problem.linearise(problem.advance(state, nothing, 0.3 + e), 0.3 + e).residual for e in (1e-5, -1e-5)
    ]
    assert np.abs((turned[0] - turned[1]) / 2e-5 - line.slope).max() < 1e-7 * np.abs(line.slope).max()


def test_mirror_image():
    up = elastica.equilibria(scene(), elements=16)
    down = elastica.equilibria(scene(start="U-"), elements=16)
    assert np.allclose(down.angle[::-1], -up.angle, atol=1e-12)
    assert np.allclose(down.height[::-1], -up.height, atol=1e-9)
    (fold,) = elastica.folds(scene(start="U-", rate=-0.1))
    assert fold.angle == pytest.approx(-elastica.folds(scene())[0].angle, abs=1e-11)
    assert fold.height < 0.0


def test_branch_passes_the_start_and_keeps_its_length():
    branch = elastica.equilibria(scene(), elements=32)
    (row,) = np.flatnonzero(branch.angle == 0.0)
    assert branch.stable[row]
    assert branch.slope[row] == pytest.approx(0.0, abs=1e-9)
    ends = branch.configurations[:, -1]
    assert np.abs(ends - [0.6, 0.0, 0.0]).max() < 1e-10
    # left tangent down for alpha > 0: between chords and arcs lies only curvature
    second = branch.configurations[:, 1]
    turned = branch.angle > 0.5
    assert np.all(second[turned, 2] < 0.0)
    assert branch.folds[0].angle == pytest.approx(1.1230897421, abs=1e-7)


class Case:
    """A beam of five elements in a state without any symmetry, with everything that may act on it."""

    def __init__(self, extensible, sigma=0.0):
        rng = np.random.default_rng(3)
        rig = Rig(np.zeros(5), np.zeros(5), rng.normal(size=2), rng.normal(size=(5, P)))
        # a soft section, so that stretch is seen
        self.problem = Statics(scene(ribbon=Ribbon(thickness=0.3)), 5, extensible, rig)
        self.beam, self.solver, self.sigma = discretised(self.problem), solver(5), sigma
        nodes = self.problem.nodes
        self.r, self.phi, self.known = rng.normal(size=(26, 2)), rng.normal(size=26), rng.normal(size=(26, 2))
        self.n = rng.normal(size=(5, P, 2))
        self.u = self.state(self.r, self.phi, self.n)
        self.known_rows = in_groups(np.concatenate([self.known[nodes, c] for c in (0, 1)], axis=1))

    def state(self, r, phi, n):
        nodes = self.problem.nodes
        parts = (r[nodes, 0], r[nodes, 1], phi[nodes], n.reshape(5, -1))
        return in_groups(np.concatenate(parts, axis=1))

    def summed(self, rows):
        """Rows (G, ROWS, WIDTH), a share of every element, as (26, 2), (26,) and (5, P, 2) of the whole."""
        local = np.moveaxis(rows, 2, 1).reshape(-1, ROWS)[:5]
        nodes = self.problem.nodes.ravel()
        fields = [np.bincount(nodes, local[:, c : c + P + 1].ravel()) for c in (0, Z, PHI)]
        return np.stack(fields[:2], axis=1), fields[2], local[:, FORCE:].reshape(5, P, 2)

    def residual(self, u):
        _residual(self.beam, self.solver, u, self.known_rows, self.sigma)
        return self.solver.rest.copy()


@compiled()
def _residual(beam, s, u, known, sigma):
    residual.residual(beam, s, u, known, sigma)


@compiled()
def _solve(beam, s, sigma):
    condensed.solve(beam, s, sigma)


@pytest.mark.parametrize("extensible", [False, True])
def test_kernel_is_the_readable_form(extensible):
    """The kernel's residual against scikit-fem's forms."""
    case = Case(extensible, sigma=1.7)
    problem, c = case.problem, case.problem.compliance
    basis = Basis(MeshLine(np.linspace(0.0, 1.0, 6)), ElementLineLobatto(P), intorder=2 * P - 1)
    along = np.empty(26, dtype=int)
    along[basis.element_dofs[[0, *range(2, P + 1), 1]].T.ravel()] = problem.nodes.ravel()
    back = np.argsort(along)
    phi = basis.interpolate(case.phi[along])
    t, normal = (np.cos(phi), np.sin(phi)), (-np.sin(phi), np.cos(phi))
    n = np.moveaxis(case.n, 2, 0)
    n_t, n_p = n[0] * t[0] + n[1] * t[1], n[0] * normal[0] + n[1] * normal[1]
    moment = LinearForm(lambda s, d: (d.phi.grad[0] - d.natural) * s.grad[0] - d.across * s).assemble(
        basis, phi=phi, natural=problem.rig.curvature, across=n_p * (1 + c * n_t)
    )[back]
    pull = [LinearForm(lambda s, d: d.n * s.grad[0]).assemble(basis, n=part)[back] for part in n]
    grads = [basis.interpolate(case.r[along, i]).grad[0] for i in (0, 1)]
    gap = np.stack([(grads[i] - t[i] * (1 + c * n_t)) * basis.dx for i in (0, 1)], axis=2)
    lumps = LinearForm(lambda s, d: s).assemble(basis)[back]
    expected = lumps[:, None] * (1.7 * case.r - case.known) + np.stack(pull, axis=1), moment, gap
    for result, wanted in zip(case.summed(case.residual(case.u)), expected, strict=True):
        assert np.abs(result - wanted).max() < 1e-13 * np.abs(wanted).max()


@pytest.mark.parametrize("extensible", [False, True])
def test_increments_solve_the_linearised_equations(extensible):
    """Filled, condensed, eliminated and handed out: what the residual changes by takes it to zero."""
    case = Case(extensible, sigma=900.0)
    tangent.fill(case.beam, case.solver, case.u, case.sigma, False)
    condensed.factorise(case.solver)
    before = case.summed(case.residual(case.u))
    _solve(case.beam, case.solver, case.sigma)
    step = case.solver.rest.copy()
    small = 1e-4 / np.abs(step).max()
    ahead, behind = (case.summed(case.residual(case.u + e * small * step)) for e in (1.0, -1.0))
    for k, (rest, high, low) in enumerate(zip(before, ahead, behind, strict=True)):
        inner = slice(1, -1) if k < 2 else slice(None)
        left = rest + (high - low) / (2.0 * small)
        assert np.abs(left[inner]).max() < 1e-6 * max(np.abs(part).max() for part in before)
    # what two elements have of a node moves as one, and the clamps do not
    nodes = case.problem.nodes
    local = np.moveaxis(step, 2, 1).reshape(-1, ROWS)[:5]
    for c in (0, Z, PHI):
        assert np.array_equal(local[1:, c], local[:-1, c + P])
        assert local[0, c] == local[-1, c + P] == 0.0
    assert nodes[-1, P] == 25


def test_sines_of_four():
    """To rounding, over several turns."""

    @compiled()
    def both(x, y):
        for i in range(x.shape[0]):
            cosine, sine = gauss_point.cosine_sine(load(x, (i,)))
            store(y, (i, 0), cosine)
            store(y, (i, 1), sine)

    x = np.linspace(-20.0, 20.0, 4000).reshape(-1, 4)
    y = np.empty((1000, 2, 4))
    both(x, y)
    assert np.abs(y[:, 0] - np.cos(x)).max() < 1e-14
    assert np.abs(y[:, 1] - np.sin(x)).max() < 1e-14


@pytest.mark.parametrize("extensible", [False, True])
def test_velocities_at_the_kink_are_consistent(extensible):
    """The clamp starts to turn: r' = t (1 + c n.t) derived once and twice, and the forces that go with it."""
    turned = scene(ribbon=Ribbon(thickness=0.1), stop=1.0)
    problem = Statics(turned, 8, extensible)
    state, _ = equilibrium(problem, problem.advance(problem.start(), np.zeros(41), 0.4), 0.4)
    beam = MovingBeam(problem, {"u": initial_states.at_rest(problem, state)}, ESDIRK4, 4)
    y, t, spin, nu = beam.model.motion, beam.model.scratch, 0.8, 0.3
    t.controls[0] = 0.4, spin, 0.0
    impulse = consistent_initialisation.project(beam.model.beam, beam.model.solver, y, t, moving(turned), nu)
    nodes, c = problem.nodes, problem.compliance

    def field(rows):
        local = np.moveaxis(rows, 2, 1).reshape(8, -1)
        return np.stack([local[:, k : k + P + 1] for k in (0, Z)], axis=2)

    v, a = field(y.v), field(y.a)
    rate = np.moveaxis(y.phi_rate, 2, 1).reshape(8, -1)
    assert rate[0, 0] == -spin
    _, cos, sin, along, _ = problem.section(state)
    stretch, value, slope = 1.0 + c * along, problem.tables.value, problem.tables.slope[0]
    dv, turn = np.einsum("ki,eic->ekc", slope, v), rate @ value.T
    assert np.abs(dv[:, :, 1] * cos - dv[:, :, 0] * sin - turn * stretch).max() < 1e-8 * np.abs(dv).max()
    # the least kinetic energy: half the impulse times the spin
    kinetic = 0.5 * np.sum(problem.mesh.lumps[:, None] * v**2)
    assert 0.5 * spin * impulse == pytest.approx(kinetic, rel=1e-9)
    if not extensible:
        assert np.abs(dv[:, :, 0] * cos + dv[:, :, 1] * sin).max() < 1e-8 * np.abs(dv).max()
        da = np.einsum("ki,eic->ekc", slope, a)
        along = da[:, :, 0] * cos + da[:, :, 1] * sin
        assert np.abs(along + turn**2).max() < 1e-7 * (turn**2).max()
    # the balance of momentum at the nodes
    n = np.moveaxis(y.u, 2, 1).reshape(8, -1)[:, FORCE:].reshape(8, P, 2)
    pull = np.einsum("ki,ekc->eic", problem.mesh.coupling, n)
    total = pull + problem.mesh.lumps[:, None] * (a + nu * v)
    balance = np.stack([np.bincount(nodes.ravel(), total[:, :, k].ravel())[1:-1] for k in (0, 1)])
    assert np.abs(balance).max() < 1e-9 * np.abs(pull).max()


@pytest.mark.parametrize("extensible", [False, True])
def test_an_equilibrium_stays_one(extensible):
    """The folds of the statics are those of the motion: equilibria are so for the kernel, to rounding."""
    problem = Statics(scene(), 8, extensible)
    state, _ = equilibrium(problem, problem.advance(problem.start(), np.zeros(41), 0.4), 0.4)
    u, memory = initial_states.at_rest(problem, state), solver(8)
    still = np.zeros_like(u[:, :PHI])
    _residual(discretised(problem), memory, u, still, 0.0)
    local = np.moveaxis(memory.rest, 2, 1).reshape(8, -1)
    for c in (0, Z, PHI):
        field = np.bincount(problem.nodes.ravel(), local[:, c : c + P + 1].ravel())
        assert np.abs(field[1:-1]).max() < 1e-10
    assert np.abs(local[:, FORCE:]).max() < 1e-13


@pytest.mark.parametrize("extensible", [False, True])
@pytest.mark.parametrize("elements", [7, 8])
def test_a_rig_is_the_same_at_rest_and_in_motion(extensible, elements):
    """Both clamps turned, a lift, a push, weight and a natural curvature: forces balance at every node."""
    controls, moves = np.array([0.1, 0.15, 0.02, 0.03, 2.0]), np.array([1.0, 0.5, 0.1, -0.2, 3.0])
    curvature = np.random.default_rng(1).normal(size=(elements, P))
    problem = Statics(scene(), elements, extensible, Rig(controls, moves, np.array([0.4, -1.5]), curvature))
    state, line = equilibrium(problem, problem.start(), 0.2)
    model = MovingBeam(problem, {"u": initial_states.at_rest(problem, state)}, ESDIRK4, 4).model
    model.scratch.controls[:, 0] = problem.controls(0.2)
    loop._put_loads(model)
    _residual(model.beam, model.solver, model.motion.u, model.scratch.known, 0.0)
    local = np.moveaxis(model.solver.rest, 2, 1).reshape(-1, ROWS)[:elements]
    for c in (0, Z, PHI):
        field = np.bincount(problem.nodes.ravel(), local[:, c : c + P + 1].ravel())
        assert np.abs(field[1:-1]).max() < 1e-10
    assert np.abs(local[:, FORCE:]).max() < 1e-13
    right = np.array([1.0 - 0.4 - controls[2] - 0.2 * moves[2], controls[3] + 0.2 * moves[3]])
    assert np.abs(np.array([part[-1] for part in problem.shape(state)]) - right).max() < 1e-12
    # all of them move with the parameter
    ends = [
        problem.linearise(problem.advance(state, 0.0 * line.slope, p), p) for p in (0.2 + 1e-5, 0.2 - 1e-5)
    ]
    change = (ends[0].residual - ends[1].residual) / 2e-5
    assert np.abs(change - line.slope).max() < 1e-6 * np.abs(line.slope).max()


def test_velocities_of_every_control_are_consistent():
    """The right clamp turns and moves: its rates are the ends', and the beam keeps its length."""
    turned = scene(stop=1.0)
    problem = Statics(turned, 6, False)
    state, _ = equilibrium(problem, problem.start(), 0.0)
    model = MovingBeam(problem, {"u": initial_states.at_rest(problem, state)}, ESDIRK4, 4).model
    y, t = model.motion, model.scratch
    t.controls[:4, 1:] = [[0.3, 0.1], [-0.4, 0.2], [0.5, 0.6], [0.7, -0.8]]
    loop._put_loads(model)
    consistent_initialisation.project(model.beam, model.solver, y, t, moving(turned), 0.5)
    fields = [np.moveaxis(rows, 2, 1).reshape(-1, rows.shape[1])[:6] for rows in (y.v, y.a, y.phi_rate)]
    v, a = (np.stack([rows[:, k : k + P + 1] for k in (0, Z)], axis=2) for rows in fields[:2])
    assert np.array_equal(v[-1, P], [-0.5, 0.7])
    assert np.array_equal(a[-1, P], [-0.6, -0.8])
    assert (fields[2][0, 0], fields[2][-1, P]) == (-0.3, -0.4)
    _, cos, sin, _, _ = problem.section(state)
    tangent = np.stack((cos, sin), axis=2)
    dv, da = (np.einsum("ki,eic->ekc", problem.tables.slope[0], part) for part in (v, a))
    turn = fields[2] @ problem.tables.value.T
    assert np.abs(np.sum(dv * tangent, axis=2)).max() < 1e-8
    assert np.abs(np.sum(da * tangent, axis=2) + turn**2).max() < 1e-7 * (turn**2).max()


def test_loads_and_shapes_at_rest():
    """Against shooting: weight downwards, and a natural curvature, which moves no fold of a clamped beam."""
    bare = elastica.folds(scene())[0].angle
    moves = np.array([1.0, 0.0, 0.0, 0.0, 0.0])
    for weight, curvature, angle in ((-5.0, 0.0, 1.080050375), (0.0, 2.0, bare)):
        rig = Rig(np.zeros(5), moves, np.array([0.0, weight]), np.full((16, P), curvature))
        problem = Statics(scene(), 16, False, rig)
        (event,) = ramp_folds(problem, equilibrium(problem, problem.start(), 0.0)[0], scene())
        assert event.point.parameter == pytest.approx(angle, abs=2e-9)
        state = equilibrium(problem, problem.start(), 0.0)[0]
        height = 0.3484540037 if weight else 0.3487125197
        assert problem.observe(state, 0.0)[0] == pytest.approx(height, abs=1e-9)


@pytest.mark.parametrize(("extensible", "angle"), [(False, 1.159895), (True, 1.159551)])
def test_planar_snap(extensible, angle):
    """To 6e-5 with the defaults, in few steps; and converged, by Richardson's rule in the step."""
    case = scene(stop=1.4)
    history = elastica.simulate(case, extensible=extensible, until="snap")
    assert abs(history.crossing("height")[1] - angle) < 6e-6
    assert history.stats["steps"] < 350
    # of factors that are kept, some 80 in all
    assert history.stats["newton_iterations"] < 2800
    assert history.stats["assemblies"] < 120
    coarse, fine = (
        elastica.simulate(
            case, elements=16, extensible=extensible, step=s, method="tr-bdf2", until="snap"
        ).crossing()[1]
        for s in (0.01, 0.005)
    )
    assert abs((4 * fine - coarse) / 3 - angle) < 3e-6


@pytest.mark.slow
def test_snap_converges_with_the_mesh():
    case = scene(stop=1.4)
    angle = {
        n: elastica.simulate(case, elements=n, step=0.01, until="snap").crossing("height")[1]
        for n in (4, 8, 24)
    }
    assert np.log2(abs(angle[4] - angle[24]) / abs(angle[8] - angle[24])) > 9.0


def test_mirror_image_in_motion():
    up = elastica.simulate(scene(stop=1.3, rate=1.0), step=0.01, elements=8)
    down = elastica.simulate(scene(stop=-1.3, rate=-1.0, start="U-"), step=0.01, elements=8)
    assert np.abs(up.height + down.height).max() < 1e-9
    assert np.abs(up.energies["work"] - down.energies["work"]).max() < 1e-8


@pytest.mark.parametrize("extensible", [False, True])
def test_full_turn_of_the_clamp(extensible):
    """One turn on: the clamp is where it was, the ribbon is not, and its length is what it was."""
    case = scene(stop=2 * np.pi, rate=2.0, damping=10.0, hold=5.0)
    history = elastica.simulate(case, elements=16, tolerance=1e-4, extensible=extensible)
    assert history.angle[-1] == 2 * np.pi
    assert history.energies["kinetic"][-1] < 1e-6
    assert history.energies["elastic"][-1] > 1.5 * history.energies["elastic"][0]
    arcs = np.linalg.norm(np.diff(history.configurations["positions"], axis=1), axis=2).sum(axis=1)
    assert np.all(arcs < 1.0 + 1e-2)
    assert np.all(arcs > 0.97)


def test_motion_tends_to_the_quasilinear_beam():
    """At dL -> 0 the snap's mu tends to the quasi-linear one, in proportion to dL/L."""
    off = []
    for d in (0.02, 0.01, 0.005):
        case = scene(compression=d, stop=2.2 * d**0.5, rate=d**0.5)
        both = [
            model.simulate(case, elements=n, step=0.004, method="tr-bdf2", until="snap").crossing()[1]
            / d**0.5
            for model, n in ((elastica, 16), (quasilinear, 64))
        ]
        off.append((both[0] / both[1] - 1) / d)
    # the share per dL/L has a limit, which it reaches in proportion to dL/L
    assert off[2] == pytest.approx(0.011, abs=5e-4)
    assert off[0] < off[1] < off[2] < 1.06 * off[1] < 1.2 * off[0]


def test_refusals():
    with pytest.raises(SceneError, match="shear"):
        elastica.folds(Scene())
    with pytest.raises(SceneError, match="stop"):
        elastica.simulate(scene())
    case = scene(stop=1.2)
    for options, word in (
        ({"elements": 2}, "elements"),
        ({"extensible": 1}, "extensible"),
        ({"method": "verlet"}, "verlet"),
        ({"step": -1.0}, "step"),
        ({"step": 0.1, "tolerance": 1e-3}, "not both"),
        ({"spectral_radius": 0.5}, "generalised-alpha"),
        ({"method": "generalised-alpha", "spectral_radius": 1.5}, "1.5"),
        ({"until": "later"}, "later"),
    ):
        with pytest.raises(OptionError, match=word):
            elastica.simulate(case, **options)
    with pytest.raises(SolverError, match="stopped at t"):
        elastica.simulate(case, tolerance=1e-30)
