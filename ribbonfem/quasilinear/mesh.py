"""Mesh of the quasi-linear beam: its matrices (stiffness, geometric stiffness, mass), modes, shape tables."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.linalg import eigh
from scipy.sparse import csr_array
from skfem import BilinearForm, LinearForm

from ribbonfem.elements.hermite import hermite_basis
from ribbonfem.elements.lobatto import lobatto_points
from ribbonfem.results import Array

# dofs at the ends: Z and Z' at s = 0, and at s = 1
ENDS = 4


@dataclass(frozen=True)
class Modes:
    """Buckling modes of the clamped beam, K phi = square G phi with phi G phi = 1, ascending; phi (n, n)."""

    squares: Array
    phi: Array


@dataclass(frozen=True)
class Mesh:
    """Symmetric matrices (n + 4, n + 4) and tables (..., n + 4), the free dofs before those of the ends.

    Tables for whole motions are sparse: an instant's shape does not depend on how many there are.

    Attributes
    ----------
    stiffness, tension, mass: of int Z''^2, int Z'^2 and int Z^2; their `width` is that of the free dofs.
    even: free dofs of even shape, which meet none of the odd ones behind them; of several elements all.
    weight: (n + 4,) integrals of the shape functions.
    height: (n + 4,) their largest values.
    nodes: (nodes,) s/L where shapes are handed out; value, bend: Z and Z'' there.
    middle: (2, n + 4) Z and Z' at midspan.
    points: (points,) s/L between the nodes, as many for each stretch between two, and shares, their weights;
        slope, curvature: Z' and Z'' there, (points, n + 4).
    """

    stiffness: Array
    tension: Array
    mass: Array
    width: int
    even: int
    weight: Array
    height: Array
    nodes: Array
    value: Any
    bend: Any
    middle: Array
    points: Array
    slope: Any
    curvature: Any
    shares: Array

    @property
    def count(self) -> int:
        """n, free dofs."""
        return len(self.mass) - ENDS

    def band(self, matrix: Array) -> Array:
        """(width + 1, n) diagonals of the free dofs' part, [d, i] = A[i + d, i]."""
        n = self.count
        return np.array(
            [np.append(np.diagonal(matrix[:n, :n], -d), np.zeros(d)) for d in range(self.width + 1)]
        )

    def shapes(self, dofs: Array, compression: float) -> Array:
        """Positions (rows, nodes, 3) in L of dofs (rows, n + 4); x is shortened by the slope."""
        result = np.zeros((len(dofs), len(self.nodes), 3))
        result[:, :, 0] = self.nodes
        result[:, 1:, 0] -= 0.5 * compression * self._along(dofs, dofs)
        result[:, :, 2] = compression**0.5 * (self.value @ dofs.T).T
        return result

    def velocities(self, dofs: Array, rates: Array, compression: float) -> Array:
        """Rates (rows, nodes, 3) of `shapes` by the rates (rows, n + 4) of the dofs."""
        result = np.zeros((len(dofs), len(self.nodes), 3))
        result[:, 1:, 0] = -compression * self._along(dofs, rates)
        result[:, :, 2] = compression**0.5 * (self.value @ rates.T).T
        return result

    def _along(self, one: Array, other: Array) -> Array:
        """int Z' Y' dx (rows, nodes - 1) from the left clamp to the nodes, of the slopes of both."""
        product = self.shares[:, None] * (self.slope @ one.T) * (self.slope @ other.T)
        by_element = product.reshape(len(self.nodes) - 1, -1, len(one)).sum(axis=1)
        return np.asarray(np.cumsum(by_element, axis=0).T)


def _tables(elements: int, degree: int, order: Array, local: Array) -> tuple[Array, Array, Array]:
    """Z, Z' and Z'' (elements * points, n + 4) at points (points,) of every element."""
    basis = hermite_basis(elements, degree, (local[None], np.ones(len(local))))
    tables = np.zeros((3, elements, len(local), basis.N))
    each = np.arange(elements)[:, None], np.arange(len(local))
    for i, dofs in enumerate(basis.element_dofs):
        field = basis.basis[i][0]
        for table, values in zip(tables, (field, field.grad[0], field.hess[0, 0]), strict=True):
            table[(*each, dofs[:, None])] = np.asarray(values)
    value, slope, bend = tables.reshape(3, -1, basis.N)[:, :, order]
    return value, slope, bend


