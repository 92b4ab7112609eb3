"""Initial states of a ribbon's motion: an equilibrium, a given state, another motion's last instant."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ribbonfem.continuation.initial import followed
from ribbonfem.ends import Ends
from ribbonfem.options import refuse, require_ribbon
from ribbonfem.results import Array, History, RestState
from ribbonfem.scene import Scene
from ribbonfem.stepping.kernels import KINK
from ribbonfem.stepping.kernels import arrays as clocks
from ribbonfem.stepping.kernels.guess import CLOCK_SIZE
from ribbonfem.stepping.resume import FITS, begun_again, require_fit, require_history

from .kernels import arrays
from .kernels.batch import in_groups
from .problem import Frames, Statics


def at_rest(problem: Statics, state: Frames, retards: bool = False) -> arrays.Motion:
    """The state of the time loop in an equilibrium; with the strains of a rod that `retards`."""
    nodes, elements = len(state.g), problem.tables.elements
    x = np.zeros((nodes, 4))
    x[:, :3] = problem.positions(state, state.at)
    # the right clamp, to the last digit
    x[-1, :3] = problem.ends.reach(state.at)[0]
    clock = np.zeros(CLOCK_SIZE)
    clock[KINK] = 1.0
    return arrays.Motion(
        x=x,
        v=np.zeros_like(x),
        a=np.zeros_like(x),
        auxiliary=np.zeros_like(x),
        g=state.g.copy(),
        n=in_groups(state.force + problem.loads(state.at)),
        tangent=np.zeros((nodes, 3)),
        tangent_rate=np.zeros((nodes, 3)),
        strain=arrays.strains(elements, retards),
        strain_rate=arrays.strains(elements, retards),
        clock=clock,
    )


def of(
    problem: Statics, scene: Scene, initial: object
) -> tuple[Frames, Callable[[], arrays.Motion] | None, float]:
    """Frames to begin at, the state of the time loop if it is another motion's, and its time in t*.

    Raises
    ------
    OptionError
        If it is neither a state nor a motion, or of another model, mesh or ribbon.
    SceneError
        If its clamps are not where the scene's begin.
    """
    if isinstance(initial, RestState):
        frames = _state(problem, scene, initial)
        return frames, lambda: _let_go(problem, frames, scene, initial), 0.0
    mesh = {"elements": problem.tables.elements, "extensible": problem.extensible}
    kept = require_history(initial, "kirchhoff", scene, mesh)
    _require_fit(problem, scene, kept["g"][[0, -1]], kept["x"][-1, :3])

    def motion() -> arrays.Motion:
        state = {name: np.array(kept[name]) for name in arrays.Motion._fields}
        return arrays.Motion(**state | {"clock": begun_again(kept["clock"])})

    frames = Frames(np.array(kept["g"]), np.zeros(3), scene.begin)
    return frames, motion, float(kept["clock"][clocks.TIME])


def _state(problem: Statics, scene: Scene, state: RestState) -> Frames:
    """The frames of a state at rest, on the same mesh."""
    if len(state.s) != len(problem.arclength) or np.abs(state.s - problem.arclength).max() > 1e-12:
        refuse("initial", state, f"its nodes are not those of elements={problem.tables.elements}")
    require_ribbon(state, scene)
    g = quaternions(state.directors, problem.ends.left(scene.begin)[0])
    _require_fit(problem, scene, g[[0, -1]], state.positions[-1] - state.positions[0])
    _require_stretch(problem, Frames(g, np.array(state.force), state.control), state)
    g[0], g[-1] = problem.ends.left(scene.begin)[0], problem.ends.right(scene.begin)[0]
    return Frames(g, np.array(state.force), scene.begin)


def _held(problem: Statics, state: RestState, extensible: bool) -> Statics:
    """The equations, on the mesh of `problem`, of which a state at rest is a solution."""
    ends, elements = Ends.of(state.scene), problem.tables.elements
    return Statics(state.scene.ribbon, ends, elements=elements, extensible=extensible)


def _require_stretch(problem: Statics, frames: Frames, state: RestState) -> None:
    """Refuse a state that stretches where the ribbon does not, and the other way round: it would ring."""
    own, other = (
        np.abs(
            _held(problem, state, extensible).positions(frames, state.control)
            - (state.positions - state.positions[0])
        ).max()
        for extensible in (problem.extensible, not problem.extensible)
    )
    if own > FITS and other < own:
        refuse(
            "initial",
            state,
            f"it is of extensible={not problem.extensible}, and here extensible={problem.extensible}; "
            "the same is needed",
        )


def _let_go(problem: Statics, frames: Frames, scene: Scene, state: RestState) -> arrays.Motion:
    """The state of the time loop at a state at rest, which other loads may have held."""
    motion = at_rest(problem, frames, scene.ribbon.retardation > 0.0)
    held = _held(problem, state, problem.extensible)
    # (the stretch is that of the force that was there)
    motion.n[:] = in_groups(frames.force + held.loads(state.control))
    motion.x[1:-1, :3] = state.positions[1:-1] - state.positions[0]
    return motion


def rest_of(problem: Statics, start: Frames, scene: Scene, initial: RestState | History) -> dict[str, Array]:
    """`History.rest` of a motion that begins with `initial`, there in `start`."""
    if isinstance(initial, History):
        # of a motion the force varies along the rod
        n = np.moveaxis(initial.resume["n"], -1, 1)
        n = n.reshape(-1, *n.shape[2:])[: problem.tables.elements] - problem.loads(scene.begin)
        start = replace(start, force=n.mean(axis=(0, 1)))
    state = followed(problem, start, scene, initial)
    return {} if state is None else {"g": state.g, "force": state.force}


def _require_fit(problem: Statics, scene: Scene, frames: Array, reach: Array) -> None:
    ends, begin = problem.ends, scene.begin
    wanted = np.stack((ends.left(begin)[0], ends.right(begin)[0]))
    require_fit(scene, max(np.abs(frames - wanted).max(), np.abs(reach - ends.reach(begin)[0]).max()))


def quaternions(directors: Array, first: Array) -> Array:
    """Unit quaternions (nodes, 4) of frames with rows m1, m2, m3, each near to the one before."""
    m1, m2, t = (np.asarray(directors)[:, k] for k in range(3))
    # columns of the rotation: G e_x = m3, G e_y = -m2, G e_z = m1
    r = np.stack((t, -m2, m1), axis=-1)
    q = np.empty((len(r), 4, 4))
    trace = np.trace(r, axis1=1, axis2=2)
    # |q|^2 times each component, by the largest
    q[:, 0, 0] = 1.0 + trace
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        q[:, i + 1, i + 1] = 1.0 + 2.0 * r[:, i, i] - trace
        q[:, 0, i + 1] = q[:, i + 1, 0] = r[:, k, j] - r[:, j, k]
        q[:, j + 1, k + 1] = q[:, k + 1, j + 1] = r[:, j, k] + r[:, k, j]
    largest = np.argmax(np.einsum("nii->ni", q), axis=1)
    g = q[np.arange(len(q)), largest]
    g /= np.linalg.norm(g, axis=1)[:, None]
    before = first
    for row in g:
        if row @ before < 0.0:
            row *= -1.0
        before = row
    return g
