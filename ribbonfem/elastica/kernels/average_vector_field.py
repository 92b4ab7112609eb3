"""The energy-conserving step of the elastica: midpoint rule with mean moments ("discrete-gradient").

The midpoint rule, with the moments' mean along the step (average vector field): phi goes from phi0 to phi1 in
a straight line, D = phi1 - phi0 at a Gauss point, so that with the angle p in the middle

    t1 - t0 = D sinc(D/2) t_perp(p),   m = (t0 + t1) / 2 = cos(D/2) t(p)

and r' = t (1 + c n.t) holds at the ends.  n is the force over the step, along m the mean of the axial forces
at its ends.  Work of n on r and on t then cancel, as in `kirchhoff.kernels.average_vector_field`:

    n.(r1 - r0)' = n.(t1 - t0) (1 + c n.m) + c (N1^2 - N0^2) / 2
"""

from __future__ import annotations

import math

from ribbonfem.ends.planar_kernels import PUSH
from ribbonfem.jit.decorator import compiled
from ribbonfem.jit.groups import INLINED, OPTIONS
from ribbonfem.jit.simd import WIDTH, greatest, larger, load, spread, store, summed
from ribbonfem.results import Array
from ribbonfem.stepping.kernels.allowed_error import USUAL, allowed_error
from ribbonfem.stepping.kernels.arrays import GAINED, TIME
from ribbonfem.stepping.kernels.guess import KNOWN, MEMORY, POINTS

from . import condensed, tangent
from .arrays import Motion, Moving, Scratch
from .beam import FORCE, PHI, ROWS, Beam, P, Z
from .ends import set_places
from .energies import kinetic_energy
from .gauss_point import Value, cosine_sine, interpolated, resolved
from .law import moment_of

# steps over which the error of one is estimated, and iterations beyond which none longer is tried
SPAN, EASY = 4, 7.0
# L/t*, above which a beam does not creep
FAST = 0.5
# positions of the last steps that are kept
KEPT = 3 * SPAN
# places in t.out: work of the controls, iterations
OUT_WORK, OUT_NEWTON = range(2)


@compiled(**INLINED)
def _sinc(x: Value) -> Value:
    """sin(x) / x by its series, to rounding for |x| < 1."""
    square = x * x
    total = 1.0 / 6227020800.0 - square * (1.0 / 1307674368000.0)
    total = 1.0 / 362880.0 - square * (1.0 / 39916800.0 - square * total)
    total = 1.0 - square * (1.0 / 6.0 - square * (1.0 / 120.0 - square * (1.0 / 5040.0 - square * total)))
    return total


@compiled(**OPTIONS)
def residual(model: Moving, sigma: float) -> None:
    """Residual of the step in s.rest, twice that of forces and moments; the controls' work in t.out.

    sigma is twice d(mean inertial force)/d(position) per mass.
    """
    beam, s, t, y = model.beam, model.solver, model.scratch, model.motion
    rest, points, compliance = s.rest, s.points, beam.compliance[0]
    for group in range(rest.shape[0]):
        for k in range(P):
            first, bent0, _, _ = interpolated(beam.value, beam.coupling, y.u, group, k)
            last, bent1, x, z = interpolated(beam.value, beam.coupling, t.u, group, k)
            cos0, sin0 = cosine_sine(first)
            cos1, sin1 = cosine_sine(last)
            cos, sin = cosine_sine(0.5 * (first + last))
            before, _ = resolved(y.u, group, k, cos0, sin0)
            start, _ = resolved(t.u, group, k, cos0, sin0)
            end, _ = resolved(t.u, group, k, cos1, sin1)
            _, shear = resolved(t.u, group, k, cos, sin)
            weight = beam.weights[k]
            # the mean axial force, and that of the end which makes it
            stretch = weight * (1.0 + compliance * (start + end - before))
            store(rest, (group, FORCE + 2 * k), x - stretch * cos1)
            store(rest, (group, FORCE + 2 * k + 1), z - stretch * sin1)
            store(points, (0, k), moment_of(beam, group, k, (0.5 / weight) * (bent0 + bent1)))
            mean = weight * (1.0 + (0.5 * compliance) * (start + end))
            store(points, (1, k), mean * _sinc(0.5 * (last - first)) * shear)
        for i in range(P + 1):
            x = z = moment = spread(0.0)
            for k in range(P):
                coupling = beam.coupling[k, i]
                x += coupling * load(t.u, (group, FORCE + 2 * k))
                z += coupling * load(t.u, (group, FORCE + 2 * k + 1))
                moment += coupling * load(points, (0, k)) - beam.value[k, i] * load(points, (1, k))
            mass, half = beam.mass[i], 0.5 * sigma
            x += mass * (half * load(t.u, (group, i)) - load(t.known, (group, i)))
            z += mass * (half * load(t.u, (group, Z + i)) - load(t.known, (group, Z + i)))
            store(rest, (group, i), 2.0 * x)
            store(rest, (group, Z + i), 2.0 * z)
            store(rest, (group, PHI + i), 2.0 * moment)
    t.out[OUT_WORK] = _work(model)


