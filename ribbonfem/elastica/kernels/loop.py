"""What the common time loop (`stepping`) calls of the elastica: guess, stage, error, acceptance, row.

Unknowns of a stage are its positions, angles and forces; all state is in `Motion` and its clock.
"""

from __future__ import annotations

import math

from ribbonfem.ends.planar_kernels import PUSH, controls_at
from ribbonfem.jit.decorator import compiled
from ribbonfem.jit.groups import INLINED, OPTIONS
from ribbonfem.jit.simd import greatest, larger, load, spread, store
from ribbonfem.linalg.array_ops import copy
from ribbonfem.results import Array
from ribbonfem.stepping.kernels.allowed_error import PLANAR, USUAL, allowed_error
from ribbonfem.stepping.kernels.arrays import (
    DIRK,
    MEAN,
    PHASE,
    TIME,
    Measures,
    ModelFunctions,
    Ramp,
    Scheme,
)
from ribbonfem.stepping.kernels.guess import KNOWN, MEMORY, POINTS, next_slot, put_weights, reject, rescale
from ribbonfem.stepping.kernels.loop import loop_of
from ribbonfem.stepping.kernels.newton import Equations, newton_of, renew
from ribbonfem.stepping.kernels.strains import know_strains

from . import average_vector_field as means
from . import condensed, consistent_initialisation, residual, tangent
from .arrays import Moving
from .beam import FORCE, PHI, ROWS, P, Z
from .ends import set_places, set_turns
from .energies import elastic_state, kinetic_energy, potential_energy, power
from .law import keep_strains, viscous_loss
from .record import record

# an angle counts as a tenth of a length
ANGLE = 0.1
# an increment (L, or ANGLE of a radian) that leads nowhere
LARGEST = 0.5


@compiled(**OPTIONS)
def _residual(model: Moving, sigma: float) -> None:
    residual.residual(model.beam, model.solver, model.scratch.u, model.scratch.known, sigma)


@compiled(**OPTIONS)
def _factorise(model: Moving, sigma: float) -> None:
    tangent.fill(model.beam, model.solver, model.scratch.u, sigma, False)
    condensed.factorise(model.solver)


@compiled(**OPTIONS)
def _solve(model: Moving, sigma: float) -> float:
    condensed.solve(model.beam, model.solver, sigma)
    rest = model.solver.rest
    places = turns = spread(0.0)
    for group in range(rest.shape[0]):
        for row in range(PHI):
            step = load(rest, (group, row))
            places = larger(places, step * step)
        for row in range(PHI, FORCE):
            step = load(rest, (group, row))
            turns = larger(turns, step * step)
    most = max(greatest(places), ANGLE * ANGLE * greatest(turns))
    # (the maximum may hide NaN, which then is everywhere)
    return math.sqrt(most) + 0.0 * rest[0, FORCE, 0]


@compiled(**INLINED)
def _move(model: Moving) -> None:
    rest, u = model.solver.rest, model.scratch.u
    for group in range(rest.shape[0]):
        for row in range(ROWS):
            store(u, (group, row), load(u, (group, row)) + load(rest, (group, row)))


_newton = newton_of(Equations(_residual, _factorise, _solve, _move))
_mean_newton = newton_of(Equations(means.residual, means.factorise, _solve, means.move))


@compiled(**OPTIONS)
def _remember(model: Moving, clock: Array, time: float, u: Array, a: Array) -> None:
    """Keep a solved stage for guesses."""
    t = model.scratch
    slot = next_slot(t.known_time, clock, time)
    for group in range(u.shape[0]):
        for row in range(PHI):
            store(t.known_u, (slot, group, row), load(a, (group, row)))
        for row in range(PHI, ROWS):
            store(t.known_u, (slot, group, row), load(u, (group, row)))


