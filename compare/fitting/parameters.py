"""What can be varied in a fit: fields of scenes and ribbons, presets, and a clock's offset; their bounds."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from typing import Any

from ribbonfem import Scene
from ribbonfem.drive import CONTROLS
from ribbonfem.options import interval, refuse
from ribbonfem.scene import shown
from ribbonfem.scene_numbers import presets_of, with_numbers

INF = math.inf
# what the fields allow: ends are left out where a field must not be there, as a fit never quite reaches them
_SCENE = {
    "compression": (0.0, 1.0),
    "shear": (-1.0, 1.0),
    "rate": (0.0, INF),
    "stop": (0.0, INF),
    "hold": (0.0, INF),
    "damping": (0.0, INF),
}
_RIBBON = {
    **dict.fromkeys(("length", "width", "thickness", "young", "density"), (0.0, INF)),
    "poisson": (-1.0, 0.5),
    **dict.fromkeys(("bending_ratio", "twist_ratio"), (0.0, INF)),
    **dict.fromkeys(("curvature", "twist"), (-INF, INF)),
    "retardation": (0.0, INF),
}
# fields that take the sign of what they are
_SIGNED = ("rate", "stop")
# of t*, or of 1 / L or L: how small a change counts where a field is 0, or nearly so
_LEAST = {"damping": 0.5, "hold": 0.1, "retardation": 0.01, "curvature": 0.1, "twist": 0.1, "shear": 0.01}
_OF_OFFSET, _OF_PRESET = 0.1, 0.01


@dataclass(frozen=True)
class Parameter:
    """One number that is varied.

    Attributes
    ----------
    name: as it was asked for.
    owner, key: "scene", "ribbon" or "preset" and a field, or "offset" and the number of a record.
    start: where it begins.
    least: how small a change of it counts, in its own unit.
    low, high: bounds.
    """

    name: str
    owner: str
    key: str | int
    start: float
    least: float
    low: float
    high: float

    @property
    def scale(self) -> float:
        """What it is counted in: itself where it begins; of an offset, which has no zero, `least`."""
        return self.least if self.owner == "offset" else self.size(self.start)

    @property
    def one_sign(self) -> bool:
        """Whether it is of one sign."""
        return self.low >= 0.0 or self.high <= 0.0

    def size(self, value: float) -> float:
        """What a small change of it is small against, at a value."""
        return self.least if self.owner == "offset" else max(abs(value), self.least)


def parameters_of(scenes: Sequence[Scene], vary: object, clocks: Sequence[int]) -> tuple[Parameter, ...]:
    """The parameters that `vary` names, for scenes that share them; an offset for each with a clock.

    Raises
    ------
    OptionError
        For a name that there is not or that cannot be varied, a bound that cannot be.
    """
    if isinstance(vary, str):
        vary = (vary,)
    if isinstance(vary, Mapping):
        limits = dict(vary)
    elif isinstance(vary, Sequence) and all(isinstance(name, str) for name in vary):
        limits = dict.fromkeys(vary)
        if len(limits) < len(vary):
            refuse("vary", vary, "each name once")
    else:
        refuse("vary", vary, "names are needed, or a mapping of names to bounds (low, high), or None")
    result: list[Parameter] = []
    for name, bounds in limits.items():
        for parameter in _named(scenes, name, clocks):
            result.append(_bounded(parameter, bounds))
            if (twin := next((p for p in result[:-1] if _place(p) == _place(parameter)), None)) is not None:
                refuse("vary", tuple(limits), f"{twin.name!r} and {name!r} are the same")
    if not result:
        refuse("vary", vary, f"one of {', '.join(names_of(scenes[0]))} at least")
    return tuple(result)


def _place(parameter: Parameter) -> tuple[str, str | int]:
    return parameter.owner, parameter.key


def names_of(scene: Scene) -> tuple[str, ...]:
    """The names that can be varied of a scene."""
    return (*_SCENE, *_RIBBON, *presets_of(scene), "offset")


def _named(scenes: Sequence[Scene], name: object, clocks: Sequence[int]) -> list[Parameter]:
    """The parameter of a name: of an offset one a clock."""
    owner, _, key = name.rpartition(".") if isinstance(name, str) else ("", "", "")
    if key == "offset" and not owner:
        least = _OF_OFFSET * scenes[0].ribbon.inertial_time
        if not clocks:
            refuse("vary", name, "nothing was measured in time")
        names = ["offset"] if len(clocks) == 1 else [f"offset {k + 1}" for k in clocks]
        pairs = zip(names, clocks, strict=True)
        return [Parameter(each, "offset", k, 0.0, least, -INF, INF) for each, k in pairs]
    for group, fields in (("scene", _SCENE), ("ribbon", _RIBBON)):
        if key in fields and owner in ("", group):
            return [_field(scenes, str(name), group, key, fields[key])]
    if owner in ("", "preset") and key in CONTROLS:
        if any(key in scene.drives.moved for scene in scenes):
            refuse("vary", name, "the drive moves it: where it stands is no preset")
        value = _shared(scenes, str(name), [scene.preset.get(key, 0.0) for scene in scenes])
        return [Parameter(str(name), "preset", key, value, _OF_PRESET, -INF, INF)]
    known = names_of(scenes[0])
    near = get_close_matches(str(name), known, 1)
    meant = f"perhaps {near[0]!r} is meant; " if near else ""
    if "," in str(name):
        meant = "several names are given as a tuple; "
    refuse("vary", name, f"cannot be varied; {meant}there are {', '.join(known)}")


def _field(
    scenes: Sequence[Scene], name: str, group: str, key: str, allowed: tuple[float, float]
) -> Parameter:
    if key in ("rate", "stop", "hold") and any(scene.schedule is not None for scene in scenes):
        refuse("vary", name, "the schedule says how the control moves: it has no rate, stop and hold")
    owners: list[Any] = [scene if group == "scene" else scene.ribbon for scene in scenes]
    values = [getattr(owner, key) for owner in owners]
    if any(value is None for value in values):
        refuse("vary", name, f"the scene has none: give Scene.{key} to begin with")
    if any(isinstance(value, tuple) for value in values):
        refuse("vary", name, f"Ribbon.{key} varies along the ribbon: a number is needed to begin with")
    value = _shared(scenes, name, values)
    low, high = allowed
    if key in _SIGNED and value < 0.0:
        low, high = -high, -low
    ribbon = scenes[0].ribbon
    unit = dict.fromkeys(("curvature", "twist"), 1.0 / ribbon.length)
    unit |= dict.fromkeys(("hold", "retardation"), ribbon.inertial_time)
    unit["damping"] = 1.0 / ribbon.inertial_time
    least = _LEAST.get(key, 0.0) * unit.get(key, 1.0)
    return Parameter(name, group, key, value, least, low, high)


def _shared(scenes: Sequence[Scene], name: str, values: list[Any]) -> float:
    if any(value != values[0] for value in values):
        refuse(
            "vary", name, f"the scenes have {shown(tuple(values))}: what is varied is the same in all of them"
        )
    return float(values[0])


def _bounded(parameter: Parameter, bounds: object) -> Parameter:
    """With the bounds that were asked for, within those of the field."""
    if bounds is None:
        return parameter
    low, high = interval(f"vary[{parameter.name!r}]", bounds)
    if not parameter.low <= low < high <= parameter.high:
        refuse(f"vary[{parameter.name!r}]", bounds, f"must be within ({parameter.low:g}, {parameter.high:g})")
    if parameter.owner == "offset":
        return replace(parameter, low=low, high=high, start=min(max(0.5 * (low + high), low), high))
    if not low <= parameter.start <= high:
        refuse(f"vary[{parameter.name!r}]", bounds, f"the scene begins at {parameter.start:g}, outside")
    return replace(parameter, low=low, high=high)


def applied(scene: Scene, parameters: Sequence[Parameter], values: Sequence[float]) -> Scene:
    """The scene with these values of the parameters.

    Raises
    ------
    SceneError
        For values that cannot be.
    """
    pairs = zip(parameters, values, strict=True)
    return with_numbers(scene, {f"{p.owner}.{p.key}": value for p, value in pairs if p.owner != "offset"})


def offset_of(parameters: Sequence[Parameter], values: Sequence[float], record: int) -> float:
    """The offset (s) of a record's clock; 0 where it is not varied."""
    pairs = zip(parameters, values, strict=True)
    return next((float(x) for p, x in pairs if p.owner == "offset" and p.key == record), 0.0)
