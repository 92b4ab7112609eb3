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
TURNS = 3 * (P + 1)
# among the rotations alone the order is the same: node 0, node P, the others
STRIPS = (0, *range(6, TURNS, 3), 3)
PLACES = (3, 4, 5, 9, 10, 11, *range(TURN0, SIZE))
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
    columns: Array
    product: Array
    turns: Array


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
        columns=np.zeros((8, TURNS)),
        product=np.zeros((8, TURNS)),
        turns=np.zeros((TURNS, TURNS)),
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


@compiled(**OPTIONS)
def elastic_energy(rod: Rod, s: Solver, g: Array, n: Array) -> float:
    """Of bending, twist and stretch."""
    total = 0.0
    for e in range(rod.weights.shape[0]):
        for k in range(P):
            _interpolate(rod, e, k, g, s.q, s.p)
            _, k1, k2, k3 = _strains(s.q, s.p, s.tangent)
            pull = n[e, k, 0] * s.tangent[0] + n[e, k, 1] * s.tangent[1] + n[e, k, 2] * s.tangent[2]
            twice = rod.stiff[0] * k1 * k1 + rod.stiff[1] * k2 * k2 + rod.stiff[2] * k3 * k3
            total += 0.5 * rod.weights[e, k] * (twice + rod.soft * pull * pull)
    return total


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
def _columns(s: Solver, rod: Rod, e: int, k: int, g: Array) -> None:
    """Derivatives of (q, p) at a Gauss point by the rotations of the element's nodes, in s.columns."""
    for i in range(P + 1):
        w, x, y, z = g[e * P + i, 0], g[e * P + i, 1], g[e * P + i, 2], g[e * P + i, 3]
        j = STRIPS[i]
        for half in range(2):
            factor = 0.5 * (rod.value[k, i] if half == 0 else rod.slope[e, k, i])
            a, b, c, d = factor * w, factor * x, factor * y, factor * z
            r = 4 * half
            s.columns[r, j], s.columns[r, j + 1], s.columns[r, j + 2] = -b, -c, -d
            s.columns[r + 1, j], s.columns[r + 1, j + 1], s.columns[r + 1, j + 2] = a, -d, c
            s.columns[r + 2, j], s.columns[r + 2, j + 1], s.columns[r + 2, j + 2] = d, a, -b
            s.columns[r + 3, j], s.columns[r + 3, j + 1], s.columns[r + 3, j + 2] = -c, b, a


@compiled(**INLINED)
def _fill_gap(rod: Rod, s: Solver, e: int, k: int, n: Array, sigma: float, impulsive: bool) -> None:
    """The rows of n at a Gauss point: with itself, the positions and the rotations (s.columns)."""
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
    strip = s.columns.shape[1]
    c0, c1, c2, c3 = s.columns[0], s.columns[1], s.columns[2], s.columns[3]
    p0 = n[0] * dt[0, 0] + n[1] * dt[1, 0] + n[2] * dt[2, 0]
    p1 = n[0] * dt[0, 1] + n[1] * dt[1, 1] + n[2] * dt[2, 1]
    p2 = n[0] * dt[0, 2] + n[1] * dt[1, 2] + n[2] * dt[2, 2]
    p3 = n[0] * dt[0, 3] + n[1] * dt[1, 3] + n[2] * dt[2, 3]
    for b in range(3):
        shift = along * tangent[b]
        d0, d1 = stretch * dt[b, 0] + shift * p0, stretch * dt[b, 1] + shift * p1
        d2, d3 = stretch * dt[b, 2] + shift * p2, stretch * dt[b, 3] + shift * p3
        out = s.product[b]
        for j in range(strip):
            out[j] = -(d0 * c0[j] + d1 * c1[j] + d2 * c2[j] + d3 * c3[j])
        for c in range(3):
            local[row + b, 3 + c] = out[c]
            local[row + b, 9 + c] = out[3 + c]
        for i in range(P - 1):
            for c in range(3):
                local[TURN0 + 3 * i + c, row + b] = out[6 + 3 * i + c]


