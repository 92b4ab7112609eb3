"""Outcomes of a run: which snaps happened, which shape was skipped, and what shapes are called.

A slow ramp from a US state may meet two folds: at the first it passes to a state on the same side of the
clamps whose mid tangent leans the other way (Path 2: U+S+ to U+S-), at the second to the other side (to
U-S+).  The first snap is the instant at which the mid tangent turns through horizontal, t_z = 0; the second
the one at which the midpoint passes the mean height of the clamps (z = 0 where none is lifted), after the
first fold (`History.snap`).  A ramp that meets one fold has one snap, the second of these.

Which sides these are is read off the start and the folds, so that mirror images, the other clamp, loads,
presets and other controls need no rules of their own; below they are said for Path 2.

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

import math
from dataclasses import dataclass

import numpy as np

from ribbonfem.events import between
from ribbonfem.history import instabilities_of
from ribbonfem.results import DEPARTED, MESH, Array, Fold, History, Value, control_text
from ribbonfem.scene import Scene, shown, swapped

# a height (L) this close to the fold state's counts as being there ...
_NEAR = 0.06
# ... at a speed below this share of the fastest of the run
_SLOW = 0.1
# folds closer than this, relative, are images of each other
_SAME = 1e-6
# elements from which on a fold is that of any finer mesh to 1e-3 rad (small slopes), to 1e-6 (ribbons), or to
# 2e-4 up to dL/L .7
_SETTLED = {"quasilinear": 8, "kirchhoff": 8, "elastica": 4}


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


def name_by_signs(height: float, slope: float, flat: float = 0.0) -> str:
    """The name of a shape by z(1/2) and t_z(1/2): on U+ S+ leans down, S- up; on U- the other way.

    Parameters
    ----------
    height: over the mean of the clamps', in L.
    slope: z-component of the unit tangent.
    flat: what is smaller counts as zero; a sign that vanishes leaves its letter out.

    Examples
    --------
    >>> name_by_signs(0.2, -0.5), name_by_signs(-0.2, 0.5), name_by_signs(0.2, 1e-9, 1e-6)
    ('U+S+', 'U-S+', 'U+')
    """
    u = "U+" if height > 0.0 else "U-"
    if abs(slope) < flat:
        return "" if abs(height) < flat else u
    if abs(height) < flat:
        return "S+" if slope < 0.0 else "S-"
    return u + ("S-" if height * slope > 0.0 else "S+")


@dataclass(frozen=True, repr=False, eq=False)
class Outcome(Value):
    """What a ramp through two folds did.

    Attributes
    ----------
    kind: "no skip", "type 1", "type 2"; "first only" if the second snap never came; "none".
    first, second: (time in s, control) of the two snaps, or None.
    minima: (k, 3) time, control and height where z turns back after the first snap: its local minima, of a
        start below the clamps its maxima.
    final: name of the last shape.
    reason: the rule that applied, in words.
    scene: of the run.
    """

    kind: str
    first: tuple[float, float] | None
    second: tuple[float, float] | None
    minima: Array
    final: str
    reason: str
    scene: Scene | None = None

    def __repr__(self) -> str:
        unit = "rad" if self.scene is None else self.scene.drives.unit
        first, second = (
            "none" if snap is None else f"{snap[1]:.6g} {unit}".rstrip() for snap in (self.first, self.second)
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


def _above(history: History) -> tuple[Array, float]:
    """(steps,) the height over the mean of the clamps', or below it where the start is below, and 1 or -1."""
    _, controls, heights, *_ = history.track
    above = heights - history.scene.clamps_height(controls)
    side = -1.0 if above[0] < -DEPARTED else 1.0
    return side * above, side


def _rebounds(history: History, first: tuple[float, float] | None) -> Array:
    """Where z turns back after the first snap (k, 3): time, control, height as in `_above`.

    Those before it are the ringing of the clamp's jump.
    """
    minima = local_minima(*history.track[:2], _above(history)[0])
    return minima[minima[:, 0] > (first[0] if first else np.inf)]


@dataclass(frozen=True)
class Instant:
    """A moment of a run: time (s), control, height z(1/2)/L, slope t_z(1/2), and the shape's name.

    `angle` is the control, by its name where clamps turn.
    """

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
    above = height - float(history.scene.clamps_height(angle))
    return Instant(time, angle, height, slope, name_by_signs(above, slope))


