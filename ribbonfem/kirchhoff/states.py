"""Start states of the ribbon by name (U+S+, ...) at alpha = 0: found, classified, and where they bifurcate.

A ribbon sheared from the planar buckled state U keeps z(s) = z(1 - s) until a pitchfork, at which
that symmetry breaks (US); at a second one, z(1/2) reaches 0 (S); past a third the unbroken U is
stable again, beside S (paper, appendices A and B; T. Yu and J. Hanna, J. Mech. Phys. Solids 122
(2019) 657).  At alpha = 0 two symmetries carry every state into its kin (paper, appendix A):

    mirror    z -> -z                    U changes its sign, S keeps it
    reversal  r(s) -> R - r(1 - s)       U and S change their signs
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache

import numpy as np

from ribbonfem.continuation import (
    Event,
    Point,
    Segment,
    Steps,
    equilibrium,
    first_point,
    solution,
    switch,
    trace,
)
from ribbonfem.continuation.curves import tolerance_for
from ribbonfem.continuation.loading import brought_on
from ribbonfem.elements.lobatto import interpolation
from ribbonfem.ends import Ends
from ribbonfem.results import SolverError
from ribbonfem.scene import Scene, SceneError

from .loading import Loading
from .problem import Frames, Statics
from .symmetric import Symmetric

# what counts as zero of heights (L) and slopes when a state is named
_FLAT = 1e-7
# dW/L from a fork within which states may not be told apart, z(1/2)/L of US that near to its tip, and at it,
# where rounding decides whether the curve turns before a shear or behind it
_RESOLVED, _MERGING, _TIP = 1e-6, 1e-2, 3e-6
# elements of the mesh on which a start is first looked for
_COARSE = 4
_FAMILIES = {"U": ("U+", "U-"), "US": ("U+S+", "U+S-", "U-S+", "U-S-"), "S": ("S+", "S-")}


def mirrored(state: Frames) -> Frames:
    """The mirror image z -> -z; alpha changes its sign."""
    return Frames(state.g * [1.0, -1.0, -1.0, 1.0], state.force * [1.0, 1.0, -1.0])


def reversed_(state: Frames) -> Frames:
    """The image r(s) -> R - r(1 - s), an equilibrium where alpha = 0."""
    return Frames(state.g[::-1].copy(), state.force)


def sheared_back(state: Frames) -> Frames:
    """The mirror image y -> -y; the shear changes its sign."""
    return Frames(state.g * [1.0, -1.0, 1.0, -1.0], state.force * [1.0, -1.0, 1.0])


def name_of(problem: Statics, state: Frames, parameter: float) -> str:
    """U and S signs of a state: of z(1/2), and of x(1/2) against half the chord.

    S alone (z(1/2) = 0) has x(1/2) in the middle; its sign is that of the U+S states which merge
    into it: S+ has t_z(1/2) < 0.
    """
    position, tangent = problem.middle(state)
    half = 0.5 * problem.ends.reach(parameter)[0][0]
    u = "" if abs(position[2]) < _FLAT else "U+" if position[2] > 0.0 else "U-"
    if abs(tangent[2]) < _FLAT:
        return u
    if not u:
        return "S+" if tangent[2] < 0.0 else "S-"
    return u + ("S+" if position[0] > half else "S-")


def _taut(compression: float) -> float:
    """The shear at which the chord is as long as the ribbon."""
    return float(np.sqrt(compression * (2.0 - compression)))


def most_shear(compression: float) -> float:
    """A shear short of the one at which the chord is as long as the ribbon and the force infinite."""
    return 0.98 * _taut(compression)


def shear_steps(problem: Statics) -> Steps:
    """Steps that are short against the range of feasible shears."""
    limit = _taut(problem.compression)
    return Steps(first=0.02 * limit, largest=0.1 * limit, tolerance=tolerance_for(problem.ribbon))


def _strides(compression: float) -> Steps:
    """Steps that lead to a guess at a state, and locate its fork no better than that needs."""
    limit = _taut(compression)
    return Steps(first=0.15 * limit, largest=0.15 * limit, turn=0.5, tolerance=3e-4, location=0.1)


def _beginning(problem: Statics, limit: float, tolerance: float) -> Point[Frames]:
    """The first point of the curve of U+ in the shear: planar, or sheared if the rod is of one stiffness.

    Without shear such a rod turns freely about the x axis: that mode's eigenvalue is rounding, so that
    rounding would decide the index, and how much of the mode is in the tangent.  A ratio larger by
    1e-6 lifts the eigenvalue by 5e-4 and leads to a shear at which it is 10 dW^2 or more by itself.
    """
    compression = problem.compression
    start = problem.buckled(compression)
    if not problem.one_stiffness:
        return first_point(problem, start, 0.0, 1.0, tolerance=tolerance)
    lifted = problem.stiffened(1e-6)
    first = first_point(lifted, start, 0.0, 1.0)
    shear = min(0.02 * most_shear(compression), 0.5 * limit)
    guess = lifted.advance(first.state, first.direction * (shear / first.rate), shear)
    state = solution(lifted, guess, shear)
    return first_point(problem, state, shear, 1.0)


def unbroken(problem: Statics, limit: float, steps: Steps) -> Iterator[Segment[Frames]]:
    """The curve of U+ in the shear, from `_beginning` to `limit`."""
    first = _beginning(problem, limit, steps.exact)
    for segment in trace(problem, first, (-limit, limit), steps, unstable=8):
        yield segment
        if segment.end.parameter < 0.0:
            break
    else:
        return
    # beyond dL/L = 0.905 the planar U is unstable out of its plane, and the curve turns to negative shears;
    # its mirror image goes on where US is looked for
    back = first_point(problem, sheared_back(segment.end.state), -segment.end.parameter, 1.0)
    yield from trace(problem, back, (-limit, limit), steps, unstable=8)


def forked(problem: Statics, event: Event[Frames], limit: float, steps: Steps) -> Iterator[Segment[Frames]]:
    """The curve that forks from U at `event`, to the shear `limit` or past its tip, where z(1/2) = 0."""
    if event.point.parameter < 1e-6:
        # a fork at no shear is the free turning of a rod of one stiffness
        return
    amplitude, point = 0.5 * steps.first, None
    while point is None or point.parameter >= limit:
        # the fork is steep in the shear at first, so that little amplitude needs little shear
        if amplitude < 1e-6:
            return
        try:
            point = switch(problem, event, amplitude, steps)
        except SolverError:
            # the stiffer the ribbon, the sooner the fork bends away from its null vector
            point = None
        amplitude *= 0.5
    for segment in trace(problem, point, (event.point.parameter - 0.1, limit), steps, unstable=8):
        yield segment
        if tip_of(problem, segment) is not None:
            return


def tip_of(problem: Statics, segment: Segment[Frames]) -> Point[Frames] | None:
    """The point of a segment at which z(1/2) changes its sign, which is where the fork turns back."""
    heights = [problem.observe(point.state, point.parameter)[0] for point in (segment.start, segment.end)]
    return segment.events[-1].point if segment.events and heights[0] * heights[1] <= 0.0 else None


def fork_of(
    problem: Statics, event: Event[Frames], limit: float, steps: Steps
) -> tuple[Point[Frames], Point[Frames] | None] | None:
    """Follow the states that fork from U at `event` towards the shear `limit`.

    Returns
    -------
    The state at `limit` and None, or the last one before the tip of the fork and the tip; None
    if the curve comes to neither.
    """
    for segment in forked(problem, event, limit, steps):
        tip = tip_of(problem, segment)
        if tip is not None:
            return segment.start, tip
        if segment.last and segment.end.parameter == limit:
            return segment.end, None
    return None


def merged(problem: Statics, tip: Point[Frames], limit: float) -> Point[Frames]:
    """The state S at a shear a little past the tip of US, or at `limit`, from the state at the tip."""
    g = tip.state.g + tip.state.g[::-1]
    guess = Frames(g / np.linalg.norm(g, axis=1)[:, None], tip.state.force)
    # among symmetric states nothing is singular at the tip
    even = Symmetric(problem, "S")
    for past in (0.02, 0.005, 0.001):
        # stiff ribbons ask for a closer guess
        shear = min(limit, tip.parameter + past * np.sqrt(problem.compression))
        try:
            state = solution(even, guess, shear)
            break
        except SolverError:
            if past == 0.001:
                raise
    return first_point(even, state, shear, 1.0)


def families(problem: Statics, shear: float) -> dict[str, tuple[Frames, int]]:
    """The states U, US and S (one of each kind) at alpha = 0 and a shear >= 0, with their indices.

    US and S are looked for on the curves that fork from U at smaller shears.
    """
    if shear == 0.0:
        state, line = equilibrium(problem, problem.buckled(problem.compression), 0.0)
        # a neutral state is no stable one, whatever rounding makes of its eigenvalue
        return {"U": (state, max(line.index, int(problem.one_stiffness)))}
    result: dict[str, tuple[Frames, int]] = {}
    events: list[Event[Frames]] = []
    steps = shear_steps(problem)
    for segment in unbroken(Symmetric(problem, "U"), shear, steps):
        events.extend(event for event in segment.events if event.kind == "branch point")
        if segment.last == "span":
            result["U"] = segment.end.state, segment.end.index
    for event in events:
        if len(result) < 2:
            result |= _forked(problem, event, shear, steps)
    if "U" in result and events and shear - events[0].point.parameter < _RESOLVED:
        # rounding would decide: stable itself, or what is resolved beside it
        result["U"] = result["U"][0], int("US" in result)
        if "US" in result:
            result["US"] = result["US"][0], 0
    return result


def _forked(
    problem: Statics, event: Event[Frames], shear: float, steps: Steps
) -> dict[str, tuple[Frames, int]]:
    """The state US or S at a shear, with its index, on the curve that forks from U at `event`; or none.

    So near to the tip of US that it is not resolved beside S, this one stands for both.
    """
    tip = last = None
    try:
        for segment in forked(problem, event, shear, steps):
            last, tip = segment.end, tip_of(problem, segment)
            if tip is None and segment.last and last.parameter == shear:
                if abs(problem.observe(last.state, shear)[0]) > _TIP:
                    return {"US": (last.state, last.index)}
                tip = last
    except SolverError:
        if shear - event.point.parameter < _RESOLVED:
            return {}
        if last is None or abs(problem.observe(last.state, last.parameter)[0]) > _MERGING:
            raise
        tip = last
    if tip is None:
        return {}
    point = merged(problem, tip, shear)
    if point.parameter < shear:
        for segment in trace(Symmetric(problem, "S"), point, (-shear, shear), steps, 8):
            point = segment.end
    if point.parameter != shear:
        return {}
    return {"S": (point.state, 0 if abs(shear - tip.parameter) < _RESOLVED else point.index)}


def _stable(result: dict[str, tuple[Frames, int]]) -> list[str]:
    return [
        name for family, names in _FAMILIES.items() if result.get(family, (None, 1))[1] == 0 for name in names
    ]


def in_shear(scene: Scene, elements: int, extensible: bool) -> Statics:
    """The equations in the shear of a scene's ribbon at its compression."""
    if extensible:
        scene.require_buckled()
    ends = Ends.varying("dW", scene.compression, 0.0)
    return Statics(scene.ribbon, ends, elements=elements, extensible=extensible)


