"""Elements of the elastica in motion, and Newton on its stages.

Local order of an element: phi, x, z of the left node; the mean of n (x, z); the bubbles of
phi; phi, x, z of the right node; then what is eliminated inside the element: the bubbles of
x and z, and the higher modes of n.  These pair up: a bubble of r' is a mode of n.  So the
rows of the constraints are written where the columns of the bubbles are, and the other way
round, and the eliminated block has int chi' N on its diagonal whatever the step and c.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ribbonfem.jit.decorator import compiled
from ribbonfem.linalg.banded_lu import band_factor, band_solve
from ribbonfem.results import Array

from .arrays import NEWTON_LIMIT, Scratch, Tables, clear


def local_places(p: int) -> NDArray[np.int64]:
    """Local columns (5, p + 1) of phi, x, z and the modes of n (x, z); the last two rows have p entries."""
    bubbles, outer = np.arange(p - 1), p + 7
    places = np.zeros((5, p + 1), dtype=np.int64)
    for row, hats in enumerate(((0, p + 4), (1, p + 5), (2, p + 6))):
        places[row, :2] = hats
    places[3:, 0] = 3, 4
    places[0, 2:] = 5 + bubbles
    places[1, 2:] = outer + bubbles
    places[2, 2:] = outer + (p - 1) + bubbles
    places[3, 1:p] = outer + 2 * (p - 1) + bubbles
    places[4, 1:p] = outer + 3 * (p - 1) + bubbles
    return places


@compiled()
def element_elastica(
    t: Tables, e: int, local: Array, q: Array, v: Array, a: Array, w: Array, b: float, g: float, nu: float
) -> None:
    """Tangent and residual (last column) of one element in `local`, rows in the order of the unknowns."""
    p = t.dx.shape[1]
    c = t.compliance
    size = 5 * p + 3
    half = q.shape[0] // 2
    count = half
    base = count + e * 2 * p
    phi, x, z, nx, nz = t.places[0], t.places[1], t.places[2], t.places[3], t.places[4]
    for i in range(size):
        for j in range(size + 1):
            local[i, j] = 0.0
    weight = 1.0 / b + nu * g / b
    for i in range(p + 1):
        rx = rz = rm = 0.0
        for j in range(p + 1):
            dof = t.dofs[e, j]
            m = t.inertia[e, i, j]
            rx += m * (a[dof] + nu * v[dof])
            rz += m * (a[half + dof] + nu * v[half + dof])
            local[x[i], x[j]] = m * weight
            local[z[i], z[j]] = m * weight
            k = t.bending[e, i, j]
            rm += k * w[dof]
            local[phi[i], phi[j]] = k
        for k in range(p):
            d = t.coupling[e, i, k]
            if d != 0.0:
                rx += d * w[base + k]
                rz += d * w[base + p + k]
                local[x[i], nx[k]] = d
                local[nx[k], x[i]] = d
                local[z[i], nz[k]] = d
                local[nz[k], z[i]] = d
                dof = t.dofs[e, i]
                local[nx[k], size] += d * q[dof]
                local[nz[k], size] += d * q[half + dof]
        local[x[i], size] = rx
        local[z[i], size] = rz
        local[phi[i], size] = rm
    for s in range(p):
        angle = fx = fz = 0.0
        for i in range(p + 1):
            angle += t.value[e, i, s] * w[t.dofs[e, i]]
        for k in range(p):
            fx += t.force[e, k, s] * w[base + k]
            fz += t.force[e, k, s] * w[base + p + k]
        cos, sin = np.cos(angle), np.sin(angle)
        along = fx * cos + fz * sin
        across = fz * cos - fx * sin
        stretch = 1.0 + c * along
        dx = t.dx[e, s]
        curvature = dx * (along * stretch - c * across * across)
        shear_x = dx * (-sin * stretch + c * across * cos)
        shear_z = dx * (cos * stretch + c * across * sin)
        moment = dx * across * stretch
        for i in range(p + 1):
            chi = t.value[e, i, s]
            local[phi[i], size] -= chi * moment
            for j in range(p + 1):
                local[phi[i], phi[j]] += chi * t.value[e, j, s] * curvature
            for k in range(p):
                fx = chi * t.force[e, k, s]
                local[phi[i], nx[k]] -= fx * shear_x
                local[phi[i], nz[k]] -= fx * shear_z
                local[nx[k], phi[i]] -= fx * shear_x
                local[nz[k], phi[i]] -= fx * shear_z
        for k in range(p):
            mode = t.force[e, k, s] * dx
            local[nx[k], size] -= mode * cos * stretch
            local[nz[k], size] -= mode * sin * stretch
            if c != 0.0:
                for l in range(p):
                    both = -c * mode * t.force[e, l, s]
                    local[nx[k], nx[l]] += both * cos * cos
                    local[nx[k], nz[l]] += both * cos * sin
                    local[nz[k], nx[l]] += both * cos * sin
                    local[nz[k], nz[l]] += both * sin * sin


@compiled()
def element_projection(
    t: Tables, e: int, local: Array, q: Array, rate: Array, w: Array, dw: Array, dead: Array, second: bool
) -> None:
    """The system of the hidden constraints of the inextensible elastica, one element.

    First (`second` False): the velocity nearest to `rate` in the kinetic energy that keeps the
    length; unknowns are the change of velocity, phi_t and the impulse.  Then: acceleration,
    phi_tt and force from the balance of momentum and moments and the constraints derived twice;
    `rate` is the acceleration's guess, `dead` (as q) the force nu v that it balances, `dw` phi_t.
    """
    p = t.dx.shape[1]
    size = 5 * p + 3
    half = q.shape[0] // 2
    base = half + e * 2 * p
    phi, x, z, nx, nz = t.places[0], t.places[1], t.places[2], t.places[3], t.places[4]
    for i in range(size):
        for j in range(size + 1):
            local[i, j] = 0.0
    for i in range(p + 1):
        rx = rz = rm = 0.0
        for j in range(p + 1):
            dof = t.dofs[e, j]
            m = t.inertia[e, i, j]
            local[x[i], x[j]] = m
            local[z[i], z[j]] = m
            if second:
                rx += m * (rate[dof] + dead[dof])
                rz += m * (rate[half + dof] + dead[half + dof])
                rm += t.bending[e, i, j] * w[dof]
        for k in range(p):
            d = t.coupling[e, i, k]
            if d != 0.0:
                if second:
                    rx += d * w[base + k]
                    rz += d * w[base + p + k]
                local[x[i], nx[k]] = d
                local[nx[k], x[i]] = d
                local[z[i], nz[k]] = d
                local[nz[k], z[i]] = d
                dof = t.dofs[e, i]
                local[nx[k], size] += d * rate[dof]
                local[nz[k], size] += d * rate[half + dof]
        local[x[i], size] = rx
        local[z[i], size] = rz
        local[phi[i], size] = rm
    for s in range(p):
        angle = spin = fx = fz = 0.0
        for i in range(p + 1):
            angle += t.value[e, i, s] * w[t.dofs[e, i]]
            spin += t.value[e, i, s] * dw[t.dofs[e, i]]
        for k in range(p):
            fx += t.force[e, k, s] * w[base + k]
            fz += t.force[e, k, s] * w[base + p + k]
        cos, sin = np.cos(angle), np.sin(angle)
        dx = t.dx[e, s]
        across = fz * cos - fx * sin
        # the derivative of t by time, once; or what phi_t alone leaves of it, twice
        turn_x = -spin * spin * cos if second else -spin * sin
        turn_z = -spin * spin * sin if second else spin * cos
        for i in range(p + 1):
            chi = t.value[e, i, s] * dx
            if second:
                local[phi[i], size] -= chi * across
            for k in range(p):
                share = chi * t.force[e, k, s]
                local[phi[i], nx[k]] += share * sin
                local[phi[i], nz[k]] -= share * cos
                local[nx[k], phi[i]] += share * sin
                local[nz[k], phi[i]] -= share * cos
        for k in range(p):
            mode = t.force[e, k, s] * dx
            local[nx[k], size] -= mode * turn_x
            local[nz[k], size] -= mode * turn_z


@compiled()
def condense(local: Array, p: int) -> None:
    """Eliminate the inner unknowns of an element; rows of bubbles and modes of n change places first."""
    size, outer, pairs = 5 * p + 3, p + 7, 2 * (p - 1)
    for i in range(pairs):
        for j in range(size + 1):
            keep = local[outer + i, j]
            local[outer + i, j] = local[outer + pairs + i, j]
            local[outer + pairs + i, j] = keep
    for k in range(size - 1, outer - 1, -1):
        inverse = 1.0 / local[k, k]
        right = local[k, size]
        for i in range(k):
            factor = local[i, k]
            if factor != 0.0:
                factor *= inverse
                for j in range(k):
                    local[i, j] -= factor * local[k, j]
                local[i, size] -= factor * right


@compiled()
def scatter(local: Array, p: int, e: int, elements: int, band: Array, right: Array) -> None:
    """Add a condensed element to the global band; the clamped dofs are left out."""
    outer, stride, width = p + 7, p + 4, p + 6
    start = e * stride - 3
    count = elements * stride - 3
    size = 5 * p + 3
    for i in range(outer):
        row = start + i
        if 0 <= row < count:
            right[row] -= local[i, size]
            for j in range(outer):
                column = start + j
                if 0 <= column < count:
                    band[row, column - row + width] += local[i, j]


@compiled()
def expand(local: Array, p: int, e: int, elements: int, x: Array, y: Array) -> None:
    """Increments y (5 p + 3,) of an element's unknowns from the global solution x."""
    outer, stride = p + 7, p + 4
    start = e * stride - 3
    count = elements * stride - 3
    size = 5 * p + 3
    for i in range(outer):
        row = start + i
        y[i] = x[row] if 0 <= row < count else 0.0
    # rows were eliminated from the last: each depends on those before it only
    for k in range(outer, size):
        value = -local[k, size]
        for j in range(k):
            value -= local[k, j] * y[j]
        y[k] = value / local[k, k]


