"""Layout of the figures of the ribbon in motion, Figs. 6 to 14: which lines are in which axes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from compare.diagrams import Diagram
from compare.diagrams.report import Diagrams
from compare.diagrams.show import COLOURS, DASHES, SHORT, Named
from compare.reproduction.cases import CaseVerdict
from compare.reproduction.delays import Delays, universal_curve
from ribbonfem.output.curve import Curve
from ribbonfem.results import Array

from .axes import FigureData, Panel, Series, equilibria
from .figures_rest import ANGLE, HEIGHT, TONES
from .in_motion import OVERDAMPED, SCALED, UNDERDAMPED, Motion, Moved, Settled

TIME, RATE = "time $t$ (s)", r"rate $\dot\alpha$ (rad/s)"
NONE = np.zeros(0)
KEYS = (
    Series("finite elements", NONE, NONE, "line", "0.2"),
    Series("discrete rods", NONE, NONE, "symbols", "0.2"),
    Series("at rest, stable", NONE, NONE, "line", "0.65"),
    Series("at rest, unstable", NONE, NONE, "dashed", "0.65"),
)
# symbols of a curve of rods
_SYMBOLS = 70
_TITLES = {"planar": "planar beam, dL/L = 0.40", "Path 1": "U+S- to U-S+", "Path 2": "U+S+ to U+S-"}


def _rest(curve: Curve) -> list[Series]:
    """The curve at rest, and its mirror image, on which the shape after the last snap lies."""
    made: list[Series] = []
    for sign, side in ((1.0, ""), (-1.0, ", mirror image")):
        made += equilibria(
            f"at rest, finite elements{side}", sign * curve.angle, sign * curve.height, curve.stable, "0.65"
        )
    return made


def _thinned(x: Array, y: Array, width: float, limits: tuple[float, float]) -> tuple[Array, Array]:
    """Rows within the limits, about equally far apart along the curve as it is drawn."""
    keep = (x >= limits[0]) & (x <= limits[1])
    x, y = x[keep], y[keep]
    if len(x) < 3:
        return x, y
    # heights fill the axis with some 0.7 L
    along = np.concatenate(([0.0], np.cumsum(np.hypot(np.diff(x) / width, np.diff(y) / 0.7))))
    pick = np.searchsorted(along, np.linspace(0.0, along[-1], _SYMBOLS))
    pick = np.unique(np.minimum(pick, len(x) - 1))
    return x[pick], y[pick]


def _ramps(result: Moved, letter: str, damping: float, against: str) -> Panel:
    """z(1/2) against the angle or the time, for the rates of one damping."""
    chosen = [motion for motion in result.motions if motion.damping == damping]
    planar = chosen[0].system == "planar"
    series: list[Series] = _rest(result.curve) if against == "angle" else []
    ends = [_end(motion, against) for motion in chosen]
    limits = (0.0 if against == "angle" else min(end[0] for end in ends), max(end[1] for end in ends))
    if against == "angle":
        fold = chosen[0].fold
        limits = (max(0.0, fold - 0.25), limits[1])
    rates = sorted({motion.rate for motion in chosen})
    for motion in chosen:
        colour = TONES[2 * rates.index(motion.rate)]
        name = f"nu = {damping:g}, rate {motion.rate:g}"
        x = motion.angle if against == "angle" else motion.time - motion.fold / motion.rate
        if motion.model == "kirchhoff":
            keep = (x >= limits[0]) & (x <= limits[1])
            label = f"{motion.rate:g} rad/s"
            series.append(
                Series(f"{name}, finite elements", x[keep], motion.height[keep], "thin", colour, label=label)
            )
        else:
            points = _thinned(x, motion.height, limits[1] - limits[0], limits)
            series.append(Series(f"{name}, rods", *points, "symbols", colour))
    if against == "angle" and not planar:
        low, high = (0.0, 0.32) if chosen[0].system == "Path 2" else (-0.36, 0.3)
    else:
        low, high = (-0.45, 0.42) if planar else (-0.36, 0.3)
    axis = ANGLE if against == "angle" else "time after the fold's angle (s)"
    kind = "overdamped" if damping == OVERDAMPED else "underdamped"
    return Panel(
        rf"({letter}) {kind}, $\nu$ = {damping:g}/s", axis, HEIGHT, tuple(series), (limits, (low, high)),
        legend="lower left",
    )  # fmt: skip


def _end(motion: Motion, against: str) -> tuple[float, float]:
    """From where to where a ramp is drawn."""
    late = motion.late if motion.late == motion.late else 0.1
    if against == "angle":
        return 0.0, min(float(motion.angle[-1]), motion.fold + max(2.2 * late, 0.05))
    return -1.0 * late / motion.rate, 2.0 * late / motion.rate


def ramps(moved: dict[str, Moved]) -> FigureData:
    """Fig. 6: a planar beam's snaps against angle and time."""
    panels = [
        _ramps(moved["planar"], letter, damping, against)
        for letter, damping, against in (
            ("A", OVERDAMPED, "angle"),
            ("B", UNDERDAMPED, "angle"),
            ("C", OVERDAMPED, "time"),
            ("D", UNDERDAMPED, "time"),
        )
    ]
    return FigureData(
        "fig6",
        "The planar beam's snap at dL/L = 0.40 (paper, Fig. 6), against the clamp angle and against the "
        "time after the ramp has passed the fold's angle. The snap comes after the fold; overdamped it is "
        "smooth, underdamped it rings. Both models with EA.",
        tuple(panels),
        width=5.0,
        height=3.5,
        legend=KEYS,
    )


