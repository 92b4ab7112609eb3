"""No number for a question that has none, and no confidence that was not earned."""

import math
from dataclasses import replace

import numpy as np
import pytest

import der
from compare.chooser.choice import choose
from ribbonfem import (
    Fold,
    History,
    OptionError,
    Ribbon,
    Scene,
    SceneWarning,
    elastica,
    kirchhoff,
    quasilinear,
)

PATH_2 = Scene(compression=0.4, shear=0.40, start="U+S+", rate=1.0, stop=0.6, damping=10.0)


def made(height, **fields):
    time = np.linspace(0.0, 1.0, len(height))
    return History(time, 0.1 * time, height, height, {}, {}, {}, Scene(), **fields)


def test_rounding_crosses_nothing():
    rng = np.random.default_rng(1)
    for _ in range(300):
        level = rng.uniform(-1.0, 1.0)
        noise = rng.uniform(-1e-6, 1e-6, 50)
        assert made(level + noise).crossing("height", level) is None
        # noise at rest, then a real crossing
        departure = 10.0 ** rng.uniform(-5, 0)
        real = np.concatenate((noise, departure * np.cos(np.linspace(0.0, 2.0, 50))))
        time, _ = made(level + real).crossing("slope", level)
        assert 0.5 < time < 1.0


def test_rows_that_lie_close_do_not_spoil_a_crossing():
    rng = np.random.default_rng(2)
    for _ in range(300):
        root = rng.uniform(0.3, 0.7)
        time = np.sort(np.concatenate((np.linspace(0.0, 1.0, 21), root + 10.0 ** rng.uniform(-16, -3, 2))))
        time = np.unique(time)
        height = np.sin(root - time) + rng.uniform(-1, 1, len(time)) * 1e-15
        run = History(time, time, height, height, {}, {}, {}, Scene())
        assert run.crossing()[0] == pytest.approx(root, abs=2e-6)


@pytest.mark.parametrize("shear", [0.495, 0.52])
@pytest.mark.parametrize("start", ["S+", "S-"])
def test_a_state_without_a_u_does_not_snap_by_rounding(shear, start):
    scene = Scene(compression=0.40, shear=shear, start=start, rate=0.5, stop=0.2)
    if start not in der.stable_states(scene, nodes=31):
        pytest.skip("not a stable state")
    whole = der.simulate(scene, nodes=31, configurations=False)
    early = der.simulate(scene, nodes=31, configurations=False, until="snap")
    result = whole.crossing()
    assert abs(whole.height[0]) < 1e-6
    assert result is None or abs(whole.height[whole.time < result[0]]).max() > 1e-6
    # a run until the snap is the beginning of the whole one
    assert early.crossing() == result
    with pytest.raises(OptionError, match="quantity = 'snap': needs a start with U"):
        choose(scene, 1e-3)


@pytest.mark.parametrize(("start", "quantity"), [("U+", "first snap"), ("S+", "first snap"), ("S-", "snap")])
def test_quantities_that_a_start_has_not(start, quantity):
    with pytest.raises(OptionError, match=quantity):
        choose(Scene(compression=0.4, shear=0.3, start=start, rate=0.1), 1e-3, quantity)


def test_runs_end_on_the_stop_and_not_by_a_step_of_rounding():
    rng = np.random.default_rng(5)
    for k in range(240):
        model, mesh = (
            (der, {"nodes": 11}),
            (elastica, {"elements": 4}),
            (quasilinear, {"elements": 4}),
        )[k % 3]
        rate, stop = 10.0 ** rng.uniform(-2, 2), rng.uniform(0.01, 0.5)
        length = 10.0 ** rng.uniform(-2, 1)
        ribbon = Ribbon(length=length, width=0.2 * length, thickness=0.01 * length)
        scene = Scene(
            compression=0.3, shear=0.0, start="U+", rate=rate, stop=stop, damping=1.0, ribbon=ribbon
        )
        count = int(rng.integers(3, 400)) if rng.random() < 0.5 else rng.uniform(3, 400)
        options = {"step": stop / rate / count} if k % 4 < 2 else {"tolerance": 1e-3}
        hold = {} if k % 5 else {"hold": stop / rate * 10.0 ** rng.uniform(-18, -13)}
        run = model.simulate(replace(scene, **hold), **mesh, **options)
        steps = np.diff(run.time)
        assert steps.min() > 1e-8 * run.time[-1]
        assert steps[-1] > 1e-5 * np.median(steps)
        assert run.angle[-1] == pytest.approx(stop, rel=1e-14)


