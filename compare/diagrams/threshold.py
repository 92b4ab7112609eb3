"""`threshold`: the value of a scene's parameter at which an outcome begins or ends, refined in the mesh."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from operator import attrgetter
from typing import Any, cast

from compare.limits import edge_ratio, two_point
from compare.models import MESH, warm_up
from compare.sweep import Sweep
from ribbonfem import Scene, SceneError, SolverError
from ribbonfem.frozen import Value
from ribbonfem.options import OptionError, choice, positive, whole_number
from ribbonfem.scene import RIBBON_STATES
from ribbonfem.scene_numbers import with_numbers

from .axes import numbers_of
from .boundaries import Line, search
from .setup import SKIPPING, mesh_of, require_runs, run_of, setup
from .states import two_folds

# meshes that follow each other: rods with half the edge, elements by a third more; the first are the default
_MESHES = {"der": (51, 100, 198, 394), "kirchhoff": (6, 8, 12)}
# of the tolerance: what bisection may take of it
_SHARE = 0.2
# how far around a change of a coarser mesh to look on a finer one
_AROUND = 1.25
_LOOK = 9
# order of the elements' errors in their number
_ELEMENTS_ORDER = 10


@dataclass(frozen=True)
class Change:
    """One change of the outcome.

    Attributes
    ----------
    value, uncertainty: in the limit of the mesh, and how far it may be from there.
    low, high: ends of the band in which both outcomes come; equal where it is a point.
    below, above: outcomes on its two sides.
    meshes: value on each mesh.
    """

    value: float
    uncertainty: float
    low: float
    high: float
    below: str
    above: str
    meshes: Mapping[int, float]

    doubt = property(attrgetter("uncertainty"), doc="The old name of `uncertainty`.")


@dataclass(frozen=True, repr=False, eq=False)
class Threshold(Value):
    """Where an outcome begins or ends as one parameter varies.

    Attributes
    ----------
    value, uncertainty, low, high, below, above: of the first change, see `Change`.
    runs: how many it took.
    changes: all of them, in order.
    scene, outcome, vary, between, model, options: what was asked.
    """

    value: float
    uncertainty: float
    low: float
    high: float
    below: str
    above: str
    runs: int
    changes: tuple[Change, ...]
    scene: Scene
    outcome: str
    vary: str
    between: tuple[float, float]
    model: str
    options: Mapping[str, Any]

    doubt = property(attrgetter("uncertainty"), doc="The old name of `uncertainty`.")

    def __repr__(self) -> str:
        parts = [
            f"{c.below} below and {c.above} above {self.vary} = "
            + (
                f"{c.low:.6g} .. {c.high:.6g} (mixed)"
                if c.high > c.low
                else f"{c.value:.6g} +- {c.uncertainty:.2g}"
            )
            for c in self.changes
        ]
        return f"Threshold({'; '.join(parts)}; {self.model}, {self.runs} runs)"


@dataclass(frozen=True)
class Trial:
    """One run on the way: the scene, what varies and its value, the model and its options."""

    scene: Scene
    vary: str
    value: float
    model: str
    options: Mapping[str, Any]
    selection: bool


def outcome_of(trial: Trial) -> str:
    """The outcome of a trial; empty if it failed."""
    scene = with_numbers(trial.scene, {trial.vary: trial.value})
    if not trial.selection:
        scene = replace(scene, stop=None, hold=0.0)
    try:
        base = setup(scene, trial.model, trial.options)
    except (SceneError, SolverError):
        return ""
    return run_of(base, scene.rate, scene.damping).outcome


def _checked(
    scene: Scene, outcome: str, vary: str, between: object, tolerance: object
) -> tuple[float, float]:
    if not isinstance(scene, Scene):
        raise OptionError(f"scene = {scene!r}: a Scene is needed")
    choice("vary", vary, numbers_of(scene))
    choice("outcome", outcome, (*SKIPPING, *RIBBON_STATES))
    if scene.schedule is not None:
        raise SceneError(f"Scene.schedule = {scene.schedule!r}: thresholds are of ramps at a constant rate")
    if scene.rate < 0.0:
        raise SceneError(
            f"Scene.rate = {scene.rate!r}: say by the drive which way it goes, as Drive(left=-1)"
        )
    if outcome not in SKIPPING and scene.stop is None and vary != "stop":
        raise SceneError("Scene.stop = None: a shape is selected at a stop; give one, or vary it")
    if outcome in SKIPPING and vary == "stop":
        raise OptionError(f"vary = 'stop': {outcome!r} is of a ramp that goes on; a stop selects a shape")
    positive("tolerance", tolerance, 0.5)
    try:
        ends = tuple(cast(Any, between))
    except TypeError:
        ends = ()
    if len(ends) != 2:
        raise OptionError(f"between = {between!r}: (low, high) is needed")
    low, high = positive("between[0]", ends[0]), positive("between[1]", ends[1])
    if not low < high:
        raise OptionError(f"between = {between!r}: low must be below high")
    return low, high


class _Search:
    """Changes on one mesh after the other."""

    def __init__(self, trial: Trial, outcome: str, tolerance: float, sweep: Sweep) -> None:
        self.trial, self.outcome, self.tolerance, self.sweep = trial, outcome, tolerance, sweep
        self.runs = 0

    def on(self, mesh: int, spans: Sequence[tuple[float, float]]) -> list[list[tuple[Any, ...]]]:
        """Changes from or to the outcome in each span, on a mesh."""
        options = {**self.trial.options, MESH[self.trial.model]: mesh}
        look = _LOOK if len(spans) == 1 else 3
        lines = [Line(span, _SHARE * self.tolerance, {}, look) for span in spans]

        def run(work: list[tuple[int, float]]) -> list[str]:
            self.runs += len(work)
            trials = [replace(self.trial, value=value, options=options) for _, value in work]
            warm = self.trial.model
            return self.sweep(f"threshold, {mesh}", outcome_of, trials, prepare=lambda: warm_up(warm))

        search(lines, run)
        for line in lines:
            if not any(line.known.values()):
                raise SolverError(
                    f"no run ended between {line.ends[0]:g} and {line.ends[1]:g}: there is no such ribbon, "
                    "or none that the model follows"
                )
        return [
            [change for change in line.changes() if self.outcome in change[4:]] or self._nothing(line)
            for line in lines
        ]

    def _nothing(self, line: Line) -> list[tuple[Any, ...]]:
        ends = [line.known[x] for x in (min(line.known), max(line.known))]
        raise SolverError(
            f"{self.trial.vary} between {line.ends[0]:g} and {line.ends[1]:g}: no change of "
            f"{self.outcome!r}; at the ends the outcome is {ends[0]!r} and {ends[1]!r}. "
            "Look in a wider range, or for another outcome"
        )


def _limit(model: str, meshes: Sequence[int], values: Sequence[float]) -> tuple[float, float]:
    """The limit of a change on these meshes, and what may be wrong with it."""
    if len(values) < 2:
        return values[-1], math.inf

    def of(a: int, b: int) -> float:
        if model == "der":
            ratio = edge_ratio(meshes[a], meshes[b])
        else:
            ratio = (meshes[b] / meshes[a]) ** _ELEMENTS_ORDER
        return two_point(values[a], values[b], ratio)

    last = len(values) - 1
    best = of(last - 1, last)
    if len(values) == 2:
        # nothing confirms the order yet: all of the step may be wrong
        return best, abs(best - values[-1])
    return best, abs(best - of(last - 2, last - 1))


def threshold(
    scene: Scene,
    outcome: str = "type 2",
    vary: str = "rate",
    between: tuple[float, float] = (0.01, 10.0),
    tolerance: float = 0.01,
    *,
    model: str = "der",
    sweep: Sweep | None = None,
    **options: Any,
) -> Threshold:
    """Where an outcome begins or ends as one parameter of a scene varies, in the limit of the mesh.

    Parameters
    ----------
    scene: of any drive, at a positive rate; for a shape as outcome, with a `stop`.
    outcome: "no skip", "type 1", "type 2", "first only", "none" (of ramps that `skipping_diagram` takes), or
        the name of a shape to be selected.
    vary: "rate", "damping", "compression", "shear", "stop", or another number as in `outcome_diagram`.
    between: values between which to look, positive.
    tolerance: relative, of the limit.
    model: "der" or "kirchhoff"; meshes are refined until the limit is known, or `nodes` or `elements` are
        given: then it is that mesh's value.
    sweep: runs the trials; by default on one worker process a processor.
    options: other keywords of the model's `simulate`.

    Returns
    -------
    `Threshold`: all changes from or to the outcome; where both outcomes come side by side, the band.

    Raises
    ------
    SceneError, OptionError
        For what cannot be.
    SolverError
        If the outcome does not change; names the outcomes at both ends.
    """
    low, high = _checked(scene, outcome, vary, between, tolerance)
    choice("model", model, tuple(_MESHES))
    require_runs(model, options)
    given = options.pop(MESH[model], None)
    meshes = _MESHES[model] if given is None else (whole_number(MESH[model], given, 4),)
    if outcome in SKIPPING and vary in ("rate", "damping"):
        # what is skipped does not vary
        on = mesh_of(model, {**options, MESH[model]: meshes[0]})
        two_folds(replace(scene, rate=1.0, stop=None, hold=0.0, damping=0.0), model, on)
    trial = Trial(scene, vary, low, model, options, outcome not in SKIPPING)
    looking = _Search(trial, outcome, tolerance, sweep or Sweep())
    first = looking.on(meshes[0], [(low, high)])[0]
    tracks: list[list[tuple[Any, ...]]] = [[change] for change in first]
    done = 1
    for mesh in meshes[1:]:
        spans = [(max(low, track[-1][2] / _AROUND), min(high, track[-1][3] * _AROUND)) for track in tracks]
        for track, change in zip(tracks, looking.on(mesh, spans), strict=True):
            track.append(change[0])
        done += 1
        settled = True
        for track in tracks:
            value, uncertainty = _limit(model, meshes[:done], [change[0] for change in track])
            band = any(change[3] > change[2] for change in track)
            settled &= band or uncertainty + track[-1][1] <= tolerance * abs(value)
        if settled:
            break
    changes = tuple(_change(track, meshes[:done], model, given is not None) for track in tracks)
    one = changes[0]
    return Threshold(
        one.value,
        one.uncertainty,
        one.low,
        one.high,
        one.below,
        one.above,
        looking.runs,
        changes,
        scene,
        outcome,
        vary,
        (low, high),
        model,
        options if given is None else {**options, MESH[model]: given},
    )


def _change(track: list[tuple[Any, ...]], meshes: Sequence[int], model: str, single: bool) -> Change:
    """The change that a track of meshes leads to."""
    _, uncertainty, low, high, below, above = track[-1]
    by_mesh = dict(zip(meshes, (change[0] for change in track), strict=True))
    if high > low or single:
        return Change(track[-1][0], uncertainty, low, high, below, above, by_mesh)
    value, error = _limit(model, meshes, [change[0] for change in track])
    return Change(value, error + uncertainty, value, value, below, above, by_mesh)
