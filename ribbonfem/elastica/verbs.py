"""The planar elastica: a geometrically exact beam, unshearable, with or without stretch (paper, section 4.1).

The tangent has the angle phi to the x axis, the cross-section carries the force n.  With
lengths in L, forces in EI2/L^2, energies in EI2/L, t = (cos phi, sin phi) in the (x, z) plane
and c = EI2 / (EA L^2), the Hellinger-Reissner functional is

    int [ phi'^2 / 2 + n . (r' - t) - c (n . t)^2 / 2 ] ds,

so that r' = t (1 + c n . t).  The clamps are r(0) = 0, r(1) = (1 - dL/L, 0), phi(0) = -alpha,
phi(1) = 0.  `extensible=False` is c = 0, the paper's elastica; `extensible=True` has the
stretching stiffness of the rectangular section.

Discretisation
--------------
phi and r are continuous cubics with hierarchical (Legendre) bubbles; n lies in the derivatives
of that space, discontinuous quadratics, and every integral is taken with three Gauss points an
element.  This is the same as collocation of r' = t (1 + c n . t) at the Gauss points, or as
selective reduced integration of a Simo-Reissner beam without shear.  Measured against C1
elements and displacement forms:

* nothing locks, because stretch is a force here and not a difference of positions: the same
  code serves c = 0 and c > 0, and folds at h = 0.001 L are as exact as at h = 0.1 L;
* nodal values and folds converge with the sixth power of the mesh (2p for degree p), as
  collocation at Gauss points does (de Boor & Swartz, SIAM J. Numer. Anal. 10 (1973) 582);
* at rest n is constant and r follows from phi by quadrature: the statics have the unknowns
  phi and one force, a band with a border of two rows.

Rotary inertia is left out, as in the paper's beam: of a thin strip it moves frequencies by
h^2 pi^2 / 24 L^2, 4e-5 for the default ribbon.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from skfem import Basis, ElementLinePp, MeshLine

from ribbonfem.closed_form import euler
from ribbonfem.compiled.banded import Arrow
from ribbonfem.continuation import PARAMETER_WEIGHT, Linearisation, Steps, equilibrium
from ribbonfem.continuation.curves import as_fold, ramp_folds, whole_curve
from ribbonfem.delay import NormalForm, ramp_normal_forms
from ribbonfem.policy import flag, interval, whole_number
from ribbonfem.results import Array, Branch, Fold, History
from ribbonfem.scene import Scene
from ribbonfem.stepping.beam_kernels import ELASTICA, Tables, local_places
from ribbonfem.stepping.newmark import Control, integrate

__all__ = ["equilibria", "folds", "normal_forms", "simulate"]

DEGREE = 3
TOLERANCE = 3e-6


class Mesh:
    """Elements in a row on [0, 1], as scikit-fem tabulates them.

    Attributes
    ----------
    degree: p of the elements; p Gauss points each.
    value, grad: (elements, p + 1, p) shape functions and their derivatives at the Gauss points;
        first the hats of the left and right node, then the bubbles.
    force: (elements, p, p) shape functions of n: the derivatives of all but the left hat, times
        the element's length; the first is 1, the others have no mean.
    dx: (elements, p) weights.
    dofs: (elements, p + 1) numbers of the shape functions, which run along the beam.
    """

    def __init__(self, elements: int, degree: int = DEGREE) -> None:
        self.elements, self.degree = elements, degree
        mesh = MeshLine(np.linspace(0.0, 1.0, elements + 1))
        # a new element for every basis: it keeps the values at its first quadrature points
        basis = Basis(mesh, ElementLinePp(degree), intorder=2 * degree - 1)
        fields = [basis.basis[i][0] for i in range(degree + 1)]
        self.value = np.stack([np.broadcast_to(np.asarray(f), basis.dx.shape) for f in fields], axis=1)
        self.grad = np.stack([np.broadcast_to(f.grad[0], basis.dx.shape) for f in fields], axis=1)
        self.dx = np.ascontiguousarray(basis.dx)
        self.force = self.grad[:, 1:] * self.dx.sum(axis=1)[:, None, None]
        along = np.empty(basis.N, dtype=np.int64)
        along[basis.nodal_dofs[0]] = degree * np.arange(elements + 1)
        for k, row in enumerate(basis.interior_dofs):
            along[row] = degree * np.arange(elements) + 1 + k
        self.dofs = np.ascontiguousarray(along[basis.element_dofs].T)
        self.count = basis.N

    def at_gauss(self, coefficients: Array, table: Array) -> Array:
        """Values (elements, p) at the Gauss points of a field (count,), from `value` or `grad`."""
        return np.einsum("eiq,ei->eq", table, coefficients[self.dofs])

    def middle_weights(self) -> tuple[NDArray[np.int64], Array]:
        """Dofs and weights whose sum is a field at midspan (inside an element, if their number is odd)."""
        if self.elements % 2 == 0:
            return np.array([self.degree * self.elements // 2]), np.ones(1)
        element = ElementLinePp(self.degree)
        point = np.array([[0.5]])
        weights = [float(element.lbasis(point, i)[0][0]) for i in range(self.degree + 1)]
        return self.dofs[self.elements // 2].copy(), np.array(weights)

    def middle(self, coefficients: Array) -> float:
        """The field at midspan."""
        index, weights = self.middle_weights()
        return float(weights @ coefficients[index])

    def integral(self, derivative: Array) -> Array:
        """The field (count,) that is 0 at s = 0 and has this derivative (elements, p) at the Gauss points."""
        field = np.zeros(self.count)
        field[:: self.degree][1:] = np.cumsum((derivative * self.dx).sum(axis=1))
        bubbles = self.grad[:, 2:]
        # derivatives of the bubbles are orthogonal to each other and to a constant
        share = np.einsum("eiq,eq->ei", bubbles, derivative * self.dx)
        field[self.dofs[:, 2:]] = share / np.einsum("eiq,eq->ei", bubbles**2, self.dx)
        return field

    def integral_adjoint(self, weights: Array) -> Array:
        """Factors (elements, p) of a derivative in weights (count,) times its `integral`."""
        nodal = weights[:: self.degree][1:]
        result = np.cumsum(nodal[::-1])[::-1][:, None] * self.dx
        bubbles = self.grad[:, 2:]
        share = weights[self.dofs[:, 2:]] / np.einsum("eiq,eq->ei", bubbles**2, self.dx)
        return result + np.einsum("ei,eiq->eq", share, bubbles) * self.dx

    def inertia(self) -> Array:
        """Mass matrices (elements, p + 1, p + 1), integrated exactly."""
        line = MeshLine(np.linspace(0.0, 1.0, self.elements + 1))
        exact = Basis(line, ElementLinePp(self.degree), intorder=2 * self.degree)
        value = np.stack(
            [np.broadcast_to(np.asarray(exact.basis[i][0]), exact.dx.shape) for i in range(self.degree + 1)],
            axis=1,
        )
        return np.einsum("eiq,ejq,eq->eij", value, value, exact.dx)


@dataclass(frozen=True)
class _State:
    """The angle phi (dofs) with the clamps in place, and the force n (2,), constant along the beam."""

    phi: Array
    force: Array


class Statics:
    """The equilibrium equations of the elastica in alpha.

    Unknowns are the free dofs of phi and the two components of n.  A `continuation.Problem`.
    """

    parameter_weight = PARAMETER_WEIGHT

    def __init__(self, scene: Scene, elements: int, extensible: bool) -> None:
        scene.require_planar("elastica")
        self.mesh = Mesh(whole_number("elements", elements, 4))
        self.compliance = 1.0 / scene.ribbon.stretch_ratio if flag("extensible", extensible) else 0.0
        self.chord = 1.0 - scene.compression
        self.side = 1.0 if scene.start == "U+" else -1.0
        self.unit = scene.ribbon.inertial_time
        mesh = self.mesh
        self.inertia = mesh.inertia()
        self.stiffness = np.einsum("eiq,ejq,eq->eij", mesh.grad, mesh.grad, mesh.dx)
        low, high = mesh.dofs[:, :, None], mesh.dofs[:, None, :]
        self._lower = low >= high
        self._slot = (high * (mesh.degree + 1) + low - high)[self._lower]
        # a change of 1 rad all along weighs as much as a turn of the clamp by 1 rad
        self.weight = np.zeros(mesh.count)
        self.weight[mesh.degree - 1 : mesh.count - 2 : mesh.degree] = PARAMETER_WEIGHT / mesh.elements

    def start(self) -> _State:
        """The inextensible buckled beam at alpha = 0, Euler's clamped elastica."""
        phi = np.zeros(self.mesh.count)
        nodes = np.linspace(0.0, 1.0, self.mesh.elements + 1)
        phi[:: self.mesh.degree] = euler.tangent_angle(1.0 - self.chord, nodes)
        phi[-1] = 0.0
        return _State(self.side * phi, np.array([-16.0 * euler.pendulum(1.0 - self.chord)[1] ** 2, 0.0]))

    def advance(self, state: _State, increment: Array, parameter: float) -> _State:
        """Move the free angles and the force, and turn the clamp to `parameter`."""
        phi = state.phi.copy()
        phi[1:-1] += increment[:-2]
        phi[0] = -parameter
        return _State(phi, state.force + increment[-2:])

    def _section(self, state: _State) -> tuple[Array, Array, Array, Array]:
        """cos phi, sin phi, n . t and n . t_perp at the Gauss points."""
        phi = self.mesh.at_gauss(state.phi, self.mesh.value)
        cos, sin = np.cos(phi), np.sin(phi)
        nx, nz = state.force
        return cos, sin, nx * cos + nz * sin, nz * cos - nx * sin

    def linearise(self, state: _State, parameter: float) -> Linearisation:
        """Residual, its derivative in alpha, and the factorised tangent."""
        mesh, c = self.mesh, self.compliance
        cos, sin, along, across = self._section(state)
        stretch = 1.0 + c * along
        moment = np.einsum("eij,ej->ei", self.stiffness, state.phi[mesh.dofs])
        moment -= np.einsum("eiq,eq->ei", mesh.value, mesh.dx * across * stretch)
        curvature = mesh.dx * (along * stretch - c * across**2)
        tangent = self.stiffness + np.einsum("eiq,ejq,eq->eij", mesh.value, mesh.value, curvature)
        band: Array = np.zeros((mesh.count, mesh.degree + 1))
        np.add.at(band.ravel(), self._slot, tangent[self._lower])
        border = np.empty((2, mesh.count))
        gap = np.empty(2)
        for row, (t, normal) in enumerate(((cos, -sin), (sin, cos))):
            share = mesh.dx * (normal * stretch + c * across * t)
            border[row] = -self._gather(np.einsum("eiq,eq->ei", mesh.value, share))
            gap[row] = (self.chord if row == 0 else 0.0) - float((mesh.dx * t * stretch).sum())
        corner = -c * np.array(
            [[(mesh.dx * a * b).sum() for b in (cos, sin)] for a in (cos, sin)], dtype=np.float64
        )
        residual = np.concatenate((self._gather(moment)[1:-1], gap))
        column = np.zeros(mesh.count)
        column[: mesh.degree + 1] = -band[0]
        slope = np.concatenate((column[1:-1], -border[:, 0]))
        band = band[1:-1].copy()
        for d in range(1, mesh.degree + 1):
            band[len(band) - d :, d] = 0.0
        arrow = Arrow(band, border[:, 1:-1].copy(), corner)
        # two negative eigenvalues belong to the force
        return Linearisation(residual, slope, arrow.solve, arrow.negative - 2)

    def _gather(self, local: Array) -> Array:
        """Sum element vectors (elements, p + 1) into dofs."""
        total: Array = np.zeros(self.mesh.count)
        np.add.at(total, self.mesh.dofs, local)
        return total

    def momentum(self, state: _State, velocity: Array) -> Array:
        """M v of rates of phi and n: of the motion of r that follows from them, seen by the same unknowns."""
        mesh, c = self.mesh, self.compliance
        cos, sin, along, across = self._section(state)
        stretch = 1.0 + c * along
        phi = np.zeros(mesh.count)
        phi[1:-1] = velocity[:-2]
        turn = mesh.at_gauss(phi, mesh.value)
        moment, force = np.zeros(mesh.count), np.zeros(2)
        for t, normal in ((cos, -sin), (sin, cos)):
            by_turn = normal * stretch + c * across * t
            rate = by_turn * turn + c * t * (cos * velocity[-2] + sin * velocity[-1])
            field = mesh.integral(rate)
            weight = mesh.integral_adjoint(
                self._gather(np.einsum("eij,ej->ei", self.inertia, field[mesh.dofs]))
            )
            moment += self._gather(np.einsum("eiq,eq->ei", mesh.value, weight * by_turn))
            force += c * np.array([(weight * t * cos).sum(), (weight * t * sin).sum()])
        return np.concatenate((moment[1:-1], force))

    def shape(self, state: _State) -> tuple[Array, Array]:
        """Dofs of x and z, by quadrature from the left clamp."""
        cos, sin, along, _ = self._section(state)
        stretch = 1.0 + self.compliance * along
        return self.mesh.integral(cos * stretch), self.mesh.integral(sin * stretch)

    def observe(self, state: _State, parameter: float) -> tuple[float, float, float]:
        """z(1/2)/L, the z-component of the unit tangent there, and the compressive end force."""
        height = self.mesh.middle(self.shape(state)[1])
        return height, float(np.sin(self.mesh.middle(state.phi))), -float(state.force[0])

    def positions(self, state: _State, parameter: float) -> Array:
        """Positions of the nodes in L."""
        x, z = (field[:: self.mesh.degree] for field in self.shape(state))
        return np.column_stack((x, np.zeros_like(x), z))


