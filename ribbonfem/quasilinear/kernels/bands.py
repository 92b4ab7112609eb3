"""Products and L D L^T of symmetric bands kept by diagonals, [d, i] = A[i + d, i]."""

from __future__ import annotations

from ribbonfem.jit.decorator import compiled
from ribbonfem.jit.groups import OPTIONS
from ribbonfem.results import Array


@compiled(**OPTIONS)
def add_product(band: Array, factor: float, x: Array, y: Array) -> None:
    """y += factor A x."""
    n = x.shape[0]
    for i in range(n):
        y[i] += factor * band[0, i] * x[i]
    for d in range(1, band.shape[0]):
        for i in range(n - d):
            y[i] += factor * band[d, i] * x[i + d]
        for i in range(n - d):
            y[i + d] += factor * band[d, i] * x[i]


@compiled(**OPTIONS)
def add_three(
    k: Array,
    g: Array,
    m: Array,
    stiffening: float,
    load: float,
    z: Array,
    more: Array,
    rest: Array,
    row: Array,
) -> None:
    """rest += (stiffening K - load G) z + M more, row += G z, of three bands at once."""
    n = z.shape[0]
    for i in range(n):
        rest[i] += (stiffening * k[0, i] - load * g[0, i]) * z[i] + m[0, i] * more[i]
        row[i] += g[0, i] * z[i]
    for d in range(1, k.shape[0]):
        for i in range(n - d):
            rest[i] += (stiffening * k[d, i] - load * g[d, i]) * z[i + d] + m[d, i] * more[i + d]
            row[i] += g[d, i] * z[i + d]
        for i in range(n - d):
            rest[i + d] += (stiffening * k[d, i] - load * g[d, i]) * z[i] + m[d, i] * more[i]
            row[i + d] += g[d, i] * z[i]


@compiled(**OPTIONS)
def dot(x: Array, y: Array) -> float:
    """x . y"""
    total = 0.0
    for i in range(x.shape[0]):
        total += x[i] * y[i]
    return total


@compiled(**OPTIONS)
def factor(band: Array, pivots: Array) -> None:
    """Overwrite a band (w + 1, n + w), zero beyond the matrix, by L of L D L^T, and pivots by 1 / D."""
    n, width = pivots.shape[0], band.shape[0] - 1
    for i in range(n):
        inverse = 1.0 / band[0, i]
        pivots[i] = inverse
        for d in range(1, width + 1):
            share = band[d, i] * inverse
            for e in range(d, width + 1):
                band[e - d, i + d] -= share * band[e, i]
        for d in range(1, width + 1):
            band[d, i] *= inverse


@compiled(**OPTIONS)
def solve_both(band: Array, pivots: Array, x: Array, y: Array) -> None:
    """Overwrite x and y by the solutions with the factors."""
    n, width = pivots.shape[0], band.shape[0] - 1
    for i in range(n):
        a, b = x[i], y[i]
        for d in range(1, min(width, n - 1 - i) + 1):
            x[i + d] -= band[d, i] * a
            y[i + d] -= band[d, i] * b
    for i in range(n - 1, -1, -1):
        a, b = x[i] * pivots[i], y[i] * pivots[i]
        for d in range(1, min(width, n - 1 - i) + 1):
            a -= band[d, i] * x[i + d]
            b -= band[d, i] * y[i + d]
        x[i], y[i] = a, b
