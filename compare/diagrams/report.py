"""The report of the commands skipping and selection: their computation, summary, tables, figures."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from compare.report.section import Drawing, Table
from compare.sweep import Sweep
from ribbonfem import Ribbon

from . import show
from .diagram import both
from .result import Diagram

# the setting that the paper's program ships with: the ratios of its section 5, a width of 0.03 in the
# rotary inertia, both end edges clamped, 101 nodes, implicit Euler of 1e-3 s
PAPER_RIBBON = Ribbon(width=0.03, bending_ratio=400.0, twist_ratio=1.4562)
PAPER_MESH: Mapping[str, Any] = {"nodes": 101, "clamp": "two-node"}
# Newton's iteration stops at an update that changes forces by some 1e-3 EI2/L^2
PAPER_STEP: Mapping[str, Any] = {"method": "implicit-euler", "step": 1e-3, "newton_tolerance": 1e-6}


@dataclass(frozen=True)
class Diagrams:
    """What was found.

    Attributes
    ----------
    diagrams: one or more; of both models in turn, if both were asked for.
    paper, same: in the paper's setting, a run a cell, and on its mesh with small errors in time; or empty.
    """

    diagrams: tuple[Diagram, ...]
    paper: tuple[Diagram, ...] = ()
    same: tuple[Diagram, ...] = ()

    def pairs(self) -> Iterator[tuple[Diagram, Diagram]]:
        """The same diagram in both models."""
        for one, two in zip(self.diagrams, self.diagrams[1:], strict=False):
            if one.scene == two.scene and one.model != two.model:
                yield one, two


def compute(
    calls: Sequence[Callable[..., Diagram]],
    *,
    model: str,
    nodes: int,
    paper: bool,
    samples: int,
    boundaries: bool,
    sweep: Sweep,
) -> Diagrams:
    """Every diagram, in the models asked for.

    Parameters
    ----------
    calls: each makes one diagram, from a model, its options, a ribbon and samples.
    model: "der", "kirchhoff" or "both"; nodes: of the rods.
    paper: whether also as published.
    samples, boundaries: as in `skipping_diagram`.
    """
    models = ("der", "kirchhoff") if model == "both" else (model,)
    configurations: dict[str, Mapping[str, Any]] = {
        "der": {"nodes": nodes},
        # as the rods do
        "kirchhoff": {"extensible": True},
    }
    common: dict[str, Any] = {"samples": samples, "boundaries": boundaries, "sweep": sweep}
    result = [call(model=name, **common, **configurations[name]) for call in calls for name in models]
    published, same = [], []
    for call in calls if paper else ():
        more = {"model": "der", "ribbon": PAPER_RIBBON, "sweep": sweep, "boundaries": False, **PAPER_MESH}
        published.append(call(samples=1, **more, **PAPER_STEP))
        same.append(call(samples=samples, **more))
    return Diagrams(tuple(result), tuple(published), tuple(same))


def summary(result: Diagrams) -> list[str]:
    """What is sure, what is not, and what of the published diagram is numerical damping."""
    cells = sum(d.outcome.size for d in result.diagrams)
    mixed = sum(int(np.count_nonzero(d.undetermined)) for d in result.diagrams)
    cut = sum(int(np.count_nonzero(d.outcome == "cut")) for d in result.diagrams)
    runs = sum(int(d.runs.sum()) for d in result.diagrams)
    failed = sum(len(d.failed) for d in result.diagrams)
    sure = cells - mixed - cut
    text = [
        f"{len(result.diagrams)} diagram(s), {cells} cells, {runs} runs ({failed} failed): in {sure} cells "
        f"all runs agree, {cut} are cut by one line, and {mixed} are mixed: there single outcomes do not "
        "converge under refinement, and only the share of runs that do one thing or the other has a limit.",
        "Why: just after a snap a lightly damped ribbon carries more energy than the pass to the other side, "
        "and rattles; whether it crosses depends on its phase, which a change of rate or damping by a few "
        "percent turns by whole periods. A published diagram with one run a cell shows one draw of these, "
        "and numerical damping of the integrator changes the shares.",
    ]
    text += [
        f"{show.label(diagram)}: no line of {name} ({why})."
        for diagram in result.diagrams
        for name, why in diagram.unpredicted.items()
    ]
    for one, two in result.pairs():
        apart = both({"one": one, "two": two})
        text.append(
            f"{show.label(one)} and {two.model}: the intervals of the shares are disjoint in "
            f"{int(apart.sum())} of {apart.size} cells."
        )
    for published, same in zip(result.paper, result.same, strict=True):
        off = show.differing_share(published, same)
        most, some = int(np.nansum(off > 0.5)), int(np.nansum(off > 0.0))
        text.append(
            f"{show.label(published)} in the paper's setting: in {most} of {off.size} cells most runs with "
            f"small errors in time end otherwise, and in {some} some do: that much of a published diagram is "
            "numerical damping, or chance."
        )
    return text


def tables(result: Diagrams, named: Mapping[float, Sequence[show.Named]]) -> list[Table]:
    """Cells, the paper's runs, mixed cells."""
    made = [
        show.summary(result.diagrams),
        show.named_table(result.diagrams, named),
        show.mixed_table(result.diagrams),
    ]
    return [table for table in made if table.rows]


def drawings(result: Diagrams, named: Mapping[float, Sequence[show.Named]], name: str) -> Iterator[Drawing]:
    """All diagrams, and what of the published ones is numerical damping."""
    yield Drawing(
        f"{name}-diagrams.png",
        "Shares of outcomes over cells of rate and damping, as a mixture of their colours; dots: where the "
        "outcome changes, solved for to 1 %; thick: bands in which both outcomes come; open circles: mixed "
        "cells.",
        show.draw(result.diagrams, named),
    )
    if result.paper:
        yield Drawing(
            f"{name}-paper.png",
            "The paper's setting (two-node clamp, 101 nodes, implicit Euler at 1 ms, a run a cell), the same "
            "mesh with TR-BDF2 and shares, and the share of runs that end otherwise than the paper's.",
            show.draw_differences(result.paper, result.same),
        )


def values(result: Diagrams) -> dict[str, Any]:
    """The fields of the diagram at the top level, or `diagrams`, a list, where there are several."""
    every = [show.numbers(diagram) for diagram in result.diagrams]
    numbers: dict[str, Any] = every[0] if len(every) == 1 else {"diagrams": every}
    if result.paper:
        numbers["paper"] = [show.numbers(diagram) for diagram in result.paper]
        numbers["same_mesh"] = [show.numbers(diagram) for diagram in result.same]
        numbers["ends_otherwise"] = [
            np.nan_to_num(show.differing_share(*pair), nan=-1.0).tolist()
            for pair in zip(result.paper, result.same, strict=True)
        ]
    return numbers


def files(result: Diagrams, name: str) -> dict[str, str]:
    """A tidy table of each diagram."""
    return {f"{name}-{k}.csv": diagram.to_csv() for k, diagram in enumerate(result.diagrams, 1)}
