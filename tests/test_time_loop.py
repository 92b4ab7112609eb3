"""The time loop serves a model that it has never seen, whose unknowns do not add: a pendulum as a rotation.

Its place is a unit complex number, turned by the increments of a stage; gravity turns with the clamp.
"""

from typing import NamedTuple

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from ribbonfem import Ribbon, Scene
from ribbonfem.ends import moving
from ribbonfem.ends.kernels import control_at
from ribbonfem.jit.decorator import compiled
from ribbonfem.linalg.array_ops import copy
from ribbonfem.stepping.kernels import (
    CLOCK_SIZE,
    FULL,
    KINK,
    PHASE,
    REACTIONS,
    ROW_SIZE,
    ROWS,
    STEPS,
    Ramp,
)
from ribbonfem.stepping.kernels.arrays import DONE, HEIGHT, TIME, VELOCITY, ModelFunctions
from ribbonfem.stepping.kernels.loop import loop_of
from ribbonfem.stepping.methods import method_of

# a ribbon of which t* is 1 s
UNIT = Ribbon(young=12.0 * 1000.0 / 0.01**2)
STIFFNESS, RATE, STOP, HOLD, DAMPING = 9.0, 0.8, 1.2, 2.0, 0.3


class Pendulum(NamedTuple):
    """place, cos and sin; rate and its change, `now` at the last instant, `new` at the stage; all (2,)."""

    place: np.ndarray
    now: np.ndarray
    new_place: np.ndarray
    new: np.ndarray
    rates: np.ndarray
    angles: np.ndarray


@compiled()
def _turned(place, by):
    return place[0] * np.cos(by) - place[1] * np.sin(by), place[1] * np.cos(by) + place[0] * np.sin(by)


@compiled()
def _moment(place, angle):
    # of gravity, whose direction is the clamp's
    return -STIFFNESS * (place[1] * np.cos(angle) - place[0] * np.sin(angle))


@compiled()
def _project(model, ramp, clock, reset):
    model.now[1] = _moment(model.place, model.angles[0]) - ramp.damping * model.now[0]
    model.angles[2] = control_at(ramp.ends, int(clock[PHASE]), clock[TIME])[1]
    return 0.0


@compiled()
def _rescale(model, ratio):
    pass


@compiled()
def _begin(model, clock):
    copy(model.now, model.rates[0])


@compiled()
def _stage(model, m, ramp, clock, i, h, at):
    diagonal = m.a[i, i] * h
    known, turn = model.now[0], 0.0
    for j in range(i):
        known += h * m.a[i, j] * model.rates[j, 1]
        turn += h * m.a[i, j] * model.rates[j, 0]
    change = model.now[1]
    angle, spin, _ = control_at(ramp.ends, int(clock[PHASE]), at)
    model.angles[1], model.angles[2] = angle, spin
    iterations = 0
    while iterations < 30:
        iterations += 1
        rate = known + diagonal * change
        model.new_place[0], model.new_place[1] = _turned(model.place, turn + diagonal * rate)
        moment = _moment(model.new_place, angle)
        stiffness = STIFFNESS * (model.new_place[0] * np.cos(angle) + model.new_place[1] * np.sin(angle))
        off = change - moment + ramp.damping * rate
        step = off / (1.0 + stiffness * diagonal * diagonal + ramp.damping * diagonal)
        change -= step
        if abs(step) < 1e-13 * (1.0 + abs(change)):
            break
    model.new[0], model.new[1] = known + diagonal * change, change
    copy(model.new, model.rates[i])
    return iterations


@compiled()
def _energies(place, rate, angle):
    elastic = STIFFNESS * (1.0 - place[0] * np.cos(angle) - place[1] * np.sin(angle))
    return 0.5 * rate * rate, elastic, _moment(place, angle)


@compiled()
def _flows(model, nu, h):
    kinetic, _, moment = _energies(model.new_place, model.new[0], model.angles[1])
    return 2.0 * nu * kinetic, moment * model.angles[2]


@compiled()
def _error(model, m, h):
    error = 0.0
    for j in range(m.stages):
        error += m.error[j] * model.rates[j, 0]
    return abs(h * error)


@compiled()
def _reject(model, clock):
    pass


