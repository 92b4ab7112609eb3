"""Tangent matrices of the elements of the elastica in motion: second derivatives of the Lagrangian.

The mass is lumped, so that r inside an element is eliminated by a division; phi inside it, then n, follow
by a dense L D L^T without pivots.  (In this order: n's own block is nearly singular in its mean.)  Left are
x, z and phi of the nodes between elements, whatever the degree (`condensed`).
"""

from __future__ import annotations

from ribbonfem.jit.decorator import compiled
from ribbonfem.jit.groups import INLINED, OPTIONS
from ribbonfem.jit.simd import increase, load, spread, store
from ribbonfem.results import Array

from .beam import N0, PLACES, SIZE, Beam, P, Solver
from .gauss_point import Value, cosine_sine, interpolated, point_hessian, resolved
from .law import stretch_of

# by how much a rate of the stretched beam's axial force is held back in the hidden constraints
PENALTY = 1e12
# small rotary inertia that makes their tangent definite; refinement takes it out again
SMALL_INERTIA = 1e-7


@compiled(**INLINED)
def _fill_force(
    beam: Beam,
    s: Solver,
    group: int,
    k: int,
    cos: Value,
    sin: Value,
    by_turn: tuple[Value, Value],
    compliance: float,
) -> None:
    """The rows of n at a Gauss point: with itself, and with phi, `by_turn` a unit."""
    local, row = s.local, N0 + 2 * k
    axial = -compliance * beam.weights[k]
    increase(local, (group, row, row), axial * cos * cos)
    increase(local, (group, row + 1, row), axial * cos * sin)
    increase(local, (group, row + 1, row + 1), axial * sin * sin)
    for i in range(P + 1):
        place, value = PLACES[i], beam.value[k, i]
        if place < N0:
            store(local, (group, row, place), value * by_turn[0])
            store(local, (group, row + 1, place), value * by_turn[1])
        else:
            store(local, (group, place, row), value * by_turn[0])
            store(local, (group, place, row + 1), value * by_turn[1])


@compiled(**INLINED)
def _fill_rotations(beam: Beam, s: Solver, group: int, impulsive: bool) -> None:
    """The rows of phi with each other, of what s.points has."""
    local, curved = s.local, s.points
    for i in range(P + 1):
        for j in range(i + 1):
            total = spread(0.0 if impulsive else beam.stiffness[0] * beam.bending[i, j])
            if impulsive:
                if i == j:
                    total += SMALL_INERTIA * beam.mass[i]
            else:
                for k in range(P):
                    total += (beam.value[k, i] * beam.value[k, j]) * load(curved, (0, k))
            store(local, (group, max(PLACES[i], PLACES[j]), min(PLACES[i], PLACES[j])), total)


@compiled(**INLINED)
def _fill_ends(beam: Beam, s: Solver, group: int, sigma: float) -> None:
    """What is the same in all elements: r of the two ends, and n with itself through r inside."""
    local = s.local
    zero, left, right = spread(0.0), spread(sigma * beam.mass[0]), spread(sigma * beam.mass[P])
    for row in range(SIZE):
        for column in range(min(row, N0) + 1):
            store(local, (group, row, column), zero)
    store(local, (group, 0, 0), left)
    store(local, (group, 1, 1), left)
    store(local, (group, 2, 2), right)
    store(local, (group, 3, 3), right)
    for k in range(P):
        row = N0 + 2 * k
        first, last = spread(beam.coupling[k, 0]), spread(beam.coupling[k, P])
        store(local, (group, row, 0), first)
        store(local, (group, row, 2), last)
        store(local, (group, row + 1, 1), first)
        store(local, (group, row + 1, 3), last)
        for l in range(k + 1):
            share = spread(-beam.share[k, l] / sigma)
            store(local, (group, row, N0 + 2 * l), share)
            store(local, (group, row, N0 + 2 * l + 1), zero)
            store(local, (group, row + 1, N0 + 2 * l), zero)
            store(local, (group, row + 1, N0 + 2 * l + 1), share)


@compiled(**OPTIONS)
def fill(beam: Beam, s: Solver, u: Array, sigma: float, impulsive: bool) -> None:
    """The lower triangles of the elements' tangents in s.local; sigma is d(force)/d(r) per mass.

    `impulsive`: that of the hidden constraints, in which stiffness plays no part.
    """
    compliance = beam.compliance[0]
    for group in range(s.local.shape[0]):
        _fill_ends(beam, s, group, sigma)
        for k in range(P):
            angle, _, _, _ = interpolated(beam.value, beam.coupling, u, group, k)
            cos, sin = cosine_sine(angle)
            tension, shear = resolved(u, group, k, cos, sin)
            weight = beam.weights[k]
            stretch = weight * stretch_of(beam, group, k, tension)
            if impulsive:
                by_turn = sin * stretch, -1.0 * (cos * stretch)
                _fill_force(beam, s, group, k, cos, sin, by_turn, PENALTY if compliance > 0.0 else 0.0)
            else:
                curved, bx, bz = point_hessian(stretch, weight * compliance, cos, sin, tension, shear)
                store(s.points, (0, k), curved)
                _fill_force(beam, s, group, k, cos, sin, (bx, bz), compliance)
        _fill_rotations(beam, s, group, impulsive)
