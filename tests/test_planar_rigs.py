"""The planar models on any rig of the plane: against other methods, against three dimensions, energies.

The check values are of a shooting method that shares no code with this project (L = EI2 = 1, inextensible).
"""

from dataclasses import replace

import numpy as np
import pytest

from ribbonfem import Drive, Ribbon, Scene, SceneError, SolverError, elastica, kirchhoff
from ribbonfem.drive import NAMED

# a weight of 5 EI2/L^3 of the default ribbon, in m/s2
HEAVY = (0.0, 0.0, -5.0 / Ribbon().weight_ratio)
NONE = (0.0, 0.0, 0.0)
PLANAR = {"compression": 0.40, "shear": 0.0, "start": "U+"}
ARCH = {"compression": 0.30, "shear": 0.0, "start": "U+", "drive": "compression", "rate": -0.1}


def planar(**given):
    return Scene(**{**PLANAR, "gravity": NONE, **given})


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ({"gravity": HEAVY}, 1.080050375),
        # of a clamped planar beam a uniform natural curvature changes nothing
        ({"ribbon": Ribbon(curvature=2.0)}, 1.123089742),
        ({"ribbon": Ribbon(curvature=-3.0)}, 1.123089742),
        ({"drive": "right"}, 1.123089742),
    ],
)
def test_folds_of_other_rigs(given, expected):
    (fold,) = elastica.folds(planar(**given))
    assert abs(fold.control - expected) < 1e-9


@pytest.mark.parametrize(
    ("turned", "lost", "fold"), [(0.6, 0.0884939107, 0.0872991669), (0.4, 0.039699033, 0.0392024268)]
)
def test_an_arch_of_two_turned_clamps_is_lost_at_a_pitchfork(turned, lost, fold):
    scene = Scene(**ARCH, preset={"left": turned, "right": turned})
    (result,) = elastica.instabilities(scene)
    assert result.kind == "pitchfork"
    assert result.subcritical
    assert not result.out_of_plane
    assert 0.30 + result.control == pytest.approx(lost, abs=1e-9)
    (beyond,) = elastica.equilibria(scene, span=(-0.299, 0.5)).folds
    assert 0.30 + beyond.control == pytest.approx(fold, abs=1e-10)


def test_both_clamps_leave_the_plane_before_the_fold_in_it():
    scene = planar(drive="both")
    (lost,) = elastica.instabilities(scene)
    assert (lost.kind, lost.out_of_plane) == ("pitchfork", True)
    assert lost.control == pytest.approx(1.211826175, abs=1e-8)
    assert elastica.leaves_plane(scene) == pytest.approx(lost.control, abs=1e-9)
    (fold,) = elastica.equilibria(scene).folds
    assert fold.control == pytest.approx(1.331782895, abs=1e-9)


def drawn(seed, count, soft=False):
    """Planar scenes at random: drives, presets, weight, a natural curvature, either start."""
    rng = np.random.default_rng(seed)
    drives = ["left", "right", "both", "opposed", "lift", "force", "compression", Drive(left=1.0, right=0.4)]
    scenes = []
    for k in range(count):
        drive = drives[k % len(drives)]
        fixed = {"left": 0.15, "right": 0.15, "lift": 0.03, "force": 3.0}
        moved = Scene(**PLANAR, drive=drive).drives.moved
        preset = {name: float(rng.uniform(-size, size)) for name, size in fixed.items() if name not in moved}
        ribbon = {"curvature": tuple(float(x) for x in rng.uniform(-2.0, 2.0, 3))}
        if soft:
            ribbon |= {
                "bending_ratio": float(10.0 ** rng.uniform(0.1, 1.2)),
                "twist_ratio": float(10.0 ** rng.uniform(-1.0, 0.2)),
            }
        rate = float(rng.choice([-0.1, 0.1]))
        scenes.append(
            planar(
                compression=float(rng.uniform(0.15, 0.5)),
                start=str(rng.choice(["U+", "U-"])),
                drive=drive,
                preset=preset,
                gravity=(float(rng.uniform(-2.0, 2.0)), 0.0, float(rng.uniform(-3.0, 3.0))),
                rate=rate,
                # beyond two radians states are wound tighter than these meshes resolve
                stop=20.0 * rate if NAMED.get(drive, drive).kind == "turn" else None,
                ribbon=Ribbon(**ribbon),
            )
        )
    return scenes


def lost(model, scene):
    """The first instability, as numbers; an empty list where the start cannot be had, or nothing is lost."""
    try:
        result = model.instabilities(scene, elements=32)
    except SceneError:
        return []
    return [(point.kind, point.out_of_plane, point.control, point.height, point.load) for point in result[:1]]


