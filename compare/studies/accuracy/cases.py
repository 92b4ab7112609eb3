"""Scenes and configurations of the accuracy study, and one timed run of one of them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from compare.quantities.measure import (
    MESHES,
    Shape,
    at_rest,
    balance_of,
    defaults_of,
    energy_at,
    fold_angles,
    function_of,
    run,
    shape_at,
    unknowns,
)
from ribbonfem import Scene, SolverError
from ribbonfem.results import Array, History

GROUPS = ("static-planar", "static-ribbon", "dynamic-planar", "dynamic-ribbon")
# what the errors are of; the first decides the front
STATIC = ("fold", "shape", "energy")
DYNAMIC = ("snap", "shape", "energy", "balance")
# configurations in the order in which a row's name gives them
_NAMED = ("elements", "degree", "nodes", "clamp", "method", "step", "tolerance")


@dataclass(frozen=True)
class Bench:
    """A scene of a group.

    In motion, shape and energy are compared at the angle `look`, late in the slow part of the
    ramp; `step` (s) is the shortest of the three fixed ones that the beams' limit is taken from.
    """

    group: str
    name: str
    scene: Scene
    look: float = 0.0
    step: float = 0.0

    @property
    def dynamic(self) -> bool:
        """Whether it is a motion."""
        return self.group.startswith("dynamic")


def _planar(compression: float, rate: float = 0.1, damping: float = 1.0, stop: float | None = None) -> Scene:
    return Scene(compression=compression, shear=0.0, start="U+", rate=rate, damping=damping, stop=stop)


def _ribbon(compression: float, shear: float, rate: float, damping: float, stop: float) -> Scene:
    return Scene(compression=compression, shear=shear, start="U+S-", rate=rate, damping=damping, stop=stop)


CASES = (
    Bench("static-planar", "0.40", _planar(0.40)),
    Bench("static-planar", "0.10", _planar(0.10)),
    Bench("static-ribbon", "0.40-0.40-U+S+", Scene(compression=0.40, shear=0.40, start="U+S+")),
    Bench("static-ribbon", "0.40-0.37-U+S-", Scene(compression=0.40, shear=0.37, start="U+S-")),
    Bench("dynamic-planar", "0.40-rate0.1-nu1", _planar(0.40, 0.1, 1.0, 1.5), 1.13, 2e-3),
    Bench("dynamic-planar", "0.40-rate1-nu0.1", _planar(0.40, 1.0, 0.1, 2.5), 1.20, 2.5e-4),
    Bench("dynamic-planar", "0.20-rate0.1-nu1", _planar(0.20, 0.1, 1.0, 1.2), 0.81, 2e-3),
    Bench("dynamic-planar", "0.40-rate0.03-nu10", _planar(0.40, 0.03, 10.0, 1.5), 1.13, 4e-3),
    Bench("dynamic-ribbon", "0.40-0.37-rate0.1-nu1", _ribbon(0.40, 0.37, 0.1, 1.0, 1.0), 0.58),
    Bench("dynamic-ribbon", "0.40-0.37-rate1-nu10", _ribbon(0.40, 0.37, 1.0, 10.0, 2.5), 0.75),
    Bench("dynamic-ribbon", "0.35-0.40-rate0.1-nu0.1", _ribbon(0.35, 0.40, 0.1, 0.1, 1.2), 0.33),
)


@dataclass(frozen=True)
class Family:
    """A model with its physics: what has one limit, and so one front."""

    name: str
    model: str
    groups: tuple[str, ...]
    fixed: Mapping[str, Any] = field(default_factory=dict)

    @property
    def extensible(self) -> bool | None:
        """Whether it stretches; None for the quasi-linear beam, which is another theory."""
        if self.model == "quasilinear":
            return None
        return True if self.model == "der" else bool(self.fixed.get("extensible", False))


# plain dicts: worker processes are sent them
_EA = {"extensible": True}
FAMILIES = (
    Family("quasilinear", "quasilinear", ("static-planar", "dynamic-planar")),
    Family("elastica", "elastica", ("static-planar", "dynamic-planar")),
    Family("elastica-EA", "elastica", ("static-planar", "dynamic-planar"), _EA),
    Family("kirchhoff", "kirchhoff", ("static-planar", "static-ribbon")),
    Family("kirchhoff-EA", "kirchhoff", GROUPS, _EA),
    Family("der", "der", GROUPS),
)

# degrees of the one element of the quasi-linear beam, beside its cubic ones
_DEGREES = (8, 11, 15, 18, 19)
_STATIC_MESHES = {
    "quasilinear": (6, 8, 16, 32, 64, 128),
    "elastica": (4, 6, 8, 12, 16, 24, 32),
    "kirchhoff": (4, 6, 8, 12, 16, 24, 32, 40),
    "der": (21, 51, 101, 201, 401),
}
# adaptive steps: meshes and tolerances of the default method, all pairs
_ADAPTIVE = {
    "quasilinear": ((8, 16, 32, 64), (1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 3e-6, 1e-6)),
    "elastica": ((4, 6, 8, 12, 16), (1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 3e-6, 1e-6)),
    "kirchhoff": ((4, 6, 8, 10), (1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 3e-6)),
    "der": ((51, 71, 101, 151, 201), (3e-3, 1e-3, 3e-4, 1e-4, 3e-5)),
}
# other methods on one mesh: the tolerances of those with an error estimate (newmark's estimate
# sees the multipliers' noise and stalls), and the fixed steps (s)
_OTHER_MESH = {"quasilinear": 16, "elastica": 8, "kirchhoff": 6, "der": 101}
_OTHER_TOLERANCES = {
    "quasilinear": (1e-4, 1e-5, 1e-6),
    "elastica": (1e-4, 1e-5, 1e-6),
    "kirchhoff": (1e-4, 1e-5),
    "der": (1e-3, 1e-4),
}
_STEPS = {
    "tr-bdf2": (4e-2, 2e-2, 1e-2),
    "generalised-alpha": (2e-2, 1e-2, 5e-3),
    "newmark": (2e-2, 1e-2, 5e-3),
    "implicit-euler": (1e-2, 5e-3),
}
_ROD_STEPS = {
    "tr-bdf2": (4e-2, 2e-2, 1e-2),
    "generalised-alpha": (2e-2, 1e-2, 5e-3),
    "newmark": (2e-2, 1e-2),
    "midpoint": (2e-2, 1e-2),
    "discrete-gradient": (2e-2, 1e-2),
    "implicit-euler": (1e-2, 5e-3),
}
_TWO_NODE = ((101, 1e-3), (101, 1e-4), (201, 1e-4), (401, 1e-4))


@dataclass(frozen=True)
class Entry:
    """One row of the report before it is measured: a case, a family and a full configuration."""

    case: Bench
    family: Family
    options: Mapping[str, Any]
    default: bool

    @property
    def label(self) -> str:
        """The configuration in words."""
        values = ((name, self.options[name]) for name in _NAMED if name in self.options)
        return ",".join(
            f"{name}={value if isinstance(value, str) else f'{value:g}'}" for name, value in values
        )

    @property
    def key(self) -> str:
        """What names the row: group/case/family/configuration."""
        return f"{self.case.group}/{self.case.name}/{self.family.name}/{self.label}"

    @property
    def command(self) -> str:
        """The command that computes this row alone."""
        return f"ribbonfem accuracy --row {self.key}"

    @property
    def dofs(self) -> int:
        """Degrees of freedom."""
        return unknowns(self.family.model, self.options, self.case.scene, self.case.dynamic)


def _static_grid(family: Family) -> Iterator[dict[str, Any]]:
    meshes = _STATIC_MESHES[family.model]
    if family.model == "der":
        for clamp in ("centred", "two-node"):
            yield from ({"nodes": nodes, "clamp": clamp} for nodes in meshes)
    else:
        yield from _finite_elements(family.model, meshes)


def _finite_elements(model: str, sizes: tuple[int, ...]) -> Iterator[dict[str, Any]]:
    """Meshes of so many elements, of the quasi-linear beam cubic ones, and one element of high degree."""
    if model != "quasilinear":
        yield from ({"elements": size} for size in sizes)
        return
    yield from ({"elements": size, "degree": 3} for size in sizes)
    yield from ({"elements": 1, "degree": degree} for degree in _DEGREES)


def _dynamic_grid(family: Family) -> Iterator[dict[str, Any]]:
    name = family.model
    rods = name == "der"
    mesh = "nodes" if rods else "elements"
    clamp = {"clamp": "centred"} if rods else {}
    sizes, tolerances = _ADAPTIVE[name]
    default = str(defaults_of(name, "simulate")["method"])
    meshes = [{mesh: size, **clamp} for size in sizes] if rods else list(_finite_elements(name, sizes))
    for which in meshes:
        for tolerance in tolerances:
            yield {**which, "method": default, "tolerance": tolerance}
    other = {mesh: _OTHER_MESH[name], **clamp, **({"degree": 3} if name == "quasilinear" else {})}
    for tolerance in _OTHER_TOLERANCES[name]:
        for adaptive in ("generalised-alpha", *(("tr-bdf2",) if default != "tr-bdf2" else ())):
            yield {**other, "method": adaptive, "tolerance": tolerance}
    for method, steps in (_ROD_STEPS if rods else _STEPS).items():
        for step in steps:
            yield {**other, "method": method, "step": step}
    if rods:
        for nodes, tolerance in _TWO_NODE:
            yield {"nodes": nodes, "clamp": "two-node", "method": "tr-bdf2", "tolerance": tolerance}


def default_options(family: Family, dynamic: bool) -> dict[str, Any]:
    """The configuration that a model's function takes if it is given none, in full.

    From the signature; where that leaves a value open (None), from what the result says it was made with: of
    motions at dL/L .40.
    """
    function = "simulate" if dynamic else "folds"
    result = dict(defaults_of(family.model, function))
    made = function_of(family.model, function)(
        _planar(0.40, 1.0, 1.0, 1e-9 if dynamic else None), **family.fixed
    )
    result.update((made if dynamic else made[0]).options)
    return {name: result[name] for name in _NAMED if result.get(name) is not None}


def entries(group: str, family: Family) -> list[Entry]:
    """All rows of a family in a group, its default configuration among them."""
    cases = [case for case in CASES if case.group == group]
    dynamic = cases[0].dynamic
    default = default_options(family, dynamic)
    grid = list(_dynamic_grid(family) if dynamic else _static_grid(family))
    if default not in grid:
        grid.append(default)
    return [Entry(case, family, options, options == default) for options in grid for case in cases]


@dataclass(frozen=True)
class Reading:
    """What one run gave: values by quantity, CPU seconds of the solve, accepted steps; or how it failed."""

    values: Mapping[str, float | Array | Shape]
    seconds: float
    steps: int | None = None
    problem: str = ""


def observed(history: History, model: str, look: float) -> dict[str, Any]:
    """Snap angle, shape and energy at the angle `look`, and the defect of the energy balance.

    Raises
    ------
    SolverError
        If there was no snap.
    """
    result = history.crossing()
    if result is None:
        raise SolverError("the height did not change sign")
    return {
        "snap": result[1],
        "shape": shape_at(history, model, look),
        "energy": energy_at(history, look),
        "balance": balance_of(history),
    }


# what a program has to wait for now and then weighs on a time below this (s)
_SHORT = 0.1
_warm: set[tuple[str, bool, str, str]] = set()


def _answer(entry: Entry) -> tuple[Any, float]:
    """The motion up to the snap, or the angles of the folds, and CPU seconds; compiled before."""
    model, scene = entry.family.model, entry.case.scene
    options = {**entry.family.fixed, **entry.options}
    kind = "step" if "step" in options else "tolerance"
    key = (model, entry.case.dynamic, str(options.get("method")), kind)
    cold = key not in _warm
    _warm.add(key)
    if not entry.case.dynamic:
        if cold:
            fold_angles(model, scene, options)
        return fold_angles(model, scene, options)
    if cold:
        run(model, replace(scene, stop=scene.rate * 1e-2), options)
    return run(model, scene, {**options, "until": "snap"})


def measure(entry: Entry) -> Reading:
    """Run an entry once."""
    model, scene = entry.family.model, entry.case.scene
    try:
        result, seconds = _answer(entry)
        if entry.case.dynamic:
            return Reading(observed(result, model, entry.case.look), seconds, int(result.stats["steps"]))
        rest = at_rest(model, scene, {**entry.family.fixed, **entry.options})
        return Reading({"fold": result, "shape": rest.shape, "energy": rest.energy}, seconds)
    except SolverError as error:
        return Reading({}, float("nan"), None, str(error).splitlines()[0])


def seconds_of(entry: Entry) -> float:
    """CPU seconds of an entry that has been measured, once more: the least of a few if they are short."""
    taken: list[float] = []
    while sum(taken) < _SHORT:
        taken.append(_answer(entry)[1])
    return min(taken)


def mesh_value(options: Mapping[str, Any]) -> int:
    """Elements or nodes of a configuration."""
    return int(next(options[name] for name in MESHES if name in options))


def error_of(value: Any, reference: Any) -> float:
    """The error of a number, of several (root mean square) or of a shape (L2)."""
    if isinstance(value, Shape):
        return value.distance(reference)
    if np.shape(value) != np.shape(reference):
        raise SolverError(f"{np.size(value)} folds found, {np.size(reference)} expected")
    return float(np.sqrt(np.mean(np.square(np.subtract(value, reference)))))
