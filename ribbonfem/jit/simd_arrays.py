"""SIMD numbers where numba is switched off: the same operations on numpy arrays of four."""

from __future__ import annotations

from typing import Any

import numpy as np

from ribbonfem.results import Array

WIDTH = 4


class Lanes:
    """Four floats; a new one comes of every operation, as with numbers (`+=` on arrays changes them)."""

    # (so that a number of numpy leaves products with one to `__rmul__`)
    __array_ufunc__ = None

    def __init__(self, places: Array) -> None:
        self.places = places

    def __add__(self, other: Lanes | float) -> Lanes:
        return Lanes(self.places + _places(other))

    def __sub__(self, other: Lanes | float) -> Lanes:
        return Lanes(self.places - _places(other))

    def __mul__(self, other: Lanes | float) -> Lanes:
        return Lanes(self.places * _places(other))

    def __truediv__(self, other: Lanes | float) -> Lanes:
        return Lanes(self.places / _places(other))

    __radd__, __rmul__ = __add__, __mul__

    def __rsub__(self, other: float) -> Lanes:
        return Lanes(other - self.places)

    def __rtruediv__(self, other: float) -> Lanes:
        return Lanes(other / self.places)

    def __neg__(self) -> Lanes:
        return Lanes(-self.places)


def _places(value: Lanes | float) -> Any:
    return value.places if isinstance(value, Lanes) else value


def load(array: Array, indices: tuple[int, ...]) -> Lanes:
    """The four of array[*indices, :], which is contiguous."""
    return Lanes(array[indices].copy())


def store(array: Array, indices: tuple[int, ...], value: Lanes) -> None:
    """array[*indices, :] = value."""
    array[indices] = value.places


def load_from(array: Array, indices: tuple[int, ...]) -> Lanes:
    """The four of array[*indices[:-1], :] from place indices[-1] on: in steps of one, not of four."""
    *entry, first = indices
    return Lanes(array[tuple(entry)][first : first + WIDTH].copy())


def store_from(array: Array, indices: tuple[int, ...], value: Lanes) -> None:
    """array[*indices[:-1], indices[-1] : indices[-1] + 4] = value."""
    *entry, first = indices
    array[tuple(entry)][first : first + WIDTH] = value.places


def spread(value: float) -> Lanes:
    """Four times the same number."""
    return Lanes(np.full(WIDTH, value))


def transposed(a: Lanes, b: Lanes, c: Lanes, d: Lanes) -> tuple[Lanes, ...]:
    """The first of each, the second of each, and so on: rows of four numbers become one value a column."""
    return tuple(Lanes(column) for column in np.stack([four.places for four in (a, b, c, d)], axis=1))


def all_below(value: Lanes, bound: float) -> bool:
    """Whether each of the four is below a number; NaN is not."""
    return bool(np.all(value.places < bound))


def lane(value: Lanes, place: int) -> float:
    """One of the four."""
    return float(value.places[place])


def larger(a: Lanes, b: Lanes) -> Lanes:
    """The larger one, place by place; a where one is NaN."""
    return Lanes(np.where(b.places > a.places, b.places, a.places))


def root(value: Lanes) -> Lanes:
    """The square root of each."""
    return Lanes(np.sqrt(value.places))


def nearest(value: Lanes) -> Lanes:
    """The whole number nearest to each."""
    return Lanes(np.rint(value.places))
