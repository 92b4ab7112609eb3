"""Public `simulate` of the rod: from a scene to the arrays and options of its compiled time loop.

Time integrators (in the kernels; q are positions and angles, M the lumped mass):

* ``tr-bdf2``: trapezoidal rule, then BDF2 (Bank et al. 1985), L-stable, with the embedded
  third-order companion of Hosea and Shampine (1996) as error estimate, on positions alone;
* ``esdirk3``, ``esdirk4``: L-stable Runge-Kutta methods of higher order (`ribbonfem.tableaus`);
* ``implicit-euler``: the paper's (section 3.2), of first order and dissipative;
* ``newmark``: beta = 1/4, gamma = 1/2, no dissipation, unstable at large nonlinear steps;
* ``generalised-alpha``: Chung and Hulbert (1993), in the form of Arnold and Bruels (2007);
* ``midpoint``: implicit midpoint rule;
* ``discrete-gradient``: midpoint with the mean of the forces along the step (average vector
  field, Quispel and McLaren 2008), which balances the energy at any step;
* ``verlet``: explicit, an oracle for the others; steps above some 1e-5 s at 51 nodes blow up.
"""

from __future__ import annotations

import time as clock_time
from functools import lru_cache
from types import MappingProxyType

import numpy as np

from ribbonfem.continuation.saddles import lowest_saddle
from ribbonfem.ends import moving
from ribbonfem.ends.kernels import Ends
from ribbonfem.options import OptionError, checked, choice, options_given, require_duration, within
from ribbonfem.results import History, RestState, SolverError, control_text, snaps_since
from ribbonfem.scene import Scene
from ribbonfem.tableaus import TABLEAUS, Tableau

from . import initial_states, kernels
from .loop import Loop
from .problem import Statics, default_steps
from .rod import Rod
from .states import start_state

METHODS = MappingProxyType(
    {
        **dict.fromkeys(TABLEAUS, kernels.RUNGE_KUTTA),
        "implicit-euler": kernels.IMPLICIT_EULER,
        "newmark": kernels.NEWMARK,
        "generalised-alpha": kernels.GENERALISED_ALPHA,
        "midpoint": kernels.MIDPOINT,
        "discrete-gradient": kernels.DISCRETE_GRADIENT,
        "verlet": kernels.VERLET,
    }
)
# order of convergence in the step
ORDERS = MappingProxyType({name: TABLEAUS[name]().constrained if name in TABLEAUS else 2 for name in METHODS})

# methods that are of elastic forces alone
UNDAMPED = (kernels.DISCRETE_GRADIENT, kernels.VERLET)
# methods with an estimate of their local error
ADAPTIVE = (*TABLEAUS, "newmark", "generalised-alpha")

TOLERANCE = 1e-5
# rad; the loop's own bound on the clamp's turn in a step, and that over the one of `ends`
LARGEST_TURN, _LARGEST = 0.5, 10.0
_warm: set[int] = set()


