from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import minimize_scalar

from ribbonfem import Scene, SceneError, quasilinear
from ribbonfem.continuation import Steps
from ribbonfem.elements.hermite import hermite_basis
from ribbonfem.options import OptionError

SCENE = Scene(compression=0.2, shear=0.0, start="U+")
EXACT = quasilinear.closed_form_fold()


def papers_mu(sigma):
    """mu(sigma) as the paper prints it (section 4.3), a form that the package does not use."""
    s, c = np.sin(sigma), np.cos(sigma)
    s2, c2 = np.sin(2 * sigma), np.cos(2 * sigma)
    bottom = 2 * sigma**3 - sigma**2 * (s2 + 4 * s) + 4 * sigma * (c - c2) + 2 * (s2 - 2 * s)
    return np.sqrt(8 * sigma * (2 * c + sigma * s - 2) ** 2 / bottom)


def test_closed_form_fold_is_the_papers():
    best = minimize_scalar(
        lambda s: -papers_mu(s), bounds=(7.0, 8.2), method="bounded", options={"xatol": 1e-10}
    )
    assert np.isclose(EXACT.sigma, best.x, rtol=1e-7)  # a maximum is flat: half the digits
    assert np.isclose(EXACT.mu, papers_mu(EXACT.sigma), rtol=1e-13)
    assert np.isclose(EXACT.height, -EXACT.mu * np.tan(EXACT.sigma / 4) / (2 * EXACT.sigma), rtol=1e-13)
    for value, known in zip(
        (EXACT.sigma, EXACT.mu, EXACT.height),
        (7.58637843107431, 1.78177604115671, 0.347601404327922),
        strict=True,
    ):
        assert abs(value - known) < 1e-12


def test_closed_form_branch_satisfies_the_end_shortening():
    branch = quasilinear.closed_form_branch((-6.0, 2.0))
    assert branch.load.min() < 0.0  # under tension at large negative angles
    for k in (0, 40, 150, 250):
        mu, load = branch.mu[k], branch.load[k]
        sigma = np.sqrt(load + 0j)
        a = -mu / (2 * sigma * np.sin(sigma / 2))
        b = -mu / 2 / (sigma * np.cos(sigma / 2) - 2 * np.sin(sigma / 2))

        def square(x, sigma=sigma, a=a, b=b):
            xi = x - 0.5
            return (
                (-a * sigma * np.sin(sigma * xi) + b * (sigma * np.cos(sigma * xi) - 2 * np.sin(sigma / 2)))
                ** 2
            ).real

        assert np.isclose(quad(square, 0.0, 1.0)[0], 2.0, rtol=1e-9)
        assert np.isclose(branch.height[k], (a * (1 - np.cos(sigma / 2))).real, rtol=1e-9)


def test_fold_converges_with_order_four():
    errors = {}
    for elements in (16, 32, 64, 128):
        (fold,) = quasilinear.folds(SCENE, elements=elements)
        scale = SCENE.compression**0.5
        result = np.array([fold.load**0.5, fold.angle / scale, fold.height / scale])
        errors[elements] = result / [EXACT.sigma, EXACT.mu, EXACT.height] - 1
    assert np.abs(errors[64]).max() <= 4e-7
    assert np.abs(errors[128]).max() <= 3e-8
    orders = np.log2(np.abs(errors[32] / errors[64]))
    assert np.all(np.abs(orders - 4) < 0.1), f"expected order 4, observed {orders}"
    assert np.abs((16 * errors[64] - errors[32]) / 15).max() <= 5e-9


def test_the_folds_own_equation_is_that_of_the_continuation():
    """Both of one mesh; and of one element of high degree the closed form to rounding."""
    for mesh in ({"elements": 9}, {"elements": 16}, {"elements": 2, "degree": 7}, {"degree": 10}):
        (solved,), (followed,) = (quasilinear.folds(SCENE, steps=steps, **mesh) for steps in (None, Steps()))
        assert abs(solved.angle - followed.angle) < 1e-10
        assert abs(solved.height - followed.height) < 1e-7
        assert abs(solved.load / followed.load - 1.0) < 1e-7
    (fold,) = quasilinear.folds(SCENE)
    scale = SCENE.compression**0.5
    assert abs(fold.load**0.5 - EXACT.sigma) < 1e-10
    assert abs(fold.angle / scale - EXACT.mu) < 1e-10
    assert abs(fold.height / scale - EXACT.height) < 1e-8
    errors = [abs(quasilinear.folds(SCENE, degree=p)[0].angle / scale - EXACT.mu) for p in (8, 10, 12, 14)]
    assert all(after < before / 50.0 for before, after in pairwise(errors)), errors