@compiled(**OPTIONS)
def _work(model: Moving) -> float:
    """Of the controls over the step, by the mean moments in s.rest, without the inertia of the held node."""
    beam, t, y, rest = model.beam, model.scratch, model.motion, model.solver.rest
    group, place = (beam.elements - 1) // WIDTH, (beam.elements - 1) % WIDTH
    total = 0.5 * rest[0, PHI, 0] * (t.u[0, PHI, 0] - y.u[0, PHI, 0])
    total += 0.5 * rest[group, PHI + P, place] * (t.u[group, PHI + P, place] - y.u[group, PHI + P, place])
    x, z = -beam.mass[P] * beam.weight[0], -beam.mass[P] * beam.weight[1]
    for k in range(P):
        x += beam.coupling[k, P] * t.u[group, FORCE + 2 * k, place]
        z += beam.coupling[k, P] * t.u[group, FORCE + 2 * k + 1, place]
    total += x * (t.u[group, P, place] - y.u[group, P, place])
    total += z * (t.u[group, Z + P, place] - y.u[group, Z + P, place])
    if t.controls[PUSH, 0] != 0.0:
        moved = spread(0.0)
        for g in range(rest.shape[0]):
            for i in range(P + 1):
                moved += load(beam.middle, (g, i)) * (load(t.u, (g, Z + i)) - load(y.u, (g, Z + i)))
        total -= t.controls[PUSH, 0] * summed(moved)
    return total


@compiled(**OPTIONS)
def factorise(model: Moving, sigma: float) -> None:
    """The tangent of the middle of the step: symmetric, with half of the increment of n."""
    t, y = model.scratch, model.motion
    for group in range(t.u.shape[0]):
        for row in range(PHI, FORCE):
            store(t.middle, (group, row), 0.5 * (load(t.u, (group, row)) + load(y.u, (group, row))))
        for row in range(FORCE, ROWS):
            store(t.middle, (group, row), load(t.u, (group, row)))
    tangent.fill(model.beam, model.solver, t.middle, sigma, False)
    condensed.factorise(model.solver)


@compiled(**INLINED)
def move(model: Moving) -> None:
    """Add the increments."""
    rest, u = model.solver.rest, model.scratch.u
    for group in range(rest.shape[0]):
        for row in range(ROWS):
            part = 1.0 if row < FORCE else 0.5
            store(u, (group, row), load(u, (group, row)) + part * load(rest, (group, row)))


@compiled(**OPTIONS)
def end_forces(beam: Beam, t: Scratch, y: Motion) -> None:
    """Give n in t.u the axial force of the step's end, in a beam that stretches."""
    if beam.compliance[0] == 0.0:
        return
    for group in range(t.u.shape[0]):
        for k in range(P):
            first, _, _, _ = interpolated(beam.value, beam.coupling, y.u, group, k)
            last, _, _, _ = interpolated(beam.value, beam.coupling, t.u, group, k)
            cos0, sin0 = cosine_sine(first)
            cos1, sin1 = cosine_sine(last)
            before, _ = resolved(y.u, group, k, cos0, sin0)
            start, _ = resolved(t.u, group, k, cos0, sin0)
            for row, direction in ((FORCE + 2 * k, cos1), (FORCE + 2 * k + 1, sin1)):
                store(t.u, (group, row), load(t.u, (group, row)) + (start - before) * direction)


