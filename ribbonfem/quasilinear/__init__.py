"""The quasi-linear beam by finite elements: small slopes, end-shortening as a global constraint."""

from ribbonfem.public_names import public

from .functions import (
    ClosedFormBranch,
    ClosedFormFold,
    closed_form_branch,
    closed_form_fold,
    equilibria,
    folds,
    frequencies,
    instabilities,
    normal_forms,
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
    "folds",
    "frequencies",
    "instabilities",
    "normal_forms",
    "simulate",
]

__getattr__, __dir__ = public(__name__, __all__)
