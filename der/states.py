"""Pre-deformation: from a flat ribbon to the stable state that a scene starts from.

The planar buckled state is known nearly in closed form.  The ribbon is sheared from there in
small steps; wherever the state has lost its stability it is pushed along its softest mode and
relaxed, so that it follows the paper's way through the pitchforks (appendix B).  At alpha = 0
all four US states follow from one by two symmetries of the clamps: the mirror z -> -z, and the
reversal s -> L - s with r -> R - r.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.linalg import eig_banded
from scipy.optimize import brentq
from scipy.special import j0

from ribbonfem.continuation import Event, Steps, equilibrium
from ribbonfem.continuation.curves import ramp_events, ramp_folds
from ribbonfem.continuation.loading import brought_on
from ribbonfem.ends import Ends
from ribbonfem.results import Array, SolverError
from ribbonfem.scene import Scene, SceneError

from . import kernels
from .problem import Loading, Statics, default_steps
from .rod import Rod, RodState

# heights and slips below this (in L) count as zero when a state is named
_FLAT = 1e-6
# L: at a pitchfork a descent step below the first may be rounding, and states within the second the same one
_NEUTRAL, _APART = 1e-5, 1e-2
# L: a descent that makes steps below this only does not move
_STANDING = 1e-11
# nodes of the rod that is sheared on the way to a finer one, and its longest step in dW/L
_COARSE, _STRIDE = 25, 0.1
# steps that follow a sheet closely
_CLOSE = 0.02


def planar(rod: Rod) -> RodState:
    """A guess for the planar state U+ at the scene's compression: tangent angle a sin(2 pi s).

    J0(a) makes the chord of what does not stretch, and the edges are as long as Euler's load leaves
    them; it is the elastica to first order in a.
    """
    # the stretch takes up what it does at Euler's load
    bent = rod.scene.compression - min(rod.scene.ribbon.euler_shortening, 0.999 * rod.scene.compression)
    amplitude = brentq(lambda a: j0(a) - 1.0 + bent, 0.0, 3.83)
    middles = 0.5 * (rod.arclength[1:] + rod.arclength[:-1])
    phi = amplitude * np.sin(2.0 * np.pi * middles)
    phi[[0, -1]] = 0.0
    edges = rod.rest * np.column_stack((np.cos(phi), np.zeros_like(phi), np.sin(phi)))
    edges *= (1.0 - rod.scene.compression) / (1.0 - bent)
    x = np.zeros((rod.nodes, 3))
    x[0, 0] = rod.arclength[0]
    x[1:] = x[0] + np.cumsum(edges, axis=0)
    x[-2:] = Statics(rod, _in_shear(rod)).clamps(0.0)[0][2:]
    m1 = np.column_stack((-np.sin(phi), np.zeros_like(phi), np.cos(phi)))
    return RodState(x, m1, np.zeros(rod.nodes))


def mirrored(state: RodState) -> RodState:
    """The image under z -> -z: U changes sign, S keeps it."""
    return RodState(state.x * [1.0, 1.0, -1.0], state.m1 * [-1.0, -1.0, 1.0], -state.twist)


def reversed_(state: RodState) -> RodState:
    """The image under s -> L - s, r -> R - r at alpha = 0: U and S both change sign."""
    ends = state.x[0] + state.x[-1]
    return RodState(ends - state.x[::-1], state.m1[::-1].copy(), -state.twist[::-1])


def _in_shear(rod: Rod) -> Ends:
    """The ends of a scene's rod in the shear, where nothing else acts."""
    return Ends.varying("dW", rod.scene.compression, 0.0)


def name(rod: Rod, state: RodState) -> str:
    """The name of a state by the signs of z(1/2) and of x(1/2) against half the chord.

    Both vanish in the states S+ and S-, which are their own reversals: S+ is the one that U+S+
    (and U-S-) becomes, with the midpoint leaning down, t_z < 0.
    """
    position, tangent = rod.middle(state.x)
    slip = float(position[0]) - 0.5 * float(rod.scene.chord(state.at)[0])
    u = "" if abs(position[2]) < _FLAT else "U+" if position[2] > 0.0 else "U-"
    if abs(slip) > _FLAT:
        return u + ("S+" if slip > 0.0 else "S-")
    if u or abs(tangent[2]) < _FLAT:
        return u
    return "S+" if tangent[2] < 0.0 else "S-"