@compiled(**OPTIONS)
def _guess(model: Moving, clock: Array, time: float, b: float) -> None:
    """Guesses of a stage at a time, from the polynomial through the last stages known: of a, phi and n."""
    t = model.scratch
    known = int(clock[POINTS])
    put_weights(t.known_time, known, time, t.lagrange)
    last, before, first = (known - 1) % MEMORY, (known - 2) % MEMORY, (known - 3) % MEMORY
    w0, w1, w2 = t.lagrange[0], t.lagrange[1], t.lagrange[2]
    for group in range(t.u.shape[0]):
        for row in range(ROWS):
            total = w0 * load(t.known_u, (last, group, row)) + w1 * load(t.known_u, (before, group, row))
            total += w2 * load(t.known_u, (first, group, row))
            if row < PHI:
                total = load(t.rp, (group, row)) + b * total
            store(t.u, (group, row), total)


@compiled(**OPTIONS)
def _put_loads(model: Moving) -> None:
    """Accelerations by the weight and the push at midspan, in place of what a stage knows."""
    t, beam = model.scratch, model.beam
    for group in range(t.known.shape[0]):
        for i in range(P + 1):
            store(t.known, (group, i), spread(beam.weight[0]))
            push = t.controls[PUSH, 0] * load(beam.push, (group, i))
            store(t.known, (group, Z + i), spread(beam.weight[1]) - push)


@compiled(**OPTIONS)
def _know(model: Moving, m: Scheme, i: int, h: float, nu: float) -> tuple[float, float]:
    """Put what a stage knows in t.rp, t.vp, t.known; return b and f of r = rp + b a, v = vp + f a."""
    y, t = model.motion, model.scratch
    if m.kind != DIRK:
        share = (1.0 - m.alpha_f) / (1.0 - m.alpha_m)
        b, f = m.r1 * h * h * share, m.v1 * h * share
    else:
        f = h * m.a[i, i]
        b = f * f
    # (of means damping is that of the middle)
    sigma = (1.0 + nu * (0.5 * f if m.kind == MEAN else f)) / b
    of_a, of_old = m.alpha_f / (1.0 - m.alpha_m), m.alpha_m / (1.0 - m.alpha_m)
    for group in range(t.known.shape[0]):
        for row in range(PHI):
            r, v = load(y.u, (group, row)), load(y.v, (group, row))
            if m.kind != DIRK:
                old = load(y.auxiliary, (group, row))
                new = of_a * load(y.a, (group, row)) - of_old * old
                r += h * v + (h * h * m.r0) * old + (h * h * m.r1) * new
                v += (h * m.v0) * old + (h * m.v1) * new
            else:
                for j in range(i):
                    part = h * m.a[i, j]
                    r += part * load(t.stage_v, (j, group, row))
                    v += part * load(t.stage_a, (j, group, row))
                r += f * v
            store(t.rp, (group, row), r)
            store(t.vp, (group, row), v)
            store(t.known, (group, row), load(t.known, (group, row)) + sigma * r - nu * v)
    return b, f


@compiled(**OPTIONS)
def _rates(model: Moving, b: float, f: float) -> None:
    """Accelerations and velocities that go with the positions of a stage."""
    t = model.scratch
    inverse = 1.0 / b
    for group in range(t.u.shape[0]):
        for row in range(PHI):
            a = inverse * (load(t.u, (group, row)) - load(t.rp, (group, row)))
            store(t.a, (group, row), a)
            store(t.v, (group, row), load(t.vp, (group, row)) + f * a)
    set_places(model.beam, t.controls, 1, t.v)
    set_places(model.beam, t.controls, 2, t.a)


@compiled(**OPTIONS)
def _project(model: Moving, ramp: Ramp, clock: Array, reset: bool) -> float:
    t, y = model.scratch, model.motion
    controls_at(ramp.ends, int(clock[PHASE]), clock[TIME], t.controls)
    _put_loads(model)
    impulse = consistent_initialisation.project(model.beam, model.solver, y, t, ramp.ends, ramp.damping)
    if reset:
        clock[POINTS] = 0.0
        _remember(model, clock, clock[TIME], y.u, y.a)
    return impulse


