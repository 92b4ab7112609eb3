"""What is left over of the equations of a Kirchhoff rod in motion.

Every stage of every method solves the same, with x = xp + b a and v = vp + f a:

    M (a + nu v) + D^T n = 0                              of each r
    dE/dpsi - T^T n + e_x J m (theta'' + nu theta') = 0   of each g, psi its rotation in the body
    D r - t (1 + c n.t) = 0                               at each Gauss point
"""

from __future__ import annotations

from ribbonfem.compiled.decorator import compiled
from ribbonfem.compiled.lanes import load, spread, store
from ribbonfem.results import Array

from .fours import INLINED, add_to_nodes, collect
from .points import bend, body, interpolated_fours
from .rod import P, Rod, Solver


@compiled(**INLINED)
def _add_points(rod: Rod, s: Solver, group: int, n: Array) -> None:
    """Gaps of a group's points into s.fn; derivatives of their densities into s.gradients."""
    for k in range(P):
        q, p = interpolated_fours(rod.value, rod.four.slope, group, k, s.frames, P)
        force = load(n, (group, k, 0)), load(n, (group, k, 1)), load(n, (group, k, 2))
        gq, gp, tangent, pull = bend(rod.stiff, rod.soft, q, p, force)
        weight = load(rod.four.weights, (group, k))
        x = y = z = spread(0.0)
        for i in range(P + 1):
            coupling = load(rod.four.coupling, (group, k, i))
            x += coupling * load(s.places, (i, 0))
            y += coupling * load(s.places, (i, 1))
            z += coupling * load(s.places, (i, 2))
        stretch = weight * (1.0 + rod.soft * pull)
        store(s.fn, (group, k, 0), x - stretch * tangent[0])
        store(s.fn, (group, k, 1), y - stretch * tangent[1])
        store(s.fn, (group, k, 2), z - stretch * tangent[2])
        store(s.gradients, (k, 0), weight * gq[0])
        store(s.gradients, (k, 1), weight * gq[1])
        store(s.gradients, (k, 2), weight * gq[2])
        store(s.gradients, (k, 3), weight * gq[3])
        store(s.gradients, (k, 4), weight * gp[0])
        store(s.gradients, (k, 5), weight * gp[1])
        store(s.gradients, (k, 6), weight * gp[2])
        store(s.gradients, (k, 7), weight * gp[3])


@compiled(**INLINED)
def _add_group(rod: Rod, s: Solver, group: int, last: int, n: Array) -> None:
    """Add the forces and moments of a group to s.fr and s.fp."""
    zero = spread(0.0)
    for i in range(P + 1):
        f0 = f1 = f2 = f3 = x = y = z = zero
        for k in range(P):
            value, slope = rod.value[k, i], load(rod.four.slope, (group, k, i))
            coupling = load(rod.four.coupling, (group, k, i))
            f0 += value * load(s.gradients, (k, 0)) + slope * load(s.gradients, (k, 4))
            f1 += value * load(s.gradients, (k, 1)) + slope * load(s.gradients, (k, 5))
            f2 += value * load(s.gradients, (k, 2)) + slope * load(s.gradients, (k, 6))
            f3 += value * load(s.gradients, (k, 3)) + slope * load(s.gradients, (k, 7))
            x += coupling * load(n, (group, k, 0))
            y += coupling * load(n, (group, k, 1))
            z += coupling * load(n, (group, k, 2))
        g = load(s.frames, (i, 0)), load(s.frames, (i, 1)), load(s.frames, (i, 2)), load(s.frames, (i, 3))
        moment = body(g, (f0, f1, f2, f3))
        add_to_nodes(s.fr, group, last, P, i, x, y, z, zero, True)
        add_to_nodes(s.fp, group, last, P, i, moment[0], moment[1], moment[2], zero, True)


@compiled(**INLINED)
def residual(rod: Rod, s: Solver, x: Array, g: Array, n: Array, force: Array) -> None:
    """Residuals in s.fr, s.fp, s.fn, with inertial forces of `force` (nodes, 4) a mass."""
    for i in range(g.shape[0]):
        store(s.fr, (i,), load(rod.inertia, (i,)) * load(force, (i,)))
        store(s.fp, (i,), spread(0.0))
        s.fp[i, 0], s.fr[i, 3] = s.fr[i, 3], 0.0
    last = rod.weights.shape[0] - 1
    for group in range(rod.four.weights.shape[0]):
        collect(g, group, last, P, s.frames)
        collect(x, group, last, P, s.places)
        _add_points(rod, s, group, n)
        _add_group(rod, s, group, last, n)
