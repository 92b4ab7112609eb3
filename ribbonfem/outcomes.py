"""Outcomes of a run: which snaps happened, which shape was skipped, and what shapes are called.

The first snap of Path 2 (U+S+ to U+S-) is the instant at which the mid tangent turns through
horizontal, t_z = 0; the second (to U-S+) the one at which the midpoint passes z = 0.  A ramp that meets one
fold has one snap, z = 0.

The paper calls a run "type 1 skipping" if the first local minimum of z(alpha) comes before
alpha_c2, and "type 2" otherwise (section 7.1).  An overdamped z falls without a minimum, and a
run may be on its way between two shapes just at alpha_c2, so that the rule used here asks for
what the types mean instead:

* type 1: z passes 0 before alpha_c2, where U+S- still exists: energy carried it over;
* no skip: z does not, and the ribbon has stayed at U+S-: it came back up from a local minimum
  with z > 0, or at alpha_c2 it was close to the fold state of U+S- and slow;
* type 2: neither: the snap came so late that U+S- was gone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ribbonfem.events import between
from ribbonfem.results import MESH, Array, Fold, History, Value
from ribbonfem.scene import Scene, shown, swapped

# a height (L) this close to the fold state's counts as being there ...
_NEAR = 0.06
# ... at a speed below this share of the fastest of the run
_SLOW = 0.1
# elements from which on a fold is that of any finer mesh to 1e-3 rad (small slopes), or 1e-6 (ribbons)
_SETTLED = 8


def name_shape(positions: Array, compression: float, *, flat: float = 1e-6) -> str:
    """The name of a configuration: signs of z(1/2) and of x(1/2) - (L - dL)/2.

    Parameters
    ----------
    positions: (N, 3) in L, nodes at equal arclength, symmetric about midspan.
    compression: dL/L.
    flat: what counts as zero, in L; a vanishing sign leaves its letter out.
    """
    half = len(positions) // 2
    middle = positions[half] if len(positions) % 2 else positions[half - 1 : half + 1].mean(axis=0)
    slip = float(middle[0]) - 0.5 * (1.0 - compression)
    u = "" if abs(middle[2]) <= flat else "U+" if middle[2] > 0 else "U-"
    s = "" if abs(slip) <= flat else "S+" if slip > 0 else "S-"
    return u + s


def name_by_signs(height: float, slope: float) -> str:
    """The name of a US shape by z(1/2) and t_z(1/2): on U+ S+ leans down, S- up; on U- the other way.

    Examples
    --------
    >>> name_by_signs(0.2, -0.5), name_by_signs(-0.2, 0.5)
    ('U+S+', 'U-S+')
    """
    return ("U+" if height > 0.0 else "U-") + ("S-" if height * slope > 0.0 else "S+")


@dataclass(frozen=True, repr=False, eq=False)
class Outcome(Value):
    """What a ramp from U+S+ did.

    Attributes
    ----------
    kind: "no skip", "type 1", "type 2"; "first only" if the second snap never came; "none".
    first, second: (time in s, angle in rad) of the two snaps, or None.
    minima: (k, 3) time, angle and height of the local minima of z after the first snap.
    final: name of the last shape.
    reason: the rule that applied, in words.
    """

    kind: str
    first: tuple[float, float] | None
    second: tuple[float, float] | None
    minima: Array
    final: str
    reason: str

    def __repr__(self) -> str:
        first, second = (
            "none" if snap is None else f"{snap[1]:.6g} rad" for snap in (self.first, self.second)
        )
        return (
            f"Outcome({self.kind!r}: {self.reason};\n"
            f"  first snap {first}, second {second}, {len(self.minima)} minima, ends as {self.final})"
        )


def local_minima(time: Array, angle: Array, height: Array) -> Array:
    """Local minima of a height, (k, 3): time, angle, height, each from the parabola through three rows."""
    k = np.flatnonzero((height[1:-1] < height[:-2]) & (height[1:-1] <= height[2:])) + 1
    left, right = time[k] - time[k - 1], time[k + 1] - time[k]
    down, up = (height[k] - height[k - 1]) / left, (height[k + 1] - height[k]) / right
    curvature = (up - down) / (left + right)
    slope = (down * right + up * left) / (left + right)
    shift = -slope / (2.0 * curvature)
    where = time[k] + shift
    return np.column_stack((where, np.interp(where, time, angle), height[k] + slope * shift / 2.0))


def _rebounds(history: History, first: tuple[float, float] | None) -> Array:
    """The local minima of z after the first snap: those before it are the ringing of the clamp's jump."""
    minima = local_minima(*history.track[:3])
    return minima[minima[:, 0] > (first[0] if first else np.inf)]


