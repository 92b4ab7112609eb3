import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

import compare
import der
from compare.chooser import levels, references, refinement
from compare.chooser.choice import FLAT, choose, stays_planar
from compare.chooser.cost_laws import beam_units, shipped
from compare.chooser.random_scenes import random_scene
from compare.chooser.strategies import Known
from compare.limits import limit_of
from compare.studies import choices
from ribbonfem import Ribbon, Scene, SceneError, elastica, kirchhoff
from ribbonfem.delay import universal
from ribbonfem.options import OptionError

PLANAR = Scene(compression=0.40, shear=0.0, start="U+", rate=0.1, damping=1.0)
VIBRATING = Scene(compression=0.40, shear=0.40, start="U+S+", rate=0.01, damping=0.1)


def rod_limit(scene, meshes=(51, 101), tolerance=1e-5):
    return limit_of([references.rod(scene, n, tolerance) for n in meshes], meshes)[0]


def test_choose_is_public():
    assert compare.choose is choose
    assert compare.choose(PLANAR, 1e-3).value == choose(PLANAR, 1e-3).value


@pytest.mark.parametrize(
    ("compression", "rate", "damping"), [(0.40, 0.1, 1.0), (0.05, 3e-3, 30.0), (0.25, 0.03, 0.05)]
)
def test_predicted_snaps_are_those_of_rods(compression, rate, damping):
    scene = Scene(compression=compression, shear=0.0, start="U+", rate=rate, damping=damping)
    chosen = choose(scene, 5e-4)
    assert chosen.model == "prediction"
    answer = chosen.run()
    assert answer.met
    assert not answer.runs
    assert answer.seconds < 0.1
    assert abs(answer.value - rod_limit(scene)) < max(answer.error, 2e-5)


def test_the_mirror_image_snaps_at_the_opposite_angle():
    mirrored = Scene(compression=0.40, shear=0.0, start="U-", rate=-0.1, damping=1.0, stop=-2.0)
    assert choose(mirrored, 1e-3).run().value == -choose(PLANAR, 1e-3).run().value


def test_a_ramp_that_stops_early_has_no_snap():
    answer = choose(Scene(compression=0.40, shear=0.0, start="U+", stop=1.0), 1e-3).run()
    assert answer.value is None
    assert answer.met


def test_where_no_law_was_measured_runs_check_each_other():
    scene = Scene(compression=0.40, shear=0.0, start="U+", rate=0.1, damping=0.0)
    chosen = choose(scene, 1e-3)
    assert chosen.model == "elastica"
    assert "nu t*" in chosen.reason
    answer = chosen.run()
    assert answer.met
    assert len(answer.runs) >= 2
    assert abs(answer.value - rod_limit(scene)) < 1e-3


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"gravity": (0, 0, -1)}, "no law was measured with weight: "),
        ({"drive": "both", "preset": {"lift": 0.01}}, "no law was measured with presets, drive = 'both': "),
        ({"ribbon": Ribbon(retardation=0.1)}, "no law was measured with retardation: "),
        ({}, "no law was measured of the snap time: "),
    ],
)
def test_a_reason_names_what_no_law_was_measured_with(options, told):
    scene = Scene(compression=0.40, shear=0.37, start="U+S+", **options)
    assert choose(scene, 1e-3, "snap time").reason.startswith(told)


def test_the_motion_takes_a_run_and_a_tighter_one_is_finer():
    scene = Scene(compression=0.20, shear=0.0, start="U+", rate=0.1, stop=1.2)
    other = kirchhoff.simulate(scene, elements=12, extensible=True, tolerance=1e-7, until="snap")
    meshes = []
    for tolerance in (1e-2, 1e-5, 1e-6):
        answer = choose(scene, tolerance, motion=True).run()
        assert answer.history is not None
        assert answer.history.model == "elastica"
        assert abs(answer.value - other.crossing()[1]) <= answer.error <= tolerance
        meshes.append((answer.runs[-1].options["elements"], -answer.runs[-1].options["tolerance"]))
    assert meshes[0] < meshes[1] < meshes[2]


