"""Diagrams of what ramps do over rate and damping: shares, boundaries, thresholds."""

from .edges import Boundary
from .record import Diagram, Failed
from .runs import Sample
from .sheet import selection_diagram, skipping_diagram
from .threshold import Change, Threshold, threshold

__all__ = [
    "Boundary",
    "Change",
    "Diagram",
    "Failed",
    "Sample",
    "Threshold",
    "selection_diagram",
    "skipping_diagram",
    "threshold",
]
