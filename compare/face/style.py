"""Drawing habits shared by all figures: no display, one look, stable solid and unstable dashed."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from numpy.typing import NDArray

# a notebook has a backend of its own, and says so; else no display is needed
if not (os.environ.get("MPLBACKEND") or "matplotlib.pyplot" in sys.modules):
    matplotlib.use("Agg")
import matplotlib.pyplot as plt  # the backend has to be chosen before pyplot is imported

STYLE = {
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
    "lines.linewidth": 1.4,
    "savefig.dpi": 150,
    "figure.constrained_layout.use": True,
}


def figure(columns: int, rows: int = 1, width: float = 4.4, height: float = 3.6) -> tuple[Any, Any]:
    """A new figure with a grid of axes, (rows, columns) squeezed to one dimension where it can be."""
    plt.rcParams.update(STYLE)
    return plt.subplots(rows, columns, figsize=(width * columns, height * rows))


def save(fig: Any, path: Path) -> str:
    """Write a figure as PNG and close it; returns the file's name."""
    path.parent.mkdir(parents=True, exist_ok=True)
    fig.savefig(path)
    plt.close(fig)
    return path.name


def draw_curve(
    axes: Any,
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    stable: NDArray[np.bool_],
    colour: Any,
    label: str = "",
    width: float = 1.4,
) -> None:
    """Draw a curve of equilibria, its stable parts solid and its unstable parts dashed.

    A segment between a stable and an unstable point, where the fold lies, is drawn dashed.
    """
    solid = stable[:-1] & stable[1:]
    for kind, style in ((True, "-"), (False, "--")):
        keep = solid == kind
        inside = np.zeros(len(x), dtype=bool)
        inside[:-1] |= keep
        inside[1:] |= keep
        # a point that ends one run and starts the next must not join the two
        breaks = np.flatnonzero(np.diff(np.concatenate(([False], keep, [False])).astype(int)))
        for start, stop in zip(breaks[::2], breaks[1::2], strict=True):
            run = slice(start, stop + 1)
            axes.plot(x[run], y[run], style, color=colour, label=label or None, lw=width)
            label = ""
