"""What was measured, and fits to it: data of other models, with noise, of closed forms; what they tell."""

import json
import warnings
from dataclasses import replace
from functools import cache

import matplotlib.pyplot as plt
import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline, CubicSpline
from scipy.optimize import OptimizeResult, curve_fit
from scipy.stats import chi2

import compare
import der
from compare.__main__ import main
from compare.fitting.problem import Problem
from compare.limits import edge_ratio, two_point
from ribbonfem import Ribbon, Scene, SceneError, Schedule, SolverError, elastica, kirchhoff
from ribbonfem.measured import Measured
from ribbonfem.options import OptionError
from ribbonfem.scene_numbers import with_numbers

NONE = (0.0, 0.0, 0.0)
BEAM = Scene(compression=0.4, shear=0.0, start="U+", rate=1.0, stop=1.5, damping=10.0, gravity=NONE)
TRUE = replace(BEAM, damping=12.0, ribbon=Ribbon(young=1.1e8))
TIMES = np.linspace(0.0, 1.5, 151)


def height_at(history, times):
    time, _, height, _, velocity = history.track
    return CubicHermiteSpline(time, height, velocity)(np.clip(times, 0.0, time[-1]))


@cache
def rods():
    """Heights of the snapping beam by rods, in the limit of their mesh."""
    meshes = (51, 101)
    runs = [der.simulate(TRUE, nodes=n, tolerance=1e-6, configurations=False) for n in meshes]
    return two_point(*(height_at(run, TIMES) for run in runs), edge_ratio(*meshes))


@cache
def fitted(**options):
    return compare.fit(
        BEAM, Measured(time=TIMES, height=rods(), uncertainty=1e-3), vary=("damping", "young"), **options
    )


def assert_true(fit, truth, part=1.0):
    """Values within a part of their standard deviation of the true ones."""
    for name, value in truth.items():
        assert abs(fit.values[name] - value) < part * fit.uncertainty[name], (name, fit)


# data of another model


def test_a_snap_of_rods_tells_damping_and_modulus():
    fit = fitted()
    assert fit.met
    assert fit.model == "elastica"
    # without noise: what is left is the error of both models, and a thousandth of the uncertainties
    assert_true(fit, {"damping": 12.0, "young": 1.1e8}, 0.05)
    assert fit.reduced_chi2 < 1e-4
    assert fit.degrees == len(TIMES) - 2
    assert fit.scene == replace(BEAM, damping=fit.values["damping"], ribbon=Ribbon(young=fit.values["young"]))
    np.testing.assert_allclose(height_at(fit.history, TIMES) - rods(), -fit.residual[0]["height"], atol=1e-12)
    # and the model's own error is told of what it is: the shift by a finer run is of the same size
    finer = fitted(tolerance=1e-7, elements=16)
    for name, error in fit.model_error.items():
        assert abs(fit.values[name] - finer.values[name]) < 5.0 * error
        assert finer.model_error[name] < 0.5 * error


def test_a_ribbon_is_fitted_in_three_dimensions():
    scene = Scene(compression=0.40, shear=0.37, start="U+S-", rate=0.5, stop=1.5, gravity=NONE)
    true, rates = replace(scene, damping=2.0, compression=0.405), (0.1, 0.5, 2.0)
    snaps = []
    for rate in rates:
        options = {"until": "snap", "tolerance": 1e-6}
        coarse, fine = (der.simulate(replace(true, rate=rate), nodes=n, **options) for n in (101, 201))
        snaps.append(two_point(coarse.snap[1], fine.snap[1], edge_ratio(101, 201)))
    # the angle of one snap would not tell both: runs at several rates do
    scenes = [replace(scene, rate=rate) for rate in rates]
    data = [Measured(snap=snap, uncertainty=2e-4) for snap in snaps]
    fit = compare.fit(scenes, data, vary=("damping", "compression"))
    assert fit.model == "kirchhoff"
    assert fit.met
    assert_true(fit, {"damping": 2.0, "compression": 0.405}, 0.2)
    # two are just enough, and tell less
    two = compare.fit(scenes[:2], data[:2], vary=("damping", "compression"))
    assert two.degrees == 0
    assert two.uncertainty["damping"] > 1.1 * fit.uncertainty["damping"]
    with pytest.raises(OptionError, match="2 numbers from 1 data"):
        compare.fit(scenes[0], data[0], vary=("damping", "compression"))


def test_states_at_rest_tell_how_the_other_clamp_stands():
    """A right clamp that is lifted and turned, by heights of the Kirchhoff elements over the left one."""
    truth = {"lift": 0.03, "right": 0.05}
    scene = Scene(compression=0.30, shear=0.0, start="U+", rate=1.0, preset=truth)
    turned = np.linspace(0.0, 0.8, 9)
    states = [
        kirchhoff.state(
            replace(scene, schedule=Schedule((0.0, 1.0), (at, at + 1e-3), "linear"), rate=Scene.rate),
            extensible=True,
        )
        for at in turned
    ]
    data = Measured(control=turned, height=[state.height for state in states], uncertainty=1e-5)
    begun = replace(scene, preset={"lift": 0.01})
    fit = compare.fit(begun, data, vary=("lift", "right"))
    for name, value in truth.items():
        assert abs(fit.values[name] - value) < 1e-5, name
    assert fit.scene.preset == pytest.approx(truth, abs=1e-5)
    assert fit.met


