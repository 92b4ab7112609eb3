"""Where a planar state of the rod leaves its plane: the first branch point of its curve across the plane."""

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
    """The magnitude of the angle; NaN where a fold, a fork within the plane or the stop comes first."""
    problem, start = states.named(scene, elements=elements, extensible=extensible)
    limit = abs(scene.require_stop())
    for segment in trace(problem, first_point(problem, start, 0.0, scene.rate), (-limit, limit)):
        for event in segment.events:
            # turns about y are in the plane, those about x and z, and a force along y, across it
            turns = event.null[:-3].reshape(-1, 4)
            inside, across = (turns[:, 2] ** 2).sum(), (turns[:, 1::2] ** 2).sum()
            fork = event.kind != "fold" and across > inside
            return abs(float(event.point.parameter)) if fork else math.nan
    return math.nan


def leaves_plane(scene: Scene, elements: int, extensible: bool) -> float:
    """As `kirchhoff.leaves_plane`; NaN also where the states at rest could not be followed."""
    try:
        return before_stop(_leaving(of_start(scene), elements, extensible), scene)
    except SolverError:
        return math.nan
