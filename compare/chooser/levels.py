"""Refinement of finite elements in motion: levels of mesh and tolerance, and the error claimed of them.

The error that is claimed is the larger of two. One is what smooth runs scatter by: an instant found by
adaptive steps errs in proportion to their tolerance, and the clamp turns on meanwhile. The other is twice
what the last runs differ by; where that is more than the coarser one scatters by, or where no such scatter
was measured, it counts several times, for a single difference may be small by chance, and where the one
before was much larger, a part of that counts. Errors fall too unevenly for an extrapolation, also on steps
that are halved one by one.

A run reads off itself whether it rattles: a ribbon that snaps twice and has not forgotten its first
vibration when it snaps again remembers every error made on the way. It is checked by finer runs wherever it
lies, scatters by more, and if they differ by more than smooth ones would, their differences count more.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import pairwise
from types import ModuleType
from typing import Any

import numpy as np

from ribbonfem import History, Ribbon, Scene, SceneError, SolverError, elastica, kirchhoff

from .cost_laws import ElementLaws
from .refinement import SCATTER, Run, Settled, apart, endless, rattles, timed

# Tolerances (L) of single runs, coarsest first, and their typical CPU seconds; from one run to the next on
# the way to an answer the tolerance falls by _FINER.
TOLERANCES = (1e-4, 3e-5, 1e-5, 3e-6, 1e-6, 3e-7, 1e-7, 3e-8, 1e-8, 3e-9)
SECONDS = {
    "kirchhoff": (0.01, 0.013, 0.018, 0.045, 0.08, 0.15, 0.25, 0.6, 1.5, 4.0),
    "elastica": (0.0035, 0.0047, 0.0056, 0.009, 0.014, 0.028, 0.044, 0.1, 0.2, 0.4),
}
_FINER = 10.0**0.5
MODELS: Mapping[str, ModuleType] = {"elastica": elastica, "kirchhoff": kirchhoff}
# Scatter of the snap over tolerance (L) times rate t* + _REST, rad; of 789 answers one was beyond.
# Below _FALLING it falls as the root of the tolerance.
_SCATTER = {"kirchhoff": 8.0, "elastica": 4.5}
_REST, _FALLING = 0.2, 1e-7
# A ribbon that rattles remembers every error made on the way: at 21 tolerances it was within 4.2 times that.
_RATTLE = 5.0
# part of it that a law of single runs, which knows where they ring, claims at least
_LAWFUL = 0.25
# Claimed of a difference that may be scatter: some overdamped scenes err as the root of the tolerance.
_SMOOTH = 2.0
# Claimed of a difference that is no scatter and stands alone, and of the last of several, which counts as at
# least this part of the one before.
_ALONE, _LATEST, _BEFORE = 6.0, 2.0, 0.3
# The same of a ribbon that rattles: it snaps at one vibration or another, and two runs may agree by chance.
_RATTLE_ALONE, _RATTLE_BEFORE = 20.0, 1.0
# A mesh of fewer elements that fails, or lacks the start, is passed over.
_SURE = 8
# Differences (rad) up to which runs that no longer close in on a limit leave nothing undecided.
_SMALL = 1e-4


def scatter(scene: Scene, local: float) -> float:
    """What the snap of a smooth run at a tolerance `local` (L) may be wrong by, its mesh aside, rad."""
    return _per_tolerance(scene) * max(local, math.sqrt(local * _FALLING))


def _per_tolerance(scene: Scene) -> float:
    """That scatter over the tolerance, where it is in proportion."""
    return _SCATTER[model_of(scene)] * (speed(scene) + _REST)


def _tolerance_for(scene: Scene, error: float) -> float:
    """The tolerance (L) at which smooth runs scatter by `error` (rad)."""
    local = error / _per_tolerance(scene)
    return min(local, local**2 / _FALLING)


def speed(scene: Scene) -> float:
    """The largest speed of the control, per t*."""
    if scene.schedule is None:
        return abs(scene.scaled_rate)
    # (of points that are told, chords will do)
    steps = np.diff(scene.schedule.time)
    moved = np.abs(np.diff(scene.schedule.value))[steps > 0.0] / steps[steps > 0.0]
    return float(moved.max()) * scene.ribbon.inertial_time


def covered(scene: Scene, laws: ElementLaws) -> bool:
    """Whether the laws were measured for ribbons like this one."""
    if scene.planar:
        # (those of single planar runs are the elastica's own)
        return False
    low, high = laws.rate
    weak, strong = laws.damping
    return (
        scene.usual
        and scene.ribbon == Ribbon()
        and low <= abs(scene.scaled_rate) <= high
        and weak <= scene.scaled_damping <= strong
        and 0.1 <= scene.compression <= 0.5
    )


def elements_for(local: float) -> int:
    """An even number on whose mesh the error in space is below that of a tolerance `local` (L) in time."""
    return 2 * math.ceil(2.0 * math.log10(TOLERANCES[0] / local) + 2.0 - 1e-9)


def first_runs(scene: Scene, tolerance: float) -> list[tuple[int, float]]:
    """Elements and tolerance (L) of the runs of an answer, in order: the second scatters little enough.

    (Of the finest runs three are better than two.)
    """
    finest, coarsest = TOLERANCES[-1] * _FINER, TOLERANCES[0] / _FINER
    fine = min(max(_tolerance_for(scene, 0.95 * tolerance), finest), coarsest)
    return [(count, float(f"{local:.3g}")) for count, local in _finer_runs(fine, -1)]


def _finer_runs(local: float, first: int) -> list[tuple[int, float]]:
    """Elements and tolerance (L), finer and finer, from so many levels below a tolerance on."""
    last = int(math.log(local / TOLERANCES[-1], _FINER) + 1e-9)
    tolerances = [local * _FINER**-k for k in range(first, last + 1)]
    return [(elements_for(each), each) for each in tolerances]


def alone(scene: Scene, tolerance: float, laws: ElementLaws) -> tuple[int, float] | None:
    """The level of the laws on which one run will do, where that is cheaper than two, and its error."""
    if not covered(scene, laws):
        return None
    bounds = [max(b, _LAWFUL * scatter(scene, t)) for b, (_, t) in zip(laws.bound, laws.levels, strict=True)]
    level = next((k for k, bound in enumerate(bounds) if bound <= tolerance), None)
    if level is None or laws.seconds[level] > seconds(scene, tolerance):
        return None
    return level, bounds[level]


def model_of(scene: Scene) -> str:
    """The model of the runs."""
    return "elastica" if scene.planar else "kirchhoff"


def seconds(scene: Scene, tolerance: float) -> float:
    """Typical CPU seconds of the first two runs of an answer."""
    table = np.log(SECONDS[model_of(scene)])
    at = [math.log(local) for _, local in first_runs(scene, tolerance)[:2]]
    return float(np.exp(np.interp(at, np.log(TOLERANCES[::-1]), table[::-1])).sum())


def _closing(values: list[float | None]) -> bool:
    """Whether the last three values close in on a limit."""
    recent = values[-3:]
    if len(recent) < 3:
        return False
    before, last = apart(recent[0], recent[1]), apart(recent[1], recent[2])
    return math.isfinite(last) and last <= 0.6 * before + 1e-9


def _claimed(
    values: list[float | None], scatters: list[float], rattling: bool, measured: bool = True
) -> float:
    """How far the last of two or more values may be from the limit.

    `measured`: whether smooth runs are known to scatter by no more than `scatters`.
    """
    moves, least = [apart(a, b) for a, b in pairwise(values)], scatters[-1] * (_RATTLE if rattling else 1.0)
    if values[-1] is None:
        # no instant, nothing that scatters
        return 0.0 if moves[-1] == 0.0 else math.inf
    parts = [move / coarse for move, coarse in zip(moves[-2:], scatters[:-1][-2:], strict=True)]
    smooth = max(parts) <= 1.0
    rattling = rattling and not smooth
    if measured and smooth:
        return max(least, _SMOOTH * moves[-1])
    if len(moves) == 1:
        return max(least, (_RATTLE_ALONE if rattling else _ALONE) * moves[0])
    before = (_RATTLE_BEFORE if rattling else _BEFORE) * moves[-2]
    return max(least, _LATEST * max(moves[-1], before))


def elements(
    scene: Scene, quantity: str, tolerance: float, laws: ElementLaws, *, configurations: bool = False
) -> Settled:
    """Run the elements on finer and finer meshes until an instant has settled to a tolerance.

    Parameters
    ----------
    scene: with or without `stop`.
    quantity: "snap" or "first snap".
    tolerance: rad.
    laws: of single runs.

    Raises
    ------
    SceneError, SolverError
        As the model does.
    """
    whole, law, model = endless(scene), alone(scene, tolerance, laws), model_of(scene)
    if law:
        # if it rattles, finer ones check it
        single = laws.levels[law[0]]
        meshes = [single, *_finer_runs(single[1], 1)]
    else:
        meshes = first_runs(scene, tolerance)
    runs: list[Run] = []
    values: list[float | None] = []
    scatters: list[float] = []
    history: History | None = None
    error, rattling, sensitive = math.inf, False, False
    for count, local in meshes:
        options: dict[str, Any] = {"elements": count, "tolerance": local, "extensible": True}
        options |= {"configurations": configurations, "until": "snap"}
        try:
            run, history = timed(model, MODELS[model].simulate, whole, quantity, options)
        except (SceneError, SolverError):
            if count >= _SURE:
                raise
            continue
        runs.append(run)
        values.append(run.value)
        scatters.append(scatter(scene, local))
        # (the mid tangent of a planar beam is level at rest and crosses nothing)
        rattling = rattling or (quantity != "first snap" and not scene.planar and rattles(history, scene))
        if law and len(runs) == 1 and not rattling and run.value is not None:
            return Settled(run.value, law[1], False, tuple(runs), history)
        if len(values) == 1:
            continue
        error = _claimed(values, scatters, rattling, scene.usual)
        if error <= tolerance:
            return Settled(values[-1], error, False, tuple(runs), history)
        # runs that close in on a limit leave a tolerance unmet, and nothing undecided
        moved = apart(values[-2], values[-1])
        sensitive = not _closing(values) and moved > _SMALL
        lost = moved > (max(4.0 * tolerance, _SMALL) if rattling else SCATTER)
        if len(values) > 2 and sensitive and lost:
            break
    return Settled(values[-1], error, sensitive, tuple(runs), history)
