"""Snaps that come while the control stands still: its value tells no instant, the time does."""

import pytest

import compare
from ribbonfem import OptionError, Scene, Schedule, kirchhoff

NONE = (0.0, 0.0, 0.0)
BASE = {"compression": 0.30, "shear": 0.0, "start": "U+", "damping": 0.0, "gravity": NONE}


def release():
    """A beam held by a force beyond its fold, and let go."""
    fold = kirchhoff.folds(Scene(**BASE), elements=12, extensible=True)[0].control
    let_go = Schedule((0, 0, 8), (-0.06, 0, 0), "linear")
    return Scene(**BASE, preset={"left": fold + 1e-3}, drive="force", schedule=let_go)


def held():
    """A ramp that stops a little beyond the fold, where the beam snaps."""
    fold = kirchhoff.folds(Scene(**BASE), elements=12, extensible=True)[0].control
    return Scene(**{**BASE, "damping": 2.0}, rate=1.0, stop=fold + 0.02, hold=5.0)


def test_a_ramp_that_snaps_while_it_is_held_does_so_at_its_stop():
    scene = held()
    answer = compare.choose(scene, 1e-3).run()
    assert answer.met
    assert answer.value == pytest.approx(scene.stop, abs=answer.error + 1e-12)


def test_the_control_tells_no_instant():
    scene = release()
    told = r"quantity = 'snap': the control stands still when it comes, at .* s.*'snap time' does"
    with pytest.raises(OptionError, match=told):
        compare.choose(scene, 1e-3).run()
    meshes = {"over": {"elements": [6, 8]}, "reference": 0.0}
    with pytest.raises(OptionError, match=told):
        compare.convergence("kirchhoff", scene, "snap", **meshes)
    coarse, fine = compare.convergence("kirchhoff", scene, "snap time", **meshes).values
    assert coarse == pytest.approx(fine, rel=1e-2)


def test_a_moving_control_tells_it_beside_a_rest():
    scene = Scene(**BASE, schedule=Schedule((0, 1, 2, 4), (0, 0.5, 0.5, 1.5), "linear"))
    run = kirchhoff.simulate(scene, elements=6, tolerance=1e-4)
    assert run.stands_still(1.5)
    assert not run.stands_still(run.snap[0])
