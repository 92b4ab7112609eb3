"""The style of all figures: fonts, sizes, colours, stable curves solid and unstable ones dashed.

Reports are drawn on figures that no window and no backend knows of; what a user plots is a figure of
pyplot, on the user's own backend.  Settings of matplotlib hold while something is drawn, and no longer.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from contextlib import AbstractContextManager, suppress
from functools import wraps
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ribbonfem.scene import Scene


def _matplotlib() -> ModuleType:
    """matplotlib, with the user's backend if it knows it: one of a notebook that is not installed here would
    else keep it from being imported at all."""
    if "matplotlib" in sys.modules:
        return sys.modules["matplotlib"]
    named = os.environ.pop("MPLBACKEND", None)
    try:
        import matplotlib
    finally:
        if named is not None:
            os.environ["MPLBACKEND"] = named
    if named:
        with suppress(ValueError, ImportError):
            matplotlib.rcParams["backend"] = named
    return matplotlib


matplotlib = _matplotlib()
colormaps = matplotlib.colormaps

STYLE = {
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
    "lines.linewidth": 1.4,
    "savefig.dpi": 150,
    "figure.constrained_layout.use": True,
}


def in_style() -> AbstractContextManager[None]:
    """A context in which all that is drawn and saved has one look."""
    context: AbstractContextManager[None] = matplotlib.rc_context(STYLE)
    return context


def blank(width: float, height: float, **settings: Any) -> Any:
    """A figure of a size in inches that is drawn on a file alone: it needs no display and no backend."""
    from matplotlib.figure import Figure

    with in_style():
        return Figure(figsize=(width, height), **settings)


def figure(columns: int, rows: int = 1, width: float = 4.4, height: float = 3.6) -> tuple[Any, Any]:
    """A new figure with a grid of axes, (rows, columns) squeezed to one dimension where it can be."""
    fig = blank(width * columns, height * rows)
    with in_style():
        return fig, fig.subplots(rows, columns)


def panels(count: int, columns: int, width: float, height: float) -> tuple[Any, list[Any]]:
    """A new figure with this many axes in rows of `columns` at most; the rest of the last row is empty."""
    columns = min(columns, count)
    fig, grid = figure(columns, -(-count // columns), width, height)
    axes = list(np.atleast_1d(grid).flat)
    for left in axes[count:]:
        left.set_visible(False)
    return fig, axes[:count]


def _new_axes(projection: str | None) -> Any:
    """Axes of a figure on the user's backend; where that is not to be had, of one that can be saved."""
    size = (4.4, 3.6)
    try:
        import matplotlib.pyplot as plt

        fig = plt.figure(figsize=size)
    except (ImportError, ValueError):
        fig = blank(*size)
    return fig.add_subplot(projection=projection)


def drawn(projection: str | None = None) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """A function of a result, axes and options, given new axes of this look where `axes` is None."""

    def of(function: Callable[..., Any]) -> Callable[..., Any]:
        @wraps(function)
        def plot(result: Any, axes: Any = None, **options: Any) -> Any:
            if axes is not None:
                return function(result, axes, **options)
            with in_style():
                return function(result, _new_axes(projection), **options)

        return plot

    return of


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


def parameter_label(over: str, unit: str) -> str:
    """The label of an axis of a second parameter."""
    return {"compression": "$dL/L$", "shear": "$dW/L$"}.get(over, f"{over} ({unit})")


def control_label(scene: Scene | None) -> str:
    """The label of an axis of the control."""
    if scene is None or scene.clamps_turn:
        return r"$\alpha$ (rad)"
    return f"{scene.drive if isinstance(scene.drive, str) else 'control'} ({scene.drives.unit or '1'})"