def in_control(scene: Scene, elements: int, extensible: bool) -> Statics:
    """The equations in the control of a scene."""
    return Statics(scene.ribbon, Ends.of(scene), elements=elements, extensible=extensible)


def stable(scene: Scene, *, elements: int, extensible: bool) -> tuple[str, ...]:
    """Names of the states that are stable at alpha = 0."""
    if not scene.isolated:
        return ()
    return tuple(_stable(families(in_shear(scene, elements, extensible), abs(scene.shear))))


def named(scene: Scene, *, elements: int, extensible: bool) -> tuple[Statics, Frames]:
    """The equations in the control of a scene, and its start state, stable there.

    The state is kept: the runs of a diagram differ in their ramps alone, and start from one state.

    Raises
    ------
    SceneError
        If it is not a stable equilibrium there; the message names those that are.
    """
    kept = _start_of(scene.at_rest, elements, extensible)
    return in_control(scene, elements, extensible), Frames(kept.g.copy(), kept.force.copy(), kept.at)


def forget() -> None:
    """Forget the start states that are kept."""
    _start_of.cache_clear()


def _images(problem: Statics, state: Frames, shear: float) -> dict[str, Frames]:
    """A state at alpha = 0 and a shear >= 0, and its images under the symmetries, by name.

    The state itself comes last, so that it counts where an image has its name.
    """
    images = (mirrored(reversed_(state)), reversed_(state), mirrored(state), state)
    return {name_of(problem, image, shear): image for image in images}