@compiled(**OPTIONS)
def guess_ringing(t: Scratch, clock: Array, b: float) -> None:
    """Guesses of n and r of a step by those of the last three, a line in time and what alternates on it.

    Both ring from step to step, which the parabola through them takes for seven times as much.
    """
    known = int(clock[POINTS])
    # the first of the points known is the kink's
    if known < 4:
        return
    last, second, third = (known - 1) % MEMORY, (known - 2) % MEMORY, (known - 3) % MEMORY
    for group in range(t.u.shape[0]):
        for row in range(ROWS):
            if row < PHI or row >= FORCE:
                total = load(t.known_u, (last, group, row)) + load(t.known_u, (second, group, row))
                total = total - load(t.known_u, (third, group, row))
                if row < PHI:
                    total = load(t.rp, (group, row)) + b * total
                store(t.u, (group, row), total)


@compiled(**INLINED)
def _held_node(beam: Beam, v: Array) -> float:
    """Twice the kinetic energy of the node that the right clamp holds."""
    group, place = (beam.elements - 1) // WIDTH, (beam.elements - 1) % WIDTH
    x, z = v[group, P, place], v[group, Z + P, place]
    held: float = beam.mass[P] * (x * x + z * z)
    return held


@compiled(**OPTIONS)
def flows(model: Moving, nu: float, h: float) -> tuple[float, float]:
    """Mean powers of the step: what damping takes of the mean velocity, and that of the controls."""
    beam, t, y = model.beam, model.scratch, model.motion
    for group in range(t.v.shape[0]):
        for row in range(PHI):
            store(t.middle, (group, row), 0.5 * (load(y.v, (group, row)) + load(t.v, (group, row))))
    held = 0.5 * (_held_node(beam, t.v) - _held_node(beam, y.v))
    power = (t.out[OUT_WORK] + held) / h + nu * _held_node(beam, t.middle)
    return 2.0 * nu * kinetic_energy(beam, t.middle), power


@compiled(**OPTIONS)
def balance(beam: Beam, t: Scratch, v: Array, clock: Array) -> None:
    """Take from velocities what a kink, Newton and rounding left of the energy."""
    if clock[GAINED] == 0.0:
        return
    part = math.sqrt(1.0 - clock[GAINED] / (kinetic_energy(beam, v) - 0.5 * _held_node(beam, v)))
    for group in range(v.shape[0]):
        for row in range(PHI):
            store(v, (group, row), part * load(v, (group, row)))
    set_places(beam, t.controls, 1, v)
    clock[GAINED] = 0.0


@compiled(**OPTIONS)
def error_by_means(y: Motion, t: Scratch, clock: Array, h: float) -> float:
    """Estimated local error of positions, h^3 d3x/dt3 / 12, counted the more the slower the beam creeps.

    By third differences of positions `SPAN` steps apart (fewer close behind a kink, and where the beam
    creeps): what so many steps do not resolve rings for ever, and is left out.  It is negative while the last
    steps are not of one length, or are hard to solve: no longer step is to follow.
    """
    # instants known since the kink, which is the first
    last = int(clock[KNOWN]) - 1
    t.past_time[last % KEPT] = clock[TIME]
    fastest = spread(0.0)
    for group in range(t.u.shape[0]):
        for row in range(PHI):
            r = load(y.u, (group, row))
            store(t.past, (last % KEPT, group, row), r)
            moved = load(t.u, (group, row)) - r
            fastest = larger(fastest, moved * moved)
    speed = math.sqrt(greatest(fastest)) / h
    span = min(SPAN if speed > FAST else 2, (last + 1) // 3)
    if span < 1:
        return -1e-300
    first, second = (last + 1 - span) % KEPT, (last + 1 - 2 * span) % KEPT
    third = (last + 1 - 3 * span) % KEPT
    h1 = clock[TIME] + h - t.past_time[first]
    h2, h3 = t.past_time[first] - t.past_time[second], t.past_time[second] - t.past_time[third]
    largest = spread(0.0)
    for group in range(t.u.shape[0]):
        for row in range(PHI):
            a, b = load(t.past, (first, group, row)), load(t.past, (second, group, row))
            rate = (a - b) * (1.0 / h2)
            late = ((load(t.u, (group, row)) - a) * (1.0 / h1) - rate) * (1.0 / (h1 + h2))
            early = (rate - (b - load(t.past, (third, group, row))) * (1.0 / h3)) * (1.0 / (h2 + h3))
            change = late - early
            largest = larger(largest, change * change)
    error = 0.5 * h * h * h * math.sqrt(greatest(largest)) / ((h1 + h2 + h3) * allowed_error(speed, USUAL))
    easy = abs(h1 - span * h) < 1e-2 * h1 and t.out[OUT_NEWTON] <= EASY
    return error if easy else -error
