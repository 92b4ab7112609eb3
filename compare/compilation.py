"""Everything compiled, in as many processes as there are cores: for images, clusters, and the first command.

A job calls the functions of a model that share compiled code; what it computes in the process that
compiles is kept beside the code, so that it can be compared with what the code computes when it is loaded.
"""

from __future__ import annotations

import hashlib
import os
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, Future
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from compare.models import MODELS
from compare.sweep import Progress, Sweep
from compare.sweep.pool import WorkerPool, interrupts_held_back, pool_of, result_of
from compare.sweep.pool import alone as no_workers
from compare.sweep.task import edition
from ribbonfem import Scene
from ribbonfem.jit.cache import folders, made_from, read, write

Result = TypeVar("Result")

_PLANAR = Scene(compression=0.30, shear=0.0, start="U+", rate=10.0)
_RIBBON = Scene(compression=0.40, shear=0.40, rate=0.03, damping=0.3)


@dataclass(frozen=True)
class Job:
    """Compiled code that is made together.

    Attributes
    ----------
    kernels: the module whose files it is made from.
    seconds: that compiling takes, about.
    call: computes with it; returns arrays.
    """

    kernels: str
    seconds: float
    call: Callable[[], list[Any]]


def _motion(model: str, scene: Scene, **options: Any) -> list[Any]:
    history = MODELS[model].simulate(replace(scene, stop=0.01), **options)
    return [history.time, history.height, *history.energies.values()]


def _planar_rest() -> list[Any]:
    met = [MODELS[name].folds(_PLANAR, elements=8)[0] for name in ("quasilinear", "elastica")]
    # (its folds are those of its modes)
    curve = MODELS["quasilinear"].equilibria(_PLANAR, elements=8, span=(-0.1, 0.1))
    return [curve.height, *([fold.angle, fold.height, fold.load] for fold in met)]


def _elements_rest() -> list[Any]:
    return [[fold.angle, fold.height, fold.load] for fold in MODELS["kirchhoff"].folds(_RIBBON, elements=8)]


def _rods_rest() -> list[Any]:
    return [[fold.angle, fold.height, fold.load] for fold in MODELS["der"].folds(_RIBBON, nodes=51)]


# those that take longest first
JOBS = {
    "elements in motion": Job(
        "ribbonfem.kirchhoff.kernels.loop", 25.0, lambda: _motion("kirchhoff", _RIBBON, elements=8)
    ),
    "elements that keep energy": Job(
        "ribbonfem.kirchhoff.kernels.loop",
        25.0,
        lambda: _motion("kirchhoff", _RIBBON, elements=8, method="discrete-gradient", step=1e-3),
    ),
    "elastica in motion": Job(
        "ribbonfem.elastica.kernels.loop", 15.0, lambda: _motion("elastica", _PLANAR, elements=8)
    ),
    "elastica that keeps energy": Job(
        "ribbonfem.elastica.kernels.loop",
        15.0,
        lambda: _motion("elastica", _PLANAR, elements=8, method="discrete-gradient", step=1e-3),
    ),
    "beams of small slopes in motion": Job(
        "ribbonfem.quasilinear.kernels.loop", 11.0, lambda: _motion("quasilinear", _PLANAR, elements=8)
    ),
    "rods in motion": Job("der.kernels.loop", 8.0, lambda: _motion("der", _RIBBON, nodes=21)),
    "rods at rest": Job("der.kernels.loop", 6.0, _rods_rest),
    "elements at rest": Job("ribbonfem.kirchhoff.kernels.statics", 6.0, _elements_rest),
    "planar beams at rest": Job("ribbonfem.elastica.kernels.statics", 4.0, _planar_rest),
}


def digest_of(job: str) -> str:
    """Of what a job computes, to the last bit."""
    values = [np.ascontiguousarray(part, dtype=float).tobytes() for part in JOBS[job].call()]
    return hashlib.sha256(b"".join(values)).hexdigest()


def _place(job: str) -> tuple[list[Path], str, bytes]:
    """Where it is noted that a job was done, under which name, and what it depends on."""
    source = Path(str(import_module(JOBS[job].kernels).__file__)).absolute()
    # (what is computed around compiled code differs in its last digits with the kernels that BLAS takes)
    blas = os.environ.get("OPENBLAS_CORETYPE", "").encode()
    made = made_from(JOBS[job].kernels) + _processor() + blas + __loader__.get_data(__file__)  # type: ignore[name-defined]
    return folders(source), f"{job.replace(' ', '-')}.done", made


def _processor() -> bytes:
    from numba.core.registry import cpu_target

    return repr(cpu_target.target_context.codegen().magic_tuple()).encode()


def done(job: str) -> tuple[str, str] | None:
    """The digest of what a job computed in the process that compiled it, and the package's edition then.

    None if none has.
    """
    payload = read(*_place(job))
    return None if payload is None else tuple(payload.decode().split(maxsplit=1))  # type: ignore[return-value]


