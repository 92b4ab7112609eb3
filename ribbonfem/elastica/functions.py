"""Public functions of the elastica at rest: folds, instabilities, equilibria, normal forms, frequencies."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from ribbonfem.continuation import Event, Steps, first_point, solution, trace
from ribbonfem.continuation.curves import (
    as_fold,
    instability_of,
    lost_before_fold,
    ramp_events,
    ramp_folds,
    span_of,
    whole_curve,
)
from ribbonfem.continuation.two_parameters import fold_curve_of, pitchfork_curve_of
from ribbonfem.delay import NormalForm, normal_form
from ribbonfem.ends.second_parameter import SecondParameter
from ribbonfem.options import checked, options_given, refuse
from ribbonfem.results import (
    Array,
    Branch,
    Fold,
    FoldCurve,
    Instability,
    PitchforkCurve,
    RestState,
    SolverError,
    control_text,
)
from ribbonfem.scene import Scene

from . import out_of_plane
from .discretisation import vibrations
from .motion import ELEMENTS
from .problem import Statics, _State
from .states import named, rest_state

__all__ = [
    "equilibria",
    "fold_curve",
    "folds",
    "frequencies",
    "instabilities",
    "leaves_plane",
    "normal_forms",
    "pitchfork_curve",
    "state",
]

# elements at rest
AT_REST = 16


def _folds(
    problem: Statics, start: _State, scene: Scene, steps: Steps | None = None
) -> tuple[Event[_State], ...]:
    """As `ramp_folds`, in the plane and out of it.

    A rod of one stiffness turns freely out of its plane: that is not lost, and not looked at.
    """
    if scene.ribbon.one_stiffness:
        return _in_plane(problem, start, scene, steps)
    if scene.one_clamp:
        result = _in_plane(problem, start, scene, steps)
        # the state at the fold tells of all before it
        if not result or not out_of_plane.OutOfPlane(problem, scene.ribbon).index(result[0].point.state):
            return result
    across = out_of_plane.lost_at(problem, start, scene)
    try:
        result = _in_plane(problem, start, scene, steps)
    except SolverError:
        if across is None:
            raise
        raise lost_before_fold(scene, float(across.parameter)) from None
    if across is not None and result:
        raise lost_before_fold(scene, float(across.parameter))
    return result


def _in_plane(
    problem: Statics, start: _State, scene: Scene, steps: Steps | None
) -> tuple[Event[_State], ...]:
    """As `ramp_folds`, which looks where a ramp lands beyond each fold.

    A clamp that is turned against its beam meets one, beyond which the beam is on the other side.
    """
    limit = 2.0 * math.pi if scene.furthest is None else abs(scene.furthest)
    if scene.one_clamp and scene.direction * problem.side > 0.0:
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
        For a scene that is not planar, a mesh that cannot be, a continuation that fails; for a state that is
        lost at another point than a fold before any fold, out of its plane too: see `instabilities`.
    """
    problem, start = named(scene, elements, extensible)
    result = _folds(problem, start, scene, steps)
    of = {"model": "elastica", "scene": scene, "options": options_given()}
    return tuple(as_fold(problem, event.point, **of) for event in result)


@checked
def instabilities(
    scene: Scene, *, elements: int = AT_REST, extensible: bool = False, steps: Steps | None = None
) -> tuple[Instability, ...]:
    """Where the state that a slow ramp follows is lost, in order: folds, up to the first that is none.

    In the plane by the curve of equilibria, out of it by the second variation.  Parameters and errors as in
    `folds`.
    """
    problem, start = named(scene, elements, extensible)
    return _lost(problem, start, scene, steps, options_given())


def instabilities_from(
    scene: Scene, rest: Mapping[str, Array], *, elements: int, extensible: bool = False
) -> tuple[Instability, ...]:
    """`instabilities` of the state in which a motion begins, `History.rest`, in place of the `start`."""
    start = _State(rest["phi"], rest["force"], scene.begin)
    of = {"elements": elements, "extensible": extensible}
    return _lost(Statics(scene, elements, extensible), start, scene, None, of)


