"""Time stepping of the planar beams: Newmark, generalised-alpha, and Runge-Kutta methods (`tableaus`).

The semi-discrete beams are differential-algebraic: the dofs q carry mass, the others follow
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

import numpy as np

from ribbonfem.ends import held as held_ends
from ribbonfem.options import require_duration
from ribbonfem.results import Array
from ribbonfem.row_buffer import some_steps
from ribbonfem.rows import Columns, Rows
from ribbonfem.scene import Scene

from . import kernels
from .control import LARGEST_TURN, Control, problem_of, ramp_of
from .motion import Motion

# rows of the dofs, which are observed and written over whenever they are full
ROWS = 512
# slopes are put behind the columns of the time loop
_COLUMNS = Columns(0, 1, kernels.HEIGHT, kernels.ROW_SIZE, kernels.VELOCITY, kernels.KINETIC, kernels.KEPT)


@dataclass(frozen=True)
class Held:
    """A motion at a fixed clamp: its angle (rad), the first velocity of q (per t*), and for how long (s)."""

    angle: float
    velocity: Array
    duration: float


def _scratch(tables: kernels.Tables, q: Array, w: Array, stages: int = 2) -> kernels.Scratch:
    elements, p = tables.dx.shape
    if tables.kind == kernels.ELASTICA:
        n, width = elements * (p + 4) - 3, p + 6
    else:
        n, width = len(q) - 4, 3
    size = 5 * p + 3
    longest = max(len(q), len(w), size)
    return kernels.Scratch(
        band=np.zeros((n, 3 * width + 1)),
        pivots=np.zeros(n, dtype=np.int64),
        right=np.zeros(n),
        local=np.zeros((elements, size, size + 1)),
        qp=np.zeros(len(q)),
        vp=np.zeros(len(q)),
        q=np.zeros(len(q)),
        v=np.zeros(len(q)),
        a=np.zeros(len(q)),
        w=np.zeros(len(w)),
        a2=np.zeros(len(q)),
        v2=np.zeros(longest),
        clamp=np.zeros(size),
        y=np.zeros(longest),
        y2=np.zeros(longest),
        stage_v=np.zeros((stages, len(q))),
        stage_a=np.zeros((stages, len(q))),
        rate=np.zeros(1),
    )


def _run(
    tables: kernels.Tables,
    scheme: kernels.Scheme,
    ramp: kernels.Ramp,
    q: Array,
    w: Array,
    keep: Callable[[Array, Array, Array], str],
    v: Array | None = None,
) -> tuple[int, Array, str]:
    """The time loop, in as many calls as there are blocks of rows; status, clock and what ended it early.

    `keep` takes the rows, q and w of a block, before the next one is written over it.  With a velocity v
    the clamp is held from the start.
    """
    clock = np.zeros(kernels.CLOCK_SIZE)
    clock[kernels.KINK] = 1.0
    most = len(some_steps(np.empty(ROWS), len(q)))
    rows, row_q, row_w = (np.empty((most, n)) for n in (kernels.ROW_SIZE, len(q), len(w)))
    still = np.zeros_like(q)
    motion = q.copy(), (still if v is None else v).copy(), still, still.copy()
    scratch = _scratch(tables, q, w, scheme.stages)
    beam = kernels.Beam(tables, scratch, *motion, w.copy(), np.zeros_like(w), row_q, row_w)
    while True:
        status = kernels.run(beam, scheme, ramp, clock, rows)
        count = int(clock[kernels.ROWS])
        full = keep(rows[:count], row_q[:count], row_w[:count])
        if status != kernels.FULL or full:
            return int(status), clock, full
        clock[kernels.ROWS] = 0.0


_warm = False


def _warm_up(
    tables: kernels.Tables, scheme: kernels.Scheme, ramp: kernels.Ramp, scene: Scene, q: Array, w: Array
) -> None:
    """Load or compile the kernel, once a process, so that no timing contains it."""
    global _warm
    if not _warm:
        short = ramp._replace(ends=held_ends(scene, 0.0, 1e-6), end=1e-6, fixed=1e-6)
        _run(tables, scheme, short, q, w, lambda *_: "")
        _warm = True


def integrate(
    tables: kernels.Tables,
    scene: Scene,
    control: Control,
    q: Array,
    w: Array,
    observe: Callable[[Array, Array], tuple[Array, Array, Array]],
    held: Held | None = None,
    every: int | None = None,
) -> Motion:
    """Step a beam from rest in the equilibrium (q, w) through the scene's ramp and hold.

    If it is `held`, from (q, w) with that velocity at a fixed clamp instead.

    A fixed step is shortened so that a whole number of steps fits the ramp, and the hold.  An
    adaptive one keeps the estimated local error of q below the tolerance.  A Newton iteration
    that does not converge halves the step; `Motion.problem` says if that had to go on below
    `SMALLEST_STEP`, or if the method gains energy: undamped methods may, after a snap.

    `observe` makes the slopes (rows,), positions (rows, nodes, 3) and curvatures (rows, nodes) of rows of q
    and w.

    Raises
    ------
    OptionError, SceneError
        For a run of more steps, or more memory, than `policy.require_duration` allows.
    """
    nodes = observe(q[None], w[None])[1].shape[1]
    row = 8.0 * (kernels.ROW_SIZE + 1 + 4 * nodes)
    ends = None
    if held is None:
        require_duration(scene, control.step, LARGEST_TURN, row / every if every else 0.0)
    else:
        ends = held_ends(scene, held.angle, held.duration / scene.ribbon.inertial_time)
    scheme, ramp = control.method.as_scheme(), ramp_of(scene, control, ends, every=every or 1)
    _warm_up(tables, scheme, ramp, scene, q, w)
    kept = Rows(kernels.ROW_SIZE + 1, _COLUMNS, (nodes, 3), (nodes,), every=every)

    def keep(rows: Array, row_q: Array, row_w: Array) -> str:
        slope, *shapes = observe(row_q, row_w)
        kept.append(np.column_stack((rows, slope)), *shapes)
        return kept.full

    began = time.perf_counter()
    status, clock, full = _run(tables, scheme, ramp, q, w, keep, None if held is None else held.velocity)
    seconds = time.perf_counter() - began
    return Motion(
        rows=kept,
        stats={
            "steps": int(clock[kernels.STEPS]),
            "newton_iterations": int(clock[kernels.NEWTON]),
            "rejected": int(clock[kernels.REJECTED]),
            "seconds": seconds,
        },
        problem=full or problem_of(status, scene, control),
    )
