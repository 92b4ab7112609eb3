"""Public `simulate` of the ribbon: from a scene to arrays and through the compiled time loop.

With lengths in L, forces in EI2/L^2, time in t*, c = EI2 / (EA L^2) or 0, the rod has the energy

    int [ 1/2 (EI1 kappa1^2 + EI2 kappa2^2 + GJ tau^2) + n.(r' - t) - c (n.t)^2 / 2 ] ds

and the inertia of r and of the rotation about the tangent (`Ribbon.rotary_inertia`): what the
discrete rods tend to.  Bending rotations and n carry no mass and follow at the same instant.
Damping is -nu M v on both.  Spin is balanced as in the rods and the paper, J theta''; the full
d(J theta' t)/dt has a gyroscopic moment besides (`gyroscopic=True`), which does no work.

r is continuous of degree p = 5, frames are unit quaternions at the same Gauss-Lobatto nodes,
interpolated and normalised, so that an element that is turned has the same strains; n has its
values at the p Gauss points, which take all integrals; the mass is lumped.  An equilibrium of
`kirchhoff` on the same mesh is one of these equations.  The force as an unknown keeps the rod from
locking and serves c = 0 and c > 0 alike, snap angles converge with the power 2 p = 10 of the
mesh, and inside the elements everything is eliminated (`tangent`): six unknowns a node.  What is
done for an element is done for four of them at once (`kernels.fours`).
"""

from __future__ import annotations

import time as clock_time
from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np

from ribbonfem.continuation import at_parameter, first_point, trace
from ribbonfem.continuation.curves import steps_for
from ribbonfem.continuation.vibration import lowest_squares
from ribbonfem.elements.lobatto import lobatto_weights
from ribbonfem.ends import held, moving
from ribbonfem.ends.kernels import Ends
from ribbonfem.frozen import freeze
from ribbonfem.material.kernels import LAW
from ribbonfem.options import checked, options_given, require_duration
from ribbonfem.results import Array, History, RestState, SolverError, snaps_since, told
from ribbonfem.row_buffer import some_steps
from ribbonfem.rows import Columns, Rows, reactions_in
from ribbonfem.scene import Scene
from ribbonfem.stepping import control as steps_control
from ribbonfem.stepping.control import LARGEST_TURN, Control, problem_of
from ribbonfem.stepping.kernels import (
    FULL,
    HEIGHT,
    KEPT,
    KINETIC,
    LOAD,
    MEAN,
    NEWTON,
    PLACES,
    REACTIONS,
    REJECTED,
    ROWS,
    STEPS,
    VELOCITY,
    Ramp,
    Scheme,
)
from ribbonfem.stepping.methods import ALL_METHODS
from ribbonfem.stepping.motion import ENERGIES
from ribbonfem.tableaus import Tableau

from . import initial_states, states
from .kernels import arrays, condensed, loop, tangent
from .kernels import average_vector_field as conserving
from .kernels.batch import in_fours
from .kernels.rod import Four, P, Rod, solver
from .problem import Frames, Statics, checked_mesh

