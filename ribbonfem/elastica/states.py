"""Start states of the elastica: the buckled beam, and the loading that leads from it to a scene's start."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from ribbonfem.closed_form import euler
from ribbonfem.continuation import solution
from ribbonfem.continuation.loading import brought_on
from ribbonfem.options import flag
from ribbonfem.results import Array, RestState
from ribbonfem.scene import Scene, SceneError

from .kernels.beam import P
from .problem import Statics, _State


def named(scene: Scene, elements: int, extensible: bool) -> tuple[Statics, _State]:
    """The equations of a beam that buckles, and a guess at its start.

    Raises
    ------
    SceneError, OptionError
        For a scene that is not planar, one that its stretch keeps flat, a mesh that cannot be; where
        the start loses stability while what acts is increased from 0.
    """
    if flag("extensible", extensible):
        scene.require_planar("elastica")
        scene.require_buckled()
    problem = Statics(scene, elements, extensible)
    start = _start_of(scene.at_rest, elements, extensible) if scene.dressed else problem.start()
    above = scene.compression - scene.ribbon.euler_shortening if extensible else np.inf
    if above < 1e-3 * scene.compression and not scene.dressed:
        # this close a mesh may be below its own Euler's load
        height = problem.observe(solution(problem, start, 0.0), 0.0)[0]
        if not problem.side * height > 0.1 * above**0.5:
            raise SceneError(
                f"Scene.compression = {scene.compression!r}: so close above Euler's load, "
                f"{scene.ribbon.euler_shortening!r}, the beam of {problem.elements} elements stays flat"
            )
    return problem, start


@lru_cache(maxsize=16)
def _start_of(scene: Scene, elements: int, extensible: bool) -> _State:
    rig = Statics(scene, elements, extensible).rig.brought_on(scene.begin)
    problem = Statics(scene, elements, extensible, rig)
    return replace(brought_on(problem, problem.start(), scene), at=scene.begin)


def forget() -> None:
    """Drop the start states that are kept: a call that is timed would find them."""
    euler.pendulum.cache_clear()
    _start_of.cache_clear()


def _reactions(problem: Statics, state: _State) -> Array:
    """(2, 6) of both clamps at rest (`RestState.reactions`)."""
    mesh, force = problem.mesh, problem.force(state)
    bent, _, _, tension, shear = problem.section(state)
    moment = bent - problem.natural(state)
    couple = mesh.weights * (1.0 + problem.compliance * tension) * shear
    result = np.zeros((2, 6))
    for clamp, (e, i) in enumerate(((0, 0), (-1, P))):
        result[clamp, [0, 2]] = mesh.coupling[:, i] @ force[e] - mesh.lumps[i] * problem.rig.weight
        # (phi turns about -y)
        result[clamp, 4] = mesh.tables.value[:, i] @ couple[e] - mesh.coupling[:, i] @ moment[e]
    return result


def rest_state(problem: Statics, state: _State, scene: Scene) -> RestState:
    """An equilibrium as what it is in three dimensions."""
    x, z = problem.shape(state)
    cos, sin, none = np.cos(state.phi), np.sin(state.phi), np.zeros_like(state.phi)
    curvature = problem.section(state)[0].ravel()
    height, slope, _ = problem.observe(state, state.at)
    return RestState(
        name="U+" if height > 0.0 else "U-",
        control=state.at,
        height=height,
        slope=slope,
        force=np.array([state.force[0], 0.0, state.force[1]]),
        energy=problem.energy(state),
        index=problem.linearise(state, state.at).index,
        s=problem.arclength,
        positions=np.column_stack((x, none, z)),
        directors=np.stack(
            [
                np.column_stack(rows)
                for rows in ((-sin, none, cos), (none, none - 1.0, none), (cos, none, sin))
            ],
            axis=1,
        ),
        points=problem.tables.points.ravel(),
        kappa1=np.zeros_like(curvature),
        kappa2=curvature,
        tau=np.zeros_like(curvature),
        scene=scene,
        reactions=_reactions(problem, state),
    )
