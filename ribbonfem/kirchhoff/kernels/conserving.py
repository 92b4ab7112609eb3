"""A step of the Kirchhoff rod that balances its energy to rounding, however long it is.

The midpoint rule, with the moments' mean along the step (average vector field): each frame turns
from g0 to g1 = g0 exp(psi / 2) about one axis, its spin over the step is psi's first component,
and the constraint r' = t (1 + c n.t) holds at the ends.  n is the force over the step, along
m = (t0 + t1) / 2 the mean of the axial forces at its ends.  Work of n on r and on t then cancel:

    n.(r1 - r0)' = n.(t1 - t0) (1 + c n.m) + c (N1^2 - N0^2) / 2
"""

from __future__ import annotations

import math

import numpy as np

from ribbonfem.compiled.copies import add, copy
from ribbonfem.compiled.decorator import compiled
from ribbonfem.compiled.lanes import load, store
from ribbonfem.results import Array
from ribbonfem.stepping.kernels.arrays import Ramp

from .arrays import MEMORY, POINTS, SIGMA, Motion, Scratch
from .condensed import solve
from .fours import INLINED, OPTIONS, collect, force_at
from .newton import KEEP, NEWTON_LIMIT, RESOLVED, ROUNDING, SMALLEST_CHANGE, make_factors, move, size_of
from .points import Vector, bend, dot, interpolated_fours, tangent_of
from .residual import add_forces, add_moments, put_gap, put_gradients, put_inertia
from .rod import P, Rod, Solver
from .rotations import rotate, turn_between

# Frames along the step (nodes, 4) are kept in the place of the rates of a stage, t.stage_v[1], mean
# velocities of the last steps in t.stage_a[2] and behind: there are no stages here, and more arrays in the
# scratch slow every other method down by a tenth.
KEPT = 3
STAGES = 2 + KEPT

# Gauss points of a step and their weights, that of the middle last
AT = (0.5 - math.sqrt(0.15), 0.5 + math.sqrt(0.15), 0.5)
SHARE = (5.0 / 18.0, 5.0 / 18.0, 8.0 / 18.0)


@compiled(**INLINED)
def _direction(rod: Rod, s: Solver, group: int, k: int) -> Vector:
    """The unit tangent at a Gauss point, by s.frames."""
    q, _ = interpolated_fours(rod.value, rod.four.slope, group, k, s.frames, P)
    _, tangent = tangent_of(q)
    return tangent


@compiled(**OPTIONS)
def _mean_moments(rod: Rod, s: Solver, t: Scratch, g0: Array) -> None:
    """Add the means of the moments along the step to s.fp; the frames of its middle stay in t.stage_v[1]."""
    path, last = t.stage_v[1], rod.weights.shape[0] - 1
    for j in range(len(AT)):
        for i in range(g0.shape[0]):
            for c in range(4):
                path[i, c] = g0[i, c]
            rotate(path, i, AT[j] * t.spin[i, 0], AT[j] * t.spin[i, 1], AT[j] * t.spin[i, 2])
        for group in range(rod.four.weights.shape[0]):
            collect(path, group, last, P, s.frames)
            for k in range(P):
                q, p = interpolated_fours(rod.value, rod.four.slope, group, k, s.frames, P)
                x, y = load(s.local_right, (group, 3 * k)), load(s.local_right, (group, 3 * k + 1))
                pull = x, y, load(s.local_right, (group, 3 * k + 2))
                gq, gp, _, _ = bend(rod.stiff, 0.0, q, p, pull)
                put_gradients(s, k, SHARE[j] * load(rod.four.weights, (group, k)), gq, gp)
            add_moments(rod, s, group, last)


