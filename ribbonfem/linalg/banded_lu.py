"""Banded factorisation with row exchanges, and products with a symmetric band."""

from __future__ import annotations

import numpy as np

from ribbonfem.results import Array

from ..jit.decorator import compiled


@compiled()
def band_factor(band: Array, pivots: np.ndarray, n: int, width: int) -> None:
    """Overwrite band[i, j - i + width] = A[i, j] (n, 3 width + 1) by its LU with row exchanges.

    The last `width` columns are the fill of the exchanges; they are zeroed here.
    """
    for i in range(n):
        for d in range(2 * width + 1, 3 * width + 1):
            band[i, d] = 0.0
    for k in range(n):
        last = min(n - 1, k + width)
        p, best = k, abs(band[k, width])
        for i in range(k + 1, last + 1):
            size = abs(band[i, k - i + width])
            if size > best:
                p, best = i, size
        pivots[k] = p
        right = min(n - 1, k + 2 * width)
        if p != k:
            shift = k - p
            for j in range(right - k + 1):
                keep = band[k, width + j]
                band[k, width + j] = band[p, width + shift + j]
                band[p, width + shift + j] = keep
        pivot = band[k, width]
        if pivot == 0.0:
            pivot = 1e-300
            band[k, width] = pivot
        inverse = 1.0 / pivot
        for i in range(k + 1, last + 1):
            start = k - i + width
            factor = band[i, start]
            if factor != 0.0:
                factor *= inverse
                band[i, start] = factor
                for j in range(1, right - k + 1):
                    band[i, start + j] -= factor * band[k, width + j]


@compiled()
def band_solve(band: Array, pivots: np.ndarray, n: int, width: int, x: Array) -> None:
    """Overwrite x (n,) by the solution, from the factors of `band_factor`."""
    for k in range(n):
        p = pivots[k]
        if p != k:
            keep = x[k]
            x[k] = x[p]
            x[p] = keep
        value = x[k]
        for i in range(k + 1, min(n, k + width + 1)):
            x[i] -= band[i, k - i + width] * value
    for k in range(n - 1, -1, -1):
        value = x[k]
        for j in range(1, min(n - 1 - k, 2 * width) + 1):
            value -= band[k, width + j] * x[k + j]
        x[k] = value / band[k, width]


@compiled()
def multiply(band: Array, x: Array, y: Array) -> None:
    """y = A x for a symmetric band[i, d] = A[i + d, i]."""
    n, width = band.shape
    for i in range(n):
        y[i] = band[i, 0] * x[i]
    for d in range(1, width):
        for i in range(n - d):
            y[i + d] += band[i, d] * x[i]
            y[i] += band[i, d] * x[i + d]
