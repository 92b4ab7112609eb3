"""The linear solver of the elastica in motion: static condensation of elements, then a band."""

from __future__ import annotations

from ribbonfem.jit.decorator import compiled
from ribbonfem.jit.groups import INLINED, OPTIONS
from ribbonfem.jit.simd import WIDTH, load, spread, store
from ribbonfem.linalg.blocks import gather_of, invert_of
from ribbonfem.results import Array

from .beam import AS_LEFT, AS_RIGHT, FORCE, N0, OUTER, PHI, SIZE, THREE, TURN0, TURNS, Beam, P, Solver, Z

_gather, _invert = gather_of(AS_LEFT, AS_RIGHT), invert_of(THREE)


@compiled(**INLINED)
def _eliminate(local: Array, pivots: Array, group: int) -> None:
    """L D L^T of the inside of a group's elements, from the last row up, two rows at a time.

    Row k of the factors is D times row k of L^T; the rows of the outside are left with their
    Schur complement.
    """
    k = SIZE - 1
    while k >= OUTER:
        first = TURNS if k >= TURN0 else 0
        inverse0 = 1.0 / load(local, (group, k, k))
        factor = load(local, (group, k, k - 1)) * inverse0
        for j in range(first, k):
            taken = factor * load(local, (group, k, j))
            store(local, (group, k - 1, j), load(local, (group, k - 1, j)) - taken)
        inverse1 = 1.0 / load(local, (group, k - 1, k - 1))
        store(pivots, (group, k), inverse0)
        store(pivots, (group, k - 1), inverse1)
        # two rows of what is left at once; what this writes above the diagonal is not read
        for i in range(first, k - 1, 2):
            a0, a1 = load(local, (group, k, i)) * inverse0, load(local, (group, k - 1, i)) * inverse1
            b0, b1 = load(local, (group, k, i + 1)) * inverse0, load(local, (group, k - 1, i + 1)) * inverse1
            for j in range(first, i + 2):
                x, y = load(local, (group, k, j)), load(local, (group, k - 1, j))
                store(local, (group, i, j), load(local, (group, i, j)) - a0 * x - a1 * y)
                store(local, (group, i + 1, j), load(local, (group, i + 1, j)) - b0 * x - b1 * y)
        k -= 2


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
            for j in range(THREE):
                a, b, c = after[0, j], after[1, j], after[2, j]
                x = own[0, 0] * a + own[0, 1] * b + own[0, 2] * c
                y = own[1, 0] * a + own[1, 1] * b + own[1, 2] * c
                z = own[2, 0] * a + own[2, 1] * b + own[2, 2] * c
                # (column j of the block is not needed any more once its product is with the columns behind)
                for i in range(j, THREE):
                    new[i, j] -= after[0, i] * x + after[1, i] * y + after[2, i] * z
                    new[j, i] = new[i, j]
                after[0, j], after[1, j], after[2, j] = x, y, z


@compiled(**INLINED)
def _right_hand_side(beam: Beam, s: Solver, group: int, sigma: float) -> None:
    """What stands against a group's rows, r inside of its elements eliminated, in s.local_right."""
    f, rest, inverse = s.local_right, s.rest, 1.0 / sigma
    for c in range(2):
        store(f, (group, c), -load(rest, (group, Z * c)))
        store(f, (group, 2 + c), -load(rest, (group, Z * c + P)))
    store(f, (group, 4), -load(rest, (group, PHI)))
    store(f, (group, 5), -load(rest, (group, PHI + P)))
    for i in range(1, P):
        store(f, (group, TURN0 - 1 + i), -load(rest, (group, PHI + i)))
    for k in range(P):
        x, z = -load(rest, (group, FORCE + 2 * k)), -load(rest, (group, FORCE + 2 * k + 1))
        for i in range(1, P):
            share = inverse * beam.inside[k, i]
            x += share * load(rest, (group, i))
            z += share * load(rest, (group, Z + i))
        store(f, (group, N0 + 2 * k), x)
        store(f, (group, N0 + 2 * k + 1), z)


@compiled(**INLINED)
def _forward(s: Solver) -> None:
    """Eliminate the inside of the elements from s.local_right, a row of all groups after the other.

    No group waits for another.
    """
    f, local, pivots = s.local_right, s.local, s.pivots
    k = SIZE - 1
    while k >= OUTER:
        for group in range(f.shape[0]):
            f0 = load(f, (group, k)) * load(pivots, (group, k))
            right = load(f, (group, k - 1)) - f0 * load(local, (group, k, k - 1))
            f1 = right * load(pivots, (group, k - 1))
            store(f, (group, k - 1), right)
            for j in range(TURNS if k >= TURN0 else 0, k - 1):
                taken = f0 * load(local, (group, k, j)) + f1 * load(local, (group, k - 1, j))
                store(f, (group, j), load(f, (group, j)) - taken)
        k -= 2


