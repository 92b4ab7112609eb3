"""The elastica as arrays for the compiled time loop."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ribbonfem.continuation.vibration import lowest_squares
from ribbonfem.elements.lobatto import lobatto_points
from ribbonfem.jit.groups import groups_of, in_fours
from ribbonfem.jit.simd import WIDTH
from ribbonfem.results import Array
from ribbonfem.stepping.kernels import KINK, Ramp, Scheme
from ribbonfem.stepping.kernels.controls import COMPRESSION, LIFT

from .kernels import arrays, condensed, loop, tangent
from .kernels.beam import PHI, ROWS, Beam, P, Z, solver
from .problem import Statics, _State, mesh_of

# 1/t*^2; the lowest frequencies squared are some hundreds
SHIFT = 100.0


@lru_cache(maxsize=32)
def _constants(elements: int) -> dict[str, Array]:
    """What a beam has of its mesh alone; kept."""
    mesh = mesh_of(elements)
    inside = mesh.coupling[:, 1:P]
    real = np.zeros(WIDTH * groups_of(elements))
    real[:elements] = 1.0
    points, powers = lobatto_points(P)[:, None], np.arange(P + 1)
    by_powers = powers * points ** np.maximum(powers - 1, 0)
    # a node between two elements is in a state twice
    halves = mesh.middle.copy()
    if elements % 2 == 0:
        left = elements // 2 - 1
        halves[left, P] = halves[left + 1, 0] = 0.5
    middle = _once(halves)
    return {
        "value": mesh.tables.value,
        "weights": mesh.weights,
        "coupling": mesh.coupling,
        "bending": mesh.bending,
        "share": (inside / mesh.lumps[1:P]) @ inside.T,
        "mass": mesh.lumps,
        "light": 1.0 / mesh.lumps,
        "inside": mesh.coupling / mesh.lumps,
        "slopes": elements * by_powers @ np.linalg.inv(points**powers),
        "real": real.reshape(-1, WIDTH),
        "middle": middle,
        "push": np.ascontiguousarray(middle / mesh.lumps[:, None]),
    }


def discretised(problem: Statics) -> Beam:
    """The beam as arrays for the compiled time loop."""
    return Beam(
        **_constants(problem.elements),
        natural=in_fours(problem.rig.curvature),
        weight=problem.rig.weight,
        soft=problem.compliance,
        chord=problem.chord,
        elements=problem.elements,
    )


def _once(table: Array) -> Array:
    """`in_fours`, with nothing where there is no element."""
    whole = in_fours(table)
    whole[-1, ..., (len(table) - 1) % WIDTH + 1 :] = 0.0
    return whole


def at_rest(problem: Statics, state: _State) -> Array:
    """The state (G, ROWS, WIDTH) of the time loop in an equilibrium."""
    x, z = problem.shape(state)
    # the right clamp, to the last digit
    controls = problem.controls(state.at)
    x[-1], z[-1] = problem.chord - controls[COMPRESSION], controls[LIFT]
    force = problem.force(state).reshape(problem.elements, 2 * P)
    nodes = problem.nodes
    return in_fours(np.concatenate((x[nodes], z[nodes], state.phi[nodes], force), axis=1))


def in_rows(problem: Statics, field: Array) -> Array:
    """Rates (G, PHI, WIDTH) of a field (nodes, 2) along x and z."""
    return in_fours(np.concatenate((field[problem.nodes, 0], field[problem.nodes, 1]), axis=1))


class Motion:
    """A beam in motion, as `stepping.newmark` runs it; with a velocity (nodes, 2) its clamps are held."""

    def __init__(
        self, problem: Statics, u: Array, scheme: Scheme, rows: int, velocity: Array | None = None
    ) -> None:
        groups = u.shape[0]
        still = np.zeros((groups, PHI, WIDTH))
        self.clock = np.zeros(arrays.CLOCK_SIZE)
        self.clock[KINK] = 1.0
        self.scheme = scheme
        nodes = len(problem.arclength)
        self._rows = np.empty((rows, nodes, 3)), np.empty((rows, nodes)), np.empty(rows)
        v = still.copy() if velocity is None else in_rows(problem, velocity)
        motion = arrays.Motion(u.copy(), v, still, still.copy(), np.zeros((groups, P + 1, WIDTH)), self.clock)
        self.model = arrays.Moving(
            discretised(problem),
            solver(problem.elements),
            arrays.scratch(problem.elements, scheme.stages),
            motion,
            *self._rows,
        )

    def observed(self, count: int) -> tuple[Array, Array, Array]:
        """Slopes (rows,), positions (rows, nodes, 3) and curvatures (rows, nodes) of the last rows."""
        positions, curvature, slope = self._rows
        return slope[:count], positions[:count], curvature[:count]

    def run(self, ramp: Ramp, rows: Array) -> int:
        """Go on until the end, or until the rows are full."""
        return int(loop.run(self.model, self.scheme, ramp, self.clock, rows))


def vibrations(problem: Statics, state: _State, count: int) -> Array:
    """The lowest `count` angular frequencies (count,), 1/s, of small undamped motions about a state at rest.

    Of the equations of motion: in a stretching beam the force does not stay constant along it.
    """
    beam, u, elements = discretised(problem), at_rest(problem, state), problem.elements
    memory = solver(elements)
    tangent.fill(beam, memory, u, SHIFT, False)
    condensed.factorise(memory)
    # where a state has each inner node, once
    places = np.arange(u.size).reshape(u.shape)
    by_element = np.moveaxis(places, 2, 1).reshape(-1, ROWS)[:elements]
    along = np.column_stack([by_element[:, c : c + P].ravel()[1:] for c in (0, Z)])
    inertia = np.repeat(problem.mass[1:-1], 2)

    def solve(right: Array) -> Array:
        memory.rest[:] = 0.0
        memory.rest.flat[along.ravel()] = -right
        condensed.solve(beam, memory, SHIFT)
        return np.asarray(memory.rest.flat[along.ravel()])

    squares = lowest_squares(solve, lambda x: inertia * x, len(inertia), count, SHIFT)
    return np.asarray(np.sqrt(squares) / problem.unit)
