"""The hard cases told: words, tables, and heat maps: a row a case, a column a method, status as colour."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from compare.report.section import Table
from ribbonfem.output.style import figure

from .confirmations import Confirmation
from .hard_cases import (
    CASES,
    COARSE,
    GOOD,
    LOSSY,
    RAISED,
    REFUSED,
    RODS,
    SKIPPED,
    STATUSES,
    UNBALANCED,
    UNRESOLVED,
    WRONG,
    MotionVerdict,
)
from .hard_statics import MODELS, VERBS, StaticVerdict

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
    "right": ("#74c476", "right"),
    "unconfirmed": ("#dcedaa", "no other model gives it"),
    "coarse mesh": ("#e7ba52", "right in the limit, the default mesh more than 1 % off"),
    "raised": ("#9ecae1", "raised an error"),
    "refused with reason": ("#d9d2e9", "no such state, and says so"),
    "WRONG": ("#d6604d", "wrong"),
    "not for this model": ("#f2f2f2", "not for this model"),
}


def _defaults(verdicts: Sequence[MotionVerdict], methods: Mapping[str, str]) -> list[MotionVerdict]:
    """The default runs of motions that exist: those that have to survive."""
    absent = {(case.name, model) for case in CASES for model, _ in case.refused}
    return [v for v in verdicts if v.method == methods[v.model] and (v.case, v.model) not in absent]


def _failures(defaults: Sequence[MotionVerdict]) -> str:
    failed = [v for v in defaults if v.status not in (GOOD, LOSSY)]
    return "; ".join(f"{v.model}, {v.case}: {v.status}, {v.note}" for v in failed)


def _failed_at_rest(statics: Sequence[StaticVerdict]) -> str:
    fine = ("right", "refused with reason")
    failed = [f"{v.model} {v.verb}, {v.scene}: {v.status}" for v in statics if v.status not in fine]
    return f"Not right: {'; '.join(failed)}." if failed else ""


def _meshes(defaults: Sequence[MotionVerdict]) -> str:
    """What the finer meshes say of the rods' snaps."""
    parts = []
    for unit, words in (("rad", "rad of the clamp"), ("wait", "of the wait")):
        off = [v for v in defaults if v.model == RODS and v.unit == unit and v.mesh is not None]
        if off:
            middle = float(np.median([v.mesh for v in off if v.mesh is not None]))
            most = max(off, key=lambda v: v.mesh or 0.0)
            parts.append(
                f"{middle:.1e} {words} in the median of {len(off)} and {most.mesh:.1e} at most ({most.case})"
            )
    return (
        "The rods of a case have its own mesh, mostly 51 nodes; one twice as fine moves their snap by "
        + ", by ".join(parts)
        + ": shown and not judged."
    )


def _confirmations(confirmed: Sequence[Confirmation]) -> str:
    kept = [c for c in confirmed if c.error is not None and c.allowed is not None and c.error <= c.allowed]
    return (
        f"References confirmed: {len(kept)} of {len(confirmed)} snaps by another integrator with small fixed "
        "steps are as close to the reference as a default run has to be."
    )


def summary(
    verdicts: Sequence[MotionVerdict],
    statics: Sequence[StaticVerdict],
    confirmed: Sequence[Confirmation],
    methods: Mapping[str, str],
) -> list[str]:
    """Say in words how many of each status there are, and which default runs (`methods`) failed."""
    counts = {status: sum(v.status == status for v in verdicts) for status in STATUSES}
    still = {status: sum(v.status == status for v in statics) for status in {v.status for v in statics}}
    defaults = _defaults(verdicts, methods)
    survived = sum(v.status in (GOOD, LOSSY) for v in defaults)
    failures = _failures(defaults)
    damped = [v for v in defaults if v.status == LOSSY]
    worst = max((-(v.drift or 0.0) for v in damped), default=0.0)
    return [
        f"{len({v.case for v in verdicts})} cases, {len(verdicts) - counts[SKIPPED]} runs: {counts[GOOD]} "
        f"completed, {counts[LOSSY]} completed with more than 5 % of the kinetic energy lost to the method, "
        f"{counts[UNBALANCED]} are right so far but gain more than 25 % of it, "
        f"{counts[COARSE]} are right on their mesh and off against a finer one, "
        f"{counts[UNRESOLVED]} are off and their own energy balance says that the step is too long, "
        f"{counts[RAISED]} raised an error that says why, {counts[REFUSED]} were refused by the name of "
        f"what cannot be, {counts[WRONG]} are wrong without saying so; {counts[SKIPPED]} were left out.",
        f"The default steps of all models, on the default meshes of the elements, give the right result in "
        f"{survived} of {len(defaults)} motions that exist: within 0.1 % of the snap's angle (and 2e-4 "
        f"rad), 1 % of a wait, 1 % of the height's range.  Of these, {len(damped)} lose more than "
        f"5 % of the largest kinetic energy to the method's own damping, {worst:.0%} at most."
        + (f"  Not in: {failures}." if failures else ""),
        f"{len({v.scene for v in statics})} scenes at rest: "
        + ", ".join(f"{number} {status}" for status, number in sorted(still.items()))
        + f".  {_failed_at_rest(statics)}",
        "The defaults ("
        + ", ".join(f"{method} of {model}" for model, method in methods.items())
        + ") are adaptive with their default tolerances, the other methods have the fixed step of the case. "
        "References are adaptive at 1e-6 L (elements: 1e-7) on the same mesh, and end at the snap.",
        _meshes(defaults),
        _confirmations(confirmed),
    ]


