"""Steps of a rod in motion: stages, Newton, errors, what is handed on."""

from __future__ import annotations

import math

from ribbonfem.jit.decorator import compiled
from ribbonfem.linalg.array_ops import copy

from .arrays import (
    ASSEMBLIES,
    DISCRETE_GRADIENT,
    DISSIPATED,
    EFFORT,
    FACTORED,
    GENERALISED_ALPHA,
    IMPLICIT_EULER,
    MIDPOINT,
    POWER,
    RUNGE_KUTTA,
    TIME,
    VERLET,
    WORK,
)
from .band import FIRST, WIDTH, factor, solve
from .energy import assemble
from .frames import INLINED, OPTIONS, carry, edges


@compiled(**INLINED)
def sum_up(rod, m1, twist, s, second, nodes):
    """`assemble` for the edges in s.tangent and s.inverse, into s.gradient, s.factors, s.energies."""
    assemble(
        s.tangent,
        s.inverse,
        m1,
        twist,
        rod.stiffness,
        rod.rest,
        rod.stretch,
        s.gradient,
        s.factors,
        s.energies,
        second,
        nodes,
    )


@compiled(**INLINED)
def _place(rod, angle, x0, dq):
    """Increments of the left clamp's two nodes to an angle."""
    for i in range(2):
        for c, direction in enumerate((math.cos(angle), 0.0, -math.sin(angle))):
            dq[4 * i + c] = rod.arclength[i] * direction - x0[i, c]


@compiled(**INLINED)
def _configure(motion, s, dq, share):
    """The configuration s.x, its edges and frames, at a share of the increments dq of a step."""
    nodes = motion.x.shape[0]
    for i in range(nodes):
        for c in range(3):
            s.x[i, c] = motion.x[i, c] + share * dq[4 * i + c]
        s.turn[i] = share * dq[4 * i + 3]
    edges(s.x, s.tangent, s.inverse)
    carry(motion.tangent, motion.m1, motion.twist, s.tangent, s.turn, s.m1, s.twist)


@compiled(**INLINED)
def _evaluate(rod, motion, s, dq, mean, second):
    """Forces in s.gradient, and with `second` their derivative in dq in s.factors.

    At the end of the increments dq or, if `mean`, their mean along the straight path to there:
    three Gauss points balance the energy of a step to the sixth power of the increments.
    """
    nodes = motion.x.shape[0]
    if mean:
        s.gradient1[:] = 0.0
        if second:
            s.hessian[:] = 0.0
    for k in range(3 if mean else 1):
        point = 0.5 + 0.3872983346207417 * (k - 1) if mean else 1.0
        _configure(motion, s, dq, point)
        sum_up(rod, s.m1, s.twist, s, second, nodes)
        if mean:
            weight = (4.0 if k == 1 else 2.5) / 9.0
            for i in range(4 * nodes):
                s.gradient1[i] += weight * s.gradient[i]
            if second:
                for i in range(4 * nodes):
                    for d in range(WIDTH + 1):
                        s.hessian[i, d] += weight * point * s.factors[i, d]
    if mean:
        copy(s.gradient1, s.gradient)
        if second:
            copy(s.hessian, s.factors)


@compiled(**OPTIONS)
def _newton(rod, motion, s, dq, c, b, policy):
    """Solve M (c dq - b) + F = 0 for the free increments, from the guess in dq; F as in `_evaluate`.

    Returns the iterations, negative if they did not converge.  A factorisation is kept from one
    iteration to the next, and from one step to the next while c stays, as long as the updates
    fall to a tenth each time: most of the cost is in making it.
    """
    nodes = motion.x.shape[0]
    first, last = FIRST, 4 * nodes - 8
    mean = policy.method == DISCRETE_GRADIENT
    before = 0.0
    fresh = motion.clock[FACTORED] != c
    made = 0
    for iteration in range(1, 31):
        _evaluate(rod, motion, s, dq, mean, fresh)
        if fresh:
            motion.clock[ASSEMBLIES] += 1
            motion.clock[FACTORED] = c
            made += 1
            for i in range(first, last):
                s.factors[i, 0] += c * rod.inertia[i]
            factor(s.factors, first, last)
        for i in range(first, last):
            s.right[i] = rod.inertia[i] * (b[i] - c * dq[i]) - s.gradient[i]
        solve(s.factors, first, last, s.right)
        size = 0.0
        for i in range(first, last):
            # an angle counts as a tenth of a length: the half width of the ribbon
            size = max(size, abs(s.right[i]) if i % 4 != 3 else 0.1 * abs(s.right[i]))
        if not fresh and (not size < 0.5 or (iteration > 1 and size > before)):
            # the old factors are no good here: take no step with them
            fresh = True
            continue
        # NaN fails this comparison too
        if not size < 0.5 or made > 15:
            motion.clock[FACTORED] = 0.0
            return -iteration
        for i in range(first, last):
            dq[i] += s.right[i]
        if size < policy.newton:
            return iteration
        fresh = iteration > 1 and size > 0.1 * before
        before = size
    motion.clock[FACTORED] = 0.0
    return -30


