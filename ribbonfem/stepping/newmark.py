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

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from ribbonfem import tableaus
from ribbonfem.growing import Growing
from ribbonfem.policy import PolicyError, choice, local_error, positive, require_duration
from ribbonfem.results import DEPARTED, Array
from ribbonfem.scene import Scene, shown
from ribbonfem.tableaus import Tableau

from . import kernels
from .motion import Motion

METHODS = (*tableaus.TABLEAUS, "generalised-alpha", "newmark")
UNTIL = ("end", "snap")

# Newton stops when what it would still change in any position (L) and angle (rad) is below this;
# convergence is quadratic, so that two increments d0, d1 foretell the next, d1^3 / d0^2
NEWTON_TOLERANCE = 1e-9
# t*; a step that has to be shorter than this means that there is no solution to be found
SMALLEST_STEP = 1e-10
# rows of the dofs, which are observed and written over whenever they are full
ROWS = 512
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
            f"spectral_radius = {shown(spectral_radius)}: only for method = 'generalised-alpha', not {name!r}"
        )
    if name == "newmark":
        return newmark()
    tableau = tableaus.TABLEAUS[name]()
    return Method(tableau.name, tableau.constrained, tableau=tableau)


# order in the step of every method, all of which have adaptive steps too
ORDERS = MappingProxyType({name: method_of(name).order for name in METHODS})
ADAPTIVE = METHODS


@dataclass(frozen=True)
class Control:
    """How to step: the method, a fixed `step` (s) or a `tolerance` (L), and when to end.

    `until` is "end", "snap", soon after the height first changes sign, once it has been further from
    zero than `departed` (L).
    """

    method: Method
    step: float | None
    tolerance: float | None
    until: str
    departed: float = DEPARTED

    def in_units_of(self, length: float) -> Control:
        """The same with its lengths in a beam's own unit of height."""
        tolerance = None if self.tolerance is None else self.tolerance / length
        return replace(self, tolerance=tolerance, departed=self.departed / length)

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
            tolerance = local_error("tolerance", default_tolerance if tolerance is None else tolerance)
        return cls(
            method_of(method, spectral_radius),
            None if step is None else positive("step", step),
            tolerance,
            choice("until", until, untils),
        )


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
    )


def ramp_of(
    scene: Scene,
    control: Control,
    *,
    newton: float = NEWTON_TOLERANCE,
    every: int = 1,
    barrier: float = -math.inf,
    gain: float = math.inf,
    least_growth: float = 1.0,
) -> kernels.Ramp:
    """The clamp's motion and the control of steps; what is named is the model's own (`kernels.Ramp`)."""
    unit = scene.ribbon.inertial_time
    rate, (turned, end) = scene.scaled_rate, scene.instants()
    return kernels.Ramp(
        rate=rate,
        stop=scene.require_stop(),
        turned=turned,
        end=end,
        damping=scene.scaled_damping,
        fixed=0.0 if control.step is None else control.step / unit,
        tolerance=control.tolerance or 0.0,
        largest=min(LARGEST_TURN / abs(rate), 0.1 * turned),
        newton=newton,
        smallest=SMALLEST_STEP,
        snap=control.until == "snap",
        departed=control.departed,
        every=every,
        barrier=barrier,
        gain=gain,
        least_growth=least_growth,
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
    clock[kernels.PHASE] = 0.0 if v is None else 1.0
    rows, row_q, row_w = (np.empty((ROWS, n)) for n in (kernels.ROW_SIZE, len(q), len(w)))
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


def _warm_up(tables: kernels.Tables, scheme: kernels.Scheme, ramp: kernels.Ramp, q: Array, w: Array) -> None:
    """Load or compile the kernel, once a process, so that no timing contains it."""
    global _warm
    if not _warm:
        short = ramp._replace(turned=1e-6, end=1e-6, stop=1e-6 * ramp.rate or ramp.stop, fixed=1e-6)
        _run(tables, scheme, short, q, w, lambda *_: "")
        _warm = True


def integrate(
    tables: kernels.Tables,
    scene: Scene,
    control: Control,
    q: Array,
    w: Array,
    observe: Callable[[Array, Array], tuple[Array, Array]],
    held: Held | None = None,
) -> Motion:
    """Step a beam from rest in the equilibrium (q, w) through the scene's ramp and hold.

    If it is `held`, from (q, w) with that velocity at a fixed clamp instead.

    A fixed step is shortened so that a whole number of steps fits the ramp, and the hold.  An
    adaptive one keeps the estimated local error of q below the tolerance.  A Newton iteration
    that does not converge halves the step; `Motion.problem` says if that had to go on below
    `SMALLEST_STEP`, or if the method gains energy: undamped methods may, after a snap.

    `observe` makes the slopes (rows,) and positions (rows, nodes, 3) of rows of q and w.

    Raises
    ------
    PolicyError, SceneError
        For a run of more steps, or more memory, than `policy.require_duration` allows.
    """
    nodes = observe(q[None], w[None])[1].shape[1]
    row = 8.0 * (kernels.ROW_SIZE + 1 + 3 * nodes)
    if held is not None:
        scene = replace(scene, stop=math.copysign(1.0, scene.rate), hold=held.duration)
    require_duration(scene, control.step, LARGEST_TURN, row)
    scheme, ramp = control.method.as_scheme(), ramp_of(scene, control)
    if held is not None:
        # no time passes on the ramp
        end = scene.hold / scene.ribbon.inertial_time
        ramp = ramp._replace(rate=0.0, stop=held.angle, turned=0.0, end=end)
    _warm_up(tables, scheme, ramp, q, w)
    kept = Growing((kernels.ROW_SIZE,), (), (nodes, 3))

    def keep(rows: Array, row_q: Array, row_w: Array) -> str:
        kept.append(rows, *observe(row_q, row_w))
        return kept.full

    began = time.perf_counter()
    status, clock, full = _run(tables, scheme, ramp, q, w, keep, None if held is None else held.velocity)
    seconds = time.perf_counter() - began
    rows, slope, positions = kept.taken()
    return Motion(
        rows=rows,
        slope=slope,
        positions=positions,
        stats={
            "steps": int(clock[kernels.STEPS]),
            "newton_iterations": int(clock[kernels.NEWTON]),
            "rejected": int(clock[kernels.REJECTED]),
            "seconds": seconds,
        },
        problem=full or problem_of(status, scene, control),
    )


def problem_of(status: int, scene: Scene, control: Control) -> str:
    """Why the time loop ended before its end."""
    if status == kernels.STUCK:
        asked = f"of step = {control.step:g} s" if control.step else f"of tolerance = {control.tolerance:g}"
        least = SMALLEST_STEP * scene.ribbon.inertial_time
        return f"{control.method.name} {asked} found no next state by any step down to {least:.1e} s"
    if status == kernels.CREPT:
        return (
            f"{control.method.name} of step = {control.step:g} s found no next state by steps as long, and "
            "took many times as many shorter ones: it needs a shorter step, or a tolerance in its place"
        )
    if status == kernels.GREW:
        return (
            f"the energy has grown by more than {kernels.GROWTH:.0%} without work: "
            f"{control.method.name} does not damp what it does not resolve"
        )
    return ""
