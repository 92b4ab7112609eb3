"""Figures of the accuracy study: error against CPU time, and orders of convergence."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from compare.quantities.convergence import Convergence
from ribbonfem.output.style import panels

from .fronts import Candidate, front
from .orders import Refined

_COLOURS = {
    "quasilinear": "#7f7f7f",
    "elastica": "#1f77b4",
    "elastica-EA": "#17becf",
    "kirchhoff": "#2ca02c",
    "kirchhoff-EA": "#bcbd22",
    "der": "#d62728",
}
_NAMES = {
    "quasilinear": "quasi-linear",
    "elastica": "elastica",
    "elastica-EA": "elastica, EA",
    "kirchhoff": "Kirchhoff",
    "kirchhoff-EA": "Kirchhoff, EA",
    "der": "DER",
}
_MARKERS = {
    None: "o",
    "tr-bdf2": "o",
    "esdirk4": "o",
    "esdirk3": "<",
    "generalised-alpha": "^",
    "newmark": "s",
    "implicit-euler": "v",
    "midpoint": "D",
    "discrete-gradient": "P",
}
# curves of a panel whose legend is set smaller, so that it is no taller than the panel
_MANY = 16
_TITLES = {
    "static-planar": "At rest, planar: fold",
    "static-ribbon": "At rest, ribbon: folds",
    "dynamic-planar": "In motion, planar: snap",
    "dynamic-ribbon": "In motion, ribbon: snap",
}


def _draw_group(
    axes: Any, group: str, result: Mapping[tuple[str, str], Sequence[Candidate]], quantity: str
) -> None:
    from matplotlib.ticker import LogLocator, NullFormatter

    methods: set[str | None] = set()
    open_marks = False
    for (its_group, family), its in result.items():
        if its_group != group:
            continue
        colour = _COLOURS[family]
        for choice in its:
            method, hollow = choice.options.get("method"), choice.options.get("clamp") == "two-node"
            methods.add(method)
            open_marks |= hollow
            at, face = (choice.seconds, choice.settled[quantity]), "none" if hollow else colour
            axes.plot(*at, _MARKERS[method], ms=3.2, color=colour, mfc=face, alpha=0.45, mew=0.7)
            if choice.default:
                axes.plot(*at, "*", ms=12, color=colour, mec="black", mew=0.7, zorder=6)
        members = front(its, quantity)
        x, y = [m.seconds for m in members], [m.settled[quantity] for m in members]
        axes.plot(x, y, "-", color=colour, lw=1.3, label=_NAMES[family])
    axes.set(
        xscale="log", yscale="log", title=_TITLES[group], xlabel="CPU seconds", ylabel="settled error (rad)"
    )
    low, high = axes.get_xlim()
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if high < 30.0 * low else (1.0,)))
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.grid(True, which="major", lw=0.3, color="0.85")
    axes.plot([], [], "*", ms=10, color="white", mec="black", mew=0.7, label="default")
    if len(methods) > 1:
        for method in _MARKERS:
            if method in methods and method is not None:
                axes.plot([], [], _MARKERS[method], ms=4, color="0.4", label=method)
    if open_marks:
        axes.plot([], [], "o", ms=4, mfc="none", color="0.4", label="two-node clamp")
    axes.legend(fontsize=7, loc="center left", bbox_to_anchor=(1.0, 0.5))


def draw_fronts(result: Mapping[tuple[str, str], Sequence[Candidate]], primary: Mapping[str, str]) -> Any:
    """A panel a group: every configuration a mark, the fronts lines, the defaults stars."""
    fig, grid = panels(len(primary), 2, 6.0, 3.9)
    for axes, group in zip(grid, primary, strict=True):
        _draw_group(axes, group, result, primary[group])
    return fig


def _look(study: Refined) -> tuple[str, str, str]:
    """Colour, marker and filling of a study: of the model, the method, the clamp."""
    method = study.label.split(", ")[-1]
    family = f"{study.model}-EA" if study.options.get("extensible") else study.model
    hollow = study.options.get("clamp") == "two-node"
    return _COLOURS[family], _MARKERS.get(method, "o"), "none" if hollow else _COLOURS[family]


def _draw_studies(axes: Any, what: Sequence[tuple[Refined, Convergence]], title: str, label: str) -> None:
    from matplotlib.ticker import NullFormatter

    for study, result in what:
        colour, marker, filling = _look(study)
        axes.loglog(
            result.sizes,
            np.where(result.errors > 0.0, result.errors, np.nan),
            marker + ("-" if result.verified else ":"),
            ms=4,
            lw=1.0,
            alpha=0.8,
            color=colour,
            mfc=filling,
            label=f"{study.label}: {result.order:.2f}",
        )
    axes.set(title=title, xlabel=label, ylabel="error of the angle (rad)")
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.grid(True, which="major", lw=0.3, color="0.85")
    axes.legend(
        fontsize=7 if len(what) < _MANY else 5.5,
        loc="center left",
        bbox_to_anchor=(1.0, 0.5),
        title="order observed",
        title_fontsize=7,
        labelspacing=0.5 if len(what) < _MANY else 0.25,
    )


def draw_orders(studied: Sequence[tuple[Refined, Convergence]]) -> Any:
    """Errors of fold and snap angles against mesh size and step, with the orders in the legends."""
    parts: list[tuple[str, str, list[tuple[Refined, Convergence]]]] = []
    for kind, title in _TITLES.items():
        mine = [(s, c) for s, c in studied if s.group == kind and s.quantity in ("fold", "snap")]
        for steps in (False, True):
            part = [(s, c) for s, c in mine if (c.over == "step") == steps]
            if part:
                caption = f"{title.split(':')[0]}, {'step' if steps else 'mesh'}"
                parts.append((caption, "step (s)" if steps else "edge or element (L)", part))
    fig, grid = panels(len(parts), 2, 6.0, 3.4)
    for axes, (title, label, part) in zip(grid, parts, strict=True):
        _draw_studies(axes, part, title, label)
    return fig
