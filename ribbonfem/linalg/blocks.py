"""Blocks that static condensation leaves between neighbouring elements: gathered by nodes, and inverted."""

from __future__ import annotations

from collections.abc import Callable

from ribbonfem.jit.decorator import compiled
from ribbonfem.jit.groups import INLINED
from ribbonfem.jit.simd import WIDTH
from ribbonfem.results import Array


def gather_of(as_left: tuple[int, ...], as_right: tuple[int, ...]) -> Callable[[Array, Array, Array], None]:
    """Gathering of blocks; `as_left` and `as_right` are a node's rows in its left and its right element."""
    size = len(as_left)

    def gather(local: Array, own: Array, following: Array) -> None:
        """Put what elimination left of the elements together, node by node.

        local (G, rows, rows, WIDTH), lower triangles; own and following (E + 1, size, size), of each node
        with itself and with the next.
        """
        for e in range(own.shape[0] - 1):
            group, lane = e // WIDTH, e % WIDTH
            old, after, new = own[e], following[e], own[e + 1]
            for i in range(size):
                left, right = as_left[i], as_right[i]
                for j in range(i + 1):
                    before = old[i, j] if e > 0 else 0.0
                    old[i, j] = old[j, i] = before + local[group, left, as_left[j], lane]
                    new[i, j] = new[j, i] = local[group, right, as_right[j], lane]
                for j in range(size):
                    # (of the two the row is the later one)
                    row, column = max(right, as_left[j]), min(right, as_left[j])
                    after[j, i] = local[group, row, column, lane]

    gathering: Callable[[Array, Array, Array], None] = compiled(**INLINED)(gather)
    return gathering


def invert_of(size: int) -> Callable[[Array], None]:
    """Inversion of blocks (size, size)."""

    def invert(block: Array) -> None:
        """The inverse of a block in its place, by sweeps without pivots."""
        for k in range(size):
            inverse = 1.0 / block[k, k]
            for i in range(size):
                if i != k:
                    factor = block[i, k] * inverse
                    for j in range(size):
                        if j != k:
                            block[i, j] -= factor * block[k, j]
            for j in range(size):
                if j != k:
                    block[j, k] *= -inverse
                    block[k, j] *= inverse
            block[k, k] = inverse

    inverting: Callable[[Array], None] = compiled(**INLINED)(invert)
    return inverting