@lru_cache(maxsize=32)
def mesh_of(elements: int, degree: int) -> Mesh:
    """The uniform mesh of so many elements of a degree, from scikit-fem; kept."""
    basis = hermite_basis(elements, degree)
    along: list[int] = []
    even = basis.N - ENDS
    for e in range(elements):
        along += [*basis.nodal_dofs[:, e], *(basis.interior_dofs[:, e] if degree > 3 else ())]
    if elements == 1:
        # even and odd bubbles do not know each other: one after the other the band is half as wide
        along = [*along[:2], *along[2::2], *along[3::2]]
        even = len(along[2::2])
    last = list(basis.nodal_dofs[:, elements])
    order = np.array([*along[2:], *along[:2], *last])

    def matrix(form: Any) -> Array:
        return np.asarray(BilinearForm(form).assemble(basis)[order][:, order].toarray())

    stiffness = matrix(lambda u, v, w: u.hess[0, 0] * v.hess[0, 0])
    tension = matrix(lambda u, v, w: u.grad[0] * v.grad[0])
    mass = matrix(lambda u, v, w: u * v)
    # what is orthogonal is rounding
    for some in (stiffness, tension, mass):
        some[np.abs(some) < 1e-10 * np.sqrt(np.outer(some.diagonal(), some.diagonal()))] = 0.0
    n = len(order) - ENDS
    rows, columns = np.nonzero(stiffness[:n, :n] != 0.0)
    width = max(int(np.abs(np.subtract(*np.nonzero(some[:n, :n]))).max()) for some in (tension, mass))
    width = max(width, int(np.abs(rows - columns).max()))
    local = lobatto_points(degree if degree > 3 else 1)
    nodes = np.append((np.arange(elements)[:, None] + local[:-1]).ravel() / elements, 1.0)
    within = np.arange(len(local) * elements).reshape(elements, -1)
    at_nodes = np.append(within[:, :-1].ravel(), within[-1, -1])
    value, slope, bend = (table[at_nodes] for table in _tables(elements, degree, order, local))
    if degree == 3:
        # slopes at the nodes are more accurate than the second derivatives of the cubics between them
        bend = make_interp_spline(nodes, slope, k=5 if len(nodes) > 5 else 3)(nodes, 1)
    at, share = np.polynomial.legendre.leggauss(min(degree, 4))
    lengths = np.diff(local)
    between = local[:-1, None] + 0.5 * lengths[:, None] * (1.0 + at)
    within_stretches = _tables(elements, degree, order, between.ravel())
    fine = _tables(elements, degree, order, np.linspace(0.0, 1.0, 16 * (len(local) - 1) + 1))[0]
    half = np.array([1.0 if elements % 2 == 0 else 0.5])
    middle = [table[(elements - 1) // 2] for table in _tables(elements, degree, order, half)]
    return Mesh(
        stiffness=stiffness,
        tension=tension,
        mass=mass,
        width=width,
        even=even,
        weight=np.asarray(LinearForm(lambda v, w: v).assemble(basis))[order],
        height=np.abs(fine).max(axis=0),
        nodes=nodes,
        value=csr_array(value),
        bend=csr_array(bend),
        middle=np.stack(middle[:2]),
        points=((np.arange(elements)[:, None] + between.ravel()) / elements).ravel(),
        slope=csr_array(within_stretches[1]),
        curvature=csr_array(within_stretches[2]),
        shares=np.tile((0.5 / elements * lengths[:, None] * share).ravel(), elements),
    )


@lru_cache(maxsize=32)
def modes_of(elements: int, degree: int) -> Modes:
    """The buckling modes of a mesh; kept."""
    mesh = mesh_of(elements, degree)
    n = mesh.count
    squares, phi = eigh(mesh.stiffness[:n, :n], mesh.tension[:n, :n])
    return Modes(squares, phi)
