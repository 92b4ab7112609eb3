"""The elastica as arrays for the compiled time loop."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csc_array
from scipy.sparse.linalg import splu

from ribbonfem.continuation.vibration import lowest_squares
from ribbonfem.results import Array
from ribbonfem.stepping.kernels import ELASTICA, Tables, element_elastica, local_places

from .problem import Statics, _State


def tables(problem: Statics) -> Tables:
    """The beam as arrays for the compiled time loop."""
    mesh = problem.mesh
    coupling = np.einsum("eiq,ekq,eq->eik", mesh.grad, mesh.force, mesh.dx)
    # what is orthogonal is zero, and the kernel passes over it
    coupling[np.abs(coupling) < 1e-12] = 0.0
    index, weight = mesh.middle_weights()
    none = np.zeros((0, 0))
    return Tables(
        kind=ELASTICA,
        clamp=-1.0,
        middle_dof=mesh.count + index,
        middle_weight=weight,
        value=np.ascontiguousarray(mesh.value),
        force=np.ascontiguousarray(mesh.force),
        dx=mesh.dx,
        bending=problem.stiffness,
        inertia=problem.inertia,
        coupling=coupling,
        dofs=mesh.dofs,
        places=local_places(mesh.degree),
        compliance=problem.compliance,
        stiffness=none,
        tension=none,
        mass=none,
    )


def at_rest(problem: Statics, state: _State) -> tuple[Array, Array]:
    """The dofs q, w of the time loop in an equilibrium."""
    mesh = problem.mesh
    x, z = problem.shape(state)
    # the right clamp, to the last digit
    x[-1], z[-1] = problem.chord, 0.0
    force = np.zeros((mesh.elements, 2, mesh.degree))
    force[:, :, 0] = state.force
    return np.concatenate((x, z)), np.concatenate((state.phi, force.ravel()))


def vibrations(problem: Statics, state: _State, count: int) -> Array:
    """The lowest `count` angular frequencies (count,), 1/s, of small undamped motions about a state at rest.

    Of the equations of motion: in a stretching beam the force does not stay constant along it.
    """
    beam, mesh = tables(problem), problem.mesh
    q, w = at_rest(problem, state)
    still = np.zeros_like(q)
    p, nodes, elements = mesh.degree, mesh.count, mesh.elements
    # numbers of x, z, phi and n, in the local order
    places = np.empty((elements, 5 * p + 3), dtype=np.int64)
    phi, x, z, nx, nz = beam.places
    places[:, x], places[:, z], places[:, phi] = mesh.dofs, nodes + mesh.dofs, 2 * nodes + mesh.dofs
    forces = 3 * nodes + 2 * p * np.arange(elements)[:, None] + np.arange(2 * p)
    places[:, nx[:p]], places[:, nz[:p]] = forces[:, :p], forces[:, p:]
    local = np.empty((elements, 5 * p + 3, 5 * p + 4))
    mass = np.zeros((elements, 5 * p + 3, 5 * p + 3))
    for e in range(elements):
        # without inertia: its factor 1 / b vanishes
        element_elastica(beam, e, local[e], q, still, still, w, np.inf, 0.0, 0.0)
        for rows in (x, z):
            mass[e][np.ix_(rows, rows)] = problem.inertia[e]
    clamped = np.array([0, nodes - 1])
    free = np.setdiff1d(
        np.arange(forces[-1, -1] + 1), np.concatenate([clamped + k * nodes for k in range(3)])
    )

    def assembled(blocks: Array) -> csc_array:
        rows, columns = np.broadcast_arrays(places[:, :, None], places[:, None, :])
        size = forces[-1, -1] + 1
        whole = csc_array((blocks.ravel(), (rows.ravel(), columns.ravel())), shape=(size, size))
        return whole[free][:, free]

    factors, inertia = splu(assembled(local[:, :, :-1])), assembled(mass)
    squares = lowest_squares(factors.solve, lambda v: inertia @ v, len(free), count)
    return np.asarray(np.sqrt(squares) / problem.unit)
