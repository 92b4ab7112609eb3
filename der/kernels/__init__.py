"""Compiled kernels of the discrete elastic rod (paper, section 3.2).

A rod has N nodes and N - 1 edges.  Unknowns are interleaved node by node, four a node:
``q = [x_0, theta^0, x_1, theta^1, ...]``, so that a node's energy couples 11 consecutive
unknowns and the Hessian has a half-bandwidth of 10.  The last angle does not exist; its slot is
kept to make all rows alike.

The state of a rod is (x, m1, twist): positions (N, 3), the material director m1 (the surface
normal) of each edge (N - 1, 3), and the twist angle at each node (N,), kept because an angle
alone is known up to full turns only.  Directors are moved by parallel transport in time, and
m2 = t x m1 points along the width, so that bending about m1 is the stiff one.  Angles theta are
therefore increments: a variation of x leaves the frames parallel (Bergou et al. 2010).

Units: lengths L, energies EI2/L.  ``rod`` holds the stiffnesses: (EI1, EI2, GJ) over EI2,
``rest`` the rest length of an edge, ``stretch`` (N - 1,) the stretching stiffness EA of each
edge times its share of the length (0 for the clamped ones), ``shape`` (N, 2) the natural curvature and twist
of each inner node times ``rest``.
"""

from .arrays import (
    AFTER,
    ASSEMBLIES,
    CARRY,
    CLOCK_SIZE,
    CONTROL,
    DISCRETE_GRADIENT,
    DONE,
    FACTORED,
    FRESH,
    FULL,
    GENERALISED_ALPHA,
    IMPLICIT_EULER,
    ITERATIONS,
    MIDPOINT,
    NEWMARK,
    PHASE,
    PLACE,
    POWER,
    PUSHED,
    REJECTED,
    ROW,
    ROW_CONTROL,
    ROW_HEIGHT,
    ROW_KEPT,
    ROW_KINETIC,
    ROW_REACTIONS,
    ROW_SIZE,
    ROW_SLOPE,
    ROW_TIME,
    ROW_VELOCITY,
    RUNGE_KUTTA,
    SIDE,
    STEP,
    STEPS,
    STUCK,
    TIME,
    VERLET,
    Course,
    Motion,
    Rod,
    Scratch,
    StepOptions,
)
from .band import FIRST, WIDTH, factor, solve, solve_refined
from .energy import assemble, resist
from .frames import carry, edges
from .loop import record, run
from .statics import equations, moved

# what counts from the beginning of a run
OF_A_RUN = (STEPS, ITERATIONS, ASSEMBLIES, REJECTED, PHASE, AFTER, SIDE, CARRY)

__all__ = [
    "ASSEMBLIES",
    "CLOCK_SIZE",
    "CONTROL",
    "DISCRETE_GRADIENT",
    "DONE",
    "FACTORED",
    "FIRST",
    "FRESH",
    "FULL",
    "GENERALISED_ALPHA",
    "IMPLICIT_EULER",
    "ITERATIONS",
    "MIDPOINT",
    "NEWMARK",
    "OF_A_RUN",
    "PHASE",
    "PLACE",
    "POWER",
    "PUSHED",
    "REJECTED",
    "ROW",
    "ROW_CONTROL",
    "ROW_HEIGHT",
    "ROW_KEPT",
    "ROW_KINETIC",
    "ROW_REACTIONS",
    "ROW_SIZE",
    "ROW_SLOPE",
    "ROW_TIME",
    "ROW_VELOCITY",
    "RUNGE_KUTTA",
    "STEP",
    "STEPS",
    "STUCK",
    "TIME",
    "VERLET",
    "WIDTH",
    "Course",
    "Motion",
    "Rod",
    "Scratch",
    "StepOptions",
    "assemble",
    "carry",
    "edges",
    "equations",
    "factor",
    "moved",
    "record",
    "resist",
    "run",
    "solve",
    "solve_refined",
]
