"""The time loop of both planar beams: what they predict, solve, measure and keep."""

from __future__ import annotations

from ribbonfem.jit.decorator import compiled
from ribbonfem.results import Array

from .arrays import (
    DIRK,
    HEIGHT,
    ONE_STAGE,
    QUASILINEAR,
    VELOCITY,
    Beam,
    Measures,
    ModelFunctions,
    Ramp,
    Scheme,
    Tables,
)
from .elastica import measure_elastica, newton_elastica, project_elastica
from .loop import loop_of
from .quasilinear import measure_quasilinear, newton_quasilinear, project_quasilinear


@compiled()
def _project(beam: Beam, ramp: Ramp, clock: Array, spin: float, reset: bool) -> float:
    t, nu = beam.t, ramp.damping
    beam.s.rate[0] = spin
    if t.kind == QUASILINEAR:
        impulse = project_quasilinear(t, beam.s, beam.q, beam.v, beam.a, beam.w, t.clamp * spin, nu)
    else:
        impulse = project_elastica(t, beam.s, beam.q, beam.v, beam.a, beam.w, t.clamp * spin, nu)
    for i in range(beam.q.shape[0]):
        beam.auxiliary[i] = beam.a[i]
    if reset:
        for i in range(beam.w.shape[0]):
            beam.dw[i] = 0.0
    return impulse


@compiled()
def _rescale(beam: Beam, ratio: float) -> None:
    a, auxiliary = beam.a, beam.auxiliary
    for i in range(a.shape[0]):
        auxiliary[i] = a[i] + (auxiliary[i] - a[i]) * ratio


@compiled()
def _begin(beam: Beam, clock: Array) -> None:
    s, v, a = beam.s, beam.v, beam.a
    for i in range(v.shape[0]):
        s.stage_v[0, i] = v[i]
        s.stage_a[0, i] = a[i]


@compiled()
def _stage(
    beam: Beam,
    m: Scheme,
    ramp: Ramp,
    clock: Array,
    stage: int,
    h: float,
    at: float,
    angle: float,
    spin: float,
) -> int:
    """Solve a stage into s.q, s.v, s.a, s.w, with q = qp + b a and v = vp + g a."""
    t, s, q, v, a, w = beam.t, beam.s, beam.q, beam.v, beam.a, beam.w
    auxiliary, dw = beam.auxiliary, beam.dw
    s.rate[0] = spin
    if m.kind == ONE_STAGE:
        share = (1.0 - m.alpha_f) / (1.0 - m.alpha_m)
        b, g = m.r1 * h * h * share, m.v1 * h * share
        for i in range(q.shape[0]):
            known = (m.alpha_f * a[i] - m.alpha_m * auxiliary[i]) / (1.0 - m.alpha_m)
            s.qp[i] = q[i] + h * v[i] + h * h * (m.r0 * auxiliary[i] + m.r1 * known)
            s.vp[i] = v[i] + h * (m.v0 * auxiliary[i] + m.v1 * known)
    else:
        g = m.a[stage, stage] * h
        b = g * g
        for i in range(q.shape[0]):
            s.vp[i] = v[i]
            s.qp[i] = q[i]
        for j in range(stage):
            weight = h * m.a[stage, j]
            for i in range(q.shape[0]):
                s.vp[i] += weight * s.stage_a[j, i]
                s.qp[i] += weight * s.stage_v[j, i]
        for i in range(q.shape[0]):
            s.qp[i] += g * s.vp[i]
    # guesses: on the line through the last two instants known
    if stage == 1:
        for i in range(q.shape[0]):
            s.a[i] = a[i]
        for i in range(w.shape[0]):
            s.w[i] = w[i] + m.c[1] * h * dw[i]
    else:
        for i in range(w.shape[0]):
            s.w[i] = w[i] + (s.w[i] - w[i]) * (m.c[stage] / m.c[stage - 1])
    if t.kind == QUASILINEAR:
        s.a[1] = 0.0
        s.qp[1] = t.clamp * angle
        s.vp[1] = t.clamp * spin
    else:
        s.w[0] = t.clamp * angle
    for i in range(q.shape[0]):
        s.q[i] = s.qp[i] + b * s.a[i]
        s.v[i] = s.vp[i] + g * s.a[i]
    if t.kind == QUASILINEAR:
        used = newton_quasilinear(t, s, s.q, s.v, s.a, s.w, b, g, ramp.damping, ramp.newton)
    else:
        used = newton_elastica(t, s, s.q, s.v, s.a, s.w, b, g, ramp.damping, ramp.newton)
    if m.kind == DIRK:
        for i in range(q.shape[0]):
            s.stage_v[stage, i] = s.v[i]
            s.stage_a[stage, i] = s.a[i]
    return used


