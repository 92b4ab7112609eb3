import numpy as np
import pytest

from ribbonfem.linalg.banded import Arrow


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
