"""Which shape does a ramp that stops select?  Diagrams over rate and damping, with shares (Fig. 14)."""

from __future__ import annotations

from functools import partial
from typing import Literal

from compare.diagrams import asked, selection_diagram
from compare.diagrams.asked import Diagrams
from compare.diagrams.sheet import SAMPLES
from compare.diagrams.show import Named
from compare.sweep import Sweep

from .registry import Question

PAPER = ((0.40, 0.40, 0.36), (0.35, 0.40, 0.27))
NAMED = {
    0.40: (
        Named(0.01, 0.1, "U+S-", "Fig. 12A"),
        Named(1.0, 0.1, "U-S+", "Fig. 12A"),
        Named(0.01, 10.0, "U+S-", "Fig. 12B"),
        Named(1.0, 10.0, "U+S-", "Fig. 12B"),
    ),
    0.35: (
        Named(0.01, 0.3, "U-S+", "Fig. 13A"),
        Named(1.0, 0.3, "U-S+", "Fig. 13A"),
        Named(0.01, 30.0, "U+S-", "Fig. 13B"),
        Named(1.0, 30.0, "U+S-", "Fig. 13B"),
    ),
}


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
    where = PAPER if all else ((compression, shear, stop),)
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


QUESTION = Question(
    name="selection",
    title="Mode selection over rate and damping",
    takes="some 4 minutes a diagram",
    main=main,
    words=asked.words,
    tables=lambda found: asked.tables(found, NAMED),
    drawings=lambda found: asked.drawings(found, NAMED, "selection"),
    values=asked.values,
    files=lambda found: asked.files(found, "selection"),
    keep=True,
)
