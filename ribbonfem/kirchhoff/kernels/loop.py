"""The compiled time loop of the Kirchhoff rod: stages, control of steps, rows.

A diagonally implicit method is a tableau (`ribbonfem.tableaus`), a Newmark-like one its coefficients
(`newmark.Method`): stages of both are solved in one place.  All state is in `Motion` and its
clock, so that a run that comes back for more rows is bitwise the uninterrupted one.
"""

from __future__ import annotations

import numpy as np

from ribbonfem.compiled.decorator import compiled
from ribbonfem.results import Array
from ribbonfem.stepping.kernels.arrays import DIRK, MOST_BESIDES, MOST_TIMES, ONE_STAGE, Scheme

from .arrays import (
    AFTER,
    CARRY,
    CREPT,
    DISSIPATED,
    DONE,
    EXCESS,
    FULL,
    GREW,
    KINK,
    LAST,
    LOWEST,
    MOMENT,
    NEWTON,
    PEAK,
    PHASE,
    POINTS,
    POWER,
    REJECTED,
    ROWS,
    SIDE,
    SINCE,
    STEP,
    STEPS,
    STUCK,
    TIME,
    WORK,
    Motion,
    Ramp,
    Scratch,
)
from .consistent import project, tangents
from .newton import guess, newton, remember
from .tangent import OPTIONS, P, Rod, Solver, add_element, clamp_moment

# part of the largest energy so far by which energy may grow without work: more is an unstable method
GROWTH = 0.25
# a height counts as on one side of zero once it has been this far from it, L: rounding has no side
DEPARTED = 1e-6
# part of it that an adaptive step may gain: a method that damps little may pump what it does not resolve
GAIN = 1e-3
# t*; a shorter step is taken whatever it gains
SHORT = 1e-6
# a step grows by this factor at least, or stays: a new one costs new factors
LEAST_GROWTH = 1.4
# lengths per t* below which the error allowed in a step shrinks with the speed, over 1, and by how much
CREEP, LEAST = 0.1, 0.01


@compiled(**OPTIONS)
def _set_clamp(g: Array, angle: float) -> None:
    g[0, 0], g[0, 1], g[0, 2], g[0, 3] = np.cos(0.5 * angle), 0.0, np.sin(0.5 * angle), 0.0


@compiled(**OPTIONS)
def _kinetic(rod: Rod, v: Array) -> float:
    total = 0.0
    for i in range(1, v.shape[0] - 1):
        for c in range(4):
            total += rod.inertia[i, c] * v[i, c] * v[i, c]
    return 0.5 * total


@compiled(**OPTIONS)
def _elastic(rod: Rod, s: Solver, x: Array, g: Array, n: Array) -> float:
    """Elastic energy; overwrites residuals."""
    for i in range(g.shape[0]):
        for c in range(3):
            s.fr[i, c] = s.fp[i, c] = 0.0
    total = 0.0
    for e in range(rod.weights.shape[0]):
        total += add_element(rod, s, e, x, g, n)
    return total


@compiled(**OPTIONS)
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


@compiled(**OPTIONS)
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


@compiled(**OPTIONS)
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


@compiled(**OPTIONS)
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


@compiled(**OPTIONS)
def _record(rod: Rod, s: Solver, y: Motion, angle: float, rows: Array, row_x: Array, row_m1: Array) -> float:
    """Write the next row, configurations if there is room for them; return the elastic energy."""
    clock, row = y.clock, int(y.clock[ROWS])
    elastic, load = _elastic(rod, s, y.x, y.g, y.n), 0.0
    for e in range(rod.weights.shape[0]):
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


@compiled(**OPTIONS)
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
            impulse = project(rod, s, y, t, spin, ramp)
            clock[WORK] += 0.5 * (before + spin) * impulse
            y.auxiliary[:] = y.a
            kinetic = _kinetic(rod, y.v)
            clock[EXCESS] = kinetic + _elastic(rod, s, y.x, y.g, y.n) + clock[DISSIPATED] - clock[WORK]
            clock[POWER] = 2.0 * nu * kinetic
            clock[MOMENT] = clamp_moment(rod, s, y.x, y.g, y.n)
            if clock[STEPS] == 0.0:
                clock[LOWEST] = clock[PEAK] = kinetic + rows[0, 5] - clock[WORK]
            clock[KINK] = 0.0
            clock[STEP] = ramp.fixed if ramp.fixed > 0.0 else min(1e-3, 1e-2 * (end - start))
            clock[LAST] = 0.0
            clock[POINTS] = 0.0
            remember(t, clock, clock[TIME], y.g, y.n, y.a)
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
            if clock[STEPS] > MOST_TIMES * (ramp.end / ramp.fixed) + MOST_BESIDES:
                return CREPT
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
            guess(t, clock, at)
            _set_clamp(t.g, angle if i == last else angle0 + spin * (m.c[i] * h))
            used = newton(rod, s, t, y.g, b, f, ft, ramp, clock)
            if used < 0:
                iterations = used - iterations
                break
            iterations += used
            remember(t, clock, at, t.g, t.n, t.a)
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
        if m.kind == DIRK:
            kinetic = _kinetic(rod, t.v)
            lost = h * (lost + m.a[last, last] * 2.0 * nu * kinetic)
            work = (angle - angle0) * (work + m.a[last, last] * clamp_moment(rod, s, t.x, t.g, t.n))
            excess = kinetic + _elastic(rod, s, t.x, t.g, t.n) + clock[DISSIPATED] + lost - clock[WORK] - work
            if ramp.fixed == 0.0 and h > SHORT and excess - clock[EXCESS] > GAIN * clock[PEAK]:
                clock[POINTS] = known
                clock[REJECTED] += 1.0
                clock[STEP] = 0.5 * h
                continue
            clock[EXCESS] = excess
        _accept(m, y, t)
        if m.project:
            project(rod, s, y, t, spin, ramp)
            y.auxiliary[:] = y.a
            _set_clamp(t.g, angle)
        kinetic = _kinetic(rod, y.v)
        moment, power = clamp_moment(rod, s, y.x, y.g, y.n), 2.0 * nu * kinetic
        if m.kind == DIRK:
            clock[WORK] += work
            clock[DISSIPATED] += lost
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
