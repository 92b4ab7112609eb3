"""The right clamp turned: the image of the left one, against a rod whose right clamp is turned itself."""

from dataclasses import replace

import numpy as np
import pytest
from ribbonfem.image import imaged

import der
from compare.archive import from_bytes, to_bytes
from der.problem import Statics
from der.rod import Rod, RodState
from der.states import start_state
from ribbonfem import Scene, SceneError, elastica, kirchhoff
from ribbonfem.continuation import equilibrium
from ribbonfem.scene import swapped

LEFT = Scene(compression=0.40, shear=0.37, start="U+S+")
RIGHT = LEFT.image


def test_a_rod_whose_right_clamp_is_turned_is_in_equilibrium_at_the_image():
    angle = 0.3
    rod = Rod(LEFT.image.image, 51)
    problem = Statics(Rod(replace(LEFT, start="U+S-"), 51))
    state = start_state(problem.rod)
    for alpha in np.linspace(0.05, angle, 6):
        state, _ = equilibrium(problem, problem.advance(state, np.zeros(len(problem.weight)), alpha), alpha)
    turn = np.array([-1.0, -1.0, 1.0])
    end = np.array([1.0 - LEFT.compression, -LEFT.shear, 0.0])
    image = RodState(
        state.x[::-1] * turn + end, np.ascontiguousarray(state.m1[::-1] * turn), state.twist[::-1].copy()
    )
    # its right clamp is the one that is turned
    tangent = (image.x[-1] - image.x[-2]) / rod.rest
    assert np.allclose(tangent, [np.cos(angle), 0.0, np.sin(angle)], atol=1e-12)
    assert np.allclose(image.m1[-1], [-np.sin(angle), 0.0, np.cos(angle)], atol=1e-12)
    assert np.allclose(image.x[1] - image.x[0], [rod.rest, 0.0, 0.0], atol=1e-14)
    _, gradient, _ = Statics(rod).assemble(image, second=False)
    # rounding of positions, times the stiffness of an edge against stretching
    rounding = np.finfo(float).eps * LEFT.ribbon.stretch_ratio / rod.rest
    assert np.abs(gradient[rod.free]).max() < 100.0 * rounding < 2e-7
    # of the original, whose left clamp is turned, the same residual: the image loses no digit
    wrong = RodState(image.x * [1.0, 1.0, -1.0], image.m1, image.twist)
    assert np.abs(Statics(rod).assemble(wrong, second=False)[1][rod.free]).max() > 1.0


def test_folds_of_the_right_clamp():
    assert RIGHT.start == "U+S-"
    for model, mesh in ((der, {"nodes": 51}), (kirchhoff, {"elements": 12, "extensible": True})):
        found = [fold.angle for fold in model.folds(RIGHT, **mesh)]
        assert found == pytest.approx([0.0679, 0.5687], abs=3e-3)
        assert found == [fold.angle for fold in model.folds(LEFT, **mesh)]
        assert len(model.folds(replace(RIGHT, start="U+S+"), **mesh)) == 1
        assert all(fold.scene == RIGHT for fold in model.folds(RIGHT, **mesh))


def profile(state, name):
    """A curvature on a grid of its own."""
    order = np.argsort(state.points)
    return np.interp(np.linspace(0.05, 0.95, 50), state.points[order], getattr(state, name)[order])


def first_folds(scene, *starts):
    return tuple(der.folds(replace(scene, start=start, stop=None), nodes=31)[0] for start in starts)


def test_states_are_named_from_their_own_side():
    for model in (der, kirchhoff):
        state = model.state(RIGHT)
        assert state.name == "U+S-"
        middle = state.positions[len(state.positions) // 2]
        assert middle[0] < 0.5 * (1.0 - RIGHT.compression)
        assert middle[2] > 0.0
        m1, m2, m3 = (state.directors[:, k] for k in range(3))
        assert np.allclose(np.cross(m3, m1), m2, atol=1e-12)
        # at alpha = 0 nothing tells which clamp will be turned
        other = model.state(replace(LEFT, start="U+S-"))
        assert np.allclose(state.positions, other.positions, atol=1e-6)
        assert np.allclose(state.directors, other.directors, atol=1e-5)
        assert np.allclose(state.force, other.force, atol=1e-4)
        for name in ("kappa1", "kappa2", "tau"):
            one, two = profile(state, name), profile(other, name)
            assert np.allclose(one, two, atol=2e-3 * np.abs(two).max()), name
        assert sorted(model.stable_states(RIGHT)) == sorted(model.stable_states(LEFT))


def test_a_motion_and_its_outcome_are_images():
    ramp = replace(LEFT, shear=0.40, rate=1.0, stop=0.9, damping=10.0)
    left, right = (der.simulate(scene, nodes=31) for scene in (ramp, ramp.image))
    assert np.array_equal(left.time, right.time)
    assert np.array_equal(left.height, right.height)
    assert np.array_equal(left.slope, -right.slope)
    r = right.configurations["positions"]
    assert np.allclose(r[:, 1] - r[:, 0], [Rod(ramp, 31).rest, 0.0, 0.0], atol=1e-12)
    assert right.scene == ramp.image
    # nothing has moved yet: the start is the left scene's state of that name
    same = der.simulate(replace(ramp, start="U+S-"), nodes=31).configurations["positions"][0]
    assert np.allclose(r[0], same, atol=1e-6)
    outcome = der.modes.classify(right, first_folds(ramp.image, "U+S-", "U+S+"))
    plain = der.modes.classify(left, first_folds(ramp, "U+S+", "U+S-"))
    assert outcome.kind == plain.kind == "type 2"
    assert outcome.final == swapped(plain.final)
    back = imaged(right, ramp)
    assert np.array_equal(back.slope, left.slope)
    for name, kept in left.configurations.items():
        assert np.allclose(back.configurations[name], kept, atol=1e-15)


def test_planar_beams_turn_from_either_side():
    ramp = Scene(compression=0.30, shear=0.0, start="U+", rate=1.0, stop=1.5)
    one, two = elastica.simulate(ramp, until="snap"), elastica.simulate(ramp.image, until="snap")
    assert one.crossing() == two.crossing()
    assert np.array_equal(one.slope, -two.slope)
    a, b = (h.configurations["positions"][-1] for h in (one, two))
    assert np.allclose(b[:, 0], 0.7 - a[::-1, 0], atol=1e-15)
    assert np.allclose(b[:, 2], a[::-1, 2], atol=0.0)


def test_images_are_their_own_inverse_and_errors_name_the_right_states():
    for start in ("U+S+", "U+S-", "U-S+", "U-S-", "U+", "U-", "S+", "S-"):
        scene = replace(LEFT, start=start)
        assert scene.image.image == scene
        assert scene.mirror.mirror == scene
        assert scene.mirror.start[0] == start[0]
    assert (swapped("U+"), swapped("S+"), swapped("U-S-")) == ("U+", "S-", "U-S+")
    assert LEFT.mirror.start == "U-S+"
    assert from_bytes(to_bytes(RIGHT)) == RIGHT
    with pytest.raises(SceneError, match=r"turned = 'up': must be 'left' or 'right'"):
        Scene(turned="up")
    with pytest.raises(SceneError, match=r"start = 'S\+'"):
        der.folds(replace(RIGHT, start="S+"), nodes=31)
