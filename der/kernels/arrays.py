"""Tuples of arrays and numbers of methods that the compiled time loop of the rod works on."""

from __future__ import annotations

from collections import namedtuple

from ribbonfem.jit.references import by_reference

IMPLICIT_EULER, NEWMARK, GENERALISED_ALPHA, MIDPOINT, DISCRETE_GRADIENT, RUNGE_KUTTA, VERLET = range(7)
DONE, FULL, STUCK, BLOWN = range(4)

# what `clock` holds between calls of `run`
(
    TIME,
    STEP,
    DISSIPATED,
    WORK,
    POWER,
    STEPS,
    ITERATIONS,
    REJECTED,
    ROW,
    SINCE,
    ASSEMBLIES,
    FACTORED,
    START,
    EFFORT,
    AFTER,
    SIDE,
    CARRY,
    PLACE,
    PHASE,
    FRESH,
    CONTROL,
    PUSH,
    PUSHED,
    SCALE,
) = range(24)
CLOCK_SIZE = 24
# L; the height has left the clamps', and may cross it, once it is this far from it: rounding is not
DEPARTED = 1e-6
# see `run`: lengths per t* below which the error allowed in a step shrinks with the speed, over 1
CREEP = 0.1
# growth of the energy, over that of the start and the work done, at which a run is stopped
GROWTH = 0.25

# columns of `rows`
ROW_TIME, ROW_CONTROL, ROW_HEIGHT, ROW_SLOPE, ROW_KINETIC, ROW_ELASTIC, ROW_POTENTIAL = range(7)
ROW_DISSIPATED, ROW_WORK, ROW_LOAD, ROW_VELOCITY, ROW_KEPT, ROW_REACTIONS = range(7, 13)
ROW_SIZE = ROW_REACTIONS + 12

# retardation in t*; shape (N, 2) natural curvature and twist of a node, rad; lumps (N,) of the weight
Rod = namedtuple("Rod", "stiffness rest stretch inertia arclength shape lumps retardation")
# nu, in 1/t*; the instant from which the control stands still, and the energy below which the ribbon cannot
# leave its state then any more, so that its run ends; the instant from which on a run ends soon after the
# height crosses that of the clamps
Course = namedtuple("Course", "damping settled barrier since")
# method, step (0: adaptive), tolerance (of positions), newton (of updates), largest, smallest, radius; of
# a Runge-Kutta method its table (stages, stages), whose last row is the step's weights, its instants, the
# weights (stages,) of its error and the power of the step in that
StepOptions = namedtuple(
    "StepOptions", "method step tolerance newton largest smallest radius table instants weights power"
)
# the motion: positions, velocities and accelerations of all unknowns; aux is the acceleration-like
# variable of generalised-alpha and the mean velocity of midpoint's last step; frames; strains (N, 4) of
# ribbons that damp
Motion = namedtuple("Motion", "x v a aux tangent m1 twist strains clock")
# arrays that a step overwrites; rate and known are velocities of a stage and their part that its increments
# do not change, and viscous (N, 4) parts of moments, of ribbons that damp
Scratch = namedtuple(
    "Scratch",
    "x tangent inverse m1 twist dq stage_v stage_a v b gradient gradient1 hessian factors right energies "
    "turn rate known strains viscous",
)

for _tuple in (Rod, Course, StepOptions, Motion, Scratch):
    by_reference(_tuple)
