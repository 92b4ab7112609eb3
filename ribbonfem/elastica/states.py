"""Where a motion or a curve of the elastica begins: the buckled beam, and what leads from it to the start."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

from ribbonfem.continuation.loading import brought_on
from ribbonfem.scene import Scene

from .problem import Rig, Statics, _State


def named(scene: Scene, elements: int, extensible: bool) -> tuple[Statics, _State]:
    """The equations in the control of a scene, and a guess at its start state, good to Newton.

    Raises
    ------
    SceneError
        For a scene that is not planar; where the start loses its stability while what acts is brought on.
    """
    problem = Statics(scene, elements, extensible)
    return problem, _start_of(scene.at_rest, elements, extensible) if scene.dressed else problem.start()


@lru_cache(maxsize=16)
def _start_of(scene: Scene, elements: int, extensible: bool) -> _State:
    rig = Rig.of(scene, elements).brought_on(scene.begin)
    problem = Statics(scene, elements, extensible, rig)
    return replace(brought_on(problem, problem.start(), scene), at=scene.begin)
