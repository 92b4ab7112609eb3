"""Boundary conditions at an instant: poses of both clamps, loads, and their rates, by a scene's controls.

The one place where a control becomes a clamp that is held somewhere.  Rotations are unit quaternions of the
rotation from the unturned clamp's frame: Ry(left) Rx(twist_left) and Ry(-right) Rx(twist_right).
"""

from __future__ import annotations

import math
from bisect import bisect_right
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ribbonfem.drive import CONTROLS
from ribbonfem.scene import Scene

from . import kernels

Array = NDArray[np.float64]


_Quaternion = tuple[float, float, float, float]


def _turn(angle: float, twist: float, by_angle: float, by_twist: float) -> tuple[_Quaternion, _Quaternion]:
    """Quaternion of Ry(angle) Rx(twist), and its derivative where the angles have these."""
    c, s = math.cos(0.5 * angle), math.sin(0.5 * angle)
    d, e = math.cos(0.5 * twist), math.sin(0.5 * twist)
    a, b = 0.5 * by_angle, 0.5 * by_twist
    rate = (-a * s * d - b * c * e, -a * s * e + b * c * d, a * c * d - b * s * e, -a * c * e - b * s * d)
    return (c * d, c * e, s * d, -s * e), rate


@dataclass(frozen=True, eq=False)
class Ends:
    """Controls as functions of one parameter, at rest.

    Attributes
    ----------
    fixed, moved: (8,) in the order of `drive.CONTROLS`: controls are fixed + parameter moved.
    chord: (3,) r(1) - r(0) in L, where all controls are 0.
    weight: (3,) per length, EI2/L^3.
    """

    fixed: Array
    moved: Array
    chord: Array
    weight: Array

    @classmethod
    def of(cls, scene: Scene, share: float = 1.0) -> Ends:
        """Of a scene, whose presets, weight and start count by a share."""
        drive, preset = scene.drives.moved, scene.preset
        return cls(
            share * np.array([preset.get(name, 0.0) for name in CONTROLS]),
            np.array([drive.get(name, 0.0) for name in CONTROLS]),
            np.array([1.0 - scene.compression, -scene.shear, 0.0]),
            share * np.array(scene.weight),
        )

    @classmethod
    def varying(cls, name: str, compression: float, shear: float) -> Ends:
        """Of a ribbon of which one control moves, or "dL" or "dW" itself, and nothing else acts."""
        moved = np.zeros(len(CONTROLS))
        own = {"dL": "compression", "dW": "shear"}.get(name, name)
        moved[CONTROLS.index(own)] = 1.0
        chord = np.array(
            [1.0 - (0.0 if name == "dL" else compression), -(0.0 if name == "dW" else shear), 0.0]
        )
        return cls(np.zeros(len(CONTROLS)), moved, chord, np.zeros(3))

    def controls(self, parameter: float) -> Array:
        """(8,)"""
        return self.fixed + self.moved * parameter

    def poses(self, parameter: float) -> tuple[Array, Array]:
        """Quaternions (2, 4) of both clamps, and their derivatives in the parameter; read-only."""
        kept = self._poses.get(parameter)
        if kept is None:
            f, m = self.numbers
            left = _turn(f[0] + m[0] * parameter, f[2] + m[2] * parameter, m[0], m[2])
            right = _turn(-f[1] - m[1] * parameter, f[3] + m[3] * parameter, -m[1], m[3])
            kept = np.array((left[0], right[0])), np.array((left[1], right[1]))
            for array in kept:
                array.flags.writeable = False
            # a state is moved to a parameter, and the equations are written there
            self._poses.clear()
            self._poses[parameter] = kept
        return kept

    def left(self, parameter: float) -> tuple[Array, Array]:
        """Quaternion (4,) of the left clamp, and its derivative in the parameter."""
        pose, rate = self.poses(parameter)
        return pose[0], rate[0]

    def right(self, parameter: float) -> tuple[Array, Array]:
        """The same of the right clamp."""
        pose, rate = self.poses(parameter)
        return pose[1], rate[1]

    @cached_property
    def _poses(self) -> dict[float, tuple[Array, Array]]:
        # the last ones
        return {}

    @cached_property
    def numbers(self) -> tuple[list[float], list[float]]:
        """`fixed` and `moved` as numbers: sums of few are quicker so."""
        return self.fixed.tolist(), self.moved.tolist()

    @cached_property
    def _rates(self) -> tuple[Array, Array]:
        # derivatives of the chord and of the force in the parameter
        by = self.moved
        return np.array([-by[4], -by[5], by[6]]), np.array([0.0, 0.0, -by[7]])

    @cached_property
    def pushes(self) -> bool:
        """Whether there is a weight, or a force at midspan, at some parameter."""
        return bool(self.weight.any() or self.fixed[7] or self.moved[7])

    def reach(self, parameter: float) -> tuple[Array, Array]:
        """r(1) - r(0) (3,) in L, and its derivative."""
        f, m = self.numbers
        x, y, z = (f[k] + m[k] * parameter for k in (4, 5, 6))
        return self.chord + (-x, -y, z), self._rates[0]

    def force(self, parameter: float) -> tuple[Array, Array]:
        """The dead force (3,) at midspan, EI2/L^2, and its derivative."""
        f, m = self.numbers
        return np.array((0.0, 0.0, -f[7] - m[7] * parameter)), self._rates[1]

    def height(self, parameter: float) -> float:
        """The mean height of both clamps, in L."""
        return 0.5 * float(self.controls(parameter)[6])


