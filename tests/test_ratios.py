"""The ratios of a ribbon follow from its section unless they are given."""

import copy
import math
import pickle
from dataclasses import fields, replace

import numpy as np
import pytest

from ribbonfem import Ribbon, Scene, SceneError, kirchhoff
from ribbonfem.ribbon import POISSON, torsion


def test_the_papers_section_has_the_papers_ratios():
    for scale in (1.0, 0.05, 3e-4, 7.0):
        ribbon = Ribbon(length=scale, width=0.2 * scale, thickness=0.01 * scale)
        assert (ribbon.bending_ratio, ribbon.twist_ratio) == (400.0, 1.4562)
        assert type(ribbon.bending_ratio) is type(ribbon.twist_ratio) is float
    assert Ribbon(width=0.04, thickness=0.0001).bending_ratio == 160000.0
    assert Ribbon(width=0.04, thickness=0.002).bending_ratio == 400.0


@pytest.mark.parametrize(
    ("aspect", "value"),
    # S. Timoshenko & J. Goodier, table 7
    [(1.0, 0.1406), (1.2, 0.166), (1.5, 0.196), (2.0, 0.229), (3.0, 0.263), (5.0, 0.291), (10.0, 0.312)],
)
def test_torsion_of_a_rectangle(aspect, value):
    assert torsion(aspect) == pytest.approx(value, abs=6e-4)


def test_torsion_against_the_membrane():
    """Prandtl's stress function by sines in both directions: J = 4 int phi, another series."""
    for aspect in (1.0, 1.7, 6.0):
        m, n = np.meshgrid(np.arange(1, 800, 2), np.arange(1, 800, 2))
        # laplacian phi = -2 over a rectangle a x b, b = 1
        terms = 1.0 / (m**2 * n**2 * ((m / aspect) ** 2 + n**2))
        assert torsion(aspect) == pytest.approx(256.0 / math.pi**6 * terms.sum(), rel=2e-7)


def test_sections_turned_by_a_quarter():
    """GJ is of the rectangle, whichever side is called the width."""
    flat, upright = Ribbon(width=0.2, thickness=0.05), Ribbon(width=0.05, thickness=0.2)
    assert upright.bending_ratio == 1.0 / flat.bending_ratio
    stiffness = [r.twist_ratio * r.bending_stiffness for r in (flat, upright)]
    assert stiffness[0] == pytest.approx(stiffness[1], rel=1e-11)


def test_replaced_sections_are_followed_and_given_ratios_stand():
    rng = np.random.default_rng(3)
    for _ in range(200):
        h, width, nu = 10.0 ** rng.uniform(-4, -1), rng.uniform(0.01, 0.3), rng.uniform(-0.9, 0.49)
        change = {"thickness": h, "width": width, "poisson": nu}
        given = {
            name: 10.0 ** rng.uniform(-1, 4)
            for name in ("bending_ratio", "twist_ratio")
            if rng.random() < 0.5
        }
        ribbon = replace(Ribbon(**given), **change)
        assert ribbon == Ribbon(**given, **change)
        assert hash(ribbon) == hash(Ribbon(**given, **change))
        for name, value in given.items():
            assert getattr(ribbon, name) == value
        for other in (pickle.loads(pickle.dumps(ribbon)), copy.deepcopy(ribbon), eval(repr(ribbon))):
            assert other == ribbon
            assert replace(other, thickness=0.02) == replace(ribbon, thickness=0.02)
        scene = replace(Scene(), ribbon=ribbon)
        assert eval(repr(scene)) == scene
    # there and back again
    assert replace(replace(Ribbon(), thickness=0.002), thickness=0.01) == Ribbon()
    # a number is given, whoever it comes from
    assert Ribbon(thickness=0.002, bending_ratio=Ribbon().bending_ratio).bending_ratio == 400.0
    assert replace(Ribbon(), thickness=0.002, bending_ratio=400.0).bending_ratio == 400.0
    # and let go again
    assert replace(Ribbon(bending_ratio=7.0), bending_ratio=None) == Ribbon()


def test_equal_by_value():
    assert Ribbon() == Ribbon(bending_ratio=400, twist_ratio=1.4562)
    assert hash(Ribbon()) == hash(Ribbon(bending_ratio=400, twist_ratio=1.4562))
    assert Ribbon() != Ribbon(thickness=0.002)
    assert Ribbon() != 3
    assert Ribbon(**{f.name: getattr(Ribbon(thickness=0.02), f.name) for f in fields(Ribbon)}) == Ribbon(
        thickness=0.02
    )


@pytest.mark.parametrize("value", [-1.0, 0.5, 2, math.nan, "0.3", None])
def test_poisson_is_refused(value):
    with pytest.raises(SceneError, match=r"Ribbon\.poisson"):
        Ribbon(poisson=value)
    assert Ribbon().poisson == POISSON


def test_a_thin_section_moves_the_first_fold():
    """(0.30, 0.30), h = 0.002: alpha_c1 .0261, and .0184 with the ratios of h = 0.01."""
    scene = Scene(compression=0.30, shear=0.30, start="U+S+", ribbon=Ribbon(thickness=0.002))
    assert kirchhoff.folds(scene)[0].angle == pytest.approx(0.0261, abs=5e-5)
    kept = replace(scene, ribbon=Ribbon(thickness=0.002, bending_ratio=400, twist_ratio=1.4562))
    assert kirchhoff.folds(kept)[0].angle == pytest.approx(0.0184, abs=5e-5)
