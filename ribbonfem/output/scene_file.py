"""Scenes read from TOML files: the fields of `Scene`, and tables of those of `Ribbon` and `Schedule`.

    compression = 0.40
    shear = 0.37
    start = "U+S-"
    drive = "left"            # or a table [drive] left = 1.0, right = 0.5
    rate = 0.1
    stop = 0.8
    gravity = [0, 0, -9.81]

    [preset]
    lift = 0.01

    [ribbon]
    thickness = 0.005

Instead of rate, stop and hold a table [schedule] says the control in time: time, value and kind, or
file = "alpha.csv" beside the scene file, with the columns time, value and the units of `Schedule.from_csv`.
What is left out keeps its default; the ratios of a ribbon, `bending_ratio` and `twist_ratio`, follow
from its section where they are left out.
"""

from __future__ import annotations

import tomllib
from dataclasses import fields
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from ribbonfem import Ribbon, Scene, SceneError, Schedule
from ribbonfem.scene import shown

# the ratios of a ribbon are given by name, and kept in one field
_RATIOS = ("bending_ratio", "twist_ratio")


def _names(owner: type[Scene] | type[Ribbon]) -> list[str]:
    names = [item.name for item in fields(owner) if item.name != "ratios"]
    return [*names, *_RATIOS] if owner is Ribbon else names


# keys of a table [schedule]; and those that go with a file
_SCHEDULE, _FILE = ("time", "value", "kind", "slope"), ("file", "time", "value", "units", "kind")
# (also by its old name)
_OLD = ("turned",)
_FIELDS = ", ".join(name for name in _names(Scene) if name != "ribbon")


def _meant(owner: type[Scene] | type[Ribbon], name: str) -> str:
    """Where a key that is none belongs, or the nearest one that is; empty where there is none near."""
    other: type[Scene] | type[Ribbon] = Ribbon if owner is Scene else Scene
    if name in _names(other):
        place = "below [ribbon]" if other is Ribbon else "above [ribbon]"
        return f"; {name!r} belongs {place}"
    near = get_close_matches(name.lower(), _names(owner), 1)
    if near:
        return f"; perhaps {near[0]!r} is meant"
    elsewhere = get_close_matches(name.lower(), _names(other), 1)
    return f"; perhaps {other.__name__}.{elsewhere[0]} is meant" if elsewhere else ""


def _known(owner: type[Scene] | type[Ribbon], table: dict[str, Any], path: Path) -> None:
    names = _names(owner)
    for name, value in table.items():
        if name not in names and not (owner is Scene and name in _OLD):
            raise SceneError(
                f"{path}: {owner.__name__}.{name} = {shown(value)}: not a field{_meant(owner, name)}; "
                f"the fields are {', '.join(names)}"
            )


def read_scene(path: Path | str) -> Scene:
    """The scene of a file.

    Raises
    ------
    SceneError
        For a file that is not TOML, a field that is not one, or a value that cannot be: names the file,
        the key, its value, what is allowed, and the nearest key.
    OSError
        If the file cannot be read.
    """
    try:
        path = Path(path)
    except TypeError:
        raise SceneError(f"{shown(path)}: the path of a scene file is needed") from None
    try:
        table = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except FileNotFoundError:
        raise FileNotFoundError(
            f"{path}: there is no such scene file (ribbonfem scenes writes some to start from)"
        ) from None
    except (ValueError, RecursionError) as error:
        # of the syntax, the encoding, or numbers longer than Python reads
        raise SceneError(f"{path}: not a TOML file: {' '.join(str(error).split())}") from error
    if not table:
        raise SceneError(
            f"{path}: empty: a scene file holds fields of Scene, {_FIELDS}, and a table [ribbon]"
        )
    _known(Scene, table, path)
    ribbon = table.pop("ribbon", {})
    if not isinstance(ribbon, dict):
        raise SceneError(f"{path}: Scene.ribbon = {shown(ribbon)}: a table of the fields of Ribbon is needed")
    _known(Ribbon, ribbon, path)
    try:
        if "schedule" in table:
            table["schedule"] = _schedule(table["schedule"], path.parent)
        return Scene(ribbon=Ribbon(**ribbon), **table)
    except SceneError as error:
        raise SceneError(f"{path}: {error}") from error


def _schedule(table: object, folder: Path) -> Schedule:
    """The schedule of a table, or of the file that it names."""
    if not isinstance(table, dict):
        wanted = "a table is needed, of time and value (kind, slope), or of a file"
        raise SceneError(f"Scene.schedule = {shown(table)}: {wanted}")
    allowed = _FILE if "file" in table else _SCHEDULE
    for name, value in table.items():
        if name not in allowed:
            raise SceneError(f"schedule.{name} = {shown(value)}: not a key; there are {', '.join(allowed)}")
    if "file" not in table:
        missing = [name for name in ("time", "value") if name not in table]
        if missing:
            raise SceneError(
                f"schedule.{missing[0]}: is missing; instants (s) and values of the control are needed"
            )
        return Schedule(**table)
    given = dict(table)
    name = given.pop("file")
    if not isinstance(name, str):
        raise SceneError(f"schedule.file = {shown(name)}: the name of a file is needed")
    if isinstance(given.get("units"), list):
        given["units"] = tuple(given["units"])
    return Schedule.from_csv(folder / name, **given)
