import dataclasses
import math
import os
import random
import signal
import subprocess
import sys
import textwrap
import time
from concurrent.futures import ThreadPoolExecutor
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from work import work

from compare import archive
from compare.archive import ArchiveError, from_bytes, to_bytes
from compare.sweep import Failure, Sweep, SweepError, Task, pool
from compare.sweep.store import Store
from ribbonfem import Fold, Ribbon, Scene

ROOT = Path(__file__).parents[1]
# many short runs, in a process that a test can kill
SCRIPT = """
    import sys
    from compare.sweep import Sweep
    from work import work

    with Sweep(folder=sys.argv[1], processes=int(sys.argv[2])) as sweep:
        found = sweep("sines", work, range(40))
    print(sum(found).hex(), flush=True)
"""
SURROUNDING = {**os.environ, "PYTHONPATH": f"{ROOT}{os.pathsep}{ROOT / 'tests'}"}


def start(folder, processes, script=SCRIPT, **more):
    return subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(script), str(folder), str(processes)],
        env=SURROUNDING,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        **more,
    )


def content(folder):
    return {path.name: path.read_bytes() for path in Path(folder).rglob("*.result")}


def children(pid):
    result = []
    for path in Path("/proc").glob("[0-9]*"):
        try:
            if int((path / "stat").read_text().rpartition(")")[2].split()[1]) == pid:
                result.append(int(path.name))
        except OSError:
            continue
    return result


def alive(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


@pytest.mark.parametrize(
    "value",
    [
        {"a": (1, 2.5, float("nan"), float("-inf"), None, True, "ü"), 3: [np.float64(0.1), np.int64(2)]},
        Scene(compression=0.3, shear=-0.1, start="U-S+", rate=-0.2, ribbon=Ribbon(thickness=0.004)),
        (Fold(0.1, 0.2, 0.3), Failure("why")),
        {"x": np.arange(6.0).reshape(2, 3), "y": np.array([True, False]), "z": np.zeros((0, 3))},
    ],
)
def test_an_archive_gives_back_what_it_was_given(value):
    data = to_bytes(value)
    again = from_bytes(data)
    assert to_bytes(again) == data
    if not isinstance(value, dict):
        assert again == value


def test_spoilt_archives_are_told(tmp_path):
    rng = random.Random(1)
    data = to_bytes({"x": np.arange(100.0), "scene": Scene()})
    for _ in range(200):
        spoilt = bytearray(data[: rng.randrange(len(data))])
        with pytest.raises(ArchiveError):
            from_bytes(bytes(spoilt))
    for junk in (b"", b"{}", os.urandom(500), to_bytes([1])[:-1]):
        path = tmp_path / "junk"
        path.write_bytes(junk)
        with pytest.raises(ArchiveError, match="junk"):
            archive.load(path)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("ribbonfem.results:Fold", "ribbonfem.equilibria:Fold"),
        ("ribbonfem.delay.fold:NormalForm", "ribbonfem.delay.normal_forms:NormalForm"),
        ("compare.reproduction.named:Case", "compare.reproduction.named_runs:Case"),
        ("compare.commands.run:Asked", "compare.commands.run:RunResult"),
        ("compare.measures.quantities:Shape", "compare.quantities.measure:Shape"),
    ],
)
def test_records_are_read_by_their_modules_of_the_version_before(old, new):
    module, _, name = new.partition(":")
    fields = dataclasses.fields(getattr(import_module(module), name))
    value = {item.name: 1.0 for item in fields if item.init}
    read = [archive.decode({"!": "record", "type": kind, "value": dict(value)}) for kind in (old, new)]
    assert type(read[0]) is type(read[1])
    assert archive.encode(read[0])["type"] == new


def test_fields_are_read_by_their_names_of_the_version_before():
    value = dict.fromkeys(("other", "value", "doubt", "low", "high", "mesh"), 1.0)
    value |= dict.fromkeys(("along", "below", "above"), "rate")
    boundary = archive.decode({"!": "record", "type": "compare.diagrams.edges:Boundary", "value": value})
    assert boundary.uncertainty == boundary.doubt == 1.0
    assert archive.for_programs(boundary) == value


