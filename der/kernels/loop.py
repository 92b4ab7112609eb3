"""The compiled time loop of the rods: control of steps, rejection, output rows."""

from __future__ import annotations

import math

from ribbonfem.ends.kernels import LIFT, control_at
from ribbonfem.jit.algebra import dot, mix, put_triple, triple
from ribbonfem.jit.decorator import compiled
from ribbonfem.linalg.array_ops import copy

from .advance import accept, begin_phase
from .arrays import (
    AFTER,
    BLOWN,
    CARRY,
    CONTROL,
    CREEP,
    DEPARTED,
    DISSIPATED,
    DONE,
    EFFORT,
    FRESH,
    FULL,
    GROWTH,
    ITERATIONS,
    PHASE,
    PLACE,
    PUSHED,
    REJECTED,
    ROW,
    ROW_CONTROL,
    ROW_DISSIPATED,
    ROW_ELASTIC,
    ROW_HEIGHT,
    ROW_KEPT,
    ROW_KINETIC,
    ROW_LOAD,
    ROW_POTENTIAL,
    ROW_REACTIONS,
    ROW_SLOPE,
    ROW_TIME,
    ROW_VELOCITY,
    ROW_WORK,
    SCALE,
    SIDE,
    SINCE,
    START,
    STEP,
    STEPS,
    STUCK,
    TIME,
    WORK,
)
from .band import FIRST
from .clamps import drift, put_reactions
from .frames import OPTIONS, edges
from .steps import attempt, largest_move, sum_up


@compiled(**OPTIONS)
def record(rod, ends, motion, s, course, phase, rows, row_x, row_m1, row_v, kept):
    """Write the next row; configurations only if it is kept and there is room for them.

    One that is not kept has what events are found in, and no elastic energy, load or reactions, which cost
    most.  `phase` is that of the step to it, -1 of the first row.  True if the energy has blown up.
    """
    nodes = motion.x.shape[0]
    clock, row = motion.clock, int(motion.clock[ROW])
    clock[ROW] += 1.0
    kinetic = 0.0
    for i in range(FIRST, 4 * nodes - 8):
        kinetic += 0.5 * rod.inertia[i] * motion.v[i] * motion.v[i]
    half = (nodes - 1) // 2
    x, v = motion.x, motion.v
    height, velocity, slope = x[half, 2], v[4 * half + 2], motion.tangent[half, 2]
    if nodes % 2:
        both = mix(triple(motion.tangent, half - 1), 1.0, triple(motion.tangent, half), 1.0)
        slope = both[2] / math.sqrt(dot(both, both))
    else:
        height = 0.5625 * (x[half, 2] + x[half + 1, 2]) - 0.0625 * (x[half - 1, 2] + x[half + 2, 2])
        velocity = 0.5625 * (v[4 * half + 2] + v[4 * half + 6])
        velocity -= 0.0625 * (v[4 * half - 2] + v[4 * half + 10])
    rows[row, ROW_TIME] = clock[TIME]
    rows[row, ROW_CONTROL] = clock[CONTROL]
    rows[row, ROW_HEIGHT] = height
    rows[row, ROW_SLOPE] = slope
    rows[row, ROW_VELOCITY] = velocity
    rows[row, ROW_KINETIC] = kinetic
    rows[row, ROW_KEPT] = 1.0 if kept else 0.0
    if not kept and course.barrier == -math.inf:
        return False
    edges(motion.x, s.tangent, s.inverse)
    sum_up(rod, motion.m1, motion.twist, s, v, 0.0, False, nodes)
    rows[row, ROW_ELASTIC] = s.energies[0] + s.energies[1] + s.energies[2]
    w, potential = ends.weight, 0.0
    if w[0] != 0.0 or w[1] != 0.0 or w[2] != 0.0:
        for i in range(nodes):
            potential -= rod.lumps[i] * dot(triple(x, i), (w[0], w[1], w[2]))
    rows[row, ROW_POTENTIAL] = potential
    rows[row, ROW_DISSIPATED] = clock[DISSIPATED]
    rows[row, ROW_WORK] = clock[WORK]
    # the compressive force along x, averaged over the free edges
    force, load = 0.0, 0.0
    for i in range(nodes - 1, 1, -1):
        force += s.gradient[4 * i]
        if i < nodes - 1:
            load -= force
    rows[row, ROW_LOAD] = load / (nodes - 3)
    if kept:
        put_reactions(rod, ends, motion, phase, course.damping, s.gradient, rows[row, ROW_REACTIONS:])
    place = int(clock[PLACE])
    if kept and place < row_x.shape[0]:
        copy(motion.x, row_x[place])
        copy(motion.m1, row_m1[place])
        # (of the clamps the motion knows no velocities; the first row is of the instant before they move)
        rate = 0.0
        if phase >= 0:
            _, rate, _ = control_at(ends, phase, clock[TIME])
        drift(rod, ends, clock[CONTROL], rate, s.rate)
        for i in range(nodes):
            of = v if 1 < i < nodes - 2 else s.rate
            put_triple((of[4 * i], of[4 * i + 1], of[4 * i + 2]), row_v[place], i)
        clock[PLACE] += 1.0
    held = kinetic + rows[row, ROW_ELASTIC] + potential - clock[WORK]
    if clock[STEPS] == 0.0:
        clock[START], clock[SCALE] = held, kinetic + rows[row, ROW_ELASTIC] + abs(potential)
    # Energy from nowhere: what follows would be no motion of this ribbon.  What the damping took is
    # left out of the balance: long steps do not resolve it, and it can only make room.
    return not held - clock[START] <= GROWTH * (clock[SCALE] + clock[EFFORT])


