"""Residual of the equations of motion of the elastica at a stage of any implicit method, element by element.

Every stage of every method solves the same, with r = rp + b a and v = vp + f a:

    (1)  m (a + nu v) + D^T n = loads     of each r
    (2)  dE/dphi - T^T n = 0              of each phi
    (3)  D r - t (1 + c n.t) = 0          at each Gauss point

m (a + nu v) less the loads is m (sigma r - known), with sigma = (1 + nu f) / b.
"""

from __future__ import annotations

from ribbonfem.jit.decorator import compiled
from ribbonfem.jit.groups import OPTIONS
from ribbonfem.jit.simd import load, spread, store
from ribbonfem.results import Array

from .beam import FORCE, PHI, Beam, P, Solver, Z
from .gauss_point import cosine_sine, interpolated, resolved
from .law import moment_of, stretch_of


@compiled(**OPTIONS)
def residual(beam: Beam, s: Solver, u: Array, known: Array, sigma: float) -> None:
    """The residual of a state, element by element, in s.rest; known (G, PHI, WIDTH)."""
    rest, points = s.rest, s.points
    for group in range(rest.shape[0]):
        for k in range(P):
            angle, bent, x, z = interpolated(beam.value, beam.coupling, u, group, k)
            cos, sin = cosine_sine(angle)
            tension, shear = resolved(u, group, k, cos, sin)
            weight = beam.weights[k]
            stretch = weight * stretch_of(beam, group, k, tension)
            # (3)
            store(rest, (group, FORCE + 2 * k), x - stretch * cos)
            store(rest, (group, FORCE + 2 * k + 1), z - stretch * sin)
            store(points, (0, k), moment_of(beam, group, k, bent * (1.0 / weight)))
            store(points, (1, k), stretch * shear)
        for i in range(P + 1):
            x = z = moment = spread(0.0)
            for k in range(P):
                coupling = beam.coupling[k, i]
                x += coupling * load(u, (group, FORCE + 2 * k))
                z += coupling * load(u, (group, FORCE + 2 * k + 1))
                moment += coupling * load(points, (0, k)) - beam.value[k, i] * load(points, (1, k))
            # (1), (2)
            mass = beam.mass[i]
            store(rest, (group, i), x + mass * (sigma * load(u, (group, i)) - load(known, (group, i))))
            z += mass * (sigma * load(u, (group, Z + i)) - load(known, (group, Z + i)))
            store(rest, (group, Z + i), z)
            store(rest, (group, PHI + i), moment)
