"""The compiled time loop common to all finite elements, and Newton's method on its stages.

They see arrays only, and know a model by its `ModelFunctions` and `Equations` alone.
"""

from ribbonfem.ends.kernels import Ends

from .arrays import (
    CLOCK_SIZE,
    CREPT,
    DIRK,
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
    REACTIONS,
    REJECTED,
    ROW_SIZE,
    ROWS,
    STEPS,
    STUCK,
    VELOCITY,
    Ramp,
    Scheme,
)
from .newton import ASSEMBLIES

__all__ = [
    "ASSEMBLIES",
    "CLOCK_SIZE",
    "CREPT",
    "DIRK",
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
    "REACTIONS",
    "REJECTED",
    "ROWS",
    "ROW_SIZE",
    "STEPS",
    "STUCK",
    "VELOCITY",
    "Ends",
    "Ramp",
    "Scheme",
]
