"""The `Scene`: pre-deformation, drive, rate, loads and damping; the statement of the problem, checked.

The ribbon is clamped at both ends.  Its right clamp is moved to ``x = L - dL``, ``y = -dW`` and
kept; then one scalar, the control, moves what the scene's `Drive` says (`ribbonfem.drive`): by default the
left clamp, which turns about the y axis.  ``alpha > 0`` turns its tangent *down* (``t = [cos a, 0, -sin a]``)
and so drives a state with ``z > 0`` towards ``z < 0``; this is the sign of the paper's three-dimensional
boundary conditions (section 3.1), and the planar models follow it too.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Any

import numpy as np

from .control_in_time import Polynomials, first_passage, of_ramp, of_schedule
from .drive import CONTROLS, NAMED, ODD, Drive, as_drive, as_preset
from .frozen import Frozen
from .ribbon import Ribbon, SceneError, SceneWarning, as_number, field_number, refuse_unknown, shown
from .scene_checks import (
    RATE,
    are_isolated,
    as_gravity,
    as_schedule,
    as_start,
    as_stop,
    drive_of_turned,
    require_buckled,
    require_feasible,
    require_isolated,
    require_signs,
    require_slack,
    rig_in_words,
    warn_of_slips,
    what_leaves_plane,
)
from .schedule import Schedule
from .state_names import PLANAR_STATES, RIBBON_STATES, mirrored, swapped

__all__ = [
    "PLANAR_STATES",
    "RIBBON_STATES",
    "Drive",
    "Ribbon",
    "Scene",
    "SceneError",
    "SceneWarning",
    "Schedule",
    "as_number",
    "shown",
    "swapped",
]

_RIBBON = Ribbon()


@dataclass(frozen=True, kw_only=True, init=False, repr=False)
class Scene:
    """A pre-deformed ribbon, and what is moved, how and how far.

    At t = 0 the ribbon is at rest in the equilibrium `start`; the control's speed jumps to `rate`, and at
    `stop` it jumps back to 0.  Nothing is smoothed.  A `schedule` says the control in time instead.

    Parameters
    ----------
    compression:
        dL/L, in (0, 1).
    shear:
        dW/L, of either sign; the chord sqrt((1 - dL/L)^2 + (dW/L)^2) must be shorter than 1.
    start:
        The pre-deformed state: "U+" or "U-" without shear; with shear any of "U+S+", "U+S-",
        "U-S+", "U-S-", "U+", "U-", "S+", "S-".  Whether it is a stable equilibrium there is
        for the models to say.  It is named without presets, loads and natural shape; these are then
        increased from 0 together, at rest.
    drive:
        What the control moves: the name of a control ("left", "right", "twist_left", "twist_right",
        "compression", "shear", "lift", "force"), "both" (clamps turn down alike), "opposed", or a `Drive`.
    rate:
        Of the control, per s, of either sign, not zero; 0.1 if there is no schedule.
    stop:
        Of the control, with the sign of `rate`; None for the static functions, which need none.
    hold:
        s, how long the control is kept at `stop`.
    schedule:
        A `Schedule` of the control, instead of `rate`, `stop` and `hold`.
    preset:
        Where other controls stand, by name.
    gravity:
        (gx, gy, gz) in m/s2; None for none.
    damping:
        nu in 1/s: a force -nu M v.
    ribbon:
        The `Ribbon`.
    turned:
        Deprecated: ``turned="right"`` is ``drive="right"``.

    Raises
    ------
    SceneError
        Naming the field, its value and what is allowed.

    Warns
    -----
    SceneWarning
        Of angles that look like degrees; once of a ribbon whose weight counts, if `gravity` is not given.

    Examples
    --------
    >>> Scene(compression=0.40, shear=0.37, start="U+S-", stop=0.9).in_words
    'dL/L 0.4, dW/L 0.37, U+S-: 0.1 rad/s to 0.9 rad, nu 1 /s'
    >>> Scene(compression=2.0)
    Traceback (most recent call last):
    ribbonfem.ribbon.SceneError: Scene.compression = 2.0: must be in (0, 1)
    """

    compression: float = 0.40
    shear: float = 0.37
    start: str = "U+S+"
    drive: str | Drive = "left"
    rate: float = RATE
    stop: float | None = None
    hold: float = 0.0
    schedule: Schedule | None = None
    preset: Mapping[str, float] = field(default_factory=Frozen)
    gravity: tuple[float, float, float] | None = None
    damping: float = 1.0
    ribbon: Ribbon = _RIBBON

    def __init__(
        self,
        *,
        compression: float = 0.40,
        shear: float = 0.37,
        start: str = "U+S+",
        drive: str | Drive | Mapping[str, float] = "left",
        rate: float = RATE,
        stop: float | None = None,
        hold: float = 0.0,
        schedule: Schedule | None = None,
        preset: Mapping[str, float] | None = None,
        gravity: tuple[float, float, float] | None = None,
        damping: float = 1.0,
        ribbon: Ribbon = _RIBBON,
        turned: str | None = None,
        **unknown: object,
    ) -> None:
        refuse_unknown("Scene", unknown, [item.name for item in fields(Scene)])
        if turned is not None:
            drive = drive_of_turned(turned, drive)
        given = {"compression": compression, "shear": shear, "rate": rate, "hold": hold, "damping": damping}
        for name, value in given.items():
            self._set(name, field_number("Scene", name, value))
        self._set("ribbon", ribbon)
        if not isinstance(self.ribbon, Ribbon):
            raise SceneError(f"Scene.ribbon = {shown(ribbon)}: a Ribbon is needed")
        require_slack(self.compression, self.shear)
        self._set("start", as_start(start, self.shear))
        self._set("drive", as_drive(drive))
        self._set("preset", as_preset({} if preset is None else preset, self.drives))
        self._set("gravity", as_gravity(gravity))
        require_signs(self.rate, self.hold, self.damping)
        self._set("schedule", as_schedule(schedule, self.drives, self.drive, self.rate, stop, self.hold))
        self._set("stop", as_stop(stop, self.rate, self.drives))
        require_feasible(self.chord, self.schedule, self.stop, self.preset)
        warn_of_slips(self.stop, self.schedule, self.drives, self.gravity, self.ribbon)

    def _set(self, name: str, value: object) -> None:
        object.__setattr__(self, name, value)

    def __repr__(self) -> str:
        values = [(item.name, getattr(self, item.name), item.default) for item in fields(self)]
        quiet = {"drive", "schedule", "preset", "gravity"}
        if self.schedule is not None:
            quiet |= {"rate", "stop", "hold"}
        given = [
            f"{name}={dict(value) if name == 'preset' else value!r}"
            for name, value, usual in values
            if name not in quiet or (value if name == "preset" else value != usual)
        ]
        return f"Scene({', '.join(given)})"

    @property
    def in_words(self) -> str:
        """The scene in a line, for the caption of a table."""
        unit = self.drives.unit
        if self.schedule is not None:
            ends, last = self.schedule.value, self.schedule.time[-1]
            moves = f"schedule {ends[0]:g} .. {self.schedule.furthest:g} {unit}, {last:g} s"
        else:
            stop = "" if self.stop is None else f" to {self.stop:g} {unit}".rstrip()
            held = f", held for {self.hold:g} s" if self.stop is not None and self.hold else ""
            moves = f"{self.rate:g} {unit}/s{stop}{held}"
        where = f"dL/L {self.compression:g}, dW/L {self.shear:g}, {self.start}"
        return ", ".join((f"{where}: {moves}, nu {self.damping:g} /s", *self.rig))

    @property
    def rig(self) -> tuple[str, ...]:
        """What is driven, where not the left clamp is, presets, weight, a natural shape: a phrase each."""
        return rig_in_words(self.drive, self.preset, self.gravity, self.ribbon)

    @property
    def turned(self) -> str:
        """The clamp that turns, "left" or "right": the old name of `drive`.

        Raises
        ------
        SceneError
            Where something else moves.
        """
        if self.drive not in ("left", "right"):
            raise SceneError(f"Scene.turned: what moves is drive = {self.drive!r}")
        return str(self.drive)

    @cached_property
    def drives(self) -> Drive:
        """The `Drive` that `drive` names or is."""
        return self.drive if isinstance(self.drive, Drive) else NAMED[self.drive]

    @property
    def clamps_turn(self) -> bool:
        """Whether the control is an angle of clamps that turn, and nothing else moves."""
        return self.drives.kind == "turn"

    @property
    def begin(self) -> float:
        """Where the control is at the start."""
        return 0.0 if self.schedule is None else self.schedule.value[0]

    @property
    def direction(self) -> float:
        """The sign of the control's first change."""
        return math.copysign(1.0, self.rate) if self.schedule is None else self.schedule.direction

    @property
    def furthest(self) -> float | None:
        """How far a ramp goes: `stop`, or the schedule's extreme in its direction; None without either."""
        return self.stop if self.schedule is None else self.schedule.furthest

    def reach_towards(self, sign: float) -> float:
        """How far the control is followed to one side: as far as `Drive.reach` says, or the scene goes."""
        first = self.chord(0.0)
        goes = (self.stop or 0.0,) if self.schedule is None else self.schedule.extremes
        return max(self.drives.reach(first, sign * (self.chord(1.0) - first)), *(sign * end for end in goes))

    def controls(self, control: float) -> dict[str, float]:
        """Every control, by name, where the scalar is `control`; dL/L and dW/L are the scene's besides."""
        moved = self.drives.moved
        return {name: self.preset.get(name, 0.0) + moved.get(name, 0.0) * control for name in CONTROLS}

    def chord(self, control: float) -> Any:
        """r(L) - r(0), (3,) in L."""
        at = self.controls(control)
        return np.array([1.0 - self.compression - at["compression"], -self.shear - at["shear"], at["lift"]])

    def clamps_height(self, control: Any) -> Any:
        """The mean height of both clamps, in L: what the ribbon's is measured from."""
        return 0.5 * (self.preset.get("lift", 0.0) + self.drives.lift * control)

    @property
    def one_clamp(self) -> bool:
        """Whether one clamp turns, and nothing else moves or acts at rest."""
        return self.drive in ("left", "right") and not self.dressed

    @cached_property
    def usual(self) -> bool:
        """Whether one clamp turns at a constant rate, and nothing else moves, acts or retards."""
        return self.one_clamp and self.ribbon.retardation == 0.0 and self.schedule is None

    @cached_property
    def weight(self) -> tuple[float, float, float]:
        """Weight per length (wx, wy, wz), EI2/L^3."""
        x, y, z = (g * self.ribbon.weight_ratio for g in self.gravity or (0.0, 0.0, 0.0))
        return x, y, z

    @cached_property
    def plain(self) -> Scene:
        """The scene at rest without presets, loads and natural shape: where its `start` is named."""
        if not self.dressed:
            return self.at_rest
        ribbon = replace(self.ribbon, curvature=0.0, twist=0.0)
        still = replace(self, rate=1.0, stop=None, hold=0.0, damping=0.0, schedule=None)
        return replace(still, preset={}, gravity=(0.0, 0.0, 0.0), ribbon=ribbon)

    @property
    def dressed(self) -> bool:
        """Whether anything acts at the start besides dL and dW: presets, weight, a natural shape."""
        return bool(self.preset) or any(self.weight) or self.ribbon.shaped or self.begin != 0.0

    @cached_property
    def mirror(self) -> Scene:
        """The mirror image z -> -z: U changes its sign, and what is turned, twisted, lifted or pushed too."""
        image: dict[str, Any] = {"start": mirrored(self.start), "drive": self.drives.mirror}
        back = self.drives.reversed_by_mirror
        if back and self.schedule is None:
            image |= {"rate": -self.rate, "stop": None if self.stop is None else -self.stop}
        elif back and self.schedule is not None:
            image["schedule"] = self.schedule.mirror
        image["preset"] = {name: -x if name in ODD else x for name, x in self.preset.items()}
        if self.gravity is not None:
            image["gravity"] = (*self.gravity[:2], -self.gravity[2])
        if self.ribbon.shaped:
            image["ribbon"] = self.ribbon.mirror
        return replace(self, **image)

    @property
    def at_rest(self) -> Scene:
        """The scene without its ramp: what its equilibria depend on."""
        begin = self.begin
        still = None if begin == 0.0 else Schedule((0.0, 1.0), (begin, self._beyond), "linear")
        rate = 1.0 if still is None else RATE
        return replace(self, rate=rate, stop=None, hold=0.0, damping=0.0, schedule=still)

    @property
    def _beyond(self) -> float:
        """Where a schedule that does not begin at 0 leads, or the control could, at rest."""
        far = self.furthest
        return self.begin + 1e-3 * self.direction if far is None or far == self.begin else far

    @cached_property
    def scaled_rate(self) -> float:
        """The rate times t*: rad."""
        return self.rate * self.ribbon.inertial_time

    @cached_property
    def scaled_damping(self) -> float:
        """The damping times t*: nu t* of the paper."""
        return self.damping * self.ribbon.inertial_time

    @cached_property
    def planar(self) -> bool:
        """Whether nothing leaves the plane y = 0: no shear, twist, or weight along y."""
        return not self._leaves_plane

    @cached_property
    def _leaves_plane(self) -> str:
        loads = (self.preset, self.weight, self.gravity)
        return what_leaves_plane(self.shear, self.drives, self.drive, *loads, self.ribbon)

    def require_planar(self, model: str) -> None:
        """Raise a `SceneError` if a planar `model` is asked for a scene that leaves its plane."""
        if self._leaves_plane:
            raise SceneError(
                f"{self._leaves_plane}: moves the ribbon out of its plane, and {model} is a planar model: it "
                "has no shear, no twist and no weight along y; kirchhoff and der have them"
            )

    @property
    def isolated(self) -> bool:
        """Whether the states are isolated: a rod of one stiffness, hardly sheared, turns freely."""
        return are_isolated(self.shear, self.ribbon)

    def require_isolated(self) -> None:
        """Raise a `SceneError` if the states are not isolated: a rod of one stiffness, hardly sheared."""
        require_isolated(self.shear, self.ribbon)

    def require_buckled(self) -> None:
        """Raise a `SceneError` if the ribbon takes the compression up by its stretch, and stays flat."""
        require_buckled(self.compression, self.ribbon, self.start)

    def require_stop(self) -> float:
        """Where the control stops, or a `SceneError` if a simulation is asked of a scene that says no end."""
        if self.schedule is not None:
            return self.schedule.value[-1]
        if self.stop is None:
            needed = "the angle (rad) at which the clamp" if self.clamps_turn else "where the control"
            raise SceneError(f"Scene.stop = None: a simulation needs {needed} stops")
        return self.stop

    @cached_property
    def motion(self) -> Polynomials:
        """The control in time, in t* (`control_in_time`).

        Raises
        ------
        SceneError
            Without `stop` or `schedule`.
        """
        if self.schedule is not None:
            return of_schedule(self.schedule, self.ribbon.inertial_time)
        return of_ramp(self.scaled_rate, self.require_stop(), self.hold / self.ribbon.inertial_time)

    def passes(self, control: float) -> float:
        """When the control first passes a value, s; infinite where it does not.

        Raises
        ------
        SceneError
            Without `stop` or `schedule`.
        """
        times, pieces, _ = self.motion
        return first_passage(times, pieces[:-1], self.begin, control) * self.ribbon.inertial_time

    @property
    def duration(self) -> float:
        """s, of the whole motion; `SceneError` without `stop` or `schedule`."""
        return self.motion[2][-1] * self.ribbon.inertial_time
