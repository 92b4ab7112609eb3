"""A cubic Hermite line element in local coordinates."""

from __future__ import annotations

from typing import Any

import numpy as np
from skfem import Basis, MeshLine
from skfem.element import Element
from skfem.element.discrete_field import DiscreteField
from skfem.refdom import RefLine

# value polynomials in the local coordinate, lowest power first, for u(0), h u'(0), u(1), h u'(1)
_CUBICS = np.array([[1.0, 0, -3, 2], [0, 1, -2, 1], [0, 0, 3, -2], [0, 0, -1, 1]])


class ElementLineLocalHermite(Element):
    """C1 cubic with dofs u and u_x at the nodes.

    scikit-fem's own Hermite element inverts a Vandermonde matrix in physical coordinates and
    keeps it in the element object: it loses digits on short or shifted elements and is silently
    wrong on a second mesh.  Here the four polynomials are written on the reference element and
    scaled by its length.
    """

    nodal_dofs = 2
    maxdeg = 3
    dofnames = ("u", "u_x")
    doflocs = np.array([[0.0], [0.0], [1.0], [1.0]])
    refdom = RefLine

    def gbasis(self, mapping: Any, X: Any, i: int, tind: Any = None) -> tuple[DiscreteField, ...]:
        """Value, first and second derivative of the i-th basis function at local points X (1, points)."""
        if not 0 <= i < 4:
            self._index_error()
        x = X[0]
        length = mapping.detDF(X, tind)
        scale = length ** (i % 2)
        cubic = np.polynomial.Polynomial(_CUBICS[i])
        return (
            DiscreteField(
                value=cubic(x) * scale,
                grad=(cubic.deriv()(x) * scale / length)[None],
                hess=(cubic.deriv(2)(x) * scale / length**2)[None, None],
            ),
        )


def hermite_basis(elements: int) -> Basis:
    """Basis on a uniform mesh of [0, 1], with quadrature exact for the mass matrix."""
    mesh = MeshLine(np.linspace(0.0, 1.0, elements + 1))
    return Basis(mesh, ElementLineLocalHermite(), intorder=6)
