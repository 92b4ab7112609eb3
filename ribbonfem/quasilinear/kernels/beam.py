"""The discretised quasi-linear beam in motion as tuples of arrays: matrices, state, memory of a step.

Heights are Z = z / L (dL/L)^(-1/2).  Unknowns are the free dofs z (n,) and the load sigma^2; the ends
e = (Z, Z' at s = 0, Z, Z' at s = 1) are what the clamps do.  Of K, G and M, the matrices of int Z''^2,
int Z'^2 and int Z^2, there is the band of the free dofs (`bands`), the rows of the ends against them (4, N),
and the ends' own (4, 4).  N is n, and places without a dof that make it a multiple of four: they have a mass
and nothing else, and stay 0.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ribbonfem.ends.planar_kernels import CONTROLS
from ribbonfem.jit.references import by_reference
from ribbonfem.jit.simd import WIDTH
from ribbonfem.results import Array
from ribbonfem.stepping.kernels.guess import MEMORY

from .bands import FEW

ENDS = 4
# of `Motion`, the arrays of dofs
DOFS = ("z", "v", "a", "auxiliary")


@by_reference
class Matrix(NamedTuple):
    """A symmetric matrix: band (2 w + 1, N), ends (4, N), corner (4, 4)."""

    band: Array
    ends: Array
    corner: Array


@by_reference
class Beam(NamedTuple):
    """The discretisation, and what acts on it.

    middle (2, N + 4) makes Z and Z' at midspan of z and e; height (N,) is the largest value of each shape
    function; weight and bent (N + 4,) are the loads of the weight along z and of the natural curvature, over
    (dL/L)^(1/2), which is `scale`; own, the energy of that curvature in the straight beam, over dL/L;
    retardation in t*; even, places of dofs of even shape, which meet none of the odd ones behind them, or N.
    """

    stiffness: Matrix
    tension: Matrix
    mass: Matrix
    middle: Array
    height: Array
    weight: Array
    bent: Array
    own: float
    scale: float
    retardation: float
    even: int


@by_reference
class Motion(NamedTuple):
    """State at the last accepted instant: z, v, a, auxiliary (N,); load (1,); ends (3, 4), e and rates."""

    z: Array
    v: Array
    a: Array
    auxiliary: Array
    load: Array
    ends: Array
    clock: Array


@by_reference
class Scratch(NamedTuple):
    """What a step overwrites, and the stages remembered for guesses.

    z, v, a, load, ends as in `Motion`, of the stage; rp, vp, known: z = rp + b a, v = vp + f a, and what
    stands against sigma z in the inertia; pulled, G e; loads, the forces of ends, loads and known on the free
    dofs; fixed (1,), what the ends are in the constraint; row, G Z; rest, a residual, overwritten by the
    increments; change (1,), that of the load; product, column: (N,) of use for a moment, wide
    (w + N + w,), and jumps (4,); wide_z, wide_v, wide_known, in whose middle z, v and known stand;
    factors (w + 1, N + w) and pivots (N,), inverse, or in place of both the inverse (N, N);
    stiffening (1,), by how much the beam that retards is stiffer to a stage's displacements; factored (2,),
    that and the load of the factors.
    """

    z: Array
    v: Array
    a: Array
    load: Array
    ends: Array
    rp: Array
    vp: Array
    known: Array
    pulled: Array
    loads: Array
    fixed: Array
    row: Array
    rest: Array
    change: Array
    product: Array
    column: Array
    wide: Array
    wide_z: Array
    wide_v: Array
    wide_known: Array
    factors: Array
    pivots: Array
    stage_v: Array
    stage_a: Array
    known_time: Array
    known_a: Array
    known_load: Array
    controls: Array
    jumps: Array
    stiffening: Array
    factored: Array


@by_reference
class Moving(NamedTuple):
    """A beam in motion.

    `row_z` and `row_v` (rows, n + 4) take z and e of rows, and their rates; `row_slope` Z' at midspan.
    """

    beam: Beam
    scratch: Scratch
    motion: Motion
    row_z: Array
    row_v: Array
    row_slope: Array


def padded(table: Array, dofs: int) -> Array:
    """A table (..., n) or (..., n + 4) of n dofs as (..., N) or (..., N + 4)."""
    places = WIDTH * -(-dofs // WIDTH)
    if places == dofs:
        return np.array(table, order="C")
    result = np.zeros((*table.shape[:-1], places + table.shape[-1] - dofs))
    result[..., :dofs], result[..., places:] = table[..., :dofs], table[..., dofs:]
    return result


def scratch(count: int, width: int, stages: int) -> Scratch:
    """Memory for so many places, a half-bandwidth and a method."""
    few = count <= FEW
    a, rp, vp, pulled, loads, row, rest, product, column = np.zeros((9, count))
    stage_v, stage_a = np.zeros((2, stages, count))
    wide, wide_z, wide_v, wide_known = np.zeros((4, count + 2 * width))
    return Scratch(
        z=wide_z[width : width + count],
        v=wide_v[width : width + count],
        a=a,
        load=np.zeros(1),
        ends=np.zeros((3, ENDS)),
        rp=rp,
        vp=vp,
        known=wide_known[width : width + count],
        pulled=pulled,
        loads=loads,
        fixed=np.zeros(1),
        row=row,
        rest=rest,
        change=np.zeros(1),
        product=product,
        column=column,
        wide=wide,
        wide_z=wide_z,
        wide_v=wide_v,
        wide_known=wide_known,
        factors=np.zeros((count, count) if few else (width + 1, count + width)),
        pivots=np.zeros(0 if few else count),
        stage_v=stage_v,
        stage_a=stage_a,
        known_time=np.zeros(MEMORY),
        known_a=np.zeros((MEMORY, count)),
        known_load=np.zeros(MEMORY),
        controls=np.zeros((CONTROLS, 3)),
        jumps=np.zeros(ENDS),
        stiffening=np.ones(1),
        factored=np.ones(2),
    )
