"""Where a quantity of which a motion has rows crosses a level."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def apart(time: Array, k: int) -> NDArray[np.int64]:
    """Two rows before the k-th and two from it on, leaving out those much closer than k - 1 and k are."""
    least = 1e-3 * (time[k] - time[k - 1])
    rows = [k - 1, k]
    if k >= 2 and time[k - 1] - time[k - 2] > least:
        rows.insert(0, k - 2)
    if k + 1 < len(time) and time[k + 1] - time[k] > least:
        rows.append(k + 1)
    return np.array(rows)


def root(x: Array, y: Array, low: float, high: float) -> float:
    """Root in [low, high] of the polynomial through the points (x, y), by bisection on its Newton form."""
    x0, scale = float(x[0]), float(x[-1] - x[0])
    nodes = (x - x0) / scale
    coefficients = y.copy()
    for order in range(1, len(nodes)):
        coefficients[order:] = (coefficients[order:] - coefficients[order - 1 : -1]) / (
            nodes[order:] - nodes[:-order]
        )

    def value(t: float) -> float:
        result = coefficients[-1]
        for c, node in zip(coefficients[-2::-1], nodes[-2::-1], strict=True):
            result = result * (t - node) + c
        return float(result)

    a, b = (low - x0) / scale, (high - x0) / scale
    sign = value(a) > 0.0
    for _ in range(60):
        middle = 0.5 * (a + b)
        if (value(middle) > 0.0) == sign:
            a = middle
        else:
            b = middle
    return x0 + scale * 0.5 * (a + b)
