"""Coefficients of the normal form at a fold of any model, from its equilibria, null vector and mass."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ribbonfem.closed_form import closed_form_fold
from ribbonfem.continuation import Event, Point, Problem, State, Steps, equilibrium
from ribbonfem.continuation.curves import ramp_folds
from ribbonfem.continuation.vibration import InertialProblem
from ribbonfem.options import refuse
from ribbonfem.results import Array
from ribbonfem.scene import Scene

# amplitudes are in L: far above rounding, far below where the next order counts
_REACH = 4e-3


@dataclass(frozen=True)
class NormalForm:
    """A fold and what its dynamics need.

    Attributes
    ----------
    angle: alpha_c, rad.
    product: c a2 in s^-4 / rad, positive where the fold is met with growing alpha.
    quadratic: a2 in s^-2, with A in L and the whole ribbon of mass 1.
    cubic: gamma = a3 / a2^2 in s^2.
    mixed: beta = b / (c a2) in s^2; these three are NaN where only the leading order is known.
    """

    angle: float
    product: float
    quadratic: float = math.nan
    cubic: float = math.nan
    mixed: float = math.nan


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
    a2 = -0.5 * _second_derivative(problem, point, null, _REACH)
    cubic, mixed = _next_order(problem, point, null, c, a2)
    return NormalForm(
        float(point.parameter),
        c * a2 / problem.unit**4,
        a2 / problem.unit**2,
        cubic * problem.unit**2,
        mixed * problem.unit**2,
    )


def _next_order(
    problem: InertialProblem[State], point: Point[State], null: Array, c: float, a2: float
) -> tuple[float, float]:
    """gamma and beta in t*^2, from the branch on both sides of the fold.

    With y^2 = c a2 (alpha_c - alpha), y > 0 on the stable side, the reduced equation has

        omega^2 = 2 y (1 - gamma y + ...),   |dX/dalpha|_M^2 = (c / 2 y)^2 (1 + 2 (gamma - beta) y + ...)

    along the branch: neither knows how the amplitude was chosen.  Their odd parts, extrapolated once.
    """

    def odd(reach: float) -> Array:
        sides = []
        for y in (reach, -reach):
            angle = point.parameter - y * y / (c * a2)
            state = problem.advance(point.state, -y / a2 * null, angle)
            state, line = equilibrium(problem, state, angle)
            square = frequency(problem, state, angle) * problem.unit**2
            along = -line.solve(line.slope)
            # of the motion with the clamp turning at 1 rad, but for what does not grow at the fold
            both = 2.0 * problem.momentum(state, along, 1.0) - problem.momentum(state, along)
            speed = float(along @ both)
            sides.append((square / y, 0.25 * c * c / (speed * y * y)))
        ahead, behind = np.array(sides)
        return -0.25 * (ahead - behind) / reach

    reach = _REACH * abs(a2)
    cubic, shape = (4.0 * odd(0.5 * reach) - odd(reach)) / 3.0
    return float(cubic), float(cubic - shape)


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
