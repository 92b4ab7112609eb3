"""Equilibrium equations restricted to states with a symmetry of the clamps at alpha = 0.

Where such a state forks the tangent is singular, but only for increments that break the symmetry: without
these its curve is smooth, and its states are found at a fork as well as elsewhere.
"""

from __future__ import annotations

import numpy as np

from ribbonfem.continuation import Linearisation
from ribbonfem.results import Array

from .problem import Frames, Statics

# signs of the components of quaternions and of the force that go with s -> 1 - s
_SIGNS = {"U": ((1.0, -1.0, -1.0, 1.0), (1.0, 1.0, -1.0)), "S": ((1.0,) * 4, (1.0,) * 3)}


class Symmetric(Statics):
    """The equations of `problem` for the states of a family: "U" (reversed and mirrored) or "S" (reversed).

    The residual, its derivative in the parameter and what is solved for from them keep the symmetry;
    vectors that break it are solved for by themselves, and the index is that of the whole problem, so
    that forks are found.
    """

    def __init__(self, problem: Statics, family: str) -> None:
        vars(self).update(vars(problem))
        frames, force = _SIGNS[family]
        inner = len(self.tables.nodes) - 2
        self._signs = np.concatenate((np.tile(frames, inner), force))
        self._order = np.arange(4 * inner + 3)
        self._order[: 4 * inner] = self._order[: 4 * inner].reshape(inner, 4)[::-1].ravel()

    def even(self, vectors: Array) -> Array:
        """The part of vectors (4 m + 3, k) that keeps the symmetry."""
        return np.asarray(0.5 * (vectors + self._signs[:, None] * vectors[self._order]))

    def linearise(self, state: Frames, parameter: float) -> Linearisation:
        """Residual, its derivative in the parameter, and the factorised tangent."""
        line = super().linearise(state, parameter)
        columns = self.even(np.column_stack((line.residual, line.slope)))

        def solve(right: Array) -> Array:
            both = right.reshape(len(right), -1)
            even = self.even(both)
            one, other = np.split(line.solve(np.hstack((even, both - even))), 2, axis=1)
            return (self.even(one) + other - self.even(other)).reshape(right.shape)

        return Linearisation(columns[:, 0].copy(), columns[:, 1].copy(), solve, line.index)
