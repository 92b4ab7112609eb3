"""The scenes of the hard cases at rest: folds and curves of every model that takes them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

import numpy as np

import der
from ribbonfem import Scene, SceneError, SolverError, elastica, kirchhoff, quasilinear
from ribbonfem.results import Branch, Fold

from .hard_cases import CASES, ELASTICA, PLANAR, QUASILINEAR, RODS

KIRCHHOFF = "kirchhoff"
MODELS = (KIRCHHOFF, RODS, ELASTICA, QUASILINEAR)
VERBS = ("folds", "equilibria")
# nodes of the rods: of their default, and of the finer meshes that show its error
_NODES = 101
_MESHES = (_NODES, 151, 201)
# so stiff sideways and in twist that a planar state stays in its plane, where neither counts
_STIFF = MappingProxyType({"bending_ratio": 1e4, "twist_ratio": 1e3})

GOOD, ALONE, RAISED, REFUSED, WRONG, ABSENT = REST_STATUSES = (
    "right",
    "unconfirmed",
    "raised",
    "refused with reason",
    "WRONG",
    "not for this model",
)

_FORKS = "the planar state forks sideways before its fold: an error must say so"
_NEUTRAL = "turns freely about x: no isolated state"
_SIDEWAYS = "planar U is unstable sideways beyond dL/L = 0.905"
# scenes that three-dimensional models have to refuse
_MUST_REFUSE = MappingProxyType(
    {
        "planar, EI1/EI2 1": _NEUTRAL,
        "planar, EI1/EI2 1.5": _FORKS,
        "planar, dL 0.95": _SIDEWAYS,
    }
)


@dataclass(frozen=True)
class StaticVerdict:
    """How a model's verb did on a scene at rest; `angle` is its first fold, of `count`, in rad."""

    scene: str
    model: str
    verb: str
    status: str
    note: str = ""
    angle: float | None = None
    count: int | None = None
    error: float | None = None


def static_scenes() -> dict[str, Scene]:
    """The distinct scenes of the hard cases at rest, by the name of the first case that has each."""
    found: dict[Scene, str] = {}
    for case in CASES:
        still = replace(
            case.scene, rate=math.copysign(1.0, case.scene.rate), stop=None, hold=0.0, damping=1.0
        )
        found.setdefault(still, case.name)
    scenes = {name: scene for scene, name in found.items()}
    ribbon = replace(CASES[0].scene.ribbon, bending_ratio=1.5)
    scenes["planar, EI1/EI2 1.5"] = Scene(**PLANAR, rate=1.0, ribbon=ribbon)
    return scenes


def _attempt(call: Callable[[], Any]) -> Any:
    try:
        return call()
    except (SolverError, ValueError) as error:
        return error


def _angles(found: Any) -> list[float]:
    return [] if isinstance(found, Exception) else [fold.angle for fold in found]


def _known(found: Any) -> list[float] | None:
    return None if isinstance(found, Exception) else _angles(found)


def _off(found: list[float], wanted: list[float]) -> float:
    """Largest difference of fold angles; infinite if there are not as many."""
    if len(found) != len(wanted):
        return math.inf
    return max((abs(a - b) for a, b in zip(found, wanted, strict=True)), default=0.0)


def _judge_folds(
    scene: str, model: str, found: Any, wanted: list[float] | None, allowed: float, reason: str
) -> StaticVerdict:
    if isinstance(found, Exception):
        status = REFUSED if reason else RAISED
        return StaticVerdict(
            scene, model, "folds", status, f"{reason}. It says: {found}" if reason else str(found)
        )
    angles = _angles(found)
    first = angles[0] if angles else None
    if reason:
        return StaticVerdict(scene, model, "folds", WRONG, f"should refuse: {reason}", first, len(angles))
    if wanted is None:
        return StaticVerdict(scene, model, "folds", ALONE, "no other model gives it", first, len(angles))
    off = _off(angles, wanted)
    status, note = (GOOD, "") if off <= allowed else (WRONG, f"more than {allowed:.1e} from {wanted}")
    error = None if math.isinf(off) else off
    return StaticVerdict(scene, model, "folds", status, note, first, len(angles), error)


