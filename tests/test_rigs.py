"""Any rig: drives, presets, loads, shapes, schedules, against values by a method that shares no code.

The check values are of a shooting method: Kirchhoff rod, inextensible, L = EI2 = 1, EI1 400, GJ 1.4562.
"""

import inspect
import math
import warnings
from dataclasses import fields, replace

import numpy as np
import pytest
from histories import assert_goes_on

import der
from ribbonfem import (
    Drive,
    Ribbon,
    Scene,
    SceneError,
    SceneWarning,
    Schedule,
    SolverError,
    elastica,
    kirchhoff,
)
from ribbonfem.drive import CONTROLS
from ribbonfem.options import OptionError
from ribbonfem.outcomes import events
from ribbonfem.output.scene_file import read_scene

# a weight of 5 EI2/L^3 of the default ribbon, in m/s2
HEAVY = (0.0, 0.0, -5.0 / Ribbon().weight_ratio)
BENT = Ribbon(curvature=2.0)
SHEARED = {"compression": 0.40, "shear": 0.37}
PLANAR = {"compression": 0.40, "shear": 0.0, "start": "U+"}
NONE = (0.0, 0.0, 0.0)

FOLDS = [
    ({**SHEARED, "gravity": HEAVY}, [0.084399719, 0.502319617]),
    ({**SHEARED, "gravity": HEAVY, "start": "U+S-"}, [0.502319617]),
    ({**PLANAR, "gravity": HEAVY}, [1.080050375]),
    ({**SHEARED, "ribbon": BENT, "gravity": NONE}, [0.051637215, 0.638761289]),
    # of a clamped planar beam a natural curvature changes nothing
    ({**PLANAR, "ribbon": BENT, "gravity": NONE}, [1.123089742]),
    ({**SHEARED, "drive": Drive(left=1.0, right=0.5)}, [0.100900607]),
    ({**SHEARED, "drive": "right", "start": "U+S-"}, [0.065887669, 0.569205273]),
    ({**SHEARED, "start": "U+S-", "preset": {"left": 0.1}, "drive": "shear"}, [0.095941399]),
    ({**SHEARED, "drive": "force"}, [20.343554908]),
    ({**SHEARED, "drive": "lift"}, [0.024199727]),
]


@pytest.mark.parametrize(("given", "expected"), FOLDS)
def test_folds_of_other_rigs(given, expected):
    result = [fold.control for fold in kirchhoff.folds(Scene(**given))]
    assert len(result) == len(expected)
    for value, check in zip(result, expected, strict=True):
        # the check values have nine digits
        assert abs(value - check) < 1e-9 * max(1.0, abs(check))


ARCH = {"compression": 0.30, "shear": 0.0, "start": "U+", "drive": "compression", "rate": -0.1}
LOST = [
    ({**PLANAR, "drive": "both"}, 1.211826175, True),
    ({**ARCH, "preset": {"left": 0.6, "right": 0.6}}, 0.0884939107 - 0.30, False),
    ({**ARCH, "preset": {"left": 0.4, "right": 0.4}}, 0.039699033 - 0.30, False),
    ({**PLANAR, "compression": 0.30, "drive": "twist_left"}, 1.24374622, False),
]


@pytest.mark.parametrize(("given", "expected", "out"), LOST)
def test_states_that_are_lost_at_a_pitchfork(given, expected, out):
    (lost,) = kirchhoff.instabilities(Scene(**given))
    assert lost.kind == "pitchfork"
    assert lost.out_of_plane == out
    # (what rounding of the tangent moves the root of its smallest eigenvalue by: 2e-8 of the last)
    assert abs(lost.control - expected) < 5e-8


def test_folds_behind_a_pitchfork_are_named_by_the_curve_alone():
    both = Scene(**PLANAR, drive="both")
    with pytest.raises(SolverError, match=r"branch point \(alpha 1\.2118.*equilibria"):
        kirchhoff.folds(both)
    assert [fold.control for fold in kirchhoff.equilibria(both).folds] == pytest.approx(
        [1.331782895], abs=1e-9
    )