@compiled()
def _collect(t: Tables, s: Scratch, dq: Array, dw: Array) -> None:
    """Solve the assembled and condensed system of the elastica; increments of q and w in dq, dw."""
    elements, p = t.dx.shape
    half = elements * p + 1
    n, width = elements * (p + 4) - 3, p + 6
    band_factor(s.band, s.pivots, n, width)
    band_solve(s.band, s.pivots, n, width, s.right)
    phi, x, z, nx, nz = t.places[0], t.places[1], t.places[2], t.places[3], t.places[4]
    y = s.v2
    for e in range(elements):
        expand(s.local[e], p, e, elements, s.right, y)
        for i in range(p + 1):
            dof = t.dofs[e, i]
            dw[dof] = y[phi[i]]
            dq[dof] = y[x[i]]
            dq[half + dof] = y[z[i]]
        base = half + e * 2 * p
        for k in range(p):
            dw[base + k] = y[nx[k]]
            dw[base + p + k] = y[nz[k]]


@compiled()
def newton_elastica(
    t: Tables,
    s: Scratch,
    q: Array,
    v: Array,
    a: Array,
    w: Array,
    b: float,
    g: float,
    nu: float,
    tolerance: float,
) -> int:
    """Solve one stage by Newton from the guess (a, w); return the iterations, or minus them on failure."""
    elements, p = t.dx.shape
    n, width = elements * (p + 4) - 3, p + 6
    half = q.shape[0] // 2
    previous = 0.0
    for iteration in range(1, NEWTON_LIMIT + 1):
        clear(s, n, width)
        for e in range(elements):
            element_elastica(t, e, s.local[e], q, v, a, w, b, g, nu)
            condense(s.local[e], p)
            scatter(s.local[e], p, e, elements, s.band, s.right)
        _collect(t, s, s.y, s.y2)
        size = 0.0
        for i in range(q.shape[0]):
            change = s.y[i]
            size = max(size, abs(change))
            q[i] += change
            v[i] += change * g / b
            a[i] += change / b
        for i in range(w.shape[0]):
            if i < half:
                size = max(size, abs(s.y2[i]))
            w[i] += s.y2[i]
        # max() may hide a NaN: look at the sum of what was added too
        if not size < 2.0 or not np.isfinite(s.y2.sum()):
            return -iteration
        if size < tolerance or size**3 < tolerance * previous * previous:
            return iteration
        previous = size
    return -NEWTON_LIMIT


