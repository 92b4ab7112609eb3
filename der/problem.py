"""Equilibria of the discrete elastic rod: the continuation problem."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ribbonfem.continuation import PARAMETER_WEIGHT, Linearisation, Steps
from ribbonfem.continuation.curves import steps_for
from ribbonfem.results import Array

from . import kernels
from .rod import Rod, RodState

# strain: of steps that turn edges further nothing is foreseen
_FORESEEN = 1e-3


def default_steps(rod: Rod, steps: Steps | None = None) -> Steps:
    """The step control given, or the one that suits the rod's shear and thickness.

    A point's tangent and index come from the state one Newton increment before it.  An increment
    along an edge changes its tension by EA / EI2 times as much, so that in a thin ribbon even a
    small one hides the signs of the Hessian: what counts as small shrinks as (h/L)^2.
    """
    usual = steps_for(rod.scene)
    return steps or replace(usual, tolerance=min(usual.tolerance, 1.2e-2 / rod.scene.ribbon.stretch_ratio))


class Statics:
    """The equilibrium equations of a rod in one parameter of its clamps.

    Parameters
    ----------
    rod: the discretisation.
    parameter: "angle" (of the left clamp, rad; the default), "compression" or "shear"; the other
        two keep the values given, by default the scene's and angle 0.

    A `ribbonfem.continuation.Problem` over the free unknowns, `rod.free`.
    """

    parameter_weight = PARAMETER_WEIGHT

    def __init__(
        self,
        rod: Rod,
        parameter: str = "angle",
        *,
        angle: float = 0.0,
        compression: float | None = None,
        shear: float | None = None,
    ) -> None:
        self.rod = rod
        self.parameter = parameter
        scene = rod.scene
        self.angle = angle
        self.compression = scene.compression if compression is None else compression
        self.shear = scene.shear if shear is None else shear
        weight = np.zeros((rod.nodes, 4))
        weight[:, :3] = rod.rest
        self.weight = weight.ravel()[rod.free]

    @property
    def arclength(self) -> Array:
        """(nodes,) s/L of the nodes whose positions are handed out."""
        return np.array(self.rod.arclength)

    def clamps(self, parameter: float) -> tuple[float, float, float]:
        """Angle, compression and shear at a value of the parameter."""
        values = {"angle": self.angle, "compression": self.compression, "shear": self.shear}
        values[self.parameter] = parameter
        return values["angle"], values["compression"], values["shear"]

    def clamp_rate(self, parameter: float) -> Array:
        """Derivative (4 N,) of the fixed unknowns in the parameter."""
        rate = np.zeros((self.rod.nodes, 4))
        if self.parameter == "angle":
            direction = [-np.sin(parameter), 0.0, -np.cos(parameter)]
            rate[:2, :3] = np.outer(self.rod.arclength[:2], direction)
        else:
            rate[-2:, 0 if self.parameter == "compression" else 1] = -1.0
        return rate.ravel()

    def advance(self, state: RodState, increment: Array, parameter: float) -> RodState:
        """Move the free unknowns by `increment` and the clamps to `parameter`; carry the frames."""
        return self._moved(state, increment, parameter, True)

    def predict(self, state: RodState, increment: Array, parameter: float) -> RodState:
        """Move likewise along a curve of equilibria: tensions stay about what they are."""
        return self._moved(state, increment, parameter, False)

    def _moved(self, state: RodState, increment: Array, parameter: float, linear: bool) -> RodState:
        rod = self.rod
        step = np.zeros(4 * rod.nodes)
        step[rod.free] = increment
        angle, compression, shear = self.clamps(parameter)
        x = state.x + step.reshape(-1, 4)[:, :3]
        x[:2], normal = rod.left(angle)
        x[-2:] = rod.right(compression, shear)
        lag = np.empty(len(state.m1))
        moved = RodState(x, np.empty_like(state.m1), state.twist.copy(), lag)
        turn = np.ascontiguousarray(step.reshape(-1, 4)[:, 3])
        (before, shorter), (after, inverse) = self.edges(state.x), self.edges(x)
        kernels.carry(before, state.m1, state.twist, after, turn, moved.m1, moved.twist)
        kernels.fall_short(before, shorter, after, inverse, rod.rest, linear, lag)
        # exact values where transport leaves rounding behind
        moved.m1[0] = normal
        moved.m1[-1] = 0.0, 0.0, 1.0
        return moved

    def edges(self, x: Array) -> tuple[Array, Array]:
        """Unit tangents (N - 1, 3) and inverse lengths (N - 1,) of the edges."""
        tangent, inverse = np.empty((len(x) - 1, 3)), np.empty(len(x) - 1)
        kernels.edges(x, tangent, inverse)
        return tangent, inverse

    def assemble(self, state: RodState, second: bool = True) -> tuple[Array, Array, Array]:
        """Energies (3,), gradient (4 N,) and Hessian band (4 N + 10, 11) of all unknowns."""
        rod = self.rod
        gradient = np.empty(4 * rod.nodes)
        hessian = np.empty((4 * rod.nodes + kernels.WIDTH, kernels.WIDTH + 1))
        energies = np.empty(3)
        kernels.assemble(
            *self.edges(state.x),
            state.m1,
            state.twist,
            rod.stiffness,
            rod.rest,
            rod.stretch,
            gradient,
            hessian,
            energies,
            second,
            rod.nodes,
        )
        return energies, gradient, hessian

    def normals(self, state: RodState) -> Array:
        """Unit vectors m1 (N - 1, 3) normal to the surface, of the edges."""
        return state.m1.copy()

    def energy(self, state: RodState) -> float:
        """Elastic energy in EI2/L."""
        return float(self.assemble(state, second=False)[0].sum())

    def linearise(self, state: RodState, parameter: float) -> Linearisation:
        """Residual, its derivative in the parameter, and the factorised tangent."""
        rod, free = self.rod, self.rod.free
        _, gradient, hessian = self.assemble(state)
        if state.lag is not None and np.abs(state.lag).max() < _FORESEEN:
            # An edge that turns in a step is stretched by the square of its turn, and the tangent takes
            # the large tension for real.  With the one that was to be, Newton needs half the iterations
            # (D. Magisano et al., Comput. Methods Appl. Mech. Eng. 313 (2017) 986).
            tangent, inverse = self.edges(state.x)
            kernels.hold_tension(hessian, tangent, rod.stretch / rod.rest * state.lag * inverse)
        size, reach = 4 * rod.nodes, 8 + kernels.WIDTH
        # the clamp that moves reaches no further
        rows = (0, reach) if self.parameter == "angle" else (size - reach, size)
        slope = kernels.multiply(hessian, *rows, self.clamp_rate(parameter))[free]
        factors = hessian.copy()
        index = kernels.factor(factors, free.start, free.stop)

        def solve(right: Array) -> Array:
            columns = right.reshape(len(right), -1)
            return np.asarray(kernels.solve_refined(hessian, factors, free.start, columns)).reshape(
                right.shape
            )

        return Linearisation(gradient[free], slope, solve, index)

    def observe(self, state: RodState, parameter: float) -> tuple[float, float, float]:
        """z(1/2)/L, t_z(1/2) and the compressive end force along x times L^2/EI2."""
        position, tangent = self.rod.middle(state.x)
        _, gradient, _ = self.assemble(state, second=False)
        return float(position[2]), float(tangent[2]), -float(gradient[-8] + gradient[-4])

    def positions(self, state: RodState, parameter: float) -> Array:
        """Positions (N, 3) in L."""
        return state.x

    @property
    def unit(self) -> float:
        """The inertial time t* in s, in which the whole ribbon weighs 1."""
        return self.rod.scene.ribbon.inertial_time

    def momentum(self, state: RodState, velocity: Array, turning: float = 0.0) -> Array:
        """M v (n,) of rates (n,) of the free unknowns; the clamp's nodes move none of them."""
        return self.rod.inertia[self.rod.free] * velocity
