"""Close to a pitchfork, and at it: folds of the curve that it is unfolded into, and the states there."""

from dataclasses import replace

import numpy as np
import pytest

import der
from der.problem import default_steps
from der.rod import Rod
from ribbonfem import Ribbon, Scene, SceneError, elastica, kirchhoff
from ribbonfem.continuation import Steps, first_point, trace
from ribbonfem.ends import Ends

STEEL = Ribbon(length=0.18, width=0.012, thickness=0.0002, young=200e9, density=7850, poisson=0.3)
STRIP = Scene(compression=0.25, shear=0.25, start="U+S+", ribbon=STEEL)
UNBROKEN, BROKEN, MERGED = ("U+", "U-"), ("U+S+", "U+S-", "U-S+", "U-S-"), ("S+", "S-")
FINE = Steps(first=2e-3, largest=0.02)


@pytest.mark.parametrize(
    ("shear", "angles"),
    [(0.2466, (3.7079e-5, 0.627460509)), (0.2464, (2.8742e-6, 0.627970813)), (0.38444, (5.8884e-5,))],
)
@pytest.mark.parametrize("steps", [None, Steps(0.01, 0.1), Steps(1e-3, 0.02), Steps(0.04, 0.4)])
def test_both_turns_inside_a_step_are_found(shear, angles, steps):
    result = kirchhoff.folds(replace(STRIP, shear=shear), elements=16, steps=steps)
    assert [fold.angle for fold in result] == pytest.approx(angles, rel=2e-4, abs=1e-9)


def fork_of_rods(compression, nodes):
    """The shear at which the planar rod's symmetric states lose their stability."""
    rod = Rod(Scene(compression=compression, shear=0.1, start="U+"), nodes, "centred")
    problem = der.states.Statics(rod, Ends.varying("dW", rod.scene.compression, 0.0))
    first = first_point(problem, der.states.planar(rod), 0.0, 1.0)
    for segment in trace(problem, first, (-0.1, 0.9 * np.sqrt(2.0 * compression)), Steps(largest=0.1), 8):
        if segment.events:
            return segment.events[0].point.parameter
    raise AssertionError("no fork")


def scenes_near_forks(count):
    """Seeded: scenes within 1e-6 to 1e-3 of a pitchfork, on the side on which their start is stable."""
    generator = np.random.default_rng(33)
    for k in range(count):
        compression = float(generator.uniform(0.15, 0.55))
        ribbon = (Ribbon(), STEEL, Ribbon(thickness=float(10 ** generator.uniform(-2.7, -1.7))))[k % 3]
        away = float(10 ** generator.uniform(-6.0, -3.0))
        if k % 4 == 3:
            shear, start = fork_of_rods(compression, 31) * (1.0 + away), "U+S+"
            yield der, Scene(compression=compression, shear=shear, start=start), {"nodes": 31}
            continue
        forks = kirchhoff.pitchforks(compression, ribbon=ribbon, elements=8)
        if k % 4 == 2:
            shear, start = forks.merged * (1.0 - away), "U+S+"
        else:
            shear, start = forks.broken * (1.0 + away), ("U+S+", "U+S-")[k % 2]
        scene = Scene(compression=compression, shear=shear, start=start, ribbon=ribbon)
        yield kirchhoff, scene, {"elements": 8}


def test_steps_ten_times_finer_change_no_fold_near_a_pitchfork():
    for model, scene, mesh in scenes_near_forks(12):
        fine = replace(default_steps(Rod(scene, 31, "centred")), first=2e-3, largest=0.02)
        expected = model.folds(scene, steps=FINE if model is kirchhoff else fine, **mesh)
        result = model.folds(scene, **mesh)
        # (a fold this close to alpha = 0 moves with the last digits of the shear)
        assert [f.angle for f in result] == pytest.approx([f.angle for f in expected], rel=1e-4, abs=1e-8)


