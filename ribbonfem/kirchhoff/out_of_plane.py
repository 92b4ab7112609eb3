"""Where a planar state of the ribbon loses its stability out of the plane: a branch point of its curve."""

from __future__ import annotations

import math
from functools import lru_cache

from ribbonfem.continuation import first_point, trace
from ribbonfem.continuation.curves import stays_stable
from ribbonfem.continuation.out_of_plane import before_stop, of_start
from ribbonfem.results import SolverError
from ribbonfem.scene import Scene

from . import states
from .problem import Frames, Statics


@lru_cache(maxsize=1024)
def _leaving(scene: Scene, elements: int, extensible: bool) -> float:
    """The control; NaN where a fold, a fork within the plane or the stop comes first."""
    problem, start = states.named(scene, elements=elements, extensible=extensible)
    return _from(problem, start, scene.begin, scene)


def _from(problem: Statics, state: Frames, begin: float, scene: Scene) -> float:
    sign, end = scene.direction, scene.require_stop()
    span = (end, math.inf) if sign < 0.0 else (-math.inf, end)
    for segment in trace(problem, first_point(problem, state, begin, sign), span):
        for event in segment.events:
            if event.kind != "fold" and problem.crosses_plane(event.null):
                return float(event.point.parameter)
            onward = stays_stable(problem, segment, event, sign * min(0.01, abs(end - begin)))
            return math.nan if onward is None else _from(problem, *onward, scene)
    return math.nan


def leaves_plane(scene: Scene, elements: int, extensible: bool) -> float:
    """As `kirchhoff.leaves_plane`; NaN also where the states at rest could not be followed."""
    image = of_start(scene)
    try:
        return before_stop(_leaving(image, elements, extensible), scene, image)
    except SolverError:
        return math.nan
