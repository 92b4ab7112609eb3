"""Computations behind the figures of the ribbon in motion: Figs. 6 to 14, with checks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Literal

import numpy as np

from compare.diagrams import report, selection_diagram, skipping_diagram
from compare.diagrams.report import Diagrams
from compare.limits import edge_ratio, two_point
from compare.models import MODELS, warm_up
from compare.reproduction import cases, delays
from compare.reproduction.cases import CaseVerdict
from compare.reproduction.delays import BEAM, PATH_1, PATH_2, Delays
from compare.reproduction.named_runs import CASES
from compare.reproduction.paths import RISING, SMOOTH
from compare.reproduction.rate_damping import SELECTION, SKIPPING
from compare.sweep import Sweep
from ribbonfem import History, Ribbon, Scene
from ribbonfem.delay import predict
from ribbonfem.output.curve import Curve
from ribbonfem.results import MESH, Array

SCENES = {"planar": (BEAM, "height"), "Path 1": (PATH_1, "height"), "Path 2": (PATH_2, "slope")}
# 1/s, and rates (rad/s) that are told apart on one axis
OVERDAMPED, UNDERDAMPED = 1e3, 1e-3
RATES = {OVERDAMPED: (1e-4, 1e-3, 1e-2), UNDERDAMPED: (1e-2, 1e-1, 1.0)}
# configuration of the two models in the curves; both with EA
OPTIONS: dict[str, dict[str, Any]] = {
    "kirchhoff": {"elements": 8, "extensible": True, "tolerance": 1e-5},
    "der": {"nodes": 101, "tolerance": 1e-5},
}
MESH_OF = {
    name: {key: value for key, value in options.items() if key in MESH} for name, options in OPTIONS.items()
}
# the systems of the scaling figures: elements, rods
SCALED = {
    "fig7": ("elastica", "DER planar"),
    "fig8": ("elements Path 1", "DER Path 1"),
    "fig9": ("elements Path 2", "DER Path 2"),
}
# rows of a curve that a figure needs
_ROWS = 2500


@dataclass(frozen=True)
class Motion:
    """One ramp through the first fold of a system.

    Attributes
    ----------
    system, model, damping, rate: which.
    fold: alpha_c of the first fold on the same mesh, rad.
    snap: time (s) and angle (rad) of the first snap, None without one.
    turns: how often z(1/2) turns back after the snap, by more than 0.002 L.
    time, angle, height: (rows,) s, rad and L.
    """

    system: str
    model: str
    damping: float
    rate: float
    fold: float
    snap: tuple[float, float] | None
    turns: int
    time: Array
    angle: Array
    height: Array

    @property
    def late(self) -> float:
        """Angle delay, rad; NaN without a snap."""
        return float("nan") if self.snap is None else self.snap[1] - self.fold


def _turns(height: Array, least: float = 2e-3) -> int:
    """How often a curve turns by more than `least`."""
    count, sense, extreme = 0, 0, float(height[0]) if len(height) else 0.0
    for value in map(float, height):
        if (sense >= 0 and value > extreme) or (sense <= 0 and value < extreme):
            extreme, sense = value, sense or (1 if value > extreme else -1)
        elif abs(value - extreme) > least:
            count, sense, extreme = count + 1, -sense, value
    return count


def _picked(history: History, snap: tuple[float, float] | None) -> Any:
    """Rows for a figure: half of them over all, half about the snap, where a slow ramp has few."""
    last = len(history) - 1
    rows = np.linspace(0, last, _ROWS // 2)
    if snap is not None:
        middle = int(np.searchsorted(history.time, snap[0]))
        rows = np.append(rows, middle + np.arange(-_ROWS // 4, _ROWS // 4))
    return np.unique(np.clip(rows, 0, last).astype(int))


def motion_of(work: tuple[str, str, float, float]) -> Motion:
    """A ramp of a system by a model, from rest to well past its first snap."""
    system, name, damping, rate = work
    scene, quantity = SCENES[system]
    model = MODELS[name]
    form = model.normal_forms(scene, **MESH_OF[name])[0]
    # what follows the snap: a few of its delays, and room to see it ring
    stop = form.angle + max(2.0 * predict(form, rate, damping).angle, 0.02, 12.0 * rate)
    if system == "Path 2":
        stop = min(stop, form.angle + 0.4)
    history = model.simulate(
        replace(scene, rate=rate, damping=damping, stop=min(stop, form.angle + 1.0)),
        configurations=False,
        **OPTIONS[name],
    )
    snap = history.crossing(quantity)
    after = history.height[history.time > (np.inf if snap is None else snap[0])]
    pick = _picked(history, snap)
    return Motion(
        system,
        name,
        damping,
        rate,
        form.angle,
        snap,
        _turns(after),
        history.time[pick],
        history.angle[pick],
        history.height[pick],
    )


def _cost(work: tuple[str, str, float, float]) -> float:
    return 1.0 / (work[3] * max(work[2], 1e-2))


@dataclass(frozen=True)
class Moved:
    """The ramps of one system at the two dampings, by both models, and its curve at rest."""

    motions: tuple[Motion, ...]
    curve: Curve


def _curve(scene: Scene) -> Curve:
    """The curve of equilibria through a scene's start, by elements with EA."""
    return Curve.of(
        MODELS["kirchhoff"].equilibria(scene, elements=16, extensible=True, steps=SMOOTH, **RISING)
        if not scene.planar
        else MODELS["elastica"].equilibria(
            scene, elements=32, extensible=True, steps=SMOOTH, span=(-1.6, 1.6), unstable=1
        )
    )


