"""What a diagram knows of a scene at rest: the two folds of a ramp, and the stable states where it stops."""

from __future__ import annotations

import math
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np

from compare.models import MODELS
from compare.quantities.branches import both_folds, span_to, stable_at
from ribbonfem import Branch, Fold, Scene, SceneError, Schedule, SolverError
from ribbonfem.outcomes import middle_side, name_by_signs
from ribbonfem.results import control_text

# name, height over the mean of the clamps' (L) and slope
State = tuple[str, float, float]

# heights (L) and slopes below this vanish when a state is named
_FLAT = 1e-6
# how near two states, or a state and a curve, are one: rows of a curve are interpolated
_ONE = 0.01
# of a motion that comes to rest: damping, ramp and hold in units of t*, and the speed (L/t*) left at its end
_DAMPED, _RAMP, _HELD, _STILL = 5.0, 5.0, 60.0, 1e-5
# heights are in L and slopes up to 1: three tenths of a slope weigh as much as a height
_SLOPE = 0.3


def is_plain(scene: Scene) -> bool:
    """Whether one clamp turns from a US state, and nothing else acts at rest: z -> -z gives more states."""
    return scene.one_clamp and len(scene.start) == 4


def _met(scene: Scene, model: str, mesh: Mapping[str, Any]) -> str:
    """What a slow ramp meets, in words."""
    try:
        points = MODELS[model].instabilities(replace(scene, stop=None, hold=0.0), **mesh)
    except SolverError as error:
        return f"cannot be followed at rest ({error})"
    listed = ", ".join(f"a {point.kind} at {control_text(scene, point.control)}" for point in points)
    return f"meets {listed or 'no fold and no branch point'}"


def two_folds(scene: Scene, model: str, mesh: Mapping[str, Any]) -> tuple[Fold, Fold]:
    """The folds of a ramp between which there is a state to skip.

    Raises
    ------
    SceneError
        If there are none; says what a slow ramp meets, and what can be asked instead.
    """
    try:
        if len(scene.start) != 4:
            raise ValueError(f"from {scene.start} there is no other state on the same side")
        folds = both_folds(scene, model, mesh)
        state = MODELS[model].state(scene, **mesh)
        middle_side(scene, folds, (state.height, state.slope))
    except (SolverError, ValueError) as error:
        if isinstance(error, SceneError) and f"Scene.start = {scene.start!r}" in str(error):
            # no stable state
            raise
        why = f" ({str(error).split(': ', 1)[-1]})" if type(error) is ValueError else ""
        raise SceneError(
            f"Scene.start = {scene.start!r}, Scene.drive = {scene.drive!r}: a slow ramp "
            f"{_met(scene, model, mesh)}, where skipping needs two folds with a state between them{why}; in "
            "which shape a ramp with a stop ends can be asked, of `selection_diagram` or `threshold`"
        ) from error
    return folds


def folds_met(scene: Scene, model: str, mesh: Mapping[str, Any]) -> tuple[Fold, ...]:
    """The folds that a slow ramp meets.

    Raises
    ------
    SceneError
        If the state at rest is lost at another point before the scene's stop.
    """
    if is_plain(scene):
        with suppress(SolverError):
            return both_folds(scene, model, mesh)
    try:
        points = MODELS[model].instabilities(replace(scene, stop=None, hold=0.0), **mesh)
    except SolverError:
        # of a curve that cannot be followed beyond the stop
        points = MODELS[model].instabilities(scene, **mesh)
    lost = next((point for point in points if point.kind != "fold"), None)
    if lost is not None and scene.stop is not None and scene.direction * (lost.control - scene.stop) < 0.0:
        raise SceneError(
            f"Scene.drive = {scene.drive!r}: the state at rest is lost at a {lost.kind}, at "
            f"{control_text(scene, lost.control)}, where a perfect run stays on it; where it goes depends on "
            "the imperfection: a preset, as small as it may be, is needed"
        )
    return tuple(Fold(point.control, point.height, point.load) for point in points if point.kind == "fold")


def apart(one: tuple[float, float], two: tuple[float, float]) -> float:
    """How far two pairs of height and slope are from each other, in L."""
    return math.hypot(one[0] - two[0], _SLOPE * (one[1] - two[1]))


