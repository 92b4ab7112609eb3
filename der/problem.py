"""Equilibria of the discrete elastic rod: the continuation problem."""

from __future__ import annotations

import math
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
# those that the rounding of eigenvalues makes, over EA / EI2
_OF_EIGENVALUES = 3e-14


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


def neutral_steps(rod: Rod, steps: Steps | None) -> Steps:
    """The same of curves of folds and pitchforks: an eigenvalue has the rounding of tensions, and more."""
    usual = default_steps(rod)
    rounding = _OF_EIGENVALUES * rod.scene.ribbon.stretch_ratio
    return steps or replace(usual, tolerance=max(Steps.tolerance, rounding))


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
        self._still = np.zeros(4 * rod.nodes)
        # along the tangents of the clamps, of the first two nodes and of the last two
        self._held = (*rod.arclength[:2].tolist(), *(rod.arclength[-2:] - 1.0).tolist())
        # the node at midspan, or the two beside it
        self.midspan = sorted({(rod.nodes - 1) // 2, rod.nodes // 2})

    def along(self, ends: Ends) -> Statics:
        """The same equations with other ends, whose controls may move otherwise with the parameter."""
        return Statics(self.rod, ends)

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
        (a, b, c, d), (fixed, moved) = self._held, self.ends.numbers
        left, right, rolled, other = (fixed[k] + moved[k] * parameter for k in range(4))
        x, y, z = self.ends.reach(parameter)[0].tolist()
        p, q, u, v = math.cos(left), -math.sin(left), math.cos(right), math.sin(right)
        ends = (a * p, 0.0, a * q), (b * p, 0.0, b * q), (x + c * u, y, z + c * v), (x + d * u, y, z + d * v)
        m1 = (
            (-math.cos(rolled) * q, -math.sin(rolled), math.cos(rolled) * p),
            (-math.cos(other) * v, -math.sin(other), math.cos(other) * u),
        )
        return np.array(ends), np.array(m1)

    def clamp_rate(self, parameter: float) -> Array:
        """Derivative (4 N,) of the fixed unknowns in the parameter."""
        (a, b, c, d), (fixed, by) = self._held, self.ends.numbers
        left, right = fixed[0] + by[0] * parameter, fixed[1] + by[1] * parameter
        x, y, z = self.ends.reach(parameter)[1].tolist()
        p, q = -by[0] * math.sin(left), -by[0] * math.cos(left)
        u, v = -by[1] * math.sin(right), by[1] * math.cos(right)
        rate = np.zeros(4 * self.rod.nodes)
        rate[:8] = a * p, 0.0, a * q, by[2], b * p, 0.0, b * q, 0.0
        rate[-8:] = x + c * u, y, z + c * v, by[3], x + d * u, y, z + d * v, 0.0
        return rate

    def advance(self, state: RodState, increment: Array, parameter: float) -> RodState:
        """Move the free unknowns by `increment` and the clamps to `parameter`; carry the frames."""
        return self._moved(state, increment, parameter, True)

    def predict(self, state: RodState, increment: Array, parameter: float) -> RodState:
        """Move likewise along a curve of equilibria: tensions stay about what they are."""
        return self._moved(state, increment, parameter, False)

    def _moved(self, state: RodState, increment: Array, parameter: float, linear: bool) -> RodState:
        rod, moved = self.rod, self.ends.moved
        clamps, normals = self.clamps(parameter)
        turns = moved[2:4] * (parameter - state.at)
        x, m1, twist, tangent, inverse, lag = kernels.moved(
            state.x,
            state.m1,
            state.twist,
            *state.edges,
            np.ascontiguousarray(increment),
            rod.free.start,
            clamps,
            normals,
            turns,
            rod.rest,
            linear,
        )
        new = RodState(x, m1, twist, parameter, lag)
        new.__dict__["edges"] = tangent, inverse
        return new

    def assemble(self, state: RodState, second: bool = True) -> tuple[Array, Array, Array]:
        """Elastic energies (3,); gradient (4 N,), with loads, and Hessian band (4 N + 10, 11)."""
        return self._equations(state, self._still, self._still[:3], second=second)[:3]

    def derivatives(self, state: RodState, parameter: float) -> tuple[Array, Array, Array]:
        """Gradient and Hessian of `assemble`, and the derivative (4 N,) of the gradient in the parameter."""
        rates = self.clamp_rate(parameter), self.ends.force(parameter)[1]
        _, gradient, hessian, slope, _, _ = self._equations(state, *rates)
        return gradient, hessian, slope + self._brought(state)

    def _equations(
        self,
        state: RodState,
        rate: Array,
        force_rate: Array,
        *,
        second: bool = True,
        lag: Array | None = None,
        shape: Array | None = None,
        solved: slice = slice(0),
    ) -> tuple[Array, Array, Array, Array, Array, int]:
        """As `kernels.equations` has them; factors of the rows `solved`."""
        rod = self.rod
        result: tuple[Array, Array, Array, Array, Array, int] = kernels.equations(
            *state.edges,
            state.m1,
            state.twist,
            rod.stiffness,
            rod.rest,
            rod.stretch,
            self.shape(state.at) if shape is None else shape,
            rod.lumps,
            self.weigh(state.at),
            self.ends.force(state.at)[0],
            self._still[: rod.nodes - 1] if lag is None else lag,
            _FORESEEN,
            rate,
            force_rate,
            solved.start or 0,
            solved.stop,
            second,
        )
        return result

    def _brought(self, state: RodState) -> Array | float:
        """What the parameter adds to the derivative of the gradient (4 N,) besides moving ends."""
        return 0.0

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
        rates = self.clamp_rate(parameter), self.ends.force(parameter)[1]
        _, gradient, hessian, slope, factors, index = self._equations(
            state, *rates, lag=state.lag, solved=free
        )
        slope += self._brought(state)

        def solve(right: Array) -> Array:
            columns = right.reshape(len(right), -1)
            return np.asarray(kernels.solve_refined(hessian, factors, free.start, columns)).reshape(
                right.shape
            )

        return Linearisation(gradient[free], slope[free], solve, index)

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

    def momentum(self, state: RodState, velocity: Array, control_rate: float = 0.0) -> Array:
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

    def _brought(self, state: RodState) -> Array | float:
        """As of `Statics`; the gradient is linear in the weight and in the natural shape."""
        brought = np.zeros(4 * self.rod.nodes)
        brought.reshape(-1, 4)[:, :3] -= np.outer(self.rod.lumps, self._weight)
        shape = self.rod.shape
        if shape.any():
            one, none = (
                self._equations(state, self._still, self._still[:3], second=False, shape=share)[1]
                for share in (shape, 0.0 * shape)
            )
            brought += one - none
        return brought
