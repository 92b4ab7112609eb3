"""The command line: ``ribbonfem COMMAND``, also ``python -m compare COMMAND``.

A command is a module of this package with a function ``main(*, progress, out, ...)``; its
keyword parameters are its options, its docstring its help.  Nothing heavy is imported before a
command is known, so that ``--help`` answers at once.
"""

from __future__ import annotations

import argparse
import importlib
import inspect
import json
import sys
from pathlib import Path
from typing import Any

COMMANDS = {
    "crosscheck": "fold of the beam: closed form, finite elements and discrete rods side by side",
    "folds": "folds and states of the ribbon at rest: 3D finite elements and discrete rods",
    "delay": "how late the snap comes: measured in every model, predicted without a parameter",
    "speed": "the time loop of the rods: steps a second, profile",
    "accuracy": "speed against error of every model, mesh, method and step; defaults against the front",
    "stability": "hard cases with every method: completed, drift, or the error raised",
    "cases": "the paper's named cases of mode skipping and selection",
    "run": "a scene from a file: the cheapest model that meets a tolerance, and its answer",
    "choices": "does the chosen model keep the tolerance asked for, and what does it save?",
    "calibrate": "measure the laws by which the cheapest model is chosen",
    "peers": "other programs on the same scenes: time at equal error",
}

OUT = Path("ribbonfem-report")


def _numbers(text: str) -> tuple[float, ...]:
    return tuple(float(part) for part in text.split(","))


def _add_options(parser: argparse.ArgumentParser, main: Any) -> list[str]:
    """Turn the keyword parameters of a command into options; return their names."""
    names = []
    for parameter in inspect.signature(main).parameters.values():
        default = parameter.default
        if parameter.name in ("progress", "out"):
            continue
        if default is inspect.Parameter.empty:
            # what a command cannot do without stands before its options
            names.append(parameter.name)
            parser.add_argument(parameter.name, type=Path, metavar=f"{parameter.name.upper()}.toml")
            continue
        option = "--" + parameter.name.replace("_", "-")
        names.append(parameter.name)
        if isinstance(default, bool):
            parser.add_argument(option, action=argparse.BooleanOptionalAction, default=default)
        elif isinstance(default, tuple):
            shown = ",".join(f"{value:g}" for value in default)
            parser.add_argument(
                option, type=_numbers, default=default, metavar="A,B,..", help=f"default {shown}"
            )
        else:
            parser.add_argument(option, type=type(default), default=default, help=f"default {default}")
    return names


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="ribbonfem",
        description="Snapping ribbons and beams: finite elements and discrete elastic rods, side by side.",
        epilog="ribbonfem COMMAND --help shows the options of a command.",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    lines = "\n".join(f"  {name:<12} {text}" for name, text in COMMANDS.items())
    parser.add_argument("command", choices=list(COMMANDS), metavar="COMMAND", help="one of those above")
    parser.usage = "ribbonfem COMMAND [options]"
    parser.description = f"{parser.description}\n\ncommands:\n{lines}"
    return parser


def main(arguments: list[str] | None = None) -> int:
    """Run one command; returns the exit status."""
    arguments = list(sys.argv[1:] if arguments is None else arguments)
    if not arguments or arguments[0] not in COMMANDS:
        _parser().parse_args(arguments[:1] or ["--help"])
    module = importlib.import_module(f"compare.questions.{arguments[0]}")
    parser = argparse.ArgumentParser(
        prog=f"ribbonfem {arguments[0]}",
        description=inspect.getdoc(module.main),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    names = _add_options(parser, module.main)
    parser.add_argument("--out", type=Path, default=OUT, help=f"folder of the report (default {OUT}/)")
    parser.add_argument("--json", action="store_true", help="print the numbers as JSON, and nothing else")
    parser.add_argument("--quiet", action="store_true", help="no progress bar")
    options = vars(parser.parse_args(arguments[1:]))

    from compare.face.report import show, write_section
    from compare.sweep.progress import Progress
    from ribbonfem.results import SolverError

    try:
        with Progress(visible=not (options["quiet"] or options["json"])) as progress:
            section = module.main(
                progress=progress, out=options["out"], **{name: options[name] for name in names}
            )
        report = write_section(section, options["out"])
    except (ValueError, SolverError, OSError) as error:
        print(f"ribbonfem {arguments[0]}: {error}", file=sys.stderr)
        return 1
    if options["json"]:
        print(json.dumps(section.values, indent=1))
    else:
        show(section, report)
    return 0


if __name__ == "__main__":
    sys.exit(main())
