"""Pseudo-arclength continuation of equilibria, shared by all models."""

from .tracing import (
    PARAMETER_WEIGHT,
    Event,
    Linearisation,
    Point,
    Problem,
    Segment,
    State,
    Steps,
    at_parameter,
    equilibrium,
    first_point,
    switch,
    trace,
)

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
    "switch",
    "trace",
]
