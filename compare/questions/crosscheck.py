"""Do the models agree at rest?  Folds of the planar beam in every model, against the closed form."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import der
from compare.face.report import Picture, Section, Table
from compare.face.style import draw_curve, figure, plt, save
from compare.sweep.progress import Progress
from ribbonfem import Fold, Ribbon, Scene, elastica, kirchhoff, quasilinear
from ribbonfem.continuation import Steps

COMPRESSIONS = (0.05, 0.10, 0.20, 0.25, 0.30, 0.35, 0.40)
THIN = Ribbon(thickness=1e-3)
DRAWN = (0.20, 0.25, 0.30, 0.35, 0.40)
# steps short enough for a polyline to look like a curve
SMOOTH = Steps(turn=0.1, largest=0.05)


def _timed(call: Callable[[], Any]) -> tuple[Any, float]:
    start = time.perf_counter()
    value = call()
    return value, time.perf_counter() - start


def extrapolated(coarse: Fold, fine: Fold, ratio: float) -> Fold:
    """Richardson's limit of a fold whose error falls by `ratio` from the coarse mesh to the fine one."""
    values = (
        (ratio * getattr(fine, name) - getattr(coarse, name)) / (ratio - 1.0)
        for name in ("angle", "height", "load")
    )
    return Fold(*values)


def edge_ratio(coarse: int, fine: int) -> float:
    """(l_coarse / l_fine)^2 of centred-clamp rods with these numbers of nodes."""
    return ((fine - 2) / (coarse - 2)) ** 2


def _named(names: tuple[str, ...], rows: list[list[Any]]) -> list[dict[str, Any]]:
    """Rows of a table as records."""
    return [dict(zip(names, row, strict=True)) for row in rows]


def _rescaled(fold: Fold, compression: float) -> tuple[float, float, float]:
    """sigma, mu and Z of a fold."""
    return fold.load**0.5, fold.angle * compression**-0.5, fold.height * compression**-0.5


def _fold_rows(
    compressions: tuple[float, ...], elements: int, nodes: int, progress: Progress
) -> tuple[list[list[Any]], list[dict[str, Any]]]:
    exact = quasilinear.closed_form_fold()
    fine = 2 * nodes - 1
    ratio = edge_ratio(nodes, fine)
    rows: list[list[Any]] = []
    records = []
    for compression in progress("planar folds", compressions):
        scene = Scene(compression=compression, shear=0.0, start="U+")
        thin = Scene(compression=compression, shear=0.0, start="U+", ribbon=THIN)
        beams: list[tuple[str, int, Callable[..., tuple[Fold, ...]]]] = [
            ("beam FEM", 2 * elements - 1, partial(quasilinear.folds, scene, elements=elements)),
            ("elastica FEM", 3 * elements + 1, partial(elastica.folds, scene, elements=elements)),
            (
                "elastica FEM, EA",
                3 * elements + 1,
                partial(elastica.folds, scene, elements=elements, extensible=True),
            ),
            ("DER", 4 * nodes - 15, partial(der.folds, scene, nodes=nodes)),
            ("DER", 4 * fine - 15, partial(der.folds, scene, nodes=fine)),
            ("DER, h = 0.001", 4 * nodes - 15, partial(der.folds, thin, nodes=nodes)),
            ("DER, h = 0.001", 4 * fine - 15, partial(der.folds, thin, nodes=fine)),
        ]
        found: list[tuple[str, int | None, Fold, float | None]] = []
        for label, count, solve in beams:
            (met,), taken = _timed(solve)
            found.append((label, count, met, taken))
            if label.startswith("DER") and count == 4 * fine - 15:
                limit = extrapolated(found[-2][2], met, ratio)
                found.append((f"{label}, limit", None, limit, None))
        scale = compression**0.5
        closed = Fold(exact.mu * scale, exact.height * scale, exact.sigma**2)
        found.insert(0, ("closed form", None, closed, None))
        for label, unknowns, fold, seconds in found:
            sigma, mu, height = _rescaled(fold, compression)
            off = [sigma / exact.sigma - 1, mu / exact.mu - 1, height / exact.height - 1]
            shown = [None] * 3 if label == "closed form" else off
            rows.append(
                [f"{compression:.2f}", label, fold.angle, sigma, mu, height, *shown, unknowns, seconds]
            )
            records.append(
                {
                    "compression": compression,
                    "model": label,
                    "angle": fold.angle,
                    "sigma": sigma,
                    "mu": mu,
                    "height": height,
                    "sigma_error": off[0],
                    "mu_error": off[1],
                    "height_error": off[2],
                    "unknowns": unknowns,
                    "seconds": seconds,
                }
            )
    return rows, records