@compiled(**INLINED)
def _fill_turns(rod: Rod, s: Solver, e: int, k: int, g: Array) -> None:
    """Add a Gauss point's share of the second derivatives in the rotations to s.turns (lower triangle)."""
    weight, strip = rod.weights[e, k], s.columns.shape[1]
    h, out = s.hess, s.product
    c0, c1, c2, c3 = s.columns[0], s.columns[1], s.columns[2], s.columns[3]
    c4, c5, c6, c7 = s.columns[4], s.columns[5], s.columns[6], s.columns[7]
    for r in range(4):
        # the blocks of q with itself, of q with p, and of p with itself
        h0, h1, h2, h3 = weight * h[r, 0], weight * h[r, 1], weight * h[r, 2], weight * h[r, 3]
        h4, h5, h6, h7 = weight * h[r, 4], weight * h[r, 5], weight * h[r, 6], weight * h[r, 7]
        to = out[r]
        for j in range(strip):
            to[j] = h0 * c0[j] + h1 * c1[j] + h2 * c2[j] + h3 * c3[j]
            to[j] += h4 * c4[j] + h5 * c5[j] + h6 * c6[j] + h7 * c7[j]
        d = 4 + r
        h0, h1, h2, h3 = weight * h[0, d], weight * h[1, d], weight * h[2, d], weight * h[3, d]
        h4, h5, h6, h7 = weight * h[d, 4], weight * h[d, 5], weight * h[d, 6], weight * h[d, 7]
        to = out[d]
        for j in range(strip):
            to[j] = h0 * c0[j] + h1 * c1[j] + h2 * c2[j] + h3 * c3[j]
            to[j] += h4 * c4[j] + h5 * c5[j] + h6 * c6[j] + h7 * c7[j]
    o0, o1, o2, o3, o4, o5, o6, o7 = out[0], out[1], out[2], out[3], out[4], out[5], out[6], out[7]
    for i in range(TURNS):
        h0, h1, h2, h3 = c0[i], c1[i], c2[i], c3[i]
        h4, h5, h6, h7 = c4[i], c5[i], c6[i], c7[i]
        to = s.turns[i]
        for j in range(i + 1):
            to[j] += h0 * o0[j] + h1 * o1[j] + h2 * o2[j] + h3 * o3[j]
            to[j] += h4 * o4[j] + h5 * o5[j] + h6 * o6[j] + h7 * o7[j]
    for i in range(P + 1):
        # the increment keeps the quaternion on its sphere: a second-order term
        radial = 0.0
        for c in range(4):
            radial += (rod.value[k, i] * s.gq[c] + rod.slope[e, k, i] * s.gp[c]) * g[e * P + i, c]
        for c in range(STRIPS[i], STRIPS[i] + 3):
            s.turns[c, c] -= 0.25 * weight * radial


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
    for i in range(TURNS):
        row = s.turns[i]
        for j in range(i + 1):
            row[j] = 0.0
    for k in range(P):
        _interpolate(rod, e, k, g, s.q, s.p)
        point(s.q, s.p, n[e, k], rod.stiff, rod.soft, s.gq, s.gp, s.hess, s.tangent, s.dt, s.product)
        _columns(s, rod, e, k, g)
        _fill_gap(rod, s, e, k, n[e, k], sigma, impulsive)
        if not impulsive:
            _fill_turns(rod, s, e, k, g)
    for i in range(TURNS):
        for j in range(i + 1):
            local[PLACES[i], PLACES[j]] = s.turns[i, j]
    for i in range(P + 1):
        mass = rod.mass[e, i] * sigma
        row = PLACES[STRIPS[i]]
        local[row, row] += rod.spin * mass
        if impulsive:
            local[row + 1, row + 1] += SMALL * mass
            local[row + 2, row + 2] += SMALL * mass
    for b in range(3):
        local[b, b] += rod.mass[e, 0] * sigma
        local[6 + b, 6 + b] += rod.mass[e, P] * sigma


# --- condensed solution --------------------------------------------------------------------------


@compiled(**OPTIONS)
def clamp_moment(rod: Rod, s: Solver, x: Array, g: Array, n: Array) -> float:
    """Moment (EI2/L) of the left clamp on the ribbon, along growing alpha; overwrites residuals."""
    s.fp[0, 1] = 0.0
    add_element(rod, s, 0, x, g, n)
    return float(s.fp[0, 1])
