"""Static condensation of the inner nodes of each element of a Kirchhoff rod, and the band that is left."""

from __future__ import annotations

from typing import Any

from ribbonfem.jit.decorator import compiled
from ribbonfem.jit.simd import WIDTH, load, spread, store
from ribbonfem.linalg.array_ops import copy
from ribbonfem.linalg.blocks import gather_of, invert_of
from ribbonfem.results import Array

from .batch import INLINED, OPTIONS, add_to_nodes, of_nodes
from .rod import (
    AS_LEFT,
    AS_RIGHT,
    N0,
    OUTER,
    SIX,
    SIZE,
    TURN0,
    TURNS,
    P,
    Rod,
    Solver,
)

_gather, _invert = gather_of(AS_LEFT, AS_RIGHT), invert_of(SIX)


@compiled(**INLINED)
def _eliminate(local: Array, pivots: Array, group: int) -> None:
    """L D L^T of the inside of a group's elements, from the last row up, three rows at a time.

    Row k of the factors is D times row k of L^T; the rows of the outside are left with their
    Schur complement.
    """
    k = SIZE - 1
    while k >= OUTER:
        first = TURNS if k >= TURN0 else 0
        inverse0 = 1.0 / load(local, (group, k, k))
        f0, f1 = load(local, (group, k, k - 1)) * inverse0, load(local, (group, k, k - 2)) * inverse0
        for j in range(first, k):
            store(local, (group, k - 1, j), load(local, (group, k - 1, j)) - f0 * load(local, (group, k, j)))
        inverse1 = 1.0 / load(local, (group, k - 1, k - 1))
        f0 = load(local, (group, k - 1, k - 2)) * inverse1
        for j in range(first, k - 1):
            taken = f1 * load(local, (group, k, j)) + f0 * load(local, (group, k - 1, j))
            store(local, (group, k - 2, j), load(local, (group, k - 2, j)) - taken)
        inverse2 = 1.0 / load(local, (group, k - 2, k - 2))
        store(pivots, (group, k), inverse0)
        store(pivots, (group, k - 1), inverse1)
        store(pivots, (group, k - 2), inverse2)
        # three rows of what is left at once; what this writes above the diagonal is not read
        for i in range(first, k - 2, 3):
            a0, a1, a2 = _factors(local, group, k, i, inverse0, inverse1, inverse2)
            b0, b1, b2 = _factors(local, group, k, i + 1, inverse0, inverse1, inverse2)
            c0, c1, c2 = _factors(local, group, k, i + 2, inverse0, inverse1, inverse2)
            for j in range(first, i + 3):
                x, y = load(local, (group, k, j)), load(local, (group, k - 1, j))
                z = load(local, (group, k - 2, j))
                store(local, (group, i, j), load(local, (group, i, j)) - a0 * x - a1 * y - a2 * z)
                store(local, (group, i + 1, j), load(local, (group, i + 1, j)) - b0 * x - b1 * y - b2 * z)
                store(local, (group, i + 2, j), load(local, (group, i + 2, j)) - c0 * x - c1 * y - c2 * z)
        k -= 3


@compiled(**INLINED)
def _factors(
    local: Array, group: int, k: int, i: int, inverse0: Any, inverse1: Any, inverse2: Any
) -> tuple[Any, Any, Any]:
    """Column i of three rows of L^T."""
    return (
        load(local, (group, k, i)) * inverse0,
        load(local, (group, k - 1, i)) * inverse1,
        load(local, (group, k - 2, i)) * inverse2,
    )


