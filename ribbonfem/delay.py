"""How late a ramp snaps: the normal form at a fold, and its universal curve (paper, section 4.4).

Near a fold at alpha_c the amplitude A of the mass-normalised null vector obeys

    A_TT + nu A_T = c (alpha - alpha_c) + a2 A^2,

whatever the model.  With alpha - alpha_c = rate T and tau = (c a2 rate)^(-1/5), A = a / (a2 tau^2),
T = tau t, it has one parameter, Lambda = nu tau:

    a'' + Lambda a' = t + a^2,   a ~ -sqrt(-t) as t -> -infinity.

a grows without bound at t = f(Lambda), so that the snap comes T_s = tau f(Lambda) after the
fold and the angle is late by rate T_s, with no parameter fitted.  f(0) = 3.4117 (the tritronquee
of Painleve I) and f -> 2.33811 Lambda^(2/3), the first zero of Airy's function.

The product c a2 is of the static fold alone: of its null vector (`normal_form`) or of the slope
of omega^4 along the stable branch (`product_from_frequencies`).  References: P. Mandel & T. Erneux,
SIAM J. Appl. Math. 47 (1987) 1; M. Liu, M. Gomez & D. Vella, J. Mech. Phys. Solids 147 (2021) 104116.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np
from scipy.integrate import solve_ivp

from ribbonfem.continuation.curves import ramp_folds
from ribbonfem.continuation.vibration import InertialProblem

from .closed_form import closed_form_fold
from .continuation import Event, Point, Problem, State, Steps
from .policy import number, refuse
from .results import Array, SolverError
from .scene import Scene

# where the outer solution starts (its series has lost 1e-12 there) and where it has left the fold
_START, _LEFT = 30.0, 10.0
_TERMS = 24
# Lambda beyond which f is that of Airy's equation to 1e-8, and the first zero of Airy's function
_AIRY, _FIRST_ZERO = 1e6, 2.338107410459767
_RELATIVE, _ABSOLUTE = 1e-11, 1e-12


@dataclass(frozen=True)
class NormalForm:
    """A fold and what its dynamics need.

    Attributes
    ----------
    angle: alpha_c, rad.
    product: c a2 in s^-4 / rad, positive where the fold is met with growing alpha.
    """

    angle: float
    product: float


@dataclass(frozen=True)
class Delay:
    """How late a snap is.

    Attributes
    ----------
    time: s.
    angle: rad, with the sign of the rate.
    damping: Lambda, below 1 inertial and above overdamped.
    """

    time: float
    angle: float
    damping: float


class _Left:
    """The event of leaving the fold, for scipy."""

    terminal = True

    def __call__(self, t: float, y: Array) -> float:
        return float(y[0]) - _LEFT


def _outer(inertia: float, friction: float, s: float) -> tuple[float, float]:
    """a and a' at t = -s on the solution that follows -sqrt(-t), by its series in s^(-1/2)."""
    k = np.arange(_TERMS)
    power = 0.5 - 0.5 * k
    a = np.zeros(_TERMS)
    a[0] = -1.0
    for m in range(1, _TERMS):
        right = -float(a[1:m] @ a[m - 1 : 0 : -1]) if m > 1 else 0.0
        if m >= 3:
            right -= friction * power[m - 3] * a[m - 3]
        if m >= 5:
            right += inertia * power[m - 5] * (power[m - 5] - 1.0) * a[m - 5]
        a[m] = right / (2.0 * a[0])
    return float(a @ s**power), float(-(a * power) @ s ** (power - 1.0))


def universal(damping: float) -> float:
    """f(Lambda), the time at which the solution of the normal form leaves to infinity.

    To a relative 1e-8: an integration in time to a = 10, then one in a^(-1/2), in which the
    end is a regular point.  Above Lambda = 1 time is counted in Lambda^(2/3).

    Parameters
    ----------
    damping: Lambda >= 0.

    Raises
    ------
    ValueError
        If Lambda is negative or not finite.
    SolverError
        If the integration fails.
    """
    damping = number("damping", damping)
    if damping < 0.0:
        refuse("damping", damping, "Lambda must be finite and not negative")
    # where inertia has no part in it any more it is Airy's equation
    return _universal(damping) if damping <= _AIRY else _FIRST_ZERO * damping ** (2.0 / 3.0)