@compiled()
def project_elastica(
    t: Tables, s: Scratch, q: Array, v: Array, a: Array, w: Array, spin: float, nu: float
) -> float:
    """Put v, a and n onto the hidden constraints; return the impulse on the clamp (a moment).

    Nothing is hidden where the beam stretches: v is then free to be what it is.
    """
    if t.compliance != 0.0:
        return 0.0
    elements, p = t.dx.shape
    n, width = elements * (p + 4) - 3, p + 6
    half = q.shape[0] // 2
    impulse = 0.0
    dphi = s.w
    for i in range(w.shape[0]):
        dphi[i] = 0.0
    dphi[0] = spin
    for second in (False, True):
        clear(s, n, width)
        for i in range(q.shape[0]):
            s.a2[i] = nu * v[i]
        for e in range(elements):
            element_projection(t, e, s.local[e], q, a if second else v, w, dphi, s.a2, second)
            if e == 0 and not second:
                for i in range(5 * p + 3):
                    s.clamp[i] = s.local[e, 0, i]
            condense(s.local[e], p)
            scatter(s.local[e], p, e, elements, s.band, s.right)
        _collect(t, s, s.y, s.y2)
        if second:
            for i in range(q.shape[0]):
                a[i] += s.y[i]
            for i in range(half, w.shape[0]):
                w[i] += s.y2[i]
        else:
            expand(s.local[0], p, 0, elements, s.right, s.v2)
            for i in range(5 * p + 3):
                impulse += s.clamp[i] * s.v2[i]
            for i in range(q.shape[0]):
                v[i] += s.y[i]
            for i in range(half):
                dphi[i] += s.y2[i]
    return impulse