UNTIL = ("end", "snap", "decided")
ELEMENTS, TOLERANCE = 8, 3e-5
# 1/t*^2; the lowest frequencies squared are some hundreds
SHIFT = 100.0
# part of the tolerance that Newton may leave in a position
REST = 3e-3
# L; the most that it may leave where energy is to be balanced: of means of forces
MEAN_REST = 1e-7
# part of the largest energy so far that an adaptive step may gain: a method that damps little may pump what
# it does not resolve
GAIN = 1e-3
# the same of means of forces along a step, of three points
MEAN_GAIN = 1e-4
# a step grows by this factor at least, or stays: a new one costs new factors
LEAST_GROWTH = 1.4
_COLUMNS = Columns(0, 1, HEIGHT, arrays.SLOPE, VELOCITY, KINETIC, KEPT)
# loops that are compiled or loaded in this process
_warm: set[Callable[..., int]] = set()


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
    gyroscopic: bool = False,
    every: int | None = None,
    configurations: bool = True,
    until: str = "end",
    initial: RestState | History | None = None,
) -> History:
    """The motion from rest in the start state, through the ramp and the hold, or the schedule.

    Parameters
    ----------
    scene: with a `stop` or a `schedule`.
    elements: an even number of at least 4; errors fall as elements^-10.  They are done four at a
        time: 6 take nearly the time of 8, and 10 that of 12.
    extensible: whether the ribbon stretches, with EA of the scene's ribbon.
    method: "esdirk4", "esdirk3" (`ribbonfem.tableaus`), "tr-bdf2", "generalised-alpha", "newmark"
        (trapezoidal), "implicit-euler" or "discrete-gradient", of order 2, which alone keeps the
        energy of undamped ringing, whatever the step (`kernels.conserving`): the one for a ring-down, with
        ``tolerance=1e-4``.  What another takes is in the history's `stats`.
        The others lose or gain it: velocities of their steps do not fit the constraint (an
        inextensible ribbon gains energy), and fast waves are damped.
    step: a fixed step in s, shortened so that a whole number of steps fits the ramp, and halved
        where no next state is found.
    tolerance: of the adaptive step, the local error of positions in L, made smaller while the
        ribbon creeps (down to 0.01 of it); 3e-5 if neither is given,
        which leaves 2e-6 rad in a snap's angle in the median of drawn scenes and 7e-5 at most, where the
        mesh leaves 1e-7 (`pytest -m slow -s -n 0 tests/test_defaults.py`).  A step in which the energy grows
        by a thousandth more than the work done is halved too.
    spectral_radius: of "generalised-alpha" at infinite frequency, in (0, 1]; 0.8.
    gyroscopic: whether the spin about the tangent turns with it, d(J theta' t)/dt; False is the
        balance of the rods and of the paper.
    every: keep the rows of each `every`-th accepted step, and the last; None keeps all up to 160 MB, and
        thins them out then (`History`).
    configurations: False leaves positions and directors out of the result.
    until: "end"; "snap", soon after the height first changes sign; "decided" ends a held ribbon's
        run once its energy is below that of every saddle that the curve of equilibria through
        its start has at `stop`.
    initial: a `RestState` to begin at in place of the scene's `start`, or a `History` whose last instant is
        gone on from: time goes on, and dissipated energy and work.  Of the same model, mesh and ribbon; its
        clamps have to be where the scene's begin.  To the last bit the uninterrupted run where that has a
        kink then.

    Returns
    -------
    History
        `configurations` holds "positions" (rows, nodes, 3) in L and "normals" (rows, nodes, 3),
        the directors m1, at the Gauss-Lobatto nodes.

    Raises
    ------
    SceneError
        For a scene without `stop`, or whose start is not a stable equilibrium.
    OptionError
        For an option that cannot be.
    SolverError
        If no step converges, or if the energy grows from nowhere; what was reached is its `history`.
    """
    control = Control.of(method, step, tolerance, until, spectral_radius, TOLERANCE, UNTIL, ALL_METHODS)
    mesh = checked_mesh(elements, extensible)
    nodes = P * mesh["elements"] + 1 if configurations else 0
    row = 8.0 * (arrays.ROW_SIZE + 6 * nodes)
    require_duration(scene, control.step, LARGEST_TURN, row / every if every else 0.0)
    first: Callable[[], arrays.Motion] | None = None
    began = 0.0
    if initial is None:
        problem, start = states.named(scene, **mesh)
    else:
        problem = states.in_control(scene, **mesh)
        start, first, began = initial_states.of(problem, scene, initial)
    barrier = _lowest_saddle(scene.at_rest, scene.require_stop(), **mesh) if until == "decided" else -np.inf
    ends = moving(scene, began=began) if began else None
    since = began + snaps_since(scene, until, "kirchhoff", mesh) / problem.unit
    ramp = ramp_of(scene, control, ends=ends, since=since, every=every or 1, barrier=barrier)
    options = options_given(tolerance=control.tolerance)
    return integrate(problem, start, scene, control, ramp, options, configurations, first, initial)


@lru_cache(maxsize=16)
def _lowest_saddle(scene: Scene, angle: float, *, elements: int, extensible: bool) -> float:
    """Lowest energy of the states with one unstable direction at an angle, on the curve through the start.

    -inf if there is none: nothing is then decided early.
    """
    problem, state = states.named(scene, elements=elements, extensible=extensible)
    steps, span = steps_for(scene), (-scene.reach_towards(-1.0), scene.reach_towards(1.0))
    if scene.turning:
        span = (-3.0, 3.0)
    energies = []
    for sign in (-1.0, 1.0):
        for segment in trace(problem, first_point(problem, state, scene.begin, sign), span, steps):
            ends = segment.start.parameter - angle, segment.end.parameter - angle
            if ends[0] * ends[1] < 0.0 and segment.start.index == segment.end.index == 1:
                energies.append(problem.energy(at_parameter(problem, segment, angle, steps).state))
    return min(energies, default=-np.inf)


