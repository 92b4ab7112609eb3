"""What the common time loop (`stepping`) calls of the Kirchhoff rod: guess, stage, error, acceptance, row.

Unknowns of a stage are its rates; the rotations are those of the last instant turned further,
so that nothing is added that does not add.  All state is in `Motion` and its clock.
"""

from __future__ import annotations

import math

from ribbonfem.ends.kernels import FRAME, PLACE, PUSH, Ends, pose_at
from ribbonfem.jit.algebra import along_i, carried, put_triple, quaternion, triple
from ribbonfem.jit.decorator import compiled
from ribbonfem.jit.simd import lane, larger, load, spread, store
from ribbonfem.linalg.array_ops import add, copy
from ribbonfem.results import Array
from ribbonfem.stepping.kernels.allowed_error import USUAL, allowed_error
from ribbonfem.stepping.kernels.arrays import (
    DIRK,
    GAINED,
    HEIGHT,
    KEPT,
    PHASE,
    PLACES,
    TIME,
    VELOCITY,
    Measures,
    ModelFunctions,
    Ramp,
    Scheme,
)
from ribbonfem.stepping.kernels.guess import KNOWN, POINTS, reject, rescale
from ribbonfem.stepping.kernels.loop import loop_of
from ribbonfem.stepping.kernels.newton import renew
from ribbonfem.stepping.kernels.strains import know_strains

from .arrays import SLOPE, Motion, Moving, Scratch
from .average_vector_field import conserve, error_by_means, guess_ringing, mean_kinetic
from .batch import OPTIONS, WIDTH
from .consistent_initialisation import project, tangents
from .energies import elastic_energy, potential_energy, power, put_reactions
from .law import keep_strains, viscous_loss
from .newton import guess, newton, remember
from .rod import P, Rod


@compiled(**OPTIONS)
def _set_clamps(t: Scratch, ends: Ends, phase: int, time: float) -> None:
    """Both clamps of a stage where they are held."""
    pose_at(ends, phase, time, t.pose)
    last = t.g.shape[0] - 1
    for c in range(4):
        t.g[0, c], t.g[last, c] = t.pose[FRAME + c], t.pose[FRAME + 4 + c]
    for c in range(3):
        t.x[last, c] = t.pose[PLACE + c]


@compiled(**OPTIONS)
def _kinetic(rod: Rod, v: Array) -> float:
    total = 0.0
    for k in range(4, v.size - 4):
        total += rod.inertia.flat[k] * v.flat[k] * v.flat[k]
    return 0.5 * total


@compiled(**OPTIONS)
def _known(
    m: Scheme, y: Motion, t: Scratch, i: int, h: float, gyroscopic: bool
) -> tuple[float, float, float]:
    """Put what a stage knows in t.xp, t.vp, t.tp; return b, f and ft of x = xp + b a, and so on."""
    nodes = y.x.shape[0]
    if m.kind != DIRK:
        share = (1.0 - m.alpha_f) / (1.0 - m.alpha_m)
        for node in range(1, nodes - 1):
            for c in range(4):
                known = (m.alpha_f * y.a[node, c] - m.alpha_m * y.auxiliary[node, c]) / (1.0 - m.alpha_m)
                t.xp[node, c] = (
                    y.x[node, c] + h * y.v[node, c] + h * h * (m.r0 * y.auxiliary[node, c] + m.r1 * known)
                )
                t.vp[node, c] = y.v[node, c] + h * (m.v0 * y.auxiliary[node, c] + m.v1 * known)
            for c in range(3):
                t.tp[node, c] = y.tangent[node, c] + 0.5 * h * y.tangent_rate[node, c]
        return m.r1 * h * h * share, m.v1 * h * share, 0.5 * h
    diagonal = h * m.a[i, i]
    for node in range(1, nodes - 1):
        x, v = load(y.x, (node,)), load(y.v, (node,))
        for j in range(i):
            share = h * m.a[i, j]
            x += share * load(t.stage_v, (j, node))
            v += share * load(t.stage_a, (j, node))
        store(t.vp, (node,), v)
        store(t.xp, (node,), x + diagonal * v)
    if gyroscopic:
        copy(y.tangent, t.tp)
        for j in range(i):
            add(t.stage_tangent_rate[j], h * m.a[i, j], t.tp)
    return diagonal * diagonal, diagonal, diagonal


@compiled(**OPTIONS)
def _project(model: Moving, ramp: Ramp, clock: Array, reset: bool) -> float:
    t, y = model.scratch, model.motion
    pose_at(ramp.ends, int(clock[PHASE]), clock[TIME], t.pose)
    impulse = project(model.rod, model.solver, y, t, ramp.ends, ramp)
    copy(y.a, y.auxiliary)
    if reset:
        clock[POINTS] = 0.0
        remember(t, clock, clock[TIME], y.g, y.n, y.a)
        copy(y.x, t.x)
        copy(y.g, t.g)
        t.v[:] = 0.0
        t.a[:] = 0.0
        t.tangent_rate[:] = 0.0
    return impulse


