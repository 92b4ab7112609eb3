"""Compiled kernels of the Kirchhoff rod: gradient and Hessian of the Lagrangian, centreline, curvatures.

Frames are unit quaternions g = (w, x, y, z) of the rotation from the clamp's frame, so that

    m3 = t = G e_x,  m1 = G e_z (surface normal),  m2 = -G e_y (width);

the body components of 2 conj(g) g' are (tau, -kappa2, kappa1).  Inside an element g is
interpolated and normalised: rotating every node rotates the element, and with angular strains
taken from g / |g| itself nothing locks.  At a Gauss point the energy is a function of the
interpolated q and p = q' alone, and everything follows from its derivatives in these eight
numbers.
"""

from __future__ import annotations

import numpy as np

from ribbonfem.compiled.decorator import compiled
from ribbonfem.results import Array


@compiled()
def point(
    q: Array,
    p: Array,
    force: Array,
    stiff: Array,
    soft: float,
    gq: Array,
    gp: Array,
    hess: Array,
    tangent: Array,
    dt: Array,
    work: Array,
) -> None:
    """Density of the Lagrangian at a Gauss point: derivatives in q and p.

    f = 1/2 sum_a stiff_a kappa_a^2 - n.t - soft/2 (n.t)^2.  Fills gq, gp (4,), hess (8, 8; blocks
    qq, qp and pp), the tangent (3,) and dt (3, 4) = d tangent / dq; work (8, 4) is overwritten.
    """
    q0, q1, q2, q3 = q[0], q[1], q[2], q[3]
    p0, p1, p2, p3 = p[0], p[1], p[2], p[3]
    inverse = 1.0 / (q0 * q0 + q1 * q1 + q2 * q2 + q3 * q3)
    twice = 2.0 * inverse
    # kappa_a = 2 q.A_a p / |q|^2: the rows of work are its derivatives in q, for now A_a p, and in p
    work[0, 0], work[0, 1], work[0, 2], work[0, 3] = p1, -p0, -p3, p2
    work[1, 0], work[1, 1], work[1, 2], work[1, 3] = p2, p3, -p0, -p1
    work[2, 0], work[2, 1], work[2, 2], work[2, 3] = p3, -p2, p1, -p0
    work[3, 0], work[3, 1], work[3, 2], work[3, 3] = -q1 * twice, q0 * twice, q3 * twice, -q2 * twice
    work[4, 0], work[4, 1], work[4, 2], work[4, 3] = -q2 * twice, -q3 * twice, q0 * twice, q1 * twice
    work[5, 0], work[5, 1], work[5, 2], work[5, 3] = -q3 * twice, q2 * twice, -q1 * twice, q0 * twice
    s0, s1, s2 = stiff[0], stiff[1], stiff[2]
    k0 = twice * (q0 * p1 - q1 * p0 - q2 * p3 + q3 * p2)
    k1 = twice * (q0 * p2 - q2 * p0 - q3 * p1 + q1 * p3)
    k2 = twice * (q0 * p3 - q3 * p0 - q1 * p2 + q2 * p1)
    m0, m1, m2 = s0 * k0, s1 * k1, s2 * k2
    # t = (w^2 + x^2 - y^2 - z^2, 2 (x y + w z), 2 (x z - w y)) / |q|^2
    tangent[0] = (q0 * q0 + q1 * q1 - q2 * q2 - q3 * q3) * inverse
    tangent[1] = twice * (q1 * q2 + q0 * q3)
    tangent[2] = twice * (q1 * q3 - q0 * q2)
    dt[0, 0], dt[0, 1], dt[0, 2], dt[0, 3] = q0, q1, -q2, -q3
    dt[1, 0], dt[1, 1], dt[1, 2], dt[1, 3] = q3, q2, q1, q0
    dt[2, 0], dt[2, 1], dt[2, 2], dt[2, 3] = -q2, q3, -q0, q1
    n0, n1, n2 = force[0], force[1], force[2]
    pull = n0 * tangent[0] + n1 * tangent[1] + n2 * tangent[2]
    stretch = 1.0 + soft * pull
    diagonal = twice * (stretch * pull - m0 * k0 - m1 * k1 - m2 * k2)
    for r in range(4):
        for b in range(3):
            dt[b, r] = twice * (dt[b, r] - tangent[b] * q[r])
        work[0, r] = twice * (work[0, r] - k0 * q[r])
        work[1, r] = twice * (work[1, r] - k1 * q[r])
        work[2, r] = twice * (work[2, r] - k2 * q[r])
        v = n0 * dt[0, r] + n1 * dt[1, r] + n2 * dt[2, r]
        moment = m0 * work[0, r] + m1 * work[1, r] + m2 * work[2, r]
        gq[r] = moment - stretch * v
        gp[r] = m0 * work[3, r] + m1 * work[4, r] + m2 * work[5, r]
        work[6, r] = v
        work[7, r] = twice * (stretch * v - moment)
    for r in range(4):
        a0, a1, a2 = s0 * work[0, r], s1 * work[1, r], s2 * work[2, r]
        b0, b1, b2 = s0 * work[3, r], s1 * work[4, r], s2 * work[5, r]
        # d kappa_p / dq without its antisymmetric part, which comes below
        part = twice * q[r]
        c0, c1, c2 = a0 - part * m0, a1 - part * m1, a2 - part * m2
        part, z, v = q[r], work[7, r], soft * work[6, r]
        for c in range(4):
            hess[r, c] = (
                a0 * work[0, c]
                + a1 * work[1, c]
                + a2 * work[2, c]
                + part * work[7, c]
                + z * q[c]
                - v * work[6, c]
            )
            hess[r, 4 + c] = c0 * work[3, c] + c1 * work[4, c] + c2 * work[5, c]
            hess[4 + r, 4 + c] = b0 * work[3, c] + b1 * work[4, c] + b2 * work[5, c]
        hess[r, r] += diagonal
    m0, m1, m2 = twice * m0, twice * m1, twice * m2
    hess[0, 5] += m0
    hess[1, 4] -= m0
    hess[2, 7] -= m0
    hess[3, 6] += m0
    hess[0, 6] += m1
    hess[2, 4] -= m1
    hess[3, 5] -= m1
    hess[1, 7] += m1
    hess[0, 7] += m2
    hess[3, 4] -= m2
    hess[1, 6] -= m2
    hess[2, 5] += m2
    # second derivative of n.(|q|^2 t)
    part = twice * stretch
    x, y, z = part * n0, part * n1, part * n2
    hess[0, 0] -= x
    hess[1, 1] -= x
    hess[2, 2] += x
    hess[3, 3] += x
    hess[1, 2] -= y
    hess[2, 1] -= y
    hess[0, 3] -= y
    hess[3, 0] -= y
    hess[1, 3] -= z
    hess[3, 1] -= z
    hess[0, 2] += z
    hess[2, 0] += z


