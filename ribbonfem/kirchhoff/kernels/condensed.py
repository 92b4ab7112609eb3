"""Elimination inside the elements of a Kirchhoff rod, and the band that is left (see `tangent`)."""

from __future__ import annotations

from ribbonfem.compiled.copies import copy
from ribbonfem.compiled.decorator import compiled
from ribbonfem.results import Array

from .tangent import INLINED, N0, OPTIONS, OUTER, SIX, SIZE, TURN0, P, Rod, Solver


@compiled(**INLINED)
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


@compiled(**INLINED)
def _invert(block: Array) -> None:
    """The inverse of a block in its place, by sweeps without pivots."""
    for k in range(SIX):
        inverse = 1.0 / block[k, k]
        for i in range(SIX):
            if i != k:
                factor = block[i, k] * inverse
                for j in range(SIX):
                    if j != k:
                        block[i, j] -= factor * block[k, j]
        for j in range(SIX):
            if j != k:
                block[j, k] *= -inverse
                block[k, j] *= inverse
        block[k, k] = inverse


@compiled(**OPTIONS)
def factorise(s: Solver) -> None:
    """Eliminate the inside of every element in s.local, then one node between them after the other.

    Left of a node is the inverse of its own block in s.own, and that times its block with the next in s.next.
    """
    elements = s.local.shape[0]
    for e in range(elements):
        local = s.local[e]
        _eliminate(local, s.pivots[e])
        own, after, new = s.own[e], s.next[e], s.own[e + 1]
        for i in range(SIX):
            for j in range(i + 1):
                own[i, j] = own[j, i] = local[i, j] + (own[i, j] if e > 0 else 0.0)
                new[i, j] = local[SIX + i, SIX + j]
            for j in range(SIX):
                after[j, i] = local[SIX + i, j]
    for e in range(1, elements):
        own, after, new = s.own[e], s.next[e], s.own[e + 1]
        _invert(own)
        if e + 1 < elements:
            for i in range(SIX):
                for j in range(SIX):
                    total = 0.0
                    for k in range(SIX):
                        total += own[i, k] * after[k, j]
                    s.block[i, j] = total
            for i in range(SIX):
                for j in range(SIX):
                    total = new[i, j]
                    for k in range(SIX):
                        total -= after[k, i] * s.block[k, j]
                    new[i, j] = total
            copy(s.block, after)


@compiled(**INLINED)
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


@compiled(**INLINED)
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


@compiled(**INLINED)
def _take(block: Array, x: Array, y: Array) -> None:
    """y -= block^T x."""
    y0, y1, y2, y3, y4, y5 = y[0], y[1], y[2], y[3], y[4], y[5]
    for k in range(SIX):
        row, factor = block[k], x[k]
        y0 -= factor * row[0]
        y1 -= factor * row[1]
        y2 -= factor * row[2]
        y3 -= factor * row[3]
        y4 -= factor * row[4]
        y5 -= factor * row[5]
    y[0], y[1], y[2], y[3], y[4], y[5] = y0, y1, y2, y3, y4, y5


@compiled(**INLINED)
def _back(own: Array, after: Array, x: Array, y: Array) -> None:
    """x <- own x - after y."""
    x0, x1, x2, x3, x4, x5 = x[0], x[1], x[2], x[3], x[4], x[5]
    y0, y1, y2, y3, y4, y5 = y[0], y[1], y[2], y[3], y[4], y[5]
    for i in range(SIX):
        a, b = own[i], after[i]
        x[i] = (a[0] * x0 + a[1] * x1 + a[2] * x2 + a[3] * x3 + a[4] * x4 + a[5] * x5) - (
            b[0] * y0 + b[1] * y1 + b[2] * y2 + b[3] * y3 + b[4] * y4 + b[5] * y5
        )


@compiled(**OPTIONS)
def solve(rod: Rod, s: Solver, sigma: float) -> None:
    """Overwrite the residuals s.fr, s.fp, s.fn by the increments that would take them to 0."""
    elements = s.local.shape[0]
    for e in range(elements + 1):
        node = e * P
        for c in range(3):
            s.right[e, c] = -s.fr[node, c]
            s.right[e, 3 + c] = -s.fp[node, c]
    for e in range(elements):
        _forward(rod, s, e, sigma)
        for i in range(SIX):
            s.right[e, i] += s.local_right[e, i]
            s.right[e + 1, i] += s.local_right[e, SIX + i]
    for e in range(1, elements - 1):
        _take(s.next[e], s.right[e], s.right[e + 1])
    for i in range(SIX):
        s.right[0, i] = s.right[elements, i] = 0.0
    for e in range(elements - 1, 0, -1):
        _back(s.own[e], s.next[e], s.right[e], s.right[e + 1])
    for e in range(elements):
        for i in range(SIX):
            s.local_right[e, i] = s.right[e, i]
            s.local_right[e, SIX + i] = s.right[e + 1, i]
        _backward(rod, s, e, sigma)
    for e in range(elements + 1):
        node = e * P
        for c in range(3):
            s.fr[node, c] = s.right[e, c]
            s.fp[node, c] = s.right[e, 3 + c]
