"""The cubic term of a fold's normal form: by how much it moves the time at which the solution blows up.

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

import numpy as np

from ribbonfem.options import number, positive, refuse
from ribbonfem.results import Array

from .collocation import integrate
from .universal_curve import _START, _TERMS, PAST, _outer, outer_series

# of ln y in the time, and Lambda beyond which the finite part follows its logarithm
LOGARITHM, _FRICTION = 18.0 / 35.0, 1e4
# where the integration towards infinity ends, over the square root of the inertia; what is left is
# the square of it
_DEEP = 1e-4


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

    def far(y: Array, u: Array) -> Array:
        x, speed = np.exp(y), np.exp(u[1])
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
        return np.stack(
            (
                -2.0 * x / speed,
                3.0 - 2.0 * scale * (push - friction * speed * x),
                2.0 * u[3] / (x * speed) - root / x - logarithm,
                2.0 * u[3] + change,
            )
        )

    end = math.log(min(_DEEP, _DEEP * math.sqrt(inertia)))
    first = math.log(x0)
    begin = [start[0], start[1], start[2] + root / x0 - logarithm * first, start[3] * x0**2]
    last = integrate(far, first, end, np.array(begin))
    slope = far(np.array([end]), last[:, None])[:, 0]
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
    def near(t: Array, y: Array) -> Array:
        a, da, b, db = y
        push, more = t + a * a - friction * da, 2.0 * a * b + a**3 - friction * db
        return np.stack((da, push / inertia, db, more / inertia))

    begin = (*_outer(inertia, friction, _START), *_outer_cubic(inertia, friction, _START))
    a, da, b, db = map(float, integrate(near, -_START, PAST, np.array(begin)))
    shift = -b / da
    # at the same a, not at the same t
    faster = db + shift * (PAST + a * a - friction * da) / inertia
    x0 = a**-0.5
    return _to_infinity(inertia, friction, 1.0, x0, (PAST, math.log(da * x0**3), shift, faster / da))[1]


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

    def along(z: Array, u: Array) -> Array:
        root, speed = np.exp(0.5 * z), np.exp(u[0])
        scale = 1.0 / (inertia * speed**2)
        drag = friction * speed / root
        push = 1.0 + gamma * root**2
        slope = root**2 - drag * u[1] - 2.0 * u[1] * (push - drag)
        return np.stack((scale * (push - drag) - 1.5, scale * slope))

    start = 1e-4 * min(1.0, friction**2 / inertia)
    # the slow solution: a start beside it would be drawn to it within 1 / stiffness
    late = start * inertia / friction**2
    slow = start**0.5 / friction * (1.0 + gamma * start - 2.0 * late + 10.0 * late**2)
    change = start * (1.0 - 3.0 * late) / (1.0 + gamma * start)
    speed, change = integrate(along, math.log(start), 0.0, np.array([math.log(slow), change]))
    return float(speed), float(change)
