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
    qq, qp and pp), the tangent (3,) and dt (3, 4) = d tangent / dq; work (4, 4) is overwritten.
    """
    square = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]
    inverse = 1.0 / square
    kq, kp, v, w = work[0], work[1], work[2], work[3]
    for r in range(4):
        gq[r] = 0.0
        gp[r] = 0.0
    for r in range(8):
        for c in range(8):
            hess[r, c] = 0.0
    # kappa_a = 2 q.A_a p / |q|^2; v = A_a p and w = A_a^T q, its derivatives in q and p
    for a in range(3):
        i, j, k = a + 1, (a + 1) % 3 + 1, (a + 2) % 3 + 1
        # Im(conj(q) p)_i = q0 p_i - q_i p0 - q_j p_k + q_k p_j
        v[0] = p[i]
        v[i] = -p[0]
        v[j] = -p[k]
        v[k] = p[j]
        w[0] = -q[i]
        w[i] = q[0]
        w[j] = q[k]
        w[k] = -q[j]
        u = q[0] * v[0] + q[i] * v[i] + q[j] * v[j] + q[k] * v[k]
        kappa = 2.0 * u * inverse
        for r in range(4):
            kq[r] = 2.0 * (v[r] - kappa * q[r]) * inverse
            kp[r] = 2.0 * w[r] * inverse
        stiffness = stiff[a]
        moment = stiffness * kappa
        for r in range(4):
            gq[r] += moment * kq[r]
            gp[r] += moment * kp[r]
            left = stiffness * kq[r] - 2.0 * inverse * moment * q[r]
            other = 2.0 * inverse * moment * kq[r]
            for c in range(4):
                hess[r, c] += left * kq[c] - other * q[c]
                # d kp_c / d q_r without its antisymmetric part, which comes below
                hess[r, 4 + c] += left * kp[c]
                hess[4 + r, 4 + c] += stiffness * kp[r] * kp[c]
            hess[r, r] -= 2.0 * inverse * moment * kappa
        # kappa_qp = (2 A - 2 q kp^T) / |q|^2: its first part
        twice = 2.0 * inverse * moment
        hess[0, 4 + i] += twice
        hess[i, 4] -= twice
        hess[j, 4 + k] -= twice
        hess[k, 4 + j] += twice
    # t = (w^2 + x^2 - y^2 - z^2, 2 (x y + w z), 2 (x z - w y)) / |q|^2
    tangent[0] = (q[0] * q[0] + q[1] * q[1] - q[2] * q[2] - q[3] * q[3]) * inverse
    tangent[1] = 2.0 * (q[1] * q[2] + q[0] * q[3]) * inverse
    tangent[2] = 2.0 * (q[1] * q[3] - q[0] * q[2]) * inverse
    dt[0, 0], dt[0, 1], dt[0, 2], dt[0, 3] = q[0], q[1], -q[2], -q[3]
    dt[1, 0], dt[1, 1], dt[1, 2], dt[1, 3] = q[3], q[2], q[1], q[0]
    dt[2, 0], dt[2, 1], dt[2, 2], dt[2, 3] = -q[2], q[3], -q[0], q[1]
    pull = force[0] * tangent[0] + force[1] * tangent[1] + force[2] * tangent[2]
    for b in range(3):
        for r in range(4):
            dt[b, r] = 2.0 * (dt[b, r] - tangent[b] * q[r]) * inverse
    for r in range(4):
        v[r] = force[0] * dt[0, r] + force[1] * dt[1, r] + force[2] * dt[2, r]
    stretch = 1.0 + soft * pull
    for r in range(4):
        gq[r] -= stretch * v[r]
        for c in range(4):
            hess[r, c] += 2.0 * stretch * inverse * (q[r] * v[c] + v[r] * q[c]) - soft * v[r] * v[c]
        hess[r, r] += 2.0 * stretch * inverse * pull
    # second derivative of n.(|q|^2 t)
    twice = 2.0 * stretch * inverse
    x, y, z = twice * force[0], twice * force[1], twice * force[2]
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
    pulled, work = np.empty(4), np.empty((4, 4))
    block = np.empty((size, size, 4, 4))
    right = np.empty((size, 8, 4))
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
                        right[i, r, c] = n * hess[r, c] + d * hess[r, 4 + c]
                        right[i, 4 + r, c] = n * hess[c, 4 + r] + d * hess[4 + r, 4 + c]
            for i in range(size):
                for j in range(i + 1):
                    n, d = value[k, i], slope[e, k, i]
                    for r in range(4):
                        for c in range(4):
                            block[i, j, r, c] += n * right[j, r, c] + d * right[j, 4 + r, c]
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
                            column[4 * a + r] += block[i, 0, r, c] * turning[c]
                    continue
                for r in range(4):
                    for s in range(3):
                        half[r, s] = 0.0
                        for c in range(4):
                            half[r, s] += block[i, j, r, c] * basis[first + j, c, s]
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
