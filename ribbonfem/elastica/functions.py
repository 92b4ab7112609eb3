"""The functions of the planar elastica."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ribbonfem.continuation import Event, Steps, equilibrium, first_point, trace
from ribbonfem.continuation.curves import (
    as_fold,
    instability_of,
    ramp_events,
    ramp_folds,
    span_of,
    whole_curve,
)
from ribbonfem.delay import NormalForm, normal_form, scene_departure
from ribbonfem.options import checked, flag
from ribbonfem.results import Array, Branch, Fold, History, Instability, snaps_from
from ribbonfem.scene import Scene, SceneError
from ribbonfem.stepping.control import Control
from ribbonfem.stepping.kernels import Scheme
from ribbonfem.stepping.motion import Motion
from ribbonfem.stepping.newmark import Held, integrate
from ribbonfem.tableaus import Tableau

from . import motion
from . import out_of_plane as sideways
from .problem import Statics, _State
from .states import named

__all__ = [
    "equilibria",
    "escape",
    "folds",
    "frequencies",
    "instabilities",
    "leaves_plane",
    "normal_forms",
    "simulate",
]

# elements at rest and in motion
AT_REST, ELEMENTS = 16, 8
TOLERANCE = 3e-5


def _problem(scene: Scene, elements: int, extensible: bool) -> tuple[Statics, _State]:
    """The equations of a beam that buckles, and a guess at its start.

    Raises
    ------
    SceneError, OptionError
        For a scene that is not planar, one that its stretch keeps flat, a mesh that cannot be; where
        the start is lost while what acts is brought on.
    """
    if flag("extensible", extensible):
        scene.require_planar("elastica")
        scene.require_buckled()
    problem, start = named(scene, elements, extensible)
    above = scene.compression - scene.ribbon.euler_shortening if extensible else np.inf
    if above < 1e-3 * scene.compression and not scene.dressed:
        # this close a mesh may be below its own Euler's load
        height = problem.observe(equilibrium(problem, start, 0.0)[0], 0.0)[0]
        if not problem.side * height > 0.1 * above**0.5:
            raise SceneError(
                f"Scene.compression = {scene.compression!r}: so close above Euler's load, "
                f"{scene.ribbon.euler_shortening!r}, the beam of {problem.elements} elements stays flat"
            )
    return problem, start


def _folds(
    problem: Statics, start: _State, scene: Scene, steps: Steps | None = None
) -> tuple[Event[_State], ...]:
    """As `ramp_folds`, which looks where a ramp lands beyond each fold.

    A clamp that is turned against its beam meets one, beyond which the beam is on the other side.
    """
    limit = 2.0 * math.pi if scene.furthest is None else abs(scene.furthest)
    plain = scene.drive in ("left", "right") and not scene.dressed
    if plain and scene.direction * problem.side > 0.0:
        point = first_point(problem, start, 0.0, scene.direction)
        for segment in trace(problem, point, (-limit, limit), steps):
            if segment.end.index or segment.events:
                fold = segment.events[0] if segment.events else None
                if fold is not None and fold.kind == "fold" and segment.start.index == 0:
                    return (fold,)
                break
        else:
            return ()
    return ramp_folds(problem, start, scene, steps)


@checked
def folds(
    scene: Scene, *, elements: int = AT_REST, extensible: bool = False, steps: Steps | None = None
) -> tuple[Fold, ...]:
    """The folds that a very slow ramp meets (one, on the side of the start state).

    Parameters
    ----------
    scene: a planar scene.
    elements: of degree 5, at least 4; errors fall as elements^-10.
    extensible: whether the beam stretches, with EA of the rectangular section.
    steps: continuation step control.

    Raises
    ------
    SceneError, OptionError, SolverError
        For a scene that is not planar, a mesh that cannot be, a continuation that fails.
    """
    problem, start = _problem(scene, elements, extensible)
    found = _folds(problem, start, scene, steps)
    of = {"model": "elastica", "scene": scene, "policy": {"elements": elements, "extensible": extensible}}
    return tuple(as_fold(problem, event.point, **of) for event in found)


@checked
def instabilities(
    scene: Scene, *, elements: int = AT_REST, extensible: bool = False, steps: Steps | None = None
) -> tuple[Instability, ...]:
    """Where the state that a slow ramp follows is lost, in order: folds, up to the first that is none.

    In the plane by the curve of equilibria, out of it by the second variation.  Parameters and errors as in
    `folds`.
    """
    problem, start = _problem(scene, elements, extensible)
    of: dict[str, Any] = {"model": "elastica"}
    of["policy"] = {"elements": elements, "extensible": extensible}
    found = ramp_events(problem, start, scene, steps)
    points = [instability_of(problem, event, scene, steps, of) for event in found]
    across = sideways.lost_at(problem, start, scene)
    if across is None or (points and scene.direction * (points[0].control - float(across.parameter)) < 0.0):
        return tuple(points)
    control = float(across.parameter)
    height, _, load = problem.observe(across.state, control)
    # the planar state is its own mirror image: no quadratic term; the cubic one is not known in the plane
    return (Instability(control, "pitchfork", False, True, height, load, scene=scene, **of),)


@checked
def normal_forms(
    scene: Scene, *, elements: int = ELEMENTS, extensible: bool = False
) -> tuple[NormalForm, ...]:
    """The normal forms of the folds that a very slow ramp meets: what `delay.predict` needs.

    The default mesh is that of `simulate`; parameters and errors as in `folds`.
    """
    problem, start = _problem(scene, elements, extensible)
    return tuple(normal_form(problem, fold) for fold in _folds(problem, start, scene))


@checked
def leaves_plane(scene: Scene, *, elements: int = AT_REST, extensible: bool = False) -> float:
    """The control at which the planar state at rest loses its stability out of its plane.

    From the second variation, bending about the normal and twist, of the states from the control's start in
    the direction of the scene's rate to its `stop`, or to their fold.  Parameters and errors as in
    `folds`.

    Returns
    -------
    NaN where they do not lose it; where the control starts, where the start has not got it.
    """
    _problem(scene, elements, extensible)
    return sideways.leaves_plane(scene, elements, extensible)


@checked
def frequencies(scene: Scene, *, count: int = 6, elements: int = AT_REST, extensible: bool = False) -> Array:
    """The lowest `count` angular frequencies (count,) of undamped motions about the start state, 1/s.

    Parameters and errors as in `folds`.
    """
    problem, start = _problem(scene, elements, extensible)
    return motion.vibrations(problem, equilibrium(problem, start, scene.begin)[0], count)


@checked
def equilibria(
    scene: Scene,
    *,
    elements: int = AT_REST,
    extensible: bool = False,
    span: tuple[float, float] | None = None,
    unstable: int = 2,
    steps: Steps | None = None,
) -> Branch:
    """The connected curve of equilibria through the start state, for controls in `span`.

    Parameters and errors as in `folds`; `span` with the control's start inside, by default (-1.5, 1.5) of
    angles, 30 EI2/L^2 of forces, and what the chord allows of lengths.  The curve climbs through ever
    higher modes: it ends with the first state of more than `unstable` unstable directions.
    """
    problem, start = _problem(scene, elements, extensible)
    span = span or span_of(scene)
    curve = whole_curve(problem, start, span, steps, unstable, scene.begin)
    policy = {"elements": elements, "extensible": extensible, "span": span, "unstable": unstable}
    return curve.as_branch(scene, policy, "elastica", problem.arclength)


def _integrated(
    problem: Statics,
    state: _State,
    scene: Scene,
    control: Control,
    held: Held | None = None,
    every: int | None = None,
    since: float = 0.0,
) -> Motion:
    """The motion from an equilibrium, or held beside it."""
    u = motion.at_rest(problem, state)

    def begin(scheme: Scheme, rows: int, velocity: Array | None) -> motion.Motion:
        return motion.Motion(problem, u, scheme, rows, velocity)

    return integrate("elastica", begin, scene, control, len(problem.arclength), held, every, since)


@checked
def simulate(
    scene: Scene,
    *,
    elements: int = ELEMENTS,
    extensible: bool = False,
    method: str | Tableau = "esdirk4",
    step: float | None = None,
    tolerance: float | None = None,
    spectral_radius: float | None = None,
    every: int | None = None,
    until: str = "end",
) -> History:
    """The motion from rest in the start state, through the ramp and the hold.

    Parameters
    ----------
    scene: a planar scene with a `stop` or a `schedule`.
    elements: of degree 5, at least 4; errors fall as elements^-10.
    extensible: whether the beam stretches, with EA of the rectangular section.
    method: "esdirk4", "esdirk3" (`ribbonfem.tableaus`), "tr-bdf2", "generalised-alpha", "newmark"
        (trapezoidal) or "implicit-euler".
    step: a fixed step in s, shortened so that a whole number of steps fits the ramp, and halved
        where no next state is found.
    tolerance: of the adaptive step, the local error of positions in L, made smaller while the
        beam creeps (down to 0.01 of it); 3e-5 if neither is given,
        which leaves 3e-6 rad in a snap's angle in the median of drawn scenes and 7e-5 at most, where the
        mesh leaves 1e-8 and 2e-5 (`pytest -m slow -s -n 0 tests/test_defaults.py`).
    spectral_radius: of "generalised-alpha" at infinite frequency, in (0, 1]; 0.8.
    every: keep the rows of each `every`-th accepted step, and the last; None keeps all up to 160 MB, and
        thins them out then (`History`).
    until: "end", or "snap", soon after the height first changes sign.

    Returns
    -------
    `History`, with the nodes' "positions" (rows, nodes, 3) in L and "curvature" (rows, nodes) in 1/L as
        configurations.

    Raises
    ------
    SceneError, OptionError
        For a scene that is not planar, one without `stop`, a policy that cannot be.
    SolverError
        If no step converges; what was reached is its `history`.
    """
    control = Control.of(method, step, tolerance, until, spectral_radius, TOLERANCE)
    problem, start = _problem(scene, elements, extensible)
    scene.require_stop()
    state, _ = equilibrium(problem, start, scene.begin)
    since = 0.0
    if until == "snap" and not scene.usual:
        # a snap is asked for: what is one is said by the states at rest
        since = snaps_from(scene, "elastica", {"elements": elements, "extensible": extensible}) / problem.unit
    moved = _integrated(problem, state, scene, control, every=every, since=since)
    policy = {
        "elements": elements,
        "extensible": extensible,
        "method": method,
        "step": step,
        "tolerance": control.tolerance,
        "spectral_radius": spectral_radius,
        "every": every,
        "until": until,
    }
    return moved.as_history(scene, policy, model="elastica", arclength=problem.arclength)


@checked
def escape(
    scene: Scene,
    *,
    fold: int = 0,
    amplitude: float = 3e-3,
    elements: int = ELEMENTS,
    extensible: bool = False,
    tolerance: float = 1e-6,
    until: str = "end",
) -> History:
    """The motion that leaves a fold at the fold's own angle, the clamp held there.

    It starts displaced along the fold's null vector, all else in equilibrium, with the velocity of
    the unstable solution of the normal form; the scene says the start, the direction and the damping.

    Parameters
    ----------
    fold: which of the `folds` of a ramp, from 0.
    amplitude: of the null vector, in L with the whole beam of mass 1, of [1e-5, 0.05].
    tolerance: of the adaptive step, the local error of positions in L.
    elements, extensible, until: as in `simulate`.

    Raises
    ------
    OptionError, SolverError
        For a fold that is not met, an amplitude or a policy that cannot be; as in `simulate`.
    """
    control = Control.of("esdirk4", None, tolerance, until, None, TOLERANCE)
    problem, start = _problem(scene, elements, extensible)
    found, duration = scene_departure(problem, start, scene, fold, amplitude)
    velocity = problem.moving(found.state, found.velocity)
    # the right clamp, to the last digit
    velocity[-1] = 0.0
    moved = _integrated(problem, found.state, scene, control, Held(found.form.angle, velocity, duration))
    policy = {
        "fold": fold,
        "amplitude": amplitude,
        "elements": elements,
        "extensible": extensible,
        "tolerance": tolerance,
        "until": until,
    }
    return moved.as_history(scene, policy, model="elastica", arclength=problem.arclength)
