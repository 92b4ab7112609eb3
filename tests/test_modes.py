from dataclasses import replace

import numpy as np
import pytest

import der
from der.modes import classify, local_minima, name_by_signs, name_shape
from der.rod import Rod
from der.states import stable_states
from ribbonfem import Drive, Fold, History, Ribbon, Scene, elastica, kirchhoff, quasilinear

FOLDS = (Fold(0.16, 0.25, 30.0), Fold(0.45, 0.09, 50.0))


def made(angle, height, slope, **scene):
    angle = np.asarray(angle, dtype=float)
    return History(
        time=angle / 0.1,
        control=angle,
        height=np.asarray(height, dtype=float),
        slope=np.asarray(slope, dtype=float),
        energies={},
        configurations={},
        stats={},
        scene=Scene(compression=0.40, shear=0.40, rate=0.1, stop=0.6, **scene),
    )


ANGLE = np.linspace(0.0, 0.6, 601)


def step(at, width=0.004):
    return 0.5 * (1 + np.tanh((ANGLE - at) / width))


def test_names_agree_with_the_states():
    rod = Rod(Scene(compression=0.40, shear=0.40), 41)
    for name, state in stable_states(rod).items():
        assert name_shape(state.x, 0.40) == name
        position, tangent = rod.middle(state.x)
        assert name_by_signs(position[2], tangent[2]) == name


def test_local_minima_are_solved_for():
    time = np.linspace(0.0, 6.0, 40)
    (minimum,) = local_minima(time, 2 * time, (time - np.pi) ** 2 + 0.25)
    assert np.allclose(minimum, [np.pi, 2 * np.pi, 0.25])


def test_no_skip_by_rebound_and_by_rest():
    slope = -0.4 + 0.9 * step(0.18)
    ringing = 0.21 - 0.11 * step(0.18) - 0.3 * step(0.47)
    ringing = ringing + 0.02 * np.cos(400 * (ANGLE - 0.18)) * np.exp(-20 * np.abs(ANGLE - 0.2)) * (
        ANGLE > 0.18
    )
    assert classify(made(ANGLE, ringing, slope), FOLDS).kind == "no skip"
    creeping = 0.21 - 0.11 * step(0.18, 0.01) - 0.02 * ANGLE - 0.3 * step(0.47, 0.01)
    outcome = classify(made(ANGLE, creeping, slope), FOLDS)
    assert outcome.kind == "no skip"
    assert "rests" in outcome.reason
    assert outcome.final == "U-S+"


def test_type_1_and_type_2():
    early = made(ANGLE, 0.21 - 0.4 * step(0.2), -0.4 + 0.9 * step(0.18))
    assert classify(early, FOLDS).kind == "type 1"
    # still falling through the fold state's height when alpha_c2 comes
    late = made(ANGLE, 0.21 - 0.4 * step(0.46, 0.03), -0.4 + 0.9 * step(0.40, 0.03))
    assert classify(late, FOLDS).kind == "type 2"
    assert classify(made(ANGLE, 0.2 + 0 * ANGLE, -0.4 + 0 * ANGLE), FOLDS).kind == "none"


def test_refusals():
    with pytest.raises(ValueError, match="start"):
        classify(made(ANGLE, ANGLE, ANGLE, start="U+S-"), FOLDS)
    with pytest.raises(ValueError, match="folds"):
        classify(made(ANGLE, ANGLE, ANGLE), FOLDS[:1])
    run = made(ANGLE, 0.2 + 0 * ANGLE, -0.4 + 0 * ANGLE)
    with pytest.raises(
        ValueError, match=r"start = 'U\+S\+', .* folds at alpha 0\.45 rad and .* behind the first"
    ):
        classify(run, FOLDS[::-1])
    with pytest.raises(ValueError, match="has passed the clamps' mean height"):
        classify(run, (FOLDS[0], Fold(0.45, -0.09, 50.0)))
    with pytest.raises(ValueError, match="does not turn over"):
        classify(run, (replace(FOLDS[0], slope=-0.3), replace(FOLDS[1], slope=-0.2)))
    right = replace(FOLDS[0], scene=replace(run.scene, drive="right"))
    with pytest.raises(ValueError, match=r"folds\[0\]: drive = 'right'"):
        classify(run, (right, FOLDS[1]))


@pytest.mark.parametrize(
    ("compression", "damping", "rate", "kind"),
    [
        (0.40, 10.0, 0.01, "no skip"),
        (0.40, 10.0, 1.0, "type 2"),
        (0.35, 0.3, 0.01, "type 1"),
        (0.35, 30.0, 0.01, "no skip"),
    ],
)
def test_named_cases_of_the_paper(compression, damping, rate, kind):
    scene = Scene(compression=compression, shear=0.40, rate=rate, damping=damping, stop=0.6)
    folds = der.folds(Scene(compression=compression, shear=0.40), nodes=51)
    # (what it does after z = 0 is not asked)
    history = der.simulate(scene, nodes=51, configurations=False, until="snap")
    assert classify(history, folds).kind == kind


