"""Boundary conditions and loads of the rod: how controls move the end nodes, and the reactions there."""

from __future__ import annotations

import math

from ribbonfem.ends.kernels import (
    COMPRESSION,
    FORCE,
    LEFT,
    LIFT,
    RIGHT,
    SHEAR,
    TWIST_LEFT,
    TWIST_RIGHT,
    control_at,
)
from ribbonfem.jit.algebra import cross, mix, triple
from ribbonfem.jit.decorator import compiled

from .arrays import CONTROL, PUSH, TIME
from .frames import OPTIONS


@compiled(**OPTIONS)
def push_at(ends, control):
    """The force at midspan at a control."""
    return ends.fixed[FORCE] + ends.moved[FORCE] * control


@compiled(**OPTIONS)
def moves_right(ends):
    """Whether the right clamp moves."""
    m = ends.moved
    return (
        m[RIGHT] != 0.0 or m[TWIST_RIGHT] != 0.0 or m[COMPRESSION] != 0.0 or m[SHEAR] != 0.0 or m[LIFT] != 0.0
    )


@compiled(**OPTIONS)
def place(rod, ends, control, motion, dq):
    """Increments of the clamps' nodes and angles to a control, and the force there."""
    f, m, x0 = ends.fixed, ends.moved, motion.x
    if m[LEFT] != 0.0:
        angle = f[LEFT] + m[LEFT] * control
        for i in range(2):
            for c, direction in enumerate((math.cos(angle), 0.0, -math.sin(angle))):
                dq[4 * i + c] = rod.arclength[i] * direction - x0[i, c]
    moved = control - motion.clock[CONTROL]
    dq[3] = m[TWIST_LEFT] * moved
    if moves_right(ends):
        nodes = x0.shape[0]
        angle = f[RIGHT] + m[RIGHT] * control
        for i in range(nodes - 2, nodes):
            for c, direction in enumerate((math.cos(angle), 0.0, math.sin(angle))):
                k = COMPRESSION + c
                shift = f[k] + m[k] * control
                there = ends.chord[c] + (shift if c == 2 else -shift)
                dq[4 * i + c] = there + (rod.arclength[i] - 1.0) * direction - x0[i, c]
        dq[4 * nodes - 5] = m[TWIST_RIGHT] * moved
    motion.clock[PUSH] = push_at(ends, control)


@compiled(**OPTIONS)
def drift(rod, ends, control, rate, v):
    """Velocities of the clamps' nodes and angles where the control moves at a rate."""
    f, m = ends.fixed, ends.moved
    nodes = rod.arclength.shape[0]
    left, right = f[LEFT] + m[LEFT] * control, f[RIGHT] + m[RIGHT] * control
    for i in range(2):
        turn = rate * m[LEFT] * rod.arclength[i]
        v[4 * i], v[4 * i + 1], v[4 * i + 2] = -math.sin(left) * turn, 0.0, -math.cos(left) * turn
        j = nodes - 2 + i
        turn = rate * m[RIGHT] * (rod.arclength[j] - 1.0)
        v[4 * j] = -math.sin(right) * turn - rate * m[COMPRESSION]
        v[4 * j + 1] = -rate * m[SHEAR]
        v[4 * j + 2] = math.cos(right) * turn + rate * m[LIFT]
    v[3], v[4 * nodes - 5] = rate * m[TWIST_LEFT], rate * m[TWIST_RIGHT]


