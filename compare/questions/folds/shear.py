"""States of the sheared ribbon at alpha = 0, and the static bound on type 1 skipping, as figures."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.colors import TwoSlopeNorm
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline, RectBivariateSpline, make_interp_spline
from scipy.optimize import brentq

from compare.face.report import Picture, Table
from compare.face.style import draw_curve, figure, plt, save
from compare.sweep.progress import Progress
from der.rod import Rod, RodState
from der.states import stable_states
from ribbonfem import Scene, SolverError, kirchhoff

Array = NDArray[np.float64]

COMPRESSIONS = (0.2, 0.3, 0.4, 0.5)
LINES = (0.02, 0.04, 0.06, 0.08, *(round(0.1 + 0.025 * k, 3) for k in range(22)))
TABULATED = (0.10, 0.20, 0.30, 0.40, 0.50, 0.60)
MAPPED = (0.10, 0.50)
FOUR = ("U+S+", "U+S-", "U-S+", "U-S-")
# phases: what is stable, its marker and colour
PHASES = {
    "U": ("o", "#1d4e89"),
    "US": ("s", "#2a9d5c"),
    "S": ("^", "#b23a48"),
    "S, U": ("D", "#7b4bab"),
}
# for maps: the folds are within 1e-8 rad on this mesh
_MAP_ELEMENTS = 12


class Part(NamedTuple):
    """What this module adds to the section of `ribbonfem folds`."""

    text: list[str]
    tables: list[Table]
    pictures: list[Picture]
    values: dict[str, Any]


def family(name: str) -> str:
    """U, US or S of a state's name."""
    return name.replace("+", "").replace("-", "")


def phase(names: Any) -> str:
    """The phase of a list of stable states: their families, "US" or "S, U", say."""
    return ", ".join(sorted({family(name) for name in names}))


def chord_limit(compression: float) -> float:
    """The shear dW/L at which the ends are as far apart as the ribbon is long."""
    return float(np.sqrt(compression * (2.0 - compression)))


def _smooth(x: Array, y: Array) -> tuple[Array, Array]:
    """More points of a curve through points of continuation: a spline in the length of its chords."""
    length = np.concatenate(([0.0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))))
    fine = np.unique(np.concatenate((length, np.linspace(0.0, length[-1], 30 * len(x)))))
    spline = CubicSpline(length, np.column_stack((x, y)))(fine)
    return spline[:, 0], spline[:, 1]


def rod_profiles(rod: Rod, state: RodState) -> tuple[Array, Array, Array, Array]:
    """s/L, kappa1, kappa2 and tau (1/L) of a rod at its inner nodes.

    kappa1 and kappa2: the curvature binormal along the means of m1 and m2 of the two edges.
    tau: the angle of the frame against the one carried over by parallel transport.
    """
    edge = np.diff(state.x, axis=0)
    tangent = edge / np.linalg.norm(edge, axis=1)[:, None]
    before, after = tangent[:-1], tangent[1:]
    cosine = np.sum(before * after, axis=1)[:, None]
    axis = np.cross(before, after)
    binormal = 2.0 * axis / (1.0 + cosine) / rod.rest
    m1 = state.m1
    m2 = np.cross(tangent, m1)
    kappa1 = 0.5 * np.sum(binormal * (m1[:-1] + m1[1:]), axis=1)
    kappa2 = 0.5 * np.sum(binormal * (m2[:-1] + m2[1:]), axis=1)
    along = np.sum(axis * m1[:-1], axis=1)[:, None]
    carried = m1[:-1] * cosine + np.cross(axis, m1[:-1]) + axis * along / (1.0 + cosine)
    sine = np.sum(np.cross(carried, m1[1:]) * after, axis=1)
    tau = np.arctan2(sine, np.sum(carried * m1[1:], axis=1)) / rod.rest
    s: Array = np.asarray(rod.arclength[1:-1])
    return s, np.asarray(kappa1), np.asarray(kappa2), np.asarray(tau)


