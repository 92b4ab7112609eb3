"""Which shapes are skipped and which are chosen?  The paper's named cases (section 7)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

import der
from compare.chooser.climb import SCATTER
from compare.face.curve import Curve
from compare.face.section import Drawing, Table
from compare.face.style import draw_curve, figure, plt
from compare.limits import edge_ratio, two_point
from compare.models import MESH, MODELS, warm_up
from compare.questions.registry import Question
from compare.sweep import Sweep
from ribbonfem import History, Scene, SolverError
from ribbonfem.continuation import Steps
from ribbonfem.outcomes import classify

from .named import CASES, Case

# meshes and tolerances of the finite elements
ELEMENTS: tuple[tuple[str, dict[str, Any]], ...] = (
    ("6 elements", {"elements": 6, "tolerance": 3e-5}),
    ("8 elements", {"elements": 8, "tolerance": 3e-5}),
    ("8 elements, tolerance 1e-5", {"elements": 8, "tolerance": 1e-5}),
)
# steps short enough for a polyline to look like a curve
SMOOTH = Steps(turn=0.12, largest=0.05)


@dataclass(frozen=True)
class CaseRun:
    """One run of a case: its outcome and snap angles (None where a snap did not come)."""

    model: str
    policy: str
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
    first, second: snap angles of the rods in the limit of the mesh and their doubt, None without one.
    elements: the same two of the finite elements.
    curve: of the finer rod, for a figure.
    """

    case: Case
    runs: tuple[CaseRun, ...]
    outcome: str
    first: tuple[float, float] | None
    second: tuple[float, float] | None
    elements: tuple[tuple[float, float] | None, tuple[float, float] | None]
    curve: dict[str, list[float]]


def outcome_of(case: Case, history: History, folds: Any) -> tuple[str, str]:
    """The outcome of a run of a case, and why."""
    found = classify(history, folds)
    return (found.final or "none", found.reason) if case.kind == "selection" else (found.kind, found.reason)


def _one(case: Case, label: str, model: str, policy: dict[str, Any]) -> tuple[CaseRun, History | None]:
    module: Any = MODELS[model]
    mesh = {name: policy[name] for name in (MESH[model], "extensible") if name in policy}
    # alpha_c2 as the fold of U+S- itself: it does not hang on the curves being connected
    folds = tuple(
        module.folds(Scene(compression=case.scene.compression, shear=case.scene.shear, start=start), **mesh)[
            0
        ]
        for start in ("U+S+", "U+S-")
    )
    # of a fixed step, rows enough to find a crossing to a millionth
    every = max(1, int(2e-3 / policy.get("step", 1.0)))
    try:
        history = module.simulate(case.scene, every=every, configurations=False, **policy)
    except SolverError as error:
        return CaseRun(model, label, "failed", None, None, str(error), float("nan")), None
    kind, reason = outcome_of(case, history, folds)
    snaps = [None if found is None else found[1] for found in (history.crossing("slope"), history.crossing())]
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


def settle(case: Case, nodes: tuple[int, int], tolerance: float, euler: tuple[float, ...]) -> CaseVerdict:
    """Run a case on two meshes and at two tolerances of both models, and with the paper's implicit Euler."""
    coarse, fine = nodes
    policies: list[tuple[str, str, dict[str, Any]]] = [
        (f"N = {coarse}", "der", {"nodes": coarse, "tolerance": tolerance}),
        (f"N = {fine}", "der", {"nodes": fine, "tolerance": tolerance}),
        (f"N = {fine}, tolerance x 10", "der", {"nodes": fine, "tolerance": 10.0 * tolerance}),
        # a method without damping of its own, where the others have some
        ("discrete gradient", "der", {"nodes": coarse, "method": "discrete-gradient", "step": 2e-3}),
        *((label, "kirchhoff", {"extensible": True, **policy}) for label, policy in ELEMENTS),
    ]
    refinements = len(policies)
    policies += [
        (f"implicit Euler, {step:g} s", "der", {"nodes": coarse, "method": "implicit-euler", "step": step})
        for step in euler
    ]
    done = [_one(case, label, model, policy) for label, model, policy in policies]
    runs = tuple(run for run, _ in done)
    outcomes = {run.outcome for run in runs[:refinements] if run.outcome != "failed"}
    ratio = edge_ratio(coarse, fine)
    # a snap that refinement moves this far comes out of a rattle and not of a fold
    scattered = any(
        len(found) > 1 and max(found) - min(found) > SCATTER
        for found in ([s for s in column if s is not None] for column in _snaps(runs[:refinements]))
    )
    history = done[1][1]
    curve: dict[str, list[float]] = {}
    if history is not None:
        # enough rows for a figure
        turning = int(np.searchsorted(np.abs(history.angle), abs(case.scene.stop or 0.0)))
        pick = np.unique(
            np.append(np.linspace(0, turning, 1500), np.linspace(turning, len(history) - 1, 1500))
        )
        pick = pick.astype(int)
        columns = {"time": history.time, "angle": history.angle, "height": history.height}
        curve = {name: values[pick].tolist() for name, values in columns.items()}
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
        curve=curve,
    )


