"""Second derivatives of a group's elements in the rotations of their nodes, from those at Gauss points.

They are summed for the quaternions of every two nodes, 4 by 4 numbers a pair, and turned into those for
rotations once: what a rotation does to a quaternion is in `columns`.
"""

from __future__ import annotations

from typing import Any

from ribbonfem.jit.algebra import Quaternion, Value, Vector
from ribbonfem.jit.decorator import compiled
from ribbonfem.jit.simd import increase, load, spread, store
from ribbonfem.results import Array

from .batch import INLINED


@compiled(**INLINED)
def clear(array: Array, rows: int, columns: int) -> None:
    """Zeros in the first rows and columns of an array (..., ..., WIDTH)."""
    zero = spread(0.0)
    for i in range(rows):
        for j in range(columns):
            store(array, (i, j), zero)


@compiled(**INLINED)
def fill_columns(frames: Array, part: float, columns: Array, degree: int) -> None:
    """Derivatives of the quaternions of a group's nodes by rotations, 4 by 3 numbers in columns (p + 1, 12).

    `part` is 1/2 for rotations, 1 for half of them: g i, g j, g k, an orthonormal basis along the sphere.
    """
    for i in range(degree + 1):
        w, x = part * load(frames, (i, 0)), part * load(frames, (i, 1))
        y, z = part * load(frames, (i, 2)), part * load(frames, (i, 3))
        _put(columns, i, 0, (-x, -y, -z))
        _put(columns, i, 3, (w, -z, y))
        _put(columns, i, 6, (z, w, -x))
        _put(columns, i, 9, (-y, x, w))


@compiled(**INLINED)
def _put(array: Array, row: int, column: int, a: Vector) -> None:
    store(array, (row, column), a[0])
    store(array, (row, column + 1), a[1])
    store(array, (row, column + 2), a[2])


@compiled(**INLINED)
def by_rotation(a: Quaternion, columns: Array, i: int, c: int) -> Value:
    """A derivative in the quaternion of node i as one in component c of its rotation."""
    return (
        a[0] * load(columns, (i, c))
        + a[1] * load(columns, (i, 3 + c))
        + a[2] * load(columns, (i, 6 + c))
        + a[3] * load(columns, (i, 9 + c))
    )


@compiled(**INLINED)
def add_gradient(
    values: Array, k: int, i: int, slope: Value, weight: Value, by: Any, gradient: Array
) -> None:
    """Add a point's share of the derivatives in node i's quaternion; `by` are those in q and in q'."""
    gq, gp = by
    value, slope = weight * values[k, i], weight * slope
    increase(gradient, (i, 0), value * gq[0] + slope * gp[0])
    increase(gradient, (i, 1), value * gq[1] + slope * gp[1])
    increase(gradient, (i, 2), value * gq[2] + slope * gp[2])
    increase(gradient, (i, 3), value * gq[3] + slope * gp[3])


@compiled(**INLINED)
def add_pairs(
    values: Array,
    slopes: Array,
    group: int,
    k: int,
    weight: Value,
    hess: Array,
    of_q: Array,
    of_p: Array,
    pairs: Array,
    degree: int,
) -> None:
    """Add a point's derivatives in the quaternions of two nodes, j <= i, to pairs (p + 1, p + 1, 16)."""
    for j in range(degree + 1):
        value, slope = weight * values[k, j], weight * load(slopes, (group, k, j))
        for r in range(4):
            for c in range(4):
                qq, qp = load(hess, (8 * r + c,)), load(hess, (8 * r + 4 + c,))
                pq, pp = load(hess, (8 * c + 4 + r,)), load(hess, (8 * r + 36 + c,))
                store(of_q, (j, 4 * r + c), value * qq + slope * qp)
                store(of_p, (j, 4 * r + c), value * pq + slope * pp)
    for i in range(degree + 1):
        value, slope = values[k, i], load(slopes, (group, k, i))
        for j in range(i + 1):
            for c in range(16):
                increase(pairs, (i, j, c), value * load(of_q, (j, c)) + slope * load(of_p, (j, c)))


@compiled(**INLINED)
def pair_by_rotations(pairs: Array, columns: Array, i: int, j: int, c: int) -> Vector:
    """The derivatives in component c of the rotation of node i and in those of node j <= i."""
    v0 = v1 = v2 = v3 = spread(0.0)
    for r in range(4):
        left = load(columns, (i, 3 * r + c))
        v0 += left * load(pairs, (i, j, 4 * r))
        v1 += left * load(pairs, (i, j, 4 * r + 1))
        v2 += left * load(pairs, (i, j, 4 * r + 2))
        v3 += left * load(pairs, (i, j, 4 * r + 3))
    v = v0, v1, v2, v3
    return by_rotation(v, columns, j, 0), by_rotation(v, columns, j, 1), by_rotation(v, columns, j, 2)


@compiled(**INLINED)
def radial(gradient: Array, frames: Array, i: int) -> Value:
    """The gradient along node i's quaternion: a rotation keeps it on its sphere, a second-order term."""
    total = spread(0.0)
    for c in range(4):
        total += load(gradient, (i, c)) * load(frames, (i, c))
    return total
