"""Diagrams of any rig: images of the usual one, weight, natural shape, other controls; words and numbers."""

import json
from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np
import pytest

import der
from compare.archive import finite
from compare.diagrams import axes, predictions, selection_diagram, show, skipping_diagram, states, threshold
from compare.diagrams import setup as runs
from compare.quantities.branches import potential
from compare.reproduction import selection as selection_command
from compare.reproduction import skipping as skipping_command
from compare.sweep import Sweep
from ribbonfem import Drive, Ribbon, Scene, SceneError, Schedule, kirchhoff
from ribbonfem.options import OptionError

# a weight of 5 EI2/L^3 of the default ribbon, along -z
HEAVY = (0.0, 0.0, -5.0 / Ribbon().weight_ratio)
NONE = (0.0, 0.0, 0.0)
GRID = ((0.1, 1.0, 2), (2.0, 20.0, 2))
ASKED = {"samples": 3, "boundaries": False, "nodes": 31}


def skipping(*grid, **rig):
    with Sweep(processes=1) as sweep:
        return skipping_diagram(0.40, 0.40, *(grid or GRID), **ASKED, sweep=sweep, **rig)


@pytest.fixture(scope="module")
def usual():
    return skipping()


@pytest.mark.parametrize(
    "image",
    [
        {"drive": "right", "start": "U+S-"},
        {"drive": Drive(left=-1.0), "start": "U-S+"},
        {"drive": Drive(right=-1.0), "start": "U-S-"},
    ],
)
def test_the_other_clamp_and_mirror_images_are_the_same_run_for_run(usual, image):
    made = skipping(**image)
    assert made.folds == pytest.approx(usual.folds, abs=1e-7)
    assert [s.outcome for s in made.samples] == [s.outcome for s in usual.samples]
    assert {s.outcome for s in usual.samples} >= {"no skip", "type 2"}
    for one, two in zip(made.samples, usual.samples, strict=True):
        assert (one.rate, one.damping) == (two.rate, two.damping)
        assert one.second == pytest.approx(two.second, rel=1e-3)
    for name, curve in usual.predicted.items():
        np.testing.assert_allclose(made.predicted[name], curve, rtol=1e-4)


def test_the_mirror_image_of_a_bent_heavy_ribbon_is_it_run_for_run():
    ribbon = Ribbon(curvature=1.0)
    rig = {"gravity": HEAVY, "ribbon": ribbon, "preset": {"right": 0.02}}
    image = {
        "start": "U-S+",
        "drive": Drive(left=-1.0),
        "gravity": tuple(-g for g in HEAVY),
        "ribbon": ribbon.mirror,
        "preset": {"right": -0.02},
    }
    one, two = skipping(**rig), skipping(**image)
    assert two.folds == pytest.approx(one.folds, abs=1e-9)
    assert [s.outcome for s in two.samples] == [s.outcome for s in one.samples]
    # each of the three acts: it is another diagram than without
    bare = kirchhoff.folds(Scene(compression=0.40, shear=0.40), elements=8)
    assert all(abs(fold.control - control) > 5e-3 for fold, control in zip(bare, one.folds, strict=True))


def test_folds_of_a_heavy_ribbon_are_those_of_another_method_and_slow_runs_snap_behind_them():
    """Single shooting, no code in common: alpha_c1 .084399719 and alpha_c2 .502319617."""
    base = runs.setup(Scene(compression=0.40, shear=0.37, gravity=HEAVY), "kirchhoff", {"elements": 16})
    assert [fold.control for fold in base.folds] == pytest.approx([0.084399719, 0.502319617], abs=1e-9)
    sample = runs.run_of(base, 0.02, 20.0)
    assert sample.outcome == "no skip"
    assert 0.0844 < sample.first < 0.12
    assert 0.5023 < sample.second < 0.53


def test_next_to_no_weight_is_the_usual_diagram(usual):
    made = skipping(gravity=(0.0, 0.0, -1e-9))
    assert [s.outcome for s in made.samples] == [s.outcome for s in usual.samples]
    assert made.folds == pytest.approx(usual.folds, abs=1e-7)


REFUSED = [
    ({"start": "U+S-"}, r"Scene\.start = 'U\+S-', .* meets a fold at alpha 0\.44\d+ rad, .* `threshold`"),
    (
        {"drive": "both"},
        r"Scene\.drive = 'both': a slow ramp meets a fold at alpha 0\.3\d+ rad, .*behind the",
    ),
    ({"drive": "force"}, r"meets a fold at control 1\d\.\d+ EI2/L\^2, .* does not lie behind"),
    ({"drive": "opposed"}, r"meets a fold at alpha 0\.\d+ rad, a pitchfork at alpha .* needs two folds"),
    ({"drive": Drive(force=-1.0)}, r"meets no fold and no branch point, where skipping needs two folds"),
    ({"start": "U-S-"}, r"meets a fold at .*, a fold at .* needs two folds"),
]


