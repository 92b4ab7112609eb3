"""Compiled kernels of the Kirchhoff rod: gradient and Hessian of the Lagrangian, centreline, curvatures.

Frames are unit quaternions g = (w, x, y, z) of the rotation from the clamp's frame, so that

    m3 = t = G e_x,  m1 = G e_z (surface normal),  m2 = -G e_y (width);

the body components of 2 conj(g) g' are (tau, -kappa2, kappa1).  Inside an element g is
interpolated and normalised: rotating every node rotates the element, and with angular strains
taken from g / |g| itself nothing locks.  At a Gauss point the energy is a function of the
interpolated q and p = q' alone, and everything follows from its derivatives in these eight
numbers.
"""

from __future__ import annotations

import numpy as np

from ribbonfem.jit.algebra import Quaternion, Value, Vector, dot
from ribbonfem.jit.decorator import compiled
from ribbonfem.jit.simd import WIDTH, increase, load, spread, store
from ribbonfem.linalg.banded import Factorised, factors_of, solution
from ribbonfem.results import Array

from .batch import INLINED, force_at, gather
from .gauss_point import interpolated, interpolated_group, point_hessian, strains_of, stretched, tangent_of
from .rotation_hessian import (
    add_gradient,
    add_pairs,
    by_rotation,
    clear,
    fill_columns,
    pair_by_rotations,
    radial,
)


@compiled()
def frame_basis(g: Array, basis: Array) -> None:
    """Columns g i, g j, g k (nodes, 4, 3): an orthonormal basis of the tangent space at each node's g."""
    for n in range(g.shape[0]):
        w, x, y, z = g[n, 0], g[n, 1], g[n, 2], g[n, 3]
        basis[n, 0, 0], basis[n, 0, 1], basis[n, 0, 2] = -x, -y, -z
        basis[n, 1, 0], basis[n, 1, 1], basis[n, 1, 2] = w, -z, y
        basis[n, 2, 0], basis[n, 2, 1], basis[n, 2, 2] = z, w, -x
        basis[n, 3, 0], basis[n, 3, 1], basis[n, 3, 2] = -y, x, w


@compiled(**INLINED)
def _add_forces(n: Vector, t: Vector, tension: Value, compliance: float, weight: Value, sums: Array) -> None:
    """Add a point's (1 + c n.t) t to sums (9,), and its derivative in n, a triangle, behind it."""
    stretch, axial = weight * (1.0 + compliance * tension), weight * compliance
    increase(sums, (0,), stretch * t[0])
    increase(sums, (1,), stretch * t[1])
    increase(sums, (2,), stretch * t[2])
    increase(sums, (3,), axial * t[0] * t[0])
    increase(sums, (4,), axial * t[0] * t[1])
    increase(sums, (5,), axial * t[1] * t[1])
    increase(sums, (6,), axial * t[0] * t[2])
    increase(sums, (7,), axial * t[1] * t[2])
    increase(sums, (8,), axial * t[2] * t[2])


@compiled(**INLINED)
def _add_change(change: Quaternion, share: Value, i: int, b: int, by_force: Array) -> None:
    """Add a point's share of the derivative of a component b of r' in the quaternion of node i."""
    increase(by_force, (i, 4 * b), -share * change[0])
    increase(by_force, (i, 4 * b + 1), -share * change[1])
    increase(by_force, (i, 4 * b + 2), -share * change[2])
    increase(by_force, (i, 4 * b + 3), -share * change[3])


@compiled(**INLINED)
def _put_node(
    i: int, lane: int, a: int, gradient: Array, block: Array, border: Array, residual: Array
) -> None:
    """Put what a lane has of node i where the rod has it, at its inner node a."""
    for r in range(4):
        residual[4 * a + r] += gradient[i, r, lane]
    for b in range(3):
        for c in range(3):
            border[b, 3 * a + c] += block[3 * b + c, lane]


