"""Which shape does a ramp skip?  Diagrams over rate and damping, with shares and boundaries (Fig. 11)."""

from __future__ import annotations

from functools import partial
from typing import Literal

from compare.diagrams import asked, skipping_diagram
from compare.diagrams.asked import Diagrams
from compare.diagrams.sheet import SAMPLES
from compare.diagrams.show import Named
from compare.sweep import Sweep

from .registry import Question

PAPER = tuple((compression, 0.40) for compression in (0.40, 0.39, 0.38, 0.37, 0.36, 0.35))
NAMED = {
    0.40: (
        Named(0.01, 0.1, "no skip", "Fig. 10A"),
        Named(1.0, 0.1, "type 2", "Fig. 10A"),
        Named(0.01, 10.0, "no skip", "Fig. 10B"),
        Named(1.0, 10.0, "type 2", "Fig. 10B"),
    ),
    0.35: (
        Named(0.01, 0.3, "type 1", "Fig. 10C"),
        Named(1.0, 0.3, "type 2", "Fig. 10C"),
        Named(0.01, 30.0, "no skip", "Fig. 10D"),
        Named(1.0, 30.0, "type 2", "Fig. 10D"),
    ),
}


def main(
    *,
    compression: float = 0.40,
    shear: float = 0.40,
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
    """Draw which shape a ramp from U+S+ skips, over rate and damping (paper, Fig. 11).

    A cell of --rates and --dampings (LOW:HIGH:COUNT) is an area: it gets the shares of outcomes, from a few
    runs where they agree and up to --samples where they do not. Changes between sure cells are solved for
    to 1 %. --all: the paper's six; --paper: also in the paper's own setting, and where that differs;
    --model both: finite elements and rods, and where their intervals are disjoint.
    """
    where = PAPER if all else ((compression, shear),)
    calls = [partial(skipping_diagram, *place, rates, dampings, seed=seed) for place in where]
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
    name="skipping",
    title="Mode skipping over rate and damping",
    takes="some 3 minutes a diagram",
    main=main,
    words=asked.words,
    tables=lambda found: asked.tables(found, NAMED),
    drawings=lambda found: asked.drawings(found, NAMED, "skipping"),
    values=asked.values,
    files=lambda found: asked.files(found, "skipping"),
    keep=True,
)