def moved(system: str, sweep: Sweep) -> Moved:
    """What panels A and B of Figs. 6, 8 and 9 are drawn from."""
    work = [
        (system, model, damping, rate)
        for model in OPTIONS
        for damping, rates in RATES.items()
        for rate in rates
    ]
    result = sweep(
        f"ramps, {system}", motion_of, work, cost=_cost, prepare=lambda: warm_up("kirchhoff", "der")
    )
    return Moved(tuple(result), _curve(SCENES[system][0]))


def scaled(figures: Sequence[str], dampings: tuple[float, ...], decades: int, sweep: Sweep) -> Delays:
    """What Figs. 7, 8C, 8D, 9C and 9D are drawn from."""
    names = [name for figure in figures for name in SCALED[figure]]
    return delays.compute(names, dampings, decades, sweep)


def width_matters(rate: float) -> tuple[float, float]:
    """Snap angle (rad) of Path 1 at nu = 1 with W = 0.2 and with W = 0.1, the ratios of stiffness kept."""
    result = []
    for width in (0.2, 0.1):
        ribbon = Ribbon(width=width, bending_ratio=400.0, twist_ratio=1.4562)
        scene = replace(PATH_1, rate=rate, damping=1.0, stop=2.0, ribbon=ribbon)
        history = MODELS["kirchhoff"].simulate(
            scene, configurations=False, until="snap", **OPTIONS["kirchhoff"]
        )
        snap = history.crossing()
        result.append(float("nan") if snap is None else snap[1])
    return result[0], result[1]


@dataclass(frozen=True)
class Settled:
    """Figs. 10, 12 and 13: the named cases, settled, and the curves at rest behind them by dL/L."""

    verdicts: tuple[CaseVerdict, ...]
    curves: dict[float, Curve]


def settled(kinds: Sequence[tuple[str, float]], sweep: Sweep) -> Settled:
    """The named cases of these (kind, dL/L)."""
    chosen = [case for case in CASES if (case.kind, case.scene.compression) in kinds]
    # as `cases` has them by default, so that its finished runs are these
    work = [(case, (51, 101), 1e-5, (1e-2, 1e-3, 1e-4)) for case in chosen]
    verdicts = sweep("named cases", cases.settled, work, cost=cases.cost, prepare=cases.compiled)
    curves = {
        value: _curve(Scene(compression=value, shear=0.40))
        for value in sorted({c.scene.compression for c in chosen})
    }
    return Settled(tuple(verdicts), curves)


@dataclass(frozen=True)
class Bound:
    """E(alpha_c1) - E(saddle to U-) at one scene, EI2/L: of elements with EA, and of rods in their limit."""

    compression: float
    elements: float
    rods: float


def bound_of(compression: float) -> Bound:
    """The static bound on type 1 skipping at dW/L = 0.40."""
    scene = Scene(compression=compression, shear=0.40)
    coarse, fine = (MODELS["der"].skipping_bound(scene, nodes=count) for count in (51, 101))
    return Bound(
        compression,
        MODELS["kirchhoff"].skipping_bound(scene, elements=16, extensible=True),
        two_point(coarse, fine, edge_ratio(51, 101)),
    )


def mapped(
    kind: Literal["skipping", "selection"], cells: int, model: str, samples: int, sweep: Sweep
) -> Diagrams:
    """What Fig. 11 or Fig. 14 is drawn from: the paper's diagrams with cells by cells of runs."""
    grid = ((0.01, 1.0, cells), (0.1, 30.0, cells))
    if kind == "skipping":
        calls = [partial(skipping_diagram, *place, *grid) for place in SKIPPING]
    else:
        calls = [partial(selection_diagram, *place, *grid) for place in SELECTION]
    return report.compute(
        calls, model=model, nodes=51, paper=False, samples=samples, boundaries=True, sweep=sweep
    )
