"""The planar models in motion on any rig of the plane: energies, retardation, what is gone on from."""

import numpy as np
import pytest
from histories import assert_goes_on
from scipy.interpolate import CubicHermiteSpline

import der
from ribbonfem import Drive, Ribbon, Scene, SceneError, Schedule, delay, elastica, kirchhoff, quasilinear
from ribbonfem.options import OptionError

NONE = (0.0, 0.0, 0.0)
PLANAR = {"compression": 0.40, "shear": 0.0, "start": "U+", "gravity": NONE, "damping": 1.0}


def balance(history):
    e = history.energies
    total = e["kinetic"] + e["elastic"] + e["potential"] + e["dissipated"] - e["work"]
    return np.abs(total - total[0]).max()


def heights(run, at):
    """Between the rows by their velocities: steps of two models are not the same."""
    return CubicHermiteSpline(run.time, run.height, run.velocity)(at)


RIGS = [
    {"drive": Drive(left=1.0, right=0.5, lift=0.05), "rate": 0.5, "stop": 0.5},
    {"drive": "force", "rate": 10.0, "stop": 10.0},
    {"drive": Drive(compression=1.0, force=20.0), "rate": 0.02, "stop": 0.02, "preset": {"right": 0.05}},
    {
        "gravity": (0.2, 0.0, -2.0),
        "drive": Drive(lift=1.0, compression=0.5),
        "schedule": Schedule((0.0, 0.5, 1.0), (0.01, 0.03, 0.02)),
    },
    {"ribbon": Ribbon(curvature=(0.0, 2.0, -1.0)), "rate": 0.5, "stop": 0.3, "start": "U-"},
    {
        "ribbon": Ribbon(retardation=0.1, curvature=1.0),
        "drive": Drive(left=1.0, compression=0.05, lift=0.03),
        "gravity": (0.3, 0.0, -1.0),
        "preset": {"force": 0.5},
        "rate": 0.5,
        "stop": 0.5,
    },
]


@pytest.mark.parametrize("extensible", [False, True])
@pytest.mark.parametrize("rig", RIGS)
def test_a_rig_moves_as_in_three_dimensions_and_its_energies_balance(rig, extensible):
    scene = Scene(**{**PLANAR, **rig})
    # (on 8 elements the two take what rings for different waves, 1e-5 L)
    options = {"elements": 12, "extensible": extensible, "tolerance": 1e-6, "configurations": False}
    plane, space = (model.simulate(scene, **options) for model in (elastica, kirchhoff))
    # without the power of any one of what moves, or the weight, it is off by a hundredth and more
    assert balance(plane) < 5e-4 * max(1.0, np.abs(plane.energies["work"]).max())
    at = np.linspace(0.0, plane.time[-1], 40)[1:]
    assert np.abs(heights(plane, at) - heights(space, at)).max() < 1e-5
    for name in ("work", "dissipated", "potential"):
        assert plane.energies[name][-1] == pytest.approx(space.energies[name][-1], abs=1e-4), name


@pytest.mark.parametrize("method", ["esdirk4", "tr-bdf2", "generalised-alpha"])
@pytest.mark.parametrize("retardation", [0.0, 0.01])
@pytest.mark.parametrize("extensible", [False, True])
def test_a_run_that_is_gone_on_from_at_a_kink_is_the_whole_to_the_last_bit(method, retardation, extensible):
    base = {**PLANAR, "damping": 0.3, "ribbon": Ribbon(retardation=retardation)}

    def run(times, values, **options):
        scene = Scene(**base, schedule=Schedule(times, values, kind="linear"))
        given = {"method": method, "elements": 5, "tolerance": 1e-4, "extensible": extensible}
        if method == "generalised-alpha" and extensible:
            # by default it hardly damps waves along the ribbon, and rounding decides how many steps they
            # cost, or whether their energy grows: with .2 still, with .1 no longer
            given["spectral_radius"] = 0.1
        return elastica.simulate(scene, **given, **options)

    whole, first = run((0, 1, 2), (0, 0.1, 0.4)), run((0, 1), (0, 0.1))
    second = run((0, 1), (0.1, 0.4), initial=first)
    assert_goes_on(whole, first, second)


