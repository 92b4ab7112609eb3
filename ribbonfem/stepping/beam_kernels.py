"""Compiled dynamics of both planar beams: tangents, banded solves, and the whole time loop.

Everything a time loop calls is in this one file, because numba's cache does not see a change in
another one.  Kernels see arrays only; `newmark` makes the arrays and says what they mean.

Unknowns.  `q` are the dofs that carry mass, `v` and `a` their velocity and acceleration, `w`
the others, which follow from the equilibrium at the same instant:

* elastica: q = (x dofs, z dofs), w = (phi dofs, n modes (elements, 2, p));
* quasi-linear: q = nodal (Z, Z'), w = (sigma^2,).

Every stage of every method solves the same equations, with q = qp + b a and v = vp + g a:

    M (a + nu v) + B(q, w)^T n = 0,   the balance of moments,   the constraints on q.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ribbonfem.compiled.decorator import compiled
from ribbonfem.results import Array

ELASTICA, QUASILINEAR = 0, 1
ONE_STAGE, DIRK = 0, 1
# what `run` returns
DONE, FULL, STUCK, GREW = 0, 1, 2, 3
# what `clock` holds
TIME, STEP, WORK, DISSIPATED, PHASE, KINK, STEPS, NEWTON = range(8)
REJECTED, ROWS, MOMENT, POWER, AFTER, LAST, LOWEST, PEAK, SIDE, CARRY = range(8, 18)
CLOCK_SIZE = 18
# columns of `rows`
ROW_SIZE = 8  # time, angle, height, kinetic, elastic, dissipated, work, load

NEWTON_LIMIT = 10
# part of the largest energy so far by which energy may grow without work: more is an unstable method
GROWTH = 0.25


class Tables(NamedTuple):
    """A beam as arrays; those of the other beam are empty.

    Elastica, per element and in the local order of scikit-fem (left hat, right hat, bubbles):
    `value` (E, p + 1, p) and `force` (E, p, p) at the Gauss points with weights `dx` (E, p),
    `bending`, `inertia` (E, p + 1, p + 1) and `coupling` int chi_i' N_k (E, p + 1, p), `dofs`
    (E, p + 1), `places` as `local_places`, `compliance` c.  Quasi-linear: symmetric bands
    [i, d] = A[i + d, i] of `stiffness`, `tension`, `mass` over all nodal values.  Both:
    `clamp`, d(clamped dof)/d(alpha); `middle_dof`, `middle_weight`, the combination of q that
    is the height at midspan.
    """

    kind: int
    clamp: float
    middle_dof: np.ndarray
    middle_weight: Array
    value: Array
    force: Array
    dx: Array
    bending: Array
    inertia: Array
    coupling: Array
    dofs: np.ndarray
    places: np.ndarray
    compliance: float
    stiffness: Array
    tension: Array
    mass: Array


class Scheme(NamedTuple):
    """Coefficients of a method, or its tableau; see `newmark.Method`.

    `power` is that of the step in the estimated error; the last row of `a` is the weights of the step.
    """

    kind: int
    power: float
    stages: int
    a: Array
    c: Array
    error: Array
    r0: float
    r1: float
    v0: float
    v1: float
    alpha_m: float
    alpha_f: float
    error0: float
    error1: float
    project: bool


class Ramp(NamedTuple):
    """The clamp's motion and the control of steps, in t* and rad."""

    rate: float
    stop: float
    turned: float  # when the clamp stops
    end: float
    damping: float
    fixed: float  # 0 if adaptive
    tolerance: float
    largest: float
    newton: float
    smallest: float
    snap: bool  # whether to end soon after the height changes sign
    departed: float  # from zero the height has to have been this far before it crosses it


class Scratch(NamedTuple):
    """Memory of the solvers, allocated once."""

    band: Array
    pivots: np.ndarray
    right: Array
    local: Array
    qp: Array
    vp: Array
    q: Array
    v: Array
    a: Array
    w: Array
    a2: Array
    v2: Array
    clamp: Array
    y: Array
    y2: Array
    stage_v: Array
    stage_a: Array


# --- banded LU with partial pivoting -------------------------------------------------------------


