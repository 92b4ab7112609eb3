"""The quasi-linear beam: small slopes, end-shortening as a global constraint."""

from ribbonfem.names import public

from .functions import (
    ClosedFormBranch,
    ClosedFormFold,
    closed_form_branch,
    closed_form_fold,
    equilibria,
    escape,
    folds,
    frequencies,
    normal_forms,
    simulate,
)
from .info import DECLARED

__all__ = [
    "DECLARED",
    "ClosedFormBranch",
    "ClosedFormFold",
    "closed_form_branch",
    "closed_form_fold",
    "equilibria",
    "escape",
    "folds",
    "frequencies",
    "normal_forms",
    "simulate",
]

__getattr__, __dir__ = public(__name__, __all__)
