"""The ribbon before one's eyes: its surface, films of it, and frames for ParaView."""

import warnings
from dataclasses import replace
from functools import cache
from itertools import pairwise
from xml.etree import ElementTree

import matplotlib.pyplot as plt
import meshio
import numpy as np
import pytest
from PIL import Image

import der
from ribbonfem import Scene, kirchhoff
from ribbonfem.output.film import film, stills
from ribbonfem.output.surface import area, of_branch, of_motion
from ribbonfem.output.vtu import frames

SCENE = Scene(compression=0.40, shear=0.40, rate=0.5, damping=1.0, stop=np.pi)
FLAT = SCENE.ribbon.width / SCENE.ribbon.length


@cache
def motion(model):
    return model.simulate(SCENE, until="snap")


@pytest.mark.parametrize("model", [der, kirchhoff], ids=["der", "kirchhoff"])
def test_the_surface_has_the_area_of_the_ribbon_and_its_width_everywhere(model):
    history = motion(model)
    strip = of_motion(history, 12)
    np.testing.assert_allclose(area(strip), FLAT, rtol=1e-3)
    across = np.linalg.norm(strip.edges[:, 1] - strip.edges[:, 0], axis=-1)
    np.testing.assert_allclose(across, FLAT, rtol=1e-9)
    # clamps: the left one turned, the right one level
    np.testing.assert_allclose(strip.normal[:, 0, 2], np.cos(strip.angle), atol=1e-3)
    np.testing.assert_allclose(strip.normal[:, -1, 2], 1.0, atol=1e-3)


def test_the_two_models_draw_one_surface():
    until = 0.5 * min(float(motion(model).time[-1]) for model in (der, kirchhoff))
    one, other = (of_motion(motion(model), 5, until=until) for model in (der, kirchhoff))
    middles = [strip.centre[:, strip.centre.shape[1] // 2] for strip in (one, other)]
    np.testing.assert_allclose(one.angle, other.angle, atol=1e-9)
    np.testing.assert_allclose(*middles, atol=5e-3)


def test_a_film_has_its_frames_and_they_move(tmp_path):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        path = film(motion(der), tmp_path / "film.gif", frames=5)
    with Image.open(path) as picture:
        assert picture.n_frames == 5
        shown = []
        for k in range(5):
            picture.seek(k)
            shown.append(np.asarray(picture.convert("L"), dtype=float))
    assert all(np.abs(a - b).mean() > 0.05 for a, b in pairwise(shown))
    assert [each.name for each in tmp_path.iterdir()] == ["film.gif"]


def test_a_film_of_another_kind_or_of_nothing_is_refused(tmp_path):
    with pytest.raises(ValueError, match=r"\.gif"):
        film(motion(der), tmp_path / "film.avi")
    bare = der.simulate(SCENE, until="snap", configurations=False)
    with pytest.raises(ValueError, match="configurations"):
        film(bare, tmp_path / "film.gif")
    assert not list(tmp_path.iterdir())


def test_frames_for_paraview_are_read_back_with_their_fields(tmp_path):
    index = frames(motion(der), tmp_path / "vtu", count=4)
    told = ElementTree.parse(index).getroot().findall(".//DataSet")
    assert len(told) == 4
    times = [float(each.get("timestep")) for each in told]
    assert times == sorted(times)
    for each in told:
        mesh = meshio.read(index.parent / each.get("file"))
        assert {"kappa1", "kappa2", "tau", "velocity", "energy_density"} <= set(mesh.point_data)
        quads = mesh.cells_dict["quad"]
        a, b, c, d = (mesh.points[quads[:, k]] for k in range(4))
        halves = ((b - a, c - a), (c - a, d - a))
        area = sum(0.5 * np.linalg.norm(np.cross(*sides), axis=1).sum() for sides in halves)
        np.testing.assert_allclose(area, FLAT, rtol=1e-3)


def test_stills_name_the_shapes(tmp_path):
    history = der.simulate(replace(SCENE, rate=2.0), until="snap")
    figure = stills(history, [0.0, float(history.time[-1])])
    assert figure.axes[0].get_title() == "U+S+"
    assert len(figure.axes) == 2
    plt.close(figure)


@pytest.mark.parametrize(("model", "options"), [(der, {"nodes": 51}), (kirchhoff, {"elements": 12})])
@pytest.mark.parametrize("turned", ["left", "right"])
def test_states_of_a_curve_have_a_surface(model, options, turned, tmp_path):
    scene = replace(SCENE, drive=turned, stop=None)
    branch = model.equilibria(scene, span=(-0.2, 0.3), **options)
    strip = of_branch(branch, 9)
    np.testing.assert_allclose(area(strip), FLAT, rtol=1e-3)
    # the clamp that turns is turned by alpha, the other one level
    first, last = (0, -1) if turned == "left" else (-1, 0)
    np.testing.assert_allclose(strip.normal[:, first, 2], np.cos(strip.angle), atol=2e-3)
    np.testing.assert_allclose(strip.normal[:, last, 2], 1.0, atol=2e-3)
    # at rest a curve and a state are one
    start = int(np.flatnonzero(branch.angle == 0.0)[0])
    rest = model.state(scene, **options)
    np.testing.assert_allclose(branch.configurations[start], rest.positions, atol=1e-9)
    if turned == "left" and model is der:
        with Image.open(film(branch, tmp_path / "curve.gif", frames=4)) as picture:
            assert picture.n_frames > 1
        assert frames(branch, tmp_path / "vtu", count=3).exists()


def test_a_curve_without_normals_has_none():
    branch = der.equilibria(replace(SCENE, stop=None), nodes=21, span=(-0.1, 0.1))
    with pytest.raises(ValueError, match="normals"):
        of_branch(replace(branch, normals=None))