@lru_cache(maxsize=4096)
def _universal(damping: float) -> float:
    inertia, friction, unit = 1.0, damping, 1.0
    if damping > 1.0:
        inertia, friction, unit = damping ** (-5.0 / 3.0), 1.0, damping ** (2.0 / 3.0)
    # up to Lambda = 150 the multistep method needs a tenth of the time; beyond, it does not get through
    method: Literal["LSODA", "Radau"] = "LSODA" if inertia > 2.4e-4 else "Radau"

    def near(t: float, y: Array) -> list[float]:
        return [y[1], (t + y[0] ** 2 - friction * y[1]) / inertia]

    first = solve_ivp(
        near,
        (-_START, 20.0),
        _outer(inertia, friction, _START),
        events=_Left(),
        method=method,
        rtol=_RELATIVE,
        atol=_ABSOLUTE,
    )
    if first.status != 1:
        raise SolverError(f"the normal form was not integrated at Lambda = {damping:g}: {first.message}")
    # the event that ended the integration is its last point
    t, a, rate = float(first.t[-1]), float(first.y[0, -1]), float(first.y[1, -1])

    # x = a^(-1/2), log x the variable; P = a' x^3 tends to sqrt(2 / (3 inertia)); where friction
    # rules a' ~ a^2 and P ~ 1/x: its logarithm is the smoother unknown
    def far(y: float, u: Array) -> list[float]:
        x, speed = math.exp(y), math.exp(u[1])
        force = (u[0] * x**4 + 1.0 - friction * speed * x) / (inertia * speed**2)
        return [-2.0 * x / speed, 3.0 - 2.0 * force]

    x0 = a**-0.5
    # deep enough for inertia to rule in the end, whatever it is
    last = math.log(min(1e-7, 1e-7 * math.sqrt(inertia)))
    span = (math.log(x0), last)
    second = solve_ivp(
        far,
        span,
        [t, math.log(rate * x0**3)],
        method=method,
        rtol=_RELATIVE,
        atol=_ABSOLUTE,
    )
    if not second.success:
        raise SolverError(f"the normal form was not integrated at Lambda = {damping:g}: {second.message}")
    rest = 2.0 * math.exp(last) / math.exp(float(second.y[1, -1]))
    return unit * (float(second.y[0, -1]) + rest)


def _second_derivative(problem: Problem[State], point: Point[State], null: Array, reach: float) -> float:
    """null . F_uu[null, null] at a fold, from residuals on both sides, extrapolated once."""

    def difference(reach: float) -> float:
        values = [
            float(
                null
                @ problem.linearise(
                    problem.advance(point.state, side * null, point.parameter), point.parameter
                ).residual
            )
            for side in (-reach, 0.0, reach)
        ]
        return (values[0] - 2.0 * values[1] + values[2]) / reach**2

    return (4.0 * difference(0.5 * reach) - difference(reach)) / 3.0


def normal_form(problem: InertialProblem[State], fold: Event[State]) -> NormalForm:
    """The normal form at a fold of any model, from its null vector and mass.

    With N the null vector of the tangent and N . M N = 1, c = -N . F_alpha and
    a2 = -N . F_uu[N, N] / 2; the tangent is symmetric, so N is its left null vector too.

    Parameters
    ----------
    problem: the model's equilibrium equations, with its mass.
    fold: as from `curves.ramp_folds` or `continuation.trace`.

    Raises
    ------
    ValueError
        If the event is not a fold.
    """
    if fold.kind != "fold":
        raise ValueError(f"a {fold.kind} has no such normal form: a fold is needed")
    point = fold.point
    mass = float(fold.null @ problem.momentum(point.state, fold.null))
    null = fold.null / math.sqrt(mass)
    c = -float(null @ point.linearisation.slope)
    # amplitudes are in L: far above rounding, far below where the next order counts
    a2 = -0.5 * _second_derivative(problem, point, null, 4e-3)
    return NormalForm(float(point.parameter), c * a2 / problem.unit**4)


def ramp_normal_forms(
    problem: InertialProblem[State], start: State, scene: Scene, steps: Steps | None = None
) -> tuple[NormalForm, ...]:
    """The normal forms of the folds that a very slow ramp of the scene meets, in order."""
    return tuple(normal_form(problem, fold) for fold in ramp_folds(problem, start, scene, steps))


def frequency(problem: InertialProblem[State], state: State, parameter: float) -> float:
    """Square of the lowest angular frequency about an equilibrium, in s^-2 (negative: unstable).

    By inverse iteration on the factorised tangent, J x = omega^2 M x: near a fold the lowest is
    far below the next and a few solves suffice.
    """
    line = problem.linearise(state, parameter)
    vector = np.where(problem.weight > 0.0, np.cos(1.0 + np.arange(len(problem.weight)) ** 1.5), 0.0)
    square, before = math.inf, 0.0
    for _ in range(60):
        momentum = problem.momentum(state, vector)
        vector = line.solve(momentum)
        square, before = float(momentum @ vector) / float(vector @ problem.momentum(state, vector)), square
        if abs(square - before) <= 1e-12 * abs(square):
            break
        vector /= np.abs(vector).max()
    return square / problem.unit**2


