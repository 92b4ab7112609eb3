"""Mechanics at a Gauss point of a Kirchhoff rod: strains, forces and their derivatives.

What takes and returns tuples is written for numbers of any kind: of one element, or of four at once.
"""

from __future__ import annotations

from typing import Any

from ribbonfem.jit.decorator import compiled
from ribbonfem.jit.simd import increase, load, spread, store
from ribbonfem.material.kernels import moments_of, stretch_of
from ribbonfem.results import Array

from .batch import INLINED

# a number of one element, or those of four
Value = Any
Quaternion = tuple[Value, Value, Value, Value]
Vector = tuple[Value, Value, Value]
Rows = tuple[Quaternion, Quaternion, Quaternion]
# what strains and the stretch count from
Offset = tuple[Vector, Value]


@compiled(**INLINED)
def interpolated(
    value: Array, slope: Array, e: int, k: int, g: Array, degree: int
) -> tuple[Quaternion, Quaternion]:
    """The quaternion (not normalised) and its derivative at a Gauss point of an element; see `LineTables`."""
    q0 = q1 = q2 = q3 = p0 = p1 = p2 = p3 = 0.0
    for i in range(degree + 1):
        at, along, node = value[k, i], slope[e, k, i], e * degree + i
        w, x, y, z = g[node, 0], g[node, 1], g[node, 2], g[node, 3]
        q0, q1, q2, q3 = q0 + at * w, q1 + at * x, q2 + at * y, q3 + at * z
        p0, p1, p2, p3 = p0 + along * w, p1 + along * x, p2 + along * y, p3 + along * z
    return (q0, q1, q2, q3), (p0, p1, p2, p3)


@compiled(**INLINED)
def interpolated_fours(
    value: Array, slope: Array, group: int, k: int, frames: Array, degree: int
) -> tuple[Quaternion, Quaternion]:
    """The same of a group: value (p, p + 1), slope (G, p, p + 1, WIDTH), frames (p + 1, 4, WIDTH)."""
    q0 = q1 = q2 = q3 = p0 = p1 = p2 = p3 = spread(0.0)
    for i in range(degree + 1):
        at, along = value[k, i], load(slope, (group, k, i))
        w, x, y, z = load(frames, (i, 0)), load(frames, (i, 1)), load(frames, (i, 2)), load(frames, (i, 3))
        q0, q1, q2, q3 = q0 + at * w, q1 + at * x, q2 + at * y, q3 + at * z
        p0, p1, p2, p3 = p0 + along * w, p1 + along * x, p2 + along * y, p3 + along * z
    return (q0, q1, q2, q3), (p0, p1, p2, p3)


@compiled(**INLINED)
def tangent_of(q: Quaternion) -> tuple[Value, Vector]:
    """1 / |q|^2, and the unit tangent."""
    q0, q1, q2, q3 = q
    inverse = 1.0 / (q0 * q0 + q1 * q1 + q2 * q2 + q3 * q3)
    return inverse, (
        inverse * (q0 * q0 + q1 * q1 - q2 * q2 - q3 * q3),
        2.0 * inverse * (q1 * q2 + q0 * q3),
        2.0 * inverse * (q1 * q3 - q0 * q2),
    )


@compiled(**INLINED)
def strains_of(inverse: Value, q: Quaternion, p: Quaternion) -> Vector:
    """tau, -kappa2, kappa1; `inverse` is 1 / |q|^2."""
    q0, q1, q2, q3 = q
    p0, p1, p2, p3 = p
    return (
        2.0 * inverse * (q0 * p1 - q1 * p0 - q2 * p3 + q3 * p2),
        2.0 * inverse * (q0 * p2 - q2 * p0 - q3 * p1 + q1 * p3),
        2.0 * inverse * (q0 * p3 - q3 * p0 - q1 * p2 + q2 * p1),
    )


@compiled(**INLINED)
def dot(a: Vector, b: Vector) -> Value:
    """a.b"""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@compiled(**INLINED)
