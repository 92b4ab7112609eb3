"""The eight controls (turn, twist and place of the clamps, a force), and the `Drive` that moves them.

    left, right              turn of a clamp, rad, > 0 down: t(0) = (cos, 0, -sin), t(L) = (cos, 0, +sin)
    twist_left, twist_right  about the clamp's own tangent, rad, right-handed about +x at rest
    compression, shear       added to dL/L and dW/L
    lift                     of the right clamp along z, in L
    force                    dead, along -z at midspan, EI2/L^2

R(0) = Ry(left) Rx(twist_left) Rref, R(L) = Ry(-right) Rx(twist_right) Rref: at an unturned clamp the normal
m1 is +z, m2 is -y and m3 is +x.  The right clamp is at x = L - dL, y = -dW, z = lift.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from .frozen import Frozen
from .ribbon import SceneError, answers_unknown, field_number, shown

Array = NDArray[np.float64]

CONTROLS = ("left", "right", "twist_left", "twist_right", "compression", "shear", "lift", "force")
TURNS = ("left", "right")
TWISTS = ("twist_left", "twist_right")
LENGTHS = ("compression", "shear", "lift")
# those that change their sign in the mirror image z -> -z
ODD = ("left", "right", "twist_left", "twist_right", "lift", "force")
# part of what the chord allows as far as which a length is followed without a stop; and of a force, EI2/L^2
_FEASIBLE, _FORCE = 0.98, 100.0


@answers_unknown
@dataclass(frozen=True, kw_only=True)
class Drive:
    """What moves by how much while the control moves by 1; what is 0 does not move.

    Raises
    ------
    SceneError
        If nothing moves, or a field is no finite number; for a control that there is not.

    Examples
    --------
    >>> Drive(left=1, right=0.5)
    Drive(left=1.0, right=0.5)
    """

    left: float = 0.0
    right: float = 0.0
    twist_left: float = 0.0
    twist_right: float = 0.0
    compression: float = 0.0
    shear: float = 0.0
    lift: float = 0.0
    force: float = 0.0

    def __post_init__(self) -> None:
        for name in CONTROLS:
            object.__setattr__(self, name, field_number("Drive", name, getattr(self, name)))
        if not self.moved:
            raise SceneError(
                f"Scene.drive = Drive(): nothing moves; one of {', '.join(CONTROLS)} must not be 0"
            )

    def __repr__(self) -> str:
        return f"Drive({', '.join(f'{name}={value!r}' for name, value in self.moved.items())})"

    @property
    def moved(self) -> dict[str, float]:
        """The controls that move, and by how much."""
        return {item.name: value for item in fields(self) if (value := getattr(self, item.name))}

    @property
    def kind(self) -> str:
        """What the scalar is: "turn" of clamps, "twist", "length", "force" or "mixed"."""
        moved = set(self.moved)
        kinds = {"turn": TURNS, "twist": TWISTS, "length": LENGTHS, "force": ("force",)}
        return next((kind for kind, names in kinds.items() if moved <= set(names)), "mixed")

    @property
    def reversed_by_mirror(self) -> bool:
        """Whether the control changes its sign in the mirror image z -> -z: if something that moves does."""
        return any(name in ODD for name in self.moved)

    @property
    def mirror(self) -> Drive:
        """What moves in the mirror image, by a control of the other sign if that is reversed."""
        back = self.reversed_by_mirror
        return Drive(**{name: by if (name in ODD) == back else -by for name, by in self.moved.items()})

    def reach(self, chord: Array, change: Array) -> float:
        """How far the control is followed to one side where nothing says how far: a magnitude, from 0.

        Three turns of clamps and twists, 100 EI2/L^2 of a force, .98 of what the chord allows of lengths.

        Parameters
        ----------
        chord, change: (3,) r(L) - r(0) at 0, in L, and what it becomes more while the control moves by 1.
        """
        far = [
            (_FORCE if name == "force" else 6.0 * math.pi) / abs(by)
            for name, by in self.moved.items()
            if name not in LENGTHS
        ]
        if change.any():
            # |chord + x change| = 1
            a, b, c = change @ change, chord @ change, chord @ chord - 1.0
            far.append(float(_FEASIBLE * (-b + math.sqrt(b * b - a * c)) / a))
        return min(far)

    @property
    def unit(self) -> str:
        """The unit of the scalar."""
        return {"turn": "rad", "twist": "rad", "length": "L", "force": "EI2/L^2", "mixed": ""}[self.kind]


# drives that have a name of their own
NAMED = {name: Drive(**{name: 1.0}) for name in CONTROLS} | {
    "both": Drive(left=1.0, right=1.0),
    "opposed": Drive(left=1.0, right=-1.0),
}
_NAMES = {drive: name for name, drive in NAMED.items()}


def as_drive(value: object) -> str | Drive:
    """A `Scene.drive`: its name where it has one.

    Raises
    ------
    SceneError
        Naming the value, and the names that there are.
    """
    if isinstance(value, str) and value in NAMED:
        return value
    if isinstance(value, Mapping):
        unknown = [name for name in value if name not in CONTROLS]
        if unknown:
            raise SceneError(
                f"Scene.drive = {shown(value)}: {unknown[0]!r} is no control; there are {', '.join(CONTROLS)}"
            )
        value = Drive(**value)
    if not isinstance(value, Drive):
        raise SceneError(f"Scene.drive = {shown(value)}: a Drive is needed, or one of {', '.join(NAMED)}")
    return _NAMES.get(value, value)


def as_preset(value: object, drive: Drive) -> Frozen[str, float]:
    """A `Scene.preset`: where controls that do not move stand; zeros are left out.

    Raises
    ------
    SceneError
        Naming a control that there is not, that moves, or whose value is no number.
    """
    if not isinstance(value, Mapping):
        raise SceneError(f"Scene.preset = {shown(value)}: a mapping of controls to numbers is needed")
    numbers = {}
    for name, given in value.items():
        if name not in CONTROLS:
            raise SceneError(f"Scene.preset: {shown(name)} is no control; there are {', '.join(CONTROLS)}")
        if name in drive.moved:
            raise SceneError(
                f"Scene.preset[{name!r}] = {shown(given)}: the drive moves it; where it starts is the "
                "schedule's first value"
            )
        numbers[name] = field_number("Scene.preset", name, given)
    # in one order, whatever was given
    return Frozen({name: numbers[name] for name in CONTROLS if numbers.get(name)})
