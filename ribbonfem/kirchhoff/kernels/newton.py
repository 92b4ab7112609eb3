"""Newton on a stage of the Kirchhoff rod: predictor, increments of rotations, convergence.

The factors of a tangent are kept over iterations, stages and steps, as long as they serve.
Guesses of g, n and a are polynomials through the last stages solved, in quaternions: their
sums, normalised, do not depend on the frame.
"""

from __future__ import annotations

from ribbonfem.ends.kernels import PUSH
from ribbonfem.jit.algebra import carried, conjugate, quaternion, triple
from ribbonfem.jit.decorator import compiled
from ribbonfem.jit.simd import load, store
from ribbonfem.linalg.array_ops import add, copy
from ribbonfem.results import Array
from ribbonfem.stepping.kernels.arrays import Ramp
from ribbonfem.stepping.kernels.guess import MEMORY, POINTS, next_slot, put_weights
from ribbonfem.stepping.kernels.newton import Equations, newton_of

from .arrays import Moving, Scratch
from .batch import INLINED, OPTIONS
from .condensed import factorise, solve
from .consistent_initialisation import tangents
from .residual import residual
from .rod import P, Rod, Solver
from .rotations import normalise_inner, rotate_inner, twists
from .tangent import fill

# an angle counts as a tenth of a length: the half width of the ribbon
ANGLE = 0.1
# an increment (L, or ANGLE of a radian) that leads nowhere
LARGEST = 0.5


@compiled(**OPTIONS)
def _gyroscopic(rod: Rod, s: Solver, g: Array, v: Array, tangent_rate: Array) -> None:
    """Add J m theta' dt/dt, the moment that turns the spin with the tangent, to (2) of `residual`."""
    for i in range(1, g.shape[0] - 1):
        factor = rod.inertia[i, 3] * v[i, 3]
        # (along the first axis of the body is nothing)
        moment = carried(conjugate(quaternion(g, i)), triple(tangent_rate, i))
        s.fp[i, 1] += factor * moment[1]
        s.fp[i, 2] += factor * moment[2]


@compiled(**OPTIONS)
def size_of(s: Solver) -> float:
    """The largest increment of a position, or of a rotation counted as one."""
    # (one maximum for each component: they do not wait for each other)
    r0 = r1 = r2 = p0 = p1 = p2 = 0.0
    for i in range(1, s.fr.shape[0] - 1):
        r0, r1, r2 = max(r0, abs(s.fr[i, 0])), max(r1, abs(s.fr[i, 1])), max(r2, abs(s.fr[i, 2]))
        p0, p1, p2 = max(p0, abs(s.fp[i, 0])), max(p1, abs(s.fp[i, 1])), max(p2, abs(s.fp[i, 2]))
    return max(r0, r1, r2, ANGLE * p0, ANGLE * p1, ANGLE * p2)


@compiled(**OPTIONS)
def move(s: Solver, t: Scratch, part: float) -> None:
    """Add the increments in s to t.x, t.g and, a part of them, to t.n."""
    rotate_inner(t.g, s.fp)
    # (what this adds to theta is not: that follows from the frames)
    add(s.fr, 1.0, t.x)
    add(s.fn, part, t.n)


@compiled(**OPTIONS)
def subtract_weight(rod: Rod, force: Array) -> None:
    """Take the weight from inertial forces a mass."""
    for i in range(force.shape[0]):
        for c in range(3):
            force[i, c] -= rod.weight[c]


@compiled(**INLINED)
def _put_rates(model: Moving) -> None:
    """Twists of a stage, and the rates that go with its positions and tangents."""
    rod, t = model.rod, model.scratch
    b, f, ft = t.stage[0], t.stage[1], t.stage[2]
    inner = range(4, t.x.size - 4)
    inverse = 1.0 / b
    twists(model.motion.g, t.g, t.x)
    # (a loop for each: of more arrays the compiler does not ask whether they overlap, and makes no vectors)
    for k in inner:
        t.a.flat[k] = (t.x.flat[k] - t.xp.flat[k]) * inverse
    for k in inner:
        t.v.flat[k] = t.vp.flat[k] + f * t.a.flat[k]
    if rod.gyroscopic:
        tangents(t.g, t.tangent)
        for i in range(1, t.g.shape[0] - 1):
            for c in range(3):
                t.tangent_rate[i, c] = (t.tangent[i, c] - t.tp[i, c]) / ft