@compiled()
def measure_elastica(t: Tables, v: Array, w: Array) -> tuple[float, float, float, float]:
    """Kinetic energy, elastic energy, moment on the clamp and mean compressive force."""
    elements, p = t.dx.shape
    half = v.shape[0] // 2
    c = t.compliance
    kinetic = elastic = moment = load = 0.0
    for e in range(elements):
        base = half + e * 2 * p
        for i in range(p + 1):
            di = t.dofs[e, i]
            for j in range(p + 1):
                dj = t.dofs[e, j]
                kinetic += 0.5 * t.inertia[e, i, j] * (v[di] * v[dj] + v[half + di] * v[half + dj])
                elastic += 0.5 * t.bending[e, i, j] * w[di] * w[dj]
                if di == 0:
                    moment += t.bending[e, i, j] * w[dj]
        for s in range(p):
            angle = fx = fz = 0.0
            for i in range(p + 1):
                angle += t.value[e, i, s] * w[t.dofs[e, i]]
            for k in range(p):
                fx += t.force[e, k, s] * w[base + k]
                fz += t.force[e, k, s] * w[base + p + k]
            cos, sin = np.cos(angle), np.sin(angle)
            along = fx * cos + fz * sin
            elastic += 0.5 * c * along * along * t.dx[e, s]
            load -= fx * t.dx[e, s]
            if e == 0:
                moment -= t.value[e, 0, s] * t.dx[e, s] * (fz * cos - fx * sin) * (1.0 + c * along)
    return kinetic, elastic, moment, load
