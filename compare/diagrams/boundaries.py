"""Search for the value of one parameter at which the outcome changes, along many lines side by side.

Many lines are solved side by side, one step of each a round, so that a sweep has work for all its workers.
A change that is found is looked at from both sides: where runs near it do not keep to their side, there is a
band of mixed outcomes, and it is its ends that are told.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from operator import attrgetter

from .axes import Axis

# points of a line in the first look, its ends included; runs on either side of a change that is found
_LOOK, _BESIDE = 5, 4
# how far, in the coordinate, runs beside a change reach
_REACH = 0.15


@dataclass(frozen=True)
class Boundary:
    """Where the outcome changes along a line of rate or of damping.

    Attributes
    ----------
    along: the name of what varies; `other` is the value of the one that does not.
    value, uncertainty: where it changes on `mesh`, and how far it may be from there on that mesh.
    low, high: ends of the band in which both outcomes come, equal to each other where it is a point.
    below, above: outcomes on its two sides.
    mesh: nodes or elements of the runs.  Another mesh, and the limit of them (`threshold`), may
        be some percent away.
    """

    along: str
    other: float
    value: float
    uncertainty: float
    low: float
    high: float
    below: str
    above: str
    mesh: int

    doubt = property(attrgetter("uncertainty"), doc="The old name of `uncertainty`.")

    @property
    def band(self) -> bool:
        """Whether it is a band and not a point."""
        return self.high > self.low


@dataclass
class Line:
    """A line that is searched: what was run on it so far, by the coordinate of the value (`axes.Axis`).

    Attributes
    ----------
    ends: values between which to look.
    tolerance: of a change, in the coordinate's unit: relative, where that is a logarithm.
    known: outcome by coordinate.
    look: points of the first look.
    axis: that the values lie on; without one the coordinate is the logarithm.
    """

    ends: tuple[float, float]
    tolerance: float
    known: dict[float, str]
    look: int = _LOOK
    beside: bool = False
    axis: Axis | None = None

    def coordinate(self, value: float) -> float:
        """Of a value."""
        return math.log(value) if self.axis is None else float(self.axis.coordinate(value))

    def value(self, x: float) -> float:
        """At a coordinate."""
        return math.exp(x) if self.axis is None else float(self.axis.value(x))

    def points(self) -> list[float]:
        """What is to be run next, as coordinates; nothing once it is done."""
        low, high = (self.coordinate(end) for end in self.ends)
        grid = [low + (high - low) * k / (self.look - 1) for k in range(self.look)]
        missing = [x for x in grid if x not in self.known]
        if missing:
            return missing
        gaps = [(a, b) for a, b in self.brackets() if b - a > math.log1p(self.tolerance)]
        if gaps:
            return [0.5 * (a + b) for a, b in gaps]
        if self.beside:
            return []
        self.beside = True
        wanted = []
        for a, b in self.brackets():
            for k in range(1, _BESIDE + 1):
                share = _REACH * k / _BESIDE
                wanted += [x for x in (a - share, b + share) if low < x < high and x not in self.known]
        return wanted

    def brackets(self) -> list[tuple[float, float]]:
        """Neighbouring points whose outcomes differ."""
        done = sorted((x, name) for x, name in self.known.items() if name)
        return [(a, b) for (a, one), (b, two) in pairwise(done) if one != two]

    def changes(self) -> list[tuple[float, float, float, float, str, str]]:
        """Value, uncertainty, low, high, below, above of each change; changes close together are a band."""
        groups: list[list[tuple[float, float]]] = []
        for change in self.brackets():
            if groups and change[0] - groups[-1][-1][1] < 2.0 * _REACH:
                groups[-1].append(change)
            else:
                groups.append([change])
        changes = []
        for group in groups:
            low, high = group[0][0], group[-1][1]
            below, above = self.known[low], self.known[high]
            value = self.value(0.5 * (low + high))
            uncertainty = 0.5 * (self.value(high) - self.value(low))
            ends = (self.value(low), self.value(high)) if len(group) > 1 else (value, value)
            changes.append((value, uncertainty, *ends, below, above))
        return changes


def search(lines: Sequence[Line], run: Callable[[list[tuple[int, float]]], list[str]]) -> None:
    """Search all lines to their ends.

    Parameters
    ----------
    lines: get their `known` filled.
    run: outcomes at (number of the line, value), all of one round at once; "" of a run that failed.
    """
    while True:
        work = [(k, x) for k, line in enumerate(lines) for x in line.points()]
        if not work:
            if all(line.beside for line in lines):
                return
            continue
        outcomes = run([(k, lines[k].value(x)) for k, x in work])
        for (k, x), outcome in zip(work, outcomes, strict=True):
            lines[k].known[x] = outcome
