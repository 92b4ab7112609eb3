"""Figures, tables and JSON numbers of diagrams."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from compare.archive import for_programs
from compare.models import MESH
from compare.report.section import Table
from ribbonfem.frozen import html_table
from ribbonfem.output.style import drawn, figure, panels
from ribbonfem.output.tables import library

from .axes import label as axis_label
from .axes import unit_of
from .predictions import TYPE_1, TYPE_2
from .result import Diagram, place, stop_in_words, told
from .setup import NO_STATE, RATE_AND_DAMPING, mesh_of

COLOURS = {
    "no skip": "#2a9d5c",
    "type 1": "#e76f51",
    "type 2": "#7b2d8b",
    "first only": "#f4d35e",
    "none": "#9aa0a6",
    "U+S+": "#457b9d",
    "U+S-": "#2a9d5c",
    "U-S+": "#c1121f",
    "U-S-": "#f4a261",
    "U+": "#2a9d5c",
    "U-": "#c1121f",
    "S+": "#457b9d",
    "S-": "#f4a261",
    NO_STATE: "#dddddd",
}
# of a second state of the same signs
_OTHER = "#6d597a"

DASHES: Mapping[str, str] = {TYPE_1: ":", TYPE_2: "--"}
# what a legend has room for
SHORT: Mapping[str, str] = {
    TYPE_1: "energy reaches the pass to U- (no run)",
    TYPE_2: r"delay reaches $\alpha_{c2}$ (no run)",
}


def colour(name: str) -> str:
    """The colour of an outcome."""
    return COLOURS.get(name, _OTHER)


def short(name: str, diagram: Diagram) -> str:
    """The name of a predicted line, as a legend has room for it."""
    text = SHORT.get(name, name)
    if diagram.scene.start[:2] == "U-":
        text = text.replace("pass to U-", "pass to U+")
    return text if diagram.scene.clamps_turn else text.replace(r"$\alpha_{c2}$", "the second fold")


@dataclass(frozen=True)
class Named:
    """A run that the paper names: where, what it says, and in which of its figures."""

    rate: float
    damping: float
    paper: str
    where: str


def _plain(values: Any) -> Any:
    """Nested lists, a number that is none as None."""
    if isinstance(values, list):
        return [_plain(value) for value in values]
    return None if isinstance(values, float) and math.isnan(values) else values


def numbers(diagram: Diagram) -> dict[str, Any]:
    """The fields of a diagram for programs."""
    usual = diagram.over == RATE_AND_DAMPING
    centres, of_a_run = (("rates", "dampings"), RATE_AND_DAMPING) if usual else (("x", "y"),) * 2
    arrays = (*centres, "shares", "uncertainty", "runs", "outcome")
    scene = diagram.scene
    return {
        "kind": diagram.kind,
        "over": list(diagram.over),
        "compression": scene.compression,
        "shear": scene.shear,
        "stop": scene.stop,
        "start": scene.start,
        "drive": scene.drive if isinstance(scene.drive, str) else scene.drives.moved,
        "preset": dict(scene.preset),
        "gravity": None if scene.gravity is None else list(scene.gravity),
        "natural_shape": scene.ribbon.shaped,
        "rate_unit": unit_of("rate", scene),
        "model": diagram.model,
        "policy": dict(diagram.options),
        "seed": diagram.seed,
        "outcomes": list(diagram.outcomes),
        **{key: _plain(np.asarray(value).tolist()) for key, value in for_programs(diagram, arrays).items()},
        "failed": [for_programs(failed, (*of_a_run, "reason")) for failed in diagram.failed],
        "boundaries": [for_programs(boundary) for boundary in diagram.boundaries],
        "folds": list(diagram.folds),
        "predicted": {name: np.asarray(curve).tolist() for name, curve in diagram.predicted.items()},
        "unpredicted": dict(diagram.unpredicted),
    }


def label(diagram: Diagram) -> str:
    """Compression, shear, another rig than the usual one, stop, model and mesh."""
    scene, mesh = diagram.scene, mesh_of(diagram.model, diagram.options)
    stop = stop_in_words(scene, diagram.over)
    if scene.drive == "left":
        stop = stop.removesuffix(" rad")
    size = f"{mesh[MESH[diagram.model]]} {MESH[diagram.model]}"
    where = ", ".join((place(scene, diagram.over, ".2f"), *told(scene)))
    return f"{where}{stop}, {diagram.model}, {size}"


def summary(diagrams: Sequence[Diagram]) -> Table:
    """A row a diagram: its cells by what they are called, runs and failures."""
    names = sorted(
        {str(name) for d in diagrams for name in np.unique(d.outcome)},
        key=lambda n: (n in ("cut", "mixed"), n),
    )
    return Table(
        "Cells of each diagram",
        ["diagram", *(name or "no run ended" for name in names), "runs", "failed", "boundaries", "bands"],
        [
            [label(d), *(int(np.count_nonzero(d.outcome == name)) for name in names)]
            + [int(d.runs.sum()), len(d.failed), len(d.boundaries), sum(b.band for b in d.boundaries)]
            for d in diagrams
        ],
        ["s"] + ["d"] * (len(names) + 4),
        "A cell is an area of rate and damping. An outcome: all its runs agree. cut: one line separates two "
        "outcomes. mixed: none does, and no single run decides; its share says what runs do there. bands: "
        "changes that are no point but a range in which both outcomes come.",
    )


def mixed_table(diagrams: Sequence[Diagram]) -> Table:
    """Every mixed cell with its shares."""
    names = [
        name
        for name in dict.fromkeys(name for d in diagrams for name in d.outcomes)
        if any(np.nansum(d.shares[..., d.outcomes.index(name)]) > 0.0 for d in diagrams if name in d.outcomes)
    ]
    rows = []
    for d in diagrams:
        for j, i in np.argwhere(np.asarray(d.undetermined)):
            shares = dict(zip(d.outcomes, map(float, d.shares[j, i]), strict=True))
            cell = [label(d), float(d.x[i]), float(d.y[j])]
            rows.append(
                [*cell, *(shares.get(name) for name in names), float(d.uncertainty[j, i]), int(d.runs[j, i])]
            )
    return Table(
        "Cells that no single run decides",
        ["diagram", *(("rate", "nu") if diagrams[0].over == RATE_AND_DAMPING else ("x", "y"))]
        + [*names, "±", "runs"],
        rows,
        ["s", ".3g", ".3g", *[".2f"] * len(names), ".2f", "d"],
        "Shares of the runs that ended; ±: half the 95 % interval of the largest.",
    )


def _cell(diagram: Diagram, rate: float, damping: float) -> tuple[int, int] | None:
    """Row and column of the cell that holds a point."""
    across, up = diagram.axes
    i, j = across.cell_of(rate), up.cell_of(damping)
    return None if i is None or j is None else (j, i)


def _verdict(diagram: Diagram, case: Named, cell: str, share: float) -> str:
    """What a cell says of a run that the paper names."""
    if cell == case.paper:
        return "confirmed"
    if cell == "mixed":
        return f"not determined: {share:.0%} of the runs" if share > 0.0 else "not found"
    if cell == "cut":
        # on which side of the line: that of the nearest run
        near = min(
            (s for s in diagram.samples if s.outcome),
            key=lambda s: math.hypot(math.log(s.rate / case.rate), math.log(s.damping / case.damping)),
        )
        return f"{'confirmed' if near.outcome == case.paper else 'not found'}; a boundary crosses the cell"
    return "not found"


def named_table(diagrams: Sequence[Diagram], named: Mapping[float, Sequence[Named]]) -> Table:
    """The paper's named runs, each in its cell: what the paper says, and what shares of runs do."""
    rows = []
    for d in diagrams:
        for case in named.get(d.scene.compression, ()):
            place = _cell(d, case.rate, case.damping)
            if place is None:
                continue
            shares = dict(zip(d.outcomes, map(float, d.shares[place]), strict=True))
            cell = str(d.outcome[place])
            listed = ", ".join(f"{name} {share:.2f}" for name, share in shares.items() if share > 0.0)
            verdict = _verdict(d, case, cell, shares.get(case.paper, 0.0))
            rows.append([label(d), case.where, case.rate, case.damping, case.paper, cell, listed, verdict])
    return Table(
        "The paper's named runs in their cells",
        ["diagram", "figure", "rate", "nu", "paper", "cell", "shares", "verdict"],
        rows,
        ["s", "s", ".3g", ".3g", "s", "s", "s", "s"],
    )


