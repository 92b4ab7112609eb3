"""Stability of a planar rod out of its plane: the Hessian over y and the angles theta.

In a planar state the Hessian does not couple them with x and z.  Ordered along the rod both
halves are bands of half the width.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ribbonfem.continuation import Linearisation
from ribbonfem.continuation.out_of_plane import before_stop, leaving, of_start
from ribbonfem.linalg.banded import Arrow
from ribbonfem.results import Array, SolverError
from ribbonfem.scene import Scene

from . import kernels
from .problem import Statics
from .rod import Rod, RodState
from .states import start_state


class InPlane:
    """The equilibrium equations over x and z alone, and the index over y and theta.

    A `ribbonfem.continuation.Problem`.
    """

    def __init__(self, statics: Statics) -> None:
        self.statics = statics
        self.parameter_weight = statics.parameter_weight
        free = np.arange(4 * statics.rod.nodes)[statics.rod.free]
        self._inside, self._across = free[free % 2 == 0], free[free % 2 == 1]
        self._placed = np.flatnonzero(free % 2 == 0)
        self.weight = statics.weight[self._placed]

    def _band(self, hessian: Array, rows: Array) -> Array:
        band = hessian[rows[:, None], 2 * np.arange(kernels.WIDTH // 2 + 1)]
        for d in range(1, band.shape[1]):
            band[len(band) - d :, d] = 0.0
        return np.ascontiguousarray(band)

    def linearise(self, state: RodState, parameter: float) -> Linearisation:
        """Residual, its derivative in the parameter, and the factorised tangent, in the plane."""
        gradient, hessian, slope = self.statics.derivatives(state, parameter)
        arrow = Arrow(self._band(hessian, self._inside))
        return Linearisation(gradient[self._inside], slope[self._inside], arrow.solve, arrow.negative)

    def across(self, state: RodState) -> int:
        """Number of unstable directions out of the plane."""
        return Arrow(self._band(self.statics.assemble(state)[2], self._across)).negative

    def advance(self, state: RodState, increment: Array, parameter: float) -> RodState:
        """Move x and z by `increment` and the clamp to `parameter`."""
        whole = np.zeros(len(self.statics.weight))
        whole[self._placed] = increment
        return self.statics.advance(state, whole, parameter)

    def observe(self, state: RodState, parameter: float) -> tuple[float, float, float]:
        """As `Statics.observe`."""
        return self.statics.observe(state, parameter)

    def energy(self, state: RodState) -> float:
        """As `Statics.energy`."""
        return self.statics.energy(state)

    def positions(self, state: RodState, parameter: float) -> Array:
        """As `Statics.positions`."""
        return self.statics.positions(state, parameter)


@lru_cache(maxsize=1024)
def _leaving(scene: Scene, nodes: int, clamp: str) -> float:
    rod = Rod(scene, nodes, clamp)
    problem = InPlane(Statics(rod))
    result = leaving(problem, start_state(rod), scene, problem.across)
    return float("nan") if result is None else float(result.parameter)


def leaves_plane(scene: Scene, nodes: int, clamp: str) -> float:
    """As `der.leaves_plane`; NaN also where the states at rest could not be followed."""
    image = of_start(scene)
    try:
        return before_stop(_leaving(image, nodes, clamp), scene, image)
    except SolverError:
        return float("nan")
