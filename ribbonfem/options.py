"""Checks of the options of public functions: types, ranges, unknown keywords, memory, length of a run.

`checked` decorates a function of a model: every keyword that the models share is checked in one
place, before anything is computed, and a keyword that there is not is answered with those that
there are.
"""

from __future__ import annotations

import inspect
import math
import os
from collections.abc import Callable, Sequence
from contextvars import ContextVar
from functools import wraps
from numbers import Integral
from typing import Any, NoReturn, ParamSpec, TypeVar

import numpy as np

from .scene import Ribbon, Scene, SceneError, as_number, shown

P = ParamSpec("P")
T = TypeVar("T")

# steps of one run: at some 10 us each a run of hours
MOST_STEPS = 1e9
# rad; ends of a span, and angles at which a state is asked for: three turns, or a slip in the unit
_WIDEST = 20.0
# fields of a ribbon that its states at rest depend on, in L, EI2/L and EI2/L^2
_OF_STATES = ("length", "width", "thickness", "bending_ratio", "twist_ratio", "curvature", "twist")


class OptionError(ValueError):
    """An option that cannot be: names it, its value and what is allowed."""


class KeywordError(OptionError, TypeError):
    """A call that a function does not take: an unknown keyword, or one too few; names those there are."""


def refuse(name: str, value: object, allowed: str) -> NoReturn:
    """Raise a `OptionError` in the form that all of them have."""
    raise OptionError(f"{name} = {shown(value)}: {allowed}")


def number(name: str, value: object) -> float:
    """Return `value` as a finite float."""
    try:
        return as_number(value)
    except ValueError as error:
        raise OptionError(f"{name} = {shown(value)}: {error}") from None


def whole_number(name: str, value: object, least: int, most: int = 10**9) -> int:
    """Return `value` as an int from `least` to `most`."""
    whole = isinstance(value, Integral) and not isinstance(value, (bool, np.timedelta64))
    if not whole or not least <= int(value) <= most:  # type: ignore[call-overload]
        refuse(name, value, f"must be a whole number of at least {least}, and at most {most}")
    return int(value)  # type: ignore[call-overload]


def positive(name: str, value: object, most: float = math.inf) -> float:
    """Return `value` as a positive finite float of at most `most`."""
    try:
        result = as_number(value)
    except ValueError:
        result = 0.0
    if not 0.0 < result <= most:
        end = "" if most == math.inf else f" of at most {most:g}"
        refuse(name, value, f"must be a positive finite number{end}")
    return result


def within(name: str, value: object, low: float, high: float) -> float:
    """Return `value` as a float of [low, high]."""
    result = number(name, value)
    if not low <= result <= high:
        refuse(name, value, f"must be in [{low:g}, {high:g}]")
    return result


def choice(name: str, value: object, allowed: Sequence[str]) -> str:
    """Return `value` if it is one of `allowed`."""
    if not isinstance(value, str) or value not in allowed:
        refuse(name, value, f"must be one of {', '.join(map(repr, allowed))}")
    return value


def flag(name: str, value: object) -> bool:
    """Return `value` if it is True or False."""
    if not isinstance(value, (bool, np.bool_)):
        refuse(name, value, "must be True or False")
    return bool(value)


def interval(name: str, value: object) -> tuple[float, float]:
    """Return `value` as a pair of numbers, the first one lower."""
    try:
        low, high = (as_number(end) for end in value)  # type: ignore[attr-defined]
    except (TypeError, ValueError):
        refuse(name, value, "must be a pair of finite numbers")
    if not low < high:
        refuse(name, value, "must be a pair of numbers, the first one lower")
    return low, high


def angle(name: str, value: object) -> float:
    """Return `value` as an angle in rad."""
    return within(name, value, -_WIDEST, _WIDEST)


def local_error(name: str, value: object) -> float:
    """Return `value` as a tolerance of positions, in L."""
    return positive(name, value, 0.1)


def require_ribbon(initial: Any, scene: Scene) -> None:
    """Raise a `OptionError` if a state at rest is of another ribbon than the scene's.

    What it is at rest depends on sizes, ratios and natural shape: weight is that of its own scene.
    """
    own, wanted = initial.scene.ribbon, scene.ribbon
    for field in _OF_STATES:
        has, needed = getattr(own, field), getattr(wanted, field)
        if has != needed:
            refuse(
                "initial",
                initial,
                f"its Ribbon.{field} is {shown(has)}, and that of the scene {shown(needed)}; "
                "the same ribbon is needed",
            )


def a_scene(name: str, value: object) -> Scene:
    """Return `value` if it is a `Scene`."""
    if not isinstance(value, Scene):
        refuse(name, value, "a Scene is needed")
    return value


def a_ribbon(name: str, value: object) -> Ribbon | None:
    """Return `value` if it is a `Ribbon` or None."""
    if value is not None and not isinstance(value, Ribbon):
        refuse(name, value, "a Ribbon is needed, or None for the default one")
    return value


# keywords that mean one thing in every function, and their checks
CHECKS: dict[str, Callable[[str, Any], Any]] = {
    "scene": a_scene,
    "ribbon": a_ribbon,
    "extensible": flag,
    "configurations": flag,
    "gyroscopic": flag,
    "count": lambda name, value: whole_number(name, value, 1),
    "which": lambda name, value: whole_number(name, value, 0),
    "span": lambda name, value: None if value is None else interval(name, value),
    "angle": angle,
    "unstable": lambda name, value: whole_number(name, value, 0, 1000),
    "every": lambda name, value: None if value is None else whole_number(name, value, 1),
    "step": lambda name, value: None if value is None else positive(name, value),
    "tolerance": lambda name, value: None if value is None else local_error(name, value),
}


