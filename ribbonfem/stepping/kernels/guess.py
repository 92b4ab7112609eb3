"""Initial guesses of a stage by a polynomial through the last ones solved; what a step keeps and forgets."""

from __future__ import annotations

from typing import Any

from ribbonfem.jit.decorator import compiled
from ribbonfem.jit.groups import OPTIONS
from ribbonfem.results import Array

from .newton import CLOCK_SIZE as COMMON

# places in the clock behind those of Newton: stages remembered, and how many when the step began
POINTS, KNOWN = range(COMMON, COMMON + 2)
CLOCK_SIZE = COMMON + 2
# stages that are kept, and how many of them a guess is made of
MEMORY, GUESS = 16, 3


@compiled(**OPTIONS)
def put_weights(times: Array, known: int, time: float, weights: Array) -> None:
    """Weights at a time of the polynomial through the last of `known` stages, the newest first.

    Stage k lies at k % MEMORY in times; those there are not yet count for nothing.
    """
    count = min(GUESS, known)
    for j in range(GUESS):
        weight = 1.0 if j < count else 0.0
        tj = times[(known - 1 - j) % MEMORY]
        for i in range(count if j < count else 0):
            if i != j:
                ti = times[(known - 1 - i) % MEMORY]
                weight *= (time - ti) / (tj - ti)
        weights[j] = weight


@compiled(**OPTIONS)
def next_slot(times: Array, clock: Array, time: float) -> int:
    """Where a stage of this time is to be kept."""
    slot = int(clock[POINTS]) % MEMORY
    clock[POINTS] += 1.0
    times[slot] = time
    return slot


@compiled(**OPTIONS)
def reject(model: Any, clock: Array) -> None:
    """Forget the stages of a step (`ModelFunctions.reject`)."""
    clock[POINTS] = clock[KNOWN]


@compiled(**OPTIONS)
def rescale(model: Any, ratio: float) -> None:
    """The auxiliary acceleration for a step so much longer (`ModelFunctions.rescale`)."""
    a, auxiliary = model.motion.a, model.motion.auxiliary
    for k in range(a.size):
        auxiliary.flat[k] = a.flat[k] + ratio * (auxiliary.flat[k] - a.flat[k])
