"""Rods in motion under every control, load and material: orders, balances, symmetries, initial states."""

from dataclasses import replace

import numpy as np
import pytest

import der
from der import kernels
from der.loop import Loop
from der.motion import ORDERS, step_options
from der.problem import Statics
from der.rod import Rod
from der.states import start_state
from ribbonfem import Ribbon, Scene, SceneError, kirchhoff
from ribbonfem.drive import CONTROLS, Drive
from ribbonfem.ends import held
from ribbonfem.options import OptionError
from ribbonfem.scene import Schedule

COARSE = {"nodes": 21, "configurations": False}
EVERYTHING = Drive(
    left=1, right=0.5, twist_left=0.3, twist_right=-0.2, compression=0.05, shear=0.03, lift=0.1, force=3
)
MOVED = {"compression": 0.2, "shear": 0.2, "lift": 0.2, "force": 20.0}
# a slope at the first point is a jump of speed; the other points are passed smoothly
SMOOTH = Schedule((0.0, 0.5, 1.0, 1.5), (0.0, 0.1, 0.05, 0.2), slope=(0.0, 0.1, 0.05, 0.1))
LOADED = {
    "gravity": (1.0, 0.5, -3.0),
    "ribbon": Ribbon(curvature=(1.0, 2.0, 0.0), twist=0.5, retardation=0.02),
}


def balance(history):
    e = history.energies
    total = e["kinetic"] + e["elastic"] + e["potential"] + e["dissipated"] - e["work"]
    return np.abs(total - total[0]).max()


def of(history):
    return history.configurations["positions"], history.configurations["normals"], history.control


@pytest.mark.parametrize("method", ["implicit-euler", "tr-bdf2", "newmark", "generalised-alpha", "midpoint"])
def test_orders_on_a_smooth_schedule(method):
    """With every control, weight, a natural shape and a material that damps, which leaves no ringing."""
    scene = Scene(drive=EVERYTHING, schedule=SMOOTH, damping=3.0, **LOADED)
    ends = [
        der.simulate(scene, nodes=15, method=method, step=h, newton_tolerance=1e-12).configurations
        for h in (0.02, 0.01, 0.005)
    ]
    x = [configurations["positions"][-1] for configurations in ends]
    order = np.log2(np.abs(x[0] - x[1]).max() / np.abs(x[1] - x[2]).max())
    assert abs(order - ORDERS[method]) < 0.15, f"{method}: observed {order:.2f}"


def test_orders_of_the_higher_methods():
    """Where friction damps most: a material that does reduces them to 2, as stiff equations do."""
    ribbon = replace(LOADED["ribbon"], retardation=1e-5)
    scene = Scene(drive=EVERYTHING, schedule=SMOOTH, damping=30.0, **(LOADED | {"ribbon": ribbon}))
    x = [
        der.simulate(scene, nodes=9, method="esdirk3", step=h, newton_tolerance=1e-12).configurations[
            "positions"
        ][-1]
        for h in (0.01, 0.005, 0.0025)
    ]
    order = np.log2(np.abs(x[0] - x[1]).max() / np.abs(x[1] - x[2]).max())
    assert 2.5 < order < 3.5, f"observed {order:.2f}"


@pytest.mark.parametrize("name", CONTROLS)
@pytest.mark.parametrize("nodes", [21, 22])
def test_energy_balances_with_the_work_of_every_control(name, nodes):
    size = MOVED.get(name, 1.0)
    schedule = Schedule((0.0, 1.0, 2.0), (0.0, 0.15 * size, 0.05 * size), slope=(0.0, 0.0, 0.0))
    scene = Scene(
        drive=name,
        schedule=schedule,
        gravity=(1.0, 0.5, -2.0),
        preset={"right": 0.05} if name != "right" else {},
    )
    history = der.simulate(scene, nodes=nodes, tolerance=1e-6, configurations=False)
    moved = np.abs(history.energies["work"]).max()
    assert moved > 1e-3
    assert balance(history) < 2e-4 * max(1.0, moved)
    assert np.ptp(history.energies["potential"]) > 1e-4


@pytest.mark.parametrize("method", ["tr-bdf2", "newmark", "midpoint"])
def test_energy_balances_with_what_the_material_loses(method):
    """Through a snap: the viscous loss is most of what is lost."""
    scene = Scene(
        compression=0.40,
        shear=0.37,
        start="U+S-",
        rate=0.5,
        stop=0.8,
        hold=1.0,
        damping=0.0,
        ribbon=Ribbon(retardation=0.01),
    )
    history = der.simulate(scene, method=method, step=1e-3, newton_tolerance=1e-10, **COARSE)
    assert history.crossing() is not None
    lost = history.energies["dissipated"][-1]
    assert lost > 5.0
    assert np.all(np.diff(history.energies["dissipated"]) >= 0.0)
    assert balance(history) < 5e-3 * lost


