"""The compiled time loop of the Kirchhoff rod: stages, Newton, hidden constraints, control of steps.

A diagonally implicit method is a tableau (`stepping.tableaus`), a Newmark-like one its coefficients
(`newmark.Method`): stages of both are solved in one place.  All state is in `Motion` and its
clock, so that a run that comes back for more rows is bitwise the uninterrupted one.

Newton keeps the factors of a tangent over iterations, stages and steps, as long as they serve.
Guesses of g, n and a are polynomials through the last stages solved, in quaternions: their
sums, normalised, do not depend on the frame.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from ribbonfem.results import Array
from ribbonfem.stepping.beam_kernels import DIRK, ONE_STAGE, Scheme

from .tangent import (
    STIFF,
    P,
    Rod,
    Solver,
    _bend,
    _body,
    _interpolate,
    _options,
    add_element,
    clamp_moment,
    factorise,
    fill_element,
    residual,
    rotate,
    solve,
    twist,
)

# what `run` returns
DONE, FULL, STUCK, GREW = 0, 1, 2, 3
# what `clock` holds
TIME, STEP, WORK, DISSIPATED, PHASE, KINK, STEPS, NEWTON, REJECTED, ROWS = range(10)
MOMENT, POWER, AFTER, LAST, LOWEST, PEAK, SIGMA, ASSEMBLIES, SINCE, SIDE, POINTS, CARRY = range(10, 22)
CLOCK_SIZE = 22
# columns of `rows`
ROW_SIZE = 9  # time, angle, height, slope, kinetic, elastic, dissipated, work, load

NEWTON_LIMIT = 20
# part of the largest energy so far by which energy may grow without work: more is an unstable method
GROWTH = 0.25
# a height counts as on one side of zero once it has been this far from it, L: rounding has no side
DEPARTED = 1e-6
# relative change of 1 / (step)^2 for which factors are kept
KEEP = 0.4
# a step grows by this factor at least, or stays: a new one costs new factors
LEAST_GROWTH = 1.4
# lengths per t* below which the error allowed in a step shrinks with the speed, over 1, and by how much
CREEP, LEAST = 0.1, 0.01
# an angle counts as a tenth of a length: the half width of the ribbon
ANGLE = 0.1
# solved stages that are remembered, and those through which a guess is laid
MEMORY, GUESS = 16, 3


class Ramp(NamedTuple):
    """The clamp's motion and the control of steps, in t* and rad."""

    rate: float
    stop: float
    turned: float  # when the clamp stops
    end: float
    damping: float
    fixed: float  # 0 if adaptive
    tolerance: float
    largest: float
    newton: float
    smallest: float
    snap: bool  # whether to end soon after the height changes sign
    barrier: float  # energy below which a held ribbon cannot leave its state any more
    gyroscopic: bool
    every: int


class Motion(NamedTuple):
    """State at the last accepted instant.

    x, v, a, auxiliary (nodes, 4); g (nodes, 4); n (E, P, 3); tangent and its rate (nodes, 3).
    """

    x: Array
    v: Array
    a: Array
    auxiliary: Array
    g: Array
    n: Array
    tangent: Array
    turning: Array
    clock: Array


class Scratch(NamedTuple):
    """What a step overwrites, and the stages remembered for guesses."""

    xp: Array
    vp: Array
    tp: Array
    x: Array
    v: Array
    a: Array
    g: Array
    n: Array
    force: Array
    tangent: Array
    turning: Array
    stage_v: Array
    stage_a: Array
    stage_turning: Array
    known_time: Array
    known_g: Array
    known_n: Array
    known_a: Array
    lagrange: Array
    spin: Array
    out: Array


def scratch(elements: int, stages: int) -> Scratch:
    """Memory for a mesh and a method."""
    nodes = elements * P + 1

    def four() -> Array:
        return np.zeros((nodes, 4))

    return Scratch(
        xp=four(),
        vp=four(),
        tp=np.zeros((nodes, 3)),
        x=four(),
        v=four(),
        a=four(),
        g=four(),
        n=np.zeros((elements, P, 3)),
        force=four(),
        tangent=np.zeros((nodes, 3)),
        turning=np.zeros((nodes, 3)),
        stage_v=np.zeros((stages, nodes, 4)),
        stage_a=np.zeros((stages, nodes, 4)),
        stage_turning=np.zeros((stages, nodes, 3)),
        known_time=np.zeros(MEMORY),
        known_g=np.zeros((MEMORY, nodes, 4)),
        known_n=np.zeros((MEMORY, elements, P, 3)),
        known_a=np.zeros((MEMORY, nodes, 4)),
        lagrange=np.zeros(GUESS),
        spin=np.zeros((nodes, 3)),
        out=np.zeros(4),
    )


