"""Finite-element models of a ribbon that is clamped at both ends and snaps, and the statement of the problem.

Each model is a module with the functions `folds`, `equilibria` and (the dynamic ones) `simulate`:
`quasilinear`, `elastica`, `kirchhoff`; the discrete elastic rod is the package `der`.
"""

from __future__ import annotations

from .options import OptionError
from .public_names import public
from .results import Branch, Fold, FoldCurve, History, Instability, PitchforkCurve, SolverError
from .scene import Drive, Ribbon, Scene, SceneError, SceneWarning, Schedule

# the name of the version before
PolicyError = OptionError

__version__ = "0.1.0"

__all__ = [
    "Branch",
    "Drive",
    "Fold",
    "FoldCurve",
    "History",
    "Instability",
    "OptionError",
    "PitchforkCurve",
    "Ribbon",
    "Scene",
    "SceneError",
    "SceneWarning",
    "Schedule",
    "SolverError",
    "delay",
    "elastica",
    "kirchhoff",
    "quasilinear",
]

# the models pull in scikit-fem and compiled kernels: only when they are asked for
__getattr__, __dir__ = public(
    __name__, __all__, dict.fromkeys(("quasilinear", "elastica", "kirchhoff", "delay"), ".")
)
