"""Compiled elements of the Kirchhoff rod in motion: residual and tangent (their solution: `condensed`).

Unknowns.  Nodes are the Gauss-Lobatto nodes of elements of degree P; frames g are the unit
quaternions of `statics`, forces n are kept by their values at the P Gauss points.  `x`
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
each, of which neighbours alone know each other, whatever the degree.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ribbonfem.compiled.decorator import compiled
from ribbonfem.results import Array

from .statics import point

# degree of the elements; a constant, so that the compiler knows the length of every inner loop
P = 5
# rows of an element's matrix: r and psi of its left node, then of its right node, n, psi of the others
OUTER = N0 = 12
TURN0 = N0 + 3 * P
SIZE = TURN0 + 3 * (P - 1)
# the element's nodes in the order of their rows, and the first row of each one's psi
ORDER = (0, P, *range(1, P))
PLACES = (3, *range(TURN0, SIZE, 3), 9)
# r and psi of a node
SIX = 6
# by how much a rate of the stretched rod's axial force is held back in the hidden constraints
STIFF = 1e12
# small rotary inertia of bending that makes their tangent definite; refinement takes it out again
SMALL = 1e-7

OPTIONS: dict[str, Any] = {"error_model": "numpy", "fastmath": {"contract", "reassoc", "nsz"}}
# of what is called for an element, a point or a node: to hand over these tuples costs more than its work
INLINED: dict[str, Any] = {**OPTIONS, "forceinline": True}


class Rod(NamedTuple):
    """The discretisation, see `LineTables`.

    value (P, P + 1), slope (E, P, P + 1), weights (E, P); coupling (E, P, P + 1) = weights slope;
    share (E, P, P), the coupling of n with itself through the inner r at unit inertia; mass
    (E, P + 1), each element's lumps; inertia (nodes, 4) of x; stiff (3,) of (tau, -kappa2,
    kappa1); soft, c; spin, J; gyroscopic,
    whether it turns with the tangent; middle, the node at midspan.
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
    gyroscopic: bool
    middle: int


class Solver(NamedTuple):
    """Memory of the tangent and its solution, allocated once.

    local (E, SIZE, SIZE), the lower triangle of each element's factors; pivots (E, SIZE), inverse;
    own and next (E + 1, SIX, SIX), of what is left for each end of an element, with itself and with
    the next (see `condensed`); right (E + 1, SIX) and local_right (E, SIZE); residuals fr, fp (nodes, 3),
    fn (E, P, 3), overwritten by the increments of r, psi and n; the rest is a point's.
    """

    local: Array
    own: Array
    next: Array
    right: Array
    local_right: Array
    pivots: Array
    gradient: Array
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
    work: Array
    columns: Array
    of_q: Array
    of_p: Array
    pairs: Array
    block: Array


def solver(elements: int) -> Solver:
    """Memory for a mesh."""
    nodes = elements * P + 1
    return Solver(
        local=np.zeros((elements, SIZE, SIZE)),
        own=np.zeros((elements + 1, SIX, SIX)),
        next=np.zeros((elements + 1, SIX, SIX)),
        right=np.zeros((elements + 1, SIX)),
        local_right=np.zeros((elements, SIZE)),
        pivots=np.zeros((elements, SIZE)),
        gradient=np.zeros((P + 1, 4)),
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
        work=np.zeros((8, 4)),
        columns=np.zeros((P + 1, 4, 3)),
        of_q=np.zeros(16 * (P + 1)),
        of_p=np.zeros(16 * (P + 1)),
        pairs=np.zeros((P + 1, 16 * (P + 1))),
        block=np.zeros((SIX, SIX)),
    )


# --- one Gauss point, one element ----------------------------------------------------------------


