"""Residual and tangent of a stage of the quasi-linear beam in motion, for Newton with kept factors.

    (1)  M (Z_tt + nu Z_t) + K (Z + tau Z_t) - sigma^2 G Z = loads
    (2)  Z^T G Z / 2 = 1 + (compression added) / dL

with z = zp + b a and v = vp + f a, and tau the time of retardation.  The tangent is a band that depends on
the step and on the load alone, and a border by the constraint, G Z, which every iteration takes anew.
"""

from __future__ import annotations

import math

from ribbonfem.ends.planar_kernels import COMPRESSION, LEFT, LIFT, PUSH, RIGHT
from ribbonfem.jit.decorator import compiled
from ribbonfem.jit.groups import INLINED, OPTIONS
from ribbonfem.jit.simd import WIDTH, greatest, larger, load_from, spread, store_from, summed
from ribbonfem.results import Array
from ribbonfem.stepping.kernels.newton import RATE, SIGMA, foretold

from .bands import add_product, dot, factor, invert, solve_both, widen
from .beam import ENDS, Beam, Matrix, Moving, Scratch

# rate of increments by what the constraint bends over one (Z): that of three half-waves, and a third more
CURVED = 30.0


@compiled(**OPTIONS)
def set_ends(beam: Beam, controls: Array, ends: Array) -> None:
    """Put the ends (3, 4), with their rates and accelerations, where the controls are."""
    for which in range(3):
        ends[which, 0] = 0.0
        ends[which, 1] = -controls[LEFT, which] / beam.scale
        ends[which, 2] = controls[LIFT, which] / beam.scale
        ends[which, 3] = controls[RIGHT, which] / beam.scale


@compiled(**INLINED)
def shortening(beam: Beam, controls: Array, which: int) -> float:
    """The right of (2) at the clamps as they are, or its rates."""
    added = controls[COMPRESSION, which] / (beam.scale * beam.scale)
    return 1.0 + added if which == 0 else added


@compiled(**INLINED)
def add_ends(matrix: Matrix, factor: float, e: Array, y: Array) -> None:
    """y (N,) += factor times the matrix's rows of the free dofs against the ends e (4,)."""
    for c in range(ENDS):
        if e[c] != 0.0:
            for i in range(y.shape[0]):
                y[i] += factor * e[c] * matrix.ends[c, i]


@compiled(**OPTIONS)
def at_end(matrix: Matrix, c: int, z: Array, e: Array) -> float:
    """Row c of the ends of the product with (z, e)."""
    total = dot(matrix.ends[c], z)
    for other in range(ENDS):
        total += matrix.corner[c, other] * e[other]
    return total


@compiled(**OPTIONS)
def put_product(matrix: Matrix, z: Array, e: Array, t: Scratch) -> None:
    """Put the free rows of A (z, e) in t.product."""
    for i in range(z.shape[0]):
        t.product[i] = 0.0
    widen(z, t.wide)
    add_product(matrix.band, 1.0, t.wide, t.product)
    add_ends(matrix, 1.0, e, t.product)


@compiled(**OPTIONS)
def square(matrix: Matrix, z: Array, wide: Array, e: Array) -> float:
    """(z, e) A (z, e), of z that stands in the middle of a wide array."""
    total = spread(0.0)
    for i in range(0, z.shape[0], WIDTH):
        free, ends = spread(0.0), spread(0.0)
        for d in range(matrix.band.shape[0]):
            free += load_from(matrix.band, (d, i)) * load_from(wide, (i + d,))
        for c in range(ENDS):
            if e[c] != 0.0:
                ends += e[c] * load_from(matrix.ends, (c, i))
        total += load_from(z, (i,)) * (free + ends + ends)
    result: float = summed(total)
    for c in range(ENDS):
        if e[c] != 0.0:
            for other in range(ENDS):
                result += e[c] * matrix.corner[c, other] * e[other]
    return result


@compiled(**OPTIONS)
def put_loads(beam: Beam, t: Scratch, nu: float) -> None:
    """Put what ends and loads do to the free dofs of a stage in t.pulled and t.loads, to (2) in t.fixed."""
    k, g, m, tau = beam.stiffness, beam.tension, beam.mass, beam.retardation
    push, ends = t.controls[PUSH, 0] / beam.scale, t.ends
    for i in range(0, t.loads.shape[0], WIDTH):
        loads = (
            load_from(beam.weight, (i,)) + load_from(beam.bent, (i,)) - push * load_from(beam.middle, (0, i))
        )
        pulled = spread(0.0)
        for c in range(ENDS):
            if ends[0, c] != 0.0 or ends[1, c] != 0.0 or ends[2, c] != 0.0:
                pulled += ends[0, c] * load_from(g.ends, (c, i))
                loads -= (ends[0, c] + tau * ends[1, c]) * load_from(k.ends, (c, i))
                loads -= (ends[2, c] + nu * ends[1, c]) * load_from(m.ends, (c, i))
        store_from(t.loads, (i,), loads)
        store_from(t.pulled, (i,), pulled)
    corner = 0.0
    for c in range(ENDS):
        if ends[0, c] != 0.0:
            for d in range(ENDS):
                corner += ends[0, c] * g.corner[c, d] * ends[0, d]
    t.fixed[0] = 0.5 * corner - shortening(beam, t.controls, 0)


