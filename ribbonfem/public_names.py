"""Lazy imports of the packages' public names, with the nearest name in the error where there is none.

lazy_loader 0.6 would do 5 of these 42 lines (its import takes 2 ms): it shows nothing of another package, as
`compare.read_scene` is, and tells no near name.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from difflib import get_close_matches
from importlib import import_module
from typing import Any


def public(
    package: str, names: Sequence[str], lazy: Mapping[str, str] | None = None
) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """The `__getattr__` and `__dir__` of a package.

    Parameters
    ----------
    package: its name.
    names: what it shows.
    lazy: of the names those that are imported only when they are asked for, and the module of each:
        "." and its name for a module itself, else the module whose attribute it is.
    """
    later = dict(lazy or {})

    def getattribute(name: str) -> Any:
        if name in later:
            module = later[name]
            if module == ".":
                return import_module(f"{package}.{name}")
            return getattr(import_module(module), name)
        if name.startswith("_"):
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        near = get_close_matches(name, names, 1)
        meant = f", perhaps {near[0]!r} is meant" if near else ""
        raise AttributeError(
            f"module {package!r} has no attribute {name!r}{meant}; it has {', '.join(sorted(names))}"
        )

    def directory() -> list[str]:
        return sorted(names)

    return getattribute, directory
