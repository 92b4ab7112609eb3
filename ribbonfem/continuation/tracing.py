"""Steps along a curve of equilibria: their control, folds and branch points, switching, where a curve ends.

Curves are followed in any parameter of a `Problem`; their folds and branch points are located,
another curve is switched to, and a curve that closes or leaves its span is recognised.

References: H. B. Keller (1977), pseudo-arclength; W. Govaerts, "Numerical Methods for
Bifurcations of Dynamical Equilibria", SIAM 2000.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Generic

import numpy as np

from ribbonfem.results import Array, SolverError

from .between import Between, root
from .corrector import (
    Linearisation,
    NotConverged,
    Point,
    Problem,
    State,
    Steps,
    correct,
    equilibrium,
    inside,
    norm,
    tangent,
)

# what 1 - cos may be between the last two vectors of an inverse iteration
_ALIGNED = 1e-15
# parts of a step's largest rate of the parameter: where it is below the first at an end, or below the second
# between the ends, the step is halved, down to the third part of `Steps.first`
_STATIONARY, _NEARLY, _CLOSEST = 0.02, 0.1, 1e-3


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
    SolverError
        If `target` is not between the parameters there, or Newton does not converge.
    """
    steps = steps or Steps()
    result = _near(problem, segment, target, steps) if after == 0.0 else None
    if result is None:
        near = _between(problem, segment, target, steps, after)
        state = problem.advance(near.state, np.zeros_like(near.direction), target)
        result = near, *equilibrium(problem, state, target, tolerance=steps.exact)
    near, state, line = result
    try:
        direction, rate = tangent(problem, line, near.direction, near.rate)
    except NotConverged as error:
        raise SolverError(
            f"the curve of equilibria has no tangent at parameter {target:.9g}: its factorisation broke down"
        ) from error
    # to second order in what was left to go: whether an event comes before is told by it
    ahead = (target - near.parameter) / near.rate if near.rate else 0.0
    step = near.step + ahead if abs(ahead) < 0.1 * segment.end.step else near.step
    return Point(state, target, direction, rate, line.index, line, step, near.iterations)


def _between(
    problem: Problem[State], segment: Segment[State], target: float, steps: Steps, after: float
) -> Point[State]:
    """The point of a segment, beyond its arclength `after`, at which the parameter is nearly `target`."""
    base, length = inside(problem, segment.start, segment.end), segment.end.step
    points = Between(problem, base, segment.end, steps, fresh=False)

    def off(step: float) -> float:
        return points.at(step).parameter - target

    try:
        return points.at(root(off, after, length, 1e-5 * length))
    except (NotConverged, ValueError) as error:
        raise SolverError(
            f"parameter {target:.9g} was not found between {base.parameter:.9g} and "
            f"{segment.end.parameter:.9g}, on a step of {length:.3g} in arclength"
        ) from error


def _near(
    problem: Problem[State], segment: Segment[State], target: float, steps: Steps
) -> tuple[Point[State], State, Linearisation] | None:
    """A point near `target`, and the state there, by one guess where the parameter runs on in one direction.

    None if the guess does not serve: where the segment turns, is steep, or Newton leads far away.
    """
    start, end = segment.start, segment.end
    length, span = end.step, end.parameter - start.parameter
    slopes = start.rate * length, end.rate * length
    # by the limits of a cubic that is monotone between its ends
    if length == 0.0 or not all(span**2 < 3.0 * slope * span < 9.0 * span**2 for slope in slopes):
        return None
    part = (target - start.parameter) / span
    if not 0.0 < part <= 1.0:
        return None
    # arclength as a cubic of the parameter
    first, last = span / slopes[0], span / slopes[1]
    rest = 1.0 - part
    share = part * part * (3.0 - 2.0 * part) + part * rest * (rest * first - part * last)
    try:
        near = correct(problem, inside(problem, start, end), share * length, steps)
        ahead = (target - near.parameter) / near.rate
        if not abs(ahead) < 0.1 * length:
            return None
        state = problem.advance(near.state, near.direction * ahead, target)
        return near, *equilibrium(problem, state, target, newton=4, tolerance=steps.exact)
    except (NotConverged, SolverError):
        return None


