"""The command `accuracy`: error against CPU time of all models and configurations; the defaults judged."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from compare.quantities.convergence import Convergence
from compare.quantities.measure import MODELS, Shape
from compare.report.registry import Command
from compare.report.section import Drawing, Table
from compare.studies.study import Study
from compare.sweep import Sweep
from ribbonfem import SolverError
from ribbonfem.options import whole_number

from . import figures
from . import orders as orders_of
from .cases import (
    DYNAMIC,
    FAMILIES,
    GROUPS,
    STATIC,
    Bench,
    Entry,
    Family,
    Reading,
    entries,
    error_of,
    measure,
    seconds_of,
)
from .fronts import Candidate, Ranking, Row, choices, front, ranking
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
    result = [
        entry
        for g in groups
        for family in FAMILIES
        if g in family.groups and family.model in models
        for entry in entries(g, family)
        if not row or entry.key == row
    ]
    if row and not result:
        raise ValueError(
            f"row = {row!r}: there is none; a row is GROUP/CASE/FAMILY/OPTIONS, as a full run's "
            "accuracy.json lists them"
        )
    if not result:
        raise ValueError(f"group = {group!r} and model = {model!r}: that model is not in the group")
    return result


def _reference(work: tuple[Bench, Family]) -> Reference:
    return reference(*work)


def _references(selected: Sequence[Entry], sweep: Sweep) -> dict[KeyOf, Reference]:
    work = {_key_of(entry): (entry.case, entry.family) for entry in reversed(selected)}
    work = {key: work[key] for key in dict.fromkeys(map(_key_of, selected))}
    return dict(zip(work, Study("references", _reference, list(work.values())).results(sweep), strict=True))


def _key_of(entry: Entry) -> KeyOf:
    return entry.case.group, entry.case.name, kind_of(entry.case, entry.family)


def _row(entry: Entry, known: Reference, runs: Sequence[Reading]) -> Row:
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


def _again(work: tuple[Entry, int]) -> float:
    """An entry's seconds in one more round."""
    return seconds_of(work[0])


def _measured(selected: Sequence[Entry], rounds: int, sweep: Sweep) -> dict[str, list[Reading]]:
    """All runs of all entries: round by round, so that what else the machine does meets all alike."""
    runs = {entry.key: [run] for entry, run in Study("first round", measure, selected).rows(sweep)}
    again = [
        (entry, k)
        for k in range(1, rounds)
        for entry in selected
        # all but the failed
        if runs[entry.key][0].seconds < (_LONG if k > 1 else math.inf)
    ]
    for (entry, _), seconds in Study(f"rounds 2 to {rounds}", _again, again).rows(sweep):
        runs[entry.key].append(Reading({}, seconds))
    return runs


def _theory(known: Mapping[KeyOf, Reference]) -> dict[str, float]:
    """Snap angle of the quasi-linear beam minus that of the inextensible elastica: the theories differ."""
    return {
        case: float(ref.values["snap"] - known[group, case, "inextensible"].values["snap"])
        for (group, case, kind), ref in known.items()
        if kind == "quasi-linear" and (group, case, "inextensible") in known
    }


def _values_of(before: Path) -> dict[str, Any]:
    """The values of an earlier accuracy.json.

    Raises
    ------
    ValueError
        If the file holds none.
    """
    try:
        values = json.loads(before.read_text(encoding="utf-8"))["values"]
    except (ValueError, KeyError, TypeError):
        raise ValueError(f"before = {str(before)!r}: no accuracy.json of an earlier run") from None
    return dict(values)


def _quantities(group: str) -> tuple[str, ...]:
    """What the errors of a group are of; the first decides its front."""
    return DYNAMIC if group.startswith("dynamic") else STATIC