@njit(**_options)
def tangents(g: Array, tangent: Array) -> None:
    """Unit tangents (nodes, 3) of the frames."""
    for i in range(g.shape[0]):
        w, x, y, z = g[i, 0], g[i, 1], g[i, 2], g[i, 3]
        tangent[i, 0] = w * w + x * x - y * y - z * z
        tangent[i, 1] = 2.0 * (x * y + w * z)
        tangent[i, 2] = 2.0 * (x * z - w * y)


@njit(**_options)
def _set_clamp(g: Array, angle: float) -> None:
    g[0, 0], g[0, 1], g[0, 2], g[0, 3] = np.cos(0.5 * angle), 0.0, np.sin(0.5 * angle), 0.0


@njit(**_options)
def _gyroscopic(rod: Rod, s: Solver, g: Array, v: Array, turning: Array) -> None:
    """Add J m theta' dt/dt, the moment that turns the spin with the tangent, to the residual."""
    for i in range(1, g.shape[0] - 1):
        w, x, y, z = g[i, 0], g[i, 1], g[i, 2], g[i, 3]
        factor = rod.inertia[i, 3] * v[i, 3]
        a, b, c = turning[i, 0], turning[i, 1], turning[i, 2]
        # components along the second and third axis of the body
        s.fp[i, 1] += factor * (
            2.0 * (x * y - w * z) * a + (w * w - x * x + y * y - z * z) * b + 2.0 * (y * z + w * x) * c
        )
        s.fp[i, 2] += factor * (
            2.0 * (x * z + w * y) * a + 2.0 * (y * z - w * x) * b + (w * w - x * x - y * y + z * z) * c
        )