def _fold(problem: Problem[State], base: Point[State], end: Point[State], steps: Steps) -> Event[State]:
    """The fold between two points: the root of the tangent's parameter component.

    The parameter is stationary there, so an error e of the root is one of e^2 in the angle.
    """
    points = Between(problem, inside(problem, base, end), end, steps)
    # of the cubic of the parameter through both ends
    mean = (end.parameter - base.parameter) / end.step
    bend, change = 3.0 * (base.rate + end.rate - 2.0 * mean), 6.0 * mean - 4.0 * base.rate - 2.0 * end.rate
    guesses = [float(x.real) for x in np.roots([bend, change, base.rate]) if 0.0 < x.real < 1.0]
    place = root(
        lambda step: points.at(step).rate,
        0.0,
        end.step,
        max(1e-7, steps.location) * end.step,
        guesses[0] * end.step if guesses else None,
    )
    point = points.at(place)
    return Event("fold", point, point.direction / norm(problem, point.direction, 0.0))


def _null_vector(line: Linearisation, weight: Array) -> Array:
    """Unit vector of the eigenvalue of J nearest to 0, by inverse iteration from a fixed start."""
    vector = np.cos(1.0 + np.arange(len(weight)) ** 1.5)
    vector /= np.sqrt(weight @ vector**2)
    for _ in range(12):
        last, vector = vector, line.solve(weight * vector)
        vector /= np.sqrt(weight @ vector**2)
        # beside a small eigenvalue of either sign the others are gone at once
        if 1.0 - abs(float((weight * last) @ vector)) < _ALIGNED:
            break
    return vector


def _branch_point(
    problem: Problem[State], base: Point[State], end: Point[State], steps: Steps
) -> Event[State] | None:
    """The point between two points at which J is singular although the curve goes on, if the root is there.

    The test function is 1 / (b J^-1 b) with b near the null vector: smooth, with a simple root.
    """
    vector = problem.weight * _null_vector(end.linearisation, problem.weight)
    # increments along the null vector are rounding here; what they leave, the fresh tangent does not show
    steps = replace(steps, tolerance=max(steps.tolerance, Steps.tolerance))
    points = Between(problem, inside(problem, base, end), end, steps)

    def test(step: float) -> float:
        return 1.0 / float(vector @ points.at(step).linearisation.solve(vector))

    try:
        point = points.at(root(test, 0.0, end.step, steps.location * end.step))
    except ValueError:
        return None
    line = point.linearisation
    null = _null_vector(line, problem.weight)
    # Where curves cross, F_p has no part along the null vector.  Where it has one the curve turns:
    # the root is a fold of another curve, onto which the step has jumped.
    scale = max(abs(test(0.0)), abs(test(end.step))) / max(abs(base.rate), abs(end.rate))
    if abs(float(null @ line.slope)) > 1e-3 * scale:
        return None
    return Event("branch point", point, null)


def _tip(
    problem: Problem[State], base: Point[State], end: Point[State], steps: Steps
) -> tuple[Event[State], ...] | None:
    """The symmetric tip of a fork, where a curve turns back and is as stable after as before.

    It meets there the curve that it has forked from.  At any other turn the index changes; if
    it does so here too, and not between `base` and `end`, then these lie on different curves.
    """
    event = _fold(problem, base, end, steps)
    middle, near = event.point.step, inside(problem, base, end)
    apart = 0.25 * min(middle, end.step - middle)
    for step in (middle - apart, middle + apart):
        if correct(problem, near, step, steps).index != base.index:
            return None
    return (Event("branch point", event.point, event.null),)


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


def _may_turn_twice(base: Point[State], end: Point[State], steps: Steps) -> bool:
    """Whether the parameter may turn forth and back inside a step with one direction at both its ends.

    So it does near a pitchfork, a^3 - m a = p: on a step longer than the root of m.  The cubic
    through both ends tells, as long as the step is not much longer than that: then one of the ends, or
    a place between them, lies near a stationary parameter, which is looked at more closely.
    """
    step, sign = end.step, np.sign(base.rate)
    first, last = sign * base.rate, sign * end.rate
    if last <= 0.0 or step < _CLOSEST * steps.first:
        return False
    most, mean = max(first, last), sign * (end.parameter - base.parameter) / step
    if min(first, last) < _STATIONARY * most:
        return True
    bend, change = 3.0 * (first + last - 2.0 * mean), 3.0 * mean - 2.0 * first - last
    return 0.0 < -change < bend and first - change**2 / bend < _NEARLY * most