@dataclass(frozen=True)
class Instant:
    """A moment of a run: time (s), angle (rad), height z(1/2)/L, slope t_z(1/2), and the shape's name."""

    time: float
    angle: float
    height: float
    slope: float
    name: str


def instant(history: History, time: float) -> Instant:
    """The shape of a run at a time in s, interpolated through its steps (`events.between`)."""
    times, angles, heights, slopes, velocities = history.track
    k = min(max(1, int(np.searchsorted(times, time))), len(times) - 1)
    if k == 0:
        height, slope = float(heights[0]), float(slopes[0])
    else:
        height = between(times, heights, k, velocities, history.kinks(times, angles))(time)
        slope = between(times, slopes, k)(time)
    angle = float(np.interp(time, times, angles))
    return Instant(time, angle, height, slope, name_by_signs(height, slope))


def _two_snaps(scene: Scene, folds: tuple[Fold, ...]) -> bool:
    """Whether the ramp is Path 2, U+S+ to U+S- to U-S+, or its image, and not known to meet one fold only."""
    if len(folds) == 1 and folds[0].scene is not None and folds[0].scene.stop is None:
        return False
    if scene.drive not in ("left", "right"):
        return False
    start = scene.start if scene.drive == "left" else swapped(scene.start)
    return (start, scene.direction > 0.0) in (("U+S+", True), ("U-S+", False))


def events(history: History, folds: tuple[Fold, ...] = ()) -> dict[str, Instant | None]:
    """What happened in a run, each instant solved for and not read off a row.

    Parameters
    ----------
    history: of any model.
    folds: adds the passage of each fold's angle by the clamp.

    Returns
    -------
    dict
        Of a ramp that meets one fold: "snap" (z = 0), "first minimum" (of z, after the snap),
        "alpha_c" and "end".  Of one from U+S+ that meets two (or of its images): "first snap"
        (t_z = 0, before the second), "second snap" (z = 0), "first minimum" (of z, after the first
        snap), "alpha_c1", "alpha_c2" and "end".  In the order in which they came; those that the run did
        not come to are last, and None.

    Raises
    ------
    ValueError
        As `require_folds_of`.
    """
    require_folds_of(history, folds)
    level, height = history.crossing("slope"), history.crossing("height")
    two = _two_snaps(history.scene, folds)
    if two:
        first = None if level is None or (height is not None and height[0] <= level[0]) else level
        snaps = {"first snap": first, "second snap": height}
    else:
        first = height
        snaps = {"snap": height}
    times = {name: None if snap is None else snap[0] for name, snap in snaps.items()}
    minima = _rebounds(history, first)
    times["first minimum"] = float(minima[0, 0]) if len(minima) else None
    for k, fold in enumerate(folds, 1):
        name = f"alpha_c{k}" if two or len(folds) > 1 else "alpha_c"
        times[name] = _passes(history, fold.control)
    times["end"] = float(history.time[-1])
    result = {name: None if time is None else instant(history, time) for name, time in times.items()}
    return dict(sorted(result.items(), key=lambda item: np.inf if item[1] is None else item[1].time))


def _passes(history: History, control: float) -> float | None:
    """When the control first passes a value, s; None if it does not."""
    scene = history.scene
    if scene.schedule is None:
        time = control / scene.rate
        reached = 0.0 <= time <= history.time[-1] and abs(control) <= abs(history.control[-1])
        return time if reached else None
    times, controls = history.track[:2]
    beyond = np.flatnonzero((controls[1:] - control) * (controls[0] - control) <= 0.0)
    if not beyond.size:
        return None
    k = int(beyond[0])
    share = (
        (control - controls[k]) / (controls[k + 1] - controls[k]) if controls[k + 1] != controls[k] else 0.0
    )
    return float(times[k] + share * (times[k + 1] - times[k]))


