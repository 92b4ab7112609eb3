"""Everything is compiled at once, and what it computes does not depend on which process compiled it."""

import subprocess
import sys

import numba.core.event as ev
import pytest

import compare
from compare import compilation
from compare.sweep.task import edition
from ribbonfem import Scene

# of each kind of model an entry that is compiled anew while others, which share its parts, are loaded
ANEW = {
    "elements in motion": "strains",
    "elastica in motion": "linearised",
    "rods in motion": "solve_refined",
}
# says what jobs compute with code that is loaded, and what they compute with an entry compiled anew
SCRIPT = """
import os, sys
from ribbonfem.jit import cache
read, left = cache.read, []
def without(places, name, made):
    if name.startswith(f"{entry}-"):
        left.append(name)
        return None
    return read(places, name, made)
from compare.compilation import JOBS, digest_of
if not os.fork():
    for job in JOBS:
        print(digest_of(job), flush=True)
    os._exit(0)
assert os.wait()[1] == 0
cache.read, cache.write = without, lambda *_: None
for job, entry in zip(sys.argv[1::2], sys.argv[2::2]):
    entries = len(left)
    print(digest_of(job), len(left) > entries)
"""


@pytest.fixture(scope="module", autouse=True)
def everything():
    """Compiled here: what other files compile of the same kernels then takes half as long."""
    compare.warm(processes=1)


@pytest.fixture(scope="module")
def elsewhere(everything):
    """What another process computes: by job with code that is loaded, and with an entry compiled anew."""
    words = [word for pair in ANEW.items() for word in pair]
    run = subprocess.run([sys.executable, "-c", SCRIPT, *words], capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    lines = run.stdout.splitlines()
    count = len(compilation.JOBS)
    return dict(zip(compilation.JOBS, lines, strict=False)), dict(zip(ANEW, lines[count:], strict=True))


@pytest.mark.parametrize("job", compilation.JOBS)
def test_code_that_is_loaded_computes_what_it_did_where_it_was_compiled(job, elsewhere):
    compiled, written = compilation.done(job)
    if written != edition():
        pytest.skip("compiled before what surrounds the kernels was changed")
    assert compiled == elsewhere[0][job]


@pytest.mark.parametrize("job", ANEW)
def test_an_entry_compiled_anew_changes_no_bit(job, elsewhere):
    assert elsewhere[1][job] == f"{elsewhere[0][job]} True"


def test_nothing_is_left_to_compile():
    scene = Scene(compression=0.40, shear=0.37, start="U+S-", rate=1.0, stop=0.02)
    planar = Scene(compression=0.40, shear=0.0, start="U+", rate=1.0, stop=0.02)
    with ev.install_recorder("numba:compile") as recorder:
        for model in compilation.MODELS.values():
            for method in model.MODEL_INFO.methods:
                fixed = {} if method in model.MODEL_INFO.adaptive else {"step": 1e-3}
                if method != "verlet":
                    model.simulate(planar if model.MODEL_INFO.planar else scene, method=method, **fixed)
            model.folds(planar)
            model.equilibria(planar, span=(-0.1, 0.1))
    compiled = {event.data["dispatcher"].py_func.__qualname__ for _, event in recorder.buffer}
    assert not compiled


def test_there_is_nothing_to_do_a_second_time():
    again = compare.warm()
    assert again.compiled == {}
    assert "nothing" in repr(again)


@pytest.mark.parametrize("processes", [0, -1, 1.5, "two", True])
def test_processes_that_cannot_be_are_refused(processes):
    with pytest.raises(ValueError, match="processes"):
        compare.warm(processes=processes)
