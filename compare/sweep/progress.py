"""A progress bar on standard error, with the time left by the cost of what is left."""

from __future__ import annotations

import logging
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from types import TracebackType
from typing import Any, TypeVar

Item = TypeVar("Item")

log = logging.getLogger("ribbonfem")


def _clock(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"


class Bar:
    """One line of progress: how many of how many, and the time left by cost and not by number."""

    def __init__(self, bars: Any, title: str, count: int, cost: float) -> None:
        self.bars, self.count, self.cost = bars, count, max(cost, 1e-300)
        self.done, self.spent, self.begin = 0, 0.0, time.monotonic()
        self.task = bars.add_task(title, total=self.cost, left="", number=f"0/{count}") if bars else None

    def advance(self, cost: float = 1.0) -> None:
        """One item of this cost is done."""
        self.done, self.spent = self.done + 1, self.spent + cost
        if self.bars:
            passed = time.monotonic() - self.begin
            left = passed * max(self.cost - self.spent, 0.0) / max(self.spent, 1e-300)
            self.bars.update(
                self.task, advance=cost, left=f"{_clock(left)} left", number=f"{self.done}/{self.count}"
            )


class Progress:
    """``for item in progress("title", items)`` draws a bar on standard error, if `visible`.

    `shows` is called with rows of tables that are finished before the result is.
    """

    def __init__(self, visible: bool = False, shows: Callable[[Any], None] | None = None) -> None:
        self._bars: Any = None
        self._shows = shows
        if visible and sys.stderr.isatty():
            # imported here: a run without a terminal does not need it
            from rich.console import Console
            from rich.progress import BarColumn, TextColumn
            from rich.progress import Progress as Bars

            self._bars = Bars(
                TextColumn("{task.description}"),
                BarColumn(),
                TextColumn("{task.fields[number]}"),
                TextColumn("{task.fields[left]}"),
                console=Console(stderr=True),
                transient=True,
                # what is printed to a terminal meanwhile goes above the bars; to a file, to the file
                redirect_stdout=sys.stdout.isatty(),
            )

    def __enter__(self) -> Progress:
        if self._bars:
            self._bars.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._bars:
            self._bars.stop()

    def say(self, text: str) -> None:
        """A line above the bars, and in the log."""
        log.info(text)
        if self._bars:
            self._bars.console.print(text, highlight=False)

    def show(self, table: Any) -> None:
        """A table of the rows that have just been finished, where somebody wants to see them at once."""
        if self._shows is not None:
            self._shows(table)

    def bar(self, title: str, count: int, cost: float | None = None) -> Bar:
        """A bar that its holder advances."""
        return Bar(self._bars, title, count, float(count) if cost is None else cost)

    def __call__(self, title: str, items: Iterable[Item], total: int | None = None) -> Iterator[Item]:
        """Yield the items, one step of a bar each; `total` is needed of items without a length."""
        if total is None:
            items = list(items)
            total = len(items)
        bar = self.bar(title, total)
        for item in items:
            yield item
            bar.advance()
