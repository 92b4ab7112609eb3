"""Statics of the elastica, its kernel against the readable form, and its motion."""

import numpy as np
import pytest
from skfem import Basis, BilinearForm, ElementLinePp, LinearForm, MeshLine

from ribbonfem import Ribbon, Scene, SceneError, elastica, quasilinear
from ribbonfem.continuation import equilibrium
from ribbonfem.elements.legendre import DEGREE
from ribbonfem.options import OptionError
from ribbonfem.results import SolverError
from ribbonfem.stepping import kernels
from ribbonfem.stepping.newmark import _scratch


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
def test_folds_converge_with_the_sixth_power_of_the_mesh(compression):
    case = scene(compression=compression)
    angle = {n: elastica.folds(case, elements=n)[0].angle for n in (16, 32, 64, 128)}
    order = np.log2(abs(angle[16] - angle[128]) / abs(angle[32] - angle[128]))
    assert 5.6 < order < 6.4
    assert abs(angle[64] / angle[128] - 1) < 1e-8


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
    problem = elastica.functions.Statics(scene(ribbon=Ribbon(thickness=0.2)), 6, extensible)
    state = problem.advance(problem.start(), 0.1 * np.sin(np.arange(19.0)), 0.3)
    step = np.cos(np.arange(19.0))
    line = problem.linearise(state, 0.3)
    ahead, behind = (problem.linearise(problem.advance(state, e * step, 0.3), 0.3) for e in (1e-5, -1e-5))
    change = (ahead.residual - behind.residual) / 2e-5
    assert np.abs(line.solve(change) - step).max() < 1e-6
    nothing = np.zeros(19)
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


@pytest.mark.parametrize("extensible", [False, True])
def test_kernel_is_the_readable_form(extensible):
    """The kernel's tangent and residual against scikit-fem's forms, on a state without any symmetry."""
    elements, p = 5, DEGREE
    problem = elastica.functions.Statics(scene(ribbon=Ribbon(thickness=0.3)), elements, extensible)
    mesh, c = problem.mesh, problem.compliance
    table = elastica.functions.tables(problem)
    rng = np.random.default_rng(3)
    q, v, a = (rng.normal(size=2 * mesh.count) for _ in range(3))
    w = rng.normal(size=mesh.count + 2 * p * elements)
    b, g, nu = 0.7, 0.4, 1.3

    line = MeshLine(np.linspace(0.0, 1.0, elements + 1))
    basis = Basis(line, ElementLinePp(p), intorder=2 * p - 1)
    exact = Basis(line, ElementLinePp(p), intorder=2 * p)
    along = np.empty(mesh.count, dtype=int)
    along[basis.element_dofs.T.ravel()] = mesh.dofs.ravel()
    back = np.argsort(along)
    phi, x, z = w[: mesh.count], q[: mesh.count], q[mesh.count :]
    force = w[mesh.count :].reshape(elements, 2, p)
    nx, nz = (np.einsum("ek,ekq->eq", force[:, i], mesh.force) for i in (0, 1))
    angle = np.asarray(basis.interpolate(phi[along]))
    t, normal = (np.cos(angle), np.sin(angle)), (-np.sin(angle), np.cos(angle))
    n_t, n_p = nx * t[0] + nz * t[1], nx * normal[0] + nz * normal[1]

    def matrix(function, of=basis):
        return BilinearForm(function).assemble(of).toarray()[back][:, back]

    fields = {"across": n_p * (1 + c * n_t), "phi": basis.interpolate(phi[along])}
    moment = LinearForm(lambda s, d: d.phi.grad[0] * s.grad[0] - d.across * s).assemble(basis, **fields)[back]
    mass = matrix(lambda r, s, d: r * s, exact)
    pull = [LinearForm(lambda s, d: d.n * s.grad[0]).assemble(basis, n=n)[back] for n in (nx, nz)]
    half = mesh.count
    momentum = [
        mass @ (a[i * half : (i + 1) * half] + nu * v[i * half : (i + 1) * half]) + pull[i] for i in (0, 1)
    ]
    grads = [basis.interpolate(field[along]).grad[0] for field in (x, z)]
    gap = [np.einsum("ekq,eq->ek", mesh.force, (grads[i] - t[i] * (1 + c * n_t)) * mesh.dx) for i in (0, 1)]
    residual = np.concatenate((*momentum, moment, np.stack(gap, axis=1).ravel()))

    size = 5 * p + 3
    places = table.places
    total = np.zeros((len(q) + len(w), len(q) + len(w)))
    found = np.zeros(len(q) + len(w))
    for e in range(elements):
        local = np.empty((size, size + 1))
        kernels.element_elastica(table, e, local, q, v, a, w, b, g, nu)
        numbers = np.empty(size, dtype=int)
        for row, first in ((0, 2 * half), (1, 0), (2, half)):
            numbers[places[row]] = first + mesh.dofs[e]
        for row in (3, 4):
            numbers[places[row, :p]] = 3 * half + (2 * e + row - 3) * p + np.arange(p)
        total[np.ix_(numbers, numbers)] += local[:, :size]
        found[numbers] += local[:, size]
    scale = np.abs(residual).max()
    assert np.abs(found - residual).max() < 1e-13 * scale

    bend = BilinearForm(lambda r, s, d: r.grad[0] * s.grad[0] + d.k * r * s).assemble(
        basis, k=n_t * (1 + c * n_t) - c * n_p**2
    )
    weight = (1 + nu * g) / b
    assert np.abs(total[: 2 * half, : 2 * half] - weight * np.kron(np.eye(2), mass)).max() < 1e-14 * weight
    block = total[2 * half : 3 * half, 2 * half : 3 * half]
    assert np.abs(block - bend.toarray()[back][:, back]).max() < 1e-13 * np.abs(block).max()
    assert np.abs(total - total.T).max() < 1e-13 * np.abs(total).max()

    # condensed, banded and expanded: the same increments as the dense system
    fixed = [0, half - 1, half, 2 * half - 1, 2 * half, 3 * half - 1]
    free = np.setdiff1d(np.arange(len(found)), fixed)
    dense = np.zeros(len(found))
    dense[free] = np.linalg.solve(total[np.ix_(free, free)], -found[free])
    scratch = _scratch(table, q, w)
    q1, w1 = q.copy(), w.copy()
    # a tolerance that any increment meets: one iteration
    kernels.newton_elastica(table, scratch, q1, v.copy(), a.copy(), w1, b, g, nu, 1e9)
    moved = np.concatenate((q1 - q, w1 - w))
    assert np.abs(moved - dense).max() < 1e-9 * np.abs(dense).max()