def _ended(
    problem: Problem[State],
    start: Point[State],
    segment: Segment[State],
    span: tuple[float, float],
    steps: Steps,
) -> Segment[State]:
    """The segment, cut where it leaves the span or comes back to the start of the curve."""
    cut: Point[State] | None
    # a turn beyond the edge may lie inside a step with both its ends within
    for end in (*(event.point for event in segment.events), segment.end):
        if not span[0] <= end.parameter <= span[1]:
            edge = span[1] if end.parameter > span[1] else span[0]
            part = Segment(segment.start, end)
            cut, last = at_parameter(problem, part, edge, steps), "span"
            break
    else:
        cut, last = _closed(problem, start, segment, steps), "closed"
    if cut is None:
        return segment
    if segment.start.index != segment.end.index:
        # beside an event rounding decides on which side the cut lies: the index there says how it did
        kept = segment.events if cut.index != segment.start.index else ()
    else:
        kept = tuple(event for event in segment.events if event.point.step <= cut.step)
    return Segment(segment.start, cut, kept, last)


def _closed(
    problem: Problem[State], start: Point[State], segment: Segment[State], steps: Steps
) -> Point[State] | None:
    """The point at which a segment comes back to `start`, in the direction in which it left; or None.

    Several sheets may have the parameter of `start`: the positions there tell.
    """
    base, end = segment.start, segment.end
    turned = base.rate * end.rate < 0.0
    low = segment.events[-1].point if turned else base
    within = (low.parameter - start.parameter) * (end.parameter - start.parameter) <= 0.0
    if base is start or not within or end.rate * start.rate < 0.0:
        return None
    back = at_parameter(problem, segment, start.parameter, steps, low.step if turned else 0.0)
    off = problem.positions(back.state, back.parameter) - problem.positions(start.state, start.parameter)
    return back if float(np.abs(off).max()) < 1e-7 else None


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

    A step is taken again at half its length if Newton fails or wanders, if its first correction is large,
    if the tangent turns by more than `steps.turn`, if the parameter may turn twice inside it, or if
    the number of unstable directions changes by more than the events found in it explain: the step
    may have landed on another curve, or passed two folds.  The last point lies on the edge of the
    span, or is the first one.

    Raises
    ------
    SolverError
        If a step falls below `steps.smallest`, or after `steps.most` points.
    """
    steps = steps or Steps()
    base, step = point, min(steps.first, steps.largest)
    for _ in range(steps.most):
        while True:
            if step < steps.smallest:
                raise SolverError(
                    f"continuation stopped at parameter {base.parameter:.9g}: no step of at least "
                    f"{steps.smallest:g} in arclength (`Steps.smallest`) found a next point of the same "
                    "curve; close to a branch point another mesh, or other `steps`, may pass it"
                )
            try:
                end = correct(problem, base, step, steps, strict=True)
                cosine = float(problem.weight @ (base.direction * end.direction))
                cosine += problem.parameter_weight * base.rate * end.rate
                turn = float(np.arccos(min(1.0, max(-1.0, cosine))))
                doubtful = turn > steps.turn or _may_turn_twice(base, end, steps)
                events = None if doubtful else _events(problem, base, end, steps)
                if events is not None:
                    segment = _ended(problem, point, Segment(base, end, events), span, steps)
                    break
            except (NotConverged, SolverError):
                # also of a solve inside the step: a shorter one has a better predictor
                pass
            step *= 0.5
        if segment.last:
            yield segment
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
        return correct(problem, side, abs(amplitude), steps)
    except NotConverged as error:
        raise SolverError(
            f"no second curve found at {amplitude:g} along the null vector of the branch point at "
            f"parameter {base.parameter:.9g}"
        ) from error
