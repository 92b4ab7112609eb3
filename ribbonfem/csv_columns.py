"""Columns of numbers read from a text file, by name or number."""

from __future__ import annotations

import csv
import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from .ribbon import SceneError, as_number, shown

Array = NDArray[np.float64]

# the name of a column, and a unit in brackets behind it
HEADING = re.compile(r"(.*?)\s*(?:[(\[]([^()\[\]]+)[)\]])?", re.DOTALL)
# cells that say that nothing was measured
_MISSING = ("", "nan", "na", "n/a", "-")


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return cell.strip().lower() in _MISSING
    return True


def columns(path: str | Path, wanted: tuple[str | int, ...], what: str, *, missing: bool = False) -> Array:
    """Columns (rows, len(wanted)) of a file of numbers, by name or number.

    Columns are separated by commas, semicolons or tabs.  Lines that begin with # are comments; where no row
    of names stands above the numbers, the last comment there is one, if it has a name for each column.

    Parameters
    ----------
    path: of the file.
    wanted: the columns.
    what: who asks, for messages.
    missing: whether a cell may be empty, or "nan": it is NaN then.

    Raises
    ------
    SceneError
        If one is not there, or a cell holds no number; names the line.  For a file that is not in UTF-8.
    OSError
        If the file cannot be read.
    """
    names, numbered = _table(path, what)
    count = len(numbered[0][1])
    places = []
    for column in wanted:
        if isinstance(column, str) and column in names:
            places.append(names.index(column))
        elif isinstance(column, int) and not isinstance(column, bool) and 0 <= column < count:
            places.append(column)
        else:
            there = ", ".join(names) or f"{count} without names"
            raise SceneError(f"{what}: {path}: no column {column!r}; there are {there}")
    result = np.empty((len(numbered), len(places)))
    for row, (line, cells) in enumerate(numbered):
        for c, place in enumerate(places):
            cell = cells[place] if place < len(cells) else ""
            if missing and cell.strip().lower() in _MISSING and place < len(cells):
                result[row, c] = np.nan
                continue
            try:
                result[row, c] = as_number(float(cell))
            except ValueError:
                where = f"line {line}, row {row + 1}"
                raise SceneError(f"{what}: {path}: {where}: {shown(cell)} is no finite number") from None
    return result


def _cells(lines: list[tuple[int, str]], separator: str) -> list[tuple[int, list[str]]]:
    """The cells of each row with the number of its first line: a cell in quotes may go on in the next one."""
    reader = csv.reader([line for _, line in lines], delimiter=separator)
    rows, first = [], 0
    for cells in reader:
        rows.append((lines[first][0], cells))
        first = reader.line_num
    return rows


def headings(path: str | Path, what: str) -> list[str]:
    """The names of a file's columns; none where it has none.  Errors as of `columns`."""
    return _table(path, what)[0]


def _table(path: str | Path, what: str) -> tuple[list[str], list[tuple[int, list[str]]]]:
    """Names, and the cells of each row with the number of its line."""
    try:
        text = Path(path).read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise SceneError(f"{what}: {path}: no text in UTF-8, by its byte {error.start + 1}") from None
    lines = [(k, line) for k, line in enumerate(text.splitlines(), 1) if line.strip()]
    rows = [(k, line) for k, line in lines if not line.lstrip().startswith("#")]
    first = rows[0][1] if rows else ""
    separator = next((mark for mark in ("\t", ";", ",") if mark in first), ",")
    numbered = [(k, row) for k, row in _cells(rows, separator) if any(cell.strip() for cell in row)]
    if not numbered:
        raise SceneError(f"{what}: {path}: an empty file")
    names = [cell.strip() for cell in numbered[0][1]]
    if all(map(_is_number, names)):
        above = [(k, line.lstrip("# \t")) for k, line in lines if k < numbered[0][0]][-1:]
        cells = [cell.strip() for _, row in _cells(above, separator) for cell in row]
        names = cells if len(cells) == len(names) else []
    else:
        numbered = numbered[1:]
    if not numbered:
        raise SceneError(f"{what}: {path}: no row below the names {', '.join(names)}")
    return names, numbered
