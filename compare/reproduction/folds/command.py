"""The command `folds`: folds and states at rest by finite elements and by rods, side by side (section 5)."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

import der
from compare.limits import edge_ratio, of_folds, triple_order, two_point
from compare.models import timed, warm_up
from compare.report.registry import Command
from compare.report.section import Drawing, Table
from compare.reproduction.paths import Paths, Swept, paths_of, swept_scene
from compare.sweep import Progress, Sweep
from ribbonfem import Fold, Scene, SolverError, kirchhoff
from ribbonfem.options import whole_number, within

from . import shear_section
from .path_figures import draw_critical, draw_paths

# the paper's two paths (Fig. 4), the scenes of its dynamics, and planar beams
SCENES: tuple[tuple[str, Scene], ...] = (
    ("planar 0.20", Scene(compression=0.20, shear=0.0, start="U+")),
    ("planar 0.40", Scene(compression=0.40, shear=0.0, start="U+")),
    ("(0.40, 0.37) Path 1", Scene(compression=0.40, shear=0.37, start="U+S-")),
    ("(0.40, 0.37) Path 2", Scene(compression=0.40, shear=0.37)),
    ("(0.40, 0.40) Path 2", Scene(compression=0.40, shear=0.40)),
    ("(0.35, 0.37) Path 2", Scene(compression=0.35, shear=0.37)),
    ("(0.35, 0.40) Path 2", Scene(compression=0.35, shear=0.40)),
    ("(0.20, 0.26) Path 2", Scene(compression=0.20, shear=0.26)),
    ("(0.50, 0.42) Path 2", Scene(compression=0.50, shear=0.42)),
)
PATHS = SCENES[3][1]
REFINED = (SCENES[3], SCENES[6])
BOUND_SCENES = (
    Scene(compression=0.40, shear=0.37),
    Scene(compression=0.35, shear=0.37),
    Scene(compression=0.40, shear=0.40),
    Scene(compression=0.35, shear=0.40),
)
SWEPT = (0.35, 0.36, 0.37, 0.38, 0.39, 0.40)
MESHES = (6, 8, 10, 12, 16, 20, 24, 32)
FINEST = 40


def observed_order(values: tuple[float, float, float], lengths: tuple[float, float, float]) -> float | None:
    """The order p of values a + c l^p on three meshes of edge lengths l; None if there is none."""
    order = triple_order(values, lengths, within=(0.05, 12.0))
    return None if math.isnan(order) else order


def limit_of(result: tuple[Fold, Fold, Fold], nodes: tuple[int, int, int]) -> tuple[Fold, float]:
    """A rod's fold on three meshes: its limit, free of l^2 and l^4, and the change by the last step, rad.

    The extrapolation of two meshes leaves an error in l1^2 l2^2, so that two such differ by the
    ratio of l1^2 to l3^2.
    """
    coarse = of_folds(result[0], result[1], edge_ratio(nodes[0], nodes[1]))
    fine = of_folds(result[1], result[2], edge_ratio(nodes[1], nodes[2]))
    limit = of_folds(coarse, fine, edge_ratio(nodes[0], nodes[2]))
    return limit, abs(limit.angle - fine.angle)


def _fold_rows(
    nodes: tuple[int, int, int], elements: int, progress: Progress
) -> tuple[list[list[Any]], list[dict[str, Any]]]:
    """The folds of both models on all scenes, as rows of a table and as records."""
    rows: list[list[Any]] = []
    records = []
    lengths = (1.0 / (nodes[0] - 2), 1.0 / (nodes[1] - 2), 1.0 / (nodes[2] - 2))
    for label, scene in progress("folds in both models", SCENES):
        plain, plain_seconds = timed(partial(kirchhoff.folds, scene, elements=elements))
        stretched = kirchhoff.folds(scene, elements=elements, extensible=True)
        rods, seconds = [], []
        for count in nodes:
            result, taken = timed(partial(der.folds, scene, nodes=count))
            if len(result) != len(plain):
                raise SolverError(
                    f"rods of {count} nodes have {len(result)} folds at {label}, the elements {len(plain)}: "
                    "take more nodes"
                )
            rods.append(result)
            seconds.append(taken)
        for k, (fold, with_ea) in enumerate(zip(plain, stretched, strict=True)):
            meshes = (rods[0][k], rods[1][k], rods[2][k])
            angles = (meshes[0].angle, meshes[1].angle, meshes[2].angle)
            limit, uncertainty = limit_of(meshes, nodes)
            order = observed_order(angles, lengths)
            off = limit.angle - with_ea.angle
            rows.append(
                [f"{label}, fold {k + 1}", fold.angle, fold.height, with_ea.angle, *angles, order]
                + [limit.angle, uncertainty, off, plain_seconds, *seconds]
            )
            records.append(
                {
                    "scene": label,
                    "fold": k + 1,
                    "kirchhoff": fold.angle,
                    "height": fold.height,
                    "kirchhoff_extensible": with_ea.angle,
                    "height_extensible": with_ea.height,
                    "rods": dict(zip(map(str, nodes), angles, strict=True)),
                    "order": order,
                    "limit": limit.angle,
                    "limit_height": limit.height,
                    "limit_doubt": uncertainty,
                    "difference": off,
                    "height_difference": limit.height - with_ea.height,
                    "seconds": plain_seconds,
                    "rod_seconds": seconds,
                }
            )
    return rows, records


def _mesh_rows(meshes: tuple[int, ...], progress: Progress) -> tuple[list[list[Any]], list[dict[str, Any]]]:
    """The finite elements' folds on refined meshes, against the finest."""
    rows: list[list[Any]] = []
    records = []
    reference = {label: kirchhoff.folds(scene, elements=FINEST) for label, scene in REFINED}
    before: dict[str, tuple[int, list[float]]] = {}
    for count in progress("mesh convergence", meshes):
        row: list[Any] = [f"{count}"]
        for label, scene in REFINED:
            result, seconds = timed(partial(kirchhoff.folds, scene, elements=count))
            pairs = zip(result, reference[label], strict=True)
            errors = [one.angle - exact.angle for one, exact in pairs]
            orders: list[float | None] = [None] * len(errors)
            # below some 1e-11 rounding decides
            if label in before and max(map(abs, errors)) > 1e-10:
                coarse, old = before[label]
                orders = [
                    float(np.log(abs(a / b)) / np.log(count / coarse))
                    for a, b in zip(old, errors, strict=True)
                ]
            before[label] = count, errors
            row += [value for pair in zip(errors, orders, strict=True) for value in pair]
            row.append(seconds)
            records.append(
                {"scene": label, "elements": count, "errors": errors, "orders": orders, "seconds": seconds}
            )
        rows.append(row)
    return rows, records


