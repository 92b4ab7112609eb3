"""Tables and figures of the states of the sheared ribbon at alpha = 0, and of the bound on skipping."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

import der
from compare.report.section import Drawing, Table
from compare.reproduction.sheared import (
    COMPRESSIONS,
    FOUR,
    LINES,
    MAP_ELEMENTS,
    MAPPED,
    PHASES,
    TABULATED,
    Heights,
    cells,
    chord_limit,
    forks_of,
    heights,
)
from compare.sweep import Sweep
from ribbonfem import Scene, kirchhoff
from ribbonfem.kirchhoff import Pitchforks
from ribbonfem.output.style import colormaps, draw_curve, figure
from ribbonfem.results import RestState

from .bound_map import bound_column, draw_bound, zero_of


def _draw_heights(ax: Any, result: Sequence[Heights]) -> None:
    for k, its in enumerate(result):
        colour = colormaps["viridis"](0.85 * k / max(1, len(result) - 1))
        for name, x, y, stable in its.lines:
            draw_curve(ax, x, y, stable, colour, f"{its.compression:.1f}" if name == "U" else "", 1.3)
        for name, shear, height in its.symbols:
            ax.plot(shear, height, PHASES[name][0], ms=4, mfc="none", mec=colour, mew=0.8)
    handles, labels = ax.get_legend_handles_labels()
    for kind in ("U", "US", "S"):
        ax.plot([], [], PHASES[kind][0], ms=4, mfc="none", mec="0.3", mew=0.8, label=f"DER, {kind}")
    first = ax.legend(handles, labels, title=r"$\Delta L/L$", fontsize=7.5, loc="lower left")
    first.set_bbox_to_anchor((0.0, 0.05))
    ax.add_artist(first)
    ax.legend(*[part[-3:] for part in ax.get_legend_handles_labels()], fontsize=7.5, loc="upper right")
    ax.set(xlabel=r"$\Delta W/L$", ylabel=r"$|z(1/2)|/L$", xlim=(0.0, 0.86), ylim=(-0.012, 0.40))
    ax.set_title("(a) states at $\\alpha = 0$")


def _draw_phases(ax: Any, forks: Sequence[Pitchforks], records: Sequence[dict[str, Any]]) -> None:
    """The phase diagram, its lines by elements and its symbols by rods."""
    x = np.array([0.0, *LINES])
    broken, merged, restored = (
        np.array([0.0, *(getattr(fork, name) or np.nan for fork in forks)])
        for name in ("broken", "merged", "restored")
    )
    # the lines leave the origin as roots: splines in the square root of the compression
    root = np.linspace(0.0, np.sqrt(x[-1]), 300)
    fine = root**2
    lines = [CubicSpline(np.sqrt(x), line)(root) for line in (broken, merged, restored)]
    edge = np.sqrt(fine * (2.0 - fine))
    bands = (("U", 0.0 * fine, lines[0]), ("US", lines[0], lines[1]), ("S", lines[1], lines[2]))
    for name, low, high in (*bands, ("S, U", lines[2], edge)):
        ax.fill_between(fine, low, high, color=PHASES[name][1], alpha=0.13, lw=0)
    for line, style, label in zip(lines, ("-", "--", "-."), ("U → US", "US → S", "U regained"), strict=True):
        ax.plot(fine, line, style, color="black", lw=1.3, label=label)
    ax.plot(fine, edge, color="0.55", lw=0.9, label="ends as far apart as L")
    for name, (marker, colour) in PHASES.items():
        chosen = [record for record in records if record["der"] == name]
        ax.plot(
            [record["compression"] for record in chosen],
            [record["shear"] for record in chosen],
            marker, ms=4, mfc="white", mec=colour, mew=1.0, label=f"DER: {name.replace(', ', ' and ')}",
        )  # fmt: skip
    ax.set(xlabel=r"$\Delta L/L$", ylabel=r"$\Delta W/L$", xlim=(0.0, 0.625), ylim=(0.0, 0.93))
    ax.legend(fontsize=7, loc="center left", bbox_to_anchor=(1.0, 0.5))
    ax.set_title("(b) stable states")


def _twist_apart(states: Sequence[RestState], rods: Sequence[RestState]) -> float:
    """The rods' largest distance in twist from the elements, 1/L."""
    worst = 0.0
    for state, rod in zip(states, rods, strict=True):
        order = np.argsort(state.points)
        line = np.interp(rod.points, state.points[order], state.tau[order])
        worst = max(worst, float(np.abs(line - rod.tau).max()))
    return worst


