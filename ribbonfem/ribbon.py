"""The `Ribbon`: length, section, Young's modulus, density, stiffness ratios, natural shape, units."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, fields, replace
from difflib import get_close_matches
from functools import wraps
from numbers import Real
from typing import Any, TypeVar

import numpy as np


class SceneError(ValueError):
    """A field of a `Scene` or a `Ribbon` that cannot be: names the field, its value and what is allowed."""


class SceneWarning(UserWarning):
    """A value that can be, but looks like a slip in its unit."""


@contextmanager
def silently() -> Iterator[None]:
    """Without `SceneWarning`: for trials of a search, whose first scene was told of when it was made."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SceneWarning)
        yield


def shown(value: object) -> str:
    """A value as a message shows it: on one line, and not too long."""
    try:
        text = " ".join(repr(value).split())
    except Exception:
        # also of integers with more digits than Python prints
        text = f"<{type(value).__name__}>"
    return text if len(text) <= 80 else f"{text[:60]} ... ({len(text)} characters)"


def as_number(value: object) -> float:
    """Return `value` as a finite float.

    Raises
    ------
    ValueError
        If it is none; the message says what is needed, and nothing else.
    """
    # a duration counts as an integer for numpy, and has a unit of its own
    if isinstance(value, (bool, np.timedelta64)) or not isinstance(value, Real):
        raise ValueError(f"a real number is needed, not {type(value).__name__}")
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise ValueError(f"a finite number is needed, of a magnitude below {np.finfo(float).max:.3g}")
    # (-0.0 is 0.0, and would be told from it by its bytes)
    return number + 0.0


def field_number(owner: str, name: str, value: object) -> float:
    """Return `value` as a finite float, or raise a `SceneError` that names the field."""
    try:
        return as_number(value)
    except ValueError as error:
        raise SceneError(f"{owner}.{name} = {shown(value)}: {error}") from None


def refuse_unknown(owner: str, unknown: Mapping[str, object], fields: Iterable[str]) -> None:
    """Raise a `SceneError` that names a field that there is not, the nearest, and those that there are."""
    for name, value in unknown.items():
        near = get_close_matches(name, tuple(fields), 1)
        meant = f", perhaps {near[0]!r} is meant" if near else ""
        raise SceneError(
            f"{owner}.{name} = {shown(value)}: there is no such field{meant}; there are {', '.join(fields)}"
        )


T = TypeVar("T", bound=type)


def answers_unknown(kind: T) -> T:
    """Class decorator of a dataclass: a keyword that is no field raises as `refuse_unknown` does."""
    names = [item.name for item in fields(kind)]
    plain = kind.__init__  # type: ignore[misc]

    @wraps(plain)
    def init(self: object, *args: object, **given: object) -> None:
        unknown = {name: value for name, value in given.items() if name not in names}
        refuse_unknown(kind.__name__, unknown, names)
        plain(self, *args, **given)

    kind.__init__ = init  # type: ignore[misc]
    return kind


def _along(name: str, values: object) -> float | tuple[float, ...]:
    """A natural curvature or twist: a number, or values at equal steps from clamp to clamp."""
    if isinstance(values, (list, tuple)) or (isinstance(values, np.ndarray) and values.ndim == 1):
        some = tuple(
            field_number("Ribbon", name, value.item() if isinstance(value, np.generic) else value)
            for value in values
        )
        if len(some) < 2:
            raise SceneError(
                f"Ribbon.{name} = {shown(values)}: a number, or two values and more along the ribbon"
            )
        # (a shape that is the same all along is a number)
        return some if len(set(some)) > 1 else some[0]
    return field_number("Ribbon", name, values)


def _or_infinite(formula: Callable[[], float]) -> float:
    """The value of a formula, infinite where it is too large for a float or divides by zero."""
    try:
        return formula()
    except (OverflowError, ZeroDivisionError):
        return math.inf


