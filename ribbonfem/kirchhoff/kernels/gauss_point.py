"""Mechanics at a Gauss point of a Kirchhoff rod: strains, forces and their derivatives.

What takes and returns tuples is written for numbers of any kind: of one element, or of four at once.
"""

from __future__ import annotations

from typing import Any

from ribbonfem.jit.algebra import (
    Quaternion,
    Value,
    Vector,
    along_i,
    between,
    by_i,
    by_vector,
    dot,
    dot4,
    mix4,
    of_vector,
    scaled,
    scaled4,
)
from ribbonfem.jit.decorator import compiled
from ribbonfem.jit.simd import load, spread, store
from ribbonfem.material.kernels import moments_of, stretch_of
from ribbonfem.results import Array

from .batch import INLINED

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
def interpolated_group(
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
    """1 / |q|^2, and the unit tangent t = q i q* / |q|^2."""
    inverse = 1.0 / dot4(q, q)
    return inverse, scaled(inverse, along_i(q, q))


@compiled(**INLINED)
def strains_of(inverse: Value, q: Quaternion, p: Quaternion) -> Vector:
    """tau, -kappa2, kappa1: 2 Im(q* p) / |q|^2; `inverse` is 1 / |q|^2."""
    return scaled(2.0 * inverse, between(q, p))


@compiled(**INLINED)
def tangent_rate(inverse: Value, q: Quaternion, t: Vector, d: Quaternion) -> Vector:
    """Of the tangent where q goes at a rate d: (q i d* + d i q* - 2 (q.d) t) / |q|^2."""
    change, longer = along_i(q, d), dot4(q, d)
    factor = 2.0 * inverse
    return (
        factor * (change[0] - longer * t[0]),
        factor * (change[1] - longer * t[1]),
        factor * (change[2] - longer * t[2]),
    )


@compiled(**INLINED)
def point_gradient(
    stiffness: Array, compliance: float, offset: Offset, q: Quaternion, p: Quaternion, n: Vector
) -> tuple[Quaternion, Quaternion, Vector, Value]:
    """Derivatives in q and p of the density of `point_hessian`, the tangent, and n.t.

    In products of quaternions: with m the body moment, d(m.kappa) is 2 q m along dp and -2 p m along dq,
    and d(n.t) is -2 n q i, each over |q|^2 and less its part along q.
    """
    inverse, tangent = tangent_of(q)
    kappa = strains_of(inverse, q, p)
    m = moments_of(stiffness, offset[0], kappa)
    tension = dot(n, tangent)
    stretch = stretch_of(compliance, offset[1], tension)
    factor = 2.0 * inverse
    by_p = scaled4(factor, by_vector(q, m))
    along = dot(m, kappa) - stretch * tension
    of_bending = mix4(by_vector(p, m), -factor, q, -factor * along)
    by_q = mix4(of_bending, 1.0, by_i(of_vector(n, q)), factor * stretch)
    return by_q, by_p, tangent, tension


@compiled(**INLINED)
def pulled(inverse: Value, q: Quaternion, t: Vector, n: Vector) -> Quaternion:
    """The derivative in q of -n.t: 2 (n q i + (n.t) q) / |q|^2."""
    return mix4(by_i(of_vector(n, q)), 2.0 * inverse, q, 2.0 * inverse * dot(n, t))


@compiled(**INLINED)
def body_moment(g: Quaternion, f: Quaternion) -> Vector:
    """Im(g* f) / 2: the moment about the body of a derivative f in g."""
    return scaled(0.5, between(g, f))


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
def _put_row(
    hess: Array,
    r: int,
    stiffness: Array,
    at: Vector,
    of_q: Vector,
    of_p: Vector,
    moments: Vector,
    rows: Any,
    second: Quaternion,
    mixed: Quaternion,
) -> None:
    """Row r of each block.

    `at` has q, z and c v there, of_q and of_p the strains' derivatives; `second` and `mixed` are the row of
    what quadratic forms add, of q with q and of q with p.
    """
    q, z, v, by_q, by_p = rows
    x = stiffness[0] * of_q[0], stiffness[1] * of_q[1], stiffness[2] * of_q[2]
    y = stiffness[0] * of_p[0], stiffness[1] * of_p[1], stiffness[2] * of_p[2]
    a = mix4(_sum(x, by_q), 1.0, _sum((at[0], at[1], -at[2]), (z, q, v)), 1.0)
    _put(hess, r, 0, mix4(a, 1.0, second, 1.0))
    a = mix4(_sum(x, by_p), 1.0, _sum(moments, by_p), -at[0])
    _put(hess, r, 4, mix4(a, 1.0, mixed, 1.0))
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

    With kappa_a = 2 q.A_a p / |q|^2, t_b = q.T_b q / |q|^2, m_a = B_a (kappa_a - offset_a), B the stiffness,
    w = 1 + e + c n.t the stretch, and v = d(n.t)/dq:

        f    = 1/2 sum_a B_a (kappa_a - offset_a)^2 - (1 + e) n.t - c/2 (n.t)^2
        f_q  = sum_a m_a dkappa_a/dq - w v,    f_p = sum_a m_a dkappa_a/dp,    z = -2 f_q / |q|^2
        f_qq = sum_a B_a dkappa_a/dq (x) dkappa_a/dq - c v (x) v + q (x) z + z (x) q
               + 2 (w n.t - m.kappa) 1 / |q|^2 - 2 w sum_b n_b T_b / |q|^2
        f_qp = sum_a B_a dkappa_a/dq (x) dkappa_a/dp - 2 q (x) f_p / |q|^2 + 2 sum_a m_a A_a / |q|^2
        f_pp = sum_a B_a dkappa_a/dp (x) dkappa_a/dp

    Fills hess (64, WIDTH), the second ones, 8 by 8 in q and p (blocks qq, qp and pp); returns f_q, f_p, the
    tangent, n.t, and dt/dq.
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
    b0 = scaled4(twice, (-q1, q0, q3, -q2))
    b1 = scaled4(twice, (-q2, -q3, q0, q1))
    b2 = scaled4(twice, (-q3, q2, -q1, q0))
    # t_b = q.T_b q / |q|^2, derived in q
    d0 = _less(twice, (q0, q1, -q2, -q3), tangent[0], q)
    d1 = _less(twice, (q3, q2, q1, q0), tangent[1], q)
    d2 = _less(twice, (-q2, q3, -q0, q1), tangent[2], q)
    m0, m1, m2 = moments_of(stiffness, offset[0], (k0, k1, k2))
    tension = dot(n, tangent)
    stretch = stretch_of(compliance, offset[1], tension)
    v = _sum(n, (d0, d1, d2))
    gq = _less(1.0, _sum((m0, m1, m2), (a0, a1, a2)), stretch, v)
    gp = _sum((m0, m1, m2), (b0, b1, b2))
    z = scaled4(-twice, gq)
    rows = q, z, v, (a0, a1, a2), (b0, b1, b2)
    # the last term of f_qp
    moments = twice * m0, twice * m1, twice * m2
    e, f, g = moments
    zero = spread(0.0)
    # the last two terms of f_qq
    part = twice * stretch
    x, y, w = part * n[0], part * n[1], part * n[2]
    one = twice * (stretch * tension - m0 * k0 - m1 * k1 - m2 * k2)
    second = (
        (one - x, zero, w, -y),
        (zero, one - x, -y, -w),
        (w, -y, one + x, zero),
        (-y, -w, zero, one + x),
    )
    mixed = (zero, e, f, g), (-e, zero, -g, f), (-f, g, zero, -e), (-g, -f, e, zero)
    at, of_q, of_p = (q0, z[0], compliance * v[0]), (a0[0], a1[0], a2[0]), (b0[0], b1[0], b2[0])
    _put_row(hess, 0, stiffness, at, of_q, of_p, moments, rows, second[0], mixed[0])
    at, of_q, of_p = (q1, z[1], compliance * v[1]), (a0[1], a1[1], a2[1]), (b0[1], b1[1], b2[1])
    _put_row(hess, 1, stiffness, at, of_q, of_p, moments, rows, second[1], mixed[1])
    at, of_q, of_p = (q2, z[2], compliance * v[2]), (a0[2], a1[2], a2[2]), (b0[2], b1[2], b2[2])
    _put_row(hess, 2, stiffness, at, of_q, of_p, moments, rows, second[2], mixed[2])
    at, of_q, of_p = (q3, z[3], compliance * v[3]), (a0[3], a1[3], a2[3]), (b0[3], b1[3], b2[3])
    _put_row(hess, 3, stiffness, at, of_q, of_p, moments, rows, second[3], mixed[3])
    return gq, gp, tangent, tension, (d0, d1, d2)


@compiled(**INLINED)
def stretched(n: Vector, stretch: Value, along: float, t: Vector, dt: Rows) -> Rows:
    """Derivatives in q of r' = (e + c n.t) t, which is `stretch` long; `along` is c, or 0 to leave it out."""
    change = _sum(n, dt)
    return (
        mix4(dt[0], stretch, change, along * t[0]),
        mix4(dt[1], stretch, change, along * t[1]),
        mix4(dt[2], stretch, change, along * t[2]),
    )