@pytest.mark.parametrize("soft", [False, True])
def test_states_at_rest_are_lost_where_they_are_in_three_dimensions(soft):
    across = 0
    for scene in drawn(3, 8, soft):
        one, two = lost(elastica, scene), lost(kirchhoff, scene)
        if soft and not two:
            # what is lost out of the plane on the way to its start has no start in three dimensions
            continue
        assert len(one) == len(two), scene
        for (kind, out, *numbers), (other, across_, *expected) in zip(one, two, strict=True):
            assert (kind, out) == (other, across_), scene
            np.testing.assert_allclose(numbers, expected, rtol=1e-6, atol=2e-7)
            across += out
    assert across > 1 or not soft


def test_a_mirror_image_leaves_its_plane_at_the_image_of_the_control():
    """Weight and presets have images of their own."""
    for scene in drawn(5, 4, soft=True):
        result = [model.leaves_plane(s) for model in (elastica, kirchhoff) for s in (scene, scene.mirror)]
        sign = scene.direction * scene.mirror.direction
        np.testing.assert_allclose(result[1::2], np.multiply(sign, result[::2]), atol=1e-9)


@pytest.mark.parametrize(
    ("given", "named"),
    [
        ({"shear": 0.1, "start": "U+S+"}, r"Scene\.shear = 0\.1: .*kirchhoff and der"),
        ({"drive": "twist_left"}, r"Scene\.drive = 'twist_left': .*kirchhoff and der"),
        (
            {"preset": {"left": 0.1, "twist_right": 0.2}, "drive": "lift"},
            r"Scene\.preset = \{'twist_right': 0\.2\}: ",
        ),
        ({"gravity": (0.0, 1.0, 2.0)}, r"Scene\.gravity = \(0\.0, 1\.0, 2\.0\): .*weight along y"),
        ({"ribbon": Ribbon(twist=0.3)}, r"Ribbon\.twist = 0\.3: "),
    ],
)
def test_what_is_not_planar_is_refused_in_a_sentence(given, named):
    with pytest.raises(SceneError, match=named):
        elastica.folds(planar(**given))


def test_a_start_that_is_lost_on_the_way_says_where():
    (point,) = elastica.instabilities(planar(compression=0.05, drive="force"))
    assert point.kind == "pitchfork"
    with pytest.raises(
        SceneError, match=r"preset force = 50 is increased from 0: a .* at 0\.[0-9]* of it"
    ) as error:
        elastica.folds(planar(compression=0.05, preset={"force": 50.0}))
    share = float(str(error.value).split(" at ")[-1].split()[0])
    assert 50.0 * share == pytest.approx(point.control, rel=1e-5)


@pytest.mark.parametrize(
    "scene",
    [
        planar(ribbon=Ribbon(twist_ratio=0.2)),
        planar(ribbon=Ribbon(twist_ratio=0.2), drive="right", start="U-", rate=-0.1),
        planar(drive="both"),
        planar(gravity=HEAVY, ribbon=Ribbon(twist_ratio=0.3)),
    ],
    ids=["left", "right", "both", "heavy"],
)
def test_no_fold_is_named_beyond_where_the_state_leaves_its_plane(scene):
    lost = elastica.instabilities(scene)[0]
    assert lost.out_of_plane
    for functions in (elastica.folds, elastica.normal_forms):
        with pytest.raises(SolverError, match=r"at a branch point .*before a fold") as raised:
            functions(scene, elements=16)
        named = float(str(raised.value).split("alpha ")[1].split(" rad")[0])
        assert named == pytest.approx(lost.control, abs=1e-6)
    assert kirchhoff.instabilities(scene)[0].control == pytest.approx(lost.control, abs=1e-6)
    # up to a stop before it nothing is lost
    assert elastica.folds(replace(scene, stop=0.9 * lost.control)) == ()


def test_opposed_clamps_lose_no_state_until_it_leaves_its_plane_far_beyond_a_quarter_turn():
    """U+ becomes the antisymmetric state, which stays stable: a pitchfork passed the other way."""
    scene = planar(drive="opposed", rate=1.0)
    assert elastica.folds(replace(scene, stop=4.4)) == kirchhoff.folds(replace(scene, stop=4.4)) == ()
    (plane,), (space,) = (model.instabilities(scene) for model in (elastica, kirchhoff))
    assert plane.out_of_plane
    assert space.out_of_plane
    assert plane.control == pytest.approx(space.control, abs=3e-5)
    assert abs(plane.height) < 1e-9
    stopped = replace(scene, stop=5.0)
    for model in (elastica, kirchhoff):
        assert model.leaves_plane(stopped) == pytest.approx(plane.control, abs=3e-5)
        with pytest.raises(SolverError, match=r"alpha 4\.5209.* before a fold.*see `instabilities`"):
            model.folds(scene)