@compiled(error_model="numpy")
def band_factor(band: Array, pivots: np.ndarray, n: int, width: int) -> None:
    """Overwrite band[i, j - i + width] = A[i, j] (n, 3 width + 1) by its LU with row exchanges.

    The last `width` columns are the fill of the exchanges; they are zeroed here.
    """
    for i in range(n):
        for d in range(2 * width + 1, 3 * width + 1):
            band[i, d] = 0.0
    for k in range(n):
        last = min(n - 1, k + width)
        p, best = k, abs(band[k, width])
        for i in range(k + 1, last + 1):
            size = abs(band[i, k - i + width])
            if size > best:
                p, best = i, size
        pivots[k] = p
        right = min(n - 1, k + 2 * width)
        if p != k:
            shift = k - p
            for j in range(right - k + 1):
                keep = band[k, width + j]
                band[k, width + j] = band[p, width + shift + j]
                band[p, width + shift + j] = keep
        pivot = band[k, width]
        if pivot == 0.0:
            pivot = 1e-300
            band[k, width] = pivot
        inverse = 1.0 / pivot
        for i in range(k + 1, last + 1):
            start = k - i + width
            factor = band[i, start]
            if factor != 0.0:
                factor *= inverse
                band[i, start] = factor
                for j in range(1, right - k + 1):
                    band[i, start + j] -= factor * band[k, width + j]


@compiled(error_model="numpy")
def band_solve(band: Array, pivots: np.ndarray, n: int, width: int, x: Array) -> None:
    """Overwrite x (n,) by the solution, from the factors of `band_factor`."""
    for k in range(n):
        p = pivots[k]
        if p != k:
            keep = x[k]
            x[k] = x[p]
            x[p] = keep
        value = x[k]
        for i in range(k + 1, min(n, k + width + 1)):
            x[i] -= band[i, k - i + width] * value
    for k in range(n - 1, -1, -1):
        value = x[k]
        for j in range(1, min(n - 1 - k, 2 * width) + 1):
            value -= band[k, width + j] * x[k + j]
        x[k] = value / band[k, width]


# --- elastica ------------------------------------------------------------------------------------
#
# Local order of an element: phi, x, z of the left node; the mean of n (x, z); the bubbles of
# phi; phi, x, z of the right node; then what is eliminated inside the element: the bubbles of
# x and z, and the higher modes of n.  These pair up: a bubble of r' is a mode of n.  So the
# rows of the constraints are written where the columns of the bubbles are, and the other way
# round, and the eliminated block has int chi' N on its diagonal whatever the step and c.


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


@compiled(error_model="numpy")
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


@compiled(error_model="numpy")
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


@compiled(error_model="numpy")
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


@compiled(error_model="numpy")
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


@compiled(error_model="numpy")
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


@compiled(error_model="numpy")
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


@compiled(error_model="numpy")
def _clear(s: Scratch, n: int, width: int) -> None:
    for i in range(n):
        s.right[i] = 0.0
        for d in range(2 * width + 1):
            s.band[i, d] = 0.0


@compiled(error_model="numpy")
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
        _clear(s, n, width)
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


@compiled(error_model="numpy")
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
        _clear(s, n, width)
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


@compiled(error_model="numpy")
def measure_elastica(t: Tables, v: Array, w: Array, out: Array) -> None:
    """Kinetic energy, elastic energy, moment on the clamp and mean compressive force, in `out`."""
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
    out[0], out[1], out[2], out[3] = kinetic, elastic, moment, load


# --- quasi-linear beam ---------------------------------------------------------------------------


@compiled(error_model="numpy")
def multiply(band: Array, x: Array, y: Array) -> None:
    """y = A x for a symmetric band[i, d] = A[i + d, i]."""
    n, width = band.shape
    for i in range(n):
        y[i] = band[i, 0] * x[i]
    for d in range(1, width):
        for i in range(n - d):
            y[i + d] += band[i, d] * x[i]
            y[i] += band[i, d] * x[i + d]


@compiled(error_model="numpy")
def _bordered(s: Scratch, n: int, row: Array, right: Array, last: float) -> float:
    """Solve [[A, row], [row, 0]] (x, y) = (right, last); x in `right`, y returned.

    Mixed block elimination (W. Govaerts, SIAM 2000, section 3.6): sound also where A alone is
    singular, as it is at the load of Euler.
    """
    column = s.v2
    for i in range(n):
        column[i] = row[i]
    band_solve(s.band, s.pivots, n, 3, column)
    dot = along = 0.0
    for i in range(n):
        dot += column[i] * right[i]
        along += column[i] * row[i]
    first = (dot - last) / along
    for i in range(n):
        right[i] -= row[i] * first
    band_solve(s.band, s.pivots, n, 3, right)
    rest = last
    for i in range(n):
        rest -= row[i] * right[i]
    second = -rest / along
    for i in range(n):
        right[i] -= column[i] * second
    return first + second


