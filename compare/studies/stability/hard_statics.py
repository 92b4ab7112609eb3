"""Hard cases at rest: folds and curves of equilibria of every model, run and judged against each other."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from types import MappingProxyType
from typing import Any

import der
from compare.limits import limit_of
from ribbonfem import Ribbon, Scene, elastica, kirchhoff, quasilinear
from ribbonfem.continuation import Steps
from ribbonfem.results import Branch, Fold

from .hard_cases import (
    CASES,
    COARSE,
    ELASTICA,
    PATH_1,
    PLANAR,
    QUASILINEAR,
    RAISED,
    RODS,
    UNBROKEN,
    WEIGHTLESS,
    WRONG,
    is_refusal,
    message_of,
)

KIRCHHOFF = "kirchhoff"
MODELS = (KIRCHHOFF, RODS, ELASTICA, QUASILINEAR)
FUNCTIONS = ("folds", "equilibria")
# nodes of the rods: of their default, and of the finer meshes that show its error
_NODES = 151
_MESHES = (_NODES, 201, 301)
# so stiff out of the plane and in twist that a planar state stays in its plane, where neither counts
_STIFF: Mapping[str, Any] = MappingProxyType({"bending_ratio": 1e4, "twist_ratio": 1e3})

# scenes at rest that no motion has: near others, where following a curve is what can fail
_MORE: MappingProxyType[str, dict[str, Any]] = MappingProxyType(
    {
        # 100 and 1.409 follow
        "h/L 0.02": {**PATH_1, "ribbon": Ribbon(thickness=0.02)},
        "EI1/EI2 10": {**UNBROKEN, "ribbon": Ribbon(bending_ratio=10.0)},
        "EI1/EI2 1e3": {**PATH_1, "ribbon": Ribbon(bending_ratio=1e3)},
        "GJ/EI2 0.1": {**UNBROKEN, "ribbon": Ribbon(twist_ratio=0.1)},
        "dW 1e-4": {**PATH_1, "shear": 1e-4, "start": "U+"},
        "above the pitchfork, U+S-": {**PATH_1, "shear": 0.335},
        "before U+S- is S-": {**PATH_1, "shear": 0.488},
        "nearly taut, dW 0.79": {**PATH_1, "shear": 0.79, "start": "S+"},
        "dL 0.01": {"compression": 0.01, "shear": 0.07, "start": "S+"},
        "mirror image, U-S-": {**PATH_1, "start": "U-S-", "rate": -1.0},
        "planar, dL 0.01": {**PLANAR, "compression": 0.01},
        "planar mirror image": {**PLANAR, "start": "U-", "rate": -1.0},
        "planar, EI1/EI2 1.5": {**PLANAR, "ribbon": Ribbon(bending_ratio=1.5)},
    }
)

# part of an angle by which a default mesh may be off
_OFF = 0.01
# a tenth of the longest step of a continuation
_SHORT = Steps(largest=0.1 * Steps().largest)

SOUND, ALONE, TOLD, ABSENT = "right", "unconfirmed", "refused with reason", "not for this model"

_FORKS = "the planar state forks out of its plane before its fold: an error must say so"
_NEUTRAL = "turns freely about x: no isolated state"
_OUT_OF_PLANE = "planar U is unstable out of its plane beyond dL/L = 0.905"
# scenes that three-dimensional models must not answer; an error that `is_refusal` is the best they can say
_MUST_FAIL = MappingProxyType(
    {
        "planar, EI1/EI2 1": _NEUTRAL,
        "planar, EI1/EI2 1.5": _FORKS,
        "planar, dL 0.95": _OUT_OF_PLANE,
    }
)


@dataclass(frozen=True)
class StaticVerdict:
    """How a model's function did on a scene at rest; `angle` is its first fold, of `count`, in rad."""

    scene: str
    model: str
    function: str
    status: str
    note: str = ""
    angle: float | None = None
    count: int | None = None
    error: float | None = None