def test_ribbons_are_refined_until_they_settle():
    scene = Scene(compression=0.40, shear=0.37, start="U+S-", rate=0.1, damping=1.0)
    fine = rod_limit(scene, (101, 151, 201), 1e-6)
    # rods share no mechanics with what is chosen: one run, whose error was measured
    for tolerance in (3e-4, 1e-5, 2e-6, 4e-7):
        answer = choose(scene, tolerance).run()
        assert answer.met
        assert answer.runs[0].model == "kirchhoff"
        assert len(answer.runs) == 1
        assert answer.error <= tolerance
        assert abs(answer.value - fine) < answer.error + 3e-6
    # of so thin a ribbon nothing was measured: a finer run checks it
    other = replace(scene, ribbon=Ribbon(thickness=0.003))
    assert len(choose(other, 3e-4).run().runs) == 2


def test_a_stop_at_the_snap_itself_is_called_sensitive():
    ribbon = Scene(compression=0.40, shear=0.37, start="U+S-", rate=0.1, damping=1.0)
    snap = choose(ribbon, 3e-4).run().value
    before = choose(replace(ribbon, stop=snap - 0.1), 1e-3).run()
    assert (before.value, before.sensitive) == (None, False)
    # the coarse meshes snap before this stop, and their limit at it
    assert choose(replace(ribbon, stop=snap - 1e-5), 1e-3).run().sensitive
    # these do too, but not their limit
    late = choose(replace(ribbon, stop=snap - 1.2e-3), 1e-3).run()
    assert late.sensitive or late.value is None
    assert choose(replace(ribbon, stop=snap + 0.01), 1e-3).run().met


def test_a_vibration_is_called_sensitive():
    # the elements settle what takes rods many nodes ...
    assert choose(VIBRATING, 1e-3).run().met
    # ... and tell where nothing settles
    answer = choose(replace(VIBRATING, rate=0.0193, damping=0.226), 1e-3).run()
    assert answer.sensitive
    assert not answer.met
    assert answer.error > 1e-3


def test_folds_without_a_motion():
    scene = Scene(compression=0.37, shear=0.0, start="U+")
    (fold,) = elastica.folds(scene, extensible=True)
    tabulated, computed = (choose(scene, tolerance, "fold") for tolerance in (1e-4, 1e-6))
    assert (tabulated.model, computed.model) == ("prediction", "elastica")
    assert abs(tabulated.run().value - fold.angle) < 5e-6
    assert computed.run().value == fold.angle
    assert choose(Scene(shear=0.40), 1e-4, "fold").model == "kirchhoff"


@pytest.mark.parametrize(
    ("arguments", "options", "error", "message"),
    [
        ((PLANAR, -1.0), {}, OptionError, "tolerance = -1.0"),
        ((PLANAR, 1e-3, "energy"), {}, OptionError, "quantity = 'energy'"),
        ((PLANAR, 1e-3, "first snap"), {}, OptionError, "quantity = 'first snap'"),
        ((PLANAR, 1e-3), {"motion": True}, SceneError, "stop"),
        ((PLANAR, 1e-3), {"motion": 1}, OptionError, "motion"),
    ],
)
def test_what_cannot_be_asked_for(arguments, options, error, message):
    with pytest.raises(error, match=message):
        choose(*arguments, **options)


def test_a_start_that_does_not_exist_is_named():
    with pytest.raises(SceneError, match=r"U\+S\+"):
        choose(Scene(compression=0.40, shear=0.05), 1e-3).run()


def test_soft_in_twist_it_leaves_the_plane():
    soft = Ribbon(twist_ratio=0.4)
    scene = Scene(compression=0.55, shear=0.0, start="U+", rate=0.1, ribbon=soft)
    assert not stays_planar(scene)
    for quantity in ("snap", "fold"):
        with pytest.raises(SceneError, match="unstable out of its plane"):
            choose(scene, 1e-3, quantity)
    # a ramp that stops before stays planar
    leaves = elastica.leaves_plane(scene, extensible=True)
    assert choose(replace(scene, stop=0.9 * leaves), 1e-2).run().value is None
    assert stays_planar(Scene(compression=0.20, shear=0.0, start="U+", ribbon=soft))