@compiled(**INLINED)
def _add_columns(
    pairs: Array,
    by_force: Array,
    sums: Array,
    clamp_rates: Array,
    push: Array,
    e: int,
    lane: int,
    elements: int,
    degree: int,
    column: Array,
) -> None:
    """Add an element's share of the residual's derivative in the parameter."""
    inner = elements * degree - 1
    if e == 0:
        # the first node turns with its clamp
        for i in range(1, degree + 1):
            for r in range(4):
                for c in range(4):
                    column[4 * (i - 1) + r] += pairs[i, 0, 4 * r + c, lane] * clamp_rates[0, c]
        for b in range(3):
            for r in range(4):
                column[4 * inner + b] += by_force[0, 4 * b + r, lane] * clamp_rates[0, r]
    if e == elements - 1:
        for j in range(degree):
            for c in range(4):
                for r in range(4):
                    column[4 * (e * degree + j - 1) + c] += (
                        pairs[degree, j, 4 * r + c, lane] * clamp_rates[1, r]
                    )
        for b in range(3):
            for r in range(4):
                column[4 * inner + b] += by_force[degree, 4 * b + r, lane] * clamp_rates[1, r]
    if 2 * e < elements and (push[0] != 0.0 or push[1] != 0.0 or push[2] != 0.0):
        for i in range(degree + 1):
            a = e * degree + i - 1
            if a >= 0:
                for b in range(3):
                    for r in range(4):
                        column[4 * a + r] += by_force[i, 4 * b + r, lane] * push[b]
        place = 3
        for b in range(3):
            for c in range(b + 1):
                column[4 * inner + b] -= sums[place, lane] * push[c]
                if c < b:
                    column[4 * inner + c] -= sums[place, lane] * push[b]
                place += 1


