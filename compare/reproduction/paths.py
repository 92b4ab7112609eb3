"""The paper's two paths and its sweeps: curves of equilibria over the clamp angle (Figs. 4 and 5)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

import der
from compare.quantities.branches import outward
from ribbonfem import Branch, Fold, Scene, kirchhoff
from ribbonfem.continuation import Steps

# beyond one unstable direction the curves only climb to higher modes
RISING: dict[str, Any] = {"unstable": 1, "span": (-1.1, 1.1)}
# steps short enough for a polyline to look like a curve
SMOOTH = Steps(turn=0.1, largest=0.05)


@dataclass(frozen=True)
class Paths:
    """Curves of one scene in both models: elements from U+S+ and from U+S-, rods from U+S+."""

    curve: Branch
    minus: Branch
    rod: Branch
    nodes: int


def _drawn(branch: Branch) -> Branch:
    """A branch without its configurations, which no figure shows."""
    return replace(branch, configurations=branch.configurations[:, :0])


def paths_of(work: tuple[Scene, int, int]) -> Paths:
    """The curves of Paths 1 and 2, of elements and of rods."""
    scene, elements, nodes = work
    return Paths(
        curve=_drawn(kirchhoff.equilibria(scene, elements=elements, steps=SMOOTH, **RISING)),
        minus=_drawn(
            kirchhoff.equilibria(replace(scene, start="U+S-"), elements=elements, steps=SMOOTH, **RISING)
        ),
        rod=_drawn(der.equilibria(scene, nodes=nodes, steps=Steps(turn=0.3, largest=0.1), **RISING)),
        nodes=nodes,
    )


@dataclass(frozen=True)
class Swept:
    """One scene of a sweep in both models: curves, and folds of elements (without and with EA) and rods."""

    scene: Scene
    curve: Branch
    rod: Branch
    plain: tuple[Fold, ...]
    stretched: tuple[Fold, ...]
    coarse: tuple[Fold, ...]
    fine: tuple[Fold, ...]


def swept_scene(work: tuple[Scene, int, tuple[int, int]]) -> Swept:
    """Curves and folds of one scene of a sweep, in both models."""
    scene, elements, nodes = work
    return Swept(
        scene=scene,
        curve=_drawn(kirchhoff.equilibria(scene, elements=elements, steps=SMOOTH, **RISING)),
        # at (0.40, 0.40) the curve of rods of few nodes runs through the isola, out to alpha = -1.3
        rod=_drawn(der.equilibria(scene, nodes=nodes[1], unstable=1)),
        plain=kirchhoff.folds(scene, elements=elements),
        stretched=kirchhoff.folds(scene, elements=elements, extensible=True),
        coarse=der.folds(scene, nodes=nodes[0]),
        fine=der.folds(scene, nodes=nodes[1]),
    )


def crowd(branch: Branch, apart: float) -> NDArray[np.int64]:
    """Rows of a branch at least `apart` from one another, an angle of 1 rad counting as 0.3 L."""
    kept = [0]
    for k in range(1, len(branch)):
        gap = np.hypot(
            0.3 * (branch.angle[k] - branch.angle[kept[-1]]), branch.height[k] - branch.height[kept[-1]]
        )
        if gap >= apart:
            kept.append(k)
    return np.array(kept)


def leg(branch: Branch) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Angle, height and slope of the stable states from alpha = 0 up to their fold."""
    rows = np.arange(len(branch))[outward(branch)]
    going = branch.stable[rows[:-1]] & (np.diff(branch.angle[rows]) > 0.0)
    rows = rows if going.all() else rows[: int(np.argmin(going)) + 1]
    return branch.angle[rows], branch.height[rows], branch.slope[rows]


def last_leg(branch: Branch) -> tuple[NDArray[np.float64], ...]:
    """Angle, height and slope of the states that the second snap leads to: U-S+, of a curve through U+S+.

    U-S+ at alpha is the mirror image of U+S+ at -alpha.
    """
    back = outward(branch, -1.0)
    end = np.flatnonzero(~branch.stable[back])
    count = end[0] if len(end) else None
    return tuple(-values[back][:count] for values in (branch.angle, branch.height, branch.slope))
