"""The normal form to the next order: what its cubic term does to the time at which it leaves.

All in y = a2 A (1/s^2), y'' + nu y' = y^2 + gamma y^3 (+ c a2 rate T on the ramp), to first order in
gamma.  Towards infinity the time at which y is reached moves by

    gamma (-(1/2) (3/2)^(3/2) y^(1/2) - (18/35) nu ln y + finite part + ...),

whatever came before; the finite part is what the ramp (`cubic_curve`) and the escape from the fold
(`escape_time`) differ in.  ln y is of y in 1/s^2.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np
from scipy.integrate import solve_ivp

from ribbonfem.policy import number, positive, refuse
from ribbonfem.results import Array, SolverError

from .curve import _ABSOLUTE, _RELATIVE, _START, _TERMS, _Left, _outer, outer_series

# of ln y in the time, and Lambda beyond which the finite part follows its logarithm
LOGARITHM, _FRICTION = 18.0 / 35.0, 1e4
# where the integration towards infinity ends, over the square root of the inertia; what is left is
# the square of it
_DEEP = 1e-4


def _method(inertia: float) -> Literal["LSODA", "Radau"]:
    return "LSODA" if inertia > 2.4e-4 else "Radau"


def _to_infinity(
    inertia: float, friction: float, ramp: float, x0: float, start: tuple[float, float, float, float]
) -> tuple[float, float]:
    """The end of inertia a'' + friction a' = ramp t + a^2, and the finite part of its shift by a^3.

    Over log x, x = a^(-1/2), with unknowns t, log P of P = a' x^3, the shift of t at given a less what
    grows of it, and x^2 times the change of log P.
    """
    fast = math.sqrt(2.0 / (3.0 * inertia))
    root = 0.5 / (fast**3 * inertia)
    logarithm = 2.0 * LOGARITHM * friction

    def far(y: float, u: Array) -> list[float]:
        x, speed = math.exp(y), math.exp(u[1])
        push = ramp * u[0] * x**4 + 1.0
        scale = 1.0 / (inertia * speed**2)
        shift = u[2] - root / x + logarithm * y
        change = (
            -2.0
            * scale
            * (
                ramp * shift * x**6
                + 1.0
                - friction * speed * x * u[3]
                - 2.0 * u[3] * (push - friction * speed * x)
            )
        )
        return [
            -2.0 * x / speed,
            3.0 - 2.0 * scale * (push - friction * speed * x),
            2.0 * u[3] / (x * speed) - root / x - logarithm,
            2.0 * u[3] + change,
        ]

    end = math.log(min(_DEEP, _DEEP * math.sqrt(inertia)))
    first = math.log(x0)
    begin = [start[0], start[1], start[2] + root / x0 - logarithm * first, start[3] * x0**2]
    run = solve_ivp(far, (first, end), begin, method=_method(inertia), rtol=_RELATIVE, atol=_ABSOLUTE)
    if not run.success:
        raise SolverError(f"the normal form was not integrated to its end: {run.message}")
    last = run.y[:, -1]
    slope = far(end, last)
    # both tend to their ends linearly in x
    return float(last[0] - slope[0]), float(last[2] - slope[2])


@lru_cache(maxsize=4096)
def cubic_curve(damping: float) -> float:
    """g(Lambda): a''+ Lambda a' = t + a^2 + eps a^3 leaves eps g later, in the sense of the finite part.

    Parameters
    ----------
    damping: Lambda >= 0.
    """
    damping = number("damping", damping)
    if damping < 0.0:
        refuse("damping", damping, "Lambda must be finite and not negative")
    if damping > _FRICTION:
        # an inertial layer ever farther out, where 1 - 18/35 of the logarithm ends
        hat = cubic_curve(_FRICTION) / _FRICTION - 6.0 / 35.0 * math.log(_FRICTION)
        hat -= 17.0 / 21.0 * math.log(damping / _FRICTION)
        return damping * (hat + 6.0 / 35.0 * math.log(damping))
    if damping > 1.0:
        hat = _cubic_curve(damping ** (-5.0 / 3.0), 1.0)
        return damping * (hat + 6.0 / 35.0 * math.log(damping))
    return _cubic_curve(1.0, damping)


def _cubic_curve(inertia: float, friction: float) -> float:
    def near(t: float, y: Array) -> list[float]:
        a, da, b, db = y
        return [
            da,
            (t + a * a - friction * da) / inertia,
            db,
            (2.0 * a * b + a**3 - friction * db) / inertia,
        ]

    begin = (*_outer(inertia, friction, _START), *_outer_cubic(inertia, friction, _START))
    run = solve_ivp(
        near,
        (-_START, 20.0),
        begin,
        events=_Left(),
        method=_method(inertia),
        rtol=_RELATIVE,
        atol=_ABSOLUTE,
    )
    if run.status != 1:
        raise SolverError(f"the cubic normal form was not integrated: {run.message}")
    t, (a, da, b, db) = float(run.t[-1]), run.y[:, -1]
    shift = -b / da
    # at the same a, not at the same t
    faster = db + shift * (t + a * a - friction * da) / inertia
    x0 = a**-0.5
    return _to_infinity(inertia, friction, 1.0, x0, (t, math.log(da * x0**3), shift, faster / da))[1]


def _outer_cubic(inertia: float, friction: float, s: float) -> tuple[float, float]:
    """The change of a and a' at t = -s by a^3, by its series: 2 a b = inertia b'' + friction b' - a^3."""
    a = outer_series(inertia, friction)
    cube = np.convolve(np.convolve(a, a)[:_TERMS], a)[:_TERMS]
    power = 1.0 - 0.5 * np.arange(_TERMS)
    b = np.zeros(_TERMS)
    for m in range(_TERMS):
        right = -cube[m] - 2.0 * float(a[1 : m + 1] @ b[:m][::-1])
        if m >= 3:
            right -= friction * power[m - 3] * b[m - 3]
        if m >= 5:
            right += inertia * power[m - 5] * (power[m - 5] - 1.0) * b[m - 5]
        b[m] = right / (2.0 * a[0])
    return float(b @ s**power), float(-(b * power) @ s ** (power - 1.0))


@dataclass(frozen=True)
class Escape:
    """The solution of y'' + nu y' = y^2 + gamma y^3 that leaves y = 0, at an instant.

    Attributes
    ----------
    speed: y', 1/s^3.
    time: until y is infinite, less what the cubic term makes of that but for its finite part, s.
    """

    speed: float
    time: float


@lru_cache(maxsize=1024)
def escape_time(y: float, damping: float, cubic: float) -> Escape:
    """Speed and time to the end from y (1/s^2), with nu (1/s) and gamma (s^2)."""
    y, damping = positive("y", y), number("damping", damping)
    # in units of y, and of the time that inertia or friction then gives
    unit = y**-0.5
    friction, inertia = damping * unit, 1.0
    if friction > 1.0:
        unit, friction, inertia = unit * friction, 1.0, friction**-2.0
    gamma = cubic * y
    plain = _unstable(inertia, friction, 0.0)
    full = _unstable(inertia, friction, gamma)
    end, finite = _to_infinity(inertia, friction, 0.0, 1.0, (0.0, plain[0], 0.0, plain[1]))
    # ln of y in 1/s^2 instead of in its own unit
    finite += LOGARITHM * friction * math.log(y)
    return Escape(math.exp(full[0]) * y / unit, unit * (end + gamma * finite))


def _unstable(inertia: float, friction: float, gamma: float) -> tuple[float, float]:
    """log y' at y = 1 of inertia y'' + friction y' = y^2 + gamma y^3 leaving 0, and its change by gamma."""
    if friction < 1e-7:
        fast = math.sqrt(2.0 / (3.0 * inertia))
        return math.log(fast) + 0.5 * math.log1p(0.75 * gamma), 0.375 / (1.0 + 0.75 * gamma)

    def along(z: float, u: Array) -> list[float]:
        root, speed = math.exp(0.5 * z), math.exp(u[0])
        scale = 1.0 / (inertia * speed**2)
        drag = friction * speed / root
        push = 1.0 + gamma * root**2
        return [
            scale * (push - drag) - 1.5,
            scale * (root**2 - drag * u[1] - 2.0 * u[1] * (push - drag)),
        ]

    start = 1e-4 * min(1.0, friction**2 / inertia)
    slow = start**0.5 / friction * (1.0 - 2.0 * start * inertia / friction**2)
    run = solve_ivp(
        along,
        (math.log(start), 0.0),
        [math.log(slow), start],
        # (it changes to stiff steps by itself: the slow solution draws all others to it)
        method="LSODA",
        rtol=1e-10,
        atol=1e-11,
    )
    if not run.success:
        raise SolverError(f"the escape of the normal form was not integrated: {run.message}")
    return float(run.y[0, -1]), float(run.y[1, -1])