def test_folds_tell_the_shear():
    scene = Scene(compression=0.40, shear=0.40, start="U+S+", gravity=NONE)
    measured = [
        two_point(a.control, b.control, edge_ratio(101, 201))
        for a, b in zip(*(der.folds(replace(scene, shear=0.395), nodes=n) for n in (101, 201)), strict=True)
    ]
    fit = compare.fit(
        scene, Measured(folds=np.degrees(measured), units={"folds": "deg"}, uncertainty=0.01), "shear"
    )
    assert_true(fit, {"shear": 0.395}, 0.1)
    assert fit.converged
    # one that was not seen tells nothing, and takes nothing away
    one = compare.fit(scene, Measured(folds=[measured[0], np.nan], uncertainty=1e-4), vary="shear")
    assert one.values["shear"] == pytest.approx(0.395, abs=1e-4)


@cache
def pushed():
    """Force (EI2/L^2) and height (L) of the beam that is pushed down at midspan, by rods: stable states."""
    scene = Scene(compression=0.3, shear=0.0, start="U+", drive="force", gravity=NONE)
    meshes, points = (201, 401), []
    for nodes in meshes:
        branch = der.equilibria(scene, nodes=nodes, span=(-5.0, 45.0))
        near = branch.stable & (branch.control >= 0.0) & (branch.height > 0.0)
        points.append(np.array([branch.control[near], branch.height[near]]))
    force, height = two_point(*points, edge_ratio(*meshes))
    return scene, force, height


def test_a_push_in_newton_tells_the_modulus():
    scene, force, height = pushed()
    # forces go with EI2 / L^2, and this alone: of the same rig with any modulus the heights are the same
    ribbon = Ribbon(length=0.3, width=0.02, thickness=3e-3, young=2.3e9)
    newton = ribbon.bending_stiffness / ribbon.length**2
    data = Measured(
        control=force * newton,
        height=height * 300.0,
        units={"control": "N", "height": "mm"},
        uncertainty={"control": 2e-3 * newton * force.max(), "height": 0.1},
    )
    fit = compare.fit(replace(scene, ribbon=replace(ribbon, young=2e9)), data, vary="young")
    assert fit.met
    assert fit.values["young"] == pytest.approx(2.3e9, rel=5e-4)
    assert fit.uncertainty["young"] > 10.0 * abs(fit.values["young"] - 2.3e9)


def test_a_load_cell_tells_the_modulus():
    """A force in N goes with EI2 / L^2: of a ramp that does not snap too, where heights say little."""
    ramp = Schedule.ramp(rate=1.0, stop=0.9, acceleration=2.0)
    scene = replace(BEAM, rate=0.1, stop=None, schedule=ramp, damping=1.0)
    true, times = replace(scene, ribbon=Ribbon(young=1.1e8)), np.linspace(0.0, ramp.time[-1], 81)
    meshes, cells = (51, 101), []
    for nodes in meshes:
        run = der.simulate(true, nodes=nodes, tolerance=1e-7, configurations=False)
        cells.append(CubicSpline(run.time, run.reactions[:, 0, 0])(times))
    # (its length is 1 m)
    newton = two_point(*cells, edge_ratio(*meshes)) * true.ribbon.bending_stiffness
    data = Measured(
        time=times, reactions={"force_left_x": newton}, units={"force_left_x": "N"}, uncertainty=0.1
    )
    fit = compare.fit(scene, data, vary=("young", "compression"))
    assert fit.met
    assert_true(fit, {"young": 1.1e8, "compression": 0.4}, 0.3)
    slow = Measured(time=times, height=height_at(run, times), uncertainty=1e-3)
    dull = compare.fit(scene, slow, vary="young")
    assert dull.uncertainty["young"] > 10.0 * fit.uncertainty["young"]


def test_every_column_is_what_a_motion_has_of_it():
    pytest.importorskip("pandas")
    scene = Scene(rate=1.0, stop=0.3, damping=10.0, gravity=NONE)
    options = {"extensible": True, "tolerance": 1e-6}
    run = kirchhoff.simulate(scene, **options)
    frame = run.to_pandas()[5:-5:7]
    names = ["time", "height", "slope", "load", *(name for name in frame if name[:5] in ("force", "momen"))]
    rows = {name: frame[name].to_numpy() for name in names}
    reactions = {name: rows.pop(name) for name in names[4:]}
    middle = run.configurations["positions"][5:-5:7, np.argmin(np.abs(run.arclength - 0.5))]
    data = Measured(
        **rows,
        control=frame["angle"].to_numpy(),
        midspan_x=middle[:, 0],
        midspan_y=middle[:, 1],
        reactions=reactions,
        uncertainty=dict.fromkeys((*names[1:], "control", "midspan_x", "midspan_y"), 1e-3),
    )
    assert len(data.measured) == 18
    fit = compare.fit(scene, data, vary="damping", **options)
    assert fit.values["damping"] == pytest.approx(10.0, abs=1e-6)
    # at its own steps a motion is interpolated by itself
    assert fit.chi2 < 1e-9
    np.testing.assert_allclose(fit.predicted[0]["midspan_y"], middle[:, 1], atol=1e-9)