@compiled(allocates=True)
def _assemble(
    g: Array,
    force: Array,
    loads: Array,
    tables: tuple[Array, Array, Array],
    law: tuple[Array, float, Array],
    clamp_rates: Array,
    push: Array,
    filled: tuple[Array, Array, Array, Array, Array],
) -> None:
    """Residual and Riemannian Hessian of the Lagrangian of all frames but the two clamped ones.

    L = int f(q, q') ds + n.R, the force in f being n + loads; the caller adds R to the force rows of the
    residual, and its derivative to those of the column.

    Parameters
    ----------
    g: (nodes, 4) unit quaternions.  force: (3,), n at the right end, in EI2/L^2.
    loads, natural: (G, p, 3, WIDTH), see `problem.Statics`.
    tables: value, see `LineTables`; slope and weights, the same for groups (`batch`).
    law: stiffness (3,) of the body strains (tau, -kappa2, kappa1); compliance EI2/(EA L^2), or 0; natural.
    clamp_rates: (2, 4) derivatives of the first and the last node's quaternions in the parameter.
    push: (3,) derivative of the force at midspan, which the left half carries.
    filled: what is filled, m = nodes - 2: band (3 m, 3 (p + 1)), border (3, 3 m), corner (3, 3), whose
        degrees of freedom are the increments along `frame_basis`, half rotation vectors in the body;
        residual and column (4 m + 3,), the gradient and its derivative in the parameter, in quaternion
        components.
    """
    value, slope, weights = tables
    stiffness, compliance, natural = law
    band, border, corner, residual, column = filled
    groups, points, size = slope.shape[0], slope.shape[1], slope.shape[2]
    inner, degree = g.shape[0] - 2, size - 1
    elements = (inner + 1) // degree
    band[:] = 0.0
    border[:] = 0.0
    corner[:] = 0.0
    residual[:] = 0.0
    column[:] = 0.0
    frames, columns, gradient = (
        np.empty((size, 4, WIDTH)),
        np.empty((size, 12, WIDTH)),
        np.empty((size, 4, WIDTH)),
    )
    hess, of_q, of_p = np.empty((64, WIDTH)), np.empty((size, 16, WIDTH)), np.empty((size, 16, WIDTH))
    pairs, by_force, sums = (
        np.empty((size, size, 16, WIDTH)),
        np.empty((size, 12, WIDTH)),
        np.empty((9, WIDTH)),
    )
    block = np.empty((9, WIDTH))
    for group in range(groups):
        gather(g, group, elements - 1, degree, frames)
        fill_columns(frames, 1.0, columns, degree)
        for i in range(size):
            clear(pairs[i], i + 1, 16)
        clear(gradient, size, 4)
        clear(by_force, size, 12)
        for place in range(9):
            store(sums, (place,), spread(0.0))
        for k in range(points):
            q, p = interpolated_group(value, slope, group, k, frames, degree)
            weight = load(weights, (group, k))
            x, y, z = force_at(loads, group, k)
            n = force[0] + x, force[1] + y, force[2] + z
            offset = force_at(natural, group, k), spread(0.0)
            gq, gp, t, tension, dt = point_hessian(stiffness, compliance, offset, q, p, n, hess)
            _add_forces(n, t, tension, compliance, weight, sums)
            change = stretched(n, 1.0 + compliance * tension, compliance, t, dt)
            for i in range(size):
                add_gradient(value, k, i, load(slope, (group, k, i)), weight, (gq, gp), gradient)
                share = weight * value[k, i]
                _add_change(change[0], share, i, 0, by_force)
                _add_change(change[1], share, i, 1, by_force)
                _add_change(change[2], share, i, 2, by_force)
            add_pairs(value, slope, group, k, weight, hess, of_q, of_p, pairs, degree)
        used = min(WIDTH, elements - WIDTH * group)
        for lane in range(used):
            place = 3
            for b in range(3):
                residual[4 * inner + b] -= sums[b, lane]
                for c in range(b + 1):
                    corner[c, b] -= sums[place, lane]
                    place += 1
        for i in range(size):
            for b in range(3):
                pulled = (
                    load(by_force, (i, 4 * b)),
                    load(by_force, (i, 4 * b + 1)),
                    load(by_force, (i, 4 * b + 2)),
                    load(by_force, (i, 4 * b + 3)),
                )
                for c in range(3):
                    store(block, (3 * b + c,), by_rotation(pulled, columns, i, c))
            for lane in range(used):
                a = (WIDTH * group + lane) * degree + i - 1
                if 0 <= a < inner:
                    _put_node(i, lane, a, gradient, block, border, residual)
            for j in range(i + 1):
                for c in range(3):
                    x, y, z = pair_by_rotations(pairs, columns, i, j, c)
                    store(block, (3 * c,), x)
                    store(block, (3 * c + 1,), y)
                    store(block, (3 * c + 2,), z)
                if i == j:
                    # the increment is followed by a normalisation: its second-order term
                    along = radial(gradient, frames, i)
                    for c in range(3):
                        increase(block, (4 * c,), -along)
                for lane in range(used):
                    first = (WIDTH * group + lane) * degree - 1
                    if first + j >= 0 and first + i < inner:
                        for u in range(3):
                            for c in range(3 if i != j else u + 1):
                                band[3 * (first + j) + c, 3 * (i - j) + u - c] += block[3 * u + c, lane]
        for lane in range(used):
            e = WIDTH * group + lane
            _add_columns(pairs, by_force, sums, clamp_rates, push, e, lane, elements, degree, column)
    _keep_along_spheres(g, residual, column)


@compiled(**INLINED)
def _keep_along_spheres(g: Array, residual: Array, column: Array) -> None:
    """Take the components along the quaternions out of both: only those along the spheres count."""
    for a in range(g.shape[0] - 2):
        along = across = 0.0
        for r in range(4):
            along += residual[4 * a + r] * g[a + 1, r]
            across += column[4 * a + r] * g[a + 1, r]
        for r in range(4):
            residual[4 * a + r] -= along * g[a + 1, r]
            column[4 * a + r] -= across * g[a + 1, r]