def middle_side(scene: Scene, folds: tuple[Fold, ...], start: tuple[float, float]) -> float:
    """The sign of t_z(1/2) between two folds of a ramp, at the first of which it changes.

    Parameters
    ----------
    scene: of the ramp.
    folds: in their order; of bare ones the state before the first is taken to lean as the start does.
    start: height and slope of the start.

    Raises
    ------
    ValueError
        If these are no two folds of a US state, the first with the mid tangent's snap and the second with the
        height's; says which folds there are.
    """
    where = " and ".join(control_text(scene, fold.control) for fold in folds) or "none"
    what = f"start = {scene.start!r}, drive = {scene.drive!r}, folds at {where}: "
    if len(folds) != 2:
        raise ValueError(f"{what}two folds are needed, between which there is a state to skip")
    side = math.copysign(1.0, start[0] - float(scene.clamps_height(scene.begin)))
    before, middle = (fold.slope for fold in folds)
    if math.isnan(before):
        before = start[1]
    if math.isnan(middle):
        middle = -before
    if len(scene.start) != 4 or before * middle >= 0.0:
        raise ValueError(f"{what}the mid tangent does not turn over at the first, as that of U+S+ does")
    if scene.direction * (folds[1].control - folds[0].control) <= _SAME * abs(folds[0].control):
        raise ValueError(f"{what}the second fold does not lie behind the first: nothing is skipped")
    if any(side * (fold.height - float(scene.clamps_height(fold.control))) <= 0.0 for fold in folds):
        raise ValueError(f"{what}the midpoint has passed the clamps' mean height before the second")
    return math.copysign(1.0, middle)


def _snaps_of(history: History, folds: tuple[Fold, ...]) -> tuple[tuple[float, float] | None, ...]:
    """Time and control of the first and of the second snap of a ramp through two folds."""
    first = history.crossing("slope")
    slopes = history.track[3]
    if folds and slopes[0] * folds[0].slope < 0.0:
        # the state at rest turns its mid tangent over before the first fold already
        first = history.crossing("slope", after=_passes(history, folds[0].control) or np.inf)
    return first, history.snap


def _two_snaps(history: History, folds: tuple[Fold, ...]) -> bool:
    """Whether the ramp meets two folds as Path 2 does, U+S+ to U+S- to U-S+."""
    scene = history.scene
    known = bool(folds) and folds[0].scene is not None and folds[0].scene.stop is None
    if len(folds) == 2 or known:
        try:
            return bool(middle_side(scene, folds, (history.height[0], history.slope[0])))
        except ValueError:
            return False
    if not scene.usual:
        met = instabilities_of(history)
        return len(scene.start) == 4 and [point.kind for point in met] == ["fold", "fold"]
    # read from its other end, a ribbon whose right clamp turns is one whose left clamp does, S exchanged
    start = scene.start if scene.drive == "left" else swapped(scene.start)
    return (start, scene.direction > 0.0) in (("U+S+", True), ("U-S+", False))


