"""Newton on a stage of the Kirchhoff rod: predictor, increments of rotations, convergence.

The factors of a tangent are kept over iterations, stages and steps, as long as they serve.
Guesses of g, n and a are polynomials through the last stages solved, in quaternions: their
sums, normalised, do not depend on the frame.
"""

from __future__ import annotations

import math

import numpy as np

from ribbonfem.ends.kernels import PUSH
from ribbonfem.jit.algebra import carried, conjugate, quaternion, triple
from ribbonfem.jit.decorator import compiled
from ribbonfem.jit.simd import load, store
from ribbonfem.linalg.array_ops import add, copy
from ribbonfem.results import Array
from ribbonfem.stepping.kernels.arrays import Ramp
from ribbonfem.stepping.kernels.guess import MEMORY, put_weights

from .arrays import ASSEMBLIES, FORETOLD, POINTS, RATE, SIGMA, Scratch
from .batch import INLINED, OPTIONS
from .condensed import factorise, solve
from .consistent_initialisation import tangents
from .residual import residual
from .rod import P, Rod, Solver
from .rotations import normalise_inner, rotate_inner, twists
from .tangent import fill

NEWTON_LIMIT = 20
# relative change of 1 / (step)^2 for which factors are kept
KEEP = 0.4
# 1/t*; stages shorter than one over this are solved the closer the shorter they are
RESOLVED = 100.0
# L; Newton tries no harder, and takes it for rounding if increments below the second do not fall
SMALLEST_CHANGE, ROUNDING = 1e-15, 1e-11
# The rate at which a first increment would fall is taken from the last stage: at least this, and to this
# power, so that it grows from stage to stage until one is measured again.  Not for fixed steps: what they
# leave is to be that of the method.
LEAST_RATE, AGEING = 1e-3, 0.8
# an angle counts as a tenth of a length: the half width of the ribbon
ANGLE = 0.1


@compiled(**OPTIONS)
def _gyroscopic(rod: Rod, s: Solver, g: Array, v: Array, tangent_rate: Array) -> None:
    """Add J m theta' dt/dt, the moment that turns the spin with the tangent, to the residual."""
    for i in range(1, g.shape[0] - 1):
        factor = rod.inertia[i, 3] * v[i, 3]
        # (along the first axis of the body is nothing)
        moment = carried(conjugate(quaternion(g, i)), triple(tangent_rate, i))
        s.fp[i, 1] += factor * moment[1]
        s.fp[i, 2] += factor * moment[2]


@compiled(**OPTIONS)
def make_factors(rod: Rod, s: Solver, g: Array, n: Array, sigma: float, clock: Array) -> None:
    """New factors of the tangent, and that they are for sigma."""
    fill(rod, s, g, n, sigma, False)
    factorise(s)
    clock[SIGMA] = sigma
    clock[ASSEMBLIES] += 1.0


@compiled(**OPTIONS)
def size_of(s: Solver) -> float:
    """The largest increment of a position, or of a rotation counted as one."""
    # (one maximum for each component: they do not wait for each other)
    r0 = r1 = r2 = p0 = p1 = p2 = 0.0
    for i in range(1, s.fr.shape[0] - 1):
        r0, r1, r2 = max(r0, abs(s.fr[i, 0])), max(r1, abs(s.fr[i, 1])), max(r2, abs(s.fr[i, 2]))
        p0, p1, p2 = max(p0, abs(s.fp[i, 0])), max(p1, abs(s.fp[i, 1])), max(p2, abs(s.fp[i, 2]))
    return max(r0, r1, r2, ANGLE * p0, ANGLE * p1, ANGLE * p2)


@compiled(**INLINED)
def _rates(t: Scratch, g0: Array, b: float, f: float) -> None:
    """Twists, and the accelerations and velocities that go with the positions."""
    inner = range(4, t.x.size - 4)
    inverse = 1.0 / b
    twists(g0, t.g, t.x)
    # (a loop for each: of more arrays the compiler does not ask whether they overlap, and makes no vectors)
    for k in inner:
        t.a.flat[k] = (t.x.flat[k] - t.xp.flat[k]) * inverse
    for k in inner:
        t.v.flat[k] = t.vp.flat[k] + f * t.a.flat[k]


@compiled(**OPTIONS)
def move(s: Solver, t: Scratch, part: float) -> None:
    """Add the increments in s to t.x, t.g and, a part of them, to t.n."""
    rotate_inner(t.g, s.fp)
    # (what this adds to theta is not: that follows from the frames)
    add(s.fr, 1.0, t.x)
    add(s.fn, part, t.n)


@compiled(**OPTIONS)
def lighten(rod: Rod, force: Array) -> None:
    """Take the weight from inertial forces a mass."""
    for i in range(force.shape[0]):
        for c in range(3):
            force[i, c] -= rod.weight[c]


