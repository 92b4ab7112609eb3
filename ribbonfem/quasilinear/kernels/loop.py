"""What the common time loop (`stepping`) calls of the quasi-linear beam: stage, error, acceptance, row."""

from __future__ import annotations

from ribbonfem.ends.planar_kernels import COMPRESSION, PUSH, controls_at
from ribbonfem.jit.decorator import compiled
from ribbonfem.jit.groups import OPTIONS
from ribbonfem.jit.simd import WIDTH, greatest, larger, load_from, spread, store_from, summed
from ribbonfem.linalg.array_ops import copy
from ribbonfem.results import Array
from ribbonfem.stepping.kernels.allowed_error import PLANAR, USUAL, allowed_error
from ribbonfem.stepping.kernels.arrays import (
    DIRK,
    HEIGHT,
    KEPT,
    PHASE,
    REACTIONS,
    TIME,
    VELOCITY,
    Measures,
    ModelFunctions,
    Ramp,
    Scheme,
)
from ribbonfem.stepping.kernels.guess import (
    KNOWN,
    MEMORY,
    POINTS,
    next_slot,
    reject,
    rescale,
)
from ribbonfem.stepping.kernels.loop import loop_of
from ribbonfem.stepping.kernels.newton import Equations, newton_of, renew

from . import consistent_initialisation
from .bands import add_product, dot
from .beam import ENDS, Moving
from .stage import (
    add_viscous_loads,
    factorise,
    foretell,
    move,
    put_loads,
    residual,
    set_ends,
    solve,
    square,
)

# an increment that leads nowhere
LARGEST = 1e3

_newton = newton_of(Equations(residual, factorise, solve, move, foretell))


@compiled(**OPTIONS)
def _remember(model: Moving, clock: Array, time: float, a: Array, load: float) -> None:
    """Keep a solved stage for guesses."""
    t = model.scratch
    slot = next_slot(t.known_time, clock, time)
    t.known_load[slot] = load
    copy(a, t.known_a[slot])


@compiled(**OPTIONS)
def _guess(model: Moving, clock: Array, time: float, b: float) -> None:
    """Guesses of z and the load at a time, on the line through the last two stages known.

    (Parabolas cost a twelfth more iterations.)
    """
    t, known = model.scratch, int(clock[POINTS])
    last, before = (known - 1) % MEMORY, (known - 2) % MEMORY
    weight = 1.0
    if known > 1:
        weight = (time - t.known_time[before]) / (t.known_time[last] - t.known_time[before])
    for k in range(0, t.z.shape[0], WIDTH):
        a = weight * load_from(t.known_a, (last, k)) + (1.0 - weight) * load_from(t.known_a, (before, k))
        store_from(t.z, (k,), load_from(t.rp, (k,)) + b * a)
    t.load[0] = weight * t.known_load[last] + (1.0 - weight) * t.known_load[before]


@compiled(**OPTIONS)
def _known(model: Moving, m: Scheme, i: int, h: float, nu: float) -> tuple[float, float]:
    """Put what a stage knows in t.rp, t.vp, t.known; return b and f of z = rp + b a, v = vp + f a."""
    y, t = model.motion, model.scratch
    n = y.z.shape[0]
    if m.kind != DIRK:
        share = (1.0 - m.alpha_f) / (1.0 - m.alpha_m)
        b, f = m.r1 * h * h * share, m.v1 * h * share
        of_a, of_old = m.alpha_f / (1.0 - m.alpha_m), m.alpha_m / (1.0 - m.alpha_m)
        for k in range(n):
            old = y.auxiliary[k]
            new = of_a * y.a[k] - of_old * old
            t.rp[k] = y.z[k] + h * y.v[k] + h * h * (m.r0 * old + m.r1 * new)
            t.vp[k] = y.v[k] + h * (m.v0 * old + m.v1 * new)
    else:
        f = h * m.a[i, i]
        b = f * f
        for k in range(0, n, WIDTH):
            z, v = load_from(y.z, (k,)), load_from(y.v, (k,))
            for j in range(i):
                z += (h * m.a[i, j]) * load_from(t.stage_v, (j, k))
                v += (h * m.a[i, j]) * load_from(t.stage_a, (j, k))
            store_from(t.vp, (k,), v)
            store_from(t.rp, (k,), z + f * v)
    sigma = (1.0 + nu * f) / b
    for k in range(0, n, WIDTH):
        store_from(t.known, (k,), sigma * load_from(t.rp, (k,)) - nu * load_from(t.vp, (k,)))
    return b, f


@compiled(**OPTIONS)
def _project(model: Moving, ramp: Ramp, clock: Array, reset: bool) -> float:
    t, y, beam = model.scratch, model.motion, model.beam
    controls_at(ramp.ends, int(clock[PHASE]), clock[TIME], t.controls)
    set_ends(beam, t.controls, t.ends)
    impulse = consistent_initialisation.project(beam, y, t, ramp.ends, ramp.damping)
    if reset:
        clock[POINTS] = 0.0
        _remember(model, clock, clock[TIME], y.a, y.load[0])
    return impulse


