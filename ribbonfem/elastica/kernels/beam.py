"""The discretised elastica in motion as a tuple of arrays, and how a state's unknowns are laid out in memory.

Elements have degree P with nodes at the Gauss-Lobatto points; forces n are kept by their values at
the P Gauss points, which take all integrals, and the mass is lumped at the nodes.  A state is one
array (G, ROWS, WIDTH) of groups of elements (`jit.groups`): x of the P + 1 nodes, then z, then
phi, then n of the P points, (x, z) by (x, z).  A node between two elements is in it twice, so that
an element has all its numbers side by side.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ribbonfem.jit.groups import groups_of
from ribbonfem.jit.references import by_reference
from ribbonfem.jit.simd import WIDTH
from ribbonfem.results import Array

# degree of the elements; a constant, so that the compiler knows the length of every inner loop
P = 5
# rows of a state: x begins at 0; those up to PHI carry mass
Z, PHI, FORCE, ROWS = P + 1, 2 * (P + 1), 3 * (P + 1), 5 * P + 3
# rows of an element's matrix: x and z of its left and its right node, phi of both, n, phi of the others
OUTER = N0 = 6
TURN0 = N0 + 2 * P
SIZE = TURN0 + P - 1
# first of the rows that phi inside the element is coupled to: not to x and z
TURNS = 4
# x, z and phi of a node, and where its left and its right element have them
THREE = 3
AS_LEFT, AS_RIGHT = (0, 1, 4), (2, 3, 5)
# the row of phi of each of the element's nodes
PLACES = (4, *range(TURN0, SIZE), 5)


@by_reference
class Beam(NamedTuple):
    """The discretisation of a uniform mesh, the same for every element, and what acts on it.

    value (P, P + 1), shape functions at the Gauss points; weights (P,); coupling (P, P + 1) = weights times
    derivatives of the shape functions; bending (P + 1, P + 1), int N_i' N_j'; share (P, P), the coupling of
    n with itself through the inner x at unit inertia; mass (P + 1,), lumps, inverse_mass, one over them, and
    inside (P, P + 1), coupling over them; slopes (P + 1, P + 1), derivatives at the nodes; real (G, WIDTH),
    1 where there is an element and 0 elsewhere; middle (G, P + 1, WIDTH), by which nodal values are one at
    midspan, and push, the same over the lumps; weight (2,), along x and z (EI2/L^3); chord, 1 - dL/L without
    the compression added; elements, their number.

    The law (`law`): natural (G, P, 1, WIDTH), the curvature without a moment; offset (G, P, 2, WIDTH), what
    curvature and stretch count from; stiffness (1,) and compliance (1,); elastic (2,), 1 and c, both
    where nothing retards; retardation, in t*.
    """

    value: Array
    weights: Array
    coupling: Array
    bending: Array
    share: Array
    mass: Array
    inverse_mass: Array
    inside: Array
    slopes: Array
    real: Array
    middle: Array
    push: Array
    weight: Array
    chord: float
    elements: int
    natural: Array
    offset: Array
    stiffness: Array
    compliance: Array
    elastic: Array
    retardation: float


@by_reference
class Solver(NamedTuple):
    """Memory of the tangent and its solution, allocated once.

    local (G, SIZE, SIZE, WIDTH), the lower triangle of each element's factors; pivots (G, SIZE, WIDTH),
    inverse; own and next (E + 1, THREE, THREE), of what is left for each end of an element, with itself and
    with the next (see `condensed`); right (E + 1, THREE) and local_right (G, SIZE, WIDTH); rest, a residual
    in the order of a state, overwritten by the increments; points (2, P + 1, WIDTH), of a group.
    """

    local: Array
    own: Array
    next: Array
    right: Array
    local_right: Array
    pivots: Array
    rest: Array
    points: Array


def solver(elements: int) -> Solver:
    """Memory for a mesh."""
    groups = groups_of(elements)

    def zeros(*shape: int) -> Array:
        return np.zeros((*shape, WIDTH))

    return Solver(
        local=zeros(groups, SIZE, SIZE),
        own=np.zeros((elements + 1, THREE, THREE)),
        next=np.zeros((elements + 1, THREE, THREE)),
        right=np.zeros((elements + 1, THREE)),
        local_right=zeros(groups, SIZE),
        pivots=zeros(groups, SIZE),
        rest=zeros(groups, ROWS),
        points=zeros(2, P + 1),
    )