@compiled()
def _accept(model, m, h):
    copy(model.new_place, model.place)
    copy(model.new, model.now)
    model.angles[0] = model.angles[1]


@compiled()
def _measure(model, nu, solved):
    if solved:
        kinetic, elastic, moment = _energies(model.new_place, model.new[0], model.angles[1])
    else:
        kinetic, elastic, moment = _energies(model.place, model.now[0], model.angles[0])
    return kinetic, elastic, 0.0, 2.0 * nu * kinetic, moment * model.angles[2], 0.0


@compiled()
def _record(model, nu, rows, row):
    rows[row, HEIGHT], rows[row, VELOCITY] = model.place[1], model.place[0] * model.now[0]
    rows[row, REACTIONS:] = 0.0


_loop = loop_of(
    ModelFunctions(_project, _rescale, _begin, _stage, _flows, _error, _reject, _accept, _measure, _record)
)


@compiled()
def run(model, scheme, ramp, clock, rows):
    return _loop(model, scheme, ramp, clock, rows)


def moved(method, *, step=0.0, tolerance=0.0, room=5000):
    """Rows of the pendulum, from rest along the clamp through its turn and the hold, by blocks of `room`."""
    scheme, turned = method_of(method).as_scheme(), STOP / RATE
    ends = moving(Scene(ribbon=UNIT, rate=RATE, stop=STOP, hold=HOLD), 0.1 * RATE / 0.05)
    ramp = Ramp(
        ends=ends,
        end=turned + HOLD,
        damping=DAMPING,
        fixed=step,
        tolerance=tolerance,
        newton=1e-12,
        first=1e-3,
        smallest=1e-10,
        snap=False,
        since=0.0,
        departed=1e-6,
        every=1,
        barrier=-np.inf,
        gain=np.inf,
        shortest=0.0,
        least_growth=1.0,
    )
    model = Pendulum(
        place=np.array([1.0, 0.0]),
        now=np.zeros(2),
        new_place=np.zeros(2),
        new=np.zeros(2),
        rates=np.zeros((scheme.stages, 2)),
        angles=np.zeros(3),
    )
    clock = np.zeros(CLOCK_SIZE)
    clock[KINK] = 1.0
    parts, status = [], FULL
    while status == FULL:
        clock[ROWS] = 0.0
        rows = np.empty((room, ROW_SIZE))
        status = run(model, scheme, ramp, clock, rows)
        parts.append(rows[: int(clock[ROWS])])
    assert status == DONE
    return np.concatenate(parts), model, int(clock[STEPS])


def exact():
    """Angle and rate at the end, by an explicit method, turn and hold apart."""

    def motion(drive):
        return lambda t, y: [y[1], -STIFFNESS * np.sin(y[0] - drive(t)) - DAMPING * y[1]]

    options = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-12}
    turn = solve_ivp(motion(lambda t: RATE * t), (0.0, STOP / RATE), [0.0, 0.0], **options)
    return solve_ivp(motion(lambda t: STOP), (0.0, HOLD), turn.y[:, -1], **options).y[:, -1]


@pytest.mark.parametrize(("method", "order"), [("esdirk4", 4), ("esdirk3", 3), ("tr-bdf2", 2)])
def test_a_rotation_goes_through_the_loop_with_the_order_of_the_method(method, order):
    end = exact()
    errors = []
    for step in (0.05, 0.025, 0.0125):
        _, model, _ = moved(method, step=step)
        assert np.hypot(*model.place) == pytest.approx(1.0, abs=1e-12)
        errors.append(abs(np.arctan2(model.place[1], model.place[0]) - end[0]))
    assert np.log2(errors[1] / errors[2]) > order - 0.3


def test_its_steps_adapt_its_energy_balances_and_a_resumed_run_is_the_same():
    rows, model, steps = moved("esdirk4", tolerance=1e-8)
    assert abs(np.arctan2(model.place[1], model.place[0]) - exact()[0]) < 1e-6
    assert 30 < steps < 1000
    # columns: kinetic, elastic, potential, dissipated, work
    assert np.ptp(rows[:, 3:7].sum(axis=1) - rows[:, 7]) < 1e-6
    again, _, _ = moved("esdirk4", tolerance=1e-8, room=17)
    assert np.array_equal(rows, again)
