"""Boundary conditions at an instant, compiled: poses and rates of both clamps, loads, power of controls."""

from __future__ import annotations

import math
from typing import NamedTuple

from numpy import ndarray

from ribbonfem.jit.decorator import compiled
from ribbonfem.jit.references import by_reference

LEFT, RIGHT, TWIST_LEFT, TWIST_RIGHT, COMPRESSION, SHEAR, LIFT, FORCE = range(8)
# what a pose of both ends holds: quaternions, spins in the body's axes and their rates; place, velocity and
# acceleration of the right clamp; the force at midspan; the control and its rate
FRAME, SPIN, SPIN_RATE, PLACE, SPEED, CHANGE, PUSH, CONTROL, RATE = 0, 8, 14, 20, 23, 26, 29, 30, 31
POSE_SIZE = 32


@by_reference
class Ends(NamedTuple):
    """A scene's controls in time, see `ribbonfem.ends.Ends`; times in t*.

    times (m + 1,), pieces (m + 1, 6), polynomials of the control from each of these instants on; kinks
    (k + 1,) from 0 to the end, first (k + 1,) the piece that begins there, reached (k + 1,) the control
    there; longest (k,) the longest step between two kinks.
    """

    fixed: ndarray
    moved: ndarray
    chord: ndarray
    weight: ndarray
    times: ndarray
    pieces: ndarray
    kinks: ndarray
    first: ndarray
    reached: ndarray
    longest: ndarray


@compiled()
def control_at(ends: Ends, phase: int, time: float) -> tuple[float, float, float]:
    """The control, its rate and acceleration, between the kinks `phase` and `phase` + 1."""
    low, high = ends.first[phase], max(ends.first[phase + 1], ends.first[phase] + 1)
    high = min(high, ends.pieces.shape[0])
    # the last piece that has begun
    while high - low > 1:
        middle = (low + high) // 2
        if ends.times[middle] <= time:
            low = middle
        else:
            high = middle
    p, s = ends.pieces, time - ends.times[low]
    value = p[low, 0] + s * (p[low, 1] + s * (p[low, 2] + s * (p[low, 3] + s * (p[low, 4] + s * p[low, 5]))))
    rate = p[low, 1] + s * (
        2.0 * p[low, 2] + s * (3.0 * p[low, 3] + s * (4.0 * p[low, 4] + s * (5.0 * p[low, 5])))
    )
    change = 2.0 * p[low, 2] + s * (6.0 * p[low, 3] + s * (12.0 * p[low, 4] + s * (20.0 * p[low, 5])))
    # at the kinks to the last digit
    if time == ends.kinks[phase + 1]:
        value = _at_end(ends, phase, value)
    return value, rate, change


@compiled()
def _at_end(ends: Ends, phase: int, value: float) -> float:
    """The value at the end of a phase: a jump follows it, or it is what the next one begins with."""
    after = ends.reached[phase + 1]
    return after if abs(after - value) <= 1e-9 * (1.0 + abs(after)) else value


@compiled()
def _clamp(
    pose: ndarray,
    which: int,
    angle: float,
    twist: float,
    turn: float,
    roll: float,
    turn2: float,
    roll2: float,
) -> None:
    """Frame, spin and its rate of a clamp at Ry(angle) Rx(twist)."""
    c, s = math.cos(0.5 * angle), math.sin(0.5 * angle)
    d, e = math.cos(0.5 * twist), math.sin(0.5 * twist)
    k = FRAME + 4 * which
    pose[k], pose[k + 1], pose[k + 2], pose[k + 3] = c * d, c * e, s * d, -s * e
    cosine, sine = d * d - e * e, 2.0 * d * e
    k = SPIN + 3 * which
    pose[k], pose[k + 1], pose[k + 2] = roll, turn * cosine, -turn * sine
    k = SPIN_RATE + 3 * which
    pose[k] = roll2
    pose[k + 1] = turn2 * cosine - turn * roll * sine
    pose[k + 2] = -turn2 * sine - turn * roll * cosine


@compiled()
def pose_at(ends: Ends, phase: int, time: float, pose: ndarray) -> None:
    """Both clamps, the force and the control at an instant, into pose (POSE_SIZE,)."""
    value, rate, change = control_at(ends, phase, time)
    f, m = ends.fixed, ends.moved
    _clamp(
        pose,
        0,
        f[LEFT] + m[LEFT] * value,
        f[TWIST_LEFT] + m[TWIST_LEFT] * value,
        m[LEFT] * rate,
        m[TWIST_LEFT] * rate,
        m[LEFT] * change,
        m[TWIST_LEFT] * change,
    )
    _clamp(
        pose,
        1,
        -(f[RIGHT] + m[RIGHT] * value),
        f[TWIST_RIGHT] + m[TWIST_RIGHT] * value,
        -m[RIGHT] * rate,
        m[TWIST_RIGHT] * rate,
        -m[RIGHT] * change,
        m[TWIST_RIGHT] * change,
    )
    for c in range(3):
        sign, k = (1.0 if c == 2 else -1.0), COMPRESSION + c
        pose[PLACE + c] = ends.chord[c] + sign * (f[k] + m[k] * value)
        pose[SPEED + c] = sign * m[k] * rate
        pose[CHANGE + c] = sign * m[k] * change
    pose[PUSH] = f[FORCE] + m[FORCE] * value
    pose[CONTROL], pose[RATE] = value, rate


@compiled()
def power_of(
    pose: ndarray,
    left: tuple[float, float, float],
    right: tuple[float, float, float],
    force: tuple[float, float, float],
    speed: float,
) -> float:
    """Power of all controls: moments of the clamps on the ribbon (in their bodies' axes), the force of the
    right one, and the force at midspan, which moves along z at `speed`."""
    total = -pose[PUSH] * speed
    for c in range(3):
        total += left[c] * pose[SPIN + c] + right[c] * pose[SPIN + 3 + c] + force[c] * pose[SPEED + c]
    return total
