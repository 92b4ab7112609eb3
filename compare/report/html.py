"""The report as one HTML page: the template `page.html` filled with sections, their pictures embedded."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

from .section import Picture, Section, Table

# rows beyond which a table is folded away
_LONG = 24


@cache
def _template() -> Any:
    """Read and compiled once: that takes ten times what filling it in does."""
    # imported here: what shows no page needs none
    from jinja2 import Environment, StrictUndefined

    text = (files("compare") / "report" / "page.html").read_text(encoding="utf-8")
    rules = Environment(autoescape=True, undefined=StrictUndefined, keep_trailing_newline=True)
    return rules.from_string(text)


def page(sections: Sequence[Section], left_out: Mapping[str, str], folder: Path) -> str:
    """The report's page; `left_out` has a reason for each file that is no section."""
    from markupsafe import Markup

    def content(picture: Picture) -> str | None:
        """What stands in the page for a picture; None of a file that is not below the report's folder."""
        path = folder / picture.file
        if Path(picture.file).is_absolute() or not path.resolve().is_relative_to(folder.resolve()):
            return None
        if not path.is_file():
            return ""
        if path.suffix == ".html":
            return path.read_text(encoding="utf-8")
        kind = "gif" if path.suffix == ".gif" else "png"
        return f"data:image/{kind};base64,{base64.b64encode(path.read_bytes()).decode('ascii')}"

    def kinds(table: Table) -> list[Markup]:
        """What is said of each column: the widest cell decides, so that it is asked once a table."""
        return [Markup(' class="text"' if sentence else "") for sentence in table.sentences()]

    given = {"sections": sections, "left_out": left_out, "content": content, "kinds": kinds, "rows": _LONG}
    return str(_template().render(given))
