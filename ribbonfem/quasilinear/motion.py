"""The quasi-linear beam as arrays for the compiled time loop."""

from __future__ import annotations

from typing import Any

import numpy as np

from ribbonfem.results import Array
from ribbonfem.stepping.kernels import QUASILINEAR, Tables

from .problem import Statics


def tables(problem: Statics) -> Tables:
    """The beam as arrays for the compiled time loop."""
    index, value, _ = problem.middle_weights()
    none = np.zeros((0, 0, 0))
    count = 2 * problem.elements + 2

    def band(matrix: Any) -> Array:
        columns = np.zeros((count, 4))
        for d in range(4):
            columns[: count - d, d] = matrix.diagonal(-d)
        return columns

    return Tables(
        kind=QUASILINEAR,
        clamp=-(problem.compression**-0.5),
        middle_dof=index,
        middle_weight=value,
        value=none,
        force=none,
        dx=np.zeros((0, 0)),
        bending=none,
        inertia=none,
        coupling=none,
        dofs=np.zeros((0, 0), dtype=np.int64),
        places=np.zeros((5, 0), dtype=np.int64),
        compliance=0.0,
        stiffness=band(problem.stiffness),
        tension=band(problem.tension),
        mass=band(problem.mass),
    )
