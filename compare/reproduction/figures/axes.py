"""A figure as data (axes, lines, symbols), from which its picture is drawn and its CSV table written."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from compare.diagrams import Diagram
from compare.diagrams.show import Named, draw_panel
from ribbonfem.output.style import blank
from ribbonfem.results import Array

# how a series is drawn: what `Axes.plot` takes
LOOKS: dict[str, dict[str, Any]] = {
    "line": {"ls": "-", "lw": 1.3},
    "thin": {"ls": "-", "lw": 0.8},
    "dashed": {"ls": "--", "lw": 1.0},
    "dotted": {"ls": ":", "lw": 1.0},
    "symbols": {"ls": "", "ms": 3.4, "mfc": "none", "mew": 0.8, "zorder": 4},
    "dots": {"ls": "", "ms": 4.5, "zorder": 5},
    "route": {"ls": "-", "lw": 4.5, "alpha": 0.4, "zorder": 1, "solid_capstyle": "butt"},
    # a closed outline
    "strip": {"lw": 0.8, "alpha": 0.3},
    # two edges of a surface in space
    "surface": {},
}


@dataclass(frozen=True)
class Series:
    """One line or one kind of symbol.

    Attributes
    ----------
    name: says what it is: quantity, parameters, model.
    x, y: (rows,); a row of NaN breaks a line.
    look: of `LOOKS`.
    colour, marker: of matplotlib.
    label: in the legend; empty of one that is not in it.
    z: (rows,) where the panel has three dimensions, or a value at each point.
    """

    name: str
    x: Array
    y: Array
    look: str = "line"
    colour: str = "black"
    marker: str = "o"
    label: str = ""
    z: Array | None = None


@dataclass(frozen=True)
class Panel:
    """Axes with what is in them.

    Attributes
    ----------
    title, x, y: of the axes.
    series: what is drawn, or, of a diagram, what is written beside it.
    limits: xlim and ylim; None where matplotlib chooses.
    log: whether both axes are logarithmic.
    equal: whether both axes have one scale.
    legend: where, as of matplotlib; none without.
    diagram, named: a diagram over rate and damping that is drawn instead of its series.
    """

    title: str
    x: str
    y: str
    series: tuple[Series, ...]
    limits: tuple[tuple[float, float] | None, tuple[float, float] | None] = (None, None)
    log: bool = False
    equal: bool = False
    legend: str = ""
    diagram: Diagram | None = None
    named: tuple[Named, ...] = ()


@dataclass(frozen=True)
class FigureData:
    """A figure.

    Attributes
    ----------
    name, caption: "fig3", say, and what it shows.
    panels, columns: row by row; one without series is a gap.
    width, height: of a panel, inches.
    legend: what stands in a legend below all panels.
    """

    name: str
    caption: str
    panels: tuple[Panel, ...]
    columns: int = 2
    width: float = 4.4
    height: float = 3.4
    legend: tuple[Series, ...] = ()


def joined(parts: Sequence[tuple[Any, Any]]) -> tuple[Array, Array]:
    """Several lines as one, rows of NaN between them."""
    x: list[float] = []
    y: list[float] = []
    for k, (a, b) in enumerate(parts):
        x += ([math.nan] if k else []) + [float(value) for value in a]
        y += ([math.nan] if k else []) + [float(value) for value in b]
    return np.array(x), np.array(y)


def equilibria(
    name: str, angle: Any, height: Any, stable: NDArray[np.bool_], colour: str, label: str = ""
) -> tuple[Series, Series]:
    """A curve of equilibria: its stable parts, and the others, dashed; a segment with a fold is dashed."""
    angle, height = np.asarray(angle), np.asarray(height)
    solid = stable[:-1] & stable[1:]
    made = []
    for kind, look, said in ((True, "line", "stable"), (False, "dashed", "unstable")):
        keep = np.concatenate(([False], solid == kind, [False])).astype(int)
        ends = np.flatnonzero(np.diff(keep))
        parts = [(angle[a : b + 1], height[a : b + 1]) for a, b in zip(ends[::2], ends[1::2], strict=True)]
        made.append(Series(f"{name}, {said}", *joined(parts), look, colour, label=label if kind else ""))
    return made[0], made[1]


def _show(axes: Any, series: Series) -> None:
    style = dict(LOOKS[series.look])
    label = series.label or None
    if series.look == "strip":
        axes.fill(series.x, series.y, color=series.colour, label=label, **style)
        return
    if series.look == "surface":
        half = len(series.x) // 2
        assert series.z is not None
        rows = [np.stack((part[:half], part[half:])) for part in (series.x, series.y, series.z)]
        axes.plot_surface(*rows, rstride=1, cstride=2, lw=0, color=series.colour)
        return
    if series.look in ("symbols", "dots"):
        style |= {"marker": series.marker, "mec": series.colour}
        if series.look == "dots":
            style["mfc"] = series.colour
    points = [part for part in (series.x, series.y, series.z) if part is not None]
    axes.plot(*points, color=series.colour, label=label, **style)


def _fill(axes: Any, panel: Panel) -> None:
    if panel.diagram is not None:
        draw_panel(axes, panel.diagram, panel.named)
        axes.set_title("")
    else:
        for series in panel.series:
            _show(axes, series)
        if panel.log:
            axes.set(xscale="log", yscale="log")
    axes.set(xlabel=panel.x, ylabel=panel.y)
    axes.set_title(panel.title, fontsize=9, loc="left")
    spatial = hasattr(axes, "plot_surface")
    if spatial:
        points = [np.concatenate([np.asarray(getattr(s, n)) for s in panel.series]) for n in "xyz"]
        axes.set_box_aspect([max(float(np.ptp(part)), 0.2) for part in points])
        axes.view_init(elev=22.0, azim=-70.0)
        axes.set_zlabel("$z/L$")
        axes.locator_params(nbins=4)
    for name, limits in zip(("xlim", "ylim"), panel.limits, strict=True):
        if limits is not None:
            axes.set(**{name: limits})
    if panel.equal and not spatial:
        axes.set_aspect("equal")
    if panel.legend:
        axes.legend(fontsize=6.5, loc=panel.legend)


def draw(data: FigureData) -> Any:
    """Draw a figure."""
    rows = -(-len(data.panels) // data.columns)
    fig = blank(data.width * data.columns, data.height * rows)
    for number, panel in enumerate(data.panels, 1):
        if not panel.series:
            continue
        spatial = any(series.look == "surface" for series in panel.series)
        axes = fig.add_subplot(rows, data.columns, number, projection="3d" if spatial else None)
        _fill(axes, panel)
    if data.legend:
        from matplotlib.lines import Line2D

        handles = [Line2D([], [], **_key(series)) for series in data.legend]
        fig.legend(handles=handles, loc="outside lower center", ncols=min(6, len(handles)), fontsize=7.5)
    return fig


def _key(series: Series) -> dict[str, Any]:
    """A series as an entry of a legend below the figure."""
    style = dict(LOOKS[series.look], color=series.colour)
    style.pop("zorder", None)
    if series.look in ("symbols", "dots"):
        style |= {"marker": series.marker, "mec": series.colour}
        if series.look == "dots":
            style["mfc"] = series.colour
    return {**style, "label": series.name}


def rows(data: FigureData) -> Iterator[tuple[str, str, str, str, str, str, str]]:
    """What is written beside a figure: panel, names of the axes, series, x, y, and z where there is one."""
    for panel in data.panels:
        for series in panel.series:
            for k in range(len(series.x)):
                values = [series.x[k], series.y[k], math.nan if series.z is None else series.z[k]]
                shown = ["" if math.isnan(value) else f"{value:.8g}" for value in map(float, values)]
                yield panel.title, panel.x, panel.y, series.name, shown[0], shown[1], shown[2]


def to_csv(data: FigureData) -> str:
    """A tidy table of everything that is drawn; an empty x and y is a gap in a line."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(["panel", "x_axis", "y_axis", "series", "x", "y", "z"])
    writer.writerows(rows(data))
    return stream.getvalue()
