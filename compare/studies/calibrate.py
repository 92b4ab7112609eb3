"""The laws of cost and error by which the cheapest model is chosen, measured anew."""

from __future__ import annotations

import itertools
import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.polynomial import chebyshev

from compare.chooser import levels, random_scenes
from compare.chooser.cost_laws import FILE, PlanarLaws, rounded, shipped
from compare.chooser.random_scenes import planar_scene, planar_snap
from compare.chooser.refinement import endless, expected_steps
from compare.limits import limit_of
from compare.models import warm_up
from compare.report.registry import Command
from compare.report.section import Drawing, Table
from compare.sweep import Sweep
from ribbonfem import Ribbon, Scene, elastica
from ribbonfem.delay import NormalForm, predict, universal
from ribbonfem.options import choice, whole_number
from ribbonfem.output.style import colormaps, figure

from .study import Study

# meshes of rods that are run one after the other until their extrapolation has settled
MESHES = (31, 51, 76, 101, 151, 201, 301)
# tolerances (L) of the elements' single runs, and elements and tolerances of what they are measured against
SINGLE = (1e-4, 3e-5, 1e-5, 3e-6, 1e-6, 3e-7, 1e-7)
FINEST = ((20, 1e-8), (24, 3e-9))
# what the laws cover: dL/L, h/L; rates and dampings times t* take in 1e-4..1 rad/s and 1e-2..1e2 1/s
COMPRESSIONS = (0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5)
RATES = tuple(10.0 ** np.arange(-4.0, 0.26, 0.25))
DAMPINGS = tuple(10.0 ** np.arange(-2.0, 2.26, 0.25))
THICKEST = 0.0225
LAGS = tuple(np.logspace(-3.5, 2.2, 38))
TERMS, POWERS = 13, 5


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
    values = Study("planar folds", _form, (roots * roots).tolist(), thickness.tolist()).grid(sweep)
    powers = np.linalg.inv(np.vander((thickness / THICKEST) ** 2, POWERS, increasing=True))
    inner = np.einsum("pc,ncq->npq", powers, values).reshape(TERMS, -1)
    fold = np.linalg.solve(chebyshev.chebvander(nodes, TERMS - 1), inner).reshape(TERMS, POWERS, 2)
    return {
        "compression": [COMPRESSIONS[0], COMPRESSIONS[-1]],
        "compliance": THICKEST**2 / 12.0,
        "fold": rounded(fold, 10),
    }


def _ratio(arguments: tuple[tuple[float, NormalForm], tuple[float, float]]) -> float:
    (compression, form), (rate, damping) = arguments
    scene = planar_scene(compression, rate, damping)
    delay = predict(form, scene.rate, scene.damping).angle
    return (planar_snap(scene, 16, 5e-7)[0] - form.angle) / delay


def _axes(axes: dict[str, Sequence[float]]) -> dict[str, Any]:
    return {name: rounded(axis, 10) for name, axis in axes.items()}


def planar_delays(sweep: Sweep) -> dict[str, Any]:
    """The delay of the snap over the normal form's prediction."""
    scenes = [planar_scene(compression, 1.0, 1.0) for compression in COMPRESSIONS]
    forms = [(at.compression, elastica.normal_forms(at, elements=20, extensible=True)[0]) for at in scenes]
    ramps = list(itertools.product(RATES, DAMPINGS))
    ratio = Study("planar delays", _ratio, forms, ramps, cost=lambda work: 1.0 / work[1][0]).grid(sweep)
    return {
        "axes": _axes({"compression": COMPRESSIONS, "rate": RATES, "damping": DAMPINGS}),
        "ratio": rounded(ratio.reshape(len(COMPRESSIONS), len(RATES), len(DAMPINGS)), 6),
    }


def _truth(scene: Scene) -> float:
    return planar_snap(scene, 28, 1e-8)[0]


def prediction_error(planar: dict[str, Any], scenes: int, seed: int, sweep: Sweep) -> dict[str, Any]:
    """Error of predictions in scenes drawn at random, also of thin and thick beams; the law bounds 99 %.

    It has three terms: a floor, what is left of the ringing that the start of the ramp sets off, and
    one in proportion to the rate.  Their shares are fixed, their scale is measured.
    """
    rng = np.random.default_rng(seed)
    drawn = [random_scenes.random_planar(rng, (0.01, 0.005, 0.01, 0.02)[k % 4]) for k in range(scenes)]
    truths = Study("predictions", _truth, drawn).results(sweep)
    floor, ringing, power, rest = 1e-5, 8e-3, 1.3, 1e-4
    shape = {"floor": floor, "ringing": [ringing, power, rest]}
    laws = PlanarLaws({**planar, "delay": {**planar["delay"], **shape}})
    result = [laws.predict(scene) for scene in drawn]
    off = np.abs([p.angle - t for p, t in zip(result, truths, strict=True)])
    share = off / [p.error for p in result]
    scale = max(1.0, float(np.quantile(share, 0.99)))
    return {
        "floor": rounded(floor * scale, 3),
        "ringing": [rounded(ringing * scale, 3), power, rounded(rest * scale, 3)],
        "checked": {"scenes": scenes, "seed": seed, "median": rounded(np.median(off), 3)}
        | {"share": rounded(np.quantile(share, [0.5, 0.9, 0.99, 1.0]), 3)},
    }


