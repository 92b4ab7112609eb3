"""Folds at rest to a tolerance: finite elements refined until three meshes agree."""

from __future__ import annotations

import math
import time
from collections.abc import Callable

from ribbonfem import Fold, Scene, SceneError, SolverError

from .refinement import Run, apart

# meshes of the elements at rest, each to be checked by the two before it: the third is the model's default
AT_REST = {
    "elastica": (8, 12, 16, 24, 32, 48, 64, 96),
    "kirchhoff": (16, 24, 32, 48, 64, 96, 128, 192, 256),
}
# elements at which a start that none of the coarser meshes has is given up
_HOPELESS = 64


def folds(
    name: str, of: Callable[..., tuple[Fold, ...]], scene: Scene, tolerance: float
) -> tuple[float | None, float, tuple[Run, ...], tuple[Fold, ...]]:
    """The last fold of a slow ramp by finer and finer elements, until three meshes agree to a tolerance.

    Parameters
    ----------
    name, of: of a model, and its `folds`.

    Returns
    -------
    The control (None where there is no fold), what it differs by from the meshes before, the runs, and
    the finest mesh's folds.

    Raises
    ------
    SceneError, SolverError
        If no mesh gives an answer.
    """
    runs: list[Run] = []
    result: list[tuple[Fold, ...]] = []
    failure: Exception | None = None
    error = math.inf
    for elements in AT_REST[name]:
        options = {"elements": elements, "extensible": True}
        begin = time.process_time()
        try:
            result.append(of(scene, **options))
        except (SceneError, SolverError) as raised:
            # a mesh too coarse for the start, or for the curve, says nothing of a finer one
            failure = raised
            runs.append(Run(name, options, None, time.process_time() - begin))
            if elements >= _HOPELESS and not result:
                break
            continue
        angle = result[-1][-1].control if result[-1] else None
        runs.append(Run(name, options, angle, time.process_time() - begin))
        if len(result) > 2:
            # two meshes may agree by chance: what the one before differs by counts too
            error = max(_apart(*result[-2:]), 0.5 * _apart(*result[-3:-1]))
        if error <= tolerance:
            break
    if not result:
        raise failure or SolverError(f"{name}: no mesh gave a fold")
    return _last(result[-1]), error, tuple(runs), result[-1]


def _apart(coarse: tuple[Fold, ...], fine: tuple[Fold, ...]) -> float:
    """Distance of the last folds on two meshes; infinite where these have not as many folds."""
    return apart(_last(coarse), _last(fine)) if len(coarse) == len(fine) else math.inf


def _last(folds: tuple[Fold, ...]) -> float | None:
    return folds[-1].control if folds else None
