"""Refinement of finite elements in motion: levels of mesh and tolerance, and the error claimed of them.

An instant found by adaptive steps errs in proportion to their tolerance, and the clamp turns on meanwhile:
that is what smooth runs scatter by.  For one clamp that turns at a constant rate it was measured over drawn
scenes and tolerances (`ribbonfem calibrate --parts elements`), and a single run claims it.  Of other rigs
runs check each other: they claim that scatter, or twice what the last two differ by; where that is more
than the coarser one scatters by, it counts several times, for a single difference may be small by chance,
and where the one before was much larger, a part of that counts.  Errors fall too unevenly for an
extrapolation, also on steps that are halved one by one.

A run reads off itself whether it vibrates: a ribbon that snaps twice and has not forgotten its first
vibration when it snaps again remembers every error made on the way, and two runs may agree by chance.  Three
runs at least check each other then, and the larger of their differences counts.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import pairwise
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np

from ribbonfem import History, Scene, SceneError, SolverError, elastica, kirchhoff

from .refinement import SCATTER, Run, Settled, apart, endless, timed, upward, vibrates

# Tolerances (L) of single runs, coarsest first, and their typical CPU seconds; from one run to the next on
# the way to an answer the tolerance falls by _FINER.
TOLERANCES = (1e-4, 3e-5, 1e-5, 3e-6, 1e-6, 3e-7, 1e-7, 3e-8, 1e-8, 3e-9)
SECONDS = {
    "kirchhoff": (0.009, 0.009, 0.01, 0.018, 0.027, 0.06, 0.11, 0.25, 0.45, 0.9),
    "elastica": (0.0014, 0.002, 0.0029, 0.0047, 0.0079, 0.014, 0.037, 0.058, 0.1, 0.21),
}
_FINER = 10.0**0.5
MODELS: Mapping[str, ModuleType] = {"elastica": elastica, "kirchhoff": kirchhoff}
# Scatter of a smooth run's snap over its tolerance (L), by nu t* and rate t*: a + b / nu + c rate^d, rad,
# with _RINGING for a smaller nu.  Below _FALLING it falls as the root of the tolerance.  (Errors, those of
# the mesh added, were at most .85 of it in 600 planar scenes, .61 in 60 ribbons, at tolerances of 3e-5 to
# 1e-7: `calibrate --parts elements --ribbons 100`.)
_SCATTER = {"kirchhoff": (0.8, 0.0, 4.0, 1.0), "elastica": (0.4, 0.28, 3.5, 1.4)}
_RINGING, _FALLING = 0.1, 1e-7
# Part of what is asked for that a run is to scatter by: its tolerance is rounded to three digits.
_WITHIN = 0.99
# rate t*, nu t*, h/L and dL/L for which it was measured
_MEASURED = ((0.01, 15.0), (0.05, 60.0), (0.004, 0.02))
_COMPRESSIONS = {"kirchhoff": (0.1, 0.5), "elastica": (0.05, 0.5)}
# and of planar runs the elements, by the least tolerance (L) for which they are enough
_PLANAR_MESHES = ((5e-5, 4), (3e-7, 8), (6e-8, 12), (0.0, 16))
# Claimed of a ribbon that vibrates: this much of a smooth run's scatter, without the root, or of the larger
# of the last two differences.
_VIBRATING, _VIBRATING_MOVES = 2.0, 3.0
# Claimed of a difference that may be scatter: some overdamped scenes err as the root of the tolerance.
_SMOOTH = 2.0
# Claimed of a difference that is no scatter and stands alone, and of the last of several, which counts as at
# least this part of the one before.
_ALONE, _LATEST, _BEFORE = 6.0, 2.0, 0.3
# A mesh of fewer elements that fails, or lacks the start, is passed over.
_SURE = 8
# Differences (rad) up to which runs that no longer close in on a limit leave nothing undecided.
_SMALL = 1e-4


def scatter(scene: Scene, local: float, vibrating: bool = False) -> float:
    """What the snap of a run at a tolerance `local` (L) may be wrong by, its mesh aside, rad."""
    if vibrating:
        return _VIBRATING * _per_tolerance(scene) * local
    return _per_tolerance(scene) * max(local, math.sqrt(local * _FALLING))


def _per_tolerance(scene: Scene) -> float:
    """That scatter over the tolerance, where it is in proportion."""
    rest, ringing, factor, power = _SCATTER[model_of(scene)]
    return rest + ringing / max(_RINGING, scene.scaled_damping) + factor * speed(scene) ** power


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


def _measured(scene: Scene) -> bool:
    """Whether the error of single runs was measured for scenes like this one."""
    if not scene.usual or upward(scene).rate < 0.0:
        return False
    values = abs(scene.scaled_rate), scene.scaled_damping, scene.ribbon.thickness / scene.ribbon.length
    within = (*_MEASURED, _COMPRESSIONS[model_of(scene)])
    pairs = zip((*values, scene.compression), within, strict=True)
    return all(low <= value <= high for value, (low, high) in pairs)


def elements_for(local: float) -> int:
    """An even number on whose mesh the error in space is below that of a tolerance `local` (L) in time."""
    return 2 * math.ceil(2.0 * math.log10(TOLERANCES[0] / local) + 2.0 - 1e-9)


def enough_for(model: str, local: float) -> int:
    """Elements of a single run at a tolerance `local` (L): four cost little more than one."""
    if model == "elastica":
        return next(count for least, count in _PLANAR_MESHES if local >= least)
    return max(8, 4 * math.ceil(elements_for(local) / 4))


def first_runs(scene: Scene, tolerance: float) -> list[tuple[int, float]]:
    """Elements and tolerance (L) of the runs of an answer, in order: the second scatters little enough.

    (Of the finest runs three are better than two.)
    """
    finest, coarsest = TOLERANCES[-1] * _FINER, TOLERANCES[0] / _FINER
    fine = min(max(_tolerance_for(scene, _WITHIN * tolerance), finest), coarsest)
    return [(count, float(f"{local:.3g}")) for count, local in _finer_runs(fine, -1)]


def _finer_runs(local: float, first: int) -> list[tuple[int, float]]:
    """Elements and tolerance (L), finer and finer, from so many levels below a tolerance on."""
    last = int(math.log(local / TOLERANCES[-1], _FINER) + 1e-9)
    tolerances = [local * _FINER**-k for k in range(first, last + 1)]
    return [(elements_for(each), each) for each in tolerances]


class Single(NamedTuple):
    """A run that needs no other to check it.

    Attributes
    ----------
    elements, tolerance: of the run; L.
    error: of the snap, rad.
    seconds: of CPU, typically.
    """

    elements: int
    tolerance: float
    error: float
    seconds: float


def alone(scene: Scene, tolerance: float) -> Single | None:
    """The single run that will do, where its error was measured; None if it was not.

    A ribbon's is checked all the same if it vibrates.
    """
    # the second of the runs that would check each other scatters little enough
    _, local = first_runs(scene, tolerance)[1]
    error = scatter(scene, local)
    if not _measured(scene) or error > tolerance:
        return None
    return Single(enough_for(model_of(scene), local), local, error, _typical(scene, local))


def model_of(scene: Scene) -> str:
    """The model of the runs."""
    return "elastica" if scene.planar else "kirchhoff"


def seconds(scene: Scene, tolerance: float) -> float:
    """Typical CPU seconds of the first two runs of an answer."""
    return sum(_typical(scene, local) for _, local in first_runs(scene, tolerance)[:2])


def _typical(scene: Scene, local: float) -> float:
    """Typical CPU seconds of a run at a tolerance (L)."""
    table = np.log(SECONDS[model_of(scene)])
    return float(np.exp(np.interp(math.log(local), np.log(TOLERANCES[::-1]), table[::-1])))


def _closing(values: list[float | None]) -> bool:
    """Whether the last three values close in on a limit."""
    recent = values[-3:]
    if len(recent) < 3:
        return False
    before, last = apart(recent[0], recent[1]), apart(recent[1], recent[2])
    return math.isfinite(last) and last <= 0.6 * before + 1e-9


def _claimed(
    values: list[float | None], scatters: list[float], vibrating: bool, measured: bool = True
) -> float:
    """How far the last of two or more values may be from the limit.

    `measured`: whether smooth runs are known to scatter by no more than `scatters`.
    """
    moves = [apart(a, b) for a, b in pairwise(values)]
    if values[-1] is None:
        # no instant, nothing that scatters
        return 0.0 if moves[-1] == 0.0 else math.inf
    if vibrating:
        return max(scatters[-1], _VIBRATING_MOVES * max(moves[-2:])) if len(moves) > 1 else math.inf
    parts = [move / coarse for move, coarse in zip(moves[-2:], scatters[:-1][-2:], strict=True)]
    if measured and max(parts) <= 1.0:
        return max(scatters[-1], _SMOOTH * moves[-1])
    if len(moves) == 1:
        return max(scatters[-1], _ALONE * moves[0])
    return max(scatters[-1], _LATEST * max(moves[-1], _BEFORE * moves[-2]))


def elements(scene: Scene, quantity: str, tolerance: float, *, configurations: bool = False) -> Settled:
    """Run the elements on finer and finer meshes until an instant has settled to a tolerance.

    Parameters
    ----------
    scene: with or without `stop`.
    quantity: "snap" or "first snap".
    tolerance: rad.

    Raises
    ------
    SceneError, SolverError
        As the model does.
    """
    whole, model = endless(scene), model_of(scene)

    def made(count: int, local: float) -> tuple[Run, History, bool]:
        """A run, its motion, and whether it vibrates."""
        options: dict[str, Any] = {"elements": count, "tolerance": local, "extensible": True}
        options |= {"configurations": configurations, "until": "snap"}
        run, history = timed(model, MODELS[model].simulate, whole, quantity, options)
        # (the mid tangent of a planar beam is level at rest and crosses nothing)
        return run, history, quantity != "first snap" and not scene.planar and vibrates(history, scene)

    law, single, meshes = alone(scene, tolerance), None, first_runs(scene, tolerance)
    if law:
        single = made(law.elements, law.tolerance)
        run, history, vibrating = single
        if not vibrating and run.value is not None:
            return Settled(run.value, law.error, False, (run,), history)
        # coarser ones check it as well as finer ones do, for less
        coarser = (local for k in (2, 1) if (local := law.tolerance * _FINER**k) <= TOLERANCES[0])
        meshes = [(enough_for(model, local), local) for local in coarser]
        meshes += [law[:2], *_finer_runs(law.tolerance, 1)]
    runs: list[Run] = []
    values: list[float | None] = []
    scatters: list[float] = []
    last: History | None = None
    error, vibrating, sensitive = math.inf, False, False
    for count, local in meshes:
        try:
            run, last, vibrates_too = (
                single if single and law and local == law.tolerance else made(count, local)
            )
        except (SceneError, SolverError):
            if count >= _SURE:
                raise
            continue
        vibrating = vibrating or vibrates_too
        runs.append(run)
        values.append(run.value)
        scatters.append(scatter(scene, local, vibrating))
        if len(values) == 1:
            continue
        error = _claimed(values, scatters, vibrating, scene.usual)
        if error <= tolerance:
            return Settled(values[-1], error, False, tuple(runs), last)
        # runs that close in on a limit leave a tolerance unmet, and nothing undecided
        moved = apart(values[-2], values[-1])
        sensitive = not _closing(values) and moved > _SMALL
        lost = moved > (max(4.0 * tolerance, _SMALL) if vibrating else SCATTER)
        if len(values) > 3 and sensitive and lost:
            break
    return Settled(values[-1], error, sensitive, tuple(runs), last)
