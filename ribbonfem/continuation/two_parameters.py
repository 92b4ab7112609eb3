"""Curves of folds and of pitchforks in two parameters: neutral states, followed, and what is between rows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Generic

import numpy as np
from numpy.polynomial import Chebyshev

from ribbonfem.ends.second_parameter import SecondParameter
from ribbonfem.fold_curves import CurvePoint, FoldCurve, PitchforkCurve
from ribbonfem.options import refuse
from ribbonfem.results import SolverError
from ribbonfem.scene import Scene

from .corrector import PARAMETER_WEIGHT, NotConverged, Point, State, Steps, correct, equilibrium, first_point
from .neutral import Neutral, NeutralStates, Rigged
from .tracing import Event, Segment, trace

# degree of the polynomials between rows; what they may be off by, in rad and the like; the part of an error
# that half a step has to leave
_DEGREE, _WITHIN, _GAINED = 6, 1e-9, 0.2
# what may be rounding, by how much more at every try, and at most
_ROUNDING, _MORE, _MOST_ROUNDING = 1e-8, 4.0, 1e-6
# parts of a piece at which Chebyshev's polynomial has its rows, and where it is off the most between two
_PLACES = 0.5 - 0.5 * np.cos(np.pi * np.arange(_DEGREE + 1) / _DEGREE)
_CHECK = 0.5 - 0.5 * np.cos(np.pi * 2.5 / _DEGREE)
# arclength to which the end of a step is known, in so many iterations
_PLACED, _MOST = 1e-11, 8
# how often a step is halved between its rows; a curve goes on by a shorter step; all steps are halved
_HALVED, _TRIES, _AGAIN = 3, 40, 4
# rate of the control, in arclength, below which a turn in the parameter is one in the control too
_CUSP = 1e-4


@dataclass(frozen=True)
class _Row(Generic[State]):
    """A point, or a mark of a kind, of a curve, by its arclength from the start."""

    place: float
    state: Neutral[State]
    kind: str = ""


class _Half(Generic[State]):
    """A curve in one direction from its start, with polynomials between rows."""

    def __init__(self, problem: NeutralStates[State], first: Point[Neutral[State]], steps: Steps) -> None:
        self._problem, self._steps, self._length = problem, steps, 0.0
        # a rad of the parameter and of the control, or what counts as much
        weights = np.array([problem.parameter_weight, problem.weight[-1]])
        self._units = np.sqrt(PARAMETER_WEIGHT / weights)
        self.first, self.rows = first, [_Row(0.0, first.state)]
        self.marks: list[_Row[State]] = []
        self.error, self.ended, self._rounding = 0.0, "", _ROUNDING

    def follow(self, span: tuple[float, float], reach: tuple[float, float]) -> None:
        """Go on until the parameter leaves its span, the control its reach, or the curve closes.

        Raises
        ------
        SolverError
            From `trace`.
        NotConverged
            If no rows were found inside of a step; if the curve closes, but not at its first point.
        """
        point, steps, tries = self.first, self._steps, _TRIES
        while True:
            for segment in trace(self._problem, point, span, steps):
                rows, marks, length = len(self.rows), len(self.marks), self._length
                try:
                    self._add(segment)
                except NotConverged:
                    # go on from here by a shorter step
                    del self.rows[rows:], self.marks[marks:]
                    self._length, tries = length, tries - 1
                    if not tries:
                        raise
                    steps = replace(self._steps, first=0.5 * segment.end.step)
                    # (what a shorter step makes no less is rounding)
                    self._rounding = min(_MORE * self._rounding, _MOST_ROUNDING)
                    break
                self._rounding = _ROUNDING
                point, self.ended = segment.end, segment.last
                if not reach[0] <= segment.end.state.control <= reach[1]:
                    self.ended = "reach"
                    return
            else:
                if self.ended == "closed" and tries < _TRIES:
                    raise NotConverged
                return

    def _add(self, segment: Segment[Neutral[State]]) -> None:
        for event in segment.events:
            if event.kind != "fold":
                continue
            rate = event.point.direction[-1] * float(self._problem.weight[-1]) ** 0.5
            kind = "cusp" if abs(rate) < _CUSP else "turn"
            self.marks.append(_Row(self._length + event.point.step, event.point.state, kind))
        # (the arclength of a point at a given parameter is known to second order)
        end = self._at_value(segment) if segment.last else segment.end.step
        self._piece(segment.start, 0.0, end, _HALVED)
        self._length += end

    def _at(self, base: Point[Neutral[State]], place: float) -> Point[Neutral[State]]:
        """The point at an arclength from another.

        Where frames turn the arclength is that of the increments: smooth along points with one guess.
        """
        return correct(self._problem, base, place, self._steps) if place else base

    def _at_value(self, segment: Segment[Neutral[State]]) -> float:
        """The arclength at which the parameter is that at the end of a segment, by Newton."""
        base, place = segment.start, segment.end.step
        for _ in range(_MOST):
            point = self._at(base, place)
            ahead = (segment.end.parameter - point.parameter) / point.rate
            # (of the curve itself; less of it is along the tangent at the start)
            cosine = float(self._problem.weight @ (base.direction * point.direction))
            place += ahead * (cosine + self._problem.parameter_weight * base.rate * point.rate)
            if abs(ahead) < _PLACED:
                break
        return place

    def _piece(
        self, base: Point[Neutral[State]], low: float, high: float, halve: int, before: float = np.inf
    ) -> None:
        """Rows at Chebyshev's places of a part of a step, or of its halves if the polynomial is off."""
        places = low + (high - low) * _PLACES
        states = [self._at(base, float(place)).state for place in places]
        values = np.array([(state.value, state.control) for state in states])
        check = low + (high - low) * _CHECK
        point = self._at(base, check)
        there = point.state.value, point.state.control
        off = [
            float(Chebyshev.fit(places, column, _DEGREE)(check)) - exact
            for column, exact in zip(values.T, there, strict=True)
        ]
        # across the curve: in the arclength there is rounding, which moves points along it
        x, y = np.array(off) / self._units
        along, up = np.array([point.rate, point.direction[-1]]) / self._units
        error = float(abs(x * up - y * along) / np.hypot(along, up))
        # of half the length it is 2^-7 as much, but for rounding
        if error > _WITHIN and halve and (error < _GAINED * before or error > self._rounding):
            middle = 0.5 * (low + high)
            self._piece(base, low, middle, halve - 1, error)
            self._piece(base, middle, high, halve - 1, error)
            return
        if error > self._rounding:
            raise NotConverged
        self.error = max(self.error, error)
        self.rows += [_Row(self._length + float(p), s) for p, s in zip(places[1:], states[1:], strict=True)]