def _points(result: Delays, name: str, damping: float) -> tuple[Array, Array]:
    cells = sorted((c for c in result.of(name, damping) if c.measured), key=lambda c: c.rate)
    return np.array([c.rate for c in cells]), np.array([float(c.measured or 0.0) for c in cells])


def _scaling(result: Delays, figure: str, letters: str) -> list[Panel]:
    """Angle delay, time delay where there is a letter for it, and collapse."""
    elements, rods = SCALED[figure]
    kinds = ("angle", "time", "collapse") if len(letters) == 3 else ("angle", "collapse")
    series: dict[str, list[Series]] = {kind: [] for kind in kinds}
    for k, damping in enumerate(result.dampings):
        colour = (
            TONES[k % len(TONES)] if len(result.dampings) <= len(TONES) else _tone(k, len(result.dampings))
        )
        for name, look in ((elements, "line"), (rods, "symbols")):
            x, y = _points(result, name, damping)
            scale = (result.forms[name].product * x) ** 0.2
            said = f"nu = {damping:g}, {'finite elements' if look == 'line' else 'rods'}"
            label = rf"$\nu$ = {damping:g}" if look == "line" else ""
            points = {"angle": (x, y), "time": (x, y / x), "collapse": (damping / scale, y / x * scale)}
            for kind in kinds:
                tag = label if kind == kinds[0] else ""
                series[kind].append(Series(said, *points[kind], look, colour, label=tag))
    # of one system: knots of two lie so close to each other that a spline would swing between them
    curve = universal_curve([cell for cell in result.cells if cell.system == elements], result.forms)
    ends = [cell.damping_ratio for cell in result.cells if cell.system == elements]
    span = np.geomspace(min(ends), max(ends), 80)
    f = np.exp(curve(np.log(span)))
    series["collapse"].append(Series("predicted, f(Lambda)", span, f, "thin", "black", label="predicted"))
    for look, said, values in (
        ("dashed", r"$\Lambda \ll 1$: 3.412", np.full_like(span, 3.41167)),
        ("dotted", r"$\Lambda \gg 1$: $2.338\,\Lambda^{2/3}$", 2.33811 * span ** (2.0 / 3.0)),
    ):
        series["collapse"].append(Series(said, span, values, look, "black", label=said))
    for kind, least in (("angle", 1.0), ("time", 0.0)):
        if kind in series:
            series[kind] += _slopes(result, elements, least)
    labels = {
        "angle": (RATE, r"angle delay $\Delta\alpha$ (rad)", (None, None)),
        "time": (RATE, "time delay $T_s$ (s)", (None, None)),
        "collapse": (
            r"$\Lambda = \nu\,(c\,a_2\,\dot\alpha)^{-1/5}$",
            r"$T_s\,(c\,a_2\,\dot\alpha)^{1/5}$",
            (None, (1.0, 2.0 * float(f.max()))),
        ),
    }
    return [
        Panel(f"({letter})", labels[kind][0], labels[kind][1], tuple(series[kind]), labels[kind][2], log=True,
              legend="best")
        for letter, kind in zip(letters, kinds, strict=True)
    ]  # fmt: skip


def _tone(k: int, count: int) -> str:
    from ribbonfem.output.style import colormaps

    red, green, blue = (round(255 * part) for part in colormaps["viridis"](0.92 * k / max(1, count - 1))[:3])
    return f"#{red:02x}{green:02x}{blue:02x}"


