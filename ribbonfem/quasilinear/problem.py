"""Equilibrium equations of the quasi-linear beam, for continuation: small slopes (paper, section 4.2).

In the rescaled height Z = z/L (dL/L)^(-1/2) the equilibria solve

    Z'''' + sigma^2 Z'' = 0,  Z(0) = Z(1) = Z'(1) = 0,  Z'(0) = -mu,  int Z'^2 = 2,

with mu = alpha (dL/L)^(-1/2); sigma^2 is the multiplier of the end-shortening.  Elements are C1, cubic
Hermite ones (the fold converges with the fourth power of the mesh) or of any higher degree: the
tangent is a band with one dense row.  On the mesh's buckling modes, K phi_j = s_j G phi_j, the branch is
a scalar equation:

    2 / mu^2 = N(sigma^2),  N(s) = N_0 + sum_j c_j^2 / (s_j - s)^2,

with c_j what the clamp's shape function does to a mode, and its fold the one root of N' between s_1 and s_2.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import eigh, null_space
from scipy.optimize import brentq

from ribbonfem.continuation import Linearisation, parameter_weight
from ribbonfem.ends import Ends
from ribbonfem.ends.planar import Rig
from ribbonfem.ends.planar_kernels import COMPRESSION, LEFT, LIFT, PUSH, RIGHT
from ribbonfem.linalg.banded import Arrow
from ribbonfem.options import require_memory, whole_number
from ribbonfem.results import Array
from ribbonfem.scene import Scene, SceneError

from .mesh import ENDS, mesh_of, modes_of

# degrees of Hermite elements without bubbles, and of one element alone: its fold is exact from 14 on, snaps
# of ramps of some rad/s need more
CUBIC, ALONE = 3, 18
HIGHEST = 40


@dataclass(frozen=True)
class _State:
    """Dofs (n + 4,), those of the ends last and in place, sigma^2, and where the parameter is."""

    z: Array
    load: float
    at: float = 0.0


class Statics:
    """The equilibrium equations of the beam on a uniform mesh, in the scene's control if no `rig` is given.

    Unknowns are the free dofs of Z and sigma^2; heights are rescaled.  A `continuation.Problem`.
    """

    def __init__(
        self, scene: Scene, elements: int = 1, degree: int | None = None, rig: Rig | None = None
    ) -> None:
        scene.require_planar("quasilinear")
        if scene.weight[0] != 0.0:
            raise SceneError(
                f"Scene.gravity = {scene.gravity!r}: quasilinear has no weight along x; elastica, kirchhoff "
                "and der do"
            )
        count = whole_number("elements", elements, 1)
        if degree is None:
            degree = ALONE if count == 1 else CUBIC
        self.degree = whole_number("degree", degree, CUBIC, HIGHEST)
        # as many dofs as four cubic elements have
        self.elements = whole_number("elements", elements, 4 if self.degree == CUBIC else 1)
        require_memory("elements", elements, 64.0 * (count * (self.degree - 1.0)) ** 2, "the mesh")
        self.scene, self.compression = scene, scene.compression
        self.scale = scene.compression**0.5
        self.side = 1.0 if scene.start == "U+" else -1.0
        self.unit = scene.ribbon.inertial_time
        self.mesh = mesh_of(self.elements, degree)
        rig = Rig.of(scene, self.mesh.points) if rig is None else rig
        self.free = slice(0, self.mesh.count)
        self._rig_by(rig)
        # loads of the weight and the natural curvature, and the energy of this in the straight beam
        self.weight_load = rig.weight[1] / self.scale * self.mesh.weight
        self.bent, self.own = np.zeros_like(self.weight_load), 0.0
        if scene.ribbon.shaped:
            self.bent = self.mesh.curvature.T @ (self.mesh.shares * rig.curvature) / self.scale
            self.own = 0.5 * float(self.mesh.shares @ rig.curvature**2) / self.compression

    @cached_property
    def parameter_weight(self) -> float:
        """Of the parameter, in an arclength of states."""
        return parameter_weight(self.rig.moved)

    @cached_property
    def weight(self) -> Array:
        """Of the unknowns, in an arclength of states."""
        return np.append(self.compression * self.mesh.mass.diagonal()[self.free], 0.0)

    def _rig_by(self, rig: Rig) -> None:
        self.rig = rig
        # what is kept is of another rig
        vars(self).pop("parameter_weight", None)
        self._fixed, self._moved = (self._held(controls) for controls in (rig.controls, rig.moves))

    def along(self, ends: Ends) -> Statics:
        """The same equations with other ends, whose controls may move otherwise with the parameter."""
        other = copy(self)
        other._rig_by(self.rig.along(ends))
        return other

    def _held(self, controls: Array) -> Array:
        """(4,) Z and Z' of both ends."""
        held: Array = np.array([0.0, -controls[LEFT], controls[LIFT], controls[RIGHT]]) / self.scale
        return held

    def _loads(self, controls: Array, share: float) -> Array:
        """(n + 4,) of the force at midspan, and a share of the others."""
        push = controls[PUSH] / self.scale
        loads: Array = share * (self.weight_load + self.bent) - push * self.mesh.middle[0]
        return loads

    @property
    def options(self) -> dict[str, int]:
        """The mesh by its keywords."""
        return {"elements": self.elements, "degree": self.degree}

    @property
    def arclength(self) -> Array:
        """(nodes,) s/L of the nodes whose positions are handed out."""
        return self.mesh.nodes

    def start(self) -> _State:
        """The buckled beam at alpha = 0: the mesh's first mode, on the side of the scene's start."""
        modes = modes_of(self.elements, self.degree)
        z = np.append(2.0**0.5 * modes.phi[:, 0], np.zeros(ENDS))
        upwards = float(np.sign(self.mesh.middle[0] @ z))
        return _State(self.side * upwards * z, float(modes.squares[0]))

    def ends(self, parameter: float) -> Array:
        """(4,) Z and Z' of both ends."""
        return self._fixed + self._moved * parameter

    def shortening(self, parameter: float) -> float:
        """The end-shortening over dL."""
        return 1.0 + float(self.rig.at(parameter)[COMPRESSION]) / self.compression

    def advance(self, state: _State, increment: Array, parameter: float) -> _State:
        """Move the free dofs and sigma^2, and the clamps to `parameter`."""
        z = np.append(state.z[self.free] + increment[:-1], self.ends(parameter))
        return _State(z, state.load + float(increment[-1]), parameter)

    def linearise(self, state: _State, parameter: float) -> Linearisation:
        """Residual, its derivative in the parameter, and the factorised tangent."""
        free, mesh, rig = self.free, self.mesh, self.rig
        matrix = mesh.stiffness - state.load * mesh.tension
        stretch = mesh.tension @ state.z
        loads = self._loads(rig.at(parameter), rig.share[0] + rig.share[1] * parameter)
        length = self.shortening(parameter) - 0.5 * float(state.z @ stretch)
        residual = np.append((matrix @ state.z - loads)[free], length)
        more = (matrix[:, mesh.count :] @ self._moved - self._loads(rig.moves, rig.share[1]))[free]
        shorter = rig.moves[COMPRESSION] / self.compression - stretch[mesh.count :] @ self._moved
        arrow = Arrow(np.ascontiguousarray(mesh.band(matrix).T), -stretch[free][None, :])
        # one negative eigenvalue belongs to the multiplier
        return Linearisation(residual, np.append(more, shorter), arrow.solve, arrow.negative - 1)

    def fold(self) -> tuple[float, float, float]:
        """alpha, z(1/2)/L and sigma^2 at the fold that the start state meets, one clamp turned against it.

        Of a scene in which nothing else acts.
        """
        modes, mesh = modes_of(self.elements, self.degree), self.mesh
        turned = self._moved * self.scale
        by_bend, by_slope = (
            modes.phi.T @ matrix[self.free, mesh.count :] @ turned
            for matrix in (mesh.stiffness, mesh.tension)
        )
        c = by_bend - modes.squares * by_slope
        own = float(turned @ mesh.tension[mesh.count :, mesh.count :] @ turned - by_slope @ by_slope)
        low, high = modes.squares[:2]

        def steepness(s: float) -> float:
            # times what makes it finite at both ends
            return float(np.sum(c**2 * ((low - s) * (high - s) / (modes.squares - s)) ** 3))

        rounding = 1e-12 * (high - low)
        load = brentq(steepness, low + rounding, high - rounding, xtol=1e-14 * high, rtol=1e-15)
        mu = (2.0 / (own + float(np.sum((c / (modes.squares - load)) ** 2)))) ** 0.5
        z = np.append(modes.phi @ (-mu * (by_slope + c / (modes.squares - load))), self.ends(mu * self.scale))
        height = self.scale * float(mesh.middle[0] @ z)
        return self.side * mu * self.scale, self.side * height, float(load)

    def frequencies(self, state: _State, count: int) -> Array:
        """The lowest `count` angular frequencies (count,), 1/s, of small undamped motions about a state."""
        mesh, free = self.mesh, self.free
        wanted = whole_number("count", count, 1, mesh.count - 1)
        # what keeps the length: all that is orthogonal to G Z
        row = (mesh.tension @ state.z)[free]
        basis = null_space(row[None])
        stiffness, mass = (
            basis.T @ matrix[free, free] @ basis
            for matrix in (mesh.stiffness - state.load * mesh.tension, mesh.mass)
        )
        squares = eigh(stiffness, mass, eigvals_only=True, subset_by_index=(0, wanted - 1))
        return np.asarray(np.sqrt(squares) / self.unit)

    def momentum(self, state: _State, velocity: Array, control_rate: float = 0.0) -> Array:
        """M v of rates of the free dofs and of sigma^2, which has no mass; of alpha too."""
        z = np.append(velocity[:-1], control_rate * self._moved)
        return np.append((self.mesh.mass @ z)[self.free], 0.0)

    def energy(self, state: _State) -> float:
        """Elastic energy in EI2/L."""
        rig = self.rig
        share = rig.share[0] + rig.share[1] * state.at
        bending = 0.5 * float(state.z @ (self.mesh.stiffness @ state.z)) - share * float(self.bent @ state.z)
        return self.compression * (bending + share**2 * self.own)

    def middle(self, z: Array) -> tuple[float, float]:
        """Z and Z' at midspan."""
        height, slope = self.mesh.middle @ z
        return float(height), float(slope)

    def observe(self, state: _State, parameter: float) -> tuple[float, float, float]:
        """z(1/2)/L, the z-component of the unit tangent there, and sigma^2."""
        height, slope = (value * self.scale for value in self.middle(state.z))
        return height, slope / float(np.hypot(1.0, slope)), state.load

    def positions(self, state: _State, parameter: float) -> Array:
        """Nodal positions in L; x is shortened by the slope, so that the end lies at 1 - dL/L."""
        return self.mesh.shapes(state.z[None], self.compression)[0]