def _roughly(scene: Scene, extensible: bool) -> Frames | None:
    """A guess at a scene's US state, by long steps on a coarse mesh; None if they do not lead there."""
    problem, shear = in_shear(scene, _COARSE, extensible), abs(scene.shear)
    steps = _strides(scene.compression)
    try:
        # not cut off at the shear: what is looked for lies before it
        for segment in unbroken(problem, most_shear(scene.compression), steps):
            for event in segment.events:
                fork = fork_of(problem, event, shear, steps) if event.point.parameter < shear else None
                if fork is None or fork[1] is not None:
                    return None
                return _images(problem, fork[0].state, shear).get(scene.start)
            if segment.end.parameter > shear:
                return None
    except SolverError:
        pass
    return None


def _from_coarse(scene: Scene, elements: int, extensible: bool) -> Frames | None:
    """A scene's US state by way of `_roughly`, at a fraction of the work; None if that does not lead there.

    What comes of the guess is taken only if it is stable and has the name asked for.
    """
    state = _roughly(scene, extensible)
    if state is None:
        return None
    if scene.shear < 0.0:
        state = sheared_back(state)
    problem = in_control(scene, elements, extensible)
    if elements != _COARSE:
        g = interpolation(_COARSE, elements, problem.tables.degree) @ state.g
        g /= np.linalg.norm(g, axis=1)[:, None]
        # Newton does not move what the clamps hold
        g[[0, -1]] = state.g[[0, -1]]
        state = Frames(g, state.force)
    try:
        result, line = equilibrium(problem, state, 0.0, newton=6)
    except SolverError:
        return None
    return result if line.index == 0 and name_of(problem, result, 0.0) == scene.start else None