def cells(arguments: tuple[float, float, int]) -> list[dict[str, Any]]:
    """The phases of both models at one compression, on a grid of shears short of the longest chord."""
    compression, step, nodes = arguments
    # half a step off: clear of the pitchforks of round compressions
    shears = np.arange(0.5 * step, 0.93 * chord_limit(compression), step)
    records = []
    for shear in map(float, shears):
        scene = Scene(compression=compression, shear=shear, start="U+")
        ours = phase(kirchhoff.stable_states(scene, elements=_MAP_ELEMENTS))
        theirs = phase(stable_states(Rod(scene, nodes)))
        records.append({"compression": compression, "shear": shear, "kirchhoff": ours, "der": theirs})
    return records


def _heights(ax: Any, progress: Progress, elements: int, nodes: int) -> list[float]:
    """z(1/2) against the shear; returns the distances of the rods' states from the elements' lines."""
    distances: list[float] = []
    for k, compression in enumerate(progress("states against the shear", COMPRESSIONS)):
        colour = plt.cm.viridis(0.85 * k / max(1, len(COMPRESSIONS) - 1))
        lines: dict[str, tuple[Array, Array]] = {}
        # with EA, as the rods have it: near the longest chord the ribbon is taut and stretches
        forks = kirchhoff.pitchforks(compression, elements=elements, extensible=True)
        for curve in kirchhoff.shear_curves(compression, elements=elements, extensible=True):
            x, y = _smooth(curve.shear, np.abs(curve.height))
            stable = np.ones(len(x), dtype=bool)
            if curve.family == "U":
                stable = (x < (forks.broken or 1.0)) | (x > (forks.restored or 1.0))
            lines[curve.family] = (x, y)
            draw_curve(ax, x, y, stable, colour, f"{compression:.1f}" if curve.family == "U" else "", 1.3)
        for shear in np.arange(0.02, 0.95 * chord_limit(compression), 0.04):
            rod = Rod(Scene(compression=compression, shear=float(shear), start="U+"), nodes)
            for name, state in stable_states(rod).items():
                if name not in ("U+", "U+S+", "S+"):
                    continue
                height = abs(float(rod.middle(state.x)[0][2]))
                marker, _ = PHASES[family(name)]
                ax.plot(shear, height, marker, ms=4, mfc="none", mec=colour, mew=0.8)
                near = lines.get(family(name))
                if near is not None and near[0].min() < shear < near[0].max():
                    order = np.argsort(near[0])
                    distances.append(abs(height - float(np.interp(shear, near[0][order], near[1][order]))))
    handles, labels = ax.get_legend_handles_labels()
    for kind in ("U", "US", "S"):
        ax.plot([], [], PHASES[kind][0], ms=4, mfc="none", mec="0.3", mew=0.8, label=f"DER, {kind}")
    first = ax.legend(handles, labels, title=r"$\Delta L/L$", fontsize=7.5, loc="lower left")
    first.set_bbox_to_anchor((0.0, 0.05))
    ax.add_artist(first)
    ax.legend(*[part[-3:] for part in ax.get_legend_handles_labels()], fontsize=7.5, loc="upper right")
    ax.set(xlabel=r"$\Delta W/L$", ylabel=r"$|z(1/2)|/L$", xlim=(0.0, 0.86), ylim=(-0.012, 0.40))
    ax.set_title("(a) states at $\\alpha = 0$")
    return distances


def _phases(ax: Any, progress: Progress, records: list[dict[str, Any]]) -> None:
    """The phase diagram, its lines by elements and its symbols by rods."""
    forks = [
        kirchhoff.pitchforks(compression, elements=_MAP_ELEMENTS)
        for compression in progress("pitchforks", LINES)
    ]
    x = np.array([0.0, *LINES])
    broken, merged, restored = (
        np.array([0.0, *(getattr(fork, name) or np.nan for fork in forks)])
        for name in ("broken", "merged", "restored")
    )
    # the lines leave the origin as roots: splines in the square root of the compression
    root = np.linspace(0.0, np.sqrt(x[-1]), 300)
    fine = root**2
    lines = [CubicSpline(np.sqrt(x), line)(root) for line in (broken, merged, restored)]
    edge = np.sqrt(fine * (2.0 - fine))
    bands = (("U", 0.0 * fine, lines[0]), ("US", lines[0], lines[1]), ("S", lines[1], lines[2]))
    for name, low, high in (*bands, ("S, U", lines[2], edge)):
        ax.fill_between(fine, low, high, color=PHASES[name][1], alpha=0.13, lw=0)
    for line, style, label in zip(lines, ("-", "--", "-."), ("U → US", "US → S", "U regained"), strict=True):
        ax.plot(fine, line, style, color="black", lw=1.3, label=label)
    ax.plot(fine, edge, color="0.55", lw=0.9, label="ends as far apart as L")
    for name, (marker, colour) in PHASES.items():
        chosen = [record for record in records if record["der"] == name]
        ax.plot(
            [record["compression"] for record in chosen],
            [record["shear"] for record in chosen],
            marker, ms=4, mfc="white", mec=colour, mew=1.0, label=f"DER: {name.replace(', ', ' and ')}",
        )  # fmt: skip
    ax.set(xlabel=r"$\Delta L/L$", ylabel=r"$\Delta W/L$", xlim=(0.0, 0.625), ylim=(0.0, 0.93))
    ax.legend(fontsize=7, loc="center left", bbox_to_anchor=(1.0, 0.5))
    ax.set_title("(b) stable states")