@compiled(**INLINED)
def _interpolate(rod: Rod, e: int, k: int, g: Array, q: Array, p: Array) -> None:
    """The quaternion (not normalised) and its derivative at a Gauss point."""
    for c in range(4):
        value = slope = 0.0
        for i in range(P + 1):
            value += rod.value[k, i] * g[e * P + i, c]
            slope += rod.slope[e, k, i] * g[e * P + i, c]
        q[c] = value
        p[c] = slope


@compiled(**INLINED)
def _strains(q: Array, p: Array, tangent: Array) -> tuple[float, float, float, float]:
    """1 / |q|^2 and tau, -kappa2, kappa1; fills the tangent."""
    q0, q1, q2, q3 = q[0], q[1], q[2], q[3]
    p0, p1, p2, p3 = p[0], p[1], p[2], p[3]
    inverse = 1.0 / (q0 * q0 + q1 * q1 + q2 * q2 + q3 * q3)
    tangent[0] = inverse * (q0 * q0 + q1 * q1 - q2 * q2 - q3 * q3)
    tangent[1] = 2.0 * inverse * (q1 * q2 + q0 * q3)
    tangent[2] = 2.0 * inverse * (q1 * q3 - q0 * q2)
    return (
        inverse,
        2.0 * inverse * (q0 * p1 - q1 * p0 - q2 * p3 + q3 * p2),
        2.0 * inverse * (q0 * p2 - q2 * p0 - q3 * p1 + q1 * p3),
        2.0 * inverse * (q0 * p3 - q3 * p0 - q1 * p2 + q2 * p1),
    )


@compiled(**INLINED)
def _bend(rod: Rod, soft: float, q: Array, p: Array, n: Array, gq: Array, gp: Array, tangent: Array) -> float:
    """Derivatives in q and p of the density, the tangent; returns n.t.

    The same as `statics.point` without second derivatives, in products of quaternions:
    with m the body moment, d(m.kappa) is 2 q m along dp and -2 p m along dq, and d(n.t) is
    -2 n q i, each over |q|^2 and less its part along q.
    """
    q0, q1, q2, q3 = q[0], q[1], q[2], q[3]
    p0, p1, p2, p3 = p[0], p[1], p[2], p[3]
    inverse, k1, k2, k3 = _strains(q, p, tangent)
    m1, m2, m3 = rod.stiff[0] * k1, rod.stiff[1] * k2, rod.stiff[2] * k3
    twice = m1 * k1 + m2 * k2 + m3 * k3
    pull = n[0] * tangent[0] + n[1] * tangent[1] + n[2] * tangent[2]
    stretch = 1.0 + soft * pull
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
    return pull


@compiled(**INLINED)
def _body(g: Array, i: int, f: Array, c: int) -> float:
    """Component c of half of Im(conj(g) f): the moment about the body of a derivative f in g."""
    if c == 0:
        return 0.5 * (g[i, 0] * f[1] - g[i, 1] * f[0] - g[i, 2] * f[3] + g[i, 3] * f[2])
    if c == 1:
        return 0.5 * (g[i, 0] * f[2] - g[i, 2] * f[0] - g[i, 3] * f[1] + g[i, 1] * f[3])
    return 0.5 * (g[i, 0] * f[3] - g[i, 3] * f[0] - g[i, 1] * f[2] + g[i, 2] * f[1])


@compiled(**INLINED)
def add_element(rod: Rod, s: Solver, e: int, x: Array, g: Array, n: Array) -> None:
    """Add an element's forces and moments to s.fr and s.fp, put its gaps in s.fn."""
    gradient = s.gradient
    for i in range(P + 1):
        for c in range(4):
            gradient[i, c] = 0.0
    for k in range(P):
        _interpolate(rod, e, k, g, s.q, s.p)
        pull = _bend(rod, rod.soft, s.q, s.p, n[e, k], s.gq, s.gp, s.tangent)
        weight = rod.weights[e, k]
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
                gradient[i, c] += value * s.gq[c] + slope * s.gp[c]
    for i in range(P + 1):
        for c in range(3):
            s.fp[e * P + i, c] += _body(g, e * P + i, gradient[i], c)


