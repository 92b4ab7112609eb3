"""The registry: the list of all commands, what a command consists of, and the order of the report."""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from compare.report.section import Drawing, Picture, Section, Table

# the module of each command, in the order of the report
COMMANDS = {
    "run": "compare.commands.run",
    "crosscheck": "compare.commands.crosscheck",
    "folds": "compare.reproduction.folds",
    "delay": "compare.reproduction.delay",
    "cases": "compare.reproduction.runs",
    "skipping": "compare.reproduction.skipping",
    "selection": "compare.reproduction.selection",
    "figures": "compare.reproduction.figures",
    "threshold": "compare.commands.threshold",
    "fit": "compare.commands.fit",
    "speed": "compare.studies.speed",
    "accuracy": "compare.studies.accuracy",
    "stability": "compare.studies.stability",
    "choices": "compare.studies.choices",
    "calibrate": "compare.studies.calibrate",
    "peers": "compare.studies.peers",
}
ORDER = tuple(COMMANDS)
# those whose every call gives other processes work from its beginning on
SHARED = frozenset({"crosscheck"})


def _nothing(_: Any) -> Iterable[Any]:
    return ()


def _no_files(_: Any) -> dict[str, str]:
    return {}


def _no_export(_: Any, __: Path, ___: Any) -> None:
    return None


def _well(_: Any) -> int:
    return 0


@dataclass(frozen=True)
class Command:
    """A command, and a section of the report.

    Attributes
    ----------
    name: of the command, and of the file that asks it.
    title: of the section; a function of what was found where it depends on that.
    takes: how long, on two cores.
    main: computes and returns one frozen result, enough to show everything again; its keyword
        parameters are the command's options, its docstring is their help.  It writes nothing.
    summary (sentences), tables, drawings, values: of a result; no model is called in them.
    files: text files that belong beside the report, by name, of a result.
    films: what the report shows of the films of a result (GIF) and its interactive views (HTML).
    export: writes films, views and frames of a result into a folder, last; is given a `Progress` too.
    status: the command's exit status, of a result.
    keep: whether finished runs stay in the folder, so that a larger command goes on from them.
    takes_over: other commands, whose finished runs that lie in the folder are not done again.
    section_name: of a result, where it is not `name`: such a section is a file beside the report.
    """

    name: str
    title: str | Callable[[Any], str]
    takes: str
    main: Callable[..., Any]
    summary: Callable[[Any], list[str]]
    values: Callable[[Any], dict[str, Any]]
    tables: Callable[[Any], Iterable[Table]] = _nothing
    drawings: Callable[[Any], Iterable[Drawing]] = _nothing
    files: Callable[[Any], dict[str, str]] = _no_files
    films: Callable[[Any], Iterable[Picture]] = _nothing
    export: Callable[[Any, Path, Any], object] = _no_export
    status: Callable[[Any], int] = _well
    keep: bool = False
    takes_over: tuple[str, ...] = ()
    section_name: Callable[[Any], str] | None = None

    def section(self, result: Any) -> Section:
        """What the report shows of a result, its pictures aside."""
        title = self.title if isinstance(self.title, str) else self.title(result)
        name = self.section_name(result) if self.section_name else self.name
        return Section(name, title, self.summary(result), tuple(self.tables(result)), (), self.values(result))


def publish(
    command: Command, result: Any, folder: Path, progress: Any = None
) -> tuple[Section, dict[str, str]]:
    """Write a result's section, its files and its pictures into the report's folder, numbers first.

    Returns
    -------
    The section, and what was left out of the page (spoilt sections of others), by file.

    Raises
    ------
    OSError
        If the folder cannot be written.
    """
    # imported here: a command's --help needs neither numpy nor the report
    from compare.report.folder import add_pictures, write_section
    from compare.sweep import Progress
    from ribbonfem.output.files import write_whole

    for name, content in command.files(result).items():
        write_whole(folder / name, content)
    section, left_out = write_section(
        command.section(result), folder, ORDER, command.drawings(result), result
    )
    command.export(result, folder, progress or Progress())
    more = tuple(command.films(result))
    return add_pictures(section, folder, ORDER, more) if more else (section, left_out)


def first_line(name: str) -> str:
    """The first line of a command's docstring, read without importing the models that it needs."""
    module = COMMANDS[name]
    spec = find_spec(module)
    # (of a file, or of a zip)
    source = getattr(spec.loader, "get_source", lambda _: "")(module) if spec else ""
    said = ast.get_docstring(ast.parse(source or "")) or ""
    return said.split("\n")[0]


def named(name: str) -> Command:
    """The command of this name."""
    command = import_module(COMMANDS[name]).COMMAND
    assert isinstance(command, Command)
    return command
