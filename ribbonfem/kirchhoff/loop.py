"""The Python side of the time loop of the Kirchhoff rod: buffers, calls of compiled code, the `History`."""

from __future__ import annotations

import time as clock_time
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from ribbonfem.ends import held
from ribbonfem.ends.kernels import Ends
from ribbonfem.frozen import freeze
from ribbonfem.material.kernels import LAW
from ribbonfem.results import Array, History, RestState, SolverError, control_text
from ribbonfem.row_buffer import some_steps
from ribbonfem.rows import Columns, Rows, reactions_in, shapes_of
from ribbonfem.scene import Scene
from ribbonfem.stepping import control as steps_control
from ribbonfem.stepping.control import Control, problem_of
from ribbonfem.stepping.kernels import (
    ASSEMBLIES,
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
from ribbonfem.stepping.motion import ENERGIES

from . import initial_states
from .discretisation import discretised
from .kernels import arrays, average_vector_field, loop
from .kernels.rod import Rod, solver
from .problem import Frames, Statics

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
        stages = average_vector_field.STAGES if scheme.kind == MEAN else scheme.stages
        self.scratch = arrays.scratch(elements, stages, rod.retardation > 0.0)
        nodes = len(motion.x)
        shapes = ((nodes, 3), (nodes, 3), (nodes, 3)) if configurations else ()
        self.rows = Rows(arrays.ROW_SIZE, _COLUMNS, *shapes, every=every)
        self.none = [np.empty((0, nodes, 3))] * 3

    def go(self, ramp: Ramp) -> int:
        """Run to the end or until it fails; returns the status of the compiled loop."""
        self.rows.kinks = ramp.ends.kinks
        while True:
            rows, *configurations = self.rows.reserve()
            self.motion.clock[ROWS] = self.motion.clock[PLACES] = 0.0
            model = arrays.Moving(
                self.rod, self.solver, self.scratch, self.motion, *(configurations or self.none)
            )
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
        rest: Mapping[str, Array] | None = None,
    ) -> History:
        """The rows so far, of a motion that began with `initial`, and follows `rest`."""
        second = scene.ribbon.inertial_time
        # velocities of a mean of forces ring from step to step
        per_second = np.nan if self.scheme.kind == MEAN else 1.0 / second
        taken, steps = self.rows.taken({0: second, VELOCITY: per_second})
        reactions = reactions_in(taken[0], REACTIONS, initial)
        rows, *configurations = taken
        freeze(rows)
        clock = self.motion.clock
        law = {name: getattr(self.rod, name).copy() for name in LAW}
        columns = rows.T
        kept = shapes_of(configurations, "normals", per_second)
        return History(
            time=columns[0],
            control=columns[1],
            height=columns[2],
            slope=columns[arrays.SLOPE],
            energies=freeze(dict(zip(ENERGIES, columns[KINETIC:LOAD], strict=True))),
            configurations=kept,
            load=columns[LOAD],
            arclength=self.arclength,
            velocity=columns[VELOCITY],
            stats={
                "steps": int(clock[STEPS]),
                "newton_iterations": int(clock[NEWTON]),
                "assemblies": int(clock[ASSEMBLIES]),
                "rejected": int(clock[REJECTED]),
                **self.rows.stats,
                **stats,
            },
            scene=scene,
            options=options,
            model="kirchhoff",
            steps=freeze(steps),
            resume=freeze({name: value.copy() for name, value in self.motion._asdict().items()} | law),
            reactions=reactions,
            rest=rest,
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
    rest: Mapping[str, Array] | None = None,
) -> History:
    """Step a rod from rest in an equilibrium through the scene's ramp and hold, or from a `first` state.

    That is the last instant of `initial`, if this is a motion.  `rest` is that of the `History`.

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
    history = run.history(scene, options, stats, initial, rest)
    problem_met = run.rows.full or problem_of(status, scene, control)
    if problem_met:
        where = f"t = {history.time[-1]:.6g} s, {control_text(scene, history.control[-1])}"
        raise SolverError(f"kirchhoff: stopped at {where}: {problem_met}", history)
    return history