def events(history: History, folds: tuple[Fold, ...] = ()) -> dict[str, Instant | None]:
    """What happened in a run, each instant solved for and not read off a row.

    Parameters
    ----------
    history: of any model.
    folds: adds the passage of each fold's control.

    Returns
    -------
    dict
        Of a ramp that meets one fold: "snap" (z = 0, see `History.snap`), "first minimum" (of z, after the
        snap), "alpha_c" and "end".  Of one from a US state that meets two: "first snap" (t_z = 0, before
        the second), "second snap" (z = 0), "first minimum" (of z, after the first snap; of a start below the
        clamps a maximum), "alpha_c1", "alpha_c2" and "end".  In the order in which they came; those that
        the run did not come to are last, and None.

    Raises
    ------
    ValueError
        As `require_folds_of`.
    """
    require_folds_of(history, folds)
    two = _two_snaps(history, folds)
    if two:
        level, height = _snaps_of(history, folds)
        first = None if level is None or (height is not None and height[0] <= level[0]) else level
        snaps = {"first snap": first, "second snap": height}
    else:
        first = history.snap
        snaps = {"snap": first}
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
        time = history.begun + control / scene.rate
        reached = history.begun <= time <= history.time[-1] and abs(control) <= abs(history.control[-1])
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
    """Raise a `ValueError` if folds are of another rig, ribbon, model or mesh than a run.

    A bare `Fold` is taken, and finite elements may be more or fewer as long as there are 8 of them, 4 of the
    elastica: from there on their folds differ by less than outcomes depend on.
    """
    if not isinstance(history, History):
        raise ValueError(f"history = {shown(history)}: a History is needed")
    if not isinstance(folds, (tuple, list)) or not all(isinstance(fold, Fold) for fold in folds):
        raise ValueError(f"folds = {shown(folds)}: a tuple of Fold is needed, as `folds` of a model gives it")
    for k, fold in enumerate(folds):
        pairs: list[tuple[str, object, object]] = []
        if fold.scene is not None:
            names = ("compression", "shear", "ribbon", "drive", "preset", "weight")
            pairs += [(name, getattr(fold.scene, name), getattr(history.scene, name)) for name in names]
        if fold.model and history.model:
            pairs.append(("model", fold.model, history.model))
        mesh = [name for name in MESH if name in fold.options and name in history.options]
        fewest = _SETTLED.get(history.model, 8)
        if "elements" in mesh and min(fold.options["elements"], history.options["elements"]) >= fewest:
            mesh.remove("elements")
        pairs += [(name, fold.options[name], history.options[name]) for name in mesh]
        for name, of_fold, of_run in pairs:
            if of_fold != of_run:
                raise ValueError(
                    f"folds[{k}]: {name} = {shown(of_fold)}, but the run's is {shown(of_run)}; those of the "
                    "same scene, model and mesh are needed"
                )


def classify(history: History, folds: tuple[Fold, ...]) -> Outcome:
    """The outcome of a run from a US state whose slow ramp meets two folds.

    Parameters
    ----------
    history: with its rows.
    folds: the two folds of the scene by the same model, on the same mesh where it is one of rods, from
        its `folds`; a bare `Fold(control, height, load)` is taken as it is.

    Raises
    ------
    ValueError
        If `folds` are not two, or of another rig, ribbon, model or mesh; if they are no two that a US
        state meets one after the other in this direction, the mid tangent turning over at the first and the
        height at the second.
    """
    scene = history.scene
    require_folds_of(history, folds)
    middle = middle_side(scene, folds, (float(history.height[0]), float(history.slope[0])))
    first, second = _snaps_of(history, folds)
    times, _, heights, slopes, _ = history.track
    above, side = _above(history)
    minima = _rebounds(history, first)
    turns = np.column_stack((minima[:, :2], side * minima[:, 2] + scene.clamps_height(minima[:, 1])))
    final = name_by_signs(side * float(above[-1]), float(slopes[-1]))
    zero = "the clamps' mean height" if scene.drives.lift or "lift" in scene.preset else "0"
    gone = "alpha_c2" if scene.clamps_turn else "the second fold"

    def outcome(kind: str, reason: str) -> Outcome:
        return Outcome(kind, first, second, turns, final, reason, scene)

    if second is None:
        kind = "none" if first is None else "first only"
        return outcome(kind, f"z never passes {zero}")
    if scene.direction * (second[1] - folds[1].control) < 0.0:
        return outcome("type 1", f"z passes {zero} before {gone}")
    if ((minima[:, 0] < second[0]) & (minima[:, 2] > 0.0)).any():
        return outcome("no skip", f"z turns back before it comes to {zero}")
    passed = _passes(history, folds[1].control)
    if first is None or first[0] >= second[0] or passed is None:
        return outcome("type 2", "no first snap before the second")
    speed = np.abs(np.gradient(above, times))
    before = times <= second[0]
    height, fall, slope = (
        float(np.interp(passed, times[before], values[before])) for values in (heights, speed, slopes)
    )
    near = abs(height - folds[1].height) < _NEAR and middle * slope > 0.0
    if near and fall < _SLOW * speed[before].max():
        return outcome("no skip", f"it rests near {name_by_signs(side, middle)} when {gone} comes")
    return outcome("type 2", f"z goes past {zero} without a stop, after {gone}")