# change of the control in a step at most: of a turn (rad), a length (L), a force (EI2/L^2)
_LARGEST = np.array([0.05, 0.05, 0.05, 0.05, 0.015, 0.015, 0.015, 2.0])


def moving(scene: Scene, largest: float = 1.0, began: float = 0.0, part: float = 0.1) -> kernels.Ends:
    """The controls of a scene in time, for compiled loops.

    `largest` multiplies what a step may change; `part` is the most of the time between two kinks.  Time is
    counted from `began` (t*) on.
    """
    ends = Ends.of(scene)
    times, pieces, kinks = scene.motion
    if began:
        times, kinks = tuple(began + x for x in times), tuple(began + x for x in kinks)
    first = [bisect_right(times, instant) - 1 for instant in kinks]
    # steps, in a unit of the control, of what it moves most
    most = float(np.max(np.abs(ends.moved) / _LARGEST)) / largest
    steps = [most * _speed(times, pieces, a, b) for a, b in pairwise(first)]
    # (at rest steps are as long as they may)
    longest = [
        min(1.0 / count, part * (after - before)) if count > 0.0 else math.inf
        for count, (before, after) in zip(steps, pairwise(kinks), strict=True)
    ]
    return kernels.Ends(
        fixed=ends.fixed,
        moved=ends.moved,
        chord=ends.chord,
        weight=ends.weight,
        times=np.array(times),
        pieces=np.array(pieces),
        kinks=np.array(kinks),
        first=np.array(first, dtype=np.int64),
        reached=np.array([_value(times, pieces, instant) for instant in kinks]),
        longest=np.array(longest),
    )


def held(scene: Scene, control: float, duration: float, began: float = 0.0) -> kernels.Ends:
    """The controls of a scene that stay where they are for a while, in t*, from `began` on."""
    ends = Ends.of(scene)
    table = np.zeros((1, 6))
    table[0, 0] = control
    return kernels.Ends(
        fixed=ends.fixed,
        moved=ends.moved,
        chord=ends.chord,
        weight=ends.weight,
        times=np.array([began]),
        pieces=table,
        kinks=np.array([began, began + duration]),
        first=np.zeros(2, dtype=np.int64),
        reached=np.array([control, control]),
        longest=np.array([np.inf]),
    )


def _value(times: tuple[float, ...], pieces: tuple[tuple[float, ...], ...], instant: float) -> float:
    """The control at a kink: as its next polynomial has it."""
    k = min(bisect_right(times, instant) - 1, len(pieces) - 1)
    return pieces[k][0] if times[k] == instant else float(np.polyval(pieces[k][::-1], instant - times[k]))


def _speed(times: tuple[float, ...], pieces: tuple[tuple[float, ...], ...], first: int, last: int) -> float:
    """The largest speed of the control from one piece to another."""
    speed = 0.0
    for k in range(first, max(last, first + 1)):
        if not any(pieces[k][2:]):
            speed = max(speed, abs(pieces[k][1]))
            continue
        length = times[k + 1] - times[k] if k + 1 < len(times) else 0.0
        at = np.linspace(0.0, length, 9)
        speed = max(speed, float(np.abs(np.polyval(np.polyder(np.array(pieces[k][::-1])), at)).max()))
    return speed