def _passes(curve: Branch, control: float, state: tuple[float, float]) -> bool:
    """Whether a curve goes through a state at a control."""
    k = np.flatnonzero(np.asarray(curve.control) == control)
    return any(apart((float(curve.height[j]), float(curve.slope[j])), state) < _ONE for j in k) or any(
        apart(other, state) < _ONE for other in stable_at(curve, control, image=False)
    )


def stable_states(scene: Scene, model: str, mesh: Mapping[str, Any]) -> tuple[State, ...]:
    """The stable states at a scene's stop, by name.

    Of a plain US ramp they are on the curve through its start and on that curve's mirror image.  Of others
    every state that is stable where nothing else acts is brought there: with the control at the stop, or,
    where it is lost on this way, by a motion so damped that it comes to rest; and the curves through all of
    them at the control's start are followed.

    Raises
    ------
    SceneError, SolverError
        If the start is not stable.
    """
    module: Any = MODELS[model]
    stop = scene.require_stop()
    still = replace(scene, stop=None, hold=0.0)
    level = float(scene.clamps_height(stop))
    if is_plain(scene):
        reach = max(1.5, 1.1 * abs(stop))
        curve = module.equilibria(still, span=(-reach, reach), **mesh)
        return tuple((name_by_signs(*state), *state) for state in stable_at(curve, stop))
    span = span_to(scene, stop)
    # (feasible on the way back from there alone)
    there = replace(still, rate=Scene.rate, schedule=Schedule((0.0, 1.0), (stop, 0.999 * stop), "linear"))
    result: list[tuple[float, float]] = []
    curves: list[Branch] = []

    def add(*states: tuple[float, float]) -> None:
        for height, slope in states:
            state = height - level, slope
            if all(apart(state, other) >= _ONE for other in result):
                result.append(state)

    for name in dict.fromkeys((scene.start, *module.stable_states(scene.plain, **mesh))):
        try:
            begin = module.state(replace(still, start=name), **mesh)
        except (SceneError, SolverError):
            if name == scene.start:
                raise
            begin = None
        try:
            state = module.state(replace(there, start=name), **mesh)
            add((state.height, state.slope))
        except (SceneError, SolverError):
            if begin is not None:
                add(*_come_to_rest(replace(scene, start=name), model, mesh))
        if begin is not None and not any(
            _passes(curve, scene.begin, (begin.height, begin.slope)) for curve in curves
        ):
            with suppress(SolverError):
                curves.append(module.equilibria(replace(still, start=name), span=span, **mesh))
    for curve in curves:
        add(*stable_at(curve, stop, image=False))
    return _named(sorted(result, key=lambda state: (-round(state[0], 4), state[1])), scene)


def _come_to_rest(scene: Scene, model: str, mesh: Mapping[str, Any]) -> list[tuple[float, float]]:
    """Height and slope of the state that a damped ramp comes to rest in at its stop; none if it does not.

    Not of one that is lost at a pitchfork before, where a perfect motion stays on it.
    """
    module: Any = MODELS[model]
    unit, stop = scene.ribbon.inertial_time, scene.require_stop()
    damped = replace(scene, damping=_DAMPED / unit, rate=stop / (_RAMP * unit), hold=_HELD * unit)
    try:
        lost = [point.kind != "fold" for point in module.instabilities(scene, **mesh)]
        end = module.simulate(damped, configurations=False, **mesh)
    except (SceneError, SolverError):
        return []
    moving = abs(float(end.velocity[-1])) * unit > _STILL
    return [] if any(lost) or moving else [(float(end.height[-1]), float(end.slope[-1]))]


def name_of(height: float, slope: float, scene: Scene, flat: float) -> str:
    """The name of a shape by its signs; of what stays in the plane by that of its height alone."""
    return name_by_signs(height, 0.0 if scene.planar else slope, flat)


def _named(states: list[tuple[float, float]], scene: Scene) -> tuple[State, ...]:
    """States by their signs, and by a number where another has the same."""
    named: list[State] = []
    for height, slope in states:
        name = name_of(height, slope, scene, _FLAT)
        count = 1 + sum(other[0].split()[0] == name for other in named)
        named.append((name if count == 1 else f"{name} {count}", height, slope))
    return tuple(named)
