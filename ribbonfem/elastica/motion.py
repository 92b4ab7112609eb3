"""The elastica as arrays for the compiled time loop."""

from __future__ import annotations

import numpy as np

from ribbonfem.results import Array
from ribbonfem.stepping.beam_kernels import ELASTICA, Tables, local_places

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
