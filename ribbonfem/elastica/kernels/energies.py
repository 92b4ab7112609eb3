"""What the rows of a motion tell of the elastica: its energies, and the moment on its left clamp."""

from __future__ import annotations

from ribbonfem.jit.decorator import compiled
from ribbonfem.jit.groups import INLINED, OPTIONS
from ribbonfem.jit.simd import lane, load, spread
from ribbonfem.results import Array

from .beam import FORCE, Beam, P, Z
from .points import Value, cosine_sine, interpolated, resolved


@compiled(**INLINED)
def summed(value: Value) -> float:
    """The four of a value together."""
    return (lane(value, 0) + lane(value, 1)) + (lane(value, 2) + lane(value, 3))


@compiled(**OPTIONS)
def kinetic_energy(beam: Beam, v: Array) -> float:
    """Of velocities (G, PHI, WIDTH)."""
    total = spread(0.0)
    for group in range(v.shape[0]):
        share = spread(0.0)
        for i in range(P + 1):
            x, z = load(v, (group, i)), load(v, (group, Z + i))
            share += beam.mass[i] * (x * x + z * z)
        total += load(beam.real, (group,)) * share
    return 0.5 * summed(total)


@compiled(**INLINED)
def _moment_at(beam: Beam, k: int, bent: Value, natural: Value, along: Value, across: Value) -> Value:
    """What a Gauss point has of the moment on the left node of its element."""
    moment = beam.coupling[k, 0] * (bent * (1.0 / beam.weights[k]) - natural)
    return moment - (beam.value[k, 0] * beam.weights[k]) * (1.0 + beam.soft * along) * across


@compiled(**OPTIONS)
def clamp_moment(beam: Beam, u: Array) -> float:
    """The moment (EI2/L) of the left clamp on the beam, along phi."""
    moment = spread(0.0)
    for k in range(P):
        angle, bent, _, _ = interpolated(beam.value, beam.coupling, u, 0, k)
        cos, sin = cosine_sine(angle)
        along, across = resolved(u, 0, k, cos, sin)
        moment += _moment_at(beam, k, bent, load(beam.natural, (0, k)), along, across)
    return lane(moment, 0)


@compiled(**OPTIONS)
def elastic_state(beam: Beam, u: Array) -> tuple[float, float, float]:
    """Elastic energy, moment of the left clamp and mean compressive force of a state."""
    elastic = force = first = spread(0.0)
    for group in range(u.shape[0]):
        share = pull = moment = spread(0.0)
        for k in range(P):
            weight = beam.weights[k]
            angle, bent, _, _ = interpolated(beam.value, beam.coupling, u, group, k)
            cos, sin = cosine_sine(angle)
            along, across = resolved(u, group, k, cos, sin)
            natural = load(beam.natural, (group, k))
            curved = bent * (1.0 / weight) - natural
            share += weight * (curved * curved + beam.soft * along * along)
            pull += weight * load(u, (group, FORCE + 2 * k))
            moment += _moment_at(beam, k, bent, natural, along, across)
        real = load(beam.real, (group,))
        elastic += real * share
        force += real * pull
        if group == 0:
            first = moment
    return 0.5 * summed(elastic), lane(first, 0), -summed(force)
