"""The laws by which the cheapest model is chosen, measured anew."""

from __future__ import annotations

import itertools
import json
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.polynomial import chebyshev

from compare.chooser.cost_laws import FILE, PlanarLaws, Policy, rounded, shipped
from compare.chooser.trials import (
    planar_scene,
    planar_snap,
    random_planar,
)
from compare.models import warm_up
from compare.report.registry import Command
from compare.report.section import Drawing, Table
from compare.sweep import Sweep
from ribbonfem import Ribbon, Scene, elastica
from ribbonfem.delay import NormalForm, predict, universal
from ribbonfem.options import whole_number
from ribbonfem.output.style import colormaps, figure

from . import ribbons as ribbon_laws

# what the laws cover: dL/L, h/L; rates and dampings times t* take in 1e-4..1 rad/s and 1e-2..1e2 1/s
COMPRESSIONS = (0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5)
RATES = tuple(10.0 ** np.arange(-4.0, 0.26, 0.25))
DAMPINGS = tuple(10.0 ** np.arange(-2.0, 2.26, 0.25))
THICKEST = 0.0225
LAGS = tuple(np.logspace(-3.5, 2.2, 38))
TERMS, POWERS = 13, 5
POLICIES = (
    Policy("elastica", 6, 1e-4),
    Policy("elastica", 6, 3e-5),
    Policy("elastica", 8, 1e-5),
    Policy("elastica", 12, 3e-6),
    Policy("elastica", 12, 1e-6),
    Policy("elastica", 14, 3e-7),
    Policy("elastica", 16, 1e-7),
)
# coarser axes do for errors than for delays
ERROR_AXES = {
    "compression": (0.02, 0.1, 0.3, 0.5),
    "rate": tuple(RATES[::3]) + (RATES[-1],),
    "damping": tuple(DAMPINGS[::3]) + (DAMPINGS[-1],),
}


def _form(arguments: tuple[float, float]) -> tuple[float, float]:
    """mu and its normal form's product in beam units, at a dL/L and an h/L (0: no stretch)."""
    compression, thickness = arguments
    ribbon = Ribbon(thickness=thickness or 0.01)
    scene = Scene(compression=compression, shear=0.0, start="U+", ribbon=ribbon, gravity=(0.0, 0.0, 0.0))
    (form,) = elastica.normal_forms(scene, elements=20, extensible=thickness > 0.0)
    root = compression**0.5
    return form.angle / root, form.product * ribbon.inertial_time**4 * root


def planar_folds(sweep: Sweep) -> dict[str, Any]:
    """The fold and its normal form as Chebyshev polynomials in (dL/L)^(1/2) times powers of c."""
    nodes = np.cos(np.pi * (np.arange(TERMS) + 0.5) / TERMS)
    low, high = COMPRESSIONS[0] ** 0.5, COMPRESSIONS[-1] ** 0.5
    roots = 0.5 * (low + high) + 0.5 * (high - low) * nodes
    thickness = THICKEST * np.linspace(0.0, 1.0, POWERS)
    work = [(float(r * r), float(h)) for r in roots for h in thickness]
    found = np.array(sweep("planar folds", _form, work))
    values = found.reshape(TERMS, POWERS, 2)
    powers = np.linalg.inv(np.vander((thickness / THICKEST) ** 2, POWERS, increasing=True))
    inner = np.einsum("pc,ncq->npq", powers, values).reshape(TERMS, -1)
    fold = np.linalg.solve(chebyshev.chebvander(nodes, TERMS - 1), inner).reshape(TERMS, POWERS, 2)
    return {
        "compression": [COMPRESSIONS[0], COMPRESSIONS[-1]],
        "compliance": THICKEST**2 / 12.0,
        "fold": rounded(fold, 10),
    }


def _ratio(arguments: tuple[float, float, float, NormalForm]) -> float:
    compression, rate, damping, form = arguments
    scene = planar_scene(compression, rate, damping)
    delay = predict(form, scene.rate, scene.damping).angle
    return (planar_snap(scene, Policy("elastica", 16, 5e-7))[0] - form.angle) / delay


