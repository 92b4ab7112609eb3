"""The local error that a step may have: less than the tolerance while the body is slow."""

from __future__ import annotations

from ribbonfem.jit.decorator import compiled

# Part of the tolerance at rest, and for each L per t* of speed.  Runge-Kutta methods on planar beams have
# their own: these lose less while they creep than ribbons do, more on the way of a fast ramp, and a snap's
# angle costs a fifth to a third less at the same error.  (A ribbon's would cost a tenth more with them, and
# generalised-alpha pumps waves along a beam in the longer steps.)
USUAL, PLANAR = (0.01, 0.1), (0.02, 0.05)


@compiled(inline=True)
def allowed_error(speed: float, parts: tuple[float, float]) -> float:
    """Part of the tolerance that a step may err by at a speed (L per t*).

    Errors made while it creeps towards a fold add up and shift the snap; those made while it rings do not.
    """
    least, growth = parts
    return min(1.0, max(least, growth * speed))
