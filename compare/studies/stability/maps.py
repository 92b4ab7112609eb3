"""Figures of the hard cases: a row a case, a column a method, status as colour."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ribbonfem.output.style import figure

from .hard_cases import (
    COARSE,
    GOOD,
    LOSSY,
    RAISED,
    REFUSED,
    SKIPPED,
    UNBALANCED,
    UNRESOLVED,
    WRONG,
    MotionVerdict,
)
from .hard_statics import ABSENT, ALONE, FUNCTIONS, MODELS, SOUND, TOLD, StaticVerdict

_MOTION = {
    GOOD: ("#74c476", "completed"),
    LOSSY: ("#dcedaa", "completed, loses more than 5 % of the kinetic energy"),
    UNBALANCED: ("#f4a6a0", "right at the snap, gains energy after it"),
    COARSE: ("#e7ba52", "right on its mesh, the mesh too coarse"),
    UNRESOLVED: ("#fdd9a0", "off, and its energy balance says so"),
    RAISED: ("#9ecae1", "raised an error"),
    REFUSED: ("#d9d2e9", "the model has no such motion, and says so"),
    WRONG: ("#d6604d", "wrong"),
    SKIPPED: ("#f2f2f2", "too many steps: left out"),
}
_REST = {
    SOUND: ("#74c476", "right"),
    ALONE: ("#dcedaa", "no other model gives it"),
    COARSE: ("#e7ba52", "right in the limit, the default mesh more than 1 % off"),
    RAISED: ("#9ecae1", "raised an error"),
    TOLD: ("#d9d2e9", "no such state, and says so"),
    WRONG: ("#d6604d", "wrong"),
    ABSENT: ("#f2f2f2", "not for this model"),
}


def _draw(
    rows: Sequence[str],
    columns: Sequence[tuple[str, str]],
    cells: Mapping[tuple[str, tuple[str, str]], tuple[str, str]],
    look: Mapping[str, tuple[str, str]],
    absent: str,
    title: str,
    tall: float,
) -> Any:
    from matplotlib.colors import ListedColormap
    from matplotlib.patches import Patch

    order = list(look)
    grid = np.array([[order.index(cells.get((r, c), (absent, ""))[0]) for c in columns] for r in rows])
    width, height = 2.1 + 0.98 * len(columns), 1.5 + tall * len(rows)
    fig, axes = figure(1, width=width, height=height)
    palette = ListedColormap([colour for colour, _ in look.values()])
    axes.imshow(grid, cmap=palette, vmin=-0.5, vmax=len(look) - 0.5, aspect="auto")
    for i, row in enumerate(rows):
        for j, column in enumerate(columns):
            text = cells.get((row, column), ("", ""))[1]
            axes.text(j, i, text, ha="center", va="center", fontsize=6.2, linespacing=1.15)
    axes.set_xticks(range(len(columns)), [f"{a}\n{b}" for a, b in columns], fontsize=7.5)
    axes.xaxis.tick_top()
    axes.set_yticks(range(len(rows)), rows, fontsize=8)
    axes.tick_params(length=0)
    axes.set_xticks(np.arange(len(columns) - 1) + 0.5, minor=True)
    axes.set_yticks(np.arange(len(rows) - 1) + 0.5, minor=True)
    axes.grid(which="minor", color="white", lw=1.2)
    axes.tick_params(which="minor", length=0)
    for spine in axes.spines.values():
        spine.set_visible(False)
    used = {order[k] for k in np.unique(grid)}
    patches: list[Any] = [Patch(color=look[name][0], label=look[name][1]) for name in order if name in used]
    fig.legend(
        handles=patches,
        loc="outside lower center",
        ncols=min(len(patches), 2 + len(columns) // 8),
        fontsize=7.5,
    )
    fig.suptitle(title, fontsize=8.5)
    return fig


def _motion_text(verdict: MotionVerdict) -> str:
    if verdict.drift is None:
        return "" if verdict.status == SKIPPED else verdict.status
    error = "no match" if verdict.error is None else f"{verdict.error:.0e} {verdict.unit}"
    text = f"{error}\n{verdict.drift:+.0e} · {verdict.rejected}"
    if verdict.mesh is not None:
        return f"{text}\nmesh {verdict.mesh:.0e}"
    return f"{text}\nmesh: otherwise" if "a mesh twice as fine" in verdict.note else text


def motion_map(verdicts: Sequence[MotionVerdict]) -> Any:
    """Draw motions."""
    rows = list(dict.fromkeys(v.case for v in verdicts))
    columns = list(dict.fromkeys((v.model, v.method) for v in verdicts))
    cells = {(v.case, (v.model, v.method)): (v.status, _motion_text(v)) for v in verdicts}
    title = (
        "First line: error against the reference (the snap's instant, in rad of the clamp or as part of the "
        "wait after it stopped; else the height, in L).\n"
        "Second: energy gained or lost over the largest kinetic energy · steps taken again.  "
        "Third, of defaults: error against a mesh twice as fine"
    )
    return _draw(rows, columns, cells, _MOTION, SKIPPED, title, 0.42)


def _rest_text(verdict: StaticVerdict) -> str:
    if verdict.count is None:
        return "refused" if verdict.status == TOLD else "raised"
    folds = f"{verdict.count} fold" + ("" if verdict.count == 1 else "s")
    if verdict.function == "equilibria":
        return folds
    return f"{folds}\n" + ("–" if verdict.error is None else f"{verdict.error:.0e} rad")


def statics_map(verdicts: Sequence[StaticVerdict]) -> Any:
    """Draw scenes at rest."""
    rows = list(dict.fromkeys(v.scene for v in verdicts))
    columns = [(model, function) for model in MODELS for function in FUNCTIONS]
    cells = {(v.scene, (v.model, v.function)): (v.status, _rest_text(v)) for v in verdicts}
    title = "Folds that a slow ramp meets and their error against an independent model; folds on the curve"
    return _draw(rows, columns, cells, _REST, ABSENT, title, 0.34)
