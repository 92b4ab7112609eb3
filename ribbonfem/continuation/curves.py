"""Whole curves of equilibria, folds that a slow ramp meets, and kinds of instability, of any `Problem`."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ribbonfem.options import OptionError
from ribbonfem.results import MESH, Array, Branch, Fold, Instability, SolverError, control_text
from ribbonfem.scene import Ribbon, Scene

from .corrector import Point, Problem, State, Steps, bordered_solve, first_point, solution
from .tracing import Event, Segment, at_parameter, switch, trace

# |dW/L| below which a ribbon is sheared for its continuation, but hardly for anything else
_NEARLY_PLANAR = 1e-3
# parts of a step beyond a branch point at which Newton begins, the first from which it ends
_FURTHER = (1.0, 0.1, 0.01)
# tolerance of Newton times EI1 / EI2: that of the default ribbon is the usual one
_BENDING = 4e-5


def steps_for(scene: Scene) -> Steps:
    """The step control that a scene's curve of equilibria asks for.

    Nearly without shear the sheets of the planar curve's broken pitchforks lie so close that only
    short turns stay on one of them.
    """
    if scene.planar:
        return Steps()
    turn = 0.1 if abs(scene.shear) < _NEARLY_PLANAR else Steps.turn
    return Steps(turn=turn, tolerance=tolerance_for(scene.ribbon))


def tolerance_for(ribbon: Ribbon) -> float:
    """`Steps.tolerance` for a ribbon in three dimensions.

    A point's tangent and index come from the state one increment before it.  One that bends the ribbon
    in its plane changes the forces by EI1 / EI2 times as much, and the signs with them.
    """
    return min(Steps.tolerance, _BENDING / ribbon.bending_ratio)


@dataclass(frozen=True)
class Curve:
    """A curve as arrays, one row a point; what a model needs to make a `Branch`."""

    parameter: Array
    height: Array
    slope: Array
    load: Array
    stable: NDArray[np.bool_]
    folds: tuple[Fold, ...]
    branch_points: tuple[Fold, ...]
    positions: Array
    energy: Array
    normals: Array | None

    def as_branch(self, scene: Scene, options: Mapping[str, Any], model: str, arclength: Array) -> Branch:
        """The same curve as a `Branch` that carries what it was made from."""
        mesh = {name: value for name, value in options.items() if name in MESH}
        of: dict[str, Any] = {"model": model, "scene": scene, "options": mesh}
        return Branch(
            control=self.parameter,
            height=self.height,
            slope=self.slope,
            load=self.load,
            stable=self.stable,
            folds=tuple(replace(fold, **of) for fold in self.folds),
            configurations=self.positions,
            scene=scene,
            options=dict(options),
            model=model,
            arclength=arclength,
            energy=self.energy,
            normals=self.normals,
        )


def as_fold(problem: Problem[State], point: Point[State], **of: Any) -> Fold:
    """What a point is as a fold; `of` are the model, scene and options that it is one of."""
    height, slope, load = problem.observe(point.state, point.parameter)
    return Fold(float(point.parameter), float(height), float(load), slope=float(slope), **of)


def span_of(scene: Scene) -> tuple[float, float]:
    """Where curves of a scene's control are followed by default, its start inside."""
    kind = scene.drives.kind
    usual = {"force": 30.0, "length": np.inf}.get(kind, 1.5)
    low, high = (min(usual, scene.reach_towards(sign)) for sign in (-1.0, 1.0))
    return min(-low, scene.begin - 0.1 * low), max(high, scene.begin + 0.1 * high)


def as_far(
    problem: Problem[State],
    point: Point[State],
    span: tuple[float, float],
    scene: Scene,
    steps: Steps | None = None,
    unstable: int = 2,
) -> Iterator[Segment[State]]:
    """`trace`; of lengths to where a curve more than halfway to an end of `span` can be followed no further.

    A ribbon nearly taut, crossed or not, bends in layers at its clamps alone, as thin as one over the root of
    the force in it, which no mesh resolves up to the last.
    """
    begin = reached = point.parameter
    try:
        for segment in trace(problem, point, span, steps, unstable):
            reached = segment.end.parameter
            yield segment
    except SolverError:
        end = span[1] if reached > begin else span[0]
        if scene.drives.kind != "length" or abs(reached - begin) < 0.5 * abs(end - begin):
            raise