def discretised(problem: Statics, scene: Scene, gyroscopic: bool = False) -> Rod:
    """The rod as arrays for the compiled time loop."""
    tables, elements, p = problem.tables, problem.tables.elements, P
    mass = np.tile(lobatto_weights(p) / elements, (elements, 1))
    inertia = np.repeat(problem.mass[:, None], 4, axis=1)
    inertia[:, 3] *= scene.ribbon.rotary_inertia
    coupling = tables.weights[:, :, None] * tables.slope
    inside = coupling[:, :, 1:p]
    share = np.einsum("eki,eli,ei->ekl", inside, inside, 1.0 / mass[:, 1:p])
    fours = map(in_fours, (tables.slope, tables.weights, coupling, share, mass))
    natural = in_fours(problem.natural)
    offset = np.concatenate((natural, np.zeros_like(natural[:, :, :1])), axis=2)
    retardation = scene.ribbon.retardation / problem.unit
    return Rod(
        value=tables.value,
        slope=tables.slope,
        weights=tables.weights,
        coupling=np.ascontiguousarray(coupling),
        four=Four(*fours),
        inertia=inertia,
        spin=scene.ribbon.rotary_inertia,
        gyroscopic=gyroscopic,
        middle=len(inertia) // 2,
        stiffness=problem.stiffness.copy(),
        compliance=np.array([problem.compliance]),
        offset=offset,
        uneven=scene.ribbon.shaped or retardation > 0.0,
        elastic=np.append(problem.stiffness, problem.compliance),
        natural=natural,
        retardation=retardation,
        weight=np.append(problem.ends.weight, 0.0),
        heavy=bool(problem.ends.weight.any()),
    )


def vibrations(problem: Statics, state: Frames, scene: Scene, count: int) -> Array:
    """The lowest `count` angular frequencies (count,), 1/s, of small undamped motions about a state at rest.

    Of the equations of motion: in a stretching rod the force does not stay constant along it.
    """
    rod, start = discretised(problem, scene), initial_states.at_rest(problem, state)
    memory = solver(len(rod.weights))
    tangent.fill(rod, memory, start.g, start.n, SHIFT, False)
    condensed.factorise(memory)
    inertia = rod.inertia[1:-1].ravel()

    def solve(right: Array) -> Array:
        # positions and spin carry all the mass
        load = right.reshape(-1, 4)
        memory.fr[1:-1, :3], memory.fp[1:-1] = -load[:, :3], 0.0
        memory.fp[1:-1, 0] = -load[:, 3]
        memory.fn[:] = 0.0
        condensed.solve(rod, memory, SHIFT)
        return np.column_stack((memory.fr[1:-1, :3], memory.fp[1:-1, 0])).ravel()

    squares = lowest_squares(solve, lambda x: inertia * x, len(inertia), count, SHIFT)
    return np.asarray(np.sqrt(squares) / problem.unit)


def ramp_of(
    scene: Scene,
    control: Control,
    *,
    ends: Ends | None = None,
    since: float = 0.0,
    every: int = 1,
    barrier: float = -np.inf,
) -> Ramp:
    """What the controls do, and the control of steps."""
    newton = steps_control.NEWTON_TOLERANCE
    if control.tolerance is not None:
        newton = min(MEAN_REST, REST * control.tolerance) if control.method.mean else REST * control.tolerance
    return steps_control.ramp_of(
        scene,
        control,
        ends,
        since,
        newton=newton,
        every=every,
        barrier=barrier,
        gain=MEAN_GAIN if control.method.mean else GAIN,
        least_growth=LEAST_GROWTH,
    )


def loop_of(scheme: Scheme) -> Callable[..., int]:
    """The compiled time loop that solves the stages of a method."""
    run: Callable[..., int] = loop.run_by_means if scheme.kind == MEAN else loop.run
    return run


