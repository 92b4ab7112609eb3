"""The time loop of both planar beams: stages, control of steps, rows."""

from __future__ import annotations

import numpy as np

from ribbonfem.compiled.decorator import compiled
from ribbonfem.results import Array

from .arrays import (
    AFTER,
    CARRY,
    CREPT,
    DIRK,
    DISSIPATED,
    DONE,
    FULL,
    GREW,
    GROWTH,
    KINK,
    LAST,
    LOWEST,
    MOMENT,
    MOST_BESIDES,
    MOST_TIMES,
    NEWTON,
    ONE_STAGE,
    PEAK,
    PHASE,
    POWER,
    QUASILINEAR,
    REJECTED,
    ROWS,
    SIDE,
    STEP,
    STEPS,
    STUCK,
    TIME,
    WORK,
    Ramp,
    Scheme,
    Scratch,
    Tables,
)
from .elastica import measure_elastica, newton_elastica, project_elastica
from .quasilinear import measure_quasilinear, newton_quasilinear, project_quasilinear


@compiled(error_model="numpy")
def _solve(
    t: Tables, s: Scratch, b: float, g: float, angle: float, spin: float, nu: float, tolerance: float
) -> int:
    """Solve a stage from the predictors s.qp, s.vp and the guesses s.a, s.w, into s.q, s.v, s.a, s.w."""
    if t.kind == QUASILINEAR:
        s.a[1] = 0.0
        s.qp[1] = t.clamp * angle
        s.vp[1] = t.clamp * spin
    else:
        s.w[0] = t.clamp * angle
    for i in range(s.q.shape[0]):
        s.q[i] = s.qp[i] + b * s.a[i]
        s.v[i] = s.vp[i] + g * s.a[i]
    if t.kind == QUASILINEAR:
        return newton_quasilinear(t, s, s.q, s.v, s.a, s.w, b, g, nu, tolerance)
    return newton_elastica(t, s, s.q, s.v, s.a, s.w, b, g, nu, tolerance)


@compiled(error_model="numpy")
def _project(t: Tables, s: Scratch, q: Array, v: Array, a: Array, w: Array, spin: float, nu: float) -> float:
    if t.kind == QUASILINEAR:
        return project_quasilinear(t, s, q, v, a, w, t.clamp * spin, nu)
    return project_elastica(t, s, q, v, a, w, t.clamp * spin, nu)


@compiled(error_model="numpy")
def _measure(t: Tables, s: Scratch, q: Array, v: Array, a: Array, w: Array, nu: float, out: Array) -> None:
    if t.kind == QUASILINEAR:
        measure_quasilinear(t, s, q, v, a, w, nu, out)
    else:
        measure_elastica(t, v, w, out)


@compiled(error_model="numpy")
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