def test_a_run_tells_from_where_its_state_is_lost():
    run = kirchhoff.simulate(Scene(**PLANAR, drive="both", rate=1.0, stop=1.25), tolerance=1e-3)
    assert run.unstable_from == pytest.approx(1.211826175, abs=1e-6)
    assert run.leaves_plane == run.unstable_from
    assert "lost at 1.21183" in repr(run)
    short = kirchhoff.simulate(Scene(**PLANAR, drive="both", rate=1.0, stop=0.5), tolerance=1e-3)
    assert np.isnan(short.unstable_from)


def test_the_right_clamp_is_the_left_one_read_from_the_other_end():
    left = kirchhoff.equilibria(Scene(**SHEARED, start="U+S+"), elements=8)
    right = kirchhoff.equilibria(Scene(**SHEARED, start="U+S-", drive="right"), elements=8)
    np.testing.assert_allclose(right.control, left.control, atol=1e-9)
    np.testing.assert_allclose(right.height, left.height, atol=1e-9)
    np.testing.assert_allclose(right.slope, -left.slope, atol=1e-9)
    turned = left.configurations[:, ::-1] * [-1.0, -1.0, 1.0] + [0.6, -0.37, 0.0]
    np.testing.assert_allclose(right.configurations, turned, atol=1e-9)


ANY = {
    "compression": 0.40,
    "shear": 0.37,
    "start": "U+S-",
    "drive": Drive(left=1.0, right=0.4, twist_left=0.2, compression=0.02, shear=0.03, lift=0.05, force=1.0),
    "preset": {"twist_right": 0.05},
    "gravity": (0.1, 0.2, -0.4),
    "damping": 0.5,
    "ribbon": Ribbon(curvature=(0.3, -0.2, 0.4), twist=0.1),
}


def test_a_scene_knows_every_field():
    """Equality, hashes, the mirror image and archives hold whatever a scene says."""
    from compare.archive import from_bytes, to_bytes

    whole = Scene(**ANY, schedule=Schedule((0, 1), (0, 0.3)))
    others = {
        "compression": 0.41,
        "shear": 0.38,
        "start": "U+S+",
        "drive": Drive(right=1.0),
        "rate": 0.2,
        "stop": 0.4,
        "hold": 1.0,
        "schedule": Schedule((0, 1), (0, 0.4)),
        "preset": {"twist_right": 0.06},
        "gravity": (0.1, 0.2, -0.5),
        "damping": 0.6,
        "ribbon": Ribbon(curvature=(0.3, -0.2, 0.5), twist=0.1),
    }
    assert set(others) == {item.name for item in fields(Scene)}
    ramp = Scene(**ANY, stop=0.3)
    for name, value in others.items():
        base = ramp if name in ("rate", "stop", "hold") else whole
        other = replace(base, **{name: value})
        assert other != base, name
        assert len({other, base, replace(other)}) == 2, name
    for scene in (whole, ramp):
        assert scene.mirror != scene
        assert scene.mirror.mirror == scene
        assert from_bytes(to_bytes(scene)) == scene
    assert Scene(preset={"lift": 0.0}) == Scene()


def test_mirror_images_move_alike():
    scene = Scene(**ANY, schedule=Schedule((0, 1.0), (0, 0.2)))
    one, two = (kirchhoff.simulate(s, elements=4, tolerance=1e-3) for s in (scene, scene.mirror))
    np.testing.assert_allclose(one.height[-1], -two.height[-1], atol=1e-9)
    np.testing.assert_allclose(one.energies["work"][-1], two.energies["work"][-1], atol=1e-9)


def balance(history):
    e = history.energies
    total = e["kinetic"] + e["elastic"] + e["potential"] + e["dissipated"] - e["work"]
    return np.abs(total - total[0]).max()


RIGS = [
    {"drive": Drive(left=1.0, right=0.5, twist_right=0.3, lift=0.05), "stop": 0.5},
    {"drive": "force", "rate": 10.0, "stop": 10.0},
    {"drive": "compression", "rate": 0.05, "stop": 0.05},
    {"drive": Drive(shear=1.0, force=20.0), "rate": 0.02, "stop": 0.02, "preset": {"right": 0.05}},
    {"gravity": (0.0, 0.2, -2.0), "drive": "lift", "rate": 0.05, "stop": 0.05},
    {"ribbon": Ribbon(curvature=(0.0, 2.0, -1.0), twist=0.5), "gravity": NONE, "stop": 0.3},
    {"ribbon": Ribbon(retardation=0.02), "gravity": NONE, "stop": 0.3},
]


