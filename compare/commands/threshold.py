"""How fast must I turn to skip?  Where an outcome begins or ends as one parameter of a scene varies."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Literal

from compare.archive import for_programs
from compare.diagrams import Threshold, threshold
from compare.report.section import Table
from compare.sweep import Sweep
from ribbonfem.output.scene_file import read_scene

from ..report.registry import Command


def main(
    scene: Path,
    *,
    between: tuple[float, float],
    vary: str = "rate",
    outcome: str = "type 2",
    tolerance: float = 0.01,
    model: Literal["der", "kirchhoff"] = "der",
    sweep: Sweep | None = None,
) -> Threshold:
    """Find the value of one parameter of the scene in a TOML file at which an outcome begins or ends.

    --outcome is "no skip", "type 1" (energy carries the ribbon over a shape before its fold), "type 2" (the
    snap comes so late that the shape is gone), "first only", "none", or the name of the shape reached at the
    scene's stop. --between LOW:HIGH gives the values of --vary to look between. --tolerance is relative, of
    the value extrapolated in the mesh. If both outcomes alternate, the result is the interval in which they
    do.
    """
    return threshold(read_scene(scene), outcome, vary, between, tolerance, model=model, sweep=sweep)


def summary(result: Threshold) -> list[str]:
    """Each change in a sentence."""
    text = []
    for change in result.changes:
        if change.high > change.low:
            where = f"between {result.vary} = {change.low:.4g} and {change.high:.4g} both outcomes alternate"
        else:
            where = f"at {result.vary} = {change.value:.5g} +- {change.uncertainty:.1g}"
        text.append(f"{where}: {change.below} below, {change.above} above.")
    return [*text, f"{result.runs} runs of {result.model}, in the limit of its mesh."]


def tables(result: Threshold) -> Iterator[Table]:
    """Each change on each mesh."""
    meshes = sorted({mesh for change in result.changes for mesh in change.meshes})
    yield Table(
        f"Changes of the outcome with {result.vary}",
        ["below", "above", *(f"mesh {mesh}" for mesh in meshes), "limit", "±"],
        [
            [c.below, c.above, *(c.meshes.get(mesh) for mesh in meshes), c.value, c.uncertainty]
            for c in result.changes
        ],
        ["s", "s", *[".5g"] * (len(meshes) + 1), ".1g"],
    )


def values(result: Threshold) -> dict[str, Any]:
    """The numbers for programs."""
    names = ("value", "uncertainty", "low", "high", "below", "above", "runs", "outcome", "vary", "model")
    return for_programs(result, names) | {
        "between": list(result.between),
        "changes": [for_programs(change) for change in result.changes],
    }


COMMAND = Command(
    name="threshold",
    title=lambda result: f"Where {result.outcome} begins or ends",
    takes="some 20 seconds",
    main=main,
    summary=summary,
    tables=tables,
    values=values,
)