def fold_curve_of(
    problem: Rigged[State],
    events: Sequence[Event[State]],
    which: int,
    scene: Scene,
    parameter: SecondParameter,
    steps: Steps,
    **of: Any,
) -> FoldCurve:
    """The curve in a second parameter through one of the folds of a scene.

    Parameters
    ----------
    problem: the equilibrium equations in the scene's control.
    events: the scene's, of which the folds count.
    of: model and options of the result.

    Raises
    ------
    OptionError
        If there is no such fold.
    SolverError
        From the continuation.
    """
    folds = [event for event in events if event.kind == "fold"]
    event = _chosen(folds, which, "folds")
    curve, marks = _followed(NeutralStates(problem, scene, parameter, False), event, steps, of)
    return FoldCurve(**curve, cusps=tuple(mark for mark in marks if mark.kind == "cusp"))


def pitchfork_curve_of(
    problem: Rigged[State],
    events: Sequence[Event[State]],
    which: int,
    scene: Scene,
    parameter: SecondParameter,
    steps: Steps,
    **of: Any,
) -> PitchforkCurve:
    """The curve through one of the events that are no folds; as `fold_curve_of`.

    Raises
    ------
    OptionError
        If the parameter or the drive unfolds the pitchfork, too.
    """
    event = _chosen([event for event in events if event.kind != "fold"], which, "pitchforks")
    neutral = NeutralStates(problem, scene, parameter, True)
    start, _ = equilibrium(neutral, neutral.start(event), parameter.own, tolerance=steps.tolerance)
    neutral.require_symmetry(start)
    return PitchforkCurve(**_followed(neutral, event, steps, of)[0])


