"""Continuous cubics with hierarchical (Legendre) bubbles on a uniform mesh, and forces between them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline
from skfem import Basis, ElementLinePp, MeshLine

from ribbonfem.results import Array

DEGREE = 3


class Mesh:
    """Elements in a row on [0, 1], as scikit-fem tabulates them.

    Attributes
    ----------
    degree: p of the elements; p Gauss points each.
    value, grad: (elements, p + 1, p) shape functions and their derivatives at the Gauss points;
        first the hats of the left and right node, then the bubbles.
    force: (elements, p, p) shape functions of n: the derivatives of all but the left hat, times
        the element's length; the first is 1, the others have no mean.
    dx: (elements, p) weights.
    dofs: (elements, p + 1) numbers of the shape functions, which run along the beam.
    """

    def __init__(self, elements: int, degree: int = DEGREE) -> None:
        self.elements, self.degree = elements, degree
        mesh = MeshLine(np.linspace(0.0, 1.0, elements + 1))
        # a new element for every basis: it keeps the values at its first quadrature points
        basis = Basis(mesh, ElementLinePp(degree), intorder=2 * degree - 1)
        fields = [basis.basis[i][0] for i in range(degree + 1)]
        self.value = np.stack([np.broadcast_to(np.asarray(f), basis.dx.shape) for f in fields], axis=1)
        self.grad = np.stack([np.broadcast_to(f.grad[0], basis.dx.shape) for f in fields], axis=1)
        self.dx = np.ascontiguousarray(basis.dx)
        self.force = self.grad[:, 1:] * self.dx.sum(axis=1)[:, None, None]
        along = np.empty(basis.N, dtype=np.int64)
        along[basis.nodal_dofs[0]] = degree * np.arange(elements + 1)
        for k, row in enumerate(basis.interior_dofs):
            along[row] = degree * np.arange(elements) + 1 + k
        self.dofs = np.ascontiguousarray(along[basis.element_dofs].T)
        self.count = basis.N

    def at_gauss(self, coefficients: Array, table: Array) -> Array:
        """Values (elements, p) at the Gauss points of a field (count,), from `value` or `grad`."""
        return np.einsum("eiq,ei->eq", table, coefficients[self.dofs])

    def middle_weights(self) -> tuple[NDArray[np.int64], Array]:
        """Dofs and weights whose sum is a field at midspan (inside an element, if their number is odd)."""
        if self.elements % 2 == 0:
            return np.array([self.degree * self.elements // 2]), np.ones(1)
        element = ElementLinePp(self.degree)
        point = np.array([[0.5]])
        weights = [float(element.lbasis(point, i)[0][0]) for i in range(self.degree + 1)]
        return self.dofs[self.elements // 2].copy(), np.array(weights)

    def middle(self, coefficients: Array) -> float:
        """The field at midspan."""
        index, weights = self.middle_weights()
        return float(weights @ coefficients[index])

    def integral(self, derivative: Array) -> Array:
        """The field (count,) that is 0 at s = 0 and has this derivative (elements, p) at the Gauss points."""
        field = np.zeros(self.count)
        field[:: self.degree][1:] = np.cumsum((derivative * self.dx).sum(axis=1))
        bubbles = self.grad[:, 2:]
        # derivatives of the bubbles are orthogonal to each other and to a constant
        share = np.einsum("eiq,eq->ei", bubbles, derivative * self.dx)
        field[self.dofs[:, 2:]] = share / np.einsum("eiq,eq->ei", bubbles**2, self.dx)
        return field

    def integral_adjoint(self, weights: Array) -> Array:
        """Factors (elements, p) of a derivative in weights (count,) times its `integral`."""
        nodal = weights[:: self.degree][1:]
        result = np.cumsum(nodal[::-1])[::-1][:, None] * self.dx
        bubbles = self.grad[:, 2:]
        share = weights[self.dofs[:, 2:]] / np.einsum("eiq,eq->ei", bubbles**2, self.dx)
        return result + np.einsum("ei,eiq->eq", share, bubbles) * self.dx

    def nodal_slopes(self) -> Array:
        """(elements + 1, count) the derivative of a field at the nodes.

        Of the spline through the derivatives at the Gauss points, which converge by an order faster than
        those of the elements at their ends.
        """
        local = 0.5 * (1.0 + np.polynomial.legendre.leggauss(self.degree)[0])
        points = (np.arange(self.elements)[:, None] + local).ravel() / self.elements
        slopes = np.zeros((self.elements, self.degree, self.count))
        for e, places in enumerate(self.dofs):
            slopes[e][:, places] = self.grad[e].T
        nodes = np.linspace(0.0, 1.0, self.elements + 1)
        return np.asarray(make_interp_spline(points, slopes.reshape(-1, self.count), k=5)(nodes))

    def inertia(self) -> Array:
        """Mass matrices (elements, p + 1, p + 1), integrated exactly."""
        line = MeshLine(np.linspace(0.0, 1.0, self.elements + 1))
        exact = Basis(line, ElementLinePp(self.degree), intorder=2 * self.degree)
        value = np.stack(
            [np.broadcast_to(np.asarray(exact.basis[i][0]), exact.dx.shape) for i in range(self.degree + 1)],
            axis=1,
        )
        return np.einsum("eiq,ejq,eq->eij", value, value, exact.dx)
