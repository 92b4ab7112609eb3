"""The ribbon whose right clamp is turned: the image of one whose left clamp is.

Turned by half a turn about the vertical and read from its other end, a ribbon whose left clamp is turned by
alpha becomes one whose right clamp is, with the sign of S exchanged:

    r(s) = D r_left(1 - s) + R,  D = diag(-1, -1, 1),  R = (L - dL, -dW, 0),
    m1(s) = D m1_left(1 - s),  t(s) = -D t_left(1 - s).

Heights, loads, energies and angles are the same, the slope at midspan changes its sign.  Models solve the
left one alone; `options.checked` hands them the image of a scene and maps back what they return.  The map is
its own inverse.
"""

from __future__ import annotations

from dataclasses import is_dataclass, replace
from typing import Any

import numpy as np

from .frozen import freeze
from .results import Array, Branch, Fold, History, RestState
from .scene import Scene, swapped

_HALF_TURN = np.array([-1.0, -1.0, 1.0])


def _positions(r: Array, scene: Scene) -> Array:
    """Positions (..., nodes, 3) of the image."""
    end = np.array([1.0 - scene.compression, -scene.shear, 0.0])
    return np.asarray(r)[..., ::-1, :] * _HALF_TURN + end


def _rest(state: RestState, scene: Scene) -> RestState:
    # the curvature about the normal is seen from the other side of the width
    return replace(
        state,
        name=swapped(state.name),
        slope=-state.slope,
        force=-_HALF_TURN * state.force,
        s=1.0 - state.s[::-1],
        positions=_positions(state.positions, scene),
        directors=state.directors[::-1] * _HALF_TURN * np.array([1.0, -1.0, -1.0])[:, None],
        points=1.0 - state.points[::-1],
        kappa1=-state.kappa1[::-1],
        kappa2=state.kappa2[::-1],
        tau=state.tau[::-1],
        scene=scene,
    )


def _turned_over(rows: Array, shift: Array) -> Array:
    """Vectors (rows, nodes, 3) of the image in the memory of `rows`: a long motion has room for them once."""
    held: list[Array] = []
    owner: Any = rows
    while isinstance(owner, np.ndarray):
        held.append(owner)
        owner = owner.base
    for array in reversed(held):
        array.flags.writeable = True
    rows *= _HALF_TURN
    rows += shift
    return freeze(rows[:, ::-1])


def _motion(history: History, scene: Scene, fresh: bool) -> History:
    kept = dict(history.configurations)
    end = np.array([1.0 - scene.compression, -scene.shear, 0.0])
    for name, shift in (("positions", end), ("normals", np.zeros(3))):
        if name in kept:
            rows = kept[name] if fresh else kept[name].copy()
            kept[name] = _turned_over(rows, shift)
    if "curvature" in kept:
        kept["curvature"] = kept["curvature"][:, ::-1]
    arclength = 1.0 - history.arclength[::-1]
    slope = freeze(-history.slope)
    steps = history.steps
    if steps is not None:
        steps = freeze(np.asarray(steps) * np.array([1.0, 1.0, 1.0, -1.0, 1.0])[:, None])
    return replace(history, slope=slope, configurations=kept, arclength=arclength, scene=scene, steps=steps)


def imaged(result: Any, scene: Scene, *, fresh: bool = False) -> Any:
    """What a model found of the image of a scene, as it is of the scene itself.

    Parameters
    ----------
    result: of any function; numbers, and what has no scene, are the same for both.
    scene: the one that was asked for.
    fresh: nobody else holds `result`, whose memory may then become that of its image.
    """
    if isinstance(result, tuple):
        return tuple(imaged(item, scene, fresh=fresh) for item in result)
    if isinstance(result, str):
        return swapped(result)
    if isinstance(result, Fold):
        return result if result.scene is None else replace(result, scene=scene)
    if isinstance(result, RestState):
        return _rest(result, scene)
    if isinstance(result, Branch):
        return replace(
            result,
            slope=-result.slope,
            folds=imaged(result.folds, scene),
            configurations=_positions(result.configurations, scene),
            arclength=1.0 - result.arclength[::-1],
            normals=None if result.normals is None else result.normals[:, ::-1] * _HALF_TURN,
            scene=scene,
        )
    if isinstance(result, History):
        return _motion(result, scene, fresh)
    if is_dataclass(result) and not isinstance(result, type) and hasattr(result, "scene"):
        return replace(result, scene=scene)
    return result
