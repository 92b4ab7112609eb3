"""The `Schedule` of a control in time: values at instants, and a smooth or linear curve through them."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .csv_columns import HEADING, columns, headings
from .ribbon import SceneError, SceneWarning, answers_unknown, as_number, shown

Array = NDArray[np.float64]

KINDS = ("smooth", "linear")
# what a value in a file is of the control's own unit
_VALUES = {"rad": 1.0, "deg": math.pi / 180.0, "L": 1.0, "EI2/L^2": 1.0}
_TIMES = {"s": 1.0, "ms": 1e-3, "min": 60.0}
# parts of an interval at which its slope is looked at
_INSIDE = np.linspace(0.0, 1.0, 33)


def _numbers(name: str, values: object) -> tuple[float, ...]:
    if isinstance(values, (str, bytes)) or not isinstance(values, Iterable):
        raise SceneError(f"Schedule.{name} = {shown(values)}: a sequence of numbers is needed")
    try:
        return tuple(as_number(value.item() if isinstance(value, np.generic) else value) for value in values)
    except ValueError as error:
        raise SceneError(f"Schedule.{name} = {shown(values)}: {error}") from None


@answers_unknown
@dataclass(frozen=True)
class Schedule:
    """The control at instants, and between them.

    Parameters
    ----------
    time: (n,) s, from 0 on; may not fall.  The run ends with the last.
    value: (n,) of the control, in its own unit; the first is where the start is.
    kind: "smooth", a piecewise polynomial of degree 5 with two continuous derivatives: slopes as of a
        monotone cubic (F. Fritsch & J. Butland, SIAM J. Sci. Stat. Comput. 5 (1984) 300), second
        derivatives from those, both lessened until every piece is monotone, so that it nowhere
        overshoots its points.  "linear" has kinks, at which steps end; two values at one time are a jump.
    slope: (n,) of a smooth one, where it is known; None to follow from the points.

    A slope at the first point is a jump of speed, as `Scene.rate` is.

    Raises
    ------
    SceneError
        Naming the field, its value and what is allowed.

    Examples
    --------
    >>> round(Schedule((0, 1, 2), (0, 0.2, 0.3))(0.5), 9)
    0.115625
    """

    time: tuple[float, ...]
    value: tuple[float, ...]
    kind: str = "smooth"
    slope: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        for name in ("time", "value"):
            object.__setattr__(self, name, _numbers(name, getattr(self, name)))
        if not isinstance(self.kind, str) or self.kind not in KINDS:
            raise SceneError(f"Schedule.kind = {shown(self.kind)}: must be 'smooth' or 'linear'")
        if len(self.time) < 2 or len(self.value) != len(self.time):
            raise SceneError(
                f"Schedule.value: {len(self.value)} values at {len(self.time)} instants; as many are needed, "
                "and two at least"
            )
        if self.time[0] != 0.0:
            raise SceneError(f"Schedule.time[0] = {self.time[0]!r}: must be 0, where the start is at rest")
        steps = np.diff(self.time)
        if (steps < 0.0).any() or self.time[-1] <= 0.0:
            k = int(np.argmax(steps < 0.0)) + 1
            raise SceneError(f"Schedule.time[{k}] = {self.time[k]!r}: times may not fall, nor all be 0")
        if self.kind == "smooth" and (steps == 0.0).any():
            k = int(np.argmax(steps == 0.0)) + 1
            raise SceneError(
                f"Schedule.time[{k}] = {self.time[k]!r}: two values at one time are a jump, which is of "
                "kind='linear' alone"
            )
        if self.slope is not None:
            object.__setattr__(self, "slope", _numbers("slope", self.slope))
            if self.kind == "linear" or len(self.slope or ()) != len(self.time):
                raise SceneError(
                    f"Schedule.slope: {len(self.slope or ())} slopes for {len(self.time)} instants; as many "
                    "are needed, of kind='smooth'"
                )

    @classmethod
    def ramp(cls, rate: float, stop: float, acceleration: float) -> Schedule:
        """From rest to `stop` at `rate`, speeding up and slowing down smoothly.

        The speed rises as 3 u^2 - 2 u^3 within 1.5 rate / acceleration, so that `acceleration` is the
        largest; where that does not fit before the middle, the largest speed is less than `rate`.

        Raises
        ------
        SceneError
            If one is 0 or no finite number, or `rate` leads away from `stop`.
        """
        numbers = {"rate": rate, "stop": stop, "acceleration": acceleration}
        for name, value in numbers.items():
            try:
                numbers[name] = as_number(value)
            except ValueError as error:
                raise SceneError(f"Schedule.ramp: {name} = {shown(value)}: {error}") from None
            if numbers[name] == 0.0:
                raise SceneError(f"Schedule.ramp: {name} = {value!r}: must not be zero")
        rate, stop, acceleration = numbers.values()
        if (rate > 0.0) != (stop > 0.0):
            raise SceneError(f"Schedule.ramp: stop = {stop!r}: rate = {rate!r} leads away from it")
        # while the speed rises the control goes half as far as at full speed
        rate = math.copysign(min(abs(rate), math.sqrt(abs(stop * acceleration) / 1.5)), rate)
        rise = 1.5 * abs(rate / acceleration)
        even = max(stop / rate - rise, 0.0)
        half = 0.5 * rate * rise
        if even <= 1e-9 * rise:
            return cls((0.0, rise, 2.0 * rise), (0.0, 0.5 * stop, stop), slope=(0.0, rate, 0.0))
        times = (0.0, rise, rise + even, 2.0 * rise + even)
        return cls(times, (0.0, half, stop - half, stop), slope=(0.0, rate, rate, 0.0))

    @classmethod
    def from_csv(
        cls,
        path: str | Path,
        *,
        time: str | int = 0,
        value: str | int = 1,
        units: tuple[str, str] | str = ("s", "rad"),
        kind: str = "smooth",
    ) -> Schedule:
        """A schedule of measured values, time counted from the first row.

        Parameters
        ----------
        path: of a file of columns, separated by commas, semicolons or tabs, with or without a row of names.
        time, value: the columns, by name or number from 0.
        units: of both columns ("s", "ms", "min"; "rad", "deg", "L", "EI2/L^2"), or of the values alone. A
            `SceneWarning` tells where the name of a column ends with another, as "alpha (deg)".

        Raises
        ------
        SceneError
            If a column or a unit is not there, or a cell holds no number.
        OSError
            If the file cannot be read.
        """
        pair = units if isinstance(units, (tuple, list)) and len(units) == 2 else ("s", units)
        for unit, known in zip(pair, (_TIMES, _VALUES), strict=True):
            if not isinstance(unit, str) or unit not in known:
                raise SceneError(
                    f"Schedule.from_csv: units = {shown(units)}: {shown(unit)} is none of {', '.join(known)}"
                )
        rows = columns(path, (time, value), "Schedule.from_csv")
        heads = headings(path, "Schedule.from_csv")
        for column, unit, known in zip((time, value), pair, (_TIMES, _VALUES), strict=True):
            head = heads[column] if heads and isinstance(column, int) else str(column)
            other = HEADING.fullmatch(head)[2]  # type: ignore[index]
            if other in known and known[other] != known[str(unit)]:
                warnings.warn(
                    f"Schedule.from_csv: {path}: {head!r} is read in {unit}. If it is in {other}, say so: "
                    f"units = {tuple(other if each == unit else each for each in pair)}",
                    SceneWarning,
                    stacklevel=2,
                )
        seconds = rows[:, 0] * _TIMES[str(pair[0])]
        return cls(tuple(seconds - seconds[0]), tuple(rows[:, 1] * _VALUES[str(pair[1])]), kind)

    @cached_property
    def pieces(self) -> Array:
        """Coefficients (n - 1, 6) of each interval, in powers of the time since its first instant."""
        x, y = np.array(self.time), np.array(self.value)
        length, rise = np.diff(x), np.diff(y)
        if self.kind == "linear" or (len(x) == 2 and self.slope is None):
            result = np.zeros((len(length), 6))
            result[:, 0] = y[:-1]
            np.divide(rise, length, out=result[:, 1], where=length > 0.0)
            return result
        chord = rise / length
        if self.slope is not None:
            return _quintic(length, y, np.array(self.slope), np.zeros(len(x)))
        slope = _monotone_slopes(length, chord)
        bend = _second_derivatives(length, chord, slope)
        for _ in range(60):
            pieces = _quintic(length, y, slope, bend)
            wrong = ~_monotone(pieces, length, rise)
            if not wrong.any():
                break
            points = np.zeros(len(x), dtype=bool)
            points[:-1] |= wrong
            points[1:] |= wrong
            bend[points] *= 0.5
            slope[points] *= 0.95
        return pieces

    @property
    def kinks(self) -> tuple[float, ...]:
        """Instants (s) inside at which the slope or the value jumps."""
        if self.kind == "smooth":
            return ()
        slopes = np.where(np.diff(self.time) > 0.0, self.pieces[:, 1], np.inf)
        bent = np.flatnonzero(slopes[1:] != slopes[:-1]) + 1
        return tuple(sorted({self.time[k] for k in bent} - {0.0, self.time[-1]}))

    @property
    def jumps(self) -> bool:
        """Whether two values stand at one time."""
        return bool((np.diff(self.time) == 0.0).any())

    @cached_property
    def _levels(self) -> tuple[float, ...]:
        """Values at the points and, of given slopes, where the curve turns back beyond them, in order."""
        if self.slope is None:
            return self.value
        levels = [self.value[0]]
        for piece, length, last in zip(self.pieces, np.diff(self.time), self.value[1:], strict=True):
            low, high = sorted((levels[-1], last))
            rounding = 1e-9 * float(np.abs(piece * length ** np.arange(6.0)).max())
            roots = np.roots(np.polyder(piece[::-1]))
            at = np.sort(roots[(roots.imag == 0.0) & (roots.real > 0.0) & (roots.real < length)].real)
            turns = np.polyval(piece[::-1], at)
            levels += turns[(turns < low - rounding) | (turns > high + rounding)].tolist()
            levels.append(last)
        return tuple(levels)

    @property
    def extremes(self) -> tuple[float, float]:
        """The smallest and the largest value."""
        return min(self._levels), max(self._levels)

    @property
    def direction(self) -> float:
        """The sign of the first change; 1 where there is none."""
        changes = [b - self.value[0] for b in self._levels if b != self.value[0]]
        return math.copysign(1.0, changes[0]) if changes else 1.0

    @property
    def furthest(self) -> float:
        """The extreme value in the direction of the first change."""
        return self.extremes[1] if self.direction > 0.0 else self.extremes[0]

    @property
    def mirror(self) -> Schedule:
        """The schedule with all values of the other sign."""
        slope = None if self.slope is None else tuple(-x for x in self.slope)
        return replace(self, value=tuple(-x for x in self.value), slope=slope)

    @property
    def monotone(self) -> bool:
        """Whether the control never turns back."""
        steps = np.diff(self._levels)
        return bool((steps >= 0.0).all() or (steps <= 0.0).all())

    def __call__(self, time: Any) -> Any:
        """The value at an instant (s), or at many; of two at one time the later one."""
        at = np.clip(np.asarray(time, dtype=float), 0.0, self.time[-1])
        k = np.clip(np.searchsorted(self.time, at, side="right") - 1, 0, len(self.pieces) - 1)
        since = at - np.array(self.time)[k]
        total = np.zeros_like(since)
        for c in range(5, -1, -1):
            total = total * since + self.pieces[k, c]
        total = np.where(at == self.time[-1], self.value[-1], total)
        return float(total) if np.ndim(time) == 0 else total


def _monotone_slopes(length: Array, chord: Array) -> Array:
    """Slopes (n,) at the points: weighted harmonic means of the chords, 0 at extremes."""
    slope = np.zeros(len(length) + 1)
    if len(chord) == 1:
        slope[:] = chord[0]
        return slope
    same = chord[1:] * chord[:-1] > 0.0
    left, right = 2.0 * length[1:] + length[:-1], length[1:] + 2.0 * length[:-1]
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = (left + right) / (left / chord[:-1] + right / chord[1:])
    slope[1:-1] = np.where(same, mean, 0.0)
    for end, near, at in ((0, 1, 0), (-1, -2, -1)):
        # of the parabola through three points, kept to the chord's sign
        h, g = length[end], length[near]
        guess = ((2.0 * h + g) * chord[end] - h * chord[near]) / (h + g)
        if guess * chord[end] <= 0.0:
            guess = 0.0
        slope[at] = math.copysign(min(abs(guess), 2.0 * abs(chord[end])), chord[end])
    return slope


def _second_derivatives(length: Array, chord: Array, slope: Array) -> Array:
    """Second derivatives (n,): means of those of the cubics on either side."""
    first = (6.0 * chord - 4.0 * slope[:-1] - 2.0 * slope[1:]) / length
    last = (-6.0 * chord + 2.0 * slope[:-1] + 4.0 * slope[1:]) / length
    bend = np.concatenate((first[:1], np.zeros(len(length) - 1), last[-1:]))
    share = length[:-1] / (length[:-1] + length[1:])
    bend[1:-1] = (1.0 - share) * last[:-1] + share * first[1:]
    return bend


def _quintic(length: Array, y: Array, slope: Array, bend: Array) -> Array:
    """Coefficients (n - 1, 6) of the polynomials with these values and derivatives at their ends."""
    h, rise = length, np.diff(y)
    result = np.zeros((len(h), 6))
    result[:, 0], result[:, 1], result[:, 2] = y[:-1], slope[:-1], 0.5 * bend[:-1]
    rest = rise - h * slope[:-1] - 0.5 * h**2 * bend[:-1]
    tilt = h * (slope[1:] - slope[:-1] - h * bend[:-1])
    turn = h**2 * (bend[1:] - bend[:-1])
    result[:, 3] = (10.0 * rest - 4.0 * tilt + 0.5 * turn) / h**3
    result[:, 4] = (-15.0 * rest + 7.0 * tilt - turn) / h**4
    result[:, 5] = (6.0 * rest - 3.0 * tilt + 0.5 * turn) / h**5
    return result


def _monotone(pieces: Array, length: Array, rise: Array) -> NDArray[np.bool_]:
    """Which pieces go from their first value to their last without turning back."""
    at = _INSIDE * length[:, None]
    slope = sum(
        (c * pieces[:, c, None] * at ** (c - 1) for c in range(2, 6)), np.tile(pieces[:, 1:2], _INSIDE.size)
    )
    scale = (np.abs(rise) / length + np.abs(pieces[:, 1]))[:, None]
    forward = np.where(rise[:, None] == 0.0, -np.abs(slope), slope * np.sign(rise)[:, None])
    return np.asarray((forward >= -1e-9 * scale - 1e-15).all(axis=1))
