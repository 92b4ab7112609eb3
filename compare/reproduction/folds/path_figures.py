"""Figures of the curves of equilibria over the clamp angle: the paper's two paths, and critical angles."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from compare.reproduction.paths import Paths, Swept, crowd, last_leg, leg
from ribbonfem.output.style import colormaps, draw_curve, figure

_ROD = "#d1495b"


def draw_paths(result: Paths) -> Any:
    """Paths 1 and 2 (Fig. 4): height and slope at midspan against the clamp angle."""
    curve, rod, minus, nodes = result.curve, result.rod, result.minus, result.nodes
    plus_leg, minus_leg = leg(curve), leg(minus)
    final = last_leg(curve)
    fig, axes = figure(2, 2, width=5.2, height=3.7)
    routes = (("Path 1", [minus_leg, final]), ("Path 2", [plus_leg, minus_leg, final]))
    for column, (title, legs) in enumerate(routes):
        for row, name in enumerate(("height", "slope")):
            ax = axes[row][column]
            for sign, tone in ((1.0, "black"), (-1.0, "0.62")):
                values: NDArray[np.float64] = getattr(curve, name)
                x, y = sign * curve.angle, sign * values
                draw_curve(ax, x, y, curve.stable, tone, width=1.1)
                picked = crowd(rod, 0.016)
                style: dict[str, Any] = {"ms": 3.4, "mfc": "none", "mec": _ROD, "mew": 0.8, "zorder": 4}
                ax.plot(
                    sign * rod.angle[picked], sign * getattr(rod, name)[picked], "o", **style,
                    alpha=1.0 if sign > 0.0 else 0.45,
                )  # fmt: skip
                for fold in curve.folds:
                    nearest = int(np.argmin(np.hypot(curve.angle - fold.angle, curve.height - fold.height)))
                    mark = fold.height if name == "height" else float(curve.slope[nearest])
                    ax.plot(sign * fold.angle, sign * mark, ".", color=tone, ms=9, zorder=5)
            _draw_route(ax, legs, row + 1)
            ax.axhline(0.0, color="0.85", lw=0.6, zorder=0)
            ax.set(xlim=(-1.05, 1.05), xlabel=r"clamp angle $\alpha$ (rad)")
        axes[0][column].set(ylabel=r"$z(1/2)/L$", ylim=(-0.36, 0.36))
        axes[1][column].set(ylabel=r"$t_z(1/2)$", ylim=(-0.95, 0.95))
        names = " → ".join(("$U_+S_-$", "$U_-S_+$") if column == 0 else ("$U_+S_+$", "$U_+S_-$", "$U_-S_+$"))
        axes[0][column].set_title(f"({'ab'[column]}) {title}: {names}")
        for row, angle, level, text in (
            (0, -0.80, 0.256, "$U_+S_+$"),
            (0, 0.44, 0.200, "$U_+S_-$"),
            (0, 0.72, -0.285, "$U_-S_+$"),
            (1, -0.80, -0.42, "$U_+S_+$"),
            (1, 0.74, 0.36, "$U_-S_+$"),
        ):
            axes[row][column].text(angle, level, text, fontsize=9.5)
        axes[1][column].annotate(
            "$U_+S_-$",
            (0.36, 0.52),
            (0.02, 0.78),
            fontsize=9.5,
            arrowprops={"arrowstyle": "-", "color": "0.4", "lw": 0.7, "shrinkB": 0},
        )
    ax = axes[0][0]
    ax.plot([], [], "k-", lw=1.1, label="finite elements: stable")
    ax.plot([], [], "k--", lw=1.1, label="unstable")
    ax.plot([], [], "k.", ms=9, label="fold")
    ax.plot([], [], "o", ms=3.4, mfc="none", mec=_ROD, label=f"DER, N = {nodes}")
    ax.plot([], [], color="orange", lw=4.5, alpha=0.45, label="slow ramp from α = 0")
    ax.legend(fontsize=7.5, loc="center left", bbox_to_anchor=(0.02, 0.68))
    return fig


def _draw_route(ax: Any, legs: list[Any], what: int) -> None:
    """The way of a slow ramp along its stable sheets, with a drop at each fold."""
    start = 0.0
    style: dict[str, Any] = {"color": "orange", "lw": 4.5, "alpha": 0.45, "zorder": 1}
    for k, one in enumerate(legs):
        keep = one[0] >= start
        x = np.concatenate(([start], one[0][keep]))
        y = np.concatenate(([np.interp(start, one[0], one[what])], one[what][keep]))
        ax.plot(x, y, solid_capstyle="butt", **style)
        if k + 1 == len(legs):
            return
        start = float(x[-1])
        below = np.interp(start, legs[k + 1][0], legs[k + 1][what])
        ax.annotate(
            "",
            (start, below),
            (start, y[-1]),
            arrowprops={"arrowstyle": "-|>", "color": "darkorange", "lw": 1.4, "shrinkA": 0, "shrinkB": 0},
            zorder=6,
        )


def draw_critical(groups: list[tuple[str, tuple[Swept, ...]]], nodes: int) -> Any:
    """Fig. 5: curves for several compressions or shears, and their critical angles."""
    fig, axes = figure(2, 2, width=5.2, height=3.7)
    for row, (name, results) in enumerate(groups):
        scenes = [result.scene for result in results]
        left, right = axes[row]
        symbol, other = (r"\Delta L/L", r"\Delta W/L") if name == "compression" else (
            r"\Delta W/L", r"\Delta L/L"
        )  # fmt: skip
        fixed = scenes[0].shear if name == "compression" else scenes[0].compression
        values = [getattr(scene, name) for scene in scenes]
        for k, (value, result) in enumerate(zip(values, results, strict=True)):
            colour = colormaps["viridis"](0.88 * k / max(1, len(values) - 1))
            curve, rod = result.curve, result.rod
            draw_curve(left, curve.angle, curve.height, curve.stable, colour, f"${value:.2f}$", width=1.2)
            picked = np.array([k for k in crowd(rod, 0.03) if rod.stable[k]], dtype=int)
            left.plot(rod.angle[picked], rod.height[picked], "o", ms=3, mfc="none", mec=colour, mew=0.7)
            for fold in result.plain:
                left.plot(fold.angle, fold.height, "k.", ms=6, zorder=5)
        left.plot([], [], "o", ms=3, mfc="none", color="0.3", label=f"DER, {nodes}")
        left.plot([], [], "k.", ms=6, label=r"$\alpha_{c1},\,\alpha_{c2}$")
        left.legend(
            title=f"${symbol}$", fontsize=7, title_fontsize=8, loc="center left", bbox_to_anchor=(1, 0.5)
        )
        left.set(xlim=(-1.05, 0.75), xlabel=r"clamp angle $\alpha$ (rad)", ylabel=r"$z(1/2)/L$")
        left.set_title(f"({'ac'[row]}) ${other} = {fixed:.2f}$")
        for k, (tone, marker) in enumerate((("#1d4e89", "o"), ("#b23a48", "s"))):
            smooth = [result.plain[k].angle for result in results]
            right.plot(values, smooth, "-", color=tone, label=f"$\\alpha_{{c{k + 1}}}$, finite elements")
            rods = [result.fine[k].angle for result in results]
            right.plot(values, rods, marker, ms=5, mfc="none", mec=tone, label=f"$\\alpha_{{c{k + 1}}}$, DER")
        right.set(xlabel=f"${symbol}$", ylabel=r"$\alpha_c$ (rad)", ylim=(0.0, 0.72))
        right.set_title(f"({'bd'[row]}) ${other} = {fixed:.2f}$")
        right.legend(fontsize=7.5, loc="center left" if row == 0 else "center right")
    return fig