def _profiles(path: Path, elements: int, nodes: int) -> tuple[str, float]:
    """Curvatures and twist of the four states; also the rods' largest distance in twist, 1/L."""
    fig, axes = figure(2, 2, width=4.8, height=3.1)
    scene = Scene(compression=0.40, shear=0.37)
    rod = Rod(scene, nodes)
    rods = stable_states(rod)
    worst = 0.0
    names = ("kappa1", "kappa2", "tau")
    styles = (
        ("#2a9d5c", "^", r"$20\,\kappa_1 L$"),
        ("#1d4e89", "o", r"$\kappa_2 L$"),
        ("#b23a48", "s", r"$\tau L$"),
    )
    for ax, name, letter in zip(axes.ravel(), FOUR, "abcd", strict=True):
        state = kirchhoff.state(Scene(compression=0.40, shear=0.37, start=name), elements=elements)
        order = np.argsort(state.points)
        s, *values = rod_profiles(rod, rods[name])
        for quantity, rod_values, (colour, marker, label) in zip(names, values, styles, strict=True):
            scale = 20.0 if quantity == "kappa1" else 1.0
            line = getattr(state, quantity)[order]
            ax.plot(state.points[order], scale * line, color=colour, label=label)
            ax.plot(s[::2], scale * rod_values[::2], marker, ms=3, mfc="none", mec=colour, mew=0.7)
            if quantity == "tau":
                worst = max(worst, float(np.abs(np.interp(s, state.points[order], line) - rod_values).max()))
        ax.axhline(0.0, color="0.85", lw=0.6, zorder=0)
        ax.set(xlabel="$s/L$", xlim=(0.0, 1.0), title=f"({letter}) ${name[:1]}_{name[1]}{name[2]}_{name[3]}$")
    axes[0][0].plot([], [], "o", ms=3, mfc="none", mec="0.3", label=f"DER, {nodes}")
    axes[0][0].legend(fontsize=7.5, loc="best", ncols=2)
    for ax in axes[:, 0]:
        ax.set_ylabel("curvatures and twist, $1/L$")
    return save(fig, path), worst


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
        found = kirchhoff.folds(scene, elements=elements)
        if len(found) > 1:
            return found[1].angle - found[0].angle
        minus = Scene(compression=compression, shear=scene.shear, start="U+S-")
        return kirchhoff.folds(minus, elements=elements)[0].angle - found[0].angle

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


