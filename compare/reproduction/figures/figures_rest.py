"""Layout of the figures of the ribbon at rest, Figs. 2 to 5, 15 and 16: which lines are in which axes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from compare.reproduction.paths import Swept, crowd, last_leg, leg
from compare.reproduction.sheared import PHASES, chord_limit
from ribbonfem.results import Array

from .at_rest import Phases, Planar, Ribbons, Snapshot, States
from .axes import FigureData, Panel, Series, equilibria, joined

ROD = "#d1495b"
GREY = "0.62"
ANGLE, HEIGHT = r"clamp angle $\alpha$ (rad)", "$z(1/2)/L$"
# a colour for each value of a sweep, and dark enough for symbols
TONES = ("#440154", "#3b528b", "#21918c", "#35b779", "#c8a415", "#b5551d")


def pretty(name: str) -> str:
    """A state's name as mathematics."""
    return "$" + "".join(f"{name[k]}_{name[k + 1]}" for k in range(0, len(name), 2)) + "$"


def _symbols(name: str, x: Any, y: Any, colour: str, marker: str = "o", label: str = "") -> Series:
    return Series(name, np.asarray(x, float), np.asarray(y, float), "symbols", colour, marker, label)


def _dots(name: str, points: Sequence[tuple[float, float]], colour: str = "black", label: str = "") -> Series:
    x, y = np.array(points, dtype=float).reshape(-1, 2).T
    return Series(name, x, y, "dots", colour, label=label)


def snapshots(snapshots: Sequence[Snapshot]) -> FigureData:
    """Fig. 2: the ribbon from above along both paths."""
    panels = []
    for path, letter in ((1, "A"), (2, "B")):
        elements = [shot for shot in snapshots if (shot.path, shot.model) == (path, "kirchhoff")]
        rods = [shot for shot in snapshots if (shot.path, shot.model) == (path, "der")]
        for k, (one, two) in enumerate(zip(elements, rods, strict=True), 1):
            said = f"{pretty(one.said)}, at rest" if not one.moving else "in its snap"
            outline = np.concatenate((one.edges[0], one.edges[1][::-1], one.edges[0][:1]))
            series = [
                Series("finite elements, outline", outline[:, 0], outline[:, 1], "strip", "#3d7ea6"),
                Series("finite elements, centreline", one.centre[:, 0], one.centre[:, 1], "thin", "#1d4e89"),
                _symbols("discrete rods, centreline", two.centre[::8, 0], two.centre[::8, 1], ROD),
            ]
            title = f"({letter}{k}) {said}, " + rf"$\alpha$ = {one.angle:.2f}"
            limits = ((-0.22, 0.82), (-0.55, 0.18))
            panels.append(Panel(title, "$x/L$", "$y/L$", tuple(series), limits, equal=True))
        # the rows of the two paths do not mix
        panels += [Panel("", "", "", ())] * (-len(panels) % 5) if path == 1 else []
    return FigureData(
        "fig2",
        "The ribbon from above (paper, Fig. 2) along (A) Path 1 and (B) Path 2, at (dL, dW) = (0.40, 0.37) "
        "L, nu = 10, 0.1 rad/s: at rest, and at the instants at which z(1/2) or the slope at midspan is 0. "
        "Strips: finite elements; circles: rods. The paper's photographs are left out.",
        tuple(panels),
        columns=5,
        width=3.1,
        height=2.5,
        legend=(
            Series("finite elements", np.zeros(0), np.zeros(0), "line", "#1d4e89"),
            Series("discrete rods", np.zeros(0), np.zeros(0), "symbols", ROD),
        ),
    )


