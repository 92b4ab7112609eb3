"""Parts of a section of the report: text, tables, drawings, pictures, and numbers for JSON."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

# letters from which a cell holds a sentence
_SENTENCE = 44

# heading, format, and what stands there of a record: an attribute, a key, or a function of the record
Column = tuple[str, str, str | Callable[[Any], Any]]


def _value(record: Any, of: str | Callable[[Any], Any]) -> Any:
    if not isinstance(of, str):
        return of(record)
    return record[of] if isinstance(record, Mapping) else getattr(record, of)


@dataclass(frozen=True)
class Table:
    """Rows of numbers and words; `formats` has a format specification for each column of numbers."""

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[Any]]
    formats: Sequence[str]
    note: str = ""

    @classmethod
    def of(cls, title: str, records: Iterable[Any], columns: Sequence[Column], note: str = "") -> Table:
        """A row a record."""
        rows = [[_value(record, of) for *_, of in columns] for record in records]
        return cls(title, [name for name, *_ in columns], rows, [spec for _, spec, _ in columns], note)

    def cells(self) -> list[list[str]]:
        """The rows as text; a missing number is a dash."""

        def text(value: Any, spec: str) -> str:
            if value is None or (isinstance(value, float) and value != value):
                return "–"
            return str(value) if isinstance(value, str) else format(value, spec)

        return [[text(v, s) for v, s in zip(row, self.formats, strict=True)] for row in self.rows]

    def sentences(self) -> list[bool]:
        """Of each column whether it holds sentences, which are set in lines and not in columns."""
        cells = self.cells()
        return [max((len(row[k]) for row in cells), default=0) >= _SENTENCE for k in range(len(self.columns))]


@dataclass(frozen=True)
class Drawing:
    """A matplotlib figure, the name of its file (a PNG) and what it shows; with `vector` a PDF beside it."""

    file: str
    caption: str
    figure: Any
    vector: bool = False


@dataclass(frozen=True)
class Picture:
    """A PNG or GIF file, or an HTML page of its own, in the report's folder and what it shows."""

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
