"""Richardson extrapolation: limits of values on refined meshes, and observed orders; only here."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, TypeVar

import numpy as np
from scipy.optimize import brentq

from ribbonfem.results import Array, Fold
from ribbonfem.results import Value as Record

# differences below this share of the value are rounding
ROUNDING = 1e-11
# an observed order is consistent with another if it differs by no more than this share of it
SLACK = 0.15
# and the next coarser triple, which is less close to the limit, by no more than this
WIDE = 0.35
# orders are looked for in this range
_ORDERS = (0.05, 20.0)

Value = float | Array
V = TypeVar("V", float, Array)


def edge_ratio(coarse: int, fine: int) -> float:
    """(l_coarse / l_fine)^2 of centred-clamp rods with these numbers of nodes."""
    return ((fine - 2) / (coarse - 2)) ** 2


def two_point(coarse: V, fine: V, ratio: float) -> V:
    """Richardson's limit of a value whose error falls by `ratio` from the coarse mesh to the fine one."""
    return (ratio * fine - coarse) / (ratio - 1.0)


def of_folds(coarse: Fold, fine: Fold, ratio: float) -> Fold:
    """Richardson's limit of a fold, of its angle, height and load."""
    angle, height, load = (
        two_point(getattr(coarse, name), getattr(fine, name), ratio) for name in ("angle", "height", "load")
    )
    return Fold(angle, height, load)


def limit_of(values: Sequence[float], meshes: Sequence[int]) -> tuple[float, float]:
    """The limit of values on centred-clamp rods of these numbers of nodes, and its estimated error.

    Parameters
    ----------
    values: two or more; only the last three count.
    meshes: N of each, growing.

    Raises
    ------
    ValueError
        For fewer than two values, or not as many meshes.
    """
    if len(values) != len(meshes) or len(values) < 2:
        raise ValueError(f"values = {values!r}, meshes = {meshes!r}: two or more are needed, one of each")
    recent, nodes = np.array(values[-3:]), np.array(meshes[-3:], dtype=float)
    square = (nodes[0] - 2.0) ** 2 / (nodes - 2.0) ** 2

    def limit(last: int) -> float:
        powers = np.vander(square[-last:], last, increasing=True)
        return float(np.linalg.solve(powers, recent[-last:])[0])

    best = limit(len(recent))
    reach = float(abs(best - recent[-1]))
    # so long a step, in rad or of the angle itself, that the meshes do not yet see the same
    far = 25.0 * reach + 1.5 * reach / max(abs(best), reach)
    if len(recent) == 2:
        return best, reach * (0.12 * (29.0 / (meshes[-2] - 2.0)) ** 2 + far)
    # the two limits may agree by chance, and then say nothing of a long step
    return best, max(abs(best - limit(2)) * (0.25 + far), 0.4 * reach * far)


@dataclass(frozen=True, eq=False)
class Limit(Record):
    """Where a sequence of values goes as the size goes to zero.

    Attributes
    ----------
    value: Richardson's limit, a number or an array.
    orders: (values - 2,) observed by each three consecutive values; NaN where they do not converge.
    verified: whether the orders agree with the one expected, or, where none is, with each other;
        or the last two values agree to rounding.
    uncertainty: by how much the limit moves when it is taken one run earlier; where it was taken
        by the order observed and not by the one expected, its distance from the finest value.
    """

    value: Value
    orders: Array
    verified: bool
    uncertainty: float


def root_mean_square(value: Any) -> float:
    """Root mean square of the numbers of a value."""
    return float(np.sqrt(np.mean(np.square(value))))


def triple_order(
    values: Sequence[Value], sizes: Sequence[float], within: tuple[float, float] = _ORDERS
) -> float:
    """The p with v = limit + C h^p through three values; NaN if they do not approach a limit so."""
    first, second = np.subtract(values[0], values[1]), np.subtract(values[1], values[2])
    # differences that point different ways are not those of one leading term
    if root_mean_square(second) == 0.0 or float(np.sum(first * second)) <= 0.0:
        return math.nan
    ratio = root_mean_square(first) / root_mean_square(second)
    a, b, c = (h / sizes[0] for h in sizes)

    def off(p: float) -> float:
        return (a**p - b**p) / (b**p - c**p) / ratio - 1.0

    low, high = within
    if off(low) * off(high) > 0.0:
        return math.nan
    return float(brentq(off, low, high))


def _near(order: float, other: float, slack: float = SLACK) -> bool:
    return bool(abs(order - other) <= slack * abs(other))


def richardson(values: Sequence[Value], sizes: Sequence[float], expected: float | None = None) -> Limit:
    """The limit of values at falling sizes, by the expected order where it is observed.

    Parameters
    ----------
    values: at least three numbers, or arrays of one shape, the coarsest first.
    sizes: their mesh sizes, steps or tolerances, falling.
    expected: the order that the method declares; None if it declares none.

    Raises
    ------
    ValueError
        If there are fewer than three, or the sizes do not fall.
    """
    if len(values) < 3 or len(values) != len(sizes):
        raise ValueError(
            f"values: {len(values)} of them with {len(sizes)} sizes: must be three at least, as many"
        )
    if any(a <= b for a, b in pairwise(sizes)):
        raise ValueError(f"sizes = {tuple(sizes)!r}: must fall")
    orders = np.array([triple_order(values[k : k + 3], sizes[k : k + 3]) for k in range(len(values) - 2)])
    last, scale = root_mean_square(np.subtract(values[-1], values[-2])), root_mean_square(values[-1])
    if last <= ROUNDING * max(1.0, scale):
        return Limit(values[-1], orders, True, last)
    seen = float(orders[-1])
    if expected is not None:
        verified = _near(seen, expected) and all(_near(p, expected, WIDE) for p in orders[-2:-1])
    else:
        verified = len(orders) > 1 and _near(seen, float(orders[-2]))
    order = expected if expected is not None and (verified or math.isnan(seen)) else seen
    if order is None or math.isnan(order):
        return Limit(values[-1], orders, False, last)
    limits = [
        two_point(np.asarray(values[k]), np.asarray(values[k + 1]), (sizes[k] / sizes[k + 1]) ** order)
        for k in range(len(values) - 3, len(values) - 1)
    ]
    limit = limits[1] if np.ndim(limits[1]) else float(limits[1])
    # three values and the order seen in them would agree by construction
    other = limits[0] if order == expected else values[-1]
    return Limit(limit, orders, verified, root_mean_square(np.subtract(limit, other)))
