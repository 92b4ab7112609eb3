"""Predictor and Newton corrector of a curve of equilibria; its `Problem`, points, `Steps`; bordered solves.

A model states its equilibrium equations ``F(u, p) = 0`` as a `Problem`; everything here works
on that and knows no mechanics.  Tangents ``J = F_u`` are symmetric (they come from an energy
or a Lagrangian), which the bordered solver uses.  A state may live on a manifold (rotating
frames, for example): increments are applied by the problem's own `advance`.

References: H. B. Keller (1977), pseudo-arclength; W. Govaerts, "Numerical Methods for
Bifurcations of Dynamical Equilibria", SIAM 2000, section 3.6, mixed block elimination.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Generic, Protocol, TypeVar

import numpy as np

from ribbonfem.options import CHECKS, positive, refuse, whole_number
from ribbonfem.results import Array, SolverError

State = TypeVar("State")

# An angle of 1 rad counts as 0.15 L in the arclength: heights change by some 0.3 L over a fold's
# neighbourhood and angles by 1 rad, and a curve of even curvature takes the fewest steps.
PARAMETER_WEIGHT = 0.0225
# a length counts as it is, and a force of 30 EI2/L^2 as 1 rad
_LENGTH_WEIGHT, _FORCE_WEIGHT = 1.0, PARAMETER_WEIGHT / 30.0**2
_CONTROL_WEIGHTS = np.array([PARAMETER_WEIGHT] * 4 + [_LENGTH_WEIGHT] * 3 + [_FORCE_WEIGHT])


def parameter_weight(moved: Array) -> float:
    """The weight of a parameter that moves controls (8,) by so much (`ribbonfem.drive`): the largest."""
    return float((_CONTROL_WEIGHTS * moved**2).max())


@dataclass(frozen=True)
class Linearisation:
    """The equations and their tangent at one state.

    Attributes
    ----------
    residual: F(u, p), (n,).
    slope: F_p, (n,).
    solve: x -> J^-1 x for x of shape (n,) or (n, k); J is symmetric.
    index: number of unstable directions (negative eigenvalues of the energy on the constraints).
    """

    residual: Array
    slope: Array
    solve: Callable[[Array], Array]
    index: int


class Problem(Protocol[State]):
    """Equilibrium equations in one parameter p.

    `weight` (n,) and `parameter_weight` make the arclength ds^2 = sum(weight du^2) +
    parameter_weight dp^2 independent of the mesh.  One that moves a state otherwise along a curve
    than by Newton has a `predict` too, with the arguments of `advance`.
    """

    @property
    def weight(self) -> Array:
        """(n,) of the unknowns."""
        ...

    @property
    def parameter_weight(self) -> float:
        """Of p."""
        ...

    def linearise(self, state: State, parameter: float) -> Linearisation:
        """Assemble and factorise at a state."""
        ...

    def advance(self, state: State, increment: Array, parameter: float) -> State:
        """Return the state moved by `increment` (n,), at the new parameter (which may move the clamps)."""
        ...

    def observe(self, state: State, parameter: float) -> tuple[float, float, float]:
        """Height z(1/2)/L, slope t_z(1/2) and compressive end force."""
        ...

    def positions(self, state: State, parameter: float) -> Array:
        """Positions (nodes, 3) in L."""
        ...

    def energy(self, state: State) -> float:
        """Elastic energy in EI2/L."""
        ...


@dataclass(frozen=True)
class Steps:
    """Step control.  The defaults find the same folds when each is halved or doubled.

    Attributes
    ----------
    first, largest, smallest: arclength of a step.
    turn: largest angle (rad) between the tangents at the two ends of a step.
    correction: largest first Newton correction, in parts of the step; a larger one would allow
        a jump to a curve nearby.
    newton: largest number of Newton iterations.
    tolerance: Newton stops when an increment is below it; convergence is quadratic, so that
        what is left is of the order of its square.
    location: branch points are located to this part of the step that crosses them; folds, where
        the parameter is stationary, to 1e-7 of it or to this part, whichever is larger.
    most: largest number of points on a curve.
    """

    first: float = 0.02
    largest: float = 0.2
    smallest: float = 1e-7
    turn: float = 0.35
    correction: float = 0.25
    newton: int = 8
    tolerance: float = 1e-7
    location: float = 1e-10
    most: int = 4000

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if name in ("newton", "most"):
                object.__setattr__(self, name, whole_number(f"Steps.{name}", value, 1))
            else:
                object.__setattr__(self, name, positive(f"Steps.{name}", value))

    @property
    def exact(self) -> float:
        """The tolerance of Newton at a given parameter: a hundredth of that along the curve."""
        return 0.01 * self.tolerance


def _steps(name: str, value: object) -> Steps | None:
    """Return `value` if it is `Steps` or None."""
    if value is not None and not isinstance(value, Steps):
        refuse(name, value, "must be None or continuation.Steps(...), the control of the steps")
    return value


CHECKS["steps"] = _steps


@dataclass(frozen=True)
class Bend:
    """How a curve bends: derivatives of (u, p) in the arclength, (n + 1,) each, across the tangent.

    Attributes
    ----------
    second, third: d2/ds2 at a point, d3/ds3; the third is 0 where only one step was made.
    mean: d2/ds2 over the step to the point.
    """

    second: Array
    third: Array
    mean: Array


@dataclass(frozen=True)
class Point(Generic[State]):
    """A point of a curve with its unit tangent (du/ds, dp/ds) and the `step` that led to it.

    `bend` is to first order; None where there was no step.  `correction` (n + 1,) is what Newton added
    to the guess by the bend of the point before.
    """

    state: State
    parameter: float
    direction: Array
    rate: float
    index: int
    linearisation: Linearisation = field(repr=False)
    step: float = 0.0
    iterations: int = 0
    bend: Bend | None = field(default=None, repr=False)
    correction: Array = field(default_factory=lambda: np.zeros(1), repr=False)


class NotConverged(Exception):
    """A corrector that did not converge; the caller shortens the step."""


def bordered_solve(
    line: Linearisation, row: Array, corner: float, right: Array, last: float
) -> tuple[Array, float]:
    """Solve [[J, F_p], [row, corner]] (x, y) = (right, last), also where J is nearly singular.

    Mixed block elimination: backward stable whatever the rank of J, so that a curve passes
    its folds without loss of digits.
    """
    both = line.solve(np.column_stack((row, line.slope)))
    left, column = both[:, 0], both[:, 1]
    first = (last - float(left @ right)) / (corner - float(left @ line.slope))
    x = line.solve(right - line.slope * first)
    second = (last - corner * first - float(row @ x)) / (corner - float(row @ column))
    return x - column * second, float(first + second)


def norm(problem: Problem[State], increment: Array, change: float) -> float:
    """Arclength of an increment (du, dp)."""
    return float(np.sqrt(problem.weight @ increment**2 + problem.parameter_weight * change**2))


def equilibrium(
    problem: Problem[State], state: State, parameter: float, *, newton: int = 30, tolerance: float = 1e-9
) -> tuple[State, Linearisation]:
    """`solution`, with the linearisation at it."""
    state = solution(problem, state, parameter, newton=newton, tolerance=tolerance)
    return state, problem.linearise(state, parameter)


def solution(
    problem: Problem[State], state: State, parameter: float, *, newton: int = 30, tolerance: float = 1e-9
) -> State:
    """The equilibrium that Newton finds at a fixed parameter from a good guess.

    Raises
    ------
    SolverError
        If the increment does not fall below `tolerance` within `newton` iterations.
    """
    size = np.inf
    for _ in range(newton):
        line = problem.linearise(state, parameter)
        increment = line.solve(-line.residual)
        size = norm(problem, increment, 0.0)
        if not np.isfinite(size) or size > 1e3:
            break
        state = problem.advance(state, increment, parameter)
        if size < tolerance:
            return state
    raise SolverError(
        f"no equilibrium found at parameter {parameter:.6g}: Newton's last increment was {size:.3g} "
        f"(needed: {tolerance:g} within {newton} iterations); start from a closer guess"
    )


def tangent(
    problem: Problem[State], line: Linearisation, direction: Array, rate: float
) -> tuple[Array, float]:
    """Unit tangent with a positive component along (direction, rate).

    Raises
    ------
    NotConverged
        If there is none: the factorisation broke down, as it may on a mesh far too coarse.
    """
    row, corner = problem.weight * direction, problem.parameter_weight * rate
    u, p = bordered_solve(line, row, corner, np.zeros_like(direction), 1.0)
    if not (abs(p) < 1e100 and np.abs(u).max() < 1e100):
        raise NotConverged
    size = norm(problem, u, p)
    return u / size, p / size


def first_point(
    problem: Problem[State], state: State, parameter: float, sign: float, *, tolerance: float = 1e-9
) -> Point[State]:
    """The point at an equilibrium, with the tangent along which the parameter moves with `sign`."""
    state, line = equilibrium(problem, state, parameter, tolerance=tolerance)
    direction, rate = -line.solve(line.slope), 1.0
    size = np.copysign(norm(problem, direction, rate), sign)
    return Point(state, parameter, direction / size, rate / size, line.index, line)


def _predicted(
    problem: Problem[State], base: Point[State], step: float, near: Point[State] | None
) -> tuple[State, float]:
    """A guess at the point at `step` from `base`, with the correction that a point `near` has asked for."""
    increment, change = step * base.direction, step * base.rate
    if base.bend is not None:
        rest = 0.5 * step**2 * base.bend.second + step**3 / 6.0 * base.bend.third
        if near is not None:
            # (the cubic is off by the fourth power)
            rest += (step / near.step) ** 4 * near.correction
        increment, change = increment + rest[:-1], change + float(rest[-1])
    parameter = base.parameter + change
    predict: Callable[[State, Array, float], State] = getattr(problem, "predict", problem.advance)
    return predict(base.state, increment, parameter), parameter


def correct(
    problem: Problem[State],
    base: Point[State],
    step: float,
    steps: Steps,
    *,
    fresh: bool = False,
    strict: bool = False,
    near: Point[State] | None = None,
) -> Point[State]:
    """The point of the curve at pseudo-arclength `step` from `base`.

    Predicted along the cubic of the last steps' bends, which saves an iteration or two against the
    straight line, and better from a point `near` that was found from the same base.  The tangent is of the
    last linearisation, one (small) increment back, or of a `fresh` one where an event is to be located by it.
    A `strict` one does not wander: beside a branch point, where increments are as good as arbitrary, none is.
    """
    row, corner = problem.weight * base.direction, problem.parameter_weight * base.rate
    state, parameter = _predicted(problem, base, step, near)
    before, total, last = parameter, np.zeros_like(base.direction), np.inf
    both = np.empty((len(total), 2))
    for iteration in range(1, steps.newton + 1):
        line = problem.linearise(state, parameter)
        # Plain block elimination: half the solves of the mixed one, and what it loses where J is
        # nearly singular is a part of a correction, which the next iteration makes good.
        both[:, 0], both[:, 1] = line.residual, line.slope
        newton, column = line.solve(both).T
        across = corner - float(row @ column)
        change = float(row @ newton) / across
        increment = -newton - change * column
        size = norm(problem, increment, change)
        # a correction that is large against the step may land on a curve that passes nearby
        if not size <= steps.correction * max(step, 1e-3):
            raise NotConverged
        # and so may one that grows again (the second puts right what the first has stretched)
        if strict and iteration > 2 and size > max(last, steps.tolerance):
            raise NotConverged
        last = size
        parameter += change
        total += increment
        state = problem.advance(state, increment, parameter)
        # (where a guess is that good, the tangent and the index at it need not be)
        if size < steps.tolerance and iteration > 1:
            if fresh:
                line = problem.linearise(state, parameter)
                direction, rate = tangent(problem, line, base.direction, base.rate)
            else:
                length = norm(problem, column, 1.0) * np.sign(across)
                direction, rate = -column / length, float(1.0 / length)
            bend = None
            if step:
                mean = _bend(problem, base, direction, rate, step, (direction, rate))
                bend = _bent(mean, base, step)
            correction = np.append(total, parameter - before)
            if near is not None:
                correction += (step / near.step) ** 4 * near.correction
            return Point(
                state, parameter, direction, rate, line.index, line, step, iteration, bend, correction
            )
    raise NotConverged


def _bend(
    problem: Problem[State],
    base: Point[State],
    direction: Array,
    rate: float,
    step: float,
    across: tuple[Array, float],
) -> Array:
    """Rate of change of the tangent from `base` to (direction, rate), a step on, `across` one of the two."""
    u, p = (direction - base.direction) / step, (rate - base.rate) / step
    along = float(problem.weight @ (across[0] * u)) + problem.parameter_weight * across[1] * p
    return np.append(u - along * across[0], p - along * across[1])


def _bent(mean: Array, base: Point[State], step: float) -> Bend:
    """The bend at the end of a step, by the means over it and over the one before."""
    if base.bend is None:
        return Bend(mean, np.zeros_like(mean), mean)
    third = 2.0 / (base.step + step) * (mean - base.bend.mean)
    return Bend(mean + 0.5 * step * third, third, mean)


def inside(problem: Problem[State], base: Point[State], end: Point[State]) -> Point[State]:
    """The point `base`, at a step of 0, with the bend of the step to `end`: predicts best between the two."""
    across = base.direction, base.rate
    mean = _bend(problem, base, end.direction, end.rate, end.step, across)
    third = np.zeros_like(mean) if end.bend is None else end.bend.third
    return replace(base, step=0.0, bend=Bend(mean - 0.5 * end.step * third, third, mean))
