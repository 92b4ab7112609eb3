"""Output on the terminal: streams that fail safely, and a section printed as text and tables."""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Collection, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any

from .section import Section, Table


def _flushed(stream: Any) -> OSError | None:
    """Write out what a stream holds, or drop it, so that the interpreter does not try again at its end."""
    try:
        stream.flush()
    except OSError as error:
        with suppress(OSError, io.UnsupportedOperation):
            number = stream.fileno()
            was, nothing = os.dup(number), os.open(os.devnull, os.O_WRONLY)
            os.dup2(nothing, number)
            stream.flush()
            os.dup2(was, number)
            os.close(was)
            os.close(nothing)
        return error
    return None


def complain(text: str) -> None:
    """A line on standard error, where there is one that takes it."""
    with suppress(OSError):
        print(text, file=sys.stderr)
    _flushed(sys.stderr)


@contextmanager
def printing() -> Iterator[None]:
    """What is printed goes out at once; an `OSError` says that standard output did not take it."""
    try:
        yield
    except OSError as error:
        _flushed(sys.stdout)
        raise _unprinted(error) from None
    failed = _flushed(sys.stdout)
    if failed:
        raise _unprinted(failed)


def _unprinted(error: OSError) -> OSError:
    if isinstance(error, BrokenPipeError):
        return BrokenPipeError("the output was closed before its end")
    return OSError(f"standard output cannot be written: {error.strerror}")


@contextmanager
def terminal() -> Iterator[None]:
    """Standard streams that a command can write to, in UTF-8, and as they were afterwards.

    Closed ones lead nowhere, so that no file that is opened takes their numbers; no columns are the 80 of a
    terminal that does not say.
    """
    with ExitStack() as undo:
        for number in range(3):
            try:
                os.fstat(number)
            except OSError:
                # the lowest number that is free
                undo.callback(os.close, os.open(os.devnull, os.O_RDWR))
        for name in ("stdout", "stderr"):
            stream = getattr(sys, name)
            if stream is None:
                nowhere = undo.enter_context(open(os.devnull, "w", encoding="utf-8"))
                undo.callback(setattr, sys, name, None)
                setattr(sys, name, nowhere)
            elif isinstance(stream, io.TextIOWrapper):
                # words and tables are UTF-8, whatever the locale says
                undo.callback(stream.reconfigure, encoding=stream.encoding, errors=stream.errors)
                stream.reconfigure(encoding="utf-8", errors="backslashreplace")
        columns = os.environ.get("COLUMNS", "")
        if columns.isdigit() and not int(columns):
            del os.environ["COLUMNS"]
            undo.callback(os.environ.__setitem__, "COLUMNS", columns)
        try:
            yield
        except SystemExit:
            # what --help has printed
            failed = _flushed(sys.stdout)
            if failed:
                complain(f"ribbonfem: {_unprinted(failed)}")
                raise SystemExit(1) from None
            raise
        finally:
            _flushed(sys.stderr)


class Rows:
    """Tables whose rows are printed as they come, in columns wide enough for what the first ones hold."""

    def __init__(self) -> None:
        self.titles: dict[str, list[int]] = {}
        self.failed: OSError | None = None

    def __call__(self, table: Table) -> None:
        """Print a table's rows, before its first ones title and columns; an error is kept for the end."""
        if self.failed is None:
            try:
                self._print(table)
            except OSError as error:
                _flushed(sys.stdout)
                self.failed = error

    def _print(self, table: Table) -> None:
        cells = table.cells()
        if table.title not in self.titles:
            self.titles[table.title] = [
                max(_COLUMN[kind == "s"], len(name), *(len(row[k]) for row in cells))
                for k, (name, kind) in enumerate(zip(table.columns, table.formats, strict=True))
            ]
            print(table.title)
            cells = [list(table.columns), *cells]
        widths = self.titles[table.title]
        for row in cells:
            pads = zip(row, widths, table.formats, strict=True)
            line = "  ".join(cell.ljust(w) if kind == "s" else cell.rjust(w) for cell, w, kind in pads)
            print(line, flush=True)


# the least width of a column of numbers, and of words
_COLUMN = (9, 22)


def show(section: Section, report: Path, printed: Collection[str] = ()) -> None:
    """Print a section's words and tables, and where the report is.

    Of tables whose titles are among those `printed` the rows are on the terminal already.
    """
    from rich.console import Console
    from rich.table import Table as Grid

    console = Console()
    for text in section.text:
        console.print(text, highlight=False, markup=False)
    for table in section.tables:
        if table.title not in printed:
            grid = Grid(title=table.title, title_justify="left", title_style="bold")
            for k, (name, sentence) in enumerate(zip(table.columns, table.sentences(), strict=True)):
                grid.add_column(name, justify="left" if k == 0 or sentence else "right", no_wrap=not sentence)
            for row in table.cells():
                grid.add_row(*row)
            # a pipe has no width of its own; rows must not be cut there
            wide = console if console.is_terminal else Console(width=200)
            wide.print(grid, markup=False)
        if table.note:
            console.print(table.note, highlight=False, markup=False)
    console.print(f"report: {report}", highlight=False, soft_wrap=True, markup=False)