@compiled(**INLINED)
def _residual(model: Moving, sigma: float) -> None:
    rod, s, t = model.rod, model.solver, model.scratch
    _put_rates(model)
    nu = t.stage[3]
    for k in range(t.force.size):
        t.force.flat[k] = t.a.flat[k] + nu * t.v.flat[k]
    if rod.has_weight:
        subtract_weight(rod, t.force)
    residual(rod, s, t.x, t.g, t.n, t.force)
    s.fr[rod.middle, 2] += t.pose[PUSH]
    if rod.gyroscopic:
        _gyroscopic(rod, s, t.g, t.v, t.tangent_rate)


@compiled(**INLINED)
def _factorise(model: Moving, sigma: float) -> None:
    fill(model.rod, model.solver, model.scratch.g, model.scratch.n, sigma, False)
    factorise(model.solver)


@compiled(**INLINED)
def _solve(model: Moving, sigma: float) -> float:
    solve(model.rod, model.solver, sigma)
    # (the maximum may hide NaN, which then is everywhere)
    return size_of(model.solver) + 0.0 * model.solver.fn[0, 0, 0, 0]


@compiled(**INLINED)
def _move(model: Moving) -> None:
    move(model.solver, model.scratch, 1.0)


_newton = newton_of(Equations(_residual, _factorise, _solve, _move))


@compiled(**OPTIONS)
def newton(model: Moving, b: float, f: float, ft: float, ramp: Ramp, clock: Array) -> int:
    """Solve a stage from the guesses t.a, t.g, t.n; return the iterations, or minus them on failure.

    x = t.xp + b a, v = t.vp + f a, tangents t.tp + ft (their rate).
    """
    t, nu = model.scratch, ramp.damping
    t.stage[0], t.stage[1], t.stage[2], t.stage[3] = b, f, ft, nu
    for k in range(4, t.x.size - 4):
        t.x.flat[k] = t.xp.flat[k] + b * t.a.flat[k]
    used: int = _newton(model, 1.0 / b + nu * f / b, b, LARGEST, ramp, clock)
    if used > 0:
        _put_rates(model)
    return used


@compiled(**OPTIONS)
def remember(t: Scratch, clock: Array, time: float, g: Array, n: Array, a: Array) -> None:
    """Keep a solved stage for guesses."""
    slot = next_slot(t.known_time, clock, time)
    copy(g, t.known_g[slot])
    copy(n, t.known_n[slot])
    copy(a, t.known_a[slot])


@compiled(**OPTIONS)
def guess(t: Scratch, clock: Array, time: float) -> None:
    """Guesses of g, n and a at a time, from the polynomial through the last stages known."""
    known = int(clock[POINTS])
    put_weights(t.known_time, known, time, t.lagrange)
    last, before, first = (known - 1) % MEMORY, (known - 2) % MEMORY, (known - 3) % MEMORY
    a, b, c = t.lagrange[0], t.lagrange[1], t.lagrange[2]
    right = t.g.shape[0] - 1
    for i in range(right):
        total = a * load(t.known_g, (last, i)) + b * load(t.known_g, (before, i))
        store(t.g, (i,), total + c * load(t.known_g, (first, i)))
        total = a * load(t.known_a, (last, i)) + b * load(t.known_a, (before, i))
        store(t.a, (i,), total + c * load(t.known_a, (first, i)))
    for group in range(t.n.shape[0]):
        for k in range(P):
            for axis in range(3):
                total = a * load(t.known_n, (last, group, k, axis))
                total += b * load(t.known_n, (before, group, k, axis))
                store(t.n, (group, k, axis), total + c * load(t.known_n, (first, group, k, axis)))
    normalise_inner(t.g)
    # (the clamp's, to the last digit)
    store(t.g, (right,), load(t.known_g, (last, right)))