def test_turned_the_other_way_it_never_folds():
    for changes in ({"rate": -1.0}, {"start": "U-"}):
        assert quasilinear.folds(replace(SCENE, **changes)) == ()
        assert quasilinear.folds(replace(SCENE, **changes), elements=16, steps=Steps()) == ()


def test_branch_matches_closed_form_and_its_stability():
    branch = quasilinear.equilibria(SCENE, elements=64)
    scale = SCENE.compression**0.5
    assert branch.angle[0] == -1.5
    assert np.count_nonzero(branch.angle == 0.0) == 1
    closed = quasilinear.closed_form_branch((-1.5 / scale, 1.5 / scale), points=4000)
    upper = closed.load < EXACT.sigma**2
    near = branch.load < (EXACT.sigma - 0.1) ** 2
    height = np.interp(branch.load[near], closed.load[upper], closed.height[upper] * scale)
    assert np.abs(height - branch.height[near]).max() < 2e-6
    assert np.array_equal(branch.stable, branch.load < branch.folds[0].load)
    assert abs(branch.folds[0].angle - EXACT.mu * scale) < 1e-6


def test_mirror_and_start_state():
    (up,) = quasilinear.folds(SCENE, elements=32)
    mirror = Scene(compression=0.2, shear=0.0, start="U-", rate=-0.1)
    (down,) = quasilinear.folds(mirror, elements=32)
    assert np.isclose(up.angle, -down.angle, atol=1e-12)
    assert np.isclose(up.height, -down.height, atol=1e-9)
    branch = quasilinear.equilibria(SCENE, elements=64)
    assert np.isclose(branch.height[branch.angle == 0.0][0], 2 / np.pi * SCENE.compression**0.5, rtol=1e-6)
    assert np.allclose(branch.configurations[3][-1], [0.8, 0.0, 0.0], atol=1e-9)


def test_stop_before_the_fold_leaves_none():
    assert quasilinear.folds(Scene(compression=0.2, shear=0.0, start="U+", stop=0.7), elements=16) == ()


def test_refusals():
    with pytest.raises(SceneError, match="shear"):
        quasilinear.folds(Scene())
    with pytest.raises(OptionError, match="elements = 0"):
        quasilinear.folds(SCENE, elements=0)
    with pytest.raises(OptionError, match="span"):
        quasilinear.equilibria(SCENE, span=(0.1, 1.0))
    with pytest.raises(TypeError, match="nodes"):
        quasilinear.folds(SCENE, nodes=11)


def test_hermite_element_keeps_digits_on_short_shifted_elements():
    from skfem import Basis, MeshLine

    from ribbonfem.elements.hermite import ElementLineLocalHermite

    mesh = MeshLine(1000.0 + np.linspace(0.0, 1e-3, 4))
    basis = Basis(mesh, ElementLineLocalHermite(), intorder=6)
    fields = [basis.basis[i][0] for i in range(4)]
    # sum of the two value functions is 1, also with rounding
    assert np.abs(fields[0] + fields[2] - 1).max() < 1e-15
    assert np.abs(fields[0].hess + fields[2].hess).max() < 1e-9 * np.abs(fields[0].hess).max()
    assert hermite_basis(5).N == 12


def test_the_coarsest_mesh_passes_where_its_matrix_is_singular():
    # at dL/L = 0.10 four elements make it singular to the last digit; mu does not depend on dL
    mus = [
        quasilinear.folds(Scene(compression=c, shear=0.0, start="U+"), elements=4)[0].angle * c**-0.5
        for c in (0.10, 0.30)
    ]
    assert abs(mus[0] - mus[1]) < 1e-9
