"""Checks of policy values (mesh, method, step), with messages that name the value and what is allowed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from numbers import Integral, Real
from typing import cast


class PolicyError(ValueError):
    """A policy value that cannot be: names it, its value and what is allowed."""


def whole_number(name: str, value: object, least: int) -> int:
    """Return `value` as an int of at least `least`."""
    if isinstance(value, bool) or not isinstance(value, Integral) or int(value) < least:
        raise PolicyError(f"{name} = {value!r}: must be a whole number of at least {least}")
    return int(value)


def positive(name: str, value: object) -> float:
    """Return `value` as a positive finite float."""
    if isinstance(value, bool) or not isinstance(value, Real) or not 0.0 < float(value) < math.inf:
        raise PolicyError(f"{name} = {value!r}: must be a positive finite number")
    return float(value)


def choice(name: str, value: object, allowed: Sequence[str]) -> str:
    """Return `value` if it is one of `allowed`."""
    if value not in allowed:
        raise PolicyError(f"{name} = {value!r}: must be one of {', '.join(map(repr, allowed))}")
    return str(value)


def flag(name: str, value: object) -> bool:
    """Return `value` if it is True or False."""
    if not isinstance(value, bool):
        raise PolicyError(f"{name} = {value!r}: must be True or False")
    return value


def interval(name: str, value: object) -> tuple[float, float]:
    """Return `value` as a pair of finite angles with 0 inside."""
    try:
        low, high = (float(end) for end in cast(Sequence[float], value))
    except (TypeError, ValueError):
        raise PolicyError(f"{name} = {value!r}: must be a pair of angles (rad)") from None
    if not -math.inf < low < 0.0 < high < math.inf:
        raise PolicyError(f"{name} = {value!r}: must have 0 inside and be finite")
    return low, high
