"""The quasi-linear beam of a problem as arrays for compiled code; shapes of its rows of dofs."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from ribbonfem.ends.planar_kernels import PLACES
from ribbonfem.results import Array
from ribbonfem.stepping.kernels import KINK, STEPS, Ramp, Scheme
from ribbonfem.stepping.kernels.guess import CLOCK_SIZE

from .kernels import beam, loop
from .mesh import ENDS, Mesh, mesh_of
from .problem import Statics, _State

_PLACED = np.array(PLACES)


@lru_cache(maxsize=32)
def _constants(elements: int, degree: int) -> dict[str, Any]:
    """What a beam has of its mesh alone; kept."""
    mesh = mesh_of(elements, degree)
    n = mesh.count
    stiffness, tension, mass = (
        beam.Matrix(
            band=beam.padded(_diagonals(mesh, whole), n),
            ends=beam.padded(whole[n:, :n], n),
            corner=np.ascontiguousarray(whole[n:, n:]),
        )
        for whole in (mesh.stiffness, mesh.tension, mesh.mass)
    )
    mass.band[mesh.width, n:] = 1.0
    height = beam.padded(mesh.height[:n], n)
    return {
        "stiffness": stiffness,
        "tension": tension,
        "mass": mass,
        "middle": beam.padded(mesh.middle, n),
        "height": height,
        "even": mesh.even if mesh.even < n else len(height),
    }


def _diagonals(mesh: Mesh, matrix: Array) -> Array:
    """(2 w + 1, n) of the free dofs' part, [w + d, i] = A[i, i + d]."""
    lower, w = mesh.band(matrix), mesh.width
    upper = [np.append(np.zeros(d), lower[d, : mesh.count - d]) for d in range(w, 0, -1)]
    return np.concatenate((np.reshape(upper, (w, mesh.count)), lower))


def discretised(problem: Statics) -> beam.Beam:
    """The beam as arrays for the compiled time loop."""
    mesh = problem.mesh
    return beam.Beam(
        **_constants(problem.elements, problem.degree),
        weight=beam.padded(problem.weight_load, mesh.count),
        bent=beam.padded(problem.bent, mesh.count),
        own=problem.own,
        scale=problem.scale,
        retardation=problem.scene.ribbon.retardation / problem.unit,
    )


def at_rest(problem: Statics, state: _State) -> dict[str, Array]:
    """The state of the time loop in an equilibrium, by the names of `beam.Motion`."""
    n = problem.mesh.count
    ends = np.zeros((3, ENDS))
    ends[0] = state.z[n:]
    still, clock = np.zeros(n), np.zeros(CLOCK_SIZE)
    clock[KINK] = 1.0
    return {
        "z": state.z[:n],
        "v": still,
        "a": still,
        "auxiliary": still,
        "load": np.array([state.load]),
        "ends": ends,
        "clock": clock,
    }


class MovingBeam:
    """A beam in motion, as `stepping.integrate` runs it, from a state by the names of `beam.Motion`.

    Arrays of dofs have n entries there; the kernels' have places beside them (`beam`).
    """

    def __init__(self, problem: Statics, begin: dict[str, Array], scheme: Scheme, rows: int) -> None:
        n = problem.mesh.count
        self.scheme, self.problem = scheme, problem
        self._dofs, self._rates = np.empty((2, rows, n + ENDS))
        self._slopes = np.empty(rows)
        motion = beam.Motion(
            **{
                name: beam.padded(value, n) if name in beam.DOFS else value.copy()
                for name, value in begin.items()
            }
        )
        self.clock = motion.clock
        memory = beam.scratch(len(motion.z), problem.mesh.width, scheme.stages)
        self.model = beam.Moving(discretised(problem), memory, motion, self._dofs, self._rates, self._slopes)

    def kept(self) -> dict[str, Array]:
        """What it goes on from."""
        n = self.problem.mesh.count
        kept = self.model.motion._asdict()
        return {name: kept[name][:n].copy() if name in beam.DOFS else kept[name].copy() for name in kept}

    def slopes(self, count: int) -> Array:
        """(rows,) of the last rows."""
        slope = self.problem.scale * self._slopes[:count]
        return np.asarray(slope / np.hypot(1.0, slope))

    def shapes(self, count: int) -> tuple[Array, Array, Array]:
        """Of the last rows positions (rows, nodes, 3), curvature (rows, nodes), velocities as positions."""
        dofs, rates = self._dofs[:count], self._rates[:count]
        mesh, compression = self.problem.mesh, self.problem.compression
        curvature = self.problem.scale * (mesh.bend @ dofs.T).T
        return mesh.shapes(dofs, compression), curvature, mesh.velocities(dofs, rates, compression)

    def run(self, ramp: Ramp, rows: Array) -> int:
        """Go on until the end, or until the rows are full."""
        if self.clock[STEPS] == 0.0:
            # (of the first row, which is of no stage)
            controls = ramp.ends.fixed + ramp.ends.reached[0] * ramp.ends.moved
            self.model.scratch.controls[:, 0] = controls[_PLACED]
        return int(loop.run(self.model, self.scheme, ramp, self.clock, rows))
