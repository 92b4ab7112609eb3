"""Forces and moments of both clamps, of all models: balances at rest and in motion, work, other models."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

import der
from compare import archive
from der.rod import Rod
from ribbonfem import Drive, Ribbon, Scene, Schedule, elastica, kirchhoff, quasilinear
from ribbonfem.ends import Ends
from ribbonfem.kirchhoff.frames import directors
from ribbonfem.kirchhoff.problem import Statics

PUSH, NU, RATE = 2.0, 2.0, 0.4
MOTION = {"rate": RATE, "stop": 0.05, "damping": NU, "preset": {"force": PUSH}}
TILTED = Scene(
    compression=0.40,
    shear=0.37,
    start="U+S+",
    drive=Drive(left=1.0, right=0.3, twist_left=0.2, twist_right=0.5, lift=0.2, compression=0.1),
    gravity=tuple(np.array([0.3, 0.5, -4.0]) / Ribbon().weight_ratio),
    **MOTION,
)
PLANAR = Scene(
    compression=0.20,
    shear=0.0,
    start="U+",
    drive=Drive(left=1.0, right=0.3, lift=0.2, compression=0.1),
    gravity=(0.0, 0.0, -4.0 / Ribbon().weight_ratio),
    **MOTION,
)
CASES = {
    "quasilinear": (quasilinear, PLANAR, {}),
    "elastica": (elastica, PLANAR, {}),
    "elastica that stretches": (elastica, PLANAR, {"extensible": True, "elements": 6}),
    "kirchhoff": (kirchhoff, TILTED, {}),
    "kirchhoff, gyroscopic": (kirchhoff, TILTED, {"extensible": True, "gyroscopic": True}),
    "der": (der, TILTED, {"nodes": 41}),
    "der, even": (der, TILTED, {"nodes": 40}),
    "der, two-node": (der, TILTED, {"nodes": 41, "clamp": "two-node"}),
}


FIELDS = ("compression", "shear", "start", "drive", "preset", "gravity", "damping", "ribbon")


def scheduled(scene, schedule, **changes):
    return Scene(**{name: getattr(scene, name) for name in FIELDS} | changes, schedule=schedule)


@lru_cache(maxsize=64)
def moved(name, method, retardation=0.0):
    """To the end of a ramp, where the clamps still move."""
    model, scene, options = CASES[name]
    scene = replace(scene, ribbon=Ribbon(retardation=retardation))
    exact = {"newton_tolerance": 1e-11} if model is der else {}
    return model.simulate(scene, step=1e-3, method=method, **options, **exact)


def held(scene, arclength):
    """Positions, velocities and accelerations (3, n, 3) of what is fixed to the clamps, at the ramp's end."""
    rate = RATE * scene.ribbon.inertial_time

    def places(time):
        ends = scene.controls(scene.stop + rate * time)
        left, right = ends["left"], ends["right"]
        reach = np.array(
            [1.0 - scene.compression - ends["compression"], -scene.shear - ends["shear"], ends["lift"]]
        )
        first, last = np.array([np.cos(left), 0, -np.sin(left)]), np.array([np.cos(right), 0, np.sin(right)])
        near = arclength[:, None] < 0.5
        return np.where(near, arclength[:, None] * first, reach + (arclength[:, None] - 1.0) * last)

    h = 1e-3
    before, now, after = (places(time) for time in (-h, 0.0, h))
    return np.stack((now, (after - before) / (2 * h), (after - 2 * now + before) / h**2))


def nodal(field, elements):
    """Vectors (nodes, 3) of the elastica's groups of elements, x and z of each one's nodes."""
    rows = np.moveaxis(field, 2, 1).reshape(-1, 2, 6)[:elements]
    vectors = np.zeros((5 * elements + 1, 3))
    for i in range(6):
        vectors[i : 5 * elements + 1 : 5][:elements, [0, 2]] = rows[:, :, i]
    return vectors


def elements_mass(scene, elements):
    return Statics(scene.ribbon, Ends.of(scene), elements=elements, extensible=False).mass


