"""Public `escape` of the ribbon: the motion that leaves a fold by itself, for predictions of delays."""

from __future__ import annotations

from ribbonfem.delay import Departure, scene_departure
from ribbonfem.delay.departure import ESCAPE_UNTIL
from ribbonfem.ends import held
from ribbonfem.options import checked, options_given
from ribbonfem.results import History
from ribbonfem.scene import Scene
from ribbonfem.stepping.control import Control

from . import states
from .initial_states import at_rest
from .kernels import arrays
from .loop import integrate, ramp_of
from .motion import TOLERANCE
from .problem import Frames, Statics, checked_mesh


@checked
def escape(
    scene: Scene,
    *,
    fold: int = 0,
    amplitude: float = 3e-3,
    elements: int = 8,
    extensible: bool = False,
    tolerance: float = 1e-6,
    configurations: bool = True,
    until: str = "end",
) -> History:
    """The motion that leaves a fold at the fold's own angle, the clamp held there.

    It starts displaced along the fold's null vector, all else in equilibrium, with the velocity of
    the unstable solution of the normal form; the scene says the start, the direction and the damping.

    Parameters
    ----------
    fold: which of the `folds` of a ramp, from 0.
    amplitude: of the null vector, in L with the whole ribbon of mass 1, of [1e-5, 0.05].
    tolerance: of the adaptive step, the local error of positions in L.
    elements, extensible, configurations: as in `simulate`.
    until: "end"; "snap", soon after the height first changes sign; "normal form", when that has left
        to infinity.

    Raises
    ------
    OptionError, SolverError
        For a fold that is not met, an amplitude or options that cannot be; as in `simulate`.
    """
    control = Control.of("esdirk4", None, tolerance, until, None, TOLERANCE, ESCAPE_UNTIL)
    problem, start = states.named(scene, **checked_mesh(elements, extensible))
    result, duration = scene_departure(problem, start, scene, fold, amplitude, until=until)
    ends = held(scene, result.form.angle, duration / problem.unit)
    ramp = ramp_of(scene, control, ends=ends)
    return integrate(
        problem,
        result.state,
        scene,
        control,
        ramp,
        options_given(),
        configurations,
        lambda: _moving(problem, result, scene),
    )


def _moving(problem: Statics, result: Departure[Frames], scene: Scene) -> arrays.Motion:
    """The state of the time loop at a departure, the clamp held."""
    motion = at_rest(problem, result.state, scene.ribbon.retardation > 0.0)
    velocity, spin = problem.moving(result.state, result.velocity)
    motion.v[1:-1, :3], motion.v[1:-1, 3] = velocity[1:-1], spin[1:-1]
    return motion