@compiled(**OPTIONS)
def factorise(s: Solver) -> None:
    """Eliminate the inside of every element in s.local, then one node between them after the other.

    Left of a node is the inverse of its own block in s.own, and that times its block with the next in s.next.
    """
    elements = s.own.shape[0] - 1
    for group in range(s.local.shape[0]):
        _eliminate(s.local, s.pivots, group)
    _gather(s.local, s.own, s.next)
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
def _right_hand_side(rod: Rod, s: Solver, group: int, last: int, sigma: float) -> None:
    """What stands against a group's rows, r inside of its elements eliminated, in s.local_right."""
    f, zero = s.local_right, spread(0.0)
    for i in range(OUTER):
        store(f, (group, i), zero)
    for i in range(1, P):
        a, b, c, _ = of_nodes(s.fr, group, last, P, i)
        inverse = (1.0 / sigma) / load(rod.groups.mass, (group, i))
        store(s.places, (i, 0), inverse * a)
        store(s.places, (i, 1), inverse * b)
        store(s.places, (i, 2), inverse * c)
        a, b, c, _ = of_nodes(s.fp, group, last, P, i)
        store(f, (group, TURN0 - 3 + 3 * i), -a)
        store(f, (group, TURN0 - 2 + 3 * i), -b)
        store(f, (group, TURN0 - 1 + 3 * i), -c)
    for k in range(P):
        x, y, z = -load(s.fn, (group, k, 0)), -load(s.fn, (group, k, 1)), -load(s.fn, (group, k, 2))
        for i in range(1, P):
            coupling = load(rod.groups.coupling, (group, k, i))
            x += coupling * load(s.places, (i, 0))
            y += coupling * load(s.places, (i, 1))
            z += coupling * load(s.places, (i, 2))
        store(f, (group, N0 + 3 * k), x)
        store(f, (group, N0 + 3 * k + 1), y)
        store(f, (group, N0 + 3 * k + 2), z)


@compiled(**INLINED)
def _forward(s: Solver, group: int) -> None:
    """Eliminate the inside of a group's elements from s.local_right."""
    f, local, pivots = s.local_right, s.local, s.pivots
    k = SIZE - 1
    while k >= OUTER:
        f0 = load(f, (group, k)) * load(pivots, (group, k))
        right1 = load(f, (group, k - 1)) - f0 * load(local, (group, k, k - 1))
        f1 = right1 * load(pivots, (group, k - 1))
        right2 = load(f, (group, k - 2)) - f0 * load(local, (group, k, k - 2))
        right2 -= f1 * load(local, (group, k - 1, k - 2))
        f2 = right2 * load(pivots, (group, k - 2))
        store(f, (group, k - 1), right1)
        store(f, (group, k - 2), right2)
        for j in range(TURNS if k >= TURN0 else 0, k - 2, 3):
            _take_rows(f, local, group, k, j, f0, f1, f2)
            _take_rows(f, local, group, k, j + 1, f0, f1, f2)
            _take_rows(f, local, group, k, j + 2, f0, f1, f2)
        k -= 3


@compiled(**INLINED)
def _take_rows(f: Array, local: Array, group: int, k: int, j: int, f0: Any, f1: Any, f2: Any) -> None:
    """Take column j of three rows, each with its factor, from f."""
    taken = f0 * load(local, (group, k, j)) + f1 * load(local, (group, k - 1, j))
    store(f, (group, j), load(f, (group, j)) - taken - f2 * load(local, (group, k - 2, j)))


@compiled(**INLINED)
def _backward(s: Solver, group: int) -> None:
    """Increments of the inside of a group's elements from those of its outside, in s.local_right."""
    f, local, pivots = s.local_right, s.local, s.pivots
    zero = spread(0.0)
    k = OUTER
    while k < SIZE:
        # (three sums of each: they do not wait for each other)
        a0 = a1 = a2 = b0 = b1 = b2 = c0 = c1 = c2 = zero
        for j in range(TURNS if k >= TURN0 else 0, k, 3):
            x, y, z = load(f, (group, j)), load(f, (group, j + 1)), load(f, (group, j + 2))
            a0 += load(local, (group, k, j)) * x
            a1 += load(local, (group, k + 1, j)) * x
            a2 += load(local, (group, k + 2, j)) * x
            b0 += load(local, (group, k, j + 1)) * y
            b1 += load(local, (group, k + 1, j + 1)) * y
            b2 += load(local, (group, k + 2, j + 1)) * y
            c0 += load(local, (group, k, j + 2)) * z
            c1 += load(local, (group, k + 1, j + 2)) * z
            c2 += load(local, (group, k + 2, j + 2)) * z
        x0 = (load(f, (group, k)) - a0 - b0 - c0) * load(pivots, (group, k))
        x1 = load(f, (group, k + 1)) - a1 - b1 - c1 - load(local, (group, k + 1, k)) * x0
        x1 *= load(pivots, (group, k + 1))
        x2 = load(f, (group, k + 2)) - a2 - b2 - c2 - load(local, (group, k + 2, k)) * x0
        x2 = (x2 - load(local, (group, k + 2, k + 1)) * x1) * load(pivots, (group, k + 2))
        store(f, (group, k), x0)
        store(f, (group, k + 1), x1)
        store(f, (group, k + 2), x2)
        k += 3


