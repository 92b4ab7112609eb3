"""A C1 line element of any degree in local coordinates: cubic Hermite functions, and bubbles."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.polynomial import Polynomial
from numpy.polynomial.legendre import Legendre
from skfem import Basis, MeshLine
from skfem.element import Element
from skfem.element.discrete_field import DiscreteField
from skfem.refdom import RefLine

from ribbonfem.results import Array

# value polynomials in the local coordinate, lowest power first, for u(0), h u'(0), u(1), h u'(1)
_CUBICS = np.array([[1.0, 0, -3, 2], [0, 1, -2, 1], [0, 0, 3, -2], [0, 0, -1, 1]])


def _bubble(k: int) -> Any:
    """The k-th bubble: its second derivative is a Legendre polynomial, of degree k + 2."""
    return Legendre.basis(k + 2, domain=[0.0, 1.0]).integ(2, lbnd=0.0)


class ElementLineLocalHermite(Element):
    """C1, with dofs u and u_x at the nodes, and `degree` - 3 bubbles whose second derivatives are orthogonal.

    scikit-fem's own Hermite element, of degree 3, inverts a Vandermonde matrix in physical coordinates and
    keeps it in the element object: it loses digits on short or shifted elements and is silently
    wrong on a second mesh.  Here the polynomials are written on the reference element and
    scaled by its length.  The bubbles vanish with their slopes at both nodes; on one element all but
    the nearest are orthogonal in the mass and in the slopes too.
    """

    nodal_dofs = 2
    refdom = RefLine

    def __init__(self, degree: int = 3) -> None:
        self.maxdeg = degree
        self.interior_dofs = degree - 3
        self.dofnames = ["u", "u_x"] + ["bubble"] * (degree - 3)
        self.doflocs = np.array([[0.0], [0.0], [1.0], [1.0]] + [[0.5]] * (degree - 3))
        cubics = [Polynomial(cubic) for cubic in _CUBICS]
        self._functions = [*cubics, *(_bubble(k) for k in range(degree - 3))]

    def gbasis(self, mapping: Any, X: Any, i: int, tind: Any = None) -> tuple[DiscreteField, ...]:
        """Value, first and second derivative of the i-th basis function at local points X (1, points)."""
        if not 0 <= i < len(self._functions):
            self._index_error()
        x = X[0]
        length = mapping.detDF(X, tind)
        scale = length ** (i % 2 if i < 4 else 2)
        function = self._functions[i]
        return (
            DiscreteField(
                value=function(x) * scale,
                grad=(function.deriv()(x) * scale / length)[None],
                hess=(function.deriv(2)(x) * scale / length**2)[None, None],
            ),
        )


def hermite_basis(elements: int, degree: int = 3, quadrature: tuple[Array, Array] | None = None) -> Basis:
    """Basis on a uniform mesh of [0, 1], with quadrature exact for the mass matrix if none is given."""
    mesh = MeshLine(np.linspace(0.0, 1.0, elements + 1))
    # a new element for every basis
    element = ElementLineLocalHermite(degree)
    if quadrature is not None:
        return Basis(mesh, element, quadrature=quadrature)
    return Basis(mesh, element, intorder=2 * degree)