def static_scenes() -> dict[str, Scene]:
    """The distinct scenes of the hard cases at rest, by the first case that has each, and more like them."""
    result: dict[Scene, str] = {}
    for case in CASES:
        still = replace(
            case.scene, rate=math.copysign(1.0, case.scene.rate), stop=None, hold=0.0, damping=1.0
        )
        result.setdefault(still, case.name)
    scenes = {name: scene for scene, name in result.items()}
    return scenes | {
        name: Scene(**{"rate": 1.0, "gravity": WEIGHTLESS, **changes}) for name, changes in _MORE.items()
    }


def _attempt(call: Callable[[], Any]) -> Any:
    try:
        return call()
    except Exception as error:  # whatever it is, it is this model's verdict and must not end the others'
        return error


def _failure(scene: str, model: str, function: str, error: Exception, reason: str) -> StaticVerdict:
    """The verdict on an error: a refusal only if it is foreseen and names what cannot be."""
    note = f"{reason}. It says: {message_of(error)}" if reason else message_of(error)
    return StaticVerdict(scene, model, function, TOLD if reason and is_refusal(error) else RAISED, note)


def _angles(result: Any) -> list[float]:
    return [] if isinstance(result, Exception) else [fold.angle for fold in result]


def _known(result: Any) -> list[float] | None:
    return None if isinstance(result, Exception) else _angles(result)


def _off(result: list[float], wanted: list[float]) -> float:
    """Largest difference of fold angles; infinite if there are not as many."""
    if len(result) != len(wanted):
        return math.inf
    return max((abs(a - b) for a, b in zip(result, wanted, strict=True)), default=0.0)


def _judge_folds(
    scene: str, model: str, result: Any, wanted: list[float] | None, allowed: float, reason: str
) -> StaticVerdict:
    if isinstance(result, Exception):
        return _failure(scene, model, "folds", result, reason)
    angles = _angles(result)
    first = angles[0] if angles else None
    if reason:
        return StaticVerdict(scene, model, "folds", WRONG, f"should not answer: {reason}", first, len(angles))
    if wanted is None:
        return StaticVerdict(scene, model, "folds", ALONE, "no other model gives it", first, len(angles))
    off = _off(angles, wanted)
    status, note = (SOUND, "") if off <= allowed else (WRONG, f"more than {allowed:.1e} from {wanted}")
    if status == SOUND and off > _OFF * max((abs(angle) for angle in wanted), default=math.inf):
        # what it tends to is right, and shown so by finer meshes; what a newcomer is given is not
        status, note = COARSE, f"tends to {wanted}, from which its default mesh is more than {_OFF:.0%} off"
    error = None if math.isinf(off) else off
    return StaticVerdict(scene, model, "folds", status, note, first, len(angles), error)


def _judge_curve(scene: str, model: str, curve: Any, folds: Any, reason: str) -> StaticVerdict:
    """The curve through the start must hold the folds that the ramp meets, within its span."""
    if isinstance(curve, Exception):
        return _failure(scene, model, "equilibria", curve, reason)
    if reason and isinstance(folds, Exception) and is_refusal(folds):
        # the start state itself is what there is not: no curve passes through it
        return StaticVerdict(scene, model, "equilibria", WRONG, f"should refuse: {reason}")
    assert isinstance(curve, Branch)
    wanted = [fold for fold in folds if abs(fold.angle) < 1.5] if not isinstance(folds, Exception) else []
    missing = [
        fold.angle
        for fold in wanted
        if min((abs(fold.angle - f.angle) for f in curve.folds), default=1.0) > 1e-7
    ]
    status, note = (WRONG, f"folds {missing} are not on the curve") if missing else (SOUND, "")
    first = curve.folds[0].angle if curve.folds else None
    return StaticVerdict(scene, model, "equilibria", status, note, first, len(curve.folds))


