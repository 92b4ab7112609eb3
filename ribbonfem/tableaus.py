"""Runge-Kutta tableaux (diagonally implicit, explicit first stage) for finite elements and rods alike.

All are stiffly accurate (the last stage is the step), L-stable, and have one diagonal element,
so that one factorisation serves all stages.  Applied to M x'' = F(x, x', y), 0 = G(x, y) every
stage solves for positions, multipliers and what else is algebraic together.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .frozen import Value
from .results import Array


@dataclass(frozen=True, eq=False)
class Tableau(Value):
    """A method of `stages` stages, the first of them explicit; every `simulate` takes one as its `method`.

    Attributes
    ----------
    name, order: of the method, in the step, for ordinary differential equations.
    constrained: its order where constraints have multipliers, as measured on beams and ribbons.
    a: (stages, stages) lower triangular, 0 in the first row; its last row is the weights of the step.
    error: (stages,) weights whose sum with the stages' rates, times the step, estimates the local
        error; of order `embedded` + 1 in the step.
    embedded: order of the method that the step is compared with.

    Raises
    ------
    ValueError
        If the table is none of such a method; names what is wrong.
    """

    name: str
    order: int
    constrained: int
    a: Array
    error: Array
    embedded: int

    def __post_init__(self) -> None:
        for name in ("a", "error"):
            object.__setattr__(self, name, np.array(getattr(self, name), dtype=float))
        super().__post_init__()
        a, n = self.a, len(self.a)
        diagonal = a.diagonal()[1:] if a.shape == (n, n) else np.zeros(0)
        explicit_first = n > 1 and a.shape == (n, n) and not a[0].any() and not np.triu(a, 1).any()
        if not explicit_first or not np.all(diagonal == diagonal[0]) or not diagonal[0] > 0.0:
            raise ValueError(
                f"a = {a.tolist()!r}: must be a lower triangle of two rows or more, whose first is zero and "
                "whose diagonal is one positive number from the second on"
            )
        if self.error.shape != (n,):
            raise ValueError(f"error = {self.error.tolist()!r}: must have a weight for each of {n} stages")
        if not np.isclose(a[-1].sum(), 1.0):
            raise ValueError(
                f"a: its last row is the weights of the step, whose sum must be 1, not {a[-1].sum():g}"
            )

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
    return Tableau("implicit-euler", 1, 1, np.array([[0.0, 0.0], [0.0, 1.0]]), np.array([-0.5, 0.5]), 1)


def tr_bdf2() -> Tableau:
    """Trapezoidal rule, then BDF2, with the embedded estimate of order 3 of M. E. Hosea & L. F. Shampine.

    Appl. Numer. Math. 20 (1996) 21.
    """
    d, w = 1.0 - 0.5 * np.sqrt(2.0), 0.25 * np.sqrt(2.0)
    a = np.array([[0.0, 0.0, 0.0], [d, d, 0.0], [w, w, d]])
    return Tableau("tr-bdf2", 2, 2, a, np.array([4.0 * w - 1.0, -1.0, 2.0 * d]) / 3.0, 2)


def _rows(*rows: tuple[float, ...]) -> Array:
    """A lower triangle from its rows."""
    a = np.zeros((len(rows), len(rows)))
    for i, row in enumerate(rows):
        a[i, : len(row)] = row
    return a


def esdirk3() -> Tableau:
    """The implicit half of ARK3(2)4L[2]SA of C. A. Kennedy & M. H. Carpenter.

    Appl. Numer. Math. 44 (2003) 139.
    """
    d = 1767732205903 / 4055673282236
    a = _rows(
        (0.0,),
        (d, d),
        (2746238789719 / 10658868560708, -640167445237 / 6845629431997, d),
        (
            1471266399579 / 7840856788654,
            -4482444167858 / 7529755066697,
            11266239266428 / 11593286722821,
            d,
        ),
    )
    other = (
        2756255671327 / 12835298489170,
        -10771552573575 / 22201958757719,
        9247589265047 / 10645013368117,
        2193209047091 / 5459859503100,
    )
    return Tableau("esdirk3", 3, 3, a, a[-1] - other, 2)


def esdirk4() -> Tableau:
    """The implicit half of ARK4(3)6L[2]SA of C. A. Kennedy & M. H. Carpenter.

    Appl. Numer. Math. 44 (2003) 139.
    """
    a = _rows(
        (0.0,),
        (1 / 4, 1 / 4),
        (8611 / 62500, -1743 / 31250, 1 / 4),
        (5012029 / 34652500, -654441 / 2922500, 174375 / 388108, 1 / 4),
        (
            15267082809 / 155376265600,
            -71443401 / 120774400,
            730878875 / 902184768,
            2285395 / 8070912,
            1 / 4,
        ),
        (82889 / 524892, 0.0, 15625 / 83664, 69875 / 102672, -2260 / 8211, 1 / 4),
    )
    other = (
        4586570599 / 29645900160,
        0.0,
        178811875 / 945068544,
        814220225 / 1159782912,
        -3700637 / 11593932,
        61727 / 225920,
    )
    return Tableau("esdirk4", 4, 3, a, a[-1] - other, 3)


# by name; what each is called by
TABLEAUS = {
    "tr-bdf2": tr_bdf2,
    "esdirk3": esdirk3,
    "esdirk4": esdirk4,
    "implicit-euler": implicit_euler,
}
