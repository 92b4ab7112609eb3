"""The state at rest in which a motion begins that does not begin at its scene's start."""

from __future__ import annotations

import numpy as np

from ribbonfem.results import History, RestState, SolverError
from ribbonfem.scene import Scene

from .corrector import Problem, State, equilibrium

# L; nearer than the first a state is at rest, and than the second a motion is about the state that it follows
_AT_REST, _ABOUT = 1e-5, 0.05


def followed(
    problem: Problem[State], guess: State, scene: Scene, initial: RestState | History
) -> State | None:
    """The stable equilibrium in which a motion begins that does not at the scene's `start`; None if in none.

    A state at rest is in one if it is one, under the new loads; a motion that is gone on from if it is about
    one.  One that began in none itself (a state that was let go) has to have snapped or come to rest.

    Parameters
    ----------
    problem: the equilibrium equations in the scene's control.
    guess: the configuration that the motion begins with.
    """
    try:
        state, line = equilibrium(problem, guess, scene.begin)
    except SolverError:
        return None
    off = problem.positions(state, scene.begin) - problem.positions(guess, scene.begin)
    moves = isinstance(initial, History) and (initial.rest != {} or initial.crossing() is not None)
    near = float(np.abs(off).max()) < (_ABOUT if moves else _AT_REST)
    return state if near and line.index == 0 else None
