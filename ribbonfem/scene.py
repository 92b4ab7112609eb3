"""What happens to the ribbon: the statement of the problem, and nothing of how it is computed.

The ribbon is clamped at both ends.  Its right clamp is moved to ``x = L - dL``, ``y = -dW`` and
kept; the left clamp then turns about the y axis at a constant rate.  ``alpha > 0`` turns the
left tangent *down* (``t = [cos a, 0, -sin a]``) and so drives a state with ``z > 0`` towards
``z < 0``; this is the sign of the paper's three-dimensional boundary conditions (section 3.1),
and the planar models follow it too.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields
from numbers import Real

PLANAR_STATES = ("U+", "U-")
RIBBON_STATES = ("U+S+", "U+S-", "U-S+", "U-S-", "U+", "U-", "S+", "S-")


class SceneError(ValueError):
    """A field of a `Scene` or a `Ribbon` that cannot be: names the field, its value and what is allowed."""


def _number(owner: str, name: str, value: object) -> float:
    """Return `value` as a finite float, or raise a `SceneError` that names the field."""
    if isinstance(value, bool) or not isinstance(value, Real):
        raise SceneError(f"{owner}.{name} = {value!r}: a real number is needed, not {type(value).__name__}")
    number = float(value)
    if not math.isfinite(number):
        raise SceneError(f"{owner}.{name} = {value!r}: a finite number is needed")
    return number


@dataclass(frozen=True, kw_only=True)
class Ribbon:
    """A thin elastic strip; the defaults are the paper's (section 5).

    Parameters
    ----------
    length, width, thickness:
        L, W and h in metres.
    young:
        Young's modulus in Pa.
    density:
        kg/m3.
    bending_ratio:
        EI1/EI2, bending about the surface normal (in the plane of the ribbon) over bending
        about the width direction, the soft one.
    twist_ratio:
        GJ/EI2.

    Raises
    ------
    SceneError
        If any field is not a positive finite number.
    """

    length: float = 1.0
    width: float = 0.2
    thickness: float = 0.01
    young: float = 1e8
    density: float = 1000.0
    bending_ratio: float = 400.0
    twist_ratio: float = 1.4562

    def __post_init__(self) -> None:
        for item in fields(self):
            number = _number("Ribbon", item.name, getattr(self, item.name))
            if number <= 0.0:
                raise SceneError(f"Ribbon.{item.name} = {number!r}: must be greater than 0")
            object.__setattr__(self, item.name, number)
        for name in ("bending_stiffness", "stretch_ratio", "inertial_time"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise SceneError(
                    f"Ribbon: length = {self.length!r}, width = {self.width!r}, "
                    f"thickness = {self.thickness!r}, young = {self.young!r}, density = {self.density!r}: "
                    f"{name} = {value!r} must be a positive finite number"
                )

    @property
    def bending_stiffness(self) -> float:
        """EI2 = E W h^3 / 12, the soft bending stiffness, in N m2."""
        return self.young * self.width * self.thickness**3 / 12.0

    @property
    def stretch_ratio(self) -> float:
        """EA L^2 / EI2 = 12 (L/h)^2."""
        return 12.0 * (self.length / self.thickness) ** 2

    @property
    def inertial_time(self) -> float:
        """t* = sqrt(rho h L^4 / B) with B = EI2 / W, in seconds (paper, section 4.2)."""
        return math.sqrt(12.0 * self.density / self.young) * self.length**2 / self.thickness

    @property
    def rotary_inertia(self) -> float:
        """Inertia about the tangent over rho A L^2: (W^2 + h^2) / (12 L^2)."""
        return (self.width**2 + self.thickness**2) / (12.0 * self.length**2)


@dataclass(frozen=True, kw_only=True)
class Scene:
    """A pre-deformed ribbon whose left clamp is turned.

    At t = 0 the ribbon is at rest in the equilibrium `start`; the clamp's angular speed jumps
    to `rate`, and at the angle `stop` it jumps back to 0.  Nothing is smoothed.

    Parameters
    ----------
    compression:
        dL/L, in (0, 1).
    shear:
        dW/L, of either sign; the chord sqrt((1 - dL/L)^2 + (dW/L)^2) must be shorter than 1.
    start:
        The pre-deformed state: "U+" or "U-" without shear; with shear any of "U+S+", "U+S-",
        "U-S+", "U-S-", "U+", "U-", "S+", "S-".  Whether it is a stable equilibrium there is
        for the models to say.
    rate:
        rad/s, of either sign, not zero.
    stop:
        rad, with the sign of `rate`; None for the static verbs, which need none.
    hold:
        s, how long the clamp is held at `stop`.
    damping:
        nu in 1/s: a force -nu M v.
    ribbon:
        The `Ribbon`.

    Raises
    ------
    SceneError
        Naming the field, its value and what is allowed.
    """

    compression: float = 0.40
    shear: float = 0.37
    start: str = "U+S+"
    rate: float = 0.1
    stop: float | None = None
    hold: float = 0.0
    damping: float = 1.0
    ribbon: Ribbon = field(default_factory=Ribbon)

    def __post_init__(self) -> None:
        for name in ("compression", "shear", "rate", "hold", "damping"):
            object.__setattr__(self, name, _number("Scene", name, getattr(self, name)))
        if not isinstance(self.ribbon, Ribbon):
            raise SceneError(f"Scene.ribbon = {self.ribbon!r}: a Ribbon is needed")
        if not 0.0 < self.compression < 1.0:
            raise SceneError(f"Scene.compression = {self.compression!r}: must be in (0, 1)")
        # the chord over L: the ribbon has to be slack to buckle at all
        if not math.hypot(1.0 - self.compression, self.shear) < 1.0:
            limit = math.sqrt(self.compression * (2.0 - self.compression))
            raise SceneError(
                f"Scene.shear = {self.shear!r}: with compression = {self.compression!r} its magnitude "
                f"must be below {limit:.6g}, where the chord is as long as the ribbon"
            )
        if not isinstance(self.start, str):
            raise SceneError(f"Scene.start = {self.start!r}: the name of a state is needed (a string)")
        allowed = RIBBON_STATES if self.shear else PLANAR_STATES
        if self.start not in allowed:
            what = "this sheared scene" if self.shear else "a scene with shear = 0"
            raise SceneError(f"Scene.start = {self.start!r}: the states of {what} are {', '.join(allowed)}")
        if self.rate == 0.0:
            raise SceneError("Scene.rate = 0.0: must not be zero")
        if self.stop is not None:
            stop = _number("Scene", "stop", self.stop)
            object.__setattr__(self, "stop", stop)
            if stop == 0.0 or (stop > 0.0) != (self.rate > 0.0):
                side = "> 0" if self.rate > 0.0 else "< 0"
                raise SceneError(
                    f"Scene.stop = {stop!r}: a ramp of rate = {self.rate!r} reaches only angles {side}"
                )
        for name in ("hold", "damping"):
            if getattr(self, name) < 0.0:
                raise SceneError(f"Scene.{name} = {getattr(self, name)!r}: must not be negative")

    @property
    def planar(self) -> bool:
        """Whether the ribbon is not sheared (shear = 0)."""
        return self.shear == 0.0

    def require_planar(self, model: str) -> None:
        """Raise a `SceneError` if a planar `model` is asked for a sheared scene."""
        if not self.planar:
            raise SceneError(f"Scene.shear = {self.shear!r}: {model} is planar and takes only shear = 0")

    def require_isolated(self) -> None:
        """Raise a `SceneError` if the states are not isolated: a rod of one stiffness without shear."""
        if self.planar and self.ribbon.bending_ratio == 1.0:
            raise SceneError(
                "Ribbon.bending_ratio = 1.0: without shear the buckled rod turns freely about the x axis, so "
                "that no state of it is a stable equilibrium; another ratio, or a shear, is needed"
            )

    def require_stop(self) -> float:
        """Return `stop`, or raise a `SceneError` if a simulation is asked of a scene without it."""
        if self.stop is None:
            raise SceneError("Scene.stop = None: a simulation needs the angle (rad) at which the clamp stops")
        return self.stop
