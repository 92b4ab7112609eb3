"""The command line ``ribbonfem COMMAND`` (also ``python -m compare COMMAND``): options, help, exit status.

A command (`compare.report.registry`): the keyword parameters of its `main` are its options, its
docstring its help; ``report``, ``scenes`` and ``warm`` ask nothing.  Nothing heavy is imported before a
command is known, so that ``--help`` answers at once.

The help of ten options takes 0.08 s of the processor, by tyro 1.0 and cyclopts 5.5 0.21 and 0.23; they read
neither LOW:HIGH:COUNT nor A,B,.. as one word.

Exit status: 0 done, 1 an error (one line says which), 2 a command line that cannot be; of ``run`` also 3,
the tolerance was not met, and 4, refinement does not settle the value.  130 after an interrupt.
"""

from __future__ import annotations

import argparse
import dataclasses
import difflib
import inspect
import json
import os
import sys
import warnings
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any, Literal, NoReturn, get_args, get_origin, get_type_hints

from compare.report.registry import COMMANDS, ORDER, SHARED, Command, first_line, named, publish
from compare.report.terminal import complain, printing, show, terminal
from compare.sweep.pool import begin_early, end_early

OUT = Path("ribbonfem-report")
REPORT, SCENES, WARM = "report", "scenes", "warm"
# finished runs of a command that has not come to its end, in the report's folder
FINISHED = ".finished"
STATUS = "exit status: 0 done, 1 error, 2 wrong usage, 130 interrupted"
OWN_STATUS = {
    "run": "exit status: 0 met, 1 error, 2 wrong usage, 3 tolerance not met, 4 sensitive, 130 interrupted",
    "fit": "exit status: 0 done, 1 error, 2 wrong usage, 3 not to be relied on, 130 interrupted",
}


def _numbers(kind: Callable[[str], float]) -> Callable[[str], tuple[float, ...]]:
    def read(text: str) -> tuple[float, ...]:
        try:
            return tuple(kind(part) for part in text.split(","))
        except ValueError:
            what = "whole numbers" if kind is int else "numbers"
            raise argparse.ArgumentTypeError(
                f"{text!r}: {what} are needed, with commas between them"
            ) from None

    return read


def _grid(text: str) -> tuple[float, float, int]:
    try:
        low, high, count = text.split(":")
        return float(low), float(high), int(count)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r}: LOW:HIGH:COUNT is needed, as 0.01:1:20") from None


def _span(text: str) -> tuple[float, float]:
    try:
        low, high = text.split(":")
        return float(low), float(high)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r}: LOW:HIGH is needed, as 0.05:5") from None


def _option(parser: argparse.ArgumentParser, name: str, hint: Any, default: Any) -> None:
    """One keyword parameter of a command as an option."""
    option = "--" + name.replace("_", "-")
    kinds = [kind for kind in get_args(hint) if kind is not type(None)]
    if default is None and len(kinds) == 1 and get_origin(hint) is not Literal:
        hint = kinds[0]
    required = default is inspect.Parameter.empty
    shown: dict[str, Any] = {"required": True} if required else {"default": default}
    note = "needed" if required else "by default left out" if default in (None, ()) else f"default {default}"
    if hint is bool:
        parser.add_argument(option, action=argparse.BooleanOptionalAction, **shown)
    elif get_origin(hint) is Literal:
        parser.add_argument(option, choices=get_args(hint), help=note, **shown)
    elif get_origin(hint) is tuple:
        parts = get_args(hint)
        kind: Callable[[str], Any]
        if parts == (float, float, int):
            kind, form = _grid, "LOW:HIGH:COUNT"
        elif parts == (float, float):
            kind, form = _span, "LOW:HIGH"
        else:
            kind, form = _numbers(parts[0]), "A,B,.."
        if default and not required:
            mark = ":" if ":" in form else ","
            note = "default " + mark.join(value if parts[0] is str else f"{value:g}" for value in default)
        parser.add_argument(option, type=kind, metavar=form, help=note, **shown)
    else:
        parser.add_argument(
            option, type=hint, metavar=getattr(hint, "__name__", "TEXT").upper(), help=note, **shown
        )


