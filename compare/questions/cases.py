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
from compare.models import warm_up
from compare.sweep import Sweep
from ribbonfem import History, Scene, SolverError
from ribbonfem.continuation import Steps

from .registry import Question

# steps short enough for a polyline to look like a curve
SMOOTH = Steps(turn=0.12, largest=0.05)


@dataclass(frozen=True)
class Case:
    """One of the paper's runs: its scene, what the paper reports, and where."""

    scene: Scene
    paper: str
    where: str

    @property
    def kind(self) -> str:
        """ "skipping" (the ramp goes on past both folds) or "selection" (it stops between them)."""
        return "selection" if self.scene.hold else "skipping"

    @property
    def label(self) -> str:
        """Compression, shear, damping, rate; for selection also where the ramp stops."""
        s = self.scene
        stop = f", stop {s.stop:g}" if self.kind == "selection" else ""
        return f"({s.compression:.2f}, {s.shear:.2f}) nu {s.damping:g}, rate {s.rate:g}{stop}"


def _skip(compression: float, damping: float, rate: float, paper: str, where: str) -> Case:
    # far enough for the slowest second snap; overdamped and fast, that is far beyond the fold
    stop = 0.6 if rate < 0.1 or damping < 10.0 else 0.9
    return Case(
        Scene(compression=compression, shear=0.40, rate=rate, damping=damping, stop=stop), paper, where
    )


def _select(compression: float, stop: float, damping: float, rate: float, paper: str, where: str) -> Case:
    # until a free vibration has lost all but e^-8 of its energy, or an overdamped one its speed
    hold = max(8.0 / damping, 0.3 * damping, 2.0)
    scene = Scene(compression=compression, shear=0.40, rate=rate, damping=damping, stop=stop, hold=hold)
    return Case(scene, paper, where)


CASES: tuple[Case, ...] = (
    _skip(0.40, 0.1, 0.01, "no skip", "Fig. 10A"),
    _skip(0.40, 0.1, 1.0, "type 2", "Fig. 10A"),
    _skip(0.40, 10.0, 0.01, "no skip", "Fig. 10B"),
    _skip(0.40, 10.0, 1.0, "type 2", "Fig. 10B"),
    _skip(0.35, 0.3, 0.01, "type 1", "Fig. 10C"),
    _skip(0.35, 0.3, 1.0, "type 2", "Fig. 10C"),
    _skip(0.35, 30.0, 0.01, "no skip", "Fig. 10D"),
    _skip(0.35, 30.0, 1.0, "type 2", "Fig. 10D"),
    _select(0.40, 0.36, 0.1, 0.01, "U+S-", "Fig. 12A"),
    _select(0.40, 0.36, 0.1, 1.0, "U-S+", "Fig. 12A, caption's rate"),
    _select(0.40, 0.36, 0.1, 100.0, "U-S+", "Fig. 12A, text's rate"),
    _select(0.40, 0.36, 10.0, 0.01, "U+S-", "Fig. 12B"),
    _select(0.40, 0.36, 10.0, 1.0, "U+S-", "Fig. 12B, caption's rate"),
    _select(0.40, 0.36, 10.0, 100.0, "U+S-", "Fig. 12B, text's rate"),
    _select(0.35, 0.27, 0.3, 0.01, "U-S+", "Fig. 13A"),
    _select(0.35, 0.27, 0.3, 1.0, "U-S+", "Fig. 13A"),
    _select(0.35, 0.27, 30.0, 0.01, "U+S-", "Fig. 13B"),
    _select(0.35, 0.27, 30.0, 1.0, "U+S-", "Fig. 13B"),
)


@dataclass(frozen=True)
class Run:
    """One run of a case: its outcome and snap angles (None where a snap did not come)."""

    policy: str
    outcome: str
    first: float | None
    second: float | None
    reason: str
    seconds: float


@dataclass(frozen=True)
class Verdict:
    """A case run on several meshes and tolerances."""

    case: Case
    runs: tuple[Run, ...]
    outcome: str
    first: tuple[float, float] | None
    second: tuple[float, float] | None
    curve: dict[str, list[float]]


def outcome_of(case: Case, history: History, folds: Any) -> tuple[str, str]:
    """The outcome of a run of a case, and why."""
    found = der.modes.classify(history, folds)
    return (found.final or "none", found.reason) if case.kind == "selection" else (found.kind, found.reason)