def product_from_frequencies(angles: Array, squares: Array, fold: float) -> float:
    """c a2 (s^-4 / rad) from omega^2 (s^-2) at angles (rad) on the stable branch towards a fold.

    omega^4 -> 4 c a2 (alpha_c - alpha); the next term is of order (alpha_c - alpha)^(3/2), so
    omega^4 / (alpha_c - alpha) is extrapolated as a polynomial in the root of the distance.

    Raises
    ------
    ValueError
        If there are fewer than two angles, or one at the fold.
    """
    distance = fold - np.asarray(angles, dtype=np.float64)
    if distance.size < 2 or not np.all(np.abs(distance) > 0.0):
        refuse("angles", angles, "at least two are needed, none of them at the fold")
    ratio = np.asarray(squares) ** 2 / distance
    fit = np.polynomial.Polynomial.fit(np.sqrt(np.abs(distance)), ratio, min(3, distance.size - 1))
    return 0.25 * float(fit(0.0))


def quasilinear_normal_form(scene: Scene) -> NormalForm:
    """The normal form of the quasi-linear beam in closed form.

    The equilibria are Z = A (cos(sigma xi) - cos(sigma/2)) + B (sin(sigma xi) - 2 xi sin(sigma/2)),
    xi = x - 1/2; at the fold the null vector is (W, S) = (dZ/dsigma, 2 sigma) at fixed mu, and

        c a2 = 3/2 |S W''(0)| int W'^2 / (int W^2)^2

    for the rate of mu in t*: 137470.385.

    Raises
    ------
    SceneError
        For a sheared scene.
    """
    scene.require_planar("quasilinear")
    fold = closed_form_fold()
    sigma, mu = fold.sigma, fold.mu
    half, sine, cosine = 0.5 * sigma, math.sin(0.5 * sigma), math.cos(0.5 * sigma)
    even, odd = sigma * sine, sigma * cosine - 2.0 * sine
    a, b = -0.5 * mu / even, -0.5 * mu / odd
    da = -a * (sine + half * cosine) / even
    db = b * half * sine / odd
    nodes, weights = np.polynomial.legendre.leggauss(60)
    xi, weights = 0.5 * nodes, 0.5 * weights
    cos, sin = np.cos(sigma * xi), np.sin(sigma * xi)
    w = da * (cos - cosine) + a * (-xi * sin + 0.5 * sine) + db * (sin - 2.0 * xi * sine)
    w += b * (xi * cos - xi * cosine)
    slope = da * (-sigma * sin) + a * (-sin - sigma * xi * cos) + db * (sigma * cos - 2.0 * sine)
    slope += b * (cos - sigma * xi * sin - cosine)
    # W'' at xi = -1/2, from d/dsigma of -sigma^2 (A cos(sigma xi) + B sin(sigma xi))
    bend = -2.0 * sigma * (a * cosine - b * sine) - sigma**2 * (da * cosine - db * sine)
    bend -= 0.5 * sigma**2 * (-a * sine - b * cosine)
    square = float(weights @ w**2)
    product = 1.5 * abs(2.0 * sigma * bend) * float(weights @ slope**2) / square**2
    side = 1.0 if scene.start == "U+" else -1.0
    length = scene.compression**0.5
    return NormalForm(side * mu * length, side * product / length / scene.ribbon.inertial_time**4)


def predict(fold: NormalForm, rate: float, damping: float) -> Delay:
    """The delay of a ramp through a fold, without simulation.

    Parameters
    ----------
    fold: the normal form.
    rate: rad/s, of the sign with which the fold is met.
    damping: nu, 1/s.

    Raises
    ------
    ValueError
        If the ramp runs away from the fold, or damping is negative.
    """
    if not isinstance(fold, NormalForm):
        refuse("fold", fold, "a NormalForm is needed, as `normal_forms` of a model gives it")
    rate, damping = number("rate", rate), number("damping", damping)
    scaled = fold.product * rate
    if not scaled > 0.0:
        refuse(
            "rate",
            rate,
            f"a ramp of this sign does not meet the fold at {fold.angle:.6g} rad from its stable side",
        )
    tau = scaled**-0.2
    time = tau * universal(damping * tau)
    return Delay(time, rate * time, damping * tau)
