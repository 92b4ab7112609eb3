"""The functions of the planar elastica."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ribbonfem.continuation import Steps, equilibrium
from ribbonfem.continuation.curves import as_fold, ramp_folds, whole_curve
from ribbonfem.delay import NormalForm, ramp_normal_forms, scene_departure
from ribbonfem.options import checked
from ribbonfem.results import Array, Branch, Fold, History
from ribbonfem.scene import Scene, SceneError
from ribbonfem.stepping.control import Control
from ribbonfem.stepping.newmark import Held, integrate
from ribbonfem.tableaus import Tableau

from . import out_of_plane as sideways
from .motion import at_rest, tables, vibrations
from .problem import Statics

__all__ = ["equilibria", "escape", "folds", "frequencies", "leaves_plane", "normal_forms", "simulate"]

TOLERANCE = 3e-6


def _problem(scene: Scene, elements: int, extensible: bool) -> Statics:
    """The equations of a beam that buckles.

    Raises
    ------
    SceneError, OptionError
        For a sheared scene, one that its stretch keeps flat, a mesh that cannot be.
    """
    problem = Statics(scene, elements, extensible)
    if not extensible:
        return problem
    scene.require_buckled()
    above = scene.compression - scene.ribbon.euler_shortening
    if above < 1e-3 * scene.compression:
        # this close a mesh may be below its own Euler's load
        state, _ = equilibrium(problem, problem.start(), 0.0)
        height = problem.observe(state, 0.0)[0]
        if not problem.side * height > 0.1 * above**0.5:
            raise SceneError(
                f"Scene.compression = {scene.compression!r}: so close above Euler's load, "
                f"{scene.ribbon.euler_shortening!r}, the beam of {problem.mesh.elements} elements stays flat"
            )
    return problem


@checked
def folds(
    scene: Scene, *, elements: int = 48, extensible: bool = False, steps: Steps | None = None
) -> tuple[Fold, ...]:
    """The folds that a very slow ramp meets (one, on the side of the start state).

    Parameters
    ----------
    scene: a planar scene.
    elements: cubic elements, at least 4; errors fall as elements^-6.
    extensible: whether the beam stretches, with EA of the rectangular section.
    steps: continuation step control.

    Raises
    ------
    SceneError, OptionError, SolverError
        For a sheared scene, a mesh that cannot be, a continuation that fails.
    """
    problem = _problem(scene, elements, extensible)
    found = ramp_folds(problem, problem.start(), scene, steps)
    of = {"model": "elastica", "scene": scene, "policy": {"elements": elements, "extensible": extensible}}
    return tuple(as_fold(problem, event.point, **of) for event in found)


@checked
def normal_forms(scene: Scene, *, elements: int = 10, extensible: bool = False) -> tuple[NormalForm, ...]:
    """The normal forms of the folds that a very slow ramp meets: what `delay.predict` needs.

    The default mesh is that of `simulate`; parameters and errors as in `folds`.
    """
    problem = _problem(scene, elements, extensible)
    return ramp_normal_forms(problem, problem.start(), scene)


@checked
def leaves_plane(scene: Scene, *, elements: int = 48, extensible: bool = False) -> float:
    """The angle (rad) at which the planar state at rest loses its stability out of its plane.

    From the second variation, bending about the normal and twist, of the states from alpha = 0 in
    the direction of the scene's rate to its `stop`, or to their fold.  Parameters and errors as in
    `folds`.

    Returns
    -------
    NaN where they do not lose it; 0 where the start has not got it.
    """
    _problem(scene, elements, extensible)
    return sideways.leaves_plane(scene, elements, extensible)


@checked
def frequencies(scene: Scene, *, count: int = 6, elements: int = 48, extensible: bool = False) -> Array:
    """The lowest `count` angular frequencies (count,) of undamped motions about the start state, 1/s.

    Parameters and errors as in `folds`.
    """
    problem = _problem(scene, elements, extensible)
    return vibrations(problem, equilibrium(problem, problem.start(), 0.0)[0], count)


@checked
def equilibria(
    scene: Scene,
    *,
    elements: int = 48,
    extensible: bool = False,
    span: tuple[float, float] = (-1.5, 1.5),
    unstable: int = 2,
    steps: Steps | None = None,
) -> Branch:
    """The connected curve of equilibria through the start state, for alpha in `span`.

    Parameters and errors as in `folds`; `span` in rad, with 0 inside.  The curve climbs through
    ever higher modes: it ends with the first state of more than `unstable` unstable directions.
    """
    problem = _problem(scene, elements, extensible)
    curve = whole_curve(problem, problem.start(), span, steps, unstable)
    policy = {"elements": elements, "extensible": extensible, "span": span, "unstable": unstable}
    return curve.as_branch(scene, policy, "elastica", problem.arclength)


def _observer(problem: Statics) -> Callable[[Array, Array], tuple[Array, Array, Array]]:
    """Slopes (rows,), positions (rows, nodes, 3) and curvatures (rows, nodes) of rows of the loop's dofs."""
    mesh = problem.mesh
    nodes = mesh.degree * np.arange(mesh.elements + 1)
    index, weights = mesh.middle_weights()
    bend = mesh.nodal_slopes()

    def observe(q: Array, w: Array) -> tuple[Array, Array, Array]:
        x, z = q[:, nodes], q[:, mesh.count + nodes]
        slope, curvature = np.sin(w[:, index] @ weights), w[:, : mesh.count] @ bend.T
        return slope, np.stack((x, np.zeros_like(x), z), axis=2), curvature

    return observe