def folds(
    scene: Scene, *, elements: int = 48, extensible: bool = False, steps: Steps | None = None
) -> tuple[Fold, ...]:
    """The folds that a very slow ramp meets (one, on the side of the start state).

    Parameters
    ----------
    scene: a planar scene.
    elements: cubic elements, at least 4; errors fall as elements^-6.
    extensible: whether the beam stretches, with EA of the rectangular section.
    steps: continuation step control.

    Raises
    ------
    SceneError, PolicyError, SolverError
        For a sheared scene, a mesh that cannot be, a continuation that fails.
    """
    problem = Statics(scene, elements, extensible)
    found = ramp_folds(problem, problem.start(), scene, steps)
    return tuple(as_fold(problem, event.point) for event in found)


def normal_forms(scene: Scene, *, elements: int = 10, extensible: bool = False) -> tuple[NormalForm, ...]:
    """The normal forms of the folds that a very slow ramp meets: what `delay.predict` needs.

    The default mesh is that of `simulate`; parameters and errors as in `folds`.
    """
    problem = Statics(scene, elements, extensible)
    return ramp_normal_forms(problem, problem.start(), scene)


def equilibria(
    scene: Scene,
    *,
    elements: int = 48,
    extensible: bool = False,
    span: tuple[float, float] = (-1.5, 1.5),
    unstable: int = 2,
    steps: Steps | None = None,
) -> Branch:
    """The connected curve of equilibria through the start state, for alpha in `span`.

    Parameters and errors as in `folds`; `span` in rad, with 0 inside.  The curve climbs through
    ever higher modes: it ends with the first state of more than `unstable` unstable directions.
    """
    problem = Statics(scene, elements, extensible)
    curve = whole_curve(problem, problem.start(), interval("span", span), steps, unstable)
    policy = {"elements": elements, "extensible": extensible, "span": span, "unstable": unstable}
    return curve.as_branch(scene, policy)


