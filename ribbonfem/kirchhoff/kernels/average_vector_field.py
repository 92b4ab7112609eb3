"""A step of the Kirchhoff rod by the average vector field: its energy balances to rounding at any step.

The midpoint rule, with the moments' mean along the step (average vector field): each frame turns
from g0 to g1 = g0 exp(psi / 2) about one axis, its spin over the step is psi's first component,
and the constraint r' = t (1 + c n.t) holds at the ends.  n is the force over the step, along
m = (t0 + t1) / 2 the mean of the axial forces at its ends.  Work of n on r and on t then cancel:

    n.(r1 - r0)' = n.(t1 - t0) (1 + c n.m) + c (N1^2 - N0^2) / 2
"""

from __future__ import annotations

import math

import numpy as np

from ribbonfem.ends.kernels import PUSH
from ribbonfem.jit.algebra import Vector, dot
from ribbonfem.jit.decorator import compiled
from ribbonfem.jit.simd import load, store
from ribbonfem.linalg.array_ops import add, copy
from ribbonfem.results import Array
from ribbonfem.stepping.kernels.arrays import TIME, Ramp
from ribbonfem.stepping.kernels.guess import KNOWN, MEMORY, POINTS
from ribbonfem.stepping.kernels.newton import (
    ASSEMBLIES,
    KEEP,
    LIMIT,
    RESOLVED,
    ROUNDING,
    SIGMA,
    SMALLEST_CHANGE,
)

from .arrays import Motion, Scratch
from .batch import INLINED, OPTIONS, force_at, gather
from .condensed import factorise, solve
from .gauss_point import interpolated_group, point_gradient, tangent_of
from .law import offset_at
from .newton import LARGEST, move, size_of
from .residual import add_forces, add_moments, put_gap, put_gradients, put_inertia
from .rod import P, Rod, Solver
from .rotations import rotate, turn_between
from .tangent import fill

# steps over which the error of one is estimated, and iterations beyond which none longer is tried
SPAN, EASY = 4, 7.0
# L/t*, above which a ribbon does not creep
FAST = 0.5
# Frames along the step (nodes, 4) are kept in the place of the rates of a stage, t.stage_v[1], positions
# of the last steps in t.stage_a[2] and behind: there are no stages here, and more arrays in the
# scratch slow every other method down by a tenth.
KEPT = 3 * SPAN
STAGES = 2 + KEPT

# Gauss points of a step and their weights, that of the middle last
AT = (0.5 - math.sqrt(0.15), 0.5 + math.sqrt(0.15), 0.5)
SHARE = (5.0 / 18.0, 5.0 / 18.0, 8.0 / 18.0)


@compiled(**INLINED)
def _direction(rod: Rod, s: Solver, group: int, k: int) -> Vector:
    """The unit tangent at a Gauss point, by s.frames."""
    q, _ = interpolated_group(rod.value, rod.groups.slope, group, k, s.frames, P)
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
        for group in range(rod.groups.weights.shape[0]):
            gather(path, group, last, P, s.frames)
            for k in range(P):
                q, p = interpolated_group(rod.value, rod.groups.slope, group, k, s.frames, P)
                x, y = load(s.local_right, (group, 3 * k)), load(s.local_right, (group, 3 * k + 1))
                force = x, y, load(s.local_right, (group, 3 * k + 2))
                gq, gp, _, _ = point_gradient(rod.stiffness, 0.0, offset_at(rod, group, k), q, p, force)
                put_gradients(s, k, SHARE[j] * load(rod.groups.weights, (group, k)), gq, gp)
            add_moments(rod, s, group, last)


