"""Base class of results, read-only and compared by content, with helpers for printing and HTML tables."""

from __future__ import annotations

import html
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields
from importlib import import_module
from typing import Any, NoReturn, TypeVar

import numpy as np

K = TypeVar("K")
V = TypeVar("V")


class Frozen(dict[K, V]):
    """A mapping that keeps what it was made with: a value, as the arrays and numbers in it are."""

    def _refuse(self, *_: Any, **__: Any) -> NoReturn:
        raise TypeError("the mappings of a result are read-only: copy it, dict(...), to change it")

    __setitem__ = __delitem__ = __ior__ = _refuse
    clear = pop = popitem = setdefault = update = _refuse

    def __reduce__(self) -> tuple[Any, ...]:
        return Frozen, (dict(self),)

    def __hash__(self) -> int:  # type: ignore[override]
        return hash(frozenset((name, _key(value)) for name, value in self.items()))


# types of which a value is read-only all through: a mapping that `freeze` or `_frozen` made is
_READ_ONLY = (float, int, str, bool, Frozen)


def _unwritten(array: Any) -> Any:
    """An array that nobody can write to: itself, if that holds all through its memory, or a copy."""
    owner = array
    while isinstance(owner, np.ndarray):
        if owner.flags.writeable:
            array = array.copy()
            array.flags.writeable = False
            break
        owner = owner.base
    return array


def freeze(value: Any) -> Any:
    """Arrays, mappings and sequences of them, that their maker keeps no hold of: read-only in place."""
    if isinstance(value, np.ndarray):
        owner: Any = value
        while isinstance(owner, np.ndarray):
            owner.flags.writeable = False
            owner = owner.base
    elif type(value) is dict or isinstance(value, Mapping):
        return Frozen({name: freeze(item) for name, item in value.items()})
    elif type(value) in (list, tuple):
        return tuple(freeze(item) for item in value)
    return value


def _frozen(value: Any) -> Any:
    """A field of a result, read-only: arrays, and mappings and sequences of them all through."""
    kind = type(value)
    if value is None or kind in _READ_ONLY:
        # (to ask whether it is a mapping takes longer)
        return value
    if kind is np.ndarray or isinstance(value, np.ndarray):
        return _unwritten(value)
    if kind is dict or isinstance(value, Mapping):
        return Frozen({name: _frozen(item) for name, item in value.items()})
    if type(value) in (list, tuple):
        return tuple(_frozen(item) for item in value)
    return value


def _same(a: Any, b: Any) -> bool:
    """Whether two fields have the same content; what is not a number is the same as itself."""
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        if not (isinstance(a, np.ndarray) and isinstance(b, np.ndarray)) or a.shape != b.shape:
            return False
        return bool(np.array_equal(a, b, equal_nan=a.dtype.kind == b.dtype.kind == "f"))
    if isinstance(a, Mapping) and isinstance(b, Mapping):
        return a.keys() == b.keys() and all(_same(a[name], b[name]) for name in a)
    if isinstance(a, tuple) and isinstance(b, tuple):
        return len(a) == len(b) and all(map(_same, a, b))
    return bool(a == b) or (a != a and b != b)


def _key(value: Any) -> Any:
    """Something to hash that is the same for fields of the same content."""
    if isinstance(value, np.ndarray):
        # the ends tell results apart well enough, and a hash need not read hundreds of megabytes
        ends = np.concatenate((value.ravel()[:16], value.ravel()[-16:])).tolist()
        return value.shape, tuple(_key(item) for item in ends)
    if isinstance(value, Mapping):
        return frozenset((name, _key(item)) for name, item in value.items())
    if isinstance(value, (tuple, list)):
        return tuple(_key(item) for item in value)
    return "nan" if value != value else value


class Value:
    """What the frozen results have in common: equal and hashed by content, and read-only throughout.

    For dataclasses made with ``frozen=True, eq=False``.  The time that a computation took, `seconds` or
    ``stats["seconds"]``, is not its content; nor is `resume`, what a stepper holds at the end.
    """

    def __post_init__(self) -> None:
        own = vars(self)
        for name, value in own.items():
            own[name] = _frozen(value)

    def __setstate__(self, state: dict[str, Any]) -> None:
        # from a pickle: nobody else holds these arrays
        for name, value in state.items():
            object.__setattr__(self, name, _frozen(freeze(value)))

    @property
    def policy(self) -> Any:
        """The name that `options` had."""
        return getattr(self, "options")  # noqa: B009 (of those that have options)

    def _content(self) -> dict[str, Any]:
        content = {item.name: getattr(self, item.name) for item in fields(self)}  # type: ignore[arg-type]
        content.pop("seconds", None)
        content.pop("resume", None)
        if isinstance(content.get("stats"), Mapping):
            content["stats"] = {name: v for name, v in content["stats"].items() if name != "seconds"}
        return content

    def __eq__(self, other: object) -> bool:
        if other.__class__ is not self.__class__:
            return NotImplemented
        return self is other or _same(self._content(), other._content())

    def __hash__(self) -> int:
        return hash((self.__class__.__name__, _key(self._content())))


def called_later(place: str, *args: Any, **kwargs: Any) -> Any:
    """Call a function, ``module:name``, that is imported only now: what draws a result knows the result."""
    module, _, name = place.partition(":")
    return getattr(import_module(module), name)(*args, **kwargs)


def html_table(caption: str, columns: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    """A table for a notebook."""

    def cells(tag: str, values: Iterable[Any]) -> str:
        texts = (f"{v:.6g}" if isinstance(v, float) else str(v) for v in values)
        return "".join(f"<{tag}>{html.escape(text)}</{tag}>" for text in texts)

    body = "".join(f"<tr>{cells('td', row)}</tr>" for row in rows)
    return (
        f"<table><caption>{html.escape(caption)}</caption><thead><tr>{cells('th', columns)}</tr></thead>"
        f"<tbody>{body}</tbody></table>"
    )


def some_rows(count: int, most: int = 12) -> list[int]:
    """Numbers of rows that show a table of `count` of them."""
    return sorted({round(k) for k in np.linspace(0, count - 1, min(count, most))}) if count else []


def short_options(options: Mapping[str, Any]) -> str:
    """Options on one line: what was given, and not what is None."""
    return ", ".join(f"{name}={value!r}" for name, value in options.items() if value is not None)
