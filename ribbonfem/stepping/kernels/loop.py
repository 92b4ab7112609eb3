"""The time loop common to all finite elements: steps, their control, kinks of the controls, output rows.

It knows a model by its `ModelFunctions` alone: a model makes its own loop of them
(`elastica.kernels.loop.run`, `kirchhoff.kernels.loop.run`).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ribbonfem.ends.kernels import LIFT, control_at
from ribbonfem.jit.decorator import compiled
from ribbonfem.results import Array

from .arrays import (
    AFTER,
    CARRY,
    CREPT,
    DIRK,
    DISSIPATED,
    DONE,
    EXCESS,
    FULL,
    GAINED,
    GREW,
    GROWTH,
    HEIGHT,
    KEPT,
    KINETIC,
    KINK,
    LAST,
    LOAD,
    LOSING,
    LOWEST,
    MEAN,
    MOST_BESIDES,
    MOST_TIMES,
    NEWTON,
    ONE_STAGE,
    PEAK,
    PHASE,
    POWER,
    REJECTED,
    ROWS,
    SHORT,
    SIDE,
    SINCE,
    SPUN,
    STEP,
    STEPS,
    STUCK,
    TIME,
    WORK,
    Measures,
    ModelFunctions,
    Ramp,
    Scheme,
)


@compiled()
def _next_step(ramp: Ramp, clock: Array, rest: float, nominal: float) -> float:
    """The next step: never past the end of the phase, and no sliver of a step left before it."""
    h = clock[STEP]
    if ramp.fixed > 0.0:
        h = min(h, nominal)
        return rest if rest <= h * (1.0 + 1e-6) else h
    # (of what moves alone: after a tiny turn a long hold would never end)
    h = min(h, ramp.ends.longest[int(clock[PHASE])])
    if rest <= 1.001 * h:
        return rest
    return 0.5 * rest if rest < 2.0 * h else h


@compiled()
def _shorter(ramp: Ramp, clock: Array, h: float) -> bool:
    """Ask for a shorter step than the one that failed; whether there is one."""
    clock[REJECTED] += 1.0
    clock[STEP] = h
    return h >= ramp.smallest


@compiled()
def _advance(ramp: Ramp, clock: Array, h: float, target: float, landed: bool, factor: float) -> None:
    # what rounding leaves of the sum of many equal steps is carried on: they are to land on the end
    time = clock[TIME]
    clock[TIME] = target if landed else time + (h + clock[CARRY])
    clock[CARRY] = 0.0 if landed else (h + clock[CARRY]) - (clock[TIME] - time)
    clock[STEPS] += 1.0
    clock[SINCE] += 1.0
    if not landed or ramp.fixed > 0.0:
        clock[STEP] = h * factor
    else:
        clock[STEP] = max(clock[STEP], h * factor)


@compiled()
def _write(clock: Array, rows: Array, row: int, control: float, measured: Measures) -> None:
    rows[row, 0] = clock[TIME]
    rows[row, 1] = control
    for c in range(3):
        rows[row, KINETIC + c] = measured[c]
    rows[row, KINETIC + 3] = clock[DISSIPATED]
    rows[row, KINETIC + 4] = clock[WORK]
    rows[row, LOAD] = measured[5]
    clock[ROWS] = row + 1.0


@compiled()
def _held(ramp: Ramp, clock: Array) -> bool:
    """Whether the controls stay as they are to the end."""
    last = ramp.ends.longest.shape[0] - 1
    return clock[PHASE] == last and ramp.ends.longest[last] == np.inf


@compiled()
def _scale(measured: Measures) -> float:
    """The energy that others are small or large against: wherever a potential is zero, above zero itself."""
    return measured[0] + measured[1] + abs(measured[2])


@compiled()
def _watch(ramp: Ramp, clock: Array, control: float, height: float, measured: Measures) -> int:
    """What a new row says: GREW, DONE, or FULL to go on."""
    total = measured[0] + measured[1] + measured[2]
    excess = total + clock[DISSIPATED] - clock[WORK]
    clock[LOWEST] = min(clock[LOWEST], excess)
    clock[PEAK] = max(clock[PEAK], _scale(measured))
    if excess - clock[LOWEST] > GROWTH * clock[PEAK]:
        return GREW
    if _held(ramp, clock) and total < ramp.barrier:
        return DONE
    # above the mean of both clamps
    ends = ramp.ends
    height -= 0.5 * (ends.fixed[LIFT] + ends.moved[LIFT] * control)
    if clock[TIME] < ramp.since:
        return FULL
    if clock[SIDE] == 0.0 and abs(height) > ramp.departed:
        clock[SIDE] = height
    if ramp.snap and (clock[AFTER] > 0.0 or (height * clock[SIDE] <= 0.0 and clock[SIDE] != 0.0)):
        clock[AFTER] += 1.0
        # a row behind it: for a cubic where velocities are not known, and behind a kink
        if clock[AFTER] > 1.0:
            return DONE
    return FULL


def loop_of(functions: ModelFunctions) -> Callable[..., int]:
    """The time loop of the models that have these functions, compiled."""
    project, rescale, begin, stage, flows, error_of, reject, accept, measure, record = functions

    def run(model, m: Scheme, ramp: Ramp, clock: Array, rows: Array) -> int:  # type: ignore[no-untyped-def]
        """Step until the end, until the rows are full (call again with more), or until no step converges.

        State is in `clock` and the model, in and out, so that a resumed run is bitwise the uninterrupted one.
        """
        nu, ends = ramp.damping, ramp.ends
        last, final = m.stages - 1, ramp.ends.longest.shape[0] - 1
        while True:
            phase = int(clock[PHASE])
            start, end = ends.kinks[phase], ends.kinks[phase + 1]
            if int(clock[ROWS]) >= rows.shape[0]:
                return FULL
            if clock[KINK] > 0.0:
                # what the controls do jumps: velocities and forces that fit the new one
                first = clock[STEPS] == 0.0
                reached, spin, _ = control_at(ends, phase, start)
                if first:
                    # the row is of the instant before the jump
                    measured = measure(model, nu, False)
                    rows[0, KEPT] = 1.0
                    record(model, nu, rows, 0)
                    _write(clock, rows, 0, reached, measured)
                    above = rows[0, HEIGHT] - 0.5 * (ends.fixed[LIFT] + ends.moved[LIFT] * reached)
                    counts = abs(above) > ramp.departed and clock[TIME] >= ramp.since
                    clock[SIDE] = above if counts else 0.0
                clock[WORK] += 0.5 * (clock[SPUN] + spin) * project(model, ramp, clock, True)
                measured = measure(model, nu, False)
                kinetic, elastic, potential, clock[LOSING], clock[POWER], _ = measured
                excess = kinetic + elastic + potential + clock[DISSIPATED] - clock[WORK]
                # (a run that is gone on from has the balance of the one before)
                known = not first or clock[EXCESS] != 0.0
                if m.kind == MEAN and known and abs(excess - clock[EXCESS]) < 0.5 * kinetic:
                    # velocities that ring do not all fit the new one: the rest has their energy
                    clock[GAINED] = excess - clock[EXCESS]
                else:
                    clock[EXCESS] = excess
                if first:
                    clock[LOWEST] = kinetic + elastic + potential + clock[DISSIPATED] - clock[WORK]
                    clock[PEAK] = _scale(measured) - clock[WORK]
                clock[KINK] = 0.0
                clock[STEP] = ramp.fixed if ramp.fixed > 0.0 else min(ramp.first, 1e-2 * (end - start))
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
            if m.kind != DIRK:
                if clock[LAST] > 0.0 and h != clock[LAST]:
                    # the auxiliary acceleration is that of an instant in proportion to the step
                    rescale(model, h / clock[LAST])
                clock[LAST] = h
            elif ramp.first < SHORT:
                clock[LAST] = -h if landed else 0.0
            begin(model, clock)
            work, lost = m.a[last, 0] * clock[POWER], m.a[last, 0] * clock[LOSING]
            # one place where stages are solved: the compiler copies the whole solver to each
            iterations = 0
            for i in range(1, m.stages):
                at = target if i == last else time + m.c[i] * h
                reached, spin, _ = control_at(ends, phase, at)
                used = stage(model, m, ramp, clock, i, h, at)
                if used < 0:
                    iterations = used - iterations
                    break
                iterations += used
                if m.kind == MEAN or (m.kind == DIRK and i < last):
                    losing, power = flows(model, nu, h)
                    work += m.a[last, i] * power
                    lost += m.a[last, i] * losing
            clock[NEWTON] += abs(iterations)
            if iterations < 0:
                reject(model, clock)
                if not _shorter(ramp, clock, 0.5 * h):
                    return STUCK
                continue
            factor = 2.0
            if ramp.fixed == 0.0:
                error = error_of(model, m, h)
                # a negative one says nothing of a longer step
                most = 2.0 if error >= 0.0 else 1.0
                error = abs(error)
                factor = min(most, 0.8 * (ramp.tolerance / max(error, 1e-300)) ** (1.0 / m.power))
                if not error <= ramp.tolerance:
                    reject(model, clock)
                    if not _shorter(ramp, clock, h * max(0.2, factor)):
                        return STUCK
                    continue
                factor = max(0.2, factor)
                if 1.0 < factor < ramp.least_growth:
                    factor = 1.0
            measured = measure(model, nu, True)
            if m.kind != ONE_STAGE:
                if m.kind == DIRK:
                    work += m.a[last, last] * measured[4]
                    lost += m.a[last, last] * measured[3]
                    if ramp.first < SHORT and time == start:
                        # of retardation: at a jump of speed a mesh has strain rates that last no step
                        lost = measured[3]
                lost, work = h * lost, h * work
                total = measured[0] + measured[1] + measured[2]
                excess = total + clock[DISSIPATED] + lost - clock[WORK] - work
                gained = excess - clock[EXCESS]
                if m.kind == MEAN:
                    gained = abs(gained)
                if ramp.fixed == 0.0 and h > ramp.shortest and gained > ramp.gain * clock[PEAK]:
                    reject(model, clock)
                    _shorter(ramp, clock, 0.5 * h)
                    continue
                if m.kind == DIRK:
                    clock[EXCESS] = excess
                elif gained < 0.01 * measured[0]:
                    # the model takes it from its velocities; where they are too low for that, later
                    clock[GAINED] = excess - clock[EXCESS]
                    kinetic, elastic, potential, losing, power, load = measured
                    measured = kinetic - clock[GAINED], elastic, potential, losing, power, load
                else:
                    clock[GAINED] = 0.0
            accept(model, m, h)
            if m.project:
                # (at its end the step's own phase)
                clock[TIME] = target
                project(model, ramp, clock, False)
                clock[TIME] = time
                measured = measure(model, nu, False)
            if m.kind == ONE_STAGE:
                lost = 0.5 * h * (clock[LOSING] + measured[3])
                work = 0.5 * h * (clock[POWER] + measured[4])
            clock[DISSIPATED] += lost
            clock[WORK] += work
            clock[LOSING], clock[POWER] = measured[3], measured[4]
            _advance(ramp, clock, h, target, landed, factor)
            clock[SPUN] = spin
            total = measured[0] + measured[1] + measured[2]
            done = landed and phase == final
            # every step leaves a row, in which events are found; the last one is kept too
            row = int(clock[ROWS])
            last_row = done or clock[AFTER] > 0.0 or (_held(ramp, clock) and total < ramp.barrier)
            kept = last_row or clock[SINCE] >= ramp.every
            rows[row, KEPT] = 1.0 if kept else 0.0
            record(model, nu, rows, row)
            _write(clock, rows, row, reached, measured)
            status = _watch(ramp, clock, reached, rows[row, HEIGHT], measured)
            if status != FULL:
                return status
            if kept:
                clock[SINCE] = 0.0
            if done:
                return DONE
            if landed:
                clock[PHASE] += 1.0
                clock[KINK] = 1.0

    return compiled()(run)