def whole_curve(
    problem: Problem[State],
    state: State,
    span: tuple[float, float] | None,
    scene: Scene,
    steps: Steps | None = None,
    unstable: int = 2,
) -> Curve:
    """The curve through a scene's start, both ways, over `span` or until it closes.

    The start state is a row, at exactly the control's start.  States with more than `unstable` unstable
    directions end the curve (see `trace`).  Without a `span` it is followed over `span_of`, `as_far` as it
    can be.

    Raises
    ------
    OptionError
        If `span` does not contain the control's start inside.
    SolverError
        From the continuation.
    """
    follow = trace if span is not None else partial(as_far, scene=scene)
    begin, span = scene.begin, span or span_of(scene)
    if not span[0] < begin < span[1]:
        raise OptionError(f"span = {span!r}: must have {begin:g} inside, where the start is")
    points: list[Point[State]] = []
    events: list[Event[State]] = []
    closed = False
    for sign in (-1.0, 1.0):
        first = first_point(problem, state, begin, sign)
        half = [first]
        turns: list[Event[State]] = []
        for segment in follow(problem, first, span, steps=steps, unstable=unstable):
            half.append(segment.end)
            turns.extend(segment.events)
            closed = segment.last == "closed"
        if sign < 0.0:
            points, events = half[::-1], turns[::-1]
            if closed:
                break
        else:
            points, events = points[:-1] + half, events + turns
    rows = np.array([problem.observe(point.state, point.parameter) for point in points])
    # of rods in three dimensions alone
    normal: Callable[[State], Array] | None = getattr(problem, "normals", None)
    return Curve(
        parameter=np.array([point.parameter for point in points]),
        height=rows[:, 0],
        slope=rows[:, 1],
        load=rows[:, 2],
        stable=np.array([point.index == 0 for point in points]),
        folds=tuple(as_fold(problem, event.point) for event in events if event.kind == "fold"),
        branch_points=tuple(as_fold(problem, event.point) for event in events if event.kind != "fold"),
        positions=np.stack([problem.positions(point.state, point.parameter) for point in points]),
        energy=np.array([problem.energy(point.state) for point in points]),
        normals=None if normal is None else np.stack([normal(point.state) for point in points]),
    )


def _above(problem: Problem[State], point: Point[State], scene: Scene) -> float:
    """The height above the mean of both clamps."""
    return problem.observe(point.state, point.parameter)[0] - float(scene.clamps_height(point.parameter))


def _landing(
    problem: Problem[State], segment: Segment[State], reached: Point[State], scene: Scene, steps: Steps
) -> float:
    """The height on a segment where it has the parameter of `reached`; of its sign at least."""
    start, end = (_above(problem, point, scene) for point in (segment.start, segment.end))
    if start * end > 0.0:
        return end
    after = segment.events[-1].point.step if segment.events else 0.0
    return _above(problem, at_parameter(problem, segment, reached.parameter, steps, after), scene)


def ramp_events(
    problem: Problem[State],
    state: State,
    scene: Scene,
    steps: Steps | None = None,
) -> tuple[Event[State], ...]:
    """Where the state that a very slow ramp from the control's start follows is lost, in order (see `Scene`).

    At a fold the state passes to the stable sheet that the same curve reaches next at that parameter.  The
    list ends with the first branch point, or with the fold at which the height passes the mean of the
    clamps', at `stop`, at the scene's `reach_towards`, or where the curve offers no further stable sheet
    before it comes to states of more than two unstable directions.

    Raises
    ------
    SolverError
        If the start is not stable, or the sheet beyond a fold is met backwards.
    """
    return _ramp_events(problem, state, scene.begin, scene, steps or steps_for(scene))


def _ramp_events(
    problem: Problem[State], state: State, begin: float, scene: Scene, steps: Steps
) -> tuple[Event[State], ...]:
    """The events of `ramp_events` from a state at a parameter on."""
    sign, far = scene.direction, scene.furthest
    limit = scene.reach_towards(sign) if far is None else sign * far
    point = first_point(problem, state, begin, sign)
    if point.index != 0:
        raise SolverError(f"the start state is not stable: {point.index} unstable directions")
    result: list[Event[State]] = []
    seeking = False
    # the curve may wander far back before it reaches the next stable sheet
    ends = (-scene.reach_towards(-1.0), scene.reach_towards(1.0))
    follow = trace if far is not None else partial(as_far, scene=scene)
    for segment in follow(problem, point, ends, steps=steps):
        if seeking:
            reached = result[-1].point
            beyond = [sign * (p.parameter - reached.parameter) for p in (segment.start, segment.end)]
            if segment.end.index or beyond[0] * beyond[1] > 0.0:
                continue
            if _above(problem, reached, scene) * _landing(problem, segment, reached, scene, steps) < 0.0:
                break
            if beyond[1] < beyond[0]:
                raise SolverError(
                    f"beyond the fold at {reached.parameter:.6g} the curve reaches a stable state from the "
                    "other side, where a ramp does not go; the whole curve is in `equilibria`"
                )
            seeking = False
            continue
        for event in segment.events:
            if seeking or segment.start.index != 0:
                continue
            if sign * event.point.parameter > limit:
                return tuple(result)
            onward = stays_stable(problem, segment, event, sign * min(0.01, limit))
            if onward is not None:
                return (*result, *_ramp_events(problem, *onward, scene, steps))
            result.append(event)
            if event.kind != "fold":
                return tuple(result)
            seeking = True
        if not seeking and sign * segment.end.parameter > limit:
            break
    return tuple(result)