def _mesh_rows() -> list[list[Any]]:
    """The beam FEM's fold on refined meshes: relative errors, and the order from one to the next."""
    exact = quasilinear.closed_form_fold()
    scene = Scene(compression=0.2, shear=0.0, start="U+")
    rows: list[list[Any]] = []
    errors: dict[int, Any] = {}
    for elements in (8, 16, 32, 64, 128):
        (fold,), seconds = _timed(partial(quasilinear.folds, scene, elements=elements))
        values = np.array(_rescaled(fold, scene.compression))
        errors[elements] = values / [exact.sigma, exact.mu, exact.height] - 1.0
        before = errors.get(elements // 2)
        order = None if before is None else float(np.log2(abs(before[0] / errors[elements][0])))
        rows.append([f"{elements}", values[0], *errors[elements], order, seconds])
    limit = (16.0 * errors[64] - errors[32]) / 15.0
    rows.append(["32, 64 extrapolated", (1.0 + limit[0]) * exact.sigma, *limit, None, None])
    return rows


def _rod_rows(nodes: int, progress: Progress) -> list[list[Any]]:
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
    for label, scene, references in progress("rods against elements", cases):
        coarse, dense = der.folds(scene, nodes=nodes), der.folds(scene, nodes=fine)
        for k, reference in enumerate(fold.angle for fold in references):
            limit = extrapolated(coarse[k], dense[k], ratio).angle
            errors = [coarse[k].angle - reference, dense[k].angle - reference]
            order = float(np.log(errors[0] / errors[1]) / np.log(ratio**0.5))
            rows.append(
                [f"{label}, fold {k + 1}", reference, coarse[k].angle, dense[k].angle, limit]
                + [errors[0] / reference, order, limit - reference]
            )
    return rows


def _diagram(path: Path, nodes: int, progress: Progress) -> str:
    """The paper's Fig. 3: heights against angles, raw and rescaled."""
    fig, (raw, scaled) = figure(2, width=5.0, height=4.0)
    for k, compression in enumerate(progress("bifurcation diagram", DRAWN)):
        colour = plt.cm.viridis(0.85 * k / (len(DRAWN) - 1))
        scene = Scene(compression=compression, shear=0.0, start="U+")
        # two unstable directions more would only add the curves of higher buckling modes
        beam = elastica.equilibria(scene, elements=32, span=(-1.6, 1.6), unstable=1, steps=SMOOTH)
        rod = der.equilibria(scene, nodes=nodes, span=(-1.6, 1.6), unstable=1, steps=Steps(turn=0.6))
        label = f"$\\Delta L/L$ = {compression:.2f}"
        for axes, scale in ((raw, 1.0), (scaled, compression**-0.5)):
            for sign in (1.0, -1.0):
                x, z = sign * scale * beam.angle, sign * scale * beam.height
                draw_curve(axes, x, z, beam.stable, colour, label if sign > 0 else "")
                for fold in beam.folds[:1]:
                    axes.plot(sign * scale * fold.angle, sign * scale * fold.height, "k.", ms=7, zorder=5)
            axes.plot(scale * rod.angle, scale * rod.height, "o", ms=3, mfc="none", color=colour)
    span = (-2.6, 2.6)
    closed = quasilinear.closed_form_branch(span)
    # up to the odd mode: beyond it lie the higher modes
    keep = np.maximum.accumulate(closed.load) < 81.0
    for sign in (1.0, -1.0):
        draw_curve(
            scaled,
            sign * closed.mu[keep],
            sign * closed.height[keep],
            closed.stable[keep],
            "black",
            "closed form" if sign > 0 else "",
            width=1.0,
        )
    exact = quasilinear.closed_form_fold()
    for sign in (1.0, -1.0):
        scaled.plot(sign * exact.mu, sign * exact.height, "ks", ms=5, mfc="white", zorder=6)
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
    return save(fig, path)


def main(
    *,
    progress: Progress | None = None,
    out: Path,
    compressions: tuple[float, ...] = COMPRESSIONS,
    elements: int = 64,
    nodes: int = 101,
) -> Section:
    """Compare the fold of the planar beam in every model with the closed form (paper, Fig. 3).

    For each end-shortening: fold angle, sigma = sqrt(load), rescaled mu and Z of the closed form,
    the beam FEM, the elastica FEM (inextensible, and with the stretching stiffness EA of the
    ribbon) and discrete elastic rods on two meshes and in their Richardson limit, with the
    differences from the closed form, unknowns and seconds; then the mesh convergence of the beam
    FEM and the rods' folds against elements that share no mechanics with them.
    """
    progress = progress or Progress()
    exact = quasilinear.closed_form_fold()
    # compiled code is loaded (or made, the first time) before anything is timed
    warm = Scene(compression=0.3, shear=0.0, start="U+")
    for _ in progress("loading compiled code", range(1)):
        quasilinear.folds(warm, elements=8)
        elastica.folds(warm, elements=8)
        kirchhoff.folds(warm, elements=8)
        der.folds(warm, nodes=21)
    rows, records = _fold_rows(compressions, elements, nodes, progress)
    mesh = _mesh_rows()
    rods = _rod_rows(nodes, progress)
    picture = _diagram(out / "crosscheck-diagram.png", 51, progress)
    sigma64 = next(row[1] for row in mesh if row[0] == "64")
    return Section(
        name="crosscheck",
        title="Folds of the planar beam, side by side",
        text=[
            f"The quasi-linear fold in closed form: sigma = {exact.sigma:.6f}, mu = {exact.mu:.6f}, "
            f"Z = {exact.height:.6f}. Beam finite elements with 64 elements: sigma = {sigma64:.6f} "
            f"(relative error {sigma64 / exact.sigma - 1:.1e}).",
            "The closed form and the beam FEM assume small slopes; the elastica and the rods do not, and "
            "leave them as the end-shortening grows. With its stretching stiffness EA a ribbon of "
            "h = 0.01 L takes up part of a small end-shortening by stretch, so that its fold does not "
            "tend to the closed form: compare the rods with the extensible elastica, and with the "
            "closed form at h = 0.001 L.",
        ],
        tables=[
            Table(
                "The fold met from U+ as the clamp turns",
                ["dL/L", "model", "alpha_c", "sigma", "mu", "Z", "d sigma", "d mu", "d Z", "unknowns", "s"],
                rows,
                ["s", "s", ".7f", ".6f", ".6f", ".6f", "+.2e", "+.2e", "+.2e", "d", ".3f"],
                "d: relative difference from the closed form. s: seconds of the solve from the start state "
                "to the end of the ramp. limit: Richardson extrapolation in the square of the edge length.",
            ),
            Table(
                "Beam FEM: the fold under mesh refinement, relative errors against the closed form",
                ["elements", "sigma", "d sigma", "d mu", "d Z", "order of sigma", "s"],
                mesh,
                ["s", ".9f", "+.2e", "+.2e", "+.2e", ".2f", ".3f"],
            ),
            Table(
                f"Discrete rods with {nodes} and {2 * nodes - 1} nodes against finite elements that share no "
                "mechanics with them (both with EA)",
                ["fold", "elements", f"N = {nodes}", f"N = {2 * nodes - 1}", "limit"]
                + [f"rel. error, {nodes}", "order", "limit - elements"],
                rods,
                ["s", ".8f", ".8f", ".8f", ".8f", "+.2e", ".2f", "+.1e"],
                "limit: Richardson extrapolation in the square of the edge length l = L/(N - 2).",
            ),
        ],
        pictures=[
            Picture(
                picture,
                "Height at midspan against the clamp angle, raw and rescaled (paper, Fig. 3). Lines: "
                "elastica FEM, stable solid, unstable dashed; circles: DER, 51 nodes; dots: folds; black: "
                "closed form of the quasi-linear beam, its fold a square.",
            )
        ],
        values={
            "closed_form": {"sigma": exact.sigma, "mu": exact.mu, "height": exact.height},
            "folds": records,
            "mesh": _named(
                ("elements", "sigma", "sigma_error", "mu_error", "height_error", "order", "seconds"), mesh
            ),
            "rods": _named(
                ("fold", "reference", "coarse", "fine", "limit", "error", "order", "limit_error"), rods
            ),
        },
    )