def test_a_state_beyond_the_fold_is_near_the_fold():
    (fold,) = elastica.folds(replace(BEAM, stop=None, compression=0.39), extensible=True)
    spread = {"control": 1e-3, "height": 1e-3}
    beyond = Measured(control=[fold.control + 5e-4], height=[fold.height], uncertainty=spread)
    fit = compare.fit(replace(BEAM, stop=None), beyond, vary={"compression": (0.3, 0.5)})
    assert fit.converged
    # the fold comes to it, as near as a tenth of the uncertainty, which a search takes for nothing
    (moved,) = elastica.folds(fit.scene, extensible=True)
    assert moved.control == pytest.approx(fold.control + 5e-4, abs=1e-4)
    assert fit.predicted[0]["control"][0] == pytest.approx(moved.control, abs=1e-6)
    assert fit.predicted[0]["height"][0] == pytest.approx(fold.height, abs=1e-3)


# noise


def test_pulls_are_normal():
    """(value - true) / uncertainty over forty draws has mean 0 and deviation 1, and is correlated as told."""
    clean, draws, random = rods(), 40, np.random.default_rng(20240607)
    begun, truth = replace(TRUE, damping=10.0, compression=0.39), {"damping": 12.0, "compression": 0.4}
    pulls = np.empty((draws, 2))
    for k in range(draws):
        noisy = clean + 1e-3 * random.standard_normal(len(clean))
        fit = compare.fit(begun, Measured(time=TIMES, height=noisy, uncertainty=1e-3), vary=tuple(truth))
        assert fit.met
        pulls[k] = [(fit.values[name] - true) / fit.uncertainty[name] for name, true in truth.items()]
    # each of these bounds fails once in two thousand times if all is right
    assert np.abs(pulls.mean(axis=0)).max() < 3.5 / np.sqrt(draws)
    low, high = np.sqrt(chi2.ppf((2.5e-4, 1.0 - 2.5e-4), draws - 1) / (draws - 1))
    assert ((pulls.std(axis=0, ddof=1) > low) & (pulls.std(axis=0, ddof=1) < high)).all()
    # (Fisher's transform of a correlation is normal)
    seen, told = np.arctanh(np.corrcoef(pulls.T)[0, 1]), np.arctanh(fit.correlation[0, 1])
    assert abs(seen - told) < 3.5 / np.sqrt(draws - 3)


def test_a_noise_that_nobody_tells_is_estimated():
    random = np.random.default_rng(7)
    rows = len(TIMES)
    data = Measured(
        time=TIMES,
        height=rods() + 2e-3 * random.standard_normal(rows),
        control=TIMES + 5e-3 * random.standard_normal(rows),
    )
    fit = compare.fit(BEAM, data, vary=("damping", "young"))
    low, high = np.sqrt(chi2.ppf((5e-4, 1.0 - 5e-4), rows) / rows)
    for name, spread in (("height", 2e-3), ("control", 5e-3)):
        assert low < fit.sigma[0][name][0] / spread < high
    assert fit.estimated == ("control", "height")
    sigma = fit.sigma[0]["height"][0]
    assert any(f"deviation of height was not given. {sigma:.2g} L is estimated" in x for x in fit.summary())
    assert_true(fit, {"damping": 12.0, "young": 1.1e8}, 4.0)
    # an uncertainty that is told is taken as it is, and a wrong one is found out
    wrong = compare.fit(
        BEAM, Measured(time=TIMES, height=data.height, uncertainty=1e-3), vary=("damping", "young")
    )
    assert wrong.reduced_chi2 == pytest.approx(4.0, rel=0.5)
    assert "chi2" in str(wrong).splitlines()[-1]
    assert not any("was not given" in line for line in wrong.summary())
    assert wrong.converged
    assert not wrong.met
    assert wrong.uncertainty["young"] == pytest.approx(0.5 * fit.uncertainty["young"], rel=0.2)


# what is determined, and what is not


def test_a_deviation_that_is_given_stays_beside_one_that_is_estimated():
    run = elastica.simulate(TRUE, extensible=True, tolerance=1e-6)
    draw = np.random.default_rng(5)
    one, other = (height_at(run, TIMES) + size * draw.normal(size=len(TIMES)) for size in (1e-4, 5e-3))
    data = [Measured(time=TIMES, height=one, uncertainty=1e-4), Measured(time=TIMES, height=other)]
    fit = compare.fit([TRUE, TRUE], data, vary="damping")
    assert (fit.sigma[0]["height"] == 1e-4).all()
    # (a deviation of 151 numbers is known to a seventeenth: four times that)
    assert fit.sigma[1]["height"] == pytest.approx(5e-3, rel=0.24)
    alone = compare.fit(TRUE, data[0], vary="damping")
    # (beside what each says of its runs, whose tolerances differ)
    told = fit.model_error["damping"] + alone.model_error["damping"]
    assert told < 0.3 * alone.uncertainty["damping"]
    assert fit.values["damping"] == pytest.approx(
        alone.values["damping"], abs=0.05 * alone.uncertainty["damping"] + told
    )
    assert fit.uncertainty["damping"] == pytest.approx(alone.uncertainty["damping"], rel=0.01)


