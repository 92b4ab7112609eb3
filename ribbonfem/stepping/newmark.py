"""Time stepping of the planar beams: Newmark, generalised-alpha, and Runge-Kutta methods (`tableaus`).

The semi-discrete beams are differential-algebraic: the dofs q carry mass, the others follow
from equilibrium and from the constraints at the same instant (`beam_kernels`).  Every method
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
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ribbonfem.policy import PolicyError, choice, positive
from ribbonfem.results import Array, History, SolverError
from ribbonfem.scene import Scene

from . import beam_kernels as kernels
from . import tableaus
from .tableaus import Tableau

ENERGIES = ("kinetic", "elastic", "dissipated", "work")
METHODS = ("tr-bdf2", "esdirk3", "esdirk4", "generalised-alpha", "newmark", "implicit-euler")
UNTIL = ("end", "snap")

# Newton stops when what it would still change in any position (L) and angle (rad) is below this;
# convergence is quadratic, so that two increments d0, d1 foretell the next, d1^3 / d0^2
NEWTON_TOLERANCE = 1e-9
# t*; a step that has to be shorter than this means that there is no solution to be found
SMALLEST_STEP = 1e-10
# rows that are allocated first; doubled whenever they are full
ROWS = 512
PROBLEMS = {
    kernels.DONE: "",
    kernels.STUCK: f"no step longer than {SMALLEST_STEP:g} t* converged; use a finer mesh, or a tolerance "
    "that can be met",
    kernels.GREW: f"energy has grown by more than {kernels.GROWTH:.0%} without work; use a smaller step, "
    "or method = 'tr-bdf2'",
}
# rad; no adaptive step turns the clamp further
LARGEST_TURN = 0.05


@dataclass(frozen=True)
class Method:
    """A one-step method, with `order` in the step.

    One-stage methods are of the form r1 = r + h v + h^2 (r0 A + r1 A1), v1 = v + h (v0 A + v1 A1)
    with (1 - alpha_m) A1 + alpha_m A = (1 - alpha_f) a1 + alpha_f a, A the auxiliary
    acceleration; `error` (two factors of h^2 A, h^2 A1) is the leading local error of r.  Others
    have a `tableau`.
    """

    name: str
    order: int
    positions: tuple[float, float] = (0.0, 0.0)
    velocities: tuple[float, float] = (0.0, 0.0)
    alpha_m: float = 0.0
    alpha_f: float = 0.0
    error: tuple[float, float] = (0.0, 0.0)
    project: bool = False
    tableau: Tableau | None = None

    def as_scheme(self) -> kernels.Scheme:
        """The same for the kernel."""
        if self.tableau is not None:
            data = self.tableau
            power = data.embedded + 1.0
            return kernels.Scheme(
                kernels.DIRK, power, data.stages, data.a, data.c, data.error, *(8 * (0.0,)), False
            )
        return kernels.Scheme(
            kernels.ONE_STAGE,
            self.order + 1.0,
            2,
            np.zeros((2, 2)),
            np.array([0.0, 1.0]),
            np.zeros(2),
            *self.positions,
            *self.velocities,
            self.alpha_m,
            self.alpha_f,
            *self.error,
            self.project,
        )


def newmark(beta: float = 0.25, gamma: float = 0.5) -> Method:
    """Newmark's method; the default is the trapezoidal rule.

    The local error is h^3 r''' (beta - 1/6) to leading order, estimated by the difference of
    accelerations (O. C. Zienkiewicz & Y. M. Xie, Earthq. Eng. Struct. Dyn. 20 (1991) 871).
    """
    constant = beta - 1.0 / 6.0
    order = 2 if gamma == 0.5 else 1
    return Method(
        "newmark", order, (0.5 - beta, beta), (1.0 - gamma, gamma), error=(-constant, constant), project=True
    )


def generalised_alpha(spectral_radius: float = 0.8) -> Method:
    """Generalised-alpha for constrained systems, with this spectral radius at infinite frequency.

    J. Chung & G. M. Hulbert, J. Appl. Mech. 60 (1993) 371, in the form of M. Arnold & O. Bruls,
    Multibody Syst. Dyn. 18 (2007) 185: equilibrium holds at the ends of steps, which keeps
    order 2 also for the multipliers.  The auxiliary acceleration is that of the instant
    (alpha_m - alpha_f) h later, which the error's constant takes into account.
    """
    rho = positive("spectral_radius", spectral_radius)
    if rho > 1.0:
        raise PolicyError(f"spectral_radius = {rho!r}: must be in (0, 1]")
    alpha_m, alpha_f = (2.0 * rho - 1.0) / (rho + 1.0), rho / (rho + 1.0)
    shift = alpha_m - alpha_f
    gamma, beta = 0.5 - shift, 0.25 * (1.0 - shift) ** 2
    constant = beta + 0.5 * shift - 1.0 / 6.0
    return Method(
        "generalised-alpha",
        2,
        (0.5 - beta, beta),
        (1.0 - gamma, gamma),
        alpha_m,
        alpha_f,
        (-constant, constant),
    )


def method_of(name: str, spectral_radius: float | None = None) -> Method:
    """The method of this name; `spectral_radius` belongs to "generalised-alpha" alone."""
    choice("method", name, METHODS)
    if name == "generalised-alpha":
        return generalised_alpha() if spectral_radius is None else generalised_alpha(spectral_radius)
    if spectral_radius is not None:
        raise PolicyError(
            f"spectral_radius = {spectral_radius!r}: only for method = 'generalised-alpha', not {name!r}"
        )
    if name == "newmark":
        return newmark()
    tableau = tableaus.TABLEAUS[name]()
    return Method(tableau.name, tableau.order, tableau=tableau)


@dataclass(frozen=True)
class Control:
    """How to step: the method, a fixed `step` (s) or a `tolerance` (L), and when to end.

    `until` is "end", "snap", soon after the height first changes sign, or what else the model knows.
    """

    method: Method
    step: float | None
    tolerance: float | None
    until: str

    def in_units_of(self, length: float) -> Control:
        """The same with the tolerance in a beam's own unit of height."""
        return self if self.tolerance is None else replace(self, tolerance=self.tolerance / length)

    @classmethod
    def of(
        cls,
        method: str,
        step: float | None,
        tolerance: float | None,
        until: str,
        spectral_radius: float | None,
        default_tolerance: float,
        untils: tuple[str, ...] = UNTIL,
    ) -> Control:
        """Check the policy of a `simulate` that may end in these ways.

        Raises
        ------
        PolicyError
            Naming the value; also if both `step` and `tolerance` are given.
        """
        if step is not None and tolerance is not None:
            raise PolicyError(f"step = {step!r} and tolerance = {tolerance!r}: give one of them, not both")
        if step is None:
            tolerance = positive("tolerance", default_tolerance if tolerance is None else tolerance)
        return cls(
            method_of(method, spectral_radius),
            None if step is None else positive("step", step),
            tolerance,
            choice("until", until, untils),
        )


@dataclass(frozen=True)
class Motion:
    """What the kernel hands back, one row an accepted step, in t* and the beam's own units.

    Attributes
    ----------
    time, angle, height: (rows,).
    kinetic, elastic, dissipated, work, load: (rows,).
    q, w: (rows, dofs) the state.
    stats: as in `History`.
    problem: why the end was not reached, a sentence; empty if it was.
    """

    time: Array
    angle: Array
    height: Array
    kinetic: Array
    elastic: Array
    dissipated: Array
    work: Array
    load: Array
    q: Array
    w: Array
    stats: dict[str, float]
    problem: str

    def as_history(
        self,
        scene: Scene,
        policy: Mapping[str, Any],
        *,
        length: float = 1.0,
        slope: Array,
        positions: Array,
    ) -> History:
        """The motion in the units of `History`; `length` is the beam's own unit of height, in L.

        Raises
        ------
        SolverError
            If the end was not reached; its `history` is what was.
        """
        columns = {name: getattr(self, name) * length**2 for name in ENERGIES}
        history = History(
            time=self.time * scene.ribbon.inertial_time,
            angle=self.angle,
            height=self.height * length,
            slope=slope,
            energies=columns,
            configurations={"positions": positions, "load": self.load},
            stats=self.stats,
            scene=scene,
            policy=dict(policy),
        )
        if self.problem:
            where = f"t = {history.time[-1]:.6g} s, alpha = {history.angle[-1]:.6g} rad"
            raise SolverError(f"stopped at {where}: {self.problem}", history)
        return history


def _scratch(tables: kernels.Tables, q: Array, w: Array, stages: int = 2) -> kernels.Scratch:
    elements, p = tables.dx.shape
    if tables.kind == kernels.ELASTICA:
        n, width = elements * (p + 4) - 3, p + 6
    else:
        n, width = len(q) - 4, 3
    size, longest = 5 * p + 3, max(len(q), len(w), 5 * p + 3)
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
    )


def _ramp(scene: Scene, control: Control) -> kernels.Ramp:
    unit = scene.ribbon.inertial_time
    rate, stop = scene.rate * unit, scene.require_stop()
    turned, hold = stop / rate, scene.hold / unit
    largest = min(LARGEST_TURN / abs(rate), 0.1 * turned)
    return kernels.Ramp(
        rate=rate,
        stop=stop,
        turned=turned,
        end=turned + hold,
        damping=scene.damping * unit,
        fixed=0.0 if control.step is None else control.step / unit,
        tolerance=control.tolerance or 0.0,
        largest=largest,
        newton=NEWTON_TOLERANCE,
        smallest=SMALLEST_STEP,
        snap=control.until == "snap",
    )


def _run(
    tables: kernels.Tables, scheme: kernels.Scheme, ramp: kernels.Ramp, q: Array, w: Array
) -> tuple[int, Array, Array, Array, Array]:
    """The time loop, in as many calls as the rows need; status, clock, rows, q and w of the rows."""
    scratch = _scratch(tables, q, w, scheme.stages)
    clock = np.zeros(kernels.CLOCK_SIZE)
    clock[kernels.KINK] = 1.0
    state = (q.copy(), np.zeros(len(q)), np.zeros(len(q)), np.zeros(len(q)), w.copy(), np.zeros(len(w)))
    rows, row_q, row_w = np.empty((0, kernels.ROW_SIZE)), np.empty((0, len(q))), np.empty((0, len(w)))
    status, capacity = kernels.FULL, ROWS
    while status == kernels.FULL:
        rows, row_q, row_w = (
            np.concatenate((old, np.empty((capacity, old.shape[1])))) for old in (rows, row_q, row_w)
        )
        status = kernels.run(tables, scheme, ramp, scratch, clock, *state, rows, row_q, row_w)
        capacity = len(rows)
    count = int(clock[kernels.ROWS])
    return status, clock, rows[:count], row_q[:count], row_w[:count]


_warm = False


def _warm_up(tables: kernels.Tables, scheme: kernels.Scheme, ramp: kernels.Ramp, q: Array, w: Array) -> None:
    """Load or compile the kernel, once a process, so that no timing contains it."""
    global _warm
    if not _warm:
        _run(tables, scheme, ramp._replace(turned=1e-6, end=1e-6, stop=1e-6 * ramp.rate, fixed=1e-6), q, w)
        _warm = True


def integrate(tables: kernels.Tables, scene: Scene, control: Control, q: Array, w: Array) -> Motion:
    """Step a beam from rest in the equilibrium (q, w) through the scene's ramp and hold.

    A fixed step is shortened so that a whole number of steps fits the ramp, and the hold.  An
    adaptive one keeps the estimated local error of q below the tolerance.  A Newton iteration
    that does not converge halves the step; `Motion.problem` says if that had to go on below
    `SMALLEST_STEP`, or if the method gains energy: undamped methods may, after a snap.
    """
    scheme, ramp = control.method.as_scheme(), _ramp(scene, control)
    _warm_up(tables, scheme, ramp, q, w)
    began = time.perf_counter()
    status, clock, rows, row_q, row_w = _run(tables, scheme, ramp, q, w)
    seconds = time.perf_counter() - began
    names = ("time", "angle", "height", *ENERGIES, "load")
    return Motion(
        q=row_q,
        w=row_w,
        stats={
            "steps": int(clock[kernels.STEPS]),
            "newton_iterations": int(clock[kernels.NEWTON]),
            "rejected": int(clock[kernels.REJECTED]),
            "seconds": seconds,
        },
        problem=PROBLEMS[status],
        **dict(zip(names, rows.T.copy(), strict=True)),
    )