@checked
def simulate(
    scene: Scene,
    *,
    initial: RestState | History | None = None,
    nodes: int = 151,
    clamp: str = "centred",
    method: str | Tableau = "tr-bdf2",
    step: float | None = None,
    tolerance: float | None = None,
    spectral_radius: float = 0.8,
    newton_tolerance: float | None = None,
    every: int | None = None,
    configurations: bool = True,
    until: str = "end",
) -> History:
    """Move the control and follow the motion (paper, sections 3.2, 6 and 7).

    Clamped nodes follow the clamps; their mass counts for the weight alone.

    Parameters
    ----------
    scene: with `stop` or a `schedule`; the ramp to `stop` and the hold after it are both followed.
    initial: what the motion starts from instead of the scene's `start`: a `RestState` of `der.state` on the
        same nodes, at rest; or a `History` of `der` on them, whose last instant is gone on from: time
        goes on, and dissipated energy and work.  Of the same ribbon; its clamps have to be where the
        scene's begin.  To the last bit the uninterrupted run where that has a kink then.
        What snaps is then told by the equilibrium in which the motion begins, where it begins in one
        (`History.snap`).
    nodes, clamp: the discretisation, see `der.rod`.
    method: one of `METHODS`; their orders are in `ORDERS`.
    step: fixed step in s; None (the default) for adaptive steps.  ``verlet`` has fixed steps
        only.  A step whose Newton iteration fails is halved and grows back.
    tolerance: adaptive: the local error of the positions in a step, in L; default 1e-5, which
        leaves less in a snap's angle (1e-5 rad in the median of drawn scenes) than 151 nodes do (8e-5);
        `pytest -m slow -s -n 0 tests/test_defaults.py`.
    spectral_radius: of generalised-alpha at infinite frequency, in [0, 1].
    newton_tolerance: Newton stops at an update below it (positions in L, a tenth of angles); by
        default 1e-8 with a fixed step and a thousandth of `tolerance` with adaptive ones.  Of what is left
        the stiff direction makes a force: reactions of short fixed steps are smooth below 1e-11.
    every: keep the rows of each `every`-th accepted step, and the last; None keeps all up to 160 MB, and
        thins them out then (`History`).
    configurations: False leaves positions and directors out of the result.
    until: "decided" ends a held ribbon's run once its energy is below that of every saddle that
        the curve of equilibria through its start has at `stop`: it cannot leave the state it is
        in any more.  "snap" ends it soon after the height first changes sign.  "end" (the default)
        goes through the whole hold.

    Returns
    -------
    History
        `configurations` holds "positions" (rows, N, 3) in L and "normals" (rows, N - 1, 3), the
        directors m1 of the edges, and "velocities" (rows, N, 3) in L/s, where they do not ring ("newmark",
        "midpoint", "discrete-gradient").

    Raises
    ------
    SceneError
        For a scene without `stop` and schedule, or whose start is not a stable equilibrium; for clamps of
        `initial` that do not fit.
    OptionError
        For an option that cannot be, a method that takes no `Ribbon.retardation`, an `initial` of
        something else.
    SolverError
        If no step down to 1e-9 of the inertial time converges, or if the energy grows from
        nowhere (an unstable step); carries the history so far.
    """
    stop = scene.require_stop()
    name = "" if isinstance(method, Tableau) else choice("method", method, tuple(METHODS))
    choice("until", until, ("end", "decided", "snap"))
    if step is not None and tolerance is not None:
        raise OptionError(f"tolerance = {tolerance!r}: a run has a fixed step or a tolerance, not both")
    if step is None and name and name not in ADAPTIVE:
        raise OptionError(f"step = None: {method} needs a fixed step (s); adaptive are {', '.join(ADAPTIVE)}")
    within("spectral_radius", spectral_radius, 0.0, 1.0)
    fixed, local = step, TOLERANCE if tolerance is None else tolerance
    if newton_tolerance is None:
        # updates fall at least tenfold each, so that what is left is a tenth of the last; below
        # 1e-11 rounding takes over
        newton_tolerance = 1e-8 if fixed is not None else max(1e-11, 1e-3 * local)
    newton = within("newton_tolerance", newton_tolerance, 1e-14, 1e-2)
    rod = Rod(scene, nodes, clamp)
    row = 8.0 * (kernels.ROW_SIZE + (6 * rod.nodes if configurations else 0))
    require_duration(scene, fixed, LARGEST_TURN, row / every if every else 0.0)
    unit = scene.ribbon.inertial_time
    options = step_options(method, 0.0 if fixed is None else fixed / unit, local, newton, spectral_radius)
    if rod.retardation > 0.0 and options.method in UNDAMPED:
        raise OptionError(f"method = {method!r}: takes no Ribbon.retardation; the others do")
    state, began = (start_state(rod), 0.0) if initial is None else initial_states.of(rod, initial)
    rest = None if initial is None else initial_states.rest_of(rod, state, initial)
    mesh = {"nodes": rod.nodes, "clamp": rod.clamp}
    ends = _controls(scene, began)
    # a control that stands still at the end of its motion
    held = bool(ends.kinks.size > 2 and not ends.pieces[ends.first[-2] : -1, 1:].any())
    course = kernels.Course(
        float(scene.scaled_damping),
        float(ends.kinks[-2] if held else ends.kinks[-1]),
        _barrier(scene.at_rest, nodes, clamp, stop) if until == "decided" else -np.inf,
        began + snaps_since(scene, until, "der", mesh, rest) / unit if until == "snap" else np.inf,
    )
    given = options_given(tolerance=local if fixed is None else None, newton_tolerance=newton)
    if options.method not in _warm:
        # compiled (or loaded) before the clock starts: one step of a short ramp
        _warm.add(options.method)
        short = ends._replace(kinks=1e-9 * np.arange(2.0), first=ends.first[:1].repeat(2))
        Loop(rod, state, options._replace(step=1e-6), 1, False).go(short, course)
    run = Loop(rod, state, options, every, configurations)
    if initial is not None:
        run.go_on(initial)
    begin = clock_time.perf_counter()
    status = run.go(ends, course)
    seconds = clock_time.perf_counter() - begin
    history = run.history(scene, given, {"seconds": seconds}, initial, rest)
    if status != kernels.DONE:
        if run.rows.full:
            cause = f"{run.rows.full}; `every` and `configurations=False` keep less"
        elif status == kernels.STUCK:
            steps = f"step = {fixed:g} s" if fixed is not None else f"tolerance = {local:g}"
            cause = f"it does not converge, with steps from {steps} down to {1e-9 * unit:.1e} s"
        else:
            cause = "its energy grew by more than a quarter beyond the work that was done"
        raise SolverError(
            f"{getattr(method, 'name', method)} stopped at t = {run.clock[kernels.TIME] * unit:.6g} s, "
            f"{control_text(scene, history.control[-1])}, on {rod.nodes} nodes: {cause}",
            history,
        )
    return history


def step_options(
    method: str | Tableau, step: float, local: float, newton: float, radius: float = 0.0
) -> kernels.StepOptions:
    """What the loop is told of a method; `step` in units of t*, 0 for adaptive ones to `local` in L."""
    if isinstance(method, Tableau):
        kind, tableau = kernels.RUNGE_KUTTA, method
    else:
        # (those that are no Runge-Kutta methods have no use for a tableau)
        kind, tableau = METHODS[method], TABLEAUS[method if method in TABLEAUS else "tr-bdf2"]()
    embedded = tableau.embedded if kind == kernels.RUNGE_KUTTA else ORDERS[str(method)]
    return kernels.StepOptions(
        kind,
        step,
        local,
        newton,
        float(np.inf),
        1e-9,
        float(radius),
        # (of a value arrays are read-only, which to compiled code is another type)
        tableau.a.copy(),
        tableau.c,
        tableau.error.copy(),
        1.0 + embedded,
    )


def _controls(scene: Scene, began: float = 0.0) -> Ends:
    """The scene's controls in time from `began` (t*); a constant rate hides nothing inside of a step."""
    return moving(scene, _LARGEST, began, 0.1 if scene.schedule is not None else np.inf)


@lru_cache(maxsize=16)
def _barrier(scene: Scene, nodes: int, clamp: str, control: float) -> float:
    """Energy of the lowest saddle at a control; -inf if there is none: nothing is then decided early."""
    rod = Rod(scene, nodes, clamp)
    problem, state = Statics(rod), start_state(rod)
    return lowest_saddle(problem, state, problem.potential, scene, control, default_steps(rod))