@compiled(allocates=True)
def linearised(
    g: Array,
    force: Array,
    loads: Array,
    value: Array,
    slope: Array,
    weights: Array,
    stiffness: Array,
    compliance: float,
    natural: Array,
    clamp_rates: Array,
    push: Array,
) -> tuple[Array, Array, Array, Array, Array, Array, Array, Array, Array, Array, int]:
    """Of the arguments of `_assemble`: what it fills, and what `banded.factored` makes of the tangent.

    Residual and its change with the parameter; `frame_basis`, band, border and corner; factors.
    """
    inner, size = g.shape[0] - 2, slope.shape[2]
    basis = np.empty((inner + 2, 4, 3))
    frame_basis(g, basis)
    band, border, corner = np.empty((3 * inner, 3 * size)), np.empty((3, 3 * inner)), np.empty((3, 3))
    residual, column = np.empty(4 * inner + 3), np.empty(4 * inner + 3)
    tables, law = (value, slope, weights), (stiffness, compliance, natural)
    filled = band, border, corner, residual, column
    _assemble(g, force, loads, tables, law, clamp_rates, push, filled)
    factors, rows, last, reach, negative = factors_of(band, border, corner)
    return residual, column, basis, band, border, corner, factors, rows, last, reach, negative


@compiled(allocates=True)
def solved(basis: Array, parts: Factorised, right: Array) -> Array:
    """As `banded.solved`, of vectors (4 m + 3, k) of quaternions and the force."""
    along = np.empty((3 * (basis.shape[0] - 2) + 3, right.shape[1]))
    to_increments(basis, right, along)
    result = np.empty_like(right)
    to_quaternions(basis, solution(parts, along), result)
    return result


@compiled()
def to_increments(basis: Array, x: Array, y: Array) -> None:
    """Components (3 m + 3, k) along `basis` of quaternion vectors (4 m + 3, k) of the inner nodes."""
    inner = basis.shape[0] - 2
    for c in range(x.shape[1]):
        for a in range(inner):
            for s in range(3):
                total = 0.0
                for r in range(4):
                    total += basis[a + 1, r, s] * x[4 * a + r, c]
                y[3 * a + s, c] = total
        for b in range(3):
            y[3 * inner + b, c] = x[4 * inner + b, c]


@compiled()
def to_quaternions(basis: Array, y: Array, x: Array) -> None:
    """The reverse of `to_increments`."""
    inner = basis.shape[0] - 2
    for c in range(x.shape[1]):
        for a in range(inner):
            for r in range(4):
                total = 0.0
                for s in range(3):
                    total += basis[a + 1, r, s] * y[3 * a + s, c]
                x[4 * a + r, c] = total
        for b in range(3):
            x[4 * inner + b, c] = y[3 * inner + b, c]


@compiled(allocates=True)
def move(g: Array, increment: Array, clamped: Array) -> Array:
    """Frames (nodes, 4) after an increment (4 m + 3,) of the inner ones, normalised; the outer are told."""
    new = g.copy()
    last = g.shape[0] - 1
    for r in range(4):
        new[0, r], new[last, r] = clamped[0, r], clamped[1, r]
    for a in range(g.shape[0] - 2):
        square = 0.0
        for r in range(4):
            new[a + 1, r] += increment[4 * a + r]
            square += new[a + 1, r] ** 2
        factor = 1.0 / np.sqrt(square)
        for r in range(4):
            new[a + 1, r] *= factor
    return new


@compiled()
def strains(
    g: Array,
    force: Array,
    loads: Array,
    value: Array,
    slope: Array,
    compliance: float,
    curvature: Array,
    derivative: Array,
) -> None:
    """At the Gauss points (elements, p, 3): body strains (tau, -kappa2, kappa1), and r' = (1 + eps) t."""
    elements, points, size = slope.shape
    for e in range(elements):
        for k in range(points):
            n = force[0] + loads[e, k, 0], force[1] + loads[e, k, 1], force[2] + loads[e, k, 2]
            q, p = interpolated(value, slope, e, k, g, size - 1)
            inverse, t = tangent_of(q)
            strain = strains_of(inverse, q, p)
            stretch = 1.0 + compliance * dot(n, t)
            for a in range(3):
                curvature[e, k, a] = strain[a]
                derivative[e, k, a] = stretch * t[a]
