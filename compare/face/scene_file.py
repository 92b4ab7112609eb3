"""Scenes in TOML files: the fields of `Scene`, and a table of those of `Ribbon`.

    compression = 0.40
    shear = 0.37
    start = "U+S-"
    rate = 0.1
    stop = 0.8

    [ribbon]
    thickness = 0.005

What is left out keeps its default; the ratios of a ribbon, `bending_ratio` and `twist_ratio`, follow
from its section where they are left out.
"""

from __future__ import annotations

import tomllib
from dataclasses import fields
from pathlib import Path
from typing import Any

from ribbonfem import Ribbon, Scene, SceneError
from ribbonfem.scene import shown

_FIELDS = ", ".join(item.name for item in fields(Scene) if item.name != "ribbon")


def _known(owner: type[Scene] | type[Ribbon], table: dict[str, Any], path: Path) -> None:
    # the ratios of a ribbon are given by name, and kept in one field
    ratios = ["bending_ratio", "twist_ratio"] if owner is Ribbon else []
    names = [item.name for item in fields(owner) if item.name != "ratios"] + ratios
    for name in table:
        if name not in names:
            raise SceneError(f"{path}: {owner.__name__}.{name} is not a field; they are {', '.join(names)}")


def read_scene(path: Path | str) -> Scene:
    """The scene of a file.

    Raises
    ------
    SceneError
        For a file that is not TOML, a field that is not one, or a value that cannot be; names it.
    OSError
        If the file cannot be read.
    """
    try:
        path = Path(path)
    except TypeError:
        raise SceneError(f"{shown(path)}: the path of a scene file is needed") from None
    try:
        table = tomllib.loads(path.read_text(encoding="utf-8"))
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
        return Scene(ribbon=Ribbon(**ribbon), **table)
    except SceneError as error:
        raise SceneError(f"{path}: {error}") from error
