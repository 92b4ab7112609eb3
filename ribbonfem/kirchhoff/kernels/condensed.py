"""Elimination inside the elements of a Kirchhoff rod, and the band that is left (see `tangent`)."""

from __future__ import annotations

from ribbonfem.compiled.decorator import compiled
from ribbonfem.results import Array

from .tangent import N0, OPTIONS, OUTER, SIZE, TURN0, WIDTH, P, Rod, Solver


@compiled(**OPTIONS)
def _eliminate(local: Array, pivots: Array) -> None:
    """L D L^T of the inside of an element, from its last row up, three rows at a time.

    Row k of the factors is D times row k of L^T; the rows of the outside are left with their
    Schur complement.
    """
    k = SIZE - 1
    while k >= OUTER:
        row0, row1, row2 = local[k], local[k - 1], local[k - 2]
        inverse0 = 1.0 / row0[k]
        f0, f1 = row0[k - 1] * inverse0, row0[k - 2] * inverse0
        for j in range(k):
            row1[j] -= f0 * row0[j]
        for j in range(k - 1):
            row2[j] -= f1 * row0[j]
        inverse1 = 1.0 / row1[k - 1]
        f0 = row1[k - 2] * inverse1
        for j in range(k - 1):
            row2[j] -= f0 * row1[j]
        inverse2 = 1.0 / row2[k - 2]
        pivots[k], pivots[k - 1], pivots[k - 2] = inverse0, inverse1, inverse2
        for i in range(k - 2):
            f0, f1, f2 = row0[i] * inverse0, row1[i] * inverse1, row2[i] * inverse2
            # (the compiler makes vectors of this loop only behind the question)
            if f0 != 0.0 or f1 != 0.0 or f2 != 0.0:
                row = local[i]
                for j in range(i + 1):
                    row[j] -= f0 * row0[j] + f1 * row1[j] + f2 * row2[j]
        k -= 3


@compiled(**OPTIONS)
def factorise(s: Solver) -> None:
    """Eliminate the inside of every element in s.local, then the nodes between them in s.band."""
    elements = s.local.shape[0]
    count = 6 * (elements - 1)
    for i in range(count):
        for d in range(WIDTH + 1):
            s.band[i, d] = 0.0
    for e in range(elements):
        local = s.local[e]
        _eliminate(local, s.pivots[e])
        first = 6 * (e - 1)
        for i in range(12):
            if 0 <= first + i < count:
                for j in range(i + 1):
                    if first + j >= 0:
                        s.band[first + j, i - j] += local[i, j]
    for k in range(count):
        above = s.band[k]
        inverse = 1.0 / above[0]
        above[0] = inverse
        for d in range(1, WIDTH + 1):
            factor = above[d] * inverse
            if factor != 0.0:
                row = s.band[k + d]
                for c in range(WIDTH + 1 - d):
                    row[c] -= factor * above[c + d]


@compiled(**OPTIONS)
def _forward(rod: Rod, s: Solver, e: int, sigma: float) -> None:
    """Right-hand side of an element, its inside eliminated, in s.local_right[e]."""
    f, local, pivots = s.local_right[e], s.local[e], s.pivots[e]
    for i in range(OUTER):
        f[i] = 0.0
    for k in range(P):
        for c in range(3):
            f[N0 + 3 * k + c] = -s.fn[e, k, c]
    for i in range(1, P):
        inverse = 1.0 / (rod.mass[e, i] * sigma)
        x, y, z = inverse * s.fr[e * P + i, 0], inverse * s.fr[e * P + i, 1], inverse * s.fr[e * P + i, 2]
        for k in range(P):
            coupling = rod.coupling[e, k, i]
            f[N0 + 3 * k] += coupling * x
            f[N0 + 3 * k + 1] += coupling * y
            f[N0 + 3 * k + 2] += coupling * z
    for i in range(1, P):
        for c in range(3):
            f[TURN0 - 3 + 3 * i + c] = -s.fp[e * P + i, c]
    k = SIZE - 1
    while k >= OUTER:
        row0, row1, row2 = local[k], local[k - 1], local[k - 2]
        f0 = f[k] * pivots[k]
        f[k - 1] -= f0 * row0[k - 1]
        f1 = f[k - 1] * pivots[k - 1]
        f[k - 2] -= f0 * row0[k - 2] + f1 * row1[k - 2]
        f2 = f[k - 2] * pivots[k - 2]
        for j in range(k - 2):
            f[j] -= f0 * row0[j] + f1 * row1[j] + f2 * row2[j]
        k -= 3