@compiled(**OPTIONS)
def _begin(model: Moving, clock: Array) -> None:
    t, y = model.scratch, model.motion
    copy(y.v, t.stage_v[0])
    copy(y.a, t.stage_a[0])
    copy(y.tangent_rate, t.stage_tangent_rate[0])
    copy(y.strain_rate, t.stage_strain_rate[0])
    clock[KNOWN] = clock[POINTS]
    renew(clock)


@compiled(**OPTIONS)
def _ready(
    model: Moving, m: Scheme, ramp: Ramp, clock: Array, i: int, h: float, at: float
) -> tuple[float, float, float]:
    """What a stage knows, as `_known`, and its guesses, the clamps where they are held."""
    b, f, ft = _known(m, model.motion, model.scratch, i, h, model.rod.gyroscopic)
    guess(model.scratch, clock, at)
    _set_clamps(model.scratch, ramp.ends, int(clock[PHASE]), at)
    if model.rod.retardation > 0.0:
        know_strains(model.rod, m, model.motion, model.scratch, i, h, ft)
    return b, f, ft


@compiled(**OPTIONS)
def _stage(model: Moving, m: Scheme, ramp: Ramp, clock: Array, i: int, h: float, at: float) -> int:
    """Solve a stage into t.x, t.g, t.n, t.v, t.a, t.tangent_rate of the scratch t."""
    t = model.scratch
    b, f, ft = _ready(model, m, ramp, clock, i, h, at)
    used = newton(model, b, f, ft, ramp, clock)
    if used > 0:
        remember(t, clock, at, t.g, t.n, t.a)
    if model.rod.retardation > 0.0:
        keep_strains(model.rod, model.solver, t, ft)
        if m.kind == DIRK:
            copy(t.strain_rate, t.stage_strain_rate[i])
    if m.kind == DIRK:
        copy(t.v, t.stage_v[i])
        copy(t.a, t.stage_a[i])
        copy(t.tangent_rate, t.stage_tangent_rate[i])
    return used


@compiled(**OPTIONS)
def _mean_stage(model: Moving, m: Scheme, ramp: Ramp, clock: Array, i: int, h: float, at: float) -> int:
    """Solve a step by the means of its forces, into the same places."""
    t, y = model.scratch, model.motion
    # (what a step that was rejected left is the end's)
    pose_at(ramp.ends, int(clock[PHASE]), clock[TIME], t.pose)
    t.out[2] = t.pose[PUSH]
    b, _, _ = _ready(model, m, ramp, clock, i, h, at)
    guess_ringing(t, clock)
    used = conserve(model.rod, model.solver, t, y, b, h, ramp, clock)
    if used > 0:
        remember(t, clock, at, t.g, t.n, t.a)
    return used


@compiled(**OPTIONS)
def _flows(model: Moving, nu: float, h: float) -> tuple[float, float]:
    rod, t = model.rod, model.scratch
    lost = 2.0 * nu * _kinetic(rod, t.v)
    if rod.retardation > 0.0:
        lost += viscous_loss(rod, t.strain_rate)
    return lost, power(rod, t.g, t.n, t.v, t.pose)


@compiled(**OPTIONS)
def _mean_flows(model: Moving, nu: float, h: float) -> tuple[float, float]:
    t = model.scratch
    return 2.0 * nu * mean_kinetic(model.rod, model.motion.v, t.v), t.out[0] / h


@compiled(**OPTIONS)
def _error(model: Moving, m: Scheme, h: float) -> float:
    """Estimated local error of the positions, counted the more the slower the ribbon creeps.

    Errors made while it creeps towards a fold add up and shift the snap; those made while it rings do not.
    """
    t, y = model.scratch, model.motion
    largest = fastest = spread(0.0)
    share = (1.0 - m.alpha_f) / (1.0 - m.alpha_m)
    for node in range(1, y.x.shape[0] - 1):
        change, v = spread(0.0), load(t.v, (node,))
        if m.kind != DIRK:
            old = load(y.auxiliary, (node,))
            known = (m.alpha_f * load(y.a, (node,)) - m.alpha_m * old) / (1.0 - m.alpha_m)
            change = h * (m.error0 * old + m.error1 * (share * load(t.a, (node,)) + known))
        else:
            for j in range(m.stages):
                change += m.error[j] * load(t.stage_v, (j, node))
        largest, fastest = larger(largest, change * change), larger(fastest, v * v)
    # (of positions, not of theta)
    error = max(lane(largest, 0), lane(largest, 1), lane(largest, 2))
    speed = max(lane(fastest, 0), lane(fastest, 1), lane(fastest, 2))
    return h * math.sqrt(error) / allowed_error(math.sqrt(speed), USUAL)


@compiled(**OPTIONS)
def _mean_error(model: Moving, m: Scheme, h: float) -> float:
    """The same of a step by means."""
    error, speed = error_by_means(model.motion, model.scratch, model.motion.clock, h)
    return error / allowed_error(speed, USUAL)


