"""Closed-form solutions: the fold and branch of the beam of small slopes, and Euler's elastica (`euler`)."""

from .small_slopes import (
    EULER,
    NEXT_EVEN,
    ODD,
    ClosedFormBranch,
    ClosedFormFold,
    closed_form_branch,
    closed_form_fold,
)

__all__ = [
    "EULER",
    "NEXT_EVEN",
    "ODD",
    "ClosedFormBranch",
    "ClosedFormFold",
    "closed_form_branch",
    "closed_form_fold",
]