@compiled(**OPTIONS)
def _energy(motion, rows, row):
    """All that a ribbon has while the control stands still."""
    energy = rows[row, ROW_KINETIC] + rows[row, ROW_ELASTIC] + rows[row, ROW_POTENTIAL]
    push, nodes = motion.clock[PUSHED], motion.x.shape[0]
    return energy + 0.5 * push * (motion.x[(nodes - 1) // 2, 2] + motion.x[nodes // 2, 2])


@compiled(**OPTIONS)
def run(rod, ends, motion, s, course, options, every, rows, row_x, row_m1, row_v):
    """Step until the end of the control's motion, until decided or snapped (DONE), until the rows are full
    (FULL), no step converges (STUCK), or the energy grows from nowhere (BLOWN).

    All the state is in `motion`, so that a call after FULL, with fresh rows, goes on.  Every accepted
    step makes a row; each `every`-th one and the last are kept, with their configurations.
    """
    nodes = motion.x.shape[0]
    clock = motion.clock
    last = ends.kinks.shape[0] - 1
    order = 1.0 / options.power
    while True:
        if clock[ROW] >= rows.shape[0]:
            return FULL
        if clock[FRESH] != 0.0:
            clock[FRESH] = 0.0
            begin_phase(rod, ends, motion, s, course, options)
        time, phase = clock[TIME], int(clock[PHASE])
        target = ends.kinks[phase + 1]
        # transport of frames needs neighbours
        h = min(clock[STEP], options.largest, ends.longest[phase])
        # no sliver of a step is left: it would tell nothing, and spoil what is interpolated over it
        landing = target - time <= h * (1.0 + (1e-6 if options.step > 0.0 else 1e-3))
        if landing:
            h = target - time
        reached = target if landing else time + h
        count, error = attempt(rod, ends, motion, s, course, options, h, reached)
        clock[ITERATIONS] += abs(count)
        failed = count < 0
        if options.step > 0.0:
            error = 0.0
        else:
            # Errors made while the ribbon creeps towards a fold add up and shift the snap; those
            # made while it rings do not.  The error allowed shrinks with the speed.
            speed = largest_move(s.v, FIRST, 4 * nodes - 8)
            error /= min(1.0, max(0.01, CREEP * speed))
            if not failed and not error <= options.tolerance:
                failed = True
        if failed:
            clock[REJECTED] += 1.0
            if count < 0:
                h *= 0.5
            else:
                h *= max(0.2, 0.9 * (options.tolerance / error) ** order)
            clock[STEP] = h
            if h < options.smallest:
                return STUCK
            continue
        accept(rod, ends, motion, s, course, options, h, reached)
        # what rounding leaves of the sum of many equal steps is carried on: they are to land on the target
        lost = h + clock[CARRY]
        clock[TIME] = target if landing else time + lost
        clock[CARRY] = 0.0 if landing else lost - (clock[TIME] - time)
        if not landing:
            clock[CONTROL], _, _ = control_at(ends, phase, clock[TIME])
        clock[STEPS] += 1.0
        clock[SINCE] += 1.0
        if options.step > 0.0:
            # after a halving the step grows back to the one asked for; a landing does not count
            clock[STEP] = min(options.step, 2.0 * clock[STEP])
        else:
            growth = 2.5 if error == 0.0 else min(2.5, max(0.2, 0.9 * (options.tolerance / error) ** order))
            # a short step onto a kink says nothing of the steps that follow
            clock[STEP] = max(h * growth, clock[STEP] if landing and growth > 1.0 else 0.0)
        done = landing and phase + 1 == last
        if landing and not done:
            clock[PHASE] += 1.0
            clock[FRESH] = 1.0
        kept = done or clock[SINCE] >= every or clock[AFTER] > 0.0
        if kept:
            clock[SINCE] = 0.0
        if record(rod, ends, motion, s, course, phase, rows, row_x, row_m1, row_v, kept):
            return BLOWN
        row = int(clock[ROW]) - 1
        if clock[TIME] >= course.settled and _energy(motion, rows, row) < course.barrier:
            if kept:
                return DONE
            # the last row is a whole one
            clock[ROW] -= 1.0
            record(rod, ends, motion, s, course, phase, rows, row_x, row_m1, row_v, True)
            return DONE
        if clock[TIME] >= course.since:
            height = rows[row, ROW_HEIGHT] - 0.5 * (ends.fixed[LIFT] + ends.moved[LIFT] * clock[CONTROL])
            if clock[SIDE] == 0.0 and abs(height) > DEPARTED:
                clock[SIDE] = height
            # two rows on either side of the crossing, for a cubic where velocities are not known
            crossed = clock[SIDE] != 0.0 and height * clock[SIDE] <= 0.0
            if clock[AFTER] > 0.0 or crossed:
                clock[AFTER] += 1.0
                if clock[AFTER] >= 2.0:
                    return DONE
        if done:
            return DONE
        if not math.isfinite(motion.v[FIRST]):
            return STUCK
