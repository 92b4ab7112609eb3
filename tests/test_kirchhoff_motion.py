"""The ribbon in motion by finite elements: derivatives, rest, orders, invariants, limits of other models."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import der
from ribbonfem import Ribbon, Scene, SceneError, SolverError, delay, elastica, kirchhoff
from ribbonfem.kirchhoff import discretisation, initial_states, states
from ribbonfem.kirchhoff.kernels import condensed, energies, tangent
from ribbonfem.kirchhoff.kernels.batch import in_groups
from ribbonfem.kirchhoff.kernels.residual import residual
from ribbonfem.kirchhoff.kernels.rod import solver
from ribbonfem.options import OptionError
from ribbonfem.stepping import methods

# one fold, met at 0.5 rad/s so that it snaps after 1.4 s
SNAP = Scene(compression=0.40, shear=0.37, start="U+S-", rate=0.5, stop=0.8, damping=1.0)
SECOND_ORDER = ("tr-bdf2", "generalised-alpha", "newmark")


def balance(history):
    e = history.energies
    return e["kinetic"] + e["elastic"] + e["dissipated"] - e["work"]


def snap(scene, quantity="height", **options):
    options = {"until": "snap", "configurations": False, **options}
    return kirchhoff.simulate(scene, **options).crossing(quantity)[1]


# --- derivatives ---------------------------------------------------------------------------------


def functional(rod, r, g, n):
    """The energy, written for complex arguments and without the kernels."""
    total = 0.0
    for e in range(len(rod.weights)):
        nodes = slice(5 * e, 5 * e + 6)
        q, p, stretched = rod.value @ g[nodes], rod.slope[e] @ g[nodes], rod.slope[e] @ r[nodes]
        w, v, dw, dv = q[:, 0], q[:, 1:], p[:, 0], p[:, 1:]
        square = np.sum(q * q, axis=1)
        kappa = 2 * (w[:, None] * dv - dw[:, None] * v - np.cross(v, dv)) / square[:, None]
        x, y, z = v.T
        t = np.stack((w * w + x * x - y * y - z * z, 2 * (x * y + w * z), 2 * (x * z - w * y)), axis=1)
        t = t / square[:, None]
        pull = np.sum(n[e] * t, axis=1)
        density = 0.5 * kappa**2 @ rod.stiffness + np.sum(n[e] * (stretched - t), axis=1)
        total = total + rod.weights[e] @ (density - 0.5 * rod.compliance[0] * pull**2)
    return total


def rotated(g, psi):
    """g exp(psi / 2), for complex psi (nodes, 3)."""
    half = 0.5 * np.sqrt(np.sum(psi * psi, axis=1) + 1e-60)
    a, b, c = (0.5 * psi * (np.sin(half) / half)[:, None]).T
    w, x, y, z = g.T
    d = np.cos(half)
    return np.stack(
        (
            w * d - x * a - y * b - z * c,
            x * d + w * a + y * c - z * b,
            y * d + w * b + z * a - x * c,
            z * d + w * c + x * b - y * a,
        ),
        axis=1,
    )


# two groups of four, the second half empty
ELEMENTS = 6


def one_by_one(groups):
    """Values (groups, ..., 4) as (elements, ...)."""
    return np.moveaxis(groups, -1, 1).reshape(-1, *groups.shape[1:-1])[:ELEMENTS]


def random_rod(extensible):
    """A rod far from equilibrium: its arrays, positions, frames, and forces (elements, 5, 3)."""
    rng = np.random.default_rng(5)
    scene = replace(SNAP, ribbon=Ribbon(thickness=0.1, bending_ratio=400.0, twist_ratio=1.4562))
    problem, start = states.named(scene, elements=ELEMENTS, extensible=extensible)
    rod, state = discretisation.discretised(problem, scene), initial_states.at_rest(problem, start)
    x = state.x + 0.05 * rng.normal(size=state.x.shape)
    g = state.g + 0.2 * rng.normal(size=state.g.shape)
    g /= np.linalg.norm(g, axis=1)[:, None]
    n = one_by_one(state.n)
    return rod, x, g, n + 10 * rng.normal(size=n.shape), rng


@pytest.mark.parametrize("extensible", [False, True])
def test_residual_is_the_derivative_of_the_energy(extensible):
    rod, x, g, n, rng = random_rod(extensible)
    memory, force = solver(ELEMENTS), rng.normal(size=x.shape)
    residual(rod, memory, x, g, in_groups(n), force)
    gaps = one_by_one(memory.fn)
    # of bending, twist and stretch: with n.(r' - t), which the constraint makes c (n.t)^2, left out
    gap = np.sum(gaps * n)
    pulled = functional(rod, x[:, :3], g, n) - gap
    assert energies.elastic_energy(rod, memory, g, in_groups(n)) == pytest.approx(pulled, rel=1e-12)
    # the clamp moves its own node, whose inertia is not the ribbon's
    held = memory.fp[0, :3] - [rod.inertia[0, 3] * force[0, 3], 0.0, 0.0]
    assert np.allclose(energies.clamp_moment(rod, g, in_groups(n), 0, 0), held, rtol=1e-12)
    r, zero = x[:, :3].astype(complex), np.zeros((len(g), 3), dtype=complex)
    step = 1e-30j
    for i in range(len(g)):
        for c in range(3):
            moved, turned = r.copy(), zero.copy()
            moved[i, c] += step
            turned[i, c] += step
            by_place = functional(rod, moved, g, n).imag / 1e-30
            by_turn = functional(rod, r, rotated(g, turned), n).imag / 1e-30
            by_place += rod.inertia[i, c] * force[i, c]
            by_turn += rod.inertia[i, 3] * force[i, 3] if c == 0 else 0.0
            assert abs(memory.fr[i, c] - by_place) < 1e-12 * np.abs(memory.fr).max()
            assert abs(memory.fp[i, c] - by_turn) < 1e-12 * np.abs(memory.fp).max()
    for index in np.ndindex(n.shape):
        pulled = n.astype(complex)
        pulled[index] += step
        by_force = functional(rod, r, g, pulled).imag / 1e-30
        assert abs(gaps[index] - by_force) < 1e-12 * np.abs(gaps).max()


@pytest.mark.parametrize("extensible", [False, True])
def test_condensed_solution_inverts_the_second_derivative(extensible):
    """u solves K u = -f where and only where the second derivative along any w is -w.f."""
    rod, x, g, n, rng = random_rod(extensible)
    sigma = 3e3
    memory = solver(ELEMENTS)
    tangent.fill(rod, memory, g, in_groups(n), sigma, False)
    condensed.factorise(memory)
    inner = slice(1, len(g) - 1)
    solutions, loads = [], []
    for _ in range(4):
        loads.append([rng.normal(size=(len(g), 3)), rng.normal(size=(len(g), 3)), rng.normal(size=n.shape)])
        memory.fr[:, :3], memory.fp[:, :3], memory.fn[:] = *loads[-1][:2], in_groups(loads[-1][2])
        condensed.solve(rod, memory, sigma)
        solutions.append([memory.fr[:, :3].copy(), memory.fp[:, :3].copy(), one_by_one(memory.fn)])
        assert np.all(memory.fr[[0, -1], :3] == 0)
        assert np.all(memory.fp[[0, -1], :3] == 0)

    def slope(u, h):
        """First derivative at h along the path of increments h u, inertia included."""
        z = h + 1e-30j
        value = functional(rod, x[:, :3] + z * u[0], rotated(g, z * u[1]), n + z * u[2])
        inertia = np.sum(rod.inertia[:, :3] * u[0] ** 2) + np.sum(rod.inertia[:, 3] * u[1][:, 0] ** 2)
        return value.imag / 1e-30 + sigma * h * inertia

    def second(u):
        # n enters as it is; turns must stay small
        h = 3e-3 / np.abs(u[1]).max()
        return (8 * (slope(u, h) - slope(u, -h)) - (slope(u, 2 * h) - slope(u, -2 * h))) / (12 * h)

    for u, f in zip(solutions, loads, strict=True):
        for w, load in zip(solutions, loads, strict=True):
            both = [a + b for a, b in zip(u, w, strict=True)]
            exact = -sum(
                np.sum((a + b)[inner] * (c + d)[inner]) if k < 2 else np.sum((a + b) * (c + d))
                for k, (a, b, c, d) in enumerate(zip(u, w, f, load, strict=True))
            )
            assert abs(second(both) - exact) < 1e-8 * abs(exact)


# --- rest and limits of other models -------------------------------------------------------------


@pytest.mark.parametrize("extensible", [False, True])
@pytest.mark.parametrize("elements", [4, 8])
def test_without_a_ramp_it_stays(elements, extensible):
    still = replace(SNAP, rate=1e-13, stop=1e-14, hold=30.0, damping=0.0)
    history = kirchhoff.simulate(still, elements=elements, extensible=extensible)
    x = history.configurations["positions"]
    assert np.abs(x - x[0]).max() < 1e-10
    assert history.energies["kinetic"].max() < 1e-16
    start = kirchhoff.state(still, elements=elements, extensible=extensible)
    assert np.abs(x[0] - start.positions).max() < 1e-12
    assert history.height[0] == pytest.approx(start.height, abs=1e-12)
    assert history.load[0] == pytest.approx(-start.force[0], abs=1e-8)


def test_snaps_are_those_of_the_rods_limit():
    """Limits of the discrete rods (N = 101, 201, 401 at a tight tolerance), with their own uncertainty."""
    first = Scene(compression=0.33, shear=0.34, start="U+S-", rate=0.2, damping=0.5, stop=0.7)
    second = Scene(compression=0.40, shear=0.40, start="U+S+", rate=1.0, damping=10.0, stop=0.7)
    third = Scene(compression=0.37, shear=0.385, start="U+S+", rate=0.3, damping=3.0, stop=0.55)
    options = {"extensible": True, "elements": 10, "tolerance": 3e-6}
    assert snap(first, **options) == pytest.approx(0.5962089, abs=3e-6)
    assert snap(second, "slope", **options) == pytest.approx(0.338914, abs=2e-5)
    assert snap(second, **options) == pytest.approx(0.6000015, abs=5e-6)
    assert snap(third, "slope", **options) == pytest.approx(0.214532, abs=5e-6)
    # vibrates between its snaps
    assert snap(third, **options) == pytest.approx(0.48392, abs=1.2e-4)


@pytest.mark.parametrize("extensible", [False, True])
def test_planar_ribbon_is_the_elastica(extensible):
    """No equation, element or stepper is shared, but in the last line the tableau of "esdirk4"."""
    beam = Scene(compression=0.40, shear=0.0, start="U+", rate=0.3, stop=1.4, damping=2.0)
    shared = {"extensible": extensible, "until": "snap", "tolerance": 1e-7}
    reference = elastica.simulate(beam, elements=16, **shared).crossing()[1]
    ribbon = kirchhoff.simulate(beam, elements=10, method="tr-bdf2", **shared)
    assert ribbon.crossing()[1] == pytest.approx(reference, abs=1e-6)
    assert np.abs(ribbon.configurations["positions"][:, :, 1]).max() < 1e-12
    # another method, of another order
    assert snap(beam, extensible=extensible, elements=10, tolerance=3e-6) == pytest.approx(
        reference, abs=3e-6
    )


def test_mirrored_scenes_move_alike():
    """z -> -z turns rate and U, y -> -y the shear."""
    options = {"elements": 4, "step": 0.01}
    first = snap(SNAP, **options)
    down = replace(SNAP, start="U-S-", rate=-0.5, stop=-0.8)
    assert snap(down, **options) == pytest.approx(-first, abs=1e-9)
    assert snap(replace(SNAP, shear=-0.37), **options) == pytest.approx(first, abs=1e-9)


# --- orders --------------------------------------------------------------------------------------


# friction stops the waves that the kink sends before they are all that an error is made of
STICKY = Scene(compression=0.40, shear=0.37, start="U+S-", rate=0.5, stop=1.2, damping=30.0)


def test_order_in_the_mesh():
    """Of the snap at the same steps: 2 p = 10 is promised."""
    fine = snap(STICKY, elements=14, step=0.005)
    errors = [abs(snap(STICKY, elements=elements, step=0.005) - fine) for elements in (6, 10)]
    observed = np.log(errors[0] / errors[1]) / np.log(10 / 6)
    assert errors[1] < 5e-8
    assert observed > 7, f"observed order {observed:.2f}, promised 10: {errors}"


STEPS = {"esdirk4": (0.1, 0.05, 0.025), "implicit-euler": (0.02, 0.01, 0.005)}


@cache
def end_of_ramp(method, step, extensible):
    """Positions."""
    options = {"elements": 4, "extensible": extensible, "step": step, "method": method}
    history = kirchhoff.simulate(replace(STICKY, stop=0.6), **options)
    return history.configurations["positions"][-1]


@pytest.mark.parametrize("extensible", [False, True])
@pytest.mark.parametrize("method", methods.ALL_METHODS)
def test_order_in_the_step(method, extensible):
    """Of the positions at the end of a ramp that stops before the snap."""
    limit = end_of_ramp("esdirk4", 0.005, extensible)
    steps = STEPS.get(method, (0.05, 0.025, 0.0125))
    errors = [np.abs(end_of_ramp(method, step, extensible) - limit).max() for step in steps]
    declared = methods.method_of(method).order
    observed = np.log2(errors[0] / errors[2]) / 2
    # "newmark" takes its velocities anew after every step, at half an order
    least = declared - (0.6 if method == "newmark" else 0.5)
    assert least < observed < declared + 0.5, f"order {observed:.2f} of {declared}: {errors}"
    assert errors[2] < {1: 1e-3, 2: 1e-5, 3: 1e-6}[declared]


# --- invariants ----------------------------------------------------------------------------------


def test_lengths_and_frames_do_not_drift():
    """Hundreds of steps of vibration: frames stay unit quaternions, the ribbon as long as it was."""
    case = replace(SNAP, damping=0.2, hold=2.0)
    history = kirchhoff.simulate(case, elements=6, tolerance=1e-4)
    assert history.stats["steps"] > 500
    normals, x = history.configurations["normals"], history.configurations["positions"]
    assert np.abs(np.linalg.norm(normals, axis=2) - 1.0).max() < 1e-13
    problem, _ = states.named(case, elements=6, extensible=False)
    tables = problem.tables
    nodes = 5 * np.arange(6)[:, None] + np.arange(6)
    slope = np.einsum("eki,teic->tekc", tables.slope, x[:, nodes])
    # Newton leaves a thousandth of the tolerance in a position
    assert np.abs(np.linalg.norm(slope, axis=3) - 1.0).max() < 1e-5


@pytest.mark.parametrize("extensible", [False, True])
@pytest.mark.parametrize("method", ["esdirk4", *SECOND_ORDER])
def test_force_does_not_chatter(method, extensible):
    """Undamped, after the kink: the alternating part of the force stays below a thousandth of it."""
    case = replace(SNAP, rate=0.1, stop=0.3, damping=0.0)
    for step in (0.01, 0.005):
        history = kirchhoff.simulate(case, elements=4, extensible=extensible, method=method, step=step)
        load = history.load
        alternating = load[1:-1] - (load[:-2] + 2 * load[1:-1] + load[2:]) / 4
        assert np.abs(alternating)[4:].mean() < 1e-3 * load.mean()


@pytest.mark.parametrize(
    ("method", "largest", "quarter"),
    [("esdirk4", 2e-6, 0.0), ("tr-bdf2", 1e-3, 4.0), ("generalised-alpha", 1e-3, 4.0)],
)
def test_energy_balance_closes_with_the_step(method, largest, quarter):
    """On the way to the fold; `quarter` is what a step of a quarter gains at least.

    With "esdirk4" the waves that the kink sends, which no step resolves, are all that is left.
    """
    case = replace(SNAP, stop=0.5, damping=10.0, rate=0.3)
    gaps = []
    for step in (0.02, 0.005):
        history = kirchhoff.simulate(case, elements=4, method=method, step=step)
        gaps.append(abs(balance(history)[-1] - balance(history)[0]))
    assert history.energies["work"][-1] > 0.1
    assert history.energies["dissipated"][-1] > 1e-2
    assert gaps[0] < largest
    assert gaps[0] / gaps[1] > quarter, gaps


def test_energy_balance_through_the_snap():
    """Undamped, half a second beyond it: within a thousandth of the largest kinetic energy."""
    case = replace(SNAP, damping=0.0, stop=0.69, hold=0.3)
    history = kirchhoff.simulate(case, elements=4, tolerance=1e-6)
    assert history.crossing() is not None
    kinetic = history.energies["kinetic"].max()
    assert kinetic > 4.0
    assert np.ptp(balance(history)) < 1e-3 * kinetic


def test_ringing_is_not_pumped():
    """A beam pressed to a tenth of its length snaps with ten times the energy of others, and rings.

    "esdirk4" hardly damps what its steps do not resolve; without its guard it doubles the energy here.
    """
    case = Scene(compression=0.9, shear=0.0, start="U+", rate=0.5, stop=1.4, damping=1.0)
    history = kirchhoff.simulate(case, configurations=False)
    assert history.crossing()[1] == pytest.approx(snap(case, method="tr-bdf2"), abs=1e-4)
    gained = balance(history)[1:] - np.minimum.accumulate(balance(history)[1:])
    assert gained.max() < 0.05 * history.energies["kinetic"].max()


def test_full_turns_of_the_clamp():
    """One and a half turns, with friction: the frame goes with the clamp, and the energy balances."""
    case = replace(SNAP, rate=4.0, stop=3.0 * np.pi, damping=10.0, hold=1.0)
    history = kirchhoff.simulate(case, elements=8, extensible=True, tolerance=1e-4)
    alpha = history.angle
    assert alpha[-1] == 3.0 * np.pi
    clamp = np.column_stack((np.sin(alpha), np.zeros_like(alpha), np.cos(alpha)))
    assert np.abs(history.configurations["normals"][:, 0] - clamp).max() < 1e-12
    assert np.ptp(balance(history)) < 2e-3 * history.energies["work"].max()
    # it has been wound up: another state than the rods' start, and what the rods come to
    rods = der.simulate(case, nodes=101, tolerance=1e-4)
    assert history.height[-1] == pytest.approx(rods.height[-1], abs=5e-3)
    assert history.energies["elastic"][-1] == pytest.approx(rods.energies["elastic"][-1], rel=1e-2)


def test_gyroscopic_moment_is_what_the_rods_leave_out():
    """In direction and size what an independent prototype found, with every method."""
    scene = Scene(compression=0.40, shear=0.40, start="U+S+", rate=1.0, damping=10.0, stop=0.7)
    options = {"extensible": True, "elements": 6, "step": 0.002}
    shifts = [
        snap(scene, quantity, gyroscopic=True, **options) - snap(scene, quantity, **options)
        for quantity in ("slope", "height")
    ]
    assert shifts[0] == pytest.approx(-1.0e-5, abs=1e-6)
    assert shifts[1] == pytest.approx(-8.6e-6, abs=1e-6)
    for method in ("tr-bdf2", "newmark", "generalised-alpha"):
        pair = [snap(scene, elements=4, method=method, step=0.002, gyroscopic=flag) for flag in (False, True)]
        assert pair[1] - pair[0] == pytest.approx(-8.6e-6, abs=4e-6)


# --- the loop ------------------------------------------------------------------------------------


def test_kinks_are_ends_of_steps():
    case = replace(SNAP, rate=0.7, stop=0.33, hold=0.2)
    for control in ({"step": 0.03}, {"tolerance": 1e-4}, {"step": 0.03, "method": "newmark"}):
        history = kirchhoff.simulate(case, elements=4, **control)
        first = int(np.flatnonzero(history.angle == 0.33)[0])
        assert np.all(history.angle[first:] == 0.33)
        assert history.time[first] == pytest.approx(0.33 / 0.7, rel=1e-14)
        assert history.time[-1] == pytest.approx(0.33 / 0.7 + 0.2, rel=1e-14)
        assert np.allclose(history.angle[:first], 0.7 * history.time[:first], rtol=1e-13)
    # 16 steps of the ramp, shortened to fit, and 7 of the hold
    assert len(kirchhoff.simulate(case, elements=4, step=0.03)) == 1 + 16 + 7


@pytest.mark.parametrize("method", ["esdirk4", "generalised-alpha", "discrete-gradient"])
def test_rows_do_not_matter(method, monkeypatch):
    """A run that comes back for more memory again and again is bitwise the one that does not."""
    whole = kirchhoff.simulate(SNAP, elements=4, method=method, tolerance=1e-3, gyroscopic=True)
    monkeypatch.setattr("ribbonfem.rows.CHUNK", 5000)
    parts = kirchhoff.simulate(SNAP, elements=4, method=method, tolerance=1e-3, gyroscopic=True)
    assert np.array_equal(whole.time, parts.time)
    for name in ("positions", "normals"):
        assert np.array_equal(whole.configurations[name], parts.configurations[name])
    assert len(whole) == whole.stats["steps"] + 1
    thinned = kirchhoff.simulate(
        SNAP, elements=4, method=method, tolerance=1e-3, gyroscopic=True, every=10, configurations=False
    )
    assert "positions" not in thinned.configurations
    assert np.array_equal(thinned.time[:-1], whole.time[:-1:10])
    assert thinned.height[-1] == whole.height[-1]


@pytest.mark.parametrize(("damping", "side"), [(0.3, -1.0), (10.0, 1.0)])
def test_decided_runs_end_early_in_the_same_state(damping, side):
    scene = Scene(compression=0.40, shear=0.40, rate=1.0, stop=0.36, damping=damping, hold=10.0)
    options = {"elements": 4, "tolerance": 1e-4, "configurations": False}
    whole = kirchhoff.simulate(scene, **options)
    short = kirchhoff.simulate(scene, until="decided", **options)
    assert short.time[-1] < 0.7 * whole.time[-1]
    assert np.array_equal(short.height, whole.height[: len(short)])
    assert np.sign(short.height[-1]) == np.sign(whole.height[-1]) == side


def test_range_of_rates_and_damping():
    """Ten orders of magnitude either way, in few steps: what is slow needs no small ones."""
    for rate in (1e-5, 1e-2, 1.0, 100.0):
        for damping in (0.0, 10.0, 1e5):
            case = replace(SNAP, rate=rate, damping=damping)
            history = kirchhoff.simulate(case, elements=4, tolerance=1e-3, until="snap")
            assert history.stats["steps"] < 1000, (rate, damping)
            assert np.isfinite(history.configurations["positions"]).all()


@pytest.mark.parametrize("step", [0.1, 1.0, 5.0])
def test_coarse_steps_are_halved_through_the_snap(step):
    case = replace(SNAP, rate=0.01, damping=10.0)
    history = kirchhoff.simulate(case, elements=4, step=step)
    assert history.crossing()[1] == pytest.approx(snap(case, elements=8), abs=2e-3)


def test_bad_policies_are_named():
    for options, text in (
        ({"elements": 5}, "elements = 5"),
        ({"method": "midpoint"}, "method = 'midpoint'"),
        ({"step": 0.1, "tolerance": 1e-3}, "give one of them"),
        ({"spectral_radius": 0.5}, "spectral_radius = 0.5"),
        ({"every": 0}, "every = 0"),
        ({"until": "never"}, "until = 'never'"),
        ({"gyroscopic": 1}, "gyroscopic = 1"),
    ):
        with pytest.raises(OptionError, match=text):
            kirchhoff.simulate(SNAP, **options)
    with pytest.raises(SceneError, match=r"Scene\.stop"):
        kirchhoff.simulate(replace(SNAP, stop=None))
    with pytest.raises(SolverError, match="stopped at t = 0 s") as caught:
        kirchhoff.simulate(SNAP, elements=4, tolerance=1e-40)
    assert len(caught.value.history) == 1


# --- small motions -------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["U+S-", "U+S+"])
def test_frequencies_are_the_rods_limit(name):
    scene = Scene(compression=0.40, shear=0.37, start=name)
    result = kirchhoff.frequencies(scene, extensible=True)
    rods = np.array([der.frequencies(scene, nodes=2 + spans) for spans in (50, 100, 200)])
    for power in (4, 16):
        rods = rods[1:] + (rods[1:] - rods[:-1]) / (power - 1)
    assert np.abs(result / rods[0] - 1.0).max() < 1e-6


@pytest.mark.parametrize("extensible", [False, True])
def test_planar_frequencies_are_the_elasticas(extensible):
    scene = Scene(compression=0.40, shear=0.0, start="U+")
    beam = elastica.frequencies(scene, extensible=extensible)
    ribbon = kirchhoff.frequencies(scene, extensible=extensible, count=9)
    # the ribbon has others, out of the plane
    nearest = ribbon[np.abs(ribbon[:, None] / beam - 1.0).argmin(axis=0)]
    assert np.abs(nearest / beam - 1.0)[:4].max() < 1e-7
    assert len(ribbon) == 9
    assert np.all(np.diff(ribbon) > 0)


def test_a_small_motion_has_the_lowest_frequency():
    """What is left of a tiny kick after friction has taken the higher modes swings at the lowest one."""
    scene = replace(SNAP, rate=1e-3, stop=1e-6, hold=8.0, damping=1.0)
    history = kirchhoff.simulate(scene, elements=4, tolerance=1e-9)
    late = history.time > 5.0
    z, t = history.height[late] - history.height[-1], history.time[late]
    crossings = t[1:][np.diff(np.sign(z)) != 0]
    measured = np.pi / np.diff(crossings).mean()
    lowest = kirchhoff.frequencies(scene, elements=4, count=1)[0]
    assert measured == pytest.approx(np.sqrt(lowest**2 - 0.25), rel=2e-2)


def test_normal_forms_are_the_rods_limit_and_predict_delays():
    scene = Scene(compression=0.40, shear=0.37, start="U+S-", rate=1e-3, stop=0.62, damping=1.0)
    (form,) = kirchhoff.normal_forms(scene, extensible=True)
    coarse, fine = (der.normal_forms(scene, nodes=2 + spans)[0] for spans in (100, 200))
    assert form.angle == pytest.approx(fine.angle + (fine.angle - coarse.angle) / 3, abs=1e-6)
    assert form.product == pytest.approx(fine.product + (fine.product - coarse.product) / 3, rel=2e-4)
    measured = snap(scene, extensible=True) - form.angle
    # the leading order is late by a time of 0.15 s
    assert delay.predict(form, scene.rate, scene.damping).angle - measured == pytest.approx(1.5e-4, abs=5e-5)


def test_steps_that_are_never_as_long_as_asked_for_end_a_run():
    """Newmark rings on what damping should forget at once, and Newton fails: it crept on for ever."""
    scene = Scene(compression=0.40, shear=0.37, start="U+S-", rate=1e-6, stop=0.6, damping=1e5)
    with pytest.raises(SolverError, match="step = 10000 s does not converge with steps as long"):
        kirchhoff.simulate(scene, elements=4, extensible=True, method="newmark", step=1e4)
