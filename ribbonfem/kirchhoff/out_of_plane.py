"""Where a planar state of the ribbon loses its stability out of the plane: a branch point of its curve."""

from __future__ import annotations

import math
from functools import lru_cache

from ribbonfem.continuation import first_point, trace
from ribbonfem.continuation.out_of_plane import before_stop, of_start
from ribbonfem.results import SolverError
from ribbonfem.scene import Scene

from . import states


@lru_cache(maxsize=1024)
def _leaving(scene: Scene, elements: int, extensible: bool) -> float:
    """The control; NaN where a fold, a fork within the plane or the stop comes first."""
    problem, start = states.named(scene, elements=elements, extensible=extensible)
    sign, end = scene.direction, scene.require_stop()
    span = (end, math.inf) if sign < 0.0 else (-math.inf, end)
    for segment in trace(problem, first_point(problem, start, scene.begin, sign), span):
        for event in segment.events:
            fork = event.kind != "fold" and problem.crosses_plane(event.null)
            return float(event.point.parameter) if fork else math.nan
    return math.nan


def leaves_plane(scene: Scene, elements: int, extensible: bool) -> float:
    """As `kirchhoff.leaves_plane`; NaN also where the states at rest could not be followed."""
    image = of_start(scene)
    try:
        return before_stop(_leaving(image, elements, extensible), scene, image)
    except SolverError:
        return math.nan