@compiled()
def frame_basis(g: Array, basis: Array) -> None:
    """Columns g i, g j, g k (nodes, 4, 3): an orthonormal basis of the tangent space at each node's g."""
    for n in range(g.shape[0]):
        w, x, y, z = g[n, 0], g[n, 1], g[n, 2], g[n, 3]
        basis[n, 0, 0], basis[n, 0, 1], basis[n, 0, 2] = -x, -y, -z
        basis[n, 1, 0], basis[n, 1, 1], basis[n, 1, 2] = w, -z, y
        basis[n, 2, 0], basis[n, 2, 1], basis[n, 2, 2] = z, w, -x
        basis[n, 3, 0], basis[n, 3, 1], basis[n, 3, 2] = -y, x, w


@compiled(allocates=True)
def assemble(
    g: Array,
    force: Array,
    value: Array,
    slope: Array,
    weights: Array,
    stiff: Array,
    soft: float,
    turning: Array,
    basis: Array,
    band: Array,
    border: Array,
    corner: Array,
    residual: Array,
    column: Array,
) -> None:
    """Residual and Riemannian Hessian of the Lagrangian of all frames but the two clamped ones.

    L = int f(q, q') ds + n.R; the caller adds R to the force rows of the residual.

    Parameters
    ----------
    g: (nodes, 4) unit quaternions.  force: (3,), n in EI2/L^2.
    value, slope, weights: see `LineTables`.
    stiff: (3,) stiffness of the body strains (tau, -kappa2, kappa1).  soft: EI2/(EA L^2), or 0.
    turning: (4,) derivative of the first node's quaternion in the parameter.
    basis: (nodes, 4, 3) from `frame_basis`.
    band: (3 m, 3 (p + 1)), border: (3, 3 m), corner: (3, 3), filled; m = nodes - 2; the degrees
        of freedom are the increments along `basis`, half rotation vectors in the body.
    residual, column: (4 m + 3,), filled: gradient, and its derivative in the parameter, in
        quaternion components.
    """
    elements, points, size = slope.shape
    nodes = g.shape[0]
    inner = nodes - 2
    degree = size - 1
    band[:] = 0.0
    border[:] = 0.0
    corner[:] = 0.0
    residual[:] = 0.0
    column[:] = 0.0
    q, p, gq, gp = np.empty(4), np.empty(4), np.empty(4), np.empty(4)
    hess, tangent, dt = np.empty((8, 8)), np.empty(3), np.empty((3, 4))
    pulled, work = np.empty(4), np.empty((8, 4))
    # second derivatives in two nodes' quaternions, 4 by 4 numbers a pair in one row: long sums are vectors
    block = np.empty((size, 16 * size))
    of_q, of_p = np.empty(16 * size), np.empty(16 * size)
    gradient = np.empty((size, 4))
    rows = np.empty((3, size, 4))
    half = np.empty((4, 3))
    for e in range(elements):
        first = e * degree
        block[:] = 0.0
        gradient[:] = 0.0
        rows[:] = 0.0
        for k in range(points):
            for r in range(4):
                q[r] = 0.0
                p[r] = 0.0
            for i in range(size):
                for r in range(4):
                    q[r] += value[k, i] * g[first + i, r]
                    p[r] += slope[e, k, i] * g[first + i, r]
            point(q, p, force, stiff, soft, gq, gp, hess, tangent, dt, work)
            weight = weights[e, k]
            pull = 0.0
            for b in range(3):
                pull += force[b] * tangent[b]
            stretch = 1.0 + soft * pull
            for r in range(4):
                pulled[r] = force[0] * dt[0, r] + force[1] * dt[1, r] + force[2] * dt[2, r]
            for b in range(3):
                residual[4 * inner + b] -= weight * stretch * tangent[b]
                for c in range(b, 3):
                    corner[b, c] -= weight * soft * tangent[b] * tangent[c]
            for i in range(size):
                n, d = weight * value[k, i], weight * slope[e, k, i]
                for r in range(4):
                    gradient[i, r] += n * gq[r] + d * gp[r]
                    for b in range(3):
                        rows[b, i, r] -= n * (stretch * dt[b, r] + soft * tangent[b] * pulled[r])
                for r in range(4):
                    for c in range(4):
                        of_q[16 * i + 4 * r + c] = n * hess[r, c] + d * hess[r, 4 + c]
                        of_p[16 * i + 4 * r + c] = n * hess[c, 4 + r] + d * hess[4 + r, 4 + c]
            for i in range(size):
                n, d, pairs = value[k, i], slope[e, k, i], block[i]
                for c in range(16 * (i + 1)):
                    pairs[c] += n * of_q[c] + d * of_p[c]
        for i in range(size):
            a = first + i - 1
            if a < 0 or a >= inner:
                continue
            radial = 0.0
            for r in range(4):
                residual[4 * a + r] += gradient[i, r]
                radial += gradient[i, r] * g[first + i, r]
            for b in range(3):
                for s in range(3):
                    total = 0.0
                    for r in range(4):
                        total += rows[b, i, r] * basis[first + i, r, s]
                    border[b, 3 * a + s] += total
            for j in range(i + 1):
                if e == 0 and j == 0:
                    for r in range(4):
                        for c in range(4):
                            column[4 * a + r] += block[i, 4 * r + c] * turning[c]
                    continue
                for r in range(4):
                    for s in range(3):
                        half[r, s] = 0.0
                        for c in range(4):
                            half[r, s] += block[i, 16 * j + 4 * r + c] * basis[first + j, c, s]
                for u in range(3):
                    for s in range(3 if i != j else u + 1):
                        total = 0.0
                        for r in range(4):
                            total += basis[first + i, r, u] * half[r, s]
                        # the increment is followed by a normalisation: its second-order term
                        if i == j and u == s:
                            total -= radial
                        band[3 * (a - i + j) + s, 3 * (i - j) + u - s] += total
        if e == 0:
            for b in range(3):
                for r in range(4):
                    column[4 * inner + b] += rows[b, 0, r] * turning[r]
    # only the components along the sphere count
    for a in range(inner):
        for r in range(4):
            q[r] = g[a + 1, r]
        along = 0.0
        across = 0.0
        for r in range(4):
            along += residual[4 * a + r] * q[r]
            across += column[4 * a + r] * q[r]
        for r in range(4):
            residual[4 * a + r] -= along * q[r]
            column[4 * a + r] -= across * q[r]