def relax(problem: Statics, state: RodState, parameter: float, *, most: int = 400) -> RodState:
    """Descend to a stable equilibrium with fixed clamps: Newton, made a descent where H is indefinite.

    Raises
    ------
    SolverError
        If no minimum is found in `most` steps.
    """
    rod, free = problem.rod, problem.rod.free
    shift, before, stalled = 1.0, np.inf, 0
    energy = problem.energy(state)
    for _ in range(most):
        _, gradient, hessian = problem.assemble(state)
        factors = hessian.copy()
        index = kernels.factor(factors, free.start, free.stop)
        stable = index == 0
        while index:
            shift *= 4.0
            if not shift < 1e30:
                raise SolverError(f"no stable equilibrium of {rod.nodes} nodes: its Hessian is not finite")
            factors = hessian.copy()
            factors[: len(gradient), 0] += shift * rod.inertia
            index = kernels.factor(factors, free.start, free.stop)
        step = np.zeros(len(gradient) + kernels.WIDTH)
        step[free] = -gradient[free]
        kernels.solve(factors, free.start, free.stop, step)
        increment = step[free]
        shift = max(1.0, shift / 16.0)
        size = float(np.abs(increment).max())
        if not np.isfinite(size):
            raise SolverError(f"no stable equilibrium of {rod.nodes} nodes: a descent step is not finite")
        increment *= min(1.0, 0.1 / size)
        while True:
            trial = problem.advance(state, increment, parameter)
            new = problem.energy(trial)
            # close to the minimum the energy no longer resolves the step
            if new <= energy or np.abs(increment).max() < 1e-6:
                break
            increment *= 0.5
        state, energy = trial, new
        # at a pitchfork rounding moves the state along its neutral mode, and that does not end
        stalled += 0.9 * before < size < _NEUTRAL
        if stable and (size < 1e-9 or stalled >= 5):
            return state
        if stalled >= 5 and size < _STANDING:
            # symmetric, and on top of the pitchfork: nothing pushes it off, and its index is rounding
            return state
        before = size
    raise SolverError(f"no stable equilibrium of {rod.nodes} nodes found within {most} descent steps")


def _softest(problem: Statics, state: RodState) -> Array:
    """Unit mode of the lowest eigenvalue of the Hessian over the free unknowns."""
    free = problem.rod.free
    band = problem.assemble(state)[2][free].T.copy()
    for d in range(1, kernels.WIDTH + 1):
        band[d, band.shape[1] - d :] = 0.0
    _, vectors = eig_banded(band, lower=True, select="i", select_range=(0, 0))
    mode = vectors[:, 0]
    return np.asarray(mode / np.abs(mode).max())


def _sheared(rod: Rod, *, breaking: bool, longest: float = _CLOSE) -> RodState | None:
    """The state reached from planar U+ by shearing; stable if `breaking`, else the symmetric one.

    Steps in dW/L are at most `longest`.  None if the symmetric state does not exist that far.
    """
    problem = Statics(rod, _in_shear(rod))
    target = rod.scene.shear
    state = planar(rod)
    line = None
    shear, step = 0.0, np.copysign(longest, target)
    try:
        state, line = equilibrium(problem, state, 0.0)
    except SolverError:
        # far from the small-angle guess: descend instead
        state, line = equilibrium(problem, relax(problem, state, 0.0), 0.0)
    while shear != target:
        following = target if abs(target - shear) <= abs(step) else shear + step
        guess = problem.advance(state, -line.solve(line.slope) * (following - shear), following)
        try:
            new, new_line = equilibrium(problem, guess, following, newton=10)
            # the symmetric state must be followed; of stable ones any will do
            if not breaking and np.abs(new.x - state.x).max() > 6.0 * abs(step):
                raise SolverError("a step onto another sheet")
        except SolverError:
            if abs(step) > 1e-4:
                step *= 0.5
                continue
            if not breaking:
                return None
            new = relax(problem, guess, following)
            new_line = problem.linearise(new, following)
        if breaking and new_line.index:
            kick = 0.01 * _softest(problem, new)
            new = relax(problem, problem.advance(new, kick, following), following)
            new_line = problem.linearise(new, following)
        state, line, shear = new, new_line, following
        step = float(np.copysign(min(longest, 1.5 * abs(step)), target))
    return replace(state, at=0.0)


def _images(rod: Rod, state: RodState | None) -> dict[str, RodState]:
    """A state and its images under the symmetries, by name; none of none."""
    result: dict[str, RodState] = {}
    if state is None:
        return result
    for image in (state, mirrored(state), reversed_(state), mirrored(reversed_(state))):
        result[name(rod, image)] = image
    return result


def stable_states(rod: Rod) -> dict[str, RodState]:
    """The stable pre-deformed states at alpha = 0 that shearing from the planar one reaches, by name."""
    problem = Statics(rod)
    plain = _sheared(rod, breaking=False)
    broken = None if rod.scene.planar else _sheared(rod, breaking=True)
    stable = plain is not None and problem.linearise(plain, 0.0).index == 0
    if plain is not None and broken is not None and np.abs(plain.x - broken.x).max() < _APART:
        # of two that are one but for rounding, at a pitchfork, the one that breaks the symmetry counts
        stable = name(rod, plain) == name(rod, broken)
    states = (_images(rod, plain) if stable else {}) | _images(rod, broken)
    states.pop("", None)
    return states