def _bound_map(path: Path, found: list[dict[str, Any]]) -> str:
    """The bound over the compressions and shears of US; the map is smooth between its columns."""
    fig, ax = figure(1, width=6.8, height=4.8)
    compressions = np.array([column["compression"] for column in found])
    shares = np.arange(len(found[0]["shears"]))
    many = np.linspace(compressions[0], compressions[-1], 121)
    kx, ky = min(3, len(compressions) - 1), min(3, len(shares) - 1)

    def between(name: str) -> Array:
        values = np.array([column[name] for column in found])
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
    zeros = [zero_of(column) for column in found]
    if all(zero is not None for zero in zeros):
        ax.plot(
            many, line([zero or 0.0 for zero in zeros]), "k-", lw=2.0, label="equal: type 1 possible above"
        )
    edges = {name: line([column[name] for column in found]) for name in ("gone", "broken", "merged")}
    ax.plot(many, edges["gone"], "k--", lw=1.2, label=r"$\alpha_{c1} = \alpha_{c2}$")
    ax.plot(many, edges["broken"], color="0.4", lw=1.2, label="U → US")
    ax.plot(many, edges["merged"], color="0.4", lw=1.2, ls="-.", label="US → S")
    ax.fill_between(
        many, edges["gone"], edges["merged"], facecolor="0.93", edgecolor="0.78", hatch="///", lw=0.0
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
    return save(fig, path)


def tasks(step: float, columns: int, rows: int, nodes: int) -> list[tuple[Callable[[Any], Any], Any]]:
    """The long computations behind the figures, as functions and their arguments, for a pool.

    Parameters
    ----------
    step: of the rods' grid in the phase diagram, in L.
    columns, rows: points of the bound's map, compressions and shears.
    nodes: of the rods.
    """
    work: list[tuple[Callable[[Any], Any], Any]] = [
        (bound_column, (float(value), rows, _MAP_ELEMENTS)) for value in np.linspace(*MAPPED, columns)
    ]
    count = round(0.6 / step)
    return work + [(cells, (round(step * k, 9), step, nodes)) for k in range(count, 0, -1)]


def draw(
    progress: Progress,
    out: Path,
    *,
    found: list[dict[str, Any]],
    records: list[dict[str, Any]],
    elements: int,
    nodes: int,
) -> Part:
    """Draw the states against the shear, their phases and curvatures, and the map of the bound.

    Parameters
    ----------
    found: results of `bound_column`.
    records: results of `cells`, one after the other.
    elements, nodes: of the finite elements and of the rods in the figures.
    """
    fig, (left, right) = figure(2, width=5.6, height=4.2)
    distances = _heights(left, progress, elements, nodes)
    worst, middle = max(distances), float(np.median(distances))
    _phases(right, progress, records)
    states = save(fig, out / "folds-states.png")
    profiles, twist = _profiles(out / "folds-curvatures.png", elements, nodes)
    bound = _bound_map(out / "folds-bound.png", found)
    forks = {value: kirchhoff.pitchforks(value) for value in TABULATED}
    agreeing = sum(record["kirchhoff"] == record["der"] for record in records)
    return Part(
        text=[
            f"Phases agree in {agreeing} of {len(records)} scenes of the grid between the elements and "
            f"rods of {nodes} nodes. Heights of states at alpha = 0, both with EA, differ by {middle:.0e} L "
            f"in the median and by up to {worst:.0e} L, near z = 0 where a height rises as a root.",
        ],
        tables=[
            Table(
                "Pitchforks at alpha = 0: shears dW/L",
                ["dL/L", "U → US", "US → S", "U regained", "longest chord"],
                [
                    [f"{value:.2f}", fork.broken, fork.merged, fork.restored, chord_limit(value)]
                    for value, fork in forks.items()
                ],
                ["s", ".9f", ".9f", ".9f", ".6f"],
                "U regained: beyond it the unbroken U is stable again, beside S. Inextensible, 32 elements.",
            )
        ],
        pictures=[
            Picture(
                states,
                "States at alpha = 0 (paper, appendix B). (a) Height at midspan against the shear: lines by "
                "finite elements with EA, stable solid, unstable dashed; symbols: stable states of rods. "
                "(b) Stable states: lines by finite elements, symbols by rods. In the uppermost region the "
                "unbroken U is stable again beside S.",
            ),
            Picture(
                profiles,
                "Curvatures and twist of the four states at (0.40, 0.37) L (paper, appendix A). Lines: "
                f"finite elements; symbols: rods, within {twist:.2g}/L in twist. kappa1, in the ribbon's "
                "plane, is drawn twenty times larger.",
            ),
            Picture(
                bound,
                "Energy of U+S+ at its first fold over that of the saddle between U+S- and U- at the same "
                "angle. Blue: below the saddle, so that no type 1 skipping follows a slow ramp. Hatched: "
                "U+S- has folded before U+S+ does.",
            ),
        ],
        values={
            "phases": records,
            "heights_within": {"median": middle, "largest": worst},
            "twist_within": twist,
            "pitchforks": [
                {"compression": value, "broken": f.broken, "merged": f.merged, "restored": f.restored}
                for value, f in forks.items()
            ],
            "bound_map": [{**column, "zero": zero_of(column)} for column in found],
        },
    )
