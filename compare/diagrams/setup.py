"""The simulation behind one point of a diagram: its options, its hold, and the name of its outcome.

A run of skipping turns on until z(1/2) passes 0, wherever that is: a ramp that stops before its snap tells
nothing.  One of selection is held at its stop until its energy is below every pass that leads out of the
state it is in (`until="decided"`), or until what is left of its vibration or creep cannot count; which state
that is, is seen by damping it to rest.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from operator import attrgetter
from typing import Any

from compare.models import MODELS
from compare.quantities.measure import require_options
from ribbonfem import Fold, History, Scene, SceneError, Schedule, SolverError
from ribbonfem.drive import TURNS, TWISTS
from ribbonfem.frozen import Frozen
from ribbonfem.model_info import defaults
from ribbonfem.options import OptionError
from ribbonfem.outcomes import classify
from ribbonfem.results import MESH
from ribbonfem.scene_numbers import with_numbers

from .states import State, apart, folds_met, is_plain, name_of, stable_states, two_folds

SKIPPING = ("no skip", "type 1", "type 2", "first only", "none")
SELECTION = ("U+S+", "U+S-", "U-S+", "U-S-")
# what usually varies
RATE_AND_DAMPING = ("rate", "damping")
# where another number does, and a ribbon has not got its start, or nothing to skip
NO_STATE = "no state"
# rad: the turn or twist of a clamp at which a ramp that has not snapped is given up
_FAR = 2.0 * math.pi
# to see in which well a run is when it ends: damping (1/t*), times t* that it is followed, tolerance (L)
_DAMPED, _REST, _ROUGHLY = 10.0, 15.0, 1e-3
# how far from a stable state (`states.apart`) it may then be, and what vanishes of one that was not found (L)
_NEAR, _FLAT = 0.1, 1e-3


@dataclass(frozen=True)
class Setup:
    """What all runs of a diagram share.

    Attributes
    ----------
    scene: the ribbon and its start; of selection with the stop.
    model: by name; `options` its keywords.
    folds: of skipping alpha_c1 and alpha_c2, of selection those that a slow ramp meets, on the same mesh.
    stable: name, height over the mean of the clamps' and slope of the stable states at the stop; empty of
        skipping.
    over: names of the two numbers that vary.  Folds and states are found anew for each run where they
        depend on them.
    """

    scene: Scene
    model: str
    options: Mapping[str, Any]
    folds: tuple[Fold, ...]
    stable: tuple[State, ...] = ()
    over: tuple[str, str] = RATE_AND_DAMPING

    @property
    def selection(self) -> bool:
        """Whether ramps stop, and it is asked in which shape they end."""
        return self.scene.stop is not None or "stop" in self.over

    @property
    def names(self) -> tuple[str, ...]:
        """The outcomes that there may be."""
        if not self.selection:
            return SKIPPING
        if is_plain(self.scene):
            return SELECTION
        return tuple(name for name, _, _ in self.stable)


@dataclass(frozen=True)
class Sample:
    """One run.

    Attributes
    ----------
    x, y: values of what varies: usually the rate of the control (rad/s, ...), and the damping (1/s).
    outcome: its name; empty where the run failed.
    first, second: where the control is at the two snaps, None where one did not come.
    reason: the rule that named it, or why the run failed.
    """

    x: float
    y: float
    outcome: str
    first: float | None
    second: float | None
    reason: str

    rate = property(attrgetter("x"), doc="x, of a diagram over rate and damping.")
    damping = property(attrgetter("y"), doc="y, of a diagram over rate and damping.")


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


def setup(
    scene: Scene, model: str, options: Mapping[str, Any], over: tuple[str, str] = RATE_AND_DAMPING
) -> Setup:
    """The setup of a diagram: its folds and states, once, where they are those of all runs.

    Raises
    ------
    SceneError, SolverError
        If the ribbon has not the states that are asked for.
    """
    base = Setup(scene, model, dict(options), (), (), over)
    return _found(base) if over == RATE_AND_DAMPING else base


def _found(base: Setup) -> Setup:
    """With the folds and states of its scene."""
    # neither damping nor the size of the rate has a part in them
    still = replace(base.scene, rate=base.scene.direction, hold=0.0, damping=0.0)
    folds, stable = _at_rest(still, base.model, Frozen(mesh_of(base.model, base.options)))
    return replace(base, folds=folds, stable=stable)


@lru_cache(maxsize=16)
def _at_rest(scene: Scene, model: str, mesh: Mapping[str, Any]) -> tuple[tuple[Fold, ...], tuple[State, ...]]:
    if scene.stop is None:
        return two_folds(scene, model, mesh), ()
    stable = stable_states(scene, model, mesh)
    return folds_met(scene, model, mesh), stable


def far(scene: Scene) -> float:
    """Where a ramp that has not snapped is given up: a turn of a clamp, or as far as the control goes."""
    turns = [abs(by) for name, by in scene.drives.moved.items() if name in (*TURNS, *TWISTS)]
    reach = scene.reach_towards(scene.direction)
    return min(reach, _FAR / max(turns)) if turns else reach


def _hold(damping: float) -> float:
    """Seconds until a free vibration has lost all but e^-16 of its energy, or an overdamped one its speed."""
    return max(16.0 / max(damping, 1e-3), 0.6 * damping, 4.0)


def _shape(history: History, base: Setup) -> str:
    """The shape that a run comes to: the stable state in whose well it is when it ends.

    A run that is decided may still be on its way down, or vibrate, on either side of the clamps.  Damped from
    there on it stays in its well, below every pass, and comes to rest in it.
    """
    scene, unit = history.scene, history.scene.ribbon.inertial_time
    stop = scene.require_stop()
    still = Schedule((0.0, _REST * unit), (stop, stop), "linear")
    damped = replace(scene, rate=Scene.rate, stop=None, hold=0.0, schedule=still, damping=_DAMPED / unit)
    mesh = mesh_of(base.model, base.options)
    rest = MODELS[base.model].simulate(
        damped, initial=history, configurations=False, tolerance=_ROUGHLY, **mesh
    )
    end = float(rest.height[-1] - scene.clamps_height(stop)), float(rest.slope[-1])
    near = min(base.stable, key=lambda state: apart(state[1:], end), default=None)
    if near is None or apart(near[1:], end) > _NEAR:
        return name_of(*end, scene, _FLAT)
    return near[0]


def run_of(base: Setup, x: float, y: float) -> Sample:
    """The run at two values of what varies: a sample, failed runs included."""
    try:
        base = replace(base, scene=with_numbers(base.scene, dict(zip(base.over, (x, y), strict=True))))
        if base.over != RATE_AND_DAMPING:
            base = _found(base)
        outcome, snaps, reason = _run(base)
    except SceneError as error:
        if base.over == RATE_AND_DAMPING:
            raise
        return Sample(x, y, NO_STATE, None, None, str(error).splitlines()[0])
    except SolverError as error:
        return Sample(x, y, "", None, None, str(error).splitlines()[0])
    first, second = (None if snap is None else snap[1] for snap in snaps)
    return Sample(x, y, outcome, first, second, reason)


def _run(base: Setup) -> tuple[str, tuple[Any, Any], str]:
    """The outcome of the scene's run, its two snaps, and the rule that named it."""
    selection, damping = base.selection, base.scene.damping
    scene = replace(
        base.scene,
        stop=base.scene.stop if selection else far(base.scene),
        hold=_hold(damping) if selection else 0.0,
    )
    until = "decided" if selection else "snap"
    history = MODELS[base.model].simulate(scene, configurations=False, until=until, **base.options)
    if selection:
        snaps = history.crossing("slope"), history.snap
        return _shape(history, base), snaps, "the shape it comes to rest in"
    result = classify(history, base.folds)
    return result.kind, (result.first, result.second), result.reason


def samples_of(work: tuple[Setup, tuple[tuple[float, float], ...]]) -> tuple[Sample, ...]:
    """Runs at several values of what varies in one setup: a task of a sweep."""
    base, points = work
    return tuple(run_of(base, x, y) for x, y in points)


def cost_of(work: tuple[Setup, tuple[tuple[float, float], ...]]) -> float:
    """Expected steps of a task: a lightly damped ribbon rings through a slow ramp, or through its hold."""
    base, points = work
    # (between folds that are not known yet, as much as is usual)
    window = 1.0 if len(base.folds) < 2 else abs(base.folds[1].control - base.folds[0].control)
    total = 0.0
    for point in points:
        own = dict(zip(base.over, point, strict=True))
        rate, nu = own.get("rate", base.scene.rate), own.get("damping", base.scene.damping)
        longest = math.inf if base.selection else window / rate
        total += 300.0 + 250.0 * min(10.0 / max(nu, 1e-3), longest)
    return total
