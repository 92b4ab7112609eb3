"""Values read off a curve of equilibria: its direction, stable states at an angle, its two folds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from compare.models import MODELS
from ribbonfem import Branch, Fold, Scene, SolverError


def outward(branch: Branch, sign: float = 1.0) -> slice:
    """Rows of a curve from its start on, in the sense in which alpha first goes to this sign.

    The start may be met on the curve in either sense.
    """
    first = int(np.flatnonzero(branch.control == 0.0)[0])
    forth = first + 1 < len(branch) and sign * branch.control[first + 1] > 0.0
    return slice(first, None) if forth else slice(first, None, -1)


def stable_at(branch: Branch, angle: float) -> list[tuple[float, float]]:
    """Heights and slopes of the stable states at an angle: on a curve, and on its mirror image.

    The image under z -> -z has the angles -alpha: the curve through U+S+ gives U-S+ too.
    """
    result = []
    for side in (1.0, -1.0):
        away = np.asarray(branch.control) - side * angle
        for k in np.flatnonzero((away[:-1] * away[1:] <= 0.0) & branch.stable[:-1] & branch.stable[1:]):
            share = away[k] / (away[k] - away[k + 1]) if away[k] != away[k + 1] else 0.0
            height, slope = (
                side * float((1.0 - share) * column[k] + share * column[k + 1])
                for column in (branch.height, branch.slope)
            )
            result.append((height, slope))
    return result


def both_folds(scene: Scene, model: str, mesh: Mapping[str, Any]) -> tuple[Fold, Fold]:
    """The folds of U+S+ and of U+S-, alpha_c1 and alpha_c2, of a scene's ribbon.

    alpha_c2 is the fold of U+S- itself, so that it does not hang on the curves being connected.

    Raises
    ------
    SceneError, SolverError
        If the ribbon has not both states, or no fold of one of them.
    """
    result = []
    for start in ("U+S+", "U+S-"):
        folds = MODELS[model].folds(replace(scene, start=start, rate=1.0, stop=None, hold=0.0), **mesh)
        if not folds:
            raise SolverError(f"{model}: no fold is met from {start} at {scene!r}")
        result.append(folds[0])
    return result[0], result[1]