def _one(case: Case, label: str, policy: dict[str, Any]) -> tuple[Run, History | None]:
    nodes = policy["nodes"]
    # alpha_c2 as the fold of U+S- itself: it does not hang on the curves being connected
    folds = tuple(
        der.folds(
            Scene(compression=case.scene.compression, shear=case.scene.shear, start=start), nodes=nodes
        )[0]
        for start in ("U+S+", "U+S-")
    )
    # of a fixed step, rows enough to find a crossing to a millionth
    every = max(1, int(2e-3 / policy.get("step", 1.0)))
    try:
        history = der.simulate(case.scene, every=every, configurations=False, **policy)
    except SolverError as error:
        return Run(label, "failed", None, None, str(error), float("nan")), None
    kind, reason = outcome_of(case, history, folds)
    snaps = [None if found is None else found[1] for found in (history.crossing("slope"), history.crossing())]
    return Run(label, kind, snaps[0], snaps[1], reason, float(history.stats["seconds"])), history


def _snaps(runs: Sequence[Run]) -> tuple[list[float | None], list[float | None]]:
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


def settle(case: Case, nodes: tuple[int, int], tolerance: float, euler: tuple[float, ...]) -> Verdict:
    """Run a case on two meshes, at two tolerances, and with the paper's implicit Euler."""
    coarse, fine = nodes
    policies: list[tuple[str, dict[str, Any]]] = [
        (f"N = {coarse}", {"nodes": coarse, "tolerance": tolerance}),
        (f"N = {fine}", {"nodes": fine, "tolerance": tolerance}),
        (f"N = {fine}, tolerance x 10", {"nodes": fine, "tolerance": 10.0 * tolerance}),
        # a method without damping of its own, where the others have some
        ("discrete gradient", {"nodes": coarse, "method": "discrete-gradient", "step": 2e-3}),
    ]
    refinements = len(policies)
    policies += [
        (f"implicit Euler, {step:g} s", {"nodes": coarse, "method": "implicit-euler", "step": step})
        for step in euler
    ]
    done = [_one(case, label, policy) for label, policy in policies]
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
    return Verdict(
        case=case,
        runs=runs,
        outcome=outcomes.pop() if len(outcomes) == 1 and not scattered else "sensitive",
        first=_estimate([run.first for run in runs[:3]], ratio),
        second=_estimate([run.second for run in runs[:3]], ratio),
        curve=curve,
    )


def _settle(arguments: tuple[Case, tuple[int, int], float, tuple[float, ...]]) -> Verdict:
    return settle(*arguments)


def _draw(verdicts: Sequence[Verdict], branches: dict[float, Curve], kind: str) -> Any:
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

    verdicts: tuple[Verdict, ...]
    nodes: tuple[int, int]
    tolerance: float
    euler: tuple[float, ...]
    branches: dict[float, Curve]


def _cost(work: tuple[Case, tuple[int, int], float, tuple[float, ...]]) -> float:
    """Slow ramps at little damping take longest."""
    return 1.0 / (work[0].scene.rate * work[0].scene.damping)


def _compiled() -> None:
    warm_up("der")
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

    Each case on two meshes and at two tolerances, with TR-BDF2, and with the paper's implicit
    Euler at several steps: the outcome, "sensitive" where refinement changes it, and the snap
    angles with their uncertainty.  --only skipping or selection runs half of them.
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


def _agrees(verdict: Verdict) -> str:
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
        "method that has no damping of its own, so that no single run decides it.",
        "Type 1: energy carries the ribbon over U+S- before its fold. Type 2: the first snap is so late "
        "that U+S- is gone. The rule is written down in der.modes.",
    ]


def tables(found: NamedCases) -> list[Table]:
    """Outcomes and snap angles, the paper's beside ours."""
    count = len(found.euler)
    rows = [
        [v.case.label, v.case.where, v.case.paper, v.outcome, _agrees(v), _shown(v.first), _shown(v.second)]
        + [run.outcome for run in v.runs[len(v.runs) - count :]]
        for v in found.verdicts
    ]
    return [
        Table(
            "Outcomes and snap angles",
            ["case", "paper's", "paper", "here", "agree", "first snap (t_z = 0)", "second snap (z = 0)"]
            + [f"Euler {step:g} s" for step in found.euler],
            rows,
            ["s"] * (7 + count),
            "±: a quarter of the extrapolation in the mesh, plus the change over a decade of tolerance. "
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
                "runs": [vars(run) for run in v.runs],
            }
            for v in found.verdicts
        ]
    }


QUESTION = Question(
    name="cases",
    title="Mode skipping and selection: the paper's named cases",
    takes="some 4 minutes",
    main=main,
    words=words,
    tables=tables,
    drawings=drawings,
    values=values,
)
