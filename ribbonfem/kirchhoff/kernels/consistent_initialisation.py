"""Consistent velocities, accelerations and forces of the Kirchhoff rod where its clamps' speed jumps.

r' = w t with w = 1 + c n.t, derived once in time, is for the velocities, and derived twice for the
accelerations:

    (1)  D v   = w dt/dt,               M (v - v0) + D^T p = 0  and  T^T p = 0, of impulses p
    (2)  D v_t = w d2t/dt2 + 2 dw/dt dt/dt,  and the equations of motion (`residual`), of forces n
"""

from __future__ import annotations

from ribbonfem.ends.kernels import (
    CHANGE,
    COMPRESSION,
    FRAME,
    LEFT,
    PUSH,
    RIGHT,
    SPEED,
    SPIN,
    SPIN_RATE,
    TWIST_LEFT,
    TWIST_RIGHT,
    Ends,
)
from ribbonfem.jit.algebra import (
    Quaternion,
    Value,
    Vector,
    along_i,
    by_vector,
    carried,
    dot,
    dot4,
    mix,
    mix4,
    put_triple,
    quaternion,
    scaled,
    triple,
)
from ribbonfem.jit.decorator import compiled
from ribbonfem.linalg.array_ops import add, copy
from ribbonfem.results import Array
from ribbonfem.stepping.kernels.arrays import Ramp
from ribbonfem.stepping.kernels.newton import SIGMA
from ribbonfem.stepping.kernels.strains import know_rates

from .arrays import Motion, Scratch
from .batch import INLINED, OPTIONS, WIDTH
from .condensed import factorise, solve
from .gauss_point import body_moment, interpolated, pulled, tangent_of, tangent_rate
from .law import put_strain_rates, put_strains
from .residual import residual
from .rod import P, Rod, Solver
from .tangent import PENALTY, fill


@compiled(**OPTIONS)
def tangents(g: Array, tangent: Array) -> None:
    """Unit tangents (nodes, 3) of the frames."""
    for i in range(g.shape[0]):
        q = quaternion(g, i)
        put_triple(along_i(q, q), tangent, i)


@compiled(**INLINED)
def _frame_rates(
    rod: Rod, e: int, k: int, g: Array, spin: Array, known_spin: Array
) -> tuple[Quaternion, Quaternion, Quaternion]:
    """Rates of the interpolated quaternion at a Gauss point of an element.

    By `spin` (nodes, 3), g spin / 2 of each node, by `known_spin`, and twice by it,
    -|known_spin|^2 g / 4.
    """
    d = u = w = (0.0, 0.0, 0.0, 0.0)
    for i in range(P + 1):
        node, value = e * P + i, rod.value[k, i]
        q, turn = quaternion(g, node), triple(known_spin, node)
        d = mix4(d, 1.0, by_vector(q, triple(spin, node)), 0.5 * value)
        u = mix4(u, 1.0, by_vector(q, turn), 0.5 * value)
        w = mix4(w, 1.0, q, -0.25 * value * dot(turn, turn))
    return d, u, w


@compiled(**INLINED)
def _curved(inverse: Value, q: Quaternion, t: Vector, u: Quaternion, w: Quaternion, change: Vector) -> Vector:
    """Second rate of t = q i q* / |q|^2 where q has the rates u and w; `change` is the first."""
    factor = 2.0 * inverse
    longer = factor * (dot4(u, u) + dot4(q, w))
    second = mix(along_i(u, u), factor, along_i(q, w), factor)
    return mix(mix(second, 1.0, t, -longer), 1.0, change, -2.0 * factor * dot4(q, u))


@compiled(**INLINED)
def _stretching(rod: Rod, e: int, k: int, v: Array, t: Vector) -> Value:
    """t.v', of velocities v (nodes, 4)."""
    total = 0.0
    for i in range(P + 1):
        total += rod.slope[e, k, i] * dot(triple(v, e * P + i), t)
    return total


