"""Checks of the fields of a `Scene`: slack, start, gravity, ramp or schedule; warnings; its rig in words."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Mapping

import numpy as np

from .drive import TWISTS, Array, Drive
from .ribbon import Ribbon, SceneError, SceneWarning, field_number, shown
from .schedule import Schedule
from .state_names import PLANAR_STATES, RIBBON_STATES

# rad/s, where neither rate nor schedule is given
RATE = 0.1
# |dW/L| up to which a rod of one stiffness turns as good as freely: the eigenvalue of that is some 10 dW^2
_HARDLY = 1e-4
# rad: three turns
_TURNS = 6.0 * math.pi + 1e-6
# m/s2, of a ribbon whose weight nobody spoke of
_GRAVITY = 9.81
# weights (EI2/L^2) that have been spoken of: a ribbon of another natural shape weighs the same
_told: set[float] = set()


def require_slack(compression: float, shear: float) -> None:
    """Raise a `SceneError` unless the chord is shorter than the ribbon, which has to be slack to buckle."""
    if not 0.0 < compression < 1.0:
        raise SceneError(f"Scene.compression = {compression!r}: must be in (0, 1)")
    if not math.hypot(1.0 - compression, shear) < 1.0:
        limit = math.sqrt(compression * (2.0 - compression))
        raise SceneError(
            f"Scene.shear = {shear!r}: with compression = {compression!r} its magnitude "
            f"must be below {limit:.6g}, where the chord is as long as the ribbon"
        )


def as_start(start: object, shear: float) -> str:
    """Return `start` if it is the name of a state at this shear."""
    if not isinstance(start, str):
        raise SceneError(f"Scene.start = {shown(start)}: the name of a state is needed (a string)")
    allowed = RIBBON_STATES if shear else PLANAR_STATES
    if start not in allowed:
        what = "this sheared scene" if shear else "a scene with shear = 0"
        raise SceneError(f"Scene.start = {shown(start)}: the states of {what} are {', '.join(allowed)}")
    return start


def drive_of_turned(turned: object, drive: object) -> str:
    """The drive that `Scene.turned`, its old name, says."""
    if turned not in ("left", "right"):
        raise SceneError(f"Scene.turned = {shown(turned)}: must be 'left' or 'right'")
    warnings.warn(f"Scene.turned: say drive={turned!r}", DeprecationWarning, stacklevel=3)
    if drive not in ("left", turned):
        raise SceneError(f"Scene.turned = {turned!r}: Scene.drive = {shown(drive)} says otherwise")
    return str(turned)


def as_gravity(gravity: object) -> tuple[float, float, float] | None:
    """Return `gravity` as three numbers (m/s2), or None."""
    if gravity is None:
        return None
    try:
        x, y, z = (g for g in gravity)  # type: ignore[attr-defined]
    except (TypeError, ValueError):
        raise SceneError(
            f"Scene.gravity = {shown(gravity)}: (gx, gy, gz) in m/s2 are needed, or None"
        ) from None
    x, y, z = (field_number("Scene", "gravity", g) for g in (x, y, z))
    return x, y, z


def require_signs(rate: float, hold: float, damping: float) -> None:
    """Raise a `SceneError` if the control does not move, or is held for, or damped by, less than nothing."""
    if rate == 0.0:
        raise SceneError("Scene.rate = 0.0: must not be zero")
    for name, value in (("hold", hold), ("damping", damping)):
        if value < 0.0:
            raise SceneError(f"Scene.{name} = {value!r}: must not be negative")


def as_schedule(
    schedule: object, drive: Drive, named: str | Drive, rate: float, stop: object, hold: float
) -> Schedule | None:
    """Return `schedule` if it is one for this drive, and nothing else says the control in time."""
    if schedule is None:
        return None
    if not isinstance(schedule, Schedule):
        raise SceneError(f"Scene.schedule = {shown(schedule)}: a Schedule is needed, or None")
    for name, value, usual in (("rate", rate, RATE), ("stop", stop, None), ("hold", hold, 0.0)):
        if value != usual:
            raise SceneError(f"Scene.{name} = {shown(value)}: a schedule says this; give one of the two")
    if schedule.jumps and drive.kind != "force":
        raise SceneError(
            f"Scene.schedule: two values at one time are a jump, which is for drive='force' alone, "
            f"not for {named!r}"
        )
    return schedule


def as_stop(stop: object, rate: float, drive: Drive) -> float | None:
    """Return `stop` as a number on the side to which `rate` leads, or None."""
    if stop is None:
        return None
    stop = field_number("Scene", "stop", stop)
    if stop == 0.0 or (stop > 0.0) != (rate > 0.0):
        side = "> 0" if rate > 0.0 else "< 0"
        what = "angles" if drive.kind in ("turn", "twist") else "values"
        raise SceneError(f"Scene.stop = {stop!r}: a ramp of rate = {rate!r} reaches only {what} {side}")
    return stop


def require_feasible(
    chord: Callable[[float], Array],
    schedule: Schedule | None,
    stop: float | None,
    preset: Mapping[str, float],
) -> None:
    """Raise a `SceneError` unless the chord, convex in the control, is always shorter than the ribbon."""
    if schedule is not None:
        ends, where = schedule.extremes, "schedule"
    else:
        ends, where = (0.0, stop or 0.0), "stop" if stop else "preset"
    for control in ends:
        length = np.linalg.norm(chord(control))
        if not length < 1.0:
            value = control if where != "preset" else dict(preset)
            raise SceneError(
                f"Scene.{where} = {value!r}: the chord is {length:.6g} L there; it must "
                "be shorter than the ribbon"
            )


def require_buckled(compression: float, ribbon: Ribbon, start: str) -> None:
    """Raise a `SceneError` if the ribbon takes the compression up by its stretch, and stays flat."""
    least = ribbon.euler_shortening
    if compression <= least:
        h = ribbon.thickness / ribbon.length
        raise SceneError(
            f"Scene.compression = {compression!r}: a ribbon that stretches, h/L = {h:.4g}, stays "
            f"flat up to {least:.6g}, Euler's load; it must be larger for a state {start}"
        )


def are_isolated(shear: float, ribbon: Ribbon) -> bool:
    """Whether states are isolated: a rod of one stiffness, hardly sheared, turns freely."""
    return abs(shear) >= _HARDLY or not ribbon.one_stiffness


def require_isolated(shear: float, ribbon: Ribbon) -> None:
    """Raise a `SceneError` if the states are not isolated."""
    if not are_isolated(shear, ribbon):
        raise SceneError(
            f"Ribbon.bending_ratio = {ribbon.bending_ratio!r}: without a shear, of {_HARDLY:g} at "
            "least, the buckled rod turns freely about the x axis, so that no state of it is a stable "
            "equilibrium; another ratio, or a shear, is needed"
        )


def what_leaves_plane(
    shear: float,
    drive: Drive,
    named: str | Drive,
    preset: Mapping[str, float],
    weight: tuple[float, float, float],
    gravity: tuple[float, float, float] | None,
    ribbon: Ribbon,
) -> str:
    """The field, with its value, by which a scene is not planar (shear, twist, weight along y), or ""."""
    across = ("shear", *TWISTS)
    if shear != 0.0:
        return f"Scene.shear = {shear!r}"
    if any(name in drive.moved for name in across):
        return f"Scene.drive = {named!r}"
    beside = {name: value for name, value in preset.items() if name in across}
    if beside:
        return f"Scene.preset = {beside!r}"
    if weight[1]:
        return f"Scene.gravity = {gravity!r}"
    return f"Ribbon.twist = {ribbon.twist!r}" if ribbon.twist != 0.0 else ""


def rig_in_words(
    drive: str | Drive,
    preset: Mapping[str, float],
    gravity: tuple[float, float, float] | None,
    ribbon: Ribbon,
) -> tuple[str, ...]:
    """What is driven, where not the left clamp is, presets, weight, a natural shape: a phrase each."""
    parts = [f"{drive} driven"] if drive != "left" else []
    parts += [f"{name} {value:g}" for name, value in preset.items()]
    if gravity is not None and any(gravity):
        parts.append(f"gravity ({', '.join(f'{g:g}' for g in gravity)}) m/s2")
    if ribbon.shaped:
        parts.append("naturally bent")
    return tuple(parts)


def warn_of_slips(
    stop: float | None,
    schedule: Schedule | None,
    drive: Drive,
    gravity: tuple[float, float, float] | None,
    ribbon: Ribbon,
) -> None:
    """Warn, where the `Scene` is made, of angles that look like degrees; once of a weight left unsaid."""
    turns = max(abs(drive.moved.get(name, 0.0)) for name in ("left", "right", *TWISTS))
    name, stop = ("stop", stop) if schedule is None else ("schedule", schedule.furthest)
    if stop is not None and abs(stop) * turns > _TURNS:
        warnings.warn(
            f"Scene.{name} = {stop!r} rad is {abs(stop) * turns / (2.0 * math.pi):.3g} turns: "
            "angles are in rad, not in degrees",
            SceneWarning,
            stacklevel=3,
        )
    if gravity is None and ribbon != Ribbon():
        weight = _GRAVITY * ribbon.weight_ratio
        if weight > 1.0 and weight not in _told:
            _told.add(weight)
            warnings.warn(
                f"Scene.gravity = None: no weight acts, though at {_GRAVITY:g} m/s2 the ribbon's would be "
                f"{weight:.3g} EI2/L^2. Give gravity=(gx, gy, gz) in m/s2, or (0, 0, 0) for none",
                SceneWarning,
                stacklevel=3,
            )