def test_discrete_gradients_balance_the_energy_of_a_force_to_rounding():
    schedule = Schedule((0.0, 1.0), (0.0, 6.0))
    scene = Scene(drive="force", schedule=schedule, damping=0.0, gravity=(0.0, 0.0, -2.0))
    history = der.simulate(scene, method="discrete-gradient", step=5e-3, newton_tolerance=1e-12, **COARSE)
    assert balance(history) < 1e-6


def test_small_motions_decay_as_the_material_says():
    """phi.(nu M + tau K_material) phi / 2 of each mode, K_material without what the loads do."""
    ribbon = Ribbon(retardation=1e-4)
    scene = Scene(drive="force", stop=1.0, damping=0.025, gravity=(0.0, 0.0, -1.0), ribbon=ribbon)
    rod = Rod(scene, 31)
    problem, state = Statics(rod), start_state(rod)
    first, last = rod.free.start, rod.free.stop
    plain, stiffer = (dense(hessian_at(rod, state, rise))[first:last, first:last] for rise in (1.0, 2.0))
    inverse = rod.inertia[rod.free] ** -0.5
    squares, modes = np.linalg.eigh(inverse[:, None] * plain * inverse)
    for k in (0, 1):
        phi, omega = inverse * modes[:, k], np.sqrt(squares[k])
        assert omega / ribbon.inertial_time == pytest.approx(der.frequencies(scene, nodes=31)[k], rel=1e-6)
        rate = scene.scaled_damping + rod.retardation * phi @ (stiffer - plain) @ phi
        options = step_options("midpoint", 0.01 / omega, 1e-6, 1e-12)
        loop = Loop(rod, state, options, 1, False, 1e-3 * phi, scene.scaled_damping)
        loop.go(
            held(scene, 0.0, 40.0 * np.pi / omega),
            kernels.Course(scene.scaled_damping, np.inf, -np.inf, np.inf),
        )
        result = loop.history(scene, {}, {})
        kinetic, elastic, potential, *_ = result.energies.values()
        energy = kinetic + elastic + potential
        energy -= problem.potential(state)
        # where it turns, for in between it is lost in pulses
        turns = np.flatnonzero((kinetic[1:-1] < kinetic[:-2]) & (kinetic[1:-1] <= kinetic[2:])) + 1
        slope = np.polyfit(result.time[turns] / ribbon.inertial_time, np.log(energy[turns]), 1)[0]
        assert slope == pytest.approx(-rate, rel=1e-4)


def hessian_at(rod, state, rise):
    hessian, size = np.zeros((4 * rod.nodes + kernels.WIDTH, kernels.WIDTH + 1)), 4 * rod.nodes
    material, sums = (rod.stiffness, rod.rest, rod.stretch, rod.shape), (np.zeros(size), hessian, np.zeros(3))
    edges, viscous = (*state.edges, state.m1, state.twist), np.zeros((rod.nodes, 4))
    kernels.assemble(material, *edges, viscous, rise, *sums, True, rod.nodes)
    return hessian


def dense(band):
    count = len(band) - kernels.WIDTH
    full = np.zeros((count, count))
    for d in range(kernels.WIDTH + 1):
        i = np.arange(count - d)
        full[i + d, i] = full[i, i + d] = band[i, d]
    return full


def test_the_right_clamp_moves_as_the_left_one_of_the_image():
    left = Scene(compression=0.40, shear=0.37, start="U+S+", rate=0.5, stop=0.3)
    right = replace(left, start="U+S-", drive="right")
    one, other = (der.simulate(scene, nodes=21, tolerance=1e-4) for scene in (left, right))
    assert len(one) == len(other)
    np.testing.assert_allclose(one.height, other.height, atol=1e-7)
    np.testing.assert_allclose(one.energies["work"], other.energies["work"], atol=1e-6)


def test_a_schedule_of_a_constant_rate_is_the_ramp():
    ramp = Scene(compression=0.40, shear=0.37, start="U+S-", rate=0.5, stop=0.8, hold=0.5)
    scheduled = replace(
        ramp, rate=0.1, stop=None, hold=0.0, schedule=Schedule((0.0, 1.6, 2.1), (0.0, 0.8, 0.8), "linear")
    )
    one, other = (der.simulate(scene, step=2e-3, **COARSE) for scene in (ramp, scheduled))
    np.testing.assert_allclose(one.control, other.control, atol=1e-12)
    np.testing.assert_allclose(one.height, other.height, atol=1e-8)


