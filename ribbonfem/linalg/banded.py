"""L D L^T of symmetric banded matrices with a few dense rows: factors, solutions, inertia.

The tangents of all models are symmetric: a band, and a few dense rows of global constraints.
L D L^T without pivoting keeps the band and gives the inertia for nothing (Sylvester); small pivots
cost digits, which one step of iterative refinement restores where the residual says so.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ribbonfem.results import Array

from ..jit.decorator import compiled
from ..jit.simd import WIDTH, load_from, spread, store_from, summed

# band, border and corner of a matrix, and what `factored` makes of them but the number of negative pivots
Factorised = tuple[Array, Array, Array, Array, Array, Array, NDArray[np.int64]]
# Numbers after a row, so that four at a time may be read, and written back as they were, beyond its last.
_SPARE = WIDTH - 1
# A residual over the right-hand side above which a solution is refined.
_LOST = 1e-9


@compiled(inline=True)
def _add(
    to: Array, row: int, first: int, factor: float, of: Array, line: int, start: int, count: int
) -> None:
    """to[row, first:] += factor of[line, start:], `count` numbers; beyond them `of` is 0."""
    for k in range(0, count, WIDTH):
        more = factor * load_from(of, (line, start + k))
        store_from(to, (row, first + k), load_from(to, (row, first + k)) + more)


@compiled(inline=True)
def _dot(of: Array, line: int, start: int, x: Array, row: int, first: int, count: int) -> float:
    """The product of of[line, start:] and x[row, first:], `count` numbers; beyond them one of both is 0."""
    total = spread(0.0)
    for k in range(0, count, WIDTH):
        total += load_from(of, (line, start + k)) * load_from(x, (row, first + k))
    return summed(total)


@compiled(fastmath={"contract"})
def factor_arrow(band: Array, border: Array, corner: Array, reach: Array) -> int:
    """Overwrite a symmetric arrow matrix with its L D L^T; return the number of negative pivots.

    Parameters
    ----------
    band: (n, w + 1 + spare), band[i, d] = A[i + d, i].
    border: (k, n + spare), rows n .. n + k - 1 of the matrix.
    corner: (k, k).
    reach: (n,) entries of each row beyond the diagonal, those that come with the factors among them.
    """
    n, k = band.shape[0], border.shape[0]
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
        width = reach[i]
        for r in range(k):
            entry = border[r, i]
            if entry != 0.0:
                factor = entry * inverse
                _add(border, r, i + 1, -factor, band, i, 1, width)
                for s in range(r, k):
                    corner[r, s] -= factor * border[s, i]
        for d in range(1, width + 1):
            factor = band[i, d] * inverse
            if factor != 0.0:
                _add(band, i + d, 0, -factor, band, i, d, width + 1 - d)
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
def solve_arrow(band: Array, border: Array, corner: Array, reach: Array, x: Array, last: Array) -> None:
    """Overwrite x (1, n + spare), its end zero, and the last unknowns (k,), by `factor_arrow`'s factors."""
    n, k = band.shape[0], border.shape[0]
    for i in range(n):
        _add(x, 0, i + 1, -x[0, i], band, i, 1, reach[i])
    for r in range(k):
        last[r] -= _dot(border, r, 0, x, 0, 0, n)
        for s in range(r):
            last[r] -= corner[s, r] * last[s]
    for r in range(k - 1, -1, -1):
        last[r] /= corner[r, r]
        for s in range(r + 1, k):
            last[r] -= corner[r, s] * last[s]
    for i in range(n):
        x[0, i] /= band[i, 0]
    for r in range(k):
        _add(x, 0, 0, -last[r], border, r, 0, n)
    for i in range(n - 1, -1, -1):
        x[0, i] -= _dot(band, i, 1, x, 0, i + 1, reach[i])


@compiled(fastmath={"contract"})
def multiply_arrow(
    band: Array, border: Array, corner: Array, x: Array, last: Array, y: Array, after: Array
) -> None:
    """Write the (unfactored) matrix times x (n,) and the last unknowns (k,) to y (n,) and (k,)."""
    n, k, width = border.shape[1], border.shape[0], band.shape[1] - 1
    for i in range(n):
        y[0, i] = 0.0
    for i in range(n):
        here, total = x[0, i], band[i, 0] * x[0, i]
        for d in range(1, min(width, n - 1 - i) + 1):
            y[0, i + d] += band[i, d] * here
            total += band[i, d] * x[0, i + d]
        y[0, i] += total
    for r in range(k):
        after[r] = 0.0
        for i in range(n):
            after[r] += border[r, i] * x[0, i]
            y[0, i] += border[r, i] * last[r]
        for s in range(k):
            after[r] += corner[min(r, s), max(r, s)] * last[s]


