"""The simulation behind one point of a diagram: its options, its hold, and the name of its outcome.

A run of skipping turns on until z(1/2) passes 0, wherever that is: a ramp that stops before its snap tells
nothing.  One of selection is held at its stop until its energy is below every pass that leads out of the
state it is in (`until="decided"`), or until what is left of its vibration or creep cannot count.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from compare.models import MODELS
from compare.quantities.branches import both_folds, stable_at
from compare.quantities.measure import require_options
from ribbonfem import Fold, History, Scene, SolverError
from ribbonfem.model_info import defaults
from ribbonfem.options import OptionError
from ribbonfem.outcomes import classify, name_by_signs
from ribbonfem.results import MESH

SKIPPING = ("no skip", "type 1", "type 2", "first only", "none")
SELECTION = ("U+S+", "U+S-", "U-S+", "U-S-")
# the angle (rad) at which a ramp that has not snapped is given up
_FAR = 2.0 * math.pi
# times t*: the end of a run over which its shape is averaged, so that a vibration does not name it
_LAST = 4.0


@dataclass(frozen=True)
class Setup:
    """What all runs of a diagram share.

    Attributes
    ----------
    scene: the ribbon and its start; of selection with the stop.
    model: by name; `options` its keywords.
    folds: alpha_c1 and alpha_c2 on the same mesh.
    stable: name, height and slope of the stable states at the stop; empty of skipping.
    """

    scene: Scene
    model: str
    options: Mapping[str, Any]
    folds: tuple[Fold, Fold]
    stable: tuple[tuple[str, float, float], ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """The outcomes that there may be."""
        return SKIPPING if self.scene.stop is None else SELECTION


@dataclass(frozen=True)
class Sample:
    """One run.

    Attributes
    ----------
    rate, damping: rad/s and 1/s.
    outcome: its name; empty where the run failed.
    first, second: angles (rad) of the two snaps, None where one did not come.
    reason: the rule that named it, or why the run failed.
    """

    rate: float
    damping: float
    outcome: str
    first: float | None
    second: float | None
    reason: str


# of `simulate`, what a run of a diagram says itself
OWN = ("configurations", "until")


def require_runs(model: str, options: Mapping[str, Any]) -> None:
    """Refuse keywords that a model's `simulate` does not take, before anything is run."""
    try:
        require_options(model, "simulate", options, OWN)
    except OptionError as error:
        raise OptionError(
            f"{error}; processes, a folder and a progress bar are of sweep = compare.sweep.Sweep(...)"
        ) from None


def mesh_of(model: str, options: Mapping[str, Any]) -> dict[str, Any]:
    """The mesh that these options give, for the functions at rest: their own defaults may be finer."""
    full = {**defaults(MODELS[model], "simulate"), **options}
    return {name: value for name, value in full.items() if name in MESH}


def setup(scene: Scene, model: str, options: Mapping[str, Any]) -> Setup:
    """The setup of a diagram: its folds, once.

    Raises
    ------
    SceneError, SolverError
        If the ribbon has not both states, or no fold of one of them.
    """
    mesh = mesh_of(model, options)
    stable = () if scene.stop is None else _stable_at(scene, scene.stop, model, mesh)
    return Setup(scene, model, dict(options), both_folds(scene, model, mesh), stable)


def _stable_at(
    scene: Scene, angle: float, model: str, mesh: Mapping[str, Any]
) -> tuple[tuple[str, float, float], ...]:
    """Stable states at an angle, with their names: on the curve through U+S+ and its mirror image."""
    reach = max(1.5, 1.1 * abs(angle))
    curve = MODELS[model].equilibria(replace(scene, stop=None), span=(-reach, reach), **mesh)
    return tuple((name_by_signs(*state), *state) for state in stable_at(curve, angle))


def _hold(damping: float) -> float:
    """Seconds until a free vibration has lost all but e^-16 of its energy, or an overdamped one its speed."""
    return max(16.0 / max(damping, 1e-3), 0.6 * damping, 4.0)


def _shape(history: History, stable: tuple[tuple[str, float, float], ...]) -> str:
    """The shape that a run comes to: of the stable states on its side of z = 0 the nearest.

    A run that is decided may still be on its way down, or vibrate: the mean of its last moments counts,
    and a shape that does not exist at the stop is none to come to rest in.
    """
    last = history.time[-1] - _LAST * history.scene.ribbon.inertial_time
    keep = history.time >= max(last, history.time[0])
    time = history.time[keep]
    span = float(time[-1] - time[0])
    height, slope = (
        float(np.trapezoid(column[keep], time)) / span if span > 0.0 else float(column[-1])
        for column in (history.height, history.slope)
    )
    near = [state for state in stable if state[1] * height > 0.0]
    if not near:
        return name_by_signs(height, slope)
    # heights are in L and slopes up to 1: three tenths of a slope weigh as much as a height
    return min(near, key=lambda state: math.hypot(state[1] - height, 0.3 * (state[2] - slope)))[0]


def run_of(base: Setup, rate: float, damping: float) -> Sample:
    """The run at a rate (rad/s) and a damping (1/s): a sample, failed runs included."""
    selection = base.scene.stop is not None
    scene = replace(
        base.scene,
        rate=rate,
        damping=damping,
        stop=base.scene.stop if selection else _FAR,
        hold=_hold(damping) if selection else 0.0,
    )
    until = "decided" if selection else "snap"
    try:
        history = MODELS[base.model].simulate(scene, configurations=False, until=until, **base.options)
    except SolverError as error:
        return Sample(rate, damping, "", None, None, str(error).splitlines()[0])
    if selection:
        snaps, outcome = tuple(map(history.crossing, ("slope", "height"))), _shape(history, base.stable)
        reason = "the shape it comes to rest in"
    else:
        result = classify(history, base.folds)
        snaps, outcome, reason = (result.first, result.second), result.kind, result.reason
    first, second = (None if snap is None else snap[1] for snap in snaps)
    return Sample(rate, damping, outcome, first, second, reason)


def samples_of(work: tuple[Setup, tuple[tuple[float, float], ...]]) -> tuple[Sample, ...]:
    """Runs at several (rate, damping) of one setup: a task of a sweep."""
    base, points = work
    return tuple(run_of(base, rate, damping) for rate, damping in points)


def cost_of(work: tuple[Setup, tuple[tuple[float, float], ...]]) -> float:
    """Expected steps of a task: a lightly damped ribbon rings through a slow ramp, or through its hold."""
    base, points = work
    selection = base.scene.stop is not None
    window = 1.0 if selection else abs(base.folds[1].angle - base.folds[0].angle)
    return sum(
        300.0 + 250.0 * min(10.0 / max(nu, 1e-3), math.inf if selection else window / rate)
        for rate, nu in points
    )
