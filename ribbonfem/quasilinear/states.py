"""Start states of the quasi-linear beam: the loading that leads to a scene's start; a motion's end."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from ribbonfem.continuation.initial import followed
from ribbonfem.continuation.loading import brought_on
from ribbonfem.options import refuse
from ribbonfem.results import Array, History
from ribbonfem.scene import Scene
from ribbonfem.stepping.resume import begun_again, require_fit, require_history

from .problem import Statics, _State


def named(scene: Scene, elements: int, degree: int | None) -> tuple[Statics, _State]:
    """The equations in the control of a scene, and its start state.

    Raises
    ------
    SceneError, OptionError
        For a scene that is not planar, a mesh that cannot be; where the start loses its stability while what
        acts is increased from 0.
    """
    problem = Statics(scene, elements, degree)
    if not scene.dressed:
        return problem, problem.start()
    return problem, _start_of(scene.at_rest, problem.elements, problem.degree)


@lru_cache(maxsize=16)
def _start_of(scene: Scene, elements: int, degree: int) -> _State:
    rig = Statics(scene, elements, degree).rig.brought_on(scene.begin)
    problem = Statics(scene, elements, degree, rig)
    state = brought_on(problem, problem.start(), scene)
    return _State(state.z, state.load, scene.begin)


def resumed(problem: Statics, scene: Scene, initial: object) -> dict[str, Array]:
    """The state of the time loop at the last instant of a motion, by its names.

    Raises
    ------
    OptionError
        If it is no motion of this model, mesh and ribbon.
    SceneError
        If its clamps are not where the scene's begin, or its compression is another.
    """
    if not isinstance(initial, History):
        refuse("initial", initial, "a History of quasilinear.simulate is needed")
    kept: Any = require_history(initial, "quasilinear", scene, problem.options)
    before = initial.scene
    # (heights are counted in the root of dL, which the controls do not change)
    off = np.abs(kept["ends"][0] - problem.ends(scene.begin)).max() * problem.scale
    require_fit(scene, max(float(off), abs(before.compression - scene.compression)))
    return {name: np.array(value) for name, value in kept.items()} | {"clock": begun_again(kept["clock"])}


def rest_of(problem: Statics, begin: dict[str, Array], scene: Scene, initial: History) -> dict[str, Array]:
    """`History.rest` of a motion that begins with `initial`, there as in `resumed`."""
    z = np.concatenate((begin["z"], begin["ends"][0]))
    result = followed(problem, _State(z, float(begin["load"][0]), scene.begin), scene, initial)
    return {} if result is None else {"z": result.z, "load": np.array(result.load)}
