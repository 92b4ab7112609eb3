"""The Python side of the rod's time loop: buffers, rows kept, calls of compiled code until the end."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ribbonfem.ends.kernels import Ends
from ribbonfem.frozen import freeze
from ribbonfem.results import Array, History, RestState
from ribbonfem.row_buffer import some_steps
from ribbonfem.rows import Columns, Rows, reactions_in, shapes_of
from ribbonfem.scene import Scene

from . import kernels
from .problem import Statics
from .rod import Rod, RodState

# methods whose velocities ring from step to step, along the ribbon: they are those of no motion
RINGING = (kernels.NEWMARK, kernels.MIDPOINT, kernels.DISCRETE_GRADIENT)
_COLUMNS = Columns(
    kernels.ROW_TIME,
    kernels.ROW_CONTROL,
    kernels.ROW_HEIGHT,
    kernels.ROW_SLOPE,
    kernels.ROW_VELOCITY,
    kernels.ROW_KINETIC,
    kernels.ROW_KEPT,
)


class Loop:
    """A motion between its calls of the compiled loop: buffers, and the rows written so far."""

    def __init__(
        self,
        rod: Rod,
        state: RodState,
        options: kernels.StepOptions,
        every: int | None,
        configurations: bool,
        velocity: Array | None = None,
        damping: float = 0.0,
    ) -> None:
        size = 4 * rod.nodes
        statics = Statics(rod)
        self.rod, self.options, self.every, self.start = rod, options, every or 1, state
        self.clock = np.zeros(kernels.CLOCK_SIZE)
        self.motion = kernels.Motion(
            state.x.copy(),
            np.zeros(size),
            np.zeros(size),
            np.zeros(size),
            state.edges[0].copy(),
            state.m1.copy(),
            state.twist.copy(),
            np.zeros((rod.nodes, 4)),
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
            stage_v=np.zeros((len(options.table), size)),
            stage_a=np.zeros((len(options.table), size)),
            v=np.zeros(size),
            b=np.zeros(size),
            gradient=np.zeros(size),
            gradient1=np.zeros(size),
            hessian=np.zeros(band),
            factors=np.zeros(band),
            right=np.zeros(size + kernels.WIDTH),
            energies=np.zeros(3),
            turn=np.zeros(rod.nodes),
            rate=np.zeros(size),
            known=np.zeros(size),
            strains=np.zeros((rod.nodes, 4)),
            viscous=np.zeros((rod.nodes, 4)),
        )
        self.constants = kernels.Rod(
            rod.stiffness,
            rod.rest,
            rod.stretch,
            rod.inertia,
            rod.arclength,
            rod.shape,
            rod.lumps,
            rod.retardation,
        )
        self.told = np.array([options.method, options.radius, rod.scene.scaled_damping, *rod.scene.weight])
        gradient = statics.assemble(state, second=False)[1]
        self.clock[kernels.CONTROL] = state.at
        self.clock[kernels.PUSHED] = -statics.ends.force(state.at)[0][2]
        self.clock[kernels.POWER] = float(statics.clamp_rate(state.at) @ gradient)
        self.clock[kernels.FRESH] = 1.0
        # adaptive runs start with a step far below any period and grow
        self.clock[kernels.STEP] = options.step or 1e-4
        if velocity is not None:
            free = rod.free
            self.motion.v[free] = velocity
            self.motion.a[free] = -gradient[free] / rod.inertia[free] - damping * velocity
        nodes = rod.nodes
        shapes = ((nodes, 3), (nodes - 1, 3), (nodes, 3)) if configurations else ()
        self.rows = Rows(kernels.ROW_SIZE, _COLUMNS, *shapes, every=every)
        self.none = [np.empty((0, count, 3)) for count in (nodes, nodes - 1, nodes)]

    def go_on(self, given: RestState | History) -> None:
        """Make the state that at the end of a History, or that of a ribbon that is let go of."""
        clock, motion, rod, free = self.clock, self.motion, self.rod, self.rod.free
        same = False
        if isinstance(given, History):
            kept, power = given.resume, clock[kernels.POWER]
            for name in ("v", "a", "aux", "tangent", "strains"):
                getattr(motion, name)[:] = kept[name]
            clock[:] = kept["clock"]
            for place in kernels.OF_A_RUN:
                clock[place] = 0.0
            clock[kernels.FRESH], clock[kernels.CONTROL] = 1.0, rod.scene.begin
            if (given.scene.drive, given.scene.preset) != (rod.scene.drive, rod.scene.preset):
                clock[kernels.POWER] = power
            self.scratch.factors[:] = kept["factors"]
            same = kept["told"].tobytes() == self.told.tobytes()
        if same:
            return
        # by another method, or under other loads
        clock[kernels.FACTORED] = 0.0
        gradient = Statics(rod).assemble(self.start, second=False)[1]
        motion.a[free] = -gradient[free] / rod.inertia[free] - rod.scene.scaled_damping * motion.v[free]
        motion.aux[free] = motion.v[free] if self.options.method in RINGING[1:] else motion.a[free]

    def _room(self) -> tuple[Array, ...]:
        """Where the next rows go."""
        rows, *configurations = self.rows.reserve()
        self.clock[kernels.ROW] = self.clock[kernels.PLACE] = 0.0
        return some_steps(rows, self.rod.nodes), *(configurations or self.none)

    def go(self, ends: Ends, course: kernels.Course) -> int:
        """Run to the end or until it fails; returns the status of the compiled loop."""
        self.rows.kinks = ends.kinks
        room = self._room()
        kernels.record(self.constants, ends, self.motion, self.scratch, course, -1, *room, True)
        while True:
            status = kernels.run(
                self.constants,
                ends,
                self.motion,
                self.scratch,
                course,
                self.options,
                self.every,
                *room,
            )
            self.rows.wrote(int(self.clock[kernels.ROW]))
            if status != kernels.FULL or self.rows.full:
                return int(status)
            room = self._room()

    def history(
        self,
        scene: Scene,
        options: dict[str, object],
        stats: dict[str, float],
        initial: RestState | History | None = None,
        rest: Mapping[str, Array] | None = None,
    ) -> History:
        """The rows so far as a `History`, of a motion that began with `initial`, and follows `rest`."""
        second = scene.ribbon.inertial_time
        # (velocities that ring are none)
        per_second = np.nan if self.options.method in RINGING else 1.0 / second
        taken, steps = self.rows.taken({kernels.ROW_TIME: second, kernels.ROW_VELOCITY: per_second})
        reactions = reactions_in(taken[0], kernels.ROW_REACTIONS, initial)
        rows, *configurations = taken
        freeze(rows)
        clock = self.clock
        time, control, height, slope, *energies, load, velocity = rows.T[: kernels.ROW_KEPT]
        return History(
            time=time,
            control=control,
            height=height,
            slope=slope,
            load=load,
            velocity=velocity,
            arclength=np.array(self.rod.arclength),
            energies=dict(
                zip(("kinetic", "elastic", "potential", "dissipated", "work"), energies, strict=True)
            ),
            configurations=shapes_of(configurations, "normals", per_second),
            stats={
                "steps": int(clock[kernels.STEPS]),
                "newton_iterations": int(clock[kernels.ITERATIONS]),
                "assemblies": int(clock[kernels.ASSEMBLIES]),
                "rejected": int(clock[kernels.REJECTED]),
                **self.rows.stats,
                **stats,
            },
            scene=scene,
            options=options,
            model="der",
            steps=freeze(steps),
            resume={
                **{name: np.array(value) for name, value in self.motion._asdict().items()},
                "factors": self.scratch.factors,
                "told": self.told,
            },
            reactions=reactions,
            rest=rest,
        )
