"""What results show of themselves: plots, tables of other programs, tables for notebooks."""

import subprocess
import sys
from dataclasses import replace
from functools import cache
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest

import compare
import der
from compare.diagrams.result import Diagram
from ribbonfem import Fold, Scene, elastica, kirchhoff
from ribbonfem.output.surface import area, of_rest

PLANAR = Scene(compression=0.4, shear=0.0, start="U+", rate=1.0, stop=0.1)
SHEARED = Scene(compression=0.4, shear=0.40, rate=1.0, stop=0.2, damping=10.0)
ROOT = Path(__file__).parents[1]


@cache
def result_of(name):
    if name == "history":
        return der.simulate(SHEARED, nodes=21)
    if name == "other history":
        return kirchhoff.simulate(SHEARED, elements=4)
    if name == "planar history":
        return elastica.simulate(PLANAR, elements=4)
    if name == "fold":
        return elastica.folds(replace(PLANAR, stop=None), elements=4)[0]
    if name == "branch":
        return elastica.equilibria(PLANAR, elements=4)
    if name == "rest":
        return kirchhoff.state(SHEARED, elements=8)
    if name == "convergence":
        return compare.convergence(elastica, PLANAR, "height", over={"elements": (4, 8, 16)}, step=1e-2)
    return diagram()


def diagram():
    shares = np.array([[[1.0, 0.0], [0.5, 0.5]], [[0.0, 1.0], [0.0, 1.0]]])
    return Diagram(
        kind="skipping",
        x=np.array([0.01, 0.1]),
        y=np.array([1.0, 10.0]),
        outcomes=("no skip", "type 2"),
        shares=shares,
        uncertainty=np.full((2, 2), 0.1),
        runs=np.full((2, 2), 4),
        outcome=np.array([["no skip", "mixed"], ["type 2", "type 2"]]),
        failed=(),
        boundaries=(),
        samples=(),
        folds=(0.1, 0.5),
        predicted={},
        scene=SHEARED,
        model="der",
        options={},
        seed=0,
    )


EACH = ("history", "other history", "planar history", "branch", "rest", "convergence", "diagram")


@pytest.mark.parametrize("name", EACH)
def test_a_result_draws_itself(name):
    result = result_of(name)
    axes = result.plot()
    assert axes.get_xlabel()
    assert axes.get_ylabel()
    assert axes.has_data()
    if name != "rest":
        again = plt.figure().add_subplot()
        assert result.plot(again) is again
    plt.close("all")


def test_a_plot_shows_the_numbers_of_its_result():
    history, branch = result_of("history"), result_of("branch")
    (line,) = history.plot(color="black").lines
    np.testing.assert_array_equal(line.get_xydata(), np.column_stack((history.angle, history.height)))
    axes = result_of("planar history").plot(curve=branch)
    assert {line.get_linestyle() for line in axes.lines} == {"-", "--"}
    dots = branch.plot().lines[-1].get_xydata()
    np.testing.assert_allclose(dots, [(fold.angle, fold.height) for fold in branch.folds])
    with pytest.raises(ValueError, match="three dimensions"):
        result_of("rest").plot(plt.figure().add_subplot())
    plt.close("all")


