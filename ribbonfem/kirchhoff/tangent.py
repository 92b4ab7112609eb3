"""Compiled elements of the Kirchhoff rod in motion: residual, tangent, condensation, Newton, hidden constraints.

Unknowns.  Nodes are the Gauss-Lobatto nodes of elements of degree P; frames g are the unit
quaternions of `kernels`, forces n are kept by their values at the P Gauss points.  `x`
(nodes, 4) holds position and theta, the angle about the tangent counted from the step's first
instant: what is left of conj(g0) g once the tangent has been carried along by the shortest
rotation.  `v` and `a` are its rates.  The clamped nodes are the first and the last.

Every stage of every method solves the same equations, with x = xp + b a and v = vp + f a:

    M (a + nu v) + D^T n = 0                              of each r
    dE/dpsi - T^T n + e_x J m (theta'' + nu theta') = 0   of each g, psi its rotation in the body
    D r - t (1 + c n.t) = 0                               at each Gauss point

Tangent.  The mass is lumped, so that r inside an element is eliminated by a division; the
rotations inside it, then n, follow by a dense L D L^T without pivots.  (In this order: n's own
block is nearly singular in its mean.)  Left are r and psi of the nodes between elements, six
each, in a symmetric band of half-bandwidth 11, whatever the degree.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from .kernels import _point
from ribbonfem.results import Array

# degree of the elements; a constant, so that the compiler knows the length of every inner loop
P = 5
N0 = 3 * (P - 1)  # first row of n in an element's matrix, after the rotations of its inner nodes
INNER = N0 + 3 * P
SIZE = INNER + 12  # then r and psi of its left node, and of its right node
WIDTH = 11
# by how much a rate of the stretched rod's axial force is held back in the hidden constraints
STIFF = 1e12
# small rotary inertia of bending that makes their tangent definite; refinement takes it out again
SMALL = 1e-7

_options = {"cache": True, "nogil": True, "error_model": "numpy", "fastmath": {"contract", "reassoc", "nsz"}}


class Rod(NamedTuple):
    """The discretisation, see `LineTables`.

    value (P, P + 1), slope (E, P, P + 1), weights (E, P); coupling (E, P, P + 1) = weights slope;
    share (E, P, P), the coupling of n with itself through the inner r at unit inertia; mass
    (E, P + 1), each element's lumps; inertia (nodes, 4) of x; stiff (3,) of (tau, -kappa2,
    kappa1); soft, c; spin, J; middle, the node at midspan.
    """

    value: Array
    slope: Array
    weights: Array
    coupling: Array
    share: Array
    mass: Array
    inertia: Array
    stiff: Array
    soft: float
    spin: float
    middle: int


class Solver(NamedTuple):
    """Memory of the tangent and its solution, allocated once.

    local (E, SIZE, SIZE), the upper triangle of each element's factors; band (6 (E - 1) + WIDTH,
    WIDTH + 1), those of what is left; right and local_right; residuals fr, fp (nodes, 3), fn
    (E, P, 3), overwritten by the increments of r, psi and n; the rest is a point's.
    """

    local: Array
    band: Array
    right: Array
    local_right: Array
    fr: Array
    fp: Array
    fn: Array
    q: Array
    p: Array
    gq: Array
    gp: Array
    hess: Array
    tangent: Array
    dt: Array
    basis: Array
    columns: Array
    product: Array


def solver(elements: int) -> Solver:
    """Memory for a mesh."""
    nodes = elements * P + 1
    count = 6 * (elements - 1)
    return Solver(
        local=np.zeros((elements, SIZE, SIZE)),
        band=np.zeros((count + WIDTH, WIDTH + 1)),
        right=np.zeros(count + WIDTH),
        local_right=np.zeros((elements, SIZE)),
        fr=np.zeros((nodes, 3)),
        fp=np.zeros((nodes, 3)),
        fn=np.zeros((elements, P, 3)),
        q=np.zeros(4),
        p=np.zeros(4),
        gq=np.zeros(4),
        gp=np.zeros(4),
        hess=np.zeros((8, 8)),
        tangent=np.zeros(3),
        dt=np.zeros((3, 4)),
        basis=np.zeros((P + 1, 4, 3)),
        columns=np.zeros((P + 1, 8, 3)),
        product=np.zeros((P + 1, 8, 3)),
    )


# --- one Gauss point, one element ----------------------------------------------------------------


@njit(**_options)
def _interpolate(rod: Rod, e: int, k: int, g: Array, q: Array, p: Array) -> None:
    """The quaternion (not normalised) and its derivative at a Gauss point."""
    for c in range(4):
        value = slope = 0.0
        for i in range(P + 1):
            value += rod.value[k, i] * g[e * P + i, c]
            slope += rod.slope[e, k, i] * g[e * P + i, c]
        q[c] = value
        p[c] = slope


@njit(**_options)
def _bend(rod: Rod, q: Array, p: Array, n: Array, gq: Array, gp: Array, tangent: Array) -> tuple[float, float]:
    """Derivatives in q and p of the density, the tangent; returns its energy without n, and n.t.

    The same as `kernels._point` without second derivatives, in products of quaternions:
    with m the body moment, d(m.kappa) is 2 q m along dp and -2 p m along dq, and d(n.t) is
    -2 n q i, each over |q|^2 and less its part along q.
    """
    q0, q1, q2, q3 = q[0], q[1], q[2], q[3]
    p0, p1, p2, p3 = p[0], p[1], p[2], p[3]
    inverse = 1.0 / (q0 * q0 + q1 * q1 + q2 * q2 + q3 * q3)
    k1 = 2.0 * inverse * (q0 * p1 - q1 * p0 - q2 * p3 + q3 * p2)
    k2 = 2.0 * inverse * (q0 * p2 - q2 * p0 - q3 * p1 + q1 * p3)
    k3 = 2.0 * inverse * (q0 * p3 - q3 * p0 - q1 * p2 + q2 * p1)
    m1, m2, m3 = rod.stiff[0] * k1, rod.stiff[1] * k2, rod.stiff[2] * k3
    twice = m1 * k1 + m2 * k2 + m3 * k3
    tangent[0] = inverse * (q0 * q0 + q1 * q1 - q2 * q2 - q3 * q3)
    tangent[1] = 2.0 * inverse * (q1 * q2 + q0 * q3)
    tangent[2] = 2.0 * inverse * (q1 * q3 - q0 * q2)
    pull = n[0] * tangent[0] + n[1] * tangent[1] + n[2] * tangent[2]
    stretch = 1.0 + rod.soft * pull
    # n q
    w0 = -(n[0] * q1 + n[1] * q2 + n[2] * q3)
    w1 = n[0] * q0 + n[1] * q3 - n[2] * q2
    w2 = n[1] * q0 + n[2] * q1 - n[0] * q3
    w3 = n[2] * q0 + n[0] * q2 - n[1] * q1
    inverse *= 2.0
    along = twice - stretch * pull
    gp[0] = -inverse * (q1 * m1 + q2 * m2 + q3 * m3)
    gp[1] = inverse * (q0 * m1 + q2 * m3 - q3 * m2)
    gp[2] = inverse * (q0 * m2 + q3 * m1 - q1 * m3)
    gp[3] = inverse * (q0 * m3 + q1 * m2 - q2 * m1)
    gq[0] = inverse * (p1 * m1 + p2 * m2 + p3 * m3 - along * q0 - stretch * w1)
    gq[1] = inverse * (p3 * m2 - p0 * m1 - p2 * m3 - along * q1 + stretch * w0)
    gq[2] = inverse * (p1 * m3 - p0 * m2 - p3 * m1 - along * q2 + stretch * w3)
    gq[3] = inverse * (p2 * m1 - p0 * m3 - p1 * m2 - along * q3 - stretch * w2)
    return 0.5 * twice, pull


@njit(**_options)
def _body(g: Array, i: int, f: Array, c: int) -> float:
    """Component c of half of Im(conj(g) f): the moment about the body of a derivative f in g."""
    if c == 0:
        return 0.5 * (g[i, 0] * f[1] - g[i, 1] * f[0] - g[i, 2] * f[3] + g[i, 3] * f[2])
    if c == 1:
        return 0.5 * (g[i, 0] * f[2] - g[i, 2] * f[0] - g[i, 3] * f[1] + g[i, 1] * f[3])
    return 0.5 * (g[i, 0] * f[3] - g[i, 3] * f[0] - g[i, 1] * f[2] + g[i, 2] * f[1])


@njit(**_options)
def add_element(rod: Rod, s: Solver, e: int, x: Array, g: Array, n: Array) -> float:
    """Add an element's forces and moments to s.fr and s.fp, put its gaps in s.fn; elastic energy."""
    energy = 0.0
    for k in range(P):
        _interpolate(rod, e, k, g, s.q, s.p)
        bending, pull = _bend(rod, s.q, s.p, n[e, k], s.gq, s.gp, s.tangent)
        weight = rod.weights[e, k]
        energy += weight * (bending + 0.5 * rod.soft * pull * pull)
        stretch = weight * (1.0 + rod.soft * pull)
        for c in range(3):
            gap = 0.0
            force = n[e, k, c]
            for i in range(P + 1):
                gap += rod.coupling[e, k, i] * x[e * P + i, c]
                s.fr[e * P + i, c] += rod.coupling[e, k, i] * force
            s.fn[e, k, c] = gap - stretch * s.tangent[c]
        for i in range(P + 1):
            value, slope = weight * rod.value[k, i], weight * rod.slope[e, k, i]
            for c in range(4):
                s.p[c] = value * s.gq[c] + slope * s.gp[c]
            for c in range(3):
                s.fp[e * P + i, c] += _body(g, e * P + i, s.p, c)
    return energy


