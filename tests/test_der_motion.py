from functools import cache

import numpy as np
import pytest

import der
from der.motion import ADAPTIVE, METHODS, ORDERS
from ribbonfem import Scene, SceneError, SolverError
from ribbonfem.options import OptionError

# Path 1: one fold, met at 0.5 rad/s so that it snaps after 1.5 s
SNAP = Scene(compression=0.40, shear=0.37, start="U+S-", rate=0.5, stop=0.8, damping=1.0)
COARSE = {"nodes": 21, "configurations": False}


def balance(history):
    e = history.energies
    return e["kinetic"] + e["elastic"] + e["dissipated"] - e["work"] - e["elastic"][0]


# The clamp's jump of speed at t = 0 makes every mode ring, also those that no step resolves; a
# slower clamp leaves less of that noise, so that orders can be read off.
SLOW = Scene(compression=0.40, shear=0.37, start="U+S-", rate=0.1, stop=0.604, damping=1.0)


@cache
def snap_angle(**options):
    return der.simulate(SLOW, newton_tolerance=1e-11, **COARSE, **options).crossing()[1]


@pytest.fixture(scope="module")
def explicit():
    """The snap angle by an integrator that solves nothing, in the limit of its step."""
    coarse, fine = (snap_angle(method="verlet", step=h) for h in (6e-5, 3e-5))
    assert abs(coarse - fine) < 1e-5
    return fine + (fine - coarse) / 3


@pytest.mark.parametrize("method", sorted(set(METHODS) - {"esdirk3", "esdirk4"}))
def test_declared_order_at_the_snap(method, explicit):
    order = ORDERS[method]
    steps = [6e-5, 3e-5, 1.5e-5] if method == "verlet" else [4e-3, 2e-3, 1e-3]
    if method == "midpoint":
        steps = [4 * h for h in steps]  # at the others' its error is below the noise of the kink
    angles = [snap_angle(method=method, step=h) for h in steps]
    observed = np.log2(abs((angles[0] - angles[1]) / (angles[1] - angles[2])))
    # the leading errors of the midpoint rule nearly cancel at this snap
    most = 5.0 if method == "midpoint" else order + 0.3
    assert order - 0.3 < observed < most, f"{method}: declared {order}, observed {observed}, {angles}"
    limit = angles[2] + (angles[2] - angles[1]) / (2**order - 1)
    assert abs(limit - explicit) < (2e-5 if order == 1 else 1e-6), f"{method}: {limit - explicit}"


@pytest.mark.parametrize("method", ["esdirk3", "esdirk4"])
def test_higher_orders(method):
    """Where friction stops the waves of the kink: 3, and the stiff stretch leaves "esdirk4" no more."""
    scene = Scene(compression=0.40, shear=0.37, start="U+S-", rate=0.5, stop=0.6, damping=30.0)

    def end(method, step):
        history = der.simulate(scene, nodes=21, method=method, step=step, newton_tolerance=1e-11)
        return history.configurations["positions"][-1]

    limit = end("esdirk4", 0.0025)
    errors = [np.abs(end(method, step) - limit).max() for step in (0.1, 0.05, 0.025)]
    observed = 0.5 * np.log2(errors[0] / errors[2])
    assert ORDERS[method] == 3
    assert 2.3 < observed < 3.7, f"observed order {observed:.2f}: {errors}"
    second = np.abs(end("tr-bdf2", 0.025) - limit).max()
    assert errors[2] < second / (5 if method == "esdirk3" else 50)


@pytest.mark.parametrize("method", ["tr-bdf2", "esdirk3", "esdirk4", "newmark", "generalised-alpha"])
def test_adaptive_error_follows_the_tolerance(method, explicit):
    errors = [
        abs(der.simulate(SLOW, method=method, tolerance=tol, **COARSE).crossing()[1] - explicit)
        for tol in (1e-3, 1e-5)
    ]
    assert errors[0] < 2e-3
    assert errors[1] < 1e-4
    assert errors[1] < 0.3 * errors[0]


def test_default_is_good_to_1e_4(explicit):
    assert abs(der.simulate(SLOW, **COARSE).crossing()[1] - explicit) < 1e-4


def test_start_at_rest_and_rows():
    history = der.simulate(SNAP, nodes=21)
    assert history.time[0] == 0.0
    assert history.angle[0] == 0.0
    assert history.energies["kinetic"][0] == 0.0
    assert history.angle[-1] == SNAP.stop
    assert np.all(np.diff(history.time) > 0)
    assert len(history) == history.stats["steps"] + 1
    assert history.configurations["positions"].shape == (len(history), 21, 3)
    assert history.configurations["normals"].shape == (len(history), 20, 3)
    tangents = np.diff(history.configurations["positions"], axis=1)
    normals = history.configurations["normals"]
    assert np.abs((tangents * normals).sum(axis=2)).max() < 1e-10
    assert np.abs((normals**2).sum(axis=2) - 1).max() < 1e-12
    assert history.options["nodes"] == 21
    # U- beyond the snap
    assert history.height[0] > 0.2
    assert history.height[-1] < 0


def test_rest_stays_at_rest():
    # hardly turned, then held for long: no drift, no energy
    scene = Scene(compression=0.40, shear=0.37, start="U+S-", rate=0.1, stop=1e-9, hold=50.0, damping=0.0)
    history = der.simulate(scene, **COARSE)
    assert abs(history.height[-1] - history.height[0]) < 1e-8
    assert history.energies["kinetic"].max() < 1e-14