def _add_options(parser: argparse.ArgumentParser, main: Any) -> list[str]:
    """Turn the parameters of a command into options; return their names."""
    hints = get_type_hints(main)
    names = []
    for parameter in inspect.signature(main).parameters.values():
        if parameter.name == "sweep":
            continue
        names.append(parameter.name)
        if hints[parameter.name] is Path and parameter.default is inspect.Parameter.empty:
            # what a command cannot do without stands before its options
            parser.add_argument(parameter.name, type=Path, metavar=f"{parameter.name.upper()}.toml")
        else:
            _option(parser, parameter.name, hints[parameter.name], parameter.default)
    return names


def _whole(text: str) -> int:
    number = int(text)
    if number < 1:
        raise argparse.ArgumentTypeError(f"{text}: a whole number of at least 1 is needed")
    return number


def _common(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--out", type=Path, default=OUT, help=f"folder of the report (default {OUT}/)")
    parser.add_argument("--json", action="store_true", help="print the numbers as JSON, and nothing else")
    parser.add_argument("--quiet", action="store_true", help="no progress bar")


def _overview() -> argparse.ArgumentParser:
    lines = [f"  {name:<12} {first_line(name)}" for name in ORDER]
    lines.append(f"  {REPORT:<12} Make the report's page anew, and with --redraw its pictures too.")
    lines.append(f"  {SCENES:<12} List the scene files that are shipped, and write them.")
    lines.append(f"  {WARM:<12} Compile everything once, for images and clusters.")
    parser = argparse.ArgumentParser(
        prog="ribbonfem",
        usage="ribbonfem COMMAND [options]",
        description="Snapping ribbons and beams: finite elements and discrete elastic rods, side by side.\n\n"
        "commands:\n" + "\n".join(lines),
        epilog=f"ribbonfem COMMAND --help shows the options of a command. {STATUS} "
        "(run: 3 and 4 besides, fit: 3).",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=_version())
    parser.add_argument("command", metavar="COMMAND", help="one of those above")
    return parser


def _version() -> str:
    from importlib.metadata import PackageNotFoundError, version

    try:
        return f"ribbonfem {version('ribbonfem')}"
    except PackageNotFoundError:
        return "ribbonfem (not installed)"


def _unknown(command: str) -> NoReturn:
    near = difflib.get_close_matches(command, (*ORDER, REPORT, SCENES, WARM), 1)
    hint = f"; did you mean {near[0]!r}?" if near else ""
    complain(f"ribbonfem: {command!r} is no command{hint} ribbonfem --help lists them")
    raise SystemExit(2)


def _warn_of_left_out(left_out: dict[str, str], prog: str) -> None:
    for file, reason in left_out.items():
        complain(f"{prog}: left out of the report: {file}: {reason}")


def _perform(command: Command, options: dict[str, Any], names: Sequence[str]) -> int:
    """Compute, write, show."""
    from compare.archive import finite
    from compare.report.folder import PAGE, require_room
    from compare.report.terminal import Rows
    from compare.sweep import Progress, Sweep

    out, prog = options["out"], f"ribbonfem {command.name}"
    require_room(out)
    with ExitStack() as stack:
        rows = Rows()
        progress = stack.enter_context(
            Progress(
                visible=not (options["quiet"] or options["json"]), shows=None if options["json"] else rows
            )
        )
        executor = None
        if options["dask"]:
            from compare.sweep.cluster import executor_at

            executor = stack.enter_context(executor_at(options["dask"]))
        sweep = stack.enter_context(
            Sweep(
                folder=out / FINISHED / command.name,
                others=[out / FINISHED / other for other in command.takes_over],
                processes=options["processes"],
                executor=executor,
                progress=progress,
            )
        )
        result = command.main(sweep=sweep, **{name: options[name] for name in names})
        section, left_out = publish(command, result, out, progress)
        if not command.keep and sweep.store is not None:
            sweep.store.clear()
    _warn_of_left_out(left_out, prog)
    with printing():
        if options["json"]:
            print(json.dumps(finite(section.values), indent=1, allow_nan=False))
        elif rows.failed:
            raise rows.failed
        else:
            show(section, out / PAGE, rows.titles)
    return command.status(result)


def _report(arguments: Sequence[str]) -> int:
    """Make the report's page anew, and with --redraw its pictures and tables too; no model is called."""
    from compare.archive import load
    from compare.report.folder import PAGE, add_pictures, require_room, write_page, write_section
    from ribbonfem.output.files import write_whole

    parser = argparse.ArgumentParser(prog=f"ribbonfem {REPORT}", description=_report.__doc__)
    parser.add_argument("--redraw", action="store_true", help="draw all sections again from their results")
    _common(parser)
    options = parser.parse_args(arguments)
    out: Path = options.out
    if not out.is_dir():
        raise OSError(f"--out {out}: there is no such folder")
    require_room(out)
    drawn, failed = [], {}
    for name in ORDER if options.redraw else ():
        kept = out / f"{name}.result"
        if not kept.exists():
            # (its ending in the version before)
            kept = kept.with_suffix(".found")
        if kept.exists():
            try:
                result, command = load(kept), named(name)
                for file, content in command.files(result).items():
                    write_whole(out / file, content)
                section, _ = write_section(command.section(result), out, ORDER, command.drawings(result))
                # films are not drawn again: those that lie there are shown
                films = [picture for picture in command.films(result) if (out / picture.file).exists()]
                if films:
                    add_pictures(section, out, ORDER, films)
            except Exception as error:
                # a spoilt result, or one of another version: told, and the others are drawn
                failed[kept.name] = " ".join(f"{type(error).__name__}: {error}".split())[:200]
            else:
                drawn.append(name)
    left_out = write_page(out, ORDER) | failed
    _warn_of_left_out(left_out, f"ribbonfem {REPORT}")
    with printing():
        if options.json:
            print(json.dumps({"redrawn": drawn, "left_out": left_out}, indent=1))
        else:
            print(f"report: {out / PAGE}")
    return 0


def _scenes(arguments: Sequence[str]) -> int:
    """List the scene files that are shipped, or write them: those that are named, or with --out all."""
    from compare.commands.scenes import titles, write

    parser = argparse.ArgumentParser(
        prog=f"ribbonfem {SCENES}", description=_scenes.__doc__, epilog=f"{STATUS}. No file is written over."
    )
    parser.add_argument("name", nargs="*", metavar="NAME", help="of a scene; without one they are listed")
    parser.add_argument("--out", type=Path, help="folder to write to (default: the one you are in)")
    parser.add_argument("--json", action="store_true", help="print names, titles and files as JSON")
    options = parser.parse_args(arguments)
    known = titles()
    given = [name.removesuffix(".toml").lower() for name in options.name]
    names = list(dict.fromkeys(given)) or (list(known) if options.out else [])
    written = dict(zip(names, write(names, options.out or Path()), strict=True))
    with printing():
        if options.json:
            rows = [
                {"name": name, "title": known[name], "file": str(written[name]) if written else None}
                for name in written or known
            ]
            print(json.dumps(rows, indent=1))
        elif written:
            for path in written.values():
                print(f"written: {path}")
            print(f"run it: ribbonfem run {path}")
        else:
            for name, title in known.items():
                print(f"{name:<16} {title}")
            print(f"write one: ribbonfem {SCENES} NAME; all of them: ribbonfem {SCENES} --out FOLDER")
    return 0


def _warm(arguments: Sequence[str]) -> int:
    """Compile everything that is not compiled yet, in parallel, and say where it is kept.

    No later process on machines of this kind compiles anything: for images, and nodes of a cluster that
    share a folder.
    """
    parser = argparse.ArgumentParser(
        prog=f"ribbonfem {WARM}",
        description=f"{inspect.getdoc(_warm)}\n\ntakes about a minute of each of two cores",
        epilog=STATUS,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--processes", type=_whole, help="worker processes (default one a processor)")
    parser.add_argument(
        "--out",
        type=Path,
        help="folder that it is kept in, for which NUMBA_CACHE_DIR has to be set later (default: where it is "
        "looked for, beside the package or at home)",
    )
    parser.add_argument("--json", action="store_true", help="print seconds and folder as JSON")
    parser.add_argument("--quiet", action="store_true", help="no progress bar")
    options = parser.parse_args(arguments)
    if options.out:
        # read when the compiler is imported, here and in the workers
        os.environ["NUMBA_CACHE_DIR"] = str(options.out.absolute())
    from compare.compilation import warm
    from compare.sweep import Progress

    with Progress(visible=not (options.quiet or options.json)) as progress:
        warmed = warm(processes=options.processes, progress=progress)
    with printing():
        if options.json:
            print(json.dumps(dataclasses.asdict(warmed), indent=1))
        else:
            for job, seconds in warmed.compiled.items():
                print(f"compiled: {job}, {seconds:.1f} s")
            print(f"{warmed.seconds:.1f} s; kept in {warmed.folder or 'no folder: none can be written'}")
    return 0


def _command(name: str, arguments: Sequence[str]) -> int:
    given = {argument.partition("=")[0] for argument in arguments}
    if name in SHARED and given.isdisjoint({"-h", "--help", "--processes", "--dask"}):
        begin_early(COMMANDS[name])
    try:
        return _called(name, arguments)
    finally:
        end_early()


def _called(name: str, arguments: Sequence[str]) -> int:
    command = named(name)
    parser = argparse.ArgumentParser(
        prog=f"ribbonfem {name}",
        description=f"{inspect.getdoc(command.main)}\n\ntakes {command.takes}",
        epilog=OWN_STATUS.get(name, STATUS),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    names = _add_options(parser, command.main)
    parser.add_argument("--processes", type=_whole, help="worker processes (default one a processor)")
    parser.add_argument("--dask", metavar="ADDRESS", help="run on a Dask cluster instead ([cluster] extra)")
    _common(parser)
    return _perform(command, vars(parser.parse_args(arguments)), names)


def _run(command: str, arguments: Sequence[str]) -> int:
    """Run a command whose name is known; an error is told in a line."""
    from compare.sweep import SweepError
    from ribbonfem.results import SolverError

    prog = f"ribbonfem {command}"
    try:
        own = {REPORT: _report, SCENES: _scenes, WARM: _warm}
        return own[command](arguments) if command in own else _command(command, arguments)
    except KeyboardInterrupt:
        complain(f"{prog}: interrupted; what is finished is kept, the same command goes on")
        return 130
    except (ValueError, SolverError, SweepError, OSError, MemoryError) as error:
        complain(f"{prog}: {' '.join(str(error).split()) or type(error).__name__}")
        return 1


def main(arguments: list[str] | None = None) -> int:
    """Run one command; returns the exit status."""
    arguments = list(sys.argv[1:] if arguments is None else arguments)
    with terminal():
        if not arguments or arguments[0].startswith("-"):
            _overview().parse_args(arguments or ["--help"])
        command = arguments[0]
        if command not in (*ORDER, REPORT, SCENES, WARM):
            _unknown(command)
        # what looks like a slip is told in a line, without the place in the source that saw it
        before = warnings.formatwarning
        warnings.formatwarning = lambda message, *_, **__: f"ribbonfem {command}: {message}\n"
        try:
            return _run(command, arguments[1:])
        finally:
            warnings.formatwarning = before


if __name__ == "__main__":
    sys.exit(main())