@compiled(**OPTIONS)
def _backward(rod: Rod, s: Solver, e: int, sigma: float) -> None:
    """Increments of the inside of an element from those of its outside, into s.fr, s.fp, s.fn."""
    f, local, pivots = s.local_right[e], s.local[e], s.pivots[e]
    k = OUTER
    while k < SIZE:
        row0, row1, row2 = local[k], local[k + 1], local[k + 2]
        f0 = f1 = f2 = 0.0
        for j in range(k):
            f0 += row0[j] * f[j]
            f1 += row1[j] * f[j]
            f2 += row2[j] * f[j]
        f[k] = (f[k] - f0) * pivots[k]
        f[k + 1] = (f[k + 1] - f1 - row1[k] * f[k]) * pivots[k + 1]
        f[k + 2] = (f[k + 2] - f2 - row2[k] * f[k] - row2[k + 1] * f[k + 1]) * pivots[k + 2]
        k += 3
    for k in range(P):
        for c in range(3):
            s.fn[e, k, c] = f[N0 + 3 * k + c]
    for i in range(1, P):
        node = e * P + i
        inverse = 1.0 / (rod.mass[e, i] * sigma)
        for c in range(3):
            s.fp[node, c] = f[TURN0 - 3 + 3 * i + c]
            total = s.fr[node, c]
            for k in range(P):
                total += rod.coupling[e, k, i] * f[N0 + 3 * k + c]
            s.fr[node, c] = -total * inverse


@compiled(**OPTIONS)
def solve(rod: Rod, s: Solver, sigma: float) -> None:
    """Overwrite the residuals s.fr, s.fp, s.fn by the increments that would take them to 0."""
    elements = s.local.shape[0]
    count = 6 * (elements - 1)
    right = s.right
    for e in range(elements - 1):
        node = (e + 1) * P
        for c in range(3):
            right[6 * e + c] = -s.fr[node, c]
            right[6 * e + 3 + c] = -s.fp[node, c]
    for e in range(elements):
        _forward(rod, s, e, sigma)
        first = 6 * (e - 1)
        for i in range(12):
            if 0 <= first + i < count:
                right[first + i] += s.local_right[e, i]
    for k in range(count):
        row = s.band[k]
        factor = right[k] * row[0]
        for d in range(1, WIDTH + 1):
            right[k + d] -= factor * row[d]
    for d in range(WIDTH):
        right[count + d] = 0.0
    for k in range(count - 1, -1, -1):
        row = s.band[k]
        total = 0.0
        for d in range(1, WIDTH + 1):
            total += row[d] * right[k + d]
        right[k] = (right[k] - total) * row[0]
    for e in range(elements):
        first = 6 * (e - 1)
        for i in range(12):
            s.local_right[e, i] = right[first + i] if 0 <= first + i < count else 0.0
        _backward(rod, s, e, sigma)
    for e in range(elements - 1):
        node = (e + 1) * P
        for c in range(3):
            s.fr[node, c] = right[6 * e + c]
            s.fp[node, c] = right[6 * e + 3 + c]
    last = elements * P
    for c in range(3):
        s.fr[0, c] = s.fr[last, c] = 0.0
        s.fp[0, c] = s.fp[last, c] = 0.0
