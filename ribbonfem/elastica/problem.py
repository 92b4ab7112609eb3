"""The elastica's functional, its mesh, and its equilibrium equations for continuation (paper, section 4.1).

The tangent has the angle phi to the x axis, the cross-section carries the force n.  With
lengths in L, forces in EI2/L^2, energies in EI2/L, t = (cos phi, sin phi) in the (x, z) plane
and c = EI2 / (EA L^2), the Hellinger-Reissner functional is

    int [ (phi' - kappa0)^2 / 2 + n . (r' - t) - c (n . t)^2 / 2 - w . r ] ds + F z(1/2),

so that r' = t (1 + c n . t), with the natural curvature kappa0, the weight w and a force F at midspan.  The
clamps are r(0) = 0, r(1) = (1 - dL/L - compression, lift), phi(0) = -left, phi(1) = right.
`extensible=False` is c = 0, the paper's elastica; `extensible=True` has the stretching stiffness of the
rectangular section.

Discretisation: that of the Kirchhoff elements, in the plane.  phi and r are continuous of degree
p = 5, by their values at the Gauss-Lobatto nodes; n has its values at the p Gauss points of an
element, which take all integrals, and the mass is lumped at the nodes.  This is the same as
collocation of r' = t (1 + c n . t) at the Gauss points, or as selective reduced integration of a
Simo-Reissner beam without shear:

* nothing locks, because stretch is a force here and not a difference of positions: the same
  code serves c = 0 and c > 0, and folds at h = 0.001 L are as exact as at h = 0.1 L;
* nodal values, folds and snaps converge with the power 2 p = 10 of the mesh, as
  collocation at Gauss points does (de Boor & Swartz, SIAM J. Numer. Anal. 10 (1973) 582);
* at rest n is a constant, and what the loads leave of it, and r follows from phi by quadrature: the
  statics have the unknowns phi and one force, a band with a border of two rows.

Rotary inertia is left out, as in the paper's beam: of a thin strip it moves frequencies by
h^2 pi^2 / 24 L^2, 4e-5 for the default ribbon.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from ribbonfem.closed_form import euler
from ribbonfem.continuation import PARAMETER_WEIGHT, Linearisation, parameter_weight
from ribbonfem.elements.lobatto import LineTables, interpolation_at, line_tables, lobatto_weights
from ribbonfem.ends import Ends
from ribbonfem.ends.planar import Rig
from ribbonfem.ends.planar_kernels import COMPRESSION, LEFT, LIFT, PUSH, RIGHT
from ribbonfem.linalg.banded import Arrow
from ribbonfem.options import flag, require_memory, whole_number
from ribbonfem.results import Array
from ribbonfem.scene import Scene

from .kernels import statics as kernels
from .kernels.beam import P


@dataclass(frozen=True)
class _State:
    """phi at the nodes with the clamps in place, n (2,) at the right clamp, and where the parameter is."""

    phi: Array
    force: Array
    at: float = 0.0


@dataclass(frozen=True)
class Mesh:
    """A uniform mesh of elements of degree P.

    Attributes
    ----------
    tables: of scikit-fem's element.
    nodes: (elements, P + 1) numbers of each element's nodes.
    lumps: (P + 1,) masses of an element's nodes; mass: (nodes,) of all.
    weights: (P,); coupling: (P, P + 1), weights times derivatives of the shape functions; bending:
        (P + 1, P + 1), int N_i' N_j', of an element; partial: (P + 1, P), by which an integral over it grows.
    middle: (elements, P + 1), by which nodal values are one at midspan.
    weight: (unknowns,) of a change in an arclength of states: 1 rad all along weighs as much as a turn of the
        clamp by 1 rad.
    """

    tables: LineTables
    nodes: NDArray[np.int64]
    lumps: Array
    mass: Array
    weights: Array
    coupling: Array
    bending: Array
    partial: Array
    middle: Array
    weight: Array


@lru_cache(maxsize=32)
def mesh_of(elements: int) -> Mesh:
    """The mesh of so many elements; kept."""
    tables = line_tables(elements, P)
    nodes = np.arange(elements)[:, None] * P + np.arange(P + 1)
    # (a read-only array is another type to compiled code)
    lumps = lobatto_weights(P) / elements
    weights = tables.weights[0]
    coupling = np.ascontiguousarray(weights[:, None] * tables.slope[0])
    middle = np.zeros((elements, P + 1))
    middle[(elements - 1) // 2] = interpolation_at(P, 1.0 if elements % 2 == 0 else 0.5)
    mass = np.asarray(np.bincount(nodes.ravel(), np.tile(lumps, elements)), dtype=np.float64)
    return Mesh(
        tables,
        nodes,
        lumps,
        mass,
        weights,
        coupling,
        bending=coupling.T @ tables.slope[0],
        partial=tables.partial / elements,
        middle=middle,
        weight=np.append(PARAMETER_WEIGHT * mass[1:-1], np.zeros(2)),
    )


@lru_cache(maxsize=32)
def carried_of(elements: int) -> tuple[Array, Array]:
    """n (elements, P) by which a beam held at its right end carries a weight, and a load at midspan, of 1."""
    mesh, points = mesh_of(elements), line_tables(elements, P).points
    load = np.where(points < 0.5, 1.0, 0.0)
    if elements % 2:
        # inside the element of midspan: D^T n is what its nodes have of the load
        nodal = mesh.middle[elements // 2].copy()
        nodal[0] -= 1.0
        load[elements // 2] = np.linalg.lstsq(mesh.coupling.T, nodal, rcond=None)[0]
    return 1.0 - points, load


@lru_cache(maxsize=32)
def _nothing_carried(elements: int) -> Array:
    return np.zeros((elements, P, 6))


class Statics:
    """The equilibrium equations of the elastica in one parameter, the scene's control if no `rig` is given.

    Unknowns are phi of the inner nodes and the two components of n.  A `continuation.Problem`.
    """

    def __init__(self, scene: Scene, elements: int, extensible: bool, rig: Rig | None = None) -> None:
        scene.require_planar("elastica")
        count = whole_number("elements", elements, 4)
        require_memory("elements", elements, 4e4 * count, "the mesh")
        self.scene = scene
        self.compliance = 1.0 / scene.ribbon.stretch_ratio if flag("extensible", extensible) else 0.0
        self.elements, self.extensible = count, bool(extensible)
        self.mesh = mesh = mesh_of(count)
        self.tables, self.nodes, self.mass, self.middle = mesh.tables, mesh.nodes, mesh.mass, mesh.middle
        self.chord = 1.0 - scene.compression
        self.side = 1.0 if scene.start == "U+" else -1.0
        self.unit = scene.ribbon.inertial_time
        self.weight = mesh.weight
        self._rig_by(Rig.of(scene, self.tables.points) if rig is None else rig)

    def _rig_by(self, rig: Rig) -> None:
        mesh, self.rig = self.mesh, rig
        # what is kept is of another rig
        vars(self).pop("parameter_weight", None)
        self._carried = self._carry() if rig.loaded else _nothing_carried(self.elements)
        self._arrays = (
            mesh.tables.value,
            mesh.weights,
            mesh.coupling,
            mesh.bending,
            self.compliance,
            np.array([-rig.moves[LEFT], rig.moves[RIGHT]]),
        )

    @cached_property
    def parameter_weight(self) -> float:
        """Of the parameter, in an arclength of states."""
        return parameter_weight(self.rig.moved)

    def along(self, ends: Ends) -> Statics:
        """The same equations with other ends, whose controls may move otherwise with the parameter."""
        other = copy(self)
        other._rig_by(self.rig.along(ends))
        return other

    @property
    def arclength(self) -> Array:
        """(nodes,) s/L of the nodes whose positions are handed out."""
        return self.tables.nodes

    def _carry(self) -> Array:
        """n by the loads and the natural curvature at parameter 0, and their changes, (elements, P, 6)."""
        rig = self.rig
        by_weight, by_push = carried_of(self.elements)
        carried = np.zeros((self.elements, P, 6))
        for k, share, push in zip((0, 3), rig.share, (rig.controls[PUSH], rig.moves[PUSH]), strict=True):
            if share:
                carried[:, :, k : k + 2] = by_weight[:, :, None] * (share * rig.weight)
                carried[:, :, k + 2] = share * rig.curvature
            carried[:, :, k + 1] -= push * by_push
        return carried

    def controls(self, parameter: float) -> Array:
        """(CONTROLS,) at a value of the parameter."""
        return self.rig.at(parameter)

    def force(self, state: _State) -> Array:
        """n (elements, P, 2) at the Gauss points."""
        carried = self._carried
        force: Array = state.force + carried[:, :, :2] + state.at * carried[:, :, 3:5]
        return force

    def natural(self, state: _State) -> Array:
        """phi' (elements, P) without a moment at the Gauss points."""
        natural: Array = self._carried[:, :, 2] + state.at * self._carried[:, :, 5]
        return natural

    def start(self) -> _State:
        """The buckled beam at alpha = 0: Euler's clamped elastica, less of it where the beam stretches."""
        bent = euler.bent(1.0 - self.chord, self.compliance)
        phi = euler.tangent_angle(bent, self.tables.nodes)
        phi[0] = phi[-1] = 0.0
        return _State(self.side * phi, np.array([-16.0 * euler.pendulum(bent)[1] ** 2, 0.0]))

    def advance(self, state: _State, increment: Array, parameter: float) -> _State:
        """Move the inner angles and the force, and the clamps to `parameter`."""
        phi = state.phi.copy()
        phi[1:-1] += increment[:-2]
        controls = self.controls(parameter)
        phi[0], phi[-1] = -controls[LEFT], controls[RIGHT]
        return _State(phi, state.force + increment[-2:], parameter)

    def linearise(self, state: _State, parameter: float) -> Linearisation:
        """Residual, its derivative in the parameter, and the factorised tangent."""
        moves, controls = self.rig.moves, self.controls(parameter)
        residual, column, *parts, negative = kernels.linearised(
            state.phi, state.force, float(parameter), self._carried, *self._arrays
        )
        residual[-2] += self.chord - controls[COMPRESSION]
        residual[-1] += controls[LIFT]
        column[-2] -= moves[COMPRESSION]
        column[-1] += moves[LIFT]
        # two negative eigenvalues belong to the force
        return Linearisation(residual, column, Arrow.of(parts, negative).solve, negative - 2)

    def section(self, state: _State) -> tuple[Array, Array, Array, Array, Array]:
        """phi', cos phi, sin phi, n . t and n . t_perp (elements, P) at the Gauss points."""
        local = state.phi[self.nodes]
        phi = local @ self.tables.value.T
        cos, sin = np.cos(phi), np.sin(phi)
        nx, nz = np.moveaxis(self.force(state), 2, 0)
        return local @ self.tables.slope[0].T, cos, sin, nx * cos + nz * sin, nz * cos - nx * sin

    def momentum(self, state: _State, velocity: Array, control_rate: float = 0.0) -> Array:
        """M v of rates of phi, n and the parameter: of the motion of r that follows, by the same unknowns."""
        tables, c = self.tables, self.compliance
        moved, by_turn, tangent = self._moving(state, velocity, control_rate)
        weights = tables.integral_adjoint(self.mass[:, None] * moved)
        share = np.einsum("ekb,ekb->ek", weights, by_turn)
        moment = np.bincount(self.nodes.ravel(), (share @ tables.value).ravel())
        force = c * np.einsum("ekb,ekb,ekd->d", weights, tangent, tangent)
        return np.concatenate((moment[1:-1], force))

    def moving(self, state: _State, velocity: Array, control_rate: float = 0.0) -> Array:
        """Velocities (nodes, 2) along x and z, by rates of phi, n and the parameter."""
        return self._moving(state, velocity, control_rate)[0]

    def _moving(self, state: _State, velocity: Array, control_rate: float) -> tuple[Array, Array, Array]:
        """`moving`; and (elements, P, 2) at the Gauss points derivatives of r' in phi, and tangents."""
        c = self.compliance
        _, cos, sin, tension, shear = self.section(state)
        tangent, normal = np.stack((cos, sin), axis=2), np.stack((-sin, cos), axis=2)
        by_turn = (1.0 + c * tension)[:, :, None] * normal + (c * shear)[:, :, None] * tangent
        ends = control_rate * self.rig.moves
        phi = np.concatenate(([-ends[LEFT]], velocity[:-2], [ends[RIGHT]]))
        at_points = phi[self.nodes] @ self.tables.value.T
        longer = c * np.sum(tangent * (velocity[-2:] + control_rate * self._carried[:, :, 3:5]), axis=2)
        moved = self.tables.integral(by_turn * at_points[:, :, None] + tangent * longer[:, :, None])
        return moved, by_turn, tangent

    def energy(self, state: _State) -> float:
        """Elastic energy in EI2/L, of bending and of stretch."""
        bent, _, _, tension, _ = self.section(state)
        density = (bent - self.natural(state)) ** 2 + self.compliance * tension**2
        return 0.5 * float(np.sum(self.tables.weights * density))

    def shape(self, state: _State) -> tuple[Array, Array]:
        """x and z (nodes,), by quadrature from the left clamp."""
        at, value, partial = float(state.at), self.mesh.tables.value, self.mesh.partial
        x, z = kernels.shape(state.phi, state.force, at, self._carried, value, partial, self.compliance)
        return x, z

    def at_middle(self, field: Array) -> float:
        """A field (nodes,) at midspan."""
        return float(np.sum(self.middle * field[self.nodes]))

    def observe(self, state: _State, parameter: float) -> tuple[float, float, float]:
        """z(1/2)/L, the z-component of the unit tangent there, and the compressive end force."""
        height = self.at_middle(self.shape(state)[1])
        return height, float(np.sin(self.at_middle(state.phi))), -float(state.force[0])

    def positions(self, state: _State, parameter: float) -> Array:
        """Positions of the nodes in L."""
        x, z = self.shape(state)
        return np.column_stack((x, np.zeros_like(x), z))