def tables(problem: Statics) -> Tables:
    """The beam as arrays for the compiled time loop."""
    mesh = problem.mesh
    coupling = np.einsum("eiq,ekq,eq->eik", mesh.grad, mesh.force, mesh.dx)
    # what is orthogonal is zero, and the kernel passes over it
    coupling[np.abs(coupling) < 1e-12] = 0.0
    index, weight = mesh.middle_weights()
    none = np.zeros((0, 0))
    return Tables(
        kind=ELASTICA,
        clamp=-1.0,
        middle_dof=mesh.count + index,
        middle_weight=weight,
        value=np.ascontiguousarray(mesh.value),
        force=np.ascontiguousarray(mesh.force),
        dx=mesh.dx,
        bending=problem.stiffness,
        inertia=problem.inertia,
        coupling=coupling,
        dofs=mesh.dofs,
        places=local_places(mesh.degree),
        compliance=problem.compliance,
        stiffness=none,
        tension=none,
        mass=none,
    )


def at_rest(problem: Statics, state: _State) -> tuple[Array, Array]:
    """The dofs q, w of the time loop in an equilibrium."""
    mesh = problem.mesh
    x, z = problem.shape(state)
    # the right clamp, to the last digit
    x[-1], z[-1] = problem.chord, 0.0
    force = np.zeros((mesh.elements, 2, mesh.degree))
    force[:, :, 0] = state.force
    return np.concatenate((x, z)), np.concatenate((state.phi, force.ravel()))


