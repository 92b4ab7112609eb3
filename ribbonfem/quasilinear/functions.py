"""Public functions of the quasi-linear beam at rest: folds, instabilities, equilibria, frequencies."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from ribbonfem.closed_form import (
    ClosedFormBranch,
    ClosedFormFold,
    closed_form_branch,
    closed_form_fold,
)
from ribbonfem.continuation import Steps
from ribbonfem.continuation.curves import (
    as_fold,
    instability_of,
    ramp_events,
    ramp_folds,
    span_of,
    whole_curve,
)
from ribbonfem.continuation.two_parameters import fold_curve_of, pitchfork_curve_of
from ribbonfem.delay import NormalForm, ramp_normal_forms
from ribbonfem.ends.second_parameter import SecondParameter
from ribbonfem.options import checked, options_given
from ribbonfem.results import Array, Branch, Fold, FoldCurve, Instability, PitchforkCurve
from ribbonfem.scene import Scene

from .problem import Statics, _State
from .states import named

__all__ = [
    "ClosedFormBranch",
    "ClosedFormFold",
    "closed_form_branch",
    "closed_form_fold",
    "equilibria",
    "fold_curve",
    "folds",
    "frequencies",
    "instabilities",
    "normal_forms",
    "pitchfork_curve",
]

# degree of the one element that is asked for frequencies
_FOR_MODES = 24


@checked
def folds(
    scene: Scene, *, elements: int = 1, degree: int | None = None, steps: Steps | None = None
) -> tuple[Fold, ...]:
    """The folds that a very slow ramp meets (one, at mu = 1.7818 from U+ as alpha grows).

    Parameters
    ----------
    scene: a planar scene.
    elements: one of degree 18, whose folds are exact to 1e-12, or at least 4 cubic Hermite elements, whose
        errors fall as elements^-4.
    degree: of the elements, if another: above 3 there are bubbles beside the Hermite functions, and any
        number of elements will do.
    steps: continuation step control; None solves the branch's own equation in sigma (`problem`).

    Raises
    ------
    SceneError, OptionError, SolverError
        For a scene that is not planar or heavy along x, a mesh that cannot be, a continuation that fails.
    """
    problem, start = named(scene, elements, degree)
    of: dict[str, Any] = {"model": "quasilinear", "scene": scene, "options": problem.options}
    if steps is not None or not scene.one_clamp:
        result = ramp_folds(problem, start, _within_reach(scene), steps)
        return tuple(as_fold(problem, event.point, **of) for event in result)
    fold = Fold(*problem.fold(), **of)
    # turned with it the start state never folds
    met = fold.angle * scene.rate > 0.0 and (scene.stop is None or abs(fold.angle) <= abs(scene.stop))
    return (fold,) if met else ()


def _within_reach(scene: Scene) -> Scene:
    """The scene, stopped where mu is 4, far beyond its fold: a coarse mesh cannot bend much further."""
    limit = 4.0 * scene.compression**0.5
    if (
        not scene.clamps_turn
        or scene.schedule is not None
        or (scene.stop is not None and abs(scene.stop) <= limit)
    ):
        return scene
    return replace(scene, stop=scene.direction * limit)


@checked
def instabilities(
    scene: Scene, *, elements: int = 1, degree: int | None = None, steps: Steps | None = None
) -> tuple[Instability, ...]:
    """Where the state that a slow ramp follows is lost in its plane: folds, up to the first that is none.

    Parameters and errors as in `folds`.
    """
    problem, start = named(scene, elements, degree)
    return _lost(problem, start, scene, steps)


def instabilities_from(
    scene: Scene, rest: Mapping[str, Array], *, elements: int, degree: int
) -> tuple[Instability, ...]:
    """`instabilities` of the state about which a motion begins, `History.rest`, in place of the `start`."""
    start = _State(rest["z"], float(rest["load"]), scene.begin)
    return _lost(Statics(scene, elements, degree), start, scene, None)


def _lost(problem: Statics, start: _State, scene: Scene, steps: Steps | None) -> tuple[Instability, ...]:
    of: dict[str, Any] = {"model": "quasilinear", "options": problem.options}
    result = ramp_events(problem, start, _within_reach(scene), steps)
    return tuple(instability_of(problem, event, scene, steps, of) for event in result)


@checked
def fold_curve(
    scene: Scene,
    *,
    over: str,
    span: tuple[float, float],
    which: int = 0,
    elements: int = 1,
    degree: int | None = None,
    steps: Steps | None = None,
) -> FoldCurve:
    """One of the scene's folds over a second parameter, through the curve's turns and cusps.

    Parameters
    ----------
    scene, span, which: as in `kirchhoff.fold_curve`.
    over: as in `kirchhoff.fold_curve`, of the plane: no "shear".
    elements, degree, steps: as in `folds`.

    Raises
    ------
    SceneError, OptionError, SolverError
        As in `kirchhoff.fold_curve`.
    """
    parameter = SecondParameter.of(scene, over, span, planar=True)
    problem, start = named(scene, elements, degree)
    events = ramp_folds(problem, start, _within_reach(scene), steps)
    of = {"model": "quasilinear", "options": options_given(**problem.options)}
    return fold_curve_of(problem, events, which, scene, parameter, steps or Steps(), **of)


@checked
def pitchfork_curve(
    scene: Scene,
    *,
    over: str,
    span: tuple[float, float],
    which: int = 0,
    elements: int = 1,
    degree: int | None = None,
    steps: Steps | None = None,
) -> PitchforkCurve:
    """One of the scene's pitchforks over a second parameter that keeps its symmetry.

    Parameters and errors as in `fold_curve`; `which` is the number among those `instabilities` that are no
    folds.  A parameter that breaks the symmetry unfolds the pitchfork, and is refused.
    """
    parameter = SecondParameter.of(scene, over, span, planar=True)
    problem, start = named(scene, elements, degree)
    events = ramp_events(problem, start, _within_reach(scene), steps)
    of = {"model": "quasilinear", "options": options_given(**problem.options)}
    return pitchfork_curve_of(problem, events, which, scene, parameter, steps or Steps(), **of)


@checked
def normal_forms(scene: Scene, *, elements: int = 1, degree: int | None = None) -> tuple[NormalForm, ...]:
    """The normal forms of the folds that a very slow ramp meets: what `delay.predict` needs.

    The default mesh is that of `simulate`; parameters and errors as in `folds`.
    """
    problem, start = named(scene, elements, degree)
    return ramp_normal_forms(problem, start, _within_reach(scene))


@checked
def frequencies(scene: Scene, *, count: int = 6, elements: int = 1, degree: int | None = None) -> Array:
    """The lowest `count` angular frequencies (count,) of undamped motions about the start state, 1/s.

    Parameters and errors as in `folds`, but that one element is of degree 24, for the higher modes.
    """
    problem, start = named(scene, elements, degree)
    if degree is None and problem.elements == 1:
        problem, start = named(scene, 1, _FOR_MODES)
    return problem.frequencies(start, count)


@checked
def equilibria(
    scene: Scene,
    *,
    elements: int = 1,
    degree: int | None = None,
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
    problem, start = named(scene, elements, degree)
    curve = whole_curve(problem, start, span, scene, steps, unstable)
    return curve.as_branch(
        scene, options_given(**problem.options, span=span or span_of(scene)), "quasilinear", problem.arclength
    )
