"""Compiled code is kept between processes, and made anew when a file that it stands on has changed."""

import ast
import itertools
import json
import os
import subprocess
import sys
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from numba import config, njit
from numba.core.errors import NumbaError

from ribbonfem.jit import decorator, entries, sources
from ribbonfem.jit.decorator import compiled
from ribbonfem.linalg.array_ops import add, copy

ROOT = Path(__file__).parents[1]

KERNELS = sorted(
    ".".join(path.relative_to(ROOT).with_suffix("").parts)
    for package in ("ribbonfem", "der")
    for path in (ROOT / package).rglob("*.py")
    if "@compiled" in path.read_text(encoding="utf-8") and path.name != "decorator.py"
)

CALLEE = """
from ribbonfem.jit.decorator import compiled

@compiled()
def twice(x):
    return {factor} * x
"""
CALLER = """
from ribbonfem.jit.decorator import compiled

from .callee import twice

@compiled()
def called(x):
    return twice(x) + 1.0
"""


def package(folder, **files):
    """A package of the name of ours in front of it, with kernels of its own; the rest is ours."""
    room = folder / "ribbonfem" / "kernels"
    room.mkdir(parents=True, exist_ok=True)
    (room.parent / "__init__.py").write_text(f"__path__.append({str(ROOT / 'ribbonfem')!r})\n")
    for name, text in {"__init__": "", **files}.items():
        (room / f"{name}.py").write_text(text)


# Forks a process for every script, with the compiler loaded and nothing of ours: a second each is saved.
FORKS = """
import json, os, sys, traceback
import numba.core.compiler, numba.core.caching, numba.core.event, numba.extending, numba.np.arrayobj
import numba.core.typing.templates, numpy.linalg
from numba import config, njit
njit("f8(f8)")(lambda x: 2.0 * x)
for line in sys.stdin:
    asked = json.loads(line)
    if isinstance(asked, int):
        print(os.waitstatus_to_exitcode(os.waitpid(asked, 0)[1]), flush=True)
        continue
    process = os.fork()
    if process:
        print(process, flush=True)
        continue
    for stream, name in ((1, "out"), (2, "err")):
        os.dup2(os.open(asked[name], os.O_WRONLY | os.O_CREAT | os.O_TRUNC), stream)
    os.environ.update(asked["environment"])
    os.chdir(asked["folder"])
    sys.path.insert(0, asked["folder"])
    config.reload_config()
    status = 0
    try:
        exec(asked["script"], {"__name__": "__main__"})
    except BaseException:
        traceback.print_exc()
        status = 1
    sys.stdout.flush()
    os._exit(status)
"""


class Forks:
    """Processes that run a script each."""

    def __init__(self):
        self.server = subprocess.Popen(
            [sys.executable, "-c", FORKS], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )

    def ask(self, what):
        self.server.stdin.write(json.dumps(what) + "\n")
        self.server.stdin.flush()
        return int(self.server.stdout.readline())


@pytest.fixture(scope="module")
def forks():
    made = Forks()
    yield made
    made.server.communicate()


@pytest.fixture
def running(forks, tmp_path):
    """Start a process that runs a script with the package; what it said is had by `said`."""
    count = itertools.count()

    def start(script, **environment):
        number = next(count)
        files = {name: str(tmp_path / f"{number}.{name}") for name in ("out", "err")}
        surroundings = {
            "NUMBA_CACHE_DIR": str(tmp_path / "cache"),
            # a second file is of the same length, and perhaps of the same second
            "PYTHONDONTWRITEBYTECODE": "1",
            **environment,
        }
        asked = {"script": script, "folder": str(tmp_path), "environment": surroundings, **files}
        return Running(forks, forks.ask(asked), files)

    return start


@dataclass
class Running:
    forks: Forks
    process: int
    files: dict

    def ended(self):
        """Its status, and what it wrote."""
        status = self.forks.ask(self.process)
        return status, *(Path(self.files[name]).read_text(encoding="utf-8") for name in ("out", "err"))


def said(process):
    status, out, err = process.ended()
    assert status == 0, err
    return out, err


# says the value, and how many functions this process compiled
COUNTED = """
import numba.core.event as ev
with ev.install_recorder("numba:compile") as recorder:
    from ribbonfem.kernels.caller import called
    value = called(1.0)
print(value, sum(event.is_start for _, event in recorder.buffer))
"""


def test_a_change_in_another_file_is_seen(tmp_path, running):
    result = []
    # (of another length: Python itself takes a file of the same size and second for the same)
    for factor in ("2.0", "2.0", "3.25"):
        package(tmp_path, callee=CALLEE.format(factor=factor), caller=CALLER)
        result.append(said(running(COUNTED))[0].split())
    # the entry and its two parts, or nothing
    assert result == [["3.0", "3"], ["3.0", "0"], ["4.25", "3"]]


def test_functions_of_one_name_and_kind_of_arguments_stay_apart(tmp_path, running):
    """One made here and one that was kept, or both kept: the code loaded first does not serve the other."""
    for name, factor in (("one", "2.0"), ("other", "3.0")):
        caller = CALLER.replace(".callee", f".{name}_callee")
        package(tmp_path, **{f"{name}_callee": CALLEE.format(factor=factor), name: caller})
    script = (
        "from ribbonfem.kernels.one import called as one\n"
        "from ribbonfem.kernels.other import called as other\n"
        "print({})"
    )
    for calls in ("one(1.0)", "one(1.0), other(1.0)", "other(1.0), one(1.0)"):
        out, _ = said(running(script.format(calls)))
        assert out.split() == [{"one": "3.0", "other": "4.0"}[call[:-5]] for call in calls.split(", ")]


