"""Vector and quaternion algebra for compiled code, on tuples of numbers of one element or of four.

A quaternion is (w, x, y, z); a unit one turns vectors, v -> q v q*, and i, j, k to the axes of its body.
"""

from __future__ import annotations

from typing import Any

from ribbonfem.results import Array

from .decorator import compiled

# a number of one element, or those of four
Value = Any
Vector = tuple[Value, Value, Value]
Quaternion = tuple[Value, Value, Value, Value]

# what kernels of every package allow, so that all of them can take it in
_INLINED: dict[str, Any] = {"fastmath": {"contract"}, "inline": True}


@compiled(**_INLINED)
def triple(array: Array, i: int) -> Vector:
    """The first three of row i of an array."""
    return array[i, 0], array[i, 1], array[i, 2]


@compiled(**_INLINED)
def quaternion(array: Array, i: int) -> Quaternion:
    """Row i of an array."""
    return array[i, 0], array[i, 1], array[i, 2], array[i, 3]


@compiled(**_INLINED)
def put_triple(a: Vector, array: Array, i: int) -> None:
    """The reverse of `triple`."""
    array[i, 0], array[i, 1], array[i, 2] = a[0], a[1], a[2]


@compiled(**_INLINED)
def dot(a: Vector, b: Vector) -> Value:
    """a.b"""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@compiled(**_INLINED)
def cross(a: Vector, b: Vector) -> Vector:
    """a x b"""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@compiled(**_INLINED)
def mix(a: Vector, p: Value, b: Vector, q: Value) -> Vector:
    """p a + q b"""
    return p * a[0] + q * b[0], p * a[1] + q * b[1], p * a[2] + q * b[2]


@compiled(**_INLINED)
def scaled(p: Value, a: Vector) -> Vector:
    """p a"""
    return p * a[0], p * a[1], p * a[2]


@compiled(**_INLINED)
def dot4(a: Quaternion, b: Quaternion) -> Value:
    """a.b, of quaternions."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]


@compiled(**_INLINED)
def scaled4(p: Value, a: Quaternion) -> Quaternion:
    """p a, of a quaternion."""
    return p * a[0], p * a[1], p * a[2], p * a[3]


@compiled(**_INLINED)
def mix4(a: Quaternion, p: Value, b: Quaternion, q: Value) -> Quaternion:
    """p a + q b, of quaternions."""
    return p * a[0] + q * b[0], p * a[1] + q * b[1], p * a[2] + q * b[2], p * a[3] + q * b[3]


@compiled(**_INLINED)
def by_vector(q: Quaternion, v: Vector) -> Quaternion:
    """The product q v."""
    return (
        -(q[1] * v[0] + q[2] * v[1] + q[3] * v[2]),
        q[0] * v[0] + q[2] * v[2] - q[3] * v[1],
        q[0] * v[1] + q[3] * v[0] - q[1] * v[2],
        q[0] * v[2] + q[1] * v[1] - q[2] * v[0],
    )


@compiled(**_INLINED)
def of_vector(v: Vector, q: Quaternion) -> Quaternion:
    """The product v q."""
    return (
        -(v[0] * q[1] + v[1] * q[2] + v[2] * q[3]),
        v[0] * q[0] + v[1] * q[3] - v[2] * q[2],
        v[1] * q[0] + v[2] * q[1] - v[0] * q[3],
        v[2] * q[0] + v[0] * q[2] - v[1] * q[1],
    )


@compiled(**_INLINED)
def by_i(q: Quaternion) -> Quaternion:
    """The product q i."""
    return -q[1], q[0], q[3], -q[2]


@compiled(**_INLINED)
def between(a: Quaternion, b: Quaternion) -> Vector:
    """Im(a* b): what turns a to b, about the axes of the body."""
    return (
        a[0] * b[1] - a[1] * b[0] - a[2] * b[3] + a[3] * b[2],
        a[0] * b[2] - a[2] * b[0] - a[3] * b[1] + a[1] * b[3],
        a[0] * b[3] - a[3] * b[0] - a[1] * b[2] + a[2] * b[1],
    )


@compiled(**_INLINED)
def along_i(a: Quaternion, b: Quaternion) -> Vector:
    """Im(a i b* + b i a*) / 2: of a quaternion with itself its first axis, times its square."""
    return (
        a[0] * b[0] + a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[1] * b[2] + b[1] * a[2] + a[0] * b[3] + b[0] * a[3],
        a[1] * b[3] + b[1] * a[3] - a[0] * b[2] - b[0] * a[2],
    )


@compiled(**_INLINED)
def conjugate(q: Quaternion) -> Quaternion:
    """q*, the reverse of a turn."""
    return q[0], -q[1], -q[2], -q[3]


@compiled(**_INLINED)
def carried(q: Quaternion, v: Vector) -> Vector:
    """q v q* = Im((q*)* (v q*)), of a unit quaternion: a vector of the body where it is in space."""
    back = conjugate(q)
    return between(back, of_vector(v, back))
