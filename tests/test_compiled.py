"""Compiled code is kept between processes, and made anew when a file that it stands on has changed."""

import ast
import os
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from numba.core.errors import NumbaError

from ribbonfem.compiled import decorator, sources
from ribbonfem.compiled.copies import add, copy

ROOT = Path(__file__).parents[1]

KERNELS = sorted(
    ".".join(path.relative_to(ROOT).with_suffix("").parts)
    for package in ("ribbonfem", "der")
    for path in (ROOT / package).rglob("*.py")
    if "@compiled" in path.read_text(encoding="utf-8") and path.name != "decorator.py"
)

CALLEE = """
from ribbonfem.compiled.decorator import compiled

@compiled()
def twice(x):
    return {factor} * x
"""
CALLER = """
from ribbonfem.compiled.decorator import compiled

from .callee import twice

@compiled()
def called(x):
    return twice(x) + 1.0
"""


def test_a_change_in_another_file_is_seen(tmp_path):
    # a package of the name of ours in front of it, which looks for everything else there
    room = tmp_path / "ribbonfem" / "kernels"
    room.mkdir(parents=True)
    (room.parent / "__init__.py").write_text(f"__path__.append({str(ROOT / 'ribbonfem')!r})\n")
    (room / "__init__.py").write_text("")
    (room / "caller.py").write_text(CALLER)
    script = (
        "from ribbonfem.kernels.caller import called; "
        "print(called(1.0), sum(called.stats.cache_hits.values()))"
    )
    environment = {
        **os.environ,
        "PYTHONPATH": str(tmp_path),
        "NUMBA_CACHE_DIR": str(tmp_path / "cache"),
        # the second file is of the same length, and perhaps of the same second
        "PYTHONDONTWRITEBYTECODE": "1",
    }
    said = []
    for factor in ("2.0", "2.0", "3.0"):
        (room / "callee.py").write_text(CALLEE.format(factor=factor))
        run = subprocess.run(
            [sys.executable, "-c", script], env=environment, cwd=tmp_path, capture_output=True, text=True
        )
        assert run.returncode == 0, run.stderr
        said.append(run.stdout.split())
    assert said == [["3.0", "0"], ["3.0", "1"], ["4.0", "0"]]


def test_what_was_kept_of_a_class_that_is_gone_is_made_anew(tmp_path):
    """An installation over an older one finds code kept of arguments that it does not have any more."""
    room = tmp_path / "ribbonfem" / "kernels"
    room.mkdir(parents=True)
    (room.parent / "__init__.py").write_text(f"__path__.append({str(ROOT / 'ribbonfem')!r})\n")
    (room / "__init__.py").write_text("")
    (room / "field.py").write_text(
        "from ribbonfem.compiled.decorator import compiled\n\n"
        "@compiled()\ndef first(pair):\n    return pair[0]\n"
    )
    pair = "from typing import NamedTuple\n\nclass Pair(NamedTuple):\n    a: float\n    b: float\n"
    (tmp_path / "old.py").write_text(pair)
    environment = {
        **os.environ,
        "PYTHONPATH": str(tmp_path),
        "NUMBA_CACHE_DIR": str(tmp_path / "cache"),
        "PYTHONDONTWRITEBYTECODE": "1",
    }
    for arguments in ("__import__('old').Pair(1.0, 2.0)", "(3.0, 4.0)"):
        script = f"from ribbonfem.kernels.field import first; print(first({arguments}))"
        run = subprocess.run(
            [sys.executable, "-c", script], env=environment, cwd=tmp_path, capture_output=True, text=True
        )
        assert run.returncode == 0, run.stderr
        (tmp_path / "old.py").unlink(missing_ok=True)
    assert run.stdout == "3.0\n"


@pytest.mark.parametrize("module", KERNELS)
def test_what_compiled_code_takes_comes_from_files_of_kernels(module):
    """A constant from another file would be frozen into the code that is kept, and not be in its key."""
    tree = ast.parse(Path(import_module(module).__file__).read_text(encoding="utf-8"))
    taken = {}
    for statement in tree.body:
        if isinstance(statement, ast.ImportFrom):
            package = module.split(".")[: -statement.level] if statement.level else []
            place = ".".join([*package, *([statement.module] if statement.module else [])])
            for name in statement.names:
                taken[name.asname or name.name] = place
    inside = set()
    for statement in tree.body:
        if isinstance(statement, ast.FunctionDef) and any(
            "compiled" in ast.unparse(mark) for mark in statement.decorator_list
        ):
            inside |= {
                node.id for part in statement.body for node in ast.walk(part) if isinstance(node, ast.Name)
            }
    foreign = {name: place for name, place in taken.items() if name in inside}
    for name, place in foreign.items():
        if place.split(".")[0] in ("ribbonfem", "der"):
            assert sources.is_kernels(place) or sources.is_kernels(f"{place}.{name}"), (name, place)


def test_what_does_not_say_that_it_allocates_cannot():
    """The hot loops: an array made in one by mistake is an error of compilation, not a slower loop."""

    @decorator.compiled(allocates=True)
    def doubled(x):
        return (2.0 * x).sum()

    @decorator.compiled()
    def tripled(x):
        return (3.0 * x).sum()

    x = np.arange(3.0)
    assert doubled(x) == 6.0
    with pytest.raises(NumbaError, match="NRT required"):
        tripled(x)


def test_copies_and_sums_take_the_entries_of_parts_of_arrays_too():
    source, target = np.arange(24.0).reshape(2, 3, 4), np.zeros((5, 3, 4))
    copy(source[1], target[2])
    assert np.array_equal(target[2], source[1])
    add(source[0], -2.0, target[2])
    assert np.array_equal(target[2], source[1] - 2.0 * source[0])
    assert not target[[0, 1, 3, 4]].any()


def test_a_compiler_that_does_not_say_what_it_keeps_keeps_nothing(monkeypatch):
    class Other:
        py_func = None

    def njit(cache=False, **_):
        return lambda function: Other() if cache else function

    monkeypatch.setattr(decorator, "njit", njit)
    decorator._warn_once.cache_clear()
    with pytest.warns(RuntimeWarning, match="numba"):
        assert decorator.compiled()(len) is len


def test_without_a_compiler_functions_are_what_they_are(monkeypatch):
    monkeypatch.setattr(decorator, "njit", lambda **_: lambda function: function)
    assert decorator.compiled(error_model="numpy")(len) is len