@pytest.mark.parametrize("extensible", [False, True])
@pytest.mark.parametrize("rig", RIGS)
def test_work_of_every_control_balances(rig, extensible):
    scene = Scene(**{**SHEARED, "start": "U+S-", "rate": 0.5, "damping": 1.0, **rig})
    run = kirchhoff.simulate(scene, extensible=extensible, tolerance=1e-6)
    # without the power of any one of what moves it is off by a hundredth and more
    assert balance(run) < 1e-4 * max(1.0, np.abs(run.energies["work"]).max())


def test_means_of_forces_balance_to_rounding_on_any_rig():
    scene = Scene(
        **SHEARED,
        drive=Drive(left=1.0, twist_left=0.2, lift=0.05, force=2.0),
        gravity=(0.0, 0.3, -1.0),
        ribbon=Ribbon(curvature=0.5),
        damping=0.0,
        rate=0.5,
        stop=0.3,
    )
    run = kirchhoff.simulate(scene, method="discrete-gradient", tolerance=1e-4)
    # the first steps from rest have too little kinetic energy to take from
    assert balance(run) < 1e-6


@pytest.mark.parametrize(
    ("model", "given", "options"),
    [
        (kirchhoff, {**SHEARED, "start": "U+S-", "drive": "shear"}, {"elements": 8}),
        (kirchhoff, {**SHEARED, "start": "U+S-", "drive": "shear"}, {"elements": 16}),
        (kirchhoff, {**SHEARED, "start": "U+S-", "drive": "shear"}, {"elements": 8, "step": 1e-3}),
        (elastica, {**PLANAR, "drive": "lift"}, {"elements": 16}),
        (elastica, {**PLANAR, "drive": "lift"}, {"elements": 8, "step": 1e-3}),
    ],
)
def test_what_a_jump_of_speed_dissipates_in_the_material_is_not_the_meshs(model, given, options):
    """Strain rates at a clamp that jumps to its speed grow without bound with the mesh, for no time."""
    scene = Scene(
        **given, gravity=NONE, rate=0.05, stop=0.02, hold=0.3, ribbon=Ribbon(retardation=0.02), damping=1.0
    )
    run, rods = model.simulate(scene, **options), der.simulate(scene, nodes=101)
    assert run.energies["dissipated"][-1] == pytest.approx(rods.energies["dissipated"][-1], rel=0.1)


def test_means_of_forces_take_no_retardation():
    scene = Scene(**SHEARED, gravity=NONE, ribbon=Ribbon(retardation=0.01), rate=0.5, stop=0.3)
    with pytest.raises(OptionError, match=r"'discrete-gradient'.*Ribbon\.retardation is not 0"):
        kirchhoff.simulate(scene, method="discrete-gradient", tolerance=1e-4)


def test_a_schedule_of_a_constant_rate_is_the_ramp():
    ramp = kirchhoff.simulate(Scene(**SHEARED, rate=0.3, stop=0.3, damping=0.3))
    for kind in ("linear", "smooth"):
        told = kirchhoff.simulate(Scene(**SHEARED, schedule=Schedule((0, 1), (0, 0.3), kind), damping=0.3))
        np.testing.assert_array_equal(told.time, ramp.time)
        np.testing.assert_allclose(told.height, ramp.height, atol=1e-12)


@pytest.mark.parametrize("method", ["esdirk4", "tr-bdf2", "generalised-alpha"])
@pytest.mark.parametrize(("retardation", "extensible"), [(0.0, False), (0.01, False), (0.01, True)])
def test_a_run_that_is_gone_on_from_at_a_kink_is_the_whole_to_the_last_bit(method, retardation, extensible):
    base = {**SHEARED, "damping": 0.3, "ribbon": Ribbon(retardation=retardation), "gravity": NONE}

    def run(times, values, **options):
        scene = Scene(**base, schedule=Schedule(times, values, kind="linear"))
        given = {"method": method, "elements": 4, "tolerance": 1e-4, "extensible": extensible}
        if method == "generalised-alpha" and extensible:
            # by default it hardly damps waves along the ribbon, and rounding decides how many steps they cost
            given["spectral_radius"] = 0.2
        return kirchhoff.simulate(scene, **given, **options)

    whole, first = run((0, 1, 2), (0, 0.1, 0.4)), run((0, 1), (0, 0.1))
    second = run((0, 1), (0.1, 0.4), initial=first)
    assert_goes_on(whole, first, second)


