"""Constitutive law of the Kirchhoff rod in motion: reference strains and Kelvin-Voigt rates (`material`).

Strains of a group's Gauss point are (tau, -kappa2, kappa1) and the stretch, in arrays (G, P, 4, WIDTH).  A
rod that does not retard needs none of them kept: its arrays hold no groups.
"""

from __future__ import annotations

from typing import Any

from ribbonfem.jit.algebra import by_vector, dot, dot4, quaternion, scaled, triple
from ribbonfem.jit.decorator import compiled
from ribbonfem.jit.simd import WIDTH, lane, load, spread, store
from ribbonfem.results import Array
from ribbonfem.stepping.kernels.strains import put_rates

from .arrays import Scratch
from .batch import INLINED, OPTIONS, force_at, gather
from .gauss_point import Offset, interpolated, interpolated_group, strains_of, tangent_of
from .rod import P, Rod, Solver

Value = Any


@compiled(**INLINED)
def offset_at(rod: Rod, group: int, k: int) -> Offset:
    """What the strains and the stretch of a group's Gauss point count from."""
    if rod.has_offset:
        x, y, z = force_at(rod.offset, group, k)
        return (x, y, z), load(rod.offset, (group, k, 3))
    zero = spread(0.0)
    return (zero, zero, zero), zero


@compiled(**OPTIONS)
def put_strains(rod: Rod, s: Solver, g: Array, n: Array, strain: Array) -> None:
    """The strains of frames and the stretch of forces, into strain."""
    last = rod.weights.shape[0] - 1
    for group in range(strain.shape[0]):
        gather(g, group, last, P, s.frames)
        for k in range(P):
            q, p = interpolated_group(rod.value, rod.groups.slope, group, k, s.frames, P)
            inverse, tangent = tangent_of(q)
            k1, k2, k3 = strains_of(inverse, q, p)
            store(strain, (group, k, 0), k1)
            store(strain, (group, k, 1), k2)
            store(strain, (group, k, 2), k3)
            tension = dot(force_at(n, group, k), tangent)
            store(strain, (group, k, 3), load(rod.offset, (group, k, 3)) + rod.compliance[0] * tension)


@compiled(**OPTIONS)
def put_strain_rates(rod: Rod, g: Array, v: Array, spin: Array, dg: Array, rate: Array) -> None:
    """Rates of the strains of frames that turn at `spin` (nodes, 3), and of the stretch by velocities v.

    dg (nodes, 4) is overwritten by the rates of the frames, g spin / 2.
    """
    for i in range(g.shape[0]):
        half = scaled(0.5, triple(spin, i))
        dg[i, 0], dg[i, 1], dg[i, 2], dg[i, 3] = by_vector(quaternion(g, i), half)
    elements = rod.weights.shape[0]
    for place in range(WIDTH * rate.shape[0]):
        e, group, at = min(place, elements - 1), place // WIDTH, place % WIDTH
        for k in range(P):
            q, p = interpolated(rod.value, rod.slope, e, k, g, P)
            dq, dp = interpolated(rod.value, rod.slope, e, k, dg, P)
            inverse, t = tangent_of(q)
            strain = strains_of(inverse, q, p)
            first, second = strains_of(inverse, dq, p), strains_of(inverse, q, dp)
            longer = 2.0 * inverse * dot4(q, dq)
            for c in range(3):
                rate[group, k, c, at] = first[c] + second[c] - strain[c] * longer
            along = 0.0
            for i in range(P + 1):
                node, slope = e * P + i, rod.slope[e, k, i]
                along += slope * dot(triple(v, node), t)
            rate[group, k, 3, at] = along


@compiled(**OPTIONS)
def keep_strains(rod: Rod, s: Solver, t: Scratch, ft: float) -> None:
    """Strains of the stage solved and their rates, in t.strain and t.strain_rate."""
    put_strains(rod, s, t.g, t.n, t.strain)
    put_rates(t, ft)


@compiled(**OPTIONS)
def viscous_loss(rod: Rod, rate: Array) -> float:
    """Power that strain rates take: the sum of stiffness x retardation x rate^2."""
    total = 0.0
    elements = rod.weights.shape[0]
    for group in range(rate.shape[0]):
        share = spread(0.0)
        for k in range(P):
            weight = load(rod.groups.weights, (group, k))
            for c in range(3):
                speed = load(rate, (group, k, c))
                share += weight * (rod.elastic[c] * speed * speed)
            if rod.elastic[3] > 0.0:
                speed = load(rate, (group, k, 3))
                share += weight * (speed * speed / rod.elastic[3])
        for place in range(min(WIDTH, elements - WIDTH * group)):
            total += lane(share, place)
    return rod.retardation * total