def planar(planar: Planar) -> FigureData:
    """Fig. 3, B and C: the planar beam, raw and rescaled."""
    panels = []
    for letter, scaled in (("B", False), ("C", True)):
        series: list[Series] = []
        for colour, (compression, beam) in zip(TONES, planar.beams.items(), strict=False):
            scale = compression**-0.5 if scaled else 1.0
            rod = planar.rods[compression]
            name = f"dL/L = {compression:.2f}"
            for sign, side in ((1.0, ""), (-1.0, ", mirror image")):
                series += equilibria(
                    f"{name}, elastica{side}",
                    sign * scale * beam.angle,
                    sign * scale * beam.height,
                    beam.stable,
                    colour,
                )
                # the fold that is met from U+; beyond the odd mode lie others
                points = [(sign * scale * a, sign * scale * z) for a, z in beam.folds[:1]]
                series.append(_dots(f"{name}, fold{side}", points))
            series.append(
                _symbols(
                    f"{name}, rods",
                    scale * rod.angle,
                    scale * rod.height,
                    colour,
                    label="" if scaled else f"$\\Delta L/L$ = {compression:.2f}",
                )
            )
        if scaled:
            for sign, side in ((1.0, ""), (-1.0, ", mirror image")):
                series += equilibria(
                    f"closed form{side}", sign * planar.exact.angle, sign * planar.exact.height,
                    planar.exact.stable, "black", label="closed form" if sign > 0.0 else "",
                )  # fmt: skip
        panels.append(
            Panel(
                f"({letter}) {'rescaled' if scaled else 'raw'}",
                r"$\mu = \alpha\,(\Delta L/L)^{-1/2}$" if scaled else ANGLE,
                r"$Z(1/2) = z(1/2)/L\,(\Delta L/L)^{-1/2}$" if scaled else HEIGHT,
                tuple(series),
                ((-2.6, 2.6) if scaled else (-1.6, 2.3), None),
                legend="lower left" if scaled else "upper right",
            )
        )
    return FigureData(
        "fig3",
        "The planar beam (paper, Fig. 3 B and C): height at midspan against the clamp angle, raw and "
        "rescaled. Lines: elastica elements, stable solid, unstable dashed; circles: rods of 51 nodes; "
        "dots: folds; black: closed form of small slopes. Angles of the folds collapse, heights do not.",
        tuple(panels),
        width=5.2,
        height=4.0,
    )


def _paths_panel(result: Ribbons, path: int) -> Panel:
    curve, rod, minus = result.paths.curve, result.paths.rod, result.paths.minus
    plus_leg, minus_leg = leg(curve), leg(minus)
    final = last_leg(curve)[:2]
    legs = [minus_leg, final] if path == 1 else [plus_leg, minus_leg, final]
    series: list[Series] = []
    picked = crowd(rod, 0.016)
    for sign, tone, side in ((1.0, "black", ""), (-1.0, GREY, ", mirror image")):
        series += equilibria(
            f"finite elements{side}",
            sign * curve.angle,
            sign * curve.height,
            curve.stable,
            tone,
            "finite elements" if sign > 0.0 else "",
        )
        series.append(
            _symbols(f"rods{side}", sign * rod.angle[picked], sign * rod.height[picked], "#1d4e89",
                     label="discrete rods" if sign > 0.0 else "")
        )  # fmt: skip
        points = [(sign * fold.angle, sign * fold.height) for fold in curve.folds]
        series.append(_dots(f"folds{side}", points, tone, "folds" if sign > 0.0 else ""))
    parts: list[tuple[Array, Array]] = []
    start = 0.0
    for one in legs:
        keep = one[0] >= start
        parts.append(
            (
                np.concatenate(([start], one[0][keep])),
                np.concatenate(([np.interp(start, one[0], one[1])], one[1][keep])),
            )
        )
        start = float(parts[-1][0][-1])
    # one line: the drops at the folds are its vertical parts
    route = np.concatenate([part[0] for part in parts]), np.concatenate([part[1] for part in parts])
    series.append(Series("slow ramp from alpha = 0", *route, "route", "darkorange", label="slow ramp"))
    names = ("U+S-", "U-S+") if path == 1 else ("U+S+", "U+S-", "U-S+")
    title = f"({'AB'[path - 1]}) Path {path}: " + r" $\rightarrow$ ".join(map(pretty, names))
    legend = "upper right" if path == 1 else ""
    return Panel(title, ANGLE, HEIGHT, tuple(series), ((-1.05, 1.05), (-0.36, 0.36)), legend=legend)


def paths(ribbons: Ribbons) -> FigureData:
    """Fig. 4: both paths."""
    return FigureData(
        "fig4",
        "The ribbon at (dL, dW) = (0.40, 0.37) L (paper, Fig. 4; its caption swaps S+ and S-). Lines: "
        "finite elements, stable solid, unstable dashed; circles: rods of 101 nodes; dots: folds; grey: "
        "the mirror image; orange: a slow ramp. The curve through U+S+ and U+S- is one, so that both "
        "panels have the same.",
        (_paths_panel(ribbons, 1), _paths_panel(ribbons, 2)),
        width=5.2,
        height=4.0,
    )