class Loop:
    """A motion between its calls of the compiled loop: buffers, and the rows written so far."""

    def __init__(
        self,
        rod: Rod,
        scheme: Scheme,
        motion: arrays.Motion,
        configurations: bool,
        s: Array,
        every: int | None = None,
    ) -> None:
        elements = len(rod.weights)
        self.rod, self.scheme, self.motion = rod, scheme, motion
        self.arclength = s
        self.solver = solver(elements)
        # means of steps are kept in the places of stages
        stages = conserving.STAGES if scheme.kind == MEAN else scheme.stages
        self.scratch = arrays.scratch(elements, stages, rod.retardation > 0.0)
        nodes = len(motion.x)
        shapes = ((nodes, 3), (nodes, 3)) if configurations else ()
        self.rows = Rows(arrays.ROW_SIZE, _COLUMNS, *shapes, every=every)
        self.none = (np.empty((0, nodes, 3)), np.empty((0, nodes, 3)))

    def go(self, ramp: Ramp) -> int:
        """Run to the end or until it fails; returns the status of the compiled loop."""
        self.rows.kinks = ramp.ends.kinks
        while True:
            rows, *configurations = self.rows.reserve()
            x, m1 = configurations or self.none
            self.motion.clock[ROWS] = self.motion.clock[PLACES] = 0.0
            model = arrays.Moving(self.rod, self.solver, self.scratch, self.motion, x, m1)
            some = some_steps(rows, len(self.motion.x))
            status = loop_of(self.scheme)(model, self.scheme, ramp, some)
            self.rows.wrote(int(self.motion.clock[ROWS]))
            if status != FULL or self.rows.full:
                return int(status)

    def history(
        self,
        scene: Scene,
        options: dict[str, Any],
        stats: dict[str, float],
        initial: RestState | History | None = None,
    ) -> History:
        """The rows so far, of a motion that began with `initial`."""
        second = scene.ribbon.inertial_time
        # velocities of a mean of forces ring from step to step
        per_second = np.nan if self.scheme.kind == MEAN else 1.0 / second
        taken, steps = self.rows.taken({0: second, VELOCITY: per_second})
        reactions = reactions_in(taken[0], REACTIONS, initial)
        rows, *configurations = map(freeze, taken)
        clock = self.motion.clock
        law = {name: getattr(self.rod, name).copy() for name in LAW}
        columns = rows.T
        kept = dict(zip(("positions", "normals"), configurations, strict=False))
        return History(
            time=columns[0],
            control=columns[1],
            height=columns[2],
            slope=columns[arrays.SLOPE],
            energies=dict(zip(ENERGIES, columns[KINETIC:LOAD], strict=True)),
            configurations=kept,
            load=columns[LOAD],
            arclength=self.arclength,
            velocity=columns[VELOCITY],
            stats={
                "steps": int(clock[STEPS]),
                "newton_iterations": int(clock[NEWTON]),
                "assemblies": int(clock[arrays.ASSEMBLIES]),
                "rejected": int(clock[REJECTED]),
                **self.rows.stats,
                **stats,
            },
            scene=scene,
            options=options,
            model="kirchhoff",
            steps=freeze(steps),
            resume={name: value.copy() for name, value in self.motion._asdict().items()} | law,
            reactions=reactions,
        )


def integrate(
    problem: Statics,
    start: Frames,
    scene: Scene,
    control: Control,
    ramp: Ramp,
    options: dict[str, Any],
    configurations: bool,
    first: Callable[[], arrays.Motion] | None = None,
    initial: RestState | History | None = None,
) -> History:
    """Step a rod from rest in an equilibrium through the scene's ramp and hold, or from a `first` state.

    That is the last instant of `initial`, if this is a motion.

    Raises
    ------
    SolverError
        If the end was not reached; its `history` is what was.
    """
    rod = discretised(problem, scene, options.get("gyroscopic", False))
    scheme = control.method.as_scheme()

    own = {name: getattr(rod, name).copy() for name in LAW}
    if isinstance(initial, History):
        own |= initial.resume

    def begin() -> arrays.Motion:
        for name in LAW:
            getattr(rod, name)[:] = own[name]
        return first() if first else initial_states.at_rest(problem, start, rod.retardation > 0.0)

    if loop_of(scheme) not in _warm:
        # compiled (or loaded) before the clock starts: one step of a short ramp
        _warm.add(loop_of(scheme))
        short = held(scene, start.at, 1e-6, float(ramp.ends.kinks[0]))
        Loop(rod, scheme, begin(), False, problem.arclength).go(
            ramp._replace(ends=short, end=1e-6, fixed=1e-6)
        )
    every = options.get("every")
    run = Loop(rod, scheme, begin(), configurations, problem.arclength, every)
    began = clock_time.perf_counter()
    status = run.go(ramp)
    stats = {"seconds": clock_time.perf_counter() - began}
    history = run.history(scene, options, stats, initial)
    problem_met = run.rows.full or problem_of(status, scene, control)
    if problem_met:
        where = f"t = {history.time[-1]:.6g} s, {told(scene, history.control[-1])}"
        raise SolverError(f"kirchhoff: stopped at {where}: {problem_met}", history)
    return history
