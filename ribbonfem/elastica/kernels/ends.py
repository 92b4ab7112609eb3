"""Boundary values of the elastica: positions and angles of both clamps, put into a state and its rates."""

from __future__ import annotations

from ribbonfem.ends.planar_kernels import COMPRESSION, LEFT, LIFT, RIGHT
from ribbonfem.jit.decorator import compiled
from ribbonfem.jit.groups import OPTIONS
from ribbonfem.jit.simd import WIDTH
from ribbonfem.results import Array

from .beam import PHI, Beam, P, Z


@compiled(**OPTIONS)
def set_turns(beam: Beam, controls: Array, which: int, state: Array) -> None:
    """Put phi of both ends into a state (which 0), or its rates (1, 2)."""
    state[0, PHI, 0] = -controls[LEFT, which]
    last = beam.elements - 1
    for lane in range(last % WIDTH, WIDTH):
        state[last // WIDTH, PHI + P, lane] = controls[RIGHT, which]


@compiled(**OPTIONS)
def set_places(beam: Beam, controls: Array, which: int, state: Array) -> None:
    """Put r of both ends into a state (which 0), or its rates (1, 2) into one of velocities."""
    state[0, 0, 0] = state[0, Z, 0] = 0.0
    chord = beam.chord if which == 0 else 0.0
    last = beam.elements - 1
    for lane in range(last % WIDTH, WIDTH):
        state[last // WIDTH, P, lane] = chord - controls[COMPRESSION, which]
        state[last // WIDTH, Z + P, lane] = controls[LIFT, which]
