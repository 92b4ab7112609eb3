"""The data of a curve of equilibria that plots draw: control, height, stability, folds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ribbonfem.results import Array, Branch


@dataclass(frozen=True)
class Curve:
    """A curve of equilibria in a figure, or several: then rows that are no numbers stand between them.

    Attributes
    ----------
    angle, height: (rows,) the control, alpha in rad where clamps turn, and z(1/2)/L.
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
        folds = tuple((fold.control, fold.height) for fold in branch.folds)
        return cls(branch.control, branch.height, branch.stable, folds)

    def mirrored(self) -> Curve:
        """The image under z -> -z, at the angles -alpha."""
        return Curve(-self.angle, -self.height, self.stable, tuple((-a, -z) for a, z in self.folds))

    @classmethod
    def joined(cls, curves: Sequence[Curve]) -> Curve:
        """Several curves as one."""
        gap, none = np.array([np.nan]), np.array([False])

        def rows(name: str, between: NDArray[Any]) -> NDArray[Any]:
            parts = [part for curve in curves for part in (between, getattr(curve, name))]
            return np.concatenate(parts[1:])

        folds = tuple(fold for curve in curves for fold in curve.folds)
        return cls(rows("angle", gap), rows("height", gap), rows("stable", none), folds)
