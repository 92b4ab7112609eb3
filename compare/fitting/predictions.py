"""What a model says would have been measured of a scene: motions, states at rest, snaps and folds."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.interpolate import Akima1DInterpolator, CubicHermiteSpline, CubicSpline

from compare.chooser.refinement import endless
from compare.models import MODEL_INFO, MODELS
from compare.quantities.measure import Shape, defaults_of, mesh_of
from ribbonfem import Branch, Fold, History, Scene, SolverError
from ribbonfem.continuation import Steps
from ribbonfem.measured import EVENTS, REACTIONS, Measured, in_own_units
from ribbonfem.results import Array

# what the control of states at rest is uncertain by where nothing is said: a part of what the rest is, each
# beside its range
EXACT = 1e-2
# points between two of a curve of equilibria at which the nearest is looked for
_BETWEEN = 16
# steps along it, as parts of the usual ones: splines through its points err by a millionth or so
_ALONG = 0.25
# runs that are kept: a change of an offset, or of a unit, asks for none
_KEPT = 64


@dataclass
class Model:
    """A model with its options, which keeps its last runs.

    Attributes
    ----------
    name: of the model.
    options: of its motions; those of its mesh are those of states at rest too.
    along: steps along curves of states at rest, as parts of the usual ones.
    runs: how many motions, curves and lists of folds were computed.
    """

    name: str
    options: Mapping[str, Any]
    along: float = _ALONG
    runs: int = 0
    _kept: dict[Any, Any] = field(default_factory=dict, repr=False)

    def of(self, function: str, scene: Scene, **options: Any) -> Any:
        """What a function of the model gives of a scene."""
        key = function, scene, tuple(options.items())
        if key not in self._kept:
            mine = self.options if function == "simulate" else mesh_of(self.name, self.options)
            self.runs += 1
            result = getattr(MODELS[self.name], function)(scene, **mine, **options)
            while len(self._kept) >= _KEPT:
                del self._kept[next(iter(self._kept))]
            self._kept[key] = result
        return self._kept[key]

    def refined(self) -> Model:
        """On a finer mesh, with finer steps."""
        key = MODEL_INFO[self.name].mesh
        full = {**defaults_of(self.name, "simulate"), **self.options}
        finer = {key: 2 * full[key] - 1 if key == "nodes" else full[key] + 4}
        if full.get("step") is not None:
            finer["step"] = 0.5 * full["step"]
        else:
            finer["tolerance"] = float(f"{0.1 * full['tolerance']:.3g}")
        return Model(self.name, {**self.options, **finer}, 0.5 * self.along)

    def slightly_finer(self) -> Model | None:
        """With a tolerance a tenth smaller: what differs is scatter of adaptive steps; None of fixed ones."""
        tolerance = self.options.get("tolerance")
        if tolerance is None:
            return None
        return Model(self.name, {**self.options, "tolerance": 0.9 * tolerance}, self.along)

    def ratio(self) -> float:
        """By how much the error in space falls from this mesh to the refined one."""
        info, options = MODEL_INFO[self.name], {**defaults_of(self.name, "simulate"), **self.options}
        fine = {**options, **self.refined().options}
        return float((info.size(options) / info.size(fine)) ** info.order(options))


@dataclass(frozen=True)
class Record:
    """A scene, what was measured of it, and how long its motion has to go on.

    Attributes
    ----------
    quantum: s; a stopped control is held for a multiple of this, as long as rows go on, or until the snap;
        a ramp without a stop ends at one.
    """

    scene: Scene
    measured: Measured
    quantum: float

    def moving(self, scene: Scene, offset: float) -> tuple[Scene, dict[str, Any]]:
        """The scene that is run, and options of the run: to the last row, or to the snap."""
        measured, goes_on = self.measured, scene.stop is None
        scene = endless(scene)
        if scene.schedule is None and self.has_clock:
            last, stop = self._last - offset, scene.require_stop()
            beyond = last - abs(stop / scene.rate)
            if beyond > scene.hold:
                scene = replace(scene, hold=self._quanta(beyond))
            elif goes_on and measured.snap is None and measured.first_snap is None:
                # (a ramp without an end is followed no further than rows go)
                way = abs(scene.rate) * self._quanta(max(last, self.quantum))
                scene = replace(scene, stop=math.copysign(min(way, abs(stop)), stop))
        if measured.time is None:
            return scene, {"until": "snap", "configurations": False}
        shapes = measured.midspan_x is not None or measured.midspan_y is not None
        return scene, {"configurations": shapes}

    def _quanta(self, duration: float) -> float:
        """A duration, s, rounded up."""
        return self.quantum * math.ceil(duration / self.quantum)

    @property
    def _last(self) -> float:
        """The last time that was measured, s; a snap may be predicted to come a little later than it came."""
        rows = [] if self.measured.time is None else [float(np.nanmax(self.seconds("time")))]
        snap = [] if self.measured.snap_time is None else [float(self.seconds("snap_time")[0]) + self.quantum]
        return max(rows + snap)

    @property
    def at_rest(self) -> bool:
        """Whether its rows are states at rest."""
        measured = self.measured
        return measured.time is None and any(name not in EVENTS for name in measured.measured)

    @property
    def moves(self) -> bool:
        """Whether something of a motion was measured."""
        events = [name for name in self.measured.measured if name in EVENTS and name != "folds"]
        return self.measured.time is not None or bool(events)

    @property
    def has_clock(self) -> bool:
        """Whether something of it was measured in time."""
        return self.measured.time is not None or self.measured.snap_time is not None

    def unit(self, name: str) -> str:
        """The unit of a quantity."""
        return self.measured.unit(name, self.scene.drives.unit)

    def seconds(self, name: str) -> Array:
        """Times in s."""
        return self.measured.values(name) * in_own_units(self.unit(name), self.scene.ribbon)

    def own(self, name: str, scene: Scene) -> float:
        """How many of the results' units the unit of a quantity is."""
        return in_own_units(self.unit(name), scene.ribbon)

    def predicted(
        self, model: Model, scene: Scene, offset: float, sigma: Mapping[str, Any]
    ) -> dict[str, Array]:
        """What would have been measured, by name, in the units of what was.

        Of states at rest those nearest on the curve, where `sigma`, the standard deviations, say what is
        near; "control" is among them.

        Raises
        ------
        SceneError, SolverError
            Of a scene that cannot be, or that does not do what was measured.
        """
        measured = self.measured
        result: dict[str, Array] = {}
        rows = [name for name in measured.measured if name not in EVENTS]
        snaps = [name for name in measured.measured if name in EVENTS and name != "folds"]
        if self.at_rest:
            result |= self._at_rest(model, scene, rows, sigma)
        history = self.history(model, scene, offset)
        if history is not None:
            if measured.time is not None:
                at = self.seconds("time") - offset
                result |= {name: sampled(history, name, at) / self.own(name, scene) for name in rows}
            result |= {name: self._event(history, name, offset) / self.own(name, scene) for name in snaps}
        if measured.folds is not None:
            result["folds"] = self._folds(model, scene) / self.own("folds", scene)
        return result

    def history(self, model: Model, scene: Scene, offset: float) -> History | None:
        """The motion of the scene, if something of one was measured."""
        if not self.moves:
            return None
        moving, options = self.moving(scene, offset)
        history: History = model.of("simulate", moving, **options)
        return history

    def curve(self, model: Model, scene: Scene) -> Branch | None:
        """The curve of states at rest, as far as they were measured; None if they were not."""
        if not self.at_rest:
            return None
        control = self.measured.values("control") * self.own("control", scene)
        low, high = float(np.nanmin(control)), float(np.nanmax(control))
        margin = 0.02 * (high - low) + 1e-3 * max(abs(low), abs(high))
        span = min(low, scene.begin) - margin, max(high, scene.begin) + margin
        usual = Steps()
        names = ("first", "largest", "turn")
        steps = replace(usual, **{name: model.along * getattr(usual, name) for name in names})
        branch: Branch = model.of("equilibria", scene, span=span, steps=steps)
        return branch

    def _event(self, history: History, name: str, offset: float) -> Array:
        crossing = history.crossing("slope") if name == "first_snap" else history.snap
        if crossing is None:
            raise SolverError(f"{name} was measured, and the ribbon does not snap: {history!r}", history)
        return np.array([crossing[0] + offset if name == "snap_time" else crossing[1]])

    def _folds(self, model: Model, scene: Scene) -> Array:
        folds: tuple[Fold, ...] = model.of("folds", scene)
        wanted = len(self.measured.folds)
        if len(folds) < wanted:
            raise SolverError(f"{wanted} folds were measured, and a slow ramp meets {len(folds)}")
        return np.array([fold.control for fold in folds[:wanted]])

    def _at_rest(
        self, model: Model, scene: Scene, rows: list[str], sigma: Mapping[str, Any]
    ) -> dict[str, Array]:
        names = ["control", *rows]
        own = np.array([self.own(name, scene) for name in names])
        data = np.array([self.measured.values(name) for name in names]).T * own
        branch = self.curve(model, scene)
        assert branch is not None
        spread = np.array([np.broadcast_to(sigma[name], len(data)) for name in names]).T * own
        points = nearest(branch, names, data, spread) / own
        return dict(zip(names, points.T, strict=True))


