"""Columns of numbers read from a text file, by name or number."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from .ribbon import SceneError, as_number, shown

Array = NDArray[np.float64]


def columns(path: str | Path, wanted: tuple[str | int, ...], what: str) -> Array:
    """Columns (rows, len(wanted)) of a file of numbers, by name or number.

    Raises
    ------
    SceneError
        If one is not there, or a cell holds no number; names the row.  For a file that is not in UTF-8.
    OSError
        If the file cannot be read.
    """
    try:
        text = Path(path).read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise SceneError(f"{what}: {path}: no text in UTF-8, by its byte {error.start + 1}") from None
    first = text.split("\n", 1)[0]
    separator = next((mark for mark in ("\t", ";", ",") if mark in first), ",")
    rows = [
        row for row in csv.reader(text.splitlines(), delimiter=separator) if any(cell.strip() for cell in row)
    ]
    if not rows:
        raise SceneError(f"{what}: {path}: an empty file")
    names = [cell.strip() for cell in rows[0]]
    try:
        [float(cell) for cell in names]
        names = []
    except ValueError:
        rows = rows[1:]
    if not rows:
        raise SceneError(f"{what}: {path}: no row below the names {', '.join(names)}")
    places = []
    for column in wanted:
        if isinstance(column, str) and column in names:
            places.append(names.index(column))
        elif (
            isinstance(column, int)
            and not isinstance(column, bool)
            and 0 <= column < len(rows[0] if rows else names)
        ):
            places.append(column)
        else:
            there = ", ".join(names) or f"{len(rows[0])} without names"
            raise SceneError(f"{what}: {path}: no column {column!r}; there are {there}")
    result = np.empty((len(rows), len(places)))
    for k, row in enumerate(rows):
        for c, place in enumerate(places):
            try:
                result[k, c] = as_number(float(row[place]))
            except (ValueError, IndexError):
                cell = row[place] if place < len(row) else ""
                raise SceneError(f"{what}: {path}: row {k + 1}: {shown(cell)} is no finite number") from None
    return result
