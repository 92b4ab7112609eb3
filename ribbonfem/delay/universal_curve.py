"""The universal curve f(Lambda): when the normal form of a fold, swept at a constant rate, blows up."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.polynomial.chebyshev import chebval

from ribbonfem.options import number, refuse
from ribbonfem.results import Array

from .collocation import integrate

# how long before the fold the outer solution starts (its series has lost 1e-12 there); and how long after it
# the solution has left the fold, 0.5 <= a <= 2 whatever Lambda is, in the unit of time of Lambda
_START, PAST = 30.0, 1.8
_TERMS = 24
# Lambda beyond which f is that of Airy's equation to 1e-8, and the first zero of Airy's function
_AIRY, _FIRST_ZERO = 1e6, 2.338107410459767
# Chebyshev series of log(f / (1 + Lambda)^(2/3)) in log(1 + Lambda), Lambda from 0 to _FITTED:
# the interpolant of `universal` at 16 Chebyshev points
_FITTED = 1e3
_SERIES = (
    *(0.92486487, -0.13806499, 0.09811942, -0.04992682, 0.01627768, -0.00190809, -0.00115807, 0.00072896),
    *(-1.49e-4, -3.595e-5, 3.462e-5, -9.15e-6, -1.04e-6, 1.68e-6, -5.3e-7, 1e-8),
)


def outer_series(inertia: float, friction: float) -> Array:
    """Coefficients of s^(1/2 - k/2) of the solution that follows -sqrt(-t), t = -s."""
    k = np.arange(_TERMS)
    power = 0.5 - 0.5 * k
    a = np.zeros(_TERMS)
    a[0] = -1.0
    for m in range(1, _TERMS):
        right = -float(a[1:m] @ a[m - 1 : 0 : -1]) if m > 1 else 0.0
        if m >= 3:
            right -= friction * power[m - 3] * a[m - 3]
        if m >= 5:
            right += inertia * power[m - 5] * (power[m - 5] - 1.0) * a[m - 5]
        a[m] = right / (2.0 * a[0])
    return a


def _outer(inertia: float, friction: float, s: float) -> tuple[float, float]:
    """a and a' at t = -s on the solution that follows -sqrt(-t)."""
    a = outer_series(inertia, friction)
    power = 0.5 - 0.5 * np.arange(_TERMS)
    return float(a @ s**power), float(-(a * power) @ s ** (power - 1.0))


def universal(damping: float) -> float:
    """f(Lambda), the time at which the solution of the normal form leaves to infinity.

    To a relative 1e-10: an integration in time to where a is positive, then one in a^(-1/2), in
    which the end is a regular point.  Above Lambda = 1 time is counted in Lambda^(2/3).

    Parameters
    ----------
    damping: Lambda >= 0.

    Raises
    ------
    ValueError
        If Lambda is negative or not finite.
    SolverError
        If the integration fails.
    """
    damping = number("damping", damping)
    if damping < 0.0:
        refuse("damping", damping, "Lambda must be finite and not negative")
    # where inertia has no part in it any more it is Airy's equation
    return _universal(damping) if damping <= _AIRY else _FIRST_ZERO * damping ** (2.0 / 3.0)


def universal_fit(damping: Array) -> Array:
    """f(Lambda) of many Lambda at once, to a relative 2e-7 and without an integration up to Lambda = 1000."""
    lag = np.asarray(damping, dtype=float)
    near = np.minimum(lag, _FITTED)
    place = 2.0 * np.log1p(near) / math.log1p(_FITTED) - 1.0
    f = np.asarray((1.0 + near) ** (2.0 / 3.0) * np.exp(chebval(place, _SERIES)))
    for beyond in np.argwhere(lag > _FITTED):
        f[tuple(beyond)] = universal(float(lag[tuple(beyond)]))
    return f


@lru_cache(maxsize=4096)
def _universal(damping: float) -> float:
    inertia, friction, unit = 1.0, damping, 1.0
    if damping > 1.0:
        inertia, friction, unit = damping ** (-5.0 / 3.0), 1.0, damping ** (2.0 / 3.0)

    def near(t: Array, y: Array) -> Array:
        return np.stack((y[1], (t + y[0] ** 2 - friction * y[1]) / inertia))

    a, rate = integrate(near, -_START, PAST, np.array(_outer(inertia, friction, _START)))

    # x = a^(-1/2), log x the variable; P = a' x^3 tends to sqrt(2 / (3 inertia)); where friction
    # rules a' ~ a^2 and P ~ 1/x: its logarithm is the smoother unknown
    def far(y: Array, u: Array) -> Array:
        x, speed = np.exp(y), np.exp(u[1])
        force = (u[0] * x**4 + 1.0 - friction * speed * x) / (inertia * speed**2)
        return np.stack((-2.0 * x / speed, 3.0 - 2.0 * force))

    x0 = a**-0.5
    # deep enough for inertia to rule in the end, whatever it is
    last = math.log(min(1e-7, 1e-7 * math.sqrt(inertia)))
    t, speed = integrate(far, math.log(x0), last, np.array([PAST, math.log(rate * x0**3)]))
    return unit * float(t + 2.0 * math.exp(last - speed))
