"""Where do the folds of a sheared ribbon end?  One curve over the shear, through its cusps.

As the shear falls U+S+ meets its first fold ever sooner, and at alpha = 0 it is gone: there the four US leave
U in a pitchfork, which alpha unfolds into a cusp.  Where they merge into S is another one, from which the
curve leads to the fold of the planar beam.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import matplotlib.pyplot as plt

from ribbonfem import FoldCurve, Scene, elastica, kirchhoff


@dataclass(frozen=True)
class Result:
    """The first fold of U+S+ over the shear.

    Attributes
    ----------
    curve: its curve; the mirror image has the other sign of alpha.
    broken, merged: dW/L of the pitchforks at alpha = 0.
    planar: alpha (rad) of the fold without shear, by a planar beam.
    """

    curve: FoldCurve
    broken: float | None
    merged: float | None
    planar: float


def main(
    *,
    compression: float = 0.40,
    shear: float = 0.40,
    span: tuple[float, float] = (0.0, 0.50),
    elements: int = 12,
) -> Result:
    """Follow the first fold that a very slow ramp from U+S+ meets, to both ends of a span of shears."""
    # problem: the fold of one scene is where the curve begins
    scene = Scene(compression=compression, shear=shear, start="U+S+")

    # discretisation: of both models
    mesh: dict[str, Any] = {"elements": elements}

    # solver: continuation of the fold in alpha and the shear; and, by symmetry, pitchforks at alpha = 0
    # run
    curve = kirchhoff.fold_curve(scene, over="shear", span=span, **mesh)
    forks = kirchhoff.pitchforks(compression, **mesh)
    planar = elastica.folds(Scene(compression=compression, shear=0.0, start="U+"), **mesh)[0].angle

    return Result(curve, forks.broken, forks.merged, planar)


def look(result: Result) -> Any:
    """alpha of the fold over dW/L, its mirror image in grey, and the shears of the pitchforks."""
    figure, axes = plt.subplots(figsize=(5.4, 3.6), constrained_layout=True)
    axes.plot(result.curve.parameter, -result.curve.control, color="0.8", lw=1.0)
    result.curve.plot(axes, label="first fold of U+S+; dots: cusps")
    for shear, what in ((result.broken, "U breaks"), (result.merged, "US merge")):
        if shear is not None:
            axes.axvline(shear, color="0.6", lw=0.9, ls=":")
            axes.text(shear, 1.0, what, ha="center", va="bottom", transform=axes.get_xaxis_transform())
    axes.plot([0.0], [-result.planar], "s", color="C1", ms=4, label="planar beam")
    axes.legend(frameon=False, loc=(0.03, 0.42))
    return figure
