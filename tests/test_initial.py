"""Motions that begin elsewhere than at the scene's start: what is followed, and so what is a snap."""

from __future__ import annotations

import pytest

import der
from compare.archive import load, save
from ribbonfem import OptionError, Ribbon, Scene, Schedule, elastica, kirchhoff, quasilinear

NONE = (0.0, 0.0, 0.0)
PLANAR = {"compression": 0.40, "shear": 0.0, "start": "U+", "gravity": NONE}
SHEARED = {"compression": 0.40, "shear": 0.37, "gravity": NONE}
MESHES = {kirchhoff: {"elements": 6}, elastica: {"elements": 6}, quasilinear: {}, der: {"nodes": 31}}


def still(at, seconds=3.0):
    return Schedule((0.0, seconds), (at, at))


@pytest.mark.parametrize("model", [kirchhoff, elastica, der])
def test_a_state_let_go_beyond_its_fold_snaps(model, tmp_path):
    """Nothing at rest is there to be followed, so that every passage counts; the start is none there."""
    mesh, base = MESHES[model], {**PLANAR, "compression": 0.3}
    at = model.folds(Scene(**base), **mesh)[0].control + 1e-3
    held = Scene(**base, preset={"left": at}, drive="force", schedule=Schedule((0, 1), (-0.06, 0.0)))
    state = model.state(held, **mesh) if model is not der else der.state(held, **mesh)
    given = {"initial": state, "tolerance": 1e-4, **mesh}
    scene = Scene(**base, damping=0.0, schedule=still(at))
    run = model.simulate(scene, **given)
    assert run.snap is not None
    assert run.snap == run.crossing()
    assert (run.snaps_from, run.rest) == (0.0, {})
    kept = load(save(run, tmp_path / "run.zip"))
    assert (kept, kept.snap, kept.snaps_from) == (run, run.snap, 0.0)
    ended = model.simulate(scene, **given, until="snap")
    assert run.snap[0] < ended.time[-1] < run.snap[0] + 0.2


def test_a_state_that_is_an_equilibrium_is_followed_whatever_the_start_is(tmp_path):
    """U+S- has one fold, further than the first of U+S+, which the scene names."""
    moved = Schedule((0.0, 1.0), (0.0, 0.9))
    scene = Scene(**SHEARED, start="U+S+", schedule=moved, damping=5.0)
    state = kirchhoff.state(Scene(**SHEARED, start="U+S-"), elements=6)
    run = kirchhoff.simulate(scene, elements=6, tolerance=1e-4, initial=state)
    own = kirchhoff.folds(Scene(**SHEARED, start="U+S-"), elements=6)[0].control
    assert moved(run.snaps_from) == pytest.approx(own, abs=1e-8)
    assert run.snap == run.crossing()
    kept = load(save(run, tmp_path / "run.zip"))
    assert kept.snaps_from == run.snaps_from


@pytest.mark.parametrize("model", list(MESHES))
def test_what_is_gone_on_from_follows_what_it_is_about(model):
    """Before the fold the same one is met, beyond it every passage counts, after the snap that of U-."""
    options = {**MESHES[model], "tolerance": 1e-4}
    base = {**PLANAR, "damping": 2.0}
    fold = model.folds(Scene(**base), **MESHES[model])[0].control

    def moved(*points, **given):
        times, values = zip(*points, strict=True)
        schedule = Schedule(times, values, "linear")
        return model.simulate(Scene(**base, schedule=schedule), **options, **given)

    before = moved((0, 0), (2, 0.8))
    second = moved((0, 0.8), (1, fold + 0.3), initial=before)
    assert second.snaps_from == pytest.approx(2.0 + (fold - 0.8) / (fold - 0.5), abs=1e-6)
    # on the way, beyond the fold and above the clamps still; the start is unstable there
    beyond = moved((0, 0), (1, fold + 0.1))
    assert beyond.crossing() is None
    third = moved((0, fold + 0.1), (2, fold + 0.1), initial=beyond)
    assert third.snaps_from == 1.0
    assert third.snap is not None
    # on the other side, come to rest: no new snap further on, and one back, at the fold of that side
    down = moved((0, fold + 0.1), (6, fold + 0.1), initial=third)
    assert down.snap is None
    further = moved((0, fold + 0.1), (0.5, fold + 0.2), initial=down)
    assert further.snap is None
    back = moved((0, fold + 0.1), (4, -fold - 0.3), initial=down)
    passed = (2 * fold + 0.1) / (2 * fold + 0.4) * 4.0
    assert back.snaps_from - back.begun == pytest.approx(passed, abs=1e-5)
    assert back.snap is not None
    assert back.snap[1] < -fold


