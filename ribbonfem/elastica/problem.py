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

from ribbonfem.closed_form import euler
from ribbonfem.continuation import PARAMETER_WEIGHT, Linearisation
from ribbonfem.elements.legendre import Mesh
from ribbonfem.linalg.banded import Arrow
from ribbonfem.options import flag, require_memory, whole_number
from ribbonfem.results import Array
from ribbonfem.scene import Scene


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
        count = whole_number("elements", elements, 4)
        require_memory("elements", elements, 2e4 * count, "the mesh")
        self.compliance = 1.0 / scene.ribbon.stretch_ratio if flag("extensible", extensible) else 0.0
        self.mesh = Mesh(count)
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

    @property
    def arclength(self) -> Array:
        """(nodes,) s/L of the nodes whose positions are handed out."""
        return np.linspace(0.0, 1.0, self.mesh.elements + 1)

    def start(self) -> _State:
        """The buckled beam at alpha = 0: Euler's clamped elastica, less of it where the beam stretches."""
        phi = np.zeros(self.mesh.count)
        nodes = np.linspace(0.0, 1.0, self.mesh.elements + 1)
        bent = euler.bent(1.0 - self.chord, self.compliance)
        phi[:: self.mesh.degree] = euler.tangent_angle(bent, nodes)
        phi[-1] = 0.0
        return _State(self.side * phi, np.array([-16.0 * euler.pendulum(bent)[1] ** 2, 0.0]))

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

    def momentum(self, state: _State, velocity: Array, turning: float = 0.0) -> Array:
        """M v of rates of phi, n and alpha: of the motion of r that follows, seen by the same unknowns."""
        mesh, c = self.mesh, self.compliance
        fields = self.moving(state, velocity, turning)
        cos, sin, along, across = self._section(state)
        stretch = 1.0 + c * along
        moment, force = np.zeros(mesh.count), np.zeros(2)
        for field, t, normal in zip(fields, (cos, sin), (-sin, cos), strict=True):
            by_turn = normal * stretch + c * across * t
            weight = mesh.integral_adjoint(
                self._gather(np.einsum("eij,ej->ei", self.inertia, field[mesh.dofs]))
            )
            moment += self._gather(np.einsum("eiq,eq->ei", mesh.value, weight * by_turn))
            force += c * np.array([(weight * t * cos).sum(), (weight * t * sin).sum()])
        return np.concatenate((moment[1:-1], force))

    def moving(self, state: _State, velocity: Array, turning: float = 0.0) -> tuple[Array, Array]:
        """Rates of the dofs of x and z, by rates of phi, n and alpha."""
        mesh, c = self.mesh, self.compliance
        cos, sin, along, across = self._section(state)
        stretch = 1.0 + c * along
        phi = np.zeros(mesh.count)
        phi[0], phi[1:-1] = -turning, velocity[:-2]
        turn = mesh.at_gauss(phi, mesh.value)
        longer = c * (cos * velocity[-2] + sin * velocity[-1])
        x, z = (
            mesh.integral((normal * stretch + c * across * t) * turn + t * longer)
            for t, normal in ((cos, -sin), (sin, cos))
        )
        return x, z

    def energy(self, state: _State) -> float:
        """Elastic energy in EI2/L, of bending and of stretch."""
        mesh = self.mesh
        local = state.phi[mesh.dofs]
        bending = float(np.einsum("ei,eij,ej->", local, self.stiffness, local))
        along = self._section(state)[2]
        return 0.5 * bending + 0.5 * self.compliance * float((mesh.dx * along**2).sum())

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
