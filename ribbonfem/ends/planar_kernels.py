"""Boundary conditions and loads of a planar beam at an instant of its motion, compiled."""

from __future__ import annotations

from ribbonfem.jit.decorator import compiled
from ribbonfem.results import Array

from . import kernels as ends_kernels
from .kernels import Ends, control_at

# rows of what is done, (CONTROLS, 3) of value, rate and acceleration: the angles of the left and of the right
# clamp (positive turns the beam's end down), what is added to the compression and the lift of the right
# clamp (L), and a dead force at midspan, along -z (EI2/L^2)
LEFT, RIGHT, COMPRESSION, LIFT, PUSH, CONTROLS = range(6)
# where `ends` has them
PLACES = (
    ends_kernels.LEFT,
    ends_kernels.RIGHT,
    ends_kernels.COMPRESSION,
    ends_kernels.LIFT,
    ends_kernels.FORCE,
)


@compiled()
def controls_at(ends: Ends, phase: int, time: float, out: Array) -> None:
    """The planar controls of a scene at an instant between two kinks."""
    value, rate, change = control_at(ends, phase, time)
    for k in range(CONTROLS):
        moved = ends.moved[PLACES[k]]
        out[k, 0] = ends.fixed[PLACES[k]] + moved * value
        out[k, 1], out[k, 2] = moved * rate, moved * change
