"""Values read off a curve of equilibria: its direction, stable states at a control, energies, two folds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.interpolate import make_interp_spline

from compare.models import MODELS
from ribbonfem import Branch, Fold, Scene, SolverError
from ribbonfem.continuation.curves import span_of
from ribbonfem.results import Array
from ribbonfem.scene import swapped


def outward(branch: Branch, sign: float = 1.0) -> slice:
    """Rows of a curve from its start on, in the sense in which the control first goes to this sign.

    The start may be met on the curve in either sense.
    """
    first = int(np.flatnonzero(branch.control == 0.0)[0])
    forth = first + 1 < len(branch) and sign * branch.control[first + 1] > 0.0
    return slice(first, None) if forth else slice(first, None, -1)


def span_to(scene: Scene, control: float) -> tuple[float, float]:
    """The default span of a scene's curve, or as much more of it as a control is inside."""
    low, high = span_of(scene)
    reach = [scene.reach_towards(sign) for sign in (-1.0, 1.0)]
    return min(low, max(1.1 * control, -reach[0])), max(high, min(1.1 * control, reach[1]))


def stable_at(branch: Branch, control: float, *, image: bool = True) -> list[tuple[float, float]]:
    """Heights and slopes of the stable states at a control: on a curve, and on its mirror image.

    The image under z -> -z has the controls of the other sign where angles are turned: the curve through
    U+S+ gives U-S+ too.  Where weight, a natural shape or presets act it is no curve of states.
    """
    result = []
    for side in (1.0, -1.0) if image else (1.0,):
        away = np.asarray(branch.control) - side * control
        for k in np.flatnonzero((away[:-1] * away[1:] <= 0.0) & branch.stable[:-1] & branch.stable[1:]):
            share = away[k] / (away[k] - away[k + 1]) if away[k] != away[k + 1] else 0.0
            height, slope = (
                side * float((1.0 - share) * column[k] + share * column[k + 1])
                for column in (branch.height, branch.slope)
            )
            result.append((height, slope))
    return result


def potential(branch: Branch) -> Array:
    """(rows,) energy with that of the weight and of the force at midspan, EI2/L: what is least at rest."""
    scene, total = branch.scene, np.array(branch.energy)
    if any(scene.weight):
        along = branch.configurations @ np.array(scene.weight)
        total -= make_interp_spline(branch.arclength, along, axis=1).integrate(0.0, 1.0)
    push = scene.preset.get("force", 0.0) + scene.drives.force * np.asarray(branch.control)
    return np.asarray(total + push * branch.height)


def both_folds(scene: Scene, model: str, mesh: Mapping[str, Any]) -> tuple[Fold, Fold]:
    """The folds between which a ramp from a US state has another to skip, alpha_c1 and alpha_c2.

    Those that a very slow ramp meets, where these are two.  Where it meets one, the second is that of the
    state with S exchanged: the curves of both need not be connected for the one to snap to the other.

    Raises
    ------
    SceneError, SolverError
        If the ribbon has not both states, or no fold of one of them.
    """
    met: list[Fold] = []
    for start in (scene.start, swapped(scene.start)):
        ramp = replace(scene, start=start, rate=scene.direction, stop=None, hold=0.0)
        result = MODELS[model].folds(ramp, **mesh)
        if len(result) == 2 and not met:
            return result[0], result[1]
        if len(result) != 1:
            what = f"{len(result)} folds are" if result else "no fold is"
            raise SolverError(f"{model}: {what} met from {start} at {scene!r}")
        met.append(result[0])
    return met[0], met[1]
