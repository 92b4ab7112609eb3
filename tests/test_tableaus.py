"""Runge-Kutta methods as data: orders from the conditions, stability from the stability function."""

import numpy as np
import pytest

from ribbonfem.tableaus import TABLEAUS

METHODS = pytest.mark.parametrize("name", sorted(TABLEAUS))


def conditions(a, b):
    """Left minus right of the order conditions, by order (Hairer, Norsett & Wanner, section II.2)."""
    c = a.sum(axis=1)
    return {
        1: [b.sum() - 1],
        2: [b @ c - 1 / 2],
        3: [b @ c**2 - 1 / 3, b @ a @ c - 1 / 6],
        4: [b @ c**3 - 1 / 4, b @ (c * (a @ c)) - 1 / 8, b @ a @ c**2 - 1 / 12, b @ a @ a @ c - 1 / 24],
        5: [b @ c**4 - 1 / 5, b @ a @ a @ a @ c - 1 / 120],
    }


def order_of(a, b):
    """The largest order of which all conditions hold."""
    order = 0
    for k, values in conditions(a, b).items():
        if np.abs(values).max() > 1e-14:
            break
        order = k
    return order


@METHODS
def test_declared_orders(name):
    tableau = TABLEAUS[name]()
    weights = tableau.a[-1]
    assert order_of(tableau.a, weights) == tableau.order
    other = order_of(tableau.a, weights - tableau.error)
    # the companion is of another order; their difference is as good as the worse of the two
    assert other != tableau.order
    assert min(other, tableau.order) == tableau.embedded


@METHODS
def test_stages_share_a_diagonal_and_the_last_is_the_step(name):
    tableau = TABLEAUS[name]()
    assert np.all(np.triu(tableau.a, 1) == 0)
    assert np.all(tableau.a[0] == 0)
    assert len(set(np.diag(tableau.a)[1:])) == 1
    assert abs(tableau.c[-1] - 1) < 1e-14


@METHODS
def test_no_oscillation_grows_and_stiff_ones_vanish(name):
    tableau = TABLEAUS[name]()

    def growth(z):
        one = np.ones(tableau.stages)
        return abs(1 + z * (tableau.a[-1] @ np.linalg.solve(np.eye(tableau.stages) - z * tableau.a, one)))

    assert max(growth(1j * y) for y in np.logspace(-2, 4, 500)) <= 1 + 1e-12
    assert growth(-1e8) < 1e-6
