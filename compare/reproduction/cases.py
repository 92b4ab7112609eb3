"""The paper's named runs of skipping and selection in both models, refined until their outcome is sure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

import der
from compare.chooser.refinement import SCATTER
from compare.limits import edge_ratio, two_point
from compare.models import MESH, MODELS, warm_up
from compare.quantities.branches import both_folds
from ribbonfem import History, Scene, SolverError
from ribbonfem.outcomes import classify

from .named_runs import Case

# meshes and tolerances of the finite elements
ELEMENTS: tuple[tuple[str, dict[str, Any]], ...] = (
    ("6 elements", {"elements": 6, "tolerance": 3e-5}),
    ("8 elements", {"elements": 8, "tolerance": 3e-5}),
    ("8 elements, tolerance 1e-5", {"elements": 8, "tolerance": 1e-5}),
)


@dataclass(frozen=True)
class CaseRun:
    """One run of a case: its outcome and snap angles (None where a snap did not come)."""

    model: str
    options: str
    outcome: str
    first: float | None
    second: float | None
    reason: str
    seconds: float


@dataclass(frozen=True)
class CaseVerdict:
    """A case run in two models that share no mechanics, on several meshes and tolerances.

    Attributes
    ----------
    case, runs: the refinements of both models, then implicit Euler's.
    outcome: the one of all refinements; "sensitive" where they differ, or a snap is scattered.
    first, second: snap angles of the rods in the limit of the mesh and their uncertainty, None without one.
    elements: the same two of the finite elements.
    curve, line: time, angle and height of the finer rod, and of the finest elements, for a figure.
    """

    case: Case
    runs: tuple[CaseRun, ...]
    outcome: str
    first: tuple[float, float] | None
    second: tuple[float, float] | None
    elements: tuple[tuple[float, float] | None, tuple[float, float] | None]
    curve: dict[str, list[float]]
    line: dict[str, list[float]]


def outcome_of(case: Case, history: History, folds: Any) -> tuple[str, str]:
    """The outcome of a run of a case, and why."""
    result = classify(history, folds)
    return (
        (result.final or "none", result.reason) if case.kind == "selection" else (result.kind, result.reason)
    )


def one_run(case: Case, label: str, model: str, options: dict[str, Any]) -> tuple[CaseRun, History | None]:
    """A run of a case under a configuration, and its history; None where it failed."""
    module: Any = MODELS[model]
    mesh = {name: options[name] for name in (MESH[model], "extensible") if name in options}
    ribbon = Scene(compression=case.scene.compression, shear=case.scene.shear, start="U+S+")
    folds = both_folds(ribbon, model, mesh)
    # of a fixed step, rows enough to find a crossing to a millionth
    every = max(1, int(2e-3 / options.get("step", 1.0)))
    try:
        history = module.simulate(case.scene, every=every, configurations=False, **options)
    except SolverError as error:
        return CaseRun(model, label, "failed", None, None, str(error), float("nan")), None
    kind, reason = outcome_of(case, history, folds)
    snaps = [
        None if result is None else result[1] for result in (history.crossing("slope"), history.crossing())
    ]
    seconds = float(history.stats["seconds"])
    return CaseRun(model, label, kind, snaps[0], snaps[1], reason, seconds), history


def _snaps(runs: Sequence[CaseRun]) -> tuple[list[float | None], list[float | None]]:
    return [run.first for run in runs], [run.second for run in runs]


def _estimate(values: Sequence[float | None], ratio: float) -> tuple[float, float] | None:
    """A snap angle and its uncertainty from (coarse mesh, fine mesh, fine mesh at a looser tolerance).

    The limit in the mesh, and what may be wrong with it: a quarter of the extrapolation, and the
    change with the tolerance.  None where the three are too far apart to have a limit.
    """
    coarse, fine, loose = values
    if coarse is None or fine is None or loose is None:
        return None
    if max(coarse, fine, loose) - min(coarse, fine, loose) > SCATTER:
        return None
    limit = two_point(coarse, fine, ratio)
    return limit, 0.25 * abs(limit - fine) + abs(fine - loose)


def _elements(values: Sequence[float | None]) -> tuple[float, float] | None:
    """A snap angle of the elements and its uncertainty, from (coarse mesh, fine mesh, tighter tolerance)."""
    coarse, fine, tight = values
    if coarse is None or fine is None or tight is None:
        return None
    if max(coarse, fine, tight) - min(coarse, fine, tight) > SCATTER:
        return None
    return tight, abs(fine - coarse) + abs(fine - tight)


def _drawn(history: History | None, scene: Scene) -> dict[str, list[float]]:
    """Rows enough for a figure; none of a run that failed."""
    if history is None:
        return {}
    stopped = int(np.searchsorted(np.abs(history.angle), abs(scene.stop or 0.0)))
    last = len(history) - 1
    rows = np.append(np.linspace(0, stopped, 1500), np.linspace(stopped, last, 1500))
    pick = np.unique(np.minimum(rows, last).astype(int))
    columns = {"time": history.time, "angle": history.angle, "height": history.height}
    return {name: values[pick].tolist() for name, values in columns.items()}


def settle(case: Case, nodes: tuple[int, int], tolerance: float, euler: tuple[float, ...]) -> CaseVerdict:
    """Run a case on two meshes and at two tolerances of both models, and with the paper's implicit Euler."""
    coarse, fine = nodes
    configurations: list[tuple[str, str, dict[str, Any]]] = [
        (f"N = {coarse}", "der", {"nodes": coarse, "tolerance": tolerance}),
        (f"N = {fine}", "der", {"nodes": fine, "tolerance": tolerance}),
        (f"N = {fine}, tolerance x 10", "der", {"nodes": fine, "tolerance": 10.0 * tolerance}),
        # a method without damping of its own, where the others have some
        ("discrete gradient", "der", {"nodes": coarse, "method": "discrete-gradient", "step": 2e-3}),
        *((label, "kirchhoff", {"extensible": True, **options}) for label, options in ELEMENTS),
    ]
    refinements = len(configurations)
    configurations += [
        (f"implicit Euler, {step:g} s", "der", {"nodes": coarse, "method": "implicit-euler", "step": step})
        for step in euler
    ]
    done = [one_run(case, label, model, options) for label, model, options in configurations]
    runs = tuple(run for run, _ in done)
    outcomes = {run.outcome for run in runs[:refinements] if run.outcome != "failed"}
    ratio = edge_ratio(coarse, fine)
    # a snap that refinement moves this far comes out of a vibration and not of a fold
    scattered = any(
        len(result) > 1 and max(result) - min(result) > SCATTER
        for result in ([s for s in column if s is not None] for column in _snaps(runs[:refinements]))
    )
    return CaseVerdict(
        case=case,
        runs=runs,
        outcome=outcomes.pop() if len(outcomes) == 1 and not scattered else "sensitive",
        first=_estimate([run.first for run in runs[:3]], ratio),
        second=_estimate([run.second for run in runs[:3]], ratio),
        elements=(
            _elements([run.first for run in runs if run.model == "kirchhoff"]),
            _elements([run.second for run in runs if run.model == "kirchhoff"]),
        ),
        curve=_drawn(done[1][1], case.scene),
        line=_drawn(done[refinements - 1][1], case.scene),
    )


def settled(arguments: tuple[Case, tuple[int, int], float, tuple[float, ...]]) -> CaseVerdict:
    """`settle` of a tuple of arguments, for a sweep."""
    return settle(*arguments)


def cost(work: tuple[Case, tuple[int, int], float, tuple[float, ...]]) -> float:
    """Slow ramps at little damping take longest."""
    return 1.0 / (work[0].scene.rate * work[0].scene.damping)


def compiled() -> None:
    """Compile what the runs need, once."""
    warm_up("der", "kirchhoff")
    short = Scene(compression=0.4, shear=0.4, rate=1.0, stop=0.01)
    der.simulate(short, nodes=21, method="implicit-euler", step=1e-3)
