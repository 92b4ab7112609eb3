"""Output rows of a motion of the elastica: height and velocity at midspan, reactions, shape."""

from __future__ import annotations

import math

from ribbonfem.jit.decorator import compiled
from ribbonfem.jit.groups import OPTIONS
from ribbonfem.jit.simd import WIDTH, load, spread, store, summed
from ribbonfem.results import Array
from ribbonfem.stepping.kernels.arrays import HEIGHT, KEPT, VELOCITY

from .arrays import Moving
from .beam import PHI, P, Z
from .energies import put_reactions


@compiled(**OPTIONS)
def _record_shape(model: Moving, row: int) -> None:
    """Positions, velocities, and phi' at the nodes; of a node between elements the mean of both."""
    beam, u, v, bends = model.beam, model.motion.u, model.motion.v, model.solver.points
    for group in range(u.shape[0]):
        for i in range(P + 1):
            bend = spread(0.0)
            for j in range(P + 1):
                bend += beam.slopes[i, j] * load(u, (group, PHI + j))
            store(bends, (0, i), bend)
        for place in range(min(WIDTH, beam.elements - WIDTH * group)):
            first = (WIDTH * group + place) * P
            before = model.row_bend[row, first] if first > 0 else bends[0, 0, place]
            for i in range(P + 1):
                model.row_x[row, first + i, 0] = u[group, i, place]
                model.row_x[row, first + i, 1] = 0.0
                model.row_x[row, first + i, 2] = u[group, Z + i, place]
                model.row_v[row, first + i, 0] = v[group, i, place]
                model.row_v[row, first + i, 1] = 0.0
                model.row_v[row, first + i, 2] = v[group, Z + i, place]
                model.row_bend[row, first + i] = bends[0, i, place]
            model.row_bend[row, first] = 0.5 * (before + bends[0, 0, place])


@compiled(**OPTIONS)
def record(model: Moving, nu: float, rows: Array, row: int) -> None:
    """Height and velocity at midspan, and the shape; of rows that are kept reactions."""
    y, beam = model.motion, model.beam
    height = velocity = angle = spread(0.0)
    for group in range(y.u.shape[0]):
        for i in range(P + 1):
            share = load(beam.middle, (group, i))
            height += share * load(y.u, (group, Z + i))
            velocity += share * load(y.v, (group, Z + i))
            angle += share * load(y.u, (group, PHI + i))
    rows[row, HEIGHT], rows[row, VELOCITY] = summed(height), summed(velocity)
    model.row_slope[row] = math.sin(summed(angle))
    _record_shape(model, row)
    if rows[row, KEPT] > 0.0:
        put_reactions(beam, y.u, model.scratch.controls, nu, rows[row])