def _chosen(events: Sequence[Event[State]], which: int, what: str) -> Event[State]:
    if which >= len(events):
        allowed = f"from 0 to {len(events) - 1}" if events else "none"
        refuse("which", which, f"the scene has {len(events)} {what}, so that there is {allowed}")
    return events[which]


def _half(
    problem: NeutralStates[State], start: Neutral[State], steps: Steps, sign: float, whole: bool = False
) -> _Half[State]:
    """The curve from a state on, towards one end of the span; by shorter steps where rows are not found.

    Of a curve that is `whole` already the start alone, as where it is that end of the span.
    """
    over, scene = problem.over, problem.scene
    reach = -scene.reach_towards(-1.0), scene.reach_towards(1.0)
    first = first_point(problem, start, over.own, sign, tolerance=steps.tolerance)
    failed = ""
    for _ in range(_AGAIN):
        half = _Half(problem, first, steps)
        try:
            if over.own == over.span[sign > 0.0]:
                half.ended = "span"
            elif not whole:
                half.follow(over.span, reach)
            return half
        except NotConverged:
            halves = {name: 0.5 * getattr(steps, name) for name in ("first", "largest", "turn")}
            steps = replace(steps, **halves)
        except SolverError as error:
            failed = f": {error}"
            break
    last = half.rows[-1].state
    raise SolverError(
        f"the curve was followed to {over.name} = {last.value:.9g}, control = {last.control:.9g}; a span "
        f"that ends before may do{failed}"
    )


def _followed(
    problem: NeutralStates[State], event: Event[State], steps: Steps, of: Mapping[str, Any]
) -> tuple[dict[str, Any], list[CurvePoint]]:
    """The fields of a curve through an event, both ways, and the points where it turns back."""
    scene, over, start = problem.scene, problem.over, problem.start(event)
    # A tolerance that tells the index of a thin ribbon is below the rounding of g, which tells none.  At a
    # fold the control is stationary; at a pitchfork it is off as the state is.
    least = Steps.tolerance if event.kind == "fold" else 0.1 * Steps.tolerance
    steps = replace(steps, tolerance=max(steps.tolerance, least))
    back = _half(problem, start, steps, -1.0)
    ahead = _half(problem, start, steps, 1.0, back.ended == "closed")
    rows = [_Row(-row.place, row.state) for row in back.rows[:0:-1]] + ahead.rows
    seen = np.array([problem.observe(row.state, row.state.value) for row in rows])
    marks = []
    for mark in back.marks[::-1] + ahead.marks:
        height, _, load = problem.observe(mark.state, mark.state.value)
        where = float(mark.state.control), float(mark.state.value), float(height), float(load)
        marks.append(CurvePoint(mark.kind, *where, over=over.name, scene=scene, model=str(of["model"])))
    curve = {
        "control": np.array([row.state.control for row in rows]),
        "parameter": np.array([row.state.value for row in rows]),
        "height": seen[:, 0],
        "load": seen[:, 2],
        "stable": np.array([problem.unstable(row.state, row.state.value) == 0 for row in rows]),
        "over": over.name,
        "turns": tuple(mark for mark in marks if mark.kind == "turn"),
        "ends": ("closed", "closed") if back.ended == "closed" else (back.ended, ahead.ended),
        "arclength": np.array([row.place for row in rows]),
        "degree": _DEGREE,
        "error": max(back.error, ahead.error),
        "scene": scene,
        **of,
    }
    return curve, marks
