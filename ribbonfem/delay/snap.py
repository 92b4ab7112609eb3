"""The delay of a snap to the next order (`predict_snap`), from statics and one escape from the fold."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, Protocol, cast

from ribbonfem.options import choice, refuse
from ribbonfem.results import MESH, Array, History, SolverError
from ribbonfem.scene import Scene, SceneError

from .cubic import LOGARITHM, cubic_curve, escape_time
from .normal_forms import NormalForm
from .prediction import Delay, predict

QUANTITIES = ("snap", "first snap")
# gamma y at which the first escape starts, a few percent off the leading order; and how much nearer the other
_START, _APART = 0.06, 3.0
_FARTHEST = 0.015
# so many starts are tried, each nearer to the fold
_ATTEMPTS = 3
# factors of the terms left out (`ribbonfem.delay`), measured
_INERTIA, _LEAST, _BENT, _REST, _INERTIAL, _RINGING = 4.0, 0.4, 0.45, 1.46, 0.25, 2.0
# of the delay by the leading order: from 0.16 to 1.03 were measured
_EARLIEST, _LATEST = 0.1, 1.1


class Model(Protocol):
    """What a model that moves offers."""

    normal_forms: Callable[..., tuple[NormalForm, ...]]
    escape: Callable[..., History]
    frequencies: Callable[..., Array]


@dataclass(frozen=True)
class Lead:
    """By how much a snap precedes the end of its fold's normal form.

    Attributes
    ----------
    time: T0, s.
    error: of the integration and of the extrapolation to no amplitude, s.
    remainder: what T0 from a finite y lacks, over y^power, s^(1 + 2 power).
    power: 3/2 where inertia rules at that y, 1 where friction does.
    reach: y at which the snap happens, 6 / T0^2 of the undamped fold, 1/s^2.
    frequency: the lowest of the start state, 1/s.
    """

    time: float
    error: float
    remainder: float
    power: float
    reach: float
    frequency: float


def lead(
    model: Model, scene: Scene, fold: int = 0, quantity: str = "snap", **options: Any
) -> tuple[NormalForm, Lead]:
    """The normal form of a fold of a ramp, and T0 of the snap beyond it at the scene's damping.

    Parameters
    ----------
    fold: which of the folds, from 0; -1 is the last.
    quantity: "snap", where z(1/2) changes sign, or "first snap", where t_z(1/2) does.
    options: of the model's mesh, and `tolerance` of the escape.

    Raises
    ------
    SceneError
        Of a schedule, or of a ribbon with retardation: the normal form has the scene's damping alone.
    """
    if scene.schedule is not None:
        raise SceneError("Scene.schedule: a delay is predicted of a ramp at a constant rate")
    if scene.ribbon.retardation > 0.0:
        raise SceneError(
            f"Ribbon.retardation = {scene.ribbon.retardation!r}: a delay is predicted of Scene.damping "
            "alone; must be 0"
        )
    # the rate's size has no part in it
    still = replace(scene, rate=math.copysign(1.0, scene.rate), stop=None, hold=0.0)
    choice("quantity", quantity, QUANTITIES)
    return _lead(cast(Hashable, model), still, fold, quantity, tuple(sorted(options.items())))


@lru_cache(maxsize=256)
def _lead(
    module: Hashable, scene: Scene, fold: int, quantity: str, options: tuple[tuple[str, Any], ...]
) -> tuple[NormalForm, Lead]:
    model, given = cast(Model, module), dict(options)
    mesh = {name: value for name, value in given.items() if name in MESH}
    forms = model.normal_forms(scene, **mesh)
    if not forms:
        raise SolverError("the ramp meets no fold, so that there is no snap to predict")
    if fold >= len(forms):
        refuse("fold", fold, f"the ramp meets {len(forms)} folds, counted from 0")
    fold = fold % len(forms)
    form = forms[fold]
    # beta stands for the next terms where gamma happens to vanish
    bend = max(abs(form.cubic), abs(form.mixed))
    highest = min(_START / bend, _FARTHEST * abs(form.quadratic))

    def escaped(damping: float, y: float) -> float:
        return _from(model, replace(scene, damping=damping), form, fold, quantity, y, given)

    (high, far), (low, near) = _pair(lambda y: escaped(scene.damping, y), highest)
    power = 1.0 + 0.5 / (1.0 + scene.damping**2 / low)
    remainder = (far - near) / (high**power - low**power)
    correction = remainder * low**power
    free = escaped(0.0, high) if scene.damping > 0.0 else far
    lowest = float(model.frequencies(scene, count=1, **mesh)[0])
    return form, Lead(near - correction, abs(correction), remainder, power, 6.0 / free**2, lowest)


def _pair(escaped: Callable[[float], float], highest: float) -> tuple[tuple[float, float], ...]:
    """T0 from escapes that start at two y, the first as far out as a state is found there."""
    for attempt in range(_ATTEMPTS):
        first = highest / _APART**attempt
        try:
            return tuple((y, escaped(y)) for y in (first, first / _APART))
        except SolverError as failed:
            # a motion that does not snap would not from nearer either
            if failed.history is not None or attempt == _ATTEMPTS - 1:
                raise
    raise AssertionError("no attempt")


def _from(
    model: Model,
    scene: Scene,
    form: NormalForm,
    fold: int,
    quantity: str,
    y: float,
    options: Mapping[str, Any],
) -> float:
    """T0 from an escape that starts at y."""
    end = escape_time(y, scene.damping, form.cubic)
    # (T0 is positive but for what friction may do: a first snap comes before the normal form's end)
    for until in ("snap",) if quantity == "snap" else ("normal form", "end"):
        history = model.escape(scene, fold=fold, amplitude=y / abs(form.quadratic), until=until, **options)
        crossing = history.crossing("height" if quantity == "snap" else "slope")
        if crossing is not None:
            return end.time - crossing[0]
    raise SolverError(
        f"a ribbon that leaves the fold at {form.angle:.6g} rad, the clamp held there, has no {quantity}",
        history,
    )


def predict_snap(model: Model, scene: Scene, quantity: str = "snap", **options: Any) -> Delay:
    """The delay of a scene's snap behind its fold to the next order, with its error; no ramp is run.

    Parameters
    ----------
    model: a model that moves: `quasilinear`, `elastica`, `kirchhoff`, `der`.
    scene: its `rate` and `damping` count, `stop` and `hold` do not.
    quantity: "snap", where z(1/2) changes sign, beyond the last fold that the ramp meets, as if the
        ribbon had come to rest before it; "first snap", where t_z(1/2) does, beyond the first fold.
    options: of the model's mesh, and `tolerance` of the escape from the fold.

    Raises
    ------
    SceneError, OptionError
        For a scene or options that the model does not take; for another quantity.
    SolverError
        If the ramp meets no fold, or what leaves it does not snap by itself.
    """
    choice("quantity", quantity, QUANTITIES)
    fold = 0 if quantity == "first snap" else -1
    form, result = lead(model, scene, fold, quantity, **options)
    return next_order(form, result, scene.rate, scene.damping)


def next_order(form: NormalForm, result: Lead, rate: float, damping: float) -> Delay:
    """The delay of a ramp through a fold to the next order, T0 known.

    Parameters
    ----------
    form: with its cubic and mixed coefficients.
    found: as `lead` finds it at this damping.
    rate: rad/s, of the sign with which the fold is met.
    damping: nu, 1/s.
    """
    first = predict(form, rate, damping)
    tau = (form.product * rate) ** -0.2
    bend = form.cubic * (cubic_curve(first.damping) / tau - 2.0 * LOGARITHM * damping * math.log(tau))
    time = first.time + bend - 0.5 * form.mixed * damping - result.time
    # no snap comes before its fold, and hardly one after the leading order's
    latest = _LATEST * first.time
    time = min(max(time, _EARLIEST * first.time), latest)
    error = min(_left_out(form, result, rate, damping, first), max(time, latest - time))
    return Delay(time, rate * time, first.damping, error)


def _left_out(form: NormalForm, result: Lead, rate: float, damping: float, first: Delay) -> float:
    """Size of what `next_order` leaves out, s: see the derivation in `ribbonfem.delay`."""
    scaled = form.product * rate
    tau = scaled**-0.2
    slow = max(1.0, first.damping)
    # of y and of time in the inner problem
    size, unit = slow ** (1.0 / 3.0) / tau**2, tau * slow ** (2.0 / 3.0)
    bends = max(form.cubic**2, form.mixed**2)
    bent, rest = bends * size**2 * unit, result.remainder * size**result.power
    # where friction rules the two have signs, and what they have in common cancels
    second = (_INERTIA / slow + _LEAST) * bent + abs(_BENT * bent + _REST * rest)
    # the ramp goes on while the ribbon is far from the fold
    far = max((6.0 / result.reach) ** 0.5 * _INERTIAL, damping / result.reach)
    outside = far * scaled * first.time / result.reach**2
    # the clamp's start sets the lowest mode ringing, at the fold with what damping leaves of it
    ringing = _RINGING * tau**3.5 * abs(scaled) * result.frequency**-2.5
    ringing *= math.exp(-0.5 * damping * abs(form.angle / rate))
    return result.error + math.sqrt(second**2 + outside**2 + ringing**2)