def test_what_was_kept_of_a_class_that_is_gone_is_made_anew(tmp_path, running):
    """An installation over an older one finds code kept of arguments that it does not have any more."""
    package(
        tmp_path,
        field="from ribbonfem.jit.decorator import compiled\n\n"
        "@compiled()\ndef first(pair):\n    return pair[0]\n",
    )
    pair = "from typing import NamedTuple\n\nclass Pair(NamedTuple):\n    a: float\n    b: float\n"
    (tmp_path / "old.py").write_text(pair)
    for arguments in ("__import__('old').Pair(1.0, 2.0)", "(3.0, 4.0)"):
        script = f"from ribbonfem.kernels.field import first; print(first({arguments}))"
        out, _ = said(running(script))
        (tmp_path / "old.py").unlink(missing_ok=True)
    assert out == "3.0\n"


def spoilt(name, data):
    return {
        "empty": b"",
        "cut": data[: len(data) // 2],
        "a byte short": data[:-1],
        "another byte": data[:-9] + bytes([data[-9] ^ 1]) + data[-8:],
        "of another version": bytes(32) + data[32:],
        "words": b"not what it was",
    }[name]


def test_a_spoilt_file_is_made_anew(tmp_path, running):
    package(tmp_path, callee=CALLEE.format(factor="2.0"), caller=CALLER)
    said(running(COUNTED))
    (file,) = (tmp_path / "cache").rglob("*.nbc")
    whole = file.read_bytes()
    for fault in ("empty", "cut", "a byte short", "another byte", "of another version", "words"):
        file.write_bytes(spoilt(fault, whole))
        assert said(running(COUNTED))[0] == "3.0 3\n", fault
        assert file.stat().st_size == len(whole)
    assert said(running(COUNTED))[0] == "3.0 0\n"


@pytest.mark.parametrize(
    "before",
    [
        # no folder can be made, here nor at home
        {"NUMBA_CACHE_DIR": "/dev/null/here"},
        # little can be written (what is told is): a full disk says so in the middle of a file
        "import resource, signal; signal.signal(signal.SIGXFSZ, signal.SIG_IGN); "
        "resource.setrlimit(resource.RLIMIT_FSIZE, (2000, 2000))",
    ],
    ids=["no folder", "disk full"],
)
@pytest.mark.skipif(os.name != "posix", reason="limits of files are Unix's")
def test_code_that_cannot_be_kept_is_compiled_and_told_once(tmp_path, before, running):
    package(tmp_path, callee=CALLEE.format(factor="2.0"), caller=CALLER)
    script = "from ribbonfem.kernels.caller import called; print(called(1.0), called(1))"
    environment = before if isinstance(before, dict) else {}
    first = "" if environment else before + "\n"
    out, err = said(running(first + script, **environment))
    assert out == "3.0 3.0\n"
    assert err.count("compiled code is not kept") == 1
    assert "NUMBA_CACHE_DIR" in err
    assert not list((tmp_path / "cache").rglob("*.nbc*"))


def test_processes_that_need_the_same_compile_it_once(tmp_path, running):
    package(tmp_path, callee=CALLEE.format(factor="2.0"), caller=CALLER)
    counts = sorted(said(process)[0] for process in [running(COUNTED) for _ in range(4)])
    assert counts == ["3.0 0\n"] * 3 + ["3.0 3\n"]


def test_a_process_that_was_killed_while_it_compiled_stops_nobody(tmp_path, running):
    package(tmp_path, callee=CALLEE.format(factor="2.0"), caller=CALLER)
    process = running(
        "import os\nfrom ribbonfem.jit import cache\n"
        "cache.write = lambda *_: os.kill(os.getpid(), 9)\n" + COUNTED,
    )
    assert process.ended()[0] == -9
    assert said(running(COUNTED))[0] == "3.0 3\n"


@compiled()
def part(x, count):
    return x * count


@compiled()
def entry(x):
    return part(x, 2) + part(x, 3)


@pytest.mark.skipif(decorator.Function is None, reason="another release of the compiler")
def test_what_compiled_code_calls_is_no_entry():
    """On the releases that it was tried with: one part for every constant, and no code of its own."""

    # (what stands inside of another function is never loaded)
    @compiled()
    def inner(x, count):
        return x * count

    @compiled()
    def outer(x):
        return inner(x, 2) + inner(x, 3)

    assert outer(2.0) == 10.0
    assert len(inner.part.overloads) == 1
    assert not inner.overloads
    assert isinstance(next(iter(inner.part.overloads.values())).library, entries.Part)


def test_a_function_is_called_both_ways():
    assert part(3.0, 4) == 12.0
    assert entry(1.0) == 5.0

    @njit
    def foreign(x):
        return entry(x) + part(x, 1)

    # by code that is not ours too
    assert foreign(1.0) == 6.0


def test_with_another_release_of_the_compiler_every_function_is_compiled_its_own_way(tmp_path, running):
    package(tmp_path, callee=CALLEE.format(factor="2.0"), caller=CALLER)
    script = "import numba; numba.__version__ = '99.0'\n" + COUNTED
    assert [said(running(script))[0] for _ in range(2)] == ["3.0 2\n", "3.0 0\n"]


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


def test_without_a_compiler_functions_are_what_they_are(monkeypatch):
    monkeypatch.setattr(config, "DISABLE_JIT", 1)
    assert compiled(inline=True)(len) is len
