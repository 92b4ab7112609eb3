"""Scenes in TOML files: the fields of `Scene`, and a table of those of `Ribbon`.

    compression = 0.40
    shear = 0.37
    start = "U+S-"
    rate = 0.1
    stop = 0.8

    [ribbon]
    thickness = 0.005

What is left out keeps its default.
"""

from __future__ import annotations

import tomllib
from dataclasses import fields
from pathlib import Path
from typing import Any

from ribbonfem import Ribbon, Scene, SceneError


def _known(owner: type[Scene] | type[Ribbon], table: dict[str, Any], path: Path) -> None:
    names = [item.name for item in fields(owner)]
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
    path = Path(path)
    try:
        table = tomllib.loads(path.read_text())
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise SceneError(f"{path}: not a TOML file: {error}") from error
    _known(Scene, table, path)
    ribbon = table.pop("ribbon", {})
    if not isinstance(ribbon, dict):
        raise SceneError(f"{path}: Scene.ribbon = {ribbon!r}: a table of the fields of Ribbon is needed")
    _known(Ribbon, ribbon, path)
    try:
        return Scene(ribbon=Ribbon(**ribbon), **table)
    except SceneError as error:
        raise SceneError(f"{path}: {error}") from error