def _slopes(result: Delays, name: str, least: float) -> list[Series]:
    """Straight lines of the limiting exponents beside the least and the most damped delays."""
    made = []
    for damping, power, said in (
        (min(result.dampings), 4.0 / 5.0, "4/5" if least else "-1/5"),
        (max(result.dampings), 2.0 / 3.0, "2/3" if least else "-1/3"),
    ):
        x, y = _points(result, name, damping)
        if len(x) < 2:
            continue
        away = 0.6 if power > 0.7 else 1.7
        ends = np.array([x[0], x[-1]])
        line = away * y[0] * (ends / x[0]) ** power
        label = f"slope {said}"
        look = "dashed" if power > 0.7 else "dotted"
        made.append(Series(label, ends, line if least else line / ends, look, "0.4", label=label))
    return made


def scaling(delays: Delays) -> FigureData:
    """Fig. 7: the planar beam's delays."""
    return FigureData(
        "fig7",
        "Delays of the planar beam at dL/L = 0.40 (paper, Fig. 7): of the angle, of the time, and rescaled "
        "by c a2, which statics give (predicted: theory without a free parameter). Lines through the "
        "elastica's delays, symbols: rods; grey: the limiting exponents.",
        tuple(_scaling(delays, "fig7", "ABC")),
        columns=3,
        width=4.3,
        height=3.6,
        legend=KEYS[:2],
    )


def ribbon(moved: dict[str, Moved], delays: Delays, path: str, figure: str) -> FigureData:
    """Figs. 8 and 9: a path's snaps and delays."""
    number, result = figure.removeprefix("fig"), moved[path]
    panels = [_ramps(result, "A", OVERDAMPED, "angle"), _ramps(result, "B", UNDERDAMPED, "angle")]
    return FigureData(
        figure,
        f"The ribbon at (dL, dW) = (0.40, 0.37) L, {_TITLES[path]} (paper, Fig. {number}): (A, B) height "
        "at midspan against the clamp angle, (C) angle delay, (D) time delay rescaled by c a2, which "
        "statics give. The snap is the instant at which "
        f"{'z(1/2)' if path == 'Path 1' else 'the slope at midspan'} is 0."
        + " Lines: finite elements; symbols: rods; both with EA.",
        (*panels, *_scaling(delays, figure, "CD")),
        width=5.0,
        height=3.5,
        legend=KEYS,
    )  # fmt: skip


def _named(result: Settled, chosen: Sequence[CaseVerdict], letter: str, against: str) -> Panel:
    """z(1/2) of named runs against the angle or the time, and of the latter the angle too."""
    scene = chosen[0].case.scene
    series: list[Series] = []
    if against == "angle":
        series += _rest(result.curves[scene.compression])
    reach = max((v.case.scene.stop or 0.0) for v in chosen)
    limits = (0.0, 1.04 * reach)
    if against == "time":
        limits = (-12.0, 25.0) if scene.damping < 1.0 else (-4.0, 6.0)
    for verdict in chosen:
        rate = verdict.case.scene.rate
        colour = "#c1121f" if rate < 0.1 else "#1d4e89" if rate < 10.0 else "#2a9d5c"
        said = f"rate {rate:g}"
        for rows, look, model in (
            (verdict.line, "thin", "finite elements"),
            (verdict.curve, "symbols", "rods"),
        ):
            if not rows:
                continue
            x = np.array(rows["angle"])
            if against == "time":
                x = np.array(rows["time"]) - (verdict.case.scene.stop or 0.0) / rate
            y, turned = np.array(rows["height"]), np.array(rows["angle"])
            keep = (x >= limits[0]) & (x <= limits[1])
            label = f"{rate:g} rad/s: {verdict.outcome}" if look == "thin" else ""
            points = (x[keep], y[keep]) if look == "thin" else _thinned(x, y, limits[1] - limits[0], limits)
            series.append(
                Series(f"{said}, z(1/2)/L, {model}", points[0], points[1], look, colour, label=label)
            )
            if against == "time" and look == "thin":
                series.append(Series(f"{said}, alpha, {model}", x[keep], turned[keep], "dashed", colour))
    where = rf"$\Delta L/L$ = {scene.compression:.2f}, $\nu$ = {scene.damping:g}/s"
    axis = ANGLE if against == "angle" else "time after the end of the ramp (s)"
    y_label = HEIGHT if against == "angle" else rf"{HEIGHT} (solid), $\alpha$ (rad, dashed)"
    heights = (-0.36, 0.34) if against == "angle" else (-0.36, 0.4)
    place = "lower left" if against == "angle" else "center right"
    return Panel(f"({letter}) {where}", axis, y_label, tuple(series), (limits, heights), legend=place)