@compiled(**INLINED)
def largest_move(values, first, last):
    """Largest component of the positions among interleaved values."""
    size = 0.0
    for i in range(first, last):
        if i % 4 != 3:
            size = max(size, abs(values[i]))
    return size


@compiled(**INLINED)
def clamp_angle(ramp, time):
    """Clamp angle at a time; exactly `stop` from the kink on."""
    turned = abs(ramp.rate) * time
    return math.copysign(min(turned, abs(ramp.stop)), ramp.rate)


@compiled(**OPTIONS)
def attempt(rod, motion, s, ramp, policy, h):
    """One step of size h from `motion`: increments in s.dq, velocities in s.v.

    Returns (iterations, local error of the positions); negative iterations mean failure.
    """
    nodes = motion.x.shape[0]
    first, last = FIRST, 4 * nodes - 8
    nu, time = ramp.damping, motion.clock[TIME]
    v0, a0, aux = motion.v, motion.a, motion.aux
    method = policy.method
    error = 0.0
    if method == VERLET:
        # kicks with the damping taken implicitly at the end: second order, and stable in nu
        for i in range(first, last):
            s.v[i] = v0[i] + 0.5 * h * a0[i]
            s.dq[i] = h * s.v[i]
        _place(rod, clamp_angle(ramp, time + h), motion.x, s.dq)
        if not largest_move(s.dq, first, last) < 0.5:
            return -1, error
        _configure(motion, s, s.dq, 1.0)
        sum_up(rod, s.m1, s.twist, s, False, nodes)
        for i in range(first, last):
            s.v[i] = (s.v[i] - 0.5 * h * s.gradient[i] / rod.inertia[i]) / (1.0 + 0.5 * h * nu)
        return 1, error

    if method == RUNGE_KUTTA:
        table, stages = policy.table, policy.table.shape[0]
        for i in range(first, last):
            s.stage_v[0, i] = v0[i]
            s.stage_a[0, i] = a0[i]
        count = 0
        for k in range(1, stages):
            dh = table[k, k] * h
            c = 1.0 / (dh * dh) + nu / dh
            for i in range(first, last):
                # what the stage knows: velocity v + dh a, increment dq + dh^2 a
                known, moved = v0[i], 0.0
                for j in range(k):
                    known += h * table[k, j] * s.stage_a[j, i]
                    moved += h * table[k, j] * s.stage_v[j, i]
                moved += dh * known
                s.stage_v[k, i] = known
                s.stage_a[k, i] = moved
                s.b[i] = c * moved - nu * known
                s.dq[i] = moved + dh * dh * s.stage_a[k - 1, i]
            _place(rod, clamp_angle(ramp, time + policy.instants[k] * h), motion.x, s.dq)
            used = _newton(rod, motion, s, s.dq, c, s.b, policy)
            if used < 0:
                return used - count, error
            count += used
            for i in range(first, last):
                acceleration = (s.dq[i] - s.stage_a[k, i]) / (dh * dh)
                s.stage_a[k, i] = acceleration
                s.stage_v[k, i] += dh * acceleration
        for i in range(first, last):
            s.v[i] = s.stage_v[stages - 1, i]
            if i % 4 != 3:
                estimate = 0.0
                for k in range(stages):
                    estimate += policy.weights[k] * s.stage_v[k, i]
                error = max(error, h * abs(estimate))
        return count, error

    beta, gamma, am, af = 0.25, 0.5, 0.0, 0.0
    if method == GENERALISED_ALPHA:
        am = (2.0 * policy.radius - 1.0) / (policy.radius + 1.0)
        af = policy.radius / (policy.radius + 1.0)
        gamma = 0.5 - am + af
        beta = 0.25 * (1.0 - am + af) ** 2
    if method == IMPLICIT_EULER:
        c = 1.0 / (h * h) + nu / h
        for i in range(first, last):
            s.b[i] = v0[i] / h
            s.dq[i] = h * (v0[i] + h * a0[i])
    elif method == MIDPOINT or method == DISCRETE_GRADIENT:
        c = 2.0 / (h * h) + nu / h
        for i in range(first, last):
            s.b[i] = 2.0 * v0[i] / h
            # the mean velocity of the step before: end velocities ring along the ribbon
            s.dq[i] = h * aux[i]
        if method == MIDPOINT:
            # the unknown of the stage is the half increment
            c *= 2.0
            for i in range(first, last):
                s.dq[i] *= 0.5
    else:
        ratio = (1.0 - am) / (1.0 - af)
        c = ratio / (beta * h * h) + nu * gamma / (beta * h)
        for i in range(first, last):
            # a1 = dq / (beta h^2) - old, v1 = known + gamma h a1
            old = v0[i] / (beta * h) + (0.5 / beta - 1.0) * aux[i]
            known = v0[i] + h * (1.0 - gamma) * aux[i]
            s.b[i] = ratio * old - nu * (known - gamma * h * old) - (am * aux[i] - af * a0[i]) / (1.0 - af)
            s.dq[i] = h * (v0[i] + 0.5 * h * a0[i])
    inner = 0.5 * h if method == MIDPOINT else h
    _place(rod, clamp_angle(ramp, time + inner), motion.x, s.dq)
    count = _newton(rod, motion, s, s.dq, c, s.b, policy)
    if count < 0:
        return count, error
    if method == MIDPOINT:
        for i in range(first, last):
            s.dq[i] *= 2.0
        _place(rod, clamp_angle(ramp, time + h), motion.x, s.dq)
    # constants of the local error h^3 q''' (implicit Euler: h^2 q'') of each method
    if method == IMPLICIT_EULER:
        for i in range(first, last):
            s.v[i] = s.dq[i] / h
            if i % 4 != 3:
                error = max(error, 0.5 * h * abs(s.v[i] - v0[i]))
    elif method == MIDPOINT or method == DISCRETE_GRADIENT:
        for i in range(first, last):
            s.v[i] = 2.0 * s.dq[i] / h - v0[i]
    else:
        constant = abs(beta - 1.0 / 6.0 + 0.5 * (am - af))
        for i in range(first, last):
            a1 = (s.dq[i] / h - v0[i]) / (beta * h) - (0.5 / beta - 1.0) * aux[i]
            s.v[i] = v0[i] + h * ((1.0 - gamma) * aux[i] + gamma * a1)
            if i % 4 != 3:
                error = max(error, constant * h * h * abs(a1 - aux[i]))
    return count, error


