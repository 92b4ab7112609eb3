"""How fast and how exact is every model with every policy, and are the defaults a good choice?"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from compare.face.report import Picture, Section
from compare.measures.quantities import MODELS, Shape
from compare.sweep.pool import in_parallel
from compare.sweep.progress import Progress
from ribbonfem import SolverError

from . import figures
from . import orders as orders_of
from .cases import (
    DYNAMIC,
    FAMILIES,
    GROUPS,
    STATIC,
    Case,
    Entry,
    Family,
    Measured,
    entries,
    error_of,
    measure,
    seconds_of,
)
from .fronts import Choice, Row, choices, front, ranking
from .references import Reference, kind_of, reference
from .tables import (
    defaults_of_fronts,
    defaults_table,
    fronts_table,
    orders_table,
    references_table,
    rows_table,
)

# a default may take this many times what the front takes for its error
ALLOWED = 1.5
# rows that take longer (s) are not timed in every round: they are far from ties
_LONG = 0.6
KeyOf = tuple[str, str, str]


def _select(group: str, model: str, row: str) -> list[Entry]:
    """The entries asked for.

    Raises
    ------
    ValueError
        Naming the option and what it may be.
    """
    groups, models = (GROUPS if group == "all" else (group,)), (tuple(MODELS) if model == "all" else (model,))
    if not set(groups) <= set(GROUPS):
        raise ValueError(f"group = {group!r}: must be all or one of {', '.join(GROUPS)}")
    if not set(models) <= set(MODELS):
        raise ValueError(f"model = {model!r}: must be all or one of {', '.join(MODELS)}")
    if row:
        groups, models = (row.split("/")[0],), tuple(MODELS)
    found = [
        entry
        for g in groups
        for family in FAMILIES
        if g in family.groups and family.model in models
        for entry in entries(g, family)
        if not row or entry.key == row
    ]
    if row and not found:
        raise ValueError(
            f"row = {row!r}: there is none; a row is GROUP/CASE/FAMILY/POLICY, as a full run's accuracy.json "
            "lists them"
        )
    if not found:
        raise ValueError(f"group = {group!r} and model = {model!r}: that model is not in the group")
    return found


def _reference(work: tuple[Case, Family]) -> Reference:
    return reference(*work)


def _references(selected: Sequence[Entry], processes: int, progress: Progress) -> dict[KeyOf, Reference]:
    work: dict[KeyOf, tuple[Case, Family]] = {}
    for entry in selected:
        work.setdefault(_key_of(entry), (entry.case, entry.family))
    found = in_parallel(_reference, list(work.values()), processes)
    return dict(zip(work, progress("references", found, len(work)), strict=True))


def _key_of(entry: Entry) -> KeyOf:
    return entry.case.group, entry.case.name, kind_of(entry.case, entry.family)


def _row(entry: Entry, known: Reference, runs: Sequence[Measured]) -> Row:
    """Errors of the first run (all are the same) and the least seconds."""
    first = runs[0]
    names = DYNAMIC if entry.case.dynamic else STATIC
    if first.problem:
        return Row(entry, {}, {}, float("nan"), first.steps, first.problem)
    try:
        errors = {name: error_of(first.values[name], known.values[name]) for name in names}
    except SolverError as error:
        return Row(entry, {}, {}, float("nan"), first.steps, str(error))
    plain = {k: np.asarray(v).tolist() for k, v in first.values.items() if not isinstance(v, Shape)}
    return Row(entry, errors, plain, min(run.seconds for run in runs), first.steps)


def _measured(
    selected: Sequence[Entry], rounds: int, processes: int, progress: Progress
) -> dict[str, list[Measured]]:
    """All runs of all entries: round by round, so that what else the machine does meets all alike."""
    first = progress("first round", in_parallel(measure, selected, processes), len(selected))
    runs = {entry.key: [run] for entry, run in zip(selected, first, strict=True)}
    again = [
        entry
        for k in range(1, rounds)
        for entry in selected
        # all but the failed
        if runs[entry.key][0].seconds < (_LONG if k > 1 else math.inf)
    ]
    later = progress(f"rounds 2 to {rounds}", in_parallel(seconds_of, again, processes), len(again))
    for entry, seconds in zip(again, later, strict=True):
        runs[entry.key].append(Measured({}, seconds))
    return runs


def _single(entry: Entry, row: Row, known: Reference) -> Section:
    """The section of one row."""
    table = rows_table([row], "The row")
    return Section(
        name="accuracy-row",
        title="One row of the accuracy report",
        text=[f"{entry.key}: reference: {known.source}, {'' if known.verified else 'not '}verified."],
        tables=[table],
        values={"row": row.record(), "reference": known.record()},
    )


def _theory(known: Mapping[KeyOf, Reference]) -> dict[str, float]:
    """Snap angle of the quasi-linear beam minus that of the inextensible elastica: the theories differ."""
    return {
        case: float(ref.values["snap"] - known[group, case, "inextensible"].values["snap"])
        for (group, case, kind), ref in known.items()
        if kind == "quasi-linear" and (group, case, "inextensible") in known
    }


def _before(out: Path) -> Mapping[str, Any]:
    """The values of the report that lies in the folder; empty if there is none that can be read."""
    try:
        values = json.loads((out / "accuracy.json").read_text(encoding="utf-8"))["values"]
    except (OSError, ValueError, KeyError):
        return {}
    return values if isinstance(values, dict) else {}


def main(
    *,
    progress: Progress | None = None,
    out: Path,
    group: str = "all",
    model: str = "all",
    row: str = "",
    rounds: int = 3,
    processes: int = 2,
    orders: bool = True,
) -> Section:
    """Error against CPU time of every model, mesh, clamp, method and step or tolerance, and the fronts.

    Errors are of fold and snap angles, of shapes in L2, of energies and of their balance, against
    references that share no mechanics with what they judge, or verified limits. CPU seconds are of
    the solve alone, the least of --rounds, in turns. If the report's folder has an earlier run, its
    ranking is compared with this one's.
    --group: all, static-planar, static-ribbon, dynamic-planar, dynamic-ribbon; --model: all,
    quasilinear, elastica, kirchhoff, der; --row KEY: that row alone, to a file of its own.
    --processes 1 takes twice as long, and its timings do not disturb each other.
    """
    progress = progress or Progress()
    if rounds < 1:
        raise ValueError(f"rounds = {rounds!r}: must be at least 1")
    selected = _select(group, model, row)
    known = _references(selected, processes, progress)
    runs = _measured(selected, rounds, processes, progress)
    rows = [_row(entry, known[_key_of(entry)], runs[entry.key]) for entry in selected]
    if row:
        return _single(selected[0], rows[0], known[_key_of(selected[0])])

    def floor(item: Row, name: str) -> float:
        return known[_key_of(item.entry)].uncertainty[name]

    groups = tuple(dict.fromkeys(entry.case.group for entry in selected))
    models = tuple(dict.fromkeys(entry.family.model for entry in selected))
    failing: dict[str, set[str]] = {family.name: set() for family in FAMILIES}
    for item in rows:
        if not item.done:
            failing[item.entry.family.name].add(item.entry.label)
    found: dict[tuple[str, str], list[Choice]] = {}
    for g in groups:
        for family in dict.fromkeys(e.family.name for e in selected if e.case.group == g):
            mine = [r for r in rows if r.entry.case.group == g and r.entry.family.name == family]
            found[g, family] = choices([r for r in mine if r.entry.label not in failing[family]], floor)
    work = orders_of.studies(groups, models) if orders else []
    done = progress("orders", in_parallel(orders_of.run_study, work, processes), len(work))
    studied = list(zip(work, done, strict=True))
    defaults = defaults_of_fronts(found)
    if not defaults:
        raise SolverError("the default policy came to an end in no group; its rows alone: --row KEY says why")
    primary = {g: (DYNAMIC if g.startswith("dynamic") else STATIC)[0] for g in groups}
    values: dict[str, Any] = {
        "rows": [r.record() for r in rows],
        "choices": [c.record() for its in found.values() for c in its],
        "fronts": [
            {"group": g, "family": f, "quantity": name, "members": [c.label for c in front(its, name)]}
            for (g, f), its in found.items()
            for name in (DYNAMIC if g.startswith("dynamic") else STATIC)
        ],
        "defaults": defaults,
        "orders": [orders_of.record(s, c) for s, c in studied],
        "references": {"/".join(key): ref.record() for key, ref in known.items()},
        "theory": _theory(known),
    }
    compared = ranking(_before(out), values)
    values["ranking"] = None if compared is None else vars(compared)
    worst = max(defaults, key=lambda r: r["distance"])
    unverified = ["/".join(key) for key, ref in known.items() if not ref.verified]
    failed = [r for r in rows if not r.done]
    fronts = {
        (r.entry.case.group, r.entry.family.name, r.entry.label)
        for r in rows
        if any(
            r.entry.label == c.label
            for c in front(found[r.entry.case.group, r.entry.family.name], primary[r.entry.case.group])
        )
    }
    shown = [
        r
        for r in rows
        if r.entry.default or (r.entry.case.group, r.entry.family.name, r.entry.label) in fronts
    ]
    text = [
        f"{len(rows)} rows of {sum(map(len, found.values()))} policies that came to an end in every scene, "
        f"the least of {rounds} rounds. The default farthest from its front: {worst['family']} in "
        f"{worst['group']} ({worst['policy']}), {worst['distance']:.2f} times the front's time at the same "
        f"error; "
        f"{sum(r['distance'] <= ALLOWED for r in defaults)} of {len(defaults)} defaults are within a factor "
        f"{ALLOWED:g}.",
        "Every row is in accuracy.json with the command that computes it alone.",
    ]
    if values["theory"]:
        text.append(
            "The quasi-linear beam is judged by its own limit. What its theory leaves out, snap angle minus "
            "the elastica's (rad): "
            + ", ".join(f"{case}: {value:+.1e}" for case, value in values["theory"].items())
            + "."
        )
    if unverified:
        text.append(f"References that are not verified: {', '.join(unverified)}.")
    if failed:
        text.append(
            f"{len(failed)} rows have no answer: "
            + "; ".join(dict.fromkeys(f"{r.entry.key}: {r.problem[:90]}" for r in failed[:4]))
        )
    if compared is not None:
        text.append(compared.words())
    pictures = [
        Picture(
            figures.draw_fronts(found, primary, out / "accuracy-fronts.png"),
            "Settled error of the fold or snap angle against CPU seconds, over the scenes of each group. "
            "Lines: fronts; stars: defaults.",
        )
    ]
    if studied:
        pictures.append(
            Picture(
                figures.draw_orders(studied, out / "accuracy-orders.png"),
                "Errors under refinement, with the orders observed by the three finest runs; dotted where "
                "the limit is not verified.",
            )
        )
    return Section(
        name="accuracy",
        title="Speed against error",
        text=text,
        tables=[
            defaults_table(defaults),
            fronts_table(found),
            *([orders_table(studied)] if studied else []),
            references_table(known),
            rows_table(shown, "The rows of the fronts and the defaults"),
        ],
        pictures=pictures,
        values=values,
    )
