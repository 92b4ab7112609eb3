"""Refinement of finite elements in motion: levels of mesh and tolerance, and the error claimed of them.

The error that is claimed is the larger of two.  One is what the last runs differ by, times a factor: a single
difference may be small by chance, so it counts more than the last of several; and where the one before was
much larger, a part of that counts.  The other is the scatter of smooth runs, within which two of them agree
by chance or do not: an instant found by adaptive steps errs in proportion to their tolerance, and the clamp
turns on meanwhile.  Errors fall too unevenly for an extrapolation.

A run reads off itself whether it rattles: a ribbon that snaps twice and has not forgotten its first vibration
when it snaps again remembers every error made on the way.  It is checked by finer runs wherever it lies, and
if they differ by more than smooth ones would, their differences count more.
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

# Elements and tolerance (L) of runs that check each other, no two on the same mesh; typical CPU seconds,
# of the Kirchhoff rod and of the elastica.
LEVELS = (
    (4, 1e-4, 0.01, 0.0035),
    (6, 3e-5, 0.013, 0.0047),
    (8, 1e-5, 0.018, 0.0056),
    (10, 3e-6, 0.045, 0.009),
    (12, 1e-6, 0.08, 0.014),
    (14, 3e-7, 0.15, 0.028),
    (16, 1e-7, 0.25, 0.044),
    (20, 3e-8, 0.6, 0.1),
    (24, 1e-8, 1.5, 0.2),
)
MODELS: Mapping[str, ModuleType] = {"elastica": elastica, "kirchhoff": kirchhoff}
# Scatter of the snap over tolerance (L) times rate t* + _REST, rad.
_SCATTER, _REST = 2.0, 0.1
# Claimed of a difference that stands alone, and of the last of several, which counts as at least this part of
# the one before.
_ALONE, _LATEST, _BEFORE = 6.0, 2.0, 0.3
# The same of a ribbon that rattles: it snaps at one vibration or another, and two runs may agree by chance.
_RATTLE_ALONE, _RATTLE_BEFORE = 20.0, 1.0
# Runs that differ by so many scatters of the coarser are not smooth.
_ROUGH = 4.0
# A mesh of fewer elements that fails, or lacks the start, is passed over.
_SURE = 8
# Differences (rad) up to which runs that no longer close in on a limit leave nothing undecided.
_SMALL = 1e-4


def scatter(scene: Scene, local: float) -> float:
    """What the snap of a smooth run at a tolerance `local` (L) may be wrong by, its mesh aside, rad."""
    return _SCATTER * local * (speed(scene) + _REST)


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


def first_level(scene: Scene, tolerance: float) -> int:
    """The number of the level to begin with: the next is the first whose scatter leaves some room."""
    # (the last but one: of the finest runs three are better than two)
    last = len(LEVELS) - 2
    fits = (k for k in range(1, last) if scatter(scene, LEVELS[k][1]) <= 0.5 * tolerance)
    return next(fits, last) - 1


def alone(scene: Scene, tolerance: float, laws: ElementLaws) -> tuple[int, float] | None:
    """The level of the laws on which one run will do, where that is cheaper than two, and its error."""
    if not covered(scene, laws):
        return None
    bounds = [max(b, scatter(scene, t)) for b, (_, t) in zip(laws.bound, laws.levels, strict=True)]
    level = next((k for k, bound in enumerate(bounds) if bound <= tolerance), None)
    if level is None or laws.seconds[level] > seconds(scene, first_level(scene, tolerance)):
        return None
    return level, bounds[level]


def model_of(scene: Scene) -> str:
    """The model of the runs."""
    return "elastica" if scene.planar else "kirchhoff"


def seconds(scene: Scene, level: int) -> float:
    """Typical CPU seconds of the two runs that begin with a level."""
    place = 3 if scene.planar else 2
    return LEVELS[level][place] + LEVELS[level + 1][place]


def _closing(values: list[float | None]) -> bool:
    """Whether the last three values close in on a limit."""
    recent = values[-3:]
    if len(recent) < 3:
        return False
    before, last = apart(recent[0], recent[1]), apart(recent[1], recent[2])
    return math.isfinite(last) and last <= 0.6 * before + 1e-9


def _claimed(values: list[float | None], scatters: list[float], rattling: bool) -> float:
    """How far the last of two or more values may be from the limit."""
    moves = [apart(a, b) for a, b in pairwise(values)]
    if values[-1] is None:
        # no instant, nothing that scatters
        return 0.0 if moves[-1] == 0.0 else math.inf
    recent = zip(moves[-2:], scatters[-3:-1] if len(moves) > 1 else scatters[:1], strict=True)
    rattling = rattling and any(moved > _ROUGH * coarse for moved, coarse in recent)
    if len(moves) == 1:
        return max(scatters[-1], (_RATTLE_ALONE if rattling else _ALONE) * moves[0])
    before = (_RATTLE_BEFORE if rattling else _BEFORE) * moves[-2]
    return max(scatters[-1], _LATEST * max(moves[-1], before))


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
        meshes = [single, *((n, t) for n, t, *_ in LEVELS if t < single[1])]
    else:
        meshes = [(n, t) for n, t, *_ in LEVELS[first_level(scene, tolerance) :]]
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
        error = _claimed(values, scatters, rattling)
        if error <= tolerance:
            return Settled(values[-1], error, False, tuple(runs), history)
        # runs that close in on a limit leave a tolerance unmet, and nothing undecided
        moved = apart(values[-2], values[-1])
        sensitive = not _closing(values) and moved > _SMALL
        lost = moved > (max(4.0 * tolerance, _SMALL) if rattling else SCATTER)
        if len(values) > 2 and sensitive and lost:
            break
    return Settled(values[-1], error, sensitive, tuple(runs), history)
