"""Diagrams of outcomes of ramps over two numbers of a scene: shares, boundaries, thresholds."""

from .boundaries import Boundary
from .diagram import outcome_diagram, selection_diagram, skipping_diagram
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
    "outcome_diagram",
    "selection_diagram",
    "skipping_diagram",
    "threshold",
]
