"""The quasi-linear beam in motion: Newton on its stages."""

from __future__ import annotations

import numpy as np

from ribbonfem.jit.decorator import compiled
from ribbonfem.linalg.banded_lu import band_factor, band_solve, multiply
from ribbonfem.results import Array

from .arrays import NEWTON_LIMIT, Scratch, Tables


@compiled()
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


@compiled()
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
            k = i + 2
            for d in range(4):
                if i + d < n:
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


@compiled()
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


@compiled()
def _on_clamp(band: Array, x: Array) -> float:
    """The row of A x that belongs to the clamped slope, A a band as in `multiply`."""
    total = band[1, 0] * x[1] + band[0, 1] * x[0] + band[1, 1] * x[2]
    for d in range(2, band.shape[1]):
        total += band[1, d] * x[1 + d]
    return total


@compiled()
def measure_quasilinear(
    t: Tables, s: Scratch, q: Array, v: Array, a: Array, w: Array, nu: float
) -> tuple[float, float, float, float]:
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
    moment -= w[0] * _on_clamp(t.tension, q)
    moment += _on_clamp(t.mass, a)
    return kinetic, elastic, moment, w[0]
