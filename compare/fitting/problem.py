"""The least-squares problem of a fit: records, parameters and model; residuals, and their derivatives."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import OptimizeResult, least_squares

from ribbonfem import Scene, SceneError, SolverError
from ribbonfem.measured import EVENTS, Measured
from ribbonfem.options import a_scene, refuse
from ribbonfem.results import Array

from .parameters import Parameter, applied, offset_of
from .predictions import EXACT, Model, Record

# Derivatives are taken over so much of a parameter that the change is this many times what predictions
# scatter by, where that is more than the data's uncertainty; but not over more of it than this.
_CLEAR, WIDEST = 3.0, 0.05
# what is so close to a bound, in parts of a parameter, is at it
_CLOSE = 1e-3
# an estimated deviation is at least this part of what it begins with, a hundredth of the range: of a column
# that is exact, as of a control that a machine turns, rounding alone is left, and would count for all
_LEAST = 1e-4
# what predictions that are symmetric about 0 change by the sign of a parameter, beside what they change by it
_EVEN = 0.1
# units of a scene's control, by the kind of its drive
_ANGLES = ("rad", "deg")
_UNITS = {"turn": _ANGLES, "twist": _ANGLES, "length": ("L", "m", "mm"), "force": ("EI2/L^2", "N", "mN")}


@dataclass
class Problem:
    """Residuals, in standard deviations, of parameters that are counted in their `scale`.

    `steps` (p,) are the parts of the parameters over which derivatives are taken; `least` by name the
    smallest standard deviations that are estimated.
    """

    records: tuple[Record, ...]
    parameters: tuple[Parameter, ...]
    model: Model
    difference: float
    sigma: list[dict[str, Array]]

    def __post_init__(self) -> None:
        self.steps = np.full(len(self.parameters), self.difference)
        begun = [(name, float(np.nanmin(each[name]))) for each in self.sigma for name in each]
        self.least = {name: _LEAST * min(x for key, x in begun if key == name) for name, _ in begun}
        self.scale = np.array([p.scale for p in self.parameters])
        self.masks = [masks_of(record.measured) for record in self.records]
        starts = np.array([p.start for p in self.parameters]) / self.scale
        for k, record in enumerate(self.records):
            if record.measured.time is not None and record.scene.schedule is not None:
                last = float(np.nanmax(record.seconds("time"))) - self.offset(starts, k)
                if last > record.scene.duration * (1.0 + 1e-9):
                    raise SceneError(
                        f"Measured.time: goes on to {last:.6g} s of the scene, and its schedule ends at "
                        f"{record.scene.duration:.6g} s: let it hold its last value as long"
                    )

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Low and high (p,)."""
        ends = np.array([(p.low, p.high) for p in self.parameters]) / self.scale[:, None]
        return ends[:, 0], ends[:, 1]

    def bound(self, y: Array) -> Any:
        """(p,) bool, whether a parameter is at a bound: a search only comes close to it."""
        low, high = self.bounds
        return np.minimum(y - low, high - y) < _CLOSE

    def held(self, y: Array, gradient: Array) -> Any:
        """(p,) bool, whether a parameter is at a bound that the residuals push it against."""
        low, high = self.bounds
        return ((y - low < _CLOSE) & (gradient >= 0.0)) | ((high - y < _CLOSE) & (gradient <= 0.0))

    def values(self, y: Array) -> Array:
        """(p,) in their own units."""
        return np.asarray(y) * self.scale

    def scenes(self, y: Array) -> tuple[Scene, ...]:
        """With these values."""
        values = self.values(y).tolist()
        return tuple(applied(record.scene, self.parameters, values) for record in self.records)

    def offset(self, y: Array, k: int) -> float:
        """Of a record's clock, s."""
        return offset_of(self.parameters, self.values(y).tolist(), k)

    def predicted(self, y: Array, model: Model | None = None) -> list[dict[str, Array]]:
        """What would have been measured, by scene and name; raises what the model does."""
        return [
            record.predicted(model or self.model, scene, self.offset(y, k), self.sigma[k])
            for k, (record, scene) in enumerate(zip(self.records, self.scenes(y), strict=True))
        ]

    def residual(self, y: Array, model: Model | None = None) -> Array:
        """(n,) predicted less measured."""
        parts = [
            ((p[name] - record.measured.values(name)) / sigma[name])[mask[name]]
            for record, p, sigma, mask in zip(
                self.records, self.predicted(y, model), self.sigma, self.masks, strict=True
            )
            for name in p
        ]
        return np.concatenate(parts)

    def attempt(self, y: Array) -> Array:
        """`residual`, infinite where the model has none: a search turns back there."""
        try:
            return self.residual(y)
        except (SceneError, SolverError):
            return np.full(self.count, np.inf)

    @property
    def count(self) -> int:
        """Of residuals."""
        return sum(int(each.sum()) for mask in self.masks for each in mask.values())

    def jacobian(self, y: Array) -> Array:
        """(n, p) by central differences; from one side at a bound, or where the model fails on the other."""
        return np.column_stack([self.derivative(y, j, part) for j, part in enumerate(self.steps)])

    def derivative(self, y: Array, j: int, part: float) -> Array:
        """(n,) by one parameter, over a part of it.

        By factors where it has one sign: parameters of which the ratio alone counts have opposite derivatives
        then, to the last digit, whatever the predictions scatter by.
        """
        parameter, value = self.parameters[j], float(self.values(y)[j])
        size = parameter.size(value)
        ends, sides = [], []
        for way in (part, -part):
            by_factors = parameter.one_sign and abs(value) == size
            there = value * math.exp(math.copysign(1.0, value) * way) if by_factors else value + way * size
            moved = np.array(y)
            moved[j] = there / self.scale[j]
            inside = parameter.low <= there <= parameter.high
            changed = self.attempt(moved) if inside else np.array([np.inf])
            known = bool(np.isfinite(changed).all())
            ends.append(changed if known else self.residual(y))
            sides.append(way if known else 0.0)
        if sides[0] == sides[1]:
            raise SolverError(
                f"{parameter.name} = {value:.6g}: on either side, {part:.2g} of it away, the model fails"
            )
        return (ends[0] - ends[1]) / (sides[0] - sides[1]) / (size / self.scale[j])

    def widen(self, y: Array) -> None:
        """Take derivatives over so much that the change is clear of the scatter, if that counts."""
        noise = self.scatter(y)
        self.steps[:] = self.difference
        for j in range(len(y)) if noise > 1.0 else ():
            change = float(np.linalg.norm(self.derivative(y, j, WIDEST)))
            wanted = _CLEAR * noise / change if change > 0.0 else math.inf
            self.steps[j] = min(max(wanted, self.difference), max(WIDEST, self.difference))

    def scatter(self, y: Array) -> float:
        """By how much, all told, the residuals differ if steps are a little finer."""
        finer = self.model.slightly_finer()
        return 0.0 if finer is None else float(np.linalg.norm(self.residual(y, finer) - self.residual(y)))

    def sizes(self, y: Array) -> Array:
        """(p,) what a small change of each is small against."""
        values = self.values(y).tolist()
        sizes = [p.size(value) for p, value in zip(self.parameters, values, strict=True)]
        return np.array(sizes) / self.scale

    def error(self, y: Array, fine: Model) -> Array:
        """(n,) of the model's predictions, in standard deviations: by the finer model's."""
        ratio = self.model.ratio()
        return (self.residual(y, fine) - self.residual(y)) * ratio / (ratio - 1.0)

    def off_symmetry(self, y: Array) -> Array:
        """A beginning off zeros about which the predictions are symmetric: no derivative leads away there."""
        moved = np.array(y)
        for j in np.flatnonzero([p.start == 0.0 and p.owner != "offset" for p in self.parameters]):
            by = np.zeros(len(y))
            by[j] = min(self.sizes(y)[j], self.bounds[1][j] - y[j]) or -self.sizes(y)[j]
            up, down, here = self.attempt(y + by), self.attempt(y - by), self.residual(y)
            if np.isfinite([up, down]).all():
                odd, even = np.linalg.norm(up - down), np.linalg.norm(up + down - 2.0 * here)
                moved += by if odd < _EVEN * even else 0.0
        return moved

    def estimate(self, y: Array, unknown: Mapping[str, str], degrees: int) -> float:
        """Take the standard deviations of these, where none is given, for what is left.

        Returns by how much one changed, relative.
        """
        predicted, change = self.predicted(y), 0.0
        for name in unknown:
            pairs = [
                (k, (p[name] - record.measured.values(name))[mask[name]])
                for k, (record, p, mask) in enumerate(zip(self.records, predicted, self.masks, strict=True))
                if name in p and name not in record.measured.uncertainty
            ]
            left = np.concatenate([each for _, each in pairs])
            share = degrees / (degrees + len(self.parameters))
            new = max(float(np.sqrt(np.mean(left**2) / share)), self.least[name])
            for k, _ in pairs:
                change = max(change, abs(new / float(self.sigma[k][name][0]) - 1.0))
                self.sigma[k][name] = np.full(self.sigma[k][name].shape, new)
        for record, sigma in zip(self.records, self.sigma, strict=True):
            if record.at_rest:
                sigma["control"] = _of_control(record.measured, sigma)
        return change

    def minimum(self, y: Array, most: int) -> OptimizeResult:
        """From a beginning, with so many evaluations at most."""
        options: dict[str, Any] = {"ftol": 1e-9, "xtol": 1e-8, "gtol": 1e-12, "max_nfev": most}
        low, high = self.bounds
        # the first step goes as far as the search begins from 0, which a parameter may be close to
        back = y - 1.0

        def at(u: Array) -> Array:
            return np.clip(u + back, low, high)

        result = least_squares(
            lambda u: self.attempt(at(u)),
            np.ones(len(y)),
            lambda u: self.jacobian(at(u)),
            bounds=(low - back, high - back),
            **options,
        )
        result.x = at(result.x)
        return result


