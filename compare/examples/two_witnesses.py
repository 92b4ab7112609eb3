"""Do rods and elements see the same motion?  A ribbon that skips, by two models that share no mechanics.

The rods' snaps move with their mesh, as the square of the edge; what they tend to has to be the elements'.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import matplotlib.pyplot as plt
import numpy as np

import der
from ribbonfem import Scene, kirchhoff


@dataclass(frozen=True)
class Result:
    """Angles (rad) of the snap, z(1/2) = 0.

    Attributes
    ----------
    nodes, rods: of each mesh of rods.
    limit: of the two finest, by an error that falls as the square of the edge.
    elements: of the Kirchhoff elements, which stretch as rods do.
    """

    nodes: tuple[int, ...]
    rods: tuple[float, ...]
    limit: float
    elements: float


def main(
    *,
    compression: float = 0.40,
    shear: float = 0.40,
    rate: float = 1.0,
    damping: float = 10.0,
    nodes: tuple[int, ...] = (51, 76, 101),
    elements: int = 8,
    tolerance: float = 1e-6,
) -> Result:
    """One ramp from U+S+ by rods on several meshes, and by elements."""
    # problem
    scene = Scene(compression=compression, shear=shear, start="U+S+", rate=rate, stop=0.9, damping=damping)

    # discretisation: lengths of the edges, in L
    edges = [1.0 / (count - 2) for count in nodes]

    # solver: steps so fine that only the mesh is seen; a run ends after its snap
    options: dict[str, Any] = {"tolerance": tolerance, "until": "snap"}

    # run
    motions = [der.simulate(scene, nodes=count, **options) for count in nodes]
    motions.append(kirchhoff.simulate(scene, elements=elements, extensible=True, **options))
    *rods, other = (snap[1] if snap else float("nan") for snap in (m.crossing("height") for m in motions))

    ratio = (edges[-2] / edges[-1]) ** 2
    return Result(
        nodes=tuple(nodes),
        rods=tuple(rods),
        limit=(ratio * rods[-1] - rods[-2]) / (ratio - 1.0),
        elements=other,
    )


def look(result: Result) -> Any:
    """The snap over the square of the edge: a straight line into the elements' angle."""
    figure, axes = plt.subplots(figsize=(5.0, 3.4), constrained_layout=True)
    squares = (np.array(result.nodes) - 2.0) ** -2
    axes.plot([*squares, 0.0], [*result.rods, result.limit], "--", color="0.6", lw=1.0)
    axes.plot(squares, result.rods, "o", label="rods")
    axes.plot(0.0, result.limit, "o", mfc="white", color="C0", label="their limit")
    axes.plot(0.0, result.elements, "+", ms=12, color="C1", label="elements")
    for square, angle, count in zip(squares, result.rods, result.nodes, strict=True):
        axes.annotate(f"N = {count}", (square, angle), (0, -14), textcoords="offset points", ha="center")
    axes.margins(0.15)
    axes.set(xlabel="square of the edge ($L^2$)", ylabel="angle of the snap (rad)")
    axes.legend(frameon=False)
    return figure