def sampled(history: History, name: str, at: Array) -> Array:
    """A quantity of a motion at instants (s): before the first it is at rest, behind the last it stays."""
    times, controls, heights, slopes, speeds = history.track
    at = np.clip(at - history.begun, times[0], times[-1])
    if name == "control":
        schedule = history.scene.schedule
        return np.interp(at, times, controls) if schedule is None else np.asarray(schedule(at))
    if name == "height":
        if np.isfinite(speeds).all():
            return np.asarray(CubicHermiteSpline(times, heights, speeds)(at))
        return np.asarray(Akima1DInterpolator(times, heights)(at))
    if name == "slope":
        return np.asarray(Akima1DInterpolator(times, slopes)(at))
    if name == "load":
        values = history.load
    elif name in REACTIONS:
        k = REACTIONS.index(name)
        # forces of both clamps come first, then moments
        values = history.reactions[:, (k // 3) % 2, 3 * (k // 6) + k % 3]
    else:
        values = _midspan(history, "xyz".index(name[-1]))
    return np.asarray(Akima1DInterpolator(history.time, values)(at))


def _midspan(history: History, axis: int) -> Array:
    """x or y of the middle (rows,), in L; where no node is there, by a quintic through the nodes."""
    s, positions = history.arclength, history.configurations["positions"]
    k = int(np.argmin(np.abs(s - 0.5)))
    if abs(s[k] - 0.5) < 1e-9:
        return np.asarray(positions[:, k, axis])
    return np.array([Shape(s, r).at(np.array([0.5]))[0, axis] for r in positions])


def nearest(branch: Branch, names: list[str], data: Array, spread: Array) -> Array:
    """The stable states (rows, names) of a curve of equilibria that are nearest to those measured.

    Parameters
    ----------
    names: "control" and others of `Branch`.
    data, spread: (rows, names) what was measured, NaN where it was not, and its standard deviations, in which
        distances are counted.

    Notes
    -----
    A state that is measured just beyond where the curve turns is near to its fold: a state there at the same
    control there is none.

    Raises
    ------
    SolverError
        If no part of the curve is stable.
    """
    parts = _stable_parts(branch, names)
    if not parts:
        raise SolverError(f"no state of the curve is stable: {branch!r}")
    result, best = np.full(data.shape, np.nan), np.full(len(data), np.inf)
    with np.errstate(invalid="ignore"):
        for curve, knots in parts:
            steps = np.linspace(0.0, len(knots) - 1.0, _BETWEEN * (len(knots) - 1) + 1)
            fine = np.interp(steps, np.arange(len(knots)), knots)
            for row, (point, scale) in enumerate(zip(data, spread, strict=True)):
                seen = np.isfinite(point)
                if not seen.all() and (not seen[0] or seen.sum() < 2):
                    continue
                at = _foot(curve, fine, point, scale, seen)
                value = curve(at)
                far = float(np.sum(((value - point) / scale)[seen] ** 2))
                if far < best[row]:
                    best[row], result[row] = far, value
    return result


def _foot(curve: CubicSpline, fine: Array, point: Array, scale: Array, seen: Any) -> float:
    """Where on a curve, between its ends, a point is nearest to it."""

    def off(at: Any) -> Array:
        return np.asarray((curve(at) - point) / scale)[..., seen]

    k = int(np.argmin((off(fine) ** 2).sum(axis=-1)))
    low, high = fine[max(k - 1, 0)], fine[min(k + 1, len(fine) - 1)]
    at = float(fine[k])
    for _ in range(20):
        # Gauss and Newton, of the distance along one parameter
        along = (np.asarray(curve(at, 1)) / scale)[seen]
        step = -float(along @ off(at)) / float(along @ along)
        new = min(max(at + step, low), high)
        if abs(new - at) <= 1e-14 * (fine[-1] - fine[0]):
            break
        at = new
    return at


def _stable_parts(branch: Branch, names: list[str]) -> list[tuple[CubicSpline, Array]]:
    """Splines, over an arclength, through the stable stretches of a curve and the folds that end them."""
    points = np.array([getattr(branch, name) for name in names]).T
    folds = [np.array([getattr(fold, name) for name in names]) for fold in branch.folds]
    span = np.ptp(points, axis=0)
    span[span == 0.0] = 1.0
    edges = np.flatnonzero(np.diff(np.concatenate(([0], branch.stable.astype(int), [0]))))
    parts = []
    for first, last in zip(edges[::2], edges[1::2], strict=True):
        part = list(points[first:last])
        # (a stretch may end at a branch point too)
        if first > 0:
            part[:0] = _between(folds, points[first - 1], points[first], span)
        if last < len(points):
            part += _between(folds, points[last - 1], points[last], span)
        rows = np.array(part)
        along = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(rows, axis=0) / span, axis=1))))
        keep = np.concatenate(([True], np.diff(along) > 1e-12))
        if keep.sum() > 3:
            parts.append((CubicSpline(along[keep], rows[keep]), along[keep]))
    return parts


def _between(folds: list[Array], a: Array, b: Array, span: Array) -> list[Array]:
    """The fold between two rows of a curve, if there is one."""

    def way(fold: Array) -> float:
        return float(np.linalg.norm((fold - a) / span) + np.linalg.norm((fold - b) / span))

    here = min(folds, key=way, default=None)
    return [] if here is None or way(here) > 2.0 * float(np.linalg.norm((a - b) / span)) else [here]
