"""Predictors: initial guesses of a stage by a polynomial through the last stages solved."""

from __future__ import annotations

from ribbonfem.jit.decorator import compiled
from ribbonfem.jit.groups import OPTIONS
from ribbonfem.results import Array

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
