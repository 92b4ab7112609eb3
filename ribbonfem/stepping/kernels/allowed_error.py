"""The local error that a step may have: less than the tolerance while the body creeps."""

from __future__ import annotations

from ribbonfem.jit.decorator import compiled

# lengths per t* below which the error allowed in a step shrinks with the speed, over 1, and by how much
CREEP, LEAST = 0.1, 0.01


@compiled(inline=True)
def allowed_error(speed: float) -> float:
    """Part of the tolerance that a step may err by at a speed (L per t*).

    Errors made while it creeps towards a fold add up and shift the snap; those made while it rings do not.
    """
    return min(1.0, max(LEAST, CREEP * speed))