@pytest.mark.parametrize(("rig", "named"), REFUSED)
def test_a_ramp_without_two_folds_is_refused_with_what_it_meets(rig, named):
    with pytest.raises(SceneError, match=named) as raised:
        skipping(**rig)
    assert "\n" not in str(raised.value)


def test_a_rate_is_positive_and_a_preset_is_of_what_stands():
    with pytest.raises(OptionError, match=r"rates\[0\]"):
        skipping((-1.0, 1.0, 2), GRID[1])
    with pytest.raises(SceneError, match=r"Scene\.preset\['left'\].*the drive moves it"):
        skipping(preset={"left": 0.1})
    with pytest.raises(SceneError, match=r"Scene\.stop = -0\.3"):
        selection_diagram(0.40, 0.40, -0.3, drive=Drive(left=-1.0), start="U-S+")


@pytest.mark.parametrize(
    ("drive", "expected"),
    [
        ("left", 2.0 * np.pi),
        (Drive(left=2.0, lift=0.01), np.pi),
        ("twist_right", 2.0 * np.pi),
        ("force", 100.0),
        ("lift", 0.98 * np.sqrt(1.0 - 0.6**2 - 0.4**2)),
    ],
)
def test_a_ramp_that_does_not_snap_is_given_up_where_its_control_ends(drive, expected):
    assert runs.far(Scene(compression=0.40, shear=0.40, drive=drive)) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(("model", "mesh"), [(kirchhoff, {"elements": 8}), (der, {"nodes": 31})])
def test_the_potential_of_a_curve_grows_by_the_moment_of_what_turns(model, mesh):
    """dV/dalpha = M_y of the left clamp; of a ribbon with a weight and a force the elastic part does not."""
    scene = Scene(compression=0.40, shear=0.37, gravity=(1.0, 0.5, -3.0), preset={"force": 1.0})
    # (the last row lies on the edge of the span)
    low, high = (model.equilibria(scene, span=(-0.02, end), **mesh) for end in (0.029, 0.031))
    there = replace(scene, schedule=Schedule((0.0, 1.0), (0.03, 0.04)))
    moment = model.state(there, **mesh).reactions[0, 4]
    assert (potential(high)[-1] - potential(low)[-1]) / 2e-3 == pytest.approx(moment, abs=2e-4)
    assert abs((high.energy[-1] - low.energy[-1]) / 2e-3 - moment) > 0.1


def test_the_energy_set_free_is_that_of_the_bound():
    scene = Scene(compression=0.40, shear=0.37, gravity=HEAVY)
    mesh = {"elements": 8}
    base = runs.setup(scene, "kirchhoff", mesh)
    (form, *_) = kirchhoff.normal_forms(scene, **mesh)
    late = predictions.late_by(form)
    made = predictions.swing(base, form.angle, late, mesh)
    bound = kirchhoff.skipping_bound(scene, **mesh)
    # (between rows of the curve)
    assert made.energy == pytest.approx(float(made.needed(form.angle)) + bound, abs=2e-3)


STOPS = [
    ({"shear": 0.40, "gravity": HEAVY, "stop": 0.36}, ("U+S-", "U-S+")),
    (
        {"shear": 0.40, "ribbon": Ribbon(curvature=2.0), "gravity": NONE, "stop": 0.36},
        ("U+S-", "U-S+", "U-S-"),
    ),
    ({"shear": 0.40, "drive": "lift", "stop": 0.06}, ("U+S+", "U+S-", "U-S+", "U-S-")),
    ({"shear": 0.0, "start": "U+", "stop": 1.2}, ("U-",)),
    # pushed down, the two below merge into one that is level at midspan
    ({"shear": 0.37, "drive": "force", "stop": 25.0, "rate": 25.0}, ("U-",)),
]