def _draw_profiles(states: Sequence[RestState], rods: Sequence[RestState]) -> Any:
    """Curvatures and twist of the four states."""
    fig, axes = figure(2, 2, width=4.8, height=3.1)
    styles = (
        ("kappa1", "#2a9d5c", "^", r"$20\,\kappa_1 L$"),
        ("kappa2", "#1d4e89", "o", r"$\kappa_2 L$"),
        ("tau", "#b23a48", "s", r"$\tau L$"),
    )
    for ax, state, rod, letter in zip(axes.ravel(), states, rods, "abcd", strict=True):
        order = np.argsort(state.points)
        for quantity, colour, marker, label in styles:
            scale = 20.0 if quantity == "kappa1" else 1.0
            ax.plot(state.points[order], scale * getattr(state, quantity)[order], color=colour, label=label)
            symbols = scale * getattr(rod, quantity)[::2]
            ax.plot(rod.points[::2], symbols, marker, ms=3, mfc="none", mec=colour, mew=0.7)
        name = state.name
        ax.axhline(0.0, color="0.85", lw=0.6, zorder=0)
        ax.set(xlabel="$s/L$", xlim=(0.0, 1.0), title=f"({letter}) ${name[:1]}_{name[1]}{name[2]}_{name[3]}$")
    axes[0][0].plot([], [], "o", ms=3, mfc="none", mec="0.3", label=f"DER, {len(rods[0].s)}")
    axes[0][0].legend(fontsize=7.5, loc="best", ncols=2)
    for ax in axes[:, 0]:
        ax.set_ylabel("curvatures and twist, $1/L$")
    return fig


@dataclass(frozen=True)
class Sheared:
    """What was found of the states at alpha = 0, and of the static bound.

    Attributes
    ----------
    nodes: of the rods.
    heights: states against the shear, one a compression.
    forks, tabulated: pitchforks of `LINES` and of `TABULATED`.
    phases: names of the stable states in both models, a record a scene.
    states, rods: the four states at (0.40, 0.37), by elements and by rods.
    columns: the static bound, one a compression.
    """

    nodes: int
    heights: tuple[Heights, ...]
    forks: tuple[Pitchforks, ...]
    tabulated: tuple[Pitchforks, ...]
    phases: tuple[dict[str, Any], ...]
    states: tuple[RestState, ...]
    rods: tuple[RestState, ...]
    columns: tuple[dict[str, Any], ...]


def compute(sweep: Sweep, *, step: float, columns: int, rows: int, elements: int, nodes: int) -> Sheared:
    """States against the shear, their phases and curvatures, and the map of the bound.

    Parameters
    ----------
    step: of the rods' grid in the phase diagram, in L.
    columns, rows: points of the bound's map, compressions and shears.
    elements, nodes: of the finite elements and of the rods.
    """
    bounds = [(float(value), rows, MAP_ELEMENTS) for value in np.linspace(*MAPPED, columns)]
    grid = [(round(step * k, 9), step, nodes) for k in range(round(0.6 / step), 0, -1)]
    result = sweep("static bound", bound_column, bounds)
    phases = sweep("stable states", cells, grid, cost=lambda work: chord_limit(work[0]))
    lines = sweep("states against the shear", heights, [(value, elements, nodes) for value in COMPRESSIONS])
    work = [(value, MAP_ELEMENTS) for value in LINES] + [(value, 32) for value in TABULATED]
    forks = sweep("pitchforks", forks_of, work)
    four = [Scene(compression=0.40, shear=0.37, start=name) for name in FOUR]
    return Sheared(
        nodes=nodes,
        heights=tuple(lines),
        forks=tuple(forks[: len(LINES)]),
        tabulated=tuple(forks[len(LINES) :]),
        phases=tuple(record for records in phases for record in records),
        states=tuple(kirchhoff.state(scene, elements=elements) for scene in four),
        rods=tuple(der.state(scene, nodes=nodes) for scene in four),
        columns=tuple(result),
    )


