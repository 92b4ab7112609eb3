"""Constants of a Kirchhoff rod in motion as arrays (mesh, inertia, stiffness, weight), and solver memory.

Nodes are the Gauss-Lobatto nodes of elements of degree P; frames g are the unit quaternions of
`statics`, forces n are kept by their values at the P Gauss points.  `x` (nodes, 4) holds position
and theta, the angle about the tangent counted from the step's first instant: what is left of
conj(g0) g once the tangent has been carried along by the shortest rotation.  `v` and `a` are its
rates.  The clamped nodes are the first and the last.

What is done for every element is done for four at once (`jit.simd`): a group.  Arrays of a
group's values have an axis of groups first and one of `WIDTH` elements last; places without an
element repeat the last one, so that nothing there is ever singular.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ribbonfem.jit.references import by_reference
from ribbonfem.jit.simd import WIDTH
from ribbonfem.results import Array

from .batch import groups_of

# degree of the elements; a constant, so that the compiler knows the length of every inner loop
P = 5
# rows of an element's matrix: r of its left and its right node, psi of both, n, psi of the others
OUTER = N0 = 12
TURN0 = N0 + 3 * P
SIZE = TURN0 + 3 * (P - 1)
# first of the rows that psi inside the element is coupled to: not to r
TURNS = 6
# r and psi of a node, and where its left and its right element have them
SIX = 6
AS_LEFT, AS_RIGHT = (0, 1, 2, 6, 7, 8), (3, 4, 5, 9, 10, 11)
# the first row of psi of each of the element's nodes
PLACES = (6, *range(TURN0, SIZE, 3), 9)


@by_reference
class GroupTables(NamedTuple):
    """Tables of the elements, four at a time.

    slope (G, P, P + 1, WIDTH), weights (G, P, WIDTH); coupling (G, P, P + 1, WIDTH) = weights slope;
    share (G, P, P, WIDTH), the coupling of n with itself through the inner r at unit inertia; mass
    (G, P + 1, WIDTH), each element's lumps.
    """

    slope: Array
    weights: Array
    coupling: Array
    share: Array
    mass: Array


@by_reference
class Rod(NamedTuple):
    """The discretisation, see `LineTables`, the material and the loads.

    value (P, P + 1), slope (E, P, P + 1), weights (E, P); coupling (E, P, P + 1) = weights slope; groups:
    the same for groups; inertia (nodes, 4) of x; spin, J; gyroscopic, whether it turns with the tangent;
    middle, the node at midspan.  The law (`ribbonfem.material`): stiffness (3,) of (tau, -kappa2, kappa1) and
    compliance (1,), c, by which kernels take moments and stretch, offset (G, P, 4, WIDTH) of these strains
    and of the stretch, which counts where `has_offset`; elastic (4,), what of stiffness and c is elastic,
    natural (G, P, 3, WIDTH), retardation in t*.  weight (4,) of the whole ribbon, which counts where
    `has_weight`.
    """

    value: Array
    slope: Array
    weights: Array
    coupling: Array
    groups: GroupTables
    inertia: Array
    spin: float
    gyroscopic: bool
    middle: int
    stiffness: Array
    compliance: Array
    offset: Array
    has_offset: bool
    elastic: Array
    natural: Array
    retardation: float
    weight: Array
    has_weight: bool


@by_reference
class Solver(NamedTuple):
    """Memory of the tangent and its solution, allocated once.

    local (G, SIZE, SIZE, WIDTH), the lower triangle of each element's factors; pivots (G, SIZE, WIDTH),
    inverse; own and next (E + 1, SIX, SIX), of what is left for each end of an element, with itself and
    with the next (see `condensed`); right (E + 1, SIX) and local_right (G, SIZE, WIDTH); residuals fr, fp
    (nodes, 4; the last column of both is of no use), fn (G, P, 3, WIDTH), overwritten by the increments of
    r, psi and n.  The rest is of one group: frames and places of its nodes (P + 1, 4, WIDTH); gradients in q
    and p of its points (P, 8, WIDTH); gradient in its nodes' quaternions (P + 1, 4, WIDTH); hess of a point
    (64, WIDTH), of_q and of_p, its products with the nodes' values, and pairs and columns, see `pairs`.
    """

    local: Array
    own: Array
    next: Array
    right: Array
    local_right: Array
    pivots: Array
    fr: Array
    fp: Array
    fn: Array
    frames: Array
    places: Array
    gradients: Array
    gradient: Array
    hess: Array
    of_q: Array
    of_p: Array
    pairs: Array
    columns: Array
    block: Array


def solver(elements: int) -> Solver:
    """Memory for a mesh."""
    nodes, groups = elements * P + 1, groups_of(elements)

    def zeros(*shape: int) -> Array:
        return np.zeros((*shape, WIDTH))

    return Solver(
        local=zeros(groups, SIZE, SIZE),
        own=np.zeros((elements + 1, SIX, SIX)),
        next=np.zeros((elements + 1, SIX, SIX)),
        right=np.zeros((elements + 1, SIX)),
        local_right=zeros(groups, SIZE),
        pivots=zeros(groups, SIZE),
        fr=np.zeros((nodes, 4)),
        fp=np.zeros((nodes, 4)),
        fn=zeros(groups, P, 3),
        frames=zeros(P + 1, 4),
        places=zeros(P + 1, 4),
        gradients=zeros(P, 8),
        gradient=zeros(P + 1, 4),
        hess=zeros(64),
        of_q=zeros(P + 1, 16),
        of_p=zeros(P + 1, 16),
        pairs=zeros(P + 1, P + 1, 16),
        columns=zeros(P + 1, 12),
        block=np.zeros((SIX, SIX)),
    )
