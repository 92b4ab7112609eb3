"""Second derivatives of the Lagrangian of a Kirchhoff rod in motion, element by element.

Tangent.  The mass is lumped, so that r inside an element is eliminated by a division; the
rotations inside it, then n, follow by a dense L D L^T without pivots.  (In this order: n's own
block is nearly singular in its mean.)  Left are r and psi of the nodes between elements, six
each, of which neighbours alone know each other, whatever the degree (`condensed`).
"""

from __future__ import annotations

from ribbonfem.compiled.decorator import compiled
from ribbonfem.compiled.lanes import load, spread, store
from ribbonfem.results import Array

from .points import Quaternion, Rows, Value, Vector, dot, interpolated_fours, second_derivatives
from .residual import collect
from .rod import INLINED, N0, OPTIONS, ORDER, PLACES, SIZE, P, Rod, Solver

# by how much a rate of the stretched rod's axial force is held back in the hidden constraints
STIFF = 1e12
# small rotary inertia of bending that makes their tangent definite; refinement takes it out again
SMALL = 1e-7


@compiled(**INLINED)
def _add(local: Array, group: int, row: int, column: int, value: Value) -> None:
    store(local, (group, row, column), load(local, (group, row, column)) + value)


@compiled(**INLINED)
def _halves(s: Solver) -> None:
    """Derivatives of the quaternions of a group's nodes by their rotations, in s.columns, 4 by 3."""
    for i in range(P + 1):
        w, x = 0.5 * load(s.frames, (i, 0)), 0.5 * load(s.frames, (i, 1))
        y, z = 0.5 * load(s.frames, (i, 2)), 0.5 * load(s.frames, (i, 3))
        _put(s.columns, i, 0, (-x, -y, -z))
        _put(s.columns, i, 3, (w, -z, y))
        _put(s.columns, i, 6, (z, w, -x))
        _put(s.columns, i, 9, (-y, x, w))


@compiled(**INLINED)
def _put(array: Array, row: int, column: int, a: Vector) -> None:
    store(array, (row, column), a[0])
    store(array, (row, column + 1), a[1])
    store(array, (row, column + 2), a[2])


@compiled(**INLINED)
def _fill_row(rod: Rod, s: Solver, group: int, k: int, b: int, change: Quaternion) -> None:
    """Component b of n at a Gauss point, with positions and rotations; `change` is that by the quaternion."""
    local, row = s.local, N0 + 3 * k + b
    store(local, (group, row, b), load(rod.four.coupling, (group, k, 0)))
    store(local, (group, row, 3 + b), load(rod.four.coupling, (group, k, P)))
    for i in range(P + 1):
        place, value = PLACES[i], -rod.value[k, i]
        for c in range(3):
            turned = value * (
                change[0] * load(s.columns, (i, c))
                + change[1] * load(s.columns, (i, 3 + c))
                + change[2] * load(s.columns, (i, 6 + c))
                + change[3] * load(s.columns, (i, 9 + c))
            )
            if place < N0:
                store(local, (group, row, place + c), turned)
            else:
                store(local, (group, place + c, row), turned)


@compiled(**INLINED)
def _combined(x: Value, a: Quaternion, y: Value, b: Quaternion) -> Quaternion:
    """x a + y b"""
    return x * a[0] + y * b[0], x * a[1] + y * b[1], x * a[2] + y * b[2], x * a[3] + y * b[3]


@compiled(**INLINED)
def _fill_gap(
    rod: Rod, s: Solver, group: int, k: int, n: Vector, t: Vector, dt: Rows, sigma: float, impulsive: bool
) -> None:
    """The rows of n at a Gauss point: with itself, the positions and the rotations."""
    local, row, weight = s.local, N0 + 3 * k, load(rod.four.weights, (group, k))
    axial = weight * (-((STIFF if rod.soft > 0.0 else 0.0) if impulsive else rod.soft))
    _add(local, group, row, row, axial * t[0] * t[0])
    _add(local, group, row + 1, row, axial * t[1] * t[0])
    _add(local, group, row + 1, row + 1, axial * t[1] * t[1])
    _add(local, group, row + 2, row, axial * t[2] * t[0])
    _add(local, group, row + 2, row + 1, axial * t[2] * t[1])
    _add(local, group, row + 2, row + 2, axial * t[2] * t[2])
    for l in range(k + 1):
        share = load(rod.four.share, (group, k, l)) * (-1.0 / sigma)
        for b in range(3):
            _add(local, group, row + b, N0 + 3 * l + b, share)
    # -(1 + c n.t) dt - c t (n.dt)
    stretch = weight * (1.0 + rod.soft * dot(n, t))
    along = weight * (0.0 if impulsive else rod.soft)
    pulled = _combined(n[0], dt[0], n[1], dt[1])
    pulled = _combined(1.0, pulled, n[2], dt[2])
    _fill_row(rod, s, group, k, 0, _combined(stretch, dt[0], along * t[0], pulled))
    _fill_row(rod, s, group, k, 1, _combined(stretch, dt[1], along * t[1], pulled))
    _fill_row(rod, s, group, k, 2, _combined(stretch, dt[2], along * t[2], pulled))


