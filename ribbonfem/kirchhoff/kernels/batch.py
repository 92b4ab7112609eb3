"""Gathering: values of a rod's nodes into arrays of its elements, four at a time (`jit.groups`)."""

from __future__ import annotations

from typing import Any

from ribbonfem.jit.decorator import compiled
from ribbonfem.jit.groups import INLINED, OPTIONS, groups_of, in_groups
from ribbonfem.jit.simd import WIDTH, load, store, transposed
from ribbonfem.results import Array

__all__ = [
    "INLINED",
    "OPTIONS",
    "WIDTH",
    "add_to_nodes",
    "force_at",
    "gather",
    "groups_of",
    "in_groups",
    "of_nodes",
]


@compiled(**INLINED)
def of_nodes(array: Array, group: int, last: int, degree: int, i: int) -> tuple[Any, Any, Any, Any]:
    """The four columns of array (nodes, 4) at node i of a group's elements; `last` is the mesh's last one."""
    e = WIDTH * group
    return transposed(
        load(array, (min(e, last) * degree + i,)),
        load(array, (min(e + 1, last) * degree + i,)),
        load(array, (min(e + 2, last) * degree + i,)),
        load(array, (min(e + 3, last) * degree + i,)),
    )


@compiled(**INLINED)
def gather(array: Array, group: int, last: int, degree: int, values: Array) -> None:
    """What array (nodes, 4) has at the nodes of a group, into values (degree + 1, 4, WIDTH)."""
    for i in range(degree + 1):
        a, b, c, d = of_nodes(array, group, last, degree, i)
        store(values, (i, 0), a)
        store(values, (i, 1), b)
        store(values, (i, 2), c)
        store(values, (i, 3), d)


@compiled(**INLINED)
def add_to_nodes(
    array: Array, group: int, last: int, degree: int, i: int, a: Any, b: Any, c: Any, d: Any, kept: bool
) -> None:
    """The reverse: add four values to array, or put them there if what was is not `kept`."""
    rows = transposed(a, b, c, d)
    e = WIDTH * group
    node = e * degree + i
    _add(array, node, rows[0], kept)
    if e + 1 <= last:
        _add(array, node + degree, rows[1], kept)
    if e + 2 <= last:
        _add(array, node + 2 * degree, rows[2], kept)
    if e + 3 <= last:
        _add(array, node + 3 * degree, rows[3], kept)


@compiled(**INLINED)
def _add(array: Array, node: int, row: Any, kept: bool) -> None:
    store(array, (node,), load(array, (node,)) + row if kept else row)


@compiled(**INLINED)
def force_at(n: Array, group: int, k: int) -> tuple[Any, Any, Any]:
    """A force n (G, P, 3, WIDTH) at a Gauss point of a group."""
    return load(n, (group, k, 0)), load(n, (group, k, 1)), load(n, (group, k, 2))
