"""Results are values: equal and hashed by content, read-only, shown in few lines, as small as their rows."""

import copy
import gc
import importlib
import pickle
import tracemalloc
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import cache

import numpy as np
import pytest

import compare
import der
import ribbonfem
from ribbonfem import Fold, History, Scene, delay, elastica, kirchhoff, quasilinear
from ribbonfem.frozen import Value
from ribbonfem.measured import Measured

PLANAR = Scene(compression=0.4, shear=0.0, start="U+", rate=1.0, stop=0.1)
PATH_2 = Scene(compression=0.4, shear=0.40, start="U+S+", rate=1.0, stop=0.6, damping=10.0)


# computed when the first test asks, and not while tests are collected
RESULTS = {
    "der": lambda: der.simulate(PATH_2, nodes=21),
    "elastica": lambda: elastica.simulate(PLANAR, elements=4),
    "quasilinear": lambda: quasilinear.simulate(PLANAR, elements=4),
    "branch": lambda: kirchhoff.equilibria(PATH_2, elements=8),
    "fold": lambda: der.folds(PATH_2, nodes=21)[0],
    "rest": lambda: kirchhoff.state(PATH_2, elements=8),
    "rods at rest": lambda: der.state(PATH_2, nodes=21),
    "curve": lambda: kirchhoff.shear_curves(0.4, elements=8)[0],
    "pitchforks": lambda: kirchhoff.pitchforks(0.4, elements=8),
    "closed form": lambda: quasilinear.closed_form_branch((-1.0, 2.0)),
    "outcome": lambda: der.modes.classify(result_of("der"), der.folds(PATH_2, nodes=21)),
    "normal form": lambda: elastica.normal_forms(replace(PLANAR, stop=None))[0],
    # mappings of arrays in a tuple
    "fit": lambda: compare.fit(replace(PLANAR, stop=None), Measured(snap=1.32, uncertainty=1e-3)),
    # an infinite error would be the same with one more
    "delay": lambda: replace(delay.predict(delay.NormalForm(1.1, 1e5), 0.1, 1.0), error=0.1),
}
EACH = pytest.mark.parametrize("name", RESULTS)


@cache
def result_of(name):
    return RESULTS[name]()


def arrays_in(value):
    if isinstance(value, np.ndarray):
        yield value
    elif isinstance(value, dict):
        for item in value.values():
            yield from arrays_in(item)
    elif isinstance(value, tuple):
        for item in value:
            yield from arrays_in(item)
    elif is_dataclass(value):
        for item in fields(value):
            yield from arrays_in(getattr(value, item.name))


@EACH
def test_equal_by_content(name):
    result = result_of(name)
    again = RESULTS[name]() if name in ("elastica", "branch") else copy.deepcopy(result)
    for other in (again, pickle.loads(pickle.dumps(result)), copy.copy(result)):
        assert other == result
        assert hash(other) == hash(result)
        assert not list(a for a in arrays_in(other) if a.flags.writeable)
    assert {result, again} == {result}
    assert result != 1
    if hasattr(result, "options"):
        assert result.options is result.options
    for item in fields(result):
        value = getattr(result, item.name)
        if item.name == "seconds":
            # (how long it took is no content)
            continue
        if isinstance(value, float) or (isinstance(value, np.ndarray) and value.size):
            changed = (
                replace(result, **{item.name: value + 1 if value.dtype != bool else ~value})
                if isinstance(value, np.ndarray)
                else replace(result, **{item.name: value + 1.0})
            )
            assert changed != result, item.name


@EACH
def test_read_only(name):
    result = result_of(name)
    for array in arrays_in(result):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0
    for item in fields(result):
        with pytest.raises(AttributeError):
            setattr(result, item.name, 0)
        value = getattr(result, item.name)
        if isinstance(value, dict):
            for change in (lambda v: v.update(a=1), lambda v: v.clear(), lambda v: v.__setitem__("a", 1)):
                with pytest.raises(TypeError, match="read-only"):
                    change(value)


