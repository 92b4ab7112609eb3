"""A second parameter of a scene, beside its control, and what it does to the ends."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ribbonfem.drive import CONTROLS, NAMED, TWISTS
from ribbonfem.options import choice, refuse
from ribbonfem.results import Array
from ribbonfem.scene import Scene

from . import Ends


@dataclass(frozen=True)
class SecondParameter:
    """A second parameter of a scene.

    Attributes
    ----------
    name: `over`.
    moved: (8,) what it moves, in the order of `drive.CONTROLS`.
    own: the scene's value of it.
    span: from where to where it is followed.
    """

    name: str
    moved: Array
    own: float
    span: tuple[float, float]

    @classmethod
    def of(
        cls, scene: Scene, over: object, span: tuple[float, float], planar: bool = False
    ) -> SecondParameter:
        """As `over` and `span` say, for a `planar` model or another one.

        Raises
        ------
        OptionError
            If it is no control, one that the drive moves, or one that leaves the plane; for a span without
            the scene's own value, or with a chord that is crossed or as long as the ribbon.
        """
        out, driven = ("shear", *TWISTS) if planar else (), scene.drives.moved
        free = [name for name, drive in NAMED.items() if not {*driven, *out} & {*drive.moved}]
        name = choice("over", over, tuple(NAMED if over in tuple(NAMED) else free))
        if name not in free:
            why = "it leaves the plane of this model" if name in out else "the drive moves that"
            refuse("over", name, f"{why}; there are {', '.join(map(repr, free))}")
        by = NAMED[name].moved
        values = {scene.preset.get(control, 0.0) / share for control, share in by.items()}
        if len(values) > 1:
            refuse("over", name, f"has no one value with preset = {dict(scene.preset)!r}")
        own = {"compression": scene.compression, "shear": scene.shear}.get(name, values.pop())
        moved = np.array([by.get(control, 0.0) for control in CONTROLS])
        result = cls(name, moved, own, span)
        if not span[0] <= own <= span[1]:
            refuse("span", span, f"must have {own:g} in it, the scene's own {name}")
        for end in span:
            x, y, z = result.ends(scene, end).reach(scene.begin)[0]
            if not (x > 0.0 and x * x + y * y + z * z < 1.0):
                refuse(
                    "span",
                    span,
                    f"at {name} = {end:g} the right clamp would be at ({x:g}, {y:g}, {z:g}) L: x has to be "
                    "> 0, and the chord shorter than the ribbon",
                )
        return result

    def ends(self, scene: Scene, value: float) -> Ends:
        """The ends in the scene's control, at a value of the parameter."""
        ends = Ends.of(scene)
        return replace(ends, fixed=ends.fixed + (value - self.own) * self.moved)
