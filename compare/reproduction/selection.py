"""Which shape does a ramp that stops select?  Diagrams over rate and damping, with shares (Fig. 14)."""

from pathlib import Path
from typing import Literal

from compare.diagrams import selection_diagram
from compare.diagrams.diagram import SAMPLES
from compare.diagrams.report import Diagrams
from compare.sweep import Sweep

from .rate_damping import SELECTION, command, compute


def main(
    *,
    scene: Path | None = None,
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
    --model both: finite elements and rods, and where their intervals are disjoint. --scene FILE: what a
    TOML file says (compression, shear, start, drive, stop, preset, gravity, ribbon), not those options; its
    rate, damping and hold are not used.
    """
    options = dict(nodes=nodes, model=model, samples=samples, boundaries=boundaries, paper=paper)
    asked = {
        "all": all,
        "paper": paper,
        "compression": compression != 0.40,
        "shear": shear != 0.40,
        "stop": stop != 0.36,
    }
    places = SELECTION if all else ((compression, shear, stop),)
    axes = rates, dampings
    return compute(
        selection_diagram, places, axes, seed=seed, sweep=sweep, scene=scene, asked=asked, **options
    )


COMMAND = command("selection", main, "some 4 minutes a diagram")
