"""Resuming a motion: the last instant of another one, checked, as the initial state of a new one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ribbonfem.options import refuse
from ribbonfem.results import Array, History
from ribbonfem.scene import Scene, SceneError

from .kernels import arrays
from .kernels.newton import ASSEMBLIES, FORETOLD

# of what files of the version before call "turning": what it is in each model
_TURNING = {"kirchhoff": "tangent_rate", "elastica": "phi_rate"}
# L and 1; clamps that are further apart do not fit
FITS = 1e-8
# counts of a run, and what its phases begin with
_COUNTED = (
    *(arrays.STEPS, arrays.NEWTON, arrays.REJECTED, arrays.ROWS, arrays.PHASE, arrays.AFTER),
    *(arrays.SINCE, arrays.PLACES, arrays.GAINED, arrays.CARRY, ASSEMBLIES),
)


def require_history(
    initial: object, model: str, scene: Scene, mesh: Mapping[str, Any]
) -> Mapping[str, Array]:
    """What the stepper of a model kept in a history of the same mesh and ribbon.

    Raises
    ------
    OptionError
        If it is no state and no motion, or of another model, mesh or ribbon.
    """
    if not isinstance(initial, History):
        refuse("initial", initial, "a RestState or a History is needed")
    if initial.model != model or not initial.resume:
        refuse("initial", initial, f"a History of {model}.simulate is needed")
    if initial.scene.ribbon != scene.ribbon:
        refuse("initial", initial, "a motion of the scene's ribbon is needed")
    own = {name: initial.options.get(name) for name in mesh}
    if own != dict(mesh):
        has = ", ".join(f"{name}={value!r}" for name, value in own.items())
        refuse("initial", initial, f"its mesh has {has}; the same are needed")
    kept = initial.resume
    if initial.scene.weight != scene.weight:
        # the energies begin anew with the other weight's
        clock = kept["clock"].copy()
        clock[arrays.EXCESS] = 0.0
        kept = {**kept, "clock": clock}
    return {**kept, _TURNING[model]: kept["turning"]} if "turning" in kept else kept


def begun_again(clock: Array) -> Array:
    """A clock at the last instant of a motion, as one that goes on from there has it."""
    result = clock.copy()
    for place in _COUNTED:
        result[place] = 0.0
    result[arrays.KINK] = 1.0
    # (of files of the version before it is a count)
    result[FORETOLD] = min(0.9, result[FORETOLD])
    return result


def require_fit(scene: Scene, off: float) -> None:
    """Raise a `SceneError` where the clamps of what a motion begins with are off by more than rounding."""
    if not off <= FITS:
        begin = scene.begin
        where = ", ".join(f"{name} {value:.6g}" for name, value in scene.controls(begin).items() if value)
        raise SceneError(
            f"Scene: the clamps begin at dL/L {scene.compression:g}, dW/L {scene.shear:g}, "
            f"{where or 'unturned'}; those of initial are off by {off:.3g}"
        )
