"""Public `simulate` and `escape` of the elastica: its motion from a scene's start, and from a fold."""

from __future__ import annotations

from ribbonfem.continuation import solution
from ribbonfem.delay import scene_departure
from ribbonfem.delay.departure import ESCAPE_UNTIL
from ribbonfem.options import checked, options_given
from ribbonfem.results import History, RestState, snaps_since
from ribbonfem.scene import Scene
from ribbonfem.stepping.control import Control
from ribbonfem.stepping.integrate import Held, integrate
from ribbonfem.stepping.kernels.arrays import TIME
from ribbonfem.stepping.methods import ALL_METHODS
from ribbonfem.tableaus import Tableau

from . import initial_states, states
from .discretisation import MovingBeam
from .kernels.beam import P
from .problem import Statics

ELEMENTS, TOLERANCE = 8, 3e-5
# where one clamp alone turns a beam compressed by no more than this, fewer leave as little (9e-6 rad of a
# fold at .3, 2e-6 at .2) as steps of this tolerance do, in half the time: their four are one step of SIMD
_FEW, _LIGHTLY, _ROUGHLY = 4, 0.3, 1e-5


def elements_for(
    scene: Scene, tolerance: float | None = TOLERANCE, initial: RestState | History | None = None
) -> int:
    """How many elements a motion has where nobody says so: as what it begins with, or as the scene needs."""
    if isinstance(initial, History):
        return max((len(initial.arclength) - 1) // P, _FEW)
    if isinstance(initial, RestState):
        return max((len(initial.s) - 1) // P, _FEW)
    light = scene.usual and scene.compression <= _LIGHTLY
    return _FEW if light and tolerance is not None and tolerance >= _ROUGHLY else ELEMENTS


@checked
def simulate(
    scene: Scene,
    *,
    elements: int | None = None,
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
    elements: of degree 5, at least 4; errors fall as elements^-10.  By default those of `initial`; 4 where
        one clamp alone turns a beam compressed by at most .3, nothing else acts and the tolerance is 1e-5 or
        more; 8 elsewhere.
    extensible: whether the beam stretches, with EA of the rectangular section.
    method, step, spectral_radius, every: as in `kirchhoff.simulate`.
    tolerance: as there, of Runge-Kutta methods down to .02 of it where the beam creeps;
        3e-5 if neither it nor a step is given, which leaves 1e-6 rad in a snap's angle in the median of drawn
        scenes and 3e-5 at most, where the mesh leaves 2e-7 and 1e-5 (`pytest -m slow -s -n 0
        tests/test_defaults.py`).
    configurations: False leaves positions and curvatures out of the result.
    until: "end", or "snap", soon after the height first changes sign.
    initial: as in `kirchhoff.simulate`; a state at rest may be of any model with these nodes.

    Returns
    -------
    `History`, with the nodes' "positions" (rows, nodes, 3) in L, "velocities" in L/s and "curvature" (rows,
        nodes) in 1/L as configurations; of "discrete-gradient", whose velocities ring, without these.

    Raises
    ------
    SceneError, OptionError
        For a scene that is not planar, one without `stop`, options that cannot be.
    SolverError
        If no step converges; what was reached is its `history`.
    """
    control = Control.of(method, step, tolerance, until, spectral_radius, TOLERANCE, methods=ALL_METHODS)
    scene.require_stop()
    control.require_elastic(method, scene)
    elements = elements_for(scene, control.tolerance, initial) if elements is None else elements
    if initial is None:
        problem, start = states.named(scene, elements, extensible)
        begin = {"u": initial_states.at_rest(problem, solution(problem, start, scene.begin))}
        began, rest = 0.0, None
    else:
        problem = Statics(scene, elements, extensible)
        begin = initial_states.of(problem, scene, initial)
        began = float(begin["clock"][TIME]) if "clock" in begin else 0.0
        rest = initial_states.rest_of(problem, begin, scene, initial)
    mesh = {"elements": elements, "extensible": extensible}
    since = began + snaps_since(scene, until, "elastica", mesh, rest) / problem.unit
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
    options = options_given(elements=elements, tolerance=control.tolerance)
    return moved.as_history(
        scene, options, model="elastica", arclength=problem.arclength, initial=initial, rest=rest
    )


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
    """The motion that leaves a fold at the fold's own angle, the clamp held there: see `kirchhoff.escape`.

    Parameters
    ----------
    fold, amplitude, tolerance, until: as in `kirchhoff.escape`.
    elements, extensible: as in `simulate`.

    Raises
    ------
    OptionError, SolverError
        For a fold that is not met, an amplitude or options that cannot be; as in `simulate`.
    """
    control = Control.of("esdirk4", None, tolerance, until, None, TOLERANCE, ESCAPE_UNTIL)
    problem, start = states.named(scene, elements, extensible)
    result, duration = scene_departure(problem, start, scene, fold, amplitude, until=until)
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
