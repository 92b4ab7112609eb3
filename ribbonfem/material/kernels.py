"""The material law of the elements, compiled: moments and stretch, for one element or for four."""

from __future__ import annotations

from typing import Any

from ribbonfem.jit.decorator import compiled
from ribbonfem.jit.groups import OPTIONS
from ribbonfem.jit.simd import load, spread, store
from ribbonfem.results import Array

Value = Any
Vector = tuple[Value, Value, Value]

# what of a body changes with the strains that it counts from (`count_from`)
LAW = ("offset", "stiffness", "compliance")


@compiled(inline=True, fastmath={"contract", "reassoc", "nsz"})
def moments_of(stiffness: Array, offset: Vector, strain: Vector) -> Vector:
    """Moments of strains, each counted from its offset."""
    return (
        stiffness[0] * (strain[0] - offset[0]),
        stiffness[1] * (strain[1] - offset[1]),
        stiffness[2] * (strain[2] - offset[2]),
    )


@compiled(inline=True, fastmath={"contract", "reassoc", "nsz"})
def stretch_of(compliance: float, offset: Value, tension: Value) -> Value:
    """The length of r' under a tension n.t."""
    return 1.0 + offset + compliance * tension


@compiled(inline=True, fastmath={"contract", "reassoc", "nsz"})
def retarded(natural: Value, known: Value, ratio: float) -> Value:
    """What a strain counts from at a stage that knows its rate as (strain - known) / f; ratio is time / f."""
    return (natural + ratio * known) / (1.0 + ratio)


@compiled(**OPTIONS)
def count_from(
    offset: Array,
    natural: Array,
    known: Array,
    stiffness: Array,
    compliance: Array,
    elastic: Array,
    ratio: float,
) -> None:
    """The law of a stage that knows strains: moments and stretch by strains alone.

    Parameters
    ----------
    offset, known: (G, points, c + 1, WIDTH), of c curvatures and the stretch; natural: (G, points, c, WIDTH).
    stiffness: (c,) and compliance: (1,), which become those of the stage; elastic: (c + 1,), both without it.
    ratio: of the time of retardation to that by which strain rates are known.
    """
    last = natural.shape[2]
    for group in range(known.shape[0]):
        for k in range(known.shape[1]):
            for c in range(last):
                own = load(natural, (group, k, c))
                store(offset, (group, k, c), retarded(own, load(known, (group, k, c)), ratio))
            stretch = retarded(spread(0.0), load(known, (group, k, last)), ratio)
            store(offset, (group, k, last), stretch)
    for c in range(last):
        stiffness[c] = elastic[c] * (1.0 + ratio)
    compliance[0] = elastic[last] / (1.0 + ratio)


@compiled(**OPTIONS)
def count_with(
    offset: Array,
    natural: Array,
    rate: Array,
    stiffness: Array,
    compliance: Array,
    elastic: Array,
    time: float,
) -> None:
    """The law where strain rates are known: moments with their viscous part, by the elastic tangent.

    As in `count_from`; `time` is that of retardation.
    """
    last = natural.shape[2]
    for group in range(rate.shape[0]):
        for k in range(rate.shape[1]):
            for c in range(last):
                own = load(natural, (group, k, c))
                store(offset, (group, k, c), own - time * load(rate, (group, k, c)))
            store(offset, (group, k, last), -time * load(rate, (group, k, last)))
    for c in range(last):
        stiffness[c] = elastic[c]
    compliance[0] = elastic[last]