@compiled(error_model="numpy")
def newton_quasilinear(
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
    size = q.shape[0]
    n = size - 4
    weight = 1.0 / b + nu * g / b
    row, right = s.y, s.right
    previous = 0.0
    for iteration in range(1, NEWTON_LIMIT + 1):
        load = w[0]
        for i in range(size):
            s.a2[i] = a[i] + nu * v[i]
        multiply(t.mass, s.a2, s.y2)
        for i in range(n):
            right[i] = -s.y2[i + 2]
        multiply(t.stiffness, q, s.y2)
        for i in range(n):
            right[i] -= s.y2[i + 2]
        multiply(t.tension, q, s.y2)
        length = 0.0
        for i in range(size):
            length += 0.5 * q[i] * s.y2[i]
        for i in range(n):
            right[i] += load * s.y2[i + 2]
            row[i] = -s.y2[i + 2]
        for i in range(n):
            for d in range(4):
                if i + d < n:
                    k = i + 2
                    entry = weight * t.mass[k, d] + t.stiffness[k, d] - load * t.tension[k, d]
                    s.band[i + d, 3 - d] = entry
                    s.band[i, 3 + d] = entry
        band_factor(s.band, s.pivots, n, 3)
        w[0] += _bordered(s, n, row, right, length - 1.0)
        biggest = 0.0
        for i in range(n):
            change = right[i]
            biggest = max(biggest, abs(change))
            q[i + 2] += change
            v[i + 2] += change * g / b
            a[i + 2] += change / b
        if not biggest < 1e3 or not np.isfinite(w[0]):
            return -iteration
        if biggest < tolerance or biggest**3 < tolerance * previous * previous:
            return iteration
        previous = biggest
    return -NEWTON_LIMIT


@compiled(error_model="numpy")
def project_quasilinear(
    t: Tables, s: Scratch, q: Array, v: Array, a: Array, w: Array, spin: float, nu: float
) -> float:
    """As `project_elastica`; the clamped slope carries mass, so that its jump moves its neighbours too."""
    size = q.shape[0]
    n = size - 4
    row, right = s.y, s.right
    multiply(t.tension, q, s.y2)
    for i in range(n):
        row[i] = -s.y2[i + 2]
        for d in range(4):
            if i + d < n:
                s.band[i + d, 3 - d] = t.mass[i + 2, d]
                s.band[i, 3 + d] = t.mass[i + 2, d]
    stretch = s.y2[1]
    band_factor(s.band, s.pivots, n, 3)
    # velocity: M dv - G Z dL = 0 on the free dofs, Z^T G (v + dv) = 0
    jump = spin - v[1]
    for i in range(n):
        right[i] = -t.mass[1, i + 1] * jump if i < 2 else 0.0
    off = stretch * spin
    for i in range(n):
        off -= row[i] * v[i + 2]
    pulse = _bordered(s, n, row, right, off)
    impulse = t.mass[1, 0] * jump - stretch * pulse
    v[1] = spin
    for i in range(n):
        if i < 2:
            impulse += t.mass[1, i + 1] * right[i]
        v[i + 2] += right[i]
    # acceleration: M a + nu M v + K Z - sigma^2 G Z = 0, Z^T G a + v^T G v = 0
    for i in range(size):
        s.a2[i] = nu * v[i]
    multiply(t.mass, s.a2, s.y2)
    for i in range(n):
        right[i] = -s.y2[i + 2]
    multiply(t.stiffness, q, s.y2)
    for i in range(n):
        right[i] -= s.y2[i + 2]
    multiply(t.tension, v, s.y2)
    speed = 0.0
    for i in range(size):
        speed += v[i] * s.y2[i]
    w[0] = _bordered(s, n, row, right, speed)
    for i in range(size):
        a[i] = 0.0
    for i in range(n):
        a[i + 2] = right[i]
    return impulse


@compiled(error_model="numpy")
def measure_quasilinear(
    t: Tables, s: Scratch, q: Array, v: Array, a: Array, w: Array, nu: float, out: Array
) -> None:
    """As `measure_elastica`, in rescaled units."""
    size = q.shape[0]
    multiply(t.mass, v, s.y2)
    kinetic = elastic = 0.0
    for i in range(size):
        kinetic += 0.5 * v[i] * s.y2[i]
    moment = nu * s.y2[1]
    multiply(t.stiffness, q, s.y2)
    for i in range(size):
        elastic += 0.5 * q[i] * s.y2[i]
    moment += s.y2[1]
    multiply(t.tension, q, s.y2)
    moment -= w[0] * s.y2[1]
    multiply(t.mass, a, s.y2)
    moment += s.y2[1]
    out[0], out[1], out[2], out[3] = kinetic, elastic, moment, w[0]


# --- stepping ------------------------------------------------------------------------------------


@compiled(error_model="numpy")
def _solve(
    t: Tables, s: Scratch, b: float, g: float, angle: float, spin: float, nu: float, tolerance: float
) -> int:
    """Solve a stage from the predictors s.qp, s.vp and the guesses s.a, s.w, into s.q, s.v, s.a, s.w."""
    if t.kind == QUASILINEAR:
        s.a[1] = 0.0
        s.qp[1] = t.clamp * angle
        s.vp[1] = t.clamp * spin
    else:
        s.w[0] = t.clamp * angle
    for i in range(s.q.shape[0]):
        s.q[i] = s.qp[i] + b * s.a[i]
        s.v[i] = s.vp[i] + g * s.a[i]
    if t.kind == QUASILINEAR:
        return newton_quasilinear(t, s, s.q, s.v, s.a, s.w, b, g, nu, tolerance)
    return newton_elastica(t, s, s.q, s.v, s.a, s.w, b, g, nu, tolerance)


@compiled(error_model="numpy")
def _project(t: Tables, s: Scratch, q: Array, v: Array, a: Array, w: Array, spin: float, nu: float) -> float:
    if t.kind == QUASILINEAR:
        return project_quasilinear(t, s, q, v, a, w, t.clamp * spin, nu)
    return project_elastica(t, s, q, v, a, w, t.clamp * spin, nu)


@compiled(error_model="numpy")
def _measure(t: Tables, s: Scratch, q: Array, v: Array, a: Array, w: Array, nu: float, out: Array) -> None:
    if t.kind == QUASILINEAR:
        measure_quasilinear(t, s, q, v, a, w, nu, out)
    else:
        measure_elastica(t, v, w, out)


@compiled(error_model="numpy")
def _next_step(ramp: Ramp, clock: Array, rest: float, nominal: float) -> float:
    """The next step: never past the end of the phase, and no sliver of a step left before it."""
    h = clock[STEP]
    if ramp.fixed > 0.0:
        h = min(h, nominal)
        return rest if rest <= h * (1.0 + 1e-6) else h
    if clock[PHASE] == 0.0:
        # of a turn alone: after a tiny one a long hold would never end
        h = min(h, ramp.largest)
    if rest <= 1.001 * h:
        return rest
    return 0.5 * rest if rest < 2.0 * h else h


@compiled(error_model="numpy")
def run(
    t: Tables,
    m: Scheme,
    ramp: Ramp,
    s: Scratch,
    clock: Array,
    q: Array,
    v: Array,
    a: Array,
    auxiliary: Array,
    w: Array,
    dw: Array,
    rows: Array,
    row_q: Array,
    row_w: Array,
) -> int:
    """Step until the end, until the rows are full (call again with more), or until no step converges.

    State is in `clock` and the arrays from q to dw (the last the rate of w), in and out, so
    that a resumed run is bitwise the uninterrupted one.
    """
    nu = ramp.damping
    out = np.empty(4)
    last = m.stages - 1
    share = (1.0 - m.alpha_f) / (1.0 - m.alpha_m)
    while True:
        phase = int(clock[PHASE])
        start = 0.0 if phase == 0 else ramp.turned
        end = ramp.turned if phase == 0 else ramp.end
        spin = ramp.rate if phase == 0 else 0.0
        if int(clock[ROWS]) >= rows.shape[0]:
            return FULL
        if clock[KINK] > 0.0:
            # the clamp's velocity jumps: velocities and forces that fit the new one
            before = 0.0 if phase == 0 else ramp.rate
            impulse = _project(t, s, q, v, a, w, spin, nu)
            clock[WORK] += 0.5 * (before + spin) * t.clamp * impulse
            for i in range(q.shape[0]):
                auxiliary[i] = a[i]
            for i in range(w.shape[0]):
                dw[i] = 0.0
            _measure(t, s, q, v, a, w, nu, out)
            clock[POWER] = 2.0 * nu * out[0]
            clock[MOMENT] = out[2]
            if clock[STEPS] == 0.0:
                _record(t, ramp, clock, 0.0 if phase == 0 else ramp.stop, q, w, out, rows, row_q, row_w)
                clock[LOWEST] = clock[PEAK] = out[0] + out[1] - clock[WORK]
                if phase == 0:
                    rows[0, 3] = 0.0  # the row is of the instant before the jump
            clock[KINK] = 0.0
            clock[STEP] = ramp.fixed if ramp.fixed > 0.0 else min(1e-3, 1e-2 * (end - start))
            clock[LAST] = 0.0
            continue
        nominal = 0.0
        if ramp.fixed > 0.0:
            # at least one step, of however long a one is asked for
            nominal = (end - start) / max(1.0, np.ceil((end - start) / ramp.fixed - 1e-9))
        time = clock[TIME]
        rest = end - time
        h = _next_step(ramp, clock, rest, nominal)
        landed = h == rest
        target = end if landed else time + h
        angle0 = ramp.rate * time if phase == 0 else ramp.stop
        angle = ramp.stop if (phase == 1 or landed) else ramp.rate * target
        if m.kind == ONE_STAGE:
            if clock[LAST] > 0.0 and h != clock[LAST]:
                # the auxiliary acceleration is that of an instant in proportion to the step
                for i in range(q.shape[0]):
                    auxiliary[i] = a[i] + (auxiliary[i] - a[i]) * (h / clock[LAST])
            clock[LAST] = h
        else:
            for i in range(q.shape[0]):
                s.stage_v[0, i] = v[i]
                s.stage_a[0, i] = a[i]
        work, lost = m.a[last, 0] * clock[MOMENT], m.a[last, 0] * clock[POWER]
        # one place where stages are solved: the compiler copies the whole solver to each
        iterations = 0
        for stage in range(1, m.stages):
            reached = angle if stage == last else angle0 + spin * m.c[stage] * h
            if m.kind == ONE_STAGE:
                b, g = m.r1 * h * h * share, m.v1 * h * share
                for i in range(q.shape[0]):
                    known = (m.alpha_f * a[i] - m.alpha_m * auxiliary[i]) / (1.0 - m.alpha_m)
                    s.qp[i] = q[i] + h * v[i] + h * h * (m.r0 * auxiliary[i] + m.r1 * known)
                    s.vp[i] = v[i] + h * (m.v0 * auxiliary[i] + m.v1 * known)
            else:
                g = m.a[stage, stage] * h
                b = g * g
                for i in range(q.shape[0]):
                    velocity, place = v[i], q[i]
                    for j in range(stage):
                        velocity += h * m.a[stage, j] * s.stage_a[j, i]
                        place += h * m.a[stage, j] * s.stage_v[j, i]
                    s.vp[i] = velocity
                    s.qp[i] = place + g * velocity
            # guesses: on the line through the last two instants known
            if stage == 1:
                for i in range(q.shape[0]):
                    s.a[i] = a[i]
                for i in range(w.shape[0]):
                    s.w[i] = w[i] + m.c[1] * h * dw[i]
            else:
                for i in range(w.shape[0]):
                    s.w[i] = w[i] + (s.w[i] - w[i]) * (m.c[stage] / m.c[stage - 1])
            used = _solve(t, s, b, g, reached, spin, nu, ramp.newton)
            if used < 0:
                iterations = used - iterations
                break
            iterations += used
            if m.kind == DIRK:
                for i in range(q.shape[0]):
                    s.stage_v[stage, i] = s.v[i]
                    s.stage_a[stage, i] = s.a[i]
                if stage < last:
                    _measure(t, s, s.q, s.v, s.a, s.w, nu, out)
                    work += m.a[last, stage] * out[2]
                    lost += m.a[last, stage] * 2.0 * nu * out[0]
        error = 0.0
        if iterations > 0:
            for i in range(q.shape[0]):
                if m.kind == ONE_STAGE:
                    known = (m.alpha_f * a[i] - m.alpha_m * auxiliary[i]) / (1.0 - m.alpha_m)
                    s.a2[i] = share * s.a[i] + known
                    change = h * h * (m.error0 * auxiliary[i] + m.error1 * s.a2[i])
                else:
                    change = 0.0
                    for j in range(m.stages):
                        change += m.error[j] * s.stage_v[j, i]
                    change *= h
                error = max(error, abs(change))
        clock[NEWTON] += abs(iterations)
        if iterations < 0:
            clock[REJECTED] += 1.0
            clock[STEP] = 0.5 * h
            if clock[STEP] < ramp.smallest:
                return STUCK
            continue
        factor = 2.0
        if ramp.fixed == 0.0:
            factor = min(2.0, 0.8 * (ramp.tolerance / max(error, 1e-300)) ** (1.0 / m.power))
            if error > ramp.tolerance:
                clock[REJECTED] += 1.0
                clock[STEP] = h * max(0.2, factor)
                if clock[STEP] < ramp.smallest:
                    return STUCK
                continue
            factor = max(0.2, factor)
        for i in range(q.shape[0]):
            if m.kind == ONE_STAGE:
                auxiliary[i] = s.a2[i]
            q[i] = s.q[i]
            v[i] = s.v[i]
            a[i] = s.a[i]
        for i in range(w.shape[0]):
            dw[i] = (s.w[i] - w[i]) / h
            w[i] = s.w[i]
        if m.project:
            _project(t, s, q, v, a, w, spin, nu)
            for i in range(q.shape[0]):
                auxiliary[i] = a[i]
        _measure(t, s, q, v, a, w, nu, out)
        power, moment = 2.0 * nu * out[0], out[2]
        turn = t.clamp * (angle - angle0)
        if m.kind == ONE_STAGE:
            clock[DISSIPATED] += 0.5 * h * (clock[POWER] + power)
            clock[WORK] += 0.5 * turn * (clock[MOMENT] + moment)
        else:
            clock[DISSIPATED] += h * (lost + m.a[last, last] * power)
            clock[WORK] += turn * (work + m.a[last, last] * moment)
        clock[POWER], clock[MOMENT] = power, moment
        # what rounding leaves of the sum of many equal steps is carried on: they are to land on the end
        clock[TIME] = target if landed else time + (h + clock[CARRY])
        clock[CARRY] = 0.0 if landed else (h + clock[CARRY]) - (clock[TIME] - time)
        clock[STEPS] += 1.0
        if not landed or ramp.fixed > 0.0:
            clock[STEP] = h * factor
        else:
            clock[STEP] = max(clock[STEP], h * factor)
        row = int(clock[ROWS])
        _record(t, ramp, clock, angle, q, w, out, rows, row_q, row_w)
        total = out[0] + out[1]
        excess = total + clock[DISSIPATED] - clock[WORK]
        clock[LOWEST] = min(clock[LOWEST], excess)
        clock[PEAK] = max(clock[PEAK], total)
        if excess - clock[LOWEST] > GROWTH * clock[PEAK]:
            return GREW
        if clock[SIDE] == 0.0 and abs(rows[row, 2]) > ramp.departed:
            clock[SIDE] = rows[row, 2]
        if ramp.snap and (clock[AFTER] > 0.0 or (rows[row, 2] * clock[SIDE] <= 0.0 and clock[SIDE] != 0.0)):
            clock[AFTER] += 1.0
            # the crossing is interpolated from two rows on each side
            if clock[AFTER] > 2.0:
                return DONE
        if landed:
            if phase == 1 or ramp.end <= ramp.turned:
                return DONE
            clock[PHASE] = 1.0
            clock[KINK] = 1.0


@compiled(error_model="numpy")
def _record(
    t: Tables,
    ramp: Ramp,
    clock: Array,
    angle: float,
    q: Array,
    w: Array,
    out: Array,
    rows: Array,
    row_q: Array,
    row_w: Array,
) -> None:
    row = int(clock[ROWS])
    height = 0.0
    for k in range(t.middle_dof.shape[0]):
        height += t.middle_weight[k] * q[t.middle_dof[k]]
    rows[row, 0] = clock[TIME]
    rows[row, 1] = angle
    rows[row, 2] = height
    rows[row, 3] = out[0]
    rows[row, 4] = out[1]
    rows[row, 5] = clock[DISSIPATED]
    rows[row, 6] = clock[WORK]
    rows[row, 7] = out[3]
    for i in range(q.shape[0]):
        row_q[row, i] = q[i]
    for i in range(w.shape[0]):
        row_w[row, i] = w[i]
    clock[ROWS] = row + 1.0
