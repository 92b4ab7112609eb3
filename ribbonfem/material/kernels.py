"""The law, compiled: moments and stretch, for numbers of one element or of four."""

from __future__ import annotations

from typing import Any

from ribbonfem.jit.decorator import compiled
from ribbonfem.results import Array

Value = Any
Vector = tuple[Value, Value, Value]


@compiled(inline=True, fastmath={"contract", "reassoc", "nsz"})
def moments_of(stiffness: Array, offset: Vector, strain: Vector) -> Vector:
    """Moments of strains, each counted from its offset."""
    return (
        stiffness[0] * (strain[0] - offset[0]),
        stiffness[1] * (strain[1] - offset[1]),
        stiffness[2] * (strain[2] - offset[2]),
    )


@compiled(inline=True, fastmath={"contract", "reassoc", "nsz"})
def stretch_of(compliance: float, offset: Value, pull: Value) -> Value:
    """The length of r' under a tension n.t."""
    return 1.0 + offset + compliance * pull


@compiled(inline=True, fastmath={"contract", "reassoc", "nsz"})
def retarded(natural: Value, known: Value, ratio: float) -> Value:
    """What a strain counts from at a stage that knows its rate as (strain - known) / f; ratio is time / f."""
    return (natural + ratio * known) / (1.0 + ratio)