@pytest.mark.parametrize("given", [{"tolerance": 1e-4}, {"step": 4e-3}])
@pytest.mark.parametrize(("model", "start"), [(kirchhoff, SHEARED), (elastica, PLANAR)])
def test_so_is_one_that_keeps_its_energy(model, start, given):
    """What a kink leaves of the energy is told against the balance of the motion before."""

    def run(times, values, **options):
        schedule = Schedule(times, values, kind="linear")
        scene = Scene(**start, damping=0.3, gravity=NONE, schedule=schedule)
        return model.simulate(scene, method="discrete-gradient", elements=4, **given, **options)

    whole, first = run((0, 0.5, 1), (0, 0.2, 0.3)), run((0, 0.5), (0, 0.2))
    second, k = run((0, 0.5), (0.2, 0.3), initial=first), len(first) - 1
    for name in ("time", "control", "height", "slope"):
        np.testing.assert_array_equal(getattr(whole, name)[k:], getattr(second, name))
    for name, energy in whole.energies.items():
        # (of the row at the kink itself one has what was taken, the other what is left)
        np.testing.assert_array_equal(energy[k + 1 :], second.energies[name][1:])


@pytest.mark.parametrize("kind", ["linear", "smooth"])
def test_a_motion_that_is_gone_on_from_tells_its_own_instants(kind):
    """Times go on; a schedule, what it passes and its kinks are counted from where the motion went on."""
    base = {**PLANAR, "gravity": NONE, "damping": 1.0}
    options = {"elements": 6, "tolerance": 1e-4}
    before = Scene(**base, schedule=Schedule((0, 1, 2), (0, 0.5, 0.5), "linear"))
    after = Scene(**base, schedule=Schedule((0, 1), (0.5, 1.5), kind))
    first = kirchhoff.simulate(before, **options)
    second = kirchhoff.simulate(after, initial=first, **options)
    fold = kirchhoff.folds(after, elements=6)[0].control
    assert second.snaps_from == pytest.approx(2.0 + fold - 0.5, abs=1e-9)
    time, control = second.snap
    assert control == pytest.approx(0.5 + time - 2.0, abs=1e-9)
    assert second.kinks(second.track[0], second.track[1]) == (0,)
    right = Scene(**base, preset={"left": 0.5}, drive="right", rate=1.0, stop=1.6)
    folds = kirchhoff.folds(right, elements=6)
    passed = events(kirchhoff.simulate(right, initial=first, **options), folds)
    fold = folds[0].control
    assert passed["alpha_c"].time == pytest.approx(2.0 + fold, abs=1e-9)
    assert passed["alpha_c"].angle == pytest.approx(fold, abs=1e-6)


@pytest.mark.parametrize("dip", [-1e-4, -0.05])
def test_a_control_that_first_goes_the_other_way_snaps_as_well(dip):
    """The state at rest comes back from a dip, and is lost where the control passes its fold."""
    scene = Scene(**SHEARED, gravity=NONE, damping=10.0, schedule=Schedule((0, 0.3, 2), (0, dip, 0.9)))
    run = kirchhoff.simulate(scene, elements=6, tolerance=1e-4)
    fold = kirchhoff.folds(Scene(**SHEARED), elements=6)[0].control
    assert scene.schedule(run.snaps_from) == pytest.approx(fold, abs=1e-9)
    assert run.snap == run.crossing()


def test_a_given_state_is_begun_at_and_clamps_have_to_fit():
    state = kirchhoff.state(Scene(**SHEARED, start="U+S-"), elements=8)
    given = kirchhoff.simulate(Scene(**SHEARED, start="U+S+", rate=0.3, stop=0.3), initial=state)
    named = kirchhoff.simulate(Scene(**SHEARED, start="U+S-", rate=0.3, stop=0.3))
    np.testing.assert_allclose(given.height[-1], named.height[-1], atol=1e-9)
    with pytest.raises(SceneError, match=r"clamps begin .* lift 0\.01"):
        kirchhoff.simulate(Scene(**SHEARED, preset={"lift": 0.01}, rate=0.3, stop=0.3), initial=state)


