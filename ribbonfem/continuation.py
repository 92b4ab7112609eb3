"""Pseudo-arclength continuation of equilibria, shared by all models.

A model states its equilibrium equations ``F(u, p) = 0`` as a `Problem`; everything here works
on that and knows no mechanics.  Tangents ``J = F_u`` are symmetric (they come from an energy
or a Lagrangian), which the bordered solver uses.  A state may live on a manifold (rotating
frames, for example): increments are applied by the problem's own `advance`.

References: H. B. Keller (1977), pseudo-arclength; W. Govaerts, "Numerical Methods for
Bifurcations of Dynamical Equilibria", SIAM 2000, section 3.6, mixed block elimination.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from typing import Generic, Protocol, TypeVar

import numpy as np
from scipy.optimize import brentq

from .results import Array, SolverError

State = TypeVar("State")

# An angle of 1 rad counts as 0.15 L in the arclength: heights change by some 0.3 L over a fold's
# neighbourhood and angles by 1 rad, and a curve of even curvature takes the fewest steps.
PARAMETER_WEIGHT = 0.0225


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
    parameter_weight dp^2 independent of the mesh.
    """

    weight: Array
    parameter_weight: float

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
    most: largest number of points on a curve.
    """

    first: float = 0.02
    largest: float = 0.2
    smallest: float = 1e-7
    turn: float = 0.35
    correction: float = 0.25
    newton: int = 8
    tolerance: float = 1e-7
    most: int = 4000

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if isinstance(value, bool) or not value > 0:
                raise ValueError(f"Steps.{name} = {value!r}: must be greater than 0")


@dataclass(frozen=True)
class Point(Generic[State]):
    """A point of a curve with its unit tangent (du/ds, dp/ds) and the `step` that led to it.

    `bend` is the tangent's rate of change over that step, (d2u/ds2, d2p/ds2) across the tangent
    and to first order; None where there was no step.
    """

    state: State
    parameter: float
    direction: Array
    rate: float
    index: int
    linearisation: Linearisation = field(repr=False)
    step: float = 0.0
    iterations: int = 0
    bend: tuple[Array, float] | None = field(default=None, repr=False)


@dataclass(frozen=True)
class Event(Generic[State]):
    """Where the curve turns back in the parameter ("fold") or another one crosses it ("branch point").

    `null` (n,) is the unit null vector of J there.
    """

    kind: str
    point: Point[State]
    null: Array


@dataclass(frozen=True)
class Segment(Generic[State]):
    """One step of a curve: its two ends and the events between them, in order.

    `last` is "span", "closed" or "unstable" on the last segment of a curve, else empty.
    """

    start: Point[State]
    end: Point[State]
    events: tuple[Event[State], ...] = ()
    last: str = ""


class _Failed(Exception):
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


def _norm(problem: Problem[State], increment: Array, change: float) -> float:
    return float(np.sqrt(problem.weight @ increment**2 + problem.parameter_weight * change**2))


def equilibrium(
    problem: Problem[State], state: State, parameter: float, *, newton: int = 30, tolerance: float = 1e-9
) -> tuple[State, Linearisation]:
    """Newton at a fixed parameter from a good guess.

    Returns
    -------
    The state and the linearisation at it.

    Raises
    ------
    SolverError
        If the increment does not fall below `tolerance` within `newton` iterations.
    """
    size = np.inf
    for _ in range(newton):
        line = problem.linearise(state, parameter)
        increment = line.solve(-line.residual)
        size = _norm(problem, increment, 0.0)
        if not np.isfinite(size) or size > 1e3:
            break
        state = problem.advance(state, increment, parameter)
        if size < tolerance:
            return state, problem.linearise(state, parameter)
    raise SolverError(
        f"no equilibrium found at parameter {parameter:.6g}: Newton's last increment was {size:.3g} "
        f"(needed: {tolerance:g} within {newton} iterations); start from a closer guess or a finer mesh"
    )


def _tangent(
    problem: Problem[State], line: Linearisation, direction: Array, rate: float
) -> tuple[Array, float]:
    """Unit tangent with a positive component along (direction, rate)."""
    row, corner = problem.weight * direction, problem.parameter_weight * rate
    u, p = bordered_solve(line, row, corner, np.zeros_like(direction), 1.0)
    size = _norm(problem, u, p)
    return u / size, p / size


def first_point(problem: Problem[State], state: State, parameter: float, sign: float) -> Point[State]:
    """The point at an equilibrium, with the tangent along which the parameter moves with `sign`."""
    state, line = equilibrium(problem, state, parameter)
    direction, rate = -line.solve(line.slope), 1.0
    size = np.copysign(_norm(problem, direction, rate), sign)
    return Point(state, parameter, direction / size, rate / size, line.index, line)


def _correct(
    problem: Problem[State], base: Point[State], step: float, steps: Steps, *, fresh: bool = False
) -> Point[State]:
    """The point of the curve at pseudo-arclength `step` from `base`.

    Predicted along the parabola of the last step's bend, which saves an iteration against the
    straight line.  The tangent is of the last linearisation, one (small) increment back, or of
    a `fresh` one where an event is to be located by it.
    """
    row, corner = problem.weight * base.direction, problem.parameter_weight * base.rate
    increment, change = step * base.direction, step * base.rate
    if base.bend is not None:
        increment = increment + 0.5 * step**2 * base.bend[0]
        change += 0.5 * step**2 * base.bend[1]
    parameter = base.parameter + change
    state = problem.advance(base.state, increment, parameter)
    for iteration in range(1, steps.newton + 1):
        line = problem.linearise(state, parameter)
        # Plain block elimination: half the solves of the mixed one, and what it loses where J is
        # nearly singular is a part of a correction, which the next iteration makes good.
        both = line.solve(np.column_stack((line.residual, line.slope)))
        newton, column = both[:, 0], both[:, 1]
        change = float(row @ newton) / (corner - float(row @ column))
        increment = -newton - change * column
        size = _norm(problem, increment, change)
        # a correction that is large against the step may land on a curve that passes nearby
        if not size <= steps.correction * max(step, 1e-3):
            raise _Failed
        parameter += change
        state = problem.advance(state, increment, parameter)
        if size < steps.tolerance:
            if fresh:
                line = problem.linearise(state, parameter)
                direction, rate = _tangent(problem, line, base.direction, base.rate)
            else:
                length = _norm(problem, column, 1.0) * np.sign(corner - float(row @ column))
                direction, rate = -column / length, float(1.0 / length)
            end = Point(state, parameter, direction, rate, line.index, line, step, iteration)
            return replace(end, bend=_bend(problem, base, end, end)) if step else end
    raise _Failed


def _bend(
    problem: Problem[State], base: Point[State], end: Point[State], at: Point[State]
) -> tuple[Array, float]:
    """Rate of change of the tangent from `base` to `end`, across the tangent `at` one of them."""
    u, p = (end.direction - base.direction) / end.step, (end.rate - base.rate) / end.step
    along = float(problem.weight @ (at.direction * u)) + problem.parameter_weight * at.rate * p
    return u - along * at.direction, p - along * at.rate


def at_parameter(
    problem: Problem[State],
    segment: Segment[State],
    target: float,
    steps: Steps | None = None,
    after: float = 0.0,
) -> Point[State]:
    """The point inside a segment, beyond its arclength `after`, at which the parameter is exactly `target`.

    Raises
    ------
    ValueError
        If `target` is not between the parameters there.
    SolverError
        From Newton.
    """
    steps = steps or Steps()
    base, length = _inside(problem, segment.start, segment.end), segment.end.step

    def off(step: float) -> float:
        parameter = base.parameter if step == 0.0 else _correct(problem, base, step, steps).parameter
        return parameter - target

    near = _correct(problem, base, brentq(off, after, length, xtol=1e-5 * length), steps)
    state = problem.advance(near.state, np.zeros_like(near.direction), target)
    state, line = equilibrium(problem, state, target)
    direction, rate = _tangent(problem, line, near.direction, near.rate)
    return Point(state, target, direction, rate, line.index, line, near.step, near.iterations)


def _inside(problem: Problem[State], base: Point[State], end: Point[State]) -> Point[State]:
    """The point `base` with the bend of the step to `end`: the best predictor between the two."""
    return replace(base, bend=_bend(problem, base, end, base))


def _fold(problem: Problem[State], base: Point[State], end: Point[State], steps: Steps) -> Event[State]:
    """The fold between two points: the root of the tangent's parameter component.

    The parameter is stationary there, so an error e of the root is one of e^2 in the angle.
    """
    base = _inside(problem, base, end)
    found = {0.0: base, end.step: end}

    def rate(step: float) -> float:
        if step not in found:
            found[step] = _correct(problem, base, step, steps, fresh=True)
        return found[step].rate

    root = brentq(rate, 0.0, end.step, xtol=1e-7 * end.step, rtol=1e-12)
    rate(root)
    point = found[root]
    return Event("fold", point, point.direction / _norm(problem, point.direction, 0.0))


def _null_vector(line: Linearisation, weight: Array) -> Array:
    """Unit vector of the eigenvalue of J nearest to 0, by inverse iteration from a fixed start."""
    vector = np.cos(1.0 + np.arange(len(weight)) ** 1.5)
    for _ in range(12):
        vector = line.solve(weight * vector)
        vector /= np.sqrt(weight @ vector**2)
    return vector


def _branch_point(
    problem: Problem[State], base: Point[State], end: Point[State], steps: Steps
) -> Event[State] | None:
    """The point between two points at which J is singular although the curve goes on, if the root is there.

    The test function is 1 / (b J^-1 b) with b near the null vector: smooth, with a simple root.
    """
    vector = problem.weight * _null_vector(end.linearisation, problem.weight)
    base = _inside(problem, base, end)
    found = {0.0: base, end.step: end}

    def test(step: float) -> float:
        if step not in found:
            found[step] = _correct(problem, base, step, steps, fresh=True)
        return 1.0 / float(vector @ found[step].linearisation.solve(vector))

    if test(0.0) * test(end.step) > 0.0:
        return None
    root = brentq(test, 0.0, end.step, xtol=1e-10 * end.step, rtol=1e-12)
    test(root)
    return Event("branch point", found[root], _null_vector(found[root].linearisation, problem.weight))


def _tip(
    problem: Problem[State], base: Point[State], end: Point[State], steps: Steps
) -> tuple[Event[State], ...] | None:
    """The symmetric tip of a fork, where a curve turns back and is as stable after as before.

    It meets there the curve that it has forked from.  Elsewhere a turn changes the index, so
    that without a null vector along the curve at the turn the step has landed on another one.
    """
    event = _fold(problem, base, end, steps)
    null = _null_vector(event.point.linearisation, problem.weight)
    along = float(problem.weight @ (null * event.null))
    if abs(along) < 1.0 - 1e-4:
        return None
    return (Event("branch point", event.point, null),)


def _events(
    problem: Problem[State], base: Point[State], end: Point[State], steps: Steps
) -> tuple[Event[State], ...] | None:
    """The events of a step, or None if they cannot be told apart and the step must be shorter."""
    change = end.index - base.index
    if base.rate * end.rate < 0.0:
        if abs(change) == 1:
            return (_fold(problem, base, end, steps),)
        return _tip(problem, base, end, steps) if change == 0 else None
    if change == 0:
        return ()
    if abs(change) > 1:
        return None
    event = _branch_point(problem, base, end, steps)
    return None if event is None else (event,)


def trace(
    problem: Problem[State],
    point: Point[State],
    span: tuple[float, float],
    steps: Steps | None = None,
    unstable: int = 2,
) -> Iterator[Segment[State]]:
    """Follow a curve from a point until the parameter leaves `span` or the curve closes.

    It also ends where a state has more than `unstable` unstable directions: buckled beams have
    curves that go on through ever higher modes and never leave the span.

    A step is taken again at half its length if Newton fails, if its first correction is large,
    if the tangent turns by more than `steps.turn`, or if the number of unstable directions
    changes by more than the events found in it explain: each of these may mean that the step
    landed on another curve.  The last point lies on the edge of the span.

    Raises
    ------
    SolverError
        If a step falls below `steps.smallest`, or after `steps.most` points.
    """
    steps = steps or Steps()
    origin = problem.positions(point.state, point.parameter)
    start, step, farthest = point, min(steps.first, steps.largest), 0.0
    base = point
    for _ in range(steps.most):
        while True:
            if step < steps.smallest:
                raise SolverError(
                    f"continuation stopped at parameter {base.parameter:.9g}: no step of at least "
                    f"{steps.smallest:g} converged; allow smaller steps or use a finer mesh"
                )
            try:
                end = _correct(problem, base, step, steps)
                cosine = float(problem.weight @ (base.direction * end.direction))
                cosine += problem.parameter_weight * base.rate * end.rate
                turn = float(np.arccos(min(1.0, max(-1.0, cosine))))
                events = _events(problem, base, end, steps) if turn <= steps.turn else None
            except _Failed:
                events = None
            if events is not None:
                break
            step *= 0.5
        segment = Segment(base, end, events)
        edge = span[1] if end.parameter > span[1] else span[0]
        if not span[0] <= end.parameter <= span[1]:
            edge_point = at_parameter(problem, segment, edge, steps)
            kept = tuple(event for event in events if event.point.step <= edge_point.step)
            yield Segment(base, edge_point, kept, "span")
            return
        distance = float(np.abs(problem.positions(end.state, end.parameter) - origin).max())
        distance = max(distance, abs(end.parameter - start.parameter))
        farthest = max(farthest, distance)
        # two long steps away and back, and on in the same direction: the curve has closed
        if farthest > 4.0 * steps.largest and distance < step and start.rate * end.rate > 0.0:
            yield Segment(base, end, events, "closed")
            return
        if end.index > max(unstable, point.index):
            yield Segment(base, end, events, "unstable")
            return
        yield segment
        base = end
        growth = min(2.0, 0.6 * steps.turn / max(turn, 1e-12), 4.0 / end.iterations)
        step = min(steps.largest, step * max(0.5, growth))
    raise SolverError(f"a curve of more than {steps.most} points: allow more, or longer steps")


def switch(
    problem: Problem[State], event: Event[State], amplitude: float, steps: Steps | None = None
) -> Point[State]:
    """The point of the other curve through a branch point, `amplitude` along its null vector.

    The sign of `amplitude` chooses the side.

    Raises
    ------
    SolverError
        If the corrector does not converge; take a smaller amplitude.
    """
    steps = steps or Steps()
    base = event.point
    side = Point(
        base.state, base.parameter, np.sign(amplitude) * event.null, 0.0, base.index, base.linearisation
    )
    try:
        return _correct(problem, side, abs(amplitude), steps)
    except _Failed as error:
        raise SolverError(
            f"no second curve found at {amplitude:g} along the null vector of the branch point at "
            f"parameter {base.parameter:.9g}; take a smaller amplitude"
        ) from error
