"""What the compiled time loop of the Kirchhoff rod works on: clock, rows, ramp, state and memory."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ribbonfem.results import Array

from .tangent import P

# what `run` returns
DONE, FULL, STUCK, GREW, CREPT = 0, 1, 2, 3, 4
# what `clock` holds
TIME, STEP, WORK, DISSIPATED, PHASE, KINK, STEPS, NEWTON, REJECTED, ROWS = range(10)
MOMENT, POWER, AFTER, LAST, LOWEST, PEAK, SIGMA, ASSEMBLIES, SINCE, SIDE, POINTS, CARRY, EXCESS = range(
    10, 23
)
CLOCK_SIZE = 23
# columns of `rows`
ROW_SIZE = 9  # time, angle, height, slope, kinetic, elastic, dissipated, work, load

# solved stages that are remembered, and those through which a guess is laid
MEMORY, GUESS = 16, 3


class Ramp(NamedTuple):
    """The clamp's motion and the control of steps, in t* and rad."""

    rate: float
    stop: float
    turned: float  # when the clamp stops
    end: float
    damping: float
    fixed: float  # 0 if adaptive
    tolerance: float
    largest: float
    newton: float
    smallest: float
    snap: bool  # whether to end soon after the height changes sign
    barrier: float  # energy below which a held ribbon cannot leave its state any more
    gyroscopic: bool
    every: int


class Motion(NamedTuple):
    """State at the last accepted instant.

    x, v, a, auxiliary (nodes, 4); g (nodes, 4); n (E, P, 3); tangent and its rate (nodes, 3).
    """

    x: Array
    v: Array
    a: Array
    auxiliary: Array
    g: Array
    n: Array
    tangent: Array
    turning: Array
    clock: Array


class Scratch(NamedTuple):
    """What a step overwrites, and the stages remembered for guesses."""

    xp: Array
    vp: Array
    tp: Array
    x: Array
    v: Array
    a: Array
    g: Array
    n: Array
    force: Array
    tangent: Array
    turning: Array
    stage_v: Array
    stage_a: Array
    stage_turning: Array
    known_time: Array
    known_g: Array
    known_n: Array
    known_a: Array
    lagrange: Array
    spin: Array
    out: Array


def scratch(elements: int, stages: int) -> Scratch:
    """Memory for a mesh and a method."""
    nodes = elements * P + 1

    def four() -> Array:
        return np.zeros((nodes, 4))

    return Scratch(
        xp=four(),
        vp=four(),
        tp=np.zeros((nodes, 3)),
        x=four(),
        v=four(),
        a=four(),
        g=four(),
        n=np.zeros((elements, P, 3)),
        force=four(),
        tangent=np.zeros((nodes, 3)),
        turning=np.zeros((nodes, 3)),
        stage_v=np.zeros((stages, nodes, 4)),
        stage_a=np.zeros((stages, nodes, 4)),
        stage_turning=np.zeros((stages, nodes, 3)),
        known_time=np.zeros(MEMORY),
        known_g=np.zeros((MEMORY, nodes, 4)),
        known_n=np.zeros((MEMORY, elements, P, 3)),
        known_a=np.zeros((MEMORY, nodes, 4)),
        lagrange=np.zeros(GUESS),
        spin=np.zeros((nodes, 3)),
        out=np.zeros(4),
    )
