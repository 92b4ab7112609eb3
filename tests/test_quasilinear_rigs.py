"""The beam of small slopes on any rig of the plane: closed forms, and the elastica at a small compression."""

import numpy as np
import pytest
from histories import assert_goes_on

from ribbonfem import Drive, Ribbon, Scene, SceneError, Schedule, elastica, quasilinear

NONE = (0.0, 0.0, 0.0)
# slopes of some hundredths: theories differ by shares of this
SMALL = 1e-3
FLAT = {"compression": SMALL, "shear": 0.0, "start": "U+", "gravity": NONE, "damping": 1.0}


def flat(**given):
    return Scene(**{**FLAT, **given})


@pytest.mark.parametrize("compression", [0.01, 0.1, 0.4])
def test_both_clamps_lose_the_symmetric_state_at_mu_2(compression):
    """tan(sigma/2) = sigma/2 at sigma = 8.98682, where mu = 2 |sin(sigma/2)| / sqrt(1 - sin(sigma)/sigma)."""
    scene = Scene(compression=compression, shear=0.0, start="U+", drive="both")
    (lost,) = quasilinear.instabilities(scene)
    assert (lost.kind, lost.subcritical, lost.out_of_plane) == ("pitchfork", True, False)
    assert abs(lost.control / compression**0.5 - 2.0) < 1e-8
    assert lost.load**0.5 == pytest.approx(8.98681891581813, abs=1e-7)


@pytest.mark.parametrize("turned", [0.1, 0.2])
def test_an_arch_of_two_turned_clamps_is_lost_at_a_quarter_of_the_square(turned):
    scene = Scene(
        compression=0.1,
        shear=0.0,
        start="U+",
        drive="compression",
        rate=-0.1,
        preset={"left": turned, "right": turned},
    )
    (lost,) = quasilinear.instabilities(scene)
    assert (0.1 + lost.control) / (0.25 * turned**2) == pytest.approx(1.0, abs=1e-8)


AT_REST = [
    {"gravity": (0.0, 0.0, -2.0)},
    {"drive": "right", "preset": {"left": 0.01}},
    {"drive": "compression", "rate": -0.1, "preset": {"left": 0.03}},
    {"ribbon": Ribbon(curvature=(0.1, -0.1, 0.2)), "preset": {"lift": 0.003, "force": -0.2, "right": -0.01}},
    {"drive": "force", "preset": {"left": 0.005}},
]


@pytest.mark.parametrize("given", AT_REST)
def test_folds_tend_to_those_of_the_elastica(given):
    scene = flat(**given)
    (one,), (two,) = quasilinear.folds(scene), elastica.folds(scene, elements=8)
    assert one.control == pytest.approx(two.control, rel=2.0 * SMALL)
    assert one.height == pytest.approx(two.height, rel=2.0 * SMALL)
    # the other ways to the same fold
    (lost,) = quasilinear.instabilities(scene)
    assert lost.control == pytest.approx(one.control, rel=1e-9)
    reach = 1.2 * abs(one.control)
    curve = quasilinear.equilibria(scene, span=(-min(reach, 0.9 * SMALL), reach), unstable=1)
    assert any(abs(fold.control - one.control) < 1e-8 for fold in curve.folds)


MOVING = [
    {"drive": Drive(left=1.0, right=0.5, lift=0.1), "rate": 0.05, "stop": 0.02},
    {"drive": "lift", "gravity": (0.0, 0.0, -2.0), "rate": 0.05, "stop": 0.01},
    {"drive": "force", "rate": 10.0, "stop": 3.0},
    {"drive": "compression", "rate": -0.001, "stop": -0.0005, "preset": {"left": 0.02}},
    {
        "schedule": Schedule((0.0, 0.5, 1.0), (0.01, 0.03, 0.02)),
        "ribbon": Ribbon(curvature=(0.1, -0.1, 0.2)),
        "preset": {"lift": 0.003, "force": -0.2, "right": -0.01},
    },
    {
        "drive": Drive(left=1.0, compression=0.05, lift=0.1),
        "ribbon": Ribbon(retardation=0.05, curvature=(0.02, -0.1, 0.1)),
        "gravity": (0.0, 0.0, -0.5),
        "preset": {"force": 0.1},
        "rate": 0.05,
        "stop": 0.05,
    },
]


@pytest.mark.parametrize("given", MOVING)
def test_motions_tend_to_those_of_the_elastica_and_their_energies_balance(given):
    scene = flat(**given)
    one, two = (model.simulate(scene, tolerance=1e-7) for model in (quasilinear, elastica))
    e = one.energies
    total = e["kinetic"] + e["elastic"] + e["potential"] + e["dissipated"] - e["work"]
    # of energies some 40 dL in size; without the power of any control it is off by a hundredth and more
    assert np.abs(total - total[0]).max() < 2e-3 * SMALL
    at = np.linspace(0.0, one.time[-1], 40)[1:]
    both = [np.interp(at, run.time, run.height) for run in (one, two)]
    assert np.abs(np.subtract(*both)).max() < 5.0 * SMALL**1.5
    for name in ("elastic", "work", "potential", "dissipated"):
        assert abs(e[name][-1] - two.energies[name][-1]) < 1.0 * SMALL, name


@pytest.mark.parametrize("method", ["esdirk4", "tr-bdf2", "generalised-alpha"])
@pytest.mark.parametrize("retardation", [0.0, 0.01])
def test_a_run_that_is_gone_on_from_at_a_kink_is_the_whole_to_the_last_bit(method, retardation):
    base = {**FLAT, "compression": 0.2, "ribbon": Ribbon(retardation=retardation), "preset": {"lift": 0.01}}

    def run(times, values, **options):
        scene = Scene(**base, schedule=Schedule(times, values, kind="linear"))
        return quasilinear.simulate(scene, method=method, tolerance=1e-4, **options)

    whole, first = run((0, 1, 2), (0, 0.1, 0.4)), run((0, 1), (0, 0.1))
    second = run((0, 1), (0.1, 0.4), initial=first)
    assert_goes_on(whole, first, second)
    with pytest.raises(SceneError, match=r"clamps begin .* off by 0\.1"):
        run((0, 1), (0.0, 0.4), initial=first)


def test_weight_along_x_is_refused_in_a_sentence():
    with pytest.raises(
        SceneError, match=r"Scene\.gravity = \(1\.0, 0\.0, 2\.0\): .*elastica, kirchhoff and der do"
    ):
        quasilinear.folds(flat(gravity=(1.0, 0.0, 2.0)))
