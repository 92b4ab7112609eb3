"""Which rows of a motion are kept, and that nothing that is found in it depends on them."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import der
import ribbonfem.rows
from ribbonfem import Scene, elastica, kirchhoff, quasilinear
from ribbonfem.outcomes import classify, events
from ribbonfem.results import Fold
from ribbonfem.rows import Columns, Rows

RIBBON = Scene(compression=0.40, shear=0.37, start="U+S+", rate=0.5, stop=0.9, damping=0.3)
PLANAR = Scene(compression=0.40, shear=0.0, start="U+", rate=1.0, stop=1.5, damping=1.0)
RUNS = {
    "rods": (der, RIBBON, {"nodes": 51}),
    "rods whose velocities ring": (der, RIBBON, {"nodes": 21, "method": "discrete-gradient", "step": 2e-3}),
    "elements": (kirchhoff, RIBBON, {"elements": 4, "tolerance": 1e-4}),
    "right clamp": (
        der,
        Scene(compression=0.40, shear=0.37, start="U+S-", rate=0.5, stop=0.9, damping=0.3, drive="right"),
        {"nodes": 51},
    ),
    "elastica": (elastica, PLANAR, {"tolerance": 1e-4}),
    "quasilinear": (quasilinear, PLANAR, {"tolerance": 1e-4}),
}
FOLDS = (Fold(0.1139, 0.2, 0.0), Fold(0.5694, 0.1, 0.0))


def result(history):
    """What is derived of a motion."""
    levels = [
        history.crossing(name, level) for name in ("height", "slope") for level in (0.0, 0.05, -0.1, 0.3)
    ]
    passed = events(history, FOLDS)
    outcome = classify(history, FOLDS) if history.scene.shear else None
    kept = {name: v for name, v in history.stats.items() if name not in ("seconds", "rows_within")}
    return levels, passed, repr(outcome), repr(history).split(";")[1].split("\n")[1], repr(kept)


@pytest.mark.parametrize("until", ["end", "snap"])
@pytest.mark.parametrize("name", RUNS)
def test_what_is_found_does_not_depend_on_the_rows_kept(name, until):
    model, scene, options = RUNS[name]
    whole = model.simulate(scene, every=1, until=until, **options)
    assert whole.crossing() is not None
    for every in (None, 7, 1000):
        some = model.simulate(scene, every=every, until=until, **options)
        assert result(some) == result(whole), every
        if every is None:
            assert len(some) == len(whole) == whole.stats["steps"] + 1
            continue
        # the rows are those asked for, and the last
        rows = np.unique(np.append(np.arange(0, len(whole), every), len(whole) - 1))
        assert np.array_equal(some.time, whole.time[rows])
        assert np.array_equal(some.energies["kinetic"], whole.energies["kinetic"][rows])
        assert np.array_equal(some.energies["elastic"], whole.energies["elastic"][rows])
        assert np.array_equal(some.load, whole.load[rows])
        for kind, values in some.configurations.items():
            assert np.array_equal(values, whole.configurations[kind][rows])


def test_the_snap_of_thinned_rods():
    """The angle is that of a run with every row, of rods and of the elements that they tend to."""
    scene = Scene(compression=0.40, shear=0.37, start="U+S+", rate=0.5, stop=0.9, damping=0.3, hold=2)
    for every in (1, 1000):
        history = der.simulate(scene, nodes=51, tolerance=1.5e-4, every=every, configurations=False)
        assert history.crossing()[1] == pytest.approx(0.616773, abs=5e-6)
        assert f"snap at {history.crossing()[1]:.6g} rad" in repr(history)


@pytest.mark.parametrize("until", ["end", "decided"])
def test_a_decided_run_ends_at_one_instant(until):
    scene = Scene(compression=0.40, shear=0.37, start="U+S+", rate=0.5, stop=0.3, hold=3.0, damping=3.0)
    ends = [der.simulate(scene, nodes=21, every=k, until=until).time[-1] for k in (1, 13)]
    assert ends[0] == ends[1]
    assert (ends[0] < 3.6) == (until == "decided")


def between(rows, time, values):
    """Values (rows, ...) at other instants, on lines through the rows."""
    k = np.clip(np.searchsorted(rows, time, side="right") - 1, 0, len(rows) - 2)
    share = ((time - rows[k]) / (rows[k + 1] - rows[k])).reshape(-1, *(1,) * (values.ndim - 1))
    return values[k] + share * (values[k + 1] - values[k])


@pytest.mark.parametrize(
    ("name", "most"),
    [("rods", 120_000), ("elements", 60_000), ("right clamp", 120_000), ("elastica", 9_000)],
)
def test_rows_that_fill_the_memory_are_thinned(name, most, monkeypatch):
    """A line through those left is within 1e-3 L of all, and what is found is the same."""
    model, scene, options = RUNS[name]
    options = {**options, "tolerance": 1e-5}
    whole = model.simulate(scene, every=1, **options)
    monkeypatch.setattr(ribbonfem.rows, "MOST", 8 * most)
    monkeypatch.setattr(ribbonfem.rows, "LEAST", 10)
    some = model.simulate(scene, **options)
    assert len(some) < 0.5 * len(whole)
    assert result(some)[:4] == result(whole)[:4]
    assert some.angle[-1] == whole.angle[-1]
    lines = between(some.time, whole.time, some.configurations["positions"])
    off = np.linalg.norm(lines - whole.configurations["positions"], axis=2).max()
    assert 0.0 < off <= some.stats["rows_within"] + 1e-12
    assert some.stats["rows_within"] <= 1e-3 or len(some) * some.configurations["positions"][0].size < most
    assert whole.stats["rows_within"] == 0.0
    # the clamp's own line too
    assert np.abs(between(some.time, whole.time, some.angle) - whole.angle).max() < 1e-8


COLUMNS = Columns(0, 1, 2, 3, 4, 5, 9)


def fed(rows, blocks, *, every=None, seed=0):
    """Rows of a made-up oscillation, handed over in blocks of random lengths."""
    kept = Rows(10, COLUMNS, every=every)
    rng, a = np.random.default_rng(seed), 0
    while a < len(rows):
        b = min(a + int(rng.integers(1, blocks)), len(rows))
        kept.append(rows[a:b].copy())
        a = b
    return kept


def oscillation(count, seed):
    rng = np.random.default_rng(seed)
    rows = np.zeros((count, 10))
    rows[:, 0] = np.cumsum(rng.uniform(0.5, 1.5, count)) * 20.0 / count
    rows[:, 1] = np.minimum(rows[:, 0], 7.0)
    rows[:, 2] = 0.2 * np.cos(3.0 * rows[:, 0]) * np.exp(-0.05 * rows[:, 0])
    rows[:, 3] = np.sin(2.0 * rows[:, 0])
    rows[:, 9] = np.arange(count) % 5 == 0
    return rows


@pytest.mark.parametrize("seed", range(20))
def test_a_long_track_keeps_what_happens(seed, monkeypatch):
    """Sign changes and minima are on the same rows as without, to the last bit, and so few stay."""
    rows = oscillation(4000, seed)
    monkeypatch.setattr(ribbonfem.rows, "MOST_TRACKED", 1200)
    kept = fed(rows, 300, every=5, seed=seed)
    _, track = kept.taken({})
    assert track.shape[1] <= 1300
    assert len(kept.taken({})[0][0]) == 800
    for column, row in ((2, 2), (3, 3)):
        values = rows[:, column]
        changes = np.flatnonzero((values[1:] > 0.0) != (values[:-1] > 0.0)) + 1
        instants = np.concatenate([rows[changes + shift, 0] for shift in (-2, -1, 0, 1)])
        assert np.isin(instants, track[0]).all(), row
    height = rows[:, 2]
    minima = np.flatnonzero((height[1:-1] < height[:-2]) & (height[1:-1] <= height[2:])) + 1
    assert np.isin(rows[minima, 0], track[0]).all()


@pytest.mark.parametrize("most", [300, 1500])
@pytest.mark.parametrize("seed", range(20))
def test_thinning_again_and_again_stays_within_its_bound(seed, most, monkeypatch):
    """Within 1e-3 L where as many rows have room, and else within what is said."""
    monkeypatch.setattr(ribbonfem.rows, "MOST", 8 * 10 * most)
    monkeypatch.setattr(ribbonfem.rows, "LEAST", 10)
    rows = oscillation(6000, seed)
    kept = fed(rows, 150, seed=seed)
    (left,), track = kept.taken({})
    assert len(left) <= most
    off = np.abs(between(left[:, 0], rows[:, 0], left[:, 2]) - rows[:, 2]).max()
    assert 1e-5 < off <= kept.within + 1e-12
    assert kept.within <= (1e-3 if most == 1500 else 1e-2)
    assert track.shape[1] == len(rows)


SLOW_RAMP = """
import der
from ribbonfem import Scene
scene = Scene(compression=0.40, shear=0.37, start="U+S-", rate=0.01, stop=0.62, damping=0.0)
history = der.simulate(scene, tolerance=1e-6)
kept = sum(values.nbytes for values in history.configurations.values())
# (what getrusage says counts the process that has made this one)
(peak,) = (line.split()[1] for line in open("/proc/self/status") if line.startswith("VmHWM"))
print(history.stats["steps"], kept, history.stats["rows_within"], peak)
"""


@pytest.mark.slow
def test_a_slow_ramp_of_rods_takes_little_memory():
    """Of its 94,000 steps every configuration would take 680 MB."""
    if not Path("/proc/self/status").exists():
        pytest.skip("the peak is Linux's")
    run = subprocess.run([sys.executable, "-W", "ignore", "-c", SLOW_RAMP], capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    steps, kept, within, peak = map(float, run.stdout.split())
    assert steps > 50_000
    assert kept < 200e6
    assert 0.0 < within <= 1e-3
    # (in kilobytes)
    assert peak < 500_000


@pytest.mark.parametrize(
    ("model", "scene", "mesh"),
    [(elastica, PLANAR, {"elements": 6}), (kirchhoff, RIBBON, {"elements": 4}), (der, RIBBON, {"nodes": 31})],
)
def test_what_a_method_takes_of_the_energy_is_told(model, scene, mesh):
    """Implicit Euler beyond a snap; of every step, whichever rows are kept."""
    case = replace(scene, rate=1.0, damping=0.1, hold=0.1)
    options = {**mesh, "method": "implicit-euler", "step": 5e-3}
    whole = model.simulate(case, every=1, **options)
    e = whole.energies
    balance = e["kinetic"] + e["elastic"] + e["dissipated"] - e["work"]
    taken, share = whole.stats["numerical_dissipation"], whole.stats["numerical_dissipation_share"]
    assert taken == pytest.approx(balance[0] - balance[-1], rel=1e-12)
    assert share == pytest.approx(taken / e["kinetic"].max(), rel=1e-12)
    assert share > 0.2
    assert f"the method itself took {taken:.3g} EI2/L, {share:.0%} of the largest kinetic energy" in repr(
        whole
    )
    few = model.simulate(case, every=40, **options)
    assert len(few) < len(whole) / 20
    assert few.stats["numerical_dissipation_share"] == share
