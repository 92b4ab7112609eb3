"""Mesh, unknowns and equilibrium equations of the Kirchhoff rod in one parameter, for continuation.

Among rods with given end frames and a given chord R, an equilibrium is a stationary point of

    L(g, n) = int [ 1/2 (EI1 kappa1^2 + EI2 kappa2^2 + GJ tau^2) - n.t - (n.t)^2 / (2 EA) ] ds + n.R

(paper, section 3.1; J. H. Maddocks, "Stability of nonlinearly elastic rods", Arch. Rational
Mech. Anal. 85 (1984), for the index of such constrained problems).  n is the force in the rod,
constant along it, and the multiplier of the chord; 1/EA is 0 for an inextensible rod.  Lengths
in L, forces in EI2/L^2, energies in EI2/L.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ribbonfem.closed_form import euler
from ribbonfem.continuation import Linearisation, parameter_weight
from ribbonfem.elements.lobatto import LineTables, line_tables, lobatto_weights
from ribbonfem.ends import Ends
from ribbonfem.options import OptionError, flag, require_memory, whole_number
from ribbonfem.results import Array
from ribbonfem.scene import Ribbon

from .frames import about, directors, tangents_of
from .kernels import statics as kernels
from .kernels.batch import in_groups

# Fold angles converge with the tenth power of the mesh; lower degrees are slower at equal error.
DEGREE = 5

# Mean square rotation (rad^2) against lengths (L^2) in the arclength.
ROTATION_WEIGHT = 0.09


@dataclass(frozen=True)
class Frames:
    """The unknowns, and the parameter at which they are: loads are those of it.

    Unit quaternions (nodes, 4) of the rotation from the unturned clamp's frame; n (3,) at the right clamp.
    """

    g: Array
    force: Array
    at: float = 0.0


class Statics:
    """Equilibrium equations of a clamped Kirchhoff rod in one parameter of its ends.

    A `continuation.Problem`.  Vectors hold the quaternion increments of the inner nodes, node
    by node, then n: (4 m + 3,).  The increments count along the unit spheres only: the tangent
    works, and is factorised, on three per node.

    Parameters
    ----------
    ribbon: stiffness ratios and natural shape.
    ends: what the parameter does to the clamps and loads.
    elements: even; midspan is a node.
    extensible: whether the rod stretches with EA.
    """

    def __init__(
        self,
        ribbon: Ribbon,
        ends: Ends,
        *,
        elements: int,
        extensible: bool = False,
        degree: int = DEGREE,
    ) -> None:
        self.ends = ends
        self.ribbon = ribbon
        self.tables: LineTables = line_tables(elements, degree)
        # the same for groups of elements
        self.slope, self.weights = in_groups(self.tables.slope), in_groups(self.tables.weights)
        self.stiffness = np.array([ribbon.twist_ratio, 1.0, ribbon.bending_ratio])
        self.compliance = 1.0 / ribbon.stretch_ratio if extensible else 0.0
        self.extensible = extensible
        curvature, twist = ribbon.natural(self.tables.points)
        # of the body strains (tau, -kappa2, kappa1)
        self.natural = np.stack((twist, -curvature, np.zeros_like(twist)), axis=-1)
        self._natural_groups = in_groups(self.natural)
        self._no_loads = np.zeros_like(self._natural_groups)
        self.loaded = ends.pushes
        self.unit = ribbon.inertial_time
        self.spin = ribbon.rotary_inertia
        lumps = lobatto_weights(degree) / elements
        self.mass = np.zeros(len(self.tables.nodes))
        for i in range(degree + 1):
            self.mass[i : i + elements * degree : degree] += lumps[i]
        inner = len(self.tables.nodes) - 2
        # s/L of the nodes
        self.arclength = self.tables.nodes
        self.weight = np.zeros(4 * inner + 3)
        # |dg| is half the angle
        self.weight[: 4 * inner] = 4.0 * ROTATION_WEIGHT / inner
        self.parameter_weight = parameter_weight(ends.moved)

    @property
    def one_stiffness(self) -> bool:
        """Whether both bending stiffnesses are the same, as far as the tangent's digits tell."""
        return self.ribbon.one_stiffness

    def stiffened(self, share: float) -> Statics:
        """The same equations with EI1/EI2 larger by a share."""
        other = copy(self)
        other.stiffness = self.stiffness * np.array([1.0, 1.0, 1.0 + share])
        return other

    def along(self, ends: Ends) -> Statics:
        """The same equations with other ends, whose controls may move otherwise with the parameter."""
        other = copy(self)
        other.ends, other.loaded = ends, ends.pushes
        other.parameter_weight = parameter_weight(ends.moved)
        return other

    def tangential(self, state: Frames, vector: Array) -> Array:
        """The part of a vector (4 m + 3,) along the unit spheres of the quaternions."""
        result = vector.copy()
        frames, inner = result[:-3].reshape(-1, 4), state.g[1:-1]
        frames -= np.sum(frames * inner, axis=1)[:, None] * inner
        return result

    @property
    def compression(self) -> float:
        """dL/L where the controls are 0."""
        return 1.0 - float(self.ends.chord[0])

    def loads(self, parameter: float) -> Array:
        """(elements, p, 3) what the force in the rod is at the Gauss points besides that at the right clamp.

        n' = -w: the weight of what is between there and the right clamp, and the force at midspan.
        """
        points = self.tables.points[:, :, None]
        force, _ = self.ends.force(parameter)
        return np.asarray((1.0 - points) * self.ends.weight + (points < 0.5) * force)

    def unbent(self, parameter: float) -> Array:
        """(elements, p, 3) strains (tau, -kappa2, kappa1) of the unloaded ribbon at the Gauss points."""
        return self.natural

    def unbent_groups(self, parameter: float) -> Array:
        """The same for groups of elements."""
        return self._natural_groups

    def crosses_plane(self, null: Array) -> bool:
        """Whether a change of the unknowns leaves the plane y = 0."""
        # turns about y are in the plane, those about x and z, and a force along y, across it
        turns = null[:-3].reshape(-1, 4)
        return bool((turns[:, 1::2] ** 2).sum() > (turns[:, 2] ** 2).sum())

    def buckled(self, compression: float) -> Frames:
        """The planar elastica clamped at both ends, z > 0, at alpha = dW = 0, in closed form.

        Of a rod that stretches, the one whose stretch is that of Euler's load all along.
        """
        compression = euler.bent(compression, self.compliance)
        period = 4.0 * euler.pendulum(compression)[1]
        sine = np.sin(0.5 * euler.tangent_angle(compression, self.tables.nodes))
        g = np.zeros((len(sine), 4))
        g[:, 0], g[:, 2] = np.sqrt(1.0 - sine**2), -sine
        g[0] = g[-1] = 1.0, 0.0, 0.0, 0.0
        return Frames(g, np.array([-(period**2), 0.0, 0.0]))

    def advance(self, state: Frames, increment: Array, parameter: float) -> Frames:
        """Move the inner frames and the force, and the clamp to `parameter`."""
        g = kernels.move(state.g, np.ascontiguousarray(increment), self.ends.poses(parameter)[0])
        return Frames(g, state.force + increment[-3:], parameter)

    def assembled(self, state: Frames, parameter: float) -> tuple[Any, ...]:
        """Residual, its derivative in the parameter, tangent-space basis, band, border and corner.

        Then what `banded.factored` makes of them.
        """
        ends = self.ends
        residual, column, *parts = kernels.linearised(
            state.g,
            state.force,
            in_groups(self.loads(parameter)) if self.loaded else self._no_loads,
            self.tables.value,
            self.slope,
            self.weights,
            self.stiffness,
            self.compliance,
            self.unbent_groups(parameter),
            ends.poses(parameter)[1],
            ends.force(parameter)[1],
        )
        chord, change = ends.reach(parameter)
        residual[-3:] += chord
        column[-3:] += change
        return residual, column, *parts

    def linearise(self, state: Frames, parameter: float) -> Linearisation:
        """Residual, its derivative in the parameter, and the factorised tangent."""
        residual, column, basis, *parts, negative = self.assembled(state, parameter)
        factorised = tuple(parts)

        def solve(right: Array) -> Array:
            x = np.ascontiguousarray(right.reshape(len(right), -1))
            return np.asarray(kernels.solved(basis, factorised, x)).reshape(right.shape)

        # three negative eigenvalues belong to the multipliers
        return Linearisation(residual, column, solve, negative - 3)

    def strains(self, state: Frames) -> tuple[Array, Array]:
        """Body strains (tau, -kappa2, kappa1) and r' at the Gauss points, (elements, p, 3) each."""
        tables = self.tables
        curvature = np.empty((tables.elements, tables.degree, 3))
        stretched = np.empty_like(curvature)
        kernels.strains(
            state.g,
            state.force,
            self.loads(state.at),
            tables.value,
            tables.slope,
            self.compliance,
            curvature,
            stretched,
        )
        return curvature, stretched

    def normals(self, state: Frames) -> Array:
        """Unit vectors m1 (nodes, 3) normal to the surface, at the nodes."""
        return directors(state.g)[:, 0]

    def energy(self, state: Frames) -> float:
        """Elastic energy in EI2/L."""
        curvature, stretched = self.strains(state)
        density = (curvature - self.unbent(state.at)) ** 2 @ self.stiffness
        if self.extensible:
            stretch = np.linalg.norm(stretched, axis=2) - 1.0
            density += stretch**2 / self.compliance
        return 0.5 * float(np.sum(self.tables.weights * density))

    def potential(self, state: Frames) -> float:
        """That and the energy of the weight and of the force at midspan: what is least at rest."""
        _, stretched = self.strains(state)
        # int w . r ds + f . r(1/2), by parts
        acting = np.einsum("ek,ekb,ekb->", self.tables.weights, self.loads(state.at), stretched)
        return self.energy(state) - float(acting)

    def positions(self, state: Frames, parameter: float) -> Array:
        """Node positions (nodes, 3) in L."""
        return self._integral(self.strains(state)[1])

    def _integral(self, derivative: Array) -> Array:
        """The field (nodes, 3), 0 at s = 0, of a derivative (elements, p, 3) at the Gauss points."""
        tables = self.tables
        result = np.zeros((len(tables.nodes), 3))
        ends = np.cumsum(np.einsum("ek,ekb->eb", tables.weights, derivative), axis=0)
        inside = np.einsum("ik,ekb->eib", tables.partial[:-1], derivative) / tables.elements
        inside[1:] += ends[:-1, None]
        result[:-1] = inside.reshape(-1, 3)
        result[-1] = ends[-1]
        return result

    def _integral_adjoint(self, field: Array) -> Array:
        """Factors (elements, p, 3) of a derivative in the sum of `field` (nodes, 3) times its `_integral`."""
        tables = self.tables
        inside = field[:-1].reshape(tables.elements, tables.degree, 3)
        # what lies beyond an element's right end moves with the whole of it
        beyond = np.cumsum(inside.sum(axis=1)[::-1], axis=0)[::-1]
        beyond = np.concatenate((beyond[1:], np.zeros((1, 3)))) + field[-1]
        result = np.einsum("ik,eib->ekb", tables.partial[:-1], inside) / tables.elements
        return np.asarray(result + tables.weights[:, :, None] * beyond[:, None])

    def momentum(self, state: Frames, velocity: Array, control_rate: float = 0.0) -> Array:
        """M v of rates of g, n and alpha: of the motion of r that follows, and of the spin about t.

        Bending rotations have no inertia; the mass is lumped at the nodes, as in `simulate`.
        """
        tables, c = self.tables, self.compliance
        moved, spin, by_frame, tangent = self._moving(state, velocity, control_rate)
        weights = self._integral_adjoint(self.mass[:, None] * moved)
        result = np.zeros_like(state.g)
        share = np.einsum("ekb,ekbc->ekc", weights, by_frame)
        np.add.at(result, self._local, np.einsum("ki,ekc->eic", tables.value, share))
        result += 2.0 * self.spin * (self.mass * spin)[:, None] * about(state.g)
        # a tension is the same all along: n has the momentum of the stretch that it makes
        force = c * np.einsum("ekb,ekb,ekd->d", weights, tangent, tangent)
        return np.concatenate((result[1:-1].ravel(), force))

    def moving(self, state: Frames, velocity: Array, control_rate: float = 0.0) -> tuple[Array, Array]:
        """Velocities (nodes, 3) and spins about the tangent (nodes,) by rates of g, n and alpha."""
        return self._moving(state, velocity, control_rate)[:2]

    @property
    def _local(self) -> NDArray[np.int64]:
        degree = self.tables.degree
        return np.arange(self.tables.elements)[:, None] * degree + np.arange(degree + 1)

    def _moving(
        self, state: Frames, velocity: Array, control_rate: float
    ) -> tuple[Array, Array, Array, Array]:
        """`moving`, and at the Gauss points the derivatives of r' (elements, p, 3, 4), and the tangents."""
        tables, c = self.tables, self.compliance
        rate = np.zeros_like(state.g)
        rate[1:-1] = velocity[:-3].reshape(-1, 4)
        rate[0] = control_rate * self.ends.left(state.at)[1]
        rate[-1] = control_rate * self.ends.right(state.at)[1]
        q = np.einsum("ki,eic->ekc", tables.value, state.g[self._local])
        change = np.einsum("ki,eic->ekc", tables.value, rate[self._local])
        tangent, derivative = tangents_of(q)
        forces = state.force + self.loads(state.at)
        tension = np.einsum("ekb,ekb->ek", tangent, forces)
        # d r' = (1 + c n.t) dt + c t (n.dt + t.dn), as a matrix of dq
        by_frame = (1.0 + c * tension)[:, :, None, None] * derivative
        by_frame += c * tangent[:, :, :, None] * np.einsum("ekb,ekbc->ekc", forces, derivative)[:, :, None]
        points = tables.points[:, :, None]
        pulled = velocity[-3:] + control_rate * (points < 0.5) * self.ends.force(state.at)[1]
        longer = c * np.einsum("ekb,ekb->ek", tangent, pulled)
        moved = np.einsum("ekbc,ekc->ekb", by_frame, change) + longer[:, :, None] * tangent
        # half the angle about t is the increment along g i
        spin = 2.0 * np.sum(about(state.g) * rate, axis=1)
        return self._integral(moved), spin, by_frame, tangent

    def middle(self, state: Frames) -> tuple[Array, Array]:
        """Position and unit tangent at midspan, (3,) each."""
        half = self.tables.elements // 2
        _, stretched = self.strains(state)
        position = np.einsum("ek,ekb->b", self.tables.weights[:half], stretched[:half])
        w, x, y, z = state.g[half * self.tables.degree]
        return position, np.array([w * w + x * x - y * y - z * z, 2 * (x * y + w * z), 2 * (x * z - w * y)])

    def observe(self, state: Frames, parameter: float) -> tuple[float, float, float]:
        """z(1/2)/L, the z-component of the tangent there, and -n_x, the compressive end force."""
        position, tangent = self.middle(state)
        return float(position[2]), float(tangent[2]), -float(state.force[0])

    def profiles(self, state: Frames) -> dict[str, Any]:
        """Arclength, kappa1, kappa2 and tau (1/L) at the Gauss points, where they are most accurate."""
        curvature, _ = self.strains(state)
        return {
            "points": self.tables.points.ravel(),
            "kappa1": curvature[:, :, 2].ravel(),
            "kappa2": -curvature[:, :, 1].ravel(),
            "tau": curvature[:, :, 0].ravel(),
        }


def checked_mesh(elements: object, extensible: object) -> dict[str, Any]:
    """The keywords of `Statics`, checked."""
    count = whole_number("elements", elements, 4)
    if count % 2:
        raise OptionError(f"elements = {count}: must be even, so that midspan is a node")
    require_memory("elements", elements, 4e4 * count, "the mesh")
    return {"elements": count, "extensible": flag("extensible", extensible)}
