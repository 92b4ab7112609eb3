"""Equilibria of the discrete elastic rod: the continuation problem."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ribbonfem.continuation import Linearisation, Steps, parameter_weight
from ribbonfem.continuation.curves import steps_for
from ribbonfem.ends import Ends
from ribbonfem.results import Array

from . import kernels
from .rod import Rod, RodState

# strain: of steps that turn edges further nothing is foreseen
_FORESEEN = 1e-3


# increments that rounding makes, over the nodes and EA / EI2: several times those that were seen
_ROUNDING = 2e-20


def default_steps(rod: Rod, steps: Steps | None = None) -> Steps:
    """The step control given, or the one that suits the rod's shear and thickness.

    A point's tangent and index come from the state one Newton increment before it.  An increment
    along an edge changes its tension by EA / EI2 times as much, so that in a thin ribbon even a
    small one hides the signs of the Hessian: what counts as small shrinks as (h/L)^2, down to what the
    rounding of tensions leaves of increments, which grows as EA / EI2.
    """
    usual, stretch = steps_for(rod.scene), rod.scene.ribbon.stretch_ratio
    rounding = _ROUNDING * rod.nodes * stretch
    return steps or replace(usual, tolerance=max(min(usual.tolerance, 1.2e-2 / stretch), rounding))


class Statics:
    """The equilibrium equations of a rod in one parameter of its ends.

    Parameters
    ----------
    rod: the discretisation.
    ends: what the parameter does to clamps and loads; None for the scene's control.

    A `ribbonfem.continuation.Problem` over the free unknowns, `rod.free`.
    """

    def __init__(self, rod: Rod, ends: Ends | None = None) -> None:
        self.rod = rod
        self.ends = Ends.of(rod.scene) if ends is None else ends
        self.parameter_weight = parameter_weight(self.ends.moved)
        weight = np.zeros((rod.nodes, 4))
        weight[:, :3] = rod.rest
        self.weight = weight.ravel()[rod.free]
        # viscous moments
        self._resting = np.zeros((rod.nodes, 4))
        # the node at midspan, or the two beside it
        self.midspan = sorted({(rod.nodes - 1) // 2, rod.nodes // 2})

    @property
    def arclength(self) -> Array:
        """(nodes,) s/L of the nodes whose positions are handed out."""
        return np.array(self.rod.arclength)

    def shape(self, parameter: float) -> Array:
        """(N, 2) curvature and twist of the unloaded ribbon at the nodes, rad."""
        return self.rod.shape

    def weigh(self, parameter: float) -> Array:
        """(3,) weight per length, EI2/L^3."""
        return self.ends.weight

    def clamps(self, parameter: float) -> tuple[Array, Array]:
        """Positions (4, 3) of the first two and last two nodes, and m1 (2, 3) of the first and last edge."""
        s, at = self.rod.arclength, self.ends.controls(parameter)
        left, right, twist_left, twist_right = at[:4]
        x = np.zeros((4, 3))
        x[:2] = np.outer(s[:2], [np.cos(left), 0.0, -np.sin(left)])
        x[2:] = self.ends.reach(parameter)[0] + np.outer(s[-2:] - 1.0, [np.cos(right), 0.0, np.sin(right)])
        m1 = [
            [np.cos(twist) * np.sin(turn), -np.sin(twist), np.cos(twist) * np.cos(turn)]
            for turn, twist in ((left, twist_left), (-right, twist_right))
        ]
        return x, np.array(m1)

    def clamp_rate(self, parameter: float) -> Array:
        """Derivative (4 N,) of the fixed unknowns in the parameter."""
        s, at, by = self.rod.arclength, self.ends.controls(parameter), self.ends.moved
        rate = np.zeros((self.rod.nodes, 4))
        rate[:2, :3] = by[0] * np.outer(s[:2], [-np.sin(at[0]), 0.0, -np.cos(at[0])])
        rate[-2:, :3] = by[1] * np.outer(s[-2:] - 1.0, [-np.sin(at[1]), 0.0, np.cos(at[1])])
        rate[-2:, :3] += self.ends.reach(parameter)[1]
        rate[0, 3], rate[-2, 3] = by[2], by[3]
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
        ends, normals = self.clamps(parameter)
        x = state.x + step.reshape(-1, 4)[:, :3]
        x[:2], x[-2:] = ends[:2], ends[2:]
        turn = np.ascontiguousarray(step.reshape(-1, 4)[:, 3])
        turn[[0, -2]] = self.ends.moved[2:4] * (parameter - state.at)
        # clamps may twist by more than half a turn: the twist is measured near to what comes of that
        twist = state.twist.copy()
        twist[1:-1] += turn[1:-1] - turn[:-2]
        lag = np.empty(len(state.m1))
        moved = RodState(x, np.empty_like(state.m1), state.twist.copy(), parameter, lag)
        (before, shorter), (after, inverse) = self.edges(state.x), self.edges(x)
        kernels.carry(before, state.m1, twist, after, turn, moved.m1, moved.twist)
        kernels.fall_short(before, shorter, after, inverse, rod.rest, linear, lag)
        # exact values where transport leaves rounding behind
        moved.m1[0], moved.m1[-1] = normals
        return moved

    def edges(self, x: Array) -> tuple[Array, Array]:
        """Unit tangents (N - 1, 3) and inverse lengths (N - 1,) of the edges."""
        tangent, inverse = np.empty((len(x) - 1, 3)), np.empty(len(x) - 1)
        kernels.edges(x, tangent, inverse)
        return tangent, inverse

    def assemble(self, state: RodState, second: bool = True) -> tuple[Array, Array, Array]:
        """Elastic energies (3,); gradient (4 N,), with loads, and Hessian band (4 N + 10, 11)."""
        energies, gradient, hessian = self._elastic(state, self.shape(state.at), second)
        forces = gradient.reshape(-1, 4)[:, :3]
        weight, force = self.weigh(state.at), self.ends.force(state.at)[0]
        if weight.any():
            forces -= np.outer(self.rod.lumps, weight)
        if force.any():
            forces[self.midspan] -= force / len(self.midspan)
        return energies, gradient, hessian

    def _elastic(self, state: RodState, shape: Array, second: bool) -> tuple[Array, Array, Array]:
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
            shape,
            self._resting,
            1.0,
            gradient,
            hessian,
            energies,
            second,
            rod.nodes,
        )
        return energies, gradient, hessian

    def slope(self, state: RodState, hessian: Array, parameter: float) -> Array:
        """Derivative (4 N,) of the gradient in the parameter."""
        result = kernels.multiply(hessian, 0, 4 * self.rod.nodes, self.clamp_rate(parameter))
        change = self.ends.force(parameter)[1]
        if change.any():
            result.reshape(-1, 4)[self.midspan, :3] -= change / len(self.midspan)
        return np.asarray(result)

    def crosses_plane(self, null: Array) -> bool:
        """Whether a change of the unknowns leaves the plane y = 0."""
        free = np.arange(4 * self.rod.nodes)[self.rod.free]
        # y and the angles are across it
        across = free % 2 == 1
        return bool((null[across] ** 2).sum() > (null[~across] ** 2).sum())

    def normals(self, state: RodState) -> Array:
        """Unit vectors m1 (N - 1, 3) normal to the surface, of the edges."""
        return state.m1.copy()

    def energy(self, state: RodState) -> float:
        """Elastic energy in EI2/L."""
        return float(self.assemble(state, second=False)[0].sum())

    def potential(self, state: RodState) -> float:
        """That and the energy of the weight and of the force at midspan: what is least at rest."""
        acting = float(self.rod.lumps @ (state.x @ self.weigh(state.at)))
        acting += float((state.x[self.midspan] @ self.ends.force(state.at)[0]).mean())
        return self.energy(state) - acting

    def linearise(self, state: RodState, parameter: float) -> Linearisation:
        """Residual, its derivative in the parameter, and the factorised tangent."""
        free = self.rod.free
        _, gradient, hessian = self.assemble(state)
        if state.lag is not None and np.abs(state.lag).max() < _FORESEEN:
            # An edge that turns in a step is stretched by the square of its turn, and the tangent takes
            # the large tension for real.  With the one that was to be, Newton needs half the iterations
            # (D. Magisano et al., Comput. Methods Appl. Mech. Eng. 313 (2017) 986).
            tangent, inverse = self.edges(state.x)
            tension = self.rod.stretch / self.rod.rest * state.lag * inverse
            kernels.hold_tension(hessian, tangent, tension)
        slope = self.slope(state, hessian, parameter)[free]
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


class Loading(Statics):
    """The equations of a scene's start in the share of what acts there besides dL and dW.

    Presets, weight, natural shape and where the control starts come on in proportion, from 0 to 1.
    """

    def __init__(self, rod: Rod) -> None:
        ends = Ends.of(rod.scene)
        controls = ends.controls(rod.scene.begin)
        super().__init__(rod, Ends(np.zeros_like(controls), controls, ends.chord, np.zeros(3)))
        self._weight = ends.weight
        size = float(np.linalg.norm(ends.weight)) + 10.0 * float(np.abs(rod.shape).max()) / rod.rest
        self.parameter_weight = parameter_weight(np.append(controls[:7], controls[7] + size))

    def shape(self, parameter: float) -> Array:
        """As of `Statics`, a share of it."""
        return parameter * self.rod.shape

    def weigh(self, parameter: float) -> Array:
        """As of `Statics`, a share of it."""
        return parameter * self._weight

    def slope(self, state: RodState, hessian: Array, parameter: float) -> Array:
        """As of `Statics`; the gradient is linear in the weight and in the natural shape."""
        result = super().slope(state, hessian, parameter)
        result.reshape(-1, 4)[:, :3] -= np.outer(self.rod.lumps, self._weight)
        shape = self.rod.shape
        if shape.any():
            result += self._elastic(state, shape, False)[1] - self._elastic(state, 0.0 * shape, False)[1]
        return result
