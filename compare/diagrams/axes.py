"""Axes of a diagram: a number of the scene that varies, and the cells along it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, cast

import numpy as np

from ribbonfem import Scene
from ribbonfem.drive import NAMED
from ribbonfem.options import OptionError, choice, number, positive, whole_number
from ribbonfem.results import Array
from ribbonfem.scene_numbers import presets_of, with_numbers

# numbers of a scene and of its ribbon, and what each is drawn as
OF_SCENE = {
    "rate": "rate",
    "damping": r"damping $\nu$",
    "compression": "dL/L",
    "shear": "dW/L",
    "stop": "stop",
}
OF_RIBBON = {
    "length": "length",
    "width": "width",
    "thickness": "thickness",
    "young": "Young's modulus",
    "density": "density",
    "bending_ratio": "EI1/EI2",
    "twist_ratio": "GJ/EI2",
    "curvature": "natural curvature",
    "twist": "natural twist",
}
_UNITS = {
    "damping": "1/s",
    **dict.fromkeys(("length", "width", "thickness"), "m"),
    "young": "Pa",
    "density": "kg/m3",
    "curvature": "1/m",
    "twist": "rad/m",
}
# what is as long from 1 to 2 as from 2 to 4
_LOGARITHMIC = ("rate", "damping", *list(OF_RIBBON)[:7])
# coordinates of an axis that is not: a spacing of its cells is this much, as that of some ten a decade
_SPACING = 0.25
# of the values, a part that rounding leaves to the hundred parts of a cell in which changes are looked for
_NARROWEST = 1e-9


@dataclass(frozen=True)
class Axis:
    """A number that varies over a diagram, in cells around values at equal distances in its coordinate.

    The coordinate is the logarithm of what is counted by factors, and in proportion to all else.

    Attributes
    ----------
    name: of the number: a field of a `Scene` or of its `Ribbon`, or a control that is preset.
    values: (n,) centres of the cells, two at least.
    """

    name: str
    values: Array

    @property
    def logarithmic(self) -> bool:
        """Whether cells are counted by factors."""
        return self.name in _LOGARITHMIC

    @property
    def _step(self) -> float:
        return (float(self.values[-1]) - float(self.values[0])) / (len(self.values) - 1)

    @property
    def spacing(self) -> float:
        """Of the cells, in the coordinate."""
        if not self.logarithmic:
            return _SPACING
        return math.log(self.values[-1] / self.values[0]) / (len(self.values) - 1)

    def coordinate(self, value: Any) -> Any:
        """Of a value, or of several."""
        return np.log(value) if self.logarithmic else np.asarray(value) * (_SPACING / self._step)

    def value(self, coordinate: Any) -> Any:
        """The value at a coordinate, or at several."""
        return np.exp(coordinate) if self.logarithmic else np.asarray(coordinate) * (self._step / _SPACING)

    def moved(self, value: float, by: Any) -> Any:
        """A value moved by so much of the coordinate, or by several."""
        return value * np.exp(by) if self.logarithmic else value + np.asarray(by) * (self._step / _SPACING)

    @property
    def edges(self) -> Array:
        """(n + 1,) values at the ends of the cells."""
        x = self.coordinate(self.values)
        half = 0.5 * self.spacing
        return np.asarray(self.value(np.append(x - half, x[-1] + half)))

    def cell_of(self, value: float) -> int | None:
        """The cell that a value lies in; None outside."""
        off = np.abs(self.coordinate(self.values) - self.coordinate(value))
        k = int(np.argmin(off))
        return k if off[k] <= 0.5 * self.spacing * (1.0 + 1e-9) else None


def axis_of(name: str, given: object, called: str) -> Axis:
    """An axis given as (low, high, count); `called` is the keyword that errors name.

    Raises
    ------
    OptionError
        If that is no such thing.
    """
    try:
        parts = tuple(cast(Any, given))
    except TypeError:
        parts = ()
    if len(parts) != 3:
        raise OptionError(f"{called} = {given!r}: (low, high, count) is needed, as (0.01, 1.0, 20)")
    checked = positive if name in _LOGARITHMIC else number
    low, high = checked(f"{called}[0]", parts[0]), checked(f"{called}[1]", parts[1])
    count = whole_number(f"{called}[2]", parts[2], 2, 1000)
    if not low < high:
        raise OptionError(f"{called} = {given!r}: low must be below high")
    if not high - low > _NARROWEST * (count - 1) * max(abs(low), abs(high)):
        raise OptionError(
            f"{called} = {given!r}: a cell must be wider than {_NARROWEST:g} of the values, as changes are "
            "looked for inside"
        )
    share = np.arange(count) / (count - 1)
    if name in _LOGARITHMIC:
        return Axis(name, low * np.exp(math.log(high / low) * share))
    return Axis(name, low + (high - low) * share)


def numbers_of(scene: Scene) -> tuple[str, ...]:
    """The names of the numbers that may vary in a scene."""
    return (*OF_SCENE, *OF_RIBBON, *presets_of(scene))


def axes_of(scene: Scene, over: object) -> tuple[Axis, Axis]:
    """The two axes of a mapping of names to (low, high, count), across first.

    Raises
    ------
    OptionError
        For what is no such mapping; names that a scene does not have, or that move in it.
    SceneError
        For a scene that cannot be at a corner.
    """
    if not isinstance(over, Mapping) or len(over) != 2:
        raise OptionError(
            f"over = {over!r}: two numbers of the scene are needed, as "
            "{'shear': (0.3, 0.4, 11), 'rate': (0.01, 1.0, 20)}"
        )
    for name in over:
        choice("over", name, numbers_of(scene))
    across, up = (axis_of(name, given, f"over[{name!r}]") for name, given in over.items())
    for x in across.values[[0, -1]]:
        for y in up.values[[0, -1]]:
            with_numbers(scene, {across.name: float(x), up.name: float(y)})
    return across, up


def unit_of(name: str, scene: Scene) -> str:
    """The unit of a number of a scene; empty of one that has none."""
    if name in ("rate", "stop"):
        return f"{scene.drives.unit or '1'}/s" if name == "rate" else scene.drives.unit
    return NAMED[name].unit if name in presets_of(scene) else _UNITS.get(name, "")


def label(name: str, scene: Scene) -> str:
    """What stands at an axis that is drawn; of the rate what is driven, where it is not the left clamp."""
    text, unit = {**OF_SCENE, **OF_RIBBON}.get(name, name.replace("_", " ")), unit_of(name, scene)
    if name == "rate" and scene.drive == "left":
        text += r" $\dot\alpha$"
    elif name == "rate":
        moved = ", ".join(f"{by:g} {what}" if by != 1.0 else what for what, by in scene.drives.moved.items())
        text += f" of {scene.drive if isinstance(scene.drive, str) else moved}"
    return f"{text} ({unit})" if unit else text
