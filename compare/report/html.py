"""The report as one HTML page that needs no other file: sections as they lie in its folder."""

from __future__ import annotations

import base64
import html
from collections.abc import Mapping, Sequence
from pathlib import Path

from .section import Picture, Section, Table

# rows beyond which a table is folded away
_LONG = 24

_STYLE = """
:root { color-scheme: light dark; --ink: #1a1a1a; --paper: #fff; --soft: #555; --line: #ddd }
@media (prefers-color-scheme: dark) {
  :root { --ink: #e6e6e6; --paper: #16181b; --soft: #a8a8a8; --line: #3a3d42 }
  img { background: #fff; border-radius: 4px }
}
body { font: 16px/1.5 system-ui, sans-serif; color: var(--ink); background: var(--paper) }
body { max-width: 74rem; margin: 2rem auto; padding: 0 1rem; overflow-wrap: break-word }
h1 { font-size: 1.7rem } h2 { margin-top: 2.5rem; border-top: 1px solid var(--line); padding-top: 1rem }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; font-size: .88rem; margin: .6rem 0 }
th { border-bottom: 1.5px solid var(--soft); text-align: right; padding: .2rem .6rem; vertical-align: bottom }
td { text-align: right; padding: .12rem .6rem; border-bottom: 1px solid var(--line) }
th:first-child, td:first-child { text-align: left }
.words { text-align: left; min-width: 9rem } tr:has(.words) td { vertical-align: top }
.scroll { overflow-x: auto } caption, summary { text-align: left; font-weight: 600; padding: .3rem 0 }
img { max-width: 100% } figcaption, .note { color: var(--soft); font-size: .92rem }
figure { margin: 1rem 0 } a { color: inherit }
iframe { width: 100%; height: 40rem; border: 0 }
@media (max-width: 700px) { iframe { height: 58rem } }
"""


def _picture(picture: Picture, folder: Path) -> str:
    """A picture in the page; only files in the report's own folder, or below it, are let in."""
    caption = html.escape(picture.caption)
    path = folder / picture.file
    file = html.escape(picture.file, quote=True)
    if Path(picture.file).is_absolute() or not path.resolve().is_relative_to(folder.resolve()):
        return f'<p class="note">{caption} (not shown: {file} is no file of this folder)</p>'
    if not path.is_file():
        return f'<p class="note">{caption} (not drawn: {file} is missing)</p>'
    if path.suffix == ".html":
        # in the page, which so needs no other file; it may run its code, and reaches nothing of the page
        inside = html.escape(path.read_text(encoding="utf-8"), quote=True)
        return (
            f'<figure><iframe title="{caption}" sandbox="allow-scripts" srcdoc="{inside}"></iframe>'
            f'<figcaption>{caption} <a href="{file}">On a page of its own</a></figcaption></figure>'
        )
    kind = "gif" if path.suffix == ".gif" else "png"
    data = f"data:image/{kind};base64,{base64.b64encode(path.read_bytes()).decode('ascii')}"
    return (
        f'<figure><a href="{file}" title="full size"><img alt="{caption}" src="{data}"></a>'
        f"<figcaption>{caption}</figcaption></figure>"
    )


def _table(table: Table) -> str:
    kinds = [' class="words"' if sentence else "" for sentence in table.sentences()]
    head = "".join(
        f"<th{kind}>{html.escape(name)}</th>" for kind, name in zip(kinds, table.columns, strict=True)
    )
    body = "".join(
        "<tr>"
        + "".join(f"<td{kind}>{html.escape(cell)}</td>" for kind, cell in zip(kinds, row, strict=True))
        + "</tr>"
        for row in table.cells()
    )
    title, long = html.escape(table.title), len(table.rows) > _LONG
    inside = (
        f'<div class="scroll"><table>{"" if long else f"<caption>{title}</caption>"}'
        f"<thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>"
    )
    if long:
        inside = f"<details><summary>{title} ({len(table.rows)} rows)</summary>{inside}</details>"
    return inside + (f'<p class="note">{html.escape(table.note)}</p>' if table.note else "")


def _section(section: Section, folder: Path) -> str:
    parts = [f'<h2 id="{html.escape(section.name, quote=True)}">{html.escape(section.title)}</h2>']
    parts += [f"<p>{html.escape(text)}</p>" for text in section.text]
    parts += [_picture(picture, folder) for picture in section.pictures]
    parts += [_table(table) for table in section.tables]
    return "\n".join(parts)


def page(sections: Sequence[Section], left_out: Mapping[str, str], folder: Path) -> str:
    """The report's page; `left_out` has a reason for each file that is no section."""
    links = "".join(
        f'<li><a href="#{html.escape(s.name, quote=True)}">{html.escape(s.title)}</a></li>' for s in sections
    )
    lost = "".join(
        f'<p class="note">Left out: {html.escape(file)}: {html.escape(reason)}</p>'
        for file, reason in left_out.items()
    )
    body = "\n".join(_section(section, folder) for section in sections)
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        '<link rel="icon" href="data:,"><title>ribbonfem report</title>'
        f"<style>{_STYLE}</style></head><body><h1>ribbonfem report</h1>"
        f"<nav><ul>{links}</ul></nav>\n{lost}\n{body}\n</body></html>\n"
    )
