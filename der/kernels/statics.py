"""Residual and tangent of a discrete elastic rod at rest, factorised, for continuation."""

from __future__ import annotations

import numpy as np

from ribbonfem.jit.decorator import compiled

from .band import WIDTH, factor, multiply
from .energy import assemble, hold_tension
from .frames import OPTIONS, carry, edges, fall_short


@compiled(allocates=True, **OPTIONS)
def moved(x, m1, twist, tangent, inverse, increment, first, clamps, normals, turns, rest, linear):
    """A configuration moved by an increment of its free unknowns, of which `first` is the first.

    The first two and last two nodes go to `clamps` (4, 3), the directors of the first and last edge to
    `normals` (2, 3), turned by `turns` (2,).  Returns x, m1, twist, the edges' tangents and inverse lengths,
    and by how much their strains fall short (`frames.fall_short`).
    """
    nodes = x.shape[0]
    step = np.zeros(4 * nodes)
    step[first : first + increment.shape[0]] = increment
    new_x = np.empty((nodes, 3))
    turn = np.empty(nodes)
    for i in range(nodes):
        for r in range(3):
            new_x[i, r] = x[i, r] + step[4 * i + r]
        turn[i] = step[4 * i + 3]
    for i in range(2):
        for r in range(3):
            new_x[i, r] = clamps[i, r]
            new_x[nodes - 2 + i, r] = clamps[2 + i, r]
    turn[0], turn[nodes - 2] = turns[0], turns[1]
    # clamps may twist by more than half a turn: the twist is measured near to what comes of that
    near = twist.copy()
    for i in range(1, nodes - 1):
        near[i] += turn[i] - turn[i - 1]
    new_tangent, new_inverse = np.empty((nodes - 1, 3)), np.empty(nodes - 1)
    edges(new_x, new_tangent, new_inverse)
    new_m1, new_twist, lag = np.empty((nodes - 1, 3)), twist.copy(), np.empty(nodes - 1)
    carry(tangent, m1, near, new_tangent, turn, new_m1, new_twist)
    fall_short(tangent, inverse, new_tangent, new_inverse, rest, linear, lag)
    # exact values where transport leaves rounding behind
    for r in range(3):
        new_m1[0, r], new_m1[nodes - 2, r] = normals[0, r], normals[1, r]
    return new_x, new_m1, new_twist, new_tangent, new_inverse, lag


@compiled(allocates=True, **OPTIONS)
def equations(
    tangent,
    inverse,
    m1,
    twist,
    stiffness,
    rest,
    stretch,
    shape,
    lumps,
    weight,
    force,
    lag,
    foreseen,
    rate,
    force_rate,
    first,
    last,
    second,
):
    """The equations at a configuration.

    Returns elastic energies (3,); gradient (4 N,), with loads; Hessian band (4 N + 10, 11); slope (4 N,), the
    derivative of the gradient where the clamps move at a `rate` (4 N,) and the force at another (3,); the
    factors of the Hessian's rows `first` to `last`, and their number of negative pivots.  Without `second`
    the first two alone are made, and factors only where there are such rows.

    An edge that turns in a step is stretched by the square of its turn, and the tangent takes the large
    tension for real.  With the one that was to be, Newton needs half the iterations (D. Magisano et al.,
    Comput. Methods Appl. Mech. Eng. 313 (2017) 986): so it is where all lags (N - 1,) are below `foreseen`.
    """
    nodes = twist.shape[0]
    gradient, energies, viscous = np.empty(4 * nodes), np.empty(3), np.zeros((nodes, 4))
    hessian = np.empty((4 * nodes + WIDTH, WIDTH + 1))
    material, sums = (stiffness, rest, stretch, shape), (gradient, hessian, energies)
    assemble(material, tangent, inverse, m1, twist, viscous, 1.0, *sums, second, nodes)
    # the node at midspan, or the two beside it
    one, other = (nodes - 1) // 2, nodes // 2
    for r in range(3):
        for i in range(nodes):
            gradient[4 * i + r] -= lumps[i] * weight[r]
        gradient[4 * one + r] -= 0.5 * force[r]
        gradient[4 * other + r] -= 0.5 * force[r]
    if not second:
        return energies, gradient, hessian, gradient, hessian, 0
    most = 0.0
    tension = np.empty(lag.shape[0])
    for i in range(lag.shape[0]):
        most = max(most, abs(lag[i]))
        tension[i] = stretch[i] / rest * lag[i] * inverse[i]
    if 0.0 < most < foreseen:
        hold_tension(hessian, tangent, tension)
    slope = multiply(hessian, 0, 4 * nodes, rate)
    for r in range(3):
        slope[4 * one + r] -= 0.5 * force_rate[r]
        slope[4 * other + r] -= 0.5 * force_rate[r]
    factors, negative = hessian, 0
    if last > first:
        factors = hessian.copy()
        negative = factor(factors, first, last)
    return energies, gradient, hessian, slope, factors, negative