@compiled(error_model="numpy")
def run(
    t: Tables,
    m: Scheme,
    ramp: Ramp,
    s: Scratch,
    clock: Array,
    q: Array,
    v: Array,
    a: Array,
    auxiliary: Array,
    w: Array,
    dw: Array,
    rows: Array,
    row_q: Array,
    row_w: Array,
) -> int:
    """Step until the end, until the rows are full (call again with more), or until no step converges.

    State is in `clock` and the arrays from q to dw (the last the rate of w), in and out, so
    that a resumed run is bitwise the uninterrupted one.
    """
    nu = ramp.damping
    out = np.empty(4)
    last = m.stages - 1
    share = (1.0 - m.alpha_f) / (1.0 - m.alpha_m)
    while True:
        phase = int(clock[PHASE])
        start = 0.0 if phase == 0 else ramp.turned
        end = ramp.turned if phase == 0 else ramp.end
        spin = ramp.rate if phase == 0 else 0.0
        if int(clock[ROWS]) >= rows.shape[0]:
            return FULL
        if clock[KINK] > 0.0:
            # the clamp's velocity jumps: velocities and forces that fit the new one
            before = 0.0 if phase == 0 else ramp.rate
            impulse = _project(t, s, q, v, a, w, spin, nu)
            clock[WORK] += 0.5 * (before + spin) * t.clamp * impulse
            for i in range(q.shape[0]):
                auxiliary[i] = a[i]
            for i in range(w.shape[0]):
                dw[i] = 0.0
            _measure(t, s, q, v, a, w, nu, out)
            clock[POWER] = 2.0 * nu * out[0]
            clock[MOMENT] = out[2]
            if clock[STEPS] == 0.0:
                _record(t, ramp, clock, 0.0 if phase == 0 else ramp.stop, q, w, out, rows, row_q, row_w)
                clock[LOWEST] = clock[PEAK] = out[0] + out[1] - clock[WORK]
                if phase == 0:
                    rows[0, 3] = 0.0  # the row is of the instant before the jump
            clock[KINK] = 0.0
            clock[STEP] = ramp.fixed if ramp.fixed > 0.0 else min(1e-3, 1e-2 * (end - start))
            clock[LAST] = 0.0
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
                for i in range(q.shape[0]):
                    auxiliary[i] = a[i] + (auxiliary[i] - a[i]) * (h / clock[LAST])
            clock[LAST] = h
        else:
            for i in range(q.shape[0]):
                s.stage_v[0, i] = v[i]
                s.stage_a[0, i] = a[i]
        work, lost = m.a[last, 0] * clock[MOMENT], m.a[last, 0] * clock[POWER]
        # one place where stages are solved: the compiler copies the whole solver to each
        iterations = 0
        for stage in range(1, m.stages):
            reached = angle if stage == last else angle0 + spin * m.c[stage] * h
            if m.kind == ONE_STAGE:
                b, g = m.r1 * h * h * share, m.v1 * h * share
                for i in range(q.shape[0]):
                    known = (m.alpha_f * a[i] - m.alpha_m * auxiliary[i]) / (1.0 - m.alpha_m)
                    s.qp[i] = q[i] + h * v[i] + h * h * (m.r0 * auxiliary[i] + m.r1 * known)
                    s.vp[i] = v[i] + h * (m.v0 * auxiliary[i] + m.v1 * known)
            else:
                g = m.a[stage, stage] * h
                b = g * g
                for i in range(q.shape[0]):
                    velocity, place = v[i], q[i]
                    for j in range(stage):
                        velocity += h * m.a[stage, j] * s.stage_a[j, i]
                        place += h * m.a[stage, j] * s.stage_v[j, i]
                    s.vp[i] = velocity
                    s.qp[i] = place + g * velocity
            # guesses: on the line through the last two instants known
            if stage == 1:
                for i in range(q.shape[0]):
                    s.a[i] = a[i]
                for i in range(w.shape[0]):
                    s.w[i] = w[i] + m.c[1] * h * dw[i]
            else:
                for i in range(w.shape[0]):
                    s.w[i] = w[i] + (s.w[i] - w[i]) * (m.c[stage] / m.c[stage - 1])
            used = _solve(t, s, b, g, reached, spin, nu, ramp.newton)
            if used < 0:
                iterations = used - iterations
                break
            iterations += used
            if m.kind == DIRK:
                for i in range(q.shape[0]):
                    s.stage_v[stage, i] = s.v[i]
                    s.stage_a[stage, i] = s.a[i]
                if stage < last:
                    _measure(t, s, s.q, s.v, s.a, s.w, nu, out)
                    work += m.a[last, stage] * out[2]
                    lost += m.a[last, stage] * 2.0 * nu * out[0]
        error = 0.0
        if iterations > 0:
            for i in range(q.shape[0]):
                if m.kind == ONE_STAGE:
                    known = (m.alpha_f * a[i] - m.alpha_m * auxiliary[i]) / (1.0 - m.alpha_m)
                    s.a2[i] = share * s.a[i] + known
                    change = h * h * (m.error0 * auxiliary[i] + m.error1 * s.a2[i])
                else:
                    change = 0.0
                    for j in range(m.stages):
                        change += m.error[j] * s.stage_v[j, i]
                    change *= h
                error = max(error, abs(change))
        clock[NEWTON] += abs(iterations)
        if iterations < 0:
            clock[REJECTED] += 1.0
            clock[STEP] = 0.5 * h
            if clock[STEP] < ramp.smallest:
                return STUCK
            continue
        factor = 2.0
        if ramp.fixed == 0.0:
            factor = min(2.0, 0.8 * (ramp.tolerance / max(error, 1e-300)) ** (1.0 / m.power))
            if error > ramp.tolerance:
                clock[REJECTED] += 1.0
                clock[STEP] = h * max(0.2, factor)
                if clock[STEP] < ramp.smallest:
                    return STUCK
                continue
            factor = max(0.2, factor)
        for i in range(q.shape[0]):
            if m.kind == ONE_STAGE:
                auxiliary[i] = s.a2[i]
            q[i] = s.q[i]
            v[i] = s.v[i]
            a[i] = s.a[i]
        for i in range(w.shape[0]):
            dw[i] = (s.w[i] - w[i]) / h
            w[i] = s.w[i]
        if m.project:
            _project(t, s, q, v, a, w, spin, nu)
            for i in range(q.shape[0]):
                auxiliary[i] = a[i]
        _measure(t, s, q, v, a, w, nu, out)
        power, moment = 2.0 * nu * out[0], out[2]
        turn = t.clamp * (angle - angle0)
        if m.kind == ONE_STAGE:
            clock[DISSIPATED] += 0.5 * h * (clock[POWER] + power)
            clock[WORK] += 0.5 * turn * (clock[MOMENT] + moment)
        else:
            clock[DISSIPATED] += h * (lost + m.a[last, last] * power)
            clock[WORK] += turn * (work + m.a[last, last] * moment)
        clock[POWER], clock[MOMENT] = power, moment
        # what rounding leaves of the sum of many equal steps is carried on: they are to land on the end
        clock[TIME] = target if landed else time + (h + clock[CARRY])
        clock[CARRY] = 0.0 if landed else (h + clock[CARRY]) - (clock[TIME] - time)
        clock[STEPS] += 1.0
        if not landed or ramp.fixed > 0.0:
            clock[STEP] = h * factor
        else:
            clock[STEP] = max(clock[STEP], h * factor)
        row = int(clock[ROWS])
        _record(t, ramp, clock, angle, q, w, out, rows, row_q, row_w)
        total = out[0] + out[1]
        excess = total + clock[DISSIPATED] - clock[WORK]
        clock[LOWEST] = min(clock[LOWEST], excess)
        clock[PEAK] = max(clock[PEAK], total)
        if excess - clock[LOWEST] > GROWTH * clock[PEAK]:
            return GREW
        if clock[SIDE] == 0.0 and abs(rows[row, 2]) > ramp.departed:
            clock[SIDE] = rows[row, 2]
        if ramp.snap and (clock[AFTER] > 0.0 or (rows[row, 2] * clock[SIDE] <= 0.0 and clock[SIDE] != 0.0)):
            clock[AFTER] += 1.0
            # the crossing is interpolated from two rows on each side
            if clock[AFTER] > 2.0:
                return DONE
        if landed:
            if phase == 1 or ramp.end <= ramp.turned:
                return DONE
            clock[PHASE] = 1.0
            clock[KINK] = 1.0


@compiled(error_model="numpy")
def _record(
    t: Tables,
    ramp: Ramp,
    clock: Array,
    angle: float,
    q: Array,
    w: Array,
    out: Array,
    rows: Array,
    row_q: Array,
    row_w: Array,
) -> None:
    row = int(clock[ROWS])
    height = 0.0
    for k in range(t.middle_dof.shape[0]):
        height += t.middle_weight[k] * q[t.middle_dof[k]]
    rows[row, 0] = clock[TIME]
    rows[row, 1] = angle
    rows[row, 2] = height
    rows[row, 3] = out[0]
    rows[row, 4] = out[1]
    rows[row, 5] = clock[DISSIPATED]
    rows[row, 6] = clock[WORK]
    rows[row, 7] = out[3]
    for i in range(q.shape[0]):
        row_q[row, i] = q[i]
    for i in range(w.shape[0]):
        row_w[row, i] = w[i]
    clock[ROWS] = row + 1.0
