"""The integration of a planar beam from start to stop: calls of the compiled loop, errors, rows kept.

The semi-discrete beams are differential-algebraic: positions carry mass, the others follow
from equilibrium and from the constraints at the same instant (`kernels`).  Every method
is written for the positions, and its stages solve position, moments and constraints together,
so that no length drifts.

The clamp's velocity jumps when it starts and when it stops.  Both instants are ends of steps,
and there velocities, accelerations and forces are made consistent with the new velocity: the
change of velocity is the one of least kinetic energy that the constraints allow (an impulse),
and accelerations and multipliers follow from the constraints derived twice.  "newmark" does
this after every step, because the trapezoidal rule would carry an error of the multiplier on
forever with alternating sign (A. Cardona & M. Geradin, Comput. Struct. 33 (1989) 801).

Time is counted in the ribbon's inertial time t*, damping in 1/t*.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ribbonfem.ends import held as held_ends
from ribbonfem.ends import moving
from ribbonfem.frozen import freeze
from ribbonfem.options import require_duration
from ribbonfem.results import Array
from ribbonfem.row_buffer import some_steps
from ribbonfem.rows import Columns, Rows
from ribbonfem.scene import Scene

from . import kernels
from .control import LARGEST_TURN, Control, problem_of, ramp_of
from .motion import Motion

# rows of states, which are observed and written over whenever they are full
ROWS = 512
# part of the tolerance that Newton may leave in a position, and what it may leave in one of a fixed step, L:
# factors that are kept leave what they may, and all of it to one side
REST, FIXED_REST = 3e-3, 1e-11
# the most of it where energy is to be balanced: of means of forces
MEAN_REST = 1e-8
# part of the largest energy so far that an adaptive step may gain: a method that damps little may pump what
# it does not resolve
GAIN = 1e-4
# a step grows by this factor at least, or stays: a new one costs new factors
LEAST_GROWTH = 1.4
# slopes are put behind the columns of the time loop
_COLUMNS = Columns(0, 1, kernels.HEIGHT, kernels.ROW_SIZE, kernels.VELOCITY, kernels.KINETIC, kernels.KEPT)
# models whose loops are compiled or loaded in this process
_warm: set[str] = set()


@dataclass(frozen=True)
class Held:
    """A motion with the control where it is: its value, and for how long (s)."""

    control: float
    duration: float


class Moving(Protocol):
    """A beam in motion, with the clock of its time loop."""

    clock: Array

    def kept(self) -> dict[str, Array]:
        """What it goes on from, by names."""
        ...

    def slopes(self, count: int) -> Array:
        """(rows,) of the last rows."""
        ...

    def shapes(self, count: int) -> tuple[Array, Array, Array]:
        """Of the last rows positions (rows, nodes, 3), curvature (rows, nodes), velocities as positions."""
        ...

    def run(self, ramp: kernels.Ramp, rows: Array) -> int:
        """Step until the end, or until the rows are full; returns the status of the compiled loop."""
        ...


def integrate(
    name: str,
    begin: Callable[[kernels.Scheme, int], Moving],
    scene: Scene,
    control: Control,
    nodes: int,
    *,
    held: Held | None = None,
    every: int | None = None,
    since: float = 0.0,
    began: float = 0.0,
    configurations: bool = True,
) -> Motion:
    """Step a beam through the scene's ramp and hold, or while the control is `held`.

    A fixed step is shortened so that a whole number of steps fits the ramp, and the hold.  An
    adaptive one keeps the estimated local error of positions below the tolerance.  A Newton iteration
    that does not converge halves the step; `Motion.problem` says if that had to go on below
    `SMALLEST_STEP`, or if the method gains energy: undamped methods may, after a snap.

    Parameters
    ----------
    name: of the model.
    begin: makes the beam where it begins, for a method and so many rows.
    nodes: whose positions are handed out.
    since: t*, from when on a passage of zero is the snap that ends a run.
    began: t*, the time that has passed before.
    configurations: whether positions and curvatures are.

    Raises
    ------
    OptionError, SceneError
        For a run of more steps, or more memory, than `options.require_duration` allows.
    """
    row = 8.0 * (kernels.ROW_SIZE + 1 + 7 * nodes * configurations)
    if held is None:
        require_duration(scene, control.step, LARGEST_TURN, row / every if every else 0.0)
        ends = moving(scene, began=began)
    else:
        ends = held_ends(scene, held.control, held.duration / scene.ribbon.inertial_time)
    newton = FIXED_REST if control.tolerance is None else REST * control.tolerance
    if control.method.mean:
        newton = min(newton, MEAN_REST)
    ramp = ramp_of(
        scene,
        control,
        ends,
        since,
        newton=newton,
        every=every or 1,
        gain=GAIN,
        least_growth=LEAST_GROWTH,
    )
    scheme = control.method.as_scheme()
    if name not in _warm:
        # compiled (or loaded) before the clock starts: one step of a short ramp
        _warm.add(name)
        short = ramp._replace(
            ends=held_ends(scene, float(ends.reached[0]), 1e-6, began), end=1e-6, fixed=1e-6
        )
        begin(scheme, 8).run(short, np.empty((8, kernels.ROW_SIZE)))
    kept = Rows(
        kernels.ROW_SIZE + 1, _COLUMNS, *((nodes, 3), (nodes,), (nodes, 3))[: 3 * configurations], every=every
    )
    kept.kinks = ramp.ends.kinks
    rows = some_steps(np.empty((ROWS, kernels.ROW_SIZE + 1)), nodes)
    began = time.perf_counter()
    beam = begin(scheme, len(rows))
    full, status, clock = "", kernels.FULL, beam.clock
    while status == kernels.FULL and not full:
        clock[kernels.ROWS] = 0.0
        status = beam.run(ramp, rows)
        count = int(clock[kernels.ROWS])
        shapes = beam.shapes(count) if configurations else ()
        rows[:count, -1] = beam.slopes(count)
        kept.append(rows[:count], *shapes)
        full = kept.full
    seconds = time.perf_counter() - began
    return Motion(
        rows=kept,
        stats={
            "steps": int(clock[kernels.STEPS]),
            "newton_iterations": int(clock[kernels.NEWTON]),
            "assemblies": int(clock[kernels.ASSEMBLIES]),
            "rejected": int(clock[kernels.REJECTED]),
            "seconds": seconds,
        },
        problem=full or problem_of(status, scene, control),
        resume=freeze(beam.kept()),
        rings=control.method.mean,
    )
