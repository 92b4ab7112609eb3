"""The systems whose delays are measured, and one measurement, for the command `delay`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from types import ModuleType
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

import der
from compare.models import warm_up
from compare.sweep import Sweep
from ribbonfem import Scene, SolverError, elastica, kirchhoff, quasilinear
from ribbonfem.delay import Lead, NormalForm, lead, next_order, predict
from ribbonfem.options import refuse, whole_number

DAMPINGS = (1e-3, 1e-2, 1e-1, 1.0, 10.0, 100.0, 1e3)
BEAM = Scene(compression=0.40, shear=0.0, start="U+")
PATH_1 = Scene(compression=0.40, shear=0.37, start="U+S-")
PATH_2 = Scene(compression=0.40, shear=0.37, start="U+S+")


@dataclass(frozen=True)
class System:
    """A model on a scene: which instant is its snap, and with what configuration it runs.

    `quantity` crosses zero well past the fold; levels near it would bias the exponents.
    """

    name: str
    scene: Scene
    quantity: str
    model: ModuleType
    mesh: dict[str, Any]
    options: dict[str, Any]


SYSTEMS = {
    system.name: system
    for system in (
        System(
            "quasi-linear beam",
            BEAM,
            "height",
            quasilinear,
            {"elements": 32},
            {"until": "snap", "tolerance": 1e-7},
        ),
        System(
            "elastica",
            BEAM,
            "height",
            elastica,
            {"elements": 16},
            {"until": "snap", "tolerance": 1e-7},
        ),
        *(
            System(
                name,
                scene,
                quantity,
                kirchhoff,
                {"elements": 8, "extensible": True},
                {"configurations": False, "tolerance": 3e-6},
            )
            for name, scene, quantity in (
                ("elements planar", BEAM, "height"),
                ("elements Path 1", PATH_1, "height"),
                ("elements Path 2", PATH_2, "slope"),
            )
        ),
        *(
            System(
                name,
                scene,
                quantity,
                der,
                {"nodes": 51},
                {"configurations": False},
            )
            for name, scene, quantity in (
                ("DER planar", BEAM, "height"),
                ("DER Path 1", PATH_1, "height"),
                ("DER Path 2", PATH_2, "slope"),
            )
        ),
    )
}
GROUPS: dict[str, tuple[str, ...]] = {
    "beam": ("quasi-linear beam", "elastica", "DER planar", "elements planar"),
    "ribbon": ("DER Path 1", "elements Path 1", "DER Path 2", "elements Path 2"),
}
GROUPS["all"] = GROUPS["beam"] + GROUPS["ribbon"]


@dataclass(frozen=True)
class Cell:
    """One measured delay: rad and s; None where no snap was found.

    `predicted` is the leading order, `next_order` the one that follows from an escape from the fold,
    and `error` what that says of itself (rad).
    """

    system: str
    damping: float
    rate: float
    damping_ratio: float
    predicted: float
    measured: float | None
    seconds: float
    problem: str = ""
    next_order: float = math.nan
    error: float = math.nan


@dataclass(frozen=True)
class SystemLead:
    """By how much the snap of a system precedes the end of its fold's normal form, and its uncertainty, s."""

    system: str
    damping: float
    lead: Lead


def escape(name: str, damping: float) -> SystemLead:
    """The escape of a system from its first fold."""
    system = SYSTEMS[name]
    scene = replace(system.scene, damping=damping)
    quantity = "snap" if system.quantity == "height" else "first snap"
    return SystemLead(name, damping, lead(system.model, scene, 0, quantity, **system.mesh)[1])


def escaped(arguments: tuple[str, float]) -> SystemLead:
    """`escape` of a pair of arguments, for a sweep."""
    return escape(*arguments)


def rates_for(damping: float, decades: int, per_decade: int = 1) -> list[float]:
    """Rates over `decades` decades up to where a snap still comes within some 2 rad of the fold.

    The overdamped delay grows as (rate nu)^(2/3), so that the fastest rate falls with nu.
    """
    fastest = 10.0 / max(1.0, 10.0 ** round(np.log10(damping)) / 10.0) if damping > 1.0 else 10.0
    count = decades * per_decade + 1
    return [float(rate) for rate in fastest * np.logspace(-decades, 0.0, count)]


