"""Where does a sheared ribbon snap?  Rods refined to their limit, against finite elements.

U+S+ meets two folds as the clamp turns.  Rods and elements share no mechanics; the rods' error falls as
the square of the edge, so that two meshes give a limit, and that has to be the elements' angle.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import matplotlib.pyplot as plt

import compare
import der
from ribbonfem import Branch, Scene, kirchhoff


@dataclass(frozen=True)
class Result:
    """Folds of one scene by two models.

    Attributes
    ----------
    nodes: of the two rods.
    rods: angles (rad) of the folds on each mesh.
    limit: what the rods' angles tend to.
    elements: the angles of the Kirchhoff elements, which stretch as the rods do.
    curve: the elements' curve of equilibria.
    """

    nodes: tuple[int, int]
    rods: tuple[tuple[float, ...], ...]
    limit: tuple[float, ...]
    elements: tuple[float, ...]
    curve: Branch


def main(
    *, compression: float = 0.40, shear: float = 0.40, nodes: tuple[int, int] = (51, 100), elements: int = 12
) -> Result:
    """The folds that a very slow ramp from U+S+ meets."""
    # problem
    scene = Scene(compression=compression, shear=shear, start="U+S+")

    # discretisation: an edge is L / (N - 2) long with the centred clamp
    ratio = ((nodes[1] - 2) / (nodes[0] - 2)) ** 2

    # solver: continuation along alpha, each fold solved for as a root
    # run
    coarse, fine = (tuple(fold.angle for fold in der.folds(scene, nodes=count)) for count in nodes)
    result = kirchhoff.folds(scene, elements=elements, extensible=True)
    curve = kirchhoff.equilibria(scene, elements=elements, extensible=True, span=(-1.0, 0.8))

    return Result(
        nodes=nodes,
        rods=(coarse, fine),
        limit=tuple((ratio * f - c) / (ratio - 1.0) for c, f in zip(coarse, fine, strict=True)),
        elements=tuple(fold.angle for fold in result),
        curve=curve,
    )


def look(result: Result) -> Any:
    """z(1/2) of the states at rest against alpha, and the folds of both models."""
    figure, axes = plt.subplots(figsize=(5.4, 3.6), constrained_layout=True)
    # importing `compare` gives a curve its `plot`
    assert compare
    result.curve.plot(axes, label="elements")
    low, high = axes.get_ylim()
    for k, angle in enumerate(result.limit):
        axes.axvline(angle, color="0.6", lw=0.9, ls=":", label="rods, limit" if k == 0 else None)
        axes.text(angle, high, rf"$\alpha_{{c{k + 1}}}$", ha="center", va="bottom")
    axes.set_ylim(low, high)
    axes.legend(frameon=False, loc=(0.03, 0.3))
    return figure
