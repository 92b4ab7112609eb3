"""The initial state of a motion that leaves a fold: on the unstable solution of the fold's normal form."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Generic

import numpy as np

from ribbonfem.continuation import Event, State, Steps
from ribbonfem.continuation.corrector import bordered_solve
from ribbonfem.continuation.curves import ramp_folds
from ribbonfem.continuation.vibration import InertialProblem
from ribbonfem.options import refuse, whole_number, within
from ribbonfem.results import Array, SolverError
from ribbonfem.scene import Scene

from .cubic import escape_time
from .normal_forms import NormalForm, normal_form

_NEWTON, _TOLERANCE = 30, 1e-10
# L; a normal form holds no farther
_FARTHEST = 0.05
# below it what leaves the fold is lost in the residual of the equilibrium
_NEAREST = 1e-5
# where an escape ends
ESCAPE_UNTIL = ("end", "snap", "normal form")


@dataclass(frozen=True)
class Departure(Generic[State]):
    """A state beyond a fold, at the fold's angle, and how it moves.

    Attributes
    ----------
    form: the normal form of the fold.
    state: displaced along the null vector, all other modes in equilibrium.
    velocity: rates of the unknowns (n,), per t*.
    time: s, until the normal form leaves to infinity from here (see `cubic.Escape`).
    """

    form: NormalForm
    state: State
    velocity: Array
    time: float


def departure(
    problem: InertialProblem[State], fold: Event[State], amplitude: float, damping: float
) -> Departure[State]:
    """The state at an amplitude A (L) of a fold's null vector, on its unstable solution.

    The push is a force along M N, against which the body is in equilibrium; its size says what A
    is, a2 A^2 + a3 A^3, whatever the unknowns are.

    Raises
    ------
    SolverError
        If no such state is found.
    """
    form = normal_form(problem, fold)
    point, unit = fold.point, problem.unit
    null = fold.null / math.sqrt(float(fold.null @ problem.momentum(point.state, fold.null)))
    push = problem.momentum(point.state, null)
    a2 = form.quadratic * unit**2
    y = abs(a2) * amplitude
    gamma = form.cubic / unit**2
    wanted = math.copysign(y * y * (1.0 + gamma * y) / abs(a2), a2)
    state = problem.advance(point.state, math.copysign(amplitude, a2) * null, point.parameter)
    force = 0.0
    for _ in range(_NEWTON):
        line = replace(problem.linearise(state, point.parameter), slope=-push)
        # J dx - d mu push = -F + mu push at a given size of the force along the way of the state
        step, change = bordered_solve(line, push, 0.0, force * push - line.residual, 0.0)
        along, stiffness = bordered_solve(line, push, 0.0, np.zeros_like(push), 1.0)
        speed = math.sqrt(float(along @ problem.momentum(state, along)))
        # the force on A falls short of the one wanted: along the way it changes by `stiffness` a unit
        missing = wanted + (force + change) / speed
        more = -missing * speed / stiffness
        step = step + more * along
        force += change + more * stiffness
        state = problem.advance(state, step, point.parameter)
        if math.sqrt(float(problem.weight @ step**2)) < _TOLERANCE:
            break
    else:
        raise SolverError(
            f"amplitude = {amplitude:g}: no state so far beyond the fold at {point.parameter:.6g} was found"
        )
    escape = escape_time(y / unit**2, damping, form.cubic)
    rate = math.copysign(escape.speed * unit**3 / abs(a2), a2)
    return Departure(form, state, rate / speed * along, escape.time)


def scene_departure(
    problem: InertialProblem[State],
    start: State,
    scene: Scene,
    fold: int,
    amplitude: float,
    steps: Steps | None = None,
    until: str = "end",
) -> tuple[Departure[State], float]:
    """How the scene's motion leaves one of the folds that its ramp meets, counted from 0; and for how long.

    The second is the s that a motion needs to have left whatever the model, half as long again as
    the normal form and more; of "normal form" what that itself takes.

    Raises
    ------
    OptionError
        If there are not so many folds, or the amplitude is not in [1e-5, 0.05].
    SolverError
        As in `ramp_folds` and `departure`.
    """
    number, reach = whole_number("fold", fold, 0), within("amplitude", amplitude, _NEAREST, _FARTHEST)
    events = ramp_folds(problem, start, replace(scene, stop=None), steps)
    if number >= len(events):
        refuse("fold", fold, f"the ramp meets {len(events)} folds, counted from 0")
    result = departure(problem, events[number], reach, scene.damping)
    whole = 1.5 * result.time + 2.0 * scene.ribbon.inertial_time
    return result, result.time if until == "normal form" else whole
