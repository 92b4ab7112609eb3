"""The cache key of compiled code: a digest of a file of kernels and of all that it imports.

The compiler's own cache looks at the file of a function alone: a caller that was kept would go on running
an old callee from another file.  Here the key is a digest of the function's file and of all files of kernels
that this file imports, directly or through others.  What compiled code takes from another file must
therefore come from a file of kernels, one that uses `compiled` or stands in a room named `kernels`, `jit` or
`linalg` (`tests/test_compiled.py` holds it).
"""

from __future__ import annotations

import ast
import hashlib
from collections.abc import Iterator
from functools import cache
from importlib.machinery import ModuleSpec
from importlib.util import find_spec

ROOMS = ("kernels", "jit", "linalg")
_PACKAGES = ("ribbonfem", "der")


@cache
def digest(module: str) -> str:
    """Of a module's source and of all files of kernels that it stands on."""
    result = hashlib.sha256()
    for name in sorted(stands_on(module)):
        result.update(name.encode())
        result.update(_source(name))
    return result.hexdigest()


def stands_on(module: str) -> frozenset[str]:
    """The module and the modules of kernels that it imports, directly or through others."""
    result: set[str] = set()
    rest = [module]
    while rest:
        name = rest.pop()
        if name not in result:
            result.add(name)
            rest += [other for other in _imports(name) if is_kernels(other)]
    return frozenset(result)


def is_kernels(module: str) -> bool:
    """Whether a module of the package holds compiled code, or what such code is made of."""
    if module.split(".")[0] not in _PACKAGES:
        return False
    return any(room in module.split(".") for room in ROOMS) or b"@compiled" in _source(module)


@cache
def _spec(module: str) -> ModuleSpec | None:
    try:
        spec = find_spec(module)
    except ModuleNotFoundError:
        # a name inside of a module
        return None
    return None if spec is None or spec.origin is None else spec


def _source(module: str) -> bytes:
    spec = _spec(module)
    try:
        # (of a file, or of a zip)
        return spec.loader.get_data(spec.origin) if spec else b""  # type: ignore[union-attr]
    except (OSError, AttributeError):
        return b""


@cache
def _imports(module: str) -> tuple[str, ...]:
    """Modules of the package that a module's top level imports from."""
    spec = _spec(module)
    if spec is None:
        return ()
    package = module if spec.submodule_search_locations else module.rpartition(".")[0]
    return tuple(name for name in _named(ast.parse(_source(module)).body, package) if _spec(name))


def _named(body: list[ast.stmt], package: str) -> Iterator[str]:
    for statement in body:
        if isinstance(statement, ast.Import):
            yield from (name.name for name in statement.names if name.name.split(".")[0] in _PACKAGES)
        elif isinstance(statement, ast.ImportFrom):
            parts = package.split(".")
            above = ".".join(parts[: len(parts) - statement.level + 1]) if statement.level else ""
            place = ".".join(part for part in (above, statement.module or "") if part)
            if place.split(".")[0] in _PACKAGES:
                # either the module itself, or modules of a package by name
                yield place
                yield from (f"{place}.{name.name}" for name in statement.names)