@compiled(**OPTIONS)
def residual(rod: Rod, s: Solver, x: Array, g: Array, n: Array, force: Array) -> None:
    """Residuals in s.fr, s.fp, s.fn, with inertial forces of `force` (nodes, 4) a mass."""
    for i in range(g.shape[0]):
        for c in range(3):
            s.fr[i, c] = rod.inertia[i, c] * force[i, c]
            s.fp[i, c] = 0.0
        s.fp[i, 0] = rod.inertia[i, 3] * force[i, 3]
    for e in range(rod.weights.shape[0]):
        add_element(rod, s, e, x, g, n)


@compiled(**INLINED)
def _halves(s: Solver, e: int, g: Array) -> None:
    """Derivatives of the element's quaternions by the rotations of their nodes, in s.columns."""
    for i in range(P + 1):
        node, to = e * P + i, s.columns[i]
        w, x, y, z = 0.5 * g[node, 0], 0.5 * g[node, 1], 0.5 * g[node, 2], 0.5 * g[node, 3]
        to[0, 0], to[0, 1], to[0, 2] = -x, -y, -z
        to[1, 0], to[1, 1], to[1, 2] = w, -z, y
        to[2, 0], to[2, 1], to[2, 2] = z, w, -x
        to[3, 0], to[3, 1], to[3, 2] = -y, x, w


@compiled(**INLINED)
def _fill_gap(rod: Rod, s: Solver, e: int, k: int, n: Array, sigma: float, impulsive: bool) -> None:
    """The rows of n at a Gauss point: with itself, the positions and the rotations."""
    local = s.local[e]
    row, weight, tangent, dt = N0 + 3 * k, rod.weights[e, k], s.tangent, s.dt
    pull = n[0] * tangent[0] + n[1] * tangent[1] + n[2] * tangent[2]
    axial = (STIFF if rod.soft > 0.0 else 0.0) if impulsive else rod.soft
    for b in range(3):
        for c in range(b + 1):
            local[row + b, row + c] -= weight * axial * tangent[b] * tangent[c]
        for l in range(k + 1):
            local[row + b, N0 + 3 * l + b] -= rod.share[e, k, l] / sigma
        local[row + b, b] = rod.coupling[e, k, 0]
        local[row + b, 6 + b] = rod.coupling[e, k, P]
    # -(1 + c n.t) dt - c t (n.dt)
    stretch, along = weight * (1.0 + rod.soft * pull), 0.0 if impulsive else weight * rod.soft
    p0 = n[0] * dt[0, 0] + n[1] * dt[1, 0] + n[2] * dt[2, 0]
    p1 = n[0] * dt[0, 1] + n[1] * dt[1, 1] + n[2] * dt[2, 1]
    p2 = n[0] * dt[0, 2] + n[1] * dt[1, 2] + n[2] * dt[2, 2]
    p3 = n[0] * dt[0, 3] + n[1] * dt[1, 3] + n[2] * dt[2, 3]
    for b in range(3):
        shift = along * tangent[b]
        d0, d1 = stretch * dt[b, 0] + shift * p0, stretch * dt[b, 1] + shift * p1
        d2, d3 = stretch * dt[b, 2] + shift * p2, stretch * dt[b, 3] + shift * p3
        for i in range(P + 1):
            half, place, value = s.columns[i], PLACES[i], -rod.value[k, i]
            for c in range(3):
                change = value * (d0 * half[0, c] + d1 * half[1, c] + d2 * half[2, c] + d3 * half[3, c])
                if place < N0:
                    local[row + b, place + c] = change
                else:
                    local[place + c, row + b] = change