@pytest.mark.parametrize("model", [elastica, kirchhoff, der])
def test_opposed_clamps_take_the_height_through_0_at_rest_in_what_is_gone_on_from_too(model):
    base = {**PLANAR, "drive": "opposed", "damping": 5.0}
    options = {**MESHES[model], "tolerance": 1e-4}
    first, second = Schedule((0, 2), (0, 0.1), "linear"), Schedule((0, 4), (0.1, 2.5), "linear")
    begun = model.simulate(Scene(**base, schedule=first), **options)
    rest = model.simulate(Scene(**base, schedule=second), initial=begun, **options, until="snap")
    assert rest.rest
    assert rest.crossing() is not None
    assert rest.snap is None
    assert rest.control[-1] == 2.5


@pytest.mark.parametrize("model", [kirchhoff, elastica, der])
@pytest.mark.parametrize(
    ("other", "named"),
    [
        ({"bending_ratio": 100.0}, r"Ribbon\.bending_ratio is 100\.0, and that of the scene 400\.0"),
        ({"twist_ratio": 2.0}, r"Ribbon\.twist_ratio is 2\.0, and that of the scene 1\.4562"),
        ({"curvature": 0.5}, r"Ribbon\.curvature is 0\.5, and that of the scene 0\.0"),
        ({"thickness": 0.02}, r"Ribbon\.thickness is 0\.02, and that of the scene 0\.01"),
    ],
)
def test_a_state_of_another_ribbon_is_refused(model, other, named):
    scene = Scene(**PLANAR, rate=0.1, stop=0.01)
    mesh = {kirchhoff: {"elements": 4}, elastica: {"elements": 4}, der: {"nodes": 15}}[model]
    state = model.state(Scene(**PLANAR, ribbon=Ribbon(**other)), **mesh)
    with pytest.raises(OptionError, match=named):
        model.simulate(scene, initial=state, **mesh)


def test_a_state_does_not_depend_on_density_modulus_and_retardation():
    other = Ribbon(density=500.0, young=3e8, retardation=0.01)
    state = kirchhoff.state(Scene(**PLANAR, ribbon=other), elements=4)
    scene = Scene(**PLANAR, rate=0.1, stop=0.01)
    given = kirchhoff.simulate(scene, initial=state, elements=4)
    named = kirchhoff.simulate(scene, elements=4)
    assert given.height[-1] == pytest.approx(named.height[-1], abs=1e-12)


@pytest.mark.parametrize("stretches", [False, True])
@pytest.mark.parametrize("base", [{**PLANAR}, {**SHEARED, "start": "U+S-"}], ids=["planar", "sheared"])
def test_a_state_that_stretches_is_begun_at_by_a_ribbon_that_does(base, stretches):
    state = kirchhoff.state(Scene(**base), elements=6, extensible=stretches)
    scene = Scene(**base, rate=0.02, stop=0.01)
    kirchhoff.simulate(scene, initial=state, elements=6, extensible=stretches)
    named = rf"it is of extensible={stretches}, and here extensible={not stretches}"
    with pytest.raises(OptionError, match=named):
        kirchhoff.simulate(scene, initial=state, elements=6, extensible=not stretches)


def test_a_model_without_states_at_rest_says_what_it_goes_on_from():
    scene = Scene(**PLANAR, rate=0.1, stop=0.01)
    for given in (elastica.state(scene, elements=4), 3):
        with pytest.raises(OptionError, match=r"initial = .*: a History of quasilinear\.simulate is needed"):
            quasilinear.simulate(scene, initial=given)