def test_a_start_that_is_lost_on_the_way_says_where():
    # the fold of the force is at 20.34
    with pytest.raises(SceneError, match=r"preset force = 30 is increased from 0: a fold at 0\.678"):
        kirchhoff.state(Scene(**SHEARED, preset={"force": 30.0}))


@pytest.mark.parametrize(
    ("given", "named"),
    [
        ({"drive": "sideways"}, r"Scene\.drive = 'sideways'.*left, right, twist_left"),
        ({"drive": {"left": 1, "up": 2}}, r"'up' is no control"),
        ({"preset": {"left": 0.1}}, r"Scene\.preset\['left'\] = 0\.1: the drive moves it"),
        ({"preset": {"side": 0.1}}, r"'side' is no control"),
        ({"gravity": 9.81}, r"Scene\.gravity = 9\.81"),
        ({"schedule": Schedule((0, 1), (0, 1)), "stop": 0.3}, r"Scene\.stop = 0\.3: a schedule says this"),
        ({"schedule": Schedule((0, 1, 1), (0, 1, 2), "linear")}, r"a jump.*'force' alone"),
        ({"drive": "lift", "stop": 0.9}, r"Scene\.stop = 0\.9: the chord is"),
        ({"preset": {"compression": -0.5}}, r"Scene\.preset = .*the chord is"),
        ({"colour": 3}, r"Scene\.colour = 3: there is no such field.*compression"),
    ],
)
def test_what_a_scene_cannot_say(given, named):
    with pytest.raises(SceneError, match=named):
        Scene(**given)


def test_given_slopes_are_looked_at_between_the_points():
    """A curve of given slopes may turn back: where it leads, and whether a ribbon can follow, are its own."""
    back = Schedule((0, 1), (0, 0.02), slope=(-10.0, 0.0))
    lowest = back(np.linspace(0.0, 1.0, 4001)).min()
    assert back.direction == -1.0
    assert back.furthest == back.extremes[0] == pytest.approx(lowest, abs=1e-6)
    assert not back.monotone
    with pytest.raises(SceneError, match=r"Scene\.schedule = -1\.9.*the chord is"):
        Scene(compression=0.1, shear=0.0, start="U+", drive="compression", schedule=back)
    for ramp in (Schedule.ramp(1, 1, 3), Schedule.ramp(-0.1, -0.9, 2), Schedule.ramp(1, 0.9, 1e-6)):
        assert ramp.monotone
        assert ramp.extremes == (min(ramp.value), max(ramp.value))


def test_a_measured_file_without_rows_is_told(tmp_path):
    path = tmp_path / "alpha.csv"
    path.write_text("time,alpha\n", encoding="utf-8")
    with pytest.raises(SceneError, match=r"alpha\.csv: no row below the names time, alpha"):
        Schedule.from_csv(path)


def test_a_measured_file_headed_in_another_unit_is_told(tmp_path):
    """Degrees or milliseconds that are read as radians or seconds are a slip that no error follows from."""
    path = tmp_path / "alpha.csv"
    path.write_text("time (ms),alpha (deg)\n0,0\n500,10\n1000,40\n", encoding="utf-8")
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        given = Schedule.from_csv(path, units=("ms", "deg"))
        assert not told
        Schedule.from_csv(path)
    assert given.time == (0.0, 0.5, 1.0)
    assert given.value[-1] == pytest.approx(math.radians(40.0))
    first, second = (str(one.message) for one in told)
    assert "'time (ms)' is read in s. If it is in ms, say so: units = ('ms', 'rad')" in first
    assert "'alpha (deg)' is read in rad. If it is in deg, say so: units = ('s', 'deg')" in second
    with pytest.warns(SceneWarning, match=r"Scene\.schedule = 40\.0 rad is 6\.37 turns"):
        Scene(schedule=Schedule((0, 1), (0, 40)))