@compiled(**OPTIONS)
def add_viscous_loads(beam: Beam, t: Scratch, b: float, f: float) -> None:
    """Add to t.loads what a stage knows of the viscous moments; z counts the more for the rest of them."""
    share = f / b
    t.stiffening[0] = 1.0 + beam.retardation * share
    for i in range(t.loads.shape[0]):
        t.product[i] = t.vp[i] - share * t.rp[i]
    widen(t.product, t.wide)
    add_product(beam.stiffness.band, -beam.retardation, t.wide, t.loads)


@compiled(**INLINED)
def residual(model: Moving, sigma: float) -> None:
    """What is left over of (1) in t.rest, of (2) in t.change, and G Z in t.row."""
    beam, t = model.beam, model.scratch
    k, g, m = beam.stiffness.band, beam.tension.band, beam.mass.band
    load, stiffening = t.load[0], t.stiffening[0]
    twice = spread(0.0)
    for i in range(0, t.z.shape[0], WIDTH):
        pulled = load_from(t.pulled, (i,))
        moment, row, inertia = spread(0.0), pulled, spread(0.0)
        for d in range(k.shape[0]):
            z = load_from(t.wide_z, (i + d,))
            moment += load_from(k, (d, i)) * z
            row += load_from(g, (d, i)) * z
            inertia += load_from(m, (d, i)) * z
        store_from(t.row, (i,), row)
        rest = stiffening * moment - load * row + sigma * inertia - load_from(t.loads, (i,))
        store_from(t.rest, (i,), rest)
        twice += load_from(t.z, (i,)) * (row + pulled)
    t.change[0] = 0.5 * summed(twice) + t.fixed[0]


@compiled(**OPTIONS)
def factorise_sum(beam: Beam, t: Scratch, of_k: float, of_g: float, of_m: float) -> None:
    """Factors, or the inverse, of a sum of the beam's matrices."""
    k, g, m = beam.stiffness.band, beam.tension.band, beam.mass.band
    n, margin = k.shape[1], k.shape[0] // 2
    t.factors[:] = 0.0
    for d in range(margin + 1):
        for i in range(n - d):
            entry = of_k * k[margin + d, i] + of_g * g[margin + d, i] + of_m * m[margin + d, i]
            if t.pivots.shape[0] > 0:
                t.factors[d, i] = entry
            else:
                t.factors[i, i + d] = t.factors[i + d, i] = entry
    if t.pivots.shape[0] > 0:
        factor(t.factors, t.pivots)
    else:
        invert(t.factors, beam.even, t.column)


@compiled(**OPTIONS)
def factorise(model: Moving, sigma: float) -> None:
    """Of the tangent at the stage's load."""
    t = model.scratch
    t.factored[0], t.factored[1] = t.stiffening[0], t.load[0]
    factorise_sum(model.beam, t, t.stiffening[0], -t.load[0], sigma)


@compiled(**OPTIONS)
def solve(model: Moving, sigma: float) -> float:
    """Increments of z and of the load in t.rest and t.change; the largest of a height."""
    t, height = model.scratch, model.beam.height
    solve_both(t.factors, t.pivots, model.beam.even, t.rest, t.row, t.product, t.column)
    # A dz - row dload = -rest, row dz = -change
    more = (dot(t.row, t.product) - t.change[0]) / dot(t.row, t.column)
    largest = spread(0.0)
    for i in range(0, t.rest.shape[0], WIDTH):
        step = more * load_from(t.column, (i,)) - load_from(t.product, (i,))
        store_from(t.rest, (i,), step)
        largest = larger(largest, load_from(height, (i,)) * larger(step, -step))
    t.change[0] = more
    return greatest(largest) + 0.0 * more


@compiled(**INLINED)
def foretell(model: Moving, sigma: float, size: float, made: int, clock: Array) -> float:
    """A bound of the rate at which increments fall, in the norm of s K + sigma M, s the stiffening.

    With factors of other s, sigma and load an increment d leaves what their differences make of K d, M d and
    G d; and d G d = - int d d'' is at most (d K d)^(1/2) (d M d)^(1/2), so that G is at most
    (s K + sigma M) / (2 (s sigma)^(1/2)).  Of the constraint d G d / 2 is left besides.
    It is kept in the clock as a rate that was measured is.
    """
    t, kept = model.scratch, clock[SIGMA]
    stiffening, load = t.factored[0], t.factored[1]
    most = 2.0 * math.sqrt(stiffening * kept)
    if load >= 0.5 * most:
        return foretold(model, sigma, size, made, clock)
    changed = max(abs(t.stiffening[0] - stiffening) / stiffening, abs(sigma - kept) / kept)
    rate = (changed + abs(t.load[0] - load) / most) / (1.0 - load / most) + CURVED * size
    clock[RATE] = rate
    return min(0.9, rate)


@compiled(**INLINED)
def move(model: Moving) -> None:
    """Add the increments."""
    t = model.scratch
    for i in range(t.z.shape[0]):
        t.z[i] += t.rest[i]
    t.load[0] += t.change[0]