def simulate(
    scene: Scene,
    *,
    elements: int = 10,
    extensible: bool = False,
    method: str = "tr-bdf2",
    step: float | None = None,
    tolerance: float | None = None,
    spectral_radius: float | None = None,
    until: str = "end",
) -> History:
    """The motion from rest in the start state, through the ramp and the hold.

    Parameters
    ----------
    scene: a planar scene with a `stop`.
    elements: cubic elements, at least 4; errors fall as elements^-6.
    extensible: whether the beam stretches, with EA of the rectangular section.
    method: "tr-bdf2", "generalised-alpha", "newmark" (trapezoidal) or "implicit-euler".
    step: a fixed step in s, shortened so that a whole number of steps fits the ramp.
    tolerance: of the adaptive step, the local error of positions in L; 3e-6 if neither is given,
        which keeps the angle of a snap to some 5e-5 (`ribbonfem accuracy`).
    spectral_radius: of "generalised-alpha" at infinite frequency, in (0, 1]; 0.8.
    until: "end", or "snap", soon after the height first changes sign.

    Returns
    -------
    `History`, with the nodes' "positions" and the "load", the compressive force averaged along
    the beam (EI2/L^2), as configurations.

    Raises
    ------
    SceneError, PolicyError
        For a sheared scene, one without `stop`, a policy that cannot be.
    SolverError
        If no step converges; what was reached is its `history`.
    """
    control = Control.of(method, step, tolerance, until, spectral_radius, TOLERANCE)
    problem = Statics(scene, elements, extensible)
    scene.require_stop()
    state, _ = equilibrium(problem, problem.start(), 0.0)
    motion = integrate(tables(problem), scene, control, *at_rest(problem, state))
    mesh = problem.mesh
    nodes = mesh.degree * np.arange(mesh.elements + 1)
    x, z = motion.q[:, nodes], motion.q[:, mesh.count + nodes]
    index, weights = mesh.middle_weights()
    policy = {
        "elements": elements,
        "extensible": extensible,
        "method": method,
        "step": step,
        "tolerance": control.tolerance,
        "spectral_radius": spectral_radius,
        "until": until,
    }
    return motion.as_history(
        scene,
        policy,
        slope=np.sin(motion.w[:, index] @ weights),
        positions=np.stack((x, np.zeros_like(x), z), axis=2),
    )