def test_clamps_are_where_the_control_says():
    scene = Scene(drive=EVERYTHING, schedule=SMOOTH, **LOADED)
    history = der.simulate(scene, nodes=15)
    problem = Statics(Rod(scene, 15))
    for row in (0, len(history) // 2, len(history) - 1):
        x, m1 = problem.clamps(history.control[row])
        positions, normals, _ = (values[row] for values in of(history))
        assert np.abs(positions[[0, 1, -2, -1]] - x).max() < 1e-12
        assert np.abs(normals[[0, -1]] - m1).max() < 1e-10
    assert history.control[-1] == scene.schedule.value[-1]


@pytest.mark.parametrize(
    "options", [{}, {"method": "newmark", "step": 2.0**-7}, {"method": "midpoint", "step": 2.0**-7}]
)
@pytest.mark.parametrize("drive", ["left", EVERYTHING])
def test_what_is_gone_on_from_a_kink_is_the_uninterrupted_run(options, drive):
    """To the last bit, where instants and slopes are numbers without rounding: t* is 1 s."""
    ribbon = Ribbon(
        thickness=2.0**-7, young=12e3 * 2.0**14, density=1e3, curvature=(1.0, 2.0, 0.0), retardation=2.0**-6
    )
    assert ribbon.inertial_time == 1.0
    given = {"drive": drive, "gravity": (1.0, 0.5, -3.0), "ribbon": ribbon}
    whole, first, second = (
        Scene(schedule=Schedule(*points, "linear"), **given)
        for points in (
            ((0.0, 0.5, 1.0, 1.25), (0.0, 0.125, 0.0625, 0.125)),
            ((0.0, 0.5, 1.0), (0.0, 0.125, 0.0625)),
            ((0.0, 0.25), (0.0625, 0.125)),
        )
    )
    begun = der.simulate(first, nodes=15, **options)
    rest = der.simulate(second, initial=begun, nodes=15, **options)
    whole = der.simulate(whole, nodes=15, **options)
    count = len(rest)
    assert rest.time[0] == begun.time[-1] == 1.0
    for name in ("time", "control", "height", "slope"):
        np.testing.assert_array_equal(getattr(rest, name), getattr(whole, name)[-count:])
    np.testing.assert_array_equal(
        rest.configurations["positions"], whole.configurations["positions"][-count:]
    )
    for name, values in rest.energies.items():
        np.testing.assert_array_equal(values, whole.energies[name][-count:])


def test_what_is_gone_on_from_elsewhere_is_so_to_the_tolerance():
    begun = Scene(compression=0.40, shear=0.37, start="U+S-", rate=0.5, stop=0.5)
    further = replace(begun, rate=0.1, stop=None, schedule=Schedule((0.0, 0.6), (0.5, 0.8)))
    options = {"tolerance": 1e-6, **COARSE}
    first = der.simulate(begun, **options)
    rest = der.simulate(further, initial=first, **options)
    other = der.simulate(further, initial=first, method="esdirk3", **options)
    whole = der.simulate(replace(begun, stop=0.8), **options)
    assert rest.time[0] == pytest.approx(1.0, abs=1e-12)
    for run in (rest, other):
        assert run.crossing()[0] == pytest.approx(whole.crossing()[0], abs=1e-4)
    # the right clamp goes on, where the left one has come to
    turned = Scene(
        compression=0.40, shear=0.37, drive="right", preset={"left": 0.5}, rate=0.5, stop=0.1, damping=3.0
    )
    moved = der.simulate(turned, initial=first, **options)
    assert moved.control[0] == 0.0
    assert moved.time[-1] == pytest.approx(1.2, abs=1e-12)
    assert np.abs(np.diff(moved.energies["work"])[:3]).max() < 1e-3


def test_a_state_at_rest_is_started_from():
    begun = Scene(schedule=Schedule((0.0, 1.0), (0.05, 0.15)), gravity=(0.0, 0.0, -1.0))
    plain = der.simulate(begun, nodes=21)
    given = der.simulate(replace(begun, start="U+S-"), initial=der.state(begun, nodes=21), nodes=21)
    assert abs(plain.height[-1] - given.height[-1]) < 1e-5
    # let go of without its weight it moves at once
    free = der.simulate(replace(begun, gravity=None), initial=der.state(begun, nodes=21), nodes=21)
    assert free.height.max() > plain.height[0] + 1e-3


def test_a_force_that_jumps_starts_the_motion():
    """As one that is taken away within a moment."""
    jump = Schedule((0.0, 0.0, 0.5), (5.0, 0.0, 0.0), "linear")
    quick = Schedule((0.0, 1e-4, 0.5), (5.0, 0.0, 0.0), "linear")
    one, other = (
        der.simulate(Scene(drive="force", schedule=s), nodes=21, tolerance=1e-6) for s in (jump, quick)
    )
    assert (one.control[0], one.control[1]) == (5.0, 0.0)
    assert abs(one.height[-1] - other.height[-1]) < 2e-4
    assert one.height[-1] > one.height[0] + 1e-3
    assert balance(one) < 1e-3


def test_a_lift_counts_heights_from_the_mean_of_the_clamps():
    scene = Scene(compression=0.40, shear=0.37, start="U+S-", rate=0.5, stop=0.8, preset={"lift": 0.01})
    history = der.simulate(scene, until="snap", **COARSE)
    assert history.crossing() is not None
    assert np.count_nonzero(history.height < 0.005) == 2


def test_refusals_of_what_does_not_fit():
    scene = Scene(compression=0.40, shear=0.37, start="U+S-", rate=0.5, stop=0.2)
    state = der.state(scene, nodes=21)
    with pytest.raises(SceneError, match=r"initial = RestState.* do not fit"):
        der.simulate(replace(scene, preset={"right": 0.1}), initial=state, nodes=21)
    with pytest.raises(OptionError, match=r"it has 21 nodes, and nodes = 31"):
        der.simulate(scene, initial=state, nodes=31)
    with pytest.raises(OptionError, match=r"a RestState or a History"):
        der.simulate(scene, initial=1.0, nodes=21)
    history = der.simulate(scene, nodes=21)
    with pytest.raises(SceneError, match=r"do not fit"):
        der.simulate(scene, initial=history, nodes=21)
    with pytest.raises(OptionError, match=r"the scene's ribbon is needed"):
        der.simulate(replace(scene, ribbon=Ribbon(width=0.1)), initial=history, nodes=21)
    with pytest.raises(OptionError, match=r"a state of der is needed"):
        der.simulate(scene, initial=kirchhoff.state(scene, elements=4), nodes=21)
    damped = replace(scene, ribbon=Ribbon(retardation=0.01))
    for method in ("verlet", "discrete-gradient"):
        with pytest.raises(OptionError, match=r"takes no Ribbon\.retardation"):
            der.simulate(damped, nodes=21, method=method, step=1e-5)


@pytest.mark.parametrize("retardation", [0.0, 0.02])
def test_motions_against_elements(retardation):
    """Rods' limits and elements that stretch, which share no mechanics: on the way, and where both settle."""
    scene = Scene(
        start="U+S-",
        drive=EVERYTHING,
        schedule=Schedule((0.0, 1.0, 2.0, 4.0), (0.0, 0.1, 0.05, 0.05)),
        damping=3.0,
        gravity=(1.0, 0.5, -3.0),
        ribbon=replace(LOADED["ribbon"], retardation=retardation),
    )
    options = {"tolerance": 1e-6, "configurations": False}
    reference = kirchhoff.simulate(scene, elements=6, extensible=True, **options)
    coarse, fine = (der.simulate(scene, nodes=n, **options) for n in (41, 81))
    at = np.array([0.5, 1.0, 1.5, 2.0, 4.0])

    def off(read):
        one, other, expected = (np.interp(at, h.time, read(h)) for h in (coarse, fine, reference))
        ratio = (79 / 39) ** 2
        return np.abs((ratio * other - one) / (ratio - 1) - expected)

    heights = off(lambda h: h.height)
    assert heights.max() < 3e-5
    assert heights[-1] < 5e-6
    for name, bound in (("elastic", 2e-3), ("potential", 1e-5), ("work", 2e-3)):
        assert off(lambda h, name=name: h.energies[name]).max() < bound


@pytest.mark.parametrize("kind", ["smooth", "linear"])
def test_rows_are_thinned_on_any_schedule(kind, monkeypatch):
    """Within a bound, the kinks' among those that stay; and what happens is found in all steps."""
    schedule = Schedule((0.0, 1.0, 2.0, 3.0), (0.0, 0.1, 0.05, 0.2), kind)
    scene = Scene(start="U+S-", schedule=schedule)
    whole = der.simulate(scene, nodes=21)
    monkeypatch.setattr("ribbonfem.rows.MOST", 400_000)
    monkeypatch.setattr("ribbonfem.rows.LEAST", 50)
    some = der.simulate(scene, nodes=21)
    assert len(some) < 0.9 * len(whole)
    assert some.stats["rows_within"] < 0.01
    assert np.abs(np.interp(whole.time, some.time, some.height) - whole.height).max() < 0.01
    np.testing.assert_allclose(schedule(some.time), some.control, atol=1e-9)
    if kind == "linear":
        assert np.isin(schedule.kinks, np.round(some.time, 12)).all()