@compiled(**INLINED)
def _sum_pairs(rod: Rod, s: Solver, e: int, k: int) -> None:
    """Add a Gauss point's share of the second derivatives in two nodes' quaternions to s.pairs.

    Those of a node with all before it stand in one row, 16 numbers each: long sums are vectors.
    """
    h, of_q, of_p, weight = s.hess, s.of_q, s.of_p, rod.weights[e, k]
    for b in range(P + 1):
        j = ORDER[b]
        value, slope = weight * rod.value[k, j], weight * rod.slope[e, k, j]
        for r in range(4):
            for c in range(4):
                of_q[16 * b + 4 * r + c] = value * h[r, c] + slope * h[r, 4 + c]
                of_p[16 * b + 4 * r + c] = value * h[c, 4 + r] + slope * h[4 + r, 4 + c]
        for c in range(4):
            s.gradient[j, c] += value * s.gq[c] + slope * s.gp[c]
    for a in range(P + 1):
        i = ORDER[a]
        value, slope, pairs = rod.value[k, i], rod.slope[e, k, i], s.pairs[a]
        for c in range(16 * (a + 1)):
            pairs[c] += value * of_q[c] + slope * of_p[c]


@compiled(**INLINED)
def _fill_turns(s: Solver, e: int, g: Array) -> None:
    """Second derivatives in the rotations of the element's nodes, from those in their quaternions."""
    local = s.local[e]
    for a in range(P + 1):
        i = ORDER[a]
        left, row = s.columns[i], PLACES[i]
        # the increment keeps the quaternion on its sphere: a second-order term
        radial = 0.0
        for c in range(4):
            radial += s.gradient[i, c] * g[e * P + i, c]
        for b in range(a + 1):
            right, column, pair = s.columns[ORDER[b]], PLACES[ORDER[b]], s.pairs[a, 16 * b : 16 * (b + 1)]
            for c in range(3):
                v0 = v1 = v2 = v3 = 0.0
                for r in range(4):
                    v0 += left[r, c] * pair[4 * r]
                    v1 += left[r, c] * pair[4 * r + 1]
                    v2 += left[r, c] * pair[4 * r + 2]
                    v3 += left[r, c] * pair[4 * r + 3]
                for d in range(c + 1 if a == b else 3):
                    local[row + c, column + d] = (
                        v0 * right[0, d] + v1 * right[1, d] + v2 * right[2, d] + v3 * right[3, d]
                    )
        for c in range(3):
            local[row + c, row + c] -= 0.25 * radial


@compiled(**OPTIONS)
def fill_element(rod: Rod, s: Solver, e: int, g: Array, n: Array, sigma: float, impulsive: bool) -> None:
    """The lower triangle of an element's tangent in s.local[e]; sigma is d(force)/d(x) per mass.

    `impulsive`: that of the hidden constraints, in which stiffness plays no part.
    """
    local = s.local[e]
    for i in range(SIZE):
        row = local[i]
        for j in range(i + 1):
            row[j] = 0.0
    for a in range(P + 1):
        pairs = s.pairs[a]
        for c in range(16 * (a + 1)):
            pairs[c] = 0.0
        for c in range(4):
            s.gradient[a, c] = 0.0
    _halves(s, e, g)
    for k in range(P):
        _interpolate(rod, e, k, g, s.q, s.p)
        point(s.q, s.p, n[e, k], rod.stiff, rod.soft, s.gq, s.gp, s.hess, s.tangent, s.dt, s.work)
        _fill_gap(rod, s, e, k, n[e, k], sigma, impulsive)
        if not impulsive:
            _sum_pairs(rod, s, e, k)
    if not impulsive:
        _fill_turns(s, e, g)
    for i in range(P + 1):
        mass, row = rod.mass[e, i] * sigma, PLACES[i]
        local[row, row] += rod.spin * mass
        if impulsive:
            local[row + 1, row + 1] += SMALL * mass
            local[row + 2, row + 2] += SMALL * mass
    for b in range(3):
        local[b, b] += rod.mass[e, 0] * sigma
        local[6 + b, 6 + b] += rod.mass[e, P] * sigma
