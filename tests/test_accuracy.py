import inspect
import json

import numpy as np
import pytest

import der
from compare.__main__ import main as command
from compare.quantities import measure as quantities
from compare.report.registry import publish
from compare.studies.accuracy import study as accuracy
from compare.studies.accuracy.cases import CASES, FAMILIES, GROUPS, default_options, entries
from compare.studies.accuracy.fronts import Candidate, distance, front, ranking
from compare.studies.accuracy.references import buckled, reference, small_slopes
from compare.sweep import Sweep
from ribbonfem import Scene, elastica, kirchhoff, quasilinear

REST = Scene(compression=0.40, shear=0.0, start="U+")


def choice(label, seconds, error, default=False, **options):
    errors = {"snap": error, "shape": error}
    return Candidate("dynamic-planar", "elastica", label, options, default, 1, errors, errors, seconds)


@pytest.fixture(scope="module")
def beam(tmp_path_factory):
    out = tmp_path_factory.mktemp("accuracy")
    result = accuracy.main(group="static-planar", model="quasilinear", rounds=1, sweep=Sweep(processes=1))
    return out, publish(accuracy.COMMAND, result, out)[0]


def alone(key):
    result = accuracy.main(row=key, rounds=1, sweep=Sweep(processes=1))
    return accuracy.COMMAND.section(result)


def test_a_small_report(beam):
    out, section = beam
    values = section.values
    json.dumps(values)
    assert {row["family"] for row in values["rows"]} == {"quasilinear"}
    assert all(row["seconds"] > 0.0 and row["dofs"] > 0 for row in values["rows"])
    assert (out / "accuracy-fronts.png").exists()
    assert (out / "accuracy-orders.png").exists()
    (default,) = values["defaults"]
    # what the signature leaves open is told too
    elements = inspect.signature(quasilinear.folds).parameters["elements"].default
    assert default["policy"] == f"elements={elements},degree=18"
    for name, factor in default["distances"].items():
        assert factor >= 0.99, name
    order = next(o for o in values["orders"] if o["quantity"] == "fold")
    assert abs(order["order"] - 4.0) < 0.1
    assert all(ref["verified"] for ref in values["references"].values())


@pytest.mark.parametrize("which", [0, -1])
def test_a_row_computed_alone_is_the_same(beam, which):
    _, section = beam
    record = section.values["rows"][which]
    assert record["command"] == f"ribbonfem accuracy --row {record['key']}"
    single = alone(record["key"])
    assert single.name == "accuracy-row"
    assert single.values["row"]["errors"] == record["errors"]
    assert single.values["row"]["values"] == record["values"]


def test_the_command_of_a_row_runs_and_leaves_the_report(beam, capsys):
    out, section = beam
    before = (out / "accuracy.json").read_bytes()
    record = section.values["rows"][3]
    status = command([*record["command"].split()[1:], "--rounds", "1", "--json", "--out", str(out)])
    assert status == 0
    assert json.loads(capsys.readouterr().out)["row"]["errors"] == record["errors"]
    assert (out / "accuracy.json").read_bytes() == before


def test_a_second_run_is_compared_with_the_first(beam):
    out, _ = beam
    result = accuracy.main(
        group="static-planar",
        model="quasilinear",
        rounds=1,
        orders=False,
        before=out / "accuracy.json",
        sweep=Sweep(processes=1),
    )
    again = accuracy.COMMAND.section(result)
    assert again.values["ranking"]["error_change"] == 0.0
    assert again.values["ranking"]["pairs"] == 55
    assert any("the run before" in line for line in again.text)


def test_a_row_in_motion():
    key = "dynamic-planar/0.40-rate1-nu0.1/quasilinear/elements=16,degree=3,method=tr-bdf2,tolerance=1e-05"
    section = alone(key)
    errors = section.values["row"]["errors"]
    assert set(errors) == {"snap", "shape", "energy", "balance"}
    assert 1e-6 < errors["snap"] < 1e-3
    assert section.values["row"]["steps"] > 50
    assert section.values["reference"]["verified"]


def test_rows_have_names_of_their_own():
    keys = []
    for group in GROUPS:
        for family in (f for f in FAMILIES if group in f.groups and f.model != "kirchhoff"):
            result = entries(group, family)
            cases = sum(case.group == group for case in CASES)
            assert sum(entry.default for entry in result) == cases
            keys += [entry.key for entry in result]
    assert len(set(keys)) == len(keys)
    assert not any(" " in key for key in keys)


