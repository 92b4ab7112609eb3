"""Runs refined until their answer has settled: the error is read off the runs themselves.

Rods are run on one mesh after the other and extrapolated to N -> infinity by a polynomial in the
square of the edge, through the last three meshes at most.  What the extrapolation may miss is
estimated from how far it reaches.  Of two meshes, an eighth of the step to the limit where the
coarser has 31 nodes, and less in proportion to the square of its edge; of three, a quarter of the
difference to the limit of the last two; of either, all of it where the step is as long as 0.04 rad, or
not short against the angle itself, for then the meshes do not yet see the same; and never less than the
part of the step that this makes.

A ribbon that vibrates between its two snaps remembers every error made on the way.  Where its free
vibration has not died out when it snaps again the error in time is measured too.  What does not
settle is called sensitive: no single run decides it.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import der
from compare.limits import limit_of
from compare.quantities.measure import require_moving
from ribbonfem import History, Scene, SceneError, SolverError
from ribbonfem.results import Value

from .cost_laws import RibbonLaws, beam_units

# what crosses zero at each instant that can be asked for
CROSSINGS = {"snap": "height", "first snap": "slope", "snap time": "height"}
# snaps this far apart (rad) that further refinement does not bring together come out of a vibration
SCATTER = 0.02
# e-foldings of a free vibration's energy after which it is forgotten
_FORGOTTEN = 12.0
# how far beyond the stop, in rad, to look for a snap that may belong before it
_BEYOND = 0.3
# a vibration converges less evenly: its estimates are multiplied by this
_VIBRATING = 4.0
# finest mesh on which a vibration is followed, and the coarsest whose scatter is believed
_VIBRATED_MESH = 151


@dataclass(frozen=True, eq=False)
class Run(Value):
    """A run on the way to an answer: model and options, the angle found (rad, None: no snap), CPU seconds."""

    model: str
    options: Mapping[str, Any]
    value: float | None
    seconds: float


@dataclass(frozen=True, eq=False)
class Settled(Value):
    """Where refinement came to.

    Attributes
    ----------
    value: the angle, rad; None where the ribbon does not snap.
    error: what may be wrong with it; infinite where the runs do not agree that there is a snap.
    sensitive: whether refinement did not settle it.
    runs: in their order.
    history: the finest run.
    """

    value: float | None
    error: float
    sensitive: bool
    runs: tuple[Run, ...]
    history: History | None


def _instant(history: History, quantity: str) -> float | None:
    """The control, or the time (s), at an instant."""
    result = history.snap if CROSSINGS[quantity] == "height" else history.crossing("slope")
    if result is None or quantity == "snap time":
        return result and result[0]
    require_moving(history, result[0], quantity)
    return result[1]


def timed(
    name: str, simulate: Callable[..., History], scene: Scene, quantity: str, options: dict[str, Any]
) -> tuple[Run, History]:
    """A run of a model by its `simulate`: what it found, and the motion."""
    begin = time.process_time()
    history = simulate(scene, **options)
    return Run(name, options, _instant(history, quantity), time.process_time() - begin), history


def apart(a: float | None, b: float | None) -> float:
    """Distance of two angles; none at all if both are missing, an infinite one if one is."""
    if a is None or b is None:
        return 0.0 if a is b else math.inf
    return abs(a - b)


def stopped(scene: Scene, settle: Callable[[Scene], Settled], quantity: str = "snap") -> Settled:
    """Settle a scene by `settle`, and call it sensitive if it snaps within its error of the stop.

    Meshes that all stop short of a snap agree on nothing, for their limit may have one: they are run
    on beyond the stop.
    """
    result = settle(scene)
    if scene.stop is None or scene.hold > 0.0 or result.sensitive or quantity == "snap time":
        return result
    if result.value is not None:
        # a limit beyond the stop: the meshes that snap do so for their errors
        inside = abs(result.value) + result.error < abs(scene.stop)
        return result if inside else replace(result, sensitive=True)
    beyond = min(_BEYOND, 0.5 * (scene.reach_towards(scene.direction) - abs(scene.stop)))
    if beyond <= 0.0:
        return result
    further = settle(replace(scene, stop=scene.stop + math.copysign(beyond, scene.stop)))
    runs = (*result.runs, *further.runs)
    near = further.value is not None and abs(further.value) - further.error < abs(scene.stop)
    if further.sensitive or near:
        return Settled(None, math.inf, True, runs, result.history)
    return replace(result, runs=runs)


def endless(scene: Scene) -> Scene:
    """The scene with an end: a ramp without one goes on for a turn, or as far as the chord allows."""
    if scene.stop is not None or scene.schedule is not None:
        return scene
    far = min(2.0 * math.pi if scene.clamps_turn else math.inf, scene.reach_towards(scene.direction))
    return replace(scene, stop=math.copysign(far, scene.rate))


def _tenth(tolerance: float) -> float:
    return float(f"{0.1 * tolerance:.6g}")


def vibrates(history: History, scene: Scene) -> bool:
    """Whether the ribbon still remembers its first snap when it passes z = 0."""
    first, last = history.crossing("slope"), history.crossing("height")
    if first is None or last is None:
        return False
    wait = last[0] - first[0]
    return wait > 0.0 and scene.damping * wait < _FORGOTTEN


class _Rods:
    """Runs of rods at one tolerance in time."""

    def __init__(self, scene: Scene, quantity: str, tolerance: float, configurations: bool) -> None:
        self.scene, self.quantity, self.tolerance = scene, quantity, tolerance
        self.configurations = configurations
        self.runs: list[Run] = []
        self.meshes: list[int] = []
        self.values: list[float | None] = []
        self.history: History | None = None
        self.failure: Exception | None = None

    def add(self, nodes: int) -> None:
        """Run on a mesh; one on which the start does not exist yet is passed over."""
        options = {
            "nodes": nodes,
            "tolerance": self.tolerance,
            "configurations": self.configurations,
            "until": "snap",
        }
        begin = time.process_time()
        try:
            run, self.history = timed("der", der.simulate, self.scene, self.quantity, options)
        except (SceneError, SolverError) as error:
            self.failure = error
            self.runs.append(Run("der", options, None, time.process_time() - begin))
            return
        self.runs.append(run)
        self.meshes.append(nodes)
        self.values.append(run.value)

    def limit(self) -> tuple[float | None, float]:
        """Value and error of what was run so far."""
        recent = self.values[-3:]
        result = [value for value in recent if value is not None]
        if len(recent) < 2 or (result and len(result) < len(recent)):
            return None, math.inf
        if not result:
            return None, 0.0
        return limit_of(result, self.meshes[-3:])

    def closing(self) -> bool:
        """Whether the last three meshes close in on a limit: those of two pairs lie close together."""
        recent = [value for value in self.values[-3:] if value is not None]
        if len(recent) < 3:
            return False
        coarse, _ = limit_of(recent[:2], self.meshes[-3:-1])
        fine, _ = limit_of(recent[1:], self.meshes[-2:])
        return abs(fine - coarse) <= 0.5 * abs(fine - recent[-1]) + 1e-9

    def scattered(self) -> bool:
        """Whether three meshes, none of them coarse, neither agree nor come closer to each other."""
        recent = self.values[-3:]
        if len(recent) < 3 or self.meshes[-1] < _VIBRATED_MESH:
            return False
        a, b, c = (math.inf if value is None else value for value in recent)
        if not math.isfinite(c):
            return math.isfinite(a) or math.isfinite(b)
        return abs(c - b) > SCATTER and not abs(c - b) < 0.6 * abs(b - a)


def _finer_in_time(series: _Rods, tolerance: float, bound: float) -> tuple[_Rods, float, list[Run]]:
    """Smaller errors in time, measured on the coarsest mesh, where the law's bound is not small enough.

    Returns
    -------
    The runs to go on with, their error in time, and the runs that this took besides.
    """
    done: list[Run] = []
    for _ in range(2):
        again = _Rods(series.scene, series.quantity, _tenth(series.tolerance), series.configurations)
        again.add(series.meshes[0])
        if not again.values:
            break
        moved = apart(series.values[0], again.values[0])
        if 2.0 * moved <= tolerance / 3.0:
            return series, 2.0 * moved, done + again.runs
        # the error falls as the tolerance to the power 2/3: by 4.6, and what is left is 0.28 of the move
        series, bound, done = again, 0.56 * moved, done + series.runs
        if bound <= tolerance / 3.0:
            break
    return series, bound, done


def rods(
    scene: Scene,
    quantity: str,
    tolerance: float,
    laws: RibbonLaws,
    *,
    first: int = 1,
    configurations: bool = False,
) -> Settled:
    """Run rods on finer and finer meshes until the limit of an instant has settled to a tolerance.

    Parameters
    ----------
    scene: with or without `stop`.
    quantity: "snap" or "first snap".
    tolerance: rad.
    laws: the meshes, and the error of the integration in time.
    first: number of the finest mesh to begin with; two coarser ones go before it.

    Raises
    ------
    SceneError, SolverError
        If no mesh has the start state, or every run fails.
    """
    whole = endless(scene)
    step, error_in_time = laws.tolerance(scene, tolerance)
    meshes = list(laws.meshes[laws.beginning(first).start :])
    series = _Rods(whole, quantity, step, configurations)
    begin = len(laws.meshes[laws.beginning(first)])
    while meshes and not series.values:
        series.add(meshes.pop(0))
    done: list[Run] = []
    trust = 1.0
    if quantity == "snap" and series.history is not None and vibrates(series.history, scene):
        begin, trust = 3, _VIBRATING
        meshes = [nodes for nodes in meshes if nodes <= _VIBRATED_MESH]
        for last in (False, True):
            # the same mesh again with smaller errors in time: what the vibration makes of them
            again = _Rods(whole, quantity, _tenth(series.tolerance), configurations)
            again.add(series.meshes[0])
            moved = apart(series.values[0], again.values[0]) if again.values else math.inf
            error_in_time = max(error_in_time, 2.0 * moved)
            if 4.0 * moved <= tolerance:
                done += again.runs
                break
            done += series.runs
            # another tenth would bring some fifth of it: not enough
            if last or moved > 4.0 * tolerance:
                value = again.values[0] if again.values else None
                return Settled(value, 2.0 * moved, True, (*done, *again.runs), again.history)
            series, error_in_time = again, 0.0
    elif series.values and error_in_time > tolerance / 3.0:
        series, error_in_time, done = _finer_in_time(series, tolerance, error_in_time)
    while True:
        value, error = series.limit() if len(series.values) >= begin else (None, math.inf)
        total = trust * error + (error_in_time if value is not None else 0.0)
        settled = total <= tolerance
        if settled and trust == 1.0 and series.history is not None and vibrates(series.history, scene):
            # the coarsest mesh did not show it
            trust = _VIBRATING
            continue
        if settled or series.scattered() or not meshes:
            if series.history is None and series.failure is not None:
                raise series.failure
            # meshes that close in on a limit leave a tolerance unmet, and nothing undecided
            sensitive = not settled and not series.closing()
            return Settled(value, total, sensitive, (*done, *series.runs), series.history)
        series.add(meshes.pop(0))


def upward(scene: Scene) -> Scene:
    """A scene or its mirror image, whichever starts from a state with z > 0."""
    return scene if scene.start.startswith("U+") else scene.mirror


def expected_steps(scene: Scene) -> float:
    """Steps for which a rod rings between its two snaps, some 250 a t*; 0 where it has only one."""
    if scene.start not in ("U+S+", "U-S+"):
        return 0.0
    _, rate, damping, _ = beam_units(scene)
    return 250.0 * min(10.0 / max(damping, 1e-9), 0.3 / rate)
