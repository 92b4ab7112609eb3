"""Where a planar state at rest leaves its plane, for any model that can tell its index out of the plane.

A planar run stays in the plane to the last bit, stable or not: the forces out of it are zero and
stay so.  Whether the ribbon would is for the second variation to say, of the states at rest.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

from ribbonfem.results import SolverError
from ribbonfem.scene import Scene, Schedule

from .between import Between
from .corrector import NotConverged, Point, Problem, State, Steps, first_point, inside
from .curves import stays_stable
from .tracing import Segment, trace

# the index is looked at once a step
_STEPS = Steps(largest=0.1)
# rad; beyond it rest states are followed in stretches of this length
_STRETCH = 0.5 * math.pi


def of_start(scene: Scene) -> Scene:
    """The scene, or its mirror image, from U+, with nothing but what its states at rest depend on.

    The stop of a clamp that turns is the end of a quarter turn, so that scenes share what is found.
    """
    image = scene if scene.start == "U+" else scene.mirror
    sign, far = image.direction, image.furthest
    if image.begin:
        end = sign * image.reach_towards(sign) if far is None else far
        return replace(image, damping=0.0, schedule=Schedule((0.0, 1.0), (image.begin, end), "linear"))
    reach = image.reach_towards(sign)
    if image.clamps_turn:
        far = 4.0 * _STRETCH if far is None else abs(far)
        reach = min(math.ceil(far / _STRETCH), 64) * _STRETCH
    elif far is not None:
        reach = abs(far)
    return replace(image.at_rest, rate=sign, stop=sign * reach)


def leaving(
    problem: Problem[State], state: State, scene: Scene, index: Callable[[State], int]
) -> Point[State] | None:
    """Where states lose their stability out of the plane.

    Followed from the control's start in the direction of the scene's rate, to its `stop` or to where the
    planar state itself ends or loses its stability in the plane.

    Parameters
    ----------
    problem: the planar equilibrium equations.
    state: the equilibrium at the control's start.
    index: number of unstable directions out of the plane.

    Returns
    -------
    None where they do not.

    Raises
    ------
    SolverError
        From the continuation.
    """
    sign, far = scene.direction, scene.furthest
    end = sign * scene.reach_towards(sign) if far is None else far
    return _leaving(problem, state, scene.begin, scene, index, end)


def _leaving(
    problem: Problem[State],
    state: State,
    begin: float,
    scene: Scene,
    index: Callable[[State], int],
    end: float,
) -> Point[State] | None:
    """`leaving` from a state at `begin` on, as far as `end`."""
    sign = scene.direction
    first = first_point(problem, state, begin, sign)
    # of one stiffness the start turns freely: its eigenvalue is rounding
    if scene.ribbon.one_stiffness or index(first.state):
        return first
    span = (end, math.inf) if sign < 0.0 else (-math.inf, end)
    for segment in trace(problem, first, span, _STEPS):
        last = segment.events[0].point if segment.events else segment.end
        if index(last.state):
            return _first(problem, segment, last, index)
        if segment.events:
            onward = stays_stable(problem, segment, segment.events[0], sign * min(0.01, abs(end - begin)))
            return None if onward is None else _leaving(problem, *onward, scene, index, end)
    return None


def _first(
    problem: Problem[State], segment: Segment[State], end: Point[State], index: Callable[[State], int]
) -> Point[State]:
    """The point inside of a segment at which the index is no longer 0, by bisection in the arclength."""
    base = inside(problem, segment.start, segment.end)
    points = Between(problem, base, segment.end, Steps(), fresh=False)
    low, high, result = 0.0, end.step, end
    for _ in range(36):
        middle = 0.5 * (low + high)
        try:
            point = points.at(middle)
        except NotConverged as error:
            raise SolverError(
                f"no state found between {base.parameter:.9g} and {end.parameter:.9g} rad"
            ) from error
        if index(point.state):
            high, result = middle, point
        else:
            low = middle
    return result


def before_stop(control: float, scene: Scene, image: Scene) -> float:
    """A control at which the image of `of_start` leaves the plane, for the scene; NaN beyond its stop."""
    own, far = control * (scene.direction * image.direction), scene.furthest
    return own if far is None or scene.direction * (own - far) < 0.0 else math.nan