def _bound_rows(
    nodes: tuple[int, int, int], elements: int, progress: Progress
) -> tuple[list[list[Any]], list[dict[str, Any]]]:
    """The static bound on type 1 skipping in both models."""
    rows: list[list[Any]] = []
    records = []
    ratio = edge_ratio(nodes[0], nodes[1])
    for scene in progress("energies of the passes", BOUND_SCENES):
        label = f"({scene.compression:.2f}, {scene.shear:.2f})"
        plain = kirchhoff.skipping_bound(scene, elements=elements)
        stretched = kirchhoff.skipping_bound(scene, elements=elements, extensible=True)
        coarse, fine = (der.skipping_bound(scene, nodes=count) for count in nodes[:2])
        limit = two_point(coarse, fine, ratio)
        verdict = "impossible" if plain < 0.0 else "possible"
        rows.append([label, plain, stretched, coarse, fine, limit, limit - stretched, verdict])
        records.append(
            {
                "compression": scene.compression,
                "shear": scene.shear,
                "kirchhoff": plain,
                "kirchhoff_extensible": stretched,
                "rods": [coarse, fine],
                "limit": limit,
                "difference": limit - stretched,
            }
        )
    return rows, records


def _swept_records(result: Sequence[Swept], nodes: tuple[int, int]) -> list[dict[str, Any]]:
    ratio = edge_ratio(*nodes)
    records = []
    for its in result:
        record: dict[str, Any] = {"compression": its.scene.compression, "shear": its.scene.shear}
        for k in range(2):
            limit = of_folds(its.coarse[k], its.fine[k], ratio).angle
            with_ea = its.stretched[k].angle
            record[f"alpha_c{k + 1}"] = {
                "kirchhoff": its.plain[k].angle,
                "kirchhoff_extensible": with_ea,
                "limit": limit,
                "difference": limit - with_ea,
            }
        records.append(record)
    return records


def _sweeps(swept: tuple[float, ...]) -> list[tuple[str, list[Scene]]]:
    """The paper's two sweeps of Fig. 5: over the compression, and over the shear."""
    return [
        ("compression", [Scene(compression=value, shear=0.37) for value in swept]),
        ("shear", [Scene(compression=0.40, shear=value) for value in swept]),
    ]


