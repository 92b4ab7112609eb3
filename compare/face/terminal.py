"""A section on the terminal."""

from __future__ import annotations

from pathlib import Path

from .section import Section


def show(section: Section, report: Path) -> None:
    """Print a section's words and tables, and where the report is."""
    from rich.console import Console
    from rich.table import Table as Grid

    console = Console()
    for text in section.text:
        console.print(text, highlight=False, markup=False)
    for table in section.tables:
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