def _lost(
    problem: Statics, start: _State, scene: Scene, steps: Steps | None, options: dict[str, Any]
) -> tuple[Instability, ...]:
    of: dict[str, Any] = {"model": "elastica", "options": options}
    across = out_of_plane.lost_at(problem, start, scene)
    if across is None:
        result = ramp_events(problem, start, scene, steps)
        return tuple(instability_of(problem, event, scene, steps, of) for event in result)
    control = float(across.parameter)
    height, _, load = problem.observe(across.state, control)
    # the planar state is its own mirror image: no quadratic term; the cubic one is not known in the plane
    return (Instability(control, "pitchfork", False, True, height, load, scene=scene, **of),)


@checked
def fold_curve(
    scene: Scene,
    *,
    over: str,
    span: tuple[float, float],
    which: int = 0,
    elements: int = AT_REST,
    extensible: bool = False,
    steps: Steps | None = None,
) -> FoldCurve:
    """One of the scene's folds over a second parameter, through the curve's turns and cusps.

    Parameters
    ----------
    scene, span, which: as in `kirchhoff.fold_curve`.
    over: as in `kirchhoff.fold_curve`, of the plane: no "shear".
    elements, extensible, steps: as in `folds`.

    Raises
    ------
    SceneError, OptionError, SolverError
        As in `kirchhoff.fold_curve`.
    """
    parameter = SecondParameter.of(scene, over, span, planar=True)
    problem, start = named(scene, elements, extensible)
    events = _folds(problem, start, scene, steps)
    of = {"model": "elastica", "options": options_given()}
    return fold_curve_of(problem, events, which, scene, parameter, steps or Steps(), **of)


@checked
def pitchfork_curve(
    scene: Scene,
    *,
    over: str,
    span: tuple[float, float],
    which: int = 0,
    elements: int = AT_REST,
    extensible: bool = False,
    steps: Steps | None = None,
) -> PitchforkCurve:
    """One of the scene's pitchforks in its plane over a second parameter that keeps its symmetry.

    Parameters and errors as in `fold_curve`; `which` is the number among those `instabilities` that are no
    folds.  A parameter that breaks the symmetry unfolds the pitchfork, and is refused.
    """
    parameter = SecondParameter.of(scene, over, span, planar=True)
    problem, start = named(scene, elements, extensible)
    across = out_of_plane.lost_at(problem, start, scene)
    if across is not None:
        refuse(
            "which",
            which,
            f"the state is lost out of its plane, at {control_text(scene, across.parameter)}: what crosses "
            "there, kirchhoff and der follow",
        )
    events = ramp_events(problem, start, scene, steps)
    of = {"model": "elastica", "options": options_given()}
    return pitchfork_curve_of(problem, events, which, scene, parameter, steps or Steps(), **of)


@checked
def normal_forms(
    scene: Scene, *, elements: int = ELEMENTS, extensible: bool = False
) -> tuple[NormalForm, ...]:
    """The normal forms of the folds that a very slow ramp meets: what `delay.predict` needs.

    The default mesh is that of motions where none coarser will do (`simulate`); parameters and errors as in
    `folds`.
    """
    problem, start = named(scene, elements, extensible)
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
    named(scene, elements, extensible)
    return out_of_plane.leaves_plane(scene, elements, extensible)


@checked
def frequencies(scene: Scene, *, count: int = 6, elements: int = AT_REST, extensible: bool = False) -> Array:
    """The lowest `count` angular frequencies (count,) of undamped motions about the start state, 1/s.

    Parameters and errors as in `folds`.
    """
    problem, start = named(scene, elements, extensible)
    return vibrations(problem, solution(problem, start, scene.begin), count)


@checked
def state(scene: Scene, *, elements: int = AT_REST, extensible: bool = False) -> RestState:
    """The scene's start state, stable in its plane.

    Parameters and errors as in `folds`.
    """
    problem, start = named(scene, elements, extensible)
    return rest_state(problem, solution(problem, start, scene.begin), scene)


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
    angles, 30 EI2/L^2 of forces, .98 of what the chord allows of lengths: by default these go towards a taut
    ribbon as far as the mesh follows it.  The curve goes on through ever higher modes: it ends with the first
    state of more than `unstable` unstable directions.
    """
    problem, start = named(scene, elements, extensible)
    curve = whole_curve(problem, start, span, scene, steps, unstable)
    return curve.as_branch(scene, options_given(span=span or span_of(scene)), "elastica", problem.arclength)
