"""Residual and factorised tangent of the elastica at rest, in all angles and the end force."""

from __future__ import annotations

import math

import numpy as np

from ribbonfem.jit.decorator import compiled
from ribbonfem.jit.groups import OPTIONS
from ribbonfem.linalg.banded import factors_of
from ribbonfem.results import Array

from .beam import P


@compiled(**OPTIONS)
def _assemble(
    phi: Array,
    force: Array,
    parameter: float,
    carried: Array,
    beam: tuple[Array, Array, Array, Array, float],
    ends: Array,
    filled: tuple[Array, Array, Array, Array, Array],
) -> None:
    """Residual and second derivatives of the Lagrangian in the inner angles and n at the right clamp.

    Parameters
    ----------
    phi: (nodes,) angles.
    force: (2,), n at the right clamp.
    carried: (elements, P, 6), n by the loads and the natural curvature at parameter 0, and their changes with
        it.
    beam: value, weights, coupling, bending and compliance, see `beam.Beam`.
    ends: (2,) changes of phi of the left and of the right clamp with the parameter.
    filled: what is filled: band (m, P + 1), band[i, d] = A[i + d, i], of the m inner angles; border (2, m);
        corner (2, 2); residual and column (m + 2,), the gradient, its last rows without the chord, and its
        change with the parameter.
    """
    value, weights, coupling, bending, compliance = beam
    band, border, corner, residual, column = filled
    inner = phi.shape[0] - 2
    for a in range(inner):
        for d in range(P + 1):
            band[a, d] = 0.0
        border[0, a] = border[1, a] = 0.0
    for a in range(inner + 2):
        residual[a] = column[a] = 0.0
    corner[0, 0] = corner[0, 1] = corner[1, 0] = corner[1, 1] = 0.0
    for e in range(carried.shape[0]):
        first = e * P - 1
        for k in range(P):
            angle = bent = 0.0
            for i in range(P + 1):
                angle += value[k, i] * phi[first + 1 + i]
                bent += coupling[k, i] * phi[first + 1 + i]
            cos, sin, weight = math.cos(angle), math.sin(angle), weights[k]
            more_x, more_z, more_bent = carried[e, k, 3], carried[e, k, 4], carried[e, k, 5]
            nx = force[0] + carried[e, k, 0] + parameter * more_x
            nz = force[1] + carried[e, k, 1] + parameter * more_z
            tension, shear = nx * cos + nz * sin, nz * cos - nx * sin
            stretch = weight * (1.0 + compliance * tension)
            axial = weight * compliance
            curved = tension * stretch - axial * shear * shear
            bx = sin * stretch - axial * shear * cos
            bz = -cos * stretch - axial * shear * sin
            residual[inner] -= stretch * cos
            residual[inner + 1] -= stretch * sin
            corner[0, 0] -= axial * cos * cos
            corner[0, 1] -= axial * cos * sin
            corner[1, 1] -= axial * sin * sin
            moment = bent / weight - carried[e, k, 2] - parameter * more_bent
            # of loads that change with the parameter
            more_moment = bx * more_x + bz * more_z
            longer = axial * (cos * more_x + sin * more_z)
            column[inner] -= longer * cos
            column[inner + 1] -= longer * sin
            for i in range(P + 1):
                a = first + i
                by_x, by_z = value[k, i] * bx, value[k, i] * bz
                if 0 <= a < inner:
                    residual[a] += coupling[k, i] * moment - value[k, i] * stretch * shear
                    column[a] += value[k, i] * more_moment - coupling[k, i] * more_bent
                    border[0, a] += by_x
                    border[1, a] += by_z
                    for j in range(i, P + 1):
                        if first + j < inner:
                            band[a, j - i] += value[k, i] * value[k, j] * curved
                        else:
                            column[a] += value[k, i] * value[k, j] * curved * ends[1]
                else:
                    end = ends[0] if a < 0 else ends[1]
                    column[inner] += by_x * end
                    column[inner + 1] += by_z * end
                    if a < 0:
                        for j in range(1, P + 1):
                            column[j - 1] += value[k, i] * value[k, j] * curved * end
        for i in range(P + 1):
            a = first + i
            for j in range(i, P + 1):
                if a < 0:
                    if j > 0:
                        column[first + j] += bending[i, j] * ends[0]
                elif first + j >= inner:
                    if a < inner:
                        column[a] += bending[i, j] * ends[1]
                else:
                    band[a, j - i] += bending[i, j]


@compiled(allocates=True, **OPTIONS)
def linearised(
    phi: Array,
    force: Array,
    parameter: float,
    carried: Array,
    value: Array,
    weights: Array,
    coupling: Array,
    bending: Array,
    compliance: float,
    ends: Array,
) -> tuple[Array, Array, Array, Array, Array, Array, Array, Array, Array, int]:
    """Residual and its change with the parameter, the tangent, and what `banded.factored` makes of it."""
    inner = phi.shape[0] - 2
    band, border, corner = np.empty((inner, P + 1)), np.empty((2, inner)), np.empty((2, 2))
    residual, column = np.empty(inner + 2), np.empty(inner + 2)
    beam = value, weights, coupling, bending, compliance
    _assemble(phi, force, parameter, carried, beam, ends, (band, border, corner, residual, column))
    factors, rows, last, reach, negative = factors_of(band, border, corner)
    return residual, column, band, border, corner, factors, rows, last, reach, negative


@compiled(allocates=True, **OPTIONS)
def shape(
    phi: Array,
    force: Array,
    parameter: float,
    carried: Array,
    value: Array,
    partial: Array,
    compliance: float,
) -> tuple[Array, Array]:
    """x and z (nodes,), the integral of r' = t (1 + c n . t) from the left clamp.

    `partial` (P + 1, P): `LineTables.partial` of an element's length; the others as in `_assemble`.
    """
    x, z = np.empty(phi.shape[0]), np.empty(phi.shape[0])
    x[0] = z[0] = 0.0
    along, up = np.empty(P), np.empty(P)
    for e in range(carried.shape[0]):
        first = e * P
        for k in range(P):
            angle = 0.0
            for i in range(P + 1):
                angle += value[k, i] * phi[first + i]
            cos, sin = math.cos(angle), math.sin(angle)
            nx = force[0] + carried[e, k, 0] + parameter * carried[e, k, 3]
            nz = force[1] + carried[e, k, 1] + parameter * carried[e, k, 4]
            tension = nx * cos + nz * sin
            along[k], up[k] = cos * (1.0 + compliance * tension), sin * (1.0 + compliance * tension)
        for i in range(1, P + 1):
            dx = dz = 0.0
            for k in range(P):
                dx += partial[i, k] * along[k]
                dz += partial[i, k] * up[k]
            x[first + i], z[first + i] = x[first] + dx, z[first] + dz
    return x, z