@njit(**_options)
def residual(rod: Rod, s: Solver, x: Array, g: Array, n: Array, force: Array) -> float:
    """Residuals in s.fr, s.fp, s.fn, with inertial forces of a mass times `force` (nodes, 4); elastic energy."""
    energy = 0.0
    for i in range(g.shape[0]):
        for c in range(3):
            s.fr[i, c] = rod.inertia[i, c] * force[i, c]
            s.fp[i, c] = 0.0
        s.fp[i, 0] = rod.inertia[i, 3] * force[i, 3]
    for e in range(rod.weights.shape[0]):
        energy += add_element(rod, s, e, x, g, n)
    return energy


@njit(**_options)
def _place(i: int) -> int:
    """First row of the rotation of an element's node i in its matrix."""
    if i == 0:
        return INNER + 3
    return INNER + 9 if i == P else 3 * (i - 1)


@njit(**_options)
def fill_element(rod: Rod, s: Solver, e: int, g: Array, n: Array, sigma: float, impulsive: bool) -> None:
    """The upper triangle of an element's tangent in s.local[e]; sigma is d(force)/d(x) per mass.

    `impulsive`: that of the hidden constraints, in which stiffness plays no part.
    """
    local = s.local[e]
    for i in range(SIZE):
        for j in range(i, SIZE):
            local[i, j] = 0.0
    for i in range(P + 1):
        w, x, y, z = 0.5 * g[e * P + i, 0], 0.5 * g[e * P + i, 1], 0.5 * g[e * P + i, 2], 0.5 * g[e * P + i, 3]
        b = s.basis[i]
        b[0, 0], b[0, 1], b[0, 2] = -x, -y, -z
        b[1, 0], b[1, 1], b[1, 2] = w, -z, y
        b[2, 0], b[2, 1], b[2, 2] = z, w, -x
        b[3, 0], b[3, 1], b[3, 2] = -y, x, w
    soft = rod.soft
    for k in range(P):
        _interpolate(rod, e, k, g, s.q, s.p)
        _point(s.q, s.p, n[e, k], rod.stiff, soft, s.gq, s.gp, s.hess, s.tangent, s.dt)
        weight = rod.weights[e, k]
        pull = n[e, k, 0] * s.tangent[0] + n[e, k, 1] * s.tangent[1] + n[e, k, 2] * s.tangent[2]
        stretch = 1.0 + soft * pull
        row = N0 + 3 * k
        axial = (STIFF if soft > 0.0 else 0.0) if impulsive else soft
        for b in range(3):
            for c in range(b, 3):
                local[row + b, row + c] -= weight * axial * s.tangent[b] * s.tangent[c]
            for l in range(k, P):
                local[row + b, N0 + 3 * l + b] -= rod.share[e, k, l] / sigma
            local[row + b, INNER + b] = rod.coupling[e, k, 0]
            local[row + b, INNER + 6 + b] = rod.coupling[e, k, P]
        for i in range(P + 1):
            value, slope = rod.value[k, i], rod.slope[e, k, i]
            place = _place(i)
            radial = 0.0
            for c in range(4):
                radial += (value * s.gq[c] + slope * s.gp[c]) * g[e * P + i, c]
            radial *= 0.25 * weight
            for a in range(3):
                turn0 = turn1 = turn2 = 0.0
                for c in range(4):
                    half = s.basis[i, c, a]
                    s.columns[i, c, a] = value * half
                    s.columns[i, 4 + c, a] = slope * half
                    turn0 += s.dt[0, c] * half
                    turn1 += s.dt[1, c] * half
                    turn2 += s.dt[2, c] * half
                axial = 0.0
                if not impulsive:
                    # the increment keeps the quaternion on its sphere: a second-order term
                    local[place + a, place + a] -= radial
                    axial = soft * (n[e, k, 0] * turn0 + n[e, k, 1] * turn1 + n[e, k, 2] * turn2)
                factor = -weight * value
                turn0 = factor * (stretch * turn0 + axial * s.tangent[0])
                turn1 = factor * (stretch * turn1 + axial * s.tangent[1])
                turn2 = factor * (stretch * turn2 + axial * s.tangent[2])
                if place < row:
                    local[place + a, row] = turn0
                    local[place + a, row + 1] = turn1
                    local[place + a, row + 2] = turn2
                else:
                    local[row, place + a] = turn0
                    local[row + 1, place + a] = turn1
                    local[row + 2, place + a] = turn2
        if impulsive:
            continue
        for r in range(4):
            for c in range(4):
                s.hess[4 + c, r] = s.hess[r, 4 + c]
        for i in range(P + 1):
            for r in range(8):
                for a in range(3):
                    total = 0.0
                    for c in range(8):
                        total += s.hess[r, c] * s.columns[i, c, a]
                    s.product[i, r, a] = weight * total
        for i in range(P + 1):
            place = _place(i)
            for j in range(P + 1):
                other = _place(j)
                if other < place:
                    continue
                for a in range(3):
                    for c in range(a if i == j else 0, 3):
                        total = 0.0
                        for r in range(8):
                            total += s.columns[i, r, a] * s.product[j, r, c]
                        local[place + a, other + c] += total
    for i in range(P + 1):
        mass = rod.mass[e, i] * sigma
        place = _place(i)
        local[place, place] += rod.spin * mass
        if impulsive:
            local[place + 1, place + 1] += SMALL * mass
            local[place + 2, place + 2] += SMALL * mass
    for b in range(3):
        local[INNER + b, INNER + b] += rod.mass[e, 0] * sigma
        local[INNER + 6 + b, INNER + 6 + b] += rod.mass[e, P] * sigma