@compiled(**OPTIONS)
def _begin(model: Moving, clock: Array) -> None:
    copy(model.motion.v, model.scratch.stage_v[0])
    copy(model.motion.a, model.scratch.stage_a[0])
    copy(model.motion.strain_rate, model.scratch.stage_strain_rate[0])
    clock[KNOWN] = clock[POINTS]
    renew(clock)


@compiled(**OPTIONS)
def _stage(model: Moving, m: Scheme, ramp: Ramp, clock: Array, i: int, h: float, at: float) -> int:
    """Solve a stage into t.u, t.v, t.a of the scratch t."""
    t, nu = model.scratch, ramp.damping
    controls_at(ramp.ends, int(clock[PHASE]), at, t.controls)
    _put_loads(model)
    b, f = _know(model, m, i, h, nu)
    _guess(model, clock, at, b)
    # (strains of one stage are known as positions of Runge-Kutta's are, by the trapezoidal rule elsewhere)
    by_rate = f if m.kind == DIRK else 0.5 * h
    if model.beam.retardation > 0.0:
        know_strains(model.beam, m, model.motion, t, i, h, by_rate)
    set_turns(model.beam, t.controls, 0, t.u)
    set_places(model.beam, t.controls, 0, t.u)
    used: int = _newton(model, (1.0 + nu * f) / b, b, LARGEST, ramp, clock)
    _rates(model, b, f)
    if used > 0:
        _remember(model, clock, at, t.u, t.a)
    if model.beam.retardation > 0.0:
        keep_strains(model.beam, t, by_rate)
        if m.kind == DIRK:
            copy(t.strain_rate, t.stage_strain_rate[i])
    if m.kind == DIRK:
        copy(t.v, t.stage_v[i])
        copy(t.a, t.stage_a[i])
    return used


@compiled(**OPTIONS)
def _mean_stage(model: Moving, m: Scheme, ramp: Ramp, clock: Array, i: int, h: float, at: float) -> int:
    """Solve a step by the means of its forces, into the same places."""
    t, nu, phase = model.scratch, ramp.damping, int(clock[PHASE])
    controls_at(ramp.ends, phase, clock[TIME], t.controls)
    before = t.controls[PUSH, 0]
    controls_at(ramp.ends, phase, at, t.controls)
    after = t.controls[PUSH, 0]
    t.controls[PUSH, 0] = 0.5 * (before + after)
    _put_loads(model)
    b, f = _know(model, m, i, h, nu)
    _guess(model, clock, at, b)
    means.guess_ringing(t, clock, b)
    set_turns(model.beam, t.controls, 0, t.u)
    set_places(model.beam, t.controls, 0, t.u)
    used: int = _mean_newton(model, 2.0 * (1.0 + 0.5 * nu * f) / b, b, LARGEST, ramp, clock)
    t.controls[PUSH, 0] = after
    t.out[means.OUT_NEWTON] = used
    _rates(model, b, f)
    if used > 0:
        means.end_forces(model.beam, t, model.motion)
        _remember(model, clock, at, t.u, t.a)
    return used


@compiled(**OPTIONS)
def _mean_begin(model: Moving, clock: Array) -> None:
    means.balance(model.beam, model.scratch, model.motion.v, clock)
    _begin(model, clock)


@compiled(**OPTIONS)
def _mean_error(model: Moving, m: Scheme, h: float) -> float:
    return means.error_by_means(model.motion, model.scratch, model.motion.clock, h)


@compiled(**OPTIONS)
def _mean_accept(model: Moving, m: Scheme, h: float) -> None:
    means.balance(model.beam, model.scratch, model.scratch.v, model.motion.clock)
    _accept(model, m, h)


@compiled(**OPTIONS)
def _losses(model: Moving, nu: float, kinetic: float, strain_rate: Array) -> float:
    lost = 2.0 * nu * kinetic
    if model.beam.retardation > 0.0:
        lost += viscous_loss(model.beam, strain_rate)
    return lost


