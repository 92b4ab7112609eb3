"""Rods at rest under every control, load and shape: against a method that shares no code, and elements."""

from dataclasses import replace

import numpy as np
import pytest

import der
from der.problem import Loading, Statics
from der.rod import Rod
from der.states import start_state
from ribbonfem import Ribbon, Scene, SolverError, kirchhoff
from ribbonfem.drive import CONTROLS, Drive
from ribbonfem.scene import Schedule

# the ratios of the default ribbon, and so thin that it hardly stretches
THIN = Ribbon(thickness=1e-3, ratios=(400.0, Ribbon().twist_ratio))
NONE = {"ribbon": THIN, "gravity": (0.0, 0.0, 0.0)}
HEAVY = NONE | {"gravity": (0.0, 0.0, -5.0 / THIN.weight_ratio)}
CURVED = NONE | {"ribbon": replace(THIN, curvature=2.0)}
PLANAR = {"shear": 0.0, "start": "U+"}

# controls of inextensible rods by a shooting method (field's conventions: L = EI2 = 1)
TABLE = {
    "weight, U+S+": (HEAVY, (0.084399719, 0.502319617)),
    "weight, U+": (HEAVY | PLANAR, (1.080050375,)),
    "curvature, U+S+": (CURVED, (0.051637215, 0.638761289)),
    "curvature, U+": (CURVED | PLANAR, (1.123089742,)),
    "shear": (NONE | {"start": "U+S-", "preset": {"left": 0.1}, "drive": "shear"}, (0.095941399,)),
    "force": (NONE | {"drive": "force"}, (20.343554908,)),
    "lift": (NONE | {"drive": "lift"}, (0.024199727,)),
    "left and half of it right": (NONE | {"drive": Drive(left=1, right=0.5)}, (0.100900607,)),
    "right": (NONE | {"start": "U+S-", "drive": "right"}, (0.065887669, 0.569205273)),
}
FALLING = {"compression": 0.30, "drive": "compression", "rate": -0.1}
LOST = {
    "both": (NONE | PLANAR | {"drive": "both"}, 1.211826175, True, True),
    "falling at .6": (
        NONE | PLANAR | FALLING | {"preset": {"left": 0.6, "right": 0.6}},
        0.0884939107 - 0.30,
        True,
        False,
    ),
    "twist": (NONE | PLANAR | {"compression": 0.30, "drive": "twist_left"}, 1.24374622, False, False),
}


def limit(values, nodes):
    coarse, fine = (np.array(of) for of in values)
    ratio = ((nodes[1] - 2) / (nodes[0] - 2)) ** 2
    return (ratio * fine - coarse) / (ratio - 1)


def folds(given, nodes):
    return limit([[fold.control for fold in der.folds(Scene(**given), nodes=n)] for n in nodes], nodes)


@pytest.mark.parametrize("name", TABLE)
def test_folds_of_any_control(name):
    given, expected = TABLE[name]
    off = np.abs(folds(given, (41, 81)) - expected) / np.maximum(1.0, expected)
    # 1 / EA moves them by some 6e-6 besides
    assert off.max() < 1e-4


@pytest.mark.slow
@pytest.mark.parametrize("name", TABLE)
def test_folds_of_any_control_closer(name):
    given, expected = TABLE[name]
    # thinner, of the same weight: 1 / EA moves them by some 1e-6
    ribbon = replace(given["ribbon"], thickness=3e-4)
    gravity = tuple(g * THIN.weight_ratio / ribbon.weight_ratio for g in given["gravity"])
    off = np.abs(folds(given | {"ribbon": ribbon, "gravity": gravity}, (101, 201)) - expected)
    assert (off / np.maximum(1.0, expected)).max() < 5e-6


@pytest.mark.parametrize("name", LOST)
def test_where_states_are_lost_at_no_fold(name):
    given, expected, subcritical, out_of_plane = LOST[name]
    result = []
    for nodes in (41, 81):
        (point,) = der.instabilities(Scene(**given), nodes=nodes)
        assert (point.kind, point.subcritical, point.out_of_plane) == ("pitchfork", subcritical, out_of_plane)
        result.append(point.control)
    assert abs(limit(result, (41, 81)) - expected) < 1e-4


def test_a_pitchfork_before_the_fold_is_told():
    both = Scene(**(NONE | PLANAR), drive="both")
    with pytest.raises(SolverError, match="branch point"):
        der.folds(both, nodes=41)
    turned = [[f.control for f in der.equilibria(both, nodes=n).folds if f.control > 0.0] for n in (41, 81)]
    assert abs(limit(turned, (41, 81))[0] - 1.331782895) < 1e-4


PRESET = {
    "left": 0.02,
    "right": -0.03,
    "twist_left": 0.05,
    "twist_right": -0.02,
    "compression": 0.01,
    "shear": -0.01,
    "lift": 0.005,
    "force": 1.0,
}