@dataclass(frozen=True)
class Accuracy:
    """What was found.

    Attributes
    ----------
    rounds: of which the least time counts.
    rows: every entry with its errors and seconds.
    known: the reference of each group, case and kind.
    studied: the convergence studies.
    before: values of an earlier run to be compared with; empty without.
    alone: whether one row was asked for.
    """

    rounds: int
    rows: tuple[Row, ...]
    known: dict[KeyOf, Reference]
    studied: tuple[tuple[orders_of.Refined, Convergence], ...]
    before: dict[str, Any]
    alone: bool

    @property
    def groups(self) -> tuple[str, ...]:
        """Those that were measured, in their order."""
        return tuple(dict.fromkeys(row.entry.case.group for row in self.rows))

    @cached_property
    def choices(self) -> dict[tuple[str, str], list[Candidate]]:
        """The configurations of each group and family that came to an end in every scene."""
        failing: dict[str, set[str]] = {family.name: set() for family in FAMILIES}
        for item in self.rows:
            if not item.done:
                failing[item.entry.family.name].add(item.entry.label)

        def floor(item: Row, name: str) -> float:
            return self.known[_key_of(item.entry)].uncertainty[name]

        result: dict[tuple[str, str], list[Candidate]] = {}
        for row in self.rows:
            group, family = row.entry.case.group, row.entry.family.name
            if (group, family) not in result:
                mine = [r for r in self.rows if (r.entry.case.group, r.entry.family.name) == (group, family)]
                done = [r for r in mine if r.entry.label not in failing[family]]
                result[group, family] = choices(done, floor)
        return result

    @cached_property
    def ranked(self) -> Ranking | None:
        """This run's ranking beside the earlier one's."""
        return ranking(self.before, _numbers(self))


def main(
    *,
    group: str = "all",
    model: str = "all",
    row: str = "",
    rounds: int = 3,
    orders: bool = True,
    before: Path | None = None,
    sweep: Sweep | None = None,
) -> Accuracy:
    """Error against CPU time of every model, mesh, clamp, method and step or tolerance.

    Errors are those of fold and snap angles, of shapes (L2 norm), of energies and of their balance. The
    reference is a model that shares no mechanics with the one that is judged, or a limit that was checked.
    CPU seconds are those of the solution alone, the least of --rounds. --before accuracy.json: results of
    an earlier run, to compare the ranking with.
    --group: all, static-planar, static-ribbon, dynamic-planar, dynamic-ribbon; --model: all,
    quasilinear, elastica, kirchhoff, der; --row KEY: that row alone, to a file of its own.
    --processes 1 takes twice as long, and its timings do not disturb each other.
    """
    sweep = sweep or Sweep()
    whole_number("rounds", rounds, 1, 1000)
    selected = _select(group, model, row)
    old = {} if before is None else _values_of(before)
    known = _references(selected, sweep)
    runs = _measured(selected, rounds, sweep)
    rows = tuple(_row(entry, known[_key_of(entry)], runs[entry.key]) for entry in selected)
    models = tuple(dict.fromkeys(entry.family.model for entry in selected))
    groups = tuple(dict.fromkeys(entry.case.group for entry in selected))
    refined = orders_of.refinements(groups, models) if orders and not row else []
    studied = tuple(Study("orders", orders_of.Refined.converge, refined).rows(sweep))
    result = Accuracy(rounds, rows, known, studied, old, bool(row))
    if not row and not defaults_of_fronts(result.choices):
        raise SolverError(
            "the default configuration failed in every group; `--row KEY` runs one of its rows and says why"
        )
    return result


def _alone(result: Accuracy) -> list[str]:
    """The words of one row."""
    entry = result.rows[0].entry
    known = result.known[_key_of(entry)]
    return [f"{entry.key}: reference: {known.source}, {'' if known.verified else 'not '}verified."]


