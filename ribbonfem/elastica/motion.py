"""Public `simulate` and `escape` of the elastica: its motion from a scene's start, and from a fold."""

from __future__ import annotations

from ribbonfem.continuation import equilibrium
from ribbonfem.delay import scene_departure
from ribbonfem.options import checked, options_given, refuse
from ribbonfem.results import History, RestState, snaps_since
from ribbonfem.scene import Scene
from ribbonfem.stepping.control import Control
from ribbonfem.stepping.integrate import Held, integrate
from ribbonfem.stepping.kernels.arrays import TIME
from ribbonfem.stepping.methods import ALL_METHODS
from ribbonfem.tableaus import Tableau

from . import initial_states, states
from .discretisation import MovingBeam
from .problem import Statics

ELEMENTS, TOLERANCE = 8, 3e-5


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
    configurations: bool = True,
    until: str = "end",
    initial: RestState | History | None = None,
) -> History:
    """The motion from rest in the start state, through the ramp and the hold.

    Parameters
    ----------
    scene: a planar scene with a `stop` or a `schedule`.
    elements: of degree 5, at least 4; errors fall as elements^-10.
    extensible: whether the beam stretches, with EA of the rectangular section.
    method: "esdirk4", "esdirk3" (`ribbonfem.tableaus`), "tr-bdf2", "generalised-alpha", "newmark"
        (trapezoidal), "implicit-euler" or "discrete-gradient", of order 2, which alone keeps the energy of
        undamped ringing, whatever the step (`kernels.average_vector_field`): the one for a ring-down, with
        ``tolerance=1e-4``.
    step: a fixed step in s, shortened so that a whole number of steps fits the ramp, and halved
        where no next state is found.
    tolerance: of the adaptive step, the local error of positions in L, made smaller while the
        beam creeps (down to 0.01 of it); 3e-5 if neither is given,
        which leaves 3e-6 rad in a snap's angle in the median of drawn scenes and 7e-5 at most, where the
        mesh leaves 1e-8 and 2e-5 (`pytest -m slow -s -n 0 tests/test_defaults.py`).
    spectral_radius: of "generalised-alpha" at infinite frequency, in (0, 1]; 0.8.
    every: keep the rows of each `every`-th accepted step, and the last; None keeps all up to 160 MB, and
        thins them out then (`History`).
    configurations: False leaves positions and curvatures out of the result.
    until: "end", or "snap", soon after the height first changes sign.
    initial: a `RestState` to begin at in place of the scene's `start`, or a `History` whose last instant is
        gone on from: time goes on, and dissipated energy and work.  Of the same mesh and ribbon, the state of
        any model with these nodes; its clamps have to be where the scene's begin.  To the last bit the
        uninterrupted run where that has a kink then.

    Returns
    -------
    `History`, with the nodes' "positions" (rows, nodes, 3) in L and "curvature" (rows, nodes) in 1/L as
        configurations.

    Raises
    ------
    SceneError, OptionError
        For a scene that is not planar, one without `stop`, options that cannot be.
    SolverError
        If no step converges; what was reached is its `history`.
    """
    control = Control.of(method, step, tolerance, until, spectral_radius, TOLERANCE, methods=ALL_METHODS)
    scene.require_stop()
    if control.method.mean and scene.ribbon.retardation > 0.0:
        refuse("method", method, "is of elastic moments alone, and Ribbon.retardation is not 0")
    if initial is None:
        problem, start = states.named(scene, elements, extensible)
        begin = {"u": initial_states.at_rest(problem, equilibrium(problem, start, scene.begin)[0])}
        began = 0.0
    else:
        problem = Statics(scene, elements, extensible)
        begin = initial_states.of(problem, scene, initial)
        began = float(begin["clock"][TIME]) if "clock" in begin else 0.0
    mesh = {"elements": elements, "extensible": extensible}
    since = began + snaps_since(scene, until, "elastica", mesh) / problem.unit
    moved = integrate(
        "elastica",
        lambda scheme, rows: MovingBeam(problem, begin, scheme, rows),
        scene,
        control,
        len(problem.arclength),
        every=every,
        since=since,
        began=began,
        configurations=configurations,
    )
    options = options_given(tolerance=control.tolerance)
    return moved.as_history(scene, options, model="elastica", arclength=problem.arclength, initial=initial)


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
        For a fold that is not met, an amplitude or options that cannot be; as in `simulate`.
    """
    control = Control.of("esdirk4", None, tolerance, until, None, TOLERANCE)
    problem, start = states.named(scene, elements, extensible)
    result, duration = scene_departure(problem, start, scene, fold, amplitude)
    velocity = problem.moving(result.state, result.velocity)
    # the right clamp, to the last digit
    velocity[-1] = 0.0
    begin = {
        "u": initial_states.at_rest(problem, result.state),
        "v": initial_states.in_rows(problem, velocity),
    }
    moved = integrate(
        "elastica",
        lambda scheme, rows: MovingBeam(problem, begin, scheme, rows),
        scene,
        control,
        len(problem.arclength),
        held=Held(result.form.angle, duration),
    )
    return moved.as_history(scene, options_given(), model="elastica", arclength=problem.arclength)
