"""Observed orders of convergence of every model in its mesh and of every method in its step."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from compare.models import MODEL_INFO
from compare.quantities.convergence import Convergence, convergence
from ribbonfem import Scene

from .cases import CASES

_SCENES = {f"{case.group}/{case.name}": case.scene for case in CASES}
_BEAM = _SCENES["static-planar/0.40"]
_RIBBON = _SCENES["static-ribbon/0.40-0.40-U+S+"]
# slow ramps: after a fast one's start the motion is too rough for a method to show its order
_MOVING_BEAM = _SCENES["dynamic-planar/0.40-rate0.1-nu1"]
_MOVING_RIBBON = _SCENES["dynamic-ribbon/0.40-0.37-rate0.1-nu1"]
_STEPS = (2e-2, 1e-2, 5e-3, 2.5e-3)
_ROD_STEPS = (1e-2, 5e-3, 2.5e-3, 1.25e-3)
# on shorter ones the elements' Newton shows through "esdirk4"
_LONG_STEPS = (4e-2, 2e-2, 1e-2, 5e-3)
# the same step on all meshes leaves their orders alone
_BEAM_STEP = {"method": "newmark", "step": 2e-2}
_ROD_STEP = {"method": "generalised-alpha", "step": 2e-2}


@dataclass(frozen=True)
class Refined:
    """A mesh or a step refined: what `convergence` is called with."""

    group: str
    label: str
    model: str
    scene: Scene
    quantity: str
    over: Mapping[str, tuple[float, ...]]
    options: Mapping[str, Any]

    def converge(self) -> Convergence:
        """Do it."""
        return convergence(self.model, self.scene, self.quantity, dict(self.over), **self.options)


def _at_rest() -> list[Refined]:
    beams: list[tuple[str, str, dict[str, tuple[float, ...]], dict[str, Any]]] = [
        ("quasi-linear", "quasilinear", {"elements": (8, 16, 32, 64)}, {}),
        ("elastica", "elastica", {"elements": (12, 16, 24, 32)}, {}),
        ("elastica, EA", "elastica", {"elements": (12, 16, 24, 32)}, {"extensible": True}),
        ("DER centred", "der", {"nodes": (51, 101, 201, 401)}, {}),
        ("DER two-node", "der", {"nodes": (101, 201, 401, 801)}, {"clamp": "two-node"}),
    ]
    ribbons: list[tuple[str, str, dict[str, tuple[float, ...]], dict[str, Any]]] = [
        ("Kirchhoff", "kirchhoff", {"elements": (8, 12, 16, 20)}, {}),
        ("Kirchhoff, EA", "kirchhoff", {"elements": (8, 12, 16, 20)}, {"extensible": True}),
        *beams[-2:],
    ]
    return [
        Refined(group, label, model, scene, quantity, over, options)
        for group, scene, what in (("static-planar", _BEAM, beams), ("static-ribbon", _RIBBON, ribbons))
        for label, model, over, options in what
        for quantity in ("fold", "shape", "energy")
    ]


def _in_step(
    group: str,
    label: str,
    model: str,
    scene: Scene,
    method: str,
    steps: tuple[float, ...],
    options: Mapping[str, Any],
) -> Refined:
    """The order of a method in its step, by the snap."""
    name, over = f"{label}, {method}", {"step": steps}
    return Refined(group, name, model, scene, "snap", over, {**options, "method": method})


def _in_motion() -> list[Refined]:
    planar, ribbon = "dynamic-planar", "dynamic-ribbon"
    nodes, finer = {"nodes": (51, 101, 201)}, {"nodes": (101, 201, 401)}
    two_node = {**_ROD_STEP, "clamp": "two-node"}
    result = [
        Refined(
            group, label, model, _MOVING_BEAM if group == planar else _MOVING_RIBBON, "snap", over, options
        )
        for group, label, model, over, options in (
            (planar, "quasi-linear", "quasilinear", {"elements": (8, 16, 32)}, _BEAM_STEP),
            (planar, "elastica", "elastica", {"elements": (4, 6, 8, 10)}, _BEAM_STEP),
            (planar, "DER centred", "der", nodes, _ROD_STEP),
            (planar, "DER two-node", "der", finer, two_node),
            (ribbon, "DER centred", "der", nodes, _ROD_STEP),
            (ribbon, "DER two-node", "der", finer, two_node),
        )
    ]
    stretching = {"extensible": True}
    # fine enough to show their order, and coarse enough to lie above what Newton leaves
    for group, scene, meshes in (
        (planar, _MOVING_BEAM, (4, 6, 8, 10)),
        (ribbon, _MOVING_RIBBON, (6, 8, 10, 12)),
    ):
        over, options = {"elements": meshes}, _ROD_STEP | stretching
        result.append(Refined(group, "Kirchhoff, EA", "kirchhoff", scene, "snap", over, options))
        result += [
            _in_step(
                group,
                "Kirchhoff, EA",
                "kirchhoff",
                scene,
                method,
                _LONG_STEPS if method == "esdirk4" else _STEPS,
                {"elements": 4} | stretching,
            )
            for method in MODEL_INFO["kirchhoff"].methods
        ]
    for model, label, elements in (("quasilinear", "quasi-linear", 16), ("elastica", "elastica", 6)):
        result += [
            _in_step(planar, label, model, _MOVING_BEAM, method, _STEPS, {"elements": elements})
            for method in MODEL_INFO[model].methods
        ]
    # an iteration stopped early leaves an error that does not fall with the step
    exact = {"nodes": 26, "newton_tolerance": 1e-11}
    for group, scene in ((planar, _MOVING_BEAM), (ribbon, _MOVING_RIBBON)):
        result += [
            _in_step(group, "DER", "der", scene, method, _ROD_STEPS, exact)
            for method in MODEL_INFO["der"].methods
            if method != "verlet"
        ]
    return result


def refinements(groups: tuple[str, ...], models: tuple[str, ...]) -> list[Refined]:
    """What is refined of these groups and models."""
    return [s for s in (*_at_rest(), *_in_motion()) if s.group in groups and s.model in models]


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def record(study: Refined, result: Convergence) -> dict[str, Any]:
    """A study and what came of it, for programs."""
    return {
        "group": study.group,
        "label": study.label,
        "model": study.model,
        "quantity": study.quantity,
        "over": result.over,
        "at": list(result.at),
        "sizes": list(result.sizes),
        "errors": [float(e) for e in result.errors],
        "orders": [_number(p) for p in result.orders],
        "order": _number(result.order),
        "expected": result.expected,
        "verified": result.verified,
        "policy": dict(study.options),
    }
