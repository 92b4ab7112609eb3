"""Public `simulate` and `escape` of the quasi-linear beam: its motion from a start, and from a fold."""

from __future__ import annotations

from typing import Any

from ribbonfem.delay import scene_departure
from ribbonfem.delay.departure import ESCAPE_UNTIL
from ribbonfem.options import checked, options_given
from ribbonfem.results import Array, History, snaps_since
from ribbonfem.scene import Scene
from ribbonfem.stepping.control import Control
from ribbonfem.stepping.integrate import Held, integrate
from ribbonfem.stepping.kernels.arrays import TIME
from ribbonfem.stepping.motion import Motion
from ribbonfem.tableaus import Tableau

from .discretisation import MovingBeam, at_rest
from .problem import Statics
from .states import named, rest_of, resumed

TOLERANCE = 3e-5


def _integrated(
    problem: Statics, begin: dict[str, Array], scene: Scene, control: Control, **options: Any
) -> Motion:
    """The motion from a state."""
    return integrate(
        "quasilinear",
        lambda scheme, rows: MovingBeam(problem, begin, scheme, rows),
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
    method: as in `kirchhoff.simulate`, without "discrete-gradient".
    step, spectral_radius, every: as there.
    tolerance: as in `elastica.simulate`; 3e-5 if neither it nor a step is given, which leaves 2e-6 rad in a
        snap's angle in the median of drawn scenes and 5e-5 at most, where the mesh leaves 3e-7 and 2e-5
        (`pytest -m slow -s -n 0 tests/test_defaults.py`).
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
    began, rest = 0.0, None
    if initial is None:
        problem, start = named(scene, elements, degree)
        begin = at_rest(problem, start)
    else:
        problem = Statics(scene, elements, degree)
        begin = resumed(problem, scene, initial)
        began = float(begin["clock"][TIME])
        rest = rest_of(problem, begin, scene, initial)
    since = began + snaps_since(scene, until, "quasilinear", problem.options, rest) / problem.unit
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
        rest=rest,
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
    """The motion that leaves a fold at the fold's own angle, the clamp held there: see `kirchhoff.escape`.

    Parameters
    ----------
    fold, tolerance: as in `kirchhoff.escape`.
    amplitude: of the null vector, in (dL/L)^(1/2) L with the whole beam of mass 1, of [1e-5, 0.05].
    elements, degree: as in `simulate`.
    until: as in `kirchhoff.escape`.

    Raises
    ------
    OptionError, SolverError
        For a fold that is not met, an amplitude or options that cannot be; as in `simulate`.
    """
    control = Control.of("esdirk4", None, tolerance, until, None, TOLERANCE, ESCAPE_UNTIL)
    problem, start = named(scene, elements, degree)
    result, duration = scene_departure(problem, start, scene, fold, amplitude, until=until)
    begin = at_rest(problem, result.state) | {"v": result.velocity[:-1]}
    moved = _integrated(problem, begin, scene, control, held=Held(result.form.angle, duration))
    options = options_given(**problem.options)
    return moved.as_history(
        scene, options, model="quasilinear", arclength=problem.arclength, length=problem.scale
    )