@compiled(**OPTIONS)
def _impulse_residual(
    rod: Rod, s: Solver, m: Motion, t: Scratch, old: Array, second: bool, ramp: Ramp
) -> None:
    """Residual of the hidden constraints, see `_project`; t.spin are the unknown rates of rotation.

    First: v = t.v against `old`, impulses t.n.  Second: a = m.a, rates of m.v and t.known_spin (the
    rates of rotation found first), forces t.n.
    """
    g = m.g
    nodes = g.shape[0]
    nu = ramp.damping
    if second:
        for i in range(nodes):
            for c in range(3):
                t.force[i, c] = m.a[i, c] + nu * m.v[i, c] - rod.weight[c]
            t.force[i, 3] = t.spin[i, 0] + nu * m.v[i, 3]
        residual(rod, s, m.x, g, t.n, t.force)
        s.fr[rod.middle, 2] += t.pose[PUSH]
        if rod.gyroscopic:
            for i in range(1, nodes - 1):
                factor = rod.inertia[i, 3] * m.v[i, 3]
                s.fp[i, 1] += factor * t.known_spin[i, 2]
                s.fp[i, 2] -= factor * t.known_spin[i, 1]
    else:
        for i in range(nodes):
            for c in range(3):
                s.fr[i, c] = rod.inertia[i, c] * (t.v[i, c] - old[i, c])
                s.fp[i, c] = 0.0
            s.fp[i, 0] = rod.inertia[i, 3] * (t.spin[i, 0] - old[i, 3])
    axial = PENALTY if rod.compliance[0] > 0.0 else 0.0
    rates = m.a if second else t.v
    last = rod.weights.shape[0] - 1
    for place in range(WIDTH * rod.groups.weights.shape[0]):
        # (places without an element repeat the last one's gaps, and add no forces)
        e, real = min(place, last), place <= last
        group, lane = place // WIDTH, place % WIDTH
        for k in range(P):
            q, _ = interpolated(rod.value, rod.slope, e, k, g, P)
            d, u, w = _frame_rates(rod, e, k, g, t.spin, t.known_spin)
            force = m.n[group, k, 0, lane], m.n[group, k, 1, lane], m.n[group, k, 2, lane]
            impulse = t.n[group, k, 0, lane], t.n[group, k, 1, lane], t.n[group, k, 2, lane]
            inverse, tangent = tangent_of(q)
            weight = rod.weights[e, k]
            stretch = 1.0 + rod.compliance[0] * dot(force, tangent)
            if rod.retardation > 0.0:
                stretch = 1.0 + m.strain[group, k, 3, lane]
            # w t', and of the second rate w t'' + 2 w' t' besides, of rotations twice
            gap = scaled(stretch, tangent_rate(inverse, q, tangent, d))
            if second:
                change = tangent_rate(inverse, q, tangent, u)
                longer = _stretching(rod, e, k, m.v, tangent)
                again = _curved(inverse, q, tangent, u, w, change)
                gap = mix(gap, 1.0, mix(again, stretch, change, 2.0 * longer), 1.0)
            held = 0.0
            if axial > 0.0:
                # the axial force of the stretched rod takes no impulse, and does not jump
                held = dot(impulse, tangent)
                if second:
                    tension = dot(force, tangent)
                    if rod.retardation > 0.0:
                        # (with its viscous part, which does jump)
                        tension = (stretch - 1.0 - rod.offset[group, k, 3, lane]) / rod.elastic[3]
                    held -= tension
                held *= weight * axial
            gap = mix(gap, -weight, tangent, -held)
            for i in range(P + 1):
                node, coupling = e * P + i, rod.coupling[e, k, i]
                gap = mix(gap, 1.0, triple(rates, node), coupling)
                if real and not second:
                    put_triple(mix(triple(s.fr, node), 1.0, impulse, coupling), s.fr, node)
            s.fn[group, k, 0, lane], s.fn[group, k, 1, lane], s.fn[group, k, 2, lane] = gap
            if real and not second:
                # -T^T of the impulse
                by_q = pulled(inverse, q, tangent, impulse)
                for i in range(P + 1):
                    node = e * P + i
                    moment = body_moment(quaternion(g, node), by_q)
                    share = rod.value[k, i] * weight * stretch
                    put_triple(mix(triple(s.fp, node), 1.0, moment, share), s.fp, node)


