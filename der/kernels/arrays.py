"""What the kernels of a rod in motion are given: names of methods, places in arrays, tuples of arrays."""

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
) = range(18)
CLOCK_SIZE = 18
# L; the height has left zero, and may cross it, once it is this far from it: rounding is not
DEPARTED = 1e-6
# see `run`: lengths per t* below which the error allowed in a step shrinks with the speed, over 1
CREEP = 0.1
# growth of the energy, over that of the start and the work done, at which a run is stopped
GROWTH = 0.25

# columns of `rows`
ROW_TIME, ROW_ANGLE, ROW_HEIGHT, ROW_SLOPE, ROW_KINETIC, ROW_ELASTIC, ROW_DISSIPATED, ROW_WORK = range(8)
ROW_LOAD, ROW_VELOCITY, ROW_KEPT, ROW_SIZE = 8, 9, 10, 11

Rod = namedtuple("Rod", "stiffness rest stretch inertia arclength")
# rate, stop (rad, along the rate), end (time), nu; all in units of t*; the energy below which a
# held ribbon cannot leave its state any more, and its run ends; whether to end soon after the height
# changes sign
Ramp = namedtuple("Ramp", "rate stop end damping barrier snap")
# method, step (0: adaptive), tolerance (of positions), newton (of updates), largest, smallest, radius; of
# a Runge-Kutta method its table (stages, stages), whose last row is the step's weights, its instants, the
# weights (stages,) of its error and the power of the step in that
Policy = namedtuple(
    "Policy", "method step tolerance newton largest smallest radius table instants weights power"
)
# the motion: positions, velocities and accelerations of all unknowns; aux is the acceleration-like
# variable of generalised-alpha and the mean velocity of midpoint's last step; frames
Motion = namedtuple("Motion", "x v a aux tangent m1 twist clock")
# arrays that a step overwrites
Scratch = namedtuple(
    "Scratch",
    "x tangent inverse m1 twist dq stage_v stage_a v b gradient gradient1 hessian factors right energies "
    "turn",
)

for _tuple in (Rod, Ramp, Policy, Motion, Scratch):
    by_reference(_tuple)