def planar_delays(sweep: Sweep) -> dict[str, Any]:
    """The delay of the snap over the normal form's prediction."""
    forms = {
        compression: elastica.normal_forms(planar_scene(compression, 1.0, 1.0), elements=20, extensible=True)[
            0
        ]
        for compression in COMPRESSIONS
    }
    work = [(c, r, d, forms[c]) for c, r, d in itertools.product(COMPRESSIONS, RATES, DAMPINGS)]
    found = sweep("planar delays", _ratio, work, cost=lambda w: 1.0 / w[1])
    ratio = np.array(found).reshape(len(COMPRESSIONS), len(RATES), len(DAMPINGS))
    axes = {"compression": COMPRESSIONS, "rate": RATES, "damping": DAMPINGS}
    return {
        "axes": {name: rounded(np.array(axis), 10) for name, axis in axes.items()},
        "ratio": rounded(ratio, 6),
    }


def _truth(scene: Scene) -> float:
    return planar_snap(scene, Policy("elastica", 28, 1e-8))[0]


def prediction_error(planar: dict[str, Any], scenes: int, seed: int, sweep: Sweep) -> dict[str, Any]:
    """Error of predictions in scenes drawn at random, also of thin and thick beams; the law bounds 99 %.

    It has three terms: a floor, what is left of the ringing that the start of the ramp sets off, and
    one in proportion to the rate.  Their shares are fixed, their scale is measured.
    """
    rng = np.random.default_rng(seed)
    drawn = [random_planar(rng, (0.01, 0.005, 0.01, 0.02)[k % 4]) for k in range(scenes)]
    truths = sweep("predictions", _truth, drawn)
    floor, ringing, power, rest = 1e-5, 8e-3, 1.3, 1e-4
    shape = {"floor": floor, "ringing": [ringing, power, rest]}
    laws = PlanarLaws({**planar, "delay": {**planar["delay"], **shape}})
    found = [laws.predict(scene) for scene in drawn]
    share = [abs(p.angle - t) / p.error for p, t in zip(found, truths, strict=True)]
    scale = max(1.0, float(np.quantile(share, 0.99)))
    return {
        "floor": float(f"{floor * scale:.3g}"),
        "ringing": [float(f"{ringing * scale:.3g}"), power, float(f"{rest * scale:.3g}")],
        "checked": {
            "scenes": scenes,
            "seed": seed,
            "median": float(
                f"{np.median([abs(p.angle - t) for p, t in zip(found, truths, strict=True)]):.3g}"
            ),
            "share": rounded(np.quantile(share, [0.5, 0.9, 0.99, 1.0]), 3),
        },
    }


def _errors(scene: Scene) -> list[tuple[float, float]]:
    truth = _truth(scene)
    runs = []
    for policy in POLICIES:
        angle, seconds = planar_snap(scene, policy)
        runs.append((abs(angle - truth), seconds))
    return runs


def planar_runs(sweep: Sweep) -> dict[str, Any]:
    """Errors and CPU seconds of the policies on a grid of scenes."""
    axes = list(ERROR_AXES.values())
    scenes = [planar_scene(*cell) for cell in itertools.product(*axes)]
    found = np.array(sweep("planar runs", _errors, scenes))
    grid = found.reshape(*(len(axis) for axis in axes), len(POLICIES), 2)
    return {
        "axes": {name: rounded(np.array(axis), 10) for name, axis in ERROR_AXES.items()},
        "policies": [
            {
                "key": policy.key,
                "model": policy.model,
                "elements": policy.elements,
                "tolerance": policy.tolerance,
                "seconds": float(f"{np.median(grid[..., k, 1]):.2g}"),
                "error": rounded(grid[..., k, 0], 2),
            }
            for k, policy in enumerate(POLICIES)
        ],
    }


