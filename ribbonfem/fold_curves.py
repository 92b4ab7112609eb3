"""Results in two parameters: curves of folds and of pitchforks, and their points.

A fold of a curve of equilibria has a control; in a second parameter of the scene it becomes a curve in the
plane of both.  Two folds meet at a cusp: beyond it there is none.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.polynomial import Chebyshev
from numpy.typing import NDArray

from .drive import NAMED
from .equilibria import Array, Controlled, axis_of, caption, control_text, name_and_unit
from .frozen import called_later, html_table, short_options, some_rows
from .options import number, refuse
from .scene import Scene

# parts of a piece by which a root may lie beyond its ends, or two roots apart and be one; and of the range of
# the parameter, by which rounding may lead beyond it
_BESIDE, _BEYOND = 1e-6, 1e-9


def _told(control: float) -> float:
    """A control as it is printed: 0 where rounding has left something else."""
    return round(control, 12) + 0.0


@dataclass(frozen=True, repr=False, eq=False)
class CurvePoint(Controlled):
    """A point of a curve in two parameters.

    Attributes
    ----------
    kind: "fold", "pitchfork", "cusp" or "turn", where the curve turns back in the parameter.
    control, parameter: where the scene's control is, and the parameter `over`.
    height: z(1/2)/L there.
    load: compressive end force times L^2/EI2.
    over, scene, model: as of the curve.
    """

    kind: str
    control: float
    parameter: float
    height: float
    load: float
    over: str = ""
    scene: Scene | None = None
    model: str = ""

    def __repr__(self) -> str:
        return (
            f"CurvePoint({self.kind} at {control_text(self.scene, _told(self.control), '.9g')}, "
            f"{self.over or 'parameter'} {self.parameter:.9g}, z(1/2) {self.height:.9g} L)"
        )


@dataclass(frozen=True, repr=False, eq=False)
class _Curve(Controlled):
    """What curves of folds and of pitchforks have in common: see `FoldCurve`."""

    control: Array
    parameter: Array
    height: Array
    load: Array
    stable: NDArray[np.bool_]
    over: str
    turns: tuple[CurvePoint, ...]
    ends: tuple[str, str]
    arclength: Array
    degree: int
    error: float
    scene: Scene
    options: Mapping[str, Any] = field(default_factory=dict)
    model: str = ""

    # of its points
    kind: ClassVar[str] = ""

    def __len__(self) -> int:
        return len(self.control)

    @property
    def unit(self) -> str:
        """The unit of the parameter."""
        return NAMED[self.over].unit

    @cached_property
    def pieces(self) -> tuple[tuple[Chebyshev, ...], ...]:
        """Polynomials of parameter, control, height and load in the arclength, four a piece of the curve."""
        columns = self.parameter, self.control, self.height, self.load
        return tuple(
            tuple(
                Chebyshev.fit(
                    self.arclength[first : first + self.degree + 1],
                    column[first : first + self.degree + 1],
                    self.degree,
                )
                for column in columns
            )
            for first in range(0, len(self) - 1, self.degree)
        )

    def at(self, parameter: float) -> tuple[CurvePoint, ...]:
        """The points of the curve at a value of its parameter, along the curve; there may be several.

        By the polynomials of degree `degree` through its rows, which were found to be at most `error` off
        the curve.

        Raises
        ------
        OptionError
            If the curve has no such value; names those that it has.
        """
        value = number("parameter", parameter)
        values = [*self.parameter.tolist(), *(float(mark.parameter) for mark in self._marks)]
        low, high = min(values), max(values)
        within = _BEYOND * (high - low)
        if not low - within <= value <= high + within:
            refuse("parameter", parameter, f"{self.over} of the curve is in [{low:.9g}, {high:.9g}]")
        result: list[CurvePoint] = []
        last = -np.inf
        for parameters, *others in self.pieces:
            begin, end = parameters.domain
            beside = _BESIDE * (end - begin)

            def is_there(place: float, parameters: Chebyshev = parameters) -> bool:
                return bool(abs(parameters(place) - value) < within)

            # at a turn two roots are one, of which rounding makes two that are complex or apart
            roots = np.clip(np.sort(np.real((parameters - value).roots())), begin - beside, end + beside)
            for place in filter(is_there, roots.tolist()):
                if place - last > beside and not (last >= begin and is_there(0.5 * (last + place))):
                    control, height, load = (float(other(place)) for other in others)
                    where = control, value, height, load
                    result.append(CurvePoint(self.kind, *where, self.over, self.scene, self.model))
                last = place
        return tuple(result)

    @property
    def _marks(self) -> tuple[CurvePoint, ...]:
        """Points to be told apart."""
        return self.turns

    def __repr__(self) -> str:
        name, unit = name_and_unit(self.scene)
        columns = (self.over, self.parameter, self.unit), (name, self.control, unit)
        spans = ", ".join(f"{n} {v.min():.6g} .. {v.max():.6g} {u}".rstrip() for n, v, u in columns)
        marks = "".join(
            f"  {mark.kind} at {self.over} {mark.parameter:.9g}, "
            f"{control_text(self.scene, _told(mark.control))};\n"
            for mark in self._marks
        )
        return (
            f"{type(self).__name__}({self.model}, {len(self)} points, {spans}, "
            f"{int(np.count_nonzero(self.stable))} stable;\n{marks}  {short_options(self.options)})"
        )

    def _repr_html_(self) -> str:
        unit = f" ({self.unit})" if self.unit else ""
        columns = ("", f"{self.over}{unit}", axis_of(self.scene), "z(1/2)/L", "load (EI2/L^2)")
        rows: list[list[Any]] = [
            [mark.kind, float(mark.parameter), float(mark.control), float(mark.height), float(mark.load)]
            for mark in self._marks
        ]
        rows += [
            [self.kind] + [float(c[k]) for c in (self.parameter, self.control, self.height, self.load)]
            for k in some_rows(len(self), max(2, 12 - len(rows)))
        ]
        return html_table(caption(self), columns, rows)

    def plot(self, axes: Any = None, **options: Any) -> Any:
        """Draw it into axes of matplotlib, or new ones: see `ribbonfem.output.plots.two_parameters`."""
        return called_later("ribbonfem.output.plots:two_parameters", self, axes, **options)

    def to_pandas(self) -> Any:
        """As a `pandas.DataFrame`: see `ribbonfem.output.tables.curve_frame`."""
        return called_later("ribbonfem.output.tables:curve_frame", self)

    def to_xarray(self) -> Any:
        """As an `xarray.Dataset`: see `ribbonfem.output.tables.curve_dataset`."""
        return called_later("ribbonfem.output.tables:curve_dataset", self)


@dataclass(frozen=True, repr=False, eq=False)
class FoldCurve(_Curve):
    """Folds of a scene over a second parameter, one row a fold, in the order of the curve.

    Attributes
    ----------
    control: (rows,) of the scene, at the folds.
    parameter: (rows,) the value of `over`: dL/L and dW/L of "compression" and "shear", else where that
        control stands.
    height: (rows,) z(1/2)/L.
    load: (rows,) compressive end force times L^2/EI2.
    stable: (rows,) bool: whether the state that ends at the fold is stable up to it.
    over: name of the parameter.
    turns: where the curve turns back in the parameter, and not in the control.
    ends: why it ends at its first and at its last row: "span"; "reach", where the control is as far as it is
        followed; "closed", in itself.
    arclength, degree: (rows,) of the curve, and the degree of the polynomials in it, of so many rows and one
        each, by which `at` and plots interpolate.
    error: the most by which they were found to be off the curve between rows, in the plane of parameter and
        control; in rad, where 0.15 L and 30 EI2/L^2 count as much.
    scene, options, model: what it was made from.
    cusps: where two folds meet: control and parameter turn back at once.
    """

    cusps: tuple[CurvePoint, ...] = ()

    kind: ClassVar[str] = "fold"

    @property
    def _marks(self) -> tuple[CurvePoint, ...]:
        return (*self.cusps, *self.turns)


@dataclass(frozen=True, repr=False, eq=False)
class PitchforkCurve(_Curve):
    """Pitchforks of a scene over a second parameter that keeps their symmetry.

    Attributes are those of `FoldCurve`, without cusps; `stable`: whether the symmetric state is stable on one
    side.
    """

    kind: ClassVar[str] = "pitchfork"
