"""Snapping ribbons and beams: finite-element models and the statement of the problem.

Each model is a module with the verbs `folds`, `equilibria` and (the dynamic ones) `simulate`:
`quasilinear`, `elastica`, `kirchhoff`; the discrete elastic rod is the package `der`.
"""

from __future__ import annotations

from importlib import import_module
from types import ModuleType

from .results import Branch, Fold, History, SolverError
from .scene import Ribbon, Scene, SceneError

__all__ = [
    "Branch",
    "Fold",
    "History",
    "Ribbon",
    "Scene",
    "SceneError",
    "SolverError",
    "delay",
    "elastica",
    "kirchhoff",
    "quasilinear",
]

_MODELS = ("quasilinear", "elastica", "kirchhoff", "delay")


def __getattr__(name: str) -> ModuleType:
    # the models pull in scikit-fem and compiled kernels: only when they are asked for
    if name in _MODELS:
        return import_module(f"{__name__}.{name}")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
