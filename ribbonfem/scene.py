"""The `Scene`: pre-deformation, drive, rate, loads and damping; the statement of the problem, checked.

The ribbon is clamped at both ends.  Its right clamp is moved to ``x = L - dL``, ``y = -dW`` and
kept; then one scalar, the control, moves what the scene's `Drive` says (`ribbonfem.drive`): by default the
left clamp, which turns about the y axis.  ``alpha > 0`` turns its tangent *down* (``t = [cos a, 0, -sin a]``)
and so drives a state with ``z > 0`` towards ``z < 0``; this is the sign of the paper's three-dimensional
boundary conditions (section 3.1), and the planar models follow it too.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Any

import numpy as np

from .drive import CONTROLS, LENGTHS, NAMED, ODD, TWISTS, Drive, as_drive, as_preset
from .frozen import Frozen
from .ribbon import Ribbon, SceneError, SceneWarning, as_number, field_number, refuse_unknown, shown
from .schedule import Schedule

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

PLANAR_STATES = ("U+", "U-")
RIBBON_STATES = ("U+S+", "U+S-", "U-S+", "U-S-", "U+", "U-", "S+", "S-")
# rad: three turns
_TURNS = 6.0 * math.pi + 1e-6
# |dW/L| up to which a rod of one stiffness turns as good as freely: the eigenvalue of that is some 10 dW^2
_HARDLY = 1e-4
# m/s2, of a ribbon whose weight nobody spoke of
_GRAVITY = 9.81
# rad/s, where neither rate nor schedule is given
_RATE = 0.1
_RIBBON = Ribbon()
# part of what the chord allows as far as which a length is followed without a stop; and of a force, EI2/L^2
_FEASIBLE, _FORCE = 0.98, 100.0
# ribbons whose weight has been spoken of
_told: set[Ribbon] = set()


def swapped(name: str) -> str:
    """The name of a state with the sign of S exchanged."""
    return (
        name.translate(str.maketrans("+-", "-+"))
        if name[:1] == "S"
        else (name[:3] + name[3:].translate(str.maketrans("+-", "-+")))
    )


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
        for the models to say.  It is named where nothing else acts; presets, loads and a natural shape are
        then brought on together, at rest.
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
        Of angles that look like degrees; once of a ribbon that is heavy, where nothing is said of gravity.

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
    rate: float = _RATE
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
        rate: float = _RATE,
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
            if turned not in ("left", "right"):
                raise SceneError(f"Scene.turned = {shown(turned)}: must be 'left' or 'right'")
            warnings.warn(f"Scene.turned: say drive={turned!r}", DeprecationWarning, stacklevel=2)
            if drive not in ("left", turned):
                raise SceneError(f"Scene.turned = {turned!r}: Scene.drive = {shown(drive)} says otherwise")
            drive = turned
        given = {"compression": compression, "shear": shear, "rate": rate, "hold": hold, "damping": damping}
        for name, value in given.items():
            self._set(name, field_number("Scene", name, value))
        self._set("ribbon", ribbon)
        if not isinstance(self.ribbon, Ribbon):
            raise SceneError(f"Scene.ribbon = {shown(ribbon)}: a Ribbon is needed")
        self._require_slack_and_state(start)
        self._set("drive", as_drive(drive))
        self._set("preset", as_preset({} if preset is None else preset, self.drives))
        self._require_gravity(gravity)
        self._require_motion(stop, schedule)
        self._require_feasible()
        self._warn()

    def _set(self, name: str, value: object) -> None:
        object.__setattr__(self, name, value)

    def _require_slack_and_state(self, start: object) -> None:
        if not 0.0 < self.compression < 1.0:
            raise SceneError(f"Scene.compression = {self.compression!r}: must be in (0, 1)")
        # the chord over L: the ribbon has to be slack to buckle at all
        if not math.hypot(1.0 - self.compression, self.shear) < 1.0:
            limit = math.sqrt(self.compression * (2.0 - self.compression))
            raise SceneError(
                f"Scene.shear = {self.shear!r}: with compression = {self.compression!r} its magnitude "
                f"must be below {limit:.6g}, where the chord is as long as the ribbon"
            )
        if not isinstance(start, str):
            raise SceneError(f"Scene.start = {shown(start)}: the name of a state is needed (a string)")
        allowed = RIBBON_STATES if self.shear else PLANAR_STATES
        if start not in allowed:
            what = "this sheared scene" if self.shear else "a scene with shear = 0"
            raise SceneError(f"Scene.start = {shown(start)}: the states of {what} are {', '.join(allowed)}")
        self._set("start", start)

    def _require_gravity(self, gravity: object) -> None:
        if gravity is not None:
            try:
                x, y, z = (g for g in gravity)  # type: ignore[attr-defined]
            except (TypeError, ValueError):
                raise SceneError(
                    f"Scene.gravity = {shown(gravity)}: (gx, gy, gz) in m/s2 are needed, or None"
                ) from None
            gravity = tuple(field_number("Scene", "gravity", g) for g in (x, y, z))
        self._set("gravity", gravity)

    def _require_motion(self, stop: object, schedule: object) -> None:
        if self.rate == 0.0:
            raise SceneError("Scene.rate = 0.0: must not be zero")
        if schedule is not None:
            if not isinstance(schedule, Schedule):
                raise SceneError(f"Scene.schedule = {shown(schedule)}: a Schedule is needed, or None")
            for name, value, usual in (
                ("rate", self.rate, _RATE),
                ("stop", stop, None),
                ("hold", self.hold, 0.0),
            ):
                if value != usual:
                    raise SceneError(
                        f"Scene.{name} = {shown(value)}: a schedule says this; give one of the two"
                    )
            if schedule.jumps and self.drives.kind != "force":
                raise SceneError(
                    f"Scene.schedule: two values at one time are a jump, which is for drive='force' alone, "
                    f"not for {self.drive!r}"
                )
        self._set("schedule", schedule)
        if stop is not None:
            stop = field_number("Scene", "stop", stop)
            if stop == 0.0 or (stop > 0.0) != (self.rate > 0.0):
                side = "> 0" if self.rate > 0.0 else "< 0"
                what = "angles" if self.drives.kind in ("turn", "twist") else "values"
                raise SceneError(
                    f"Scene.stop = {stop!r}: a ramp of rate = {self.rate!r} reaches only {what} {side}"
                )
        self._set("stop", stop)
        for name in ("hold", "damping"):
            if getattr(self, name) < 0.0:
                raise SceneError(f"Scene.{name} = {getattr(self, name)!r}: must not be negative")

    def _require_feasible(self) -> None:
        """The chord of every instant is shorter than the ribbon: a convex function of the control."""
        if self.schedule is not None:
            ends, where = self.schedule.extremes, "schedule"
        else:
            ends, where = (0.0, self.stop or 0.0), "stop" if self.stop else "preset"
        for control in ends:
            chord = self.chord(control)
            if not np.linalg.norm(chord) < 1.0:
                value = control if where != "preset" else dict(self.preset)
                raise SceneError(
                    f"Scene.{where} = {value!r}: the chord is {np.linalg.norm(chord):.6g} L there; it must "
                    "be shorter than the ribbon"
                )

    def _warn(self) -> None:
        turns = max(abs(self.drives.moved.get(name, 0.0)) for name in ("left", "right", *TWISTS))
        if self.stop is not None and abs(self.stop) * turns > _TURNS:
            warnings.warn(
                f"Scene.stop = {self.stop!r} rad is {abs(self.stop) * turns / (2.0 * math.pi):.3g} turns: "
                "angles are in rad, not in degrees",
                SceneWarning,
                stacklevel=4,
            )
        if self.gravity is None and self.ribbon != Ribbon() and self.ribbon not in _told:
            weight = _GRAVITY * self.ribbon.weight_ratio
            if weight > 1.0:
                _told.add(self.ribbon)
                warnings.warn(
                    f"Scene.gravity = None: nothing is said of weight, and the ribbon's is {weight:.3g} "
                    f"EI2/L^2 at {_GRAVITY:g} m/s2; gravity=(0, 0, 0) says that none acts",
                    SceneWarning,
                    stacklevel=4,
                )

    def __repr__(self) -> str:
        values = [(item.name, getattr(self, item.name), item.default) for item in fields(self)]
        quiet = {"drive", "schedule", "preset", "gravity"}
        if self.schedule is not None:
            quiet |= {"rate", "stop", "hold"}
        told = [
            f"{name}={dict(value) if name == 'preset' else value!r}"
            for name, value, usual in values
            if name not in quiet or (value if name == "preset" else value != usual)
        ]
        return f"Scene({', '.join(told)})"

    @property
    def in_words(self) -> str:
        """The scene in a line, for the caption of a table."""
        drive, unit = self.drives, self.drives.unit
        if self.schedule is not None:
            ends, last = self.schedule.value, self.schedule.time[-1]
            moves = f"schedule {ends[0]:g} .. {self.schedule.furthest:g} {unit}, {last:g} s"
        else:
            stop = "" if self.stop is None else f" to {self.stop:g} {unit}".rstrip()
            held = f", held for {self.hold:g} s" if self.stop is not None and self.hold else ""
            moves = f"{self.rate:g} {unit}/s{stop}{held}"
        told = (
            ""
            if self.drive == "left"
            else f", {self.drive if isinstance(self.drive, str) else drive!r} driven"
        )
        told += "".join(f", {name} {value:g}" for name, value in self.preset.items())
        if self.gravity is not None and any(self.gravity):
            told += f", gravity ({', '.join(f'{g:g}' for g in self.gravity)}) m/s2"
        if self.ribbon.shaped:
            told += ", naturally bent"
        where = f"dL/L {self.compression:g}, dW/L {self.shear:g}, {self.start}"
        return f"{where}: {moves}, nu {self.damping:g} /s{told}"

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
    def turning(self) -> bool:
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
        """How far the control is followed to one side where nothing says how far: a magnitude, from 0.

        Three turns of clamps and twists, 100 EI2/L^2 of a force, .98 of what the chord allows of lengths.
        """
        far = [
            (_FORCE if name == "force" else 6.0 * math.pi) / abs(by)
            for name, by in self.drives.moved.items()
            if name not in LENGTHS
        ]
        first = self.chord(0.0)
        rate = sign * (self.chord(1.0) - first)
        if rate.any():
            # |first + x rate| = 1
            a, b, c = rate @ rate, first @ rate, first @ first - 1.0
            far.append(_FEASIBLE * (-b + math.sqrt(b * b - a * c)) / a)
        return float(min(far))

    def controls(self, control: float) -> dict[str, float]:
        """Every control, by name, where the scalar is `control`; dL/L and dW/L are the scene's besides."""
        moved = self.drives.moved
        return {name: self.preset.get(name, 0.0) + moved.get(name, 0.0) * control for name in CONTROLS}

    def chord(self, control: float) -> Any:
        """r(L) - r(0), (3,) in L."""
        at = self.controls(control)
        return np.array([1.0 - self.compression - at["compression"], -self.shear - at["shear"], at["lift"]])

    @cached_property
    def usual(self) -> bool:
        """Whether one clamp turns at a constant rate, and nothing else moves, acts or retards."""
        plain = not self.dressed and self.ribbon.retardation == 0.0 and self.schedule is None
        return plain and self.drive in ("left", "right")

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
        bare = {
            "preset": {},
            "gravity": (0.0, 0.0, 0.0),
            "ribbon": replace(self.ribbon, curvature=0.0, twist=0.0),
        }
        return replace(self, rate=1.0, stop=None, hold=0.0, damping=0.0, schedule=None, **bare)  # type: ignore[arg-type]

    @property
    def dressed(self) -> bool:
        """Whether anything acts at the start besides dL and dW: presets, weight, a natural shape."""
        return bool(self.preset) or any(self.weight) or self.ribbon.shaped or self.begin != 0.0

    @cached_property
    def mirror(self) -> Scene:
        """The mirror image z -> -z: U changes its sign, and what is turned, twisted, lifted or pushed too."""
        start = self.start.translate(str.maketrans("+-", "-+")) if len(self.start) == 2 else self.start
        if len(self.start) == 4:
            start = f"U{'-' if self.start[1] == '+' else '+'}{self.start[2:]}"
        elif self.start[0] == "S":
            start = self.start
        moved = self.drives.moved
        # the control changes its sign, unless all that moves is the same in the image
        back = any(name in ODD for name in moved)
        drive = Drive(**{name: by if (name in ODD) == back else -by for name, by in moved.items()})
        image: dict[str, Any] = {"start": start, "drive": drive}
        if back and self.schedule is None:
            image |= {"rate": -self.rate, "stop": None if self.stop is None else -self.stop}
        elif back and self.schedule is not None:
            s = self.schedule
            slope = None if s.slope is None else tuple(-x for x in s.slope)
            image["schedule"] = replace(s, value=tuple(-x for x in s.value), slope=slope)
        image["preset"] = {name: -x if name in ODD else x for name, x in self.preset.items()}
        if self.gravity is not None:
            image["gravity"] = (*self.gravity[:2], -self.gravity[2])
        if self.ribbon.shaped:
            opposite: dict[str, Any] = {
                name: tuple(-x for x in value) if isinstance(value, tuple) else -value
                for name, value in (("curvature", self.ribbon.curvature), ("twist", self.ribbon.twist))
            }
            image["ribbon"] = replace(self.ribbon, **opposite)
        return replace(self, **image)

    @property
    def at_rest(self) -> Scene:
        """The scene without its ramp: what its equilibria depend on."""
        begin = self.begin
        still = None if begin == 0.0 else Schedule((0.0, 1.0), (begin, self._beyond), "linear")
        return replace(
            self, rate=1.0 if still is None else _RATE, stop=None, hold=0.0, damping=0.0, schedule=still
        )

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
        across = {"shear", *TWISTS}
        acts = across & ({*self.drives.moved} | {*self.preset}) or self.weight[1] or self.ribbon.twist != 0.0
        return self.shear == 0.0 and not acts

    def require_planar(self, model: str) -> None:
        """Raise a `SceneError` if a planar `model` is asked for a scene that leaves its plane."""
        if self.planar:
            return
        across = ("shear", *TWISTS)
        moved = [name for name in across if name in self.drives.moved]
        what = f"Scene.drive = {self.drive!r}"
        if self.shear != 0.0:
            what = f"Scene.shear = {self.shear!r}"
        elif not moved:
            preset = {name: value for name, value in self.preset.items() if name in across}
            what = f"Ribbon.twist = {self.ribbon.twist!r}"
            if preset:
                what = f"Scene.preset = {preset!r}"
            elif self.weight[1]:
                what = f"Scene.gravity = {self.gravity!r}"
        raise SceneError(
            f"{what}: leaves the plane, and {model} is planar: without shear, twist and weight along y; "
            "kirchhoff and der have them"
        )

    @property
    def isolated(self) -> bool:
        """Whether the states are isolated: a rod of one stiffness, hardly sheared, turns freely."""
        return abs(self.shear) >= _HARDLY or not self.ribbon.one_stiffness

    def require_isolated(self) -> None:
        """Raise a `SceneError` if the states are not isolated: a rod of one stiffness, hardly sheared."""
        if not self.isolated:
            raise SceneError(
                f"Ribbon.bending_ratio = {self.ribbon.bending_ratio!r}: without a shear, of {_HARDLY:g} at "
                "least, the buckled rod turns freely about the x axis, so that no state of it is a stable "
                "equilibrium; another ratio, or a shear, is needed"
            )

    def require_buckled(self) -> None:
        """Raise a `SceneError` if the ribbon takes the compression up by its stretch, and stays flat."""
        least = self.ribbon.euler_shortening
        if self.compression <= least:
            h = self.ribbon.thickness / self.ribbon.length
            raise SceneError(
                f"Scene.compression = {self.compression!r}: a ribbon that stretches, h/L = {h:.4g}, stays "
                f"flat up to {least:.6g}, Euler's load; it must be larger for a state {self.start}"
            )

    def require_stop(self) -> float:
        """Where the control stops, or a `SceneError` if a simulation is asked of a scene that says no end."""
        if self.schedule is not None:
            return self.schedule.value[-1]
        if self.stop is None:
            needed = "the angle (rad) at which the clamp stops" if self.turning else "where the control stops"
            raise SceneError(f"Scene.stop = None: a simulation needs {needed}")
        return self.stop

    @cached_property
    def motion(self) -> tuple[tuple[float, ...], tuple[tuple[float, ...], ...], tuple[float, ...]]:
        """The control in time, in t*: instants, polynomials between them, and kinks from 0 to the end.

        Polynomials are coefficients in powers of the time since the first instant of each; their last one
        holds what is reached.  A hold that is rounding beside the ramp is none.

        Raises
        ------
        SceneError
            Without `stop` or `schedule`.
        """
        unit = self.ribbon.inertial_time
        if self.schedule is not None:
            s = self.schedule
            last = (self.require_stop(), *(0.0,) * 5)
            pieces = tuple(tuple(c * unit**k for k, c in enumerate(piece)) for piece in s.pieces.tolist())
            times = tuple(x / unit for x in s.time)
            return times, (*pieces, last), tuple(x / unit for x in (0.0, *s.kinks, s.time[-1]))
        stop = self.require_stop()
        turned, hold = stop / self.scaled_rate, self.hold / unit
        times = (0.0, turned)
        pieces = ((0.0, self.scaled_rate, *(0.0,) * 4), (stop, *(0.0,) * 5))
        return times, pieces, (*times, turned + hold) if hold > 1e-12 * turned else times

    def passes(self, control: float) -> float:
        """When the control first passes a value, s; infinite where it does not.

        Raises
        ------
        SceneError
            Without `stop` or `schedule`.
        """
        times, pieces, _ = self.motion
        side = control - self.begin
        for k, piece in enumerate(pieces[:-1] if self.schedule is not None else pieces[:1]):
            length = times[k + 1] - times[k]
            at = np.linspace(0.0, length, 65)
            off = (np.polyval(piece[::-1], at) - control) * math.copysign(1.0, side)
            beyond = np.flatnonzero(off >= 0.0)
            if beyond.size:
                low, high = at[max(int(beyond[0]) - 1, 0)], at[int(beyond[0])]
                for _ in range(60):
                    middle = 0.5 * (low + high)
                    if (np.polyval(piece[::-1], middle) - control) * side >= 0.0:
                        high = middle
                    else:
                        low = middle
                return float(times[k] + high) * self.ribbon.inertial_time
        return math.inf

    @property
    def duration(self) -> float:
        """s, of the whole motion; `SceneError` without `stop` or `schedule`."""
        return self.motion[2][-1] * self.ribbon.inertial_time
