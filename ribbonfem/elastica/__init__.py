"""The planar elastica by finite elements: a geometrically exact beam, with or without stretch."""

from ribbonfem.public_names import public

from .functions import (
    equilibria,
    fold_curve,
    folds,
    frequencies,
    instabilities,
    leaves_plane,
    normal_forms,
    pitchfork_curve,
    state,
)
from .info import MODEL_INFO
from .motion import escape, simulate

__all__ = [
    "MODEL_INFO",
    "equilibria",
    "escape",
    "fold_curve",
    "folds",
    "frequencies",
    "instabilities",
    "leaves_plane",
    "normal_forms",
    "pitchfork_curve",
    "simulate",
    "state",
]

__getattr__, __dir__ = public(__name__, __all__)
