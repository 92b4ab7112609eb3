"""The runner that the studies share: cases times configurations, each measured, in rows."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any, TypeVar

import numpy as np

from compare.sweep import Progress, Sweep
from ribbonfem.results import Array

Run = TypeVar("Run")


@dataclass(frozen=True)
class Study:
    """Cases times configurations, and how each is measured.

    Attributes
    ----------
    title: of the bar.
    measure: of a piece of work; a function of a module, unless it runs `here`.
    cases: what is studied.
    configurations: in what ways; a piece of work is then (case, configuration), else the case alone.
    cost: of a piece of work, in any unit: the dearest begin first.
    prepare: called once before any worker starts.
    """

    title: str
    measure: Callable[[Any], Any]
    cases: Sequence[Any]
    configurations: Sequence[Any] | None = None
    cost: Callable[[Any], float] | None = None
    prepare: Callable[[], object] | None = None

    @property
    def work(self) -> list[Any]:
        """All pieces of work in the order of the rows, the configurations of a case together."""
        return list(self.cases if self.configurations is None else product(self.cases, self.configurations))

    def results(self, sweep: Sweep) -> list[Any]:
        """What was measured of each piece of work."""
        return sweep(self.title, self.measure, self.work, cost=self.cost, prepare=self.prepare)

    def rows(self, sweep: Sweep) -> list[tuple[Any, Any]]:
        """Each piece of work with what was measured of it."""
        return list(zip(self.work, self.results(sweep), strict=True))

    def grid(self, sweep: Sweep) -> Array:
        """Numbers that were measured, as an array (cases, configurations, ...)."""
        result = np.array(self.results(sweep))
        return result.reshape(len(self.cases), -1, *result.shape[1:])

    def by_turns(self, sweep: Sweep, rounds: int) -> list[list[Any]]:
        """What was measured of each piece of work, a list with one result a round.

        One round after the other, so that what else the machine does meets all of them alike.
        """
        result = sweep(self.title, self.measure, self.work * rounds)
        return [result[k :: len(self.work)] for k in range(len(self.work))]


def here(sweep: Sweep | None) -> Sweep:
    """A sweep in this process, which keeps nothing: for clocks that no other process may disturb."""
    return Sweep(processes=1, progress=sweep.progress if sweep else Progress())


def settled(
    runs: Iterable[Run],
    error: Callable[[Run], float],
    kind: Callable[[Run], Hashable],
    size: Callable[[Run], Sequence[float]],
) -> Iterator[tuple[Run, float]]:
    """Each run with the largest error of it and of all that are of its kind and at least as fine.

    Errors of mesh and step have opposite signs, and cancel in some run by chance: by its own error that one
    would count as exact.  `size`: numbers none of which is larger in a finer run.
    """
    groups: dict[Hashable, list[Run]] = {}
    for run in runs:
        groups.setdefault(kind(run), []).append(run)
    for group in groups.values():
        sizes = np.array([size(run) for run in group], dtype=float)
        errors = np.array([error(run) for run in group], dtype=float)
        for run, own in zip(group, sizes, strict=True):
            yield run, float(errors[(sizes <= own).all(axis=1)].max())


def cheapest(
    runs: Iterable[tuple[Run, float]], seconds: Callable[[Run], float | None], allowed: float = math.inf
) -> Run | None:
    """The quickest of (run, error) whose error is at most the one allowed; None if there is none."""
    good = [run for run, error in runs if error <= allowed]
    return min(good, key=lambda run: seconds(run) or 0.0, default=None)
