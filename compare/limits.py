"""Limits of refinement: the only place that extrapolates."""

from __future__ import annotations

from ribbonfem.results import Fold


def edge_ratio(coarse: int, fine: int) -> float:
    """(l_coarse / l_fine)^2 of centred-clamp rods with these numbers of nodes."""
    return ((fine - 2) / (coarse - 2)) ** 2


def two_point(coarse: float, fine: float, ratio: float) -> float:
    """Richardson's limit of a value whose error falls by `ratio` from the coarse mesh to the fine one."""
    return (ratio * fine - coarse) / (ratio - 1.0)


def of_folds(coarse: Fold, fine: Fold, ratio: float) -> Fold:
    """Richardson's limit of a fold, of its angle, height and load."""
    angle, height, load = (
        two_point(getattr(coarse, name), getattr(fine, name), ratio) for name in ("angle", "height", "load")
    )
    return Fold(angle, height, load)
