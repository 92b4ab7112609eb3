"""Strains, and derivatives of the energy density, at a Gauss point of the elastica, of four elements at once.

The density is phi'^2 / 2 + n . (r' - t) - c (n . t)^2 / 2 with t = (cos phi, sin phi).
"""

from __future__ import annotations

import math
from typing import Any

from ribbonfem.jit.decorator import compiled
from ribbonfem.jit.groups import INLINED
from ribbonfem.jit.simd import load, nearest, spread
from ribbonfem.results import Array

from .beam import FORCE, PHI, P, Z

Value = Any

_TURN = 2.0 * math.pi


@compiled(**INLINED)
def cosine_sine(angle: Value) -> tuple[Value, Value]:
    """cos and sin to some 1e-15: series of an eighth of it without whole turns, doubled three times."""
    y = 0.125 * (angle - _TURN * nearest(angle * (1.0 / _TURN)))
    square = y * y
    odd = 1.0 / 362880.0 - square * (1.0 / 39916800.0 - square * (1.0 / 6227020800.0))
    odd = 1.0 / 6.0 - square * (1.0 / 120.0 - square * (1.0 / 5040.0 - square * odd))
    sine = y - y * square * odd
    even = 1.0 / 40320.0 - square * (1.0 / 3628800.0 - square * (1.0 / 479001600.0))
    # 1 - cos, which loses no digits where the angle is small
    versine = square * (0.5 - square * (1.0 / 24.0 - square * (1.0 / 720.0 - square * even)))
    for _ in range(3):
        sine, versine = 2.0 * sine * (1.0 - versine), 2.0 * sine * sine
    return 1.0 - versine, sine


@compiled(**INLINED)
def interpolated(
    value: Array, coupling: Array, u: Array, group: int, k: int
) -> tuple[Value, Value, Value, Value]:
    """phi at a Gauss point of a group, and phi', x', z' times its weight, of a state."""
    angle = bent = x = z = spread(0.0)
    for i in range(P + 1):
        phi = load(u, (group, PHI + i))
        angle += value[k, i] * phi
        bent += coupling[k, i] * phi
        x += coupling[k, i] * load(u, (group, i))
        z += coupling[k, i] * load(u, (group, Z + i))
    return angle, bent, x, z


@compiled(**INLINED)
def resolved(u: Array, group: int, k: int, cos: Value, sin: Value) -> tuple[Value, Value]:
    """Axial and shear force, n.t and n along the normal of t, of a state."""
    nx, nz = load(u, (group, FORCE + 2 * k)), load(u, (group, FORCE + 2 * k + 1))
    return nx * cos + nz * sin, nz * cos - nx * sin


@compiled(**INLINED)
def point_hessian(
    stretch: Value, compliance: float, cos: Value, sin: Value, tension: Value, shear: Value
) -> tuple[Value, Value, Value]:
    """Of -n . t - c (n . t)^2 / 2: twice in phi, and in phi and each component of n; by a weight with it in
    the stretch and in c.
    """
    turn = compliance * shear
    return (
        tension * stretch - turn * shear,
        sin * stretch - turn * cos,
        -1.0 * (cos * stretch) - turn * sin,
    )
