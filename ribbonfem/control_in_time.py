"""The control in time as polynomials between instants: of a ramp, of a schedule; when it passes a value.

Times are in t* (`Ribbon.inertial_time`).  `Polynomials` are instants, the coefficients of the polynomials
that begin there, in powers of the time since, and kinks from 0 to the end; the last polynomial holds what is
reached.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from .schedule import Schedule

Polynomials = tuple[tuple[float, ...], tuple[tuple[float, ...], ...], tuple[float, ...]]
_NONE = (0.0,) * 5


def of_ramp(rate: float, stop: float, hold: float) -> Polynomials:
    """The control at a constant rate (1/t*) to `stop`, then held: not at all where that is rounding."""
    turned = stop / rate
    times = (0.0, turned)
    pieces = ((0.0, rate, *_NONE[1:]), (stop, *_NONE))
    return times, pieces, (*times, turned + hold) if hold > 1e-12 * turned else times


def of_schedule(schedule: Schedule, unit: float) -> Polynomials:
    """The control of a schedule, t* being `unit` seconds."""
    pieces = tuple(tuple(c * unit**k for k, c in enumerate(piece)) for piece in schedule.pieces.tolist())
    kinks = (0.0, *schedule.kinks, schedule.time[-1])
    last = (schedule.value[-1], *_NONE)
    return tuple(x / unit for x in schedule.time), (*pieces, last), tuple(x / unit for x in kinks)


def first_passage(
    times: Sequence[float], pieces: Sequence[Sequence[float]], begin: float, value: float
) -> float:
    """When polynomials first pass a value that lies on one side of where they begin; infinite if they do not.

    Parameters
    ----------
    times: (n + 1,) ends of the intervals.
    pieces: (n, m) coefficients of each interval, in powers of the time since its first instant.
    """
    side = math.copysign(1.0, value - begin)
    for k, piece in enumerate(pieces):
        at = np.linspace(0.0, times[k + 1] - times[k], 65)
        beyond = np.flatnonzero((np.polyval(piece[::-1], at) - value) * side >= 0.0)
        if beyond.size:
            low, high = at[max(int(beyond[0]) - 1, 0)], at[int(beyond[0])]
            for _ in range(60):
                middle = 0.5 * (low + high)
                if (np.polyval(piece[::-1], middle) - value) * side >= 0.0:
                    high = middle
                else:
                    low = middle
            return float(times[k] + high)
    return math.inf
