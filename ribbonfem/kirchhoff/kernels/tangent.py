"""Second derivatives of the Lagrangian of a Kirchhoff rod in motion, element by element.

Tangent.  The mass is lumped, so that r inside an element is eliminated by a division; the
rotations inside it, then n, follow by a dense L D L^T without pivots.  (In this order: n's own
block is nearly singular in its mean.)  Left are r and psi of the nodes between elements, six
each, of which neighbours alone know each other, whatever the degree (`condensed`).
"""

from __future__ import annotations

from ribbonfem.jit.algebra import Quaternion, Value, Vector
from ribbonfem.jit.decorator import compiled
from ribbonfem.jit.simd import increase, load, spread, store
from ribbonfem.material.kernels import stretch_of
from ribbonfem.results import Array

from .batch import INLINED, OPTIONS, force_at, gather
from .gauss_point import Rows, interpolated_group, point_hessian, stretched
from .law import offset_at
from .rod import N0, PLACES, SIZE, P, Rod, Solver
from .rotation_hessian import (
    add_gradient,
    add_pairs,
    by_rotation,
    clear,
    fill_columns,
    pair_by_rotations,
    radial,
)

# by how much a rate of the stretched rod's axial force is held back in the hidden constraints
PENALTY = 1e12
# small rotary inertia of bending that makes their tangent definite; refinement takes it out again
SMALL_INERTIA = 1e-7


@compiled(**INLINED)
def _fill_row(rod: Rod, s: Solver, group: int, k: int, b: int, weight: Value, change: Quaternion) -> None:
    """Component b of n at a Gauss point, with positions and rotations; `change` is r' by the quaternion."""
    local, row = s.local, N0 + 3 * k + b
    store(local, (group, row, b), load(rod.groups.coupling, (group, k, 0)))
    store(local, (group, row, 3 + b), load(rod.groups.coupling, (group, k, P)))
    for i in range(P + 1):
        place, value = PLACES[i], weight * (-rod.value[k, i])
        for c in range(3):
            new = value * by_rotation(change, s.columns, i, c)
            if place < N0:
                store(local, (group, row, place + c), new)
            else:
                store(local, (group, place + c, row), new)


@compiled(**INLINED)
def _fill_gap(
    rod: Rod,
    s: Solver,
    group: int,
    k: int,
    n: Vector,
    stretch: Value,
    t: Vector,
    dt: Rows,
    sigma: float,
    impulsive: bool,
) -> None:
    """The rows of n at a Gauss point: with itself, the positions and the rotations."""
    local, row, weight = s.local, N0 + 3 * k, load(rod.groups.weights, (group, k))
    axial = weight * (-((PENALTY if rod.compliance[0] > 0.0 else 0.0) if impulsive else rod.compliance[0]))
    increase(local, (group, row, row), axial * t[0] * t[0])
    increase(local, (group, row + 1, row), axial * t[1] * t[0])
    increase(local, (group, row + 1, row + 1), axial * t[1] * t[1])
    increase(local, (group, row + 2, row), axial * t[2] * t[0])
    increase(local, (group, row + 2, row + 1), axial * t[2] * t[1])
    increase(local, (group, row + 2, row + 2), axial * t[2] * t[2])
    for l in range(k + 1):
        share = load(rod.groups.share, (group, k, l)) * (-1.0 / sigma)
        for b in range(3):
            increase(local, (group, row + b, N0 + 3 * l + b), share)
    change = stretched(n, stretch, 0.0 if impulsive else rod.compliance[0], t, dt)
    _fill_row(rod, s, group, k, 0, weight, change[0])
    _fill_row(rod, s, group, k, 1, weight, change[1])
    _fill_row(rod, s, group, k, 2, weight, change[2])


@compiled(**INLINED)
def _fill_rotations(s: Solver, group: int) -> None:
    """The rows of the rotations with each other; of a node with itself its upper triangle too, never read."""
    for i in range(P + 1):
        row = PLACES[i]
        for j in range(i + 1):
            column = PLACES[j]
            for c in range(3):
                a, b, d = pair_by_rotations(s.pairs, s.columns, i, j, c)
                if row >= column:
                    store(s.local, (group, row + c, column), a)
                    store(s.local, (group, row + c, column + 1), b)
                    store(s.local, (group, row + c, column + 2), d)
                else:
                    store(s.local, (group, column, row + c), a)
                    store(s.local, (group, column + 1, row + c), b)
                    store(s.local, (group, column + 2, row + c), d)
        for c in range(3):
            increase(s.local, (group, row + c, row + c), -0.25 * radial(s.gradient, s.frames, i))


@compiled(**INLINED)
def _fill_group(rod: Rod, s: Solver, group: int, g: Array, n: Array, sigma: float, impulsive: bool) -> None:
    zero = spread(0.0)
    for i in range(SIZE):
        for j in range(i + 1):
            store(s.local, (group, i, j), zero)
    for i in range(P + 1):
        clear(s.pairs[i], i + 1, 16)
    clear(s.gradient, P + 1, 4)
    gather(g, group, rod.weights.shape[0] - 1, P, s.frames)
    fill_columns(s.frames, 0.5, s.columns, P)
    for k in range(P):
        q, p = interpolated_group(rod.value, rod.groups.slope, group, k, s.frames, P)
        force = force_at(n, group, k)
        offset = offset_at(rod, group, k)
        gq, gp, t, tension, dt = point_hessian(rod.stiffness, rod.compliance[0], offset, q, p, force, s.hess)
        stretch = stretch_of(rod.compliance[0], offset[1], tension)
        _fill_gap(rod, s, group, k, force, stretch, t, dt, sigma, impulsive)
        if not impulsive:
            weight = load(rod.groups.weights, (group, k))
            for i in range(P + 1):
                slope = load(rod.groups.slope, (group, k, i))
                add_gradient(rod.value, k, i, slope, weight, (gq, gp), s.gradient)
            add_pairs(rod.value, rod.groups.slope, group, k, weight, s.hess, s.of_q, s.of_p, s.pairs, P)
    if not impulsive:
        _fill_rotations(s, group)
    for i in range(P + 1):
        mass, row = load(rod.groups.mass, (group, i)) * sigma, PLACES[i]
        increase(s.local, (group, row, row), rod.spin * mass)
        if impulsive:
            increase(s.local, (group, row + 1, row + 1), SMALL_INERTIA * mass)
            increase(s.local, (group, row + 2, row + 2), SMALL_INERTIA * mass)
    for b in range(3):
        increase(s.local, (group, b, b), load(rod.groups.mass, (group, 0)) * sigma)
        increase(s.local, (group, 3 + b, 3 + b), load(rod.groups.mass, (group, P)) * sigma)


@compiled(**OPTIONS)
def fill(rod: Rod, s: Solver, g: Array, n: Array, sigma: float, impulsive: bool) -> None:
    """The lower triangles of the elements' tangents in s.local; sigma is d(force)/d(x) per mass.

    `impulsive`: that of the hidden constraints, in which stiffness plays no part.
    """
    for group in range(rod.groups.weights.shape[0]):
        _fill_group(rod, s, group, g, n, sigma, impulsive)
