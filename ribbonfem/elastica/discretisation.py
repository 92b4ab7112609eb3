"""The elastica of a problem as arrays for compiled code, and the frequencies of its small motions."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ribbonfem.continuation.vibration import lowest_squares
from ribbonfem.elements.lobatto import lobatto_points
from ribbonfem.jit.groups import groups_of, in_groups
from ribbonfem.jit.simd import WIDTH
from ribbonfem.material.kernels import LAW
from ribbonfem.results import Array
from ribbonfem.stepping.kernels import KINK, MEAN, Ramp, Scheme
from ribbonfem.stepping.kernels.guess import CLOCK_SIZE

from . import initial_states
from .kernels import arrays, condensed, loop, tangent
from .kernels import average_vector_field as means
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
        "inverse_mass": 1.0 / mesh.lumps,
        "inside": mesh.coupling / mesh.lumps,
        "slopes": elements * by_powers @ np.linalg.inv(points**powers),
        "real": real.reshape(-1, WIDTH),
        "middle": middle,
        "push": np.ascontiguousarray(middle / mesh.lumps[:, None]),
    }


def discretised(problem: Statics) -> Beam:
    """The beam as arrays for the compiled time loop."""
    natural = in_groups(problem.rig.curvature[:, :, None])
    return Beam(
        **_constants(problem.elements),
        weight=problem.rig.weight,
        chord=problem.chord,
        elements=problem.elements,
        natural=natural,
        offset=np.concatenate((natural, np.zeros_like(natural)), axis=2),
        stiffness=np.ones(1),
        compliance=np.array([problem.compliance]),
        elastic=np.array([1.0, problem.compliance]),
        retardation=problem.scene.ribbon.retardation / problem.unit,
    )


def _once(table: Array) -> Array:
    """`in_groups`, with nothing where there is no element."""
    whole = in_groups(table)
    whole[-1, ..., (len(table) - 1) % WIDTH + 1 :] = 0.0
    return whole


class MovingBeam:
    """A beam in motion, as `stepping.integrate` runs it.

    `begin` has its state by the names of `arrays.Motion`, and of what the beam counts strains from; what it
    has not is at rest.
    """

    def __init__(self, problem: Statics, begin: dict[str, Array], scheme: Scheme, rows: int) -> None:
        elements, groups = problem.elements, groups_of(problem.elements)
        beam = discretised(problem)
        retards = beam.retardation > 0.0
        clock = np.zeros(CLOCK_SIZE)
        clock[KINK] = 1.0
        state = {
            "v": np.zeros((groups, PHI, WIDTH)),
            "a": np.zeros((groups, PHI, WIDTH)),
            "auxiliary": np.zeros((groups, PHI, WIDTH)),
            "phi_rate": np.zeros((groups, P + 1, WIDTH)),
            "strain": arrays.strains(elements, retards),
            "strain_rate": arrays.strains(elements, retards),
            "clock": clock,
        } | begin
        for name in LAW:
            getattr(beam, name)[:] = state.pop(name, getattr(beam, name))
        motion = arrays.Motion(**{name: value.copy() for name, value in state.items()})
        self.clock, self.scheme = motion.clock, scheme
        nodes, past = len(problem.arclength), means.KEPT if scheme.kind == MEAN else 0
        self._rows = [np.empty((rows, *shape)) for shape in ((nodes, 3), (nodes,), (nodes, 3), ())]
        self.model = arrays.Moving(
            beam,
            solver(elements),
            arrays.scratch(elements, scheme.stages, retards, past),
            motion,
            *self._rows,
        )

    def kept(self) -> dict[str, Array]:
        """What it goes on from."""
        law = {name: getattr(self.model.beam, name).copy() for name in LAW}
        return {name: value.copy() for name, value in self.model.motion._asdict().items()} | law

    def slopes(self, count: int) -> Array:
        """(rows,) of the last rows."""
        return self._rows[3][:count]

    def shapes(self, count: int) -> tuple[Array, Array, Array]:
        """Of the last rows positions (rows, nodes, 3), curvature (rows, nodes), velocities as positions."""
        positions, curvature, velocities, _ = (of[:count] for of in self._rows)
        return positions, curvature, velocities

    def run(self, ramp: Ramp, rows: Array) -> int:
        """Go on until the end, or until the rows are full."""
        run = loop.run_by_means if self.scheme.kind == MEAN else loop.run
        return int(run(self.model, self.scheme, ramp, self.clock, rows))


def vibrations(problem: Statics, state: _State, count: int) -> Array:
    """The lowest `count` angular frequencies (count,), 1/s, of small undamped motions about a state at rest.

    Of the equations of motion: in a stretching beam the force does not stay constant along it.
    """
    beam, u, elements = discretised(problem), initial_states.at_rest(problem, state), problem.elements
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
