"""Equations of neutral states, of any problem whose ends two controls move: folds and pitchforks.

A state is neutral where its tangent J = F_u is singular.  With a vector b that is about along the null
vector, the scalar g of

    [ J   b ] [ v ]   [ 0 ]
    [ b^T 0 ] [ g ] = [ 1 ],        g = -v.J v,

passes 0 there, simply and smoothly, and v is then the null vector.  Folds solve F = 0, g = 0 for the state u
and the control p: equilibrium equations again, in the second parameter q, which `trace` follows.  They turn
back in q at cusps, where the normal form's quadratic coefficient g_u.v = -v.F_uu[v, v] is 0, and at turns,
where v.F_p is.

At a pitchfork v breaks a symmetry that F, F_p and F_q keep.  There v.F = 0 says nothing, and v.F_p = 0 takes
its place (G. Moore, Numer. Funct. Anal. Optim. 2 (1980) 441).

Reference: W. Govaerts, "Numerical Methods for Bifurcations of Dynamical Equilibria", SIAM 2000.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, Generic, Protocol

import numpy as np

from ribbonfem.ends import Ends
from ribbonfem.ends.second_parameter import SecondParameter
from ribbonfem.options import refuse
from ribbonfem.results import Array
from ribbonfem.scene import Scene

from .corrector import Linearisation, Problem, State, parameter_weight
from .tracing import Event

# arclength of the differences along the null vector
_REACH = 5e-4
# arclength to which a state is settled beside a curve, in so many iterations at most
_SETTLED, _MOST = 1e-6, 8
# share of F_q along the null vector that breaks a symmetry, and is no rounding
_BROKEN = 1e-6


class Rigged(Problem[State], Protocol):
    """Equilibrium equations of a body whose ends move with the parameter.

    Its states are dataclasses with the parameter as `at`.  One whose unknowns are on a manifold has
    `tangential` too: (state, vector (n,)) -> the part along it.
    """

    def along(self: Any, ends: Ends) -> Any:
        """The same equations with these ends, whose controls may move otherwise with the parameter."""
        ...


@dataclass(frozen=True)
class Neutral(Generic[State]):
    """A state with a control and a value of the second parameter, and b (n,).

    `null` holds v once the equations have been made there: the b of the states that follow.
    """

    state: State
    control: float
    value: float
    border: Array
    null: list[Array] = field(default_factory=list, compare=False)


def _counted_from(at: float, state: State) -> State:
    """A state where the parameter of the same controls is another."""
    return replace(state, at=at)  # type: ignore[type-var]


def _tangential(problem: Rigged[State], state: State, vector: Array) -> Array:
    """The part of a vector (n,) along the manifold of the unknowns."""
    part: Callable[[State, Array], Array] | None = getattr(problem, "tangential", None)
    return vector if part is None else part(state, vector)


def _null(line: Linearisation, b: Array) -> tuple[Array, float]:
    """v (n,) and g of [[J, b], [b^T, 0]] (v, g) = (0, 1)."""
    v = line.solve(b)
    size = float(b @ v)
    return v / size, -1.0 / size


def _bordered(line: Linearisation, b: Array, v: Array, right: Array) -> tuple[Array, Array]:
    """x (n, k) and y (k,) of [[J, b], [b^T, 0]] (x, y) = (right, 0), J singular or not.

    By mixed block elimination.
    """
    y = v @ right
    x = line.solve(right - np.outer(b, y))
    return x - np.outer(v, b @ x), y


class NeutralStates(Generic[State]):
    """The equations of neutral states in the second parameter: a `continuation.Problem`.

    Parameters
    ----------
    problem: the equilibrium equations in the scene's control.
    symmetric: of pitchforks.
    """

    def __init__(
        self, problem: Rigged[State], scene: Scene, parameter: SecondParameter, symmetric: bool
    ) -> None:
        self._problem, self.scene, self.over, self._symmetric = problem, scene, parameter, symmetric
        self.weight = np.append(problem.weight, problem.parameter_weight)
        self.parameter_weight = parameter_weight(parameter.moved)

    def within(self, value: float) -> Rigged[State]:
        """The equilibrium equations in the control, at a value of the parameter."""
        return self._problem.along(self._ends(value))

    def _ends(self, value: float) -> Ends:
        return self.over.ends(self.scene, value)

    def _across(self, control: float, value: float) -> Rigged[State]:
        """Those in the parameter, counted so that the same ends stand where the control does."""
        ends, moved = self._ends(value), self.over.moved
        return self._problem.along(replace(ends, fixed=ends.controls(control) - control * moved, moved=moved))

    def start(self, event: Event[State]) -> Neutral[State]:
        """The state at a fold or branch point of the scene."""
        border = self._problem.weight * event.null
        return Neutral(event.point.state, event.point.parameter, self.over.own, border)

    def advance(self, state: Neutral[State], increment: Array, parameter: float) -> Neutral[State]:
        """Move the state and its control, and the ends to `parameter`."""
        return self._moved_by("advance", state, increment, parameter)

    def predict(self, state: Neutral[State], increment: Array, parameter: float) -> Neutral[State]:
        """The same along a curve."""
        return self._moved_by("predict", state, increment, parameter)

    def _moved_by(
        self, how: str, state: Neutral[State], increment: Array, parameter: float
    ) -> Neutral[State]:
        problem, control = self.within(parameter), state.control + float(increment[-1])
        border = state.border
        if state.null:
            null = state.null[0]
            border = problem.weight * null / np.sqrt(problem.weight @ null**2)
        # both controls at once: on the way from 0 to 1
        here, there = self._ends(state.value).controls(state.control), self._ends(parameter).controls(control)
        way = problem.along(replace(self._ends(parameter), fixed=here, moved=there - here))
        move: Callable[..., State] = getattr(way, how, way.advance)
        moved = _counted_from(control, move(_counted_from(0.0, state.state), increment[:-1], 1.0))
        return Neutral(self._settled(problem, moved, control, border), control, parameter, border)

    def _settled(self, problem: Rigged[State], state: State, control: float, border: Array) -> State:
        """The state at which F is along b, with the same b.u: what is stiff is in equilibrium with the rest.

        g alone says little where a step has stretched what hardly stretches.
        """
        before = np.inf
        for _ in range(_MOST):
            line = problem.linearise(state, control)
            v, _ = _null(line, border)
            moves, _ = _bordered(line, border, v, _tangential(problem, state, line.residual)[:, None])
            size = float(np.sqrt(problem.weight @ moves[:, 0] ** 2))
            if not size < before:
                break
            state, before = problem.advance(state, -moves[:, 0], control), size
            if size < _SETTLED:
                break
        return state

    def _along_null(
        self, state: Neutral[State], parameter: float, v: Array, force: Array
    ) -> tuple[Array, float, float]:
        """g_u (n,), g_p and g_q, which are -v.J v derived: by differences of F, F_p and F_q along v."""
        control = state.control
        problem, across = self.within(parameter), self._across(control, parameter)
        reach = _REACH / float(np.sqrt(problem.weight @ v**2))
        sides = []
        for e in (-reach, reach):
            there = problem.advance(state.state, e * v, control)
            line = problem.linearise(there, control)
            vectors = line.residual, line.slope, across.linearise(there, control).slope
            sides.append([_tangential(problem, there, vector) for vector in vectors])
        (before, *slopes), (beyond, *others) = sides
        by_control, by_value = (
            -float(v @ (other - slope)) / (2.0 * reach) for slope, other in zip(slopes, others, strict=True)
        )
        return -(before - 2.0 * force + beyond) / reach**2, by_control, by_value

    def linearise(self, state: Neutral[State], parameter: float) -> Linearisation:
        """F and g, their derivatives in the parameter, and the factorised tangent."""
        control, b = state.control, state.border
        problem, across = self.within(parameter), self._across(control, parameter)
        line = problem.linearise(state.state, control)
        force, by_control, by_value = (
            _tangential(problem, state.state, vector)
            for vector in (line.residual, line.slope, across.linearise(state.state, control).slope)
        )
        v, g = _null(line, b)
        state.null[:] = [v]
        g_state, g_control, g_value = self._along_null(state, parameter, v, force)
        # dp, and the part of du along v, are told by v.F and g; the rest of du by the rest of F
        columns, (y_control,) = _bordered(line, b, v, by_control[:, None])
        x_control = columns[:, 0]
        curvature, corner = float(g_state @ v), g_control - float(g_state @ x_control)
        if self._symmetric:
            # v.F and v.F_q are 0; in their place is v.F_p, which tells of what is along v
            force = force + (y_control - float(v @ force)) * b
            by_value = by_value - float(v @ by_value) * b
            matrix = np.array([[0.0, -corner], [corner, 0.0]])
        else:
            matrix = np.array([[y_control, -g], [corner, curvature]])
        determinant = float(matrix[0, 0] * matrix[1, 1] - matrix[0, 1] * matrix[1, 0])

        def solve(right: Array) -> Array:
            rows = right.reshape(len(right), -1)
            x, y = _bordered(line, b, v, rows[:-1])
            z = rows[-1] - g_state @ x
            change = (matrix[1, 1] * y - matrix[0, 1] * z) / determinant
            amount = (matrix[0, 0] * z - matrix[1, 0] * y) / determinant
            x = x - np.outer(x_control, change) + np.outer(v, amount)
            return np.vstack((x, change)).reshape(right.shape)

        # where the curve turns back in the parameter (of pitchforks the determinant is the corner squared)
        sign = corner if self._symmetric else determinant
        return Linearisation(np.append(force, g), np.append(by_value, g_value), solve, int(sign < 0.0))

    def unstable(self, state: Neutral[State], parameter: float) -> int:
        """Number of unstable directions beside the neutral one."""
        # at the state itself rounding has the sign of the eigenvalue that is 0
        self.linearise(state, parameter)
        beside = self.advance(state, np.append(_REACH * state.null[0], 0.0), parameter)
        line = self.within(parameter).linearise(beside.state, state.control)
        # of the bordered matrix, which has one negative eigenvalue more
        return line.index + int(float(beside.border @ line.solve(beside.border)) > 0.0) - 1

    def require_symmetry(self, state: Neutral[State]) -> None:
        """Refuse a parameter that has a part along the null vector: it breaks the symmetry, too."""
        self.linearise(state, state.value)
        null = state.null[0]
        slope = self._across(state.control, state.value).linearise(state.state, state.control).slope
        if abs(float(null @ slope)) > _BROKEN * float(np.linalg.norm(null) * np.linalg.norm(slope)):
            refuse("over", self.over.name, "unfolds the pitchfork, which needs the symmetry that this breaks")

    def observe(self, state: Neutral[State], parameter: float) -> tuple[float, float, float]:
        """As of the problem in the control."""
        return self.within(parameter).observe(state.state, state.control)

    def positions(self, state: Neutral[State], parameter: float) -> Array:
        """As of the problem in the control."""
        return self.within(parameter).positions(state.state, state.control)

    def energy(self, state: Neutral[State]) -> float:
        """As of the problem in the control."""
        return self.within(state.value).energy(state.state)
