"""Heat maps of the hard cases: a row a case, a column a method, the status as colour, numbers inside."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .figures import figure, save

if TYPE_CHECKING:
    from .hard_statics import StaticVerdict
    from .stability import Verdict

_MOTION = {
    "good": ("#74c476", "completed"),
    "loses energy": ("#dcedaa", "loses energy to its own damping"),
    "unresolved": ("#fdc778", "its energy balance says: step too long"),
    "raised": ("#9ecae1", "raised an error"),
    "no such motion": ("#d9d2e9", "the model has no such motion, and says so"),
    "WRONG": ("#d6604d", "wrong"),
    "skipped": ("#f2f2f2", "too many steps"),
}
_REST = {
    "right": ("#74c476", "right"),
    "unconfirmed": ("#dcedaa", "no other model gives it"),
    "raised": ("#9ecae1", "raised an error"),
    "refused with reason": ("#d9d2e9", "no such state, and says so"),
    "WRONG": ("#d6604d", "wrong"),
    "not for this model": ("#f2f2f2", "not for this model"),
}
_UNITS = {"rad": "rad", "wait": "wait", "L": "L"}


def _draw(
    rows: Sequence[str],
    columns: Sequence[tuple[str, str]],
    cells: Mapping[tuple[str, tuple[str, str]], tuple[str, str]],
    look: Mapping[str, tuple[str, str]],
    absent: str,
    title: str,
    path: Path,
) -> str:
    from matplotlib.colors import ListedColormap
    from matplotlib.patches import Patch

    order = list(look)
    grid = np.array([[order.index(cells.get((r, c), (absent, ""))[0]) for c in columns] for r in rows])
    width, height = 2.1 + 0.98 * len(columns), 1.5 + 0.34 * len(rows)
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
    fig.legend(handles=patches, loc="outside lower center", ncols=min(len(patches), 4), fontsize=7.5)
    fig.suptitle(title, fontsize=8.5)
    return save(fig, path)


def _motion_text(verdict: Verdict) -> str:
    if verdict.status == "no such motion":
        return "refused"
    if verdict.drift is None:
        return verdict.status
    error = "no match" if verdict.error is None else f"{verdict.error:.0e} {verdict.unit}"
    return f"{error}\n{verdict.drift:+.0e} · {verdict.rejected}"


def motion_map(verdicts: Sequence[Verdict], path: Path) -> str:
    """Draw motions; returns the file's name."""
    rows = list(dict.fromkeys(v.case for v in verdicts))
    columns = list(dict.fromkeys((v.model, v.method) for v in verdicts))
    cells = {(v.case, (v.model, v.method)): (v.status, _motion_text(v)) for v in verdicts}
    title = (
        "First line: error against the reference (the snap's instant, in rad of the clamp or as part of the "
        "wait after it stopped; else the height, in L).\n"
        "Second: energy gained or lost over the largest kinetic energy · steps taken again"
    )
    return _draw(rows, columns, cells, _MOTION, "skipped", title, path)


def _rest_text(verdict: StaticVerdict) -> str:
    if verdict.count is None:
        return "refused" if verdict.status == "refused with reason" else "raised"
    folds = f"{verdict.count} fold" + ("" if verdict.count == 1 else "s")
    if verdict.verb == "equilibria":
        return folds
    return f"{folds}\n" + ("–" if verdict.error is None else f"{verdict.error:.0e} rad")


def statics_map(verdicts: Sequence[StaticVerdict], path: Path) -> str:
    """Draw scenes at rest; returns the file's name."""
    from .hard_statics import MODELS, VERBS

    rows = list(dict.fromkeys(v.scene for v in verdicts))
    columns = [(model, verb) for model in MODELS for verb in VERBS]
    cells = {(v.scene, (v.model, v.verb)): (v.status, _rest_text(v)) for v in verdicts}
    title = "Folds that a slow ramp meets and their error against an independent model; folds on the curve"
    return _draw(rows, columns, cells, _REST, "not for this model", title, path)
