"""A Lagrange line element of any degree with its nodes at the Gauss-Lobatto points."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, lru_cache
from typing import Any

import numpy as np
from numpy.polynomial import Polynomial
from numpy.polynomial.legendre import Legendre
from skfem import Basis, MeshLine
from skfem.element import ElementH1
from skfem.refdom import RefLine

from ribbonfem.results import Array


@cache
def lobatto_points(degree: int) -> Array:
    """The degree + 1 Gauss-Lobatto points of [0, 1], ascending; kept, and not to be written to."""
    inner = Legendre.basis(degree).deriv().roots()
    points = np.concatenate(([0.0], 0.5 * (1.0 + np.sort(inner.real)), [1.0]))
    points.flags.writeable = False
    return points


@cache
def lobatto_weights(degree: int) -> Array:
    """Weights of the Gauss-Lobatto quadrature on [0, 1]: a lumped mass, to degree 2 degree - 1; kept."""
    points = lobatto_points(degree)
    powers = np.arange(degree + 1)
    weights = np.linalg.solve(points[None, :] ** powers[:, None], 1.0 / (powers + 1.0))
    weights.flags.writeable = False
    return weights


class ElementLineLobatto(ElementH1):
    """Continuous polynomials of a given degree, with nodal values as dofs.

    scikit-fem's `ElementLinePp` is hierarchical: its dofs are no values, so that a constraint
    on the values (a unit quaternion) cannot be put on them; and it keeps tables by the number
    of points alone.  The nodes here are those that interpolate best.
    """

    nodal_dofs = 1
    refdom = RefLine

    def __init__(self, degree: int) -> None:
        points = lobatto_points(degree)
        self.interior_dofs = degree - 1
        self.maxdeg = degree
        self.dofnames = ["u"] * degree
        # scikit-fem's order: the two ends, then the inside
        order = np.concatenate(([0, degree], np.arange(1, degree)))
        self.doflocs = points[order][:, None]
        self._polynomials = []
        for k in order:
            product = Polynomial.fromroots(np.delete(points, k))
            self._polynomials.append(product / product(points[k]))

    def lbasis(self, X: Any, i: int) -> tuple[Array, Array]:
        """Value and derivative of the i-th basis function at local points X (1, points)."""
        if not 0 <= i <= self.maxdeg:
            self._index_error()
        polynomial = self._polynomials[i]
        return polynomial(X[0]), polynomial.deriv()(X[0])[None]


@dataclass(frozen=True)
class LineTables:
    """A uniform mesh of [0, 1] and the element tables that a compiled kernel needs.

    Attributes
    ----------
    elements, degree: of the mesh; nodes are numbered along it, degree of them an element.
    nodes: (elements * degree + 1,) their coordinates.
    points: (elements, p) coordinates of the Gauss points, p = degree.
    weights: (elements, p) quadrature weights, element length included.
    value, slope: (p, degree + 1) and (elements, p, degree + 1) basis functions, local node
        order along the element, and their derivatives along the mesh.
    partial: (degree + 1, p) integrals from the element's start to its nodes over the
        polynomial through its Gauss points, for an element of unit length.
    """

    elements: int
    degree: int
    nodes: Array
    points: Array
    weights: Array
    value: Array
    slope: Array
    partial: Array

    def integral(self, derivative: Array) -> Array:
        """The field (nodes, ...), 0 at s = 0, of a derivative (elements, p, ...) at the Gauss points."""
        shape = derivative.shape[2:]
        result = np.zeros((len(self.nodes), *shape))
        ends = np.cumsum(np.einsum("ek,ek...->e...", self.weights, derivative), axis=0)
        inside = np.einsum("ik,ek...->ei...", self.partial[:-1], derivative) / self.elements
        inside[1:] += ends[:-1, None]
        result[:-1] = inside.reshape(-1, *shape)
        result[-1] = ends[-1]
        return result

    def integral_adjoint(self, field: Array) -> Array:
        """Factors (elements, p, ...) of a derivative in the sum of a field times its integral."""
        inside = field[:-1].reshape(self.elements, self.degree, *field.shape[1:])
        # what lies beyond an element's right end moves with the whole of it
        beyond = np.cumsum(inside.sum(axis=1)[::-1], axis=0)[::-1]
        beyond = np.concatenate((beyond[1:], np.zeros_like(beyond[:1]))) + field[-1]
        result = np.einsum("ik,ei...->ek...", self.partial[:-1], inside) / self.elements
        return np.asarray(result + np.einsum("ek,e...->ek...", self.weights, beyond))


@lru_cache(maxsize=32)
def line_tables(elements: int, degree: int) -> LineTables:
    """Tables of `ElementLineLobatto` with `degree` (at least 2) Gauss points an element, from scikit-fem."""
    mesh = MeshLine(np.linspace(0.0, 1.0, elements + 1))
    # exact for polynomials of degree 2 p - 1: p Gauss points.  One more would cost the
    # superconvergence nothing and a fifth of the time.
    basis = Basis(mesh, ElementLineLobatto(degree), intorder=2 * degree - 1)
    along = np.concatenate(([0], np.arange(2, degree + 1), [1]))
    value = np.array([np.asarray(basis.basis[i][0])[0] for i in along]).T
    slope = np.array([basis.basis[i][0].grad[0] for i in along]).transpose(1, 2, 0)
    points = np.asarray(basis.global_coordinates())[0]
    local = np.asarray(basis.X).ravel()
    corners = lobatto_points(degree)
    powers = np.arange(degree)
    integrals = corners[:, None] ** (powers + 1) / (powers + 1)
    partial = integrals @ np.linalg.inv(local[:, None] ** powers)
    nodes = np.append((np.arange(elements)[:, None] + corners[:-1]).ravel() / elements, 1.0)
    return LineTables(
        elements,
        degree,
        nodes,
        np.ascontiguousarray(points),
        np.ascontiguousarray(basis.dx),
        np.ascontiguousarray(value),
        np.ascontiguousarray(slope),
        np.ascontiguousarray(partial),
    )


@cache
def interpolation_at(degree: int, point: float) -> Array:
    """Values (degree + 1,) of an element's basis functions, along it, at a local coordinate; kept."""
    # scikit-fem's order: the two ends, then the inside
    element, places = ElementLineLobatto(degree), (0, degree, *range(1, degree))
    values = np.zeros(degree + 1)
    for i, place in enumerate(places):
        values[place] = element.lbasis(np.array([[point]]), i)[0][0]
    values.flags.writeable = False
    return values


@lru_cache(maxsize=32)
def interpolation(coarse: int, fine: int, degree: int) -> Array:
    """Values at the nodes of a mesh of `fine` elements by those at the nodes of one of `coarse`; kept.

    (fine * degree + 1, coarse * degree + 1), exact for what the coarse mesh can be.
    """
    element = ElementLineLobatto(degree)
    nodes = line_tables(fine, degree).nodes * coarse
    within = np.minimum(np.floor(nodes).astype(int), coarse - 1)
    matrix = np.zeros((len(nodes), coarse * degree + 1))
    # scikit-fem's order: the two ends, then the inside
    for i, place in enumerate((0, degree, *range(1, degree))):
        matrix[np.arange(len(nodes)), within * degree + place] = element.lbasis((nodes - within)[None], i)[0]
    matrix.flags.writeable = False
    return matrix
