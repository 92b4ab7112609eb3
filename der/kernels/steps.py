"""One time step of a rod by each method: stages, Newton's method, error estimates."""

from __future__ import annotations

from ribbonfem.ends.kernels import control_at
from ribbonfem.jit.decorator import compiled
from ribbonfem.linalg.array_ops import copy

from .arrays import (
    ASSEMBLIES,
    DISCRETE_GRADIENT,
    FACTORED,
    GENERALISED_ALPHA,
    IMPLICIT_EULER,
    MIDPOINT,
    PHASE,
    PUSH,
    PUSHED,
    RUNGE_KUTTA,
    TIME,
    VERLET,
)
from .band import FIRST, WIDTH, factor, solve
from .clamps import add_loads, drift, place
from .energy import assemble, resist
from .frames import INLINED, OPTIONS, carry, edges


@compiled(**OPTIONS)
def sum_up(rod, m1, twist, s, velocity, pace, second, nodes):
    """`assemble` for the edges in s.tangent and s.inverse, into s.gradient, s.factors, s.energies."""
    if rod.retardation > 0.0:
        resist(rod, s.tangent, s.inverse, m1, twist, velocity, s.strains, s.viscous)
    material = rod.stiffness, rod.rest, rod.stretch, rod.shape
    rise, sums = 1.0 + rod.retardation * pace, (s.gradient, s.factors, s.energies)
    assemble(material, s.tangent, s.inverse, m1, twist, s.viscous, rise, *sums, second, nodes)


@compiled(**OPTIONS)
def configure(motion, s, dq, share):
    """The configuration s.x, its edges and frames, at a share of the increments dq of a step."""
    nodes = motion.x.shape[0]
    for i in range(nodes):
        for c in range(3):
            s.x[i, c] = motion.x[i, c] + share * dq[4 * i + c]
        s.turn[i] = share * dq[4 * i + 3]
    edges(s.x, s.tangent, s.inverse)
    carry(motion.tangent, motion.m1, motion.twist, s.tangent, s.turn, s.m1, s.twist)


@compiled(**INLINED)
def _evaluate(rod, ends, motion, s, dq, mean, pace, second):
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
        configure(motion, s, dq, point)
        sum_up(rod, s.m1, s.twist, s, s.rate, pace, second, nodes)
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
    add_loads(rod, ends, motion.clock[PUSH], s.gradient, nodes)


@compiled(**OPTIONS)
def _newton(rod, ends, motion, s, dq, c, b, pace, options):
    """Solve M (c dq - b) + F = 0 for the free increments, from the guess in dq; F as in `_evaluate`.

    Of ribbons that damp F is at the velocities s.known + pace dq, and at those in s.rate of the clamps.

    Returns the iterations, negative if they did not converge.  A factorisation is kept from one
    iteration to the next, and from one step to the next while c stays, as long as the updates
    fall to a tenth each time: most of the cost is in making it.
    """
    nodes = motion.x.shape[0]
    first, last = FIRST, 4 * nodes - 8
    mean = options.method == DISCRETE_GRADIENT
    before = 0.0
    fresh = motion.clock[FACTORED] != c
    made = 0
    for iteration in range(1, 31):
        if rod.retardation > 0.0:
            for i in range(first, last):
                s.rate[i] = s.known[i] + pace * dq[i]
        _evaluate(rod, ends, motion, s, dq, mean, pace, fresh)
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
        if size < options.newton:
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


