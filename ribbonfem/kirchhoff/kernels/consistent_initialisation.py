"""Hidden constraints of the Kirchhoff rod: velocities, accelerations and forces that fit its clamp."""

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
from ribbonfem.jit.decorator import compiled
from ribbonfem.linalg.array_ops import add, copy
from ribbonfem.results import Array
from ribbonfem.stepping.kernels.arrays import Ramp

from .arrays import SIGMA, Motion, Scratch
from .batch import OPTIONS, WIDTH
from .condensed import factorise, solve
from .gauss_point import body, dot, interpolated, tangent_of
from .law import know_rates, put_strain_rates, put_strains
from .residual import residual
from .rod import P, Rod, Solver
from .tangent import STIFF, fill


@compiled(**OPTIONS)
def tangents(g: Array, tangent: Array) -> None:
    """Unit tangents (nodes, 3) of the frames."""
    for i in range(g.shape[0]):
        w, x, y, z = g[i, 0], g[i, 1], g[i, 2], g[i, 3]
        tangent[i, 0] = w * w + x * x - y * y - z * z
        tangent[i, 1] = 2.0 * (x * y + w * z)
        tangent[i, 2] = 2.0 * (x * z - w * y)


@compiled(**OPTIONS)
def _impulse_residual(
    rod: Rod, s: Solver, m: Motion, t: Scratch, old: Array, second: bool, ramp: Ramp
) -> None:
    """Residual of the hidden constraints, see `_project`; t.spin are the unknown rates of rotation.

    First: v = t.v against `old`, impulses t.n.  Second: a = m.a, rates of m.v and t.turning (the
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
                s.fp[i, 1] += factor * t.turning[i, 2]
                s.fp[i, 2] -= factor * t.turning[i, 1]
    else:
        for i in range(nodes):
            for c in range(3):
                s.fr[i, c] = rod.inertia[i, c] * (t.v[i, c] - old[i, c])
                s.fp[i, c] = 0.0
            s.fp[i, 0] = rod.inertia[i, 3] * (t.spin[i, 0] - old[i, 3])
    axial = STIFF if rod.compliance[0] > 0.0 else 0.0
    rates = m.a if second else t.v
    last = rod.weights.shape[0] - 1
    for place in range(WIDTH * rod.four.weights.shape[0]):
        # (places without an element repeat the last one's gaps, and add no forces)
        e, real = min(place, last), place <= last
        group, lane = place // WIDTH, place % WIDTH
        for k in range(P):
            q, _ = interpolated(rod.value, rod.slope, e, k, g, P)
            force = m.n[group, k, 0, lane], m.n[group, k, 1, lane], m.n[group, k, 2, lane]
            inverse, tangent = tangent_of(q)
            pull = dot(force, tangent)
            weight = rod.weights[e, k]
            stretch = 1.0 + rod.compliance[0] * pull
            if rod.retardation > 0.0:
                stretch = 1.0 + m.strain[group, k, 3, lane]
            # rates of the interpolated quaternion, by t.spin, and by t.turning alone twice
            d0 = d1 = d2 = d3 = 0.0
            u0 = u1 = u2 = u3 = w0 = w1 = w2 = w3 = 0.0
            for i in range(P + 1):
                node = e * P + i
                w, x, y, z = g[node, 0], g[node, 1], g[node, 2], g[node, 3]
                value = 0.5 * rod.value[k, i]
                a, b, c = t.spin[node, 0], t.spin[node, 1], t.spin[node, 2]
                d0 -= value * (x * a + y * b + z * c)
                d1 += value * (w * a + y * c - z * b)
                d2 += value * (w * b + z * a - x * c)
                d3 += value * (w * c + x * b - y * a)
                if second:
                    a, b, c = t.turning[node, 0], t.turning[node, 1], t.turning[node, 2]
                    u0 -= value * (x * a + y * b + z * c)
                    u1 += value * (w * a + y * c - z * b)
                    u2 += value * (w * b + z * a - x * c)
                    u3 += value * (w * c + x * b - y * a)
                    square = 0.5 * value * (a * a + b * b + c * c)
                    w0 -= square * w
                    w1 -= square * x
                    w2 -= square * y
                    w3 -= square * z
            q0, q1, q2, q3 = q
            tx, ty, tz = tangent
            # derivative of t along d
            along = 2.0 * inverse * (q0 * d0 + q1 * d1 + q2 * d2 + q3 * d3)
            rx = 2.0 * inverse * (q0 * d0 + q1 * d1 - q2 * d2 - q3 * d3) - along * tx
            ry = 2.0 * inverse * (q1 * d2 + d1 * q2 + q0 * d3 + d0 * q3) - along * ty
            rz = 2.0 * inverse * (q1 * d3 + d1 * q3 - q0 * d2 - d0 * q2) - along * tz
            hx = hy = hz = longer = 0.0
            if second:
                # t along u, and twice: t = U / S with U = q i q*, S = |q|^2
                along = 2.0 * inverse * (q0 * u0 + q1 * u1 + q2 * u2 + q3 * u3)
                fx = 2.0 * inverse * (q0 * u0 + q1 * u1 - q2 * u2 - q3 * u3) - along * tx
                fy = 2.0 * inverse * (q1 * u2 + u1 * q2 + q0 * u3 + u0 * q3) - along * ty
                fz = 2.0 * inverse * (q1 * u3 + u1 * q3 - q0 * u2 - u0 * q2) - along * tz
                curved = 2.0 * inverse * (u0 * u0 + u1 * u1 + u2 * u2 + u3 * u3)
                curved += 2.0 * inverse * (q0 * w0 + q1 * w1 + q2 * w2 + q3 * w3)
                hx = 2.0 * inverse * (u0 * u0 + u1 * u1 - u2 * u2 - u3 * u3)
                hx += 2.0 * inverse * (q0 * w0 + q1 * w1 - q2 * w2 - q3 * w3)
                hy = 4.0 * inverse * (u1 * u2 + u0 * u3)
                hy += 2.0 * inverse * (q1 * w2 + w1 * q2 + q0 * w3 + w0 * q3)
                hz = 4.0 * inverse * (u1 * u3 - u0 * u2)
                hz += 2.0 * inverse * (q1 * w3 + w1 * q3 - q0 * w2 - w0 * q2)
                hx -= curved * tx + 2.0 * along * fx
                hy -= curved * ty + 2.0 * along * fy
                hz -= curved * tz + 2.0 * along * fz
                for i in range(P + 1):
                    node, slope = e * P + i, rod.slope[e, k, i]
                    longer += slope * (m.v[node, 0] * tx + m.v[node, 1] * ty + m.v[node, 2] * tz)
                hx = stretch * hx + 2.0 * longer * fx
                hy = stretch * hy + 2.0 * longer * fy
                hz = stretch * hz + 2.0 * longer * fz
            held = 0.0
            if axial > 0.0:
                # the axial force of the stretched rod takes no impulse, and does not jump
                held = t.n[group, k, 0, lane] * tx + t.n[group, k, 1, lane] * ty + t.n[group, k, 2, lane] * tz
                if second:
                    tension = force[0] * tx + force[1] * ty + force[2] * tz
                    if rod.retardation > 0.0:
                        # (with its viscous part, which does jump)
                        tension = (stretch - 1.0 - rod.offset[group, k, 3, lane]) / rod.elastic[3]
                    held -= tension
                held *= weight * axial
            s.fn[group, k, 0, lane] = -weight * (stretch * rx + hx) - held * tx
            s.fn[group, k, 1, lane] = -weight * (stretch * ry + hy) - held * ty
            s.fn[group, k, 2, lane] = -weight * (stretch * rz + hz) - held * tz
            for i in range(P + 1):
                node, coupling = e * P + i, rod.coupling[e, k, i]
                for c in range(3):
                    s.fn[group, k, c, lane] += coupling * rates[node, c]
                    if real and not second:
                        s.fr[node, c] += coupling * t.n[group, k, c, lane]
            if real and not second:
                # -T^T of the impulse: the derivative of -n.t in q, as in `bend`
                n0, n1, n2 = t.n[group, k, 0, lane], t.n[group, k, 1, lane], t.n[group, k, 2, lane]
                v0 = -(n0 * q1 + n1 * q2 + n2 * q3)
                v1 = n0 * q0 + n1 * q3 - n2 * q2
                v2 = n1 * q0 + n2 * q1 - n0 * q3
                v3 = n2 * q0 + n0 * q2 - n1 * q1
                pull = n0 * tx + n1 * ty + n2 * tz
                factor = 2.0 * inverse * weight * stretch
                by_q = pull * q0 - v1, pull * q1 + v0, pull * q2 + v3, pull * q3 - v2
                for i in range(P + 1):
                    node = e * P + i
                    moment = body((g[node, 0], g[node, 1], g[node, 2], g[node, 3]), by_q)
                    s.fp[node, 0] += rod.value[k, i] * factor * moment[0]
                    s.fp[node, 1] += rod.value[k, i] * factor * moment[1]
                    s.fp[node, 2] += rod.value[k, i] * factor * moment[2]


@compiled(**OPTIONS)
def _impulse(s: Solver, ends: Ends, pose: Array) -> float:
    """On the control, of the impulses on both clamps in s: what the control's rate moves of them."""
    last, moved = s.fp.shape[0] - 1, ends.moved
    total = moved[TWIST_LEFT] * s.fp[0, 0] + moved[TWIST_RIGHT] * s.fp[last, 0]
    # the axes about which the clamps turn, in their bodies
    for side in range(2):
        node, by = last * side, moved[LEFT] if side == 0 else -moved[RIGHT]
        if by != 0.0:
            k = FRAME + 4 * side
            w, x, y, z = pose[k], pose[k + 1], pose[k + 2], pose[k + 3]
            total += by * 2.0 * (x * y + w * z) * s.fp[node, 0]
            total += by * (w * w - x * x + y * y - z * z) * s.fp[node, 1]
            total += by * 2.0 * (y * z - w * x) * s.fp[node, 2]
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
                    t.turning[i, c] = t.spin[i, c]
                t.spin[i, c] = 0.0
            for c in range(4):
                if not second:
                    t.v[i, c] = m.v[i, c]
        for c in range(3):
            m.v[nodes - 1, c], m.a[nodes - 1, c] = t.pose[SPEED + c], t.pose[CHANGE + c]
            t.v[nodes - 1, c] = t.pose[SPEED + c]
        if second and rod.retardation > 0.0:
            put_strains(rod, s, m.g, m.n, m.strain)
            put_strain_rates(rod, m.g, m.v, t.turning, t.force, m.strain_rate)
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
        w, x, y, z = m.g[i, 0], m.g[i, 1], m.g[i, 2], m.g[i, 3]
        # t' = w3 m2' - w2 m3', the second and third axis of the body
        b, c = t.turning[i, 2], -t.turning[i, 1]
        m.turning[i, 0] = 2.0 * (x * y - w * z) * b + 2.0 * (x * z + w * y) * c
        m.turning[i, 1] = (w * w - x * x + y * y - z * z) * b + 2.0 * (y * z - w * x) * c
        m.turning[i, 2] = 2.0 * (y * z + w * x) * b + (w * w - x * x - y * y + z * z) * c
    return impulse