@compiled(**OPTIONS)
def _flows(model: Moving, nu: float, h: float) -> tuple[float, float]:
    t = model.scratch
    lost = _losses(model, nu, kinetic_energy(model.beam, t.v), t.strain_rate)
    return lost, power(model.beam, t.u, t.v, t.controls, nu)


@compiled(**OPTIONS)
def _error(model: Moving, m: Scheme, h: float) -> float:
    """Estimated local error of the positions, counted the more the slower the beam creeps."""
    t, y = model.scratch, model.motion
    largest = fastest = spread(0.0)
    share = (1.0 - m.alpha_f) / (1.0 - m.alpha_m)
    of_a, of_old = m.alpha_f / (1.0 - m.alpha_m), m.alpha_m / (1.0 - m.alpha_m)
    for group in range(y.a.shape[0]):
        for row in range(PHI):
            change, v = spread(0.0), load(t.v, (group, row))
            if m.kind != DIRK:
                old = load(y.auxiliary, (group, row))
                new = share * load(t.a, (group, row)) + of_a * load(y.a, (group, row)) - of_old * old
                change = (h * m.error0) * old + (h * m.error1) * new
            else:
                for j in range(m.stages):
                    change += m.error[j] * load(t.stage_v, (j, group, row))
            largest, fastest = larger(largest, change * change), larger(fastest, v * v)
    allowed = allowed_error(math.sqrt(greatest(fastest)), PLANAR if m.kind == DIRK else USUAL)
    return h * math.sqrt(greatest(largest)) / allowed


@compiled(**OPTIONS)
def _accept(model: Moving, m: Scheme, h: float) -> None:
    """Take over the last stage."""
    t, y = model.scratch, model.motion
    if m.kind != DIRK:
        share = (1.0 - m.alpha_f) / (1.0 - m.alpha_m)
        of_a, of_old = m.alpha_f / (1.0 - m.alpha_m), m.alpha_m / (1.0 - m.alpha_m)
        for group in range(y.a.shape[0]):
            for row in range(PHI):
                new = of_a * load(y.a, (group, row)) - of_old * load(y.auxiliary, (group, row))
                store(y.auxiliary, (group, row), share * load(t.a, (group, row)) + new)
    copy(t.u, y.u)
    copy(t.v, y.v)
    copy(t.a, y.a)
    copy(t.strain, y.strain)
    copy(t.strain_rate, y.strain_rate)


@compiled(**OPTIONS)
def _measure(model: Moving, nu: float, solved: bool) -> Measures:
    """Energies, what they lose and take, mean compressive force (`ModelFunctions`)."""
    u, v, strain_rate = model.motion.u, model.motion.v, model.motion.strain_rate
    if solved:
        u, v, strain_rate = model.scratch.u, model.scratch.v, model.scratch.strain_rate
    elastic, force = elastic_state(model.beam, u)
    kinetic = kinetic_energy(model.beam, v)
    work = power(model.beam, u, v, model.scratch.controls, nu)
    lost = _losses(model, nu, kinetic, strain_rate)
    return kinetic, elastic, potential_energy(model.beam, u), lost, work, force


_loop = loop_of(
    ModelFunctions(_project, rescale, _begin, _stage, _flows, _error, reject, _accept, _measure, record)
)
# a loop of its own: the other is compiled without its solver
_mean_loop = loop_of(
    ModelFunctions(
        _project,
        rescale,
        _mean_begin,
        _mean_stage,
        means.flows,
        _mean_error,
        reject,
        _mean_accept,
        _measure,
        record,
    )
)


@compiled()
def run(model: Moving, m: Scheme, ramp: Ramp, clock: Array, rows: Array) -> int:
    """The time loop of the elastica, see `loop_of`."""
    return _loop(model, m, ramp, clock, rows)


@compiled()
def run_by_means(model: Moving, m: Scheme, ramp: Ramp, clock: Array, rows: Array) -> int:
    """The same with the means of forces along a step (`average_vector_field`)."""
    return _mean_loop(model, m, ramp, clock, rows)