def inertia(history):
    """Masses, places, accelerations with nu times velocities; of spins shares and the same along tangents."""
    scene, kept, nu = history.scene, history.resume, history.scene.scaled_damping
    rate = RATE * scene.ribbon.inertial_time
    if history.model == "kirchhoff":
        mass = elements_mass(scene, history.options["elements"])
        v, a = kept["v"].copy(), kept["a"].copy()
        _, speed, change = held(scene, np.array([0.0, 0.1, 0.9, 1.0]))
        v[[0, -1], :3], a[[0, -1], :3] = speed[[0, -1]], change[[0, -1]]
        v[[0, -1], 3] = rate * scene.drives.twist_left, rate * scene.drives.twist_right
        spin = (a[:, 3:] + nu * v[:, 3:]) * directors(kept["g"])[:, 2]
        if history.options["gyroscopic"]:
            tangent_rate = kept["tangent_rate"].copy()
            tangent_rate[[0, -1]] = (speed[1] - speed[0]) / 0.1, (speed[3] - speed[2]) / 0.1
            spin += v[:, 3:] * tangent_rate
        return mass, kept["x"][:, :3], a[:, :3] + nu * v[:, :3], spin, mass
    if history.model == "elastica":
        count = history.options["elements"]
        mass, acting = elastica.problem.mesh_of(count).mass, nodal(kept["a"] + nu * kept["v"], count)
        return mass, history.configurations["positions"][-1], acting, np.zeros_like(acting), mass
    rod = Rod(scene, len(history.arclength), history.options["clamp"])
    v, a = (kept[name].reshape(-1, 4).copy() for name in ("v", "a"))
    ends = [0, 1, -2, -1]
    _, v[ends, :3], a[ends, :3] = held(scene, rod.arclength[ends])
    v[[0, -2], 3] = rate * scene.drives.twist_left, rate * scene.drives.twist_right
    a[[0, -2], 3] = 0.0
    share = np.full(len(v) - 1, rod.rest)
    share[[0, -1]] *= 0.5 + rod.lumps[0] / rod.rest
    return rod.lumps, kept["x"], a[:, :3] + nu * v[:, :3], (a + nu * v)[:-1, 3:] * kept["tangent"], share


