"""The command `cases`: which shapes the paper's named runs skip and choose (section 7), by both models."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

import der
from compare.archive import for_programs
from compare.chooser.refinement import SCATTER
from compare.report.registry import Command
from compare.report.section import Drawing, Table
from compare.reproduction.cases import CaseVerdict, compiled, cost, settled
from compare.reproduction.named_runs import CASES
from compare.sweep import Sweep
from ribbonfem import Scene
from ribbonfem.options import positive
from ribbonfem.output.curve import Curve
from ribbonfem.output.style import colormaps, draw_curve, figure


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
    colours = {rate: colormaps["plasma"](0.8 * k / max(1, len(rates) - 1)) for k, rate in enumerate(rates)}
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
    for step in euler:
        positive("euler", step, 1.0)
    coarse, fine = int(nodes[0]), int(nodes[1])
    chosen = [case for case in CASES if only in ("all", case.kind)]
    work = [(case, (coarse, fine), tolerance, euler) for case in chosen]
    verdicts = sweep("named cases", settled, work, cost=cost, prepare=compiled)
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


def summary(result: NamedCases) -> list[str]:
    """How many cases end as the paper says, and what the types mean."""
    agreeing = [_agrees(verdict) for verdict in result.verdicts]
    coarse, fine = result.nodes
    return [
        f"Of {len(agreeing)} cases {agreeing.count('yes')} end as the paper says, {agreeing.count('open')} "
        f"are sensitive: there the outcome, or a snap by more than {SCATTER:g} rad, changes between "
        f"N = {coarse} and {fine}, tolerances {result.tolerance:g} and {10 * result.tolerance:g} L, or "
        "with a method that has no damping of its own, or with the finite elements on 6 and 8 "
        "elements, which share no mechanics with the rods: no single run decides it.",
        "Type 1: energy carries the ribbon over U+S- before its fold. Type 2: the first snap is so late "
        "that U+S- is gone. The rule is written down in ribbonfem.outcomes.",
    ]


def tables(result: NamedCases) -> list[Table]:
    """Outcomes and snap angles, the paper's beside ours."""
    count = len(result.euler)
    rows = [
        [v.case.label, v.case.where, v.case.paper, v.outcome, _agrees(v)]
        + [_shown(v.first), _shown(v.elements[0]), _shown(v.second), _shown(v.elements[1])]
        + [run.outcome for run in v.runs[len(v.runs) - count :]]
        for v in result.verdicts
    ]
    return [
        Table(
            "Outcomes and snap angles",
            ["case", "paper's", "paper", "here", "agree", "first snap (t_z = 0), rods", "elements"]
            + ["second snap (z = 0), rods", "elements"]
            + [f"Euler {step:g} s" for step in result.euler],
            rows,
            ["s"] * (9 + count),
            "±: of rods a quarter of the extrapolation in the mesh, plus the change over a decade of "
            "tolerance; of elements the changes with mesh and tolerance. "
            "Euler: the paper's implicit Euler on the coarse mesh, whose damping decides some cases.",
        )
    ]


def drawings(result: NamedCases) -> Iterator[Drawing]:
    """The paper's Figs. 10, 12 and 13."""
    for kind, caption in (
        ("skipping", "Mode skipping (paper, Fig. 10). Grey: equilibria, stable solid, unstable dashed."),
        ("selection", "Mode selection (paper, Figs. 12 and 13). Grey: equilibria."),
    ):
        if any(verdict.case.kind == kind for verdict in result.verdicts):
            yield Drawing(f"cases-{kind}.png", caption, _draw(result.verdicts, result.branches, kind))


def values(result: NamedCases) -> dict[str, Any]:
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
                "runs": [for_programs(run) for run in v.runs],
            }
            for v in result.verdicts
        ]
    }


COMMAND = Command(
    name="cases",
    title="Mode skipping and selection: the paper's named cases",
    takes="some 5 minutes",
    main=main,
    summary=summary,
    tables=tables,
    drawings=drawings,
    values=values,
    keep=True,
)