def test_what_is_exact_does_not_count_for_all():
    """A control as a machine tells it: rounding alone is left of it, beside a height that has a noise."""
    run = elastica.simulate(TRUE, extensible=True, tolerance=1e-6)
    noise = 1e-3 * np.random.default_rng(4).normal(size=len(TIMES))
    data = {"time": TIMES, "height": height_at(run, TIMES) + noise, "units": {"control": "deg"}}
    one = compare.fit(TRUE, Measured(**data), vary="damping")
    both = compare.fit(TRUE, Measured(**data, control=np.rad2deg(TIMES)), vary="damping")
    assert both.met
    # (degrees of freedom differ, by which the deviation of the height is estimated)
    assert both.values["damping"] == pytest.approx(
        one.values["damping"], abs=0.05 * one.uncertainty["damping"]
    )
    assert both.uncertainty["damping"] == pytest.approx(one.uncertainty["damping"], rel=0.02)
    # and a fit to its own prediction is told as known, not as undetermined
    own = Measured(time=TIMES, height=one.predicted[0]["height"])
    same = compare.fit(one.scene, own, **one.options)
    assert same.identifiable["damping"]
    assert same.values["damping"] == pytest.approx(one.values["damping"], abs=same.uncertainty["damping"])


def test_a_motion_tells_modulus_over_density_alone():
    data = Measured(time=TIMES, height=rods(), uncertainty=1e-3)
    both = compare.fit(BEAM, data, vary=("young", "density", "damping"))
    assert both.identifiable == {"young": False, "density": False, "damping": True}
    assert both.uncertainty["young"] == np.inf
    assert np.isnan(both.correlation[0, 1])
    (direction,) = both.undetermined
    # both by the same part: t* stays
    assert direction["young"] / direction["density"] == pytest.approx(1.0, abs=1e-4)
    assert "do not determine young and density" in str(both)
    assert not both.met
    # what is determined is as with one of the two
    fit = fitted()
    assert both.values["damping"] == pytest.approx(
        fit.values["damping"], abs=0.05 * fit.uncertainty["damping"]
    )
    assert both.uncertainty["damping"] == pytest.approx(fit.uncertainty["damping"], rel=0.02)
    density = compare.fit(BEAM, data, vary=("density", "damping"))
    ratio = density.values["density"] / 1000.0 * fit.values["young"] / 1e8
    assert ratio == pytest.approx(1.0, abs=1e-3)
    # at rest there is no time, and neither says anything
    scene, force, height = pushed()
    rest = compare.fit(
        scene, Measured(control=force, height=height, uncertainty=1e-3), vary=("young", "compression")
    )
    assert rest.identifiable == {"young": False, "compression": True}
    assert list(rest.undetermined[0]) == ["young"]
    still = Measured(control=force, height=height, uncertainty=1e-3)
    alone = compare.fit(scene, still, vary="density")
    assert alone.uncertainty == {"density": np.inf}


def test_units_change_nothing():
    scene = replace(BEAM, ribbon=replace(BEAM.ribbon, length=0.5, width=0.1, thickness=5e-3))
    time = scene.ribbon.inertial_time / BEAM.ribbon.inertial_time
    scene = replace(scene, rate=BEAM.rate / time, damping=BEAM.damping / time)
    data = Measured(
        time=TIMES * time * 1e3,
        height=rods() * 500.0,
        units={"time": "ms", "height": "mm"},
        uncertainty=0.5,
    )
    fit, same = compare.fit(scene, data, vary=("damping", "young")), fitted()
    # steps that differ by rounding scatter: less than what the model errs by
    assert fit.values["damping"] * time == pytest.approx(
        same.values["damping"], abs=same.model_error["damping"]
    )
    assert fit.values["young"] == pytest.approx(same.values["young"], abs=same.model_error["young"])
    assert fit.uncertainty["young"] == pytest.approx(same.uncertainty["young"], rel=5e-2)


def test_a_clock_of_its_own_is_found():
    random = np.random.default_rng(3)
    early = np.linspace(-0.2, 1.5, 171)
    run = elastica.simulate(replace(BEAM, damping=12.0), extensible=True, tolerance=1e-7)
    heights = height_at(run, early) + 1e-3 * random.standard_normal(len(early))
    data = Measured(time=early + 41.3, height=heights, uncertainty=1e-3)
    fit = compare.fit(BEAM, data, vary={"damping": None, "offset": (41.0, 41.5)})
    assert fit.converged
    assert_true(fit, {"damping": 12.0, "offset": 41.3}, 4.0)
    assert fit.uncertainty["offset"] < 5e-3


def test_a_snap_while_the_control_stands_is_waited_for():
    """A ramp that stops just past the fold; how long it was held is not in the scene, but in the data."""
    scene = Scene(compression=0.3, shear=0.0, start="U+", rate=1.0, stop=1.0, damping=10.0, gravity=NONE)
    run = elastica.simulate(replace(scene, hold=10.0), extensible=True, until="snap", tolerance=1e-6)
    time, _ = run.snap
    assert time > 1.3
    begin = replace(scene, damping=9.0)
    fit = compare.fit(begin, Measured(snap_time=time, uncertainty=0.01), vary="damping")
    assert_true(fit, {"damping": 10.0}, 0.1)
    rows = {"time": (0.0, 0.5), "height": (0.3, 0.3)}
    both = Measured(**rows, snap_time=time, uncertainty={"height": 1.0, "snap_time": 0.01})
    assert_true(compare.fit(begin, both, vary="damping"), {"damping": 10.0}, 0.1)


