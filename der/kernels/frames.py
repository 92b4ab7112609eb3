"""Edges of a discrete elastic rod and their material frames, carried by parallel transport."""

from __future__ import annotations

import math
from typing import Any

from ribbonfem.jit.algebra import cross, dot, mix, put_triple, scaled, triple
from ribbonfem.jit.decorator import compiled

# of all kernels of the rods
OPTIONS: dict[str, Any] = {"fastmath": {"contract"}}
# of what a step calls over and over with whole tuples of arrays: to hand them over takes a twentieth of it
INLINED: dict[str, Any] = {**OPTIONS, "inline": True}


@compiled(**OPTIONS)
def edges(x, tangent, inverse):
    """Unit tangents (N - 1, 3) and inverse lengths (N - 1,) of the edges."""
    for i in range(tangent.shape[0]):
        e = mix(triple(x, i + 1), 1.0, triple(x, i), -1.0)
        length = 1.0 / math.sqrt(dot(e, e))
        inverse[i] = length
        put_triple(scaled(length, e), tangent, i)


@compiled(**OPTIONS)
def fall_short(tangent_old, inverse_old, tangent, inverse, rest, linear, lag):
    """By how much the edges' strains fall short of what a step was to make of them; writes lag (N - 1,).

    It was to change them by its part along the old edges if it was `linear`, else not at all.
    """
    for i in range(lag.shape[0]):
        length = 1.0 / inverse[i]
        # along the old edge the new one has the length that was foreseen
        foreseen = (
            length * dot(triple(tangent_old, i), triple(tangent, i)) if linear else 1.0 / inverse_old[i]
        )
        lag[i] = (foreseen - length) / rest


@compiled(**OPTIONS)
def _turned(m, t, angle):
    """m, normal to t, turned about t."""
    square = angle * angle
    if square < 2.5e-3:
        # series to rounding: an angle of a step is small, and the library's functions are not cheap
        c = 1.0 - square * (0.5 - square * (1.0 / 24.0 - square * (1.0 / 720.0)))
        s = angle * (1.0 - square * (1.0 / 6.0 - square * (1.0 / 120.0 - square * (1.0 / 5040.0))))
    else:
        c, s = math.cos(angle), math.sin(angle)
    return mix(m, c, cross(t, m), s)


@compiled(**OPTIONS)
def _angle_of(y, x):
    """atan2(y, x), by its series where y is small."""
    if x > 0.0 and abs(y) < 0.1 * x:
        z = y / x
        w = z * z
        series = 1.0 / 9.0 - w * (1.0 / 11.0 - w * (1.0 / 13.0))
        return z * (1.0 - w * (1.0 / 3.0 - w * (1.0 / 5.0 - w * (1.0 / 7.0 - w * series))))
    return math.atan2(y, x)


@compiled(**OPTIONS)
def carry(tangent_old, m1_old, twist_old, tangent, turn, m1, twist):
    """Carry the directors from one configuration's tangents to another's.

    Each m1 is transported parallel from the old tangent of its edge to the new one and then
    turned by `turn` (N,) about it; the twist is measured anew and kept on the turn nearest to
    the old one.  Writes m1 and twist; they may be the old arrays.
    """
    before = (0.0, 0.0, 0.0)
    director = (0.0, 0.0, 0.0)
    for i in range(m1.shape[0]):
        old, new = triple(tangent_old, i), triple(tangent, i)
        m = triple(m1_old, i)
        m = mix(m, 1.0, mix(old, 1.0, new, 1.0), -dot(m, new) / (1.0 + dot(old, new)))
        m = _turned(m, new, turn[i])
        # back onto the normal plane and to unit length: a Newton step, since it is off by rounding
        m = mix(m, 1.0, new, -dot(m, new))
        m = scaled(1.5 - 0.5 * dot(m, m), m)
        if i > 0:
            # m1 of the edge before, transported in space onto this edge
            both = mix(before, 1.0, new, 1.0)
            moved = mix(director, 1.0, both, -dot(director, new) / (1.0 + dot(before, new)))
            angle = _angle_of(-dot(moved, cross(new, m)), dot(moved, m))
            off = twist_old[i] - angle
            if abs(off) > math.pi:
                angle += 2.0 * math.pi * round(off / (2.0 * math.pi))
            twist[i] = angle
        put_triple(m, m1, i)
        before, director = new, m
