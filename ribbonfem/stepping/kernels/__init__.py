"""Compiled dynamics of both planar beams: tangents, banded solves, and the whole time loop.

Kernels see arrays only; `newmark` makes the arrays and says what they mean.

Unknowns.  `q` are the dofs that carry mass, `v` and `a` their velocity and acceleration, `w`
the others, which follow from the equilibrium at the same instant:

* elastica: q = (x dofs, z dofs), w = (phi dofs, n modes (elements, 2, p));
* quasi-linear: q = nodal (Z, Z'), w = (sigma^2,).

Every stage of every method solves the same equations, with q = qp + b a and v = vp + g a:

    M (a + nu v) + B(q, w)^T n = 0,   the balance of moments,   the constraints on q.
"""

from ribbonfem.ends.kernels import Ends

from .arrays import (
    CLOCK_SIZE,
    CREPT,
    DIRK,
    ELASTICA,
    FULL,
    GREW,
    GROWTH,
    HEIGHT,
    KEPT,
    KINETIC,
    KINK,
    LOAD,
    MEAN,
    NEWTON,
    ONE_STAGE,
    PHASE,
    PLACES,
    QUASILINEAR,
    REJECTED,
    ROW_SIZE,
    ROWS,
    STEPS,
    STUCK,
    VELOCITY,
    Beam,
    Ramp,
    Scheme,
    Scratch,
    Tables,
)
from .beams import run
from .elastica import element_elastica, local_places, newton_elastica
from .quasilinear import newton_quasilinear, project_quasilinear

__all__ = [
    "CLOCK_SIZE",
    "CREPT",
    "DIRK",
    "ELASTICA",
    "FULL",
    "GREW",
    "GROWTH",
    "HEIGHT",
    "KEPT",
    "KINETIC",
    "KINK",
    "LOAD",
    "MEAN",
    "NEWTON",
    "ONE_STAGE",
    "PHASE",
    "PLACES",
    "QUASILINEAR",
    "REJECTED",
    "ROWS",
    "ROW_SIZE",
    "STEPS",
    "STUCK",
    "VELOCITY",
    "Beam",
    "Ends",
    "Ramp",
    "Scheme",
    "Scratch",
    "Tables",
    "element_elastica",
    "local_places",
    "newton_elastica",
    "newton_quasilinear",
    "project_quasilinear",
    "run",
]
