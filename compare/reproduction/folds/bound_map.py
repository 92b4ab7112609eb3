"""The static bound on type 1 skipping as a map over compression and shear."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline, RectBivariateSpline, make_interp_spline
from scipy.optimize import brentq

from ribbonfem import Scene, SolverError, kirchhoff
from ribbonfem.output.style import figure
from ribbonfem.results import Array


def bound_column(arguments: tuple[float, int, int]) -> dict[str, Any]:
    """The static bound at one compression, for shears from the first pitchfork to where U+S- is gone.

    Returns
    -------
    compression, the pitchforks `broken` and `merged`, the shear `gone` beyond which U+S- folds
    before U+S+ does (None if it never does), `shears`, and `bounds` (EI2/L) at these.
    """
    compression, count, elements = arguments
    forks = kirchhoff.pitchforks(compression, elements=elements)
    if forks.broken is None or forks.merged is None:
        raise SolverError(f"compression = {compression:g}: the ribbon has no states US")
    low, width = forks.broken, forks.merged - forks.broken

    def window(share: float) -> float:
        """alpha_c2 - alpha_c1 of a scene between the pitchforks."""
        scene = Scene(compression=compression, shear=low + share * width)
        result = kirchhoff.folds(scene, elements=elements)
        if len(result) > 1:
            return result[1].angle - result[0].angle
        minus = Scene(compression=compression, shear=scene.shear, start="U+S-")
        return kirchhoff.folds(minus, elements=elements)[0].angle - result[0].angle

    gone = float(brentq(window, 0.4, 0.85, xtol=5e-4))
    # clear of the states that fork there and of the fold that U+S- has there
    shares = 0.01 + (gone - 2e-3 - 0.01) * np.linspace(0.0, 1.0, count)
    shears = [low + float(share) * width for share in shares]
    return {
        "compression": compression,
        "broken": forks.broken,
        "merged": forks.merged,
        "gone": low + gone * width,
        "shears": shears,
        "bounds": [
            kirchhoff.skipping_bound(Scene(compression=compression, shear=shear), elements=elements)
            for shear in shears
        ],
    }


def zero_of(column: dict[str, Any]) -> float | None:
    """The shear at which the bound of a column changes its sign; None if it does not."""
    bounds = np.array(column["bounds"])
    if not bounds[0] < 0.0 < bounds[-1]:
        return None
    spline = CubicSpline(column["shears"], bounds)
    return float(
        brentq(lambda shear: float(spline(shear)), column["shears"][0], column["shears"][-1], xtol=1e-9)
    )


def draw_bound(result: Sequence[dict[str, Any]]) -> Any:
    """The bound over the compressions and shears of US; the map is smooth between its columns."""
    from matplotlib.colors import TwoSlopeNorm

    fig, ax = figure(1, width=6.8, height=4.8)
    compressions = np.array([column["compression"] for column in result])
    shares = np.arange(len(result[0]["shears"]))
    many = np.linspace(compressions[0], compressions[-1], 121)
    kx, ky = min(3, len(compressions) - 1), min(3, len(shares) - 1)

    def between(name: str) -> Array:
        values = np.array([column[name] for column in result])
        spline = RectBivariateSpline(compressions, shares, values, kx=kx, ky=ky)
        return np.asarray(spline(many, np.linspace(0.0, shares[-1], 81)))

    def line(values: list[float]) -> Array:
        return np.asarray(make_interp_spline(compressions, values, k=kx)(many))

    y, z = between("shears"), between("bounds")
    x = np.broadcast_to(many[:, None], y.shape)
    levels = np.arange(np.floor(2.0 * z.min()) / 2.0, np.ceil(2.0 * z.max()) / 2.0 + 0.25, 0.5)
    norm = TwoSlopeNorm(0.0, min(levels[0], -0.5), max(levels[-1], 0.5))
    filled = ax.contourf(x, y, z, levels, cmap="RdBu_r", norm=norm)
    whole = [v for v in levels if v % 1.0 == 0.0 and v != 0.0]
    ax.contour(x, y, z, whole, colors="0.25", linewidths=0.4)
    zeros = [zero_of(column) for column in result]
    if all(zero is not None for zero in zeros):
        ax.plot(
            many, line([zero or 0.0 for zero in zeros]), "k-", lw=2.0, label="equal: type 1 possible above"
        )
    boundaries = {name: line([column[name] for column in result]) for name in ("gone", "broken", "merged")}
    ax.plot(many, boundaries["gone"], "k--", lw=1.2, label=r"$\alpha_{c1} = \alpha_{c2}$")
    ax.plot(many, boundaries["broken"], color="0.4", lw=1.2, label="U → US")
    ax.plot(many, boundaries["merged"], color="0.4", lw=1.2, ls="-.", label="US → S")
    ax.fill_between(
        many,
        boundaries["gone"],
        boundaries["merged"],
        facecolor="0.93",
        edgecolor="0.78",
        hatch="///",
        lw=0.0,
    )
    style: dict[str, Any] = {"ls": "", "mfc": "white", "mec": "black", "mew": 0.8}
    ax.plot(
        np.linspace(0.35, 0.40, 6), [0.40] * 6, "o", ms=4, label="diagrams of skipping (Fig. 11)", **style
    )
    ax.plot(0.40, 0.37, "s", ms=5, label="Paths 1 and 2 (Fig. 4)", **style)
    box = {"facecolor": "white", "edgecolor": "none", "pad": 1.0, "alpha": 0.85}
    ax.annotate("no $U_+S_-$ left at $\\alpha_{c1}$", (0.41, 0.465), (0.41, 0.537), fontsize=8, ha="center",
                bbox=box, arrowprops={"arrowstyle": "-", "lw": 0.7, "color": "0.3"})  # fmt: skip
    bar = fig.colorbar(filled, ax=ax, shrink=0.9, ticks=np.unique(np.round(levels)))
    bar.set_label(r"$E(\alpha_{c1}) - E(\mathrm{saddle})$,  $EI_2/L$")
    ax.set(xlabel=r"$\Delta L/L$", ylabel=r"$\Delta W/L$", xlim=(many[0], many[-1]))
    ax.legend(fontsize=7, loc="upper left")
    return fig