def test_kink_is_landed_on_and_the_hold_decays():
    scene = Scene(compression=0.40, shear=0.37, start="U+S-", rate=0.5, stop=0.8, hold=6.0, damping=2.0)
    history = der.simulate(scene, **COARSE)
    assert np.any(np.abs(history.time - 1.6) < 1e-12)
    assert np.isclose(history.time[-1], 7.6)
    assert history.energies["kinetic"][-1] < 1e-3 * history.energies["kinetic"].max()
    held = history.time >= 1.6
    assert np.ptp(history.energies["work"][held]) == 0.0


@pytest.mark.parametrize(
    ("method", "step", "bound"), [("discrete-gradient", 2e-3, 0.05), ("tr-bdf2", 5e-4, 0.2)]
)
def test_energy_balance(method, step, bound):
    history = der.simulate(SNAP, method=method, step=step, newton_tolerance=1e-10, **COARSE)
    moved = history.energies["kinetic"].max()
    assert moved > 4.0
    assert np.abs(balance(history)).max() < bound * moved


def test_mirror_and_reversal_of_the_motion():
    mirror = Scene(compression=0.40, shear=0.37, start="U-S-", rate=-0.5, stop=-0.8, damping=1.0)
    plain, image = der.simulate(SNAP, **COARSE), der.simulate(mirror, **COARSE)
    assert abs(plain.crossing()[1] + image.crossing()[1]) < 1e-7
    sideways = Scene(compression=0.40, shear=-0.37, start="U+S-", rate=0.5, stop=0.8, damping=1.0)
    assert abs(plain.crossing()[1] - der.simulate(sideways, **COARSE).crossing()[1]) < 1e-7


def test_slow_and_overdamped():
    # the creep through a snap at nu = 1e3, rate 1e-4: minutes of simulated time
    scene = Scene(compression=0.40, shear=0.37, start="U+S-", rate=1e-3, stop=0.9, damping=1e3)
    history = der.simulate(scene, **COARSE)
    (fold,) = der.folds(scene.__class__(compression=0.40, shear=0.37, start="U+S-"), nodes=21)
    assert history.crossing()[1] > fold.angle
    assert history.stats["steps"] < 1500


def test_garbage_is_refused_with_the_history():
    with pytest.raises(SolverError, match="verlet stopped at") as caught:
        der.simulate(SNAP, method="verlet", step=1e-3, **COARSE)
    assert len(caught.value.history) >= 1
    scene = Scene(compression=0.40, shear=0.37, start="U+S-", rate=0.5, stop=0.8, damping=0.0, hold=5.0)
    with pytest.raises(SolverError, match=r"energy|converged"):
        der.simulate(scene, method="midpoint", step=1.6e-2, **COARSE)


def test_chunks_join(monkeypatch):
    whole = der.simulate(SNAP, nodes=21)
    monkeypatch.setattr("ribbonfem.rows.CHUNK", 1)
    parts = der.simulate(SNAP, nodes=21)
    assert len(parts) > 256
    assert np.array_equal(whole.height, parts.height)
    assert np.array_equal(whole.configurations["positions"], parts.configurations["positions"])


def test_every_nth_row():
    full = der.simulate(SNAP, method="implicit-euler", step=2e-3, **COARSE)
    some = der.simulate(SNAP, method="implicit-euler", step=2e-3, every=7, **COARSE)
    assert np.array_equal(some.height[:-1], full.height[::7][: len(some) - 1])
    assert some.height[-1] == full.height[-1]
    assert some.energies["dissipated"][-1] == full.energies["dissipated"][-1]


def test_refusals():
    with pytest.raises(SceneError, match="stop"):
        der.simulate(Scene())
    with pytest.raises(OptionError, match="method = 'rk4'"):
        der.simulate(SNAP, method="rk4")
    with pytest.raises(OptionError, match="not both"):
        der.simulate(SNAP, step=1e-3, tolerance=1e-4)
    with pytest.raises(OptionError, match="verlet"):
        der.simulate(SNAP, method="verlet")
    with pytest.raises(OptionError, match="step = -1"):
        der.simulate(SNAP, step=-1)
    with pytest.raises(OptionError, match="spectral_radius"):
        der.simulate(SNAP, spectral_radius=1.5)
    assert "verlet" not in ADAPTIVE


@pytest.mark.parametrize(("damping", "final"), [(0.3, "U-S+"), (10.0, "U+S-")])
def test_decided_runs_end_early_in_the_same_state(damping, final):
    scene = Scene(compression=0.40, shear=0.40, rate=1.0, stop=0.36, damping=damping, hold=12.0)
    whole = der.simulate(scene, nodes=31, configurations=False)
    short = der.simulate(scene, nodes=31, configurations=False, until="decided")
    assert short.time[-1] < 0.7 * whole.time[-1]
    rows = len(short)
    assert np.array_equal(short.height, whole.height[:rows])
    for history in (whole, short):
        # decided, but perhaps not at rest: the sign of z is the state's
        assert der.modes.name_by_signs(history.height[-1], history.slope[-1])[:2] == final[:2]


@pytest.mark.parametrize(("start", "rate"), [("U+S-", 1.0), ("U-S+", -1.0)])
def test_a_run_until_the_snap_is_the_beginning_of_the_whole_run(start, rate):
    scene = Scene(compression=0.40, shear=0.37, start=start, rate=rate, stop=rate, damping=1.0)
    whole = der.simulate(scene, nodes=31, configurations=False)
    short = der.simulate(scene, nodes=31, configurations=False, until="snap")
    np.testing.assert_array_equal(short.height, whole.height[: len(short)])
    assert short.crossing() == whole.crossing()
    # two rows after the crossing, which a cubic needs where velocities are not known
    assert np.count_nonzero(short.height * short.height[0] < 0.0) == 2
