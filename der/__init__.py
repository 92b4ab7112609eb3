"""The discrete elastic rod: a ribbon in three dimensions, at rest and in motion.

    der.folds(scene)        the folds that a very slow ramp meets
    der.equilibria(scene)   the connected curve of equilibria through the start state
    der.simulate(scene)     the motion while the clamp turns and is held
    der.normal_forms(scene) the folds' normal forms, from which delays are predicted
    der.frequencies(scene)  angular frequencies of small motions about the start state
    der.modes               names of shapes, outcomes of runs: skipping and selection

Policy: ``nodes`` (N), ``clamp`` ("centred" or "two-node"), ``method``, ``step`` or ``tolerance``.
Paper, section 3.2; it shares the statement of the problem and generic mathematics with
`ribbonfem`, and no mechanics.
"""

from . import modes
from .motion import simulate
from .verbs import equilibria, folds, frequencies, normal_forms

__all__ = ["equilibria", "folds", "frequencies", "modes", "normal_forms", "simulate"]