def make(job: str) -> float:
    """Compile what a job needs, or load it; returns the seconds."""
    begin = time.perf_counter()
    computed = digest_of(job)
    if done(job) is None:
        write(*_place(job), f"{computed} {edition()}".encode())
    return time.perf_counter() - begin


@dataclass(frozen=True)
class Warmed:
    """What `warm` did.

    Attributes
    ----------
    seconds: in all.
    compiled: seconds of each job that was compiled; what had been before is left out.
    folder: where the compiled code of the elements' kernels is kept; "" if nothing can be written.
    """

    seconds: float
    compiled: dict[str, float]
    folder: str

    def __repr__(self) -> str:
        what = ", ".join(self.compiled) or "nothing: all was there"
        return f"Warmed(compiled {what}; {self.seconds:.1f} s; kept in {self.folder or 'no folder'})"


class Background:
    """Other processes: what they compile, and calls that they make after it, in order."""

    def __init__(
        self, pool: WorkerPool | None, processes: int, jobs: Sequence[str], progress: Progress
    ) -> None:
        self._pool, self._progress = pool, progress
        # (a pool is given one call a process at a time: what it has been given cannot be taken back)
        self._free, self._lock = processes, threading.RLock()
        self._waiting: deque[tuple[Future[Any], Callable[[], Any]]] = deque()
        self._jobs = {job: self.begin(make, job) for job in jobs}

    def begin(self, call: Callable[..., Result], *arguments: Any) -> Callable[[], Result]:
        """Have a call of a module's function made there.

        Returns
        -------
        A function that returns its result: waits for it, or makes the call here if it has not begun there.
        """
        made = partial(call, *arguments)
        if self._pool is None:
            return made
        future: Future[Result] = Future()
        self._waiting.append((future, made))
        self._go_on()

        def result() -> Result:
            # of workers that were lost the process that needs it does the work
            with suppress(BrokenExecutor):
                with interrupts_held_back():
                    begun = not future.cancel()
                if begun:
                    return result_of(future)
            return made()

        return result

    def _go_on(self) -> None:
        assert self._pool is not None
        with self._lock:
            while self._free and self._waiting:
                future, call = self._waiting.popleft()
                if not future.set_running_or_notify_cancel():
                    continue
                try:
                    there = self._pool.submit(call)
                except (BrokenExecutor, RuntimeError) as error:
                    future.set_exception(BrokenExecutor(str(error)))
                    continue
                self._free -= 1
                there.add_done_callback(partial(self._ended, future))

    def _ended(self, future: Future[Any], there: Future[Any]) -> None:
        with self._lock:
            self._free += 1
        error = BrokenExecutor("ended") if there.cancelled() else there.exception()
        if error is None:
            future.set_result(there.result())
        else:
            future.set_exception(error)
        self._go_on()

    def wait(self, title: str = "compiling, once") -> None:
        """Until all is compiled; what has not been begun, here."""
        bar = self._progress.bar(title, len(self._jobs), sum(JOBS[job].seconds for job in self._jobs))
        for job in reversed(self._jobs):
            self._jobs[job]()
            bar.advance(JOBS[job].seconds)


@contextmanager
def background(*jobs: str, processes: int, progress: Progress) -> Iterator[Background]:
    """Compile jobs in other processes while this one goes on; leaving it ends them.

    One that is needed here meanwhile is waited for where it is called: no two compile the same.
    """
    if processes < 1 or no_workers():
        yield Background(None, 0, (), progress)
        return
    missing = [job for job in jobs if done(job) is None]
    if missing:
        about = max(
            max(JOBS[job].seconds for job in missing), sum(JOBS[job].seconds for job in missing) / processes
        )
        # (of a quick machine that does nothing else, and of one at half its speed)
        progress.say(f"compiling, once, {about:.0f} to {2 * about:.0f} s: {', '.join(missing)}")
    pool = pool_of(processes)
    try:
        yield Background(pool, processes, missing, progress)
    finally:
        pool.end()


def warm(*, processes: int | None = None, progress: Progress | None = None) -> Warmed:
    """Compile everything that is not compiled yet, each job in a process of its own.

    Parameters
    ----------
    processes: at a time, by default one a processor.
    progress: draws a bar.

    Raises
    ------
    ValueError
        If `processes` is no whole number of at least 1.
    """
    begin = time.perf_counter()
    with Sweep(processes=processes, progress=progress) as sweep:
        missing = [job for job in JOBS if done(job) is None]
        seconds = sweep("compiling", make, missing, cost=lambda job: JOBS[job].seconds)
    places, _, _ = _place("elements in motion")
    kept = next(
        (str(place) for place in places if os.access(place, os.W_OK)), "no folder: none can be written"
    )
    return Warmed(time.perf_counter() - begin, dict(zip(missing, seconds, strict=True)), kept)