def test_every_state_is_there_at_the_shears_of_the_pitchforks():
    """S is smooth where U is restored: its energies at .5694 and .5695 are 24.1489 and 24.1534."""
    scene = Scene(compression=0.4, shear=0.3, start="U+")
    forks = kirchhoff.pitchforks(0.4)
    restored = kirchhoff.state(replace(scene, shear=forks.restored, start="S+"))
    ends = [kirchhoff.state(replace(scene, shear=dw, start="S+")).energy for dw in (0.5694, 0.5695)]
    assert ends == pytest.approx([24.1489, 24.1534], abs=6e-5)
    part = (forks.restored - 0.5694) / 1e-4
    assert restored.energy == pytest.approx(ends[0] + part * (ends[1] - ends[0]), abs=1e-6)
    for elements in (16, 20, 32):
        tip = kirchhoff.pitchforks(0.4, elements=elements).merged
        assert kirchhoff.state(replace(scene, shear=tip, start="S+"), elements=elements).name == "S+"
    assert kirchhoff.state(replace(scene, shear=forks.restored * (1 + 1e-9), start="U+")).name == "U+"
    # a hair's breadth below and above the shears that `pitchforks` has given
    wide = Scene(compression=0.7, shear=0.372728601, start="U+")
    assert kirchhoff.stable_states(wide) == UNBROKEN
    assert kirchhoff.stable_states(replace(scene, shear=0.333103130)) == BROKEN


def test_at_a_pitchfork_the_states_of_one_side_are_stable():
    """Seeded, from 0 to 1e-3 away: which is told by the side, and each of them is had by its name."""
    generator = np.random.default_rng(34)
    sides = {
        "broken": (UNBROKEN, BROKEN),
        "merged": (BROKEN, MERGED),
        "restored": (MERGED, UNBROKEN + MERGED),
    }
    for k in range(6):
        ribbon = (Ribbon(), STEEL, Ribbon(bending_ratio=float(10 ** generator.uniform(1.0, 3.0))))[k // 2]
        compression, mesh = float(generator.uniform(0.1, 0.7)), {"elements": (8, 12)[k % 2]}
        forks = kirchhoff.pitchforks(compression, ribbon=ribbon, **mesh)
        fork = tuple(sides)[k % 3]
        at = getattr(forks, fork)
        if at is None or (fork == "merged" and (forks.restored or 1.0) < at):
            continue
        for away in (0.0, generator.choice((-1.0, 1.0)) * 10 ** generator.uniform(-12.0, -3.0)):
            scene = Scene(compression=compression, shear=float(at * (1.0 + away)), start="U+", ribbon=ribbon)
            result = kirchhoff.stable_states(scene, **mesh)
            assert result in (sides[fork] if abs(away) < 1e-9 else (sides[fork][int(away > 0.0)],))
            for start in ("U+", "U+S-", "S+"):
                if start in result:
                    assert kirchhoff.state(replace(scene, start=start), **mesh).name == start
                else:
                    with pytest.raises(SceneError, match="not a stable equilibrium"):
                        kirchhoff.state(replace(scene, start=start), **mesh)


@pytest.mark.parametrize("nodes", [31, 51])
def test_rods_have_their_states_at_their_pitchfork(nodes):
    at = fork_of_rods(0.25, nodes)
    for away in (-1e-9, -1e-12, 0.0, 1e-12, 1e-9, 1e-6):
        scene = Scene(compression=0.25, shear=at * (1.0 + away), start="U+")
        result = der.stable_states(scene, nodes=nodes)
        assert result in (UNBROKEN, BROKEN) if away < 1e-6 else result == BROKEN


@pytest.mark.parametrize("model", [elastica, kirchhoff])
@pytest.mark.parametrize("drive", ["force", "both"])
def test_a_branch_point_at_which_nothing_converges_is_closed_in_on(model, drive):
    """Newton does not end at the point itself, on some meshes: places beside it serve."""
    for compression in (0.10, 0.15, 0.22, 0.25, 0.275, 0.30):
        scene = Scene(compression=compression, shear=0.0, start="U+", drive=drive, gravity=(0.0, 0.0, 0.0))
        met = [model.instabilities(scene, elements=count)[0].control for count in (12, 16)]
        assert met[0] == pytest.approx(met[1], rel=3e-7)


def test_a_ramp_goes_on_beyond_the_tip_of_a_fork_on_every_mesh():
    """The curve ends there in the symmetric one; J is singular, and what it gave alone was rounding."""
    pulled = Scene(compression=0.35, shear=0.40, start="U+S+", drive="compression", rate=-0.1)
    assert [der.instabilities(pulled, nodes=n) for n in (81, 131, 151, 201)] == [()] * 4
    pushed = Scene(compression=0.3202, shear=0.34456, start="U+S+", drive="compression", rate=0.1)
    (fork,) = kirchhoff.instabilities(pushed, elements=16, extensible=True)
    for nodes in (101, 131, 151):
        (of_rods,) = der.instabilities(pushed, nodes=nodes)
        assert of_rods.kind == fork.kind == "pitchfork"
        # rods err as the square of an edge
        assert (of_rods.control - fork.control) * (nodes - 2) ** 2 == pytest.approx(-7.29, rel=0.02)