@compiled(**INLINED)
def clamp_moment(rod, gradient, angle):
    """Moment (of the clamp on the ribbon, along growing angle) from the reaction of the left nodes."""
    total = 0.0
    for i in range(2):
        total += rod.arclength[i] * (
            -math.sin(angle) * gradient[4 * i] - math.cos(angle) * gradient[4 * i + 2]
        )
    return total


@compiled(**OPTIONS)
def accept(rod, motion, s, ramp, policy, h):
    """Take over the step in s.dq, s.v: frames, accelerations, energies passed on."""
    nodes = motion.x.shape[0]
    first, last = FIRST, 4 * nodes - 8
    clock, nu, method = motion.clock, ramp.damping, policy.method
    v0, a0, aux = motion.v, motion.a, motion.aux
    lost = 0.0
    for i in range(first, last):
        mean = s.dq[i] / h
        inner = 1.5 * mean - 0.25 * (v0[i] + s.v[i])
        lost += rod.inertia[i] * (v0[i] * v0[i] + 4.0 * inner * inner + s.v[i] * s.v[i])
    clock[DISSIPATED] += nu * h * lost / 6.0
    _configure(motion, s, s.dq, 1.0)
    before, after = clamp_angle(ramp, clock[TIME]), clamp_angle(ramp, clock[TIME] + h)
    whole = method == VERLET
    sum_up(rod, s.m1, s.twist, s, False, nodes if whole else 4)
    power = clamp_moment(rod, s.gradient, after)
    work = 0.5 * (clock[POWER] + power) * (after - before)
    clock[WORK] += work
    clock[EFFORT] += abs(work)
    clock[POWER] = power
    am, af = 0.0, 0.0
    if method == GENERALISED_ALPHA:
        am = (2.0 * policy.radius - 1.0) / (policy.radius + 1.0)
        af = policy.radius / (policy.radius + 1.0)
    gamma = 0.5 - am + af
    for i in range(first, last):
        if whole:
            a1 = -nu * s.v[i] - s.gradient[i] / rod.inertia[i]
        elif method == RUNGE_KUTTA:
            a1 = s.stage_a[policy.table.shape[0] - 1, i]
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
