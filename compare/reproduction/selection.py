"""Which shape does a ramp that stops select?  Diagrams over rate and damping, with shares (Fig. 14)."""

from __future__ import annotations

from functools import partial
from typing import Literal

from compare.diagrams import report as asked
from compare.diagrams import selection_diagram
from compare.diagrams.diagram import SAMPLES
from compare.diagrams.report import Diagrams
from compare.reproduction.maps import NAMED_SELECTION, SELECTION
from compare.sweep import Sweep

from ..report.registry import Command


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
    """Draw in which shape a ramp from U+S+ to --stop (rad), then held, comes to rest (paper, Fig. 14).

    A cell of --rates and --dampings (LOW:HIGH:COUNT) is an area: it gets the shares of shapes, from a few
    runs where they agree and up to --samples where they do not. Changes between sure cells are solved for
    to 1 %. --all: the paper's two; --paper: also in the paper's own setting, and where that differs;
    --model both: finite elements and rods, and where their intervals are disjoint.
    """
    where = SELECTION if all else ((compression, shear, stop),)
    calls = [partial(selection_diagram, *place, rates, dampings, seed=seed) for place in where]
    return asked.compute(
        calls,
        model=model,
        nodes=nodes,
        paper=paper,
        samples=samples,
        boundaries=boundaries,
        sweep=sweep or Sweep(),
    )


COMMAND = Command(
    name="selection",
    title="Mode selection over rate and damping",
    takes="some 4 minutes a diagram",
    main=main,
    words=asked.words,
    tables=lambda found: asked.tables(found, NAMED_SELECTION),
    drawings=lambda found: asked.drawings(found, NAMED_SELECTION, "selection"),
    values=asked.values,
    files=lambda found: asked.files(found, "selection"),
    keep=True,
)
