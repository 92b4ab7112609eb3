"""Diagonally implicit Runge-Kutta methods with an explicit first stage, as data.

All are stiffly accurate (the last stage is the step), L-stable, and have one diagonal element,
so that one factorisation serves all stages.  Applied to M x'' = F(x, x', y), 0 = G(x, y) every
stage solves for positions, multipliers and what else is algebraic together.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ribbonfem.results import Array


@dataclass(frozen=True, eq=False)
class Tableau:
    """A method of `stages` stages, the first of them explicit.

    Attributes
    ----------
    name, order: of the method, in the step.
    a: (stages, stages) lower triangular, 0 in the first row; its last row is the weights of the step.
    error: (stages,) weights whose sum with the stages' rates, times the step, estimates the local
        error; of order `embedded` + 1 in the step.
    embedded: order of the method that the step is compared with.
    """

    name: str
    order: int
    a: Array
    error: Array
    embedded: int

    @property
    def stages(self) -> int:
        """Number of stages, the explicit one included."""
        return len(self.a)

    @property
    def c(self) -> Array:
        """(stages,) instants of the stages, in steps."""
        return np.asarray(self.a.sum(axis=1))


def implicit_euler() -> Tableau:
    """The backward Euler rule; its damping is its own, not the scene's."""
    return Tableau("implicit-euler", 1, np.array([[0.0, 0.0], [0.0, 1.0]]), np.array([-0.5, 0.5]), 1)


def tr_bdf2() -> Tableau:
    """Trapezoidal rule, then BDF2, with the embedded estimate of order 3 of M. E. Hosea & L. F. Shampine.

    Appl. Numer. Math. 20 (1996) 21.
    """
    d, w = 1.0 - 0.5 * np.sqrt(2.0), 0.25 * np.sqrt(2.0)
    a = np.array([[0.0, 0.0, 0.0], [d, d, 0.0], [w, w, d]])
    return Tableau("tr-bdf2", 2, a, np.array([4.0 * w - 1.0, -1.0, 2.0 * d]) / 3.0, 2)
