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

from ribbonfem.compiled.copies import copy
from ribbonfem.compiled.decorator import compiled
from ribbonfem.results import Array
from ribbonfem.stepping.kernels.arrays import Ramp

from .arrays import MEMORY, POINTS, SIGMA, Motion, Scratch
from .condensed import solve
from .newton import KEEP, NEWTON_LIMIT, RESOLVED, ROUNDING, SMALLEST_CHANGE, make_factors, move, size_of
from .rotations import rotate, turn_between
from .tangent import OPTIONS, P, Rod, Solver, _bend, _body, _interpolate

# Frames along the step (nodes, 4) and the force on the mean tangents, a row a Gauss point, are kept in the
# places of the rates of stages, t.stage_v[1] and t.stage_turning[1], mean velocities of the last steps in
# t.stage_a[2] and behind: there are no stages here, and more arrays in the scratch slow every other method
# down by a tenth.
KEPT = 3
STAGES = 2 + KEPT

# Gauss points of a step and their weights, that of the middle last
AT = (0.5 - math.sqrt(0.15), 0.5 + math.sqrt(0.15), 0.5)
SHARE = (5.0 / 18.0, 5.0 / 18.0, 8.0 / 18.0)


@compiled(**OPTIONS)
def _direction(rod: Rod, s: Solver, e: int, k: int, g: Array, n: Array, tangent: Array) -> float:
    """The unit tangent at a Gauss point; returns n along it."""
    _interpolate(rod, e, k, g, s.q, s.p)
    q0, q1, q2, q3 = s.q[0], s.q[1], s.q[2], s.q[3]
    inverse = 1.0 / (q0 * q0 + q1 * q1 + q2 * q2 + q3 * q3)
    tangent[0] = inverse * (q0 * q0 + q1 * q1 - q2 * q2 - q3 * q3)
    tangent[1] = 2.0 * inverse * (q1 * q2 + q0 * q3)
    tangent[2] = 2.0 * inverse * (q1 * q3 - q0 * q2)
    return float(n[0] * tangent[0] + n[1] * tangent[1] + n[2] * tangent[2])


@compiled(**OPTIONS)
def _mean_moments(rod: Rod, s: Solver, t: Scratch, g0: Array) -> None:
    """Add the means of the moments along the step to s.fp; the frames of its middle stay in t.stage_v[1]."""
    nodes = g0.shape[0]
    path, pull = t.stage_v[1], t.stage_turning[1]
    for j in range(len(AT)):
        for i in range(nodes):
            for c in range(4):
                path[i, c] = g0[i, c]
            rotate(path, i, AT[j] * t.spin[i, 0], AT[j] * t.spin[i, 1], AT[j] * t.spin[i, 2])
        for e in range(rod.weights.shape[0]):
            for i in range(P + 1):
                for c in range(4):
                    s.gradient[i, c] = 0.0
            for k in range(P):
                _interpolate(rod, e, k, path, s.q, s.p)
                _bend(rod, 0.0, s.q, s.p, pull[e * P + k], s.gq, s.gp, s.tangent)
                share = SHARE[j] * rod.weights[e, k]
                for i in range(P + 1):
                    value, slope = share * rod.value[k, i], share * rod.slope[e, k, i]
                    for c in range(4):
                        s.gradient[i, c] += value * s.gq[c] + slope * s.gp[c]
            for i in range(P + 1):
                for c in range(3):
                    s.fp[e * P + i, c] += _body(path, e * P + i, s.gradient[i], c)


@compiled(**OPTIONS)
def _residual(rod: Rod, s: Solver, t: Scratch, y: Motion) -> None:
    """Residuals of the step in s.fr, s.fp, s.fn; t.force is the mean inertial force a mass."""
    for i in range(y.g.shape[0]):
        for c in range(3):
            s.fr[i, c] = rod.inertia[i, c] * t.force[i, c]
            s.fp[i, c] = 0.0
        s.fp[i, 0] = rod.inertia[i, 3] * t.force[i, 3]
    pull = t.stage_turning[1]
    for e in range(rod.weights.shape[0]):
        for k in range(P):
            n = t.n[e, k]
            # N1 is what makes the mean n.m
            mean = 0.5 * _direction(rod, s, e, k, y.g, n, s.tangent)
            first = 0.0
            for c in range(3):
                first += y.n[e, k, c] * s.tangent[c]
            mean += 0.5 * _direction(rod, s, e, k, t.g, n, s.tangent)
            stretch = rod.weights[e, k] * (1.0 + rod.soft * (2.0 * mean - first))
            for c in range(3):
                pull[e * P + k, c] = (1.0 + rod.soft * mean) * n[c]
                gap = 0.0
                for i in range(P + 1):
                    coupling = rod.coupling[e, k, i]
                    gap += coupling * t.x[e * P + i, c]
                    s.fr[e * P + i, c] += coupling * n[c]
                s.fn[e, k, c] = gap - stretch * s.tangent[c]
    _mean_moments(rod, s, t, y.g)


@compiled(**OPTIONS)
def _end_forces(rod: Rod, s: Solver, t: Scratch, y: Motion) -> None:
    """Give t.n the axial force of the step's end, in a rod that stretches."""
    for e in range(rod.weights.shape[0]):
        for k in range(P):
            along = _direction(rod, s, e, k, y.g, t.n[e, k], s.tangent)
            for c in range(3):
                along -= y.n[e, k, c] * s.tangent[c]
            _direction(rod, s, e, k, t.g, t.n[e, k], s.tangent)
            for c in range(3):
                t.n[e, k, c] += along * s.tangent[c]


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
        good = size < 0.5 and np.isfinite(s.fn[0, 0, 0])
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
    for e in range(t.n.shape[0]):
        for k in range(P):
            for c in range(3):
                t.n[e, k, c] = (
                    t.known_n[last, e, k, c] + t.known_n[second, e, k, c] - t.known_n[third, e, k, c]
                )


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
