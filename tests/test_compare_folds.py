"""Folds and states at rest in both models: agreement within error estimates, bound, phases, figures."""

import json
from dataclasses import replace

import numpy as np
import pytest

import der
from compare.report.folder import PAGE
from compare.report.registry import publish
from compare.reproduction import sheared
from compare.reproduction.folds import command as folds
from compare.reproduction.folds import shear_section
from compare.sweep import Sweep
from ribbonfem import Fold, Scene, SolverError, kirchhoff
from ribbonfem.output.style import STYLE

SKIPPED = Scene(compression=0.35, shear=0.40)


@pytest.fixture(scope="module")
def section(tmp_path_factory):
    """The whole command, on small meshes and grids and on some of its scenes."""
    out = tmp_path_factory.mktemp("report")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(folds, "SCENES", tuple(folds.SCENES[k] for k in (1, 2, 3, 4)))
        patch.setattr(folds, "REFINED", folds.REFINED[:1])
        patch.setattr(folds, "FINEST", 20)
        patch.setattr(folds, "BOUND_SCENES", (Scene(shear=0.37), Scene(shear=0.40), SKIPPED))
        patch.setattr(sheared, "RODS_EVERY", 0.12)
        patch.setattr(shear_section, "MAPPED", (0.10, 0.20))
        patch.setattr(shear_section, "LINES", (0.1, 0.2, 0.4, 0.65))
        patch.setattr(shear_section, "COMPRESSIONS", (0.4,))
        patch.setattr(shear_section, "TABULATED", (0.40, 0.60))
        patch.setitem(STYLE, "figure.constrained_layout.use", False)
        result = folds.main(
            elements=12,
            nodes=(51, 71, 101),
            swept=(0.37, 0.40),
            meshes=(6, 8, 10),
            columns=2,
            rows=3,
            phase_step=0.2,
            sweep=Sweep(processes=1),
        )
        made, _ = publish(folds.COMMAND, result, out)
    return made, out


def test_limits_of_rods_are_the_extensible_elements(section):
    records = section[0].values["folds"]
    assert len(records) == 1 + 1 + 2 * 2
    for record in records:
        # coarse rods: the error of the extrapolation is some l^6, and its last step bounds it
        assert abs(record["difference"]) < min(1e-6, max(0.5 * record["limit_doubt"], 2e-7)), record
        assert record["order"] == pytest.approx(2.0, abs=0.06), record
        assert abs(record["height_difference"]) < 2e-6, record
        # what EA changes is far above these errors, so that agreement is with the right one
        assert 1e-4 < abs(record["kirchhoff"] - record["kirchhoff_extensible"]) < 2e-3


def test_folds_of_the_two_paths_are_those_of_one_curve(section):
    angle = {(r["scene"], r["fold"]): r["kirchhoff"] for r in section[0].values["folds"]}
    assert angle["(0.40, 0.37) Path 1", 1] == pytest.approx(angle["(0.40, 0.37) Path 2", 2], abs=1e-10)
    assert angle["(0.40, 0.40) Path 2", 1] == pytest.approx(0.1607329979, abs=1e-8)
    assert angle["(0.40, 0.40) Path 2", 2] == pytest.approx(0.4458846258, abs=1e-8)
    assert angle["planar 0.40", 1] == pytest.approx(1.1230897421, abs=1e-8)


def test_mesh_table_has_high_order(section):
    for record in section[0].values["meshes"]:
        if record["elements"] == 10:
            assert max(map(abs, record["errors"])) < 5e-8
            assert min(record["orders"]) > 6.0


def test_critical_angles_move_as_in_the_paper(section):
    records = section[0].values["sweeps"]
    by = {(r["compression"], r["shear"]): r for r in records}
    first = {key: r["alpha_c1"]["kirchhoff"] for key, r in by.items()}
    second = {key: r["alpha_c2"]["kirchhoff"] for key, r in by.items()}
    assert first[0.37, 0.37] > first[0.40, 0.37]
    assert second[0.37, 0.37] < second[0.40, 0.37]
    assert first[0.40, 0.37] < first[0.40, 0.40]
    assert second[0.40, 0.37] > second[0.40, 0.40]
    for record in records:
        for fold in ("alpha_c1", "alpha_c2"):
            # free of l^2 only: l^4 is left
            assert abs(record[fold]["difference"]) < 1e-5


@pytest.mark.parametrize(
    ("compression", "shear", "expected"), [(0.40, 0.37, -2.28), (0.40, 0.40, 0.55), (0.35, 0.40, 2.60)]
)
def test_bound_has_its_sign_and_value_in_both_models(section, compression, shear, expected):
    record = next(
        r for r in section[0].values["bounds"] if (r["compression"], r["shear"]) == (compression, shear)
    )
    assert record["kirchhoff"] == pytest.approx(expected, abs=0.006)
    assert record["difference"] == pytest.approx(0.0, abs=5e-4)
    # a coarse rod is off by a hundred times more
    assert abs(record["rods"][0] - record["kirchhoff_extensible"]) > 0.05


