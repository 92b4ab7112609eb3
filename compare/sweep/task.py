"""The task of a sweep: a function, its arguments, and the key under which its result is stored."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from importlib.metadata import PackageNotFoundError, version
from importlib.resources.abc import Traversable
from importlib.util import find_spec
from typing import Any

from compare.archive import ROOMS, encode


def _room(name: str) -> Traversable:
    """A package's folder, or its place in a zip; the package is not imported, which takes a second."""
    spec = find_spec(name)
    # both kinds of loaders that there are have one
    return spec.loader.get_resource_reader(name).files()  # type: ignore[union-attr]


def _sources(folder: Traversable, name: str) -> Iterator[tuple[str, bytes]]:
    """Sources and numbers of a package in the order of their names, from its folder or a zip."""
    for item in sorted(folder.iterdir(), key=lambda each: each.name):
        if item.is_dir():
            yield from _sources(item, f"{name}/{item.name}")
        elif item.name.endswith((".py", ".json")):
            yield f"{name}/{item.name}", item.read_bytes()


@lru_cache(maxsize=1)
def edition() -> str:
    """The package's version and a digest of its sources: results of another edition are not taken over."""
    try:
        named = version("ribbonfem")
    except PackageNotFoundError:
        named = "source"
    digest = hashlib.sha256()
    for room in ROOMS:
        for name, content in _sources(_room(room), room):
            digest.update(name.encode("utf-8"))
            digest.update(content)
    return f"{named}+{digest.hexdigest()[:16]}"


@dataclass(frozen=True)
class Task:
    """A call of a function of a module, which runs anywhere and writes nothing.

    Attributes
    ----------
    function: of one argument, importable by its name.
    argument: a record, or a tuple of what a record may hold.
    cost: how long it takes, in any unit; only ratios count.
    """

    function: Callable[[Any], Any]
    argument: Any
    cost: float = 1.0

    @property
    def key(self) -> str:
        """A hash of the function's name, the argument's content and the package's edition."""
        name = f"{self.function.__module__}:{self.function.__qualname__}"
        tree = json.dumps([edition(), name, encode(self.argument)], sort_keys=True)
        return hashlib.sha256(tree.encode("utf-8")).hexdigest()[:40]


@dataclass(frozen=True)
class Failure:
    """A task that ended without a result, and why."""

    reason: str
