"""Public `escape` of the rod: the motion that leaves a fold by itself, for predictions of delays."""

from __future__ import annotations

import time as clock_time

import numpy as np

from ribbonfem.continuation import Steps
from ribbonfem.delay import scene_departure
from ribbonfem.delay.departure import ESCAPE_UNTIL
from ribbonfem.ends import held
from ribbonfem.options import checked, choice, local_error, options_given
from ribbonfem.results import History, SolverError, control_text
from ribbonfem.scene import Scene

from . import kernels
from .loop import Loop
from .motion import step_options
from .problem import Statics, default_steps
from .rod import Rod
from .states import start_state


@checked
def escape(
    scene: Scene,
    *,
    fold: int = 0,
    amplitude: float = 3e-3,
    nodes: int = 151,
    clamp: str = "centred",
    tolerance: float = 1e-6,
    configurations: bool = True,
    until: str = "end",
    steps: Steps | None = None,
) -> History:
    """The motion that leaves a fold at the fold's own control, held there: see `ribbonfem.kirchhoff.escape`.

    Parameters
    ----------
    fold, amplitude, tolerance: as in `ribbonfem.kirchhoff.escape`.
    nodes, clamp, configurations, steps: as in `simulate` and `folds`.
    until: "end"; "snap", soon after the height first changes sign; "normal form", when that has left
        to infinity.

    Raises
    ------
    OptionError, SolverError
        For a fold that is not met, an amplitude or options that cannot be; as in `simulate`.
    """
    choice("until", until, ESCAPE_UNTIL)
    local = local_error("tolerance", tolerance)
    rod = Rod(scene, nodes, clamp)
    result, duration = scene_departure(
        Statics(rod), start_state(rod), scene, fold, amplitude, default_steps(rod, steps), until
    )
    angle = result.form.angle
    damping = scene.scaled_damping
    ends = held(scene, angle, duration / scene.ribbon.inertial_time)
    course = kernels.Course(damping, np.inf, -np.inf, 0.0 if until == "snap" else np.inf)
    options = step_options("tr-bdf2", 0.0, local, max(1e-11, 1e-3 * local))
    run = Loop(rod, result.state, options, 1, configurations, result.velocity, damping)
    begin = clock_time.perf_counter()
    status = run.go(ends, course)
    stats = {"seconds": clock_time.perf_counter() - begin}
    history = run.history(scene, options_given(tolerance=local), stats)
    if status != kernels.DONE:
        raise SolverError(
            f"the escape from {control_text(scene, angle)} on {nodes} nodes did not reach its end", history
        )
    return history
