"""Pictures and files show the numbers of the run: strains, velocities, one scale, nothing cut off."""

import random
from dataclasses import replace
from functools import cache

import matplotlib.pyplot as plt
import meshio
import numpy as np
import pytest
from mpl_toolkits.mplot3d.proj3d import proj_transform

import der
from ribbonfem import Ribbon, Scene, elastica, kirchhoff, quasilinear
from ribbonfem.output.film import _Stage, stills
from ribbonfem.output.perspective import box, fit
from ribbonfem.output.style import blank
from ribbonfem.output.surface import of_branch, of_motion, of_rest
from ribbonfem.output.vtu import fields, frames

# what each leaves out of the energy of bending and twist: its mesh, and in rods and beams that stretch the
# stretch; and of the curvature at a clamp
SHARE = {kirchhoff: (2e-3, 2e-3), der: (5e-3, 1e-2), elastica: (8e-3, 1e-2), quasilinear: (2e-3, 2e-3)}
MESH = {kirchhoff: {"elements": 12}, der: {"nodes": 101}, elastica: {}, quasilinear: {}}


def scenes(seed, count):
    rng = random.Random(seed)
    for k in range(count):
        shear = 0.0 if k % 2 else rng.uniform(0.36, 0.40)
        dL = rng.uniform(0.1, 0.4) if shear == 0.0 else 0.40
        yield Scene(
            compression=dL,
            shear=shear,
            start="U+" if shear == 0.0 else rng.choice(["U+S+", "U+S-"]),
            rate=rng.choice([0.01, 0.3, 1.0]),
            stop=rng.uniform(0.02, 0.1),
            damping=rng.uniform(0.5, 5.0),
            drive=rng.choice(["left", "right"]),
            ribbon=Ribbon(thickness=rng.choice([0.002, 0.005])),
        )


RUNS = [
    pytest.param(model, scene, id=f"{model.__name__}-{k}")
    for k, scene in enumerate(scenes(1, 12))
    for model in (kirchhoff, der, elastica, quasilinear)
    if scene.planar or model in (kirchhoff, der)
]


@cache
def motion(model, scene):
    return model.simulate(scene, **MESH[model])


@pytest.mark.parametrize(("model", "scene"), RUNS)
def test_fields_are_those_of_the_motion(model, scene):
    history = motion(model, scene)
    strip = of_motion(history, 5)
    energy = np.interp(strip.time, history.time, history.energies["elastic"])
    result = [np.trapezoid(fields(strip, k)["energy_density"], strip.s) for k in range(5)]
    within, at_clamp = SHARE[model]
    np.testing.assert_allclose(result, energy, rtol=within)
    if scene.planar and model is not quasilinear:
        rest = kirchhoff.state(replace(scene, stop=None), elements=24)
        ends = abs(float(np.interp(0.0, rest.points, rest.kappa2)))
        np.testing.assert_allclose(np.abs(strip.kappa2[0, [0, -1]]), ends, rtol=at_clamp)


def test_the_curvature_at_a_clamp_is_that_of_the_closed_form():
    # small slopes: z = A (1 - cos 2 pi s) / 2 with (pi A)^2 / 4 = dL
    for dL in (0.001, 0.01, 0.1):
        beam = Scene(compression=dL, shear=0.0, start="U+", rate=1.0, stop=0.01)
        strip = of_motion(quasilinear.simulate(beam), 2)
        np.testing.assert_allclose(strip.kappa2[0, [0, -1]], 4.0 * np.pi * dL**0.5, rtol=1e-4)


@pytest.mark.parametrize("model", [der, kirchhoff], ids=["der", "kirchhoff"])
@pytest.mark.parametrize("turned", ["left", "right"])
def test_strains_of_a_state_are_its_own(model, turned):
    scene = Scene(
        compression=0.40, shear=0.37, start="U+S+", drive=turned, ribbon=Ribbon(width=0.05, thickness=0.0025)
    )
    state = model.state(scene, **MESH[model])
    strip = of_rest(state)
    # (at a clamp kappa1 falls off within some 1/20, over few edges)
    inside = (state.points > 0.05) & (state.points < 0.95)
    for name in ("kappa1", "kappa2", "tau"):
        own = getattr(state, name)[inside]
        result = np.interp(state.points[inside], strip.s, getattr(strip, name)[0])
        np.testing.assert_allclose(result, own, atol=5e-3 * np.abs(state.kappa2).max())


