"""The paper's settings of the diagrams over rate and damping (Figs. 11 and 14), and their two commands."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

from compare.diagrams import Diagram, report
from compare.diagrams.report import Diagrams
from compare.diagrams.show import Named
from compare.report.registry import Command
from compare.sweep import Sweep


def _named(figure: str, panels: str, dampings: tuple[float, float], *outcomes: str) -> tuple[Named, ...]:
    """Runs of two panels, each at 0.01 and at 1 rad/s."""
    at = [(rate, nu, panel) for nu, panel in zip(dampings, panels, strict=True) for rate in (0.01, 1.0)]
    return tuple(
        Named(rate, nu, outcome, f"{figure}{panel}")
        for (rate, nu, panel), outcome in zip(at, outcomes, strict=True)
    )


SKIPPING = tuple((compression, 0.40) for compression in (0.40, 0.39, 0.38, 0.37, 0.36, 0.35))
NAMED_SKIPPING = {
    0.40: _named("Fig. 10", "AB", (0.1, 10.0), "no skip", "type 2", "no skip", "type 2"),
    0.35: _named("Fig. 10", "CD", (0.3, 30.0), "type 1", "type 2", "no skip", "type 2"),
}
SELECTION = ((0.40, 0.40, 0.36), (0.35, 0.40, 0.27))
NAMED_SELECTION = {
    0.40: _named("Fig. 12", "AB", (0.1, 10.0), "U+S-", "U-S+", "U+S-", "U+S-"),
    0.35: _named("Fig. 13", "AB", (0.3, 30.0), "U-S+", "U-S+", "U+S-", "U+S-"),
}


def compute(
    make: Callable[..., Diagram],
    places: Sequence[tuple[float, ...]],
    axes: Sequence[tuple[float, float, int]],
    *,
    seed: int,
    sweep: Sweep | None,
    **options: Any,
) -> Diagrams:
    """A diagram over rate and damping, `axes`, of each of these dL, dW (and stop)."""
    calls = [partial(make, *place, *axes, seed=seed) for place in places]
    return report.compute(calls, sweep=sweep or Sweep(), **options)


def command(name: str, main: Callable[..., Diagrams], takes: str) -> Command:
    """The command of this name, "skipping" or "selection"."""
    named: Mapping[float, Sequence[Named]] = NAMED_SELECTION if name == "selection" else NAMED_SKIPPING
    return Command(
        name=name,
        title=f"Mode {name} over rate and damping",
        takes=takes,
        main=main,
        summary=report.summary,
        tables=lambda result: report.tables(result, named),
        drawings=lambda result: report.drawings(result, named, name),
        values=report.values,
        files=lambda result: report.files(result, name),
        keep=True,
    )
