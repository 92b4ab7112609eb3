"""Public functions of the discrete elastic rod at rest: folds, instabilities, equilibria, frequencies."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ribbonfem.continuation import Event, Steps
from ribbonfem.continuation.curves import as_fold, instability_of, ramp_events, span_of, whole_curve
from ribbonfem.continuation.two_parameters import fold_curve_of, pitchfork_curve_of
from ribbonfem.continuation.vibration import natural_frequencies
from ribbonfem.delay import NormalForm, normal_form
from ribbonfem.ends.second_parameter import SecondParameter
from ribbonfem.options import checked, options_given
from ribbonfem.results import Array, Branch, Fold, FoldCurve, Instability, PitchforkCurve
from ribbonfem.scene import Scene

from . import out_of_plane as plane
from .problem import Statics, default_steps, neutral_steps
from .rod import Rod, RodState
from .states import met_events, met_folds, start_state


@checked
def folds(
    scene: Scene, *, nodes: int = 151, clamp: str = "centred", steps: Steps | None = None
) -> tuple[Fold, ...]:
    """The folds that a very slow ramp meets, in order: two from U+S+, one from U+S- and planar U+.

    Parameters
    ----------
    scene: any one.
    nodes: N, at least 7; the error falls as N^-2 with the centred clamp and N^-1 with the other.
    clamp: "centred" or "two-node" (see `der.rod`).
    steps: continuation step control; None for one that suits the thickness.

    Raises
    ------
    SceneError
        If the start is not a stable equilibrium.
    OptionError, SolverError
        For an option that cannot be; for a continuation that fails, or a state that is lost at
        another point than a fold before any fold: see `instabilities`.
    """
    problem = Statics(Rod(scene, nodes, clamp))
    result = met_folds(scene, nodes, clamp, steps)
    of = {"model": "der", "scene": scene, "options": options_given()}
    return tuple(as_fold(problem, event.point, **of) for event in result)


@checked
def instabilities(
    scene: Scene, *, nodes: int = 151, clamp: str = "centred", steps: Steps | None = None
) -> tuple[Instability, ...]:
    """Where the state that a slow ramp follows is lost, in order: folds, up to the first that is none.

    At a "pitchfork" or a "branch" another curve crosses: a perfect ribbon stays on the lost state, a real one
    leaves it.  Parameters and errors as in `folds`.
    """
    rod, result = Rod(scene, nodes, clamp), met_events(scene, nodes, clamp, steps)
    return _as_instabilities(rod, result, default_steps(rod, steps), options_given())


def instabilities_from(
    scene: Scene, rest: Mapping[str, Array], *, nodes: int, clamp: str = "centred"
) -> tuple[Instability, ...]:
    """`instabilities` of the state in which a motion begins, `History.rest`, in place of the `start`."""
    rod, start = Rod(scene, nodes, clamp), RodState(**rest, at=scene.begin)
    steps = default_steps(rod)
    result = ramp_events(Statics(rod), start, scene, steps)
    return _as_instabilities(rod, result, steps, {"nodes": nodes, "clamp": clamp})


def _as_instabilities(
    rod: Rod, events: tuple[Event[RodState], ...], steps: Steps, options: dict[str, Any]
) -> tuple[Instability, ...]:
    problem, of = Statics(rod), {"model": "der", "options": options}
    return tuple(instability_of(problem, event, rod.scene, steps, of) for event in events)


@checked
def fold_curve(
    scene: Scene,
    *,
    over: str,
    span: tuple[float, float],
    which: int = 0,
    nodes: int = 151,
    clamp: str = "centred",
    steps: Steps | None = None,
) -> FoldCurve:
    """One of the scene's folds over a second parameter, through the curve's turns and cusps.

    Parameters
    ----------
    scene, over, span, which: as in `kirchhoff.fold_curve`.
    nodes, clamp, steps: as in `folds`.

    Raises
    ------
    SceneError, OptionError, SolverError
        As in `kirchhoff.fold_curve`.
    """
    parameter = SecondParameter.of(scene, over, span)
    rod, events = Rod(scene, nodes, clamp), met_folds(scene, nodes, clamp, steps)
    of = {"model": "der", "options": options_given()}
    return fold_curve_of(Statics(rod), events, which, scene, parameter, neutral_steps(rod, steps), **of)


@checked
def pitchfork_curve(
    scene: Scene,
    *,
    over: str,
    span: tuple[float, float],
    which: int = 0,
    nodes: int = 151,
    clamp: str = "centred",
    steps: Steps | None = None,
) -> PitchforkCurve:
    """One of the scene's pitchforks over a second parameter that keeps its symmetry.

    Parameters and errors as in `fold_curve`; `which` is the number among those `instabilities` that are no
    folds.  A parameter that breaks the symmetry unfolds the pitchfork, and is refused.
    """
    parameter = SecondParameter.of(scene, over, span)
    rod, events = Rod(scene, nodes, clamp), met_events(scene, nodes, clamp, steps)
    of = {"model": "der", "options": options_given()}
    return pitchfork_curve_of(Statics(rod), events, which, scene, parameter, neutral_steps(rod, steps), **of)


@checked
def normal_forms(
    scene: Scene, *, nodes: int = 151, clamp: str = "centred", steps: Steps | None = None
) -> tuple[NormalForm, ...]:
    """The normal forms of the folds of `folds`: what `ribbonfem.delay.predict` needs.

    Parameters and errors as in `folds`.
    """
    problem = Statics(Rod(scene, nodes, clamp))
    return tuple(normal_form(problem, fold) for fold in met_folds(scene, nodes, clamp, steps))


@checked
def frequencies(scene: Scene, *, count: int = 6, nodes: int = 151, clamp: str = "centred") -> Array:
    """The lowest `count` angular frequencies (count,) of undamped motions about the start state, 1/s.

    Parameters and errors as in `folds`.
    """
    rod = Rod(scene, nodes, clamp)
    return natural_frequencies(Statics(rod), start_state(rod), scene.begin, count)


@checked
def equilibria(
    scene: Scene,
    *,
    nodes: int = 151,
    clamp: str = "centred",
    span: tuple[float, float] | None = None,
    unstable: int = 2,
    steps: Steps | None = None,
) -> Branch:
    """The connected curve of equilibria through the start state, for controls in `span`.

    By default (-1.5, 1.5) of angles, 30 EI2/L^2 of forces, .98 of what the chord allows of lengths, towards a
    taut ribbon as far as the nodes follow it; the control's start is inside.  It ends with the first state of
    more than `unstable` unstable directions.
    Other parameters and errors as in `folds`.
    """
    rod = Rod(scene, nodes, clamp)
    problem = Statics(rod)
    curve = whole_curve(problem, start_state(rod), span, scene, default_steps(rod, steps), unstable)
    return curve.as_branch(scene, options_given(span=span or span_of(scene)), "der", problem.arclength)


@checked
def leaves_plane(scene: Scene, *, nodes: int = 151, clamp: str = "centred") -> float:
    """The control at which the planar state at rest loses its stability out of its plane.

    From the Hessian over what is across the plane, along the states from the control's start in the
    direction of the scene's rate to its `stop`, or to their fold.  Parameters and errors as in `folds`.

    Returns
    -------
    NaN where they do not lose it.
    """
    scene.require_planar("leaves_plane")
    Rod(scene, nodes, clamp)
    return plane.leaves_plane(scene, nodes, clamp)
