"""Residual of the equations of motion of the Kirchhoff rod at a stage of any implicit method.

Every stage of every method solves the same, with x = xp + b a and v = vp + f a:

    (1)  M (a + nu v - w) + D^T n + F = 0                      of each r, w the weight, F at midspan
    (2)  dE/dpsi - T^T n + e_x J m (theta'' + nu theta') = 0   of each g, psi its rotation in the body
    (3)  D r - t (1 + e + c n.t) = 0                           at each Gauss point
"""

from __future__ import annotations

from ribbonfem.jit.algebra import Quaternion, Value, Vector
from ribbonfem.jit.decorator import compiled
from ribbonfem.jit.simd import load, spread, store
from ribbonfem.material.kernels import stretch_of
from ribbonfem.results import Array

from .batch import INLINED, add_to_nodes, force_at, gather
from .gauss_point import body_moment, interpolated_group, point_gradient
from .law import offset_at
from .rod import P, Rod, Solver


@compiled(**INLINED)
def put_gap(rod: Rod, s: Solver, group: int, k: int, stretch: Value, tangent: Vector) -> None:
    """(3): D r, of what s.places has, less a stretched tangent, into s.fn."""
    x = y = z = spread(0.0)
    for i in range(P + 1):
        coupling = load(rod.groups.coupling, (group, k, i))
        x += coupling * load(s.places, (i, 0))
        y += coupling * load(s.places, (i, 1))
        z += coupling * load(s.places, (i, 2))
    stretch = load(rod.groups.weights, (group, k)) * stretch
    store(s.fn, (group, k, 0), x - stretch * tangent[0])
    store(s.fn, (group, k, 1), y - stretch * tangent[1])
    store(s.fn, (group, k, 2), z - stretch * tangent[2])


@compiled(**INLINED)
def put_gradients(s: Solver, k: int, weight: Value, gq: Quaternion, gp: Quaternion) -> None:
    """Derivatives of a point's density in q and q', times a weight, into s.gradients."""
    store(s.gradients, (k, 0), weight * gq[0])
    store(s.gradients, (k, 1), weight * gq[1])
    store(s.gradients, (k, 2), weight * gq[2])
    store(s.gradients, (k, 3), weight * gq[3])
    store(s.gradients, (k, 4), weight * gp[0])
    store(s.gradients, (k, 5), weight * gp[1])
    store(s.gradients, (k, 6), weight * gp[2])
    store(s.gradients, (k, 7), weight * gp[3])


@compiled(**INLINED)
def add_forces(rod: Rod, s: Solver, group: int, last: int, n: Array) -> None:
    """(1): add D^T n of a group to s.fr."""
    zero = spread(0.0)
    for i in range(P + 1):
        x = y = z = zero
        for k in range(P):
            coupling = load(rod.groups.coupling, (group, k, i))
            x += coupling * load(n, (group, k, 0))
            y += coupling * load(n, (group, k, 1))
            z += coupling * load(n, (group, k, 2))
        add_to_nodes(s.fr, group, last, P, i, x, y, z, zero, True)


@compiled(**INLINED)
def add_moments(rod: Rod, s: Solver, group: int, last: int) -> None:
    """(2): add dE/dpsi - T^T n of a group's frames, of what s.gradients has, to s.fp."""
    zero = spread(0.0)
    for i in range(P + 1):
        f0 = f1 = f2 = f3 = zero
        for k in range(P):
            value, slope = rod.value[k, i], load(rod.groups.slope, (group, k, i))
            f0 += value * load(s.gradients, (k, 0)) + slope * load(s.gradients, (k, 4))
            f1 += value * load(s.gradients, (k, 1)) + slope * load(s.gradients, (k, 5))
            f2 += value * load(s.gradients, (k, 2)) + slope * load(s.gradients, (k, 6))
            f3 += value * load(s.gradients, (k, 3)) + slope * load(s.gradients, (k, 7))
        g = load(s.frames, (i, 0)), load(s.frames, (i, 1)), load(s.frames, (i, 2)), load(s.frames, (i, 3))
        moment = body_moment(g, (f0, f1, f2, f3))
        add_to_nodes(s.fp, group, last, P, i, moment[0], moment[1], moment[2], zero, True)


@compiled(**INLINED)
def put_inertia(rod: Rod, s: Solver, force: Array) -> None:
    """(1), (2): inertial forces of `force` (nodes, 4) a mass into s.fr and s.fp, and nothing else."""
    for i in range(force.shape[0]):
        store(s.fr, (i,), load(rod.inertia, (i,)) * load(force, (i,)))
        store(s.fp, (i,), spread(0.0))
        s.fp[i, 0], s.fr[i, 3] = s.fr[i, 3], 0.0


@compiled(**INLINED)
def residual(rod: Rod, s: Solver, x: Array, g: Array, n: Array, force: Array) -> None:
    """Residuals in s.fr, s.fp, s.fn, with inertial forces of `force` (nodes, 4) a mass."""
    put_inertia(rod, s, force)
    last = rod.weights.shape[0] - 1
    for group in range(rod.groups.weights.shape[0]):
        gather(g, group, last, P, s.frames)
        gather(x, group, last, P, s.places)
        for k in range(P):
            q, p = interpolated_group(rod.value, rod.groups.slope, group, k, s.frames, P)
            offset = offset_at(rod, group, k)
            gq, gp, tangent, tension = point_gradient(
                rod.stiffness, rod.compliance[0], offset, q, p, force_at(n, group, k)
            )
            put_gap(rod, s, group, k, stretch_of(rod.compliance[0], offset[1], tension), tangent)
            put_gradients(s, k, load(rod.groups.weights, (group, k)), gq, gp)
        add_forces(rod, s, group, last, n)
        add_moments(rod, s, group, last)
