"""Arrays of output rows that grow in blocks while a motion runs."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from .options import MOST_STEPS, half_of_memory
from .results import Array

# rows that are moved at a time
_BLOCK = 1024
# steps times nodes that compiled code goes on for at the most: an interrupt is seen between its calls, within
# a second
_AT_ONCE = 100_000


def some_steps(rows: Array, nodes: int) -> Array:
    """Of the room for rows what one call of compiled code may fill: it sees no interrupt meanwhile."""
    return rows[: max(_AT_ONCE // nodes, 8)]


class RowBuffer:
    """Arrays with one row an instant, and the same number of rows in all.

    They are reallocated as they grow, which moves pages and copies nothing where the system can,
    and never hold more than a tenth, or a chunk, beyond what was written.

    Parameters
    ----------
    shapes: of one row of each array.
    chunk: bytes by which they grow at least.

    Attributes
    ----------
    count: rows that were written.
    """

    def __init__(self, *shapes: tuple[int, ...], chunk: int = 4_000_000) -> None:
        self._arrays = [np.empty((0, *shape)) for shape in shapes]
        self._row = 8 * sum(math.prod(shape) for shape in shapes)
        self._chunk = chunk
        self.count = 0

    @property
    def full(self) -> str:
        """Why no more rows may be written, a sentence; empty if they may."""
        needed, most = 1.1 * self.count * self._row, half_of_memory()
        if needed > most:
            return f"its {self.count} rows of {self._row} bytes fill half of the memory"
        return f"it has taken {self.count} steps" if self.count > MOST_STEPS else ""

    def reserve(self) -> list[Array]:
        """Room behind the rows that were written: views, one of each array, that the next call ends."""
        more = max(self._chunk // max(self._row, 1), self.count // 10, 64)
        self._resize(self.count + more)
        return [array[self.count :] for array in self._arrays]

    def append(self, *rows: Array) -> None:
        """Write rows, as many to each array."""
        count = self.count + len(rows[0])
        self.make_room(len(rows[0]))
        for array, new in zip(self._arrays, rows, strict=True):
            array[self.count : count] = new
        self.count = count

    def make_room(self, rows: int) -> None:
        """Room for so many rows behind those that were written."""
        count = self.count + rows
        if count > len(self._arrays[0]):
            # (what is reallocated is cleared: a short motion is not to wait for a whole chunk)
            self._resize(count + max(min(self._chunk // max(self._row, 1), count), count // 10))

    def written(self, which: int = 0, beyond: int = 0) -> Array:
        """A view of the rows written to an array, with so many behind them, that `reserve` ends."""
        return self._arrays[which][: self.count + beyond]

    def keep(self, stays: NDArray[np.bool_]) -> None:
        """Leave out the rows that do not stay, in place."""
        for array in self._arrays:
            count = 0
            for a in range(0, len(stays), _BLOCK):
                some = stays[a : a + _BLOCK]
                part = array[a : a + len(some)][some]
                array[count : count + len(part)] = part
                count += len(part)
        self.count = int(np.count_nonzero(stays))

    def taken(self) -> list[Array]:
        """The rows, without what was reserved behind them."""
        self._resize(self.count)
        return self._arrays

    def _resize(self, rows: int) -> None:
        for array in self._arrays:
            # no view of it is used any more: see `reserve`
            array.resize((rows, *array.shape[1:]), refcheck=False)