@pytest.mark.parametrize(("model", "rate"), [(m, r) for m in (kirchhoff, der) for r in (0.01, 0.3)])
def test_velocities_are_those_of_the_motion_and_not_of_the_frames(model, rate, tmp_path):
    scene = Scene(compression=0.4, shear=0.37, start="U+S-", rate=rate, stop=1.2, damping=1.0)
    history = model.simulate(scene, until="snap", **MESH[model])
    peak = float(np.abs(history.velocity).max())
    strip = of_motion(history, 40)
    middle = strip.velocity[:, len(strip.s) // 2, 2]
    own = np.interp(strip.time, history.time, history.velocity)
    np.testing.assert_allclose(middle, own, atol=0.02 * peak)
    # the snap comes last: with frames far apart too it is as fast as it was
    np.testing.assert_allclose(middle[-1], history.velocity[-1], rtol=0.01)
    index = frames(history, tmp_path, count=3)
    last = meshio.read(index.parent / "frame-00002.vtu").point_data
    assert np.abs(last["velocity"][:, 2]).max() > 0.95 * abs(float(history.velocity[-1]))


def test_velocities_do_not_look_across_a_kink():
    # the clamp stops: its edge turns with the rate before, and not at all behind
    scene = Scene(compression=0.4, shear=0.0, start="U+", rate=1.0, stop=0.1, hold=0.1, damping=1.0)
    strip = of_motion(motion(kirchhoff, scene), 41)
    near = strip.velocity[:, 1, 2] / strip.s[1]
    # (the rest of it waves: a few percent at the first point)
    np.testing.assert_allclose(near[1:20], -1.0, atol=0.12)
    np.testing.assert_allclose(near[21:], 0.0, atol=0.12)


def test_a_curve_has_strains_and_no_velocity():
    scene = Scene(compression=0.4, shear=0.37, start="U+S-")
    strip = of_branch(kirchhoff.equilibria(scene, elements=8, span=(-0.1, 0.1)), 5)
    assert "velocity" not in fields(strip, 0)
    assert np.isfinite(fields(strip, 0)["energy_density"]).all()


def scales(axes):
    """Length of a unit along each axis, in a picture of the axes' box."""
    return axes._box_aspect / np.ptp(np.reshape(axes.get_w_lims(), (3, 2)), axis=1)


@pytest.mark.parametrize("seed", range(20))
def test_one_scale_along_all_axes_and_nothing_is_cut(seed):
    rng = np.random.default_rng(seed)
    points = rng.uniform(-1.0, 1.0, 3) + rng.normal(size=(60, 3)) * 10.0 ** rng.uniform(-2.5, 0.0, 3)
    axes = blank(*rng.uniform(2.0, 9.0, 2)).add_axes((0.1, 0.2, 0.6, 0.5), projection="3d")
    for stage in (box, fit):
        stage(axes, points)
        np.testing.assert_allclose(scales(axes), scales(axes)[0], rtol=1e-9)
    assert inside(axes, points)


def inside(axes, points):
    axes.figure.canvas.draw()
    x, y, _ = proj_transform(*points.T, axes.get_proj())
    pixel = axes.transData.transform(np.column_stack((x, y)))
    panel = axes.get_position(original=True).transformed(axes.figure.transFigure)
    return bool(((pixel >= panel.p0) & (pixel <= panel.p1)).all())


@pytest.mark.parametrize("width", [0.02, 0.2])
def test_films_stills_and_states_have_one_scale_and_show_both_ends(width):
    scene = Scene(
        compression=0.4,
        shear=0.37,
        start="U+S-",
        rate=1.0,
        stop=0.9,
        damping=5.0,
        ribbon=Ribbon(width=width, thickness=0.05 * width),
    )
    history = motion(kirchhoff, scene)
    stage = _Stage(of_motion(history, 4), None, history)
    for k in range(4):
        stage.show(k)
        assert inside(stage.view, stage.strip.edges[k].reshape(-1, 3))
    shown = stills(history, [0.0, 0.4, 0.9])
    for k, axes in enumerate(shown.axes):
        np.testing.assert_allclose(scales(axes), scales(axes)[0], rtol=1e-9)
        edges = of_motion(history, 2, until=[0.0, 0.4, 0.9][k]).edges[-1]
        assert inside(axes, edges.reshape(-1, 3))
    axes = kirchhoff.state(replace(scene, stop=None)).plot()
    for one in (axes, stage.view):
        np.testing.assert_allclose(scales(one), scales(one)[0], rtol=1e-9)
    plt.close("all")


@pytest.mark.parametrize("model", [kirchhoff, der, elastica, quasilinear])
def test_velocities_are_the_motions_own_whichever_rows_are_kept(model):
    planar = model in (elastica, quasilinear)
    # (small, so that the quasi-linear beam's x is that of small slopes)
    ringing = Scene(
        compression=0.1 if planar else 0.4,
        shear=0.0 if planar else 0.37,
        start="U+" if planar else "U+S+",
        rate=0.3,
        stop=0.05,
        damping=0.3,
        hold=1.0,
    )
    whole = model.simulate(ringing, tolerance=1e-7, every=1, **MESH[model])
    few = model.simulate(ringing, tolerance=1e-7, every=40, **MESH[model])
    shapes = whole.configurations
    # between kinks displacements are what velocities add up to
    ends = np.searchsorted(whole.time, np.nextafter(ringing.stop / ringing.rate, 0.0))
    for part in (slice(2, ends), slice(ends + 2, len(whole))):
        time, x, v = whole.time[part], shapes["positions"][part], shapes["velocities"][part]
        moved = np.sum(np.diff(time)[:, None, None] * 0.5 * (v[1:] + v[:-1]), axis=0)
        np.testing.assert_allclose(moved, x[-1] - x[0], atol=2e-4 * np.abs(v).max())
    for history in (whole, few):
        strip = of_motion(history, 60)
        middle = np.argmin(np.abs(strip.s - 0.5))
        wanted, largest = (
            np.interp(strip.time, history.time, history.velocity),
            np.abs(history.velocity).max(),
        )
        np.testing.assert_allclose(strip.velocity[:, middle, 2], wanted, atol=0.01 * largest)
    assert len(few) < 0.1 * len(whole)