@compiled(**OPTIONS)
def newton(
    rod: Rod, s: Solver, t: Scratch, g0: Array, b: float, f: float, ft: float, ramp: Ramp, clock: Array
) -> int:
    """Solve a stage from the guesses t.a, t.g, t.n; return the iterations, or minus them on failure.

    x = t.xp + b a, v = t.vp + f a, tangents t.tp + ft (their rate).  Factors are kept while
    they still reduce the increments; those to come are foretold from the last two.
    """
    nu = ramp.damping
    nodes = g0.shape[0]
    sigma = 1.0 / b + nu * f / b
    fresh = not abs(clock[SIGMA] - sigma) <= KEEP * sigma
    # What Newton leaves in a position, over the step, is in the velocity; all to one side it feeds
    # the ringing.
    tolerance = max(SMALLEST_CHANGE, ramp.newton * min(1.0, RESOLVED * math.sqrt(b)))
    before = rate = 0.0
    made = 0
    for k in range(4, t.x.size - 4):
        t.x.flat[k] = t.xp.flat[k] + b * t.a.flat[k]
    iteration = 0
    while iteration < NEWTON_LIMIT:
        iteration += 1
        _rates(t, g0, b, f)
        for k in range(t.force.size):
            t.force.flat[k] = t.a.flat[k] + nu * t.v.flat[k]
        if rod.has_weight:
            lighten(rod, t.force)
        residual(rod, s, t.x, t.g, t.n, t.force)
        s.fr[rod.middle, 2] += t.pose[PUSH]
        if rod.gyroscopic:
            tangents(t.g, t.tangent)
            for i in range(1, nodes - 1):
                for c in range(3):
                    t.tangent_rate[i, c] = (t.tangent[i, c] - t.tp[i, c]) / ft
            _gyroscopic(rod, s, t.g, t.v, t.tangent_rate)
        if fresh:
            make_factors(rod, s, t.g, t.n, sigma, clock)
            made += 1
        solve(rod, s, sigma)
        size = size_of(s)
        # a comparison that NaN fails; max() may hide one in either argument
        good = size < 0.5 and np.isfinite(s.fn[0, 0, 0, 0])
        if not fresh and (not good or (iteration > 1 and size > max(0.5 * before, ROUNDING))):
            # the old factors are no good here: take no step with them
            fresh = True
            continue
        if not good or made > 8:
            break
        move(s, t, 1.0)
        if before > 0.0:
            rate = min(0.9, size / before)
        elif made == 0 and ramp.fixed == 0.0:
            rate = clock[FORETOLD]
        left = size * rate / (1.0 - rate) if rate > 0.0 else size
        if min(size, left) < tolerance or (made > 0 and size < ROUNDING and rate > 0.3):
            _rates(t, g0, b, f)
            if rod.gyroscopic:
                tangents(t.g, t.tangent)
                for i in range(1, nodes - 1):
                    for c in range(3):
                        t.tangent_rate[i, c] = (t.tangent[i, c] - t.tp[i, c]) / ft
            if before > 0.0 or made > 0:
                clock[RATE] = rate
            clock[FORETOLD] = min(0.9, max(rate, LEAST_RATE) ** AGEING)
            return iteration
        fresh = iteration > 1 and rate > 0.3
        before = size
    clock[SIGMA] = 0.0
    return -iteration


@compiled(**OPTIONS)
def remember(t: Scratch, clock: Array, time: float, g: Array, n: Array, a: Array) -> None:
    """Keep a solved stage for guesses."""
    slot = int(clock[POINTS]) % MEMORY
    clock[POINTS] += 1.0
    t.known_time[slot] = time
    copy(g, t.known_g[slot])
    copy(n, t.known_n[slot])
    copy(a, t.known_a[slot])


@compiled(**OPTIONS)
def guess(t: Scratch, clock: Array, time: float) -> None:
    """Guesses of g, n and a at a time, from the polynomial through the last stages known."""
    known = int(clock[POINTS])
    put_weights(t.known_time, known, time, t.lagrange)
    last, before, first = (known - 1) % MEMORY, (known - 2) % MEMORY, (known - 3) % MEMORY
    a, b, c = t.lagrange[0], t.lagrange[1], t.lagrange[2]
    right = t.g.shape[0] - 1
    for i in range(right):
        total = a * load(t.known_g, (last, i)) + b * load(t.known_g, (before, i))
        store(t.g, (i,), total + c * load(t.known_g, (first, i)))
        total = a * load(t.known_a, (last, i)) + b * load(t.known_a, (before, i))
        store(t.a, (i,), total + c * load(t.known_a, (first, i)))
    for group in range(t.n.shape[0]):
        for k in range(P):
            for axis in range(3):
                total = a * load(t.known_n, (last, group, k, axis))
                total += b * load(t.known_n, (before, group, k, axis))
                store(t.n, (group, k, axis), total + c * load(t.known_n, (first, group, k, axis)))
    normalise_inner(t.g)
    # (the clamp's, to the last digit)
    store(t.g, (right,), load(t.known_g, (last, right)))
