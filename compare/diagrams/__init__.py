"""Diagrams of outcomes of ramps over rate and damping: shares, boundaries, thresholds."""

from .boundaries import Boundary
from .diagram import selection_diagram, skipping_diagram
from .result import Diagram, Failed
from .setup import Sample
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