def test_rod_bound_needs_a_saddle():
    with pytest.raises(SolverError, match="no saddle"):
        der.skipping_bound(replace(SKIPPED, shear=0.43), nodes=31)


def test_map_of_the_bound_is_that_of_single_scenes(section):
    for column in section[0].values["bound_map"]:
        assert column["broken"] < column["zero"] < column["gone"] < column["merged"]
        assert np.all(np.diff(column["bounds"]) > 0)
        compression = column["compression"]
        scene = Scene(compression=compression, shear=column["shears"][1])
        assert column["bounds"][1] == pytest.approx(kirchhoff.skipping_bound(scene, elements=16), abs=1e-4)
        # on the dashed line of the map the two folds are at one angle
        for off, order in ((-2e-3, 1.0), (2e-3, -1.0)):
            near = Scene(compression=compression, shear=column["gone"] + off)
            one = kirchhoff.folds(near, elements=10)[0].angle
            two = kirchhoff.folds(replace(near, start="U+S-"), elements=10)[0].angle
            assert order * (two - one) > 0.0


def test_phases_agree(section):
    records = section[0].values["phases"]
    assert {r["kirchhoff"] for r in records} == {"U", "US", "S", "S, U"}
    assert all(r["kirchhoff"] == r["der"] for r in records)
    forks = {p["compression"]: p for p in section[0].values["pitchforks"]}
    for record in records:
        p = forks.get(record["compression"])
        if p is None:
            continue
        place = sum(record["shear"] > p[name] for name in ("broken", "merged", "restored"))
        assert record["kirchhoff"] == ("U", "US", "S", "S, U")[place]


def test_phase_names():
    assert sheared.phase(["U+", "U-"]) == "U"
    assert sheared.phase(("U+S+", "U+S-", "U-S+", "U-S-")) == "US"
    assert sheared.phase(["S+", "U-", "U+", "S-"]) == "S, U"


def test_rods_curvatures_tend_to_those_of_the_elements():
    scene = Scene(compression=0.40, shear=0.37, start="U+S-")
    state = kirchhoff.state(scene, elements=24, extensible=True)
    order = np.argsort(state.points)
    errors = {}
    for nodes in (31, 61):
        rod = der.state(scene, nodes=nodes)
        for name in ("kappa1", "kappa2", "tau"):
            values = getattr(rod, name)
            line = np.interp(rod.points, state.points[order], getattr(state, name)[order])
            errors[name, nodes] = np.sqrt(np.mean((values - line) ** 2)) / np.abs(line).max()
    for name in ("kappa1", "kappa2", "tau"):
        assert errors[name, 61] < 4e-3, errors
        # of order 2: (59 / 29)^2 = 4.1
        assert 3.0 < errors[name, 31] / errors[name, 61] < 5.5, errors


def test_limits_and_orders_of_made_up_values():
    nodes = (51, 101, 201)
    lengths = tuple(1.0 / (n - 2) for n in nodes)
    made = tuple(Fold(0.3 + 5 * h**2 + 40 * h**4, 0.1 - h**2, 50.0) for h in lengths)
    limit, uncertainty = folds.limit_of(made, nodes)
    assert limit.angle == pytest.approx(0.3, abs=1e-14)
    assert limit.height == pytest.approx(0.1, abs=1e-14)
    # what two meshes leave, 40 l^2 l'^2
    assert uncertainty == pytest.approx(40 * lengths[1] ** 2 * lengths[2] ** 2, rel=1e-3)
    for order in (1.0, 2.0, 3.0):
        values = tuple(0.3 + 5 * h**order for h in lengths)
        assert folds.observed_order(values, lengths) == pytest.approx(order, abs=1e-6)
    assert folds.observed_order((1.0, 1.2, 1.1), lengths) is None


def test_report_has_its_pictures_and_plain_values(section):
    made, out = section
    assert len(made.pictures) == 5
    for picture in made.pictures:
        assert (out / picture.file).stat().st_size > 20_000
    for table in made.tables:
        assert all(len(row) == len(table.columns) for row in table.cells())
    json.dumps(made.values)
    assert (out / PAGE).read_text(encoding="utf-8").count("data:image/png;base64,") == 5


@pytest.mark.parametrize("options", [{"nodes": (51, 101)}, {"columns": 1}, {"phase_step": 0.0}])
def test_refusals(options):
    with pytest.raises(ValueError, match=next(iter(options))):
        folds.main(**options)
