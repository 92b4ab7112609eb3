"""Public functions for single equilibria of the rod: stable states, the saddle, the bound on skipping."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ribbonfem.continuation import Point
from ribbonfem.continuation.saddles import saddle_beyond_fold
from ribbonfem.options import checked
from ribbonfem.results import Array, RestState, SolverError
from ribbonfem.scene import Scene, SceneError

from . import states
from .problem import Statics, default_steps
from .rod import Rod, RodState


def _profiles(rod: Rod, state: RodState) -> dict[str, Array]:
    """Arclength of the inner nodes, and kappa1, kappa2 and tau (1/L) there.

    kappa1 and kappa2: the curvature binormal along the means of m1 and m2 of the two edges.
    tau: the angle of the frame against the one carried over by parallel transport.
    """
    edge = np.diff(state.x, axis=0)
    tangent = edge / np.linalg.norm(edge, axis=1)[:, None]
    before, after = tangent[:-1], tangent[1:]
    cosine = np.sum(before * after, axis=1)[:, None]
    axis = np.cross(before, after)
    binormal = 2.0 * axis / (1.0 + cosine) / rod.rest
    m1 = state.m1
    m2 = np.cross(tangent, m1)
    kappa1 = 0.5 * np.sum(binormal * (m1[:-1] + m1[1:]), axis=1)
    kappa2 = 0.5 * np.sum(binormal * (m2[:-1] + m2[1:]), axis=1)
    along = np.sum(axis * m1[:-1], axis=1)[:, None]
    carried = m1[:-1] * cosine + np.cross(axis, m1[:-1]) + axis * along / (1.0 + cosine)
    sine = np.sum(np.cross(carried, m1[1:]) * after, axis=1)
    tau = np.arctan2(sine, np.sum(carried * m1[1:], axis=1)) / rod.rest
    return {"points": np.array(rod.arclength[1:-1]), "kappa1": kappa1, "kappa2": kappa2, "tau": tau}


def _directors(state: RodState) -> Array:
    """Rows m1, m2, m3 (N, 3, 3) at the nodes: means of the two edges' frames; an end has its edge's."""
    edge = np.diff(state.x, axis=0)
    tangent = edge / np.linalg.norm(edge, axis=1)[:, None]
    frames = np.stack((state.m1, np.cross(tangent, state.m1), tangent), axis=1)
    joined = np.concatenate((frames[:1], 0.5 * (frames[:-1] + frames[1:]), frames[-1:]))
    # the nearest rotation of a mean of two that are close
    u, _, v = np.linalg.svd(joined)
    return np.asarray(u @ v)


def state_of(rest: RestState) -> RodState:
    """The nodes and directors that a `RestState` of rods was made from."""
    x = rest.positions.copy()
    edge = np.diff(x, axis=0)
    tangent = edge / np.linalg.norm(edge, axis=1)[:, None]
    m1 = np.empty_like(tangent)
    m1[0] = rest.directors[0, 0]
    twist = np.zeros(len(x))
    twist[1:-1] = rest.tau * np.diff(rest.points).mean()
    for i in range(1, len(m1)):
        before, after = tangent[i - 1], tangent[i]
        m = m1[i - 1]
        carried = m - (before + after) * (m @ after) / (1.0 + before @ after)
        m1[i] = carried * np.cos(twist[i]) + np.cross(after, carried) * np.sin(twist[i])
    return RodState(x, m1, twist)


def _reactions(problem: Statics, state: RodState) -> Array:
    """(2, 6) of both clamps at rest (`RestState.reactions`): what their nodes and the held edges need."""
    rod, tangent = problem.rod, state.edges[0]
    gradient = problem.assemble(state, second=False)[1].reshape(-1, 4)
    result = np.empty((2, 6))
    for clamp, nodes in enumerate((slice(2), slice(-2, None))):
        forces, along = gradient[nodes, :3], tangent[-clamp]
        result[clamp, :3] = forces.sum(axis=0)
        lever = (rod.arclength[nodes] - clamp) @ forces
        result[clamp, 3:] = np.cross(along, lever) + gradient[nodes.start or 0, 3] * along
    return result


def _rest(problem: Statics, state: RodState, control: float, index: int, scene: Scene) -> RestState:
    rod = problem.rod
    height, slope, _ = problem.observe(state, control)
    reactions = _reactions(problem, state)
    return RestState(
        name=states.name(rod, state),
        control=float(control),
        height=height,
        slope=slope,
        force=reactions[1, :3],
        energy=problem.energy(state),
        index=index,
        s=np.array(rod.arclength),
        positions=state.x.copy(),
        directors=_directors(state),
        scene=scene,
        reactions=reactions,
        **_profiles(rod, state),
    )


@checked
def state(scene: Scene, *, nodes: int = 151, clamp: str = "centred") -> RestState:
    """The scene's start state: stable.

    Parameters
    ----------
    scene: any one.
    nodes, clamp: the discretisation, as in `der.folds`.

    Returns
    -------
    `RestState`; of the centred clamp the end nodes lie half an edge beyond the clamps, s = 0 and 1.
    Curvatures and twist are those at the inner nodes.

    Raises
    ------
    SceneError
        If the start is not a stable equilibrium; the message names those that are.
    OptionError, SolverError
        For an option that cannot be, a pre-deformation that fails.
    """
    rod = Rod(scene, nodes, clamp)
    return _rest(Statics(rod), states.start_state(rod), scene.begin, 0, scene)


@checked
def stable_states(scene: Scene, *, nodes: int = 151, clamp: str = "centred") -> tuple[str, ...]:
    """Names of the scene's stable states, whatever its `start`; () if there is none.

    Of those that shearing from the planar state reaches, without presets, loads and natural shape.
    Parameters and errors as in `state`.
    """
    if not scene.isolated:
        return ()
    return tuple(sorted(states.stable_states(Rod(scene.plain, nodes, clamp))))


def _pass(scene: Scene, angle: float, nodes: int, clamp: str) -> tuple[Statics, Point[RodState]]:
    """The saddle between U+S- and U- at an angle: see `saddle_beyond_fold`."""
    rod = Rod(replace(scene, start="U+S-", rate=1.0, stop=None, schedule=None), nodes, clamp)
    problem, steps = Statics(rod), default_steps(rod)
    return problem, saddle_beyond_fold(problem, states.start_state(rod), angle, steps)


@checked
def saddle(scene: Scene, angle: float, *, nodes: int = 151, clamp: str = "centred") -> RestState:
    """The saddle between U+S- and U- at an angle: the lowest pass from the one to the other.

    It has one unstable direction.

    Parameters
    ----------
    scene: a sheared one; its `start` does not count.
    angle: alpha in rad, below that of the fold of U+S-.
    nodes, clamp: as in `state`.

    Raises
    ------
    SceneError, OptionError
        As in `state`.
    SolverError
        If there is no such saddle at the angle.
    """
    if scene.planar:
        raise SceneError("Scene.shear = 0.0: the saddle between U+S- and U- needs a sheared scene")
    problem, point = _pass(scene, angle, nodes, clamp)
    return _rest(problem, point.state, angle, 1, scene)


@checked
def skipping_bound(scene: Scene, *, nodes: int = 151, clamp: str = "centred") -> float:
    """Energy of U+S+ at its fold alpha_c1 over that of the saddle to U- at the same angle, in EI2/L.

    Where it is negative a ribbon that leaves the fold at rest cannot pass the saddle, so that
    U+S- is not skipped for its energy alone ("type 1" in the paper's section 7).

    Parameters and errors as in `saddle`.
    """
    if scene.planar:
        raise SceneError("Scene.shear = 0.0: the saddle between U+S- and U- needs a sheared scene")
    rod = Rod(replace(scene, start="U+S+", rate=1.0, stop=None, schedule=None), nodes, clamp)
    problem = Statics(rod)
    result = states.met_folds(rod.scene, nodes, clamp, None)
    if not result:
        raise SolverError("U+S+ has no fold within a turn of the clamp, so that there is nothing to compare")
    top = result[0].point
    there, point = _pass(scene, top.parameter, nodes, clamp)
    return problem.potential(top.state) - there.potential(point.state)