def test_an_equilibrium_stays_one():
    """The folds of the statics are those of the motion: equilibria are so for the kernel, to rounding."""
    problem = elastica.functions.Statics(scene(), 8, True)
    state, _ = equilibrium(problem, problem.advance(problem.start(), np.zeros(25), 0.4), 0.4)
    table = elastica.functions.tables(problem)
    q, w = elastica.functions.at_rest(problem, state)
    rest = np.zeros_like(q)
    before = q.copy(), w.copy()
    used = kernels.newton_elastica(
        table, _scratch(table, q, w), q, rest.copy(), rest.copy(), w, 1e-2, 0.1, 0.0, 1e-9
    )
    assert used == 1
    assert np.abs(q - before[0]).max() < 1e-12
    assert np.abs(w[:25] - before[1][:25]).max() < 1e-11


@pytest.mark.parametrize(("extensible", "angle"), [(False, 1.159895), (True, 1.159551)])
def test_planar_snap(extensible, angle):
    """To 6e-5 with the defaults, in few steps; and converged, by Richardson's rule in the step."""
    case = scene(stop=1.4)
    history = elastica.simulate(case, extensible=extensible, until="snap")
    assert abs(history.crossing("height")[1] - angle) < 6e-5
    assert history.stats["steps"] < 350
    assert history.stats["newton_iterations"] < 1600
    coarse, fine = (
        elastica.simulate(case, elements=16, extensible=extensible, step=s, until="snap").crossing()[1]
        for s in (0.01, 0.005)
    )
    assert abs((4 * fine - coarse) / 3 - angle) < 3e-6


@pytest.mark.slow
def test_snap_converges_with_the_mesh():
    case = scene(stop=1.4)
    angle = {
        n: elastica.simulate(case, elements=n, step=0.01, until="snap").crossing("height")[1]
        for n in (12, 24, 48)
    }
    assert np.log2(abs(angle[12] - angle[48]) / abs(angle[24] - angle[48])) > 5.5


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
            model.simulate(case, elements=n, step=0.004, until="snap").crossing("height")[1] / d**0.5
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
    for policy, word in (
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
            elastica.simulate(case, **policy)
    with pytest.raises(SolverError, match="stopped at t"):
        elastica.simulate(case, tolerance=1e-30)
