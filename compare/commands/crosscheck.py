"""Do the models agree at rest?  Folds of the planar beam in every model, against the closed form."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

import der
from compare.compilation import background
from compare.limits import edge_ratio, of_folds, two_point
from compare.models import MODELS, timed, warm_up
from compare.quantities.planar_curves import planar_curves
from compare.report.section import Drawing, Table
from compare.sweep import Progress, Sweep
from compare.sweep.pool import processors
from ribbonfem import Fold, Ribbon, Scene, elastica, kirchhoff, quasilinear
from ribbonfem.output.curve import Curve

from ..report.registry import Command

COMPRESSIONS = (0.05, 0.10, 0.20, 0.25, 0.30, 0.35, 0.40)
# its ratios follow, 4e4 and 1.499; planar folds do not depend on them
THIN = Ribbon(thickness=1e-3)
# a ribbon in motion, and its meshes
SNAP = Scene(compression=0.40, shear=0.37, start="U+S-", rate=0.1, damping=1.0, stop=0.65)
SNAP_NODES, SNAP_ELEMENTS = (101, 201), (6, 8)
# what is compiled for it, in the order in which it is worth while to begin
COMPILED = ("elements in motion", "rods in motion", "elements at rest", "rods at rest")


@dataclass(frozen=True)
class Crosscheck:
    """What was found: rows of the three tables, and the curves of the figure by dL/L.

    Attributes
    ----------
    nodes: of the coarser rods.
    closed: sigma, mu and Z of the closed form.
    folds: the table of planar folds, a record a row.
    mesh, rods: rows of the beam's mesh convergence and of the rods against elements.
    snaps: rows of a ribbon's snap in motion.
    beams, dots: curves of the elastica and of rods.
    exact: the closed form's curve (in mu and Z).
    """

    nodes: int
    closed: tuple[float, float, float]
    folds: tuple[dict[str, Any], ...]
    mesh: tuple[list[Any], ...]
    rods: tuple[list[Any], ...]
    snaps: tuple[list[Any], ...]
    beams: dict[float, Curve]
    dots: dict[float, Curve]
    exact: Curve


def _named(names: tuple[str, ...], rows: tuple[list[Any], ...]) -> list[dict[str, Any]]:
    """Rows of a table as records."""
    return [dict(zip(names, row, strict=True)) for row in rows]


def _rescaled(fold: Fold, compression: float) -> tuple[float, float, float]:
    """sigma, mu and Z of a fold."""
    return fold.load**0.5, fold.angle * compression**-0.5, fold.height * compression**-0.5


def _folds_of(
    compression: float, elements: int, nodes: int, show: Callable[[dict[str, Any]], object] = len
) -> list[dict[str, Any]]:
    """The folds of every model at one dL/L, a record each; each is shown as it comes."""
    exact = quasilinear.closed_form_fold()
    fine = 2 * nodes - 1
    ratio = edge_ratio(nodes, fine)
    records = []

    def done(label: str, unknowns: int | None, fold: Fold, taken: float | None) -> None:
        sigma, mu, height = _rescaled(fold, compression)
        records.append(
            {
                "compression": compression,
                "model": label,
                "angle": fold.angle,
                "sigma": sigma,
                "mu": mu,
                "height": height,
                "sigma_error": sigma / exact.sigma - 1,
                "mu_error": mu / exact.mu - 1,
                "height_error": height / exact.height - 1,
                "unknowns": unknowns,
                "seconds": taken,
            }
        )
        show(records[-1])

    scene = Scene(compression=compression, shear=0.0, start="U+")
    thin = Scene(compression=compression, shear=0.0, start="U+", ribbon=THIN, gravity=(0.0, 0.0, 0.0))
    stretching = {"elements": elements, "extensible": True}
    solves: list[tuple[str, int, str, Scene, dict[str, Any]]] = [
        ("beam FEM", 2 * elements - 1, "quasilinear", scene, {"elements": elements}),
        ("elastica FEM", 5 * elements + 1, "elastica", scene, {"elements": elements}),
        ("elastica FEM, EA", 5 * elements + 1, "elastica", scene, stretching),
        ("DER", 4 * nodes - 15, "der", scene, {"nodes": nodes}),
        ("DER", 4 * fine - 15, "der", scene, {"nodes": fine}),
        ("DER, h = 0.001", 4 * nodes - 15, "der", thin, {"nodes": nodes}),
        ("DER, h = 0.001", 4 * fine - 15, "der", thin, {"nodes": fine}),
    ]
    scale = compression**0.5
    done("closed form", None, Fold(exact.mu * scale, exact.height * scale, exact.sigma**2), None)
    before: Fold | None = None
    for label, count, name, of, mesh in solves:
        # nothing is compiled or loaded while a clock runs
        warm_up(name, motion=False)
        (met,), taken = timed(partial(MODELS[name].folds, of, **mesh))
        done(label, count, met, taken)
        if before is not None and mesh.get("nodes") == fine:
            done(f"{label}, limit", None, of_folds(before, met, ratio), None)
        before = met
    return records


def _fold_table(records: Sequence[dict[str, Any]]) -> Table:
    """Planar folds, a row a record."""
    rows = []
    for r in records:
        off = [r["sigma_error"], r["mu_error"], r["height_error"]]
        shown = [None] * 3 if r["model"] == "closed form" else off
        values = [r["angle"], r["sigma"], r["mu"], r["height"], *shown]
        rows.append([f"{r['compression']:.2f}", r["model"], *values, r["unknowns"], r["seconds"]])
    return Table(
        "The fold met from U+ as the clamp turns",
        ["dL/L", "model", "alpha_c", "sigma", "mu", "Z", "d sigma", "d mu", "d Z", "unknowns", "s"],
        rows,
        ["s", "s", ".7f", ".6f", ".6f", ".6f", "+.2e", "+.2e", "+.2e", "d", ".3f"],
        "d: relative difference from the closed form. s: seconds of the solve from the start state "
        "to the end of the ramp. limit: Richardson extrapolation in the square of the edge length.",
    )


def _mesh_rows() -> list[list[Any]]:
    """The beam FEM's fold on refined meshes: relative errors, and the order from one to the next."""
    exact = quasilinear.closed_form_fold()
    scene = Scene(compression=0.2, shear=0.0, start="U+")
    rows: list[list[Any]] = []
    errors: dict[int, Any] = {}
    for elements in (8, 16, 32, 64, 128):
        (fold,), seconds = timed(partial(quasilinear.folds, scene, elements=elements))
        values = np.array(_rescaled(fold, scene.compression))
        errors[elements] = values / [exact.sigma, exact.mu, exact.height] - 1.0
        before = errors.get(elements // 2)
        order = None if before is None else float(np.log2(abs(before[0] / errors[elements][0])))
        rows.append([f"{elements}", values[0], *errors[elements], order, seconds])
    limit = (16.0 * errors[64] - errors[32]) / 15.0
    rows.append(["32, 64 extrapolated", (1.0 + limit[0]) * exact.sigma, *limit, None, None])
    return rows


def _rod_rows(nodes: int) -> list[list[Any]]:
    """DER folds against solvers that share no mechanics with it."""
    fine = 2 * nodes - 1
    ratio = edge_ratio(nodes, fine)
    planar = Scene(compression=0.40, shear=0.0, start="U+")
    ribbon = Scene(compression=0.40, shear=0.40)
    cases = [
        ("planar 0.40", planar, elastica.folds(planar, elements=64, extensible=True)),
        ("ribbon (0.40, 0.40)", ribbon, kirchhoff.folds(ribbon, extensible=True)),
    ]
    rows: list[list[Any]] = []
    for label, scene, references in cases:
        coarse, dense = der.folds(scene, nodes=nodes), der.folds(scene, nodes=fine)
        for k, reference in enumerate(fold.angle for fold in references):
            limit = of_folds(coarse[k], dense[k], ratio).angle
            errors = [coarse[k].angle - reference, dense[k].angle - reference]
            order = float(np.log(errors[0] / errors[1]) / np.log(ratio**0.5))
            rows.append(
                [f"{label}, fold {k + 1}", reference, coarse[k].angle, dense[k].angle, limit]
                + [errors[0] / reference, order, limit - reference]
            )
    return rows


def _snap_rows() -> list[list[Any]]:
    """The snap of a ribbon in motion, rods and elements, each on two meshes; both with EA."""
    rods: list[float] = []
    rows: list[list[Any]] = []
    runs: list[tuple[str, Any, dict[str, Any]]] = [
        (f"DER, N = {n}", der, {"nodes": n, "tolerance": 1e-5}) for n in SNAP_NODES
    ]
    runs += [
        (f"Kirchhoff, {n} elements", kirchhoff, {"elements": n, "tolerance": 1e-5, "extensible": True})
        for n in SNAP_ELEMENTS
    ]
    warm_up("der", "kirchhoff")
    for label, model, options in runs:
        history = model.simulate(SNAP, configurations=False, until="snap", **options)
        result = history.crossing()
        angle = float("nan") if result is None else result[1]
        rows.append([label, angle, float(history.stats["seconds"])])
        if model is der:
            rods.append(angle)
    limit = two_point(rods[0], rods[1], edge_ratio(*SNAP_NODES))
    rows.insert(2, ["DER, limit", limit, None])
    return [[label, angle, angle - limit, seconds] for label, angle, seconds in rows]


def _diagram(result: Crosscheck) -> Any:
    """The paper's Fig. 3: heights against angles, raw and rescaled."""
    # (imported where something is drawn: workers draw nothing)
    from ribbonfem.output.style import colormaps, draw_curve, figure

    fig, (raw, scaled) = figure(2, width=5.0, height=4.0)
    for k, (compression, beam) in enumerate(result.beams.items()):
        colour = colormaps["viridis"](0.85 * k / max(1, len(result.beams) - 1))
        rod = result.dots[compression]
        label = f"$\\Delta L/L$ = {compression:.2f}"
        for axes, scale in ((raw, 1.0), (scaled, compression**-0.5)):
            for sign in (1.0, -1.0):
                x, z = sign * scale * beam.angle, sign * scale * beam.height
                draw_curve(axes, x, z, beam.stable, colour, label if sign > 0 else "")
                for angle, height in beam.folds[:1]:
                    axes.plot(sign * scale * angle, sign * scale * height, "k.", ms=7, zorder=5)
            axes.plot(scale * rod.angle, scale * rod.height, "o", ms=3, mfc="none", color=colour)
    exact = result.exact
    for sign in (1.0, -1.0):
        label = "closed form" if sign > 0 else ""
        draw_curve(scaled, sign * exact.angle, sign * exact.height, exact.stable, "black", label, width=1.0)
    ((mu, height),) = exact.folds
    for sign in (1.0, -1.0):
        scaled.plot(sign * mu, sign * height, "ks", ms=5, mfc="white", zorder=6)
    raw.set(xlabel=r"clamp angle $\alpha$ (rad)", ylabel=r"$z(1/2)/L$", title="(a) raw", xlim=(-1.6, 2.3))
    scaled.set(
        xlabel=r"$\mu = \alpha\,(\Delta L/L)^{-1/2}$",
        ylabel=r"$Z(1/2)$",
        title="(b) rescaled",
        xlim=(-2.6, 2.6),
    )
    raw.plot([], [], "ko", ms=3, mfc="none", label="DER")
    raw.plot([], [], "k.", ms=7, label="fold")
    raw.legend(fontsize=7.5, loc="center right", bbox_to_anchor=(1.0, 0.68))
    scaled.plot([], [], "ks", ms=5, mfc="white", label="its fold")
    scaled.legend(*[part[-2:] for part in scaled.get_legend_handles_labels()], fontsize=7.5)
    return fig


def main(
    *,
    compressions: tuple[float, ...] = COMPRESSIONS,
    elements: int = 64,
    nodes: int = 101,
    sweep: Sweep | None = None,
) -> Crosscheck:
    """Compare the fold of the planar beam in every model with the closed form (paper, Fig. 3).

    For each end-shortening dL: the angle alpha and the compressive load sigma^2 (EI2/L^2) of the fold, with
    mu = alpha (dL/L)^(-1/2) and Z = z(1/2)/L (dL/L)^(-1/2). By the closed form of small slopes, by finite
    elements of the beam of small slopes, of the elastica without stretch and with the ribbon's EA, and by
    discrete elastic rods on two meshes and extrapolated. Then the mesh convergence of the beam of small
    slopes, and the snap of a ribbon by rods and by finite elements.
    """
    progress = sweep.progress if sweep else Progress()
    exact = quasilinear.closed_form_fold()
    first, *rest = compressions
    for compression in compressions:
        # invalid input raises before the first run
        Scene(compression=compression, shear=0.0, start="U+")
    # the first time there is much to compile: other processes do it while this one runs what compiles quickly
    others = (sweep.processes if sweep else processors()) - 1
    with background(*COMPILED, processes=others, progress=progress) as elsewhere:
        snaps = elsewhere.begin(_snap_rows)
        rods = elsewhere.begin(_rod_rows, nodes)
        curves = elsewhere.begin(planar_curves, 51)
        # it goes through these from their end, this process from their beginning
        folds = {c: elsewhere.begin(_folds_of, c, elements, nodes) for c in reversed(rest)}
        records = _folds_of(first, elements, nodes, lambda record: progress.show(_fold_table([record])))
        for compression in progress("planar folds", rest):
            met = folds[compression]()
            progress.show(_fold_table(met))
            records += met
        mesh = _mesh_rows()
        elsewhere.wait()
        # what draws is imported while others compute
        from ribbonfem.output.style import blank

        blank(1.0, 1.0)
        beams, dots, curve = curves()
        against, snapped = rods(), snaps()
    return Crosscheck(
        nodes=nodes,
        closed=(exact.sigma, exact.mu, exact.height),
        folds=tuple(records),
        mesh=tuple(mesh),
        rods=tuple(against),
        snaps=tuple(snapped),
        beams=beams,
        dots=dots,
        exact=curve,
    )


def summary(result: Crosscheck) -> list[str]:
    """What was asked, found, and how sure it is."""
    sigma, mu, height = result.closed
    apart = abs(result.snaps[-1][2])
    sigma64 = next(row[1] for row in result.mesh if row[0] == "64")
    return [
        f"The quasi-linear fold in closed form: sigma = {sigma:.6f}, mu = {mu:.6f}, "
        f"Z = {height:.6f}. Beam finite elements with 64 elements: sigma = {sigma64:.6f} "
        f"(relative error {sigma64 / sigma - 1:.1e}).",
        "sigma is the square root of the compressive end force (in EI2/L^2) at the fold, mu the clamp's "
        "angle and Z the height at midspan there, both over the square root of dL/L; N is the number of a "
        "rod's nodes.",
        f"In motion, rods and finite elements that share no mechanics agree on the angle at which a ribbon "
        f"snaps to {apart:.0e} rad (last table).",
        "The closed form and the beam FEM assume small slopes; the elastica and the rods do not, and "
        "leave them as the end-shortening grows. With its stretching stiffness EA a ribbon of "
        "h = 0.01 L takes up part of a small end-shortening by stretch, so that its fold does not "
        "tend to the closed form: compare the rods with the extensible elastica, and with the "
        "closed form at h = 0.001 L.",
    ]


def tables(result: Crosscheck) -> list[Table]:
    """Planar folds, the beam's mesh convergence, rods against elements."""
    return [
        _fold_table(result.folds),
        Table(
            "Beam FEM: the fold under mesh refinement, relative errors against the closed form",
            ["elements", "sigma", "d sigma", "d mu", "d Z", "order of sigma", "s"],
            result.mesh,
            ["s", ".9f", "+.2e", "+.2e", "+.2e", ".2f", ".3f"],
        ),
        Table(
            f"Discrete rods with {result.nodes} and {2 * result.nodes - 1} nodes against finite elements "
            "that share no mechanics with them (both with EA)",
            ["fold", "elements", f"N = {result.nodes}", f"N = {2 * result.nodes - 1}", "limit"]
            + [f"rel. error, {result.nodes}", "order", "limit - elements"],
            result.rods,
            ["s", ".8f", ".8f", ".8f", ".8f", "+.2e", ".2f", "+.1e"],
            "limit: Richardson extrapolation in the square of the edge length l = L/(N - 2).",
        ),
        Table(
            "A ribbon in motion: (dL, dW)/L = (0.40, 0.37) from U+S-, 0.1 rad/s, nu = 1, angle of its snap",
            ["model", "alpha (rad)", "minus the rods' limit", "s"],
            result.snaps,
            ["s", ".7f", "+.1e", ".3f"],
            "Rods and finite elements share no mechanics; both with EA, tolerance 1e-5 L.",
        ),
    ]


def drawings(result: Crosscheck) -> Iterator[Drawing]:
    """The paper's Fig. 3."""
    yield Drawing(
        "crosscheck-diagram.png",
        "Height at midspan against the clamp angle, raw and rescaled (paper, Fig. 3). Lines: "
        "elastica FEM, stable solid, unstable dashed; circles: DER, 51 nodes; dots: folds; black: "
        "closed form of the quasi-linear beam, its fold a square.",
        _diagram(result),
    )


def values(result: Crosscheck) -> dict[str, Any]:
    """The numbers for programs."""
    sigma, mu, height = result.closed
    return {
        "closed_form": {"sigma": sigma, "mu": mu, "height": height},
        "folds": list(result.folds),
        "mesh": _named(
            ("elements", "sigma", "sigma_error", "mu_error", "height_error", "order", "seconds"), result.mesh
        ),
        "rods": _named(
            ("fold", "reference", "coarse", "fine", "limit", "error", "order", "limit_error"), result.rods
        ),
        "snaps": _named(("model", "angle", "difference", "seconds"), result.snaps),
    }


COMMAND = Command(
    name="crosscheck",
    title="Folds of the planar beam, side by side",
    takes="five to ten seconds; the first time, with compiling, a minute",
    main=main,
    summary=summary,
    tables=tables,
    drawings=drawings,
    values=values,
)
