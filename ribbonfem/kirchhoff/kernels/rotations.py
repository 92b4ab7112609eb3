"""Turns of the frames of a Kirchhoff rod, unit quaternions."""

from __future__ import annotations

import math

from ribbonfem.compiled.decorator import compiled
from ribbonfem.results import Array

from .tangent import INLINED, OPTIONS


@compiled(**INLINED)
def rotate(g: Array, i: int, a: float, b: float, c: float) -> None:
    """g <- g exp(psi / 2) at node i, with psi = (a, b, c)."""
    square = 0.25 * (a * a + b * b + c * c)
    if square < 1e-4:
        # sin(y) / y and cos(y), to the last digit
        half = 0.5 * (1.0 - square * (1.0 - square * (1.0 - square / 42.0) / 20.0) / 6.0)
        cosine = 1.0 - 0.5 * square * (1.0 - square * (1.0 - square / 30.0) / 12.0)
    else:
        angle = math.sqrt(square)
        half = 0.5 * math.sin(angle) / angle
        cosine = math.cos(angle)
    a, b, c = half * a, half * b, half * c
    w, x, y, z = g[i, 0], g[i, 1], g[i, 2], g[i, 3]
    w1 = w * cosine - x * a - y * b - z * c
    x1 = x * cosine + w * a + y * c - z * b
    y1 = y * cosine + w * b + z * a - x * c
    z1 = z * cosine + w * c + x * b - y * a
    # rounding would let the length drift over thousands of increments
    scale = 1.5 - 0.5 * (w1 * w1 + x1 * x1 + y1 * y1 + z1 * z1)
    g[i, 0], g[i, 1], g[i, 2], g[i, 3] = scale * w1, scale * x1, scale * y1, scale * z1


@compiled(**INLINED)
def twist(g0: Array, g: Array, i: int) -> float:
    """theta of node i: of conj(g0) g about the tangent, in (-pi, pi]."""
    w, x, y, z = g0[i, 0], g0[i, 1], g0[i, 2], g0[i, 3]
    along = w * g[i, 0] + x * g[i, 1] + y * g[i, 2] + z * g[i, 3]
    across = w * g[i, 1] - x * g[i, 0] - y * g[i, 3] + z * g[i, 2]
    return 2.0 * math.atan2(across, along) if along >= 0.0 else 2.0 * math.atan2(-across, -along)


@compiled(**OPTIONS)
def turn_between(g0: Array, g: Array, i: int, psi: Array) -> None:
    """psi[i] (3,), the shortest turn with g = g0 exp(psi / 2) at node i."""
    w, x, y, z = g0[i, 0], g0[i, 1], g0[i, 2], g0[i, 3]
    d, a, b, c = g[i, 0], g[i, 1], g[i, 2], g[i, 3]
    cosine = w * d + x * a + y * b + z * c
    sign = 1.0 if cosine >= 0.0 else -1.0
    p0 = sign * (w * a - x * d - y * c + z * b)
    p1 = sign * (w * b - y * d - z * a + x * c)
    p2 = sign * (w * c - z * d - x * b + y * a)
    sine = math.sqrt(p0 * p0 + p1 * p1 + p2 * p2)
    factor = 2.0 * math.atan2(sine, abs(cosine)) / sine if sine > 1e-150 else 2.0
    psi[i, 0], psi[i, 1], psi[i, 2] = factor * p0, factor * p1, factor * p2