def masks_of(measured: Measured) -> dict[str, Any]:
    """By name the rows that count: of states at rest those with a control and something over it."""
    masks = {name: np.isfinite(measured.values(name)) for name in measured.measured}
    rows = [name for name in masks if name not in EVENTS]
    over = measured.time if measured.time is not None else measured.control
    for name in rows:
        masks[name] &= np.isfinite(over)
    if rows and measured.time is None:
        masks["control"] = np.any([masks[name] for name in rows], axis=0)
    return masks


def deviations_of(records: tuple[Record, ...]) -> tuple[list[dict[str, Array]], dict[str, str]]:
    """Standard deviations by scene and name, and the units of the quantities whose own are to be estimated.

    Raises
    ------
    SceneError
        For one that is not given and cannot be estimated.
    """
    unknown: dict[str, str] = {}
    result: list[dict[str, Array]] = []
    for record in records:
        measured, given = record.measured, record.measured.uncertainty
        sigma = {}
        for name in measured.measured:
            values = measured.values(name)
            spread = float(np.ptp(values[np.isfinite(values)]))
            if name in given:
                sigma[name] = np.broadcast_to(given[name], values.shape)
                continue
            if unknown.setdefault(name, record.unit(name)) != record.unit(name):
                raise SceneError(f"Measured.uncertainty: that of {name} is needed: its units differ")
            # to begin with
            some = 0.01 * spread or 1e-3 * float(np.nanmax(np.abs(values))) or 1.0
            sigma[name] = np.full(values.shape, some)
        result.append(sigma)
        if record.at_rest:
            sigma["control"] = _of_control(measured, sigma)
    for name in unknown:
        data = [record.measured for record in records if name not in record.measured.uncertainty]
        having = [each.values(name) for each in data if name in each.measured]
        if sum(int(np.isfinite(values).sum()) for values in having) < 2:
            raise SceneError(
                f"Measured.uncertainty: that of {name} is needed: nothing can be told from a single number"
            )
    return result, unknown