def _refined(rod: Rod, coarse: Rod, state: RodState) -> RodState:
    """A state of a coarse rod, interpolated onto the nodes and edges of `rod`."""
    x = CubicSpline(coarse.arclength, state.x)(rod.arclength)
    ends, normals = Statics(rod).clamps(0.0)
    x[:2], x[-2:] = ends[:2], ends[2:]
    middles = [0.5 * (r.arclength[1:] + r.arclength[:-1]) for r in (coarse, rod)]
    m1 = CubicSpline(middles[0], state.m1)(middles[1])
    tangent = np.diff(x, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1)[:, None]
    m1 -= (m1 * tangent).sum(axis=1)[:, None] * tangent
    m1 /= np.linalg.norm(m1, axis=1)[:, None]
    m1[0], m1[-1] = normals
    refined = RodState(x, np.empty_like(m1), np.zeros(rod.nodes))
    kernels.carry(tangent, m1, refined.twist, tangent, np.zeros(rod.nodes), refined.m1, refined.twist)
    return refined


def _by_strides(rod: Rod) -> RodState | None:
    """The scene's start by long steps in shear; None if they lose the way, as close to a pitchfork."""
    try:
        broken = _sheared(rod, breaking=True, longest=_STRIDE)
    except SolverError:
        return None
    return _images(rod, broken).get(rod.scene.start)


def _from_coarse(rod: Rod) -> RodState | None:
    """The scene's start by way of a coarse rod, at a fraction of the work; None if that does not lead there.

    Close to a pitchfork the coarse rod may lie on its other side: what comes of it is taken only
    if it is stable and has the name asked for.
    """
    coarse = Rod(rod.scene, _COARSE, rod.clamp)
    wanted = rod.scene.start
    start = _by_strides(coarse)
    if start is None:
        return None
    try:
        problem = Statics(rod)
        relaxed = relax(problem, _refined(rod, coarse, start), 0.0, most=60)
        state, line = equilibrium(problem, relaxed, 0.0)
    except SolverError:
        return None
    return state if line.index == 0 and name(rod, state) == wanted else None


def start_state(rod: Rod) -> RodState:
    """The stable equilibrium that the scene starts from.

    It is kept: the runs of a diagram differ in their ramps alone, and start from one state.

    Raises
    ------
    SceneError
        If the scene's `start` is not a stable equilibrium there; names those that are.
    SolverError
        If the pre-deformation fails.
    """
    return _start_of(rod.scene.at_rest, rod.nodes, rod.clamp).copy()


def met_folds(scene: Scene, nodes: int, clamp: str, steps: Steps | None) -> tuple[Event[RodState], ...]:
    """`curves.ramp_folds` of a scene's rod; they are kept, since folds, normal forms and bounds all ask."""
    # neither damping nor the size of the rate has a part in them
    return _met_folds(_slow(scene), nodes, clamp, steps)


def met_events(scene: Scene, nodes: int, clamp: str, steps: Steps | None) -> tuple[Event[RodState], ...]:
    """The same of `curves.ramp_events`."""
    rod = Rod(_slow(scene), nodes, clamp)
    return ramp_events(Statics(rod), start_state(rod), rod.scene, default_steps(rod, steps))


def _slow(scene: Scene) -> Scene:
    """What a very slow ramp of a scene depends on."""
    if scene.schedule is not None:
        return replace(scene, damping=0.0)
    return replace(scene.at_rest, rate=math.copysign(1.0, scene.rate), stop=scene.stop)


@lru_cache(maxsize=16)
def _met_folds(scene: Scene, nodes: int, clamp: str, steps: Steps | None) -> tuple[Event[RodState], ...]:
    rod = Rod(scene, nodes, clamp)
    return ramp_folds(Statics(rod), start_state(rod), scene, default_steps(rod, steps))


def forget() -> None:
    """Forget the start states and folds that are kept."""
    _start_of.cache_clear()
    _met_folds.cache_clear()


@lru_cache(maxsize=16)
def _start_of(scene: Scene, nodes: int, clamp: str) -> RodState:
    rod = Rod(scene, nodes, clamp)
    if scene.dressed:
        # named where nothing else acts, then all of that is increased from 0 together
        plain = _start_of(replace(scene.plain, drive="left"), nodes, clamp).copy()
        state = brought_on(Loading(rod), plain, scene, default_steps(rod))
        return replace(state, at=scene.begin)
    rod.scene.require_isolated()
    wanted = rod.scene.start
    if not rod.scene.planar and len(wanted) == 4:
        if rod.nodes >= 2 * _COARSE:
            result = _from_coarse(rod)
            if result is not None:
                return result
        # the common case: no need to look at the symmetric state too
        result = _by_strides(rod) or _images(rod, _sheared(rod, breaking=True)).get(wanted)
        if result is not None:
            return result
    states = stable_states(rod)
    if wanted not in states:
        there = ", ".join(sorted(states)) or "none"
        raise SceneError(
            f"Scene.start = {wanted!r}: not a stable equilibrium of the rod at compression = "
            f"{rod.scene.compression:g}, shear = {rod.scene.shear:g}; the stable ones are: {there}"
        )
    return states[wanted]