@compiled(**OPTIONS)
def _residual(rod: Rod, s: Solver, t: Scratch, y: Motion) -> None:
    """Residuals of the step in s.fr, s.fp, s.fn; t.force is the mean inertial force a mass.

    The force on the mean tangents is kept in s.local_right, which is free until the solution.
    """
    put_inertia(rod, s, t.force)
    last = rod.weights.shape[0] - 1
    for group in range(rod.four.weights.shape[0]):
        collect(y.g, group, last, P, s.frames)
        for k in range(P):
            tangent = _direction(rod, s, group, k)
            store(s.gradients, (k, 0), dot(force_at(t.n, group, k), tangent))
            store(s.gradients, (k, 1), dot(force_at(y.n, group, k), tangent))
        collect(t.g, group, last, P, s.frames)
        collect(t.x, group, last, P, s.places)
        for k in range(P):
            n, tangent = force_at(t.n, group, k), _direction(rod, s, group, k)
            mean = 0.5 * (load(s.gradients, (k, 0)) + dot(n, tangent))
            # N1 is what makes the mean n.m
            put_gap(rod, s, group, k, 1.0 + rod.soft * (2.0 * mean - load(s.gradients, (k, 1))), tangent)
            part = 1.0 + rod.soft * mean
            store(s.local_right, (group, 3 * k), part * n[0])
            store(s.local_right, (group, 3 * k + 1), part * n[1])
            store(s.local_right, (group, 3 * k + 2), part * n[2])
        add_forces(rod, s, group, last, t.n)
    _mean_moments(rod, s, t, y.g)


@compiled(**OPTIONS)
def _end_forces(rod: Rod, s: Solver, t: Scratch, y: Motion) -> None:
    """Give t.n the axial force of the step's end, in a rod that stretches."""
    last = rod.weights.shape[0] - 1
    for group in range(rod.four.weights.shape[0]):
        collect(y.g, group, last, P, s.frames)
        for k in range(P):
            tangent = _direction(rod, s, group, k)
            along = dot(force_at(t.n, group, k), tangent) - dot(force_at(y.n, group, k), tangent)
            store(s.gradients, (k, 0), along)
        collect(t.g, group, last, P, s.frames)
        for k in range(P):
            tangent, along = _direction(rod, s, group, k), load(s.gradients, (k, 0))
            n = force_at(t.n, group, k)
            store(t.n, (group, k, 0), n[0] + along * tangent[0])
            store(t.n, (group, k, 1), n[1] + along * tangent[1])
            store(t.n, (group, k, 2), n[2] + along * tangent[2])


@compiled(**OPTIONS)
def _rates(t: Scratch, y: Motion, b: float, h: float, nu: float) -> None:
    """Accelerations, and velocities of the end, from positions and turns."""
    for i in range(1, y.g.shape[0] - 1):
        turn_between(y.g, t.g, i, t.spin)
        t.x[i, 3] = t.spin[i, 0]
        for c in range(4):
            acceleration = (t.x[i, c] - t.xp[i, c]) / b
            t.a[i, c] = acceleration
            t.v[i, c] = t.vp[i, c] + h * acceleration
            t.force[i, c] = acceleration + 0.5 * nu * (y.v[i, c] + t.v[i, c])


@compiled(**OPTIONS)
def conserve(rod: Rod, s: Solver, t: Scratch, y: Motion, b: float, h: float, ramp: Ramp, clock: Array) -> int:
    """Solve a step as `newton` does a stage; the mean moment on the clamp is left in t.out[0].

    The tangent is that of the middle, symmetric: moments count there twice, and half of n.
    """
    nu, nodes = ramp.damping, y.g.shape[0]
    sigma = 2.0 * (1.0 / b + 0.5 * nu * h / b)
    fresh = not abs(clock[SIGMA] - sigma) <= KEEP * sigma
    tolerance = max(SMALLEST_CHANGE, ramp.newton * min(1.0, RESOLVED * math.sqrt(b)))
    before = rate = 0.0
    made = 0
    turn_between(y.g, t.g, 0, t.spin)
    for i in range(1, nodes - 1):
        for c in range(3):
            t.x[i, c] = t.xp[i, c] + b * t.a[i, c]
    iteration = 0
    while iteration < NEWTON_LIMIT:
        iteration += 1
        _rates(t, y, b, h, nu)
        _residual(rod, s, t, y)
        t.out[0] = s.fp[0, 1]
        for i in range(1, nodes - 1):
            if rod.gyroscopic:
                # J theta' t', whose work on psi is none
                factor = 0.5 * rod.inertia[i, 3] * (y.v[i, 3] + t.v[i, 3]) / h
                s.fp[i, 1] += factor * t.spin[i, 2]
                s.fp[i, 2] -= factor * t.spin[i, 1]
            for c in range(3):
                s.fr[i, c] *= 2.0
                s.fp[i, c] *= 2.0
        if fresh:
            make_factors(rod, s, t.stage_v[1], t.n, sigma, clock)
            made += 1
        solve(rod, s, sigma)
        size = size_of(s)
        # a comparison that NaN fails; max() may hide one in either argument
        good = size < 0.5 and np.isfinite(s.fn[0, 0, 0, 0])
        if not fresh and (not good or (iteration > 1 and size > max(0.5 * before, ROUNDING))):
            fresh = True
            continue
        if not good or made > 8:
            break
        move(s, t, 0.5)
        left = size
        if before > 0.0:
            rate = min(0.9, size / before)
            left = size * rate / (1.0 - rate)
        if min(size, left) < tolerance or (made > 0 and size < ROUNDING and rate > 0.3):
            _rates(t, y, b, h, nu)
            if rod.soft > 0.0:
                _end_forces(rod, s, t, y)
            return iteration
        fresh = iteration > 1 and rate > 0.3
        before = size
    clock[SIGMA] = 0.0
    return -iteration


