"""Boundary conditions and loads of a planar beam at rest, as functions of one parameter (`Rig`)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ribbonfem.drive import CONTROLS as ALL
from ribbonfem.results import Array
from ribbonfem.scene import Scene

from . import Ends
from .planar_kernels import CONTROLS, PLACES, PUSH

_PLACED = list(PLACES)


@dataclass(frozen=True)
class Rig:
    """What is done to a beam besides its compression.

    Attributes
    ----------
    controls: (CONTROLS,) where they stand at parameter 0 (`planar_kernels`), and `moves`, how they change
        with it.
    weight: (2,) along x and z, in EI2/L^3.
    curvature: (...) without a moment, 1/L, at points of the beam.
    share: of weight and curvature, at parameter 0 and its change.
    """

    controls: Array
    moves: Array
    weight: Array
    curvature: Array
    share: tuple[float, float] = (1.0, 0.0)

    @classmethod
    def of(cls, scene: Scene, points: Array) -> Rig:
        """What a scene's control does, and what acts besides; the natural curvature at these s/L."""
        ends = Ends.of(scene)
        curvature = scene.ribbon.natural(points)[0] if scene.ribbon.shaped else np.zeros(np.shape(points))
        return cls(ends.fixed[_PLACED], ends.moved[_PLACED], ends.weight[::2].copy(), curvature)

    def along(self, ends: Ends) -> Rig:
        """The same with other ends."""
        return replace(self, controls=ends.fixed[_PLACED], moves=ends.moved[_PLACED])

    def brought_on(self, begin: float) -> Rig:
        """In the share of all that acts where the control is at `begin`."""
        controls = self.controls + begin * self.moves
        return Rig(np.zeros(CONTROLS), controls, self.weight, self.curvature, (0.0, 1.0))

    @property
    def loaded(self) -> bool:
        """Whether there is a weight, a natural curvature or a force at midspan, at some parameter."""
        pushed = self.controls[PUSH] or self.moves[PUSH]
        return bool(pushed or self.weight.any() or self.curvature.any())

    def at(self, parameter: float) -> Array:
        """(CONTROLS,) at a value of the parameter."""
        moved: Array = self.controls + parameter * self.moves
        return moved

    @property
    def moved(self) -> Array:
        """(8,) what the parameter moves in the order of `drive.CONTROLS`, loads as a force."""
        moved = np.zeros(len(ALL))
        moved[_PLACED] = self.moves
        if self.share[1]:
            size = float(np.linalg.norm(self.weight)) + 10.0 * float(np.abs(self.curvature).max())
            moved[-1] += self.share[1] * size
        return moved
