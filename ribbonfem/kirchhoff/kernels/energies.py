"""Energies, reactions at the clamps and power of the controls, of a state of the Kirchhoff rod in motion."""

from __future__ import annotations

from ribbonfem.ends.kernels import CHANGE, PUSH, SPEED, SPIN, SPIN_RATE
from ribbonfem.jit.algebra import Vector, carried, dot, mix4, quaternion
from ribbonfem.jit.decorator import compiled
from ribbonfem.jit.simd import WIDTH, lane, load, spread
from ribbonfem.results import Array
from ribbonfem.stepping.kernels.arrays import REACTIONS

from .batch import INLINED, OPTIONS, force_at, gather
from .gauss_point import body_moment, interpolated, interpolated_group, point_gradient, strains_of, tangent_of
from .rod import P, Rod, Solver


@compiled(**INLINED)
def elastic_energy(rod: Rod, s: Solver, g: Array, n: Array) -> float:
    """Of bending, twist and stretch."""
    elements, total = rod.weights.shape[0], 0.0
    for group in range(rod.groups.weights.shape[0]):
        gather(g, group, elements - 1, P, s.frames)
        share = spread(0.0)
        for k in range(P):
            q, p = interpolated_group(rod.value, rod.groups.slope, group, k, s.frames, P)
            inverse, tangent = tangent_of(q)
            k1, k2, k3 = strains_of(inverse, q, p)
            tension = dot(force_at(n, group, k), tangent)
            stretching = rod.compliance[0] * tension * tension
            if rod.has_offset:
                x, y, z = force_at(rod.natural, group, k)
                k1, k2, k3 = k1 - x, k2 - y, k3 - z
                if rod.elastic[3] > 0.0:
                    strain = load(rod.offset, (group, k, 3)) + rod.compliance[0] * tension
                    stretching = strain * strain / rod.elastic[3]
            twice = rod.elastic[0] * k1 * k1 + rod.elastic[1] * k2 * k2 + rod.elastic[2] * k3 * k3
            share += load(rod.groups.weights, (group, k)) * (twice + stretching)
        for place in range(min(WIDTH, elements - WIDTH * group)):
            total += 0.5 * lane(share, place)
    return total


@compiled(**OPTIONS)
def potential_energy(rod: Rod, x: Array) -> float:
    """Of the weight."""
    total = 0.0
    if rod.has_weight:
        for i in range(x.shape[0]):
            for c in range(3):
                total -= rod.inertia[i, c] * rod.weight[c] * x[i, c]
    return total


@compiled(**OPTIONS)
def clamp_moment(rod: Rod, g: Array, n: Array, e: int, i: int) -> Vector:
    """Moment (EI2/L) of a clamp on the ribbon, in its body's axes: node i of element e."""
    f = (0.0, 0.0, 0.0, 0.0)
    group, place = e // WIDTH, e % WIDTH
    for k in range(P):
        q, p = interpolated(rod.value, rod.slope, e, k, g, P)
        force = n[group, k, 0, place], n[group, k, 1, place], n[group, k, 2, place]
        offset = (0.0, 0.0, 0.0), 0.0
        if rod.has_offset:
            o = rod.offset
            offset = (
                (o[group, k, 0, place], o[group, k, 1, place], o[group, k, 2, place]),
                o[group, k, 3, place],
            )
        gq, gp, _, _ = point_gradient(rod.stiffness, rod.compliance[0], offset, q, p, force)
        value, slope = rod.weights[e, k] * rod.value[k, i], rod.weights[e, k] * rod.slope[e, k, i]
        f = mix4(f, 1.0, mix4(gq, value, gp, slope), 1.0)
    return body_moment(quaternion(g, e * P + i), f)


@compiled(**OPTIONS)
def clamp_force(rod: Rod, n: Array, e: int, i: int) -> Vector:
    """Force (EI2/L^2) of a clamp on the ribbon, without the inertia of what it holds: node i of element e."""
    x = y = z = 0.0
    group, place = e // WIDTH, e % WIDTH
    for k in range(P):
        coupling = rod.coupling[e, k, i]
        x += coupling * n[group, k, 0, place]
        y += coupling * n[group, k, 1, place]
        z += coupling * n[group, k, 2, place]
    node = e * P + i
    return (
        x - rod.inertia[node, 0] * rod.weight[0],
        y - rod.inertia[node, 1] * rod.weight[1],
        z - rod.inertia[node, 2] * rod.weight[2],
    )


@compiled(**OPTIONS)
def put_reactions(rod: Rod, g: Array, n: Array, pose: Array, nu: float, row: Array) -> None:
    """Put force and moment of both clamps into a row, in the fixed frame, with the inertia of their nodes."""
    last = rod.weights.shape[0] - 1
    for clamp in range(2):
        e, i, spin = clamp * last, clamp * P, SPIN + 3 * clamp
        node, at = e * P + i, REACTIONS + 6 * clamp
        x, y, z = clamp_force(rod, n, e, i)
        row[at], row[at + 1], row[at + 2] = x, y, z
        if clamp == 1:
            for c in range(3):
                row[at + c] += rod.inertia[node, c] * (pose[CHANGE + c] + nu * pose[SPEED + c])
        a, b, c = clamp_moment(rod, g, n, e, i)
        momentum = rod.inertia[node, 3] * pose[spin]
        a += rod.inertia[node, 3] * pose[SPIN_RATE + 3 * clamp] + nu * momentum
        if rod.gyroscopic:
            b, c = b + momentum * pose[spin + 2], c - momentum * pose[spin + 1]
        moment = carried(quaternion(g, node), (a, b, c))
        row[at + 3], row[at + 4], row[at + 5] = moment


@compiled(**OPTIONS)
def _moves(pose: Array, first: int) -> bool:
    return pose[first] != 0.0 or pose[first + 1] != 0.0 or pose[first + 2] != 0.0


@compiled(**OPTIONS)
def power(rod: Rod, g: Array, n: Array, v: Array, pose: Array) -> float:
    """Power (EI2/L a t*) of all controls, by what moves of them."""
    total = -pose[PUSH] * v[rod.middle, 2]
    if _moves(pose, SPIN):
        moment = clamp_moment(rod, g, n, 0, 0)
        total += dot(moment, (pose[SPIN], pose[SPIN + 1], pose[SPIN + 2]))
    if _moves(pose, SPIN + 3):
        moment = clamp_moment(rod, g, n, rod.weights.shape[0] - 1, P)
        total += dot(moment, (pose[SPIN + 3], pose[SPIN + 4], pose[SPIN + 5]))
    if _moves(pose, SPEED):
        force = clamp_force(rod, n, rod.weights.shape[0] - 1, P)
        total += dot(force, (pose[SPEED], pose[SPEED + 1], pose[SPEED + 2]))
    return total
