"""Stability of the planar elastica out of its plane: bending about the normal, coupled with twist.

At an equilibrium with the frame (t, n, b), b across the plane, curvature kappa, moment m = kappa less the
natural curvature, and force F in the plane, turn the cross-sections by psi = theta t + beta n.  To first
order the twist is theta' - kappa beta and the bending about n is beta' + kappa theta; to second order the
curvature changes by -[theta (beta' + kappa theta) - beta (theta' - kappa beta)] / 2 and the tangent by
-beta b + beta (theta n - beta t) / 2.  With s = 1 + c F.t the second variation of the functional
of `elastica.problem` is

    int 1/2 [ GJ (theta' - kappa beta)^2 + EI1 (beta' + kappa theta)^2
              - m (theta beta' - beta theta' + kappa theta^2 + kappa beta^2)
              + s (F.t beta^2 - F.n theta beta) ] ds

over beta and theta that vanish at the clamps, with int s beta ds = 0: the ends do not move across.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ribbonfem.continuation import Point
from ribbonfem.continuation.out_of_plane import before_stop, leaving, of_start
from ribbonfem.linalg.banded import Arrow
from ribbonfem.results import Array, SolverError
from ribbonfem.scene import Ribbon, Scene

from .kernels.beam import P
from .problem import Statics, _State
from .states import named


class OutOfPlane:
    """The second variation on the elements of the plane's problem, with the same Gauss points."""

    def __init__(self, problem: Statics, ribbon: Ribbon) -> None:
        self.problem = problem
        self.bending, self.twist = ribbon.bending_ratio, ribbon.twist_ratio
        # theta and beta alternate along the beam
        dofs = np.stack((2 * problem.nodes, 2 * problem.nodes + 1), axis=1).reshape(problem.elements, -1)
        self._width = 2 * P + 1
        low, high = dofs[:, :, None], dofs[:, None, :]
        self._lower = low >= high
        self._slot = (high * (self._width + 1) + low - high)[self._lower]
        self._beta = 2 * problem.nodes + 1

    def index(self, state: _State) -> int:
        """Number of unstable directions out of the plane."""
        problem = self.problem
        kappa, _, _, tension, shear = problem.section(state)
        moment = kappa - problem.natural(state)
        stretch = 1.0 + problem.compliance * tension
        value, grad, dx = problem.tables.value, problem.tables.slope[0], problem.tables.weights

        def form(left: Array, right: Array, factor: Array) -> Array:
            return np.asarray(np.einsum("qi,qj,eq->eij", left, right, factor * dx))

        one = np.ones_like(dx)
        theta = self.twist * form(grad, grad, one) + form(
            value, value, self.bending * kappa**2 - moment * kappa
        )
        beta = self.bending * form(grad, grad, one)
        beta += form(value, value, self.twist * kappa**2 - moment * kappa + stretch * tension)
        mixed = form(grad, value, 0.5 * moment - self.twist * kappa)
        mixed += form(value, grad, self.bending * kappa - 0.5 * moment)
        mixed -= form(value, value, 0.5 * stretch * shear)
        tangent = np.block([[theta, mixed], [mixed.swapaxes(1, 2), beta]])
        count = 2 * len(problem.arclength)
        band: Array = np.zeros((count, self._width + 1))
        np.add.at(band.ravel(), self._slot, tangent[self._lower])
        border = np.zeros((1, count))
        np.add.at(border[0], self._beta, (stretch * dx) @ value)
        band = band[2:-2].copy()
        for d in range(1, self._width + 1):
            band[len(band) - d :, d] = 0.0
        # one negative eigenvalue belongs to the force across the plane
        return Arrow(band, border[:, 2:-2].copy()).negative - 1


@lru_cache(maxsize=1024)
def _leaving(scene: Scene, elements: int, extensible: bool) -> float:
    result = lost_at(*named(scene, elements, extensible), scene)
    return float("nan") if result is None else float(result.parameter)


def leaves_plane(scene: Scene, elements: int, extensible: bool) -> float:
    """As `elastica.leaves_plane`; NaN also where the states at rest could not be followed."""
    image = of_start(scene)
    return before_stop(_leaving(image, elements, extensible), scene, image)


def lost_at(problem: Statics, start: _State, scene: Scene) -> Point[_State] | None:
    """Where the states of any drive lose their stability out of the plane; None if they do not."""
    try:
        return leaving(problem, start, scene, OutOfPlane(problem, scene.ribbon).index)
    except SolverError:
        return None
