"""The paper's diagrams over rate and damping (Figs. 11 and 14): its named runs in them, and the commands."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from inspect import signature
from typing import Literal

from compare.diagrams import Diagram, report, selection_diagram, skipping_diagram
from compare.diagrams.diagram import SAMPLES
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


def command(name: str, told: str, takes: str) -> Command:
    """The command of this name, "skipping" or "selection"; `told` is its help."""
    stopped = name == "selection"
    make: Callable[..., Diagram] = selection_diagram if stopped else skipping_diagram
    places: Sequence[tuple[float, ...]] = SELECTION if stopped else SKIPPING
    named: Mapping[float, Sequence[Named]] = NAMED_SELECTION if stopped else NAMED_SKIPPING

    def main(
        *,
        compression: float = 0.40,
        shear: float = 0.40,
        stop: float = 0.36,
        rates: tuple[float, float, int] = (0.01, 1.0, 20),
        dampings: tuple[float, float, int] = (0.1, 30.0, 20),
        nodes: int = 51,
        model: Literal["der", "kirchhoff", "both"] = "der",
        samples: int = SAMPLES,
        boundaries: bool = True,
        seed: int = 0,
        all: bool = False,
        paper: bool = False,
        sweep: Sweep | None = None,
    ) -> Diagrams:
        alone = (compression, shear, stop) if stopped else (compression, shear)
        return report.compute(
            [partial(make, *place, rates, dampings, seed=seed) for place in (places if all else (alone,))],
            model=model,
            nodes=nodes,
            paper=paper,
            samples=samples,
            boundaries=boundaries,
            sweep=sweep or Sweep(),
        )

    main.__doc__ = told
    if not stopped:
        # a ramp that goes on has no stop to be asked for
        whole = signature(main)
        kept = [option for option in whole.parameters.values() if option.name != "stop"]
        main.__signature__ = whole.replace(parameters=kept)  # type: ignore[attr-defined]
    return Command(
        name=name,
        title=f"Mode {name} over rate and damping",
        takes=takes,
        main=main,
        words=report.words,
        tables=lambda result: report.tables(result, named),
        drawings=lambda result: report.drawings(result, named, name),
        values=report.values,
        files=lambda result: report.files(result, name),
        keep=True,
    )
