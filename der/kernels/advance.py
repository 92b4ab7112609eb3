"""What follows an accepted step of the rod: frames, accelerations, energies; restarts at kinks."""

from __future__ import annotations

import math

from ribbonfem.ends.kernels import control_at
from ribbonfem.jit.decorator import compiled
from ribbonfem.linalg.array_ops import copy

from .arrays import (
    CONTROL,
    DISCRETE_GRADIENT,
    DISSIPATED,
    EFFORT,
    GENERALISED_ALPHA,
    IMPLICIT_EULER,
    MIDPOINT,
    NEWMARK,
    PHASE,
    POWER,
    PUSHED,
    RUNGE_KUTTA,
    TIME,
    VERLET,
    WORK,
)
from .band import FIRST
from .clamps import add_loads, drift, moves_right, push_at, reaction
from .frames import OPTIONS, edges
from .steps import configure, sum_up


@compiled(**OPTIONS)
def begin_phase(rod, ends, motion, s, course, options):
    """Make the accelerations those after a kink.

    They jump with the force at midspan and, of ribbons that damp, with the clamps' velocities.
    """
    nodes = motion.x.shape[0]
    clock = motion.clock
    control, rate, _ = control_at(ends, int(clock[PHASE]), clock[TIME])
    push = push_at(ends, control)
    damped = rod.retardation > 0.0
    clock[CONTROL] = control
    if damped or push != clock[PUSHED]:
        clock[PUSHED] = push
        drift(rod, ends, control, rate, motion.v)
        edges(motion.x, s.tangent, s.inverse)
        sum_up(rod, motion.m1, motion.twist, s, motion.v, 0.0, False, nodes)
        add_loads(rod, ends, push, s.gradient, nodes)
        for i in range(FIRST, 4 * nodes - 8):
            change = -course.damping * motion.v[i] - s.gradient[i] / rod.inertia[i] - motion.a[i]
            motion.a[i] += change
            if options.method == NEWMARK or options.method == GENERALISED_ALPHA:
                motion.aux[i] += change
        if damped:
            copy(s.strains, motion.strains)
            # moments of a clamp whose speed jumps: the end of the step says more of it than its beginning
            clock[POWER] = math.nan


@compiled(**OPTIONS)
def _viscous_loss(rod, before, after):
    """The energy that the change of the strains costs within a unit of time."""
    bend_1, bend_2, turn = (
        rod.stiffness[0] / rod.rest,
        rod.stiffness[1] / rod.rest,
        rod.stiffness[2] / rod.rest,
    )
    total = 0.0
    for i in range(1, before.shape[0] - 1):
        total += bend_1 * (after[i, 0] - before[i, 0]) ** 2 + bend_2 * (after[i, 1] - before[i, 1]) ** 2
        total += turn * (after[i, 2] - before[i, 2]) ** 2 + rod.stretch[i] * (after[i, 3] - before[i, 3]) ** 2
    return rod.retardation * total


@compiled(**OPTIONS)
def accept(rod, ends, motion, s, course, options, h, target):
    """Take over the step in s.dq, s.v: frames, accelerations, energies passed on."""
    nodes = motion.x.shape[0]
    first, last = FIRST, 4 * nodes - 8
    clock, nu, method = motion.clock, course.damping, options.method
    v0, a0, aux = motion.v, motion.a, motion.aux
    lost = 0.0
    for i in range(first, last):
        mean = s.dq[i] / h
        inner = 1.5 * mean - 0.25 * (v0[i] + s.v[i])
        lost += rod.inertia[i] * (v0[i] * v0[i] + 4.0 * inner * inner + s.v[i] * s.v[i])
    clock[DISSIPATED] += nu * h * lost / 6.0
    configure(motion, s, s.dq, 1.0)
    before = clock[CONTROL]
    after, rate, _ = control_at(ends, int(clock[PHASE]), target)
    push = push_at(ends, after)
    whole, damped = method == VERLET, rod.retardation > 0.0
    all_of = whole or damped or moves_right(ends)
    if damped:
        drift(rod, ends, after, rate, s.v)
    sum_up(rod, s.m1, s.twist, s, s.v, 0.0, False, nodes if all_of else 4)
    add_loads(rod, ends, push, s.gradient, nodes if all_of else 4)
    power = reaction(rod, ends, after, s.gradient)
    if math.isnan(clock[POWER]):
        clock[POWER] = power
    work = 0.5 * (clock[POWER] + power) * (after - before)
    if push != 0.0 or clock[PUSHED] != 0.0:
        for half in ((nodes - 1) // 2, nodes // 2):
            work -= 0.25 * (clock[PUSHED] + push) * s.dq[4 * half + 2]
    clock[WORK] += work
    clock[EFFORT] += abs(work)
    clock[POWER] = power
    clock[CONTROL], clock[PUSHED] = after, push
    if damped:
        clock[DISSIPATED] += _viscous_loss(rod, motion.strains, s.strains) / h
        copy(s.strains, motion.strains)
        for i in range(first):
            v0[i], v0[last + i] = s.v[i], s.v[last + i]
    am, af = 0.0, 0.0
    if method == GENERALISED_ALPHA:
        am = (2.0 * options.radius - 1.0) / (options.radius + 1.0)
        af = options.radius / (options.radius + 1.0)
    gamma = 0.5 - am + af
    for i in range(first, last):
        if whole:
            a1 = -nu * s.v[i] - s.gradient[i] / rod.inertia[i]
        elif method == RUNGE_KUTTA:
            a1 = s.stage_a[options.table.shape[0] - 1, i]
        elif method == IMPLICIT_EULER:
            a1 = (s.v[i] - v0[i]) / h
        elif method == MIDPOINT or method == DISCRETE_GRADIENT:
            a1 = 0.0
            aux[i] = s.dq[i] / h
        else:
            new = (s.v[i] - v0[i] - h * (1.0 - gamma) * aux[i]) / (gamma * h)
            a1 = ((1.0 - am) * new + am * aux[i] - af * a0[i]) / (1.0 - af)
            aux[i] = new
        a0[i] = a1
        v0[i] = s.v[i]
    copy(s.x, motion.x)
    copy(s.tangent, motion.tangent)
    copy(s.m1, motion.m1)
    copy(s.twist, motion.twist)
