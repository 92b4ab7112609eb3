"""Fold and branch of equilibria of the quasi-linear beam in closed form (paper, section 4.3).

``z'''' + sigma^2 z'' = 0`` with ``z = 0`` at both ends, ``z'(0) = -mu``, ``z'(1) = 0`` and the
end-shortening ``int z'^2 = 2``, all in the rescaled height Z and slope mu.  The solution is
split about midspan, xi = x - 1/2, into

    even: A (cos(sigma xi) - cos(sigma/2)),   odd: B (sin(sigma xi) - 2 xi sin(sigma/2)),

which is well conditioned where the paper's quotient is not and continues to sigma^2 < 0
(a beam under tension) through complex sigma.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import lru_cache
from math import factorial

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from ribbonfem.options import interval, whole_number
from ribbonfem.results import Array, Value

# sigma at which the beam has mu = 0: Euler's clamped mode, the odd one, and the next even one
EULER = 2.0 * np.pi
ODD = 8.986818915818128  # tan(sigma/2) = sigma/2
NEXT_EVEN = 4.0 * np.pi


@dataclass(frozen=True)
class ClosedFormFold:
    """The fold met from U+ in rescaled units: sigma, mu = alpha (dL/L)^(-1/2), Z(1/2)."""

    sigma: float
    mu: float
    height: float


@dataclass(frozen=True, repr=False, eq=False)
class ClosedFormBranch(Value):
    """The equilibria connected with U+ at mu = 0, one row a point, in the order of the curve.

    `load` is sigma^2, which grows along the curve: from U+ at the smallest mu over the fold to
    the odd mode (mu = 0, height 0) and on, with ever more unstable directions, through a fold
    at mu < 0 to the second even mode.  U- lies on the mirror image (mu, Z) -> (-mu, -Z): the
    two curves touch in (mu, Z) at the odd mode, but with odd parts of opposite sign.
    """

    mu: Array
    height: Array
    load: Array
    stable: NDArray[np.bool_]

    def __repr__(self) -> str:
        span = f"mu {self.mu.min():.4g} .. {self.mu.max():.4g}" if len(self.mu) else "empty"
        return f"ClosedFormBranch({len(self.mu)} points, {span}, {int(np.count_nonzero(self.stable))} stable)"


def _even_and_odd(sigma: NDArray[np.complex128]) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
    """Shares of the even and odd parts in int z'^2 / mu^2; analytic in sigma^2."""
    half = np.sin(sigma / 2)
    even = (0.5 - np.sin(sigma) / (2 * sigma)) / (4 * half**2)
    top = sigma**2 / 2 + sigma * np.sin(sigma) / 2 - 4 * half**2
    bottom = sigma * np.cos(sigma / 2) - 2 * half
    odd = top / (4 * bottom**2)
    # both parts of the quotient lose all digits as sigma -> 0; their series do not
    load = sigma**2
    m = np.arange(3, 14)
    top_series = sum((-1.0) ** (k - 1) * (k - 2) / factorial(2 * k) * load ** (k - 3) for k in m)
    bottom_series = sum(
        (-1.0) ** k * 2 * k / (4.0**k * factorial(2 * k + 1)) * load ** (k - 1) for k in range(1, 13)
    )
    return even, np.where(np.abs(load) < 1.0, top_series / (4 * bottom_series**2), odd)


def _stretch(sigma: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """int z'^2 / mu^2, which the end-shortening sets to 2 / mu^2."""
    even, odd = _even_and_odd(sigma)
    return even + odd


@lru_cache(maxsize=1)
def closed_form_fold() -> ClosedFormFold:
    """The fold of the quasi-linear beam, met from U+ as mu grows.

    mu is largest there, so sigma is the root of d(int z'^2 / mu^2)/dsigma, taken by a complex
    step.  sigma = 7.5864, mu = 1.7818, Z = 0.3476 (paper, eq. for the bifurcation point).

    Examples
    --------
    >>> fold = closed_form_fold()
    >>> round(fold.sigma, 10), round(fold.mu, 10), round(fold.height, 10)
    (7.5863784311, 1.7817760412, 0.3476014043)
    """

    def slope(sigma: float) -> float:
        return float(_stretch(np.array([sigma + 1e-30j]))[0].imag * 1e30)

    sigma = brentq(slope, 7.0, 8.5, xtol=1e-15, rtol=1e-15)
    mu = float(np.sqrt(2.0 / _stretch(np.array([sigma + 0j]))[0].real))
    return ClosedFormFold(sigma, mu, -mu * float(np.tan(sigma / 4)) / (2.0 * sigma))


def closed_form_branch(span: tuple[float, float], points: int = 400) -> ClosedFormBranch:
    """The curve of equilibria through U+ for mu from `span[0]`, up to the second even mode.

    Parameters
    ----------
    span: smallest (< 0) and largest (> 0) rescaled angle mu; rows outside are left out.
    points: rows, about.

    Raises
    ------
    ValueError
        If 0 is not inside `span`.
    """
    span = interval("span", span)
    points = whole_number("points", points, 3, 10**7)
    marks = [_load_at(-span[0]), EULER**2, ODD**2, NEXT_EVEN**2]
    # the singular loads themselves are left out: both shares of the stretch are infinite there
    load = np.concatenate([np.linspace(a, b, points // 3 + 2)[1:-1] for a, b in itertools.pairwise(marks)])
    load = np.concatenate((marks[:1], load))
    sigma = np.sqrt(load + 0j)
    even, odd = _even_and_odd(sigma)
    sign = np.where(load < EULER**2, -1.0, np.where(load < ODD**2, 1.0, -1.0))
    mu = sign * np.sqrt(2.0 / (even + odd).real)
    height = (-mu * np.tan(sigma / 4) / (2.0 * sigma)).real
    inside = (mu >= span[0] * (1 + 1e-12)) & (mu <= span[1])
    stable = load < closed_form_fold().sigma ** 2
    return ClosedFormBranch(mu[inside], height[inside], load[inside], stable[inside])


def _load_at(reach: float) -> float:
    """sigma^2 below Euler's at which the U+ half has mu = -reach."""

    def off(load: float) -> float:
        return float(_stretch(np.sqrt(np.array([load + 0j])))[0].real - 2.0 / reach**2)

    low = -1.0
    while off(low) > 0.0:
        low *= 2.0
    return float(brentq(off, low, EULER**2 * (1.0 - 1e-12)))