def _apart(result: Sheared) -> tuple[float, float]:
    """Median and largest distance of heights between the models, L."""
    distances = [distance for its in result.heights for distance in its.distances()]
    return float(np.median(distances)), max(distances)


def summary(result: Sheared) -> list[str]:
    """How far the models agree."""
    agreeing = sum(record["kirchhoff"] == record["der"] for record in result.phases)
    middle, worst = _apart(result)
    return [
        f"Phases agree in {agreeing} of {len(result.phases)} scenes of the grid between the elements and "
        f"rods of {result.nodes} nodes. Heights of states at alpha = 0, both with EA, differ by "
        f"{middle:.0e} L in the median and by up to {worst:.0e} L, near z = 0 where a height rises as a root."
    ]


def tables(result: Sheared) -> list[Table]:
    """The pitchforks."""
    return [
        Table(
            "Pitchforks at alpha = 0: shears dW/L",
            ["dL/L", "U → US", "US → S", "U regained", "longest chord"],
            [
                [f"{value:.2f}", fork.broken, fork.merged, fork.restored, chord_limit(value)]
                for value, fork in zip(TABULATED, result.tabulated, strict=True)
            ],
            ["s", ".9f", ".9f", ".9f", ".6f"],
            "U regained: beyond it the unbroken U is stable again, beside S. Inextensible, 32 elements.",
        )
    ]


def drawings(result: Sheared) -> Iterator[Drawing]:
    """States, curvatures, the bound."""
    fig, (left, right) = figure(2, width=5.6, height=4.2)
    _draw_heights(left, result.heights)
    _draw_phases(right, result.forks, result.phases)
    yield Drawing(
        "folds-states.png",
        "States at alpha = 0 (paper, appendix B). (a) Height at midspan against the shear: lines by "
        "finite elements with EA, stable solid, unstable dashed; symbols: stable states of rods. "
        "(b) Stable states: lines by finite elements, symbols by rods. In the uppermost region the "
        "unbroken U is stable again beside S.",
        fig,
    )
    yield Drawing(
        "folds-curvatures.png",
        "Curvatures and twist of the four states at (0.40, 0.37) L (paper, appendix A). Lines: "
        f"finite elements; symbols: rods, within {_twist_apart(result.states, result.rods):.2g}/L in twist. "
        "kappa1, in the ribbon's plane, is drawn twenty times larger.",
        _draw_profiles(result.states, result.rods),
    )
    yield Drawing(
        "folds-bound.png",
        "Energy of U+S+ at its first fold over that of the saddle between U+S- and U- at the same "
        "angle. Blue: below the saddle, so that no type 1 skipping follows a slow ramp. Hatched: "
        "U+S- has folded before U+S+ does.",
        draw_bound(result.columns),
    )


def values(result: Sheared) -> dict[str, Any]:
    """The numbers for programs."""
    middle, worst = _apart(result)
    return {
        "phases": list(result.phases),
        "heights_within": {"median": middle, "largest": worst},
        "twist_within": _twist_apart(result.states, result.rods),
        "pitchforks": [
            {"compression": value, "broken": f.broken, "merged": f.merged, "restored": f.restored}
            for value, f in zip(TABULATED, result.tabulated, strict=True)
        ],
        "bound_map": [{**column, "zero": zero_of(column)} for column in result.columns],
    }