# sum of n^-5 over odd n, 31/32 of zeta(5)
_ODD = 31.0 / 32.0 * 1.0369277551433699


def torsion(aspect: float) -> float:
    """J / (a b^3) of a rectangle with sides a = `aspect` b >= b (S. Timoshenko & J. Goodier, art. 109).

    1/3 - 64 / (pi^5 aspect) sum over odd n of tanh(n pi aspect / 2) / n^5.
    """
    left = math.fsum(
        2.0 / (n**5 * (math.exp(n * math.pi * aspect) + 1.0)) for n in range(1, 14, 2) if n * aspect < 200.0
    )
    return 1.0 / 3.0 - 64.0 / math.pi**5 / aspect * (_ODD - left)


def _rounded(ratio: float) -> float:
    """A ratio without the rounding of the lengths that it is made of: 400 where W / h is 20."""
    return float(f"{ratio:.12g}")


# Poisson's ratio with which a rectangle of 20 : 1 has the paper's GJ/EI2 = 1.4562
POISSON = 0.330157335786238
_SIZES = ("length", "width", "thickness", "young", "density")
_RATIOS = ("bending_ratio", "twist_ratio")
_SHAPES = ("curvature", "twist")
_KEEP: Any = object()


@dataclass(frozen=True, init=False, eq=False, repr=False)
class Ribbon:
    """A thin elastic strip; the defaults are the paper's (section 5).

    The ratios follow from the section, a rectangle of W by h, unless they are given: EI1/EI2 = (W/h)^2,
    and GJ/EI2 from the series for the torsion of a rectangle and Poisson's ratio.  One that is
    given stands, also in `dataclasses.replace(ribbon, thickness=...)`; one that follows, follows there
    too.  ``bending_ratio=None`` lets it follow again.  Two ribbons are equal if all their numbers are,
    given or not.

    Parameters
    ----------
    length, width, thickness:
        L, W and h in metres.
    young:
        Young's modulus in Pa.
    density:
        kg/m3.
    poisson:
        Poisson's ratio, in (-1, 0.5); it enters GJ only.
    bending_ratio:
        EI1/EI2, bending about the surface normal (in the plane of the ribbon) over bending
        about the width direction, the soft one; None to follow: 400 of the default section.
    twist_ratio:
        GJ/EI2; None to follow: 1.4562 of the default section.
    curvature:
        Natural curvature about the width, 1/m, > 0 bends an unloaded ribbon towards its normal: a number,
        or values at equal steps of s from clamp to clamp, linear between.
    twist:
        Natural twist, rad/m, right-handed about the tangent; alike.
    retardation:
        Kelvin-Voigt time in s: every moment is stiffness x (strain + retardation x strain rate), and the
        tension of an extensible ribbon too.
    ratios:
        Both of them as given, None where one follows: for `dataclasses.replace`, which hands on
        fields and could not tell a ratio that was given from one that follows.

    Raises
    ------
    SceneError
        If a field is not a positive finite number, or what follows from them is not.

    Warns
    -----
    SceneWarning
        Of sizes that look like millimetres, and of a modulus that looks like gigapascals.

    Examples
    --------
    >>> Ribbon().bending_ratio, Ribbon(thickness=0.005).bending_ratio
    (400.0, 1600.0)
    >>> round(Ribbon().inertial_time, 4)
    1.0954
    """

    length: float = 1.0
    width: float = 0.2
    thickness: float = 0.01
    young: float = 1e8
    density: float = 1000.0
    poisson: float = POISSON
    ratios: tuple[float | None, float | None] = (None, None)
    curvature: float | tuple[float, ...] = 0.0
    twist: float | tuple[float, ...] = 0.0
    retardation: float = 0.0

    def __init__(
        self,
        *,
        length: float = 1.0,
        width: float = 0.2,
        thickness: float = 0.01,
        young: float = 1e8,
        density: float = 1000.0,
        poisson: float = POISSON,
        bending_ratio: float | None = _KEEP,
        twist_ratio: float | None = _KEEP,
        ratios: tuple[float | None, float | None] = (None, None),
        curvature: float | Sequence[float] = 0.0,
        twist: float | Sequence[float] = 0.0,
        retardation: float = 0.0,
        **unknown: object,
    ) -> None:
        refuse_unknown("Ribbon", unknown, (*_SIZES, "poisson", *_RATIOS, *_SHAPES, "retardation"))
        for name, value in zip(_SIZES, (length, width, thickness, young, density), strict=True):
            object.__setattr__(self, name, self._positive(name, value))
        poisson = field_number("Ribbon", "poisson", poisson)
        if not -1.0 < poisson < 0.5:
            raise SceneError(f"Ribbon.poisson = {poisson!r}: must be in (-1, 0.5)")
        object.__setattr__(self, "poisson", poisson)
        if not isinstance(ratios, (tuple, list)) or len(ratios) != 2:
            raise SceneError(f"Ribbon.ratios = {shown(ratios)}: a pair is needed, EI1/EI2 and GJ/EI2 or None")
        given = [
            old if new is _KEEP else new
            for old, new in zip(ratios, (bending_ratio, twist_ratio), strict=True)
        ]
        kept = [
            None if value is None else self._positive(name, value)
            for name, value in zip(_RATIOS, given, strict=True)
        ]
        object.__setattr__(self, "ratios", tuple(kept))
        for name, values in zip(_SHAPES, (curvature, twist), strict=True):
            object.__setattr__(self, name, _along(name, values))
        retardation = field_number("Ribbon", "retardation", retardation)
        if retardation < 0.0:
            raise SceneError(f"Ribbon.retardation = {retardation!r}: must not be negative")
        object.__setattr__(self, "retardation", retardation)
        for name in ("bending_stiffness", "stretch_ratio", "inertial_time", *_RATIOS):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                sizes = ", ".join(f"{name} = {getattr(self, name)!r}" for name in _SIZES)
                raise SceneError(f"Ribbon: {sizes}: {name} = {value!r} must be a positive finite number")
        self._warn()

    @staticmethod
    def _positive(name: str, value: object) -> float:
        number = field_number("Ribbon", name, value)
        if number <= 0.0:
            raise SceneError(f"Ribbon.{name} = {number!r}: must be greater than 0")
        return number

    def _warn(self) -> None:
        """Tell plausible slips in the units."""
        slip = ""
        for name, most in (("thickness", 0.5), ("width", 2.0)):
            if getattr(self, name) >= most * self.length:
                slip = f"Ribbon.{name} = {getattr(self, name)!r} m beside length = {self.length!r} m"
        if self.length >= 25.0:
            slip = f"Ribbon.length = {self.length!r} m"
        if slip:
            warnings.warn(f"{slip}: dimensions are in m, not in mm", SceneWarning, stacklevel=3)
        if self.young < 2e3:
            warnings.warn(
                f"Ribbon.young = {self.young!r} Pa is softer than any solid: moduli are in Pa, not in GPa",
                SceneWarning,
                stacklevel=3,
            )

    def _values(self) -> tuple[Any, ...]:
        return tuple(getattr(self, name) for name in (*_SIZES, "poisson", *_RATIOS, *_SHAPES, "retardation"))

    def __eq__(self, other: object) -> bool:
        return self._values() == other._values() if isinstance(other, Ribbon) else NotImplemented

    def __hash__(self) -> int:
        return hash(self._values())

    def __repr__(self) -> str:
        values = {name: getattr(self, name) for name in (*_SIZES, "poisson")}
        values |= {name: value for name, value in zip(_RATIOS, self.ratios, strict=True) if value is not None}
        values |= {name: value for name in (*_SHAPES, "retardation") if (value := getattr(self, name))}
        return f"Ribbon({', '.join(f'{name}={value!r}' for name, value in values.items())})"

    @property
    def bending_ratio(self) -> float:
        """EI1/EI2: as given, or (W/h)^2."""
        given = self.ratios[0]
        return _rounded(_or_infinite(lambda: (self.width / self.thickness) ** 2)) if given is None else given

    @property
    def twist_ratio(self) -> float:
        """GJ/EI2: as given, or of a rectangle with this Poisson's ratio."""
        given = self.ratios[1]
        if given is not None:
            return given
        aspect = _or_infinite(lambda: max(self.width / self.thickness, self.thickness / self.width))
        if not math.isfinite(aspect):
            return math.inf
        # J counts the longer side once and the shorter cubed, EI2 the width once and the thickness cubed
        turned = min(1.0, _or_infinite(lambda: (self.width / self.thickness) ** 2))
        return _rounded(6.0 * torsion(aspect) / (1.0 + self.poisson) * turned)

    @property
    def bending_stiffness(self) -> float:
        """EI2 = E W h^3 / 12, the soft bending stiffness, in N m2."""
        return _or_infinite(lambda: self.young * self.width * self.thickness**3 / 12.0)

    @property
    def stretch_ratio(self) -> float:
        """EA L^2 / EI2 = 12 (L/h)^2."""
        return _or_infinite(lambda: 12.0 * (self.length / self.thickness) ** 2)

    @property
    def inertial_time(self) -> float:
        """t* = sqrt(rho h L^4 / B) with B = EI2 / W, in seconds (paper, section 4.2)."""
        return _or_infinite(
            lambda: math.sqrt(12.0 * self.density / self.young) * self.length**2 / self.thickness
        )

    @property
    def rotary_inertia(self) -> float:
        """Inertia about the tangent over rho A L^2: (W^2 + h^2) / (12 L^2)."""
        return _or_infinite(
            lambda: ((self.width / self.length) ** 2 + (self.thickness / self.length) ** 2) / 12.0
        )

    @property
    def weight_ratio(self) -> float:
        """Weight per length in EI2/L^3 at 1 m/s2: 12 rho L^3 / (E h^2)."""
        return _or_infinite(lambda: 12.0 * self.density * self.length**3 / (self.young * self.thickness**2))

    @property
    def shaped(self) -> bool:
        """Whether the ribbon has a natural curvature or twist."""
        return self.curvature != 0.0 or self.twist != 0.0

    @property
    def mirror(self) -> Ribbon:
        """The ribbon of the other natural curvature and twist."""
        opposite: dict[str, Any] = {
            name: tuple(-x for x in value) if isinstance(value, tuple) else -value
            for name, value in (("curvature", self.curvature), ("twist", self.twist))
        }
        return replace(self, **opposite)

    def natural(self, s: Any) -> tuple[Any, Any]:
        """Natural curvature about the width and twist, in 1/L, at s/L."""

        def along(values: float | tuple[float, ...]) -> Any:
            points = np.atleast_1d(np.asarray(values, dtype=float)) * self.length
            return np.interp(s, np.linspace(0.0, 1.0, len(points)), points)

        return along(self.curvature), along(self.twist)

    @property
    def one_stiffness(self) -> bool:
        """Whether both bending stiffnesses are the same, as far as a tangent's digits tell."""
        return abs(self.bending_ratio - 1.0) <= 1e-9

    @property
    def euler_shortening(self) -> float:
        """dL/L at which the straight ribbon buckles by its stretch alone; 1 where it never does.

        The force P (EI2/L^2) shortens by c P, c = EI2 / (EA L^2), and buckles at P (1 - c P) = 4 pi^2.
        """
        discriminant = 1.0 - 16.0 * math.pi**2 / self.stretch_ratio
        return 1.0 if discriminant < 0.0 else 0.5 * (1.0 - math.sqrt(discriminant))
