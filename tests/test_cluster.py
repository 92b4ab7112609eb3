"""A sweep on a real Dask scheduler with two workers, one of which is killed."""

import math
import os
import signal
import time

import pytest

from compare.archive import to_bytes
from compare.diagrams import skipping_diagram
from compare.sweep import Sweep, Task
from compare.sweep.cluster import executor_at


@pytest.fixture(scope="module", autouse=True)
def distributed():
    # (imported here: whoever collects the tests needs it not)
    return pytest.importorskip("distributed")


@pytest.fixture(scope="module")
def cluster(distributed):
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address=None, processes=True
    ) as result:
        yield result


def test_a_diagram_on_a_cluster_is_that_of_this_process(cluster):
    options = {"nodes": 31, "samples": 1, "boundaries": False}
    grid = ((0.2, 1.0, 2), (5.0, 30.0, 2))
    with executor_at(cluster.scheduler_address) as executor, Sweep(executor=executor) as sweep:
        there = skipping_diagram(0.40, 0.40, *grid, sweep=sweep, **options)
    here = skipping_diagram(0.40, 0.40, *grid, sweep=Sweep(processes=1), **options)
    assert to_bytes(there) == to_bytes(here)


def test_a_killed_worker_loses_nothing(cluster, tmp_path):
    with executor_at(cluster.scheduler_address) as executor:
        # what it takes is long enough to be killed in
        pids = [executor.submit(os.getpid).result() for _ in range(4)]
        with Sweep(folder=tmp_path, executor=executor) as sweep:
            tasks = [0.2 + 0.001 * k for k in range(12)]
            found = []
            for number, result in sweep.completed("wait", [Task(time.sleep, t) for t in tasks]):
                found.append(number)
                if len(found) == 2:
                    os.kill(pids[0], signal.SIGKILL)
                assert result is None
            assert sorted(found) == list(range(12))
            assert sweep("roots", math.sqrt, [1.0, 4.0, 9.0]) == [1.0, 2.0, 3.0]
    assert len(list(tmp_path.rglob("*.result"))) == 15


def test_no_scheduler_is_told(monkeypatch):
    monkeypatch.setattr("compare.sweep.cluster._PATIENCE", 0.5)
    with pytest.raises(OSError, match=r"127\.0\.0\.1"), executor_at("tcp://127.0.0.1:1"):
        pass