# --- condensed solution --------------------------------------------------------------------------


@njit(**_options)
def factorise(s: Solver) -> None:
    """Eliminate the inside of every element in s.local, then the nodes between them in s.band."""
    elements = s.local.shape[0]
    count = 6 * (elements - 1)
    for i in range(count):
        for d in range(WIDTH + 1):
            s.band[i, d] = 0.0
    for e in range(elements):
        local = s.local[e]
        for k in range(INNER):
            inverse = 1.0 / local[k, k]
            for i in range(k + 1, SIZE):
                factor = local[k, i] * inverse
                if factor != 0.0:
                    for j in range(i, SIZE):
                        local[i, j] -= factor * local[k, j]
        first = 6 * (e - 1)
        for i in range(12):
            if 0 <= first + i < count:
                for j in range(i, 12):
                    if first + j < count:
                        s.band[first + i, j - i] += local[INNER + i, INNER + j]
    for k in range(count):
        inverse = 1.0 / s.band[k, 0]
        for d in range(1, WIDTH + 1):
            factor = s.band[k, d] * inverse
            if factor != 0.0:
                for c in range(d, WIDTH + 1):
                    s.band[k + d, c - d] -= factor * s.band[k, c]


@njit(**_options)
def solve(rod: Rod, s: Solver, sigma: float) -> None:
    """Overwrite the residuals s.fr, s.fp, s.fn by the increments that would take them to 0."""
    elements = s.local.shape[0]
    count = 6 * (elements - 1)
    for e in range(elements - 1):
        node = (e + 1) * P
        for c in range(3):
            s.right[6 * e + c] = -s.fr[node, c]
            s.right[6 * e + 3 + c] = -s.fp[node, c]
    for e in range(elements):
        f = s.local_right[e]
        local = s.local[e]
        for i in range(1, P):
            for c in range(3):
                f[3 * (i - 1) + c] = -s.fp[e * P + i, c]
        for k in range(P):
            for c in range(3):
                total = -s.fn[e, k, c]
                for i in range(1, P):
                    total += rod.coupling[e, k, i] * s.fr[e * P + i, c] / (rod.inertia[e * P + i, 0] * sigma)
                f[N0 + 3 * k + c] = total
        for i in range(INNER, SIZE):
            f[i] = 0.0
        for k in range(INNER):
            factor = f[k] / local[k, k]
            for i in range(k + 1, SIZE):
                f[i] -= factor * local[k, i]
        first = 6 * (e - 1)
        for i in range(12):
            if 0 <= first + i < count:
                s.right[first + i] += f[INNER + i]
    for k in range(count):
        factor = s.right[k] / s.band[k, 0]
        for d in range(1, WIDTH + 1):
            s.right[k + d] -= factor * s.band[k, d]
    for i in range(count, count + WIDTH):
        s.right[i] = 0.0
    for k in range(count - 1, -1, -1):
        total = s.right[k]
        for d in range(1, WIDTH + 1):
            total -= s.band[k, d] * s.right[k + d]
        s.right[k] = total / s.band[k, 0]
    for e in range(elements):
        f = s.local_right[e]
        local = s.local[e]
        first = 6 * (e - 1)
        for i in range(12):
            row = INNER + i
            f[row] = s.right[first + i] if 0 <= first + i < count else 0.0
        for k in range(INNER - 1, -1, -1):
            # f[k] still holds what forward elimination left of the right-hand side
            total = f[k]
            for i in range(k + 1, SIZE):
                total -= local[k, i] * f[i]
            f[k] = total / local[k, k]
        for k in range(P):
            for c in range(3):
                s.fn[e, k, c] = f[N0 + 3 * k + c]
        for i in range(1, P):
            node = e * P + i
            for c in range(3):
                s.fp[node, c] = f[3 * (i - 1) + c]
                total = -s.fr[node, c]
                for k in range(P):
                    total -= rod.coupling[e, k, i] * f[N0 + 3 * k + c]
                s.fr[node, c] = total / (rod.inertia[node, 0] * sigma)
    for e in range(elements - 1):
        node = (e + 1) * P
        for c in range(3):
            s.fr[node, c] = s.right[6 * e + c]
            s.fp[node, c] = s.right[6 * e + 3 + c]
    last = elements * P
    for c in range(3):
        s.fr[0, c] = s.fr[last, c] = 0.0
        s.fp[0, c] = s.fp[last, c] = 0.0


