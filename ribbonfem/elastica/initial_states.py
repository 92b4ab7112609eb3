"""Initial states of a motion of the elastica: an equilibrium, a given state, another motion's end."""

from __future__ import annotations

import numpy as np

from ribbonfem.continuation import solution
from ribbonfem.continuation.initial import followed
from ribbonfem.ends.planar_kernels import COMPRESSION, LEFT, LIFT, RIGHT
from ribbonfem.jit.groups import in_groups
from ribbonfem.jit.simd import WIDTH
from ribbonfem.material.kernels import LAW
from ribbonfem.options import refuse, require_ribbon
from ribbonfem.results import Array, History, RestState
from ribbonfem.scene import Scene
from ribbonfem.stepping.resume import begun_again, require_fit, require_history

from .kernels import arrays
from .kernels.beam import FORCE, PHI, ROWS, P, Z
from .problem import Statics, _State

# components of frames across the plane that are none
_FLAT = 1e-9


def at_rest(problem: Statics, state: _State) -> Array:
    """The state (G, ROWS, WIDTH) of the time loop in an equilibrium."""
    x, z = problem.shape(state)
    # the right clamp, to the last digit
    controls = problem.controls(state.at)
    x[-1], z[-1] = problem.chord - controls[COMPRESSION], controls[LIFT]
    force = problem.force(state).reshape(problem.elements, 2 * P)
    nodes = problem.nodes
    return in_groups(np.concatenate((x[nodes], z[nodes], state.phi[nodes], force), axis=1))


def in_rows(problem: Statics, field: Array) -> Array:
    """Rates (G, PHI, WIDTH) of a field (nodes, 2) along x and z."""
    return in_groups(np.concatenate((field[problem.nodes, 0], field[problem.nodes, 1]), axis=1))


def of(problem: Statics, scene: Scene, initial: object) -> dict[str, Array]:
    """The state of the time loop, by its names (`arrays.Motion`, and `LAW` of a beam that retards).

    Raises
    ------
    OptionError
        If it is neither a state nor a motion, or of another model, mesh or ribbon; or not planar.
    SceneError
        If its clamps are not where the scene's begin.
    """
    if isinstance(initial, RestState):
        return {"u": _at_rest(problem, scene, initial)}
    kept = require_history(
        initial, "elastica", scene, {"elements": problem.elements, "extensible": problem.extensible}
    )
    u, last = kept["u"], problem.elements - 1
    first, end = u[0, :, 0], u[last // WIDTH, :, last % WIDTH]
    _require_fit(problem, scene, (first[PHI], end[PHI + P]), (end[P], end[Z + P]))
    names = (*arrays.Motion._fields, *LAW)
    return {name: np.array(kept[name]) for name in names} | {"clock": begun_again(kept["clock"])}


def rest_of(
    problem: Statics, begin: dict[str, Array], scene: Scene, initial: RestState | History
) -> dict[str, Array]:
    """`History.rest` of a motion that begins with `initial`, there as in `of`."""
    rows = np.moveaxis(begin["u"], -1, 1).reshape(-1, ROWS)[: problem.elements]
    phi = np.empty(len(problem.arclength))
    phi[problem.nodes] = rows[:, PHI:FORCE]
    # of a motion the force varies along the beam
    state = _State(phi, np.zeros(2), scene.begin)
    force = (rows[:, FORCE:].reshape(-1, P, 2) - problem.force(state)).mean(axis=(0, 1))
    result = followed(problem, _State(phi, force, scene.begin), scene, initial)
    return {} if result is None else {"phi": result.phi, "force": result.force}


def _at_rest(problem: Statics, scene: Scene, state: RestState) -> Array:
    """A state at rest as (G, ROWS, WIDTH): other loads may have held it, whose force is the beam's."""
    if len(state.s) != len(problem.arclength) or np.abs(state.s - problem.arclength).max() > 1e-12:
        refuse("initial", state, f"its nodes are not those of elements={problem.elements}")
    require_ribbon(state, scene)
    tangent, normal = state.directors[:, 2], state.directors[:, 0]
    if max(np.abs(tangent[:, 1]).max(), np.abs(normal[:, 1]).max()) > _FLAT:
        refuse("initial", state, "the elastica needs a state in the plane y = 0")
    phi = np.unwrap(np.arctan2(tangent[:, 2], tangent[:, 0]))
    wanted = problem.controls(scene.begin)[LEFT]
    phi += 2.0 * np.pi * np.round((-wanted - phi[0]) / (2.0 * np.pi))
    place = (state.positions - state.positions[0])[:, [0, 2]]
    _require_fit(problem, scene, (phi[0], phi[-1]), (place[-1, 0], place[-1, 1]))
    # an equilibrium of these elements, under the loads that held it
    held = Statics(state.scene, problem.elements, problem.extensible)
    result = solution(held, _State(phi, state.force[[0, 2]], state.control), state.control)
    return at_rest(held, result)


def _require_fit(
    problem: Statics, scene: Scene, turns: tuple[float, float], reach: tuple[float, float]
) -> None:
    controls = problem.controls(scene.begin)
    wanted = -controls[LEFT], controls[RIGHT], problem.chord - controls[COMPRESSION], controls[LIFT]
    off = np.subtract((*turns, *reach), wanted)
    require_fit(scene, float(np.abs(off).max()))
