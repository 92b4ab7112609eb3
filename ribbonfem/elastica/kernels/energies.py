"""Energies, reactions at the clamps, mean axial force and power of controls, of a state of the elastica."""

from __future__ import annotations

from ribbonfem.ends.planar_kernels import COMPRESSION, LEFT, LIFT, PUSH, RIGHT
from ribbonfem.jit.decorator import compiled
from ribbonfem.jit.groups import INLINED, OPTIONS
from ribbonfem.jit.simd import WIDTH, lane, load, spread, summed
from ribbonfem.results import Array
from ribbonfem.stepping.kernels.arrays import REACTIONS

from .beam import FORCE, Beam, P, Z
from .gauss_point import Value, cosine_sine, interpolated, resolved
from .law import moment_of, stretch_of


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


@compiled(**OPTIONS)
def potential_energy(beam: Beam, u: Array) -> float:
    """Of the weight."""
    wx, wz = beam.weight[0], beam.weight[1]
    if wx == 0.0 and wz == 0.0:
        return 0.0
    total = spread(0.0)
    for group in range(u.shape[0]):
        share = spread(0.0)
        for i in range(P + 1):
            share += beam.mass[i] * (wx * load(u, (group, i)) + wz * load(u, (group, Z + i)))
        total += load(beam.real, (group,)) * share
    return -summed(total)


@compiled(**INLINED)
def _moment_at(beam: Beam, group: int, k: int, i: int, bent: Value, tension: Value, shear: Value) -> Value:
    """What a Gauss point has of the moment on node i of its element."""
    moment = beam.coupling[k, i] * moment_of(beam, group, k, bent * (1.0 / beam.weights[k]))
    return moment - (beam.value[k, i] * beam.weights[k]) * stretch_of(beam, group, k, tension) * shear


@compiled(**OPTIONS)
def clamp_moment(beam: Beam, u: Array, group: int, place: int, i: int) -> float:
    """The moment (EI2/L) on the beam at node i of an element, along phi."""
    moment = spread(0.0)
    for k in range(P):
        angle, bent, _, _ = interpolated(beam.value, beam.coupling, u, group, k)
        cos, sin = cosine_sine(angle)
        tension, shear = resolved(u, group, k, cos, sin)
        moment += _moment_at(beam, group, k, i, bent, tension, shear)
    # (a lane is a constant)
    if place == 0:
        return lane(moment, 0)
    if place == 1:
        return lane(moment, 1)
    return lane(moment, 2) if place == 2 else lane(moment, 3)


@compiled(**OPTIONS)
def clamp_force(
    beam: Beam, u: Array, group: int, place: int, i: int, controls: Array, nu: float
) -> tuple[float, float]:
    """The force (EI2/L^2) along x and z of a clamp, with inertia and weight of what it holds: node i."""
    mass = beam.mass[i]
    x, z = -mass * beam.weight[0], -mass * beam.weight[1]
    if i == P:
        x -= mass * (controls[COMPRESSION, 2] + nu * controls[COMPRESSION, 1])
        z += mass * (controls[LIFT, 2] + nu * controls[LIFT, 1])
    for k in range(P):
        x += beam.coupling[k, i] * u[group, FORCE + 2 * k, place]
        z += beam.coupling[k, i] * u[group, FORCE + 2 * k + 1, place]
    return x, z


@compiled(**OPTIONS)
def put_reactions(beam: Beam, u: Array, controls: Array, nu: float, row: Array) -> None:
    """Put force and moment of both clamps into a row (`History.reactions`)."""
    for clamp in range(2):
        element, i, at = clamp * (beam.elements - 1), clamp * P, REACTIONS + 6 * clamp
        group, place = element // WIDTH, element % WIDTH
        for c in range(6):
            row[at + c] = 0.0
        row[at], row[at + 2] = clamp_force(beam, u, group, place, i, controls, nu)
        # (phi turns about -y)
        row[at + 4] = -clamp_moment(beam, u, group, place, i)


@compiled(**OPTIONS)
def power(beam: Beam, u: Array, v: Array, controls: Array, nu: float) -> float:
    """Power of the controls: moments of both clamps, the force of the right one, the push at midspan."""
    total = 0.0
    # (phi of the left clamp is minus its angle)
    if controls[LEFT, 1] != 0.0:
        total -= controls[LEFT, 1] * clamp_moment(beam, u, 0, 0, 0)
    last = beam.elements - 1
    group, place = last // WIDTH, last % WIDTH
    if controls[RIGHT, 1] != 0.0:
        total += controls[RIGHT, 1] * clamp_moment(beam, u, group, place, P)
    if controls[COMPRESSION, 1] != 0.0 or controls[LIFT, 1] != 0.0:
        x, z = clamp_force(beam, u, group, place, P, controls, nu)
        total += controls[LIFT, 1] * z - controls[COMPRESSION, 1] * x
    if controls[PUSH, 0] != 0.0:
        speed = spread(0.0)
        for g in range(v.shape[0]):
            for i in range(P + 1):
                speed += load(beam.middle, (g, i)) * load(v, (g, Z + i))
        total -= controls[PUSH, 0] * summed(speed)
    return total


@compiled(**OPTIONS)
def elastic_state(beam: Beam, u: Array) -> tuple[float, float]:
    """Elastic energy and mean compressive force of a state."""
    elastic = force = spread(0.0)
    axial_stiffness = 1.0 / beam.elastic[1] if beam.elastic[1] > 0.0 else 0.0
    for group in range(u.shape[0]):
        share = axial = spread(0.0)
        for k in range(P):
            weight = beam.weights[k]
            angle, bent, _, _ = interpolated(beam.value, beam.coupling, u, group, k)
            cos, sin = cosine_sine(angle)
            tension, _ = resolved(u, group, k, cos, sin)
            curved = bent * (1.0 / weight) - load(beam.natural, (group, k, 0))
            longer = stretch_of(beam, group, k, tension) - 1.0
            share += weight * (curved * curved + axial_stiffness * longer * longer)
            axial += weight * load(u, (group, FORCE + 2 * k))
        real = load(beam.real, (group,))
        elastic += real * share
        force += real * axial
    return 0.5 * summed(elastic), -summed(force)