def draw_panel(axes: Any, diagram: Diagram, named: Sequence[Named] = ()) -> None:
    """One diagram: colours mixed by shares, boundaries, bands, predictions, failures, the paper's runs."""
    from matplotlib.colors import to_rgb

    palette = np.array([to_rgb(colour(name)) for name in diagram.outcomes]).reshape(-1, 3)
    shares = np.nan_to_num(np.array(diagram.shares))
    # on white, so that a cell without a run stays so
    mixed = np.einsum("jik,kc->jic", shares, palette) + (1.0 - shares.sum(axis=2))[..., None]
    across, up = diagram.axes
    x, y = across.edges, up.edges
    axes.pcolormesh(x, y, np.clip(0.25 + 0.75 * mixed, 0.0, 1.0), lw=0)
    for j, i in np.argwhere(np.asarray(diagram.undetermined)):
        axes.plot(diagram.x[i], diagram.y[j], "o", ms=2.6, mfc="white", mec="black", mew=0.6)
    for b in diagram.boundaries:
        along = b.along == across.name
        if b.band:
            ends = np.array([[b.low, b.high], [b.other, b.other]])
            axes.plot(
                *(ends if along else ends[::-1]), color="black", lw=2.6, alpha=0.45, solid_capstyle="butt"
            )
        point = (b.value, b.other) if along else (b.other, b.value)
        axes.plot(*point, "k.", ms=3.2)
    for name, curve in diagram.predicted.items():
        if len(curve):
            axes.plot(curve[:, 0], curve[:, 1], color="black", ls=DASHES.get(name, "--"), lw=1.1)
    for failed in diagram.failed:
        axes.plot(failed.x, failed.y, "x", ms=4, color="red")
    for case in named:
        axes.plot(case.rate, case.damping, "*", ms=9, mfc=colour(case.paper), mec="black", mew=0.8, zorder=6)
    scales = ["log" if axis.logarithmic else "linear" for axis in (across, up)]
    axes.set(xscale=scales[0], yscale=scales[1], xlim=(x[0], x[-1]), ylim=(y[0], y[-1]))
    axes.set(xlabel=axis_label(across.name, diagram.scene), ylabel=axis_label(up.name, diagram.scene))
    axes.set_title(textwrap.fill(label(diagram), 56), fontsize=8.5)