def bend(
    stiffness: Array, compliance: float, offset: Offset, q: Quaternion, p: Quaternion, n: Vector
) -> tuple[Quaternion, Quaternion, Vector, Value]:
    """Derivatives in q and p of the density of `point_hessian`, the tangent, and n.t.

    In products of quaternions: with m the body moment, d(m.kappa) is 2 q m along dp and -2 p m along dq,
    and d(n.t) is -2 n q i, each over |q|^2 and less its part along q.
    """
    q0, q1, q2, q3 = q
    p0, p1, p2, p3 = p
    inverse, tangent = tangent_of(q)
    k1, k2, k3 = strains_of(inverse, q, p)
    m1, m2, m3 = moments_of(stiffness, offset[0], (k1, k2, k3))
    twice = m1 * k1 + m2 * k2 + m3 * k3
    pull = dot(n, tangent)
    stretch = stretch_of(compliance, offset[1], pull)
    # n q
    w0 = -(n[0] * q1 + n[1] * q2 + n[2] * q3)
    w1 = n[0] * q0 + n[1] * q3 - n[2] * q2
    w2 = n[1] * q0 + n[2] * q1 - n[0] * q3
    w3 = n[2] * q0 + n[0] * q2 - n[1] * q1
    factor = 2.0 * inverse
    along = twice - stretch * pull
    by_p = (
        -factor * (q1 * m1 + q2 * m2 + q3 * m3),
        factor * (q0 * m1 + q2 * m3 - q3 * m2),
        factor * (q0 * m2 + q3 * m1 - q1 * m3),
        factor * (q0 * m3 + q1 * m2 - q2 * m1),
    )
    by_q = (
        factor * (p1 * m1 + p2 * m2 + p3 * m3 - along * q0 - stretch * w1),
        factor * (p3 * m2 - p0 * m1 - p2 * m3 - along * q1 + stretch * w0),
        factor * (p1 * m3 - p0 * m2 - p3 * m1 - along * q2 + stretch * w3),
        factor * (p2 * m1 - p0 * m3 - p1 * m2 - along * q3 - stretch * w2),
    )
    return by_q, by_p, tangent, pull


@compiled(**INLINED)
def body(g: Quaternion, f: Quaternion) -> Vector:
    """Half of Im(conj(g) f): the moment about the body of a derivative f in g."""
    return (
        0.5 * (g[0] * f[1] - g[1] * f[0] - g[2] * f[3] + g[3] * f[2]),
        0.5 * (g[0] * f[2] - g[2] * f[0] - g[3] * f[1] + g[1] * f[3]),
        0.5 * (g[0] * f[3] - g[3] * f[0] - g[1] * f[2] + g[2] * f[1]),
    )


@compiled(**INLINED)
def _scaled(factor: Value, a: Quaternion) -> Quaternion:
    return factor * a[0], factor * a[1], factor * a[2], factor * a[3]


@compiled(**INLINED)
def _sum(x: Vector, rows: Rows) -> Quaternion:
    """The rows' sum, each with its factor."""
    a, b, c = rows
    return (
        x[0] * a[0] + x[1] * b[0] + x[2] * c[0],
        x[0] * a[1] + x[1] * b[1] + x[2] * c[1],
        x[0] * a[2] + x[1] * b[2] + x[2] * c[2],
        x[0] * a[3] + x[1] * b[3] + x[2] * c[3],
    )


@compiled(**INLINED)
def _less(factor: Value, a: Quaternion, b: Value, q: Quaternion) -> Quaternion:
    """factor (a - b q)"""
    return (
        factor * (a[0] - b * q[0]),
        factor * (a[1] - b * q[1]),
        factor * (a[2] - b * q[2]),
        factor * (a[3] - b * q[3]),
    )


@compiled(**INLINED)
def _put(hess: Array, row: int, column: int, a: Quaternion) -> None:
    store(hess, (8 * row + column,), a[0])
    store(hess, (8 * row + column + 1,), a[1])
    store(hess, (8 * row + column + 2,), a[2])
    store(hess, (8 * row + column + 3,), a[3])


@compiled(**INLINED)
def _put_rows(
    hess: Array, r: int, stiffness: Array, at: Vector, of_q: Vector, of_p: Vector, moments: Vector, rows: Any
) -> None:
    """Row r of each block; `at` has q, z and c v there, of_q and of_p the strains' derivatives."""
    q, z, v, by_q, by_p = rows
    x = stiffness[0] * of_q[0], stiffness[1] * of_q[1], stiffness[2] * of_q[2]
    y = stiffness[0] * of_p[0], stiffness[1] * of_p[1], stiffness[2] * of_p[2]
    a, b = _sum(x, by_q), _sum((at[0], at[1], -at[2]), (z, q, v))
    _put(hess, r, 0, (a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3]))
    # (without the antisymmetric part of kappa's)
    a, b = _sum(x, by_p), _sum(moments, by_p)
    _put(hess, r, 4, _less(1.0, a, at[0], b))
    _put(hess, 4 + r, 4, _sum(y, by_p))