def test_a_ramp_without_a_stop_is_followed_as_far_as_rows_go():
    """And not for a turn of the clamp, most of it a vibration behind the snap; the fit is the same."""
    early = TIMES[:140]
    data = Measured(time=early, height=rods()[:140], uncertainty=1e-3)
    endless = compare.fit(replace(BEAM, stop=None), data)
    stopped = compare.fit(BEAM, data)
    assert endless.history.time[-1] < early[-1] + BEAM.ribbon.inertial_time
    spread = stopped.uncertainty["damping"]
    assert endless.values["damping"] == pytest.approx(stopped.values["damping"], abs=0.1 * spread)
    assert endless.uncertainty["damping"] == pytest.approx(spread, rel=0.01)
    # a snap may come later than the last row
    late = Measured(time=early[:50], height=rods()[:50], snap=1.35, uncertainty={"height": 1.0, "snap": 1e-3})
    assert compare.fit(replace(BEAM, stop=None), late).met


def test_derivatives_do_not_depend_on_their_step():
    """Over a factor of five: it is long against the scatter of the steps, and short against the curvature.

    (At 1e-3 the scatter is 1 to 6 % of a derivative, and falls as the difference grows.)
    """
    spread = [fitted(difference=part).uncertainty for part in (2e-3, 5e-3, 1e-2)]
    for name in ("damping", "young"):
        values = np.array([each[name] for each in spread])
        assert np.ptp(values) < 0.05 * values.mean()


def test_a_negative_parameter_is_its_mirror_image():
    """The beam turned over, and driven the other way: the same rate, as well known."""
    up = Scene(compression=0.3, shear=0.0, start="U+", rate=1.0, damping=3.0, gravity=NONE)
    down = replace(up, start="U-", rate=-1.0)
    one = compare.fit(up, Measured(snap=1.3, uncertainty=1e-3), vary="rate")
    other = compare.fit(down, Measured(snap=-1.3, uncertainty=1e-3), vary="rate")
    assert one.met
    assert other.met
    assert one.chi2 + other.chi2 < 1e-6
    assert one.values["rate"] > 1.5
    assert other.values["rate"] == pytest.approx(-one.values["rate"], abs=1e-3 * one.uncertainty["rate"])
    assert other.uncertainty["rate"] == pytest.approx(one.uncertainty["rate"], rel=1e-3)


def test_a_bound_is_told():
    data = Measured(time=TIMES, height=rods(), uncertainty=1e-3)
    fit = compare.fit(BEAM, data, vary={"damping": (5.0, 10.1)})
    assert fit.at_bounds == ("damping",)
    assert fit.values["damping"] == pytest.approx(10.1, abs=0.02)
    assert "At a bound: damping." in fit.summary()


def test_a_search_may_begin_at_zero():
    """Where a field may not be less, and where the ribbon is the same for both signs: no slope leads off."""
    data = Measured(time=TIMES, height=rods(), uncertainty=1e-3)
    begin = replace(BEAM, damping=0.0)
    fit, same = compare.fit(begin, data, vary=("damping", "young")), fitted()
    for name, value in same.values.items():
        assert fit.values[name] == pytest.approx(value, abs=0.02 * same.uncertainty[name])
    # alone too: there is no other parameter whose size says how far a first step goes
    true = replace(TRUE, ribbon=BEAM.ribbon)
    run = elastica.simulate(true, extensible=True, tolerance=1e-7)
    alone = compare.fit(begin, Measured(time=TIMES, height=height_at(run, TIMES), uncertainty=1e-3))
    # (met: the model's own error is less than this part)
    assert alone.met
    assert not alone.at_bounds
    assert_true(alone, {"damping": 12.0}, 0.3)
    run = kirchhoff.simulate(replace(BEAM, shear=0.05), extensible=True, tolerance=1e-6)
    data = Measured(time=TIMES, height=height_at(run, TIMES), uncertainty=1e-3)
    sheared = compare.fit(BEAM, data, vary="shear")
    assert sheared.model == "kirchhoff"
    assert abs(sheared.values["shear"]) == pytest.approx(0.05, abs=0.2 * sheared.uncertainty["shear"])
    # what is 0 is found to be that, with how much it could be
    still = elastica.simulate(replace(BEAM, damping=0.0), extensible=True, tolerance=1e-7)
    early = TIMES[:120]
    none = compare.fit(
        BEAM, Measured(time=early, height=height_at(still, early), uncertainty=1e-3), vary="damping"
    )
    assert none.at_bounds == ("damping",)
    assert none.values["damping"] < none.uncertainty["damping"] < 0.2


def test_a_bound_that_the_data_lead_away_from_is_no_minimum(monkeypatch):
    """A search that stays where it begins, at a bound, has not converged."""
    monkeypatch.setattr(Problem, "minimum", lambda self, y, most: OptimizeResult(x=y, status=2))
    data = Measured(time=TIMES, height=rods(), uncertainty=1e-3)
    for bounds, converged in (((10.0, 20.0), False), ((1.0, 10.0), True)):
        fit = compare.fit(BEAM, data, vary={"damping": bounds})
        assert fit.at_bounds == ("damping",)
        assert fit.converged is converged