def test_no_foreign_object_comes_out_of_an_archive():
    for name in ("os:system", "subprocess:Popen", "compare.archive:write_whole", "builtins:dict"):
        with pytest.raises(ArchiveError):
            archive.decode({"!": "record", "type": name, "value": {}})
    with pytest.raises(ArchiveError, match="cannot be kept"):
        to_bytes(object())


def test_results_come_in_the_order_of_the_items():
    with Sweep(processes=2) as sweep:
        # the dearest first, whatever the order of the items
        assert sweep("roots", math.sqrt, [4.0, 9.0, 16.0], cost=lambda x: x) == [2.0, 3.0, 4.0]
    with ThreadPoolExecutor(2) as threads, Sweep(executor=threads) as sweep:
        assert sweep("roots", math.sqrt, range(50)) == [math.sqrt(k) for k in range(50)]


def test_failures_are_recorded_or_end_the_sweep(tmp_path):
    for processes in (1, 2):
        with Sweep(folder=tmp_path / str(processes), processes=processes) as sweep:
            result = sweep("roots", math.sqrt, [4.0, -1.0], failures=(ValueError,))
            assert result[0] == 2.0
            assert isinstance(result[1], Failure)
            assert "domain" in result[1].reason or "nonnegative" in result[1].reason
            with pytest.raises(ValueError, match=r"domain|nonnegative"):
                sweep("roots", math.sqrt, [-2.0, -3.0])


def test_keys_tell_functions_arguments_and_types_apart():
    keys = {
        Task(f, x).key
        for f in (math.sqrt, math.exp)
        for x in (1, 1.0, "1", (1,), [1], None, True, 1.0 + 2**-52)
    }
    assert len(keys) == 16
    assert Task(math.sqrt, 1.0, 5.0).key == Task(math.sqrt, 1.0).key


def test_finished_tasks_are_not_done_again(tmp_path):
    with Sweep(folder=tmp_path, processes=1) as sweep:
        sweep("wait", time.sleep, [0.05, 0.06, 0.07])
        began = time.perf_counter()
        sweep("wait", time.sleep, [0.05, 0.06, 0.07])
        assert time.perf_counter() - began < 0.04


def test_a_file_cut_short_spoilt_or_of_another_task_is_not_believed(tmp_path):
    with Sweep(folder=tmp_path, processes=1) as sweep:
        sweep("roots", math.sqrt, [4.0, 9.0, 16.0, 25.0])
        files = sorted(tmp_path.rglob("*.result"))
        files[0].write_bytes(files[0].read_bytes()[:20])
        files[1].write_bytes(b"\x00" * 300)
        files[2].write_bytes(files[3].read_bytes())
        assert sweep("roots", math.sqrt, [4.0, 9.0, 16.0, 25.0]) == [2.0, 3.0, 4.0, 5.0]


def test_a_worker_killed_is_replaced_and_a_sweep_that_kills_all_gives_up(tmp_path):
    process = start(tmp_path, 2, "import time\n" + textwrap.dedent(SCRIPT))
    killed = 0
    while process.poll() is None and not killed:
        for pid in children(process.pid):
            if len(content(tmp_path)) >= 3 and b"spawn_main" in Path(f"/proc/{pid}/cmdline").read_bytes():
                os.kill(pid, signal.SIGKILL)
                killed = pid
                break
        time.sleep(0.005)
    err = process.communicate()[1]
    assert process.returncode == 0, err
    assert len(content(tmp_path)) == 40
    with Sweep(processes=2) as sweep, pytest.raises(SweepError, match="workers were lost"):
        sweep("end", os._exit, [3, 4, 5])


