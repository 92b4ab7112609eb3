"""Ribbons by finite elements: one run where a law was measured, else each run checked by the next finer one.

A run reads off itself whether the law holds for it: a ribbon that snaps twice and has not forgotten its
first vibration when it snaps again (it rattles) remembers every error made on the way, and is checked by a
finer run wherever it lies.
"""

from __future__ import annotations

import math
from typing import Any

from ribbonfem import History, Ribbon, Scene, kirchhoff

from .climb import SCATTER, Run, Settled, apart, endless, rattles, timed
from .laws import ElementLaws

# Differences of rattling runs count this many times, the larger of the last two: a ribbon that rattles snaps
# at one vibration or another, and two runs may agree by chance.  Where there are but two, they count more.
_RATTLE, _ALONE = 2.0, 20.0


def covered(scene: Scene, laws: ElementLaws) -> bool:
    """Whether the laws were measured for ribbons like this one."""
    low, high = laws.rate
    weak, strong = laws.damping
    return (
        scene.ribbon == Ribbon()
        and low <= abs(scene.scaled_rate) <= high
        and weak <= scene.scaled_damping <= strong
        and 0.1 <= scene.compression <= 0.5
    )


def beginning(scene: Scene, tolerance: float, laws: ElementLaws) -> tuple[int, float | None]:
    """The rung to begin with, and the error that the law bounds there; None where a finer run must tell."""
    rungs = range(len(laws.ladder) - 1)
    pair = next((k for k in rungs if laws.typical[k] <= 0.5 * tolerance), rungs[-1])
    if covered(scene, laws):
        alone = next((k for k in rungs if laws.bound[k] <= tolerance), None)
        if alone is not None and laws.seconds[alone] <= sum(laws.seconds[pair : pair + 2]):
            return alone, laws.bound[alone]
    return pair, None


def _closing(values: list[float | None]) -> bool:
    """Whether the last three values close in on a limit."""
    recent = values[-3:]
    if len(recent) < 3:
        return False
    before, last = apart(recent[0], recent[1]), apart(recent[1], recent[2])
    return math.isfinite(last) and last <= 0.6 * before + 1e-9


def _error(values: list[float | None], rattling: bool) -> float:
    """How far the last of two or more values is from the limit, by what the rungs differ."""
    moved = apart(values[-2], values[-1])
    if not rattling:
        return moved
    if len(values) == 2:
        return _ALONE * moved
    return _RATTLE * max(moved, apart(values[-3], values[-2]))


def elements(
    scene: Scene, quantity: str, tolerance: float, laws: ElementLaws, *, configurations: bool = False
) -> Settled:
    """Run the elements on finer and finer meshes until an instant has settled to a tolerance.

    Parameters
    ----------
    scene: with or without `stop`.
    quantity: "snap" or "first snap".
    tolerance: rad.
    laws: the ladder of meshes and tolerances, and what was measured of it.

    Raises
    ------
    SceneError, SolverError
        As the model does.
    """
    whole = endless(scene)
    rung, bound = beginning(scene, tolerance, laws)
    runs: list[Run] = []
    values: list[float | None] = []
    history: History | None = None
    error = math.inf
    for count, local in laws.ladder[rung:]:
        policy: dict[str, Any] = {"elements": count, "tolerance": local, "extensible": True}
        policy |= {"configurations": configurations, "until": "snap"}
        run, history = timed("kirchhoff", kirchhoff.simulate, whole, quantity, policy)
        runs.append(run)
        values.append(run.value)
        rattling = quantity == "snap" and rattles(history, scene)
        if bound is not None and len(runs) == 1 and not rattling and run.value is not None:
            return Settled(run.value, bound, False, tuple(runs), history)
        if len(values) > 1:
            moved = apart(values[-2], values[-1])
            error = _error(values, rattling)
            if error <= tolerance:
                return Settled(values[-1], error, False, tuple(runs), history)
            lost = rattling and len(values) > 2 and not _closing(values) and moved > 4.0 * tolerance
            if lost or (len(values) > 2 and not _closing(values) and moved > SCATTER):
                break
    # runs that close in on a limit leave a tolerance unmet, and nothing undecided
    return Settled(values[-1], error, not _closing(values), tuple(runs), history)
