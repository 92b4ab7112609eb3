"""Models that share no mechanics, in motion and at rest."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

import der
from compare.commands.crosscheck import edge_ratio
from ribbonfem import Drive, Ribbon, Scene, SolverError, delay, elastica, kirchhoff, quasilinear

BEAM = Scene(compression=0.40, shear=0.0, start="U+", rate=0.1, damping=1.0, stop=1.175)
PATH_1 = Scene(compression=0.40, shear=0.37, start="U+S-", rate=0.1, damping=1.0, stop=0.63)


def snap(scene, nodes, **options):
    options |= {"tolerance": 1e-6, "configurations": False, "until": "snap"}
    return der.simulate(scene, nodes=nodes, **options).crossing()[1]


def limit(coarse, fine, nodes):
    ratio = edge_ratio(*nodes)
    return (ratio * fine - coarse) / (ratio - 1)


def test_planar_snap_of_rods_and_elements():
    nodes = (51, 101)
    coarse, fine = (snap(BEAM, n) for n in nodes)
    rods = limit(coarse, fine, nodes)
    beam = elastica.simulate(BEAM, extensible=True, tolerance=1e-7, until="snap").crossing()[1]
    # the limit in the mesh and the tolerance of the rods; the beam is converged to 1e-6
    assert abs(rods - beam) < 2e-5
    assert abs(fine - beam) > 1e-4  # a finite mesh is seen


@pytest.mark.parametrize(("clamp", "order"), [("centred", 2), ("two-node", 1)])
def test_order_in_the_mesh_at_the_snap(clamp, order):
    nodes = (26, 51, 101)
    angles = [snap(PATH_1, n, clamp=clamp) for n in nodes]
    spans = [n - 2 if clamp == "centred" else n - 1 for n in nodes]
    # three meshes fix the limit, the constant and the order
    ratio = (angles[0] - angles[1]) / (angles[1] - angles[2])
    trial = np.linspace(0.5, 3.0, 2501)
    model = (spans[0] ** -trial - spans[1] ** -trial) / (spans[1] ** -trial - spans[2] ** -trial)
    observed = trial[np.argmin(np.abs(model - ratio))]
    assert abs(observed - order) < 0.15, f"declared {order}, observed {observed}: {angles}"


def test_ribbon_folds_of_rods_and_elements():
    scene = Scene(compression=0.35, shear=0.37)
    nodes = (101, 201)
    reference = kirchhoff.folds(scene, extensible=True)
    coarse, fine = (der.folds(scene, nodes=n) for n in nodes)
    assert len(reference) == len(coarse) == 2
    for k, fold in enumerate(reference):
        assert abs(limit(coarse[k].angle, fine[k].angle, nodes) - fold.angle) < 2e-6
        assert abs(limit(coarse[k].height, fine[k].height, nodes) - fold.height) < 2e-6
        assert abs(limit(coarse[k].load, fine[k].load, nodes) / fold.load - 1) < 2e-5


def test_kirchhoff_and_elastica_agree_on_planar_folds():
    scene = Scene(compression=0.30, shear=0.0, start="U+")
    for extensible in (False, True):
        (plane,) = elastica.folds(scene, elements=64, extensible=extensible)
        (space,) = kirchhoff.folds(scene, extensible=extensible)
        assert abs(plane.angle - space.angle) < 1e-9
        assert abs(plane.height - space.height) < 1e-8


def test_normal_forms_of_rods_and_elements():
    (rods,) = der.normal_forms(Scene(compression=0.40, shear=0.0, start="U+"), nodes=101)
    (beam,) = elastica.normal_forms(Scene(compression=0.40, shear=0.0, start="U+"), extensible=True)
    coarse = der.normal_forms(Scene(compression=0.40, shear=0.0, start="U+"), nodes=51)[0]
    product = limit(coarse.product, rods.product, (51, 101))
    assert abs(product / beam.product - 1) < 2e-3
    # and the delay follows: overdamped and slow, the ratio to the prediction is close to 1
    scene = Scene(compression=0.40, shear=0.37, start="U+S-", rate=1e-5, damping=1e3, stop=0.575)
    form = der.normal_forms(scene, nodes=51)[0]
    measured = der.simulate(scene, nodes=51, configurations=False).crossing()[1] - form.angle
    assert abs(measured / delay.predict(form, 1e-5, 1e3).angle - 1) < 0.02


@pytest.mark.parametrize(
    ("model", "scene", "options"),
    [
        (kirchhoff, PATH_1, {"method": "esdirk4", "tolerance": 1e-5}),
        (kirchhoff, PATH_1, {"method": "generalised-alpha", "step": 5e-3}),
        (der, PATH_1, {"nodes": 51, "tolerance": 1e-4}),
        (der, PATH_1, {"nodes": 52, "tolerance": 1e-4}),
        (elastica, BEAM, {"tolerance": 1e-5}),
        (quasilinear, BEAM, {"tolerance": 1e-5}),
    ],
)
def test_velocity_is_the_rate_of_the_height(model, scene, options):
    history = model.simulate(scene, until="snap", **options)
    t, z, v = history.time, history.height, history.velocity
    # of the cubics through two rows and their velocities, against a spline through the heights alone
    middle = 0.5 * (z[1:] + z[:-1]) + np.diff(t) * (v[:-1] - v[1:]) / 8.0
    spline = CubicSpline(t, z)(0.5 * (t[1:] + t[:-1]))
    late = t[1:] > 0.9 * t[-1]
    assert np.abs(v[1:][late]).max() > 0.3
    assert np.abs(middle - spline)[late].max() < 2e-5
    assert v[0] == 0.0


@pytest.mark.parametrize("model", [kirchhoff, der])
def test_velocities_that_ring_are_not_told(model):
    options = {"method": "discrete-gradient", "step": 5e-3, "configurations": False}
    assert np.isnan(model.simulate(replace(PATH_1, stop=0.1), **options).velocity).all()


def test_load_is_a_column_of_every_motion():
    ramp = Scene(compression=0.40, shear=0.37, start="U+S-", rate=0.1, damping=1.0, stop=0.3)
    rod, elements = der.simulate(ramp, nodes=101), kirchhoff.simulate(ramp, extensible=True)
    assert rod.load[0] == pytest.approx(elements.load[0], rel=2e-3)
    # along a slow ramp the ringing of the start dies out
    at = [float(np.interp(0.25, history.angle, history.load)) for history in (rod, elements)]
    assert at[0] == pytest.approx(at[1], rel=5e-3)
    assert rod.load[0] == pytest.approx(-der.state(ramp, nodes=101).force[0], rel=1e-8)


@pytest.mark.parametrize(
    ("model", "scene", "options"),
    [
        (quasilinear, BEAM, {"elements": 16}),
        (elastica, BEAM, {"elements": 16}),
        (elastica, BEAM, {"elements": 16, "extensible": True}),
        (kirchhoff, PATH_1, {"elements": 8, "extensible": True}),
        (der, PATH_1, {"nodes": 31}),
    ],
)
def test_a_branch_and_a_motion_have_one_energy(model, scene, options):
    branch = model.equilibria(scene, span=(-0.1, 0.6), **options)
    start = np.flatnonzero(branch.angle == 0.0)[0]
    motion = model.simulate(replace(scene, stop=1e-3), **options)
    assert branch.energy[start] == pytest.approx(motion.energies["elastic"][0], rel=1e-9)


# in m/s2, a weight of 5 EI2/L^3
HEAVY = (0.0, 0.0, -5.0 / Ribbon().weight_ratio)


@pytest.mark.parametrize("acting", [{"gravity": HEAVY}, {"preset": {"force": 1.0}}])
def test_the_energy_of_the_pass_has_that_of_what_acts(acting):
    scene = Scene(compression=0.40, shear=0.37, **acting)
    nodes = (51, 101)
    rods = limit(*(der.skipping_bound(scene, nodes=count) for count in nodes), nodes)
    # the elastic energy alone is off by a tenth and more
    assert abs(kirchhoff.skipping_bound(scene, elements=12, extensible=True) - rods) < 3e-4


def test_a_heavy_ribbon_is_decided_when_its_whole_energy_is_below_the_pass():
    scene = Scene(compression=0.40, shear=0.37, gravity=HEAVY, rate=0.3, stop=0.3, hold=40.0, damping=0.3)
    rods = der.simulate(scene, nodes=101, until="decided", configurations=False)
    elements = kirchhoff.simulate(scene, extensible=True, until="decided", configurations=False)
    # both end with the step in which it falls below; by elastic energies .3 s later
    assert elements.time[-1] == pytest.approx(rods.time[-1], abs=0.1)
    rest = kirchhoff.simulate(scene, extensible=True, configurations=False)
    assert rest.time[-1] > 2.0 * elements.time[-1]
    assert (rest.height[-1] > 0.0) == (elements.height[-1] > 0.0)


LENGTHS = [
    (model, drive, start)
    for model in (quasilinear, elastica, kirchhoff, der)
    for drive in ("compression", "lift")
    for start in ({"compression": 0.10}, {"compression": 0.40}, {"compression": 0.80})
] + [
    (model, drive, start)
    for model in (kirchhoff, der)
    for drive in ("compression", "shear", "lift", Drive(compression=1.0, shear=0.5))
    for start in (
        {"compression": 0.40, "shear": 0.37, "start": "U+S+"},
        {"compression": 0.40, "shear": 0.70, "start": "S+"},
        {"compression": 0.40, "shear": 0.75, "start": "U+"},
    )
]


@pytest.mark.parametrize(("model", "drive", "start"), LENGTHS)
def test_lengths_are_followed_as_far_as_the_chord_allows_by_default(model, drive, start):
    """To ends that cross, and a taut ribbon, or to where the curve closes or more than two modes are lost."""
    scene = Scene(**{"shear": 0.0, "start": "U+", **start}, drive=drive)
    curve = model.equilibria(scene)
    low, high = curve.options["span"]
    assert low <= curve.control.min() < 0.0 < curve.control.max() <= high
    assert all(np.linalg.norm(scene.chord(control)) < 1.0 for control in curve.control)
    if curve.control[0] != curve.control[-1]:
        for end, limit in ((0, low), (-1, high)):
            assert abs(curve.control[end]) > 0.5 * abs(limit) or not curve.stable[end]
    # where nobody says how far, folds and other losses are looked for as far
    model.instabilities(scene)


def test_coarse_elements_follow_a_taut_ribbon_less_far_and_a_span_that_is_given_is_followed_or_refused():
    scene = Scene(compression=0.40, shear=0.0, start="U+", drive="compression")
    coarse, fine = (kirchhoff.equilibria(scene, elements=count) for count in (8, 20))
    assert 1.1 < coarse.control.max() < fine.control.max() < 1.568
    # ends that cross by .3 L: the same state
    ends = [model.equilibria(scene, span=(-0.01, 0.9)) for model in (elastica, kirchhoff)]
    assert ends[0].control[-1] == ends[1].control[-1] == 0.9
    assert ends[0].height[-1] == pytest.approx(ends[1].height[-1], abs=1e-7)
    with pytest.raises(SolverError, match="continuation stopped"):
        kirchhoff.equilibria(scene, elements=20, span=(-0.01, 1.567))
