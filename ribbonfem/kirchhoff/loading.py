"""Equations by which presets, weight and natural shape are brought on, from a bare state to the start."""

from __future__ import annotations

from copy import copy
from dataclasses import replace

import numpy as np

from ribbonfem.continuation import Linearisation, parameter_weight
from ribbonfem.ends import Ends
from ribbonfem.results import Array
from ribbonfem.scene import Scene

from .problem import Frames, Statics

# step of differences in the share of what acts
_SHARE = 1e-5


class Loading(Statics):
    """The equations of a scene's start in the share of what acts there besides dL and dW.

    Presets, weight, natural shape and where the control starts come on in proportion, from 0 to 1.
    """

    def __init__(self, problem: Statics, scene: Scene) -> None:
        vars(self).update(vars(problem))
        ends = problem.ends
        controls = ends.controls(scene.begin)
        self._weight = ends.weight
        self.ends = Ends(np.zeros_like(controls), controls, ends.chord, np.zeros(3))
        self.loaded = True
        size = float(np.linalg.norm(self._weight)) + 10.0 * float(np.abs(self.natural).max())
        self.parameter_weight = parameter_weight(np.append(controls[:7], controls[7] + size))

    def loads(self, parameter: float) -> Array:
        """As of `Statics`, with a share of the weight."""
        points = self.tables.points[:, :, None]
        return np.asarray(super().loads(parameter) + (1.0 - points) * (parameter * self._weight))

    def unbent(self, parameter: float) -> Array:
        """As of `Statics`, of a share of the natural shape."""
        return parameter * self.natural

    def unbent_groups(self, parameter: float) -> Array:
        """The same for groups of elements."""
        return parameter * self._natural_groups

    def linearise(self, state: Frames, parameter: float) -> Linearisation:
        """As of `Statics`; the derivative in the share by central differences: it predicts, and no more."""
        line = super().linearise(state, parameter)
        sides = [self._residual(state, parameter + h) for h in (-_SHARE, _SHARE)]
        change = line.slope + (sides[1] - sides[0]) / (2.0 * _SHARE)
        return Linearisation(line.residual, change, line.solve, line.index)

    def _residual(self, state: Frames, parameter: float) -> Array:
        """With the clamps and the force where they are: `Statics` has derived those."""
        there = copy(self)
        there.ends = replace(
            self.ends, fixed=self.ends.controls(state.at), moved=np.zeros_like(self.ends.moved)
        )
        return Statics.assembled(there, state, parameter)[0]