def critical(swept: dict[str, tuple[Swept, ...]]) -> FigureData:
    """Fig. 5: curves and critical angles, over compression and over shear."""
    panels = []
    for row, (name, results) in enumerate(swept.items()):
        symbol, other = (r"\Delta L/L", r"\Delta W/L") if name == "compression" else (
            r"\Delta W/L", r"\Delta L/L"
        )  # fmt: skip
        scenes = [its.scene for its in results]
        fixed = scenes[0].shear if name == "compression" else scenes[0].compression
        values = [float(getattr(scene, name)) for scene in scenes]
        series: list[Series] = []
        for colour, value, its in zip(TONES, values, results, strict=False):
            said = f"{'dL/L' if name == 'compression' else 'dW/L'} = {value:.2f}"
            curve, rod = its.curve, its.rod
            series += equilibria(f"{said}, finite elements", curve.angle, curve.height, curve.stable, colour)
            picked = np.array([k for k in crowd(rod, 0.03) if rod.stable[k]], dtype=int)
            series.append(
                _symbols(f"{said}, rods", rod.angle[picked], rod.height[picked], colour, label=f"{value:.2f}")
            )
            series.append(_dots(f"{said}, folds", [(fold.angle, fold.height) for fold in its.plain]))
        title = f"({'AC'[row]}) ${other}$ = {fixed:.2f}; ${symbol}$:"
        panels.append(
            Panel(title, ANGLE, HEIGHT, tuple(series), ((-1.05, 0.8), None), legend="center left")
        )  # fmt: skip
        lines: list[Series] = []
        for k, (tone, marker) in enumerate((("#1d4e89", "o"), ("#b23a48", "s"))):
            angles = np.array([its.plain[k].angle for its in results])
            smooth = np.linspace(values[0], values[-1], 60)
            fit = (
                CubicSpline(values, angles)(smooth) if len(values) > 3 else np.interp(smooth, values, angles)
            )
            what = rf"$\alpha_{{c{k + 1}}}$"
            lines.append(
                Series(
                    f"{what}, finite elements",
                    smooth,
                    np.asarray(fit),
                    "line",
                    tone,
                    label=f"{what}, elements",
                )
            )
            lines.append(
                _symbols(
                    f"{what}, rods",
                    values,
                    [its.fine[k].angle for its in results],
                    tone,
                    marker,
                    f"{what}, rods",
                )
            )
        panels.append(
            Panel(f"({'BD'[row]}) ${other}$ = {fixed:.2f}", f"${symbol}$", r"$\alpha_c$ (rad)", tuple(lines),
                  (None, (0.0, 0.75)), legend="best")
        )  # fmt: skip
    return FigureData(
        "fig5",
        "Curves and critical angles (paper, Fig. 5): (A, B) over the compression at dW/L = 0.37, (C, D) "
        "over the shear at dL/L = 0.40. Lines: finite elements, stable solid, unstable dashed; symbols: "
        "stable states of rods of 101 nodes; dots: folds that a slow ramp meets.",
        tuple(panels),
        width=5.0,
        height=3.7,
    )


def curvatures(states: States) -> FigureData:
    """Fig. 15: curvatures and twist of the four states."""
    panels = []
    styles = (
        ("kappa1", "#2a9d5c", "^", r"$20\,\kappa_1 L$", 20.0),
        ("kappa2", "#1d4e89", "o", r"$\kappa_2 L$", 1.0),
        ("tau", "#b23a48", "s", r"$\tau L$", 1.0),
    )
    for letter, state, rod in zip("ABCD", states.elements, states.rods, strict=True):
        order = np.argsort(state.points)
        series = []
        for quantity, colour, marker, label, scale in styles:
            values = scale * getattr(state, quantity)[order]
            series.append(
                Series(f"{label}, finite elements", state.points[order], values, "line", colour,
                       label=label if letter == "A" else "")
            )  # fmt: skip
            series.append(
                _symbols(
                    f"{label}, rods", rod.points[::2], scale * getattr(rod, quantity)[::2], colour, marker
                )
            )
        panels.append(
            Panel(f"({letter}) {pretty(state.name)}", "$s/L$", "curvatures and twist (1/L)", tuple(series),
                  ((0.0, 1.0), None), legend="best" if letter == "A" else "")
        )  # fmt: skip
    return FigureData(
        "fig15",
        "Curvatures and twist of the four states at (dL, dW) = (0.40, 0.37) L (paper, Fig. 15). kappa1 is "
        "about the ribbon's normal, in its plane, and twenty times larger here; kappa2 about its width. "
        "Lines: finite elements with EA; symbols: rods of 51 nodes.",
        tuple(panels),
        width=4.6,
        height=3.0,
    )


