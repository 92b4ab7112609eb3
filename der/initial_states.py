"""Initial states of a rod's motion other than the scene's start: a state at rest, a motion's end."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ribbonfem.continuation.initial import followed
from ribbonfem.options import refuse, require_ribbon
from ribbonfem.results import Array, History, RestState, control_text
from ribbonfem.scene import SceneError

from . import kernels
from .problem import Statics
from .rest import state_of
from .rod import Rod, RodState

# L; clamps that are further apart do not fit
_FITS = 1e-9


def of(rod: Rod, given: object) -> tuple[RodState, float]:
    """The configuration that a motion starts from, its clamps where the scene's begin, and its time in t*.

    Raises
    ------
    OptionError
        If it is neither a state nor a motion, or of other nodes or another ribbon.
    SceneError
        If its clamps are not where the scene's begin.
    """
    began, scene = 0.0, rod.scene
    if isinstance(given, History):
        kept = given.resume
        if given.model != "der" or not kept:
            refuse("initial", given, "a History of der.simulate is needed")
        if given.scene.ribbon != scene.ribbon:
            refuse("initial", given, "a motion of the scene's ribbon is needed")
        state = RodState(kept["x"].copy(), kept["m1"].copy(), kept["twist"].copy())
        began = float(kept["clock"][kernels.TIME])
    elif isinstance(given, RestState):
        if len(given.points) != len(given.s) - 2:
            refuse("initial", given, "a state of der is needed")
        require_ribbon(given, scene)
        state = state_of(given)
    else:
        refuse("initial", given, "a RestState or a History is needed")
    if len(state.x) != rod.nodes:
        refuse("initial", given, f"it has {len(state.x)} nodes, and nodes = {rod.nodes}")
    x, m1 = Statics(rod).clamps(scene.begin)
    off = max(np.abs(x - state.x[[0, 1, -2, -1]]).max(), np.abs(m1 - state.m1[[0, -1]]).max())
    if not off <= _FITS:
        raise SceneError(
            f"Scene: the clamps, clamp = {rod.clamp!r}, begin where {control_text(scene, scene.begin)}; "
            f"those of initial = {given!r} do not fit: they are off by {off:.3g}"
        )
    return replace(state, at=scene.begin), began


def rest_of(rod: Rod, start: RodState, initial: RestState | History) -> dict[str, Array]:
    """`History.rest` of a motion that begins with `initial`, there in `start`."""
    result = followed(Statics(rod), start, rod.scene, initial)
    return {} if result is None else {"x": result.x, "m1": result.m1, "twist": result.twist}
