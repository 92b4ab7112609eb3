"""The `plot()` of each result: motion, curve of equilibria, state at rest, convergence, fit."""

from __future__ import annotations

from typing import Any

import numpy as np

from ribbonfem import Branch, FoldCurve, History, PitchforkCurve
from ribbonfem.frozen import html_table, some_rows
from ribbonfem.measured import in_own_units
from ribbonfem.results import RestState

from .curve import Curve
from .perspective import box
from .style import control_label, draw_curve, drawn, parameter_label
from .surface import of_rest

# data up to which each has an error bar
_FEW = 60
# points of a piece of a curve in two parameters
_FINE = 15


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


@drawn()
def two_parameters(
    curve: FoldCurve | PitchforkCurve, axes: Any = None, *, color: Any = None, label: str = ""
) -> Any:
    """The control of a curve of folds or pitchforks against its parameter; dots are cusps.

    Solid where a stable state ends, or one of its branches crosses; dashed where others do.

    Parameters
    ----------
    curve: of folds or of pitchforks.
    axes: of matplotlib; by default new ones, of a figure of pyplot.
    color, label: of the curve; "C0" and none by default.

    Returns
    -------
    The axes.
    """
    color = "C0" if color is None else color
    fine = [np.linspace(pieces[0].domain[0], pieces[0].domain[1], _FINE) for pieces in curve.pieces]
    if fine:
        parameter, control = (
            np.concatenate([pieces[k](s) for pieces, s in zip(curve.pieces, fine, strict=True)])
            for k in (0, 1)
        )
        rows = np.searchsorted(curve.arclength, np.concatenate(fine)).clip(0, len(curve) - 1)
        draw_curve(axes, parameter, control, curve.stable[rows], color, label)
    cusps = curve.cusps if isinstance(curve, FoldCurve) else ()
    for cusp in cusps:
        axes.plot(cusp.parameter, cusp.control, "o", color=color, ms=4)
    axes.set(xlabel=parameter_label(curve.over, curve.unit), ylabel=control_label(curve.scene))
    return axes


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


@drawn()
def fit(result: Any, axes: Any = None, *, quantity: str | None = None, scene: int = 0, **line: Any) -> Any:
    """What was measured and what a `Fit` predicts, over time, control or scenes; residuals above.

    Parameters
    ----------
    result: the fit.
    axes: of matplotlib; by default new ones, of a figure of pyplot.
    quantity: the name of what is drawn; by default the first that was measured.
    scene: which of several, from 0; events are drawn over all of them.
    line: what `Axes.plot` takes, of the line of the fit.

    Returns
    -------
    The axes; above them in `axes.child_axes[0]` are the residuals, in standard deviations.

    Raises
    ------
    ValueError
        For a quantity that was not measured.
    """
    data, drives = result.measured[scene], result.scenes[scene].drives
    name = data.measured[0] if quantity is None else quantity
    if name not in data.measured:
        raise ValueError(f"quantity = {name!r}: must be one of {', '.join(data.measured)}")
    events = name not in data.columns
    which = [k for k, each in enumerate(result.measured) if name in each.measured] if events else [scene]
    rows = [
        (result.measured[k].values(name), result.predicted[k][name], result.sigma[k][name]) for k in which
    ]
    measured, predicted, sigma = (np.concatenate(each) for each in zip(*rows, strict=True))
    texts = (f"{key} {text}" for key, text in result.texts.items())
    style: dict[str, Any] = {"color": "C1", "lw": 1.0, "label": "fit\n" + "\n".join(texts)} | line
    if events:
        over, label = _over_scenes(result, which, name)
        axes.plot(over, predicted, **({"marker": "x", "ls": "none"} | style))
    elif data.time is not None:
        over, label = data.values("time"), f"time ({data.unit('time')})"
        axes.plot(*_fitted_motion(result, scene, name, np.nanmax(over), predicted), **style)
    else:
        over, label = data.values("control"), f"control ({data.unit('control', drives.unit)})"
        curve, ribbon = result.curves[scene], result.scenes[scene].ribbon
        x, z = (in_own_units(data.unit(each, drives.unit), ribbon) for each in ("control", name))
        draw_curve(
            axes, curve.control / x, getattr(curve, name) / z, curve.stable, style["color"], style["label"]
        )
    few = len(over) <= _FEW
    dots: dict[str, Any] = {"color": "C0", "ms": 5 if few else 3, "label": "measured", "zorder": 1}
    if few:
        axes.errorbar(over, measured, sigma, fmt=".", **dots)
    else:
        axes.plot(over, measured, ".", **dots)
    above = axes.inset_axes((0.0, 1.04, 1.0, 0.24), sharex=axes)
    above.axhspan(-1.0, 1.0, color="0.92")
    above.plot(over, (measured - predicted) / sigma, ".", color="C0", ms=4 if few else 2)
    above.set_ylabel("residual\n/ $\\sigma$")
    above.tick_params(labelbottom=False)
    axes.set(xlabel=label, ylabel=f"{name} ({data.unit(name, drives.unit)})")
    axes.legend(frameon=True, framealpha=0.9, edgecolor="none")
    return axes


def _fitted_motion(result: Any, scene: int, name: str, last: float, predicted: Any) -> tuple[Any, Any]:
    """Time and quantity of the motion in the units of what was measured: of heights at every step."""
    data, ribbon = result.measured[scene], result.scenes[scene].ribbon
    if name != "height":
        order = np.argsort(data.values("time"))
        return data.values("time")[order], predicted[order]
    offset = result.values.get("offset", result.values.get(f"offset {scene + 1}", 0.0))
    time, _, height, *_ = result.histories[scene].track
    clock = (time + offset) / in_own_units(data.unit("time"), ribbon)
    # before it moves it is at rest
    first = min(float(np.nanmin(data.values("time"))), clock[0])
    clock, height = np.concatenate(([first], clock)), np.concatenate((height[:1], height))
    return clock[clock <= last], height[clock <= last] / in_own_units(data.unit(name), ribbon)


def _over_scenes(result: Any, which: list[int], name: str) -> tuple[Any, str]:
    """What events are drawn over: rates where they differ, else numbers of scenes; of folds their own."""
    counts = [len(result.measured[k].values(name)) for k in which]
    rates = [result.scenes[k].rate for k in which]
    if len(set(rates)) > 1:
        return np.repeat(rates, counts), f"rate ({result.scenes[which[0]].drives.unit or 1}/s)"
    if len(which) == 1:
        return np.arange(1, counts[0] + 1), "number"
    return np.repeat(np.array(which) + 1, counts), "scene"