# options of the checked function that is being called
_given: ContextVar[dict[str, Any]] = ContextVar("given")
# what is no option of a model but a start, or how a curve is followed
_NO_OPTIONS = ("initial", "steps")


def options_given(**settled: Any) -> dict[str, Any]:
    """The options with which the `checked` function that asks was called, defaults among them, in its order.

    `settled`: values of those that the call left open.
    """
    return {**_given.get(), **settled}


def checked(function: Callable[P, T]) -> Callable[P, T]:
    """Check what a function of a model is called with, by `CHECKS`; see `options_given` too."""
    return _checked(function, CHECKS)


def call_of_a_scene(function: Callable[P, T]) -> Callable[P, T]:
    """As `checked`, for what is asked of a scene and not of a model: its own options are for it to check."""
    return _checked(function, {"scene": a_scene})


def _checked(function: Callable[P, T], known: dict[str, Callable[[str, Any], Any]]) -> Callable[P, T]:
    signature = inspect.signature(function)
    taken = tuple(signature.parameters)
    by_name: Callable[..., T] = function
    of = signature.parameters.values()
    places = tuple(parameter.name for parameter in of if parameter.kind is parameter.POSITIONAL_OR_KEYWORD)
    needed = {parameter.name for parameter in of if parameter.default is parameter.empty}
    checks = {name: known[name] for name in taken if name in known}
    defaults = {
        name: parameter.default
        for name, parameter in signature.parameters.items()
        if parameter.kind is parameter.KEYWORD_ONLY and name not in _NO_OPTIONS
    }
    module = function.__module__
    for file in (".functions", ".motion", ".two_parameters"):
        module = module.removesuffix(file)
    what = f"{module}.{function.__name__}"

    @wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> T:
        for name, value in kwargs.items():
            if name not in taken:
                raise KeywordError(
                    f"{name} = {shown(value)}: {what} has no such keyword; it takes {', '.join(taken)}"
                )
        given: dict[str, Any] = dict(zip(places, args, strict=False))
        if len(given) < len(args) or given.keys() & kwargs or needed - given.keys() - kwargs.keys():
            # (Python says what is wrong; to ask it always takes longer than all checks)
            try:
                signature.bind(*args, **kwargs)
            except TypeError as error:
                named = ", ".join(name for name in taken if name not in places)
                first = f"it takes {', '.join(places)}" + (f", and by keyword {named}" if named else "")
                raise KeywordError(f"{what}: {error}; {first}") from None
        given |= kwargs
        # (in the order of the signature: what is told first does not depend on how it was called)
        for name, check in checks.items():
            if name in given:
                given[name] = check(name, given[name])
        token = _given.set({**defaults, **{name: given[name] for name in given if name in defaults}})
        try:
            return by_name(**given)
        finally:
            _given.reset(token)

    return call


def half_of_memory() -> float:
    """Half of this machine's memory in bytes; infinite where it cannot be told."""
    try:
        return 0.5 * os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, OSError, ValueError):
        return math.inf


def require_memory(name: str, value: object, needed: float, what: str) -> None:
    """Raise a `OptionError` if what an option asks for needs more than half of the memory."""
    most = half_of_memory()
    if needed > most:
        refuse(
            name,
            value,
            f"{what} would need {needed:.3g} bytes, and at most {most:.3g} are allowed, half of the memory",
        )


def require_duration(scene: Scene, step: float | None, largest_turn: float, row: float) -> None:
    """Refuse a run of more than `MOST_STEPS` steps, or whose rows do not fit in half of the memory.

    Parameters
    ----------
    scene: with `stop`.
    step: fixed, s; None for adaptive steps.
    largest_turn: of the clamp in an adaptive step, rad.
    row: bytes of what a step leaves.

    Raises
    ------
    OptionError, SceneError
        Naming the step or, of adaptive runs, the field of the scene that makes the run so long.
    """
    stop, schedule = scene.require_stop(), scene.schedule
    ramp = abs(stop / scene.rate) if schedule is None else schedule.time[-1]
    limit = f"at most {MOST_STEPS:g} are allowed"
    if step is not None:
        count = (ramp + scene.hold) / step
        if not count <= MOST_STEPS:
            refuse(
                "step",
                step,
                f"the run of {ramp + scene.hold:.6g} s would need {count:.3g} steps, and {limit}",
            )
        require_memory("step", step, count * row, f"{count:.3g} steps")
        return
    way = abs(stop) if schedule is None else float(np.abs(np.diff(schedule.value)).sum())
    if not way / largest_turn <= MOST_STEPS:
        name, value = ("stop", stop) if schedule is None else ("schedule", schedule)
        raise SceneError(
            f"Scene.{name} = {shown(value)}: the ramp would need {way / largest_turn:.3g} steps, and {limit}"
        )
    # a step as short as a snap asks for has to be more than rounding beside the time that has passed
    most = 1e12 * scene.ribbon.inertial_time
    first = ("rate", "turned") if schedule is None else ("schedule", "moved")
    for (name, what), duration in ((first, ramp), (("hold", "held"), scene.hold)):
        if not duration <= most:
            raise SceneError(
                f"Scene.{name} = {shown(getattr(scene, name))}: the clamp would be {what} for "
                f"{duration:.3g} s; at most {most:.3g} s (1e12 t*) are allowed: in longer ones the "
                "time steps of a snap are lost to rounding"
            )
