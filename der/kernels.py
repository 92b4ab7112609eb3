"""Compiled kernels of the discrete elastic rod (paper, section 3.2).

A rod has N nodes and N - 1 edges.  Unknowns are interleaved node by node, four a node:
``q = [x_0, theta^0, x_1, theta^1, ...]``, so that a node's energy couples 11 consecutive
unknowns and the Hessian has a half-bandwidth of 10.  The last angle does not exist; its slot is
kept to make all rows alike.

The state of a rod is (x, m1, twist): positions (N, 3), the material director m1 (the surface
normal) of each edge (N - 1, 3), and the twist angle at each node (N,), kept because an angle
alone is known up to full turns only.  Directors are moved by parallel transport in time, and
m2 = t x m1 points along the width, so that bending about m1 is the stiff one.  Angles theta are
therefore increments: a variation of x leaves the frames parallel (Bergou et al. 2010).

Units: lengths L, energies EI2/L.  ``rod`` holds the stiffnesses: (EI1, EI2, GJ) over EI2,
``rest`` the rest length of an edge, ``stretch`` (N - 1,) the stretching stiffness EA of each
edge times its share of the length (0 for the clamped ones).

All kernels of the package live here: the compiler's cache does not see a change in another
file.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

WIDTH = 10  # half-bandwidth
FIRST = 7  # first free unknown: theta^1; the last is theta^(N-3), number 4 N - 9

_options = {"cache": True, "nogil": True, "fastmath": {"contract"}, "error_model": "numpy"}


@njit(**_options)
def _cross(a, b):
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


@njit(**_options)
def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(**_options)
def _sum(a, p, b, q):
    """p a + q b."""
    return (p * a[0] + q * b[0], p * a[1] + q * b[1], p * a[2] + q * b[2])


@njit(**_options)
def _row(array, i):
    return (array[i, 0], array[i, 1], array[i, 2])


@njit(**_options)
def transport(x_old, m1_old, twist_old, x, turn, m1, twist):
    """Carry the directors from one configuration to another.

    Each m1 is transported parallel from the old tangent of its edge to the new one and then
    turned by `turn` (N,) about it; the twist is measured anew and kept on the turn nearest to
    the old one.  Writes m1 and twist; they may be the old arrays.
    """
    edges = m1.shape[0]
    before = (0.0, 0.0, 0.0)
    director = (0.0, 0.0, 0.0)
    for i in range(edges):
        old = _sum(_row(x_old, i + 1), 1.0, _row(x_old, i), -1.0)
        old = _sum(old, 1.0 / math.sqrt(_dot(old, old)), old, 0.0)
        new = _sum(_row(x, i + 1), 1.0, _row(x, i), -1.0)
        new = _sum(new, 1.0 / math.sqrt(_dot(new, new)), new, 0.0)
        m = _row(m1_old, i)
        m = _sum(m, 1.0, _sum(old, 1.0, new, 1.0), -_dot(m, new) / (1.0 + _dot(old, new)))
        m = _sum(m, math.cos(turn[i]), _cross(new, m), math.sin(turn[i]))
        m = _sum(m, 1.0, new, -_dot(m, new))
        m = _sum(m, 1.0 / math.sqrt(_dot(m, m)), m, 0.0)
        if i > 0:
            # m1 of the edge before, transported in space onto this edge
            moved = _sum(
                director, 1.0, _sum(before, 1.0, new, 1.0), -_dot(director, new) / (1.0 + _dot(before, new))
            )
            angle = math.atan2(-_dot(moved, _cross(new, m)), _dot(moved, m))
            twist[i] = angle + 2.0 * math.pi * round((twist_old[i] - angle) / (2.0 * math.pi))
        m1[i, 0], m1[i, 1], m1[i, 2] = m
        before, director = new, m


@njit(**_options)
def assemble(x, m1, twist, stiffness, rest, stretch, gradient, hessian, energies, second):
    """Energy and its first and second derivatives at a configuration.

    Writes gradient (4 N,), hessian (4 N + 10, 11) with hessian[i, d] = H[i + d, i], and
    energies (3,): stretching, bending, twisting.  The Hessian is the symmetric part of the
    derivative of the gradient; what is left out is the holonomy of the frames times dE/dtheta,
    which vanishes in equilibrium.  Without `second` the Hessian is not touched.
    """
    nodes = x.shape[0]
    gradient[:] = 0.0
    if second:
        hessian[:] = 0.0
    bend_1, bend_2, turn = stiffness[0] / rest, stiffness[1] / rest, stiffness[2] / rest
    stretching = bending = twisting = 0.0

    e = _sum(_row(x, 1), 1.0, _row(x, 0), -1.0)
    ie = 1.0 / math.sqrt(_dot(e, e))
    te = (e[0] * ie, e[1] * ie, e[2] * ie)
    m1e = _row(m1, 0)
    m2e = _cross(te, m1e)
    for i in range(1, nodes - 1):
        f = _sum(_row(x, i + 1), 1.0, _row(x, i), -1.0)
        i_f = 1.0 / math.sqrt(_dot(f, f))
        tf = (f[0] * i_f, f[1] * i_f, f[2] * i_f)
        m1f = _row(m1, i)
        m2f = _cross(tf, m1f)
        chi = 1.0 + _dot(te, tf)
        ix = 1.0 / chi
        kb = _cross(te, tf)
        kb = (2.0 * ix * kb[0], 2.0 * ix * kb[1], 2.0 * ix * kb[2])
        tt = _sum(te, ix, tf, ix)
        n1 = _sum(m1e, ix, m1f, ix)
        n2 = _sum(m2e, ix, m2f, ix)
        kappa_1 = 0.5 * chi * _dot(kb, n1)
        kappa_2 = 0.5 * chi * _dot(kb, n2)
        a1, a2, at = bend_1 * kappa_1, bend_2 * kappa_2, turn * twist[i]
        bending += 0.5 * (a1 * kappa_1 + a2 * kappa_2)
        twisting += 0.5 * at * twist[i]
        p1, p2 = _cross(tf, n1), _cross(tf, n2)
        q1, q2 = _cross(te, n1), _cross(te, n2)
        # derivatives of the curvatures in the two edge vectors and the two angles
        g1e = (ie * (p1[0] - kappa_1 * tt[0]), ie * (p1[1] - kappa_1 * tt[1]), ie * (p1[2] - kappa_1 * tt[2]))
        g2e = (ie * (p2[0] - kappa_2 * tt[0]), ie * (p2[1] - kappa_2 * tt[1]), ie * (p2[2] - kappa_2 * tt[2]))
        g1f = (
            -i_f * (q1[0] + kappa_1 * tt[0]),
            -i_f * (q1[1] + kappa_1 * tt[1]),
            -i_f * (q1[2] + kappa_1 * tt[2]),
        )
        g2f = (
            -i_f * (q2[0] + kappa_2 * tt[0]),
            -i_f * (q2[1] + kappa_2 * tt[1]),
            -i_f * (q2[2] + kappa_2 * tt[2]),
        )
        k1e, k2e = 0.5 * _dot(kb, m2e), -0.5 * _dot(kb, m1e)
        k1f, k2f = 0.5 * _dot(kb, m2f), -0.5 * _dot(kb, m1f)

        b = 4 * (i - 1)
        half_e, half_f = 0.5 * at * ie, 0.5 * at * i_f
        for c in range(3):
            de = a1 * g1e[c] + a2 * g2e[c] + half_e * kb[c]
            df = a1 * g1f[c] + a2 * g2f[c] + half_f * kb[c]
            gradient[b + c] -= de
            gradient[b + 4 + c] += de - df
            gradient[b + 8 + c] += df
        gradient[b + 3] += a1 * k1e + a2 * k2e - at
        gradient[b + 7] += a1 * k1f + a2 * k2f + at

        # the edge after the node also carries its stretching
        along = across = 0.0
        if stretch[i] > 0.0:
            strain = 1.0 / (i_f * rest) - 1.0
            force = stretch[i] / rest * strain
            stretching += 0.5 * stretch[i] * strain * strain
            for c in range(3):
                gradient[b + 4 + c] -= force * tf[c]
                gradient[b + 8 + c] += force * tf[c]
            across = force * i_f
            along = stretch[i] / (rest * rest) - across

        if second:
            de_ = _sum(m1e, a1, m2e, a2)
            df_ = _sum(m1f, a1, m2f, a2)
            c = a1 * kappa_1 + a2 * kappa_2
            cx = c * ix
            u = _sum(tt, c, _sum(p1, a1, p2, a2), -1.0)
            w = _sum(tt, c, _sum(q1, a1, q2, a2), 1.0)
            ve = _sum(_sum(de_, 0.25, kb, 0.125 * turn), 1.0, _sum(te, 1.0, tt, 1.0), -0.25 * at)
            vf = _sum(_sum(df_, 0.25, kb, 0.125 * turn), 1.0, _sum(tf, 1.0, tt, 1.0), -0.25 * at)
            # skew part of the mixed block: [z]x
            z = _sum(_sum(de_, ix, df_, ix), -1.0, tt, 0.5 * at)
            kv = _sum(kb, 0.25 * turn, tt, -0.25 * at)
            ee, ef, ff = ie * ie, ie * i_f, i_f * i_f
            b1e = (bend_1 * g1e[0], bend_1 * g1e[1], bend_1 * g1e[2])
            b2e = (bend_2 * g2e[0], bend_2 * g2e[1], bend_2 * g2e[2])
            b1f = (bend_1 * g1f[0], bend_1 * g1f[1], bend_1 * g1f[2])
            b2f = (bend_2 * g2f[0], bend_2 * g2f[1], bend_2 * g2f[2])
            skew = ((0.0, -z[2], z[1]), (z[2], 0.0, -z[0]), (-z[1], z[0], 0.0))
            for r in range(3):
                for s in range(3):
                    mixed = (
                        ef
                        * (
                            tt[r] * w[s]
                            + u[r] * tt[s]
                            - cx * te[r] * tf[s]
                            + kb[r] * kv[s]
                            - 0.25 * at * tt[r] * kb[s]
                            + skew[r][s]
                        )
                        + b1e[r] * g1f[s]
                        + b2e[r] * g2f[s]
                    )
                    if r == s:
                        mixed -= ef * cx
                    # x_(i-1) with x_(i+1)
                    hessian[b + r, 8 + s - r] -= mixed
                    # x_(i-1) with x_i
                    hessian[b + r, 4 + s - r] += mixed
                    # x_i with x_(i+1)
                    hessian[b + 4 + r, 4 + s - r] += mixed
                    # x_i with itself: minus the mixed block and its transpose, lower triangle
                    if r >= s:
                        hessian[b + 4 + s, r - s] -= mixed
                    if s >= r:
                        hessian[b + 4 + r, s - r] -= mixed
                for s in range(r + 1):
                    left = (
                        ee
                        * (tt[r] * u[s] + u[r] * tt[s] + kb[r] * ve[s] + ve[r] * kb[s] + cx * te[r] * te[s])
                        + b1e[r] * g1e[s]
                        + b2e[r] * g2e[s]
                    )
                    right = (
                        ff
                        * (tt[r] * w[s] + w[r] * tt[s] + kb[r] * vf[s] + vf[r] * kb[s] + cx * tf[r] * tf[s])
                        + b1f[r] * g1f[s]
                        + b2f[r] * g2f[s]
                        + along * tf[r] * tf[s]
                    )
                    if r == s:
                        left -= ee * cx
                        right += across - ff * cx
                    hessian[b + s, r - s] += left
                    hessian[b + 4 + s, r - s] += left + right
                    hessian[b + 8 + s, r - s] += right
                    hessian[b + s, 4 + r - s] -= left
                    hessian[b + 4 + s, 4 + r - s] -= right
                    if r != s:
                        hessian[b + r, 4 + s - r] -= left
                        hessian[b + 4 + r, 4 + s - r] -= right
            # angles
            le = _sum(m2e, a1, m1e, -a2)
            lf = _sum(m2f, a1, m1f, -a2)
            he, hf = 0.5 * _dot(kb, le), 0.5 * _dot(kb, lf)
            fe, ff_ = _cross(tf, le), _cross(tf, lf)
            ge, gf = _cross(te, le), _cross(te, lf)
            for r in range(3):
                half = 0.5 * turn * kb[r]
                ee_ = ie * (ix * fe[r] - he * tt[r] - half) + b1e[r] * k1e + b2e[r] * k2e
                ef_ = ie * (ix * ff_[r] - hf * tt[r] + half) + b1e[r] * k1f + b2e[r] * k2f
                fe_ = -i_f * (ix * ge[r] + he * tt[r] + half) + b1f[r] * k1e + b2f[r] * k2e
                fff = -i_f * (ix * gf[r] + hf * tt[r] - half) + b1f[r] * k1f + b2f[r] * k2f
                hessian[b + r, 3 - r] -= ee_
                hessian[b + 3, 1 + r] += ee_ - fe_
                hessian[b + 3, 5 + r] += fe_
                hessian[b + r, 7 - r] -= ef_
                hessian[b + 4 + r, 3 - r] += ef_ - fff
                hessian[b + 7, 1 + r] += fff
            hessian[b + 3, 0] += bend_1 * k1e * k1e + bend_2 * k2e * k2e + turn - 0.5 * _dot(kb, de_)
            hessian[b + 7, 0] += bend_1 * k1f * k1f + bend_2 * k2f * k2f + turn - 0.5 * _dot(kb, df_)
            hessian[b + 3, 4] += bend_1 * k1e * k1f + bend_2 * k2e * k2f - turn
        te, ie, m1e, m2e = tf, i_f, m1f, m2f
    energies[0] = stretching
    energies[1] = bending
    energies[2] = twisting


@njit(**_options)
def factor(a, first, last):
    """Overwrite rows first .. last - 1 of a band (rows, 11) with its L D L^T; count negative pivots.

    Ten rows beyond `last` are overwritten: they must be scratch or not needed.  The trip counts
    are constants, which lets the compiler unroll both loops.
    """
    for i in range(last, last + WIDTH):
        for d in range(WIDTH + 1):
            a[i, d] = 0.0
    for i in range(max(first, last - WIDTH), last):
        for d in range(last - i, WIDTH + 1):
            a[i, d] = 0.0
    negative = 0
    for i in range(first, last):
        pivot = a[i, 0]
        if pivot < 0.0:
            negative += 1
        inverse = 1.0 / pivot
        for d in range(1, WIDTH + 1):
            ratio = a[i, d] * inverse
            for e in range(d, WIDTH + 1):
                a[i + d, e - d] -= ratio * a[i, e]
        for d in range(1, WIDTH + 1):
            a[i, d] *= inverse
        a[i, 0] = inverse
    return negative


@njit(**_options)
def solve(a, first, last, x):
    """Overwrite x[first:last] with the solution; x has ten entries beyond `last` to spare."""
    for i in range(last, last + WIDTH):
        x[i] = 0.0
    for i in range(first, last):
        value = x[i]
        for d in range(1, WIDTH + 1):
            x[i + d] -= a[i, d] * value
    for i in range(last, last + WIDTH):
        x[i] = 0.0
    for i in range(last - 1, first - 1, -1):
        value = x[i] * a[i, 0]
        for d in range(1, WIDTH + 1):
            value -= a[i, d] * x[i + d]
        x[i] = value


@njit(**_options)
def multiply(a, first, last, x):
    """Product of the unfactored band's rows and columns first .. last - 1 with x, as a new array."""
    y = np.zeros(x.shape[0])
    for i in range(first, last):
        total = a[i, 0] * x[i]
        for d in range(1, min(WIDTH, last - 1 - i) + 1):
            y[i + d] += a[i, d] * x[i]
            total += a[i, d] * x[i + d]
        y[i] += total
    return y


@njit(**_options)
def solve_refined(hessian, factors, first, right):
    """Solve for right-hand sides (n, k) on rows first .. first + n - 1, with one refinement.

    Pivots may be small, since they are not chosen; the refinement restores the digits.
    """
    count, columns = right.shape
    last = first + count
    x = np.empty(right.shape)
    work = np.empty(last + WIDTH)
    for c in range(columns):
        work[first:last] = right[:, c]
        solve(factors, first, last, work)
        x[:, c] = work[first:last]
        product = multiply(hessian, first, last, work)
        for i in range(count):
            work[first + i] = right[i, c] - product[first + i]
        solve(factors, first, last, work)
        for i in range(count):
            x[i, c] += work[first + i]
    return x
