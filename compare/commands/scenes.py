"""Example scene files: listed, and written into a folder."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches
from importlib.resources import files
from pathlib import Path

from ribbonfem import SceneError
from ribbonfem.output.files import write_whole

# in the order in which one might try them
NAMES = (
    "planar-snap",
    "path-1",
    "path-2",
    "skipping-type-1",
    "skipping-type-2",
    "selection",
    "mixed-outcomes",
)

# the paper's films of simulations, by its names: `run` with --motion makes them
MOVIES = {"movie-s2": "path-1", "movie-s4": "path-2"}


def text(name: str) -> str:
    """The shipped file of this name, TOML with units in its comments.

    Raises
    ------
    SceneError
        If there is none; says which there are, and the nearest.
    """
    name = name.removesuffix(".toml")
    name = MOVIES.get(name.lower(), name)
    if name not in NAMES:
        known = (*NAMES, *MOVIES)
        near = get_close_matches(name.lower(), known, 1)
        meant = f"; perhaps {near[0]!r} is meant" if near else ""
        raise SceneError(f"{name!r}: no example scene has this name{meant}; there are {', '.join(known)}")
    return (files("compare") / "examples" / f"{name}.toml").read_text(encoding="utf-8")


def titles() -> dict[str, str]:
    """What each shipped scene shows, in a line, by name."""
    shown = {name: text(name).split("\n", 1)[0].removeprefix("# ") for name in NAMES}
    films = {
        name: f"The paper's Movie {name[-2:].upper()}: {of}, with --motion." for name, of in MOVIES.items()
    }
    return {**shown, **films}


def write(names: Iterable[str], folder: Path | str) -> list[Path]:
    """Write shipped scenes into a folder, each as NAME.toml; nothing is written over.

    Returns
    -------
    The files.

    Raises
    ------
    SceneError
        For a name that is not shipped.
    FileExistsError
        If a file is there already: names it, and then none is written.
    OSError
        If the folder cannot be written.
    """
    wanted = {Path(folder) / f"{name.removesuffix('.toml')}.toml": text(name) for name in names}
    for path in wanted:
        if path.exists():
            raise FileExistsError(
                f"{path}: the file exists, and nothing was written: "
                "move it away, or name another folder with --out"
            )
    for path, content in wanted.items():
        write_whole(path, content)
    return list(wanted)