def test_events_of_a_run():
    scene = Scene(compression=0.40, shear=0.40, rate=0.1, damping=10.0, stop=0.6)
    folds = der.folds(scene, nodes=31)
    history = der.simulate(scene, nodes=31, configurations=False)
    result = der.modes.events(history, folds)
    assert result["alpha_c1"].name == "U+S+"
    assert result["alpha_c2"].name == "U+S-"
    assert result["end"].name == "U-S+"
    assert abs(result["first snap"].slope) < 1e-8
    assert abs(result["second snap"].height) < 1e-8
    assert folds[0].angle < result["first snap"].angle < folds[1].angle < result["second snap"].angle
    assert np.isclose(result["alpha_c1"].angle, folds[0].angle)
    assert result["first minimum"].time > result["first snap"].time
    short = der.simulate(Scene(compression=0.40, shear=0.40, rate=0.1, stop=0.05), nodes=31)
    assert der.modes.events(short, folds)["alpha_c1"] is None
    assert der.modes.events(short)["second snap"] is None


STRIP = Ribbon(length=0.18, width=0.012, thickness=0.0002, young=200e9, density=7850, poisson=0.3)


@pytest.mark.parametrize("model", [der, kirchhoff])
def test_a_ramp_that_meets_one_fold_has_one_snap(model):
    """A steel strip from U+: z = 0 at .7638, t_z = 0 of the ringing after it, and nothing is numbered."""
    scene = Scene(compression=0.25, shear=0.2, start="U+", ribbon=STRIP, rate=1.0, stop=0.9, damping=0.5)
    mesh = {"nodes": 51} if model is der else {}
    history, folds = model.simulate(scene, **mesh), model.folds(scene, **mesh)
    result = der.modes.events(history, folds)
    assert set(result) == {"alpha_c", "snap", "first minimum", "end"}
    assert list(result)[:2] == ["alpha_c", "snap"]
    assert result["snap"].angle == history.crossing("height")[1]
    assert result["alpha_c"].angle == pytest.approx(folds[0].angle, abs=1e-12)
    assert result["first minimum"].time > result["snap"].time
    assert set(der.modes.events(history)) == {"snap", "first minimum", "end"}


def test_events_come_in_their_order():
    """Seeded ramps of both kinds: instants ascend, and what did not come is last."""
    generator = np.random.default_rng(9)
    for k in range(8):
        start = ("U+S+", "U+S-", "U+", "U-S+")[k % 4]
        shear = 0.0 if start == "U+" else float(generator.uniform(0.36, 0.4))
        sign = -1.0 if start == "U-S+" else 1.0
        rate, damping = 10 ** generator.uniform(-0.5, 1.0), 10 ** generator.uniform(-1.0, 1.5)
        ramp = {"rate": sign * rate, "stop": sign * generator.uniform(0.3, 2.0)}
        scene = Scene(compression=0.4, shear=shear, start=start, damping=damping, **ramp)
        result = der.modes.events(kirchhoff.simulate(scene), kirchhoff.folds(scene, elements=12))
        times = [np.inf if event is None else event.time for event in result.values()]
        assert times == sorted(times)
        assert ("first snap" in result) == (start in ("U+S+", "U-S+"))
        if result.get("first snap") and result["second snap"]:
            assert result["first snap"].time < result["second snap"].time


def test_runs_and_folds_by_their_defaults_are_of_one_model():
    """Elements in motion are fewer than those at rest; rods' folds do depend on the mesh."""
    scene = Scene(compression=0.40, shear=0.40, rate=1.0, stop=0.9, damping=10.0)
    assert classify(kirchhoff.simulate(scene), kirchhoff.folds(scene)).kind == "type 2"
    beam = Scene(compression=0.3, shear=0.0, start="U+", rate=1.0, stop=1.2, damping=1.0)
    for model in (elastica, quasilinear):
        result = der.modes.events(model.simulate(beam), model.folds(beam))
        assert result["alpha_c"].time < result["snap"].time
    with pytest.raises(ValueError, match=r"folds\[0\]: elements = 4"):
        der.modes.events(quasilinear.simulate(beam), quasilinear.folds(beam, elements=4))


def test_a_mid_tangent_that_turns_over_at_rest_before_the_first_fold_is_no_snap():
    slope = 0.1 - 0.5 * step(0.05) + 0.9 * step(0.18)
    height = 0.21 - 0.1 * step(0.18) - 0.3 * step(0.47)
    folds = replace(FOLDS[0], slope=-0.4), replace(FOLDS[1], slope=0.5)
    outcome = classify(made(ANGLE, height, slope), folds)
    assert outcome.first == pytest.approx((1.8, 0.18), abs=0.05)
    assert outcome.second == pytest.approx((4.7, 0.47), abs=0.05)
    with pytest.raises(ValueError, match="turn over"):
        classify(made(ANGLE, height, slope), (folds[0], replace(FOLDS[1], slope=-0.5)))


