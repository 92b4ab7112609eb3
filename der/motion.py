"""The ribbon in motion: `simulate`.

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

from ribbonfem.continuation import at_parameter, first_point, trace
from ribbonfem.frozen import freeze
from ribbonfem.options import OptionError, checked, choice, require_duration, within
from ribbonfem.results import Array, History, SolverError
from ribbonfem.row_buffer import some_steps
from ribbonfem.rows import Columns, Rows
from ribbonfem.scene import Scene
from ribbonfem.tableaus import TABLEAUS, Tableau

from . import kernels
from . import out_of_plane as plane
from .problem import Statics, default_steps
from .rod import Rod, RodState
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

# methods whose velocities ring from step to step, along the ribbon: they are those of no motion
RINGING = (kernels.NEWMARK, kernels.MIDPOINT, kernels.DISCRETE_GRADIENT)
# methods with an estimate of their local error
ADAPTIVE = (*TABLEAUS, "newmark", "generalised-alpha")

TOLERANCE = 1e-5
_COLUMNS = Columns(
    kernels.ROW_TIME,
    kernels.ROW_ANGLE,
    kernels.ROW_HEIGHT,
    kernels.ROW_SLOPE,
    kernels.ROW_VELOCITY,
    kernels.ROW_KINETIC,
    kernels.ROW_KEPT,
)
# rad; the loop's own bound on the clamp's turn in a step
LARGEST_TURN = 0.5
_warm: set[int] = set()


@checked
def simulate(
    scene: Scene,
    *,
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
    """Turn the clamp and follow the motion (paper, sections 3.2, 6 and 7).

    Parameters
    ----------
    scene: with `stop`; the ramp to `stop` and the hold after it are both followed.
    nodes, clamp: the discretisation, see `der.rod`.
    method: one of `METHODS`; their orders are in `ORDERS`.
    step: fixed step in s; None (the default) for adaptive steps.  ``verlet`` has fixed steps
        only.  A step whose Newton iteration fails is halved and grows back.
    tolerance: adaptive: the local error of the positions in a step, in L; default 1e-5, which
        leaves less in a snap's angle (1e-5 rad in the median of drawn scenes) than 151 nodes do (8e-5);
        `pytest -m slow -s -n 0 tests/test_defaults.py`.
    spectral_radius: of generalised-alpha at infinite frequency, in [0, 1].
    newton_tolerance: Newton stops at an update below it (positions in L, a tenth of angles); by
        default 1e-8 with a fixed step and a thousandth of `tolerance` with adaptive ones.
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
        directors m1 of the edges.

    Raises
    ------
    SceneError
        For a scene without `stop`, or whose start is not a stable equilibrium.
    OptionError
        For a policy value that cannot be.
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
    state = start_state(rod)

    unit = scene.ribbon.inertial_time
    ramp = kernels.Ramp(
        float(scene.scaled_rate),
        float(stop),
        float(scene.instants()[1]),
        float(scene.scaled_damping),
        _lowest_saddle(scene.at_rest, nodes, clamp, stop) if until == "decided" else -np.inf,
        until == "snap",
    )
    policy = policy_of(method, 0.0 if fixed is None else fixed / unit, local, newton, spectral_radius)
    given = {
        "nodes": nodes,
        "clamp": clamp,
        "method": method,
        "step": fixed,
        "tolerance": local if fixed is None else None,
        "spectral_radius": spectral_radius,
        "newton_tolerance": newton,
        "every": every,
        "configurations": configurations,
        "until": until,
    }
    if policy.method not in _warm:
        # compiled (or loaded) before the clock starts: one step of a short ramp
        _warm.add(policy.method)
        Loop(rod, state, policy._replace(step=1e-6), 1, False).go(
            ramp._replace(stop=1e-9 * ramp.rate, end=1e-9)
        )
    run = Loop(rod, state, policy, every, configurations)
    begin = clock_time.perf_counter()
    status = run.go(ramp)
    seconds = clock_time.perf_counter() - begin
    leaves = {"leaves_plane": plane.leaves_plane(scene, nodes, clamp)} if scene.planar else {}
    history = run.history(scene, given, {"seconds": seconds, **leaves})
    if status != kernels.DONE:
        if run.rows.full:
            cause = f"{run.rows.full}; `every` and `configurations=False` keep less"
        elif status == kernels.STUCK:
            asked = f"step = {fixed:g} s" if fixed is not None else f"tolerance = {local:g}"
            cause = f"from {asked} down to {1e-9 * unit:.1e} s no step found a next state"
        else:
            cause = "its energy grew by more than a quarter beyond the work done"
        raise SolverError(
            f"{getattr(method, 'name', method)} stopped at t = {run.clock[kernels.TIME] * unit:.6g} s, "
            f"alpha = {history.angle[-1]:.6g}, on {rod.nodes} nodes: {cause}",
            history,
        )
    return history