@pytest.mark.parametrize("model", [der, kirchhoff], ids=["der", "kirchhoff"])
def test_a_state_at_rest_is_a_surface_of_the_ribbon(model):
    state = model.state(SHEARED, **({"nodes": 51} if model is der else {"elements": 8}))
    strip = of_rest(state)
    np.testing.assert_allclose(area(strip), SHEARED.ribbon.width / SHEARED.ribbon.length, rtol=1e-3)
    middle = strip.centre[0, strip.centre.shape[1] // 2]
    assert middle[2] == pytest.approx(state.height, abs=1e-5)
    # the two clamps are level, and their normals up
    np.testing.assert_allclose(strip.normal[0, [0, -1], 2], 1.0, atol=1e-3)


@pytest.mark.parametrize("name", [*EACH, "fold"])
def test_a_notebook_gets_a_short_table(name):
    text = result_of(name)._repr_html_()
    assert text.startswith("<table>")
    assert 2 <= text.count("<tr>") <= 14
    assert len(text) < 6000
    if name not in ("rest", "diagram"):
        # what scene it is of
        assert f"{result_of(name).scene.rate:g} rad/s" in text


def test_a_table_tells_the_folds_the_rows_and_the_snap():
    branch, history = result_of("branch"), result_of("history")
    text = branch._repr_html_()
    assert text.count("<td>fold</td>") == len(branch.folds) > 0
    assert f"<td>{branch.folds[0].angle:.6g}</td>" in text
    assert f"{len(branch)} points" in text
    text = history._repr_html_()
    assert f"{len(history)} rows" in text
    assert "no snap" in text


def test_a_fold_is_read_at_a_glance():
    fold = result_of("fold")
    assert repr(fold).startswith(f"Fold(alpha {fold.angle:.9g} rad, z(1/2) {fold.height:.9g} L, load ")
    assert "elastica; elements=4, extensible=False" in repr(fold)
    assert repr(Fold(1.0, 0.5, 2.0)) == "Fold(alpha 1 rad, z(1/2) 0.5 L, load 2 EI2/L^2)"
    assert Fold(1.0, 0.5, 2.0)._repr_html_().count("<tr>") == 2


def test_a_motion_is_a_data_frame_with_units():
    pytest.importorskip("pandas")
    for name in ("history", "other history", "planar history"):
        history = result_of(name)
        frame = history.to_pandas()
        states = ["time", "angle", "height", "slope", "load", "velocity"]
        clamps = [
            f"{what}_{clamp}_{axis}"
            for what in ("force", "moment")
            for clamp in ("left", "right")
            for axis in "xyz"
        ]
        assert list(frame.columns) == states + list(history.energies) + clamps
        assert len(frame) == len(history)
        np.testing.assert_array_equal(frame["height"], history.height)
        assert frame.attrs["units"] | {"time": "s", "angle": "rad", "work": "EI2/L"} == frame.attrs["units"]
        assert set(frame.attrs["units"]) == set(frame.columns)
        assert frame.attrs["model"] == history.model


def test_a_branch_is_a_data_frame_with_units():
    pytest.importorskip("pandas")
    branch = result_of("branch")
    frame = branch.to_pandas()
    assert list(frame.columns) == ["angle", "height", "slope", "load", "energy", "stable"]
    assert frame["stable"].dtype == bool
    assert frame.attrs["folds"] == [fold.angle for fold in branch.folds]
    assert set(frame.attrs["units"]) == set(frame.columns)
    # what is changed in a table is not changed in the result
    frame.loc[0, "height"] = 9.0
    assert branch.height[0] != 9.0


def test_a_refinement_is_a_data_frame():
    pytest.importorskip("pandas")
    refined = result_of("convergence")
    frame = refined.to_pandas()
    assert list(frame.columns) == ["elements", "size", "dofs", "value", "error", "order", "seconds"]
    np.testing.assert_array_equal(frame["elements"], (4, 8, 16))
    np.testing.assert_array_equal(frame["error"], refined.errors)
    assert frame["order"].isna().tolist()[:2] == [True, True]
    np.testing.assert_array_equal(frame["order"][2:], refined.orders)
    assert frame.attrs["limit"] == refined.limit
    assert frame.attrs["units"] == {"size": "L", "seconds": "s"}


def test_a_refinement_of_shapes_has_no_column_of_values():
    pytest.importorskip("pandas")
    refined = compare.convergence(elastica, PLANAR, "shape", over={"elements": (4, 8, 16)}, step=1e-2)
    frame = refined.to_pandas()
    assert "value" not in frame.columns
    assert np.shape(frame.attrs["limit"]) == refined.limit.shape


def test_a_diagram_is_a_tidy_data_frame():
    pytest.importorskip("pandas")
    made = result_of("diagram")
    frame = made.to_pandas()
    assert list(frame.columns) == ["rate", "damping", "outcome", "share", "cell", "runs", "doubt"]
    assert len(frame) == made.shares.size
    for j, damping in enumerate(made.dampings):
        for i, rate in enumerate(made.rates):
            rows = frame[(frame["rate"] == rate) & (frame["damping"] == damping)]
            assert dict(zip(rows["outcome"], rows["share"], strict=True)) == dict(
                zip(made.outcomes, made.shares[j, i], strict=True)
            )
            assert set(rows["cell"]) == {made.outcome[j, i]}
    # the same rows as the CSV
    assert made.to_csv().count("\n") == len(frame) + 1
    assert frame.attrs["units"] == {"rate": "rad/s", "damping": "1/s"}


def test_results_are_data_sets_with_units(tmp_path):
    pytest.importorskip("xarray")
    for name in ("history", "other history", "planar history"):
        history = result_of(name)
        data = history.to_xarray()
        assert data["positions"].dims == ("time", "node", "axis")
        assert data["positions"].shape == history.configurations["positions"].shape
        assert set(history.configurations) <= set(data)
        assert data["force"].dims == data["moment"].dims == ("time", "clamp", "axis")
        np.testing.assert_array_equal(data["time"], history.time)
        np.testing.assert_array_equal(data["s"], history.arclength)
        units = {key: data[key].attrs["units"] for key in ("time", "angle", "positions", "kinetic", "s")}
        assert units == {"time": "s", "angle": "rad", "positions": "L", "kinetic": "EI2/L", "s": "L"}
        assert data.attrs["model"] == history.model
    branch = result_of("branch")
    data = branch.to_xarray()
    assert data["positions"].shape == branch.configurations.shape
    assert data["height"].dims == ("row",)
    assert data.attrs["folds"] == [fold.angle for fold in branch.folds]


@pytest.mark.parametrize(("method", "library"), [("to_pandas", "pandas"), ("to_xarray", "xarray")])
def test_a_library_that_is_missing_is_named_with_what_to_install(monkeypatch, method, library):
    monkeypatch.setitem(sys.modules, library, None)
    for name in ("history", "branch", "convergence", "diagram"):
        if not hasattr(result_of(name), method):
            continue
        with pytest.raises(ImportError, match=rf"{method} needs {library}.*pip install {library}"):
            getattr(result_of(name), method)()


def test_results_draw_themselves_without_compare_and_import_what_they_need_when_called():
    tried = (
        "import sys; from ribbonfem import History; assert History.plot and History.to_xarray; "
        "import compare; "
        "assert not {'matplotlib', 'pandas', 'xarray', 'compare.archive'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", tried], cwd=ROOT, check=True)
    light = "import sys; import compare; assert 'numpy' not in sys.modules"
    subprocess.run([sys.executable, "-c", light], cwd=ROOT, check=True)