@checked
def simulate(
    scene: Scene,
    *,
    elements: int = 10,
    extensible: bool = False,
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
    elements: cubic elements, at least 4; errors fall as elements^-6.
    extensible: whether the beam stretches, with EA of the rectangular section.
    method: "tr-bdf2", "generalised-alpha", "newmark" (trapezoidal) or "implicit-euler".
    step: a fixed step in s, shortened so that a whole number of steps fits the ramp, and halved
        where no next state is found.
    tolerance: of the adaptive step, the local error of positions in L; 3e-6 if neither is given,
        which leaves 3e-5 rad in a snap's angle in the median of drawn scenes and 2e-4 at most, where the
        mesh leaves 4e-6 (`pytest -m slow -s -n 0 tests/test_defaults.py`).
    spectral_radius: of "generalised-alpha" at infinite frequency, in (0, 1]; 0.8.
    every: keep the rows of each `every`-th accepted step, and the last; None keeps all up to 160 MB, and
        thins them out then (`History`).
    until: "end", or "snap", soon after the height first changes sign.

    Returns
    -------
    `History`, with the nodes' "positions" (rows, nodes, 3) in L and "curvature" (rows, nodes) in 1/L as
        configurations.

    Raises
    ------
    SceneError, OptionError
        For a sheared scene, one without `stop`, a policy that cannot be.
    SolverError
        If no step converges; what was reached is its `history`.
    """
    control = Control.of(method, step, tolerance, until, spectral_radius, TOLERANCE)
    problem = _problem(scene, elements, extensible)
    scene.require_stop()
    state, _ = equilibrium(problem, problem.start(), 0.0)
    motion = integrate(
        tables(problem), scene, control, *at_rest(problem, state), _observer(problem), every=every
    )
    policy = {
        "elements": elements,
        "extensible": extensible,
        "method": method,
        "step": step,
        "tolerance": control.tolerance,
        "spectral_radius": spectral_radius,
        "every": every,
        "until": until,
    }
    motion.stats["leaves_plane"] = sideways.leaves_plane(scene, elements, extensible)
    return motion.as_history(scene, policy, model="elastica", arclength=problem.arclength)


@checked
def escape(
    scene: Scene,
    *,
    fold: int = 0,
    amplitude: float = 3e-3,
    elements: int = 10,
    extensible: bool = False,
    tolerance: float = 1e-7,
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
        For a fold that is not met, an amplitude or a policy that cannot be; as in `simulate`.
    """
    control = Control.of("tr-bdf2", None, tolerance, until, None, TOLERANCE)
    problem = _problem(scene, elements, extensible)
    found, duration = scene_departure(problem, problem.start(), scene, fold, amplitude)
    q, w = at_rest(problem, found.state)
    x, z = problem.moving(found.state, found.velocity)
    # the right clamp, to the last digit
    x[-1] = z[-1] = 0.0
    held = Held(found.form.angle, np.concatenate((x, z)), duration)
    motion = integrate(tables(problem), scene, control, q, w, _observer(problem), held)
    policy = {
        "fold": fold,
        "amplitude": amplitude,
        "elements": elements,
        "extensible": extensible,
        "tolerance": tolerance,
        "until": until,
    }
    return motion.as_history(scene, policy, model="elastica", arclength=problem.arclength)