def test_trials_warn_of_nothing():
    """What a weight would do was said of the scene, and not of each trial."""
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        scene = replace(BEAM, gravity=None)
        fit = compare.fit(scene, Measured(snap=1.31, uncertainty=1e-2), vary="young")
        assert fit.runs > 5
        with_numbers(scene, {"thickness": 0.012})
    assert not told


def test_a_search_that_ends_too_early_says_so():
    fit = compare.fit(BEAM, Measured(time=TIMES, height=rods(), uncertainty=1e-5), vary="damping", most=2)
    assert not fit.converged
    assert not fit.met
    assert "NOT converged" in repr(fit)
    assert fit.summary()[0].startswith("It did not converge")


def test_a_long_vibration_is_not_trusted():
    """Undamped high modes make two runs differ by more than is measured: that is said."""
    scene = replace(BEAM, damping=1.0)
    times = np.linspace(0.0, 3.0, 151)
    run = kirchhoff.simulate(replace(scene, damping=1.1, hold=1.5), extensible=True, tolerance=1e-5)
    fit = compare.fit(
        scene,
        Measured(time=times, height=height_at(run, times), uncertainty=1e-4),
        vary="damping",
        tolerance=1e-5,
    )
    assert fit.prediction_error > 1.0
    assert not fit.met
    assert any("model" in line for line in fit.summary())


# closed forms


def test_a_free_vibration_tells_damping_and_modulus():
    """Small vibrations of the slope at midspan are c + exp(-nu t / 2) (a cos w t + b sin w t)."""
    # the clamp turns a little within a period and stays: the lowest mode is left
    nudge = Schedule((0.0, 0.2, 3.0), (0.0, 0.05, 0.05), slope=(0.0, 0.0, 0.0))
    scene = Scene(compression=0.4, shear=0.0, start="U+", damping=1.0, gravity=NONE, schedule=nudge)
    true = replace(scene, damping=1.5, ribbon=Ribbon(young=1.03e8))
    run, times = kirchhoff.simulate(true, extensible=True, tolerance=1e-7), np.linspace(0.25, 3.0, 276)
    slopes = CubicSpline(run.time, run.slope)(times)
    fit = compare.fit(scene, Measured(time=times, slope=slopes, uncertainty=1e-4), vary=("damping", "young"))
    assert fit.met
    assert_true(fit, {"damping": 1.5, "young": 1.03e8}, 0.3)

    def free(t, c, a, b, damping, w):
        return c + np.exp(-0.5 * damping * t) * (a * np.cos(w * t) + b * np.sin(w * t))

    turned = replace(scene, schedule=Schedule((0.0, 1.0), (0.05, 0.06), "linear"))
    usual = elastica.frequencies(turned, extensible=True, count=1)[0]
    (*_, damping, w), _ = curve_fit(free, times, slopes, (slopes.mean(), 1e-3, 1e-3, 1.0, usual))
    # what the higher modes leave in it
    assert fit.values["damping"] == pytest.approx(damping, rel=0.01)
    young = 1e8 * (w**2 + damping**2 / 4.0) / usual**2
    assert fit.values["young"] == pytest.approx(young, rel=1e-3)


# what is measured


def test_missing_rows_count_nothing_and_order_neither(tmp_path):
    holes = rods().copy()
    holes[20:50] = np.nan
    there = np.isfinite(holes)
    data = Measured(time=TIMES, height=holes, uncertainty=1e-3)
    assert data.missing == {"height": 30}
    assert "30 missing" in repr(data)
    fit = compare.fit(BEAM, data, vary="damping")
    short = compare.fit(
        BEAM, Measured(time=TIMES[there], height=holes[there], uncertainty=1e-3), vary="damping"
    )
    assert fit.values == short.values
    assert fit.degrees == there.sum() - 1
    assert np.isnan(fit.residual[0]["height"][20:50]).all()
    mixed = np.random.default_rng(0).permutation(len(TIMES))
    other = Measured(time=TIMES[mixed], height=holes[mixed], uncertainty=1e-3)
    shuffled = compare.fit(BEAM, other, vary="damping")
    assert shuffled.values["damping"] == pytest.approx(
        fit.values["damping"], abs=0.02 * fit.uncertainty["damping"]
    )
    np.testing.assert_allclose(shuffled.residual[0]["height"], fit.residual[0]["height"][mixed], atol=1e-4)