def policy_of(
    method: str | Tableau, step: float, local: float, newton: float, radius: float = 0.0
) -> kernels.Policy:
    """What the loop is told of a method; `step` in units of t*, 0 for adaptive ones to `local` in L."""
    if isinstance(method, Tableau):
        kind, tableau = kernels.RUNGE_KUTTA, method
    else:
        # (those that are no Runge-Kutta methods have no use for a tableau)
        kind, tableau = METHODS[method], TABLEAUS[method if method in TABLEAUS else "tr-bdf2"]()
    embedded = tableau.embedded if kind == kernels.RUNGE_KUTTA else ORDERS[str(method)]
    return kernels.Policy(
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


@lru_cache(maxsize=16)
def _lowest_saddle(scene: Scene, nodes: int, clamp: str, angle: float) -> float:
    """Lowest energy of the states with one unstable direction at an angle, on the curve through the start.

    -inf if there is none: nothing is then decided early.
    """
    rod = Rod(scene, nodes, clamp)
    state = start_state(rod)
    problem, steps = Statics(rod), default_steps(rod)
    energies = []
    for sign in (-1.0, 1.0):
        for segment in trace(problem, first_point(problem, state, 0.0, sign), (-3.0, 3.0), steps):
            ends = segment.start.parameter - angle, segment.end.parameter - angle
            if ends[0] * ends[1] < 0.0 and segment.start.index == segment.end.index == 1:
                energies.append(problem.energy(at_parameter(problem, segment, angle, steps).state))
    return min(energies, default=-np.inf)


class Loop:
    """A motion between its calls of the compiled loop: buffers, and the rows written so far."""

    def __init__(
        self,
        rod: Rod,
        state: RodState,
        policy: kernels.Policy,
        every: int | None,
        configurations: bool,
        velocity: Array | None = None,
        damping: float = 0.0,
    ) -> None:
        size = 4 * rod.nodes
        statics = Statics(rod)
        self.rod, self.policy, self.every = rod, policy, every or 1
        self.clock = np.zeros(kernels.CLOCK_SIZE)
        self.motion = kernels.Motion(
            state.x.copy(),
            np.zeros(size),
            np.zeros(size),
            np.zeros(size),
            statics.edges(state.x)[0],
            state.m1.copy(),
            state.twist.copy(),
            self.clock,
        )
        band = (size + kernels.WIDTH, kernels.WIDTH + 1)
        self.scratch = kernels.Scratch(
            x=state.x.copy(),
            tangent=np.zeros_like(state.m1),
            inverse=np.zeros(rod.nodes - 1),
            m1=state.m1.copy(),
            twist=state.twist.copy(),
            dq=np.zeros(size),
            stage_v=np.zeros((len(policy.table), size)),
            stage_a=np.zeros((len(policy.table), size)),
            v=np.zeros(size),
            b=np.zeros(size),
            gradient=np.zeros(size),
            gradient1=np.zeros(size),
            hessian=np.zeros(band),
            factors=np.zeros(band),
            right=np.zeros(size + kernels.WIDTH),
            energies=np.zeros(3),
            turn=np.zeros(rod.nodes),
        )
        self.constants = kernels.Rod(rod.stiffness, rod.rest, rod.stretch, rod.inertia, rod.arclength)
        gradient = statics.assemble(state, second=False)[1]
        self.clock[kernels.POWER] = kernels.clamp_moment(self.constants, gradient, 0.0)
        # adaptive runs start with a step far below any period and grow
        self.clock[kernels.STEP] = policy.step or 1e-4
        if velocity is not None:
            free = rod.free
            self.motion.v[free] = velocity
            self.motion.a[free] = -gradient[free] / rod.inertia[free] - damping * velocity
        nodes = rod.nodes
        shapes = ((nodes, 3), (nodes - 1, 3)) if configurations else ()
        self.rows = Rows(kernels.ROW_SIZE, _COLUMNS, *shapes, every=every)
        self.none = (np.empty((0, nodes, 3)), np.empty((0, nodes - 1, 3)))

    def _room(self) -> tuple[Array, Array, Array]:
        """Where the next rows go."""
        rows, *configurations = self.rows.reserve()
        x, m1 = configurations or self.none
        self.clock[kernels.ROW] = self.clock[kernels.PLACE] = 0.0
        return some_steps(rows, self.rod.nodes), x, m1

    def go(self, ramp: kernels.Ramp) -> int:
        """Run to the end or until it fails; returns the status of the compiled loop."""
        rows, x, m1 = self._room()
        kernels.record(self.constants, self.motion, self.scratch, ramp, rows, x, m1, True)
        while True:
            status = kernels.run(
                self.constants, self.motion, self.scratch, ramp, self.policy, self.every, rows, x, m1
            )
            self.rows.wrote(int(self.clock[kernels.ROW]))
            if status != kernels.FULL or self.rows.full:
                return int(status)
            rows, x, m1 = self._room()

    def history(
        self, scene: Scene, policy: dict[str, object], stats: dict[str, float], began: float = 0.0
    ) -> History:
        """The rows so far as a `History` from the loop's time `began`."""
        second = scene.ribbon.inertial_time
        # (velocities that ring are none)
        per_second = np.nan if self.policy.method in RINGING else 1.0 / second
        taken, steps = self.rows.taken({kernels.ROW_TIME: second, kernels.ROW_VELOCITY: per_second}, began)
        rows, *configurations = map(freeze, taken)
        clock = self.clock
        time, angle, height, slope, *energies, load, velocity, _ = rows.T
        return History(
            time=time,
            control=angle,
            height=height,
            slope=slope,
            load=load,
            velocity=velocity,
            arclength=np.array(self.rod.arclength),
            energies=dict(zip(("kinetic", "elastic", "dissipated", "work"), energies, strict=True)),
            configurations=dict(zip(("positions", "normals"), configurations, strict=False)),
            stats={
                "steps": int(clock[kernels.STEPS]),
                "newton_iterations": int(clock[kernels.ITERATIONS]),
                "assemblies": int(clock[kernels.ASSEMBLIES]),
                "rejected": int(clock[kernels.REJECTED]),
                **self.rows.stats,
                **stats,
            },
            scene=scene,
            policy=policy,
            model="der",
            steps=freeze(steps),
        )