def drawn(count, seed):
    """Scenes over all controls, loads and shapes."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        drive = Drive(
            **{name: rng.uniform(0.3, 1.0) for name in rng.choice(["left", "right", "lift"], 2, False)}
        )
        idle = [name for name in CONTROLS if name not in drive.moved]
        size = {"compression": 0.02, "shear": 0.02, "lift": 0.02, "force": 2.0}
        preset = {name: size.get(name, 0.05) * rng.uniform(-1.0, 1.0) for name in rng.choice(idle, 3, False)}
        ribbon = Ribbon(curvature=tuple(rng.uniform(-1.0, 1.0, 3)), twist=rng.uniform(-0.5, 0.5))
        gravity = tuple(rng.uniform(-2.0, 2.0, 3) / ribbon.weight_ratio)
        start = ("U+S+", "U+S-")[rng.integers(2)]
        yield Scene(
            compression=0.40,
            shear=0.36,
            start=start,
            drive=drive,
            preset=preset,
            gravity=gravity,
            ribbon=ribbon,
        )


@pytest.mark.parametrize("scene", list(drawn(4, seed=271)), ids=range(4))
def test_start_states_of_drawn_scenes_against_elements(scene):
    """Two discretisations that share the statement of the problem alone."""
    reference = kirchhoff.state(scene, elements=12, extensible=True)
    nodes = (81, 161)
    states = [der.state(scene, nodes=n) for n in nodes]
    for get, bound in (
        (lambda s: s.height, 3e-6),
        (lambda s: s.slope, 1e-5),
        (lambda s: s.energy, 1e-3),
        (lambda s: s.force, 3e-3),
    ):
        assert np.abs(limit([get(s) for s in states], nodes) - get(reference)).max() < bound
    expected = kirchhoff.frequencies(scene, count=3, elements=12, extensible=True)
    result = limit([der.frequencies(scene, count=3, nodes=n) for n in nodes], nodes)
    assert np.abs(result / expected - 1.0).max() < 1e-4


@pytest.mark.parametrize("scene", list(drawn(1, seed=271)), ids=[0])
@pytest.mark.parametrize("clamp", ["centred", "two-node"])
@pytest.mark.parametrize("nodes", [21, 22])
def test_derivatives_in_controls_and_shares(scene, clamp, nodes):
    """Of the residual in the control and in the share of what acts, by differences."""
    rods = [
        Rod(replace(scene, drive=name, preset={n: x for n, x in PRESET.items() if n != name}), nodes, clamp)
        for name in CONTROLS
    ]
    loading = Loading(rods[0])
    for problem in [loading, *map(Statics, rods)]:
        # at rest: elsewhere torques turn the frames, which is left out
        state, at, h = start_state(problem.rod), float(problem is loading), 1e-5
        state, still = replace(state, at=at), np.zeros(len(problem.weight))
        sides = [problem.linearise(problem.advance(state, still, at + d), at + d) for d in (-h, h)]
        expected = (sides[1].residual - sides[0].residual) / (2.0 * h)
        slope = problem.linearise(state, at).slope
        assert np.abs(slope - expected).max() < 1e-6 * np.abs(expected).max()


def test_the_energy_is_what_the_residual_is_the_gradient_of():
    (scene,) = drawn(1, seed=271)
    problem = Statics(Rod(scene, 21))
    state = start_state(problem.rod)
    rng = np.random.default_rng(0)
    direction = rng.normal(size=len(problem.weight))
    h = 1e-4
    middle = problem.advance(state, h * direction, 0.0)
    sides = [problem.potential(problem.advance(middle, side * direction, 0.0)) for side in (-1e-6, 1e-6)]
    change = (sides[1] - sides[0]) / 2e-6
    gradient = problem.linearise(middle, 0.0).residual @ direction
    assert abs(gradient) > 1.0
    assert abs(change / gradient - 1.0) < 1e-4


def test_clamps_twist_by_more_than_half_a_turn():
    """A preset of two thirds of a turn on both ends alike is the untwisted ribbon turned about its chord."""
    scene = Scene(**(NONE | PLANAR | {"preset": {"twist_left": 4.2, "twist_right": 4.2}}))
    plain = der.state(Scene(**(NONE | PLANAR)), nodes=31)
    result = der.state(scene, nodes=31)
    c, s = np.cos(4.2), np.sin(4.2)
    turn = np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])
    assert np.abs(result.positions - plain.positions @ turn.T).max() < 1e-7
    assert abs(result.energy - plain.energy) < 1e-6


def test_right_is_the_image_of_left():
    """r(s) -> R - r(L - s): U and S change signs; with the mirror z -> -z the right clamp is the left."""
    left = Scene(compression=0.40, shear=0.37, start="U+S+")
    right = Scene(compression=0.40, shear=0.37, start="U+S-", drive="right")
    for one, other in zip(der.folds(left, nodes=41), der.folds(right, nodes=41), strict=True):
        assert np.isclose(one.control, other.control, atol=1e-9)
        assert np.isclose(one.height, other.height, atol=1e-8)


def test_a_start_that_does_not_stay_stable_is_told():
    lifted = Scene(**(NONE | {"preset": {"lift": 0.05}}))
    with pytest.raises(ValueError, match=r"lift = 0.05 is increased from 0: a fold at"):
        der.state(lifted, nodes=31)


def test_a_start_away_from_0():
    """A schedule that begins at an angle has its start there, on the curve of a ramp."""
    begun = Scene(schedule=Schedule((0.0, 1.0), (0.05, 0.2)))
    result = der.state(begun, nodes=41)
    assert result.control == 0.05
    curve = der.equilibria(Scene(), nodes=41, span=(-0.01, 0.05))
    assert abs(result.height - curve.height[-1]) < 1e-7
    assert der.folds(begun, nodes=41)[0].control == pytest.approx(
        der.folds(Scene(), nodes=41)[0].control, abs=1e-8
    )