def _settle(arguments: tuple[Case, tuple[int, int], float, tuple[float, ...]]) -> CaseVerdict:
    return settle(*arguments)


def _draw(verdicts: Sequence[CaseVerdict], branches: dict[float, Curve], kind: str) -> Any:
    """z against alpha and against time, a column for each compression and damping (Figs. 10, 12, 13)."""
    chosen = [v for v in verdicts if v.case.kind == kind]
    keys = sorted(
        {(v.case.scene.compression, v.case.scene.damping) for v in chosen}, key=lambda k: (-k[0], k[1])
    )
    rows = 1 if kind == "skipping" else 2
    fig, axes = figure(len(keys), rows, width=3.6, height=3.0)
    axes = np.atleast_2d(axes)
    rates = sorted({v.case.scene.rate for v in chosen})
    colours = {rate: plt.cm.plasma(0.8 * k / max(1, len(rates) - 1)) for k, rate in enumerate(rates)}
    for column, (compression, damping) in enumerate(keys):
        top = axes[0][column]
        branch = branches[compression]
        draw_curve(top, branch.angle, branch.height, branch.stable, "0.6", width=0.9)
        reach = 0.0
        for verdict in chosen:
            scene = verdict.case.scene
            if (scene.compression, scene.damping) != (compression, damping) or not verdict.curve:
                continue
            label = f"{scene.rate:g} rad/s: {verdict.outcome}"
            colour = colours[scene.rate]
            top.plot(verdict.curve["angle"], verdict.curve["height"], color=colour, lw=0.9, label=label)
            if kind == "selection":
                time = np.array(verdict.curve["time"]) - (scene.stop or 0.0) / scene.rate
                axes[1][column].plot(time, verdict.curve["height"], color=colour, lw=0.9)
            reach = max(reach, (scene.stop or 0.0) * 1.02)
        top.set(xlim=(0.0, reach), ylim=(-0.36, 0.32), title=f"dL/L {compression:g}, nu {damping:g}")
        top.set_xlabel(r"$\alpha$ (rad)")
        top.legend(fontsize=6.5, loc="lower left")
        if kind == "selection":
            window = (-20.0, 40.0) if damping < 1.0 else (-5.0, 5.0)
            axes[1][column].set(xlim=window, ylim=(-0.36, 0.32), xlabel="time after the end of the ramp (s)")
    for row in range(rows):
        axes[row][0].set_ylabel("$z(1/2)/L$")
    return fig


def _shown(estimate: tuple[float, float] | None) -> str:
    return "–" if estimate is None else f"{estimate[0]:.4f} ± {estimate[1]:.0e}"


@dataclass(frozen=True)
class NamedCases:
    """What was found: the verdicts, how they were reached, and the curves behind the figures, by dL/L."""

    verdicts: tuple[CaseVerdict, ...]
    nodes: tuple[int, int]
    tolerance: float
    euler: tuple[float, ...]
    branches: dict[float, Curve]


def _cost(work: tuple[Case, tuple[int, int], float, tuple[float, ...]]) -> float:
    """Slow ramps at little damping take longest."""
    return 1.0 / (work[0].scene.rate * work[0].scene.damping)


def _compiled() -> None:
    warm_up("der", "kirchhoff")
    short = Scene(compression=0.4, shear=0.4, rate=1.0, stop=0.01)
    der.simulate(short, nodes=21, method="implicit-euler", step=1e-3)


