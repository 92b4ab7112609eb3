"""Interpolation of a motion between its steps, and the instant at which a quantity crosses zero."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# a neighbouring row closer than this part of the interval is left out: its differences are rounding
LEAST = 1e-3


def kinks_of(angle: Array) -> tuple[int, int]:
    """The rows at which the clamp starts and stops: velocities jump there."""
    return 0, int(np.argmax(angle == angle[-1]))


def between(
    time: Array, values: Array, k: int, rates: Array | None = None, kinks: tuple[int, ...] = ()
) -> Callable[[float], float]:
    """The polynomial that `values` are taken to follow between rows k - 1 and k.

    Parameters
    ----------
    time, values: (rows,), 1 <= k < rows.
    rates: (rows,), d(values)/d(time), if they are known.
    kinks: rows at which they jump; those given are of the instant before.

    Notes
    -----
    It goes through the rows k - 2, k - 1 and k with their rates, of degree 5: steps of an accurate method
    are so long that a cubic through four rows would be off by ten times what the method is.  Where there are
    no rates it is that cubic.  Behind a kink nothing of what is before it is used but its value.
    """
    if rates is None or not all(map(math.isfinite, rates[max(k - 2, 0) : k + 1].tolist())):
        rows = _around(time, k)
        return _newton(time[rows].tolist(), values[rows].tolist())
    rows = [k - 1, k]
    if k - 1 not in kinks:
        if k >= 2 and time[k - 1] - time[k - 2] > LEAST * (time[k] - time[k - 1]):
            rows.insert(0, k - 2)
    elif k + 1 < len(time) and k not in kinks:
        rows.append(k + 1)
    # twice where the rate is of this side
    twice = [row for row in rows for _ in range(1 if row == k - 1 and row in kinks else 2)]
    return _newton(time[twice].tolist(), values[twice].tolist(), rates[twice].tolist())


def root(
    time: Array, values: Array, k: int, rates: Array | None = None, kinks: tuple[int, ...] = ()
) -> float:
    """The instant between rows k - 1 and k, on both sides of 0, at which `values` are 0, as in `between`."""
    value = between(time, values, k, rates, kinks)
    low, high = float(time[k - 1]), float(time[k])
    below, above = value(low), value(high)
    before, stuck = high, 0
    for _ in range(60):
        # regula falsi; the end that stays counts half, that it does not stay for good (Illinois)
        middle = (low * above - high * below) / (above - below) if below != above else low
        if abs(middle - before) <= 2e-16 * abs(middle):
            break
        before, here = middle, value(middle)
        if (here > 0.0) == (below > 0.0):
            low, below = middle, here
            above *= 0.5 if stuck < 0 else 1.0
            stuck = -1
        else:
            high, above = middle, here
            below *= 0.5 if stuck > 0 else 1.0
            stuck = 1
    return min(max(before, float(time[k - 1])), float(time[k]))


def _around(time: Array, k: int) -> list[int]:
    """Two rows before the k-th and two from it on, leaving out those much closer than k - 1 and k are."""
    least = LEAST * (time[k] - time[k - 1])
    rows = [k - 1, k]
    if k >= 2 and time[k - 1] - time[k - 2] > least:
        rows.insert(0, k - 2)
    if k + 1 < len(time) and time[k + 1] - time[k] > least:
        rows.append(k + 1)
    return rows


def _newton(x: list[float], y: list[float], slopes: list[float] | None = None) -> Callable[[float], float]:
    """The polynomial through (x, y), by divided differences; a node that is repeated takes the slope too."""
    differences = list(y)
    for order in range(1, len(x)):
        for i in range(len(x) - 1, order - 1, -1):
            gap = x[i] - x[i - order]
            if gap == 0.0:
                differences[i] = slopes[i] if slopes is not None else math.nan
            else:
                differences[i] = (differences[i] - differences[i - 1]) / gap
    inner = list(zip(differences[-2::-1], x[-2::-1], strict=True))

    def value(t: float) -> float:
        result = differences[-1]
        for c, node in inner:
            result = result * (t - node) + c
        return result

    return value
