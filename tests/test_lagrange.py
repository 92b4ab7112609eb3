"""The Lagrange line element: values as dofs, derivatives, quadrature, integrals inside an element."""

import numpy as np
import pytest
from skfem import Basis, BilinearForm, MeshLine, solve
from skfem.helpers import dot, grad

from ribbonfem.elements.lobatto import ElementLineLobatto, interpolation, line_tables, lobatto_points


@pytest.mark.parametrize("degree", [2, 3, 5, 6])
def test_tables_reproduce_polynomials(degree):
    tables = line_tables(4, degree)
    power = np.polynomial.Polynomial(np.arange(1.0, degree + 2))
    nodal = power(tables.nodes)
    for e in range(tables.elements):
        local = nodal[e * degree : (e + 1) * degree + 1]
        assert tables.value @ local == pytest.approx(power(tables.points[e]), rel=1e-12)
        assert tables.slope[e] @ local == pytest.approx(power.deriv()(tables.points[e]), rel=1e-11)
        primitive = power.deriv().integ()
        start = e / tables.elements
        inside = tables.partial @ power.deriv()(tables.points[e]) / tables.elements
        ends = start + lobatto_points(degree) / tables.elements
        assert inside == pytest.approx(primitive(ends) - primitive(start), abs=1e-11)
    # p Gauss points: exact to degree 2 p - 1, and not beyond
    x, w = tables.points.ravel(), tables.weights.ravel()
    assert w @ x ** (2 * degree - 1) == pytest.approx(1 / (2 * degree), rel=1e-13)
    assert abs(w @ x ** (2 * degree) - 1 / (2 * degree + 1)) > 1e-16


def test_element_works_in_scikit_fem_and_converges_with_its_degree():
    errors = []
    for elements in (4, 8):
        basis = Basis(MeshLine(np.linspace(0, 1, elements + 1)), ElementLineLobatto(3), intorder=8)
        stiffness = BilinearForm(lambda u, v, w: dot(grad(u), grad(v))).assemble(basis)
        mass = BilinearForm(lambda u, v, w: u * v).assemble(basis)
        places = basis.doflocs[0]
        # -u'' + u = (1 + pi^2) cos(pi x) with natural ends
        load = mass @ ((1 + np.pi**2) * np.cos(np.pi * places))
        value = basis.interpolate(solve(stiffness + mass, load))
        x = basis.global_coordinates()[0]
        errors.append(np.sqrt(np.sum((np.asarray(value) - np.cos(np.pi * x)) ** 2 * basis.dx)))
    assert 3.7 < np.log2(errors[0] / errors[1]) < 4.5


@pytest.mark.parametrize(("coarse", "fine"), [(4, 12), (4, 10), (6, 4)])
def test_interpolation_is_exact_for_what_the_coarse_mesh_can_be(coarse, fine):
    """A polynomial of the elements' degree, and a kink at a node between two of them."""
    degree = 5
    here, there = line_tables(coarse, degree).nodes, line_tables(fine, degree).nodes
    matrix = interpolation(coarse, fine, degree)
    for field in (lambda s: 1.0 + s - 3.0 * s**5, lambda s: np.abs(s - 0.5) ** 3):
        assert np.abs(matrix @ field(here) - field(there)).max() < 1e-13
