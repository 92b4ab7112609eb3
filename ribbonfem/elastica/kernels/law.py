"""The material of the elastica in motion: moment and stretch with retardation, strains remembered.

Strains of a group's Gauss point are the curvature and the stretch, in arrays (G, P, 2, WIDTH).  A beam that
does not retard needs none of them kept: its arrays hold no groups.
"""

from __future__ import annotations

from typing import Any

from ribbonfem.jit.decorator import compiled
from ribbonfem.jit.groups import INLINED, OPTIONS
from ribbonfem.jit.simd import load, spread, store, summed
from ribbonfem.results import Array
from ribbonfem.stepping.kernels.strains import put_rates

from .arrays import Scratch
from .beam import Beam, P, Z
from .gauss_point import cosine_sine, interpolated, resolved

Value = Any


@compiled(**INLINED)
def moment_of(beam: Beam, group: int, k: int, curvature: Value) -> Value:
    """The moment at a Gauss point."""
    return beam.stiffness[0] * (curvature - load(beam.offset, (group, k, 0)))


@compiled(**INLINED)
def stretch_of(beam: Beam, group: int, k: int, tension: Value) -> Value:
    """The length of r' at a Gauss point under an axial force."""
    return 1.0 + load(beam.offset, (group, k, 1)) + beam.compliance[0] * tension


@compiled(**OPTIONS)
def put_strains(beam: Beam, u: Array, strain: Array) -> None:
    """The strains of a state, into strain."""
    for group in range(strain.shape[0]):
        for k in range(P):
            angle, bent, _, _ = interpolated(beam.value, beam.coupling, u, group, k)
            cos, sin = cosine_sine(angle)
            tension, _ = resolved(u, group, k, cos, sin)
            store(strain, (group, k, 0), bent * (1.0 / beam.weights[k]))
            store(strain, (group, k, 1), stretch_of(beam, group, k, tension) - 1.0)


@compiled(**OPTIONS)
def put_strain_rates(beam: Beam, u: Array, v: Array, phi_rate: Array, rate: Array) -> None:
    """Rates of the strains of a state whose nodes move by v (G, PHI, WIDTH) and turn by phi_rate."""
    for group in range(rate.shape[0]):
        for k in range(P):
            angle, _, _, _ = interpolated(beam.value, beam.coupling, u, group, k)
            cos, sin = cosine_sine(angle)
            bent = x = z = spread(0.0)
            for i in range(P + 1):
                bent += beam.coupling[k, i] * load(phi_rate, (group, i))
                x += beam.coupling[k, i] * load(v, (group, i))
                z += beam.coupling[k, i] * load(v, (group, Z + i))
            inverse = 1.0 / beam.weights[k]
            store(rate, (group, k, 0), inverse * bent)
            store(rate, (group, k, 1), inverse * (x * cos + z * sin))


@compiled(**OPTIONS)
def keep_strains(beam: Beam, t: Scratch, f: float) -> None:
    """Strains of the stage solved and their rates, in t.strain and t.strain_rate."""
    put_strains(beam, t.u, t.strain)
    put_rates(t, f)


@compiled(**OPTIONS)
def viscous_loss(beam: Beam, rate: Array) -> float:
    """Power that strain rates take: the sum of stiffness x retardation x rate^2."""
    axial_stiffness = 1.0 / beam.elastic[1] if beam.elastic[1] > 0.0 else 0.0
    total = spread(0.0)
    for group in range(rate.shape[0]):
        share = spread(0.0)
        for k in range(P):
            bent, longer = load(rate, (group, k, 0)), load(rate, (group, k, 1))
            share += beam.weights[k] * (beam.elastic[0] * bent * bent + axial_stiffness * longer * longer)
        total += load(beam.real, (group,)) * share
    return beam.retardation * summed(total)