@compiled(**OPTIONS)
def reaction(rod, ends, control, gradient):
    """What the clamps' reactions do while the control moves by 1: the derivative of the energy in it."""
    f, m = ends.fixed, ends.moved
    nodes = rod.arclength.shape[0]
    total = 0.0
    if m[LEFT] != 0.0:
        angle, moment = f[LEFT] + m[LEFT] * control, 0.0
        for i in range(2):
            moment += rod.arclength[i] * (
                -math.sin(angle) * gradient[4 * i] - math.cos(angle) * gradient[4 * i + 2]
            )
        total += m[LEFT] * moment
    if m[TWIST_LEFT] != 0.0:
        total += m[TWIST_LEFT] * gradient[3]
    if moves_right(ends):
        angle = f[RIGHT] + m[RIGHT] * control
        for i in range(nodes - 2, nodes):
            g = 4 * i
            turn = (rod.arclength[i] - 1.0) * m[RIGHT]
            total += turn * (math.cos(angle) * gradient[g + 2] - math.sin(angle) * gradient[g])
            total += m[LIFT] * gradient[g + 2] - m[COMPRESSION] * gradient[g] - m[SHEAR] * gradient[g + 1]
        total += m[TWIST_RIGHT] * gradient[4 * nodes - 5]
    return total


@compiled(**OPTIONS)
def _change(rod, ends, i, control, rate, change, nu):
    """Acceleration of a clamped node, with nu times its velocity."""
    m = ends.moved
    left = i < 2
    which, slid = (LEFT, 0.0) if left else (RIGHT, 1.0)
    angle, arm = ends.fixed[which] + m[which] * control, rod.arclength[i] - slid
    # (the right clamp turns the other way)
    up = -1.0 if left else 1.0
    turn, speed = arm * m[which] * (change + nu * rate), arm * (m[which] * rate) ** 2
    shift = slid * (change + nu * rate)
    return (
        -math.sin(angle) * turn - math.cos(angle) * speed - shift * m[COMPRESSION],
        -shift * m[SHEAR],
        up * (math.cos(angle) * turn - math.sin(angle) * speed) + shift * m[LIFT],
    )


@compiled(**OPTIONS)
def put_reactions(rod, ends, motion, phase, nu, gradient, row):
    """Put force and moment of both clamps into a row, with weight and inertia of the nodes that they hold.

    The gradient is of the elastic energy; of the first row, of no `phase`, nothing is known to move.
    """
    nodes, w = motion.x.shape[0], ends.weight
    control, rate, change = 0.0, 0.0, 0.0
    if phase >= 0:
        control, rate, change = control_at(ends, phase, motion.clock[TIME])
    for clamp in range(2):
        edge, place = clamp * (nodes - 2), 6 * clamp
        for c in range(6):
            row[place + c] = 0.0
        for i in range(edge, edge + 2):
            a, k = _change(rod, ends, i, control, rate, change, nu), 4 * i
            inner = gradient[k], gradient[k + 1], gradient[k + 2]
            pull = mix(inner, 1.0, (a[0] - w[0], a[1] - w[1], a[2] - w[2]), rod.lumps[i])
            # (the node is this far from the clamp's own point, along its edge)
            arm, moment = rod.arclength[i] - clamp, cross(triple(motion.tangent, edge), pull)
            for c in range(3):
                row[place + c] += pull[c]
                row[place + 3 + c] += arm * moment[c]
        # of the held edge what lies between the clamps
        twist = ends.moved[TWIST_RIGHT if clamp else TWIST_LEFT]
        inertia = rod.inertia[3] * (0.5 + rod.lumps[0] / rod.rest)
        along = gradient[4 * edge + 3] + inertia * twist * (change + nu * rate)
        for c in range(3):
            row[place + 3 + c] += along * motion.tangent[edge, c]


@compiled(**OPTIONS)
def add_loads(rod, ends, push, gradient, nodes):
    """What weight and the force at midspan, down along z, add to the gradient of the first nodes."""
    w = ends.weight
    if w[0] != 0.0 or w[1] != 0.0 or w[2] != 0.0:
        for i in range(nodes):
            for c in range(3):
                gradient[4 * i + c] -= rod.lumps[i] * w[c]
    if push != 0.0:
        count = rod.arclength.shape[0]
        for half in ((count - 1) // 2, count // 2):
            if half < nodes:
                gradient[4 * half + 2] += 0.5 * push
