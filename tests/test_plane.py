"""Planar states that leave their plane, found by each model's own second variation."""

import math
from dataclasses import replace

import numpy as np
import pytest

import der
from compare.chooser.choice import choose
from compare.limits import edge_ratio, two_point
from ribbonfem import Ribbon, Scene, SceneError, SolverError, elastica, kirchhoff
from ribbonfem.continuation import equilibrium
from ribbonfem.elastica.out_of_plane import OutOfPlane
from ribbonfem.elastica.problem import Statics

SOFT = Scene(
    compression=0.4,
    shear=0.0,
    start="U+",
    rate=0.1,
    stop=1.4,
    ribbon=Ribbon(bending_ratio=5.0, twist_ratio=0.1),
)


def soft(bending, twist, **scene):
    return replace(SOFT, ribbon=Ribbon(bending_ratio=bending, twist_ratio=twist), **scene)


@pytest.mark.parametrize("twist", [0.3, 1.0, 40.0])
@pytest.mark.parametrize("compression", [0.01, 0.4, 0.8])
def test_a_rod_of_one_stiffness_is_neutral(compression, twist):
    """It turns freely about x: from just above one stiffness to just below one more mode is unstable."""
    scene = soft(1.0, twist, compression=compression)
    problem = Statics(scene, 64, False)
    state, _ = equilibrium(problem, problem.start(), 0.0)
    indices = [
        OutOfPlane(problem, Ribbon(bending_ratio=ratio, twist_ratio=twist)).index(state)
        for ratio in (1.0 - 1e-6, 1.0 + 1e-6)
    ]
    assert indices[0] - indices[1] == 1
    assert elastica.leaves_plane(scene) == 0.0


def of_the_kirchhoff_rod(scene):
    """The angle at which the rod in three dimensions meets its branch point; NaN where it meets a fold."""
    try:
        kirchhoff.folds(replace(scene, stop=None))
    except SolverError as error:
        if "branch point" not in str(error):
            raise
        return float(str(error).split("alpha ")[1].split(" rad")[0])
    except SceneError:
        return 0.0
    return math.nan


def test_against_the_rod_in_three_dimensions():
    """Models that share no mechanics, over ratios drawn at random: the same angle, or none in any."""
    rng = np.random.default_rng(11)
    leaving = 0
    for _ in range(40):
        scene = soft(
            10.0 ** rng.uniform(-0.1, 1.5), 10.0 ** rng.uniform(-1.5, 0.5), compression=rng.uniform(0.05, 0.6)
        )
        planar, rod = elastica.leaves_plane(scene), of_the_kirchhoff_rod(scene)
        assert math.isnan(planar) == (math.isnan(rod) or rod > 1.4), (scene, planar, rod)
        if not math.isnan(planar):
            leaving += 1
            assert planar == pytest.approx(rod, abs=2e-7)
    assert leaving > 10


def test_rods_tend_to_the_extensible_elastica():
    expected = elastica.leaves_plane(SOFT, extensible=True)
    coarse, fine = (der.leaves_plane(SOFT, nodes=nodes) for nodes in (101, 201))
    assert abs(fine - expected) < abs(coarse - expected) / 3.5
    assert two_point(coarse, fine, edge_ratio(101, 201)) == pytest.approx(expected, abs=2e-5)


def test_runs_carry_the_angle():
    leaves = elastica.leaves_plane(SOFT, elements=8)
    run = elastica.simulate(SOFT, until="snap")
    assert run.leaves_plane == pytest.approx(leaves, abs=1e-9)
    assert "its state at rest is lost at 0.44" in repr(run)
    # a mirror image, a stop before it, a stiffer ribbon
    mirror = replace(SOFT, start="U-", rate=-0.1, stop=-1.4)
    assert elastica.leaves_plane(mirror, elements=8) == -leaves
    for other in (replace(SOFT, stop=0.9 * leaves), replace(SOFT, ribbon=Ribbon())):
        short = replace(other, rate=10.0)
        assert math.isnan(elastica.simulate(short, until="snap").leaves_plane)
    sheared = replace(SOFT, shear=0.37, start="U+S-", ribbon=Ribbon(), stop=0.01)
    assert math.isnan(der.simulate(sheared, nodes=31).leaves_plane)


