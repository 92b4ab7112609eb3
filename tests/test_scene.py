import math
import warnings
from dataclasses import replace

import numpy as np
import pytest

from compare.sweep.task import Task
from ribbonfem import Ribbon, Scene, SceneError, Schedule
from ribbonfem.scene import SceneWarning

PLANAR = {"shear": 0.0, "start": "U+"}


def test_defaults_are_the_papers_ribbon():
    ribbon = Ribbon()
    assert math.isclose(ribbon.inertial_time, 1.0954451150103321)  # t* = 1.0954 s
    assert math.isclose(ribbon.stretch_ratio, 1.2e5)
    assert math.isclose(ribbon.bending_stiffness, 1e8 * 0.2 * 1e-6 / 12)
    assert math.isclose(ribbon.rotary_inertia, (0.04 + 1e-4) / 12)


@pytest.mark.parametrize(
    "name", ["length", "width", "thickness", "young", "density", "bending_ratio", "twist_ratio"]
)
@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf, "1", None, True, [1.0]])
def test_ribbon_refuses_and_names(name, value):
    if value is None and name.endswith("_ratio"):
        assert Ribbon(**{name: value}) == Ribbon()  # it follows from the section
        return
    with pytest.raises(SceneError, match=name) as caught:
        Ribbon(**{name: value})
    assert repr(value) in str(caught.value)


@pytest.mark.parametrize(
    ("field", "value", "others"),
    [
        ("compression", 0.0, {}),
        ("compression", 1.0, {}),
        ("compression", 1.3, PLANAR),
        ("compression", "0.4", {}),
        ("compression", True, {}),
        ("compression", math.nan, {}),
        ("shear", 0.8, {}),  # the chord is exactly as long as the ribbon: 0.6, 0.8, 1
        ("shear", -0.81, {}),
        ("shear", None, {}),
        ("start", "U+", {"shear": 0.0, "start": "U+S+"}),
        ("start", "flat", {}),
        ("start", 3, {}),
        ("rate", 0.0, {}),
        ("rate", math.inf, {}),
        ("stop", -0.5, {}),
        ("stop", 0.5, {"rate": -0.1}),
        ("stop", 0.0, {}),
        ("stop", "1", {}),
        ("hold", -1e-9, {}),
        ("damping", -1.0, {}),
        ("damping", None, {}),
        ("ribbon", {"length": 1.0}, {}),
    ],
)
def test_scene_refuses_and_names(field, value, others):
    with pytest.raises(SceneError, match=rf"Scene\.{field}"):
        Scene(**{field: value, **others})


def test_message_states_value_and_limit():
    with pytest.raises(SceneError) as caught:
        Scene(compression=0.4, shear=0.9)
    assert "0.9" in str(caught.value)
    assert "0.8" in str(caught.value)  # sqrt(1 - 0.6^2)
    assert issubclass(SceneError, ValueError)


def test_accepts_numpy_numbers_and_both_signs():
    scene = Scene(compression=np.float64(0.3), shear=np.float32(-0.25), rate=-1, stop=np.int64(-1))
    assert isinstance(scene.shear, float)
    assert scene.stop == -1.0


def test_frozen_keyword_only_hashable():
    scene = Scene()
    with pytest.raises(AttributeError):
        scene.rate = 1.0
    with pytest.raises(TypeError):
        Scene(0.4)
    assert hash(Scene()) == hash(scene)


def test_helpers_refuse():
    with pytest.raises(SceneError, match="stop"):
        Scene().require_stop()
    with pytest.raises(SceneError, match="elastica"):
        Scene().require_planar("elastica")


def test_scenes_that_differ_in_the_sign_of_a_zero_are_one_to_a_sweep_too():
    """As a mirror image makes them: equal, with one hash and one key."""
    ribbon = Ribbon(curvature=(0.0, 1.0), twist=-0.0)
    given = {"gravity": (0.0, 0.0, -0.0), "shear": -0.0, "start": "U+", "ribbon": ribbon, "damping": -0.0}
    scene = Scene(**given, schedule=Schedule((-0.0, 1), (-0.0, 0.1), slope=(-0.0, 0.2)))
    plain = Scene(
        gravity=(0.0, 0.0, 0.0),
        shear=0.0,
        start="U+",
        ribbon=Ribbon(curvature=(0.0, 1.0)),
        damping=0.0,
        schedule=Schedule((0, 1), (0.0, 0.1), slope=(0.0, 0.2)),
    )
    for one, other in ((scene, plain), (scene.mirror.mirror, plain), (scene.mirror, plain.mirror)):
        assert (one, hash(one), Task(repr, one).key) == (other, hash(other), Task(repr, other).key)
    assert "-0.0" not in repr(plain.mirror)


def test_of_its_weight_a_ribbon_is_told_once_and_its_mirror_image_not_again():
    ribbon = Ribbon(thickness=0.00123, curvature=1.0)
    with pytest.warns(SceneWarning, match="no weight acts"):
        scene = Scene(ribbon=ribbon)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert scene.mirror.mirror == scene
        Scene(ribbon=replace(ribbon, curvature=2.0, retardation=0.1))
