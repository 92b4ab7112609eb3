"""Curves of equilibria of the planar beam by elements, rods and closed form (paper, Fig. 3)."""

from __future__ import annotations

import numpy as np

import der
from compare.sweep import Progress
from ribbonfem import Scene, elastica, quasilinear
from ribbonfem.continuation import Steps
from ribbonfem.output.curve import Curve

DRAWN = (0.20, 0.25, 0.30, 0.35, 0.40)
# steps short enough for a polyline to look like a curve
SMOOTH = Steps(turn=0.1, largest=0.015)


def planar_curves(
    nodes: int, progress: Progress | None = None
) -> tuple[dict[float, Curve], dict[float, Curve], Curve]:
    """The curves of the paper's Fig. 3: the elastica's and the rods' by dL/L, and the closed form's."""
    beams, dots = {}, {}
    for compression in (progress or Progress())("bifurcation diagram", DRAWN):
        scene = Scene(compression=compression, shear=0.0, start="U+")
        # two unstable directions more would only add the curves of higher buckling modes
        beams[compression] = Curve.of(
            elastica.equilibria(scene, elements=32, span=(-1.6, 1.6), unstable=1, steps=SMOOTH)
        )
        dots[compression] = Curve.of(
            der.equilibria(scene, nodes=nodes, span=(-1.6, 1.6), unstable=1, steps=Steps(turn=0.6))
        )
    closed = quasilinear.closed_form_branch((-2.6, 2.6))
    # up to the odd mode: beyond it lie the higher modes
    keep = np.maximum.accumulate(closed.load) < 81.0
    fold = quasilinear.closed_form_fold()
    exact = Curve(closed.mu[keep], closed.height[keep], closed.stable[keep], ((fold.mu, fold.height),))
    return beams, dots, exact
