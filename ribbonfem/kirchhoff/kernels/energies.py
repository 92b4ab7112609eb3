"""What the rows of a motion tell of a Kirchhoff rod: its elastic energy, and the moment on its clamp."""

from __future__ import annotations

from ribbonfem.compiled.decorator import compiled
from ribbonfem.results import Array

from .tangent import INLINED, P, Rod, Solver, _interpolate, _strains, add_element


@compiled(**INLINED)
def elastic_energy(rod: Rod, s: Solver, g: Array, n: Array) -> float:
    """Of bending, twist and stretch."""
    total = 0.0
    for e in range(rod.weights.shape[0]):
        for k in range(P):
            _interpolate(rod, e, k, g, s.q, s.p)
            _, k1, k2, k3 = _strains(s.q, s.p, s.tangent)
            pull = n[e, k, 0] * s.tangent[0] + n[e, k, 1] * s.tangent[1] + n[e, k, 2] * s.tangent[2]
            twice = rod.stiff[0] * k1 * k1 + rod.stiff[1] * k2 * k2 + rod.stiff[2] * k3 * k3
            total += 0.5 * rod.weights[e, k] * (twice + rod.soft * pull * pull)
    return total


@compiled(**INLINED)
def clamp_moment(rod: Rod, s: Solver, x: Array, g: Array, n: Array) -> float:
    """Moment (EI2/L) of the left clamp on the ribbon, along growing alpha; overwrites residuals."""
    s.fp[0, 1] = 0.0
    add_element(rod, s, 0, x, g, n)
    return float(s.fp[0, 1])