def unbalanced(history):
    """Force and moment about the left clamp that are left over at the last instant, over the largest ones."""
    scene, (left, right) = history.scene, history.reactions[-1]
    mass, x, acting, spin, share = inertia(history)
    # (of an even number of nodes two carry the push)
    middle = 0.5 * (x[(len(x) - 1) // 2] + x[len(x) // 2])
    push, reach = np.array([0.0, 0.0, -PUSH]), held(scene, np.array([1.0]))[0, 0]
    force = left[:3] + right[:3] + push
    moment = left[3:] + right[3:] + np.cross(reach, right[:3]) + np.cross(middle, push)
    inertial = mass[:, None] * (scene.weight - acting)
    force = force + inertial.sum(axis=0)
    moment = moment + np.cross(x, inertial).sum(axis=0)
    moment -= scene.ribbon.rotary_inertia * (share[:, None] * spin).sum(axis=0)
    return np.abs(force).max() / np.abs(right).max(), np.abs(moment).max() / np.abs(right).max()


@pytest.mark.parametrize(
    ("name", "method", "retardation", "close"),
    [
        ("elastica", "esdirk4", 0.0, 1e-8),
        ("elastica", "newmark", 0.0, 1e-9),
        ("elastica that stretches", "generalised-alpha", 1e-3, 1e-8),
        ("kirchhoff", "newmark", 0.0, 1e-9),
        ("kirchhoff", "esdirk4", 1e-3, 1e-7),
        ("kirchhoff, gyroscopic", "newmark", 0.0, 1e-9),
        ("kirchhoff, gyroscopic", "implicit-euler", 0.0, 1e-6),
        ("der", "esdirk3", 0.0, 1e-9),
        ("der, even", "tr-bdf2", 1e-3, 1e-9),
        ("der, two-node", "implicit-euler", 0.0, 1e-9),
    ],
)
def test_in_motion_momentum_and_angular_momentum_balance(name, method, retardation, close):
    """By the velocities and accelerations of the last instant, to what Newton leaves of moments."""
    history = moved(name, method, retardation)
    assert np.isfinite(history.reactions).all()
    assert not history.reactions.flags.writeable
    force, moment = unbalanced(history)
    assert force < 1e-9
    assert moment < close


def test_in_motion_a_beam_of_small_slopes_balances():
    """Z = 1 and Z = s are shapes of its mesh, along which nothing bends."""
    history = moved("quasilinear", "esdirk4", 1e-3)
    scene, kept = history.scene, history.resume
    mesh, scale, nu = quasilinear.problem.mesh_of(1, 18), scene.compression**0.5, scene.scaled_damping
    velocity, change = (np.append(kept[n], kept["ends"][k]) for n, k in (("v", 1), ("a", 2)))
    inertial = scale * (mesh.mass @ (change + nu * velocity)) - scene.weight[2] * mesh.weight
    (left, right), lift = history.reactions[-1], scene.drives.lift * scene.stop
    for ends, arms, turns, at_middle in (((1, 0, 1, 0), (1, 1), 0, 1.0), ((0, 1, 1, 1), (0, 1), 1, 0.5)):
        shape = np.append(np.zeros(mesh.count), ends)
        given = arms[0] * left[2] + arms[1] * right[2] - turns * (left[4] + right[4] + lift * right[0])
        assert given - at_middle * PUSH == pytest.approx(shape @ inertial, abs=1e-9 * np.abs(right).max())


def test_those_of_means_are_the_impulse_of_each_step():
    """From rest to rest of the clamps, by which the inertia of what they hold takes none."""
    scene, options = scheduled(PLANAR, Schedule.ramp(0.4, 0.05, 4.0)), {"step": 2e-3, "every": 1}
    history = elastica.simulate(scene, method="discrete-gradient", **options)
    force = history.reactions[:, :, :3].sum(axis=1) + scene.weight - (0.0, 0.0, PUSH)
    impulse = (np.diff(history.time) / scene.ribbon.inertial_time) @ force[1:]
    x, mass = history.configurations["positions"], elastica.problem.mesh_of(8).mass
    momentum = mass @ nodal(history.resume["v"], 8) + scene.scaled_damping * (mass @ (x[-1] - x[0]))
    # (of a velocity Newton leaves 1e-8 L over a step of 2e-3 t*)
    np.testing.assert_allclose(impulse, momentum, atol=1e-3 * np.abs(momentum).max())


@pytest.mark.parametrize("name", CASES)
def test_at_rest_forces_and_moments_balance(name):
    history = moved(name, "tr-bdf2")
    (left, right), scene = history.reactions[0], history.scene
    size = np.abs(right).max()
    loads = np.array(scene.weight) - (0.0, 0.0, PUSH)
    assert np.abs(left[:3] + right[:3] + loads).max() < 1e-9 * size
    if history.model in ("elastica", "kirchhoff"):
        assert history.load[0] - left[0] == pytest.approx(0.5 * scene.weight[0], abs=1e-9 * size)
        # about the left clamp: weights act at their nodes
        x = history.configurations["positions"][0]
        mass = elastica.problem.mesh_of(history.options["elements"]).mass
        moment = left[3:] + right[3:] + np.cross(x[-1] - x[0], right[:3])
        moment += np.cross(mass @ (x - x[0]), scene.weight)
        moment += np.cross(x[len(x) // 2] - x[0], (0.0, 0.0, -PUSH))
        assert np.abs(moment).max() < 1e-9 * size


@pytest.mark.parametrize("name", ["elastica", "kirchhoff", "der"])
def test_a_state_at_rest_has_them_too(name):
    model, scene, options = CASES[name]
    mesh = options or {"elements": 8}
    state, history = model.state(scene.at_rest, **mesh), moved(name, "tr-bdf2")
    size = np.abs(state.reactions).max()
    np.testing.assert_allclose(state.reactions, history.reactions[0], atol=1e-9 * size)
    np.testing.assert_allclose(state.reactions[1, :3], state.force, atol=1e-12 * size)
    let_go = replace(scene, preset={})
    begun = model.simulate(let_go, initial=state, step=1e-2, **mesh).reactions
    np.testing.assert_array_equal(begun[0], state.reactions)
    # where a curve of equilibria has the scene's start
    curve = model.equilibria(scene.at_rest, span=(-1e-3, 1e-3), **mesh)
    load = curve.load[np.argmin(np.abs(curve.control))]
    assert load == pytest.approx(-state.reactions[1, 0], abs=1e-6 * size)


@pytest.mark.parametrize("name", ["quasilinear", "elastica", "kirchhoff", "der"])
def test_their_power_is_the_work_of_the_controls(name):
    model, scene, options = CASES[name]
    # (in three dimensions what a clamp holds does no work, in the plane it does)
    drive = Drive(left=1.0, right=0.3, **({"lift": 0.2, "compression": 0.1} if scene is PLANAR else {}))
    scene = scheduled(scene, Schedule.ramp(0.4, 0.1, 4.0), preset={}, drive=drive)
    history = model.simulate(scene, step=2e-3, every=1, **options)
    time, control, moves = history.time, history.control, scene.drives
    power = moves.left * history.reactions[:, 0, 4] - moves.right * history.reactions[:, 1, 4]
    power = power + moves.lift * history.reactions[:, 1, 2] - moves.compression * history.reactions[:, 1, 0]
    work = np.concatenate(([0.0], np.cumsum(0.5 * (power[1:] + power[:-1]) * np.diff(control))))
    assert np.ptp(time) > 0.2
    assert np.abs(work - history.energies["work"]).max() < 1e-5 * np.abs(work).max()


# (Newton leaves 1e-7 L in a step by means)
@pytest.mark.parametrize(("method", "close"), [("esdirk4", 1e-6), ("discrete-gradient", 1e-5)])
def test_in_the_plane_models_agree(method, close):
    scene = scheduled(PLANAR, Schedule.ramp(0.4, 0.05, 4.0), compression=0.40)
    options = {"step": 2e-3, "elements": 12, "method": method}
    planar, spatial = (model.simulate(scene, **options).reactions for model in (elastica, kirchhoff))
    size = np.abs(planar).max()
    assert np.abs(planar - spatial).max() < close * size


def test_small_slopes_agree_with_a_flat_elastica():
    """Their differences fall with dL/L, as one takes tangents for angles; both over (dL/L)^(1/2)."""
    off = []
    for compression in (4e-3, 1e-3):
        scene = Scene(
            compression=compression,
            shear=0.0,
            start="U+",
            drive=Drive(left=1.0, right=0.5),
            rate=0.5 * compression**0.5,
            stop=0.2 * compression**0.5,
            damping=20.0,
        )
        small, exact = (
            model.simulate(scene, step=2e-2, every=1).reactions / (1.0, 1, s, 1, s, 1)
            for model, s in ((quasilinear, compression**0.5), (elastica, compression**0.5))
        )
        off.append(np.abs(small - exact)[1:].max() / np.abs(small).max())
    assert off[1] < 1e-3
    assert off[0] / off[1] == pytest.approx(4.0, abs=0.8)


def test_rods_tend_to_the_elements():
    scene = scheduled(TILTED, Schedule.ramp(0.4, 0.2, 2.0), damping=30.0)
    options = {"step": 5e-3, "every": 1}
    elements = kirchhoff.simulate(scene, extensible=True, method="tr-bdf2", **options).reactions
    # (of what Newton leaves in a position the stiff direction makes a force)
    options |= {"newton_tolerance": 1e-12}
    coarse, fine = (der.simulate(scene, nodes=nodes, **options).reactions for nodes in (82, 162))
    assert np.abs(coarse - elements).max() / np.abs(fine - elements).max() == pytest.approx(4.0, abs=0.2)
    limit = fine + (fine - coarse) / 3.0
    assert np.abs(limit - elements).max() < 1e-4 * np.abs(elements).max()


@pytest.mark.parametrize("name", ["quasilinear", "elastica", "kirchhoff", "der"])
def test_the_mirror_image_has_the_mirrored_ones(name):
    model, scene, options = CASES[name]
    one, other = (model.simulate(s, step=5e-3, **options).reactions for s in (scene, scene.mirror))
    # forces are vectors; moments are axial
    signs = np.array([1.0, 1.0, -1.0, -1.0, -1.0, 1.0])
    np.testing.assert_allclose(other, signs * one, atol=1e-6 * np.abs(one).max())


@pytest.mark.parametrize("name", ["quasilinear", "elastica", "kirchhoff", "der"])
def test_a_motion_that_goes_on_begins_with_the_last_ones(name):
    model, scene, options = CASES[name]
    half = Schedule((0.0, 0.05, 0.1), (0.0, 0.02, 0.06), kind="linear")
    whole = scheduled(scene, half)
    first = replace(scene, stop=0.02)
    second = scheduled(scene, Schedule((0.0, 0.05), (0.02, 0.06), kind="linear"))
    begun = model.simulate(first, step=5e-3, **options)
    rest = model.simulate(second, step=5e-3, initial=begun, **options)
    np.testing.assert_array_equal(rest.reactions[0], begun.reactions[-1])
    once = model.simulate(whole, step=5e-3, **options)
    joined = np.concatenate((begun.reactions, rest.reactions[1:]))
    np.testing.assert_allclose(joined, once.reactions, rtol=1e-9, atol=1e-9 * np.abs(joined).max())


def test_they_are_kept_as_the_rows_are():
    history = moved("kirchhoff", "tr-bdf2")
    every = kirchhoff.simulate(history.scene, step=1e-3, method="tr-bdf2", every=7)
    rows = np.isin(history.time, every.time)
    np.testing.assert_array_equal(every.reactions, history.reactions[rows])
    assert archive.from_bytes(archive.to_bytes(history)) == history
    bare = replace(history, reactions=None)
    assert bare.reactions.shape == history.reactions.shape
    assert np.isnan(bare.reactions).all()
    assert bare != history
    frame = pytest.importorskip("pandas") and history.to_pandas()
    np.testing.assert_array_equal(frame["moment_left_y"], history.reactions[:, 0, 4])
    assert (frame.attrs["units"]["moment_left_y"], frame.attrs["units"]["force_right_x"]) == (
        "EI2/L",
        "EI2/L^2",
    )
    data = pytest.importorskip("xarray") and history.to_xarray()
    np.testing.assert_array_equal(data["force"].sel(clamp="right", axis="z"), history.reactions[:, 1, 2])
    assert data["moment"].attrs["units"] == "EI2/L"