@compiled(**INLINED)
def _sum_pairs(rod: Rod, s: Solver, group: int, k: int, gq: Quaternion, gp: Quaternion) -> None:
    """Add a Gauss point's share of the derivatives in a node's quaternion, and in it and another's."""
    weight = load(rod.four.weights, (group, k))
    for b in range(P + 1):
        j = ORDER[b]
        value, slope = weight * rod.value[k, j], weight * load(rod.four.slope, (group, k, j))
        for r in range(4):
            for c in range(4):
                qq, qp = load(s.hess, (8 * r + c,)), load(s.hess, (8 * r + 4 + c,))
                pq, pp = load(s.hess, (8 * c + 4 + r,)), load(s.hess, (8 * r + 36 + c,))
                store(s.of_q, (b, 4 * r + c), value * qq + slope * qp)
                store(s.of_p, (b, 4 * r + c), value * pq + slope * pp)
        store(s.gradient, (j, 0), load(s.gradient, (j, 0)) + value * gq[0] + slope * gp[0])
        store(s.gradient, (j, 1), load(s.gradient, (j, 1)) + value * gq[1] + slope * gp[1])
        store(s.gradient, (j, 2), load(s.gradient, (j, 2)) + value * gq[2] + slope * gp[2])
        store(s.gradient, (j, 3), load(s.gradient, (j, 3)) + value * gq[3] + slope * gp[3])
    for a in range(P + 1):
        value, slope = rod.value[k, ORDER[a]], load(rod.four.slope, (group, k, ORDER[a]))
        for b in range(a + 1):
            for c in range(16):
                pair = load(s.pairs, (a, b, c))
                pair += value * load(s.of_q, (b, c)) + slope * load(s.of_p, (b, c))
                store(s.pairs, (a, b, c), pair)


@compiled(**INLINED)
def _fill_turns(s: Solver, group: int) -> None:
    """Second derivatives in the rotations of a group's nodes, from those in their quaternions."""
    for a in range(P + 1):
        i = ORDER[a]
        row = PLACES[i]
        # the increment keeps the quaternion on its sphere: a second-order term
        radial = spread(0.0)
        for c in range(4):
            radial += load(s.gradient, (i, c)) * load(s.frames, (i, c))
        for b in range(a + 1):
            j = ORDER[b]
            column = PLACES[j]
            for c in range(3):
                v0 = v1 = v2 = v3 = spread(0.0)
                for r in range(4):
                    left = load(s.columns, (i, 3 * r + c))
                    v0 += left * load(s.pairs, (a, b, 4 * r))
                    v1 += left * load(s.pairs, (a, b, 4 * r + 1))
                    v2 += left * load(s.pairs, (a, b, 4 * r + 2))
                    v3 += left * load(s.pairs, (a, b, 4 * r + 3))
                for d in range(3):
                    # (of a node with itself the upper triangle too, where nothing is read)
                    turned = (
                        v0 * load(s.columns, (j, d))
                        + v1 * load(s.columns, (j, 3 + d))
                        + v2 * load(s.columns, (j, 6 + d))
                        + v3 * load(s.columns, (j, 9 + d))
                    )
                    store(s.local, (group, row + c, column + d), turned)
        for c in range(3):
            _add(s.local, group, row + c, row + c, -0.25 * radial)


@compiled(**INLINED)
def _fill_group(rod: Rod, s: Solver, group: int, g: Array, n: Array, sigma: float, impulsive: bool) -> None:
    zero = spread(0.0)
    for i in range(SIZE):
        for j in range(i + 1):
            store(s.local, (group, i, j), zero)
    for a in range(P + 1):
        for b in range(a + 1):
            for c in range(16):
                store(s.pairs, (a, b, c), zero)
        for c in range(4):
            store(s.gradient, (a, c), zero)
    collect(g, group, rod.weights.shape[0] - 1, s.frames)
    _halves(s)
    for k in range(P):
        q, p = interpolated_fours(rod, group, k, s.frames)
        force = load(n, (group, k, 0)), load(n, (group, k, 1)), load(n, (group, k, 2))
        gq, gp, t, _, dt = second_derivatives(rod.stiff, rod.soft, q, p, force, s.hess)
        _fill_gap(rod, s, group, k, force, t, dt, sigma, impulsive)
        if not impulsive:
            _sum_pairs(rod, s, group, k, gq, gp)
    if not impulsive:
        _fill_turns(s, group)
    for i in range(P + 1):
        mass, row = load(rod.four.mass, (group, i)) * sigma, PLACES[i]
        _add(s.local, group, row, row, rod.spin * mass)
        if impulsive:
            _add(s.local, group, row + 1, row + 1, SMALL * mass)
            _add(s.local, group, row + 2, row + 2, SMALL * mass)
    for b in range(3):
        _add(s.local, group, b, b, load(rod.four.mass, (group, 0)) * sigma)
        _add(s.local, group, 3 + b, 3 + b, load(rod.four.mass, (group, P)) * sigma)


@compiled(**OPTIONS)
def fill(rod: Rod, s: Solver, g: Array, n: Array, sigma: float, impulsive: bool) -> None:
    """The lower triangles of the elements' tangents in s.local; sigma is d(force)/d(x) per mass.

    `impulsive`: that of the hidden constraints, in which stiffness plays no part.
    """
    for group in range(rod.four.weights.shape[0]):
        _fill_group(rod, s, group, g, n, sigma, impulsive)
