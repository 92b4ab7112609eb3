"""What was measured on the bench, `Measured`: a motion, states at rest, snaps and folds; and how well."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .csv_columns import HEADING, headings
from .csv_columns import columns as read_columns
from .frozen import Value
from .ribbon import Ribbon, SceneError, answers_unknown, field_number, shown

Array = NDArray[np.float64]

REACTIONS = tuple(
    f"{what}_{clamp}_{axis}" for what in ("force", "moment") for clamp in ("left", "right") for axis in "xyz"
)
# columns with a row an instant, or a state at rest
ROWS = ("control", "height", "slope", "load", "midspan_x", "midspan_y")
# numbers of a whole experiment; of `folds` several
EVENTS = ("snap", "snap_time", "first_snap", "folds")
# of states at rest: what a curve of equilibria has
AT_REST = ("height", "slope", "load")

_LENGTHS, _FORCES = ("L", "m", "mm"), ("EI2/L^2", "N", "mN")
_CONTROLS = ("rad", "deg", *_LENGTHS, *_FORCES)
_UNITS: Mapping[str, tuple[str, ...]] = {
    "time": ("s", "ms", "min"),
    "snap_time": ("s", "ms", "min"),
    **dict.fromkeys(("control", "snap", "first_snap", "folds"), _CONTROLS),
    **dict.fromkeys(("height", "midspan_x", "midspan_y"), _LENGTHS),
    "slope": ("1",),
    "load": _FORCES,
    **{name: _FORCES if name.startswith("force") else ("EI2/L", "N m", "N mm") for name in REACTIONS},
}


def _numbers(name: str, values: object) -> Array:
    """A column, read-only; NaN where nothing was measured."""
    if isinstance(values, (str, bytes, Mapping)) or not isinstance(values, Iterable):
        raise SceneError(f"Measured.{name} = {shown(values)}: a sequence of numbers is needed")
    try:
        array = np.array(list(values), dtype=float)
    except (TypeError, ValueError, OverflowError):
        array = np.zeros((0, 0))
    if array.ndim != 1 or not array.size:
        raise SceneError(f"Measured.{name} = {shown(values)}: a sequence of numbers is needed, one a row")
    if np.isinf(array).any():
        k = int(np.argmax(np.isinf(array)))
        raise SceneError(
            f"Measured.{name}[{k}] = {array[k]}: a finite number is needed, or NaN where nothing was measured"
        )
    if np.isnan(array).all():
        raise SceneError(f"Measured.{name}: holds no number: one row at least must not be NaN")
    return array


@answers_unknown
@dataclass(frozen=True, kw_only=True, repr=False, eq=False)
class Measured(Value):
    """What was measured of a scene, each quantity with its standard deviation.

    Rows that have a `time` are of a motion; rows that have a `control` and no time are states at rest; events
    are numbers of the whole experiment.  One of the three at least.  Rows may be in any order.  NaN is a row
    in which this quantity was not measured.

    Parameters
    ----------
    time: (rows,) s, from the beginning of the scene, or on the clock of a camera, whose offset `compare.fit`
        finds.
    control: (rows,) of the scene, in its own unit; of states at rest what they are measured over.
    height, slope: (rows,) z(1/2), and the z-component of the unit tangent there.
    load: (rows,) compressive force along x, averaged along the ribbon.
    midspan_x, midspan_y: (rows,) where the middle of the ribbon is, from the left clamp.
    reactions: columns (rows,) by name, "force_left_x" to "moment_right_z": of a clamp on the ribbon.
    snap, first_snap: the control at which the height is first that of the clamps, and at which the tangent at
        midspan is first level.
    snap_time: s, of the snap, on the clock of `time`.
    folds: the controls at which a very slow ramp snaps, in order; NaN for one that was not measured.
    uncertainty: one standard deviation, in the unit of the quantity: a number where one quantity is measured,
        or a mapping of names to numbers or columns.  What is left out is estimated, by `compare.fit`, from
        what its fit leaves.  `time` counts as exact; `control` of states at rest, where nothing is said, as a
        hundred times as well known as the rest, beside their ranges.
    units: of quantities that are not in those of the results (L, EI2/L^2, EI2/L, rad, s), by name: "m", "mm";
        "N", "mN"; "N m", "N mm"; "deg"; "ms", "min".  SI is converted with the ribbon that is fitted, so that
        a force in N tells its modulus.

    Raises
    ------
    SceneError
        Naming the field, its value and what is allowed.

    Examples
    --------
    >>> height = (34.8, 34.1, float("nan"))
    >>> Measured(time=(0, 0.1, 0.2), height=height, units={"height": "mm"}, uncertainty=0.5)
    Measured(height of 3 rows over time, 1 missing, +- 0.5 mm)
    """

    time: Any = None
    control: Any = None
    height: Any = None
    slope: Any = None
    load: Any = None
    midspan_x: Any = None
    midspan_y: Any = None
    reactions: Mapping[str, Any] = field(default_factory=dict)
    snap: float | None = None
    first_snap: float | None = None
    snap_time: float | None = None
    folds: Any = None
    uncertainty: Any = None
    units: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in ("time", *ROWS, "folds"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, _numbers(name, getattr(self, name)))
        for name in ("reactions", "units"):
            if not isinstance(getattr(self, name), Mapping):
                raise SceneError(
                    f"Measured.{name} = {shown(getattr(self, name))}: a mapping by name is needed"
                )
        for name in self.reactions:
            if name not in REACTIONS:
                raise SceneError(f"Measured.reactions: {shown(name)} is none of {', '.join(REACTIONS)}")
        reactions = {name: _numbers(f"reactions[{name!r}]", each) for name, each in self.reactions.items()}
        object.__setattr__(self, "reactions", reactions)
        for name in ("snap", "first_snap", "snap_time"):
            value = getattr(self, name)
            if value is not None:
                plain = value.item() if isinstance(value, np.generic) else value
                object.__setattr__(self, name, field_number("Measured", name, plain))
        self._require_rows()
        self._require_units()
        object.__setattr__(self, "uncertainty", self._deviations())
        super().__post_init__()

    def _require_rows(self) -> None:
        measured = self.columns
        rows = {name: len(column) for name, column in measured.items()}
        if self.time is not None:
            rows = {"time": len(self.time), **rows}
        for name, count in rows.items():
            first = next(iter(rows))
            if count != rows[first]:
                raise SceneError(
                    f"Measured.{name}: {count} rows, and {first} has {rows[first]}; as many are needed"
                )
        if self.time is None and measured:
            if self.control is None:
                raise SceneError(
                    f"Measured.{next(iter(measured))}: is measured over nothing: time is needed, or control "
                    "of states at rest"
                )
            moving = [name for name in measured if name not in ("control", *AT_REST)]
            if moving:
                raise SceneError(
                    f"Measured.{moving[0]}: needs a time: of states at rest {', '.join(AT_REST)} are taken"
                )
        if not self.measured:
            raise SceneError(
                f"Measured: nothing is measured: {', '.join((*ROWS, 'reactions'))} over time, "
                f"{', '.join(AT_REST)} over control, or one of {', '.join(EVENTS)}"
            )

    def _require_units(self) -> None:
        for name, unit in self.units.items():
            if name not in _UNITS:
                raise SceneError(
                    f"Measured.units: {shown(name)} is no quantity; there are {', '.join(_UNITS)}"
                )
            if unit not in _UNITS[name]:
                raise SceneError(
                    f"Measured.units[{name!r}] = {shown(unit)}: must be one of {', '.join(_UNITS[name])}"
                )

    def _deviations(self) -> dict[str, Any]:
        """Standard deviations by name."""
        given, names = self.uncertainty, self.measured
        if given is None:
            return {}
        if not isinstance(given, Mapping):
            if len(names) > 1:
                raise SceneError(
                    f"Measured.uncertainty = {shown(given)}: whose, of {', '.join(names)}? A mapping by name "
                    "is needed"
                )
            given = {names[0]: given}
        allowed = names if self.time is not None or self.control is None else (*names, "control")
        for name in given:
            if name not in allowed:
                raise SceneError(f"Measured.uncertainty: {shown(name)} is none of {', '.join(allowed)}")
        return {name: self._deviation(name, value) for name, value in given.items() if value is not None}

    def _deviation(self, name: str, value: object) -> float | Array:
        """The standard deviation of a quantity; where its value is missing, this may be too."""
        values = self.values(name)
        try:
            deviation = np.array(value, dtype=float)
            there = np.broadcast_to(deviation, values.shape)[np.isfinite(values)]
        except (TypeError, ValueError):
            there = np.array([np.nan])
        if not (np.isfinite(there) & (there > 0.0)).all():
            raise SceneError(
                f"Measured.uncertainty[{name!r}] = {shown(value)}: a standard deviation is needed, a "
                f"positive finite number, or {len(values)} of them"
            )
        return float(deviation) if deviation.ndim == 0 else deviation

    @property
    def columns(self) -> dict[str, Array]:
        """What has rows, by name; `time` aside."""
        given = {name: getattr(self, name) for name in ROWS}
        return {name: column for name, column in (given | dict(self.reactions)).items() if column is not None}

    @property
    def measured(self) -> tuple[str, ...]:
        """The names of what a fit compares: of states at rest not the control."""
        rows = [name for name in self.columns if self.time is not None or name != "control"]
        return (*rows, *(name for name in EVENTS if getattr(self, name) is not None))

    def values(self, name: str) -> Array:
        """The values (rows,) of a quantity, in its unit."""
        given = self.reactions[name] if name in REACTIONS else getattr(self, name)
        return np.atleast_1d(np.asarray(given, dtype=float))

    def unit(self, name: str, control: str = "rad") -> str:
        """The unit of a quantity; `control` is that of the scene's."""
        if name in self.units:
            return self.units[name]
        if name in ("snap", "first_snap", "folds"):
            return self.unit("control", control)
        return control if name == "control" else _UNITS[name][0]

    @property
    def missing(self) -> dict[str, int]:
        """How many rows of a quantity are NaN, or have no time; by name, where there are any."""
        over = self.time if self.time is not None else self.control
        counts = {}
        for name in self.measured:
            lost = np.isnan(self.values(name))
            if name in self.columns:
                lost = lost | np.isnan(over)
            if lost.any():
                counts[name] = int(lost.sum())
        return counts

    def __repr__(self) -> str:
        over = "control, at rest" if self.time is None else "time"
        parts = []
        for name in self.measured:
            unit = self.unit(name, "")
            count = f" of {len(self.values(name))} rows over {over}" if name in self.columns else ""
            lost = f", {self.missing[name]} missing" if name in self.missing else ""
            deviation = self.uncertainty.get(name)
            spread = (
                "" if deviation is None else " +- a column" if np.ndim(deviation) else f" +- {deviation:g}"
            )
            value = "" if name in self.columns else " " + ", ".join(f"{x:g}" for x in self.values(name))
            end = f" {unit}".rstrip() if value or spread else ""
            parts.append(f"{name}{count}{lost}{',' if count and spread else ''}{value}{spread}{end}")
        return f"Measured({'; '.join(parts)})"

    @classmethod
    def from_csv(
        cls,
        path: str | Path,
        *,
        units: Mapping[str, str] | None = None,
        uncertainty: Any = None,
        **columns: str | int,
    ) -> Measured:
        """The rows of a file: of a motion, or of states at rest.

        Parameters
        ----------
        path: of a file of columns, separated by commas, semicolons or tabs; their names stand in the first
            row, or in a comment (#) above the numbers.  Cells that are empty or "nan" are missing.
        columns: of each quantity its column, by name or number from 0: ``time="t (s)", height="z"``;
            reactions by their own names.  Where none is given, those that are named as quantities are, with
            their unit or without: "time (ms)", "force_left_x (N)".
        units: as of a `Measured`; what is left out is in the unit that the name of its column ends with.
        uncertainty: as of a `Measured`; a standard deviation may be the name of a column too.

        Raises
        ------
        SceneError
            If a column or a unit is not there, or two columns are named as one quantity, or a cell holds no
            number; names the line.
        OSError
            If the file cannot be read.
        """
        what, allowed = "Measured.from_csv", ("time", *ROWS, *REACTIONS)
        for name, column in columns.items():
            if name not in allowed:
                raise SceneError(f"{what}: {name} = {shown(column)}: must be one of {', '.join(allowed)}")
        if not isinstance(units, (Mapping, type(None))):
            raise SceneError(f"{what}: units = {shown(units)}: a mapping by name is needed")
        given, heads = dict(units or {}), headings(path, what)
        own = not columns
        for heading in heads if own else ():
            name = HEADING.fullmatch(heading)[1]  # type: ignore[index]
            if name in columns:
                raise SceneError(
                    f"{what}: {path}: {columns[name]!r} and {heading!r} are both {name}: say which, by "
                    f"{name} = its name or number"
                )
            if name in allowed:
                columns[name] = heading
        for name, column in columns.items():
            numbered = isinstance(column, int) and 0 <= column < len(heads)
            unit = HEADING.fullmatch(heads[column] if numbered else str(column))[2]  # type: ignore[index]
            # (what a name has in brackets may be something else)
            if unit and (own or unit in _UNITS[name]):
                given.setdefault(name, unit)
        if not columns:
            there, first = (", ".join(heads), heads[0]) if heads else ("no names", 0)
            raise SceneError(
                f"{what}: {path}: no column is headed as a quantity; there are {there}. Head them "
                f"'time (ms)', 'height (mm)', ..., or say in Python which they are: time={first!r}, ..."
            )
        spread = uncertainty if isinstance(uncertainty, Mapping) else {"": uncertainty}
        wide = {name: column for name, column in spread.items() if isinstance(column, str)}
        table = read_columns(path, (*columns.values(), *wide.values()), what, missing=True)
        rows = dict(zip((*columns, *(f"+- {name}" for name in wide)), table.T, strict=True))
        deviations = {name: rows.pop(f"+- {name}", value) for name, value in spread.items()}
        return cls(
            reactions={name: rows.pop(name) for name in REACTIONS if name in rows},
            uncertainty=deviations if isinstance(uncertainty, Mapping) else deviations[""],
            units=given,
            **rows,
        )


def in_own_units(unit: str, ribbon: Ribbon) -> float:
    """How many of the results' units (L, EI2/L^2, EI2/L, rad, s) a unit is, of a ribbon."""
    length, stiffness = ribbon.length, ribbon.bending_stiffness
    newton = length**2 / stiffness
    return {
        "m": 1.0 / length,
        "mm": 1e-3 / length,
        "N": newton,
        "mN": 1e-3 * newton,
        "N m": newton / length,
        "N mm": 1e-3 * newton / length,
        "deg": math.pi / 180.0,
        "ms": 1e-3,
        "min": 60.0,
    }.get(unit, 1.0)