@njit(**_options)
def rotate(g: Array, i: int, a: float, b: float, c: float) -> None:
    """g <- g exp(psi / 2) at node i, with psi = (a, b, c)."""
    square = 0.25 * (a * a + b * b + c * c)
    if square < 1e-4:
        # sin(y) / y and cos(y), to the last digit
        half = 0.5 * (1.0 - square * (1.0 - square * (1.0 - square / 42.0) / 20.0) / 6.0)
        cosine = 1.0 - 0.5 * square * (1.0 - square * (1.0 - square / 30.0) / 12.0)
    else:
        angle = math.sqrt(square)
        half = 0.5 * math.sin(angle) / angle
        cosine = math.cos(angle)
    a, b, c = half * a, half * b, half * c
    w, x, y, z = g[i, 0], g[i, 1], g[i, 2], g[i, 3]
    w1 = w * cosine - x * a - y * b - z * c
    x1 = x * cosine + w * a + y * c - z * b
    y1 = y * cosine + w * b + z * a - x * c
    z1 = z * cosine + w * c + x * b - y * a
    # rounding would let the length drift over thousands of increments
    scale = 1.5 - 0.5 * (w1 * w1 + x1 * x1 + y1 * y1 + z1 * z1)
    g[i, 0], g[i, 1], g[i, 2], g[i, 3] = scale * w1, scale * x1, scale * y1, scale * z1


@njit(**_options)
def twist(g0: Array, g: Array, i: int) -> float:
    """theta of node i: of conj(g0) g about the tangent, in (-pi, pi]."""
    w, x, y, z = g0[i, 0], g0[i, 1], g0[i, 2], g0[i, 3]
    along = w * g[i, 0] + x * g[i, 1] + y * g[i, 2] + z * g[i, 3]
    across = w * g[i, 1] - x * g[i, 0] - y * g[i, 3] + z * g[i, 2]
    return 2.0 * math.atan2(across, along) if along >= 0.0 else 2.0 * math.atan2(-across, -along)


@njit(**_options)
def clamp_moment(rod: Rod, s: Solver, x: Array, g: Array, n: Array) -> float:
    """Moment (EI2/L) of the left clamp on the ribbon, along growing alpha; overwrites residuals."""
    s.fp[0, 1] = 0.0
    add_element(rod, s, 0, x, g, n)
    return float(s.fp[0, 1])