def main(
    *,
    nodes: tuple[int, ...] = (51, 101),
    tolerance: float = 1e-5,
    euler: tuple[float, ...] = (1e-2, 1e-3, 1e-4),
    only: Literal["all", "skipping", "selection"] = "all",
    sweep: Sweep | None = None,
) -> NamedCases:
    """Run the paper's named cases of mode skipping and selection (Figs. 10, 12, 13).

    Each case on two meshes and at two tolerances of rods and of finite elements, which share no
    mechanics, and with the paper's implicit Euler at several steps: the outcome, "sensitive" where
    refinement or the other model changes it, and the snap angles with their uncertainty.
    --only skipping or selection runs half of them.
    """
    sweep = sweep or Sweep()
    if only not in ("all", "skipping", "selection"):
        raise ValueError(f"only = {only!r}: must be 'all', 'skipping' or 'selection'")
    if len(nodes) != 2 or not nodes[0] < nodes[1]:
        raise ValueError(f"nodes = {nodes!r}: two numbers are needed, the coarse mesh first")
    coarse, fine = int(nodes[0]), int(nodes[1])
    chosen = [case for case in CASES if only in ("all", case.kind)]
    work = [(case, (coarse, fine), tolerance, euler) for case in chosen]
    verdicts = sweep("named cases", _settle, work, cost=_cost, prepare=_compiled)
    branches = {
        compression: Curve.of(
            der.equilibria(Scene(compression=compression, shear=0.40), nodes=coarse, span=(-1.5, 1.0))
        )
        for compression in sorted({case.scene.compression for case in chosen})
    }
    return NamedCases(tuple(verdicts), (coarse, fine), tolerance, tuple(euler), branches)


def _agrees(verdict: CaseVerdict) -> str:
    ours = verdict.outcome
    return "yes" if ours == verdict.case.paper else "open" if ours == "sensitive" else "NO"


def words(found: NamedCases) -> list[str]:
    """How many cases end as the paper says, and what the types mean."""
    agreeing = [_agrees(verdict) for verdict in found.verdicts]
    coarse, fine = found.nodes
    return [
        f"Of {len(agreeing)} cases {agreeing.count('yes')} end as the paper says, {agreeing.count('open')} "
        f"are sensitive: there the outcome, or a snap by more than {SCATTER:g} rad, changes between "
        f"N = {coarse} and {fine}, tolerances {found.tolerance:g} and {10 * found.tolerance:g} L, or with a "
        "method that has no damping of its own, or with the finite elements on 6 and 8 elements, which share "
        "no mechanics with the rods: no single run decides it.",
        "Type 1: energy carries the ribbon over U+S- before its fold. Type 2: the first snap is so late "
        "that U+S- is gone. The rule is written down in ribbonfem.outcomes.",
    ]


def tables(found: NamedCases) -> list[Table]:
    """Outcomes and snap angles, the paper's beside ours."""
    count = len(found.euler)
    rows = [
        [v.case.label, v.case.where, v.case.paper, v.outcome, _agrees(v)]
        + [_shown(v.first), _shown(v.elements[0]), _shown(v.second), _shown(v.elements[1])]
        + [run.outcome for run in v.runs[len(v.runs) - count :]]
        for v in found.verdicts
    ]
    return [
        Table(
            "Outcomes and snap angles",
            ["case", "paper's", "paper", "here", "agree", "first snap (t_z = 0), rods", "elements"]
            + ["second snap (z = 0), rods", "elements"]
            + [f"Euler {step:g} s" for step in found.euler],
            rows,
            ["s"] * (9 + count),
            "±: of rods a quarter of the extrapolation in the mesh, plus the change over a decade of "
            "tolerance; of elements the changes with mesh and tolerance. "
            "Euler: the paper's implicit Euler on the coarse mesh, whose damping decides some cases.",
        )
    ]


def drawings(found: NamedCases) -> Iterator[Drawing]:
    """The paper's Figs. 10, 12 and 13."""
    for kind, caption in (
        ("skipping", "Mode skipping (paper, Fig. 10). Grey: equilibria, stable solid, unstable dashed."),
        ("selection", "Mode selection (paper, Figs. 12 and 13). Grey: equilibria."),
    ):
        if any(verdict.case.kind == kind for verdict in found.verdicts):
            yield Drawing(f"cases-{kind}.png", caption, _draw(found.verdicts, found.branches, kind))


def values(found: NamedCases) -> dict[str, Any]:
    """The numbers for programs."""
    return {
        "cases": [
            {
                "case": v.case.label,
                "kind": v.case.kind,
                "paper": v.case.paper,
                "outcome": v.outcome,
                "first": v.first,
                "second": v.second,
                "elements_first": v.elements[0],
                "elements_second": v.elements[1],
                "runs": [vars(run) for run in v.runs],
            }
            for v in found.verdicts
        ]
    }


QUESTION = Question(
    name="cases",
    title="Mode skipping and selection: the paper's named cases",
    takes="some 5 minutes",
    main=main,
    words=words,
    tables=tables,
    drawings=drawings,
    values=values,
)