@pytest.mark.parametrize(("rig", "names"), STOPS)
def test_selection_names_states_that_exist_and_where_long_runs_come_to_rest(rig, names):
    scene = Scene(**{"compression": 0.40, "rate": 1.0, **rig})
    options = {"elements": 8, "tolerance": 1e-4}
    base = runs.setup(scene, "kirchhoff", options)
    assert base.names == names
    for name, height, slope in base.stable:
        # of a start there, or of a slower way
        assert states.name_of(height, slope, scene, 1e-6) == name
    level = float(scene.clamps_height(scene.stop))
    for rate, damping in ((1.0, 1.3), (0.2, 5.0)):
        sample = runs.run_of(base, rate * scene.rate, damping)
        held = replace(scene, rate=rate * scene.rate, damping=damping, hold=60.0)
        end = kirchhoff.simulate(held, configurations=False, every=50, **options)
        (there,) = (state for state in base.stable if state[0] == sample.outcome)
        assert states.apart(there[1:], (end.height[-1] - level, end.slope[-1])) < 2e-3


def test_a_usual_run_that_is_decided_is_named_by_its_well_and_not_by_its_way():
    """It is decided within a second, in which it has been on the other side for longer than where it ends."""
    for model, options in (("kirchhoff", {"elements": 8}), ("der", {"nodes": 31, "method": "tr-bdf2"})):
        base = runs.setup(Scene(compression=0.40, shear=0.40, rate=1.0, stop=0.36), model, options)
        assert base.names == runs.SELECTION
        for rate, damping, name in ((1.0, 1.3, "U-S+"), (0.02, 10.0, "U+S-")):
            assert runs.run_of(base, rate, damping).outcome == name
            held = replace(base.scene, rate=rate, damping=damping, hold=60.0)
            end = runs.MODELS[model].simulate(held, configurations=False, every=50, **options)
            assert (end.height[-1] > 0.0) == (name[1] == "+")


def test_a_state_lost_at_a_pitchfork_before_the_stop_is_refused():
    with pytest.raises(
        SceneError, match=r"drive = 'both': .*lost at a pitchfork, at alpha 1\.\d+ rad.*a preset"
    ):
        selection_diagram(0.40, 0.0, 1.3, *GRID, start="U+", drive="both", **ASKED)


def test_retardation_has_no_part_at_rest():
    """Of the usual rig all four names, whatever the ribbon loses in motion."""
    scene = Scene(compression=0.40, shear=0.40, rate=1.0, stop=0.36)
    slow = replace(scene, ribbon=Ribbon(retardation=0.01), gravity=NONE)
    one, two = (runs.setup(s, "kirchhoff", {"elements": 8}) for s in (scene, slow))
    assert two.names == one.names == runs.SELECTION
    assert two.stable == one.stable
    assert runs.run_of(two, 1.0, 1.3).outcome in runs.SELECTION


def test_a_curve_that_cannot_be_followed_beyond_the_stop_is_followed_to_it():
    """Opposed clamps from U-S+: at 4.24 rad no next point of the curve is found."""
    scene = Scene(compression=0.40, shear=0.37, start="U-S+", drive="opposed", rate=1.0, stop=0.3)
    base = runs.setup(scene, "kirchhoff", {"elements": 8})
    assert base.folds == ()
    assert scene.start in base.names
    assert runs.run_of(base, 0.1, 5.0).outcome == "U-S+"


def test_states_of_the_same_signs_are_told_apart():
    scene = Scene(compression=0.40, shear=0.40)
    named = states._named([(0.2, 0.3), (0.1, 0.3), (-0.2, 0.3)], scene)
    assert [name for name, _, _ in named] == ["U+S-", "U+S- 2", "U-S+"]
    assert show.colour("U+S- 2") != show.colour("U+S-")


def test_words_and_numbers_name_the_control_with_its_unit():
    with Sweep(processes=1) as sweep:
        made = selection_diagram(
            0.40, 0.40, 0.06, (0.1, 1.0, 2), (2.0, 20.0, 2), drive="lift", preset={"right": 0.01},
            gravity=(0.0, 0.0, -0.1), sweep=sweep, **ASKED,
        )  # fmt: skip
    rig = "lift driven, right 0.01, gravity (0, 0, -0.1) m/s2"
    assert f"selection at (0.4, 0.4), {rig}, stop 0.06 L, der" in repr(made)
    assert show.label(made) == f"(0.40, 0.40), {rig}, stop 0.06 L, der, 31 nodes"
    numbers = json.loads(json.dumps(finite(show.numbers(made))))
    assert (numbers["drive"], numbers["rate_unit"], numbers["stop"]) == ("lift", "L/s", 0.06)
    assert (numbers["preset"], numbers["gravity"], numbers["start"]) == (
        {"right": 0.01},
        [0, 0, -0.1],
        "U+S+",
    )
    assert numbers["outcomes"] == list(made.outcomes)
    rows = [row.split(",") for row in made.to_csv().splitlines()]
    assert rows[0][-2:] == ["drive", "rate_unit"]
    assert all(row[-2:] == ["lift", "L/s"] for row in rows[1:])
    assert made.to_pandas().attrs["units"]["rate"] == "L/s"
    assert "rate (L/s)" in made._repr_html_()
    panel = made.plot()
    assert panel.get_xlabel() == "rate of lift (L/s)"
    assert "lift driven" in panel.get_title()
    plt.close("all")
    drive = Drive(left=1.0, right=0.3)
    other = replace(made, scene=replace(made.scene, drive=drive, preset={}, stop=0.1))
    assert axes.label("rate", other.scene) == "rate of left, 0.3 right (rad/s)"


