"""All results of the models: those at rest (`equilibria`) and in motion (`history`), under one name."""

from .equilibria import Array, Branch, Controlled, Fold, Instability, RestState, axis_of, control_text
from .fold_curves import CurvePoint, FoldCurve, PitchforkCurve
from .frozen import Frozen, Value
from .history import DEPARTED, MESH, History, SolverError, snaps_from, snaps_since

__all__ = [
    "DEPARTED",
    "MESH",
    "Array",
    "Branch",
    "Controlled",
    "CurvePoint",
    "Fold",
    "FoldCurve",
    "Frozen",
    "History",
    "Instability",
    "PitchforkCurve",
    "RestState",
    "SolverError",
    "Value",
    "axis_of",
    "control_text",
    "snaps_from",
    "snaps_since",
]