def test_a_file_of_rows(tmp_path):
    path = tmp_path / "camera.csv"
    path.write_text("# camera 2\n# t (ms);z (mm);sd\n0;34.8;0.1\n10;;0.1\n\n20;34.6;0.2\n")
    data = Measured.from_csv(
        path,
        time="t (ms)",
        height="z (mm)",
        units={"time": "ms", "height": "mm"},
        uncertainty={"height": "sd"},
    )
    np.testing.assert_array_equal(data.time, [0.0, 10.0, 20.0])
    np.testing.assert_array_equal(data.height, [34.8, np.nan, 34.6])
    np.testing.assert_array_equal(data.uncertainty["height"], [0.1, 0.1, 0.2])
    assert data == Measured.from_csv(path, time=0, height=1, units=dict(data.units), uncertainty="sd")
    path.write_text("time,force\n0,1\n# here the cell slipped\n0.1,1.2 N\n")
    with pytest.raises(SceneError, match=r"camera\.csv: line 4, row 2: '1\.2 N' is no finite number"):
        Measured.from_csv(path, time="time", force_left_x="force")
    with pytest.raises(SceneError, match="no column 'z'; there are time, force"):
        Measured.from_csv(path, time="time", height="z")
    path.write_text("time [ms];height (mm);remark\n0;34.8;1\n")
    headed = Measured.from_csv(path)
    assert headed == Measured(time=[0.0], height=[34.8], units={"time": "ms", "height": "mm"})
    path.write_text("t;z\n0;34.8\n")
    with pytest.raises(SceneError, match=r"no column is headed as a quantity; there are t, z\..* time='t'"):
        Measured.from_csv(path)
    path.write_text("0;34.8\n")
    with pytest.raises(SceneError, match=r"there are no names\..* time=0"):
        Measured.from_csv(path)
    with pytest.raises(SceneError, match="hight = 1: must be one of time, control, height"):
        Measured.from_csv(path, time="time", hight=1)


def test_a_file_has_one_column_of_a_quantity_in_the_unit_of_its_name(tmp_path):
    path = tmp_path / "two.csv"
    path.write_text("time (ms),height (mm),height (m),z (left)\n0,34.8,0.0348,1\n10,34.1,0.0341,1\n")
    with pytest.raises(SceneError, match=r"'height \(mm\)' and 'height \(m\)' are both height: say which"):
        Measured.from_csv(path)
    metres = Measured(time=[0, 10], height=[0.0348, 0.0341], units={"time": "ms", "height": "m"})
    assert Measured.from_csv(path, time="time (ms)", height="height (m)") == metres
    assert Measured.from_csv(path, time=0, height=2) == metres
    # what is said counts, and brackets may hold what is no unit
    told = Measured.from_csv(path, time=0, height=1, units={"height": "L"})
    assert told.unit("height") == "L"
    assert Measured.from_csv(path, time=0, height="z (left)").unit("height") == "L"
    with pytest.raises(SceneError, match=r"units = 'mm': a mapping by name"):
        Measured.from_csv(path, time=0, height=1, units="mm")


def test_cells_in_quotes_may_go_on_in_the_next_line(tmp_path):
    """As spreadsheets write names and remarks; numbers of lines are those of the file."""
    path = tmp_path / "sheet.csv"
    path.write_text('# two\n"time\n(ms)","height\n(mm)",remark\n0,34.8,"blown\non"\n10,34.1,\n20,x,\n')
    with pytest.raises(SceneError, match=r"line 8, row 3: 'x' is no finite number"):
        Measured.from_csv(path)
    path.write_text(path.read_text().replace("20,x,\n", ""))
    assert Measured.from_csv(path) == Measured(
        time=[0.0, 10.0], height=[34.8, 34.1], units={"time": "ms", "height": "mm"}
    )
    assert Schedule.from_csv(path, time=0, value=1, units=("ms", "rad")).value == (34.8, 34.1)
    path.write_text('time,height\n0,"34.8\n1,34.1\n')
    with pytest.raises(SceneError, match="line 2, row 1"):
        Measured.from_csv(path)


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({}, "nothing is measured"),
        ({"height": [1.0]}, "measured over nothing: time is needed, or control"),
        ({"time": [0, 1], "height": [1.0]}, r"Measured\.height: 1 rows, and time has 2"),
        ({"time": [0, 1], "height": [1.0, np.inf]}, r"Measured\.height\[1\] = inf"),
        ({"time": [0], "height": [np.nan]}, "holds no number"),
        ({"time": [0], "hight": [1]}, "perhaps 'height' is meant"),
        ({"time": [0], "height": [1], "uncertainty": 0.0}, r"uncertainty\['height'\] = 0\.0: a standard"),
        ({"time": [0], "height": [1], "slope": [1], "uncertainty": 0.1}, "whose, of height, slope"),
        ({"time": [0], "height": [1], "uncertainty": {"slope": 0.1}}, "'slope' is none of height"),
        ({"time": [0], "height": [1], "units": {"height": "cm"}}, "must be one of L, m, mm"),
        ({"time": [0], "reactions": {"force": [1]}}, "'force' is none of force_left_x"),
        ({"control": [0], "midspan_x": [1]}, "needs a time: of states at rest"),
        ({"time": [0], "height": [10**400]}, r"Measured\.height = .*a sequence of numbers is needed"),
        ({"snap": "early"}, r"Measured\.snap = 'early': a real number is needed"),
    ],
)
def test_what_cannot_have_been_measured_is_refused(given, told):
    with pytest.raises(SceneError, match=told):
        Measured(**given)


SNAP = Measured(snap=1.3, uncertainty=1e-3)