@dataclass(frozen=True)
class Folds:
    """What was found.

    Attributes
    ----------
    elements, nodes: of the tables.
    folds, meshes, bounds: rows of three tables; `records` are the same for programs, by name.
    paths: the curves of Paths 1 and 2.
    swept: the scenes of Fig. 5, by what is swept.
    sheared: the states at alpha = 0 and the map of the bound.
    """

    elements: int
    nodes: tuple[int, int, int]
    folds: tuple[list[Any], ...]
    meshes: tuple[list[Any], ...]
    bounds: tuple[list[Any], ...]
    records: dict[str, list[dict[str, Any]]]
    paths: Paths
    swept: dict[str, tuple[Swept, ...]]
    sheared: shear_section.Sheared


def main(
    *,
    elements: int = 32,
    nodes: tuple[int, ...] = (51, 101, 201),
    swept: tuple[float, ...] = SWEPT,
    meshes: tuple[int, ...] = MESHES,
    columns: int = 9,
    rows: int = 7,
    phase_step: float = 0.05,
    sweep: Sweep | None = None,
) -> Folds:
    """Folds and states of the ribbon at rest: 3D finite elements against discrete elastic rods.

    Tables: fold angles alpha_c1, alpha_c2 and saddles of both models; the order of convergence of the
    rods in their number of nodes, and their limit (Richardson); the mesh convergence of the elements.
    Figures: Paths 1 and 2, fold angles, states against the shear, their phase diagram, curvatures, and
    where a ribbon that leaves its first fold at rest has the energy to skip U+S- (type 1 skipping) (Figs. 4,
    5, appendices A and B). --swept: compressions and shears of Fig. 5. --columns, --rows: points of the map
    of type 1 skipping, in the compression and in the shear. --phase-step: grid of the rods in the phase
    diagram.
    """
    sweep = sweep or Sweep()
    if len(nodes) != 3 or not nodes[0] < nodes[1] < nodes[2]:
        raise ValueError(f"nodes = {nodes!r}: three numbers are needed, the coarsest mesh first")
    whole_number("elements", elements, 4)
    for count in meshes:
        whole_number("meshes", count, 4)
    # scenes that cannot be are refused here, and not after the tables
    groups = _sweeps(swept)
    whole_number("columns", columns, 2)
    whole_number("rows", rows, 2)
    within("phase_step", phase_step, 0.01, 0.5)
    counts = (int(nodes[0]), int(nodes[1]), int(nodes[2]))
    progress = sweep.progress
    # compiled code is loaded (or made, the first time) before anything is timed or any worker starts
    warm_up("kirchhoff", "der")
    fold_rows, fold_records = _fold_rows(counts, elements, progress)
    mesh_rows, mesh_records = _mesh_rows(tuple(int(count) for count in meshes), progress)
    bound_rows, bound_records = _bound_rows(counts, min(elements, 20), progress)
    drawn = min(elements, 16)
    scenes = [(scene, drawn, counts[:2]) for _, group in groups for scene in group]
    done = tuple(sweep("critical angles", swept_scene, scenes))
    (paths,) = sweep("paths", paths_of, [(PATHS, drawn, counts[1])])
    return Folds(
        elements=elements,
        nodes=counts,
        folds=tuple(fold_rows),
        meshes=tuple(mesh_rows),
        bounds=tuple(bound_rows),
        records={
            "folds": fold_records,
            "meshes": mesh_records,
            "sweeps": _swept_records(done, counts[:2]),
            "bounds": bound_records,
        },
        paths=paths,
        swept={name: done[k * len(swept) :][: len(swept)] for k, (name, _) in enumerate(groups)},
        sheared=shear_section.compute(
            sweep, step=phase_step, columns=columns, rows=rows, elements=drawn, nodes=counts[0]
        ),
    )


def summary(result: Folds) -> list[str]:
    """How far the models agree."""
    records = result.records["folds"]
    worst = max(records, key=lambda record: abs(record["difference"]))
    slowest = max(record["seconds"] for record in records)
    return [
        f"Finite elements of a Kirchhoff rod ({result.elements} elements) and discrete elastic rods share no "
        "mechanics. With the ribbon's stretching stiffness EA in both, the rods' folds tend to those of "
        f"the elements: over {len(records)} folds the largest difference of the limit is "
        f"{abs(worst['difference']):.1e} rad, at {worst['scene']}, fold {worst['fold']}.",
        f"A list of folds takes the finite elements {slowest:.2f} s or less; their errors are in the "
        "second table.",
        *shear_section.summary(result.sheared),
    ]