@pytest.mark.parametrize("compression", [0.1, 0.35, FLAT[0]])
def test_the_bound_of_planar_stability_is_safe(compression):
    _, bending, twisting = FLAT
    ribbon = Ribbon(bending_ratio=bending, twist_ratio=twisting)
    scene = Scene(compression=compression, shear=0.0, start="U+", rate=1.0, ribbon=ribbon)
    assert math.isnan(elastica.leaves_plane(scene, extensible=True))
    assert math.isnan(der.leaves_plane(scene, nodes=31))


@pytest.mark.parametrize(("compression", "thickness"), [(0.03, 0.02), (0.2, 0.01), (0.47, 0.003)])
def test_tabulated_normal_forms(compression, thickness):
    scene = Scene(compression=compression, shear=0.0, start="U+", ribbon=Ribbon(thickness=thickness))
    (form,) = elastica.normal_forms(scene, elements=16, extensible=True)
    tabulated = shipped().planar.fold(scene)
    assert abs(tabulated.angle - form.angle) < 3e-6
    assert abs(tabulated.product / form.product - 1.0) < 1e-5
    for rate, damping in ((1e-3, 0.1), (0.1, 30.0)):
        lag = damping * (form.product * rate) ** -0.2
        delay = rate * (form.product * rate) ** -0.2 * universal(lag)
        assert abs(shipped().planar.delay(form, rate, damping) / delay - 1.0) < 1e-5


def test_laws_say_where_they_end():
    laws = shipped().planar
    assert not laws.outside(PLANAR)
    assert "dL/L" in laws.outside(Scene(compression=0.6, shear=0.0, start="U+"))
    assert "rate" in laws.outside(Scene(compression=0.4, shear=0.0, start="U+", rate=30.0))
    assert "EA" in laws.outside(
        Scene(compression=0.4, shear=0.0, start="U+", rate=0.3, ribbon=Ribbon(thickness=0.05))
    )
    # in the beam's own units the material and the length drop out
    long = Ribbon(length=10.0, width=2.0, thickness=0.1, young=2e9)
    other = Scene(compression=0.4, shear=0.0, start="U+", rate=0.02, ribbon=long)
    assert math.isclose(beam_units(other)[3], beam_units(PLANAR)[3])
    same = Scene(
        compression=0.4,
        shear=0.0,
        start="U+",
        rate=0.1 * PLANAR.ribbon.inertial_time / long.inertial_time,
        damping=PLANAR.ribbon.inertial_time / long.inertial_time,
        ribbon=long,
    )
    assert math.isclose(laws.predict(same).angle, laws.predict(PLANAR).angle, rel_tol=1e-12)


def test_the_limit_of_meshes():
    meshes = (31, 51, 76)
    square = 1.0 / (np.array(meshes) - 2.0) ** 2
    two, three = 0.5 + 2.0 * square[:2], 0.5 + 2.0 * square + 30.0 * square**2
    assert math.isclose(limit_of(two.tolist(), meshes[:2])[0], 0.5, abs_tol=1e-12)
    limit, error = limit_of(three.tolist(), meshes)
    assert math.isclose(limit, 0.5, abs_tol=1e-12)
    # the fourth order, which two meshes cannot see, is inside of what they claim
    wrong, claimed = limit_of(three[1:].tolist(), meshes[1:])
    assert 0.0 < abs(wrong - 0.5) < claimed
    assert error < claimed
    with pytest.raises(ValueError, match="two or more"):
        limit_of([0.5], (31,))


def test_snaps_that_meshes_do_not_share_are_not_extrapolated():
    rods = refinement._Rods(VIBRATING, "snap", 1e-4, False)
    rods.meshes, rods.values = [31, 51, 76], [0.4, None, 0.41]
    assert rods.limit() == (None, math.inf)
    rods.values = [None, None, None]
    assert rods.limit() == (None, 0.0)
    rods.meshes, rods.values = [101, 151, 201], [0.2, 0.4, 0.15]
    assert rods.scattered()
    rods.values = [0.2, 0.24, 0.25]
    assert not rods.scattered()