@pytest.mark.parametrize(
    ("scene", "measured", "vary", "error", "told"),
    [
        (BEAM, SNAP, "yuong", OptionError, "perhaps 'young' is meant"),
        (BEAM, SNAP, ("young", "ribbon.young"), OptionError, "'young' and 'ribbon.young' are the same"),
        (BEAM, SNAP, "young,damping", OptionError, "several names are given as a tuple"),
        (BEAM, SNAP, (), OptionError, "at least"),
        (BEAM, SNAP, {"damping": (-1.0, 2.0)}, OptionError, r"must be within \(0, inf\)"),
        (BEAM, SNAP, {"damping": (0.1, 2.0)}, OptionError, "begins at 10, outside"),
        (BEAM, SNAP, "offset", OptionError, "nothing was measured in time"),
        (BEAM, SNAP, "preset.left", OptionError, "the drive moves it"),
        (BEAM, SNAP, ("lift", "preset.lift"), OptionError, "'lift' and 'preset.lift' are the same"),
        (BEAM, 1.3, "damping", OptionError, "a Measured is needed"),
        ([BEAM, BEAM], SNAP, "damping", OptionError, "one for each scene"),
        ([BEAM, replace(BEAM, damping=1.0)], [SNAP, SNAP], "damping", OptionError, "same in all"),
        (BEAM, Measured(snap=1.3), "damping", SceneError, "nothing can be told from a single number"),
        (BEAM, replace(SNAP, units={"snap": "mm"}), "damping", SceneError, "snap is in mm, and the scene's"),
        (replace(BEAM, stop=0.5), SNAP, "damping", SolverError, "the ribbon does not snap"),
        (
            replace(BEAM, rate=0.1, stop=None, schedule=Schedule((0.0, 1.0), (0.0, 1.5))),
            Measured(time=[0.0, 2.0], height=[0.3, 0.2]),
            "damping",
            SceneError,
            "its schedule ends at 1 s",
        ),
    ],
)
def test_what_cannot_be_fitted_is_refused(scene, measured, vary, error, told):
    with pytest.raises(error, match=told):
        compare.fit(scene, measured, vary=vary)


# what a fit shows


def test_a_fit_from_the_command_line(tmp_path, capsys):
    (tmp_path / "beam.toml").write_text(
        'compression = 0.4\nshear = 0.0\nstart = "U+"\nrate = 1.0\nstop = 1.5\ndamping = 10.0\n'
        "gravity = [0, 0, 0]\n"
    )
    noisy = rods() + 1e-3 * np.random.default_rng(5).standard_normal(len(TIMES))
    rows = np.column_stack((1e3 * TIMES, 1e3 * noisy))
    np.savetxt(tmp_path / "film.csv", rows, delimiter=",", header="time (ms), height (mm)")
    words = ["fit", str(tmp_path / "beam.toml"), "--data", str(tmp_path / "film.csv"), "--quiet", "--json"]
    words += ["--out", str(tmp_path / "out")]
    assert main([*words, "--vary", "damping,young", "--uncertainty", "1"]) == 0
    told = json.loads(capsys.readouterr().out)
    again = compare.fit(BEAM, Measured(time=TIMES, height=noisy, uncertainty=1e-3), vary=("damping", "young"))
    assert told["values"] == pytest.approx(again.values, rel=1e-3)
    assert (tmp_path / "out" / "fit-height.png").exists()
    # named, it is the same
    assert main([*words, "--vary", "damping,young", "--uncertainty", "height:1"]) == 0
    assert json.loads(capsys.readouterr().out)["uncertainty"] == told["uncertainty"]
    assert main([*words, "--uncertainty", "height:1,slope"]) == 1
    assert "NAME:NUMBER" in capsys.readouterr().err
    # what cannot be told is no success
    assert main([*words, "--vary", "damping,young,density"]) == 3
    told = json.loads(capsys.readouterr().out)
    assert told["uncertainty"]["young"] is None
    assert set(told["undetermined"][0]) == {"young", "density"}


def test_a_fit_is_kept_drawn_and_tabulated(tmp_path):
    pytest.importorskip("pandas")
    fit = fitted()
    compare.save(fit, tmp_path / "fit")
    assert compare.load(tmp_path / "fit") == fit
    frame = fit.to_pandas()
    np.testing.assert_allclose(frame.measured - frame.predicted, frame.residual, atol=1e-15)
    assert ((frame.residual / frame.uncertainty) ** 2).sum() == pytest.approx(fit.chi2)
    assert frame.attrs["values"] == fit.values
    assert fit._repr_html_().count("<tr>") == 3
    axes = fit.plot()
    line, dots = axes.lines
    np.testing.assert_array_equal(dots.get_ydata(), rods())
    np.testing.assert_allclose(np.interp(TIMES, *line.get_data()), rods(), atol=5e-3)
    left = axes.child_axes[0].lines[0].get_ydata()
    np.testing.assert_allclose(left, fit.residual[0]["height"] / 1e-3, atol=1e-9)
    scene, force, height = pushed()
    rest = compare.fit(scene, Measured(control=force, height=height, uncertainty=1e-3), vary="compression")
    assert rest.plot().get_xlabel() == "control (EI2/L^2)"
    events = compare.fit([BEAM, replace(BEAM, rate=2.0)], [SNAP, replace(SNAP, snap=1.5)], vary="damping")
    assert events.plot().get_xlabel() == "rate (rad/s)"
    with pytest.raises(ValueError, match="quantity = 'slope': must be one of snap"):
        events.plot(quantity="slope")
    plt.close("all")