@compiled(**OPTIONS)
def _impulse(s: Solver, ends: Ends, pose: Array) -> float:
    """On the control, of the impulses on both clamps in s: what the control's rate moves of them."""
    last, moved = s.fp.shape[0] - 1, ends.moved
    total = moved[TWIST_LEFT] * s.fp[0, 0] + moved[TWIST_RIGHT] * s.fp[last, 0]
    # (the clamps turn about an axis of space)
    for side in range(2):
        node, by = last * side, moved[LEFT] if side == 0 else -moved[RIGHT]
        if by != 0.0:
            k = FRAME + 4 * side
            frame = pose[k], pose[k + 1], pose[k + 2], pose[k + 3]
            total += by * carried(frame, triple(s.fp, node))[1]
    for c in range(3):
        sign = 1.0 if c == 2 else -1.0
        total += sign * moved[COMPRESSION + c] * s.fr[last, c]
    return total


@compiled(**OPTIONS)
def project(rod: Rod, s: Solver, m: Motion, t: Scratch, ends: Ends, ramp: Ramp) -> float:
    """Put v, a and n onto the hidden constraints; return the impulse on the control.

    r' = t (1 + c n.t), derived once: the velocity nearest to m.v in the kinetic energy, with the
    clamps as in t.pose; derived twice: the accelerations and forces that go with it.  What stretch
    leaves free stays as it is.  Bending has no inertia: a small one is lent to the tangent, and
    refinement of the solution takes it back.
    """
    nodes = m.g.shape[0]
    m.clock[SIGMA] = 0.0
    fill(rod, s, m.g, m.n, 1.0, True)
    factorise(s)
    impulse = 0.0
    for second in (False, True):
        for i in range(nodes):
            for c in range(3):
                if second:
                    t.known_spin[i, c] = t.spin[i, c]
                t.spin[i, c] = 0.0
            for c in range(4):
                if not second:
                    t.v[i, c] = m.v[i, c]
        for c in range(3):
            m.v[nodes - 1, c], m.a[nodes - 1, c] = t.pose[SPEED + c], t.pose[CHANGE + c]
            t.v[nodes - 1, c] = t.pose[SPEED + c]
        if second and rod.retardation > 0.0:
            put_strains(rod, s, m.g, m.n, m.strain)
            put_strain_rates(rod, m.g, m.v, t.known_spin, t.force, m.strain_rate)
            know_rates(rod, m.strain_rate)
        for k in range(t.n.size):
            t.n.flat[k] = m.n.flat[k] if second else 0.0
        for i in range(nodes):
            t.spin[i, 0] = m.a[i, 3] if second else m.v[i, 3]
        first = SPIN_RATE if second else SPIN
        for c in range(3):
            t.spin[0, c], t.spin[nodes - 1, c] = t.pose[first + c], t.pose[first + 3 + c]
        for _ in range(12):
            _impulse_residual(rod, s, m, t, m.v, second, ramp)
            if not second:
                impulse = _impulse(s, ends, t.pose)
            solve(rod, s, 1.0)
            size = change = 0.0
            for i in range(1, nodes - 1):
                for c in range(3):
                    t.spin[i, c] += s.fp[i, c]
                    change = max(change, abs(s.fp[i, c]))
                    size = max(size, abs(t.spin[i, c]))
                    if second:
                        m.a[i, c] += s.fr[i, c]
                    else:
                        t.v[i, c] += s.fr[i, c]
            add(s.fn, 1.0, t.n)
            if change <= 1e-11 * size:
                break
        for i in range(1, nodes - 1):
            if second:
                m.a[i, 3] = t.spin[i, 0]
            else:
                t.v[i, 3] = t.spin[i, 0]
                for c in range(4):
                    m.v[i, c] = t.v[i, c]
        if second:
            copy(t.n, m.n)
    tangents(m.g, m.tangent)
    for i in range(nodes):
        # t' = w3 m2' - w2 m3', the second and third axis of the body
        turn = 0.0, t.known_spin[i, 2], -t.known_spin[i, 1]
        put_triple(carried(quaternion(m.g, i), turn), m.tangent_rate, i)
    return impulse