def lags() -> dict[str, Any]:
    """f(Lambda) of the normal form."""
    return {"damping": rounded(np.array(LAGS), 8), "f": [float(f"{universal(x):.9g}") for x in LAGS]}


def _drift(new: dict[str, Any]) -> list[list[Any]]:
    """How far the laws that come with the package lie from these; empty before there are any."""
    try:
        old = shipped()
    except FileNotFoundError:
        return []
    rows: list[list[Any]] = []
    if "planar" in new:
        laws = PlanarLaws(new["planar"])
        mu = np.abs(laws.coefficients - old.planar.coefficients)[..., 0].sum()
        rows.append(["mu of the planar fold", float(mu)])
        rows.append(
            ["delay over prediction", float(np.abs(laws.ratio / old.planar.ratio - 1.0).max())],
        )
    if "ribbon" in new:
        for kind, errors in new["ribbon"]["mesh"].items():
            before = old.ribbon.data["mesh"][kind]
            rows.append([f"mesh errors, {kind}", float(np.abs(np.log(np.divide(errors, before))).max())])
    return rows


def _draw(planar: dict[str, Any]) -> Any:
    """The delay over its prediction, against the rate."""
    ratio = np.array(planar["delay"]["ratio"])
    axes = {name: np.array(values) for name, values in planar["delay"]["axes"].items()}
    fig, panels = figure(3, width=3.6, height=3.0)
    for panel, index in zip(panels, (0, 3, len(axes["compression"]) - 1), strict=True):
        for k in range(0, len(axes["damping"]), 4):
            colour = colormaps["viridis"](k / len(axes["damping"]))
            label = rf"$\nu t_*$ = {axes['damping'][k]:.2g}"
            panel.semilogx(axes["rate"], ratio[index, :, k], color=colour, label=label)
        panel.set(title=f"dL/L = {axes['compression'][index]:g}", ylim=(0.4, 1.05))
        panel.set_xlabel(r"rate $\dot\alpha t_*$")
    panels[0].set_ylabel("delay / normal form")
    panels[0].legend(fontsize=7)
    return fig


@dataclass(frozen=True)
class Calibration:
    """What was found: the new laws, whole (with the shipped ones where only half was measured), and drifts.

    `scenes`, `ribbons` and `seed` are those of the drawn scenes; `new` are the halves that were measured.
    """

    laws: dict[str, Any]
    new: tuple[str, ...]
    drift: tuple[list[Any], ...]
    scenes: int
    ribbons: int
    seed: int


def main(
    *,
    parts: Literal["all", "planar", "ribbon", "elements"] = "all",
    scenes: int = 200,
    ribbons: int = 60,
    seed: int = 7,
    sweep: Sweep | None = None,
) -> Calibration:
    """Measure the laws behind `compare.choose` anew, write them as laws.json, and compare with the shipped.

    --parts planar, ribbon (rods) or elements measures a part; the others are taken from the shipped file.
    Scenes are drawn with --seed: planar ones to bound the error of predictions, ribbons for the
    errors of meshes and steps.
    """
    sweep = sweep or Sweep()
    if parts not in ("all", "planar", "ribbon", "elements"):
        raise ValueError(f"parts = {parts!r}: must be 'all', 'planar', 'ribbon' or 'elements'")
    # bounds of laws are quantiles: of fewer scenes they would be no law
    whole_number("scenes", scenes, 10)
    whole_number("ribbons", ribbons, 10)
    whole_number("seed", seed, 0)
    # compiled once here, before any worker starts
    warm_up("elastica", "kirchhoff", "der")
    new: dict[str, Any] = {}
    if parts in ("all", "planar"):
        planar = planar_folds(sweep)
        planar["universal"] = lags()
        planar["delay"] = planar_delays(sweep)
        planar["delay"].update(prediction_error(planar, scenes, seed, sweep))
        planar["runs"] = planar_runs(sweep)
        new["planar"] = planar
    if parts in ("all", "ribbon"):
        new["ribbon"] = ribbon_laws.rods(ribbons, seed, sweep)
    if parts in ("all", "elements"):
        new["elements"] = ribbon_laws.elements(ribbons, seed, sweep)
    whole = {**({} if parts == "all" else shipped().data), **new}
    return Calibration(whole, tuple(new), tuple(_drift(new)), scenes, ribbons, seed)