@compiled(**INLINED)
def _scatter(rod: Rod, s: Solver, group: int, last: int, sigma: float) -> None:
    """Increments of a group from s.local_right into s.fr, s.fp, s.fn; of r inside from those of n."""
    f, zero = s.local_right, spread(0.0)
    for k in range(P):
        for c in range(3):
            store(s.fn, (group, k, c), load(f, (group, N0 + 3 * k + c)))
    for i in range(1, P):
        x, y, z, _ = of_nodes(s.fr, group, last, P, i)
        for k in range(P):
            coupling = load(rod.groups.coupling, (group, k, i))
            x += coupling * load(f, (group, N0 + 3 * k))
            y += coupling * load(f, (group, N0 + 3 * k + 1))
            z += coupling * load(f, (group, N0 + 3 * k + 2))
        inverse = (-1.0 / sigma) / load(rod.groups.mass, (group, i))
        add_to_nodes(s.fr, group, last, P, i, inverse * x, inverse * y, inverse * z, zero, False)
        row = TURN0 - 3 + 3 * i
        x, y, z = load(f, (group, row)), load(f, (group, row + 1)), load(f, (group, row + 2))
        add_to_nodes(s.fp, group, last, P, i, x, y, z, zero, False)


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


@compiled(**INLINED)
def solve(rod: Rod, s: Solver, sigma: float) -> None:
    """Overwrite the residuals s.fr, s.fp, s.fn by the increments that would take them to 0."""
    elements, groups = s.own.shape[0] - 1, s.local.shape[0]
    last = elements - 1
    for e in range(elements + 1):
        node = e * P
        for c in range(3):
            s.right[e, c] = -s.fr[node, c]
            s.right[e, 3 + c] = -s.fp[node, c]
    for group in range(groups):
        _right_hand_side(rod, s, group, last, sigma)
        _forward(s, group)
    for e in range(elements):
        group, lane = e // WIDTH, e % WIDTH
        for i in range(SIX):
            s.right[e, i] += s.local_right[group, AS_LEFT[i], lane]
            s.right[e + 1, i] += s.local_right[group, AS_RIGHT[i], lane]
    for e in range(1, elements - 1):
        _take(s.next[e], s.right[e], s.right[e + 1])
    for i in range(SIX):
        s.right[0, i] = s.right[elements, i] = 0.0
    for e in range(elements - 1, 0, -1):
        _back(s.own[e], s.next[e], s.right[e], s.right[e + 1])
    for place in range(WIDTH * groups):
        group, lane, e = place // WIDTH, place % WIDTH, min(place, last)
        for i in range(SIX):
            s.local_right[group, AS_LEFT[i], lane] = s.right[e, i]
            s.local_right[group, AS_RIGHT[i], lane] = s.right[e + 1, i]
    # (backwards: what was last read is still near)
    for group in range(groups - 1, -1, -1):
        _backward(s, group)
        _scatter(rod, s, group, last, sigma)
    for e in range(elements + 1):
        node = e * P
        for c in range(3):
            s.fr[node, c] = s.right[e, c]
            s.fp[node, c] = s.right[e, 3 + c]