def test_a_given_state_is_begun_at_and_clamps_have_to_fit():
    scene = Scene(**PLANAR, preset={"lift": 0.02}, rate=0.3, stop=0.3)
    named = elastica.simulate(scene)
    for model in (elastica, kirchhoff):
        given = elastica.simulate(scene, initial=model.state(scene, elements=8))
        np.testing.assert_allclose(given.height[-1], named.height[-1], atol=1e-10)
    state = elastica.state(scene, elements=8)
    assert (state.name, state.index) == ("U+", 0)
    np.testing.assert_allclose(state.force, kirchhoff.state(scene, elements=8).force, atol=1e-6)
    # let go: the force that held it is there no more
    pushed, let_go = Scene(**PLANAR, preset={"force": 20.0}), Scene(**PLANAR, rate=0.1, stop=0.02)
    runs = [
        m.simulate(let_go, elements=12, tolerance=1e-6, initial=m.state(pushed, elements=12))
        for m in (elastica, kirchhoff)
    ]
    assert runs[0].energies["kinetic"].max() > 1e-2
    assert balance(runs[0]) < 1e-4
    at = np.linspace(0.0, 0.2, 40)
    assert np.abs(heights(runs[0], at) - heights(runs[1], at)).max() < 1e-5
    with pytest.raises(SceneError, match=r"clamps begin .* unturned; .* off by 0\.02"):
        elastica.simulate(Scene(**PLANAR, rate=0.3, stop=0.3), initial=state)
    with pytest.raises(OptionError, match=r"its nodes are not those of elements=6"):
        elastica.simulate(scene, initial=state, elements=6)
    with pytest.raises(OptionError, match=r"initial = .*History of elastica\.simulate"):
        elastica.simulate(scene, initial=kirchhoff.simulate(scene, tolerance=1e-3))
    with pytest.raises(OptionError, match=r"elements=8, extensible=False; the same are needed"):
        elastica.simulate(scene, initial=named, extensible=True)


@pytest.mark.parametrize("extensible", [False, True])
@pytest.mark.parametrize(
    "rig", [{"hold": 0.5}, {"hold": 0.5, "damping": 0.0}, RIGS[0], RIGS[2], RIGS[3], RIGS[4]]
)
def test_means_of_forces_balance_to_rounding_at_any_step(rig, extensible):
    """Work of fast clamps, friction, weight and a snap included, with steps that resolve little."""
    scene = Scene(**({**PLANAR, "rate": 2.0, "stop": 1.5} if "hold" in rig else PLANAR) | rig)
    options = {"extensible": extensible, "configurations": False, "method": "discrete-gradient"}
    run = elastica.simulate(scene, step=4e-3, **options)
    # the first steps from rest have too little kinetic energy to take from
    assert balance(run) < 1e-8
    assert np.isnan(run.velocity).all()
    if "hold" in rig:
        assert run.energies["kinetic"].max() > 1.0
        # the same rule in three dimensions, up to the snap, and one of higher order
        other = kirchhoff.simulate(scene, step=4e-3, until="snap", **options)
        assert run.snap[1] == pytest.approx(other.snap[1], abs=1e-5)
        fine = elastica.simulate(scene, extensible=extensible, tolerance=1e-6, until="snap")
        assert run.snap[1] == pytest.approx(fine.snap[1], abs=2e-3)


def test_means_of_forces_are_of_second_order_and_their_steps_adapt():
    scene = Scene(**{**PLANAR, "damping": 0.0}, rate=1.0, stop=1.2, hold=0.5)
    fine = elastica.simulate(scene, tolerance=1e-7, until="snap").snap[0]
    steps = [2e-2, 1e-2, 5e-3, 2.5e-3]
    method = {"method": "discrete-gradient", "until": "snap"}
    errors = [abs(elastica.simulate(scene, step=h, **method).snap[0] - fine) for h in steps]
    order = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert abs(order - 2.0) < 0.3, f"expected order 2, observed {order:.2f}: {errors}"
    off = [abs(elastica.simulate(scene, tolerance=t, **method).snap[0] - fine) for t in (1e-3, 3e-5)]
    assert off[1] < 2e-4
    assert off[1] < 0.2 * off[0]


def test_means_of_forces_are_of_elastic_moments():
    scene = Scene(**{**PLANAR, "ribbon": Ribbon(retardation=0.1)}, rate=1.0, stop=0.1)
    with pytest.raises(OptionError, match=r"method = 'discrete-gradient': .*Ribbon\.retardation"):
        elastica.simulate(scene, method="discrete-gradient")


