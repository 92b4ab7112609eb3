"""The quasi-linear beam (paper, section 4.2): small slopes, end-shortening as a global constraint.

In the rescaled height Z = z/L (dL/L)^(-1/2) the equilibria solve

    Z'''' + sigma^2 Z'' = 0,  Z(0) = Z(1) = Z'(1) = 0,  Z'(0) = -mu,  int Z'^2 = 2,

with mu = alpha (dL/L)^(-1/2); sigma^2 is the multiplier of the end-shortening.  Cubic Hermite
elements; the tangent is a band with one dense row, and the fold converges with the fourth
power of the mesh.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from skfem import BilinearForm

from ribbonfem.closed_form import EULER
from ribbonfem.continuation import PARAMETER_WEIGHT, Linearisation
from ribbonfem.elements.hermite import hermite_basis
from ribbonfem.linalg.banded import Arrow
from ribbonfem.options import require_memory, whole_number
from ribbonfem.results import Array
from ribbonfem.scene import Scene


@dataclass(frozen=True)
class _State:
    """Nodal values Z, Z' (2 n + 2) with the clamps in place, and sigma^2."""

    z: Array
    load: float


class Statics:
    """The equilibrium equations of the beam in alpha, on a uniform mesh.

    Unknowns are the free nodal values of Z and sigma^2; `parameter` is alpha in rad, heights
    are rescaled.  A `continuation.Problem`.
    """

    parameter_weight = PARAMETER_WEIGHT

    def __init__(self, scene: Scene, elements: int) -> None:
        scene.require_planar("quasilinear")
        self.elements = whole_number("elements", elements, 4)
        require_memory("elements", elements, 2e4 * self.elements, "the mesh")
        self.compression = scene.compression
        self.side = 1.0 if scene.start == "U+" else -1.0
        self.unit = scene.ribbon.inertial_time
        basis = hermite_basis(self.elements)
        # dofs run along the beam, (Z, Z') node by node: a half-bandwidth of 3
        self.order = basis.nodal_dofs.T.ravel()
        self.stiffness = self._matrix(basis, lambda u, v, w: u.hess[0, 0] * v.hess[0, 0])
        self.tension = self._matrix(basis, lambda u, v, w: u.grad[0] * v.grad[0])
        self.mass = self._matrix(basis, lambda u, v, w: u * v)
        self.free = slice(2, 2 * self.elements)
        count = 2 * self.elements - 2
        self.weight = np.zeros(count + 1)
        self.weight[0:count:2] = self.compression / self.elements

    def _matrix(self, basis: Any, form: Any) -> Any:
        return BilinearForm(form).assemble(basis)[self.order][:, self.order].tocsr()

    @property
    def arclength(self) -> Array:
        """(nodes,) s/L of the nodes whose positions are handed out."""
        return np.linspace(0.0, 1.0, self.elements + 1)

    def start(self) -> _State:
        """The buckled beam at alpha = 0: Euler's clamped mode, on the side of the scene's start."""
        x = np.linspace(0.0, 1.0, self.elements + 1)
        shape = np.column_stack(((1.0 - np.cos(EULER * x)) / np.pi, 2.0 * np.sin(EULER * x)))
        return _State(self.side * shape.ravel(), EULER**2)

    def advance(self, state: _State, increment: Array, parameter: float) -> _State:
        """Move the free values and sigma^2, and turn the clamp to `parameter`."""
        z = state.z.copy()
        z[self.free] += increment[:-1]
        z[:2] = 0.0, -parameter * self.compression**-0.5
        z[-2:] = 0.0
        return _State(z, state.load + float(increment[-1]))

    def linearise(self, state: _State, parameter: float) -> Linearisation:
        """Residual, its derivative in alpha, and the factorised tangent."""
        free = self.free
        matrix = self.stiffness - state.load * self.tension
        stretch = self.tension @ state.z
        residual = np.append((matrix @ state.z)[free], 1.0 - 0.5 * float(state.z @ stretch))
        clamp = -(self.compression**-0.5)
        column = np.append(matrix[free, 1].toarray()[:, 0], -stretch[1]) * clamp
        band = np.zeros((len(residual) - 1, 4))
        for d in range(4):
            band[: len(band) - d, d] = matrix.diagonal(-d)[2 : 2 + len(band) - d]
        arrow = Arrow(band, -stretch[free][None, :])
        # one negative eigenvalue belongs to the multiplier
        return Linearisation(residual, column, arrow.solve, arrow.negative - 1)

    def momentum(self, state: _State, velocity: Array, turning: float = 0.0) -> Array:
        """M v of rates of the free nodal values and of sigma^2, which has no mass; of alpha too."""
        z = np.zeros(self.mass.shape[0])
        z[self.free] = velocity[:-1]
        z[1] = -turning * self.compression**-0.5
        return np.append((self.mass @ z)[self.free], 0.0)

    def energy(self, state: _State) -> float:
        """Elastic energy in EI2/L."""
        return 0.5 * self.compression * float(state.z @ (self.stiffness @ state.z))

    def middle_weights(self) -> tuple[NDArray[np.int64], Array, Array]:
        """Dofs, and their weights in Z and in Z' at midspan (inside an element, if their number is odd)."""
        n, h = self.elements, 1.0 / self.elements
        if n % 2 == 0:
            return np.array([n, n + 1]), np.array([1.0, 0.0]), np.array([0.0, 1.0])
        value = np.array([0.5, 0.125 * h, 0.5, -0.125 * h])
        return np.arange(n - 1, n + 3), value, np.array([-1.5 / h, -0.25, 1.5 / h, -0.25])

    def middle(self, z: Array) -> tuple[float, float]:
        """Z and Z' at midspan."""
        index, value, slope = self.middle_weights()
        return float(value @ z[index]), float(slope @ z[index])

    def observe(self, state: _State, parameter: float) -> tuple[float, float, float]:
        """z(1/2)/L, the z-component of the unit tangent there, and sigma^2."""
        height, slope = (value * self.compression**0.5 for value in self.middle(state.z))
        return height, slope / float(np.hypot(1.0, slope)), state.load

    def positions(self, state: _State, parameter: float) -> Array:
        """Nodal positions in L; x is shortened by the slope, so that the end lies at 1 - dL/L."""
        return self.shapes(state.z[None])[0]

    def shapes(self, z: Array) -> Array:
        """Positions (rows, nodes, 3) in L of nodal values Z, Z' (rows, 2 nodes)."""
        value, slope = z[:, 0::2], z[:, 1::2]
        h = 1.0 / self.elements
        rise = np.diff(value)
        left, right = slope[:, :-1], slope[:, 1:]
        # int Z'^2 over each cubic, exactly
        square = 1.2 * rise**2 / h - 0.2 * rise * (left + right)
        square += h / 15 * (2 * left**2 - left * right + 2 * right**2)
        x = np.tile(np.linspace(0.0, 1.0, self.elements + 1), (len(z), 1))
        x[:, 1:] -= 0.5 * self.compression * np.cumsum(square, axis=1)
        return np.stack((x, np.zeros_like(x), value * self.compression**0.5), axis=2)
