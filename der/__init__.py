"""The discrete elastic rod: a ribbon in three dimensions, at rest and in motion.

    der.folds(scene)        the folds that a very slow ramp meets
    der.equilibria(scene)   the connected curve of equilibria through the start state

Policy: ``nodes`` (N), ``clamp`` ("centred" or "two-node").  Paper, section 3.2; it shares the
statement of the problem and generic mathematics with `ribbonfem`, and no mechanics.
"""

from .motion import simulate
from .verbs import equilibria, folds

__all__ = ["equilibria", "folds", "simulate"]