def _handles(diagrams: Sequence[Diagram], paper: bool = False) -> list[Any]:
    """What a legend explains: every colour, mark and line that is drawn, and none that is not."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    there = [
        n
        for n in dict.fromkeys(name for d in diagrams for name in d.outcomes)
        if any(np.nansum(d.shares[..., d.outcomes.index(n)]) > 0 for d in diagrams if n in d.outcomes)
    ]
    handles: list[Any] = [Patch(color=colour(name), alpha=0.75, label=name) for name in there]
    if any(d.undetermined.any() for d in diagrams):
        handles.append(Line2D([], [], marker="o", ls="", ms=4, mfc="white", mec="black", label="mixed cell"))
    if any(d.boundaries for d in diagrams):
        handles.append(Line2D([], [], marker=".", ls="", color="black", label="change, to 1 %"))
    if any(b.band for d in diagrams for b in d.boundaries):
        handles.append(Line2D([], [], color="black", lw=2.6, alpha=0.45, label="band of both"))
    if any(d.failed for d in diagrams):
        handles.append(Line2D([], [], marker="x", ls="", ms=4, color="red", label="run that failed"))
    for name in dict.fromkeys(n for d in diagrams for n, curve in d.predicted.items() if len(curve)):
        line = DASHES.get(name, "--")
        handles.append(Line2D([], [], color="black", ls=line, lw=1.1, label=short(name, diagrams[0])))
    for name in sorted({name for d in diagrams for name in d.unpredicted}):
        if not any(len(d.predicted.get(name, ())) for d in diagrams):
            label = f"{short(name, diagrams[0])}: {diagrams[0].unpredicted.get(name, 'not there')[:40]}"
            handles.append(Line2D([], [], ls="", label=label))
    if paper:
        handles.append(
            Line2D([], [], marker="*", ls="", ms=9, mfc="white", mec="black", label="paper's runs")
        )
    return handles


def draw(diagrams: Sequence[Diagram], named: Mapping[float, Sequence[Named]]) -> Any:
    """All diagrams, a panel each."""
    fig, grid = panels(len(diagrams), 3, width=3.7, height=3.3)
    for axes, diagram in zip(grid, diagrams, strict=True):
        draw_panel(axes, diagram, named.get(diagram.scene.compression, ()))
    handles = _handles(diagrams, any(named.get(d.scene.compression) for d in diagrams))
    fig.legend(
        handles=handles,
        loc="outside lower center",
        ncols=min((2, 3, 5)[min(3, len(diagrams)) - 1], len(handles)),
        fontsize=7.5,
    )
    return fig


def draw_differences(paper: Sequence[Diagram], ours: Sequence[Diagram]) -> Any:
    """The paper's setting, the same mesh with small errors in time, and the cells whose outcome differs."""
    fig, grid = figure(3, len(paper), width=3.5, height=3.1)
    for row, (one, two) in zip(np.atleast_2d(grid), zip(paper, ours, strict=True), strict=True):
        for axes, diagram, what in ((row[0], one, "implicit Euler, 1 ms"), (row[1], two, "TR-BDF2, shares")):
            draw_panel(axes, diagram)
            axes.set_title(f"{label(diagram)}: {what}", fontsize=7.5)
        x, y = (axis.edges for axis in one.axes)
        row[2].pcolormesh(x, y, differing_share(one, two), vmin=0.0, vmax=1.0, cmap="magma_r")
        row[2].set(xscale="log", yscale="log", title="share of runs that end otherwise")
        for axes in row:
            axes.set(xlabel=axis_label("rate", one.scene), ylabel=axis_label("damping", one.scene))
    return fig