@compiled(**INLINED)
def _backward(s: Solver) -> None:
    """Increments of the inside of the elements from those of their outside, in s.local_right."""
    f, local, pivots = s.local_right, s.local, s.pivots
    zero = spread(0.0)
    k = OUTER
    while k < SIZE:
        for group in range(f.shape[0]):
            # (two sums of each: they do not wait for each other)
            a0 = a1 = b0 = b1 = zero
            for j in range(TURNS if k >= TURN0 else 0, k, 2):
                x, y = load(f, (group, j)), load(f, (group, j + 1))
                a0 += load(local, (group, k, j)) * x
                a1 += load(local, (group, k + 1, j)) * x
                b0 += load(local, (group, k, j + 1)) * y
                b1 += load(local, (group, k + 1, j + 1)) * y
            x0 = (load(f, (group, k)) - a0 - b0) * load(pivots, (group, k))
            x1 = load(f, (group, k + 1)) - a1 - b1 - load(local, (group, k + 1, k)) * x0
            store(f, (group, k), x0)
            store(f, (group, k + 1), x1 * load(pivots, (group, k + 1)))
        k += 2


@compiled(**INLINED)
def _scatter(beam: Beam, s: Solver, group: int, sigma: float) -> None:
    """Increments of a group from s.local_right into s.rest; of r inside from those of n."""
    f, rest, inverse = s.local_right, s.rest, -1.0 / sigma
    for c in range(2):
        store(rest, (group, Z * c), load(f, (group, c)))
        store(rest, (group, Z * c + P), load(f, (group, 2 + c)))
    store(rest, (group, PHI), load(f, (group, 4)))
    store(rest, (group, PHI + P), load(f, (group, 5)))
    for i in range(1, P):
        lump = beam.inverse_mass[i]
        x, z = lump * load(rest, (group, i)), lump * load(rest, (group, Z + i))
        for k in range(P):
            x += beam.inside[k, i] * load(f, (group, N0 + 2 * k))
            z += beam.inside[k, i] * load(f, (group, N0 + 2 * k + 1))
        store(rest, (group, i), inverse * x)
        store(rest, (group, Z + i), inverse * z)
        store(rest, (group, PHI + i), load(f, (group, TURN0 - 1 + i)))
    for k in range(2 * P):
        store(rest, (group, FORCE + k), load(f, (group, N0 + k)))


@compiled(**INLINED)
def _between(s: Solver, elements: int) -> None:
    """Increments of the nodes between elements; those of the clamped ones are none."""
    right = s.right
    for i in range(THREE):
        right[0, i] = right[elements, i] = 0.0
    for e in range(1, elements):
        group, lane, after, place = (e - 1) // WIDTH, (e - 1) % WIDTH, e // WIDTH, e % WIDTH
        for i in range(THREE):
            total = s.local_right[group, AS_RIGHT[i], lane] + s.local_right[after, AS_LEFT[i], place]
            if e > 1:
                block = s.next[e - 1]
                total -= block[0, i] * right[e - 1, 0] + block[1, i] * right[e - 1, 1]
                total -= block[2, i] * right[e - 1, 2]
            right[e, i] = total
    x = y = z = 0.0
    for e in range(elements - 1, 0, -1):
        own, after = s.own[e], s.next[e]
        a, b, c = right[e, 0], right[e, 1], right[e, 2]
        for i in range(THREE):
            value = own[i, 0] * a + own[i, 1] * b + own[i, 2] * c
            right[e, i] = value - (after[i, 0] * x + after[i, 1] * y + after[i, 2] * z)
        x, y, z = right[e, 0], right[e, 1], right[e, 2]


@compiled(**OPTIONS)
def solve(beam: Beam, s: Solver, sigma: float) -> None:
    """Overwrite the residual s.rest by the increments that would take it to 0."""
    elements, groups = s.own.shape[0] - 1, s.local.shape[0]
    for group in range(groups):
        _right_hand_side(beam, s, group, sigma)
    _forward(s)
    _between(s, elements)
    for place in range(WIDTH * groups):
        group, lane, e = place // WIDTH, place % WIDTH, min(place, elements - 1)
        for i in range(THREE):
            s.local_right[group, AS_LEFT[i], lane] = s.right[e, i]
            s.local_right[group, AS_RIGHT[i], lane] = s.right[e + 1, i]
    _backward(s)
    for group in range(groups):
        _scatter(beam, s, group, sigma)
