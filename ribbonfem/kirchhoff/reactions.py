"""Forces and moments of both clamps on a Kirchhoff rod at rest."""

from __future__ import annotations

import numpy as np

from ribbonfem.results import Array

from .frames import tangents_of
from .problem import Frames, Statics

_STEP = 1e-30


def reactions_of(problem: Statics, state: Frames) -> Array:
    """(2, 6) of the left and the right clamp: force (EI2/L^2) and moment (EI2/L), in the fixed frame.

    The moment is the derivative of the energy with its constraint, int [ U + n.(r' - t) - c (n.t)^2 / 2 ] ds,
    as the clamp's node turns: by a complex step, which rounds nothing.
    """
    tables, loads = problem.tables, problem.loads(state.at)
    nodes, weight = tables.degree + 1, problem.ends.weight
    push, _ = problem.ends.force(state.at)
    result = np.empty((2, 6))
    result[:, :3] = -(state.force + weight + push), state.force
    turns = 0.5 * np.stack([_product(axis, np.eye(4)) for axis in np.eye(4)[1:]])
    for clamp, (element, node) in enumerate(((0, 0), (tables.elements - 1, nodes - 1))):
        first = element * tables.degree
        g = np.tile(state.g[first : first + nodes].astype(complex), (3, 1, 1))
        g[:, node] += 1j * _STEP * np.einsum("k,akc->ac", state.g[first + node], turns)
        q, p = tables.value @ g, tables.slope[element] @ g
        conjugate = q * (1.0, -1.0, -1.0, -1.0)
        strain = 2.0 * _product(conjugate, p)[..., 1:] / np.sum(q * q, axis=-1)[..., None]
        tension = np.sum(tangents_of(q)[0] * (state.force + loads[element]), axis=-1)
        bent = (strain - problem.unbent(state.at)[element]) ** 2 @ problem.stiffness
        density = 0.5 * bent - tension - 0.5 * problem.compliance * tension**2
        result[clamp, 3:] = (density @ tables.weights[element]).imag / _STEP
    return result


def _product(a: Array, b: Array) -> Array:
    """Products of quaternions (..., 4)."""
    w = a[..., 0] * b[..., 0] - np.sum(a[..., 1:] * b[..., 1:], axis=-1)
    v = a[..., :1] * b[..., 1:] + b[..., :1] * a[..., 1:] + np.cross(a[..., 1:], b[..., 1:])
    return np.concatenate((w[..., None], v), axis=-1)