@compiled(**OPTIONS)
def _residual(rod: Rod, s: Solver, t: Scratch, y: Motion) -> None:
    """Residuals of the step in s.fr, s.fp, s.fn; t.force is the mean inertial force a mass.

    The force on the mean tangents is kept in s.local_right, which is free until the solution.
    """
    put_inertia(rod, s, t.force)
    last = rod.weights.shape[0] - 1
    for group in range(rod.groups.weights.shape[0]):
        gather(y.g, group, last, P, s.frames)
        for k in range(P):
            tangent = _direction(rod, s, group, k)
            store(s.gradients, (k, 0), dot(force_at(t.n, group, k), tangent))
            store(s.gradients, (k, 1), dot(force_at(y.n, group, k), tangent))
        gather(t.g, group, last, P, s.frames)
        gather(t.x, group, last, P, s.places)
        for k in range(P):
            n, tangent = force_at(t.n, group, k), _direction(rod, s, group, k)
            mean = 0.5 * (load(s.gradients, (k, 0)) + dot(n, tangent))
            # N1 is what makes the mean n.m
            put_gap(
                rod, s, group, k, 1.0 + rod.compliance[0] * (2.0 * mean - load(s.gradients, (k, 1))), tangent
            )
            part = 1.0 + rod.compliance[0] * mean
            store(s.local_right, (group, 3 * k), part * n[0])
            store(s.local_right, (group, 3 * k + 1), part * n[1])
            store(s.local_right, (group, 3 * k + 2), part * n[2])
        add_forces(rod, s, group, last, t.n)
    _mean_moments(rod, s, t, y.g)


@compiled(**OPTIONS)
def _end_forces(rod: Rod, s: Solver, t: Scratch, y: Motion) -> None:
    """Give t.n the axial force of the step's end, in a rod that stretches."""
    last = rod.weights.shape[0] - 1
    for group in range(rod.groups.weights.shape[0]):
        gather(y.g, group, last, P, s.frames)
        for k in range(P):
            tangent = _direction(rod, s, group, k)
            along = dot(force_at(t.n, group, k), tangent) - dot(force_at(y.n, group, k), tangent)
            store(s.gradients, (k, 0), along)
        gather(t.g, group, last, P, s.frames)
        for k in range(P):
            tangent, along = _direction(rod, s, group, k), load(s.gradients, (k, 0))
            n = force_at(t.n, group, k)
            store(t.n, (group, k, 0), n[0] + along * tangent[0])
            store(t.n, (group, k, 1), n[1] + along * tangent[1])
            store(t.n, (group, k, 2), n[2] + along * tangent[2])


@compiled(**OPTIONS)
def _rates(rod: Rod, t: Scratch, y: Motion, b: float, h: float, nu: float) -> None:
    """Accelerations, and velocities of the end, from positions and turns."""
    for i in range(1, y.g.shape[0] - 1):
        turn_between(y.g, t.g, i, t.spin)
        t.x[i, 3] = t.spin[i, 0]
        for c in range(4):
            acceleration = (t.x[i, c] - t.xp[i, c]) / b
            t.a[i, c] = acceleration
            t.v[i, c] = t.vp[i, c] + h * acceleration
            t.force[i, c] = acceleration + 0.5 * nu * (y.v[i, c] + t.v[i, c]) - rod.weight[c]


@compiled(**OPTIONS)
def _work(rod: Rod, s: Solver, t: Scratch, y: Motion, push: float) -> float:
    """Of the controls over the step, by the means of the clamps' forces in s."""
    last = y.g.shape[0] - 1
    total = push * (y.x[rod.middle, 2] - t.x[rod.middle, 2])
    for c in range(3):
        force = s.fr[last, c] - rod.inertia[last, c] * rod.weight[c]
        total += s.fp[0, c] * t.spin[0, c] + s.fp[last, c] * t.spin[last, c]
        total += force * (t.x[last, c] - y.x[last, c])
    return total