@lru_cache(maxsize=16)
def _start_of(scene: Scene, elements: int, extensible: bool) -> Frames:
    if scene.dressed:
        # named where nothing else acts, then all of that is increased from 0 together
        start = _start_of(scene.plain, elements, extensible)
        state = brought_on(Loading(in_control(scene, elements, extensible), scene), start, scene)
        return Frames(state.g, state.force, scene.begin)
    scene.require_isolated()
    if scene.start in _FAMILIES["US"]:
        near = _from_coarse(scene, elements, extensible)
        if near is not None:
            return near
    sheared = in_shear(scene, elements, extensible)
    shear = abs(scene.shear)
    result = families(sheared, shear)
    allowed = _stable(result)
    if scene.start not in allowed:
        raise SceneError(
            f"Scene.start = {scene.start!r}: not a stable equilibrium at compression = "
            f"{scene.compression!r}, shear = {scene.shear!r}; the states that are: "
            f"{', '.join(allowed) or 'none'}"
        )
    family = next(family for family, names in _FAMILIES.items() if scene.start in names)
    state = result[family][0]
    # two symmetries reach every sign
    images = _images(sheared, state, shear)
    if scene.start not in images:
        raise SceneError(
            f"Scene.start = {scene.start!r}: at compression = {scene.compression!r}, shear = {scene.shear!r} "
            f"the heights and slopes that tell the states apart are below {_FLAT:g}"
        )
    state = images[scene.start]
    if scene.shear < 0.0:
        state = sheared_back(state)
    problem = in_control(scene, elements, extensible)
    try:
        settled = solution(problem if family == "US" else Symmetric(problem, family), state, 0.0)
    except SolverError:
        settled = state
    # at a fork it is as near to equilibrium as it can be told, and Newton goes to its image or nowhere
    return settled if name_of(problem, settled, 0.0) == scene.start else state