@pytest.mark.parametrize("encoding", ["latin-1", "utf-16"])
def test_a_measured_file_in_another_encoding_is_told(tmp_path, encoding):
    path = tmp_path / "alpha.csv"
    path.write_text("time,Länge\n0,0\n1,0.5\n", encoding=encoding)
    with pytest.raises(SceneError, match=r"alpha\.csv: no text in UTF-8, by its byte \d"):
        Schedule.from_csv(path)
    scene = tmp_path / "scene.toml"
    scene.write_text('[schedule]\nfile = "alpha.csv"\n', encoding="utf-8")
    with pytest.raises(SceneError, match=r"scene\.toml: .*alpha\.csv: no text in UTF-8"):
        read_scene(scene)
    scene.write_text('start = "Ü"\n', encoding=encoding)
    with pytest.raises(SceneError, match=r"scene\.toml: not a TOML file: "):
        read_scene(scene)


def test_a_field_of_a_drive_or_schedule_that_there_is_not_lists_those_that_there_are():
    with pytest.raises(SceneError, match=r"Drive\.lft = 1: there is no such field, perhaps 'lift' .*twist_l"):
        Drive(lft=1)
    with pytest.raises(SceneError, match=r"Schedule\.knd = 'linear': .*; there are time, value, kind, slope"):
        Schedule((0, 1), (0, 1), knd="linear")
    assert list(inspect.signature(Schedule).parameters) == ["time", "value", "kind", "slope"]


def test_the_old_name_of_the_right_clamp_reads():
    with pytest.warns(DeprecationWarning, match="drive='right'"):
        assert Scene(turned="right") == Scene(drive="right")
    assert Scene(drive="right").turned == "right"
    assert Scene(drive=Drive(left=1, right=1)).drive == "both"


def test_an_angle_is_read_where_clamps_turn_alone():
    fold = kirchhoff.folds(Scene(**SHEARED, drive="lift"))[0]
    with pytest.raises(SceneError, match=r"drive = 'lift'.*`control`"):
        _ = fold.angle
    assert kirchhoff.folds(Scene(**SHEARED))[0].angle == pytest.approx(0.0658876686, abs=1e-9)


def test_every_control_has_a_derivative_in_time_that_fits():
    from ribbonfem.ends import kernels, moving

    scene = Scene(
        **SHEARED, drive=Drive(**dict.fromkeys(CONTROLS[:7], 0.1), force=2.0), schedule=Schedule.ramp(1, 1, 3)
    )
    ends = moving(scene)
    low, pose, high = (np.zeros(kernels.POSE_SIZE) for _ in range(3))
    at, h = 0.4 * ends.kinks[-1], 1e-5
    for time, into in ((at - h, low), (at, pose), (at + h, high)):
        kernels.pose_at(ends, 0, time, into)
    rate = (high - low) / (2 * h)
    p, v, a = kernels.PLACE, kernels.SPEED, kernels.CHANGE
    np.testing.assert_allclose(rate[p : p + 3], pose[v : v + 3], atol=1e-9)
    np.testing.assert_allclose(rate[v : v + 3], pose[a : a + 3], atol=1e-8)
    for side in range(2):
        q, dq = pose[4 * side : 4 * side + 4], rate[4 * side : 4 * side + 4]
        spin = 2 * (q[0] * dq[1:] - dq[0] * q[1:] - np.cross(q[1:], dq[1:]))
        k = kernels.SPIN + 3 * side
        np.testing.assert_allclose(spin, pose[k : k + 3], atol=1e-9)
        r = kernels.SPIN_RATE + 3 * side
        np.testing.assert_allclose(rate[k : k + 3], pose[r : r + 3], atol=1e-8)


@pytest.mark.parametrize("model", [kirchhoff, elastica])
def test_a_control_is_followed_as_far_as_the_scene_goes(model):
    """Farther than 100 EI2/L^2, to which a force is followed where nothing says how far."""
    scene = Scene(**PLANAR, gravity=NONE, drive="force", rate=10.0, stop=130.0, preset={"left": 0.02})
    (fold,) = model.instabilities(scene, elements=8)
    assert 100.0 < fold.control < 130.0
    run = model.simulate(scene, elements=8)
    assert run.snap == run.crossing()
    assert run.snap[1] > fold.control