@njit(**_options)
def _newton(
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
    before = rate = 0.0
    made = 0
    for i in range(1, nodes - 1):
        for c in range(3):
            t.x[i, c] = t.xp[i, c] + b * t.a[i, c]
    iteration = 0
    while iteration < NEWTON_LIMIT:
        iteration += 1
        for i in range(1, nodes - 1):
            t.x[i, 3] = twist(g0, t.g, i)
            for c in range(4):
                acceleration = (t.x[i, c] - t.xp[i, c]) / b
                t.a[i, c] = acceleration
                t.v[i, c] = t.vp[i, c] + f * acceleration
                t.force[i, c] = acceleration + nu * t.v[i, c]
        residual(rod, s, t.x, t.g, t.n, t.force)
        if ramp.gyroscopic:
            tangents(t.g, t.tangent)
            for i in range(1, nodes - 1):
                for c in range(3):
                    t.turning[i, c] = (t.tangent[i, c] - t.tp[i, c]) / ft
            _gyroscopic(rod, s, t.g, t.v, t.turning)
        if fresh:
            for e in range(rod.weights.shape[0]):
                fill_element(rod, s, e, t.g, t.n, sigma, False)
            factorise(s)
            clock[SIGMA] = sigma
            clock[ASSEMBLIES] += 1.0
            made += 1
        solve(rod, s, sigma)
        size = 0.0
        for i in range(1, nodes - 1):
            for c in range(3):
                size = max(size, abs(s.fr[i, c]), ANGLE * abs(s.fp[i, c]))
        # a comparison that NaN fails; max() may hide one in either argument
        good = size < 0.5 and np.isfinite(s.fn[0, 0, 0])
        if not fresh and (not good or (iteration > 1 and size > 0.5 * before)):
            # the old factors are no good here: take no step with them
            fresh = True
            continue
        if not good or made > 8:
            break
        for i in range(1, nodes - 1):
            rotate(t.g, i, s.fp[i, 0], s.fp[i, 1], s.fp[i, 2])
            for c in range(3):
                t.x[i, c] += s.fr[i, c]
        for e in range(rod.weights.shape[0]):
            for k in range(P):
                for c in range(3):
                    t.n[e, k, c] += s.fn[e, k, c]
        left = size
        if before > 0.0:
            rate = min(0.9, size / before)
            left = size * rate / (1.0 - rate)
        if size < ramp.newton or left < ramp.newton:
            for i in range(1, nodes - 1):
                t.x[i, 3] = twist(g0, t.g, i)
                for c in range(4):
                    t.a[i, c] = (t.x[i, c] - t.xp[i, c]) / b
                    t.v[i, c] = t.vp[i, c] + f * t.a[i, c]
            if ramp.gyroscopic:
                tangents(t.g, t.tangent)
                for i in range(1, nodes - 1):
                    for c in range(3):
                        t.turning[i, c] = (t.tangent[i, c] - t.tp[i, c]) / ft
            return iteration
        fresh = iteration > 1 and rate > 0.3
        before = size
    clock[SIGMA] = 0.0
    return -iteration


@njit(**_options)
def _impulse_residual(
    rod: Rod, s: Solver, m: Motion, t: Scratch, old: Array, second: bool, ramp: Ramp
) -> None:
    """Residual of the hidden constraints, see `_project`; t.spin are the unknown rates of rotation.

    First: v = t.v against `old`, impulses t.n.  Second: a = m.a, rates of m.v and t.turning (the
    rates of rotation found first), forces t.n.
    """
    g = m.g
    nodes = g.shape[0]
    nu = ramp.damping
    if second:
        for i in range(nodes):
            for c in range(3):
                t.force[i, c] = m.a[i, c] + nu * m.v[i, c]
            t.force[i, 3] = t.spin[i, 0] + nu * m.v[i, 3]
        residual(rod, s, m.x, g, t.n, t.force)
        if ramp.gyroscopic:
            for i in range(1, nodes - 1):
                factor = rod.inertia[i, 3] * m.v[i, 3]
                s.fp[i, 1] += factor * t.turning[i, 2]
                s.fp[i, 2] -= factor * t.turning[i, 1]
    else:
        for i in range(nodes):
            for c in range(3):
                s.fr[i, c] = rod.inertia[i, c] * (t.v[i, c] - old[i, c])
                s.fp[i, c] = 0.0
            s.fp[i, 0] = rod.inertia[i, 3] * (t.spin[i, 0] - old[i, 3])
    axial = STIFF if rod.soft > 0.0 else 0.0
    rates = m.a if second else t.v
    for e in range(rod.weights.shape[0]):
        for k in range(P):
            _interpolate(rod, e, k, g, s.q, s.p)
            _, pull = _bend(rod, s.q, s.p, m.n[e, k], s.gq, s.gp, s.tangent)
            weight = rod.weights[e, k]
            stretch = 1.0 + rod.soft * pull
            # rates of the interpolated quaternion, by t.spin, and by t.turning alone twice
            d0 = d1 = d2 = d3 = 0.0
            u0 = u1 = u2 = u3 = w0 = w1 = w2 = w3 = 0.0
            for i in range(P + 1):
                node = e * P + i
                w, x, y, z = g[node, 0], g[node, 1], g[node, 2], g[node, 3]
                value = 0.5 * rod.value[k, i]
                a, b, c = t.spin[node, 0], t.spin[node, 1], t.spin[node, 2]
                d0 -= value * (x * a + y * b + z * c)
                d1 += value * (w * a + y * c - z * b)
                d2 += value * (w * b + z * a - x * c)
                d3 += value * (w * c + x * b - y * a)
                if second:
                    a, b, c = t.turning[node, 0], t.turning[node, 1], t.turning[node, 2]
                    u0 -= value * (x * a + y * b + z * c)
                    u1 += value * (w * a + y * c - z * b)
                    u2 += value * (w * b + z * a - x * c)
                    u3 += value * (w * c + x * b - y * a)
                    square = 0.5 * value * (a * a + b * b + c * c)
                    w0 -= square * w
                    w1 -= square * x
                    w2 -= square * y
                    w3 -= square * z
            q0, q1, q2, q3 = s.q[0], s.q[1], s.q[2], s.q[3]
            inverse = 1.0 / (q0 * q0 + q1 * q1 + q2 * q2 + q3 * q3)
            tx, ty, tz = s.tangent[0], s.tangent[1], s.tangent[2]
            # derivative of t along d
            along = 2.0 * inverse * (q0 * d0 + q1 * d1 + q2 * d2 + q3 * d3)
            rx = 2.0 * inverse * (q0 * d0 + q1 * d1 - q2 * d2 - q3 * d3) - along * tx
            ry = 2.0 * inverse * (q1 * d2 + d1 * q2 + q0 * d3 + d0 * q3) - along * ty
            rz = 2.0 * inverse * (q1 * d3 + d1 * q3 - q0 * d2 - d0 * q2) - along * tz
            hx = hy = hz = longer = 0.0
            if second:
                # t along u, and twice: t = U / S with U = q i q*, S = |q|^2
                along = 2.0 * inverse * (q0 * u0 + q1 * u1 + q2 * u2 + q3 * u3)
                fx = 2.0 * inverse * (q0 * u0 + q1 * u1 - q2 * u2 - q3 * u3) - along * tx
                fy = 2.0 * inverse * (q1 * u2 + u1 * q2 + q0 * u3 + u0 * q3) - along * ty
                fz = 2.0 * inverse * (q1 * u3 + u1 * q3 - q0 * u2 - u0 * q2) - along * tz
                curved = 2.0 * inverse * (u0 * u0 + u1 * u1 + u2 * u2 + u3 * u3)
                curved += 2.0 * inverse * (q0 * w0 + q1 * w1 + q2 * w2 + q3 * w3)
                hx = 2.0 * inverse * (u0 * u0 + u1 * u1 - u2 * u2 - u3 * u3)
                hx += 2.0 * inverse * (q0 * w0 + q1 * w1 - q2 * w2 - q3 * w3)
                hy = 4.0 * inverse * (u1 * u2 + u0 * u3)
                hy += 2.0 * inverse * (q1 * w2 + w1 * q2 + q0 * w3 + w0 * q3)
                hz = 4.0 * inverse * (u1 * u3 - u0 * u2)
                hz += 2.0 * inverse * (q1 * w3 + w1 * q3 - q0 * w2 - w0 * q2)
                hx -= curved * tx + 2.0 * along * fx
                hy -= curved * ty + 2.0 * along * fy
                hz -= curved * tz + 2.0 * along * fz
                for i in range(P + 1):
                    node, slope = e * P + i, rod.slope[e, k, i]
                    longer += slope * (m.v[node, 0] * tx + m.v[node, 1] * ty + m.v[node, 2] * tz)
                hx = stretch * hx + 2.0 * longer * fx
                hy = stretch * hy + 2.0 * longer * fy
                hz = stretch * hz + 2.0 * longer * fz
            held = 0.0
            if axial > 0.0:
                # the axial force of the stretched rod takes no impulse, and does not jump
                for c in range(3):
                    change = t.n[e, k, c] - (m.n[e, k, c] if second else 0.0)
                    held += weight * axial * change * s.tangent[c]
            s.fn[e, k, 0] = -weight * (stretch * rx + hx) - held * tx
            s.fn[e, k, 1] = -weight * (stretch * ry + hy) - held * ty
            s.fn[e, k, 2] = -weight * (stretch * rz + hz) - held * tz
            for i in range(P + 1):
                node, coupling = e * P + i, rod.coupling[e, k, i]
                for c in range(3):
                    s.fn[e, k, c] += coupling * rates[node, c]
                    if not second:
                        s.fr[node, c] += coupling * t.n[e, k, c]
            if not second:
                # -T^T of the impulse: the derivative of -n.t in q, as in `_bend`
                n0, n1, n2 = t.n[e, k, 0], t.n[e, k, 1], t.n[e, k, 2]
                v0 = -(n0 * q1 + n1 * q2 + n2 * q3)
                v1 = n0 * q0 + n1 * q3 - n2 * q2
                v2 = n1 * q0 + n2 * q1 - n0 * q3
                v3 = n2 * q0 + n0 * q2 - n1 * q1
                pull = n0 * tx + n1 * ty + n2 * tz
                factor = 2.0 * inverse * weight * stretch
                s.gq[0] = factor * (pull * q0 - v1)
                s.gq[1] = factor * (pull * q1 + v0)
                s.gq[2] = factor * (pull * q2 + v3)
                s.gq[3] = factor * (pull * q3 - v2)
                for i in range(P + 1):
                    node = e * P + i
                    for c in range(4):
                        s.p[c] = rod.value[k, i] * s.gq[c]
                    for c in range(3):
                        s.fp[node, c] += _body(g, node, s.p, c)


@njit(**_options)
def _project(rod: Rod, s: Solver, m: Motion, t: Scratch, spin: float, ramp: Ramp) -> float:
    """Put v, a and n onto the hidden constraints; return the impulse on the clamp (a moment).

    r' = t (1 + c n.t), derived once: the velocity nearest to m.v in the kinetic energy, with the
    clamp at `spin`; derived twice: the accelerations and forces that go with it.  What stretch
    leaves free stays as it is.  Bending has no inertia: a small one is lent to the tangent, and
    refinement of the solution takes it back.
    """
    nodes = m.g.shape[0]
    elements = rod.weights.shape[0]
    m.clock[SIGMA] = 0.0
    for e in range(elements):
        fill_element(rod, s, e, m.g, m.n, 1.0, True)
    factorise(s)
    impulse = 0.0
    for second in (False, True):
        for i in range(nodes):
            for c in range(3):
                if second:
                    t.turning[i, c] = t.spin[i, c]
                t.spin[i, c] = 0.0
            for c in range(4):
                if not second:
                    t.v[i, c] = m.v[i, c]
        for e in range(elements):
            for k in range(P):
                for c in range(3):
                    t.n[e, k, c] = m.n[e, k, c] if second else 0.0
        for i in range(nodes):
            t.spin[i, 0] = m.a[i, 3] if second else m.v[i, 3]
        if not second:
            t.spin[0, 1] = spin
        for _ in range(12):
            _impulse_residual(rod, s, m, t, m.v, second, ramp)
            if not second:
                impulse = s.fp[0, 1]
            solve(rod, s, 1.0)
            size = change = 0.0
            for i in range(1, nodes - 1):
                for c in range(3):
                    t.spin[i, c] += s.fp[i, c]
                    change = max(change, abs(s.fp[i, c]))
                    size = max(size, abs(t.spin[i, c]))
                    if second:
                        m.a[i, c] += s.fr[i, c]
                    else:
                        t.v[i, c] += s.fr[i, c]
            for e in range(elements):
                for k in range(P):
                    for c in range(3):
                        t.n[e, k, c] += s.fn[e, k, c]
            if change <= 1e-11 * size:
                break
        for i in range(1, nodes - 1):
            if second:
                m.a[i, 3] = t.spin[i, 0]
            else:
                t.v[i, 3] = t.spin[i, 0]
                for c in range(4):
                    m.v[i, c] = t.v[i, c]
        if second:
            for e in range(elements):
                for k in range(P):
                    for c in range(3):
                        m.n[e, k, c] = t.n[e, k, c]
    tangents(m.g, m.tangent)
    for i in range(nodes):
        w, x, y, z = m.g[i, 0], m.g[i, 1], m.g[i, 2], m.g[i, 3]
        # t' = w3 m2' - w2 m3', the second and third axis of the body
        b, c = t.turning[i, 2], -t.turning[i, 1]
        m.turning[i, 0] = 2.0 * (x * y - w * z) * b + 2.0 * (x * z + w * y) * c
        m.turning[i, 1] = (w * w - x * x + y * y - z * z) * b + 2.0 * (y * z - w * x) * c
        m.turning[i, 2] = 2.0 * (y * z + w * x) * b + (w * w - x * x - y * y + z * z) * c
    return impulse


@njit(**_options)
def _kinetic(rod: Rod, v: Array) -> float:
    total = 0.0
    for i in range(1, v.shape[0] - 1):
        for c in range(4):
            total += rod.inertia[i, c] * v[i, c] * v[i, c]
    return 0.5 * total


@njit(**_options)
def _remember(t: Scratch, clock: Array, time: float, g: Array, n: Array, a: Array) -> None:
    """Keep a solved stage for guesses."""
    slot = int(clock[POINTS]) % MEMORY
    clock[POINTS] += 1.0
    t.known_time[slot] = time
    t.known_g[slot] = g
    t.known_n[slot] = n
    t.known_a[slot] = a


@njit(**_options)
def _guess(t: Scratch, clock: Array, time: float) -> None:
    """Guesses of g, n and a at a time, from the polynomial through the last stages known."""
    known = int(clock[POINTS])
    count = min(GUESS, known)
    for j in range(count):
        weight = 1.0
        tj = t.known_time[(known - 1 - j) % MEMORY]
        for i in range(count):
            if i != j:
                ti = t.known_time[(known - 1 - i) % MEMORY]
                weight *= (time - ti) / (tj - ti)
        t.lagrange[j] = weight
    nodes = t.g.shape[0]
    for i in range(1, nodes - 1):
        for c in range(4):
            g = a = 0.0
            for j in range(count):
                slot = (known - 1 - j) % MEMORY
                g += t.lagrange[j] * t.known_g[slot, i, c]
                a += t.lagrange[j] * t.known_a[slot, i, c]
            t.g[i, c] = g
            t.a[i, c] = a
        w, x, y, z = t.g[i, 0], t.g[i, 1], t.g[i, 2], t.g[i, 3]
        scale = 1.0 / np.sqrt(w * w + x * x + y * y + z * z)
        for c in range(4):
            t.g[i, c] *= scale
    for e in range(t.n.shape[0]):
        for k in range(P):
            for c in range(3):
                n = 0.0
                for j in range(count):
                    n += t.lagrange[j] * t.known_n[(known - 1 - j) % MEMORY, e, k, c]
                t.n[e, k, c] = n


@njit(**_options)
def _next_step(ramp: Ramp, clock: Array, rest: float, nominal: float) -> float:
    """The next step: never past the end of the phase, and no sliver of a step left before it."""
    h = clock[STEP]
    if ramp.fixed > 0.0:
        h = min(h, nominal)
        return rest if rest <= h * (1.0 + 1e-6) else h
    if clock[PHASE] == 0.0:
        # of a turn alone: after a tiny one a long hold would never end
        h = min(h, ramp.largest)
    if rest <= 1.001 * h:
        return rest
    return 0.5 * rest if rest < 2.0 * h else h


@njit(**_options)
def _stage(m: Scheme, y: Motion, t: Scratch, i: int, h: float) -> tuple[float, float, float]:
    """Put what a stage knows in t.xp, t.vp, t.tp; return b, f and ft of x = xp + b a, and so on."""
    nodes = y.x.shape[0]
    if m.kind == ONE_STAGE:
        share = (1.0 - m.alpha_f) / (1.0 - m.alpha_m)
        for node in range(1, nodes - 1):
            for c in range(4):
                known = (m.alpha_f * y.a[node, c] - m.alpha_m * y.auxiliary[node, c]) / (1.0 - m.alpha_m)
                t.xp[node, c] = (
                    y.x[node, c] + h * y.v[node, c] + h * h * (m.r0 * y.auxiliary[node, c] + m.r1 * known)
                )
                t.vp[node, c] = y.v[node, c] + h * (m.v0 * y.auxiliary[node, c] + m.v1 * known)
            for c in range(3):
                t.tp[node, c] = y.tangent[node, c] + 0.5 * h * y.turning[node, c]
        return m.r1 * h * h * share, m.v1 * h * share, 0.5 * h
    diagonal = h * m.a[i, i]
    for node in range(1, nodes - 1):
        for c in range(4):
            v, x = y.v[node, c], y.x[node, c]
            for j in range(i):
                v += h * m.a[i, j] * t.stage_a[j, node, c]
                x += h * m.a[i, j] * t.stage_v[j, node, c]
            t.vp[node, c] = v
            t.xp[node, c] = x + diagonal * v
        for c in range(3):
            tangent = y.tangent[node, c]
            for j in range(i):
                tangent += h * m.a[i, j] * t.stage_turning[j, node, c]
            t.tp[node, c] = tangent
    return diagonal * diagonal, diagonal, diagonal


@njit(**_options)
def _error(m: Scheme, y: Motion, t: Scratch, h: float) -> float:
    """Estimated local error of the positions."""
    largest = 0.0
    share = (1.0 - m.alpha_f) / (1.0 - m.alpha_m)
    for node in range(1, y.x.shape[0] - 1):
        for c in range(3):
            change = 0.0
            if m.kind == ONE_STAGE:
                known = (m.alpha_f * y.a[node, c] - m.alpha_m * y.auxiliary[node, c]) / (1.0 - m.alpha_m)
                new = share * t.a[node, c] + known
                change = h * h * (m.error0 * y.auxiliary[node, c] + m.error1 * new)
            else:
                for j in range(m.stages):
                    change += m.error[j] * t.stage_v[j, node, c]
                change *= h
            largest = max(largest, abs(change))
    return largest


@njit(**_options)
def _accept(m: Scheme, y: Motion, t: Scratch) -> None:
    """Take over the last stage; theta starts anew."""
    share = (1.0 - m.alpha_f) / (1.0 - m.alpha_m)
    for node in range(1, y.x.shape[0] - 1):
        for c in range(4):
            if m.kind == ONE_STAGE:
                known = (m.alpha_f * y.a[node, c] - m.alpha_m * y.auxiliary[node, c]) / (1.0 - m.alpha_m)
                y.auxiliary[node, c] = share * t.a[node, c] + known
            y.x[node, c] = t.x[node, c]
            y.v[node, c] = t.v[node, c]
            y.a[node, c] = t.a[node, c]
        y.x[node, 3] = 0.0
        for c in range(3):
            y.turning[node, c] = t.turning[node, c]
    y.g[:] = t.g
    y.n[:] = t.n
    tangents(y.g, y.tangent)


@njit(**_options)
def _record(rod: Rod, s: Solver, y: Motion, angle: float, rows: Array, row_x: Array, row_m1: Array) -> float:
    """Write the next row, configurations if there is room for them; return the elastic energy."""
    clock, row = y.clock, int(y.clock[ROWS])
    for i in range(y.g.shape[0]):
        for c in range(3):
            s.fr[i, c] = s.fp[i, c] = 0.0
    elastic = load = 0.0
    for e in range(rod.weights.shape[0]):
        elastic += add_element(rod, s, e, y.x, y.g, y.n)
        for k in range(P):
            load -= rod.weights[e, k] * y.n[e, k, 0]
    rows[row, 0] = clock[TIME]
    rows[row, 1] = angle
    rows[row, 2] = y.x[rod.middle, 2]
    rows[row, 3] = y.tangent[rod.middle, 2]
    rows[row, 4] = _kinetic(rod, y.v)
    rows[row, 5] = elastic
    rows[row, 6] = clock[DISSIPATED]
    rows[row, 7] = clock[WORK]
    rows[row, 8] = load
    if row < row_x.shape[0]:
        for i in range(y.g.shape[0]):
            w, x, z, u = y.g[i, 0], y.g[i, 1], y.g[i, 2], y.g[i, 3]
            for c in range(3):
                row_x[row, i, c] = y.x[i, c]
            row_m1[row, i, 0] = 2.0 * (x * u + w * z)
            row_m1[row, i, 1] = 2.0 * (z * u - w * x)
            row_m1[row, i, 2] = w * w - x * x - z * z + u * u
    clock[ROWS] += 1.0
    return elastic


@njit(**_options)
def run(
    rod: Rod,
    m: Scheme,
    ramp: Ramp,
    s: Solver,
    t: Scratch,
    y: Motion,
    rows: Array,
    row_x: Array,
    row_m1: Array,
) -> int:
    """Step until the end, until the rows are full (call again with fresh ones), or no step converges."""
    clock, nu = y.clock, ramp.damping
    nodes = y.x.shape[0]
    last = m.stages - 1
    while True:
        phase = int(clock[PHASE])
        start = 0.0 if phase == 0 else ramp.turned
        end = ramp.turned if phase == 0 else ramp.end
        spin = ramp.rate if phase == 0 else 0.0
        if int(clock[ROWS]) >= rows.shape[0]:
            return FULL
        if clock[KINK] > 0.0:
            # the clamp's velocity jumps: velocities and forces that fit the new one
            if clock[STEPS] == 0.0:
                tangents(y.g, y.tangent)
                _record(rod, s, y, 0.0 if phase == 0 else ramp.stop, rows, row_x, row_m1)
                clock[SIDE] = rows[0, 2] if abs(rows[0, 2]) > DEPARTED else 0.0
            before = 0.0 if phase == 0 else ramp.rate
            impulse = _project(rod, s, y, t, spin, ramp)
            clock[WORK] += 0.5 * (before + spin) * impulse
            y.auxiliary[:] = y.a
            kinetic = _kinetic(rod, y.v)
            clock[POWER] = 2.0 * nu * kinetic
            clock[MOMENT] = clamp_moment(rod, s, y.x, y.g, y.n)
            if clock[STEPS] == 0.0:
                clock[LOWEST] = clock[PEAK] = kinetic + rows[0, 5] - clock[WORK]
            clock[KINK] = 0.0
            clock[STEP] = ramp.fixed if ramp.fixed > 0.0 else min(1e-3, 1e-2 * (end - start))
            clock[LAST] = 0.0
            clock[POINTS] = 0.0
            _remember(t, clock, clock[TIME], y.g, y.n, y.a)
            t.x[:] = y.x
            t.g[:] = y.g
            t.v[:] = 0.0
            t.a[:] = 0.0
            t.turning[:] = 0.0
            continue
        nominal = 0.0
        if ramp.fixed > 0.0:
            # at least one step, of however long a one is asked for
            nominal = (end - start) / max(1.0, np.ceil((end - start) / ramp.fixed - 1e-9))
        time = clock[TIME]
        rest = end - time
        h = _next_step(ramp, clock, rest, nominal)
        landed = h == rest
        target = end if landed else time + h
        angle0 = ramp.rate * time if phase == 0 else ramp.stop
        angle = ramp.stop if (phase == 1 or landed) else ramp.rate * target
        if m.kind == ONE_STAGE:
            if clock[LAST] > 0.0 and h != clock[LAST]:
                # the auxiliary acceleration is that of an instant in proportion to the step
                for i in range(nodes):
                    for c in range(4):
                        y.auxiliary[i, c] = y.a[i, c] + (y.auxiliary[i, c] - y.a[i, c]) * (h / clock[LAST])
            clock[LAST] = h
        else:
            t.stage_v[0] = y.v
            t.stage_a[0] = y.a
            t.stage_turning[0] = y.turning
        known = clock[POINTS]
        iterations = 0
        work = lost = 0.0
        if m.kind == DIRK:
            work, lost = m.a[last, 0] * clock[MOMENT], m.a[last, 0] * clock[POWER]
        for i in range(1, m.stages):
            at = target if i == last else time + m.c[i] * h
            b, f, ft = _stage(m, y, t, i, h)
            _guess(t, clock, at)
            _set_clamp(t.g, angle if i == last else angle0 + spin * (m.c[i] * h))
            used = _newton(rod, s, t, y.g, b, f, ft, ramp, clock)
            if used < 0:
                iterations = used - iterations
                break
            iterations += used
            _remember(t, clock, at, t.g, t.n, t.a)
            if m.kind == DIRK:
                t.stage_v[i] = t.v
                t.stage_a[i] = t.a
                t.stage_turning[i] = t.turning
                if i < last:
                    work += m.a[last, i] * clamp_moment(rod, s, t.x, t.g, t.n)
                    lost += m.a[last, i] * 2.0 * nu * _kinetic(rod, t.v)
        clock[NEWTON] += abs(iterations)
        if iterations < 0:
            clock[POINTS] = known
            clock[REJECTED] += 1.0
            clock[STEP] = 0.5 * h
            if clock[STEP] < ramp.smallest:
                return STUCK
            continue
        factor = 2.0
        if ramp.fixed == 0.0:
            error = _error(m, y, t, h)
            # Errors made while the ribbon creeps towards a fold add up and shift the snap; those
            # made while it rings do not.  The error allowed shrinks with the speed.
            speed = 0.0
            for i in range(1, nodes - 1):
                for c in range(3):
                    speed = max(speed, abs(t.v[i, c]))
            error /= min(1.0, max(LEAST, CREEP * speed))
            factor = min(2.0, 0.8 * (ramp.tolerance / max(error, 1e-300)) ** (1.0 / m.power))
            if not error <= ramp.tolerance:
                clock[POINTS] = known
                clock[REJECTED] += 1.0
                clock[STEP] = h * max(0.2, factor)
                if clock[STEP] < ramp.smallest:
                    return STUCK
                continue
            factor = max(0.2, factor)
            if 1.0 < factor < LEAST_GROWTH:
                factor = 1.0
        _accept(m, y, t)
        if m.project:
            _project(rod, s, y, t, spin, ramp)
            y.auxiliary[:] = y.a
            _set_clamp(t.g, angle)
        kinetic = _kinetic(rod, y.v)
        moment, power = clamp_moment(rod, s, y.x, y.g, y.n), 2.0 * nu * kinetic
        if m.kind == DIRK:
            clock[WORK] += (angle - angle0) * (work + m.a[last, last] * moment)
            clock[DISSIPATED] += h * (lost + m.a[last, last] * power)
        else:
            clock[WORK] += 0.5 * (angle - angle0) * (clock[MOMENT] + moment)
            clock[DISSIPATED] += 0.5 * h * (clock[POWER] + power)
        clock[MOMENT], clock[POWER] = moment, power
        # what rounding leaves of the sum of many equal steps is carried on: they are to land on the end
        clock[TIME] = target if landed else time + (h + clock[CARRY])
        clock[CARRY] = 0.0 if landed else (h + clock[CARRY]) - (clock[TIME] - time)
        clock[STEPS] += 1.0
        clock[SINCE] += 1.0
        if not landed or ramp.fixed > 0.0:
            clock[STEP] = h * factor
        else:
            clock[STEP] = max(clock[STEP], h * factor)
        done = landed and (phase == 1 or ramp.end <= ramp.turned)
        if done or clock[SINCE] >= ramp.every:
            clock[SINCE] = 0.0
            row = int(clock[ROWS])
            total = kinetic + _record(rod, s, y, angle, rows, row_x, row_m1)
            excess = total + clock[DISSIPATED] - clock[WORK]
            clock[LOWEST] = min(clock[LOWEST], excess)
            clock[PEAK] = max(clock[PEAK], total)
            if excess - clock[LOWEST] > GROWTH * clock[PEAK]:
                return GREW
            if phase == 1 and total < ramp.barrier:
                return DONE
            if clock[SIDE] == 0.0 and abs(rows[row, 2]) > DEPARTED:
                clock[SIDE] = rows[row, 2]
            crossed = clock[SIDE] != 0.0 and rows[row, 2] * clock[SIDE] <= 0.0
            if ramp.snap and (clock[AFTER] > 0.0 or crossed):
                clock[AFTER] += 1.0
                # the crossing is interpolated from two rows on each side
                if clock[AFTER] > 2.0:
                    return DONE
        if done:
            return DONE
        if landed:
            clock[PHASE] = 1.0
            clock[KINK] = 1.0