@compiled(**OPTIONS)
def conserve(rod: Rod, s: Solver, t: Scratch, y: Motion, b: float, h: float, ramp: Ramp, clock: Array) -> int:
    """Solve a step as `newton` does a stage; the work of the controls is left in t.out[0].

    t.out[2] is the force at midspan at its beginning.

    The tangent is that of the middle, symmetric: moments count there twice, and half of n.
    """
    nu, nodes = ramp.damping, y.g.shape[0]
    sigma = 2.0 * (1.0 / b + 0.5 * nu * h / b)
    fresh = not abs(clock[SIGMA] - sigma) <= KEEP * sigma
    tolerance = max(SMALLEST_CHANGE, ramp.newton * min(1.0, RESOLVED * math.sqrt(b)))
    before = rate = 0.0
    made = 0
    # the force at midspan of the middle of the step
    push = 0.5 * (t.out[2] + t.pose[PUSH])
    turn_between(y.g, t.g, 0, t.spin)
    turn_between(y.g, t.g, nodes - 1, t.spin)
    for i in range(1, nodes - 1):
        for c in range(3):
            t.x[i, c] = t.xp[i, c] + b * t.a[i, c]
    iteration = 0
    while iteration < LIMIT:
        iteration += 1
        _rates(rod, t, y, b, h, nu)
        _residual(rod, s, t, y)
        t.out[0] = _work(rod, s, t, y, push)
        s.fr[rod.middle, 2] += push
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
            fill(rod, s, t.stage_v[1], t.n, sigma, False)
            factorise(s)
            clock[SIGMA] = sigma
            clock[ASSEMBLIES] += 1.0
            made += 1
        solve(rod, s, sigma)
        size = size_of(s)
        # a comparison that NaN fails; max() may hide one in either argument
        good = size < LARGEST and np.isfinite(s.fn[0, 0, 0, 0])
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
            _rates(rod, t, y, b, h, nu)
            if rod.compliance[0] > 0.0:
                _end_forces(rod, s, t, y)
            t.out[1] = iteration
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
def error_by_means(y: Motion, t: Scratch, clock: Array, h: float) -> tuple[float, float]:
    """Estimated local error of positions, h^3 d3x/dt3 / 12, and the largest speed.

    By third differences of positions `SPAN` steps apart (fewer close behind a kink, and where the ribbon
    creeps): what so many steps do not resolve rings for ever, and is left out.  Its energy is kept all the
    same; an estimate with it asks for ever shorter steps, as waves grow ever shorter.  The error is
    negative while the last steps are not of one length, or are hard to solve: no longer step is to follow.
    """
    # instants known since the kink, which is the first
    last = int(clock[KNOWN]) - 1
    copy(y.x, t.stage_a[2 + last % KEPT])
    # (the clamped node has none, and its place is the instant's)
    t.stage_a[2 + last % KEPT, 0, 0] = clock[TIME]
    speed = 0.0
    for i in range(1, y.x.shape[0] - 1):
        for c in range(3):
            speed = max(speed, abs(t.x[i, c] - y.x[i, c]))
    span = min(SPAN if speed > FAST * h else 2, (last + 1) // 3)
    if span < 1:
        return -1e-300, 1.0
    first = t.stage_a[2 + (last + 1 - span) % KEPT]
    second = t.stage_a[2 + (last + 1 - 2 * span) % KEPT]
    third = t.stage_a[2 + (last + 1 - 3 * span) % KEPT]
    h1 = clock[TIME] + h - first[0, 0]
    h2, h3 = first[0, 0] - second[0, 0], second[0, 0] - third[0, 0]
    largest = 0.0
    for i in range(1, y.x.shape[0] - 1):
        for c in range(3):
            v2 = (first[i, c] - second[i, c]) / h2
            late = ((t.x[i, c] - first[i, c]) / h1 - v2) / (h1 + h2)
            early = (v2 - (second[i, c] - third[i, c]) / h3) / (h2 + h3)
            largest = max(largest, abs(late - early))
    error = 0.5 * h * h * h * largest / (h1 + h2 + h3)
    easy = abs(h1 - span * h) < 1e-2 * h1 and t.out[1] <= EASY
    return (error if easy else -error), speed / h


@compiled(**OPTIONS)
def mean_kinetic(rod: Rod, v0: Array, v: Array) -> float:
    """Kinetic energy of the mean velocity of a step."""
    total = 0.0
    for i in range(1, v.shape[0] - 1):
        for c in range(4):
            middle = 0.5 * (v0[i, c] + v[i, c])
            total += rod.inertia[i, c] * middle * middle
    return 0.5 * total