def _phase_lines(result: Phases) -> list[Series]:
    """The pitchforks over the compression, splines in its square root: they leave the origin as roots."""
    x = np.array([0.0, *result.lines])
    root = np.linspace(0.0, np.sqrt(x[-1]), 300)
    made = []
    names = (
        ("broken", "U to US", "line"),
        ("merged", "US to S", "dashed"),
        ("restored", "U stable again", "dotted"),
    )
    for name, said, look in names:
        shears = np.array([0.0, *(getattr(fork, name) or np.nan for fork in result.forks)])
        made.append(
            Series(f"{said}, finite elements", root**2, CubicSpline(np.sqrt(x), shears)(root), look, "black",
                   label=said)
        )  # fmt: skip
    edge = np.array([chord_limit(float(value)) for value in root**2])
    made.append(
        Series("ends as far apart as L", root**2, edge, "thin", "0.55", label="ends as far apart as L")
    )
    return made


def phases(phases: Phases) -> FigureData:
    """Fig. 16: states against the shear, phase diagram, three shapes."""
    series: list[Series] = []
    for colour, its in zip(TONES, phases.heights, strict=False):
        said = f"dL/L = {its.compression:.1f}"
        for family, *whole in its.lines:
            # splines have more points than a figure needs
            x, y, stable = (column[:: max(1, len(column) // 100)] for column in whole)
            for sign, side in ((1.0, ""), (-1.0, ", mirror image")):
                series += equilibria(
                    f"{said}, {family}, finite elements{side}", x, sign * y, stable, colour,
                    label=said if family == "U" and sign > 0.0 else "",
                )  # fmt: skip
        for family in ("U", "US", "S"):
            points = [(shear, sign * height) for name, shear, height in its.symbols if name == family
                      for sign in (1.0, -1.0)]  # fmt: skip
            if points:
                shears, tall = np.array(points).T
                series.append(_symbols(f"{said}, {family}, rods", shears, tall, colour, PHASES[family][0]))
    diagram = _phase_lines(phases)
    for name, (marker, colour) in PHASES.items():
        chosen = [record for record in phases.grid if record["der"] == name]
        if chosen:
            diagram.append(
                _symbols(f"{name.replace(', ', ' and ')}, rods", [r["compression"] for r in chosen],
                         [r["shear"] for r in chosen], colour, marker, name.replace(", ", " and "))
            )  # fmt: skip
    panels = [
        Panel(r"(A) states at $\alpha = 0$", r"$\Delta W/L$", HEIGHT, tuple(series), ((0.0, 0.86), None),
              legend="upper right"),
        Panel("(B) stable states", r"$\Delta L/L$", r"$\Delta W/L$", tuple(diagram),
              ((0.0, 0.62), (0.0, 0.95)), legend="upper left"),
        *(
            Panel(f"({letter}) {pretty(shape.name)}, $\\Delta W/L$ = {shape.shear:.2f}", "$x/L$", "$y/L$",
                  (_surface(shape.edges),))
            for letter, shape in zip("CDE", phases.shapes, strict=True)
        ),
    ]  # fmt: skip
    return FigureData(
        "fig16",
        "States at alpha = 0 (paper, Fig. 16): (A) against the shear, lines by finite elements with EA, "
        "symbols by rods; (B) which are stable, lines by finite elements, symbols by rods; beyond the "
        "dotted line the unbroken U is stable again beside S, which the paper does not show; (C to E) a "
        "ribbon of each kind at dL/L = 0.40.",
        tuple(panels),
        columns=3,
        width=4.6,
        height=3.9,
    )


def _surface(edges: Array) -> Series:
    points = np.concatenate((edges[0], edges[1]))
    return Series(
        "finite elements, two edges", points[:, 0], points[:, 1], "surface", "#3d7ea6", z=points[:, 2]
    )


__all__ = ["ANGLE", "HEIGHT", "ROD", "TONES", "critical", "curvatures", "joined", "paths", "phases", "planar",
           "pretty", "snapshots"]  # fmt: skip