@compiled(**OPTIONS)
def _begin(model: Moving, clock: Array) -> None:
    copy(model.motion.v, model.scratch.stage_v[0])
    copy(model.motion.a, model.scratch.stage_a[0])
    clock[KNOWN] = clock[POINTS]
    renew(clock)


@compiled(**OPTIONS)
def _stage(model: Moving, m: Scheme, ramp: Ramp, clock: Array, i: int, h: float, at: float) -> int:
    """Solve a stage into t.z, t.v, t.a, t.load of the scratch t."""
    t, beam, nu = model.scratch, model.beam, ramp.damping
    controls_at(ramp.ends, int(clock[PHASE]), at, t.controls)
    set_ends(beam, t.controls, t.ends)
    put_loads(beam, t, nu)
    b, f = _known(model, m, i, h, nu)
    add_product(beam.mass.band, 1.0, t.wide_known, t.loads)
    if beam.retardation > 0.0:
        add_viscous_loads(beam, t, b, f)
    _guess(model, clock, at, b)
    used: int = _newton(model, (1.0 + nu * f) / b, b, LARGEST, ramp, clock)
    inverse = 1.0 / b
    for k in range(0, t.z.shape[0], WIDTH):
        a = inverse * (load_from(t.z, (k,)) - load_from(t.rp, (k,)))
        v = load_from(t.vp, (k,)) + f * a
        store_from(t.a, (k,), a)
        store_from(t.v, (k,), v)
        if m.kind == DIRK:
            store_from(t.stage_a, (i, k), a)
            store_from(t.stage_v, (i, k), v)
    if used > 0:
        _remember(model, clock, at, t.a, t.load[0])
    return used


@compiled(**OPTIONS)
def _error(model: Moving, m: Scheme, h: float) -> float:
    """Estimated local error of the heights, counted the more the slower the beam creeps."""
    t, y, beam = model.scratch, model.motion, model.beam
    share = (1.0 - m.alpha_f) / (1.0 - m.alpha_m)
    of_a, of_old = m.alpha_f / (1.0 - m.alpha_m), m.alpha_m / (1.0 - m.alpha_m)
    largest = fastest = spread(0.0)
    for k in range(0, y.a.shape[0], WIDTH):
        height, v, change = load_from(beam.height, (k,)), load_from(t.v, (k,)), spread(0.0)
        if m.kind != DIRK:
            old = load_from(y.auxiliary, (k,))
            new = share * load_from(t.a, (k,)) + of_a * load_from(y.a, (k,)) - of_old * old
            change = (h * m.error0) * old + (h * m.error1) * new
        else:
            for j in range(m.stages):
                change += m.error[j] * load_from(t.stage_v, (j, k))
        largest = larger(largest, height * larger(change, -change))
        fastest = larger(fastest, height * larger(v, -v))
    allowed = allowed_error(beam.scale * greatest(fastest), PLANAR if m.kind == DIRK else USUAL)
    return h * greatest(largest) / allowed


@compiled(**OPTIONS)
def _accept(model: Moving, m: Scheme, h: float) -> None:
    """Take over the last stage."""
    t, y = model.scratch, model.motion
    if m.kind != DIRK:
        share = (1.0 - m.alpha_f) / (1.0 - m.alpha_m)
        for k in range(y.a.shape[0]):
            known = (m.alpha_f * y.a[k] - m.alpha_m * y.auxiliary[k]) / (1.0 - m.alpha_m)
            y.auxiliary[k] = share * t.a[k] + known
    copy(t.z, y.z)
    copy(t.v, y.v)
    copy(t.a, y.a)
    copy(t.load, y.load)
    copy(t.ends, y.ends)


@compiled(**OPTIONS)
def _held(model: Moving, c: int, z: Array, v: Array, a: Array, load: float, ends: Array, nu: float) -> float:
    """What holds dof c of the ends, in units of the beam's own."""
    beam, n, push = model.beam, z.shape[0], model.scratch.controls[PUSH, 0] / model.beam.scale
    k, g, m, total = beam.stiffness, beam.tension, beam.mass, spread(0.0)
    for i in range(0, n, WIDTH):
        rate = load_from(v, (i,))
        strained = load_from(z, (i,)) + beam.retardation * rate
        total += load_from(k.ends, (c, i)) * strained - load * load_from(g.ends, (c, i)) * load_from(z, (i,))
        total += load_from(m.ends, (c, i)) * (load_from(a, (i,)) + nu * rate)
    held: float = summed(total)
    for e in range(ENDS):
        held += k.corner[c, e] * (ends[0, e] + beam.retardation * ends[1, e])
        held += m.corner[c, e] * (ends[2, e] + nu * ends[1, e]) - load * g.corner[c, e] * ends[0, e]
    return held + push * beam.middle[0, n + c] - beam.weight[n + c] - beam.bent[n + c]