def _ribbon(scene: Scene) -> dict[str, Any]:
    runs = [random_scenes.rod_snap(scene, nodes, 1e-4) for nodes in MESHES]
    times = {f"{t:.0e}": random_scenes.rod_snap(scene, 76, t)[0] for t in (1e-6, 1e-5)}
    times["1e-04"] = runs[MESHES.index(76)][0]
    return {"snap": [run[0] for run in runs], "seconds": [run[1] for run in runs], "time": times}


def rods(scenes: int, seed: int, sweep: Sweep) -> dict[str, Any]:
    """Errors of rods on random ribbons: of extrapolated meshes, and of the integration in time."""
    rng = np.random.default_rng(seed)
    drawn = [random_scenes.random_ribbon(rng) for _ in sweep.progress("drawing ribbons", range(scenes))]
    result = Study("ribbons", _ribbon, drawn).results(sweep)
    rate = np.array([scene.scaled_rate for scene in drawn])
    laws: dict[str, Any] = {"meshes": MESHES, "scenes": scenes, "seed": seed, "time": {}, "mesh": {}}
    best = np.array([f["time"]["1e-06"] for f in result])
    for label in ("1e-04", "1e-05"):
        at = np.array([f["time"][label] for f in result])
        # ribbons that vibrate are looked after by the run itself
        laws["time"][label] = rounded(np.nanquantile(np.abs(at - best) / rate, 0.9), 2)
    # the finest has nothing to be measured against; a decade of tolerance takes four fifths of the error
    laws["time"]["1e-06"] = rounded(laws["time"]["1e-05"] / 5.0, 2)
    for kind in ("U+S+", "U+S-"):
        chosen = [f["snap"] for f, scene in zip(result, drawn, strict=True) if scene.start == kind]
        laws["mesh"][kind] = [
            rounded(np.nanmedian([limit_of(s[: k + 1], MESHES[: k + 1])[1] for s in chosen]), 2)
            for k in range(1, len(MESHES) - 1)
        ]
    laws["seconds"] = rounded(np.median([f["seconds"] for f in result], axis=0), 2)
    return laws


def _single_runs(scene: Scene) -> list[tuple[float, float, bool]]:
    """Snap (rad), CPU seconds, and whether it vibrates, of each run at `SINGLE`, then of the `FINEST`."""
    model = levels.model_of(scene)
    meshes = [*((levels.enough_for(model, local), local) for local in SINGLE), *FINEST]
    if scene.planar:
        return [(*planar_snap(endless(scene), *mesh), False) for mesh in meshes]
    return [random_scenes.element_snap(scene, *mesh) for mesh in meshes]


def elements(scenes: int, seed: int, sweep: Sweep) -> dict[str, Any]:
    """Errors of single runs of elements in drawn scenes, over the scatter that smooth ones claim.

    Errors above 2e-8 rad that the finest runs do not settle to a fifth are left out.
    """
    rng = np.random.default_rng(seed)
    drawn = [random_scenes.random_scene(rng, planar=k % 2 == 0) for k in range(2 * scenes)]
    result = Study("elements", _single_runs, drawn, cost=expected_steps).results(sweep)
    rows = []
    for scene, runs in zip(drawn, result, strict=True):
        *_, (coarse, _, _), (truth, _, vibrates) = runs
        kind = "planar" if scene.planar else "vibrating" if vibrates else "smooth"
        for local, (snap, seconds, _) in zip(SINGLE, runs, strict=False):
            error = abs(snap - truth)
            if abs(coarse - truth) <= max(0.2 * error, 2e-8):
                rows.append((kind, local, error, error / levels.scatter(scene, local), seconds))
    table = []
    for kind, local in itertools.product(("planar", "smooth", "vibrating"), SINGLE):
        these = np.array([row[2:] for row in rows if row[:2] == (kind, local)]).reshape(-1, 3)
        if len(these):
            error, seconds = rounded(np.median(these[:, (0, 2)], axis=0), 2)
            shares = rounded(np.quantile(these[:, 1], (0.5, 0.97, 1.0)), 2)
            row = {"kind": kind, "tolerance": local, "scenes": len(these), "error": error, "seconds": seconds}
            table.append(row | dict(zip(("median", "97 %", "largest"), shares, strict=True)))
    return {"scenes": scenes, "seed": seed, "runs": table}


