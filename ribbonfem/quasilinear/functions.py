"""The functions of the quasi-linear beam."""

from __future__ import annotations

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
from ribbonfem.delay import NormalForm, ramp_normal_forms, scene_departure
from ribbonfem.delay.departure import ESCAPE_UNTIL
from ribbonfem.options import checked, options_given
from ribbonfem.results import Array, Branch, Fold, History, Instability, snaps_since
from ribbonfem.scene import Scene
from ribbonfem.stepping.control import Control
from ribbonfem.stepping.kernels.arrays import TIME
from ribbonfem.stepping.motion import Motion
from ribbonfem.stepping.newmark import Held, integrate
from ribbonfem.tableaus import Tableau

from . import motion
from .problem import Statics
from .states import named, resumed

__all__ = [
    "ClosedFormBranch",
    "ClosedFormFold",
    "closed_form_branch",
    "closed_form_fold",
    "equilibria",
    "escape",
    "folds",
    "frequencies",
    "instabilities",
    "normal_forms",
    "simulate",
]

TOLERANCE = 3e-5
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
    plain = scene.drive in ("left", "right") and not scene.dressed
    if steps is not None or not plain:
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
        not scene.turning
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
    of: dict[str, Any] = {"model": "quasilinear", "options": problem.options}
    result = ramp_events(problem, start, _within_reach(scene), steps)
    return tuple(instability_of(problem, event, scene, steps, of) for event in result)


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
    angles, 30 EI2/L^2 of forces, and what the chord allows of lengths.  The curve climbs through ever
    higher modes: it ends with the first state of more than `unstable` unstable directions.
    """
    problem, start = named(scene, elements, degree)
    span = span or span_of(scene)
    curve = whole_curve(problem, start, span, steps, unstable, scene.begin)
    return curve.as_branch(
        scene, options_given(**problem.options, span=span), "quasilinear", problem.arclength
    )


def _integrated(
    problem: Statics, begin: dict[str, Array], scene: Scene, control: Control, **options: Any
) -> Motion:
    """The motion from a state."""
    return integrate(
        "quasilinear",
        lambda scheme, rows: motion.Motion(problem, begin, scheme, rows),
        scene,
        control.in_units_of(problem.scale),
        len(problem.arclength),
        **options,
    )


@checked
def simulate(
    scene: Scene,
    *,
    elements: int = 1,
    degree: int | None = None,
    method: str | Tableau = "esdirk4",
    step: float | None = None,
    tolerance: float | None = None,
    spectral_radius: float | None = None,
    every: int | None = None,
    configurations: bool = True,
    until: str = "end",
    initial: History | None = None,
) -> History:
    """The motion from rest in the start state, through the ramp and the hold.

    Parameters
    ----------
    scene: a planar scene with a `stop` or a `schedule`.
    elements: one of degree 18, whose folds are exact to 1e-12, or at least 4 cubic Hermite elements, whose
        errors fall as elements^-4.
    degree: of the elements, if another: above 3 there are bubbles beside the Hermite functions, and any
        number of elements will do.
    method: "esdirk4", "esdirk3" (`ribbonfem.tableaus`), "tr-bdf2", "generalised-alpha", "newmark"
        (trapezoidal) or "implicit-euler".
    step: a fixed step in s, shortened so that a whole number of steps fits the ramp, and halved
        where no next state is found.
    tolerance: of the adaptive step, the local error of positions in L, made smaller while the
        beam creeps (down to 0.01 of it); 3e-5 if neither is given,
        which leaves 4e-6 rad in a snap's angle in the median of drawn scenes and 5e-5 at most, where the
        mesh leaves 3e-7 and 2e-5 (`pytest -m slow -s -n 0 tests/test_defaults.py`).
    spectral_radius: of "generalised-alpha" at infinite frequency, in (0, 1]; 0.8.
    every: keep the rows of each `every`-th accepted step, and the last; None keeps all up to 160 MB, and
        thins them out then (`History`).
    configurations: False leaves positions and curvatures out of the result.
    until: "end", or "snap", soon after the height first changes sign.
    initial: a `History` whose last instant is gone on from: time goes on, and dissipated energy and work.  Of
        the same mesh, ribbon and compression; its clamps have to be where the scene's begin.

    Returns
    -------
    `History`, with the nodes' "positions" as configurations; its load is sigma^2.

    Raises
    ------
    SceneError, OptionError
        For a scene that is not planar, one without `stop`, options that cannot be.
    SolverError
        If no step converges; what was reached is its `history`.
    """
    control = Control.of(method, step, tolerance, until, spectral_radius, TOLERANCE)
    scene.require_stop()
    began = 0.0
    if initial is None:
        problem, start = named(scene, elements, degree)
        begin = motion.at_rest(problem, start)
    else:
        problem = Statics(scene, elements, degree)
        begin = resumed(problem, scene, initial)
        began = float(begin["clock"][TIME])
    since = began + snaps_since(scene, until, "quasilinear", problem.options) / problem.unit
    moved = _integrated(
        problem,
        begin,
        scene,
        control,
        every=every,
        since=since,
        began=began,
        configurations=configurations,
    )
    options = options_given(**problem.options, tolerance=control.tolerance)
    return moved.as_history(
        scene,
        options,
        model="quasilinear",
        arclength=problem.arclength,
        length=problem.scale,
        initial=initial,
    )


@checked
def escape(
    scene: Scene,
    *,
    fold: int = 0,
    amplitude: float = 3e-3,
    elements: int = 1,
    degree: int | None = None,
    tolerance: float = 1e-6,
    until: str = "end",
) -> History:
    """The motion that leaves a fold at the fold's own angle, the clamp held there.

    It starts displaced along the fold's null vector, all else in equilibrium, with the velocity of
    the unstable solution of the normal form; the scene says the start, the direction and the damping.

    Parameters
    ----------
    fold: which of the `folds` of a ramp, from 0.
    amplitude: of the null vector, in (dL/L)^(1/2) L with the whole beam of mass 1, of [1e-5, 0.05].
    tolerance: of the adaptive step, the local error of positions in L.
    elements, degree: as in `simulate`.
    until: "end"; "snap", soon after the height first changes sign; "normal form", when that has left
        to infinity.

    Raises
    ------
    OptionError, SolverError
        For a fold that is not met, an amplitude or options that cannot be; as in `simulate`.
    """
    control = Control.of("esdirk4", None, tolerance, until, None, TOLERANCE, ESCAPE_UNTIL)
    problem, start = named(scene, elements, degree)
    result, duration = scene_departure(problem, start, scene, fold, amplitude, until=until)
    begin = motion.at_rest(problem, result.state) | {"v": result.velocity[:-1]}
    moved = _integrated(problem, begin, scene, control, held=Held(result.form.angle, duration))
    options = options_given(**problem.options)
    return moved.as_history(
        scene, options, model="quasilinear", arclength=problem.arclength, length=problem.scale
    )