@compiled(allocates=True, fastmath={"contract"})
def factors_of(
    band: Array, border: Array, corner: Array
) -> tuple[Array, Array, Array, NDArray[np.int64], int]:
    """As `factored`, for compiled code: what hands arrays to Python cannot serve both."""
    n, width, k = band.shape[0], band.shape[1] - 1, border.shape[0]
    factors, rows = np.zeros((n, width + 1 + _SPARE)), np.zeros((k, n + _SPARE))
    reach = np.zeros(n, dtype=np.int64)
    end = 0
    for i in range(n):
        # what a band holds beyond the matrix is no part of it, and a row gets the entries of those before it
        for d in range(min(width, n - 1 - i) + 1):
            factors[i, d] = band[i, d]
            if band[i, d] != 0.0 and i + d > end:
                end = i + d
        reach[i] = max(end - i, 0)
    for r in range(k):
        for i in range(n):
            rows[r, i] = border[r, i]
    last = corner.copy()
    negative = factor_arrow(factors, rows, last, reach)
    return factors, rows, last, reach, negative


@compiled(allocates=True, fastmath={"contract"})
def factored(band: Array, border: Array, corner: Array) -> tuple[Array, Array, Array, NDArray[np.int64], int]:
    """The factors of `factor_arrow` of band (n, w + 1), border and corner, which stay as they are."""
    return factors_of(band, border, corner)


@compiled(allocates=True, fastmath={"contract"})
def solution(parts: Factorised, right: Array) -> Array:
    """As `solved`, for compiled code."""
    band, border, corner, factors, rows, last, reach = parts
    k, n = border.shape
    out = np.empty_like(right)
    x, end = np.zeros((1, n + _SPARE)), np.empty(k)
    rest, over = np.zeros((1, n + _SPARE)), np.empty(k)
    for c in range(right.shape[1]):
        # (entry by entry: what assigns slices takes longer to compile than all the rest)
        for i in range(n):
            x[0, i] = right[i, c]
        for r in range(k):
            end[r] = right[n + r, c]
        solve_arrow(factors, rows, last, reach, x, end)
        multiply_arrow(band, border, corner, x, end, rest, over)
        most = left = 0.0
        for i in range(n):
            rest[0, i] = right[i, c] - rest[0, i]
            most, left = max(most, abs(right[i, c])), max(left, abs(rest[0, i]))
        for r in range(k):
            over[r] = right[n + r, c] - over[r]
            most, left = max(most, abs(right[n + r, c])), max(left, abs(over[r]))
        if not left <= _LOST * most:
            solve_arrow(factors, rows, last, reach, rest, over)
            for i in range(n):
                x[0, i] += rest[0, i]
            for r in range(k):
                end[r] += over[r]
        for i in range(n):
            out[i, c] = x[0, i]
        for r in range(k):
            out[n + r, c] = end[r]
    return out


@compiled(allocates=True, fastmath={"contract"})
def solved(parts: Factorised, right: Array) -> Array:
    """The solution (n + k, m) for right-hand sides (n + k, m), refined where that is needed."""
    return solution(parts, right)


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
    """

    def __init__(self, band: Array, border: Array | None = None, corner: Array | None = None) -> None:
        border = np.zeros((0, len(band))) if border is None else border
        corner = np.zeros((len(border), len(border))) if corner is None else corner
        *factors, negative = factored(band, border, corner)
        self._parts: Any = (band, border, corner, *factors)
        self.negative = int(negative)

    @classmethod
    def of(cls, parts: Sequence[Any], negative: int) -> Arrow:
        """Of a band, border and corner, and what `factored` has made of them."""
        arrow = cls.__new__(cls)
        arrow._parts, arrow.negative = tuple(parts), int(negative)
        return arrow

    def solve(self, right: Array) -> Array:
        """Solve for right-hand sides (n + k,) or (n + k, m)."""
        b = np.ascontiguousarray(right.reshape(len(right), -1), dtype=np.float64)
        return np.asarray(solved(self._parts, b)).reshape(right.shape)