def summary(result: Accuracy) -> list[str]:
    """How far the defaults are from the fronts, and what is not verified or failed."""
    if result.alone:
        return _alone(result)
    defaults = defaults_of_fronts(result.choices)
    worst = max(defaults, key=lambda r: r["distance"])
    near = sum(r["distance"] <= ALLOWED for r in defaults)
    unverified = ["/".join(key) for key, ref in result.known.items() if not ref.verified]
    failed = [r for r in result.rows if not r.done]
    theory = _theory(result.known)
    text = [
        f"{len(result.rows)} rows of {sum(map(len, result.choices.values()))} configurations that came to "
        f"an end in every scene, the least of {result.rounds} rounds. The default farthest from its front: "
        f"{worst['family']} in {worst['group']} ({worst['policy']}), {worst['distance']:.2f} times the "
        f"front's time at the same error; {near} of {len(defaults)} defaults are within a factor "
        f"{ALLOWED:g}.",
        "Every row is in accuracy.json with the command that computes it alone.",
    ]
    if theory:
        text.append(
            "The quasi-linear beam is judged by its own limit. What its theory leaves out, snap angle minus "
            f"the elastica's (rad): {', '.join(f'{case}: {value:+.1e}' for case, value in theory.items())}."
        )
    if unverified:
        text.append(f"References that are not verified: {', '.join(unverified)}.")
    if failed:
        text.append(
            f"{len(failed)} rows have no answer: "
            + "; ".join(dict.fromkeys(f"{r.entry.key}: {r.problem[:90]}" for r in failed[:4]))
        )
    if result.ranked is not None:
        text.append(result.ranked.summary())
    return text


def _shown(result: Accuracy) -> list[Row]:
    """The rows of the fronts of the first quantity, and the defaults."""
    members = {
        (*key, choice.label)
        for key, its in result.choices.items()
        for choice in front(its, _quantities(key[0])[0])
    }
    return [
        r
        for r in result.rows
        if r.entry.default or (r.done and (r.entry.case.group, r.entry.family.name, r.entry.label) in members)
    ]


def tables(result: Accuracy) -> list[Table]:
    """Defaults, fronts, orders, references, and the rows of the fronts."""
    if result.alone:
        return [rows_table(result.rows, "The row")]
    return [
        defaults_table(defaults_of_fronts(result.choices)),
        fronts_table(result.choices),
        *([orders_table(result.studied)] if result.studied else []),
        references_table(result.known),
        rows_table(_shown(result), "The rows of the fronts and the defaults"),
    ]


def drawings(result: Accuracy) -> Iterator[Drawing]:
    """The fronts, and errors under refinement."""
    if result.alone:
        return
    yield Drawing(
        "accuracy-fronts.png",
        "Settled error of the fold or snap angle against CPU seconds, over the scenes of each group. "
        "Lines: fronts; stars: defaults.",
        figures.draw_fronts(result.choices, {group: _quantities(group)[0] for group in result.groups}),
    )
    if result.studied:
        yield Drawing(
            "accuracy-orders.png",
            "Errors under refinement, with the orders observed by the three finest runs; dotted where "
            "the limit is not verified.",
            figures.draw_orders(result.studied),
        )


def _numbers(result: Accuracy) -> dict[str, Any]:
    return {
        "rows": [r.record() for r in result.rows],
        "choices": [c.record() for its in result.choices.values() for c in its],
        "fronts": [
            {"group": g, "family": f, "quantity": name, "members": [c.label for c in front(its, name)]}
            for (g, f), its in result.choices.items()
            for name in _quantities(g)
        ],
        "defaults": defaults_of_fronts(result.choices),
        "orders": [orders_of.record(s, c) for s, c in result.studied],
        "references": {"/".join(key): ref.record() for key, ref in result.known.items()},
        "theory": _theory(result.known),
    }


def values(result: Accuracy) -> dict[str, Any]:
    """The numbers for programs."""
    if result.alone:
        (row,) = result.rows
        return {"row": row.record(), "reference": result.known[_key_of(row.entry)].record()}
    return {**_numbers(result), "ranking": None if result.ranked is None else vars(result.ranked)}


COMMAND = Command(
    name="accuracy",
    title=lambda result: "One row of the accuracy report" if result.alone else "Speed against error",
    takes="some 8 minutes",
    main=main,
    summary=summary,
    tables=tables,
    drawings=drawings,
    values=values,
    section_name=lambda result: "accuracy-row" if result.alone else "accuracy",
)