def _short(note: str, most: int = 60) -> str:
    return note if len(note) <= most else note[: most - 1] + "…"


def _messages(verdicts: Sequence[MotionVerdict], statics: Sequence[StaticVerdict]) -> list[list[str]]:
    """A row for each case, model and message: whose it is, and its words."""
    found: dict[tuple[str, str, str], tuple[list[str], str]] = {}
    told = [
        (v.case, v.model, v.method, v.note)
        for v in verdicts
        if v.status not in (GOOD, LOSSY, SKIPPED) and v.note
    ]
    told += [(s.scene, s.model, s.verb, s.note) for s in statics if s.count is None]
    for case, model, method, note in told:
        words = note.rpartition("It says: ")[2]
        # methods put their name first; the instant at which they stop differs
        same = "".join(c for c in words.replace(method, "") if not c.isdigit())
        found.setdefault((case, model, same[-60:]), ([], words))[0].append(method)
    rows = []
    for (case, model, _), (who, words) in found.items():
        rows.append([case, f"{model} {', '.join(who[:2])}{' ..' * (len(who) > 2)}", _short(words, 112)])
    return rows


def tables(
    verdicts: Sequence[MotionVerdict], statics: Sequence[StaticVerdict], confirmed: Sequence[Confirmation]
) -> list[Table]:
    """Every run, every scene at rest, every reference that was confirmed."""
    runs = [
        [
            v.case,
            f"{v.model} {v.method}",
            v.status,
            v.error,
            v.unit,
            v.mesh,
            v.drift,
            v.snap,
            v.rejected,
            v.seconds,
        ]
        for v in verdicts
        if v.status != SKIPPED
    ]
    return [
        Table(
            "References confirmed",
            ["case", "by", "step (s)", "reference (s)", "found (s)", "error", "of", "allowed", "note"],
            [
                [
                    c.case,
                    f"{c.model} {c.method}",
                    c.step,
                    c.wanted,
                    c.found,
                    c.error,
                    c.unit,
                    c.allowed,
                    c.note,
                ]
                for c in confirmed
            ],
            ["s", "s", ".0e", ".7g", ".7g", ".1e", "s", ".1e", "s"],
            "The instant of the snap by the reference and by an integrator that shares no step with it, "
            "both on the mesh of the case.",
        ),
        Table(
            "Every motion",
            [
                "case",
                "method",
                "status",
                "error",
                "of",
                "finer",
                "drift",
                "snap (rad)",
                "rejected",
                "s",
            ],
            runs,
            ["s", "s", "s", ".1e", "s", ".1e", "+.1e", ".5f", "d", ".2f"],
            "error: against the reference, of the snap's instant in rad of the clamp or as part of the wait "
            "since it stopped, else of the height in L. finer: the same against a mesh twice as fine. "
            "drift: largest gain (or, negative, loss) of energy beyond the balance, over the largest kinetic "
            "energy. rejected: steps taken again.",
        ),
        Table(
            "Why not, or why less",
            ["case", "by", "message"],
            _messages(verdicts, statics),
            ["s", "s", "s"],
            "Errors in their own words, and what is said against runs that completed. Methods of which the "
            "same is said but for the instant stand together, with the words of the first.",
        ),
        Table(
            "Every scene at rest",
            ["scene", "model", "verb", "status", "first fold (rad)", "folds", "error (rad)", "note"],
            [
                [s.scene, s.model, s.verb, s.status, s.angle, s.count, s.error, _short(s.note)]
                for s in statics
            ],
            ["s", "s", "s", "s", ".7f", "d", ".1e", "s"],
            "error: of the rods against the Kirchhoff elements, and of these against the rods' limit in N; "
            "elastica: against the Kirchhoff elements; quasi-linear beam: against its closed form.",
        ),
    ]


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
        return "refused" if verdict.status == "refused with reason" else "raised"
    folds = f"{verdict.count} fold" + ("" if verdict.count == 1 else "s")
    if verdict.verb == "equilibria":
        return folds
    return f"{folds}\n" + ("–" if verdict.error is None else f"{verdict.error:.0e} rad")


def statics_map(verdicts: Sequence[StaticVerdict]) -> Any:
    """Draw scenes at rest."""
    rows = list(dict.fromkeys(v.scene for v in verdicts))
    columns = [(model, verb) for model in MODELS for verb in VERBS]
    cells = {(v.scene, (v.model, v.verb)): (v.status, _rest_text(v)) for v in verdicts}
    title = "Folds that a slow ramp meets and their error against an independent model; folds on the curve"
    return _draw(rows, columns, cells, _REST, "not for this model", title, 0.34)