def test_scenes_of_the_check_are_drawn_once_and_for_all():
    first, again, other = choices.draw(6, 3), choices.draw(6, 3), choices.draw(6, 4)
    assert first == again != other
    assert [scene.planar for scene in first] == [True, False] * 3
    # more scenes are the same ones and others
    assert choices.draw(4, 3) == first[:4]


def test_the_check_tells_a_miss_from_an_honest_failure(monkeypatch):
    scene = Scene(compression=0.3, shear=0.0, start="U+", rate=0.02)
    truth = choose(scene, 1e-3).value
    monkeypatch.setattr(choices, "reference", lambda _: (truth, 1e-6))
    (kept,) = choices.judge(scene, [1e-3])
    assert (kept.verdict, kept.covered) == ("met", True)

    def claim(value, estimate):
        choice = Known(scene, "snap", 1e-3, "prediction", {}, estimate, 0.0, "", value)
        monkeypatch.setattr(choices, "choose", lambda *_: choice)
        (verdict,) = choices.judge(scene, [1e-3])
        return verdict.verdict, verdict.covered

    assert claim(truth + 2e-3, 1e-4) == ("missed", False)
    assert claim(truth + 2e-3, 1e-2) == ("told", True)
    # within the tolerance, and yet more than it claims
    assert claim(truth + 5e-4, 1e-4) == ("met", False)
    monkeypatch.setattr(choices, "reference", lambda _: (truth, 1e-2))
    assert claim(truth + 2e-3, 1e-4)[0] == "sensitive"


# elements of another tolerance and mesh than any answer's, and the elastica by another method
SNAP = 1.15955060


def test_a_planar_snap_is_as_exact_as_it_claims():
    scene = replace(PLANAR, stop=1.4)
    other = elastica.simulate(
        scene, elements=24, extensible=True, method="esdirk4", tolerance=1e-8, until="snap"
    )
    assert other.crossing()[1] == pytest.approx(SNAP, abs=2e-7)
    for tolerance in (1e-3, 1e-4, 1e-5, 1e-6):
        answer = choose(scene, tolerance).run()
        assert answer.met
        assert not answer.sensitive
        assert abs(answer.value - SNAP) <= answer.error <= tolerance


@pytest.mark.parametrize(("planar", "scenes"), [(True, 8), (False, 2)])
def test_the_claimed_error_covers_the_true_one(planar, scenes):
    """Of planar scenes by one run of the elastica at most, against elements in three dimensions."""
    # (none of the ribbons vibrates)
    rng = np.random.default_rng(21)
    for _ in range(scenes):
        scene = random_scene(rng, planar=planar)
        run = {"elements": 16, "tolerance": 5e-8, "extensible": True, "configurations": False}
        truth = kirchhoff.simulate(refinement.endless(scene), until="snap", **run).crossing()[1]
        for tolerance in (1e-3, 1e-4, 1e-5, 1e-6)[: 4 if planar else 3]:
            answer = choose(scene, tolerance).run()
            assert answer.met
            assert not answer.sensitive
            assert abs(answer.value - truth) <= answer.error
            assert not planar or len(answer.runs) <= 1


def test_a_law_of_single_runs_knows_where_the_beam_rings():
    # one run of the elastica is wrong by 1.5e-3 here, between scenes of the law in which it is not
    ringing = Scene(
        compression=0.056, shear=0.0, start="U+", rate=0.36, damping=0.16, ribbon=Ribbon(thickness=0.0118)
    )
    answer = choose(ringing, 1e-3).run()
    assert answer.met
    assert abs(answer.value - choose(ringing, 1e-5).run().value) <= answer.error
    assert shipped().planar.ringing_left(replace(ringing, damping=100.0), 0.4) < 1e-9