@compiled(**INLINED)
def point_hessian(
    stiffness: Array,
    compliance: float,
    offset: Offset,
    q: Quaternion,
    p: Quaternion,
    n: Vector,
    hess: Array,
) -> tuple[Quaternion, Quaternion, Vector, Value, Rows]:
    """Derivatives of the density of the Lagrangian at a Gauss point of four elements.

    f = 1/2 sum_a stiffness_a (kappa_a - offset_a)^2 - (1 + e) n.t - c/2 (n.t)^2.  Fills hess (64, WIDTH),
    the second ones, 8 by 8 in q and p (blocks qq, qp and pp); returns those in q and p, the tangent, n.t, and
    d tangent / dq.
    """
    q0, q1, q2, q3 = q
    p0, p1, p2, p3 = p
    inverse, tangent = tangent_of(q)
    k0, k1, k2 = strains_of(inverse, q, p)
    twice = 2.0 * inverse
    # kappa_a = 2 q.A_a p / |q|^2, derived in q and in p
    a0 = _less(twice, (p1, -p0, -p3, p2), k0, q)
    a1 = _less(twice, (p2, p3, -p0, -p1), k1, q)
    a2 = _less(twice, (p3, -p2, p1, -p0), k2, q)
    b0 = _scaled(twice, (-q1, q0, q3, -q2))
    b1 = _scaled(twice, (-q2, -q3, q0, q1))
    b2 = _scaled(twice, (-q3, q2, -q1, q0))
    # t = (w^2 + x^2 - y^2 - z^2, 2 (x y + w z), 2 (x z - w y)) / |q|^2
    d0 = _less(twice, (q0, q1, -q2, -q3), tangent[0], q)
    d1 = _less(twice, (q3, q2, q1, q0), tangent[1], q)
    d2 = _less(twice, (-q2, q3, -q0, q1), tangent[2], q)
    m0, m1, m2 = moments_of(stiffness, offset[0], (k0, k1, k2))
    pull = dot(n, tangent)
    stretch = stretch_of(compliance, offset[1], pull)
    v = _sum(n, (d0, d1, d2))
    gq = _less(1.0, _sum((m0, m1, m2), (a0, a1, a2)), stretch, v)
    gp = _sum((m0, m1, m2), (b0, b1, b2))
    z = _scaled(-twice, gq)
    rows = q, z, v, (a0, a1, a2), (b0, b1, b2)
    moments = twice * m0, twice * m1, twice * m2
    _put_rows(
        hess,
        0,
        stiffness,
        (q0, z[0], compliance * v[0]),
        (a0[0], a1[0], a2[0]),
        (b0[0], b1[0], b2[0]),
        moments,
        rows,
    )
    _put_rows(
        hess,
        1,
        stiffness,
        (q1, z[1], compliance * v[1]),
        (a0[1], a1[1], a2[1]),
        (b0[1], b1[1], b2[1]),
        moments,
        rows,
    )
    _put_rows(
        hess,
        2,
        stiffness,
        (q2, z[2], compliance * v[2]),
        (a0[2], a1[2], a2[2]),
        (b0[2], b1[2], b2[2]),
        moments,
        rows,
    )
    _put_rows(
        hess,
        3,
        stiffness,
        (q3, z[3], compliance * v[3]),
        (a0[3], a1[3], a2[3]),
        (b0[3], b1[3], b2[3]),
        moments,
        rows,
    )
    for r in range(4):
        increase(hess, (8 * r + r,), twice * (stretch * pull - m0 * k0 - m1 * k1 - m2 * k2))
    increase(hess, (8 * 0 + 5,), moments[0])
    increase(hess, (8 * 1 + 4,), -moments[0])
    increase(hess, (8 * 2 + 7,), -moments[0])
    increase(hess, (8 * 3 + 6,), moments[0])
    increase(hess, (8 * 0 + 6,), moments[1])
    increase(hess, (8 * 2 + 4,), -moments[1])
    increase(hess, (8 * 3 + 5,), -moments[1])
    increase(hess, (8 * 1 + 7,), moments[1])
    increase(hess, (8 * 0 + 7,), moments[2])
    increase(hess, (8 * 3 + 4,), -moments[2])
    increase(hess, (8 * 1 + 6,), -moments[2])
    increase(hess, (8 * 2 + 5,), moments[2])
    # second derivative of n.(|q|^2 t)
    part = twice * stretch
    x, y, z = part * n[0], part * n[1], part * n[2]
    increase(hess, (8 * 0 + 0,), -x)
    increase(hess, (8 * 1 + 1,), -x)
    increase(hess, (8 * 2 + 2,), x)
    increase(hess, (8 * 3 + 3,), x)
    increase(hess, (8 * 1 + 2,), -y)
    increase(hess, (8 * 2 + 1,), -y)
    increase(hess, (8 * 0 + 3,), -y)
    increase(hess, (8 * 3 + 0,), -y)
    increase(hess, (8 * 1 + 3,), -z)
    increase(hess, (8 * 3 + 1,), -z)
    increase(hess, (8 * 0 + 2,), z)
    increase(hess, (8 * 2 + 0,), z)
    return gq, gp, tangent, pull, (d0, d1, d2)


@compiled(**INLINED)
def stretched(n: Vector, stretch: Value, along: float, t: Vector, dt: Rows) -> Rows:
    """Derivatives in q of r' = (e + c n.t) t, which is `stretch` long; `along` is c, or 0 to leave it out."""
    pulled = _sum(n, dt)
    return (
        _both(stretch, dt[0], along * t[0], pulled),
        _both(stretch, dt[1], along * t[1], pulled),
        _both(stretch, dt[2], along * t[2], pulled),
    )


@compiled(**INLINED)
def _both(x: Value, a: Quaternion, y: Value, b: Quaternion) -> Quaternion:
    """x a + y b"""
    return x * a[0] + y * b[0], x * a[1] + y * b[1], x * a[2] + y * b[2], x * a[3] + y * b[3]
