"""Newton's method on a stage, with factors of the tangent kept over iterations, stages and steps.

It knows a model by its `Equations` alone, as the time loop does.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

from ribbonfem.jit.decorator import compiled
from ribbonfem.results import Array

from .arrays import CLOCK_SIZE as COMMON
from .arrays import LAST, Ramp

# places in the clock behind those of the time loop: sigma of the factors kept, how often there were new ones,
# and the rate at which increments fell, measured and foretold
SIGMA, ASSEMBLIES, RATE, FORETOLD = range(COMMON, COMMON + 4)
CLOCK_SIZE = COMMON + 4

LIMIT = 20
# relative change of 1 / (step)^2 for which factors are kept
KEEP = 0.4
# 1/t*; stages shorter than one over this are solved the closer the shorter they are
RESOLVED = 100.0
# L; Newton tries no harder, and takes it for rounding if increments below the second do not fall
SMALLEST_CHANGE, ROUNDING = 1e-15, 1e-11
# The rate at which a first increment would fall is taken from the last stage: at least this, and to this
# power, so that it grows from stage to stage until one is measured again.  Not for fixed steps: what they
# leave is to be that of the method.
LEAST_RATE, AGEING = 1e-3, 0.8
# factors with which increments fell by less than this, over 1, in the last stage are made anew for a step:
# new ones cost some four iterations, and serve several stages
SLOW = 0.015


@compiled(inline=True)
def foretold(model: Any, sigma: float, size: float, made: int, clock: Array) -> float:
    """The rate of factors that were kept, from the last stage (`Equations.foretell`)."""
    return clock[FORETOLD] if made == 0 else 0.0


class Equations(NamedTuple):
    """What a model does for Newton, compiled functions whose first argument is the model.

    sigma is d(inertial force)/d(position) of a stage, per mass.
    """

    residual: Callable[..., Any]  # (model, sigma): of the stage's unknowns as they are
    factorise: Callable[..., Any]  # (model, sigma): the tangent there
    solve: Callable[..., Any]  # (model, sigma): increments from the residual; the largest in L, or not finite
    move: Callable[..., Any]  # (model): add the increments
    # (model, sigma, size, made, clock): the rate at which a first increment of this size, already added, will
    # fall; `made`, how many factors were made for it; 0 if there is no telling
    foretell: Callable[..., Any] = foretold


@compiled(inline=True)
def renew(clock: Array) -> None:
    """At the start of a step: forget factors with which increments fell slowly."""
    if clock[RATE] > SLOW:
        clock[SIGMA] = 0.0


def newton_of(equations: Equations) -> Callable[..., int]:
    """Newton on the stages of the models that have these equations, compiled."""
    residual, factorise, solve, move, foretell = equations

    def newton(model, sigma: float, b: float, largest: float, ramp: Ramp, clock: Array) -> int:  # type: ignore[no-untyped-def]
        """Solve a stage from its guesses; return the iterations, or minus them on failure.

        b is d(position)/d(acceleration).  Factors are kept while they still reduce the increments; those to
        come are foretold from the last two.  Increments above `largest` lead nowhere.
        """
        fresh = not abs(clock[SIGMA] - sigma) <= KEEP * sigma
        # What Newton leaves in a position, over the step, is in the velocity; all to one side it feeds
        # the ringing.
        shortest = math.sqrt(b)
        if clock[LAST] < 0.0:
            # (what it leaves before a kink is corrected in the short step behind that)
            shortest = min(shortest, ramp.first)
        tolerance = max(SMALLEST_CHANGE, ramp.newton * min(1.0, RESOLVED * shortest))
        before = rate = 0.0
        made = 0
        iteration = 0
        while iteration < LIMIT:
            iteration += 1
            residual(model, sigma)
            if fresh:
                factorise(model, sigma)
                clock[SIGMA] = sigma
                clock[ASSEMBLIES] += 1.0
                made += 1
            size = solve(model, sigma)
            # a comparison that NaN fails
            good = size < largest
            if not fresh and (not good or (iteration > 1 and size > max(0.5 * before, ROUNDING))):
                # the old factors are no good here: take no step with them
                fresh = True
                continue
            if not good or made > 8:
                break
            move(model)
            if before > 0.0:
                rate = min(0.9, size / before)
            elif ramp.fixed == 0.0:
                rate = foretell(model, sigma, size, made, clock)
            left = size * rate / (1.0 - rate) if rate > 0.0 else size
            if min(size, left) < tolerance or (made > 0 and size < ROUNDING and rate > 0.3):
                if before > 0.0 or made > 0:
                    clock[RATE] = rate
                clock[FORETOLD] = min(0.9, max(rate, LEAST_RATE) ** AGEING)
                return iteration
            fresh = iteration > 1 and rate > 0.3
            before = size
        clock[SIGMA] = 0.0
        return -iteration

    return compiled()(newton)