def test_the_chooser_refuses_what_leaves_its_plane():
    """With a shear of 1e-6 it snaps at .633, in the plane at 1.1595: no number is the planar scene's."""
    for quantity in ("snap", "fold"):
        with pytest.raises(SceneError, match="unstable out of its plane from 0\\.442"):
            choose(SOFT, 1e-3, quantity)
    assert choose(replace(SOFT, stop=0.4), 1e-2).run().value is None


@pytest.mark.parametrize("thickness", [0.003, 0.01, 0.05, 0.2, 0.4])
def test_a_flat_ribbon_is_no_buckled_one(thickness):
    """Below Euler's load whoever stretches refuses; just above it the extensible elastica has buckled."""
    ribbon = Ribbon(thickness=thickness, bending_ratio=400.0, twist_ratio=1.4562)
    least = ribbon.euler_shortening
    for compression in np.linspace(0.02, 0.98, 5) * least:
        scene = Scene(compression=compression, shear=0.0, start="U+", rate=0.1, stop=0.5, ribbon=ribbon)
        for call in (
            lambda scene: elastica.simulate(scene, extensible=True),
            lambda scene: elastica.folds(scene, extensible=True),
            lambda scene: elastica.equilibria(scene, extensible=True),
            lambda scene: kirchhoff.folds(scene, extensible=True),
            lambda scene: kirchhoff.state(scene, extensible=True),
            lambda scene: der.simulate(scene, nodes=31),
            lambda scene: der.folds(scene, nodes=31),
            lambda scene: choose(scene, 1e-3),
            lambda scene: choose(scene, 1e-3, "fold"),
        ):
            with pytest.raises(SceneError, match=r"Scene\.compression = .* Euler's load"):
                call(scene)
        # what does not stretch buckles at any compression
        assert elastica.state(scene).height > 0.1 * compression**0.5
    if least < 1.0:
        above = Scene(compression=1.05 * least, shear=0.0, start="U+", ribbon=ribbon)
        (fold,) = elastica.folds(above, extensible=True)
        assert 0.0 < fold.height < 0.6 * math.sqrt(above.compression)


@pytest.mark.parametrize("thickness", [0.001, 0.01, 0.05, 0.15])
@pytest.mark.parametrize("start", ["U+", "U-"])
def test_just_above_eulers_load(thickness, start):
    """z(1/2) = (2 / pi) sqrt(dL - dL_Euler) to leading order, on the side asked for, or a refusal."""
    ribbon = Ribbon(thickness=thickness, bending_ratio=400.0, twist_ratio=1.4562)
    sign = 1.0 if start == "U+" else -1.0
    for above in (1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 0.5):
        compression = ribbon.euler_shortening * (1.0 + above)
        scene = Scene(
            compression=compression, shear=0.0, start=start, rate=0.1, stop=1e-3 * compression, ribbon=ribbon
        )
        height = 2.0 / math.pi * math.sqrt(compression - ribbon.euler_shortening)
        expected = pytest.approx(sign * height, rel=0.04)
        assert kirchhoff.state(scene, extensible=True).height == expected
        if above > 1e-5:
            assert elastica.simulate(scene, extensible=True).height[0] == expected
        else:
            # the beam of few elements has an Euler's load of its own
            try:
                assert sign * elastica.simulate(scene, extensible=True).height[0] > 0.5 * height
            except SceneError as error:
                assert "stays flat" in str(error)  # noqa: PT017
        if above > 3e-3:
            assert der.state(scene, nodes=101).height == expected