def test_defaults_are_those_of_the_models():
    parameters = inspect.signature(der.simulate).parameters
    family = next(f for f in FAMILIES if f.name == "der")
    options = default_options(family, True)
    assert options["nodes"] == parameters["nodes"].default
    assert options["method"] == parameters["method"].default
    assert options["tolerance"] > 0.0
    assert "step" not in options


@pytest.mark.parametrize(
    ("options", "named"),
    [
        ({"group": "static"}, "group = 'static'.*static-planar"),
        ({"model": "beam"}, "model = 'beam'.*kirchhoff"),
        ({"group": "dynamic-ribbon", "model": "elastica"}, "not in the group"),
        ({"row": "static-planar/0.40/elastica/elements=5"}, "row = .*GROUP/CASE/FAMILY/OPTIONS"),
        ({"rounds": 0}, "rounds = 0"),
    ],
)
def test_options_that_cannot_be(options, named):
    with pytest.raises(ValueError, match=named):
        accuracy.main(**options)


def test_front_and_distance():
    result = [
        choice("a", 1.0, 1e-2),
        choice("b", 4.0, 1e-4),
        choice("c", 4.0, 1e-3),
        choice("equal", 5.0, 0.99e-4),
        choice("d", 16.0, 1e-6),
        choice("worse", 20.0, 1e-2),
    ]
    members = front(result, "snap")
    assert [member.label for member in members] == ["a", "b", "d"]
    assert np.isclose(distance(result[1], members, "snap"), 1.0)
    assert distance(result[3], members, "snap") < 1.3
    # half way in log error lies half way in log time
    assert np.isclose(distance(result[2], members, "snap"), 2.0)
    assert np.isclose(distance(result[5], members, "snap"), 20.0)


def test_ranking_counts_what_changed():
    def report(seconds, members):
        rows = [choice(label, s, 1e-3).record() for label, s in zip("abc", seconds, strict=True)]
        fronts = [{"group": "g", "family": "f", "quantity": "snap", "members": members}]
        return {"choices": rows, "fronts": fronts, "rows": []}

    first = report((1.0, 2.0, 2.05), ["a", "b"])
    same = ranking(first, first)
    assert (same.pairs, same.swapped, same.clear, same.front_changed) == (3, 0, 2, 0)
    assert same.correlation == 1.0
    tie = ranking(first, report((1.0, 2.1, 2.05), ["a", "c"]))
    assert (tie.swapped, tie.clear_swapped, tie.front_changed, tie.front_size) == (1, 0, 2, 3)
    other = ranking(first, report((3.0, 2.0, 2.05), ["a", "b"]))
    assert other.clear_swapped == 2
    assert ranking({}, first) is None


def test_closed_forms_of_the_start_state():
    exact = buckled(REST)
    history = elastica.simulate(Scene(compression=0.40, shear=0.0, start="U+", stop=1e-9), elements=48)
    assert abs(history.energies["elastic"][0] - exact.energy) < 1e-8
    assert abs(history.height[0] - exact.height) < 1e-9
    beam = quasilinear.simulate(Scene(compression=0.40, shear=0.0, start="U-", stop=1e-9), elements=64)
    other = small_slopes(Scene(compression=0.40, shear=0.0, start="U-"))
    assert abs(beam.energies["elastic"][0] - other.energy) < 1e-5
    assert abs(beam.height[0] - other.height) < 1e-7
    assert np.allclose(beam.configurations["positions"][0, -1], other.shape.r[-1], atol=1e-6)


def test_references_at_rest_confirm_each_other():
    case = next(c for c in CASES if c.group == "static-planar")
    family = next(f for f in FAMILIES if f.name == "elastica")
    result = reference(case, family)
    assert result.verified
    assert max(result.checks.values()) < 1e-10
    assert abs(result.values["fold"][0] - 1.1230897421) < 1e-9


@pytest.mark.parametrize("model", [der, kirchhoff])
def test_a_timed_call_finds_nothing_kept(model):
    """What a model keeps of an earlier call would make the second of two timed ones free."""
    scene = Scene(compression=0.40, shear=0.37, start="U+S-")
    model.folds(scene)
    # tables of a mesh, of another module, are no part of an answer
    mine = [f for f in vars(model.states).values() if getattr(f, "__module__", "") == model.states.__name__]
    kept = [f for f in mine if hasattr(f, "cache_info")]
    assert any(f.cache_info().currsize for f in kept)
    quantities.forget(model.__name__.rpartition(".")[2])
    assert not any(f.cache_info().currsize for f in kept)