@EACH
def test_shown_in_one_to_three_lines(name):
    for text in (repr(result_of(name)), str(result_of(name))):
        lines = text.splitlines()
        assert 1 <= len(lines) <= 3
        assert max(map(len, lines)) < 240
        assert "array(" not in text
    html = getattr(result_of(name), "_repr_html_", None)
    if name in ("der", "branch"):
        assert html().count("<tr>") == 13


def test_seconds_are_no_content():
    run = result_of("elastica")
    slower = replace(run, stats={**run.stats, "seconds": 1e3})
    assert slower == run
    assert hash(slower) == hash(run)
    assert replace(run, stats={**run.stats, "steps": 3}) != run


def test_numbers_that_are_none_are_the_same():
    time = np.array([0.0, 1.0])
    runs = [History(time, time, np.array([0.0, np.nan]), time, {}, {}, {"a": np.nan}, PLANAR) for _ in "ab"]
    assert runs[0] == runs[1]
    assert hash(runs[0]) == hash(runs[1])
    # what is handed in stays its owner's
    time[0] = 5.0
    assert runs[0].time[0] == 0.0
    assert Fold(0.0, 1.0, 2.0) == Fold(-0.0, 1.0, 2.0)
    assert hash(Fold(0.0, 1.0, 2.0)) == hash(Fold(-0.0, 1.0, 2.0))


@dataclass(frozen=True, eq=False)
class Holder(Value):
    """A result of one field."""

    content: object


def test_read_only_in_every_container_also_behind_a_pickle():
    mine = np.arange(3.0)
    result = Holder({"a": [mine, {"b": (mine[1:],)}], "c": ({"d": mine},)})
    for other in (result, pickle.loads(pickle.dumps(result)), copy.deepcopy(result)):
        arrays = list(arrays_in(other))
        assert len(arrays) == 3
        assert not any(array.flags.writeable for array in arrays)
        assert other == result
    assert mine.flags.writeable


def size(run):
    """Of all arrays of a motion, once each, in bytes."""
    parts = [value for field in fields(run) for value in (getattr(run, field.name),)]
    parts += [item for part in parts if isinstance(part, dict) for item in part.values()]
    arrays = {id(part): part for part in parts if isinstance(part, np.ndarray)}
    return sum(part.nbytes for part in arrays.values())


@pytest.mark.slow
@pytest.mark.parametrize(
    ("model", "options"),
    [
        (der, {"nodes": 21}),
        (der, {"nodes": 21, "configurations": False}),
        (elastica, {"elements": 4}),
        (quasilinear, {"elements": 8}),
    ],
)
@pytest.mark.parametrize("turned", ["left", "right"])
def test_long_motions_peak_little_above_their_size(model, options, turned):
    model.simulate(PLANAR, **options)
    scene = replace(PLANAR, rate=0.01, drive=turned)
    gc.collect()
    tracemalloc.start()
    run = model.simulate(scene, method="implicit-euler", step=10.0 / 200_000, every=1, **options)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert len(run) == 200_001
    assert peak < 1.3 * size(run)


@pytest.mark.parametrize(
    "name", ["ribbonfem", "der", *(f"ribbonfem.{m}" for m in ("elastica", "kirchhoff", "quasilinear"))]
)
def test_packages_show_their_public_names_and_nothing_else(name):
    module = importlib.import_module(name)
    assert dir(module) == sorted(module.__all__)
    for shown in module.__all__:
        assert getattr(module, shown) is not None
    with pytest.raises(AttributeError, match="it has "):
        module.nothing_of_that_name  # noqa: B018
    assert not hasattr(module, "__nothing__")


def test_versions():
    assert ribbonfem.__version__.count(".") == 2
    assert der.__version__ == ribbonfem.__version__
    assert compare is not None