def measure(name: str, form: NormalForm, damping: float, rate: float, result: Lead) -> Cell:
    """Ramp a system through its fold and return by how much the snap is late."""
    system = SYSTEMS[name]
    delay, further = predict(form, rate, damping), next_order(form, result, rate, damping)
    said: dict[str, Any] = {"next_order": further.angle, "error": further.angle_error}
    seconds, problem = 0.0, ""
    # a stop soon after the snap: what rings after it is not looked at
    for room in (1.15, 2.0, 4.0):
        stop = form.angle + room * delay.angle
        scene = replace(system.scene, rate=rate, damping=damping, stop=stop)
        try:
            history = system.model.simulate(scene, **system.mesh, **system.options)
        except SolverError as error:
            problem = str(error)
            break
        seconds += float(history.stats["seconds"])
        snap = history.crossing(system.quantity)
        if snap is not None:
            measured = snap[1] - form.angle
            return Cell(name, damping, rate, delay.damping, delay.angle, measured, seconds, **said)
        if stop > form.angle + 3.0:
            break
    problem = problem or "no snap"
    return Cell(name, damping, rate, delay.damping, delay.angle, None, seconds, problem, **said)


def measured(arguments: tuple[str, NormalForm, float, float, Lead]) -> Cell:
    """`measure` of a tuple of arguments, for a sweep."""
    return measure(*arguments)


def slope_of(cells: list[Cell]) -> tuple[float, float, float] | None:
    """Exponent of the angle delay over the three slowest rates, with their range."""
    good = sorted((c for c in cells if c.measured), key=lambda c: c.rate)[:3]
    if len(good) < 2:
        return None
    x, y = np.log([c.rate for c in good]), np.log([c.measured for c in good if c.measured])
    return float(np.polyfit(x, y, 1)[0]), good[0].rate, good[-1].rate


def ratio_limit(cells: list[Cell]) -> float | None:
    """measured / predicted in the limit of a slow ramp, from the three slowest rates.

    What the normal form leaves out is the time of the snap itself, against that of its layer at the
    fold: rate^(1/5) where inertia rules and rate^(1/3) where damping does.
    """
    good = sorted((c for c in cells if c.measured), key=lambda c: c.rate)[:3]
    if len(good) < 3:
        return None
    power = 1.0 / 5.0 if good[0].damping_ratio < 1.0 else 1.0 / 3.0
    x = np.array([c.rate**power for c in good])
    y = np.array([(c.measured or 0.0) / c.predicted for c in good])
    return float(np.polynomial.Polynomial.fit(x, y, 2)(0.0))


def universal_curve(cells: Sequence[Cell], forms: dict[str, NormalForm]) -> CubicSpline:
    """ln f against ln Lambda through the values that the cells were predicted with.

    Each of them is an integration of the normal form; a figure needs hundreds.
    """
    result = {}
    for cell in cells:
        scale = (forms[cell.system].product * cell.rate) ** 0.2
        result[round(float(np.log(cell.damping_ratio)), 3)] = float(
            np.log(cell.predicted / cell.rate * scale)
        )
    points = sorted(result.items())
    return CubicSpline(*np.array(points).T)


@dataclass(frozen=True)
class Delays:
    """What was found: the systems' normal forms, and every measured delay."""

    forms: dict[str, NormalForm]
    dampings: tuple[float, ...]
    cells: tuple[Cell, ...]
    escapes: tuple[SystemLead, ...] = ()

    def of(self, name: str, damping: float) -> list[Cell]:
        """The delays of a system at a damping."""
        return [c for c in self.cells if c.system == name and c.damping == damping]


def _cost(work: tuple[str, NormalForm, float, float, Lead]) -> float:
    """Slow ramps at little damping take longest."""
    return 1.0 / (work[3] * max(work[2], 1e-2))


def require_ranges(dampings: Sequence[float], decades: int) -> None:
    """Raise a OptionError unless there are delays at these dampings over so many decades of rates."""
    whole_number("decades", decades, 1, 8)
    if not dampings:
        refuse("dampings", dampings, "one at least is needed")
    for damping in dampings:
        Scene(damping=damping)


def compute(names: Sequence[str], dampings: tuple[float, ...], decades: int, sweep: Sweep) -> Delays:
    """The delays of these systems at these dampings, over `decades` of rates."""
    require_ranges(dampings, decades)
    forms = {}
    for name in sweep.progress("static folds", names):
        system = SYSTEMS[name]
        forms[name] = system.model.normal_forms(system.scene, **system.mesh)[0]
    pairs = [(name, damping) for name in names for damping in dampings]
    escapes = sweep("escapes from the fold", escaped, pairs, prepare=warm_up)
    leads = {(result.system, result.damping): result.lead for result in escapes}
    work = [
        (name, forms[name], damping, rate, leads[name, damping])
        for name in names
        for damping in dampings
        for rate in rates_for(damping, decades)
    ]
    work.sort(key=_cost, reverse=True)
    cells = sweep("delays", measured, work, cost=_cost, prepare=warm_up)
    return Delays(forms, dampings, tuple(cells), tuple(escapes))
