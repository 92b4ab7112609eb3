"""One self-contained HTML report, to which every command adds its section.

A command returns a `Section`; its tables and values are kept as ``NAME.json`` and its figures
as PNG files in the report's folder, and ``report.html`` is made anew from all that lie there.
"""

from __future__ import annotations

import base64
import html
import json
import os
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

ORDER = (
    "run",
    "crosscheck",
    "folds",
    "delay",
    "cases",
    "speed",
    "accuracy",
    "stability",
    "choices",
    "calibrate",
    "peers",
)

_STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; color: #1a1a1a; }
body { max-width: 74rem; margin: 2rem auto; padding: 0 1rem }
h1 { font-size: 1.7rem } h2 { margin-top: 2.5rem; border-top: 1px solid #ccc; padding-top: 1rem }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; font-size: .88rem; margin: .6rem 0 }
th { border-bottom: 1.5px solid #333; text-align: right; padding: .2rem .6rem; vertical-align: bottom }
td { text-align: right; padding: .12rem .6rem; border-bottom: 1px solid #eee }
th:first-child, td:first-child { text-align: left }
.scroll { overflow-x: auto } caption { text-align: left; font-weight: 600; padding: .3rem 0 }
img { max-width: 100% } figcaption, .note { color: #444; font-size: .92rem } figure { margin: 1rem 0 }
"""


@dataclass(frozen=True)
class Table:
    """Rows of numbers and words; `formats` has a format specification for each column of numbers."""

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[Any]]
    formats: Sequence[str]
    note: str = ""

    def cells(self) -> list[list[str]]:
        """The rows as text; a missing number is a dash."""

        def text(value: Any, spec: str) -> str:
            if value is None or (isinstance(value, float) and value != value):
                return "–"
            return str(value) if isinstance(value, str) else format(value, spec)

        return [[text(v, s) for v, s in zip(row, self.formats, strict=True)] for row in self.rows]


@dataclass(frozen=True)
class Picture:
    """A PNG file in the report's folder and what it shows."""

    file: str
    caption: str


@dataclass(frozen=True)
class Section:
    """What a command found: words, tables, pictures, and its numbers for programs."""

    name: str
    title: str
    text: Sequence[str]
    tables: Sequence[Table] = ()
    pictures: Sequence[Picture] = ()
    values: dict[str, Any] = field(default_factory=dict)


def _write(path: Path, text: str) -> None:
    """Write a file whole or not at all."""
    aside = path.with_name(f".{path.name}.{os.getpid()}")
    aside.write_text(text, encoding="utf-8")
    os.replace(aside, path)


def _section_html(section: dict[str, Any], folder: Path) -> str:
    parts = [f'<h2 id="{section["name"]}">{html.escape(section["title"])}</h2>']
    parts += [f"<p>{html.escape(text)}</p>" for text in section["text"]]
    for picture in section["pictures"]:
        path = folder / picture["file"]
        if path.exists():
            data = base64.b64encode(path.read_bytes()).decode()
            caption = html.escape(picture["caption"])
            parts.append(
                f'<figure><img alt="{caption}" src="data:image/png;base64,{data}">'
                f"<figcaption>{caption}</figcaption></figure>"
            )
    for table in section["tables"]:
        head = "".join(f"<th>{html.escape(name)}</th>" for name in table["columns"])
        body = "".join(
            "<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in row) + "</tr>"
            for row in Table(**table).cells()
        )
        parts.append(
            f'<div class="scroll"><table><caption>{html.escape(table["title"])}</caption>'
            f"<thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>"
        )
        if table["note"]:
            parts.append(f'<p class="note">{html.escape(table["note"])}</p>')
    return "\n".join(parts)


def write_section(section: Section, folder: Path) -> Path:
    """Keep a section in the report's folder and make ``report.html`` anew.

    Returns the path of the report.
    """
    folder.mkdir(parents=True, exist_ok=True)
    _write(folder / f"{section.name}.json", json.dumps(asdict(section), indent=1))
    found = {}
    for path in folder.glob("*.json"):
        if path.stem in ORDER:
            found[path.stem] = json.loads(path.read_text(encoding="utf-8"))
    sections = [found[name] for name in ORDER if name in found]
    links = " · ".join(f'<a href="#{s["name"]}">{html.escape(s["title"])}</a>' for s in sections)
    body = "\n".join(_section_html(s, folder) for s in sections)
    report = folder / "report.html"
    _write(
        report,
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width"><title>ribbonfem report</title>'
        f"<style>{_STYLE}</style></head><body><h1>ribbonfem report</h1>"
        f"<p>{links}</p>\n{body}\n</body></html>\n",
    )
    return report


def show(section: Section, report: Path) -> None:
    """Print a section's words and tables on the terminal, and where the report is."""
    from rich.console import Console
    from rich.table import Table as Grid

    console = Console()
    for text in section.text:
        console.print(text, highlight=False)
    for table in section.tables:
        grid = Grid(title=table.title, title_justify="left", title_style="bold")
        for k, name in enumerate(table.columns):
            grid.add_column(name, justify="left" if k == 0 else "right", no_wrap=True)
        for row in table.cells():
            grid.add_row(*row)
        # a pipe has no width of its own; rows must not be cut there
        wide = console if console.is_terminal else Console(width=200)
        wide.print(grid)
        if table.note:
            console.print(table.note, highlight=False)
    console.print(f"report: {report}", highlight=False, soft_wrap=True)
