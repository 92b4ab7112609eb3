"""The planar elastica: a geometrically exact beam, with or without stretch."""

from .verbs import (
    equilibria,
    folds,
    frequencies,
    normal_forms,
    simulate,
)

__all__ = [
    "equilibria",
    "folds",
    "frequencies",
    "normal_forms",
    "simulate",
]
