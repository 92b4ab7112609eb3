"""The functions of the quasi-linear beam."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.interpolate import make_interp_spline

from ribbonfem.closed_form import (
    ClosedFormBranch,
    ClosedFormFold,
    closed_form_branch,
    closed_form_fold,
)
from ribbonfem.continuation import Steps, equilibrium
from ribbonfem.continuation.curves import as_fold, ramp_folds, whole_curve
from ribbonfem.continuation.vibration import natural_frequencies
from ribbonfem.delay import NormalForm, ramp_normal_forms, scene_departure
from ribbonfem.options import checked
from ribbonfem.results import Array, Branch, Fold, History
from ribbonfem.scene import Scene
from ribbonfem.stepping.control import Control
from ribbonfem.stepping.newmark import Held, integrate
from ribbonfem.tableaus import Tableau

from .motion import tables
from .problem import Statics

__all__ = [
    "ClosedFormBranch",
    "ClosedFormFold",
    "closed_form_branch",
    "closed_form_fold",
    "equilibria",
    "escape",
    "folds",
    "frequencies",
    "normal_forms",
    "simulate",
]

TOLERANCE = 1e-5


@checked
def folds(scene: Scene, *, elements: int = 64, steps: Steps | None = None) -> tuple[Fold, ...]:
    """The folds that a very slow ramp meets (one, at mu = 1.7818 from U+ as alpha grows).

    Parameters
    ----------
    scene: a planar scene.
    elements: cubic Hermite elements, at least 4; errors fall as elements^-4.
    steps: continuation step control.

    Raises
    ------
    SceneError, OptionError, SolverError
        For a sheared scene, a mesh that cannot be, a continuation that fails.
    """
    problem = Statics(scene, elements)
    found = ramp_folds(problem, problem.start(), scene, steps)
    of = {"model": "quasilinear", "scene": scene, "policy": {"elements": elements}}
    return tuple(as_fold(problem, event.point, **of) for event in found)


@checked
def normal_forms(scene: Scene, *, elements: int = 32) -> tuple[NormalForm, ...]:
    """The normal forms of the folds that a very slow ramp meets: what `delay.predict` needs.

    The default mesh is that of `simulate`; parameters and errors as in `folds`.
    """
    problem = Statics(scene, elements)
    return ramp_normal_forms(problem, problem.start(), scene)


@checked
def frequencies(scene: Scene, *, count: int = 6, elements: int = 128) -> Array:
    """The lowest `count` angular frequencies (count,) of undamped motions about the start state, 1/s.

    Parameters and errors as in `folds`.
    """
    problem = Statics(scene, elements)
    return natural_frequencies(problem, equilibrium(problem, problem.start(), 0.0)[0], 0.0, count)


@checked
def equilibria(
    scene: Scene,
    *,
    elements: int = 64,
    span: tuple[float, float] = (-1.5, 1.5),
    unstable: int = 2,
    steps: Steps | None = None,
) -> Branch:
    """The connected curve of equilibria through the start state, for alpha in `span`.

    Parameters and errors as in `folds`; `span` in rad, with 0 inside.  The curve climbs through
    ever higher modes: it ends with the first state of more than `unstable` unstable directions.
    """
    problem = Statics(scene, elements)
    curve = whole_curve(problem, problem.start(), span, steps, unstable)
    return curve.as_branch(
        scene, {"elements": elements, "span": span, "unstable": unstable}, "quasilinear", problem.arclength
    )


def _observer(problem: Statics) -> Callable[[Array, Array], tuple[Array, Array, Array]]:
    """Slopes (rows,), positions (rows, nodes, 3) and curvatures (rows, nodes) of rows of the loop's dofs."""
    index, _, weights = problem.middle_weights()
    length = problem.compression**0.5

    nodes = problem.arclength

    def observe(z: Array, _: Array) -> tuple[Array, Array, Array]:
        slope = z[:, index] @ weights * length
        # slopes at the nodes are more accurate than the second derivatives of the cubics between them
        bend = make_interp_spline(nodes, z[:, 1::2], k=5 if len(nodes) > 5 else 3, axis=1)(nodes, 1)
        return slope / np.hypot(1.0, slope), problem.shapes(z), length * bend

    return observe


@checked
def simulate(
    scene: Scene,
    *,
    elements: int = 32,
    method: str | Tableau = "tr-bdf2",
    step: float | None = None,
    tolerance: float | None = None,
    spectral_radius: float | None = None,
    every: int | None = None,
    until: str = "end",
) -> History:
    """The motion from rest in the start state, through the ramp and the hold.

    Parameters
    ----------
    scene: a planar scene with a `stop`.
    elements: cubic Hermite elements, at least 4; errors fall as elements^-4.
    method: "tr-bdf2", "generalised-alpha", "newmark" (trapezoidal) or "implicit-euler".
    step: a fixed step in s, shortened so that a whole number of steps fits the ramp, and halved
        where no next state is found.
    tolerance: of the adaptive step, the local error of positions in L; 1e-5 if neither is given,
        which leaves 2e-5 rad in a snap's angle in the median of drawn scenes and 6e-5 at most, where the
        mesh leaves 4e-6 (`pytest -m slow -s -n 0 tests/test_defaults.py`).
    spectral_radius: of "generalised-alpha" at infinite frequency, in (0, 1]; 0.8.
    every: keep the rows of each `every`-th accepted step, and the last; None keeps all up to 160 MB, and
        thins them out then (`History`).
    until: "end", or "snap", soon after the height first changes sign.

    Returns
    -------
    `History`, with the nodes' "positions" as configurations; its load is sigma^2.

    Raises
    ------
    SceneError, OptionError
        For a sheared scene, one without `stop`, a policy that cannot be.
    SolverError
        If no step converges; what was reached is its `history`.
    """
    control = Control.of(method, step, tolerance, until, spectral_radius, TOLERANCE)
    problem = Statics(scene, elements)
    scene.require_stop()
    state, _ = equilibrium(problem, problem.start(), 0.0)
    length = problem.compression**0.5
    motion = integrate(
        tables(problem),
        scene,
        control.in_units_of(length),
        state.z,
        np.array([state.load]),
        _observer(problem),
        every=every,
    )
    policy = {
        "elements": elements,
        "method": method,
        "step": step,
        "tolerance": control.tolerance,
        "spectral_radius": spectral_radius,
        "every": every,
        "until": until,
    }
    return motion.as_history(scene, policy, model="quasilinear", arclength=problem.arclength, length=length)


@checked
def escape(
    scene: Scene,
    *,
    fold: int = 0,
    amplitude: float = 3e-3,
    elements: int = 32,
    tolerance: float = 1e-7,
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
    elements, until: as in `simulate`.

    Raises
    ------
    OptionError, SolverError
        For a fold that is not met, an amplitude or a policy that cannot be; as in `simulate`.
    """
    control = Control.of("tr-bdf2", None, tolerance, until, None, TOLERANCE)
    problem = Statics(scene, elements)
    found, duration = scene_departure(problem, problem.start(), scene, fold, amplitude)
    length = problem.compression**0.5
    velocity = np.zeros_like(found.state.z)
    velocity[problem.free] = found.velocity[:-1]
    motion = integrate(
        tables(problem),
        scene,
        control.in_units_of(length),
        found.state.z,
        np.array([found.state.load]),
        _observer(problem),
        Held(found.form.angle, velocity, duration),
    )
    policy = {
        "fold": fold,
        "amplitude": amplitude,
        "elements": elements,
        "tolerance": tolerance,
        "until": until,
    }
    return motion.as_history(scene, policy, model="quasilinear", arclength=problem.arclength, length=length)
