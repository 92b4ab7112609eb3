"""Pseudo-arclength continuation of equilibria, shared by all models."""

from .corrector import (
    PARAMETER_WEIGHT,
    Linearisation,
    Point,
    Problem,
    State,
    Steps,
    equilibrium,
    first_point,
    parameter_weight,
    solution,
)
from .tracing import Event, Segment, at_parameter, switch, trace

__all__ = [
    "PARAMETER_WEIGHT",
    "Event",
    "Linearisation",
    "Point",
    "Problem",
    "Segment",
    "State",
    "Steps",
    "at_parameter",
    "equilibrium",
    "first_point",
    "parameter_weight",
    "solution",
    "switch",
    "trace",
]
