"""Worker processes that end with their parent and need no main guard in the script that starts them.

loky 3.7 passes the same tests in 30 lines fewer, if its workers too watch their parent; two of its
workers are 4 processes and 106 MB, of these 3 and 84, and a killed parent leaves a warning of semaphores.
joblib is made of it, takes 0.33 s of the processor to import, and is no executor.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import threading
import time
import types
import warnings
from collections.abc import Iterator
from concurrent.futures import Future, ProcessPoolExecutor, wait
from contextlib import contextmanager, suppress
from importlib import import_module
from typing import TypeVar

Result = TypeVar("Result")
# seconds after which a worker notices that its parent is gone, and for which an interrupt is held back
_WATCH, MOMENT = 1.0, 0.2
# what libraries of linear algebra read their number of threads from
_THREADS = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "GOTO_NUM_THREADS",
    "MKL_NUM_THREADS",
    "BLIS_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
)
_one_at_a_time = threading.Lock()
# begun before it was known what for
_early: list[WorkerPool] = []


def processors() -> int:
    """How many processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _end_with(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(_WATCH)
    os._exit(1)


def _begin(parent: int) -> None:
    # an interrupt is the parent's to answer: it ends its workers itself
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with, args=(parent,), daemon=True).start()
    # one process a core is the parallelism there is; threads below it only get in the way.  Read when
    # numpy and scipy load their libraries, which is after this
    os.environ.update(dict.fromkeys(_THREADS, "1"))
    # told once, by the parent
    warnings.filterwarnings("ignore", message="compiled code is not kept")


@contextmanager
def _without_main() -> Iterator[None]:
    """Hide the main module from processes that are spawned meanwhile.

    They would run it again to find the functions that it defines: a script without a main guard would
    start itself over and over, and one from standard input cannot be found at all.  A sweep's functions
    are all in modules that can be imported.  Threads take turns, or one would restore what another hid.
    """
    with _one_at_a_time:
        main = sys.modules["__main__"]
        sys.modules["__main__"] = types.ModuleType("__main__")
        try:
            yield
        finally:
            sys.modules["__main__"] = main


@contextmanager
def interrupts_held_back() -> Iterator[None]:
    """Hold an interrupt back until the end of this context.

    Futures and executors take locks in Python: interrupted just then they would never be let go of, and the
    process could not end.
    """
    came: list[int] = []
    mine = threading.current_thread() is threading.main_thread()
    if not mine or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield
        return
    signal.signal(signal.SIGINT, lambda number, _: came.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    if came:
        raise KeyboardInterrupt


def result_of(future: Future[Result]) -> Result:
    """The result of a future, once it is there; an interrupt comes in between."""
    while True:
        with interrupts_held_back():
            done, _ = wait([future], timeout=MOMENT)
            if done:
                return future.result()


def alone() -> bool:
    """Whether this process may have no workers: it is a worker of a pool that lets it have none."""
    return multiprocessing.current_process().daemon


class WorkerPool(ProcessPoolExecutor):
    """Spawned processes (a forked child would inherit the locks of threads that it does not have)."""

    def __init__(self, processes: int) -> None:
        context = multiprocessing.get_context("spawn")
        super().__init__(processes, mp_context=context, initializer=_begin, initargs=(os.getpid(),))
        self.size = processes

    def submit(self, *call, **more):  # type: ignore[no-untyped-def]
        """As any executor's; processes are spawned here, as they are needed."""
        with _without_main():
            return super().submit(*call, **more)

    def end(self) -> None:
        """Stop at once, whatever is running."""
        with interrupts_held_back():
            workers = list((self._processes or {}).values())
            self.shutdown(wait=False, cancel_futures=True)
            for worker in workers:
                worker.terminate()
            for worker in workers:
                worker.join(timeout=5.0)
                if worker.is_alive():
                    worker.kill()


def _load(module: str) -> None:
    import_module(module)


def begin_early(module: str) -> None:
    """Start processes that import a module while this one does: as many as work beside it."""
    if alone() or processors() == 1:
        return
    # where there can be none, it is told when they are needed
    with suppress(OSError, RuntimeError):
        pool = WorkerPool(processors() - 1)
        for _ in range(pool.size):
            pool.submit(_load, module)
        _early.append(pool)


def pool_of(processes: int) -> WorkerPool:
    """A pool of so many processes: one that was begun early, or a new one."""
    while _early:
        pool = _early.pop()
        if pool.size == processes:
            return pool
        pool.end()
    return WorkerPool(processes)


def end_early() -> None:
    """End processes that were begun early and were not needed."""
    while _early:
        _early.pop().end()