def planar_laws(scenes: int, seed: int, sweep: Sweep) -> dict[str, Any]:
    """Folds, f(Lambda) of the normal form, delays and the errors of predictions."""
    planar = planar_folds(sweep)
    planar["universal"] = {"damping": rounded(LAGS, 8), "f": rounded([universal(x) for x in LAGS], 9)}
    planar["delay"] = planar_delays(sweep)
    planar["delay"].update(prediction_error(planar, scenes, seed, sweep))
    return planar


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
        rows.append(["delay over prediction", float(np.abs(laws.ratio / old.planar.ratio - 1.0).max())])
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
    """The new laws, whole (with the shipped ones where only a part was measured), and drifts.

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
    """Measure again the laws of error and cost by which `compare.choose` chooses; write them as laws.json.

    --parts planar, ribbon (rods) or elements (single runs) measures one part, the others keep their shipped
    laws. --scenes planar ones and --ribbons sheared ones are drawn with --seed; of elements so many of each.
    """
    sweep = sweep or Sweep()
    choice("parts", parts, ("all", "planar", "ribbon", "elements"))
    # bounds of laws are quantiles: of fewer scenes they would be no law
    for name, count in (("scenes", scenes), ("ribbons", ribbons)):
        whole_number(name, count, 10)
    whole_number("seed", seed, 0)
    warm_up("elastica", "kirchhoff", "der")
    measure: dict[str, Callable[[], dict[str, Any]]] = {
        "planar": lambda: planar_laws(scenes, seed, sweep),
        "ribbon": lambda: rods(ribbons, seed, sweep),
        "elements": lambda: elements(ribbons, seed, sweep),
    }
    new = {part: measure[part]() for part in measure if parts in ("all", part)}
    whole = {**({} if parts == "all" else shipped().data), **new}
    return Calibration(whole, tuple(new), tuple(_drift(new)), scenes, ribbons, seed)


def summary(result: Calibration) -> list[str]:
    """Where the laws are, and how well predictions do."""
    text = [f"The laws are in {FILE} beside this report."]
    if "planar" in result.new:
        checked = result.laws["planar"]["delay"]["checked"]
        worst = checked["share"][-1] / max(1.0, checked["share"][2])
        text.append(
            f"Predictions of {result.scenes} planar snaps drawn at random (seed {result.seed}), checked with "
            f"the elastica at 24 elements: the median error is {checked['median']:.1e} rad; the law of the "
            f"error bounds 99 % of them, the worst is {worst:.2f} times it."
        )
    return text


def tables(result: Calibration) -> Iterator[Table]:
    """Errors of meshes and of single runs, drift."""
    if "ribbon" in result.new:
        laws = result.laws["ribbon"]
        yield Table(
            "Ribbons: estimated errors, median over scenes",
            ["meshes up to N", "U+S+", "U+S-", "CPU s of the last"],
            list(zip(map(str, MESHES[1:-1]), *laws["mesh"].values(), laws["seconds"][1:-1], strict=True)),
            ["s", ".1e", ".1e", ".3f"],
            f"Extrapolated through the last three meshes at most; {result.ribbons} scenes, tolerance 1e-4.",
        )
    if "elements" in result.new:
        laws = result.laws["elements"]
        yield Table.of(
            "Single runs of elements: errors of the snap over the scatter of smooth runs",
            laws["runs"],
            [
                ("scenes", "s", "kind"),
                ("tolerance", ".0e", "tolerance"),
                ("settled", "d", "scenes"),
                ("median error", ".1e", "error"),
                *((name, ".2f", name) for name in ("median", "97 %", "largest")),
                ("CPU s", ".4f", "seconds"),
            ],
            f"{laws['scenes']} planar scenes, by the elastica, and as many ribbons, by the Kirchhoff rod.",
        )
    if result.drift:
        note = "Of the meshes' errors: the logarithm of their ratio."
        yield Table(
            "Against the shipped laws", ["law", "largest difference"], result.drift, ["s", ".1e"], note
        )


def drawings(result: Calibration) -> Iterator[Drawing]:
    """The planar delay over its prediction."""
    if "planar" in result.new:
        caption = "Delay of the planar snap over the prediction of the normal form."
        yield Drawing("calibrate-delay.png", caption, _draw(result.laws["planar"]))


def values(result: Calibration) -> dict[str, Any]:
    """The numbers for programs; the laws themselves are a file of their own."""
    return {"drift": list(result.drift), "laws": FILE}


def files(result: Calibration) -> dict[str, str]:
    """The laws, as the package ships them."""
    return {FILE: json.dumps(result.laws, separators=(",", ":")) + "\n"}


COMMAND = Command(
    name="calibrate",
    title="The laws behind the chooser",
    takes="some 20 minutes",
    main=main,
    summary=summary,
    tables=tables,
    drawings=drawings,
    values=values,
    files=files,
)