def tables(result: Folds) -> list[Table]:
    """Folds, mesh convergence, critical angles, the bound, pitchforks."""
    counts = result.nodes
    swept_rows = []
    for record in result.records["sweeps"]:
        row: list[Any] = [f"({record['compression']:.3f}, {record['shear']:.3f})"]
        for k in (1, 2):
            row += list(record[f"alpha_c{k}"].values())
        swept_rows.append(row)
    return [
        Table(
            "Folds that a slow ramp meets, rad",
            ["scene", "elements", "z(1/2)/L", "with EA"]
            + [f"DER {count}" for count in counts]
            + ["order", "limit", "±", "off", "s"]
            + [f"s, {count}" for count in counts],
            result.folds,
            ["s", ".10f", ".7f", ".9f"] + [".7f"] * 3 + [".3f", ".9f", ".0e", "+.1e"] + [".2f"] * 4,
            "order: observed on the three meshes. limit: Richardson extrapolation in (N - 2)^-2 and its "
            "square; ±: what the last step of it changed; off: limit - elements with EA. s: seconds of "
            "the inextensible elements, and of the rods.",
        ),
        Table(
            f"Finite elements under mesh refinement: errors of the folds against {FINEST} elements, rad",
            ["elements"]
            + [
                text
                for label, _ in REFINED
                for text in (f"{label[:12]}: alpha_c1", "order", "alpha_c2", "order", "s")
            ],
            result.meshes,
            ["s"] + ["+.1e", ".1f", "+.1e", ".1f", ".2f"] * len(REFINED),
            "order: of the error in the number of elements, from the row above.",
        ),
        Table(
            "Critical angles of Fig. 5, rad",
            ["(dL, dW)/L"]
            + [text for k in (1, 2) for text in (f"alpha_c{k}", "with EA", "DER limit", "limit - with EA")],
            swept_rows,
            ["s"] + [".8f", ".8f", ".8f", "+.1e"] * 2,
            f"limit: of N = {counts[0]} and {counts[1]}.",
        ),
        Table(
            "Static bound on type 1 skipping: E(alpha_c1) - E(saddle to U-), EI2/L",
            ["(dL, dW)/L", "elements", "elements, EA"]
            + [f"DER {count}" for count in counts[:2]]
            + ["DER limit", "limit - elements, EA", "type 1"],
            result.bounds,
            ["s"] + ["+.5f"] * 5 + ["+.1e", "s"],
            "Energies at rest. Where the difference is negative, a ribbon that leaves its first fold at "
            "rest cannot pass on to U- without U+S-; where it is positive it may, if little is damped.",
        ),
        *shear_section.tables(result.sheared),
    ]


def drawings(result: Folds) -> Iterator[Drawing]:
    """Figs. 4 and 5, appendices A and B, the bound."""
    yield Drawing(
        "folds-paths.png",
        "Paths 1 and 2 at (dL, dW) = (0.40, 0.37) L (paper, Fig. 4): height and slope at midspan "
        "against the clamp angle. Black: the curve through U+S+ and U+S-, which is one; grey: its "
        "mirror image. U+S+ and U+S- have the same height at alpha = 0, and opposite slopes.",
        draw_paths(result.paths),
    )
    yield Drawing(
        "folds-critical.png",
        "Curves and critical angles for several compressions and shears (paper, Fig. 5). Lines: "
        "finite elements, stable solid, unstable dashed; symbols: stable states of discrete rods. At "
        "(0.40, 0.40) rods of some 100 nodes or fewer have one curve where the elements have two: "
        "symbols without a line, at alpha < -0.5, lie on what is detached in the limit.",
        draw_critical(list(result.swept.items()), result.nodes[1]),
    )
    yield from shear_section.drawings(result.sheared)


def values(result: Folds) -> dict[str, Any]:
    """The numbers for programs."""
    return {**result.records, **shear_section.values(result.sheared)}


COMMAND = Command(
    name="folds",
    title="The ribbon at rest: folds and states",
    takes="some 50 seconds",
    main=main,
    summary=summary,
    tables=tables,
    drawings=drawings,
    values=values,
)