@compiled(**OPTIONS)
def _flowing(model: Moving, nu: float) -> tuple[float, float, float]:
    """Kinetic energy of the scratch, what damping takes, and the power of the controls."""
    beam, t = model.beam, model.scratch
    n, tau, push = t.z.shape[0], beam.retardation, t.controls[PUSH, 0] / beam.scale
    # (in units of the beam's own: of the shortening over dL/L)
    power = t.load[0] * t.controls[COMPRESSION, 1] / (beam.scale * beam.scale)
    if push != 0.0:
        power -= push * (dot(beam.middle[0, :n], t.v) + dot(beam.middle[0, n:], t.ends[1]))
    for c in range(1, ENDS):
        if t.ends[1, c] != 0.0:
            power += t.ends[1, c] * _held(model, c, t.z, t.v, t.a, t.load[0], t.ends, nu)
    kinetic = 0.5 * square(beam.mass, t.v, t.wide_v, t.ends[1])
    lost = 2.0 * nu * kinetic
    if tau > 0.0:
        lost += tau * square(beam.stiffness, t.v, t.wide_v, t.ends[1])
    return kinetic, lost, power


@compiled(**OPTIONS)
def _flows(model: Moving, nu: float, h: float) -> tuple[float, float]:
    _, lost, power = _flowing(model, nu)
    return lost, power


@compiled(**OPTIONS)
def _measure(model: Moving, nu: float, solved: bool) -> Measures:
    """Energies, what they lose and take, load (`ModelFunctions`)."""
    beam, t, y = model.beam, model.scratch, model.motion
    if not solved:
        # (what the scratch holds of the last stage is used no more)
        copy(y.z, t.z)
        copy(y.v, t.v)
        copy(y.a, t.a)
        copy(y.load, t.load)
        copy(y.ends, t.ends)
    n = t.z.shape[0]
    kinetic, lost, power = _flowing(model, nu)
    bent = weight = spread(0.0)
    for k in range(0, n, WIDTH):
        bent += load_from(beam.bent, (k,)) * load_from(t.z, (k,))
        weight += load_from(beam.weight, (k,)) * load_from(t.z, (k,))
    elastic = 0.5 * square(beam.stiffness, t.z, t.wide_z, t.ends[0]) + beam.own - summed(bent)
    potential = -summed(weight)
    for c in range(ENDS):
        elastic -= beam.bent[n + c] * t.ends[0, c]
        potential -= beam.weight[n + c] * t.ends[0, c]
    return kinetic, elastic, potential, lost, power, t.load[0]


@compiled(**OPTIONS)
def _record(model: Moving, nu: float, rows: Array, row: int) -> None:
    """Height and velocity at midspan, and the dofs; of rows that are kept reactions."""
    y, middle = model.motion, model.beam.middle
    n, unknowns = y.z.shape[0], model.row_z.shape[1] - ENDS
    height, velocity = dot(middle[0, :n], y.z), dot(middle[0, :n], y.v)
    slope = dot(middle[1, :n], y.z)
    for k in range(unknowns):
        model.row_z[row, k] = y.z[k]
        model.row_v[row, k] = y.v[k]
    for c in range(ENDS):
        height += middle[0, n + c] * y.ends[0, c]
        velocity += middle[0, n + c] * y.ends[1, c]
        slope += middle[1, n + c] * y.ends[0, c]
        model.row_z[row, unknowns + c] = y.ends[0, c]
        model.row_v[row, unknowns + c] = y.ends[1, c]
    model.row_slope[row] = slope
    rows[row, HEIGHT], rows[row, VELOCITY] = height, velocity
    if rows[row, KEPT] == 0.0:
        return
    for c in range(12):
        rows[row, REACTIONS + c] = 0.0
    rows[row, REACTIONS], rows[row, REACTIONS + 6] = y.load[0], -y.load[0]
    for c in range(ENDS):
        held = model.beam.scale * _held(model, c, y.z, y.v, y.a, y.load[0], y.ends, nu)
        # force along z; moment about y, which turns slopes down
        rows[row, REACTIONS + 6 * (c // 2) + 2 * (1 + c % 2)] = held if c % 2 == 0 else -held


_loop = loop_of(
    ModelFunctions(_project, rescale, _begin, _stage, _flows, _error, reject, _accept, _measure, _record)
)


@compiled()
def run(model: Moving, m: Scheme, ramp: Ramp, clock: Array, rows: Array) -> int:
    """The time loop of the quasi-linear beam, see `loop_of`."""
    return _loop(model, m, ramp, clock, rows)
