"""The Kirchhoff rod of a problem as arrays for compiled code, and the frequencies of its small motions."""

from __future__ import annotations

import numpy as np

from ribbonfem.continuation.vibration import lowest_squares
from ribbonfem.elements.lobatto import lobatto_weights
from ribbonfem.results import Array
from ribbonfem.scene import Scene

from . import initial_states
from .kernels import condensed, tangent
from .kernels.batch import in_groups
from .kernels.rod import GroupTables, P, Rod, solver
from .problem import Frames, Statics

# 1/t*^2; the lowest frequencies squared are some hundreds
SHIFT = 100.0


def discretised(problem: Statics, scene: Scene, gyroscopic: bool = False) -> Rod:
    """The rod as arrays for the compiled time loop."""
    tables, elements, p = problem.tables, problem.tables.elements, P
    mass = np.tile(lobatto_weights(p) / elements, (elements, 1))
    inertia = np.repeat(problem.mass[:, None], 4, axis=1)
    inertia[:, 3] *= scene.ribbon.rotary_inertia
    coupling = tables.weights[:, :, None] * tables.slope
    inside = coupling[:, :, 1:p]
    share = np.einsum("eki,eli,ei->ekl", inside, inside, 1.0 / mass[:, 1:p])
    grouped = map(in_groups, (tables.slope, tables.weights, coupling, share, mass))
    natural = in_groups(problem.natural)
    offset = np.concatenate((natural, np.zeros_like(natural[:, :, :1])), axis=2)
    retardation = scene.ribbon.retardation / problem.unit
    return Rod(
        value=tables.value,
        slope=tables.slope,
        weights=tables.weights,
        coupling=np.ascontiguousarray(coupling),
        groups=GroupTables(*grouped),
        inertia=inertia,
        spin=scene.ribbon.rotary_inertia,
        gyroscopic=gyroscopic,
        middle=len(inertia) // 2,
        stiffness=problem.stiffness.copy(),
        compliance=np.array([problem.compliance]),
        offset=offset,
        has_offset=scene.ribbon.shaped or retardation > 0.0,
        elastic=np.append(problem.stiffness, problem.compliance),
        natural=natural,
        retardation=retardation,
        weight=np.append(problem.ends.weight, 0.0),
        has_weight=bool(problem.ends.weight.any()),
    )


def vibrations(problem: Statics, state: Frames, scene: Scene, count: int) -> Array:
    """The lowest `count` angular frequencies (count,), 1/s, of small undamped motions about a state at rest.

    Of the equations of motion: in a stretching rod the force does not stay constant along it.
    """
    rod, start = discretised(problem, scene), initial_states.at_rest(problem, state)
    memory = solver(len(rod.weights))
    tangent.fill(rod, memory, start.g, start.n, SHIFT, False)
    condensed.factorise(memory)
    inertia = rod.inertia[1:-1].ravel()

    def solve(right: Array) -> Array:
        # positions and spin carry all the mass
        load = right.reshape(-1, 4)
        memory.fr[1:-1, :3], memory.fp[1:-1] = -load[:, :3], 0.0
        memory.fp[1:-1, 0] = -load[:, 3]
        memory.fn[:] = 0.0
        condensed.solve(rod, memory, SHIFT)
        return np.column_stack((memory.fr[1:-1, :3], memory.fp[1:-1, 0])).ravel()

    squares = lowest_squares(solve, lambda x: inertia * x, len(inertia), count, SHIFT)
    return np.asarray(np.sqrt(squares) / problem.unit)
