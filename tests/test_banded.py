import numpy as np
import pytest

from ribbonfem.linalg.banded import Arrow, factored


@pytest.mark.parametrize(("width", "border"), [(1, 0), (3, 1), (5, 2), (7, 3)])
def test_arrow_against_dense(width, border):
    rng = np.random.default_rng(width)
    n = 30
    band = rng.normal(size=(n, width + 1))
    for d in range(1, width + 1):
        band[n - d :, d] = 0.0
    rows, corner = rng.normal(size=(border, n)), rng.normal(size=(border, border))
    corner = corner + corner.T
    dense = np.zeros((n + border, n + border))
    for d in range(width + 1):
        for i in range(n - d):
            dense[i + d, i] = dense[i, i + d] = band[i, d]
    dense[n:, :n], dense[:n, n:], dense[n:, n:] = rows, rows.T, corner
    arrow = Arrow(band, rows if border else None, corner if border else None)
    right = rng.normal(size=(n + border, 2))
    assert np.abs(dense @ arrow.solve(right) - right).max() < 1e-10
    assert np.allclose(arrow.solve(right[:, 0]), arrow.solve(right)[:, 0])
    assert arrow.negative == (np.linalg.eigvalsh(dense) < 0).sum()


def test_a_pivot_that_cancels_costs_no_digits():
    """Without a step of refinement six digits of sixteen are left."""
    rng = np.random.default_rng(1)
    band = np.zeros((12, 3))
    band[:, 0], band[:-1, 1], band[:-2, 2] = rng.normal(size=12), rng.normal(size=11), rng.normal(size=10)
    # the second pivot
    band[1, 0] = band[0, 1] ** 2 / band[0, 0] * (1.0 + 1e-10)
    matrix = np.diag(band[:, 0])
    for d in (1, 2):
        matrix += np.diag(band[:-d, d], d) + np.diag(band[:-d, d], -d)
    exact = rng.normal(size=12)
    assert np.abs(Arrow(band).solve(matrix @ exact) - exact).max() < 1e-13 * np.linalg.cond(matrix)


def test_elements_of_a_band_that_are_not_there_cost_no_fill():
    """Blocks that overlap by one row, as finite elements: factors end where the blocks do."""
    rng = np.random.default_rng(2)
    size, blocks = 5, 4
    band = np.zeros((size * blocks + 1, size + 1))
    for b in range(blocks):
        for i in range(size + 1):
            band[size * b + i, : size + 1 - i] += rng.normal(size=size + 1 - i)
    reach = factored(band, np.zeros((0, len(band))), np.zeros((0, 0)))[3]
    assert reach.tolist() == [size - i % size for i in range(size * blocks)] + [0]
