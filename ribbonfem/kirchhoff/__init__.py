"""The ribbon as a geometrically exact Kirchhoff rod in three dimensions, by finite elements."""

from ribbonfem.public_names import public

from .escape import escape
from .functions import (
    Pitchforks,
    RestState,
    ShearCurve,
    equilibria,
    folds,
    frequencies,
    instabilities,
    leaves_plane,
    normal_forms,
    pitchforks,
    saddle,
    shear_curves,
    skipping_bound,
    stable_states,
    state,
)
from .info import MODEL_INFO
from .motion import simulate
from .two_parameters import fold_curve, pitchfork_curve

__all__ = [
    "MODEL_INFO",
    "Pitchforks",
    "RestState",
    "ShearCurve",
    "equilibria",
    "escape",
    "fold_curve",
    "folds",
    "frequencies",
    "instabilities",
    "leaves_plane",
    "normal_forms",
    "pitchfork_curve",
    "pitchforks",
    "saddle",
    "shear_curves",
    "simulate",
    "skipping_bound",
    "stable_states",
    "state",
]

__getattr__, __dir__ = public(__name__, __all__)
