"""Root finding inside a step of a curve: where a test function of its points changes sign."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic

import numpy as np

from .corrector import NotConverged, Point, Problem, State, Steps, correct

# values below this part of those at the ends may be rounding
_ROUNDING = 1e-7
# the most that the value at a root may be over the larger one at the ends, or over `within` / (high - low)
_SMOOTH, _STEEP = 1e-3, 10.0
# how often, and by how much of what is left, a place is left where nothing converges
_ASIDE, _SHARE = 12, 0.03


def root(
    value: Callable[[float], float], low: float, high: float, within: float, guess: float | None = None
) -> float:
    """A root of a function between two places where it has different signs, to `within`.

    By inverse quadratic interpolation of the last three values, and by halving where that leads out
    of the bracket or does not shorten it (R. P. Brent, 1973, chapter 4).  Where the values are
    rounding, or where none is found beside the root, the least of them counts.  (At a branch point itself
    none is found: places to its sides close in on it.)

    Raises
    ------
    ValueError
        If the signs are the same.
    NotConverged
        From `value`, far from the root; and where the values do not become small, but jump: their points
        lie on two curves.
    """
    ends = {low: value(low), high: value(high)}
    for place, there in ends.items():
        if there == 0.0:
            return place
    if ends[low] * ends[high] > 0.0:
        raise ValueError(f"no root: {ends[low]:.3g} at {low:.6g}, {ends[high]:.3g} at {high:.6g}")
    most = max(map(abs, ends.values()))
    small, large = _ROUNDING * most, max(_SMOOTH, _STEEP * within / (high - low)) * most
    last = [(low, ends[low]), (high, ends[high])]
    following = _interpolated(last) if guess is None else guess
    least, best = np.inf, low
    lengths, aside = [high - low], 0
    while True:
        # not at an end: where the root is there the tangent is singular
        place = min(max(following, low + 0.5 * within), high - 0.5 * within)
        try:
            there = value(place)
        except NotConverged:
            if least < small:
                return best
            aside += 1
            if aside > _ASIDE:
                raise
            following = place + _SHARE * ((high if aside % 2 else low) - place)
            continue
        if least < small and abs(there) >= least:
            return best
        if abs(there) < least:
            least, best = abs(there), place
        last = [*last[-2:], (place, there)]
        if there * ends[low] < 0.0:
            high = place
        else:
            low = place
        ends[place] = there
        lengths.append(high - low)
        following = _interpolated(last)
        if there == 0.0 or abs(following - place) < within or high - low <= within:
            if least > large:
                raise NotConverged
            return place
        slow = len(lengths) > 4 and lengths[-1] > 0.5 * lengths[-4]
        if slow or not low < following < high:
            following = 0.5 * (low + high)
            lengths = [high - low]


def _interpolated(points: list[tuple[float, float]]) -> float:
    """Where the polynomial through (value, place) of two or three points has the value 0; NaN if none has."""
    total = 0.0
    for i, (place, there) in enumerate(points):
        share = place
        for j, (_, other) in enumerate(points):
            if i != j:
                share *= other / (other - there) if other != there else np.nan
        total += share
    return total


class Between(Generic[State]):
    """Points of a curve between two, by their arclength from the first; each is found once."""

    def __init__(
        self,
        problem: Problem[State],
        base: Point[State],
        end: Point[State],
        steps: Steps,
        *,
        fresh: bool = True,
    ) -> None:
        self._problem, self._base, self._steps, self._fresh = problem, base, steps, fresh
        self._found = {0.0: base, end.step: end}

    def at(self, step: float) -> Point[State]:
        """The point at an arclength, guessed by the nearest that was found; raises NotConverged."""
        if step not in self._found:
            inner = list(self._found.values())[2:]
            near = min(inner, key=lambda point: abs(point.step - step)) if inner else None
            self._found[step] = correct(
                self._problem, self._base, step, self._steps, fresh=self._fresh, near=near
            )
        return self._found[step]
