"""The buckled inextensible beam at alpha = 0, in closed form: Euler's elastica, clamped at both ends.

The tangent angle is the swing of a pendulum over one period, phi = 2 asin(sqrt(m) sn(4 K s)), of
the parameter m with 2 E(m) / K(m) - 1 = 1 - dL/L; the force is n = -(4 K)^2 e_x in EI2/L^2
(A. E. H. Love, Mathematical Theory of Elasticity, 1927, art. 263).  All for U+; U- is its mirror image.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq
from scipy.special import ellipe, ellipj, ellipk

from ribbonfem.results import Array


@lru_cache(maxsize=64)
def pendulum(compression: float) -> tuple[float, float]:
    """The parameter m and the quarter period K(m) for a dL/L."""
    m = brentq(lambda m: 2.0 * ellipe(m) / ellipk(m) - 2.0 + compression, 0.0, 1.0 - 1e-14, xtol=1e-15)
    return float(m), float(ellipk(m))


def bent(compression: float, compliance: float) -> float:
    """The part of a dL/L that bending takes up in a beam that stretches, c = EI2 / (EA L^2), about.

    Its force is close to Euler's, P (1 - c P) = 4 pi^2, and takes up c P.
    """
    shortening = 0.5 * (1.0 - np.sqrt(max(0.0, 1.0 - 16.0 * np.pi**2 * compliance)))
    return compression - float(min(shortening, 0.999 * compression))


def tangent_angle(compression: float, s: Array) -> Array:
    """phi (rad) at the arclengths s (L)."""
    m, quarter = pendulum(compression)
    return np.asarray(2.0 * np.arcsin(np.sqrt(m) * ellipj(4.0 * quarter * s, m)[0]))


def shape(compression: float, s: Array) -> tuple[Array, Array]:
    """x and z (L) at the arclengths s, by splines through many points of the tangent."""
    fine = np.linspace(0.0, 1.0, 2001)
    phi = tangent_angle(compression, fine)
    x, z = (CubicSpline(fine, part).antiderivative()(s) for part in (np.cos(phi), np.sin(phi)))
    return x, z


def energy(compression: float) -> float:
    """Bending energy in EI2/L: half the integral of phi'^2, phi' = 8 sqrt(m) K cn(4 K s)."""
    m, quarter = pendulum(compression)
    return 32.0 * quarter * float(ellipe(m) - (1.0 - m) * quarter)