@compiled(**OPTIONS)
def attempt(rod, ends, motion, s, course, options, h, target):
    """One step of size h from `motion` to an instant: increments in s.dq, velocities in s.v.

    Returns (iterations, local error of the positions); negative iterations mean failure.
    """
    nodes = motion.x.shape[0]
    first, last = FIRST, 4 * nodes - 8
    nu, time, phase = course.damping, motion.clock[TIME], int(motion.clock[PHASE])
    damped = rod.retardation > 0.0
    control, rate, _ = control_at(ends, phase, target)
    v0, a0, aux = motion.v, motion.a, motion.aux
    method = options.method
    error = 0.0
    if method == VERLET:
        # kicks with the damping taken implicitly at the end: second order, and stable in nu
        for i in range(first, last):
            s.v[i] = v0[i] + 0.5 * h * a0[i]
            s.dq[i] = h * s.v[i]
        place(rod, ends, control, motion, s.dq)
        if not largest_move(s.dq, first, last) < 0.5:
            return -1, error
        configure(motion, s, s.dq, 1.0)
        sum_up(rod, s.m1, s.twist, s, s.rate, 0.0, False, nodes)
        add_loads(rod, ends, motion.clock[PUSH], s.gradient, nodes)
        for i in range(first, last):
            s.v[i] = (s.v[i] - 0.5 * h * s.gradient[i] / rod.inertia[i]) / (1.0 + 0.5 * h * nu)
        return 1, error

    if method == RUNGE_KUTTA:
        table, stages = options.table, options.table.shape[0]
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
            if options.instants[k] != 1.0:
                control, rate, _ = control_at(ends, phase, time + options.instants[k] * h)
            else:
                control, rate, _ = control_at(ends, phase, target)
            place(rod, ends, control, motion, s.dq)
            if damped:
                drift(rod, ends, control, rate, s.rate)
                for i in range(first, last):
                    s.known[i] = s.stage_v[k, i] - s.stage_a[k, i] / dh
            used = _newton(rod, ends, motion, s, s.dq, c, s.b, 1.0 / dh, options)
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
                    estimate += options.weights[k] * s.stage_v[k, i]
                error = max(error, h * abs(estimate))
        return count, error

    beta, gamma, am, af = 0.25, 0.5, 0.0, 0.0
    if method == GENERALISED_ALPHA:
        am = (2.0 * options.radius - 1.0) / (options.radius + 1.0)
        af = options.radius / (options.radius + 1.0)
        gamma = 0.5 - am + af
        beta = 0.25 * (1.0 - am + af) ** 2
    if method == IMPLICIT_EULER:
        c, pace = 1.0 / (h * h) + nu / h, 1.0 / h
        for i in range(first, last):
            s.known[i] = 0.0
            s.b[i] = v0[i] / h
            s.dq[i] = h * (v0[i] + h * a0[i])
    elif method == MIDPOINT or method == DISCRETE_GRADIENT:
        c, pace = 2.0 / (h * h) + nu / h, 2.0 / h
        for i in range(first, last):
            s.known[i] = 0.0
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
        c, pace = ratio / (beta * h * h) + nu * gamma / (beta * h), gamma / (beta * h)
        for i in range(first, last):
            # a1 = dq / (beta h^2) - old, v1 = known + gamma h a1
            old = v0[i] / (beta * h) + (0.5 / beta - 1.0) * aux[i]
            known = v0[i] + h * (1.0 - gamma) * aux[i]
            s.known[i] = known - gamma * h * old
            s.b[i] = ratio * old - nu * (known - gamma * h * old) - (am * aux[i] - af * a0[i]) / (1.0 - af)
            s.dq[i] = h * (v0[i] + 0.5 * h * a0[i])
    if method == MIDPOINT:
        middle, rate, _ = control_at(ends, phase, time + 0.5 * h)
        place(rod, ends, middle, motion, s.dq)
        if damped:
            drift(rod, ends, middle, rate, s.rate)
    else:
        place(rod, ends, control, motion, s.dq)
        if damped:
            drift(rod, ends, control, rate, s.rate)
    if method == DISCRETE_GRADIENT:
        # the mean force, whose work is that of a step
        motion.clock[PUSH] = 0.5 * (motion.clock[PUSHED] + motion.clock[PUSH])
    count = _newton(rod, ends, motion, s, s.dq, c, s.b, pace, options)
    if count < 0:
        return count, error
    if method == MIDPOINT:
        for i in range(first, last):
            s.dq[i] *= 2.0
        place(rod, ends, control, motion, s.dq)
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
