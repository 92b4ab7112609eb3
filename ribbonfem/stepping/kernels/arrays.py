"""Arrays and their places that the time loops of all finite elements share: scheme, ramp, rows."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from ribbonfem.ends.kernels import Ends
from ribbonfem.jit.references import by_reference
from ribbonfem.results import Array

# MEAN: of one stage, its flows those of the whole step
ONE_STAGE, DIRK, MEAN = range(3)
# what `run` returns
DONE, FULL, STUCK, GREW, CREPT = 0, 1, 2, 3, 4
# steps that a run of fixed ones may take: so many times those asked for, and so many besides (a snap in a run
# of few long steps needs more)
MOST_TIMES, MOST_BESIDES = 32.0, 2e4
# what `clock` holds; a model may have places of its own behind
TIME, STEP, WORK, DISSIPATED, PHASE, KINK, STEPS, NEWTON = range(8)
# LAST: of means the last step; of others 0, or less where the step of a ribbon that retards ends at a kink
REJECTED, ROWS, POWER, LOSING, AFTER, LAST, LOWEST, PEAK, SIDE, CARRY, SINCE, EXCESS = range(8, 20)
# rows with configurations; energy that a step by means gained; the control's rate at the last instant
PLACES, GAINED, SPUN = 20, 21, 22
CLOCK_SIZE = 23
# columns of `rows`; a model may have columns of its own behind
HEIGHT, KINETIC, LOAD, VELOCITY, KEPT, REACTIONS = 2, 3, 8, 9, 10, 11
# time, control, height, kinetic, elastic, potential, dissipated, work, load, d(height)/d(time), whether it is
# kept; of rows that are, force and moment of the left and of the right clamp (`History.reactions`)
ROW_SIZE = 23

# part of the largest energy so far by which energy may grow without work: more is an unstable method
GROWTH = 0.25
# t*; in a shorter first step beams that retard have strain rates that no mesh resolves
SHORT = 1e-6


@by_reference
class Scheme(NamedTuple):
    """Coefficients of a method, or its tableau; see `methods.Method`.

    `power` is that of the step in the estimated error; the last row of `a` is the weights of the step.
    """

    kind: int
    power: float
    stages: int
    a: Array
    c: Array
    error: Array
    r0: float
    r1: float
    v0: float
    v1: float
    alpha_m: float
    alpha_f: float
    error0: float
    error1: float
    project: bool


@by_reference
class Ramp(NamedTuple):
    """What the controls do in time, and the control of steps, in t*."""

    ends: Ends
    end: float
    damping: float
    fixed: float  # 0 if adaptive
    tolerance: float
    newton: float
    first: float  # the longest step behind a kink
    smallest: float
    snap: bool  # whether to end soon after the height passes that of the clamps
    since: float  # from when on that counts
    departed: float  # from zero the height has to have been this far before it crosses it
    every: int  # steps to a row that is kept; the others are for events alone
    barrier: float  # energy below which a beam that is held to the end cannot leave its state any more
    gain: float  # part of the largest energy so far that an adaptive step may gain from nowhere
    shortest: float  # a step no longer than this is taken whatever energy it gains
    least_growth: float  # a step grows by this factor at least, or stays


# kinetic, elastic and potential energy; powers lost and of the controls; compressive force
Measures = tuple[float, float, float, float, float, float]


class ModelFunctions(NamedTuple):
    """What a model does for the time loop (`loop.run`), compiled functions whose first argument is the model.

    The model is a tuple of its own, the state at the last accepted instant in it.  What it predicts from a
    rate is its own affair: unknowns need not add.
    """

    project: Callable[..., Any]  # (model, ramp, clock, reset): onto the hidden constraints; an impulse
    rescale: Callable[..., Any]  # (model, ratio): the auxiliary acceleration for a step so much longer
    begin: Callable[..., Any]  # (model, clock): a step, whose stage 0 is the last instant
    stage: Callable[..., Any]  # (model, scheme, ramp, clock, i, h, at): solve it; iterations
    flows: Callable[..., Any]  # (model, nu, h): powers lost and of the controls, of the stage or step solved
    error: Callable[..., Any]  # (model, scheme, h): of the step; minus it where none longer is to follow
    reject: Callable[..., Any]  # (model, clock): forget the stages of this step
    accept: Callable[..., Any]  # (model, scheme, h): the last stage is the new instant
    measure: Callable[..., Any]  # (model, nu, solved): `Measures`, of stage or instant
    record: Callable[..., Any]  # (model, nu, rows, row): height, reactions, own columns, configurations
