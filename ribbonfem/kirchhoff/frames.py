"""Rotations of a rod's frames, in numpy: directors and tangents of quaternions, and their derivatives."""

from __future__ import annotations

import numpy as np

from ribbonfem.results import Array


def about(g: Array) -> Array:
    """g i (nodes, 4), the direction of a rotation of frames about their tangents."""
    w, x, y, z = g.T
    return np.stack((-x, w, z, -y), axis=1)


def directors(g: Array) -> Array:
    """Rows m1, m2, m3 (nodes, 3, 3) of the frames G e_z, -G e_y, G e_x."""
    w, x, y, z = g.T
    normal = np.stack((2 * (x * z + w * y), 2 * (y * z - w * x), w * w - x * x - y * y + z * z), axis=1)
    width = -np.stack((2 * (x * y - w * z), w * w - x * x + y * y - z * z, 2 * (y * z + w * x)), axis=1)
    tangent = np.stack((w * w + x * x - y * y - z * z, 2 * (x * y + w * z), 2 * (x * z - w * y)), axis=1)
    return np.stack((normal, width, tangent), axis=1)


def tangents_of(q: Array) -> tuple[Array, Array]:
    """Unit tangents (..., 3) of quaternions (..., 4) of any length, and their derivatives (..., 3, 4)."""
    w, x, y, z = np.moveaxis(q, -1, 0)
    square = np.sum(q * q, axis=-1)
    tangent = np.stack((w * w + x * x - y * y - z * z, 2 * (x * y + w * z), 2 * (x * z - w * y)), axis=-1)
    tangent /= square[..., None]
    rows = np.stack(
        (
            np.stack((w, x, -y, -z), axis=-1),
            np.stack((z, y, x, w), axis=-1),
            np.stack((-y, z, -w, x), axis=-1),
        ),
        axis=-2,
    )
    derivative = 2.0 * (rows - tangent[..., None] * q[..., None, :]) / square[..., None, None]
    return tangent, derivative