def stays_stable(
    problem: Problem[State], segment: Segment[State], event: Event[State], further: float
) -> tuple[State, float] | None:
    """The state, and its parameter, beyond an event at which the curve ends in another one that is stable."""
    turns = segment.start.rate * segment.end.rate < 0.0
    if event.kind == "fold" or segment.end.index or not turns:
        return None
    onward = _along(problem, event, further)
    return onward if onward is not None and problem.linearise(*onward).index == 0 else None


def _along(problem: Problem[State], event: Event[State], further: float) -> tuple[State, float] | None:
    """A state, and its parameter, on the curve through a branch point that breaks no symmetry; or None.

    J is singular there along the null vector, which borders it; what solves it alone is rounding.
    """
    point, across = event.point, problem.weight * event.null
    bordered = replace(point.linearisation, slope=across)
    along, _ = bordered_solve(bordered, across, 0.0, -point.linearisation.slope, 0.0)
    for part in _FURTHER:
        parameter = point.parameter + part * further
        guess = problem.advance(point.state, part * further * along, parameter)
        try:
            return solution(problem, guess, parameter), parameter
        except SolverError:
            continue
    return None


def ramp_folds(
    problem: Problem[State],
    state: State,
    scene: Scene,
    steps: Steps | None = None,
) -> tuple[Event[State], ...]:
    """The folds of `ramp_events`.

    Raises
    ------
    SolverError
        As there, and if the state loses its stability at a branch point before any fold.
    """
    result = ramp_events(problem, state, scene, steps)
    folds = tuple(event for event in result if event.kind == "fold")
    if result and not folds and _folds_beyond(problem, result[0], scene, steps or steps_for(scene)):
        raise lost_before_fold(scene, result[0].point.parameter)
    return folds


def lost_before_fold(scene: Scene, control: float) -> SolverError:
    """What `folds` says of a state that is lost at another point than a fold, at this control."""
    return SolverError(
        f"the ramp loses stability at a branch point ({control_text(scene, control, '.9g')}) before a fold: "
        "another curve crosses there, see `instabilities`; folds beyond are in `equilibria`"
    )


def _folds_beyond(problem: Problem[State], event: Event[State], scene: Scene, steps: Steps) -> bool:
    """Whether the curve that goes on through a branch point turns back within reach."""
    sign, far = scene.direction, scene.furthest
    limit = scene.reach_towards(sign) if far is None else sign * far
    beyond = _along(problem, event, sign * min(0.01, 0.5 * abs(limit - sign * event.point.parameter)))
    if beyond is None:
        return True
    ends = (-scene.reach_towards(-1.0), scene.reach_towards(1.0))
    try:
        for segment in trace(problem, first_point(problem, *beyond, sign), ends, steps, 8):
            if sign * segment.end.parameter > limit:
                return False
            if any(other.kind == "fold" for other in segment.events):
                return True
    except SolverError:
        # a curve that cannot be followed may turn back
        return True
    return False


# amplitudes of the curve that crosses at a branch point, and how unequal its two sides are at a pitchfork
_SIDES, _UNEQUAL = (0.02, 0.005, 1e-3), 0.2


def instability_of(
    problem: Problem[State], event: Event[State], scene: Scene, steps: Steps | None, of: dict[str, Any]
) -> Instability:
    """What kind of point an event is, by where the curve that crosses there goes.

    On that curve the control is p0 + q e^2 on both sides e of a pitchfork, and runs through p0 at a branch
    point with a quadratic term; before p0 it is there while the state is stable still: subcritical.
    """
    point = event.point
    height, _, load = problem.observe(point.state, point.parameter)
    known: dict[str, Any] = {"control": float(point.parameter), "height": float(height), "load": float(load)}
    if event.kind == "fold":
        return Instability(kind="fold", subcritical=False, out_of_plane=False, **known, scene=scene, **of)
    across: Callable[[Array], bool] | None = getattr(problem, "crosses_plane", None)
    out = scene.planar and across is not None and across(event.null)
    for amplitude in _SIDES:
        try:
            sides = [
                scene.direction * (switch(problem, event, side, steps).parameter - point.parameter)
                for side in (amplitude, -amplitude)
            ]
        except SolverError:
            continue
        even, odd = sides[0] + sides[1], abs(sides[0] - sides[1])
        kind = "pitchfork" if odd <= _UNEQUAL * abs(even) or (amplitude == _SIDES[-1] and out) else "branch"
        if kind == "pitchfork" or amplitude == _SIDES[-1]:
            return Instability(
                kind=kind,
                subcritical=bool(kind == "branch" or even < 0.0),
                out_of_plane=out,
                **known,
                scene=scene,
                **of,
            )
    return Instability(kind="branch", subcritical=True, out_of_plane=out, **known, scene=scene, **of)
