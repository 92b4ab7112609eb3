"""Which mesh is fine enough?  A quantity refined, with its order, its limit, and what the chooser would do.

The order that is observed has to be the one that a model declares; only then is a limit known, and only a
limit says what a single run is off by.  Each model is taken against its own limit: that says how fine its
mesh is, and nothing of whether its mechanics are those of the ribbon.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import matplotlib.pyplot as plt

import compare
import der
from compare.quantities.convergence import Convergence
from ribbonfem import Scene, quasilinear


@dataclass(frozen=True)
class Result:
    """The snap of a planar ramp.

    Attributes
    ----------
    refined: of each model, under refinement of its mesh.
    chosen: angle (rad) of the model that the chooser takes; error: what it says that may be off by;
        reason: in words.
    """

    refined: tuple[Convergence, ...]
    chosen: float
    error: float
    reason: str


def main(
    *,
    compression: float = 0.40,
    rate: float = 0.1,
    damping: float = 1.0,
    elements: tuple[int, ...] = (8, 16, 32),
    nodes: tuple[int, ...] = (26, 51, 101),
    tolerance: float = 1e-7,
) -> Result:
    """The beam of small slopes and rods, each refined in its mesh."""
    # problem
    scene = Scene(compression=compression, shear=0.0, start="U+", rate=rate, stop=1.4, damping=damping)

    # discretisation: of each model, coarse to fine
    meshes: dict[Any, Any] = {quasilinear: {"elements": elements}, der: {"nodes": nodes}}

    # solver: steps so fine that only the mesh is seen
    options: dict[str, Any] = {"tolerance": tolerance}

    # run
    refined = tuple(
        compare.convergence(model, scene, "snap", over=over, **options) for model, over in meshes.items()
    )
    choice = compare.choose(scene, tolerance=1e-3)
    answer = choice.run()

    return Result(refined, answer.value, answer.error, choice.reason)


def look(result: Result) -> Any:
    """Errors over the size of the mesh, with the orders that the models declare."""
    figure, axes = plt.subplots(figsize=(5.0, 3.6), constrained_layout=True)
    for k, convergence in enumerate(result.refined):
        # importing `compare` gives it its `plot`
        convergence.plot(axes, color=f"C{k}")
    axes.set(xlabel="length of an edge or an element ($L$)", ylabel="error of the snap (rad)")
    axes.legend(frameon=False)
    return figure
