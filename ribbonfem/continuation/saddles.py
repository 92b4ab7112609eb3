"""Saddles on the curve through a start state: states of one unstable direction, the passes between others."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ribbonfem.results import SolverError
from ribbonfem.scene import Scene

from .corrector import Point, Problem, State, Steps, first_point
from .curves import as_far
from .tracing import at_parameter, trace


def saddle_beyond_fold(
    problem: Problem[State], state: State, angle: float, steps: Steps | None
) -> Point[State]:
    """The saddle between U+S- and U- at an angle, on the curve through U+S- beyond its first fold.

    Raises
    ------
    SolverError
        If there is none at the angle.
    """
    fold = None
    for segment in trace(problem, first_point(problem, state, 0.0, 1.0), (-2.0 * np.pi, 2.0 * np.pi), steps):
        near, step = segment.start, 0.0
        if fold is None:
            fold = next((event.point for event in segment.events if event.kind == "fold"), None)
            if fold is None:
                continue
            # (where the fold lies inside this segment, the angle may also be met before it)
            near, step = fold, fold.step
        if fold.parameter < angle:
            break
        if (near.parameter - angle) * (segment.end.parameter - angle) <= 0.0:
            result = at_parameter(problem, segment, angle, steps, step)
            if result.index == 1:
                return result
            break
    where = "it has no fold" if fold is None else f"its fold is at {fold.parameter:.6g}"
    raise SolverError(f"no saddle between U+S- and U- at angle = {angle:.6g}: {where}")


def lowest_saddle(
    problem: Problem[State],
    state: State,
    energy: Callable[[State], float],
    scene: Scene,
    control: float,
    steps: Steps | None,
) -> float:
    """Lowest energy of the saddles at a control, on the curve through the start; -inf if there is none."""
    span = (-3.0, 3.0) if scene.clamps_turn else (-scene.reach_towards(-1.0), scene.reach_towards(1.0))
    energies = []
    for sign in (-1.0, 1.0):
        first = first_point(problem, state, scene.begin, sign)
        for segment in as_far(problem, first, span, scene, steps):
            ends = segment.start.parameter - control, segment.end.parameter - control
            if ends[0] * ends[1] < 0.0 and segment.start.index == segment.end.index == 1:
                energies.append(energy(at_parameter(problem, segment, control, steps).state))
    return min(energies, default=-np.inf)