@compiled()
def _error(beam: Beam, m: Scheme, h: float) -> float:
    """Estimated local error of q."""
    s, a, auxiliary = beam.s, beam.a, beam.auxiliary
    share = (1.0 - m.alpha_f) / (1.0 - m.alpha_m)
    error = 0.0
    for i in range(a.shape[0]):
        if m.kind == ONE_STAGE:
            known = (m.alpha_f * a[i] - m.alpha_m * auxiliary[i]) / (1.0 - m.alpha_m)
            change = h * h * (m.error0 * auxiliary[i] + m.error1 * (share * s.a[i] + known))
        else:
            change = 0.0
            for j in range(m.stages):
                change += m.error[j] * s.stage_v[j, i]
            change *= h
        error = max(error, abs(change))
    return error


@compiled()
def _reject(beam: Beam, clock: Array) -> None:
    """Nothing is remembered from stage to stage."""


@compiled()
def _accept(beam: Beam, m: Scheme, h: float) -> None:
    s, q, v, a, w = beam.s, beam.q, beam.v, beam.a, beam.w
    auxiliary, dw = beam.auxiliary, beam.dw
    share = (1.0 - m.alpha_f) / (1.0 - m.alpha_m)
    for i in range(q.shape[0]):
        if m.kind == ONE_STAGE:
            known = (m.alpha_f * a[i] - m.alpha_m * auxiliary[i]) / (1.0 - m.alpha_m)
            auxiliary[i] = share * s.a[i] + known
        q[i] = s.q[i]
        v[i] = s.v[i]
        a[i] = s.a[i]
    for i in range(w.shape[0]):
        dw[i] = (s.w[i] - w[i]) / h
        w[i] = s.w[i]


@compiled()
def _energies(
    t: Tables, beam: Beam, q: Array, v: Array, a: Array, w: Array, nu: float
) -> tuple[float, float, float, float]:
    if t.kind == QUASILINEAR:
        return measure_quasilinear(t, beam.s, q, v, a, w, nu)
    return measure_elastica(t, v, w)


@compiled()
def _measure(beam: Beam, nu: float, solved: bool) -> Measures:
    s = beam.s
    if solved:
        kinetic, elastic, moment, load = _energies(beam.t, beam, s.q, s.v, s.a, s.w, nu)
    else:
        kinetic, elastic, moment, load = _energies(beam.t, beam, beam.q, beam.v, beam.a, beam.w, nu)
    return kinetic, elastic, 0.0, 2.0 * nu * kinetic, beam.t.clamp * s.rate[0] * moment, load


@compiled()
def _flows(beam: Beam, nu: float, h: float) -> tuple[float, float]:
    _, _, _, lost, power, _ = _measure(beam, nu, True)
    return lost, power


@compiled()
def _record(beam: Beam, rows: Array, row: int) -> None:
    t, q, w = beam.t, beam.q, beam.w
    height = velocity = 0.0
    for k in range(t.middle_dof.shape[0]):
        height += t.middle_weight[k] * q[t.middle_dof[k]]
        velocity += t.middle_weight[k] * beam.v[t.middle_dof[k]]
    rows[row, HEIGHT] = height
    rows[row, VELOCITY] = velocity
    for i in range(q.shape[0]):
        beam.row_q[row, i] = q[i]
    for i in range(w.shape[0]):
        beam.row_w[row, i] = w[i]


_loop = loop_of(
    ModelFunctions(_project, _rescale, _begin, _stage, _flows, _error, _reject, _accept, _measure, _record)
)


@compiled()
def run(beam: Beam, m: Scheme, ramp: Ramp, clock: Array, rows: Array) -> int:
    """The time loop of a beam, see `loop.loop_of`."""
    return _loop(beam, m, ramp, clock, beam.t.clamp, rows)
