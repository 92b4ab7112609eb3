"""One run of a sweep: a function of the package, what it is called with, and a key that names both."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from compare.archive import ROOMS, encode


@lru_cache(maxsize=1)
def edition() -> str:
    """The package's version and a digest of its sources: results of another edition are not taken over."""
    try:
        named = version("ribbonfem")
    except PackageNotFoundError:
        named = "source"
    digest = hashlib.sha256()
    home = Path(__file__).parents[2]
    for room in ROOMS:
        for file in sorted((home / room).rglob("*")):
            if file.suffix in (".py", ".json"):
                digest.update(str(file.relative_to(home)).encode("utf-8"))
                digest.update(file.read_bytes())
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
