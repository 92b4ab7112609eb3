"""The `plot()` of each result: motion, curve of equilibria, state at rest, convergence."""

from __future__ import annotations

from typing import Any

import numpy as np

from ribbonfem import Branch, History
from ribbonfem.frozen import html_table, some_rows
from ribbonfem.results import RestState

from .curve import Curve
from .perspective import box
from .style import control_label, draw_curve, drawn
from .surface import of_rest


def _heights(axes: Any, result: History | Branch) -> Any:
    axes.set(xlabel=control_label(result.scene), ylabel="$z(1/2)/L$")
    return axes


@drawn()
def motion(history: History, axes: Any = None, *, curve: Branch | Curve | None = None, **line: Any) -> Any:
    """z(1/2)/L of a motion against the control, alpha (rad) where clamps turn.

    Parameters
    ----------
    history: the motion.
    axes: of matplotlib; by default new ones, of a figure of pyplot.
    curve: of equilibria, drawn behind it in grey.
    line: what `Axes.plot` takes.

    Returns
    -------
    The axes; `axes.figure` is the figure.
    """
    if curve is not None:
        curve = Curve.of(curve) if isinstance(curve, Branch) else curve
        draw_curve(axes, curve.angle, curve.height, curve.stable, "0.65", width=1.0)
    axes.plot(history.control, history.height, **line)
    return _heights(axes, history)


@drawn()
def branch(
    branch: Branch, axes: Any = None, *, color: Any = None, label: str = "", colour: Any = None
) -> Any:
    """z(1/2)/L of a curve of equilibria against the control: stable solid, unstable dashed, folds dots.

    Parameters
    ----------
    branch: the curve.
    axes: of matplotlib; by default new ones, of a figure of pyplot.
    color, label: of the curve; "C0" and none by default. (`colour` is the same, and its old name.)

    Returns
    -------
    The axes.
    """
    if color is not None and colour is not None:
        raise TypeError("color and colour are the same: give one of them")
    color = "C0" if color is None and colour is None else colour if color is None else color
    draw_curve(axes, branch.control, branch.height, branch.stable, color, label)
    if branch.folds:
        axes.plot(*zip(*Curve.of(branch).folds, strict=True), "o", color=color, ms=4)
    return _heights(axes, branch)


@drawn("3d")
def rest(state: RestState, axes: Any = None) -> Any:
    """The ribbon at rest in perspective, a surface of its true width, lengths in L.

    Parameters
    ----------
    state: the equilibrium.
    axes: with three dimensions; new ones by default.

    Returns
    -------
    The axes.

    Raises
    ------
    ValueError
        For axes of two dimensions.
    """
    if not hasattr(axes, "plot_surface"):
        raise ValueError("axes: a ribbon needs axes of three dimensions, projection='3d'")
    edges = of_rest(state).edges[0]
    points = edges.reshape(-1, 3)
    if axes.has_data():
        # of several states in the same axes none is cut
        points = np.concatenate((points, np.reshape(axes.get_w_lims(), (3, 2)).T))
    axes.plot_surface(*np.moveaxis(edges, -1, 0), rstride=1, cstride=2, lw=0, color="#3d7ea6")
    box(axes, points)
    axes.set(xlabel="$x/L$", ylabel="$y/L$", zlabel="$z/L$", title=f"{state.name}, index {state.index}")
    return axes


def rest_table(state: RestState) -> str:
    """A table of some nodes for a notebook: arclength and positions, in L."""
    rows = [[float(state.s[k]), *map(float, state.positions[k])] for k in some_rows(len(state.s))]
    return html_table(repr(state), ("s/L", "x/L", "y/L", "z/L"), rows)


@drawn()
def convergence(result: Any, axes: Any = None, **line: Any) -> Any:
    """Errors of a `Convergence` over the size refined, both logarithmic, and the order declared as a slope.

    Parameters
    ----------
    result: the runs; their sizes are edge lengths in L, steps in s or tolerances in L, and errors are
        of the quantity (angles in rad).
    axes: of matplotlib; by default new ones, of a figure of pyplot.
    line: what `Axes.loglog` takes.

    Returns
    -------
    The axes.
    """
    sizes, errors = np.array(result.sizes), np.array(result.errors)
    shown = errors > 0.0
    order = f", order {result.order:.2f}" if np.isfinite(result.order) else ""
    named = {"label": f"{result.model}{order}"} | line
    axes.loglog(sizes[shown], errors[shown], "o-", **named)
    if result.expected is not None and shown.any():
        ends = np.array([sizes[shown].min(), sizes[shown].max()])
        slope = errors[shown][0] * (ends / sizes[shown][0]) ** result.expected
        axes.loglog(ends, slope, "--", color="0.6", lw=1.0, label=f"order {result.expected:g}")
    axes.set(xlabel=f"size ({result.over})", ylabel=f"error of the {result.quantity}")
    axes.legend()
    return axes
