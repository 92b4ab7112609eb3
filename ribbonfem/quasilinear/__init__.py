"""The quasi-linear beam by finite elements: small slopes, end-shortening as a global constraint."""

from ribbonfem.public_names import public

from .functions import (
    ClosedFormBranch,
    ClosedFormFold,
    closed_form_branch,
    closed_form_fold,
    equilibria,
    fold_curve,
    folds,
    frequencies,
    instabilities,
    normal_forms,
    pitchfork_curve,
)
from .info import MODEL_INFO
from .motion import escape, simulate

__all__ = [
    "MODEL_INFO",
    "ClosedFormBranch",
    "ClosedFormFold",
    "closed_form_branch",
    "closed_form_fold",
    "equilibria",
    "escape",
    "fold_curve",
    "folds",
    "frequencies",
    "instabilities",
    "normal_forms",
    "pitchfork_curve",
    "simulate",
]

__getattr__, __dir__ = public(__name__, __all__)
