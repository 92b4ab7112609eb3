"""The report's folder: writes and reads each section's JSON, result file and pictures, and the page of all.

A section lies there as ``NAME.json`` (text, tables, numbers), ``NAME.result`` (the result that all of it is
made of, see `compare.archive`) and PNG files; ``report.html`` is made anew from all that lie there.
Numbers are written before pictures, and every file whole or not at all.
"""

from __future__ import annotations

import io
import json
import math
import shutil
import tempfile
from collections.abc import Iterable, Sequence
from dataclasses import asdict, fields, replace
from pathlib import Path
from typing import Any

from compare.archive import finite, save
from ribbonfem.output.files import write_whole

from .html import page
from .section import Drawing, Picture, Section, Table

PAGE = "report.html"
# bytes that a section may need; less room than this is told before anything is computed
_ROOM = 20_000_000


def require_room(folder: Path) -> None:
    """Raise an `OSError` if a report cannot be written to this folder: before anything is computed for it."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(prefix=".", dir=folder):
            pass
    except OSError as error:
        raise type(error)(f"--out {folder}: the report cannot be written there: {error.strerror}") from None
    free = shutil.disk_usage(folder).free
    if free < _ROOM:
        raise OSError(f"--out {folder}: {free / 1e6:.1f} MB are free there; {_ROOM / 1e6:.0f} MB are needed")


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise ValueError(f"{value!r} where text should be")
    return value


def _read(path: Path) -> Section:
    """The section of a file, whose every part is what it should be."""
    data = json.loads(path.read_text(encoding="utf-8"))
    if not isinstance(data, dict) or set(data) != {field.name for field in fields(Section)}:
        raise ValueError("it holds no section of this version")
    if data["name"] != path.stem or not isinstance(data["values"], dict):
        raise ValueError("it holds another section than its name says")
    for part in ("text", "tables", "pictures"):
        if not isinstance(data[part], list):
            raise ValueError(f"{part} is no list")
    tables = tuple(Table(**table) for table in data["tables"])
    for table in tables:
        table.cells()
        for word in (table.title, table.note, *table.columns):
            _text(word)
    pictures = tuple(Picture(_text(p["file"]), _text(p["caption"])) for p in data["pictures"])
    text = tuple(_text(line) for line in data["text"])
    return Section(data["name"], _text(data["title"]), text, tables, pictures, data["values"])


def sections_in(folder: Path, order: Sequence[str]) -> tuple[list[Section], dict[str, str]]:
    """The sections that lie in a folder, in their order, and why others were left out, by file."""
    result, left_out = [], {}
    for name in order:
        path = folder / f"{name}.json"
        if not path.exists():
            continue
        try:
            result.append(_read(path))
        except Exception as error:
            # whatever a spoilt file may do to its readers: it is told, and stops nothing else
            left_out[path.name] = " ".join(f"{type(error).__name__}: {error}".split())[:200]
    return result, left_out


def write_page(folder: Path, order: Sequence[str]) -> dict[str, str]:
    """Make the page anew from what lies in the folder; returns what was left out, by file."""
    sections, left_out = sections_in(folder, order)
    write_whole(folder / PAGE, page(sections, left_out, folder))
    return left_out


def _as_json(section: Section) -> str:
    """A section as JSON; infinite numbers of a table are words in it."""

    def word(value: Any) -> Any:
        return str(value) if isinstance(value, float) and math.isinf(value) else value

    tables = [replace(table, rows=[[*map(word, row)] for row in table.rows]) for table in section.tables]
    return json.dumps(finite(asdict(replace(section, tables=tables))), indent=1, allow_nan=False)


def _draw(drawing: Drawing, folder: Path) -> Picture:
    path = folder / drawing.file
    # a PDF says when it was made, and equal results make equal files
    kinds = {"png": None, "pdf": {"CreationDate": None}} if drawing.vector else {"png": None}
    for kind, said in kinds.items():
        stream = io.BytesIO()
        drawing.figure.savefig(stream, format=kind, metadata=said)
        write_whole(path.with_suffix(f".{kind}"), stream.getvalue())
    return Picture(drawing.file, drawing.caption)


def add_pictures(
    section: Section, folder: Path, order: Sequence[str], more: Sequence[Picture]
) -> tuple[Section, dict[str, str]]:
    """Show more pictures in a section that lies in the folder: films, that are made last."""
    section = replace(section, pictures=(*section.pictures, *more))
    write_whole(folder / f"{section.name}.json", _as_json(section))
    return section, write_page(folder, order)


def write_section(
    section: Section, folder: Path, order: Sequence[str], drawings: Iterable[Drawing] = (), result: Any = None
) -> tuple[Section, dict[str, str]]:
    """Keep a section in the report's folder and make the page anew.

    Parameters
    ----------
    section: its text, tables and numbers.
    folder, order: of the report, and of the sections in it.
    drawings: are drawn after the numbers have been written.
    result: the result that the section is made of, for `compare.archive.load`.

    Returns
    -------
    The section with its pictures, and what was left out of the page, by file.
    """
    kept = folder / f"{section.name}.json"
    write_whole(kept, _as_json(section))
    if result is not None:
        save(result, folder / f"{section.name}.result")
    from ribbonfem.output.style import in_style

    with in_style():
        pictures = tuple(_draw(drawing, folder) for drawing in drawings)
    if pictures:
        section = replace(section, pictures=pictures)
        write_whole(kept, _as_json(section))
    return section, write_page(folder, order)