def require_folds_of(history: History, folds: tuple[Fold, ...]) -> None:
    """Raise a `ValueError` if folds are of another compression, shear, ribbon, model or mesh than a run.

    A bare `Fold` is taken, and finite elements may be more or fewer as long as there are 8 of them: from
    there on their folds differ by less than outcomes depend on.
    """
    if not isinstance(history, History):
        raise ValueError(f"history = {shown(history)}: a History is needed")
    if not isinstance(folds, (tuple, list)) or not all(isinstance(fold, Fold) for fold in folds):
        raise ValueError(f"folds = {shown(folds)}: a tuple of Fold is needed, as `folds` of a model gives it")
    for k, fold in enumerate(folds):
        pairs: list[tuple[str, object, object]] = []
        if fold.scene is not None:
            names = ("compression", "shear", "ribbon")
            pairs += [(name, getattr(fold.scene, name), getattr(history.scene, name)) for name in names]
        if fold.model and history.model:
            pairs.append(("model", fold.model, history.model))
        mesh = [name for name in MESH if name in fold.options and name in history.options]
        if "elements" in mesh and min(fold.options["elements"], history.options["elements"]) >= _SETTLED:
            mesh.remove("elements")
        pairs += [(name, fold.options[name], history.options[name]) for name in mesh]
        for name, of_fold, of_run in pairs:
            if of_fold != of_run:
                raise ValueError(
                    f"folds[{k}]: {name} = {shown(of_fold)}, but the run's is {shown(of_run)}; those of the "
                    "same scene, model and mesh are needed"
                )


def classify(history: History, folds: tuple[Fold, ...]) -> Outcome:
    """The outcome of a run that started at U+S+ (with the right clamp turned: U+S-) at a positive rate.

    Parameters
    ----------
    history: with its rows.
    folds: the two folds of the scene by the same model, on the same mesh where it is one of rods, from
        its `folds`; a bare `Fold(angle, height, load)` is taken as it is.

    Raises
    ------
    ValueError
        If the run did not start at U+S+ under a positive rate, if `folds` are not two, or are of
        another compression, shear, ribbon, model or mesh.
    """
    scene = history.scene
    require_folds_of(history, folds)
    # read from its other end, a ribbon whose right clamp turns is one whose left clamp does, S exchanged
    path, side = {"left": ("U+S+", 1.0), "right": ("U+S-", -1.0)}.get(str(scene.drive), ("", 0.0))
    if scene.start != path or scene.direction < 0.0:
        raise ValueError(
            f"start = {scene.start!r}, drive = {scene.drive!r}, rate = {scene.rate!r}: outcomes are those of "
            "U+S+ turned by the left clamp, or U+S- by the right one, rate > 0"
        )
    if len(folds) != 2:
        raise ValueError(f"{len(folds)} folds: the two folds of Path 2 are needed")
    first, second = history.crossing("slope"), history.crossing("height")
    final = name_by_signs(history.height[-1], history.slope[-1])
    minima = _rebounds(history, first)

    def outcome(kind: str, reason: str) -> Outcome:
        return Outcome(kind, first, second, minima, final, reason)

    if second is None:
        kind = "none" if first is None else "first only"
        return outcome(kind, "z never passes 0")
    if second[1] < folds[1].control:
        return outcome("type 1", "z passes 0 before alpha_c2")
    rebound = (minima[:, 0] < second[0]) & (minima[:, 2] > 0.0)
    if rebound.any():
        return outcome("no skip", "z comes back up from a minimum above 0")
    if first is None or first[0] >= second[0] or history.control[-1] < folds[1].control:
        return outcome("type 2", "no first snap before the second")
    times, angles, heights, slopes, _ = history.track
    speed = np.abs(np.gradient(heights, times))
    before = times <= second[0]
    height, fall, slope = (
        float(np.interp(folds[1].control, angles[before], values[before]))
        for values in (heights, speed, slopes)
    )
    near = abs(height - folds[1].height) < _NEAR and side * slope > 0.0
    if near and fall < _SLOW * speed[before].max():
        return outcome("no skip", "it rests near U+S- when alpha_c2 comes")
    return outcome("type 2", "z falls past 0 without a stop, after alpha_c2")
