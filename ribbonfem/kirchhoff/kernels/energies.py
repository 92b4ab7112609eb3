"""What the rows of a motion tell of a Kirchhoff rod: its elastic energy, and the moment on its clamp."""

from __future__ import annotations

from ribbonfem.jit.decorator import compiled
from ribbonfem.jit.simd import WIDTH, lane, load, spread
from ribbonfem.results import Array

from .batch import INLINED, collect, force_at
from .gauss_point import bend, body, dot, interpolated, interpolated_fours, strains_of, tangent_of
from .rod import P, Rod, Solver


@compiled(**INLINED)
def elastic_energy(rod: Rod, s: Solver, g: Array, n: Array) -> float:
    """Of bending, twist and stretch."""
    elements, total = rod.weights.shape[0], 0.0
    for group in range(rod.four.weights.shape[0]):
        collect(g, group, elements - 1, P, s.frames)
        share = spread(0.0)
        for k in range(P):
            q, p = interpolated_fours(rod.value, rod.four.slope, group, k, s.frames, P)
            inverse, tangent = tangent_of(q)
            k1, k2, k3 = strains_of(inverse, q, p)
            pull = dot(force_at(n, group, k), tangent)
            twice = rod.stiffness[0] * k1 * k1 + rod.stiffness[1] * k2 * k2 + rod.stiffness[2] * k3 * k3
            share += load(rod.four.weights, (group, k)) * (twice + rod.compliance * pull * pull)
        for place in range(min(WIDTH, elements - WIDTH * group)):
            total += 0.5 * lane(share, place)
    return total


@compiled(**INLINED)
def clamp_moment(rod: Rod, g: Array, n: Array) -> float:
    """Moment (EI2/L) of the left clamp on the ribbon, along growing alpha."""
    f0 = f1 = f2 = f3 = 0.0
    for k in range(P):
        q, p = interpolated(rod.value, rod.slope, 0, k, g, P)
        gq, gp, _, _ = bend(
            rod.stiffness, rod.compliance, q, p, (n[0, k, 0, 0], n[0, k, 1, 0], n[0, k, 2, 0])
        )
        value, slope = rod.weights[0, k] * rod.value[k, 0], rod.weights[0, k] * rod.slope[0, k, 0]
        f0, f1 = f0 + value * gq[0] + slope * gp[0], f1 + value * gq[1] + slope * gp[1]
        f2, f3 = f2 + value * gq[2] + slope * gp[2], f3 + value * gq[3] + slope * gp[3]
    return float(body((g[0, 0], g[0, 1], g[0, 2], g[0, 3]), (f0, f1, f2, f3))[1])
