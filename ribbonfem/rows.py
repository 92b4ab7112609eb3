"""Which rows of a motion are kept (`every`, thinning), and the track of all steps for its events."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .frozen import Frozen, freeze
from .options import MOST_STEPS
from .results import Array, History, RestState
from .row_buffer import RowBuffer

# bytes of rows beyond which they are thinned where nobody said which to keep, and the part that is left then
MOST, LEFT = 160_000_000, 0.6
# rows that are kept however long they are
LEAST = 1000
# bytes by which they grow at least
CHUNK = 4_000_000
# L; a line through the rows that are left passes the others within this, if `MOST` allows
WITHIN = 1e-3
# steps whose track is kept whole
MOST_TRACKED = 2**20
# rows on either side of an event that stay
_BESIDE = 3
# events that are kept with their neighbours in a longer track
_MOST_EVENTS = 2**15
# rows that are compared at a time: what is compared stays in the cache
_BLOCK = 256


class Columns(NamedTuple):
    """Where rows have what is kept of every step; `kept` says whether a row is one of those asked for.

    Behind the kinetic energy are the elastic, the potential and the dissipated one, and the work.
    """

    time: int
    angle: int
    height: int
    slope: int
    velocity: int
    kinetic: int
    kept: int


def reactions_in(rows: Array, first: int, initial: RestState | History | None) -> Array:
    """A view (rows, 2, 6) of the reactions in rows, from a column on.

    The first row is that of what a motion began with: the loop does not know how clamps moved before, or what
    other loads held a state.
    """
    reactions = rows[:, first : first + 12].reshape(-1, 2, 6)
    if initial is not None and len(reactions):
        begun = initial.reactions[-1] if isinstance(initial, History) else initial.reactions
        reactions[0] = np.where(np.isfinite(begun), begun, reactions[0])
    return freeze(reactions)


def shapes_of(configurations: Sequence[Array], second: str, per_second: float) -> Frozen[str, Array]:
    """Configurations of rows, by names: positions, what else, and velocities by their unit.

    NaN as unit: velocities that ring from step to step are those of no motion, and are left out.
    """
    named = dict(zip(("positions", second, "velocities"), configurations, strict=False))
    if math.isnan(per_second):
        named.pop("velocities", None)
    elif "velocities" in named:
        named["velocities"] *= per_second
    frozen: Frozen[str, Array] = freeze(named)
    return frozen


class Rows:
    """The rows of a motion while it runs.

    Parameters
    ----------
    size: columns of a row.
    columns: their places.
    shapes: of the configurations of a row; the first is of positions.
    every: rows are those of each `every`-th step, which the loop has marked; None keeps all until they
        take more than `MOST` bytes, and thins them then.

    Attributes
    ----------
    within: L; a line through the rows passes those that were thinned out within it.
    stats: what is said of the rows, once they are taken.
    kinks: instants, in the loop's unit, at which the control's speed jumps: their rows are kept.  None where
        they are those at which it bends.
    """

    def __init__(self, size: int, columns: Columns, *shapes: tuple[int, ...], every: int | None) -> None:
        self._columns, self._every = columns, every
        self._tracked = list(columns[:5])
        self._rows = RowBuffer((size,), *shapes, chunk=CHUNK)
        self._track = None if every in (None, 1) else RowBuffer((5,), chunk=CHUNK // 10)
        # bounds of what was thinned out between a row and the one before
        self._off = np.zeros(0)
        self._most = max(MOST // (8 * (size + sum(math.prod(shape) for shape in shapes))), LEAST)
        self._taken = 0
        self._shaped = bool(shapes)
        self._kinetic = 0.0
        self.within = 0.0
        self.kinks: Array | None = None
        self.stats: dict[str, float] = {}

    @property
    def full(self) -> str:
        """Why no more rows may be written, a sentence; empty if they may."""
        return self._rows.full or (f"it has taken {self._taken} steps" if self._taken > MOST_STEPS else "")

    def reserve(self) -> list[Array]:
        """Room for the next rows: views, one of each array, that the next call ends."""
        return self._rows.reserve()

    def wrote(self, count: int) -> None:
        """Take over the rows written to what was reserved, with the configurations of those kept alone."""
        new = self._rows.written(beyond=count)[self._rows.count :]
        self._taken += count
        if count:
            self._kinetic = max(self._kinetic, float(new[:, self._columns.kinetic].max()))
        if self._track is not None:
            self._track.append(new[:, self._tracked])
            if self._track.count > MOST_TRACKED:
                self._thin_track(self._track)
        if self._every not in (None, 1):
            kept = new[new[:, self._columns.kept] > 0.0]
            new[: len(kept)] = kept
            count = len(kept)
        self._rows.count += count
        if self._every is None and self._rows.count > self._most:
            self._thin()

    def append(self, rows: Array, *configurations: Array) -> None:
        """The same of rows that are elsewhere, with configurations of all."""
        count = len(rows)
        self._rows.make_room(count)
        kept = rows[:, self._columns.kept] > 0.0 if self._every not in (None, 1) else slice(None)
        self._rows.written(beyond=count)[self._rows.count :] = rows
        for k, new in enumerate(configurations, 1):
            some = new[kept]
            self._rows.written(k, len(some))[self._rows.count :] = some
        self.wrote(count)

    def taken(self, units: dict[int, float], began: float = 0.0) -> tuple[list[Array], Array | None]:
        """The rows, and (5, steps) the track where they are not of all steps; by the units of columns.

        `began` is the instant, in the loop's unit, from which time counts.
        """
        rows = self._rows.taken()
        rows[0][:, self._columns.time] -= began
        by = np.ones(rows[0].shape[1])
        by[list(units)] = list(units.values())
        rows[0] *= by
        if self._taken:
            first = self._columns.kinetic
            energies = rows[0][[0, -1], first : first + 5] @ (1.0, 1.0, 1.0, 1.0, -1.0)
            lost, most = float(energies[0] - energies[1]), self._kinetic * units.get(first, 1.0)
            self.stats["numerical_dissipation"] = lost
            self.stats["numerical_dissipation_share"] = lost / most if most > 0.0 else 0.0
        if self._every is None or self._every == 1:
            self.stats["rows_within"] = self.within
        if self._track is None:
            return rows, None
        track = self._track.taken()[0].T.copy()
        track[0] -= began
        for values, column in zip(track, self._tracked, strict=True):
            values *= units.get(column, 1.0)
        return rows, track

    def _thin(self) -> None:
        """Leave out every second row where the line through its neighbours is close, until enough are out."""
        if self._track is None:
            self._track = RowBuffer((5,), chunk=CHUNK // 10)
            self._track.append(self._rows.written()[:, self._tracked])
        off = np.zeros(self._rows.count)
        off[: len(self._off)] = self._off
        allowed = max(WITHIN, self.within)
        while len(off) > LEFT * self._most:
            bound = self._distances() + np.maximum(off[1:-1:2], off[2::2])
            out = np.flatnonzero(bound <= allowed)
            off[2 * out + 2] = bound[out]
            stays = np.ones(len(off), dtype=bool)
            stays[2 * out + 1] = False
            self._rows.keep(stays)
            off = off[stays]
            if len(out) < 0.1 * len(stays):
                allowed *= 2.0
        self._off = off
        self.within = max(self.within, float(off.max()))

    def _distances(self) -> Array:
        """L, of every second row but the last from the line through those on either side of it."""
        rows = self._rows.written()
        time, angle = rows[:, self._columns.time], rows[:, self._columns.angle]
        share = (time[1:-1:2] - time[:-2:2]) / (time[2::2] - time[:-2:2])
        height = self._columns.height
        shapes = (
            self._rows.written(1).reshape(len(rows), -1) if self._shaped else rows[:, height : height + 1]
        )
        result = np.empty(len(share))
        for a in range(0, len(share), _BLOCK):
            b = min(a + _BLOCK, len(share))
            part = shapes[2 * a : 2 * b + 1]
            left, middle, right = part[:-2:2], part[1:-1:2], part[2::2]
            off = right - left
            off *= share[a:b, None]
            off += left
            off -= middle
            off *= off
            if self._shaped:
                off = off[:, 0::3] + off[:, 1::3] + off[:, 2::3]
            result[a:b] = np.sqrt(off.max(axis=1))
        # the instant at which the clamp stops is kept
        bent = np.abs(angle[1:-1:2] - angle[:-2:2] - share * (angle[2::2] - angle[:-2:2]))
        if self.kinks is None:
            result[bent > 1e-9] = np.inf
            return result
        np.maximum(result, bent, out=result)
        result[np.isin(time[1:-1:2], self.kinks)] = np.inf
        return result

    def _thin_track(self, track: RowBuffer) -> None:
        """Leave out every second step of a track that is away from what happens in it."""
        time, angle, height, slope, _ = track.written().T
        happens = np.zeros(len(angle), dtype=bool)
        for values in (height, slope):
            happens[1:] |= (values[1:] > 0.0) != (values[:-1] > 0.0)
        happens[1:-1] |= (height[1:-1] < height[:-2]) & (height[1:-1] <= height[2:])
        happens[1:-1] |= (angle[2:] == angle[1:-1]) & (angle[1:-1] != angle[:-2])
        if self.kinks is not None:
            happens |= np.isin(time, self.kinks)
        stays = np.arange(len(angle)) % 2 == 0
        for row in np.flatnonzero(happens)[:_MOST_EVENTS]:
            stays[max(row - _BESIDE, 0) : row + _BESIDE + 1] = True
        stays[: 2 * _BESIDE] = stays[-2 * _BESIDE :] = True
        track.keep(stays)