def _judge_curve(scene: str, model: str, curve: Any, folds: Any, reason: str) -> StaticVerdict:
    """The curve through the start must hold the folds that the ramp meets, within its span."""
    if isinstance(curve, Exception):
        status = REFUSED if reason else RAISED
        return StaticVerdict(scene, model, "equilibria", status, str(curve))
    if reason and isinstance(folds, SceneError):
        return StaticVerdict(scene, model, "equilibria", WRONG, f"should refuse: {reason}")
    assert isinstance(curve, Branch)
    wanted = [fold for fold in folds if abs(fold.angle) < 1.5] if not isinstance(folds, Exception) else []
    missing = [
        fold.angle
        for fold in wanted
        if min((abs(fold.angle - f.angle) for f in curve.folds), default=1.0) > 1e-7
    ]
    status, note = (WRONG, f"folds {missing} are not on the curve") if missing else (GOOD, "")
    first = curve.folds[0].angle if curve.folds else None
    return StaticVerdict(scene, model, "equilibria", status, note, first, len(curve.folds))


def _closed_form(scene: Scene) -> list[float]:
    """The fold of the quasi-linear beam, where the ramp drives its state over."""
    if (scene.start == "U+") != (scene.rate > 0.0):
        return []
    return [math.copysign(quasilinear.closed_form_fold().mu * math.sqrt(scene.compression), scene.rate)]


def _limits(found: Mapping[int, Any]) -> tuple[list[float] | None, float]:
    """The rods' folds extrapolated from three meshes, and the change from the first mesh to the limit.

    Near a pitchfork the next term in 1/N^2 counts too, so that two meshes are too few.
    """
    if any(isinstance(result, Exception) for result in found.values()):
        return None, 0.0
    angles = [_angles(result) for result in found.values()]
    if len({len(row) for row in angles}) > 1:
        return None, 0.0
    squares = np.array([(nodes - 2.0) ** -2 for nodes in found])
    weights = [np.prod([other / (other - own) for other in squares if other != own]) for own in squares]
    limit = [float(np.dot(weights, fold)) for fold in zip(*angles, strict=True)]
    return limit, _off(angles[0], limit)


def judge_statics(name: str, scene: Scene) -> list[StaticVerdict]:
    """Folds and curves of a scene by every model, each against another that shares no mechanics."""
    reason = _MUST_REFUSE.get(name, "")
    elements = _attempt(lambda: kirchhoff.folds(scene, extensible=True))
    rods = {n: _attempt(lambda n=n: der.folds(scene, nodes=n)) for n in _MESHES}  # type: ignore[misc]
    limit, change = _limits(rods)
    verdicts = [
        _judge_folds(name, KIRCHHOFF, elements, limit, 1e-6 + 0.1 * change, reason),
        _judge_folds(name, RODS, rods[_NODES], _known(elements), 1e-6 + 2.0 * change, reason),
        _judge_curve(
            name, KIRCHHOFF, _attempt(lambda: kirchhoff.equilibria(scene, extensible=True)), elements, reason
        ),
        _judge_curve(name, RODS, _attempt(lambda: der.equilibria(scene)), rods[_NODES], reason),
    ]
    if not scene.planar:
        return verdicts
    own = _attempt(lambda: elastica.folds(scene, extensible=True))
    stiff = replace(scene, ribbon=replace(scene.ribbon, **_STIFF))
    plane = _attempt(lambda: kirchhoff.folds(stiff, extensible=True))
    beam: tuple[Fold, ...] | Exception = _attempt(lambda: quasilinear.folds(scene))
    return [
        *verdicts,
        _judge_folds(name, ELASTICA, own, _known(plane), 1e-6, ""),
        _judge_folds(name, QUASILINEAR, beam, _closed_form(scene), 1e-6, ""),
        _judge_curve(name, ELASTICA, _attempt(lambda: elastica.equilibria(scene, extensible=True)), own, ""),
        _judge_curve(name, QUASILINEAR, _attempt(lambda: quasilinear.equilibria(scene)), beam, ""),
    ]
