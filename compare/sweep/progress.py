"""A progress bar with the time left, which library code can be given and need not know."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator
from types import TracebackType
from typing import Any, TypeVar

Item = TypeVar("Item")


class Progress:
    """``for item in progress("title", items)`` draws a bar on standard error, if `visible`."""

    def __init__(self, visible: bool = False) -> None:
        self._bars: Any = None
        if visible and sys.stderr.isatty():
            # imported here: a run without a terminal does not need it
            from rich.console import Console
            from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeRemainingColumn
            from rich.progress import Progress as Bars

            self._bars = Bars(
                TextColumn("{task.description}"),
                BarColumn(),
                MofNCompleteColumn(),
                TimeRemainingColumn(),
                console=Console(stderr=True),
                transient=True,
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

    def __call__(self, title: str, items: Iterable[Item], total: int | None = None) -> Iterator[Item]:
        """Yield the items, one step of a bar each; `total` is needed of items without a length."""
        if total is None:
            items = list(items)
            total = len(items)
        task = self._bars.add_task(title, total=total) if self._bars else None
        for item in items:
            yield item
            if self._bars:
                self._bars.advance(task)
