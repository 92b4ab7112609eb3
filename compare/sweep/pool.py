"""Independent runs on several processes."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from typing import TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")


def _single_threaded() -> None:
    # one process a core is the parallelism there is; threads below it only get in the way
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ[name] = "1"


def in_parallel(call: Callable[[Item], Result], items: Sequence[Item], processes: int) -> Iterator[Result]:
    """Yield call(item) in the order of the items, computed on `processes` processes (1: in this one)."""
    if processes < 1:
        raise ValueError(f"processes = {processes!r}: must be at least 1")
    if processes == 1 or len(items) < 2:
        yield from map(call, items)
        return
    # spawned: a forked child would inherit the locks of threads that it does not have
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(processes, mp_context=context, initializer=_single_threaded) as pool:
        yield from pool.map(call, items)