def test_runs_that_agree_by_chance_claim_what_they_scatter():
    scatters = [levels.scatter(PLANAR, local) for local in (1e-5, 3e-6, 1e-6)]
    assert scatters == sorted(scatters, reverse=True)
    # a difference that is 0 is no error of 0; of a vibration it says nothing where the one before was large
    assert levels._claimed([1.0, 1.0], scatters[:2], False) == scatters[1]
    smooth, vibrating = (levels._claimed([1.0, 1.01, 1.01], scatters, one) for one in (False, True))
    assert smooth == pytest.approx(6e-3)
    assert vibrating == pytest.approx(3e-2)
    # two runs tell nothing of a vibration, and three that agree no more than what errors of its way leave
    assert levels._claimed([1.0, 1.0], scatters[:2], True) == math.inf
    vibrates = [levels.scatter(PLANAR, local, True) for local in (1e-5, 3e-6, 1e-6)]
    assert levels._claimed([1.0, 1.0, 1.0], vibrates, True) == vibrates[-1] > scatters[-1]
    # where no scatter was measured, and where the difference is none, it counts several times
    little = [1.0, 1.0 + 0.5 * scatters[0]]
    assert levels._claimed(little, scatters[:2], False) == pytest.approx(scatters[0])
    assert levels._claimed(little, scatters[:2], False, measured=False) == pytest.approx(3.0 * scatters[0])
    much = [1.0, 1.0 + 2.0 * scatters[0]]
    assert levels._claimed(much, scatters[:2], False) == pytest.approx(12.0 * scatters[0])
    assert levels._claimed([1.0, None], scatters[:2], False) == math.inf
    assert levels._claimed([None, None], scatters[:2], False) == 0.0


@pytest.mark.parametrize("tolerance", [1e-3, 1e-5, 1e-6, 3e-8, 1e-9])
@pytest.mark.parametrize("rate", [0.01, 0.3, 5.0])
def test_runs_of_an_answer_are_each_finer_than_the_one_before(tolerance, rate):
    scene = replace(PLANAR, rate=rate)
    runs = levels.first_runs(scene, tolerance)
    assert len(runs) >= 3
    for (coarse, local), (fine, finer) in itertools.pairwise(runs):
        assert coarse < fine
        assert finer == pytest.approx(local * 0.1**0.5, rel=0.01)
        assert coarse % 2 == 0
    assert runs[0][0] >= 4
    assert runs[0][1] <= 1e-4
    scattered = levels.scatter(scene, runs[1][1])
    assert scattered <= tolerance or len(runs) == 3


def test_a_slow_ribbon_is_predicted():
    scene = Scene(compression=0.40, shear=0.37, start="U+S+", rate=3e-3, damping=0.3)
    chosen = choose(scene, 1e-4)
    assert chosen.model == "folds"
    result = chosen.run()
    assert result.met
    assert result.history is None
    ramp = replace(scene, stop=result.value + 0.01)
    run = kirchhoff.simulate(ramp, extensible=True, tolerance=1e-6, until="snap", configurations=False)
    assert result.value == pytest.approx(run.crossing()[1], abs=result.error)
    # its mirror image is as slow
    other = choose(scene.mirror, 1e-4).run()
    assert other.value == pytest.approx(-result.value, abs=1e-9)
    # no prediction is as certain as that
    assert choose(scene, 1e-9).model == "kirchhoff"


@pytest.mark.slow
def test_two_dozen_scenes():
    result = choices.main(scenes=24, seed=11)
    judged = result.judged
    assert len(result.verdicts) == 24 * 4
    assert sum(v.verdict == "met" for v in judged) >= 0.95 * len(judged)
    assert not any(v.verdict == "missed" for v in judged)
    assert sum(v.covered for v in judged) >= 0.97 * len(judged)
    section = choices.COMMAND.section(result)
    assert [row["tolerance"] for row in section.values["summary"][::3]] == [1e-3, 1e-4, 1e-5, 1e-6]
    assert [drawing.file for drawing in choices.drawings(result)] == ["choices-check.png"]
