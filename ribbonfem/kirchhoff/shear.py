"""States at alpha = 0 as functions of the shear: their pitchforks and their curves (paper, appendix B)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ribbonfem.continuation import Event, Point, first_point, trace
from ribbonfem.results import Array, Value
from ribbonfem.scene import Scene

from . import states
from .problem import Frames, Statics
from .symmetric import Symmetric


@dataclass(frozen=True)
class Pitchforks:
    """Shears dW/L at which states of a ribbon fork at alpha = 0; None where there is no such point.

    Attributes
    ----------
    broken: the unbroken U loses its stability to the four US.
    merged: U+S+ and U-S- merge into S+, U+S- and U-S+ into S-: z(1/2) = 0 from there on.
    restored: the unbroken U is stable again, beside S.
    """

    broken: float | None
    merged: float | None
    restored: float | None


@dataclass(frozen=True, repr=False, eq=False)
class ShearCurve(Value):
    """One family of states at alpha = 0 against the shear, one row a point, in the order of the curve.

    Attributes
    ----------
    family: "U" (U+), "US" (one of U+S+, U+S-) or "S" (one of S+, S-); the others are mirror images.
    shear: (rows,) dW/L.
    height, slope: (rows,) z(1/2)/L and the z-component of the tangent there.
    energy: (rows,) elastic, in EI2/L.
    stable: (rows,) bool.
    """

    family: str
    shear: Array
    height: Array
    slope: Array
    energy: Array
    stable: NDArray[np.bool_]

    def __repr__(self) -> str:
        span = f"shear {self.shear.min():.4g} .. {self.shear.max():.4g}" if len(self.shear) else "empty"
        return (
            f"ShearCurve({self.family!r}, {len(self.shear)} points, {span}, "
            f"{int(np.count_nonzero(self.stable))} stable)"
        )


def pitchforks(scene: Scene, *, elements: int, extensible: bool) -> Pitchforks:
    """The shears at which states of the scene's ribbon and compression fork at alpha = 0."""
    problem = states.in_shear(scene, elements, extensible)
    limit = states.most_shear(scene.compression)
    steps = states.shear_steps(problem)
    broken = merged = restored = None
    for segment in states.unbroken(Symmetric(problem, "U"), limit, steps):
        for event in segment.events:
            if segment.end.index > segment.start.index and broken is None:
                broken = event
            elif broken is not None and segment.end.index == 0 and segment.start.index == 1:
                restored = event.point
        if restored is not None:
            break
    fork = None if broken is None else states.fork_of(problem, broken, limit, steps)
    if fork is not None and fork[1] is not None:
        lower = _unmerging(problem, states.merged(problem, fork[1], limit))
        merged = lower[-1] if lower else None
    points = (None if broken is None else broken.point, merged, restored)
    return Pitchforks(*(None if point is None else abs(float(point.parameter)) for point in points))


def _unmerging(problem: Statics, start: Point[Frames]) -> list[Point[Frames]]:
    """The states S from `start` to where they lose their stability as the shear falls; or none.

    On the side of S the eigenvalue passes through 0 with a slope, on that of US it does not.
    """
    points: list[Point[Frames]] = []
    even = Symmetric(problem, "S")
    first = first_point(even, start.state, start.parameter, -1.0)
    compression = problem.compression
    for segment in trace(even, first, (0.0, states.most_shear(compression)), states.shear_steps(problem), 8):
        if segment.events:
            return [*points, segment.events[0].point]
        points.append(segment.end)
    return []


def shear_curves(scene: Scene, *, elements: int, extensible: bool) -> tuple[ShearCurve, ...]:
    """U+, U+S and S of the scene's ribbon and compression against the shear, from 0 to its limit."""
    problem = states.in_shear(scene, elements, extensible)
    limit = states.most_shear(scene.compression)
    steps = states.shear_steps(problem)
    u: list[Point[Frames]] = []
    event: Event[Frames] | None = None
    for segment in states.unbroken(Symmetric(problem, "U"), limit, steps):
        u += [segment.end] if u else [segment.start, segment.end]
        if event is None and segment.events and segment.end.index > segment.start.index:
            event = segment.events[0]
    curves = [_curve("U", problem, u)]
    if event is None:
        return tuple(curves)
    us = [event.point]
    tip = None
    for segment in states.forked(problem, event, limit, steps):
        tip = states.tip_of(problem, segment)
        us.append(segment.end if tip is None else tip)
    # at its two ends, the tips, a US state is neutral; it is stable up to them
    curves.append(_curve("US", problem, us))
    if tip is not None:
        first = states.merged(problem, tip, limit)
        even = Symmetric(problem, "S")
        up = first_point(even, first.state, first.parameter, 1.0)
        above = [s.end for s in trace(even, up, (0.0, limit), steps, 8)]
        curves.append(_curve("S", problem, [*_unmerging(problem, first)[::-1], first, *above]))
    return tuple(curves)


def _curve(family: str, problem: Statics, points: list[Point[Frames]]) -> ShearCurve:
    rows = np.array([problem.observe(point.state, point.parameter) for point in points])
    return ShearCurve(
        family=family,
        shear=np.array([point.parameter for point in points]),
        height=rows[:, 0],
        slope=rows[:, 1],
        energy=np.array([problem.energy(point.state) for point in points]),
        stable=np.array([point.index == 0 for point in points]),
    )