def words(found: Calibration) -> list[str]:
    """Where the laws are, and how well predictions do."""
    text = [f"The laws are in {FILE} beside this report."]
    if "planar" in found.new:
        checked = found.laws["planar"]["delay"]["checked"]
        worst = checked["share"][-1] / max(1.0, checked["share"][2])
        text.append(
            f"Predictions of {found.scenes} planar snaps drawn at random (seed {found.seed}), checked with "
            f"the elastica at 24 elements: the median error is {checked['median']:.1e} rad; the law of the "
            f"error bounds 99 % of them, the worst is {worst:.2f} times it."
        )
    return text


def tables(found: Calibration) -> Iterator[Table]:
    """Errors of runs, errors of meshes, drift."""
    if "planar" in found.new:
        yield Table(
            "Runs of planar scenes",
            ["policy", "CPU s", "median error", "largest error"],
            [
                [run["key"], run["seconds"], float(np.median(run["error"])), float(np.max(run["error"]))]
                for run in found.laws["planar"]["runs"]["policies"]
            ],
            ["s", ".3f", ".1e", ".1e"],
            "Errors of the angle of the snap (rad) on a grid of scenes. Policy: model, elements, tolerance.",
        )
    if "ribbon" in found.new:
        laws = found.laws["ribbon"]
        yield Table(
            "Ribbons: estimated errors, median over scenes",
            ["meshes up to N", "U+S+", "U+S-", "CPU s of the last"],
            [
                [str(ribbon_laws.MESHES[k + 1]), *(laws["mesh"][kind][k] for kind in ("U+S+", "U+S-"))]
                + [laws["seconds"][k + 1]]
                for k in range(len(ribbon_laws.MESHES) - 2)
            ],
            ["s", ".1e", ".1e", ".3f"],
            f"Extrapolated through the last three meshes at most; {found.ribbons} scenes, tolerance 1e-4.",
        )
    if "elements" in found.new:
        laws = found.laws["elements"]
        yield Table(
            "Ribbons by elements: errors of the snap, rad",
            ["elements", "tolerance", "bound", "median", "CPU s"],
            [
                [str(count), local, laws["bound"][k], laws["typical"][k], laws["seconds"][k]]
                for k, (count, local) in enumerate(laws["ladder"])
            ],
            ["s", ".0e", ".1e", ".1e", ".3f"],
            f"Against the last rung, of {laws['scenes']} scenes; bounds of the {laws['smooth']} smooth ones.",
        )
    if found.drift:
        yield Table(
            "Against the shipped laws",
            ["law", "largest relative difference"],
            found.drift,
            ["s", ".1e"],
            "Of the meshes' errors: the logarithm of their ratio.",
        )


def drawings(found: Calibration) -> Iterator[Drawing]:
    """The planar delay over its prediction."""
    if "planar" in found.new:
        caption = "Delay of the planar snap over the prediction of the normal form."
        yield Drawing("calibrate-delay.png", caption, _draw(found.laws["planar"]))


def values(found: Calibration) -> dict[str, Any]:
    """The numbers for programs; the laws themselves are a file of their own."""
    return {"drift": list(found.drift), "laws": FILE}


def files(found: Calibration) -> dict[str, str]:
    """The laws, as the package ships them."""
    return {FILE: json.dumps(found.laws, separators=(",", ":")) + "\n"}


COMMAND = Command(
    name="calibrate",
    title="The laws behind the chooser",
    takes="some 20 minutes",
    main=main,
    words=words,
    tables=tables,
    drawings=drawings,
    values=values,
    files=files,
)
