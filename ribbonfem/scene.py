"""What happens to the ribbon: the statement of the problem, and nothing of how it is computed.

The ribbon is clamped at both ends.  Its right clamp is moved to ``x = L - dL``, ``y = -dW`` and
kept; the left clamp (or the right one) then turns about the y axis at a constant rate.  ``alpha > 0``
turns the left tangent *down* (``t = [cos a, 0, -sin a]``) and so drives a state with ``z > 0`` towards
``z < 0``; this is the sign of the paper's three-dimensional boundary conditions (section 3.1),
and the planar models follow it too.
"""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass, field, replace
from functools import cached_property

from .ribbon import Ribbon, SceneError, SceneWarning, as_number, field_number, shown

__all__ = [
    "CLAMPS",
    "PLANAR_STATES",
    "RIBBON_STATES",
    "Ribbon",
    "Scene",
    "SceneError",
    "SceneWarning",
    "as_number",
    "shown",
    "swapped",
]

PLANAR_STATES = ("U+", "U-")
CLAMPS = ("left", "right")
RIBBON_STATES = ("U+S+", "U+S-", "U-S+", "U-S-", "U+", "U-", "S+", "S-")
# rad: three turns
_TURNS = 6.0 * math.pi + 1e-6
# |dW/L| up to which a rod of one stiffness turns as good as freely: the eigenvalue of that is some 10 dW^2
_HARDLY = 1e-4


def swapped(name: str) -> str:
    """The name of a state with the sign of S exchanged."""
    return (
        name.translate(str.maketrans("+-", "-+"))
        if name[:1] == "S"
        else (name[:3] + name[3:].translate(str.maketrans("+-", "-+")))
    )


@dataclass(frozen=True, kw_only=True)
class Scene:
    """A pre-deformed ribbon of which one clamp is turned.

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
        rad, with the sign of `rate`; None for the static functions, which need none.
    hold:
        s, how long the clamp is held at `stop`.
    damping:
        nu in 1/s: a force -nu M v.
    ribbon:
        The `Ribbon`.
    turned:
        The clamp that is turned, "left" or "right".  The right one is held at t = [cos a, 0, +sin a],
        so that alpha > 0 still drives U+ towards U-; then U+S- has two folds and U+S+ one
        (`ribbonfem.image`).

    Raises
    ------
    SceneError
        Naming the field, its value and what is allowed.

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
    rate: float = 0.1
    stop: float | None = None
    hold: float = 0.0
    damping: float = 1.0
    ribbon: Ribbon = field(default_factory=Ribbon)
    turned: str = "left"

    def __post_init__(self) -> None:
        if not isinstance(self.turned, str) or self.turned not in CLAMPS:
            raise SceneError(f"Scene.turned = {shown(self.turned)}: must be 'left' or 'right'")
        for name in ("compression", "shear", "rate", "hold", "damping"):
            object.__setattr__(self, name, field_number("Scene", name, getattr(self, name)))
        if not isinstance(self.ribbon, Ribbon):
            raise SceneError(f"Scene.ribbon = {shown(self.ribbon)}: a Ribbon is needed")
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
            raise SceneError(f"Scene.start = {shown(self.start)}: the name of a state is needed (a string)")
        allowed = RIBBON_STATES if self.shear else PLANAR_STATES
        if self.start not in allowed:
            what = "this sheared scene" if self.shear else "a scene with shear = 0"
            raise SceneError(
                f"Scene.start = {shown(self.start)}: the states of {what} are {', '.join(allowed)}"
            )
        if self.rate == 0.0:
            raise SceneError("Scene.rate = 0.0: must not be zero")
        if self.stop is not None:
            stop = field_number("Scene", "stop", self.stop)
            object.__setattr__(self, "stop", stop)
            if stop == 0.0 or (stop > 0.0) != (self.rate > 0.0):
                side = "> 0" if self.rate > 0.0 else "< 0"
                raise SceneError(
                    f"Scene.stop = {stop!r}: a ramp of rate = {self.rate!r} reaches only angles {side}"
                )
        for name in ("hold", "damping"):
            if getattr(self, name) < 0.0:
                raise SceneError(f"Scene.{name} = {getattr(self, name)!r}: must not be negative")
        if self.stop is not None and abs(self.stop) > _TURNS:
            warnings.warn(
                f"Scene.stop = {self.stop!r} rad is {abs(self.stop) / (2.0 * math.pi):.3g} turns: "
                "angles are in rad, not in degrees",
                SceneWarning,
                stacklevel=3,
            )

    @property
    def in_words(self) -> str:
        """The scene in a line, for the caption of a table."""
        stop = "" if self.stop is None else f" to {self.stop:g} rad"
        held = f", held for {self.hold:g} s" if self.stop is not None and self.hold else ""
        turned = "" if self.turned == "left" else ", right clamp turned"
        return (
            f"dL/L {self.compression:g}, dW/L {self.shear:g}, {self.start}: {self.rate:g} rad/s{stop}{held}, "
            f"nu {self.damping:g} /s{turned}"
        )

    @cached_property
    def image(self) -> Scene:
        """The scene with the other clamp turned, whose motion is this one's image: S changes its sign."""
        return replace(self, start=swapped(self.start), turned="left" if self.turned == "right" else "right")

    @cached_property
    def mirror(self) -> Scene:
        """The mirror image z -> -z: U changes its sign and the clamp turns the other way."""
        start = self.start.translate(str.maketrans("+-", "-+")) if len(self.start) == 2 else self.start
        if len(self.start) == 4:
            start = f"U{'-' if self.start[1] == '+' else '+'}{self.start[2:]}"
        elif self.start[0] == "S":
            start = self.start
        return replace(self, start=start, rate=-self.rate, stop=None if self.stop is None else -self.stop)

    @property
    def at_rest(self) -> Scene:
        """The scene without its ramp: what its equilibria depend on."""
        return replace(self, rate=1.0, stop=None, hold=0.0, damping=0.0)

    @cached_property
    def scaled_rate(self) -> float:
        """The rate times t*: rad."""
        return self.rate * self.ribbon.inertial_time

    @cached_property
    def scaled_damping(self) -> float:
        """The damping times t*: nu t* of the paper."""
        return self.damping * self.ribbon.inertial_time

    @property
    def planar(self) -> bool:
        """Whether the ribbon is not sheared (shear = 0)."""
        return self.shear == 0.0

    def require_planar(self, model: str) -> None:
        """Raise a `SceneError` if a planar `model` is asked for a sheared scene."""
        if not self.planar:
            raise SceneError(f"Scene.shear = {self.shear!r}: {model} is planar and takes only shear = 0")

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
        """Return `stop`, or raise a `SceneError` if a simulation is asked of a scene without it."""
        if self.stop is None:
            raise SceneError("Scene.stop = None: a simulation needs the angle (rad) at which the clamp stops")
        return self.stop

    def instants(self) -> tuple[float, float]:
        """When the clamp stops, and when its hold ends, in units of t*; `SceneError` without `stop`.

        As the time loops compute them, to the last bit; a hold that is rounding beside the ramp is none.
        """
        turned, hold = self.require_stop() / self.scaled_rate, self.hold / self.ribbon.inertial_time
        return turned, turned + (hold if hold > 1e-12 * turned else 0.0)
