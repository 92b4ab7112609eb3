"""Where a planar state at rest leaves its plane, for any model that can tell its index out of the plane.

A planar run stays in the plane to the last bit, stable or not: the forces out of it are zero and
stay so.  Whether the ribbon would is for the second variation to say, of the states at rest.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

from ribbonfem.results import SolverError
from ribbonfem.scene import Scene

from .between import Between
from .corrector import NotConverged, Point, Problem, State, Steps, first_point, inside
from .tracing import Segment, trace

# the index is looked at once a step
_STEPS = Steps(largest=0.1)
# rad; beyond it rest states are followed in stretches of this length
_STRETCH = 0.5 * math.pi


def of_start(scene: Scene) -> Scene:
    """The scene, or its mirror image, from U+, with nothing but what its states at rest depend on.

    Its stop is the end of a quarter turn, so that scenes share what is found.
    """
    sign = scene.direction * (1.0 if scene.start == "U+" else -1.0)
    far = 4.0 * _STRETCH if scene.furthest is None else abs(scene.furthest)
    stop = min(math.ceil(far / _STRETCH), 64) * _STRETCH
    return replace(scene.at_rest, start="U+", rate=sign, stop=sign * stop)


def leaving(problem: Problem[State], state: State, scene: Scene, index: Callable[[State], int]) -> float:
    """The magnitude of the angle (rad) at which states lose their stability out of the plane.

    Followed from alpha = 0 in the direction of the scene's rate, to its `stop` or to where the
    planar state itself ends or loses its stability in the plane.

    Parameters
    ----------
    problem: the planar equilibrium equations.
    state: the equilibrium at 0.
    scene: as from `of_start`.
    index: number of unstable directions out of the plane.

    Returns
    -------
    NaN where it does not.

    Raises
    ------
    SolverError
        From the continuation.
    """
    limit = abs(scene.require_stop())
    first = first_point(problem, state, 0.0, scene.rate)
    # of one stiffness the start turns freely: its eigenvalue is rounding
    if scene.ribbon.one_stiffness or index(first.state):
        return 0.0
    for segment in trace(problem, first, (-limit, limit), _STEPS):
        end = segment.events[0].point if segment.events else segment.end
        if index(end.state):
            return abs(_first(problem, segment, end, index))
        if segment.events:
            break
    return math.nan


def _first(
    problem: Problem[State], segment: Segment[State], end: Point[State], index: Callable[[State], int]
) -> float:
    """The parameter inside of a segment at which the index is no longer 0, by bisection in the arclength."""
    base = inside(problem, segment.start, segment.end)
    points = Between(problem, base, segment.end, Steps(), fresh=False)
    low, high, parameter = 0.0, end.step, float(end.parameter)
    for _ in range(36):
        middle = 0.5 * (low + high)
        try:
            point = points.at(middle)
        except NotConverged as error:
            raise SolverError(
                f"no state found between {base.parameter:.9g} and {end.parameter:.9g} rad"
            ) from error
        if index(point.state):
            high, parameter = middle, float(point.parameter)
        else:
            low = middle
    return parameter


def before_stop(angle: float, scene: Scene) -> float:
    """An angle of `leaving` with the sign of the scene's ramp; NaN if that stops before."""
    stop = math.inf if scene.furthest is None else abs(scene.furthest)
    return math.copysign(angle, scene.direction) if angle < stop else math.nan