def test_many_equal_steps_land_on_the_stop():
    """A hundred thousand steps, whose rounding adds up to more than a thousandth part of a millionth."""
    scene = Scene(compression=0.3, shear=0.0, start="U+", rate=1.0, stop=0.1)
    step = 0.1 / 99991
    run = quasilinear.simulate(scene, elements=4, method="implicit-euler", step=step)
    assert len(run) == 99992
    rods = der.simulate(scene, nodes=7, method="implicit-euler", step=step, configurations=False, every=99990)
    assert rods.stats["steps"] == 99991


def test_folds_of_another_scene_model_or_mesh():
    run = der.simulate(PATH_2, nodes=31, configurations=False)
    folds = der.folds(PATH_2, nodes=31)
    assert der.modes.classify(run, folds).kind
    # another ramp has the same folds
    assert der.modes.classify(run, der.folds(replace(PATH_2, rate=0.3, stop=None), nodes=31)).kind
    bare = tuple(Fold(fold.angle, fold.height, fold.load) for fold in folds)
    assert der.modes.classify(run, bare) == der.modes.classify(run, folds)
    for name, others in (
        ("nodes", der.folds(PATH_2, nodes=41)),
        ("clamp", der.folds(PATH_2, nodes=31, clamp="two-node")),
        ("model", kirchhoff.folds(PATH_2)),
        ("shear", der.folds(replace(PATH_2, shear=0.41), nodes=31)),
        ("shear", (bare[0], der.folds(replace(PATH_2, shear=0.41), nodes=31)[1])),
        ("compression", der.folds(replace(PATH_2, compression=0.38), nodes=31)),
        ("ribbon", der.folds(replace(PATH_2, ribbon=Ribbon(thickness=0.009)), nodes=31)),
    ):
        with pytest.raises(ValueError, match=rf"folds\[\d\]: {name} = "):
            der.modes.classify(run, others)
    for nonsense in (None, 3, (1, 2), "ab", [None, None]):
        with pytest.raises(ValueError, match="folds = "):
            der.modes.classify(run, nonsense)


@pytest.mark.slow
def test_a_fold_near_the_taut_end_is_refined_until_it_is_met():
    """A thin, nearly taut ribbon: the default mesh is off by hundredths of a radian."""
    scene = Scene(compression=0.2178, shear=0.6106, start="S+", ribbon=Ribbon(thickness=0.00097))
    exact = kirchhoff.folds(scene, extensible=True, elements=320)[-1].angle
    assert abs(kirchhoff.folds(scene, extensible=True)[-1].angle - exact) > 1e-3
    for tolerance in (1e-2, 1e-3, 1e-4):
        answer = choose(scene, tolerance, "fold").run()
        assert answer.met
        assert abs(answer.value - exact) < tolerance


def test_an_error_that_is_too_large_is_said():
    """None of the meshes settles this fold to 1e-9: its error is what the last two meshes show."""
    scene = Scene(compression=0.30, shear=0.60, start="S+", ribbon=Ribbon(thickness=0.002))
    loose = choose(scene, 1e-3, "fold").run()
    assert loose.met
    assert 0.0 < loose.error <= 1e-3
    assert len(loose.runs) >= 3
    assert abs(loose.runs[-1].value - loose.runs[-2].value) <= loose.error


def test_a_smooth_snap_is_not_sensitive():
    """Its limit by seven meshes: 0.6064301."""
    scene = Scene(compression=0.40, shear=0.37, start="U+S-", rate=0.1, damping=1.0)
    answer = choose(scene, 1e-5).run()
    assert not answer.sensitive
    assert answer.met
    assert abs(answer.value - 0.6064301) < 2e-6
    assert abs(answer.value - 0.6064301) < answer.error


def test_nothing_is_claimed_of_a_stop_that_is_none():
    with pytest.warns(SceneWarning):
        scene = Scene(stop=400.0)
    assert scene.stop == 400.0
    assert math.isnan(elastica.leaves_plane(Scene(compression=0.3, shear=0.0, start="U+")))
