"""States of the sheared ribbon at alpha = 0: heights, pitchforks, phases (paper, appendices A and B)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

import der
from ribbonfem import Scene, SceneError, kirchhoff
from ribbonfem.kirchhoff import Pitchforks
from ribbonfem.results import Array

COMPRESSIONS = (0.2, 0.3, 0.4, 0.5)
LINES = (0.02, 0.04, 0.06, 0.08, *(round(0.1 + 0.025 * k, 3) for k in range(22)))
TABULATED = (0.10, 0.20, 0.30, 0.40, 0.50, 0.60)
MAPPED = (0.10, 0.50)
# dW/L from one state of rods to the next
RODS_EVERY = 0.04
FOUR = ("U+S+", "U+S-", "U-S+", "U-S-")
# phases: what is stable, its marker and colour
PHASES = {
    "U": ("o", "#1d4e89"),
    "US": ("s", "#2a9d5c"),
    "S": ("^", "#b23a48"),
    "S, U": ("D", "#7b4bab"),
}
# for maps: the folds are within 1e-8 rad on this mesh
MAP_ELEMENTS = 12


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


def cells(arguments: tuple[float, float, int]) -> list[dict[str, Any]]:
    """The phases of both models at one compression, on a grid of shears short of the longest chord."""
    compression, step, nodes = arguments
    # half a step off: clear of the pitchforks of round compressions
    shears = np.arange(0.5 * step, 0.93 * chord_limit(compression), step)
    records = []
    for shear in map(float, shears):
        scene = Scene(compression=compression, shear=shear, start="U+")
        ours = phase(kirchhoff.stable_states(scene, elements=MAP_ELEMENTS))
        theirs = phase(der.stable_states(scene, nodes=nodes))
        records.append({"compression": compression, "shear": shear, "kirchhoff": ours, "der": theirs})
    return records


@dataclass(frozen=True)
class Heights:
    """States at alpha = 0 of one compression against the shear.

    Attributes
    ----------
    compression: dL/L.
    lines: family, shears, |z(1/2)|/L, stable; of the elements with EA.
    symbols: family, shear and |z(1/2)|/L of stable states of rods.
    """

    compression: float
    lines: tuple[tuple[str, Array, Array, Any], ...]
    symbols: tuple[tuple[str, float, float], ...]

    def distances(self) -> list[float]:
        """How far each rod's height is from the elements' line."""
        lines = {name: (x, y) for name, x, y, _ in self.lines}
        result = []
        for name, shear, height in self.symbols:
            near = lines.get(name)
            if near is not None and near[0].min() < shear < near[0].max():
                order = np.argsort(near[0])
                result.append(abs(height - float(np.interp(shear, near[0][order], near[1][order]))))
        return result


def heights(work: tuple[float, int, int]) -> Heights:
    """States at alpha = 0 of one compression, by elements and by rods."""
    compression, elements, nodes = work
    lines, symbols = [], []
    forks = kirchhoff.pitchforks(compression, elements=elements, extensible=True)
    for curve in kirchhoff.shear_curves(compression, elements=elements, extensible=True):
        x, y = _smooth(curve.shear, np.abs(curve.height))
        stable = np.ones(len(x), dtype=bool)
        if curve.family == "U":
            stable = (x < (forks.broken or 1.0)) | (x > (forks.restored or 1.0))
        lines.append((curve.family, x, y, stable))
    for shear in np.arange(0.02, 0.95 * chord_limit(compression), RODS_EVERY):
        for name in ("U+", "U+S+", "S+"):
            try:
                rest = der.state(Scene(compression=compression, shear=float(shear), start=name), nodes=nodes)
            except SceneError:
                continue
            symbols.append((family(name), float(shear), abs(rest.height)))
    return Heights(compression, tuple(lines), tuple(symbols))


def forks_of(work: tuple[float, int]) -> Pitchforks:
    """Pitchforks of (dL/L, elements)."""
    return kirchhoff.pitchforks(work[0], elements=work[1])
