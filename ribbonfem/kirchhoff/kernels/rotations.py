"""Rotations of the nodes' frames by increments, as unit quaternions; rotation vectors between two states."""

from __future__ import annotations

import math

from ribbonfem.jit.algebra import (
    Quaternion,
    Value,
    Vector,
    between,
    by_vector,
    dot,
    dot4,
    mix4,
    put_triple,
    quaternion,
    scaled,
    scaled4,
)
from ribbonfem.jit.decorator import compiled
from ribbonfem.jit.simd import WIDTH, all_below, lane, load, root, store, transposed
from ribbonfem.results import Array

from .batch import INLINED, OPTIONS

# half an angle squared below which a series has all digits of its sine and cosine
_SMALL = 1e-4
# tangent squared below which one has all digits of its angle
_FLAT = 1e-2


@compiled(**INLINED)
def _series(square: Value) -> tuple[Value, Value]:
    """sin(y) / (2 y) and cos(y), to the last digit for y^2 = square below `_SMALL`."""
    half = 0.5 - square * (1.0 / 12.0 - square * (1.0 / 240.0 - square * (1.0 / 10080.0)))
    cosine = 1.0 - square * (0.5 - square * (1.0 / 24.0 - square * (1.0 / 720.0)))
    return half, cosine


@compiled(**INLINED)
def _rotated(g: Quaternion, half: Value, cosine: Value, psi: Vector) -> Quaternion:
    """g (cosine, half psi), of length 1."""
    new = mix4(g, cosine, by_vector(g, psi), half)
    # rounding would let the length drift over thousands of increments
    return scaled4(1.5 - 0.5 * dot4(new, new), new)


@compiled(**INLINED)
def rotate(g: Array, i: int, a: float, b: float, c: float) -> None:
    """g <- g exp(psi / 2) at node i, with psi = (a, b, c)."""
    square = 0.25 * (a * a + b * b + c * c)
    half, cosine = _series(square)
    if square >= _SMALL:
        angle = math.sqrt(square)
        half, cosine = 0.5 * math.sin(angle) / angle, math.cos(angle)
    g[i, 0], g[i, 1], g[i, 2], g[i, 3] = _rotated(quaternion(g, i), half, cosine, (a, b, c))


@compiled(**INLINED)
def _rows(array: Array, i: int) -> tuple[Value, Value, Value, Value]:
    """The four columns of rows i to i + 3."""
    return transposed(load(array, (i,)), load(array, (i + 1,)), load(array, (i + 2,)), load(array, (i + 3,)))


@compiled(**INLINED)
def _put_rows(array: Array, i: int, a: Value, b: Value, c: Value, d: Value) -> None:
    """The reverse of `_rows`."""
    rows = transposed(a, b, c, d)
    store(array, (i,), rows[0])
    store(array, (i + 1,), rows[1])
    store(array, (i + 2,), rows[2])
    store(array, (i + 3,), rows[3])


@compiled(**INLINED)
def normalise_inner(g: Array) -> None:
    """Give the quaternions of all nodes but the clamped ones the length 1."""
    i, right = 1, g.shape[0] - 1
    while i < right:
        if i + WIDTH <= right:
            four = _rows(g, i)
            four = scaled4(1.0 / root(dot4(four, four)), four)
            _put_rows(g, i, four[0], four[1], four[2], four[3])
            i += WIDTH
        else:
            q = quaternion(g, i)
            g[i, 0], g[i, 1], g[i, 2], g[i, 3] = scaled4(1.0 / math.sqrt(dot4(q, q)), q)
            i += 1


@compiled(**INLINED)
def rotate_inner(g: Array, psi: Array) -> None:
    """`rotate` at all nodes but the clamped ones, by psi (nodes, 4), whose last column does not count."""
    i, right = 1, g.shape[0] - 1
    while i < right:
        if i + WIDTH <= right:
            a, b, c, _ = _rows(psi, i)
            square = 0.25 * (a * a + b * b + c * c)
            if all_below(square, _SMALL):
                half, cosine = _series(square)
                new = _rotated(_rows(g, i), half, cosine, (a, b, c))
                _put_rows(g, i, new[0], new[1], new[2], new[3])
                i += WIDTH
                continue
        rotate(g, i, psi[i, 0], psi[i, 1], psi[i, 2])
        i += 1


@compiled(**INLINED)
def _about(g0: Quaternion, g: Quaternion) -> tuple[Value, Value]:
    """Of conj(g0) g, what is along 1 and what is about the tangent."""
    return dot4(g0, g), between(g0, g)[0]


@compiled(**INLINED)
def twists(g0: Array, g: Array, x: Array) -> None:
    """theta of the inner nodes into x[:, 3]: of conj(g0) g about the tangent, in (-pi, pi]."""
    i, right = 1, g.shape[0] - 1
    while i < right:
        if i + WIDTH <= right:
            along, across = _about(_rows(g0, i), _rows(g, i))
            ratio = across / along
            square = ratio * ratio
            if all_below(square, _FLAT):
                total = 1.0 / 13.0 - square * (1.0 / 15.0)
                total = 1.0 / 9.0 - square * (1.0 / 11.0 - square * total)
                total = 1.0 / 5.0 - square * (1.0 / 7.0 - square * total)
                total = 2.0 * ratio * (1.0 - square * (1.0 / 3.0 - square * total))
                x[i, 3], x[i + 1, 3], x[i + 2, 3], x[i + 3, 3] = (
                    lane(total, 0),
                    lane(total, 1),
                    lane(total, 2),
                    lane(total, 3),
                )
                i += WIDTH
                continue
        along, across = _about(quaternion(g0, i), quaternion(g, i))
        x[i, 3] = 2.0 * (math.atan2(across, along) if along >= 0.0 else math.atan2(-across, -along))
        i += 1


@compiled(**OPTIONS)
def turn_between(g0: Array, g: Array, i: int, psi: Array) -> None:
    """psi[i] (3,), the shortest turn with g = g0 exp(psi / 2) at node i."""
    before, after = quaternion(g0, i), quaternion(g, i)
    cosine, turn = dot4(before, after), between(before, after)
    sine = math.sqrt(dot(turn, turn))
    factor = 2.0 * math.atan2(sine, abs(cosine)) / sine if sine > 1e-150 else 2.0
    put_triple(scaled(factor if cosine >= 0.0 else -factor, turn), psi, i)
