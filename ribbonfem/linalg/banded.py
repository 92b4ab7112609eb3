"""Symmetric banded factorisation with a dense border, and its inertia.

The tangents of all models are symmetric: a band, and a few dense rows of global constraints.
L D L^T without pivoting keeps the band and gives the inertia for nothing (Sylvester); a small
pivot costs digits, which one step of iterative refinement restores.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ribbonfem.results import Array

from ..jit.decorator import compiled


@compiled()
def factor_arrow(band: Array, border: Array, corner: Array) -> int:
    """Overwrite a symmetric arrow matrix with its L D L^T; return the number of negative pivots.

    Parameters
    ----------
    band: (n + w, w + 1), band[i, d] = A[i + d, i]; the last w rows are scratch.
    border: (k, n), rows n .. n + k - 1 of the matrix.
    corner: (k, k).
    """
    n, k, width = border.shape[1], border.shape[0], band.shape[1] - 1
    negative = 0
    tiny = 1e-300
    for i in range(n):
        pivot = band[i, 0]
        if abs(pivot) < tiny:
            pivot = tiny
            band[i, 0] = pivot
        if pivot < 0.0:
            negative += 1
        for r in range(k):
            entry = border[r, i]
            if entry != 0.0:
                factor = entry / pivot
                for d in range(1, min(width, n - 1 - i) + 1):
                    border[r, i + d] -= factor * band[i, d]
                for s in range(k):
                    corner[r, s] -= factor * border[s, i] if s >= r else 0.0
        for d in range(1, min(width, n - 1 - i) + 1):
            factor = band[i, d] / pivot
            if factor != 0.0:
                for e in range(d, width + 1):
                    band[i + d, e - d] -= factor * band[i, e]
        for r in range(k):
            border[r, i] /= pivot
        for d in range(1, width + 1):
            band[i, d] /= pivot
    for r in range(k):
        pivot = corner[r, r]
        if abs(pivot) < tiny:
            pivot = tiny
            corner[r, r] = pivot
        if pivot < 0.0:
            negative += 1
        for s in range(r + 1, k):
            factor = corner[r, s] / pivot
            for t in range(s, k):
                corner[s, t] -= factor * corner[r, t]
        for s in range(r + 1, k):
            corner[r, s] /= pivot
    return negative


@compiled()
def solve_arrow(band: Array, border: Array, corner: Array, x: Array) -> None:
    """Overwrite x (n + k, m) with the solution, from the factors of `factor_arrow`."""
    n, k, width = border.shape[1], border.shape[0], band.shape[1] - 1
    for c in range(x.shape[1]):
        for i in range(n):
            value = x[i, c]
            for d in range(1, min(width, n - 1 - i) + 1):
                x[i + d, c] -= band[i, d] * value
            for r in range(k):
                x[n + r, c] -= border[r, i] * value
        for r in range(k):
            for s in range(r + 1, k):
                x[n + s, c] -= corner[r, s] * x[n + r, c]
        for r in range(k - 1, -1, -1):
            value = x[n + r, c] / corner[r, r]
            for s in range(r + 1, k):
                value -= corner[r, s] * x[n + s, c]
            x[n + r, c] = value
        for i in range(n - 1, -1, -1):
            value = x[i, c] / band[i, 0]
            for d in range(1, min(width, n - 1 - i) + 1):
                value -= band[i, d] * x[i + d, c]
            for r in range(k):
                value -= border[r, i] * x[n + r, c]
            x[i, c] = value


@compiled(allocates=True)
def multiply_arrow(band: Array, border: Array, corner: Array, x: Array) -> Array:
    """The product of the (unfactored) matrix with x (n + k, m)."""
    n, k, width = border.shape[1], border.shape[0], band.shape[1] - 1
    y = np.zeros_like(x)
    for c in range(x.shape[1]):
        for i in range(n):
            y[i, c] += band[i, 0] * x[i, c]
            for d in range(1, min(width, n - 1 - i) + 1):
                y[i + d, c] += band[i, d] * x[i, c]
                y[i, c] += band[i, d] * x[i + d, c]
            for r in range(k):
                y[n + r, c] += border[r, i] * x[i, c]
                y[i, c] += border[r, i] * x[n + r, c]
        for r in range(k):
            for s in range(k):
                y[n + r, c] += corner[min(r, s), max(r, s)] * x[n + s, c]
    return y


@compiled(allocates=True)
def factors_of(band: Array, border: Array, corner: Array) -> tuple[Array, Array, Array, int]:
    """As `factored`, for compiled code: what hands arrays to Python cannot serve both."""
    n, width = band.shape[0], band.shape[1] - 1
    factors = np.zeros((n + width, width + 1))
    for i in range(n):
        # what a band holds beyond the matrix is no part of it
        for d in range(min(width, n - 1 - i) + 1):
            factors[i, d] = band[i, d]
    rows, last = border.copy(), corner.copy()
    negative = factor_arrow(factors, rows, last)
    return factors, rows, last, negative


@compiled(allocates=True)
def factored(band: Array, border: Array, corner: Array) -> tuple[Array, Array, Array, int]:
    """The factors of `factor_arrow` of band (n, w + 1), border and corner, which stay as they are."""
    return factors_of(band, border, corner)


@compiled(allocates=True)
def solved(
    band: Array,
    border: Array,
    corner: Array,
    factors: Array,
    rows: Array,
    last: Array,
    right: Array,
    refined: bool,
) -> Array:
    """The solution (n + k, m) for right-hand sides (n + k, m), perhaps with one step of refinement."""
    x = right.copy()
    solve_arrow(factors, rows, last, x)
    if not refined:
        return x
    rest = multiply_arrow(band, border, corner, x)
    for r in range(x.shape[0]):
        for c in range(x.shape[1]):
            rest[r, c] = right[r, c] - rest[r, c]
    solve_arrow(factors, rows, last, rest)
    for r in range(x.shape[0]):
        for c in range(x.shape[1]):
            x[r, c] += rest[r, c]
    return x


class Arrow:
    """A factorised symmetric arrow matrix.

    Parameters
    ----------
    band: (n, w + 1), band[i, d] = A[i + d, i].
    border: (k, n) or None.
    corner: (k, k) or None for zeros; only its upper triangle is read.

    Attributes
    ----------
    negative: number of negative eigenvalues of the whole matrix.
    refined: whether solutions have a step of refinement, at more than the price of another solution.
    """

    def __init__(
        self,
        band: Array,
        border: Array | None = None,
        corner: Array | None = None,
        *,
        refined: bool = True,
    ) -> None:
        border = np.zeros((0, len(band))) if border is None else border
        corner = np.zeros((len(border), len(border))) if corner is None else corner
        *factors, negative = factored(band, border, corner)
        self._parts = (band, border, corner, *factors)
        self.negative = int(negative)
        self.refined = refined

    @classmethod
    def of(cls, parts: Sequence[Array], negative: int) -> Arrow:
        """Of a band, border and corner, and what `factored` has made of them."""
        arrow = cls.__new__(cls)
        arrow._parts, arrow.negative, arrow.refined = tuple(parts), int(negative), True
        return arrow

    def solve(self, right: Array) -> Array:
        """Solve for right-hand sides (n + k,) or (n + k, m)."""
        b = np.ascontiguousarray(right.reshape(len(right), -1), dtype=np.float64)
        return np.asarray(solved(*self._parts, b, self.refined)).reshape(right.shape)