HEAVY = [
    Scene(compression=0.08, shear=0.0, start="U+", rate=0.3, damping=1.0, stop=2.5, gravity=(9.81, 0.0, 0.0)),
    Scene(
        compression=0.107,
        shear=0.0,
        start="U+",
        rate=1.655,
        damping=1.0,
        stop=2.5,
        gravity=(0.0, 0.0, 9.81),
        ribbon=Ribbon(thickness=0.005),
    ),
]


@pytest.mark.parametrize("scene", HEAVY)
def test_a_run_may_begin_with_less_energy_than_none(scene):
    """What counts as gained went by elastic and potential energy, whose sum is negative at rest here."""
    planar, spatial = (
        model.simulate(scene, extensible=True, tolerance=1e-5, until="snap")
        for model in (elastica, kirchhoff)
    )
    assert planar.energies["elastic"][0] + planar.energies["potential"][0] < 0.0
    assert planar.snap[1] == pytest.approx(spatial.snap[1], abs=2e-5)
    coarse, fine = (der.simulate(scene, nodes=n, tolerance=1e-5, until="snap").snap[1] for n in (51, 101))
    assert planar.snap[1] == pytest.approx(fine + (fine - coarse) / ((99 / 49) ** 2 - 1), abs=5e-5)


@pytest.mark.parametrize(("tolerance", "elements"), [(3e-3, 4), (1e-3, 4), (1e-3, 8)])
def test_no_loose_tolerance_ends_a_run(tolerance, elements):
    """A step that gained energy was halved until it made velocities of what Newton had left of positions."""
    for rate in 0.1 * (1.0 + 0.003 * np.arange(8)):
        scene = Scene(compression=0.20, shear=0.0, start="U+", rate=rate, damping=1.0, stop=1.6)
        fine, rough = (
            elastica.simulate(scene, elements=8, tolerance=1e-5, until="snap"),
            elastica.simulate(scene, elements=elements, tolerance=tolerance, until="snap"),
        )
        assert rough.snap[1] == pytest.approx(fine.snap[1], abs=0.2 * tolerance)


def test_configurations_may_be_left_out():
    scene = Scene(**PLANAR, rate=0.3, stop=0.1)
    bare, whole = elastica.simulate(scene, configurations=False), elastica.simulate(scene)
    assert not bare.configurations
    assert set(whole.configurations) == {"positions", "curvature", "velocities"}
    np.testing.assert_array_equal(bare.height, whole.height)


@pytest.mark.parametrize(("model", "mesh"), [(quasilinear, {}), (elastica, {"elements": 12})])
def test_a_release_beyond_the_fold_takes_the_time_of_its_normal_form(model, mesh):
    """From rest at A = -eta (c eps / a2)^(1/2): A_TT = c eps + a2 A^2 blows up at 3.51342 (c a2 eps)^(-1/4).

    A dead force holds the beam eps beyond its fold, until it is let go.  The height passes zero before the
    blow-up by the lead of `delay.lead`; what is left falls as eps^(1/2).
    """
    still = {"compression": 0.30, "shear": 0.0, "start": "U+", "gravity": NONE, "damping": 0.0}
    (form,) = model.normal_forms(Scene(**still), **mesh)
    _, lead = delay.lead(model, Scene(**still), **mesh)
    # the fold moves in proportion to the force
    (moved,) = model.folds(Scene(**still, preset={"force": -0.01}), **mesh)
    by_force = (moved.control - form.angle) / 0.01
    eta, ratios = 0.1, []
    for beyond in (1e-4, 1e-6):
        at = form.angle + beyond
        expected = 3.51342 * (form.product * beyond) ** -0.25
        held = {"force": -beyond * (1.0 + eta**2) / by_force}
        rest = Scene(**still, preset=held, schedule=Schedule((0.0, 1e-3), (at, at)))
        begun = model.simulate(rest, **mesh)
        free = Scene(**still, schedule=Schedule((0.0, 1.1 * expected), (at, at)))
        run = model.simulate(free, initial=begun, tolerance=1e-7, **mesh)
        ratios.append((run.crossing("height")[0] - begun.time[-1] + lead.time) / expected)
    limit = (10.0 * ratios[1] - ratios[0]) / 9.0
    assert abs(ratios[0] - 1.0) < 0.01
    assert limit == pytest.approx(1.0, abs=2e-4)