def _of_control(measured: Measured, sigma: Mapping[str, Array]) -> Array:
    """Standard deviations (rows,) of the controls of states at rest: as given, or `EXACT` beside the rest."""
    control = measured.values("control")
    if "control" in measured.uncertainty:
        return np.broadcast_to(measured.uncertainty["control"], control.shape)
    parts = [
        np.nanmin(sigma[name]) / (np.ptp(values[np.isfinite(values)]) or 1.0)
        for name in sigma
        if name not in ("control", *EVENTS) and (values := measured.values(name)) is not None
    ]
    return np.full(control.shape, EXACT * min(parts) * (np.ptp(control[np.isfinite(control)]) or 1.0))


def records_of(scene: object, measured: object) -> tuple[Record, ...]:
    """Scenes with what was measured of each.

    Raises
    ------
    OptionError, SceneError
        For what is none, or not as many; for units that are not of a scene's control.
    """
    scenes = tuple(scene) if isinstance(scene, Sequence) else (scene,)
    data = tuple(measured) if isinstance(measured, Sequence) else (measured,)
    if len(scenes) != len(data) or not scenes:
        refuse("measured", measured, f"one for each scene is needed, and there are {len(scenes)} scenes")
    result = []
    for each, what in zip(scenes, data, strict=True):
        if not isinstance(what, Measured):
            refuse("measured", what, "a Measured is needed")
        one = a_scene("scene", each)
        own = Record(one, what, one.ribbon.inertial_time)
        allowed = _UNITS.get(one.drives.kind, (own.unit("control"),))
        for name in ("control", "snap", "first_snap", "folds"):
            if getattr(what, name) is not None and own.unit(name) not in allowed:
                raise SceneError(
                    f"Measured.units: {name} is in {own.unit(name)}, and the scene's control, drive = "
                    f"{one.drive!r}, in one of {', '.join(allowed)}"
                )
        result.append(own)
    return tuple(result)