@compiled(**OPTIONS)
def guess_ringing(t: Scratch, clock: Array) -> None:
    """Guesses of n and a of a step by those of the last three, a line in time and what alternates on it.

    Both ring from step to step, which the parabola through them takes for seven times as much.
    """
    known = int(clock[POINTS])
    # the first of the points known is the kink's
    if known < 4:
        return
    last, second, third = (known - 1) % MEMORY, (known - 2) % MEMORY, (known - 3) % MEMORY
    for i in range(1, t.g.shape[0] - 1):
        for c in range(4):
            t.a[i, c] = t.known_a[last, i, c] + t.known_a[second, i, c] - t.known_a[third, i, c]
    copy(t.known_n[last], t.n)
    add(t.known_n[second], 1.0, t.n)
    add(t.known_n[third], -1.0, t.n)


@compiled(**OPTIONS)
def error_by_means(y: Motion, t: Scratch, before: int, h: float) -> tuple[float, float]:
    """Estimated local error of positions, h^3 x''' / 12, and the largest speed; `before`: steps since a kink.

    By second differences of velocities: means of a step, and of those the means of neighbours.  Velocities
    at the ends of steps ring for ever with what a step does not resolve, as accelerations do.  The error is
    negative while the last four steps are not of one length: no longer step is to follow.
    """
    if before < KEPT:
        return -1e-300, 1.0
    first, second, third = t.stage_a[2], t.stage_a[3], t.stage_a[4]
    h1, h2, h3 = first[0, 0], second[0, 0], third[0, 0]
    # between the middles of those means
    late, early = 0.25 * (h + 2.0 * h1 + h2), 0.25 * (h1 + 2.0 * h2 + h3)
    largest = speed = 0.0
    for i in range(1, y.x.shape[0] - 1):
        for c in range(3):
            mean = (t.x[i, c] - y.x[i, c]) / h
            change = 0.5 * ((mean - second[i, c]) / late - (first[i, c] - third[i, c]) / early)
            largest = max(largest, abs(change))
            speed = max(speed, abs(mean))
    error = h * h * h * largest / (6.0 * (late + early))
    alike = max(abs(h1 - h), abs(h2 - h), abs(h3 - h)) < 1e-2 * h
    return (error if alike else -error), speed


@compiled(**OPTIONS)
def keep_mean(y: Motion, t: Scratch, h: float) -> None:
    """Keep a step's mean velocities, before it is taken over."""
    copy(t.stage_a[3], t.stage_a[4])
    copy(t.stage_a[2], t.stage_a[3])
    first = t.stage_a[2]
    # (the clamped node has none, and its place is the step's)
    first[0, 0] = h
    for i in range(1, y.x.shape[0] - 1):
        for c in range(3):
            first[i, c] = (t.x[i, c] - y.x[i, c]) / h


@compiled(**OPTIONS)
def mean_kinetic(rod: Rod, v0: Array, v: Array) -> float:
    """Kinetic energy of the mean velocity of a step."""
    total = 0.0
    for i in range(1, v.shape[0] - 1):
        for c in range(4):
            middle = 0.5 * (v0[i, c] + v[i, c])
            total += rod.inertia[i, c] * middle * middle
    return 0.5 * total
