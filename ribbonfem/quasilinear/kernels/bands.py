"""Products and solutions of symmetric bands, four numbers at a time.

Vectors have N places, a multiple of `WIDTH`, those without an unknown 0.  A band of half-width w is kept by
its diagonals (2 w + 1, N), [w + d, i] = A[i, i + d], 0 beyond the matrix.  What it is multiplied with stands
in a `wide` array, with w zeros before it and as many behind.
"""

from __future__ import annotations

from ribbonfem.jit.decorator import compiled
from ribbonfem.jit.groups import INLINED, OPTIONS
from ribbonfem.jit.simd import WIDTH, load_from, spread, store_from, summed
from ribbonfem.results import Array

# unknowns up to which the inverse of a matrix is made: a product takes a third of the time of a substitution,
# in which each number waits for the one before
FEW = 24


@compiled(**INLINED)
def dot(x: Array, y: Array) -> float:
    """x . y"""
    total = spread(0.0)
    for i in range(0, x.shape[0], WIDTH):
        total += load_from(x, (i,)) * load_from(y, (i,))
    return summed(total)


@compiled(**INLINED)
def widen(x: Array, wide: Array) -> None:
    """Put x in the middle of a wide array."""
    margin = (wide.shape[0] - x.shape[0]) // 2
    for i in range(0, x.shape[0], WIDTH):
        store_from(wide, (margin + i,), load_from(x, (i,)))


@compiled(**OPTIONS)
def add_product(band: Array, factor: float, wide: Array, y: Array) -> None:
    """y += factor A x."""
    for i in range(0, y.shape[0], WIDTH):
        total = spread(0.0)
        for d in range(band.shape[0]):
            total += load_from(band, (d, i)) * load_from(wide, (i + d,))
        store_from(y, (i,), load_from(y, (i,)) + factor * total)


@compiled(**OPTIONS)
def invert(a: Array, even: int, column: Array) -> None:
    """Overwrite a matrix (N, N) by its inverse; its first `even` places and the others do not meet.

    `column` (N,) is of use for a moment.
    """
    n = a.shape[0]
    for p in range(n):
        first, last = (0, even) if p < even else (even, n)
        inverse = 1.0 / a[p, p]
        for i in range(first, last):
            column[i] = a[i, p]
            a[i, p] = 0.0
        a[p, p] = 1.0
        column[p] = 0.0
        for k in range(first - first % WIDTH, last, WIDTH):
            row = inverse * load_from(a, (p, k))
            store_from(a, (p, k), row)
            for i in range(first, last):
                store_from(a, (i, k), load_from(a, (i, k)) - column[i] * row)


@compiled(**OPTIONS)
def factor(lower: Array, pivots: Array) -> None:
    """Overwrite a band [d, i] = A[i + d, i] (w + 1, N + w) by L of L D L^T, and pivots by 1 / D."""
    n, width = pivots.shape[0], lower.shape[0] - 1
    for i in range(n):
        inverse = 1.0 / lower[0, i]
        pivots[i] = inverse
        for d in range(1, width + 1):
            share = lower[d, i] * inverse
            for e in range(d, width + 1):
                lower[e - d, i + d] -= share * lower[e, i]
        for d in range(1, width + 1):
            lower[d, i] *= inverse


@compiled(**OPTIONS)
def _substitute(lower: Array, pivots: Array, x: Array, y: Array) -> None:
    """Overwrite x and y by the solutions with the factors."""
    n, width = pivots.shape[0], lower.shape[0] - 1
    for i in range(n):
        a, b = x[i], y[i]
        for d in range(1, min(width, n - 1 - i) + 1):
            x[i + d] -= lower[d, i] * a
            y[i + d] -= lower[d, i] * b
    for i in range(n - 1, -1, -1):
        a, b = x[i] * pivots[i], y[i] * pivots[i]
        for d in range(1, min(width, n - 1 - i) + 1):
            a -= lower[d, i] * x[i + d]
            b -= lower[d, i] * y[i + d]
        x[i], y[i] = a, b


@compiled(**OPTIONS)
def solve_both(
    factors: Array, pivots: Array, even: int, x: Array, y: Array, to_x: Array, to_y: Array
) -> None:
    """Solutions of x and of y: with the inverse of `invert` if there are no pivots, or with the factors."""
    n = x.shape[0]
    if pivots.shape[0] > 0:
        for i in range(n):
            to_x[i], to_y[i] = x[i], y[i]
        _substitute(factors, pivots, to_x, to_y)
        return
    for i in range(0, n, WIDTH):
        # (two sums each: one addition need not wait for another)
        first, second, third, fourth = spread(0.0), spread(0.0), spread(0.0), spread(0.0)
        begin = 0 if i < even else even - even % 2
        end = n if i + WIDTH > even else even + even % 2
        for j in range(begin, end, 2):
            one, other = load_from(factors, (j, i)), load_from(factors, (j + 1, i))
            first += x[j] * one
            second += y[j] * one
            third += x[j + 1] * other
            fourth += y[j + 1] * other
        store_from(to_x, (i,), first + third)
        store_from(to_y, (i,), second + fourth)