@compiled()
def to_increments(basis: Array, x: Array, y: Array) -> None:
    """Components (3 m + 3, k) along `basis` of quaternion vectors (4 m + 3, k) of the inner nodes."""
    inner = basis.shape[0] - 2
    for c in range(x.shape[1]):
        for a in range(inner):
            for s in range(3):
                total = 0.0
                for r in range(4):
                    total += basis[a + 1, r, s] * x[4 * a + r, c]
                y[3 * a + s, c] = total
        for b in range(3):
            y[3 * inner + b, c] = x[4 * inner + b, c]


@compiled()
def to_quaternions(basis: Array, y: Array, x: Array) -> None:
    """The reverse of `to_increments`."""
    inner = basis.shape[0] - 2
    for c in range(x.shape[1]):
        for a in range(inner):
            for r in range(4):
                total = 0.0
                for s in range(3):
                    total += basis[a + 1, r, s] * y[3 * a + s, c]
                x[4 * a + r, c] = total
        for b in range(3):
            x[4 * inner + b, c] = y[3 * inner + b, c]


@compiled(allocates=True)
def move(g: Array, increment: Array) -> Array:
    """Frames (nodes, 4) after an increment (4 m + 3,) of the inner ones, normalised."""
    new = g.copy()
    for a in range(g.shape[0] - 2):
        square = 0.0
        for r in range(4):
            new[a + 1, r] += increment[4 * a + r]
            square += new[a + 1, r] ** 2
        factor = 1.0 / np.sqrt(square)
        for r in range(4):
            new[a + 1, r] *= factor
    return new


