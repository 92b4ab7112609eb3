"""The discrete elastic rod: a ribbon in three dimensions, at rest and in motion.

    der.folds(scene)        the folds that a very slow ramp meets
    der.equilibria(scene)   the connected curve of equilibria through the start state
    der.instabilities(scene)
                            where the state that such a ramp follows is lost, at folds or otherwise
    der.fold_curve, der.pitchfork_curve
                            one of these over a second parameter
    der.leaves_plane(scene) where a planar state at rest leaves its plane
    der.simulate(scene)     the motion while the control moves and is held
    der.escape(scene)       the motion that leaves a fold by itself
    der.normal_forms(scene) the folds' normal forms, from which delays are predicted
    der.state, der.stable_states, der.saddle, der.skipping_bound
                            states by name, their passes, the static bound on skipping
    der.frequencies(scene)  angular frequencies of small motions about the start state
    der.modes               names of shapes, outcomes of runs: skipping and selection

Options: ``nodes`` (N), ``clamp`` ("centred" or "two-node"), ``method``, ``step`` or ``tolerance``.
Paper, section 3.2; it shares the statement of the problem and generic mathematics with
`ribbonfem`, and no mechanics.
"""

import ribbonfem
from ribbonfem.public_names import public

from . import modes
from .escape import escape
from .functions import (
    equilibria,
    fold_curve,
    folds,
    frequencies,
    instabilities,
    leaves_plane,
    normal_forms,
    pitchfork_curve,
)
from .info import MODEL_INFO
from .motion import simulate
from .rest import saddle, skipping_bound, stable_states, state

__all__ = [
    "MODEL_INFO",
    "equilibria",
    "escape",
    "fold_curve",
    "folds",
    "frequencies",
    "instabilities",
    "leaves_plane",
    "modes",
    "normal_forms",
    "pitchfork_curve",
    "saddle",
    "simulate",
    "skipping_bound",
    "stable_states",
    "state",
]

__version__ = ribbonfem.__version__

__getattr__, __dir__ = public(__name__, __all__)
