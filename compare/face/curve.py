"""What of a curve of equilibria is drawn."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ribbonfem.results import Array, Branch


@dataclass(frozen=True)
class Curve:
    """A curve of equilibria in a figure.

    Attributes
    ----------
    angle, height: (rows,) alpha in rad and z(1/2)/L.
    stable: (rows,) bool.
    folds: angle and height of each fold.
    """

    angle: Array
    height: Array
    stable: NDArray[np.bool_]
    folds: tuple[tuple[float, float], ...]

    @classmethod
    def of(cls, branch: Branch) -> Curve:
        """What of a branch is drawn."""
        folds = tuple((fold.angle, fold.height) for fold in branch.folds)
        return cls(branch.angle, branch.height, branch.stable, folds)
