"""Whole curves of equilibria and slow ramps along them, for any model's `Problem`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ribbonfem.results import MESH, Array, Branch, Fold, SolverError
from ribbonfem.scene import Ribbon, Scene

from .corrector import Point, Problem, State, Steps, first_point
from .tracing import Event, Segment, at_parameter, trace

# |dW/L| below which a ribbon is sheared for its continuation, but hardly for anything else
_NEARLY_PLANAR = 1e-3
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

    def as_branch(self, scene: Scene, policy: Mapping[str, Any], model: str, arclength: Array) -> Branch:
        """The same curve as a `Branch` that carries what it was made from."""
        mesh = {name: value for name, value in policy.items() if name in MESH}
        of: dict[str, Any] = {"model": model, "scene": scene, "policy": mesh}
        return Branch(
            angle=self.parameter,
            height=self.height,
            slope=self.slope,
            load=self.load,
            stable=self.stable,
            folds=tuple(replace(fold, **of) for fold in self.folds),
            configurations=self.positions,
            scene=scene,
            policy=dict(policy),
            model=model,
            arclength=arclength,
            energy=self.energy,
            normals=self.normals,
        )


def as_fold(problem: Problem[State], point: Point[State], **of: Any) -> Fold:
    """The angle, height and load of a point; `of` are the model, scene and policy that it is a fold of."""
    height, _, load = problem.observe(point.state, point.parameter)
    return Fold(float(point.parameter), float(height), float(load), **of)


def whole_curve(
    problem: Problem[State],
    state: State,
    span: tuple[float, float],
    steps: Steps | None = None,
    unstable: int = 2,
) -> Curve:
    """The curve through an equilibrium at parameter 0, both ways, over `span` or until it closes.

    The start state is a row, at parameter exactly 0.  States with more than `unstable` unstable
    directions end the curve (see `trace`).

    Raises
    ------
    ValueError
        If `span` does not contain 0 inside.
    SolverError
        From the continuation.
    """
    if not span[0] < 0.0 < span[1]:
        raise ValueError(f"span = {span!r}: must contain 0 inside")
    points: list[Point[State]] = []
    events: list[Event[State]] = []
    closed = False
    for sign in (-1.0, 1.0):
        first = first_point(problem, state, 0.0, sign)
        half = [first]
        turns: list[Event[State]] = []
        for segment in trace(problem, first, span, steps, unstable):
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


def _landing(problem: Problem[State], segment: Segment[State], reached: Point[State], steps: Steps) -> float:
    """The height on a segment where it has the parameter of `reached`; of its sign at least."""
    start, end = (problem.observe(p.state, p.parameter)[0] for p in (segment.start, segment.end))
    if start * end > 0.0:
        return end
    after = segment.events[-1].point.step if segment.events else 0.0
    point = at_parameter(problem, segment, reached.parameter, steps, after)
    return problem.observe(point.state, point.parameter)[0]


def ramp_folds(
    problem: Problem[State],
    state: State,
    scene: Scene,
    steps: Steps | None = None,
) -> tuple[Event[State], ...]:
    """The folds that a very slow ramp from alpha = 0 meets, in order (see `Scene`: rate, stop).

    At a fold the state passes to the stable sheet that the same curve reaches next at that
    parameter.  The list ends with the fold at which the height changes sign, at `stop`, at a
    full turn, or where the curve offers no further stable sheet before it climbs to states of
    more than two unstable directions.

    Raises
    ------
    SolverError
        If the state loses its stability at a branch point: the ramp then leaves this curve.
    """
    steps = steps or steps_for(scene)
    sign = 1.0 if scene.rate > 0.0 else -1.0
    limit = 2.0 * np.pi if scene.stop is None else abs(scene.stop)
    point = first_point(problem, state, 0.0, sign)
    if point.index != 0:
        raise SolverError(f"the start state is not stable: {point.index} unstable directions")
    found: list[Event[State]] = []
    seeking = False
    # the curve may wander far back before it reaches the next stable sheet
    for segment in trace(problem, point, (-2.0 * np.pi, 2.0 * np.pi), steps):
        if seeking:
            reached = found[-1].point
            ends = [sign * (p.parameter - reached.parameter) for p in (segment.start, segment.end)]
            if segment.end.index or ends[0] * ends[1] > 0.0:
                continue
            if (
                problem.observe(reached.state, reached.parameter)[0]
                * _landing(problem, segment, reached, steps)
                < 0.0
            ):
                break
            if ends[1] < ends[0]:
                raise SolverError(
                    f"the stable sheet beyond the fold at {reached.parameter:.6g} is met backwards; "
                    "its folds are in `equilibria`"
                )
            seeking = False
            continue
        for event in segment.events:
            if event.kind != "fold":
                if segment.start.index == 0:
                    raise SolverError(
                        f"the ramp loses stability at a branch point (parameter {event.point.parameter:.9g}) "
                        "before a fold: another curve crosses there; see `equilibria`"
                    )
                continue
            if seeking or segment.start.index != 0:
                continue
            if abs(event.point.parameter) > limit:
                return tuple(found)
            found.append(event)
            seeking = True
        if not seeking and sign * segment.end.parameter > limit:
            break
    return tuple(found)