def test_texts_of_the_usual_rig_stay(usual):
    assert show.label(usual) == "(0.40, 0.40), der, 31 nodes"
    assert repr(usual).startswith("Diagram(skipping at (0.4, 0.4), der, 2 x 2 cells")
    assert usual.to_csv().splitlines()[0] == "rate,damping,outcome,share,cell,runs,doubt_of_largest"
    assert axes.label("rate", usual.scene) == r"rate $\dot\alpha$ (rad/s)"
    assert show.numbers(usual)["drive"] == "left"


def test_a_threshold_of_the_right_clamp_is_that_of_the_left_one():
    scenes = [
        Scene(compression=0.40, shear=0.40, damping=10.0),
        Scene(compression=0.40, shear=0.40, damping=10.0, start="U+S-", drive="right"),
    ]
    with Sweep(processes=1) as sweep:
        one, two = (threshold(s, "type 2", "rate", (0.3, 1.0), 0.05, nodes=31, sweep=sweep) for s in scenes)
    assert (two.below, two.above, two.runs) == (one.below, one.above, one.runs)
    assert two.value == pytest.approx(one.value, rel=1e-9)
    with pytest.raises(SceneError, match=r"Scene\.rate = -0\.1: say by the drive"):
        threshold(replace(scenes[0], rate=-0.1))
    with pytest.raises(SceneError, match=r"Scene\.schedule"):
        threshold(Scene(schedule=Schedule((0, 1), (0, 0.3))))


FILE = """
compression = 0.40
shear = 0.40
start = "U+S-"
rate = 0.2
stop = 0.36
hold = 2.0
gravity = [0, 0, 0]
preset = {lift = 0.0}
"""


@pytest.fixture
def scene_file(tmp_path):
    def written(*lines):
        path = tmp_path / "rig.toml"
        path.write_text("\n".join((FILE, *lines)))
        return path

    return written


def test_commands_take_the_rig_of_a_scene_file(scene_file, usual):
    right = scene_file('drive = "right"')
    asked = {"rates": GRID[0], "dampings": GRID[1], **ASKED}
    with Sweep(processes=1) as sweep:
        result = skipping_command.main(scene=right, **asked, sweep=sweep)
        ends = selection_command.main(scene=right, **asked, sweep=sweep)
    (made,), (chosen,) = result.diagrams, ends.diagrams
    # what the file says of rate, damping, stop and hold is not used by a ramp that goes on
    assert (made.scene.drive, made.scene.start, made.scene.stop) == ("right", "U+S-", None)
    assert [s.outcome for s in made.samples] == [s.outcome for s in usual.samples]
    assert (chosen.scene.drive, chosen.scene.stop) == ("right", 0.36)
    # the paper's runs are of its own rig
    titles = [table.title for table in skipping_command.COMMAND.tables(result)]
    assert "Cells of each diagram" in titles
    assert not any("named" in title for title in titles)


@pytest.mark.parametrize(
    "options", [{"all": True}, {"paper": True}, {"compression": 0.3}, {"shear": 0.3}, {"stop": 0.3}]
)
def test_what_a_scene_file_leaves_nothing_to_is_refused(scene_file, options):
    (name,) = options
    with pytest.raises(OptionError, match=f"--{name}: --scene"):
        selection_command.main(scene=scene_file(), **options)


def test_a_scene_file_says_no_schedule_no_falling_control_and_where_a_selection_stops(tmp_path):
    path = tmp_path / "scene.toml"
    for text, named in (
        (
            "[schedule]\ntime = [0, 1]\nvalue = [0, 0.3]",
            r"Scene\.schedule: the rates of a diagram are constant",
        ),
        ("rate = -0.1", r"Scene\.rate = -0\.1: .*drive"),
        ("rate = 0.1", r"Scene\.stop: selection needs"),
    ):
        path.write_text(text)
        with pytest.raises(SceneError, match=named):
            selection_command.main(scene=path)
