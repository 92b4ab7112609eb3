"""The snap of a slow ribbon without a simulation: fold by finite elements, delay by `predict_snap`."""

from __future__ import annotations

from dataclasses import replace

from ribbonfem import Scene, SceneError, SolverError, kirchhoff
from ribbonfem.delay import Lead, NormalForm, next_order, predict_snap

from . import at_rest
from .cost_laws import beam_units
from .refinement import Settled, upward

# the last fold of (0.40, 0.37) and its lead, in units of t*: those of other ribbons are within a factor of 2
_FOLD = NormalForm(angle=0.57, product=1.8e5, quadratic=3.3e3, cubic=-1.7e-3, mixed=-2.4e-3)
_LEAD = Lead(time=0.13, error=1e-5, remainder=1e-4, power=1.0, reach=350.0, frequency=20.0)
# part of the tolerance that the fold may take
_STATIC = 0.3
# nu times the time between the folds of Path 2 from which on its second snap has forgotten the first
_FORGOTTEN = 16.0


def forgets(scene: Scene, quantity: str) -> bool:
    """Whether it is the second snap of a ramp so slow that the vibration of its first is gone by then."""
    _, rate, damping, _ = beam_units(scene)
    two = scene.start in ("U+S+", "U-S+") and upward(scene).rate > 0.0
    return two and quantity == "snap" and damping * 0.2 / rate > _FORGOTTEN


def expected_error(scene: Scene) -> float:
    """What a ribbon's predicted snap will typically be wrong by, before its fold is known, rad."""
    _, rate, damping, _ = beam_units(scene)
    return 1e-6 + rate * next_order(_FOLD, _LEAD, rate, damping).error


def answer(scene: Scene, tolerance: float) -> Settled | None:
    """The second snap of a slow ribbon without a run; None where statics do not make it certain enough.

    It is certain where the energy of the first snap cannot carry the ribbon over.
    """
    ramp = replace(scene, stop=None)
    try:
        fold, uncertainty, runs, folds = at_rest.folds(
            "kirchhoff", kirchhoff.folds, ramp, _STATIC * tolerance
        )
        if fold is None or len(folds) != 2 or kirchhoff.skipping_bound(ramp, extensible=True) >= 0.0:
            return None
        delay = predict_snap(kirchhoff, ramp, extensible=True)
    except (SceneError, SolverError):
        # a run says what is the matter, or gets there
        return None
    value, error = fold + delay.angle, uncertainty + delay.angle_error
    # what comes after a stop is no matter of a ramp
    beyond = scene.stop is not None and abs(value) + error > abs(scene.stop)
    if not error <= tolerance or beyond:
        return None
    return Settled(value, error, False, runs, None)