def _judge_jumps(curves: Mapping[str, tuple[Any, Callable[[Steps], Any]]]) -> dict[str, str]:
    """The models whose curves jump to another one, with what shows it; {} if all have as many folds.

    Where two models disagree each is asked again with short steps: a curve that has other folds
    then was left on the way.
    """
    counts = {model: len(result.folds) for model, (result, _) in curves.items() if isinstance(result, Branch)}
    if len(set(counts.values())) < 2:
        return {}
    notes = {}
    for model, count in counts.items():
        again = _attempt(partial(curves[model][1], _SHORT))
        if isinstance(again, Branch) and len(again.folds) != count:
            notes[model] = f"leaves its curve: with steps a tenth as long there are {len(again.folds)} folds"
    return notes or {model: "the other model's curve has other folds" for model in counts}


def _closed_form(scene: Scene) -> list[float]:
    """The fold of the quasi-linear beam, where the ramp drives its state over."""
    if (scene.start == "U+") != (scene.rate > 0.0):
        return []
    return [math.copysign(quasilinear.closed_form_fold().mu * math.sqrt(scene.compression), scene.rate)]


def _limits(results: Mapping[int, Any]) -> tuple[list[float] | None, float]:
    """The rods' folds extrapolated from three meshes, and how far the first, the default, is from them.

    Near a pitchfork the next term in 1/N^2 counts too, so that two meshes are too few.
    """
    if any(isinstance(result, Exception) for result in results.values()):
        return None, 0.0
    angles = [_angles(result) for result in results.values()]
    if len({len(row) for row in angles}) > 1:
        return None, 0.0
    limit = [limit_of(fold, tuple(results))[0] for fold in zip(*angles, strict=True)]
    return limit, _off(angles[0], limit)


def _judge_curves(name: str, scene: Scene, elements: Any, rods: Any, reason: str) -> list[StaticVerdict]:
    """The curves of the two models that bend out of their plane, each by its own folds and by the other."""
    follow = {
        KIRCHHOFF: lambda steps: kirchhoff.equilibria(scene, extensible=True, steps=steps),
        RODS: lambda steps: der.equilibria(scene, steps=steps),
    }
    curves = {model: (_attempt(partial(call, None)), call) for model, call in follow.items()}
    jumps = _judge_jumps(curves)
    verdicts = []
    for model, folds in ((KIRCHHOFF, elements), (RODS, rods)):
        verdict = _judge_curve(name, model, curves[model][0], folds, reason)
        if model in jumps and verdict.status == SOUND:
            status = WRONG if "leaves" in jumps[model] else ALONE
            verdict = replace(verdict, status=status, note=jumps[model])
        verdicts.append(verdict)
    return verdicts


def judge_statics(name: str, scene: Scene) -> list[StaticVerdict]:
    """Folds and curves of a scene by every model, each against another that shares no mechanics."""
    reason = _MUST_FAIL.get(name, "")
    elements = _attempt(lambda: kirchhoff.folds(scene, extensible=True))
    rods = {n: _attempt(partial(der.folds, scene, nodes=n)) for n in _MESHES}
    limit, change = _limits(rods)
    verdicts = [
        _judge_folds(name, KIRCHHOFF, elements, limit, 1e-6 + 0.1 * change, reason),
        _judge_folds(name, RODS, rods[_NODES], _known(elements), 1e-6 + 2.0 * change, reason),
        *_judge_curves(name, scene, elements, rods[_NODES], reason),
    ]
    if not scene.planar:
        return verdicts
    own = _attempt(lambda: elastica.folds(scene, extensible=True))
    held_in_plane = replace(scene, ribbon=replace(scene.ribbon, **_STIFF))
    plane = _attempt(lambda: kirchhoff.folds(held_in_plane, extensible=True))
    beam: tuple[Fold, ...] | Exception = _attempt(lambda: quasilinear.folds(scene))
    return [
        *verdicts,
        _judge_folds(name, ELASTICA, own, _known(plane), 1e-6, ""),
        _judge_folds(name, QUASILINEAR, beam, _closed_form(scene), 1e-6, ""),
        _judge_curve(name, ELASTICA, _attempt(lambda: elastica.equilibria(scene, extensible=True)), own, ""),
        _judge_curve(name, QUASILINEAR, _attempt(lambda: quasilinear.equilibria(scene)), beam, ""),
    ]
