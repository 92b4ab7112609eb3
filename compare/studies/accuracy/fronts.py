"""Pareto fronts of CPU time and error, the distance of a default from its front, rankings."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import numpy as np

from compare.archive import for_programs
from compare.studies.study import settled

from .cases import Entry, mesh_value

# times nearer than this are a tie
TIE = 0.10
# a member of a front has to lower the error to this share at least of the next quicker one's
WORTH = 0.95


@dataclass(frozen=True)
class Row:
    """A row of the report: an entry, its errors by quantity, and its CPU seconds, the least of all rounds."""

    entry: Entry
    errors: Mapping[str, float]
    values: Mapping[str, float | list[float]]
    seconds: float
    steps: int | None
    problem: str = ""

    @property
    def done(self) -> bool:
        """Whether it has an answer."""
        return not self.problem

    def record(self) -> dict[str, Any]:
        """The row for programs."""
        entry = self.entry
        return {
            "key": entry.key,
            "group": entry.case.group,
            "case": entry.case.name,
            "family": entry.family.name,
            "model": entry.family.model,
            "policy": {**entry.family.fixed, **entry.options},
            "default": entry.default,
            "dofs": entry.dofs,
            "errors": dict(self.errors),
            "values": dict(self.values),
            "seconds": self.seconds if self.done else None,
            "steps": self.steps,
            "problem": self.problem,
            "command": entry.command,
        }


@dataclass(frozen=True)
class Candidate:
    """A configuration over all cases of a group: root mean square of its errors, sum of its CPU seconds.

    `settled` is the largest error of it and of all that are at least as fine in mesh and step: errors
    of mesh and step have opposite signs, and cancel in some configuration by chance.
    """

    group: str
    family: str
    label: str
    options: Mapping[str, Any]
    default: bool
    dofs: int
    errors: Mapping[str, float]
    settled: Mapping[str, float]
    seconds: float

    def record(self) -> dict[str, Any]:
        """The same for programs."""
        return {**for_programs(self), "policy": dict(self.options)}


def _kind(options: Mapping[str, Any]) -> tuple[Any, ...]:
    """What has to be the same in configurations of which one is finer than the other."""
    return options.get("method"), options.get("clamp"), "step" in options, "tolerance" in options


def _size(options: Mapping[str, Any]) -> tuple[float, ...]:
    """Numbers none of which is larger in a finer configuration of the same kind."""
    degree = options.get("degree", 0)
    return -mesh_value(options), -degree, options.get("step", 0.0), options.get("tolerance", 0.0)


def choices(rows: Sequence[Row], floor: Callable[[Row, str], float]) -> list[Candidate]:
    """The rows of one family in one group, one choice a configuration, without those that failed in any case.

    `floor` is the uncertainty of a row's reference: an error below it says no more.
    """
    by_label: dict[str, list[Row]] = {}
    for row in rows:
        by_label.setdefault(row.entry.label, []).append(row)
    good = [mine for mine in by_label.values() if all(row.done for row in mine)]
    result = [
        Candidate(
            mine[0].entry.case.group,
            mine[0].entry.family.name,
            mine[0].entry.label,
            mine[0].entry.options,
            mine[0].entry.default,
            mine[0].entry.dofs,
            {
                name: float(np.sqrt(np.mean([max(row.errors[name], floor(row, name)) ** 2 for row in mine])))
                for name in mine[0].errors
            },
            {},
            float(sum(row.seconds for row in mine)),
        )
        for mine in good
    ]
    worst: dict[str, dict[str, float]] = {}
    for name in result[0].errors if result else ():
        for one, error in settled(
            result,
            error=lambda c, name=name: c.errors[name],  # type: ignore[misc]
            kind=lambda c: _kind(c.options),
            size=lambda c: _size(c.options),
        ):
            worst.setdefault(one.label, {})[name] = error
    return [replace(one, settled=worst[one.label]) for one in result]


def front(result: Sequence[Candidate], quantity: str) -> list[Candidate]:
    """Those that none other beats in both seconds and settled error, the quickest first.

    The gain in error must be worth the name (`WORTH`), else rounding would choose among equals.
    """
    members: list[Candidate] = []
    for choice in sorted(result, key=lambda c: (c.seconds, c.settled[quantity])):
        if not members or choice.settled[quantity] < WORTH * members[-1].settled[quantity]:
            members.append(choice)
    return members


def distance(choice: Candidate, members: Sequence[Candidate], quantity: str) -> float:
    """Its CPU seconds over those of the front at the same error, on straight lines in log-log.

    1 on the front, and for one left of it, whose gain in error was not worth a place there.  Of an
    error beyond the front's ends, the nearest end counts.
    """
    x = np.log([member.settled[quantity] for member in members])[::-1]
    y = np.log([member.seconds for member in members])[::-1]
    on_front = math.exp(np.interp(math.log(choice.settled[quantity]), x, y))
    return max(1.0, choice.seconds / on_front)


@dataclass(frozen=True)
class Ranking:
    """How alike two runs rank the configurations of a group by CPU time.

    Attributes
    ----------
    pairs: configurations compared two by two, within families; swapped: those in another order;
    clear: pairs more than `TIE` apart in both runs; clear_swapped: those of them in another order.
    correlation: Spearman's, the median over the families of a group; of families whose times hardly
        differ it is low.
    front_changed: members of fronts in one run and not in the other, of front_size in either.
    error_change: largest relative change of an error.
    """

    pairs: int
    swapped: int
    clear: int
    clear_swapped: int
    correlation: float
    front_changed: int
    front_size: int
    error_change: float

    def summary(self) -> str:
        """The same in a sentence."""
        return (
            f"Against the run before: rank correlation of times {self.correlation:.3f} (median), "
            f"{self.swapped} of {self.pairs} pairs swapped, "
            f"{self.clear_swapped} of the {self.clear} pairs more than {TIE:.0%} apart in both runs; "
            f"{self.front_changed} of {self.front_size} front members differ; "
            f"errors differ by a share of {self.error_change:.1g} at most."
        )


def _ranks(values: Sequence[float]) -> np.ndarray[Any, Any]:
    return np.argsort(np.argsort(values)).astype(float)


def ranking(before: Mapping[str, Any], now: Mapping[str, Any]) -> Ranking | None:
    """Compare the values of two reports; None if they have no configurations in common."""

    def by_family(values: Mapping[str, Any]) -> dict[tuple[str, str], dict[str, float]]:
        families: dict[tuple[str, str], dict[str, float]] = {}
        for c in values.get("choices", ()):
            families.setdefault((c["group"], c["family"]), {})[c["label"]] = c["seconds"]
        return families

    old, new = by_family(before), by_family(now)
    pairs = swapped = clear = clear_swapped = 0
    correlations = []
    for key in old.keys() & new.keys():
        labels = sorted(old[key].keys() & new[key].keys())
        if len(labels) > 2:
            a, b = ([table[key][label] for label in labels] for table in (old, new))
            correlations.append(float(np.corrcoef(_ranks(a), _ranks(b))[0, 1]))
        for one, two in combinations(labels, 2):
            first, second = (math.log(table[key][one] / table[key][two]) for table in (old, new))
            apart = min(abs(first), abs(second)) > math.log1p(TIE)
            pairs += 1
            clear += apart
            swapped += first * second < 0.0
            clear_swapped += apart and first * second < 0.0
    if not pairs:
        return None
    fronts = [
        {(f["group"], f["family"], label) for f in values.get("fronts", ()) for label in f["members"]}
        for values in (before, now)
    ]
    known = [{row["key"]: row["errors"] for row in values.get("rows", ())} for values in (before, now)]
    change = [
        abs(known[1][key][name] / value - 1.0)
        for key, errors in known[0].items()
        for name, value in errors.items()
        if value > 0.0 and name in known[1].get(key, {})
    ]
    return Ranking(
        pairs,
        swapped,
        clear,
        clear_swapped,
        float(np.median(correlations)) if correlations else 1.0,
        len(fronts[0] ^ fronts[1]),
        len(fronts[0] | fronts[1]),
        max(change, default=0.0),
    )