@compiled(**OPTIONS)
def _accept(model: Moving, m: Scheme, h: float) -> None:
    """Take over the last stage; theta starts anew."""
    t, y = model.scratch, model.motion
    share = (1.0 - m.alpha_f) / (1.0 - m.alpha_m)
    for node in range(1, y.x.shape[0] - 1):
        for c in range(4):
            if m.kind != DIRK:
                known = (m.alpha_f * y.a[node, c] - m.alpha_m * y.auxiliary[node, c]) / (1.0 - m.alpha_m)
                y.auxiliary[node, c] = share * t.a[node, c] + known
            y.x[node, c] = t.x[node, c]
            y.v[node, c] = t.v[node, c]
            y.a[node, c] = t.a[node, c]
        y.x[node, 3] = 0.0
        for c in range(3):
            y.tangent_rate[node, c] = t.tangent_rate[node, c]
    for c in range(3):
        y.x[y.x.shape[0] - 1, c] = t.x[y.x.shape[0] - 1, c]
    copy(t.strain, y.strain)
    copy(t.strain_rate, y.strain_rate)
    copy(t.g, y.g)
    copy(t.n, y.n)
    tangents(y.g, y.tangent)


@compiled(**OPTIONS)
def _balance(rod: Rod, v: Array, clock: Array) -> None:
    """Take from velocities what a kink, Newton and the three points of the means left of the energy."""
    if clock[GAINED] != 0.0:
        part = math.sqrt(1.0 - clock[GAINED] / _kinetic(rod, v))
        for k in range(4, v.size - 4):
            v.flat[k] *= part
        clock[GAINED] = 0.0


@compiled(**OPTIONS)
def _mean_begin(model: Moving, clock: Array) -> None:
    _balance(model.rod, model.motion.v, clock)
    _begin(model, clock)


@compiled(**OPTIONS)
def _mean_accept(model: Moving, m: Scheme, h: float) -> None:
    _balance(model.rod, model.scratch.v, model.motion.clock)
    _accept(model, m, h)


@compiled(**OPTIONS)
def _energies(
    model: Moving, nu: float, x: Array, g: Array, n: Array, v: Array, strain_rate: Array
) -> Measures:
    rod, s = model.rod, model.solver
    load = 0.0
    for e in range(rod.weights.shape[0]):
        for k in range(P):
            load -= rod.weights[e, k] * n[e // WIDTH, k, 0, e % WIDTH]
    kinetic = _kinetic(rod, v)
    lost = 2.0 * nu * kinetic
    if rod.retardation > 0.0:
        lost += viscous_loss(rod, strain_rate)
    elastic, potential = elastic_energy(rod, s, g, n), potential_energy(rod, x)
    return kinetic, elastic, potential, lost, power(rod, g, n, v, model.scratch.pose), load


@compiled(**OPTIONS)
def _measure(model: Moving, nu: float, solved: bool) -> Measures:
    """Energies, what they lose and take, mean compressive force (`ModelFunctions`); overwrites residuals."""
    t, y = model.scratch, model.motion
    if solved:
        return _energies(model, nu, t.x, t.g, t.n, t.v, t.strain_rate)
    return _energies(model, nu, y.x, y.g, y.n, y.v, y.strain_rate)


@compiled(**OPTIONS)
def _record(model: Moving, nu: float, rows: Array, row: int) -> None:
    """Height, slope and velocity; of rows that are kept reactions, and configurations if there is room."""
    rod, y = model.rod, model.motion
    middle = quaternion(y.g, rod.middle)
    rows[row, HEIGHT] = y.x[rod.middle, 2]
    rows[row, SLOPE] = along_i(middle, middle)[2]
    rows[row, VELOCITY] = y.v[rod.middle, 2]
    if rows[row, KEPT] == 0.0:
        return
    put_reactions(rod, y.g, y.n, model.scratch.pose, nu, rows[row])
    place = int(y.clock[PLACES])
    if place < model.row_x.shape[0]:
        y.clock[PLACES] += 1.0
        for i in range(y.g.shape[0]):
            put_triple(triple(y.x, i), model.row_x[place], i)
            put_triple(carried(quaternion(y.g, i), (0.0, 0.0, 1.0)), model.row_m1[place], i)
            put_triple(triple(y.v, i), model.row_v[place], i)


_loop = loop_of(
    ModelFunctions(_project, rescale, _begin, _stage, _flows, _error, reject, _accept, _measure, _record)
)
# a loop of its own: two solvers in one are no longer compiled into it, which costs both
_mean_loop = loop_of(
    ModelFunctions(
        _project,
        rescale,
        _mean_begin,
        _mean_stage,
        _mean_flows,
        _mean_error,
        reject,
        _mean_accept,
        _measure,
        _record,
    )
)


@compiled()
def run(model: Moving, m: Scheme, ramp: Ramp, rows: Array) -> int:
    """The time loop of a Kirchhoff rod, see `loop_of`."""
    return _loop(model, m, ramp, model.motion.clock, rows)


@compiled()
def run_by_means(model: Moving, m: Scheme, ramp: Ramp, rows: Array) -> int:
    """The same with the means of forces along a step (`average_vector_field`)."""
    return _mean_loop(model, m, ramp, model.motion.clock, rows)
