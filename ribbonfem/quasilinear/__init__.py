"""The quasi-linear beam: small slopes, end-shortening as a global constraint."""

from .verbs import (
    ClosedFormBranch,
    ClosedFormFold,
    closed_form_branch,
    closed_form_fold,
    equilibria,
    folds,
    frequencies,
    normal_forms,
    simulate,
)

__all__ = [
    "ClosedFormBranch",
    "ClosedFormFold",
    "closed_form_branch",
    "closed_form_fold",
    "equilibria",
    "folds",
    "frequencies",
    "normal_forms",
    "simulate",
]