@pytest.mark.parametrize(
    ("processes", "kills"), [(1, 1), (2, 2), pytest.param(2, 50, marks=pytest.mark.slow)]
)
def test_kills_lose_nothing_and_the_resumed_sweep_is_the_uninterrupted_one(tmp_path, processes, kills):
    with Sweep(folder=tmp_path / "whole", processes=1) as sweep:
        expected = sum(sweep("sines", work, range(40))).hex()
    rng, kept = random.Random(processes), {}
    for _ in range(kills):
        process = start(tmp_path / "killed", processes)
        while process.poll() is None and len(content(tmp_path / "killed")) == len(kept):
            time.sleep(0.005)
        time.sleep(rng.uniform(0.0, 0.02))
        workers = children(process.pid)
        process.kill()
        process.communicate()
        now = content(tmp_path / "killed")
        assert kept.items() <= now.items()
        kept = now
        limit = time.monotonic() + 10.0
        while any(map(alive, workers)) and time.monotonic() < limit:
            time.sleep(0.05)
        assert not any(map(alive, workers))
    last = start(tmp_path / "killed", processes)
    out, err = last.communicate()
    assert out.strip() == expected, err
    assert content(tmp_path / "killed") == content(tmp_path / "whole")


def test_an_interrupt_ends_the_workers(tmp_path):
    process = start(tmp_path, 2, start_new_session=True)
    while not content(tmp_path):
        time.sleep(0.01)
    workers = children(process.pid)
    os.killpg(process.pid, signal.SIGINT)
    process.communicate(timeout=20)
    limit = time.monotonic() + 10.0
    while any(map(alive, workers)) and time.monotonic() < limit:
        time.sleep(0.05)
    assert not any(map(alive, workers))


# an interrupt that comes while a future's lock is taken
LOCKED = """
    import signal
    from concurrent.futures import _base

    # (a job in the background of a shell ignores it)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    enter, rest = _base._AcquireFutures.__enter__, [3]

    def interrupted(self):
        enter(self)
        rest[0] -= 1
        if rest[0] == 0:
            signal.raise_signal(signal.SIGINT)

    _base._AcquireFutures.__enter__ = interrupted
"""


def test_an_interrupt_takes_no_lock_along(tmp_path):
    process = start(tmp_path, 2, textwrap.dedent(LOCKED) + textwrap.dedent(SCRIPT))
    _, told = process.communicate(timeout=60)
    assert process.returncode == -signal.SIGINT
    assert "KeyboardInterrupt" in told


def test_a_folder_that_cannot_be_written_is_told(tmp_path):
    (tmp_path / "file").write_text("in the way")
    with Sweep(folder=tmp_path / "file" / "below", processes=1) as sweep, pytest.raises(NotADirectoryError):
        sweep("roots", math.sqrt, [1.0])


def test_sweeps_from_standard_input_and_without_a_main_guard(tmp_path):
    script = tmp_path / "plain.py"
    script.write_text(textwrap.dedent(SCRIPT))
    for command, text in (([str(script)], None), (["-"], script.read_text())):
        done = subprocess.run(
            # (each its own folder, or there would be nothing left to do for the second)
            [sys.executable, *command, str(tmp_path / str(text is None)), "2"],
            input=text,
            env=SURROUNDING,
            capture_output=True,
            text=True,
        )
        assert done.returncode == 0, done.stderr


def test_processes_are_checked():
    for wrong in (0, -1, 1.5, True, "2"):
        with pytest.raises(ValueError, match="processes"):
            Sweep(processes=wrong)
    assert Store(Path("x")).read("ab") is None


def test_processes_begun_early_serve_who_asks_for_as_many_and_end_otherwise(monkeypatch):
    monkeypatch.setattr(pool, "processors", lambda: 2)
    pool.begin_early("work")
    taken = pool.pool_of(1)
    (worker,) = taken._processes
    assert taken.submit(os.getpid).result(timeout=60) == worker
    taken.end()
    pool.begin_early("work")
    (early,) = pool._early[0]._processes.values()
    other = pool.pool_of(2)
    assert other.size == 2
    assert not early.is_alive()
    pool.begin_early("work")
    (early,) = pool._early[0]._processes.values()
    pool.end_early()
    assert not early.is_alive()
    assert not pool._early
