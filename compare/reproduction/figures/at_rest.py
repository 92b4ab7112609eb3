"""Computations behind the figures of the ribbon at rest: Figs. 2 to 5, 15 and 16, with checks."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import der
from compare.limits import edge_ratio, of_folds
from compare.models import MODELS, warm_up
from compare.quantities.planar_curves import DRAWN, planar_curves
from compare.reproduction.paths import Paths, Swept, paths_of, swept_scene
from compare.reproduction.sheared import (
    COMPRESSIONS,
    FOUR,
    LINES,
    MAP_ELEMENTS,
    Heights,
    cells,
    chord_limit,
    forks_of,
    heights,
)
from compare.sweep import Sweep
from ribbonfem import Scene, elastica, kirchhoff, quasilinear
from ribbonfem.kirchhoff import Pitchforks
from ribbonfem.outcomes import name_by_signs
from ribbonfem.output.curve import Curve
from ribbonfem.output.surface import of_motion, of_rest
from ribbonfem.results import Array, RestState

PATH = Scene(compression=0.40, shear=0.37)
# beside the paper's own, to see the limit of small end-shortening
SMALL = (0.02, 0.05, 0.10)
SWEPT = (0.35, 0.36, 0.37, 0.38, 0.39)
ELEMENTS = 16
NODES = (51, 101)
# a motion slow and damped enough that between its snaps it follows the states at rest
GENTLE: dict[str, Any] = {"rate": 0.1, "damping": 10.0, "stop": 0.75, "hold": 10.0}
# one of each kind of state at alpha = 0, dL/L = 0.40
KINDS = ((0.10, "U+"), (0.37, "U+S+"), (0.55, "S+"))


@dataclass(frozen=True)
class PlanarFold:
    """The fold of the planar beam at one end-shortening.

    Attributes
    ----------
    compression: dL/L.
    count: folds that a ramp from U+ meets.
    plain, stretched, rods: sigma, mu and Z, rescaled by (dL/L)^(1/2): of the elastica without and with EA,
        and of rods in their Richardson limit.
    """

    compression: float
    count: int
    plain: tuple[float, float, float]
    stretched: tuple[float, float, float]
    rods: tuple[float, float, float]


@dataclass(frozen=True)
class Planar:
    """Fig. 3: curves of the elastica and of rods by dL/L, of the closed form, and folds.

    `beam` is sigma, mu and Z of the quasi-linear beam by 64 cubic elements.
    """

    beams: dict[float, Curve]
    rods: dict[float, Curve]
    exact: Curve
    closed: tuple[float, float, float]
    beam: tuple[float, float, float]
    folds: tuple[PlanarFold, ...]


def _rescaled(fold: Any, compression: float) -> tuple[float, float, float]:
    scale = compression**-0.5
    return float(fold.load) ** 0.5, float(fold.angle) * scale, float(fold.height) * scale


def planar_fold(compression: float) -> PlanarFold:
    """The fold at one end-shortening, in three ways."""
    scene = Scene(compression=compression, shear=0.0, start="U+")
    plain = elastica.folds(scene, elements=32)
    (stretched,) = elastica.folds(scene, elements=32, extensible=True)
    coarse, fine = (der.folds(scene, nodes=count)[0] for count in NODES)
    limit = of_folds(coarse, fine, edge_ratio(*NODES))
    return PlanarFold(
        compression,
        len(plain),
        *(_rescaled(fold, compression) for fold in (plain[0], stretched, limit)),
    )


def planar(sweep: Sweep) -> Planar:
    """What Fig. 3 is drawn from."""
    folds = sweep("planar folds", planar_fold, (*SMALL, *DRAWN), prepare=lambda: warm_up("elastica", "der"))
    beams, rods, exact = planar_curves(NODES[0], sweep.progress)
    closed = quasilinear.closed_form_fold()
    scene = Scene(compression=0.20, shear=0.0, start="U+")
    (beam,) = quasilinear.folds(scene, elements=64)
    return Planar(
        beams,
        rods,
        exact,
        (closed.sigma, closed.mu, closed.height),
        _rescaled(beam, scene.compression),
        tuple(folds),
    )


@dataclass(frozen=True)
class Snapshot:
    """The ribbon at one instant of a slow ramp: edges (2, points, 3) and centreline (points, 3) in L."""

    path: int
    model: str
    said: str
    angle: float
    moving: bool
    centre: Array
    edges: Array


def snapshots_of(work: tuple[int, str]) -> tuple[Snapshot, ...]:
    """A path's shapes at rest and in its snaps, by one model."""
    path, model = work
    scene = replace(PATH, start="U+S-" if path == 1 else "U+S+", **GENTLE)
    options: dict[str, Any] = {"nodes": NODES[1]} if model == "der" else {"elements": 8, "extensible": True}
    history = MODELS[model].simulate(scene, **options)
    snaps = [history.crossing("height")]
    if path == 2:
        snaps.insert(0, history.crossing("slope"))
    times = [snap[0] for snap in snaps if snap is not None]
    between = [0.5 * (a + b) for a, b in pairwise(times)]
    instants = [(0.0, False)]
    for k, time in enumerate(times):
        instants.append((time, True))
        instants += [(between[k], False)] if k < len(between) else []
    instants.append((float(history.time[-1]), False))
    made = []
    for time, moving in instants:
        strip = of_motion(history, 2, until=max(time, 1e-9))
        said = name_by_signs(float(strip.height[1]), float(strip.slope[1]))
        made.append(
            Snapshot(path, model, said, float(strip.angle[1]), moving, strip.centre[1], strip.edges[1])
        )
    return tuple(made)