@compiled(allocates=True)
def strains(
    g: Array, force: Array, value: Array, slope: Array, soft: float, curvature: Array, stretched: Array
) -> None:
    """At the Gauss points (elements, p, 3): body strains (tau, -kappa2, kappa1), and r' = (1 + eps) t."""
    elements, points, size = slope.shape
    q, p = np.empty(4), np.empty(4)
    for e in range(elements):
        for k in range(points):
            for r in range(4):
                q[r] = 0.0
                p[r] = 0.0
            for i in range(size):
                for r in range(4):
                    q[r] += value[k, i] * g[e * (size - 1) + i, r]
                    p[r] += slope[e, k, i] * g[e * (size - 1) + i, r]
            inverse = 1.0 / (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
            for a in range(3):
                i, j, l = a + 1, (a + 1) % 3 + 1, (a + 2) % 3 + 1
                curvature[e, k, a] = 2.0 * inverse * (q[0] * p[i] - q[i] * p[0] - q[j] * p[l] + q[l] * p[j])
            tx = (q[0] * q[0] + q[1] * q[1] - q[2] * q[2] - q[3] * q[3]) * inverse
            ty = 2.0 * (q[1] * q[2] + q[0] * q[3]) * inverse
            tz = 2.0 * (q[1] * q[3] - q[0] * q[2]) * inverse
            stretch = 1.0 + soft * (force[0] * tx + force[1] * ty + force[2] * tz)
            stretched[e, k, 0] = stretch * tx
            stretched[e, k, 1] = stretch * ty
            stretched[e, k, 2] = stretch * tz
