"""A Kirchhoff rod in motion as arrays, and the memory in which it is solved.

Nodes are the Gauss-Lobatto nodes of elements of degree P; frames g are the unit quaternions of
`statics`, forces n are kept by their values at the P Gauss points.  `x` (nodes, 4) holds position
and theta, the angle about the tangent counted from the step's first instant: what is left of
conj(g0) g once the tangent has been carried along by the shortest rotation.  `v` and `a` are its
rates.  The clamped nodes are the first and the last.

What is done for every element is done for four at once (`compiled.lanes`): a group.  Arrays of a
group's values have an axis of groups first and one of `WIDTH` elements last; places without an
element repeat the last one, so that nothing there is ever singular.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ribbonfem.compiled.decorator import compiled
from ribbonfem.compiled.lanes import WIDTH, load, store, transposed
from ribbonfem.results import Array

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
# the element's nodes in the order of their rows, and the first row of each one's psi
ORDER = (0, P, *range(1, P))
PLACES = (6, *range(TURN0, SIZE, 3), 9)
OPTIONS: dict[str, Any] = {"error_model": "numpy", "fastmath": {"contract", "reassoc", "nsz"}}
# of what is called for an element, a point or a node: to hand over these tuples costs more than its work
INLINED: dict[str, Any] = {**OPTIONS, "forceinline": True}


class Four(NamedTuple):
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


class Rod(NamedTuple):
    """The discretisation, see `LineTables`.

    value (P, P + 1), slope (E, P, P + 1), weights (E, P); coupling (E, P, P + 1) = weights slope; four:
    the same for groups; inertia (nodes, 4) of x; stiff (3,) of (tau, -kappa2, kappa1); soft, c; spin, J;
    gyroscopic, whether it turns with the tangent; middle, the node at midspan.
    """

    value: Array
    slope: Array
    weights: Array
    coupling: Array
    four: Four
    inertia: Array
    stiff: Array
    soft: float
    spin: float
    gyroscopic: bool
    middle: int


class Solver(NamedTuple):
    """Memory of the tangent and its solution, allocated once.

    local (G, SIZE, SIZE, WIDTH), the lower triangle of each element's factors; pivots (G, SIZE, WIDTH),
    inverse; own and next (E + 1, SIX, SIX), of what is left for each end of an element, with itself and
    with the next (see `condensed`); right (E + 1, SIX) and local_right (G, SIZE, WIDTH); residuals fr, fp
    (nodes, 4; the last column of both is of no use), fn (G, P, 3, WIDTH), overwritten by the increments of
    r, psi and n.  The rest is of one group: frames and positions of its nodes (P + 1, 4, WIDTH); gradients
    in q and p of its points (P, 8, WIDTH), and in its nodes' quaternions (P + 1, 4, WIDTH); second derivatives of a point
    (64, WIDTH), and of the group in one node's quaternion and another's, 16 a pair; derivatives of quaternions in rotations (P + 1, 12, WIDTH).
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

    def four(*shape: int) -> Array:
        return np.zeros((*shape, WIDTH))

    return Solver(
        local=four(groups, SIZE, SIZE),
        own=np.zeros((elements + 1, SIX, SIX)),
        next=np.zeros((elements + 1, SIX, SIX)),
        right=np.zeros((elements + 1, SIX)),
        local_right=four(groups, SIZE),
        pivots=four(groups, SIZE),
        fr=np.zeros((nodes, 4)),
        fp=np.zeros((nodes, 4)),
        fn=four(groups, P, 3),
        frames=four(P + 1, 4),
        places=four(P + 1, 4),
        gradients=four(P, 8),
        gradient=four(P + 1, 4),
        hess=four(64),
        of_q=four(P + 1, 16),
        of_p=four(P + 1, 16),
        pairs=four(P + 1, P + 1, 16),
        columns=four(P + 1, 12),
        block=np.zeros((SIX, SIX)),
    )


def groups_of(elements: int) -> int:
    """How many groups of `WIDTH` hold so many elements."""
    return -(-elements // WIDTH)


def in_fours(table: Array) -> Array:
    """A table (E, ...) as (G, ..., WIDTH)."""
    elements = len(table)
    which = np.minimum(np.arange(WIDTH * groups_of(elements)), elements - 1)
    return np.ascontiguousarray(np.moveaxis(table[which].reshape(-1, WIDTH, *table.shape[1:]), 1, -1))


@compiled(**INLINED)
def of_nodes(array: Array, group: int, last: int, i: int) -> tuple[Any, Any, Any, Any]:
    """The four numbers in array (nodes, 4) of node i of a group's elements; `last` is the mesh's last element."""
    e = WIDTH * group
    return transposed(
        load(array, (min(e, last) * P + i,)),
        load(array, (min(e + 1, last) * P + i,)),
        load(array, (min(e + 2, last) * P + i,)),
        load(array, (min(e + 3, last) * P + i,)),
    )


@compiled(**INLINED)
def add_to_nodes(
    array: Array, group: int, last: int, i: int, a: Any, b: Any, c: Any, d: Any, kept: bool
) -> None:
    """The reverse: add four values to array, or put them there if what was is not `kept`."""
    rows = transposed(a, b, c, d)
    e = WIDTH * group
    node = e * P + i
    _add(array, node, rows[0], kept)
    if e + 1 <= last:
        _add(array, node + P, rows[1], kept)
    if e + 2 <= last:
        _add(array, node + 2 * P, rows[2], kept)
    if e + 3 <= last:
        _add(array, node + 3 * P, rows[3], kept)


@compiled(**INLINED)
def _add(array: Array, node: int, row: Any, kept: bool) -> None:
    store(array, (node,), load(array, (node,)) + row if kept else row)