@dataclass(frozen=True)
class Turned:
    """What a slow ramp of the right clamp does: how many folds it meets, and the shapes it comes to."""

    start: str
    folds: int
    shapes: tuple[str, ...]


def turned_right(start: str) -> Turned:
    """Turn the right clamp instead, by rods, slowly."""
    scene = replace(PATH, drive="right", start=start)
    history = der.simulate(replace(scene, **GENTLE), nodes=NODES[0])
    # names at rest: from rows whose kinetic energy is small
    quiet = history.energies["kinetic"] < 1e-2
    names = [
        name_by_signs(float(height), float(slope))
        for height, slope in zip(history.height[quiet], history.slope[quiet], strict=True)
    ]
    shapes = tuple(name for k, name in enumerate(names) if k == 0 or name != names[k - 1])
    return Turned(start, len(der.folds(scene, nodes=NODES[0])), shapes)


@dataclass(frozen=True)
class Ribbons:
    """Fig. 4 and what is checked beside it.

    Attributes
    ----------
    paths: the curves.
    path_1, path_2: folds of elements, of elements with EA, and of rods on two meshes.
    two_node: folds of Path 2 by rods of 101 nodes with both end edges clamped, as the paper has them.
    turned: the right clamp turned instead.
    """

    paths: Paths
    path_1: Swept
    path_2: Swept
    two_node: tuple[float, ...]
    turned: tuple[Turned, ...]


def _two_node(scene: Scene) -> tuple[float, ...]:
    return tuple(fold.angle for fold in der.folds(scene, nodes=NODES[1], clamp="two-node"))


def ribbons(sweep: Sweep) -> Ribbons:
    """What Fig. 4 is drawn from."""
    (paths,) = sweep(
        "paths", paths_of, [(PATH, ELEMENTS, NODES[1])], prepare=lambda: warm_up("kirchhoff", "der")
    )
    scenes = [replace(PATH, start=start) for start in ("U+S-", "U+S+")]
    one, two = sweep("folds of both paths", swept_scene, [(scene, ELEMENTS, NODES) for scene in scenes])
    (clamped,) = sweep("the paper's clamp", _two_node, [PATH])
    turned = sweep("the right clamp", turned_right, ["U+S+", "U+S-"])
    return Ribbons(paths, one, two, clamped, tuple(turned))


@dataclass(frozen=True)
class States:
    """Fig. 15: the four states at (0.40, 0.37), and which states are stable there in both models."""

    elements: tuple[RestState, ...]
    rods: tuple[RestState, ...]
    stable: tuple[tuple[str, ...], tuple[str, ...]]


def states() -> States:
    """What Fig. 15 is drawn from."""
    scenes = [replace(PATH, start=name) for name in FOUR]
    return States(
        tuple(kirchhoff.state(scene, elements=ELEMENTS, extensible=True) for scene in scenes),
        tuple(der.state(scene, nodes=NODES[0]) for scene in scenes),
        (
            tuple(sorted(kirchhoff.stable_states(PATH, elements=ELEMENTS))),
            tuple(sorted(der.stable_states(PATH, nodes=NODES[0]))),
        ),
    )


@dataclass(frozen=True)
class Shape:
    """A ribbon at rest at alpha = 0: its name, dW/L, and edges (2, points, 3) in L."""

    name: str
    shear: float
    edges: Array


@dataclass(frozen=True)
class Phases:
    """Fig. 16: states against the shear, pitchforks, stable states over a grid, and three shapes."""

    heights: tuple[Heights, ...]
    lines: tuple[float, ...]
    forks: tuple[Pitchforks, ...]
    grid: tuple[dict[str, Any], ...]
    shapes: tuple[Shape, ...]


def phases(sweep: Sweep, step: float) -> Phases:
    """What Fig. 16 is drawn from; `step` is the rods' grid in the phase diagram, in L."""
    grid = [(round(step * k, 9), step, NODES[0]) for k in range(round(0.6 / step), 0, -1)]
    result = sweep("stable states", cells, grid, cost=lambda work: chord_limit(work[0]))
    curves = sweep(
        "states against the shear", heights, [(value, ELEMENTS, NODES[0]) for value in COMPRESSIONS]
    )
    forks = sweep("pitchforks", forks_of, [(value, MAP_ELEMENTS) for value in LINES])
    shapes = []
    for shear, name in KINDS:
        scene = Scene(compression=0.40, shear=shear, start=name)
        edges = of_rest(kirchhoff.state(scene, elements=ELEMENTS)).edges[0]
        shapes.append(Shape(name, shear, edges))
    return Phases(
        tuple(curves),
        LINES,
        tuple(forks),
        tuple(record for records in result for record in records),
        tuple(shapes),
    )


def snapshots(sweep: Sweep) -> tuple[Snapshot, ...]:
    """What Fig. 2 is drawn from."""
    work = [(path, model) for path in (1, 2) for model in ("kirchhoff", "der")]
    result = sweep("snapshots", snapshots_of, work, prepare=lambda: warm_up("kirchhoff", "der"))
    return tuple(shot for shots in result for shot in shots)


def swept(sweep: Sweep) -> dict[str, tuple[Swept, ...]]:
    """What Fig. 5 is drawn from: the sweeps over compression and over shear."""
    scenes = [Scene(compression=value, shear=0.37) for value in SWEPT]
    scenes += [Scene(compression=0.40, shear=value) for value in SWEPT]
    result = sweep("critical angles", swept_scene, [(scene, ELEMENTS, NODES) for scene in scenes])
    return {"compression": tuple(result[: len(SWEPT)]), "shear": tuple(result[len(SWEPT) :])}
