"""L D L^T of symmetric banded matrices with a few dense rows: factors, solutions, inertia.

The tangents of all models are symmetric: a band, and a few dense rows of global constraints.
L D L^T without pivoting keeps the band and gives the inertia for nothing (Sylvester); a small
pivot costs digits, which one step of iterative refinement restores.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ribbonfem.results import Array

from ..jit.decorator import compiled


@compiled(fastmath={"contract"})
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
        inverse = 1.0 / pivot
        for r in range(k):
            entry = border[r, i]
            if entry != 0.0:
                factor = entry * inverse
                for d in range(1, min(width, n - 1 - i) + 1):
                    border[r, i + d] -= factor * band[i, d]
                for s in range(k):
                    corner[r, s] -= factor * border[s, i] if s >= r else 0.0
        for d in range(1, min(width, n - 1 - i) + 1):
            factor = band[i, d] * inverse
            if factor != 0.0:
                for e in range(d, width + 1):
                    band[i + d, e - d] -= factor * band[i, e]
        for r in range(k):
            border[r, i] *= inverse
        for d in range(1, width + 1):
            band[i, d] *= inverse
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


@compiled(fastmath={"contract"})
def solve_arrow(band: Array, border: Array, corner: Array, x: Array, last: Array) -> None:
    """Overwrite x (n + w,), its end zero, and the last unknowns (k,) by the solution, from `factor_arrow`."""
    n, k, width = border.shape[1], border.shape[0], band.shape[1] - 1
    for i in range(n):
        value = x[i]
        for d in range(1, width + 1):
            x[i + d] -= band[i, d] * value
    for r in range(k):
        last[r] -= _dot(border, r, 0, n, x, 0)
        for s in range(r):
            last[r] -= corner[s, r] * last[s]
    for r in range(k - 1, -1, -1):
        last[r] /= corner[r, r]
        for s in range(r + 1, k):
            last[r] -= corner[r, s] * last[s]
    for i in range(n):
        x[i] /= band[i, 0]
    for r in range(k):
        for i in range(n):
            x[i] -= border[r, i] * last[r]
    for i in range(n - 1, -1, -1):
        x[i] -= _dot(band, i, 1, width, x, i + 1)


@compiled(inline=True, fastmath={"contract"})
def _dot(band: Array, i: int, first: int, count: int, x: Array, at: int) -> float:
    """Of `count` entries of a row from `first` on with those of x from `at` on.

    Four sums side by side, where one would wait for every product before it.
    """
    one = two = three = four = 0.0
    whole = count - count % 4
    for d in range(0, whole, 4):
        one += band[i, first + d] * x[at + d]
        two += band[i, first + d + 1] * x[at + d + 1]
        three += band[i, first + d + 2] * x[at + d + 2]
        four += band[i, first + d + 3] * x[at + d + 3]
    for d in range(whole, count):
        one += band[i, first + d] * x[at + d]
    return (one + two) + (three + four)


@compiled(fastmath={"contract"})
def multiply_arrow(
    band: Array, border: Array, corner: Array, x: Array, last: Array, y: Array, after: Array
) -> None:
    """Write the (unfactored) matrix times x (n,) and the last unknowns (k,) to y (n,) and (k,)."""
    n, k, width = border.shape[1], border.shape[0], band.shape[1] - 1
    for i in range(n):
        y[i] = band[i, 0] * x[i]
    for i in range(n):
        here = min(width, n - 1 - i)
        for d in range(1, here + 1):
            y[i + d] += band[i, d] * x[i]
        y[i] += _dot(band, i, 1, here, x, i + 1)
    for r in range(k):
        after[r] = _dot(border, r, 0, n, x, 0)
        for i in range(n):
            y[i] += border[r, i] * last[r]
        for s in range(k):
            after[r] += corner[min(r, s), max(r, s)] * last[s]


@compiled(allocates=True, fastmath={"contract"})
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


@compiled(allocates=True, fastmath={"contract"})
def factored(band: Array, border: Array, corner: Array) -> tuple[Array, Array, Array, int]:
    """The factors of `factor_arrow` of band (n, w + 1), border and corner, which stay as they are."""
    return factors_of(band, border, corner)


@compiled(allocates=True, fastmath={"contract"})
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
    k, n = border.shape
    out = np.empty_like(right)
    x, end = np.zeros(factors.shape[0]), np.empty(k)
    rest, over = np.zeros(factors.shape[0]), np.empty(k)
    for c in range(right.shape[1]):
        # (entry by entry: what assigns slices takes longer to compile than all the rest)
        for i in range(n):
            x[i] = right[i, c]
        for r in range(k):
            end[r] = right[n + r, c]
        solve_arrow(factors, rows, last, x, end)
        if refined:
            multiply_arrow(band, border, corner, x, end, rest, over)
            for i in range(n):
                rest[i] = right[i, c] - rest[i]
            for r in range(k):
                over[r] = right[n + r, c] - over[r]
            solve_arrow(factors, rows, last, rest, over)
            for i in range(n):
                x[i] += rest[i]
            for r in range(k):
                end[r] += over[r]
        for i in range(n):
            out[i, c] = x[i]
        for r in range(k):
            out[n + r, c] = end[r]
    return out


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