def differing_share(paper: Diagram, ours: Diagram) -> Any:
    """(m, n) the share of our runs in a cell that end otherwise than the paper's run at its centre."""
    index = {name: k for k, name in enumerate(ours.outcomes)}
    result = np.full(ours.shares.shape[:2], np.nan)
    for j in range(len(ours.y)):
        for i in range(len(ours.x)):
            name = str(paper.outcome[j, i])
            if name in index:
                result[j, i] = 1.0 - float(ours.shares[j, i, index[name]])
    return result


@drawn()
def plot(diagram: Diagram, axes: Any = None) -> Any:
    """A diagram over what varies, colours mixed by the shares of outcomes.

    Parameters
    ----------
    diagram: what ramps do.
    axes: of matplotlib; by default new ones, of a figure of pyplot.

    Returns
    -------
    The axes.
    """
    draw_panel(axes, diagram)
    axes.legend(handles=_handles([diagram]), fontsize=7)
    return axes


def frame(diagram: Diagram) -> Any:
    """A diagram as a `pandas.DataFrame`, a row for each cell and outcome.

    Returns
    -------
    Columns of what varies (usually rate, of the control, and damping, 1/s), outcome, share (NaN where no run
    ended), cell (its outcome, "cut" or "mixed"), runs, doubt (of the cell's largest share); `attrs` has the
    units by column, kind, folds (of the control), model, drive, scene, options and seed.

    Raises
    ------
    ImportError
        If pandas is not installed; says how to install it.
    """
    shape = diagram.shares.shape
    across, up = diagram.over
    cells: dict[str, Any] = {up: diagram.y[:, None], across: diagram.x}
    cells |= {"cell": diagram.outcome, "runs": diagram.runs, "doubt": diagram.uncertainty}
    columns = {
        name: np.repeat(np.broadcast_to(values, shape[:2]).ravel(), shape[2])
        for name, values in cells.items()
    }
    columns["outcome"] = np.tile(np.array(diagram.outcomes), shape[0] * shape[1])
    columns["share"] = np.array(diagram.shares).ravel()
    order = [across, up, "outcome", "share", "cell", "runs", "doubt"]
    result = library("pandas", "to_pandas").DataFrame({name: columns[name] for name in order})
    result.attrs.update(
        units={name: unit_of(name, diagram.scene) for name in diagram.over},
        kind=diagram.kind,
        folds=[float(control) for control in diagram.folds],
        model=diagram.model,
        drive=str(diagram.scene.drive),
        scene=repr(diagram.scene),
        options=repr(dict(diagram.options)),
        seed=diagram.seed,
    )
    return result


def html(diagram: Diagram) -> str:
    """A table of cells for a notebook: the outcome of each, as in the figure."""
    across, up = diagram.over
    unit = "" if diagram.scene.drive == "left" or across != "rate" else f" ({unit_of(across, diagram.scene)})"
    columns = [f"{'nu' if up == 'damping' else up} \\ {across}{unit}", *(f"{x:.3g}" for x in diagram.x)]
    rows = [[f"{y:.3g}", *map(str, cells)] for y, cells in zip(diagram.y, diagram.outcome, strict=True)]
    return html_table(repr(diagram), columns, rows[::-1])