IMAGES = [
    {"drive": "right", "start": "U+S-"},
    {"drive": Drive(left=-1.0), "start": "U-S+"},
    {"drive": Drive(right=-1.0), "start": "U-S-"},
    # the control itself falls
    {"drive": "left", "start": "U-S+", "rate": -1.0, "stop": -1.0},
]
KINDS = [(0.40, 10.0, 1.0, "type 2"), (0.40, 10.0, 0.1, "no skip"), (0.35, 0.3, 0.1, "type 1")]


@pytest.mark.parametrize("image", IMAGES)
@pytest.mark.parametrize(("compression", "damping", "rate", "kind"), KINDS)
def test_images_of_a_ramp_have_its_outcome(image, compression, damping, rate, kind):
    """z -> -z, and the ribbon read from its other end: the same instants, controls of the image's sign."""
    base = Scene(compression=compression, shear=0.40, damping=damping, rate=rate, stop=0.9)
    sign = np.sign(image.get("rate", 1.0))
    other = replace(base, **{**image, "rate": sign * rate, "stop": sign * 0.9})
    one, two = (
        classify(run, kirchhoff.folds(run.scene, elements=8))
        for run in (kirchhoff.simulate(scene, tolerance=1e-3, until="snap") for scene in (base, other))
    )
    assert one.kind == two.kind == kind
    up = 1.0 if other.start[1] == "+" else -1.0
    assert two.final == other.start[:1] + ("-" if up > 0.0 else "+") + other.start[2:]
    for mine, its in ((one.first, two.first), (one.second, two.second)):
        assert (mine is None) == (its is None)
        if mine is not None:
            assert its == pytest.approx((mine[0], sign * mine[1]), rel=1e-6)
    np.testing.assert_allclose(two.minima, one.minima * [1.0, sign, up], rtol=1e-5)


def heavy(weight):
    """Of a weight per length along z in EI2/L^3."""
    return {"compression": 0.40, "shear": 0.37, "gravity": (0.0, 0.0, weight / Ribbon().weight_ratio)}


RIGS = [
    heavy(-5.0),
    {"compression": 0.40, "shear": 0.37, "ribbon": Ribbon(curvature=2.0), "gravity": (0.0, 0.0, 0.0)},
    {"compression": 0.40, "shear": 0.37, "preset": {"lift": -0.03}},
    {"compression": 0.40, "shear": 0.37, "drive": Drive(left=1.0, right=0.3)},
    {"compression": 0.40, "shear": 0.37, "drive": Drive(left=1.0, lift=0.05)},
]


@pytest.mark.parametrize("rig", RIGS)
def test_a_ramp_of_another_rig_snaps_twice(rig):
    """So slow, and so damped, that it stays near states at rest: behind each fold its snap, and no skip."""
    scene = Scene(**rig, rate=0.03, damping=20.0, stop=1.2)
    folds = kirchhoff.folds(scene, elements=8)
    run = kirchhoff.simulate(scene, tolerance=1e-3, until="snap")
    outcome = classify(run, folds)
    assert outcome.kind == "no skip"
    result = der.modes.events(run, folds)
    order = [name for name in result if name not in ("first minimum", "end")]
    assert order == ["alpha_c1", "first snap", "alpha_c2", "second snap"]
    assert result["alpha_c1"].name == "U+S+"
    assert result["alpha_c2"].name == "U+S-"
    assert result["end"].name == outcome.final == "U-S+"
    # the names do not hang on the folds
    assert set(der.modes.events(run)) == set(result) - {"alpha_c1", "alpha_c2"}
    second = result["second snap"]
    assert (second.time, second.angle) == run.snap == outcome.second
    # (where the lift moves crossings are those of a cubic, without velocities)
    within = 1e-3 if scene.drives.lift else 1e-8
    assert second.height == pytest.approx(float(scene.clamps_height(second.angle)), abs=within)
    for fold, name in zip(folds, ("alpha_c1", "alpha_c2"), strict=True):
        # close to its fold the state moves as the root of the distance
        assert result[name].angle == pytest.approx(fold.control, abs=1e-9)
        assert np.sign(result[name].slope) == np.sign(fold.slope)


def test_a_weight_that_is_next_to_none_changes_no_outcome():
    for damping, rate in ((10.0, 1.0), (1.0, 0.2), (0.3, 0.05)):
        scenes = [Scene(**heavy(w), rate=rate, damping=damping, stop=1.5) for w in (0.0, -1e-9)]
        runs = [kirchhoff.simulate(scene, tolerance=1e-4, until="snap") for scene in scenes]
        one, two = (classify(run, kirchhoff.folds(run.scene, elements=8)) for run in runs)
        assert one.kind == two.kind
        # what runs whose steps differ may be apart by at this tolerance
        assert two.second == pytest.approx(one.second, rel=1e-3)
        assert two.first == pytest.approx(one.first, rel=1e-3)


def test_names_leave_out_what_vanishes():
    assert [name_by_signs(h, s, 1e-6) for h, s in ((0.2, 0.0), (-0.2, 1e-9), (0.0, -0.3), (1e-9, 0.3))] == [
        "U+",
        "U-",
        "S+",
        "S-",
    ]
    assert name_by_signs(0.0, 0.0, 1e-6) == ""
