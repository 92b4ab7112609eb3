"""What every model returns: folds, branches of equilibria, histories of motion.

All are frozen and hold one row a point or instant.  Lengths are in L, angles in rad, times in
s, energies in EI2/L, forces in EI2/L^2.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .scene import Scene

Array = NDArray[np.float64]


class SolverError(RuntimeError):
    """A solve that did not converge.  Says what was tried and what to change.

    `history` holds what a time stepper had reached, or None.
    """

    def __init__(self, message: str, history: History | None = None) -> None:
        super().__init__(message)
        self.history = history


@dataclass(frozen=True)
class Fold:
    """A saddle-node bifurcation in the angle.

    Attributes
    ----------
    angle: alpha at the fold, rad.
    height: z(1/2)/L there.
    load: compressive end force times L^2/EI2 (sigma^2 of the quasi-linear beam).
    """

    angle: float
    height: float
    load: float


@dataclass(frozen=True, repr=False)
class Branch:
    """A connected curve of equilibria, one row a point, in the order of the curve.

    Attributes
    ----------
    angle: (rows,) rad.
    height: (rows,) z(1/2)/L.
    slope: (rows,) z-component of the unit tangent at midspan.
    load: (rows,) compressive end force times L^2/EI2.
    stable: (rows,) bool; a fold itself is never a row.
    folds: the folds met along the curve, in its order.
    configurations: (rows, nodes, 3) positions in L.
    scene, policy: what it was made from.
    """

    angle: Array
    height: Array
    slope: Array
    load: Array
    stable: NDArray[np.bool_]
    folds: tuple[Fold, ...]
    configurations: Array
    scene: Scene
    policy: Mapping[str, Any] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.angle)

    def __repr__(self) -> str:
        return (
            f"Branch({len(self)} points, alpha {self.angle.min():.4g} .. {self.angle.max():.4g} rad, "
            f"{len(self.folds)} folds, policy={dict(self.policy)})"
        )


@dataclass(frozen=True, repr=False)
class History:
    """A motion, one row an accepted step.

    Attributes
    ----------
    time: (rows,) s.
    angle: (rows,) of the left clamp, rad.
    height: (rows,) z(1/2)/L.
    slope: (rows,) z-component of the unit tangent at midspan.
    energies: "kinetic", "elastic", "dissipated" and "work" (of the clamp), each (rows,), in
        EI2/L; kinetic + elastic + dissipated - work is constant in an exact solution.
    configurations: "positions" (rows, nodes, 3) in L, and what else the model has.
    stats: steps, newton_iterations, rejected, seconds (of the solve alone).
    scene, policy: what it was made from.
    """

    time: Array
    angle: Array
    height: Array
    slope: Array
    energies: Mapping[str, Array]
    configurations: Mapping[str, Array]
    stats: Mapping[str, float]
    scene: Scene
    policy: Mapping[str, Any] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.time)

    def __repr__(self) -> str:
        return (
            f"History({len(self)} rows, {self.time[-1]:.4g} s, alpha {self.angle[0]:.4g} .. "
            f"{self.angle[-1]:.4g} rad, policy={dict(self.policy)})"
        )

    def crossing(self, quantity: str = "height", level: float = 0.0) -> tuple[float, float] | None:
        """Time and angle at which "height" or "slope" first crosses `level`.

        Solved for on the cubic through the four rows around the crossing, so that its error is
        of the integration and not of the grid of rows.

        Returns
        -------
        (time, angle) in s and rad, or None if there is no crossing.

        Raises
        ------
        ValueError
            If `quantity` is not "height" or "slope".
        """
        if quantity not in ("height", "slope"):
            raise ValueError(f"quantity = {quantity!r}: must be 'height' or 'slope'")
        values = np.asarray(getattr(self, quantity)) - level
        change = np.flatnonzero(values[:-1] * values[1:] < 0.0)
        exact = np.flatnonzero(values == 0.0)
        if exact.size and not (change.size and change[0] < exact[0]):
            return float(self.time[exact[0]]), float(self.angle[exact[0]])
        if not change.size:
            return None
        k = int(change[0])
        rows = np.arange(max(k - 1, 0), min(k + 3, len(values)))
        time = _cubic_root(self.time[rows], values[rows], float(self.time[k]), float(self.time[k + 1]))
        return time, float(np.interp(time, self.time, self.angle))


@dataclass(frozen=True, repr=False)
class RestState:
    """One equilibrium of the ribbon.

    Attributes
    ----------
    name: of the state as its signs say, "U+S+" and so on.
    angle: alpha, rad.
    height, slope: z(1/2)/L and the z-component of the tangent there.
    force: (3,) n, the force in the rod in the fixed frame, EI2/L^2; the right clamp pulls with n.
    energy: elastic, in EI2/L.
    index: number of unstable directions; 0 is stable.
    s: (nodes,) arclength of the nodes, in L.
    positions: (nodes, 3) in L.
    directors: (nodes, 3, 3), rows m1 (normal), m2 (width), m3 (tangent).
    points: (points,) arclength of the rows of kappa1, kappa2 and tau.
    kappa1, kappa2, tau: (points,) curvatures about m1 and m2, and twist, in 1/L.
    scene: what it is a state of.
    """

    name: str
    angle: float
    height: float
    slope: float
    force: Array
    energy: float
    index: int
    s: Array
    positions: Array
    directors: Array
    points: Array
    kappa1: Array
    kappa2: Array
    tau: Array
    scene: Scene

    def __repr__(self) -> str:
        return (
            f"RestState({self.name!r}, alpha {self.angle:.6g} rad, z(1/2) {self.height:.6g} L, "
            f"energy {self.energy:.6g} EI2/L, index {self.index})"
        )


def _cubic_root(x: Array, y: Array, low: float, high: float) -> float:
    """Root in [low, high] of the polynomial through the points (x, y), by bisection on its Newton form."""
    x0, scale = float(x[0]), float(x[-1] - x[0])
    nodes = (x - x0) / scale
    coefficients = y.copy()
    for order in range(1, len(nodes)):
        coefficients[order:] = (coefficients[order:] - coefficients[order - 1 : -1]) / (
            nodes[order:] - nodes[:-order]
        )

    def value(t: float) -> float:
        result = coefficients[-1]
        for c, node in zip(coefficients[-2::-1], nodes[-2::-1], strict=True):
            result = result * (t - node) + c
        return float(result)

    a, b = (low - x0) / scale, (high - x0) / scale
    sign = value(a) > 0.0
    for _ in range(60):
        middle = 0.5 * (a + b)
        if (value(middle) > 0.0) == sign:
            a = middle
        else:
            b = middle
    return x0 + scale * 0.5 * (a + b)