def named(settled: Settled, figure: str) -> FigureData:
    """Figs. 10, 12 and 13: the named runs."""
    kind, compressions = {
        "fig10": ("skipping", (0.40, 0.35)), "fig12": ("selection", (0.40,)), "fig13": ("selection", (0.35,)),
    }[figure]  # fmt: skip
    mine = [v for v in settled.verdicts if v.case.kind == kind and v.case.scene.compression in compressions]
    places = sorted(
        {(v.case.scene.compression, v.case.scene.damping) for v in mine}, key=lambda k: (-k[0], k[1])
    )
    groups = [
        [v for v in mine if (v.case.scene.compression, v.case.scene.damping) == place] for place in places
    ]
    order = [(group, "angle") for group in groups]
    if kind == "selection":
        order += [(group, "time") for group in groups]
    panels = tuple(
        _named(settled, group, letter, against)
        for letter, (group, against) in zip("ABCD", order, strict=False)
    )
    number = figure.removeprefix("fig")
    what = "Mode skipping" if kind == "skipping" else "Mode selection"
    extra = (
        ""
        if figure != "fig12"
        else " The paper's fast rate is 100 rad/s in its text and 1 in its caption: both."
    )
    return FigureData(
        figure,
        f"{what} at dW/L = 0.40 (paper, Fig. {number}). Lines: finite elements, circles: rods, the finest "
        "of each; the outcome of all refinements of both stands beside the rate; sensitive: they differ. "
        f"Where a ribbon rings, the two part in phase.{extra}",
        panels,
        width=5.0,
        height=3.4,
        legend=KEYS,
    )


def _map(diagram: Diagram, letter: str, cases: Sequence[Named]) -> Panel:
    """A diagram over rate and damping; its series are what is written beside it."""
    x, y = np.meshgrid(diagram.rates, diagram.dampings)
    series = []
    for k, name in enumerate(diagram.outcomes):
        share = np.asarray(diagram.shares[..., k])
        if np.nansum(share) > 0.0:
            series.append(
                Series(f"share of {name}, {diagram.model}", x.ravel(), y.ravel(), colour=COLOURS[name],
                       z=share.ravel())
            )  # fmt: skip
    mixed = np.asarray(diagram.undetermined)
    series.append(Series("mixed cell", x[mixed], y[mixed], "symbols"))
    for below, above in sorted({(b.below, b.above) for b in diagram.boundaries}):
        here = [b for b in diagram.boundaries if (b.below, b.above) == (below, above)]
        points = np.array([(b.value, b.other) if b.along == "rate" else (b.other, b.value) for b in here])
        series.append(Series(f"change from {below} to {above}", points[:, 0], points[:, 1], "dots"))
    for name, curve in diagram.predicted.items():
        if len(curve):
            series.append(Series(f"predicted, {name}", curve[:, 0], curve[:, 1], "dashed"))
    scene = diagram.scene
    stop = "" if scene.stop is None else rf", stop {scene.stop:g} rad"
    title = rf"({letter}) $\Delta L/L$ = {scene.compression:.2f}{stop}"
    if diagram.model != "der":
        title += ", finite elements"
    return Panel(title, RATE, r"damping $\nu$ (1/s)", tuple(series), diagram=diagram, named=tuple(cases))


def maps(result: Diagrams, figure: str, cases: dict[float, Any]) -> FigureData:
    """Figs. 11 and 14: what ramps do over rate and damping."""
    panels = tuple(
        _map(diagram, letter, cases.get(diagram.scene.compression, ()))
        for letter, diagram in zip("ABCDEFGHIJKL", result.diagrams, strict=False)
    )
    there = [
        name
        for name in result.diagrams[0].outcomes
        if any(np.nansum(d.shares[..., d.outcomes.index(name)]) > 0.0 for d in result.diagrams)
    ]
    keys = [Series(name, NONE, NONE, "dots", COLOURS[name], "s") for name in there]
    keys += [
        Series("mixed cell", NONE, NONE, "symbols", "black"),
        Series("change, to 1 %", NONE, NONE, "dots", "black", "."),
    ]
    for name in dict.fromkeys(n for d in result.diagrams for n, curve in d.predicted.items() if len(curve)):
        look = "dotted" if DASHES.get(name) == ":" else "dashed"
        keys.append(Series(SHORT.get(name, name), NONE, NONE, look, "black"))
    keys.append(Series("paper's runs", NONE, NONE, "symbols", "black", "*"))
    what = (
        "which shape a ramp skips" if figure == "fig11" else "in which shape a ramp that stops comes to rest"
    )
    return FigureData(
        figure,
        f"Over rate and damping, {what}, at dW/L = 0.40 (paper, Fig. {figure.removeprefix('fig')}). A cell "
        "is an area with the shares of its runs, as a mixture of colours; in mixed cells (open circles) no "
        "single run decides. Dots: where the outcome changes. Grey bars: bands in which both come.",
        panels,
        columns=3 if len(panels) > 2 else 2,
        width=4.0,
        height=3.5,
        legend=tuple(keys),
    )
