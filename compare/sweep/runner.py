"""The runner of a sweep: tasks on any executor, the longest first, kept as they finish, resumed."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from pathlib import Path
from typing import Any, TypeVar

from .pool import MOMENT, WorkerPool, alone, interrupts_held_back, processors
from .progress import Progress
from .store import Store
from .task import Failure, Task

Item = TypeVar("Item")
Result = TypeVar("Result")

# how often workers may be lost, without a task finished in between, before a sweep gives up
_LOSSES = 3
# tasks handed to an executor at a time, for each of its workers: enough to keep it busy
_AHEAD = 4


class SweepError(RuntimeError):
    """A sweep that could not go on; what was finished is kept."""


def perform(function: Callable[[Any], Any], argument: Any, expected: tuple[type[Exception], ...]) -> Any:
    """Call a task's function; an expected error becomes a `Failure`."""
    try:
        return function(argument)
    except expected as error:
        return Failure(str(error))


class Sweep:
    """Runs tasks, and brings their results back in the order of the tasks.

    Parameters
    ----------
    folder: keeps one file a finished task, from which a later sweep goes on; None keeps nothing.
    others: folders of other sweeps, whose finished tasks are taken over.
    processes: workers of a pool of its own, by default one a processor; 1 runs everything in this
        process, and so does any number where no workers can be had (in a worker of
        `multiprocessing.Pool`, on a system without shared memory).
    executor: anything with the interface of `concurrent.futures.Executor`, instead of a pool.
    progress: draws bars; by default none.

    A sweep is a context: leaving it ends its workers.
    """

    def __init__(
        self,
        *,
        folder: str | Path | None = None,
        others: Sequence[str | Path] = (),
        processes: int | None = None,
        executor: Executor | None = None,
        progress: Progress | None = None,
    ) -> None:
        if processes is not None and (type(processes) is not int or processes < 1):
            raise ValueError(f"processes = {processes!r}: must be a whole number of at least 1")
        self.store = None if folder is None else Store(Path(folder))
        self.others = tuple(Store(Path(other)) for other in others)
        self.processes = processors() if processes is None else processes
        self.progress = progress or Progress()
        self._given = executor
        self._pool: WorkerPool | None = None

    def __enter__(self) -> Sweep:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End the workers of this sweep's own pool."""
        if self._pool is not None:
            self._pool.end()
            self._pool = None

    def __call__(
        self,
        title: str,
        function: Callable[[Item], Result],
        items: Iterable[Item],
        *,
        cost: Callable[[Item], float] | None = None,
        failures: tuple[type[Exception], ...] = (),
        prepare: Callable[[], object] | None = None,
    ) -> list[Any]:
        """Results of function(item), in the order of the items.

        Parameters
        ----------
        title: of the bar.
        function: of a module; runs anywhere and writes nothing.
        items: arguments, each a record or a tuple of what a record may hold.
        cost: of an item, in any unit: the dearest begin first, and the time left goes by it.
        failures: errors that are recorded as a `Failure` in the result's place; others end the sweep.
        prepare: called once here before any worker starts (compiles what they would all compile).

        Raises
        ------
        SweepError
            If workers are lost again and again.
        """
        tasks = [Task(function, item, 1.0 if cost is None else float(cost(item))) for item in items]
        results: list[Any] = [None] * len(tasks)
        for number, result in self.completed(title, tasks, failures=failures, prepare=prepare):
            results[number] = result
        return results

    def completed(
        self,
        title: str,
        tasks: Sequence[Task],
        *,
        failures: tuple[type[Exception], ...] = (),
        prepare: Callable[[], object] | None = None,
    ) -> Iterator[tuple[int, Any]]:
        """Yield (number, result) as tasks complete: first those that an earlier sweep has finished."""
        keys = [task.key for task in tasks] if self.store or self.others else [""] * len(tasks)
        bar = self.progress.bar(title, len(tasks), sum(task.cost for task in tasks))
        waiting: list[int] = []
        for number, key in enumerate(keys):
            kept = self._kept(key)
            if kept is None:
                waiting.append(number)
            else:
                bar.advance(tasks[number].cost)
                yield number, kept[0]
        if not waiting:
            return
        if prepare is not None:
            prepare()
        # the dearest first, so that no worker sits with a long one when the others are done
        waiting.sort(key=lambda number: -tasks[number].cost)
        here = self._given is None and (self.processes == 1 or len(waiting) == 1 or not self._has_workers())
        finished = self._here(tasks, waiting, failures) if here else self._there(tasks, waiting, failures)
        for number, result in finished:
            if self.store:
                self.store.write(keys[number], result)
            bar.advance(tasks[number].cost)
            yield number, result

    def _kept(self, key: str) -> tuple[Any] | None:
        """The result of a key in a tuple, in the first store that has it."""
        for store in (self.store, *self.others):
            result = store.read(key) if store else None
            if result is not None:
                return result
        return None

    @staticmethod
    def _here(
        tasks: Sequence[Task], waiting: list[int], failures: tuple[type[Exception], ...]
    ) -> Iterator[tuple[int, Any]]:
        for number in waiting:
            yield number, perform(tasks[number].function, tasks[number].argument, failures)

    def _has_workers(self) -> bool:
        """Whether a pool of workers can be had in this process, on this system."""
        if self._pool is not None:
            return True
        if alone():
            return False
        try:
            self._pool = WorkerPool(self.processes)
        except (ImportError, NotImplementedError, OSError) as error:
            # no semaphores, or no shared memory
            self.progress.say(f"no worker processes ({error}): everything runs in this one")
            return False
        return True

    def _executor(self) -> Executor:
        if self._given is not None:
            return self._given
        if self._pool is None:
            self._pool = WorkerPool(self.processes)
        return self._pool

    def _there(
        self, tasks: Sequence[Task], waiting: list[int], failures: tuple[type[Exception], ...]
    ) -> Iterator[tuple[int, Any]]:
        """Tasks on the executor, a few ahead of its workers; those lost with a worker go again."""
        left, running, losses = waiting[::-1], dict[Future[Any], int](), 0
        # an executor that was given does not say how many workers it has: it gets all at once
        ahead = len(left) if self._given is not None else _AHEAD * self.processes
        try:
            while left or running:
                lost, failed = False, None
                finished: list[tuple[int, Any]] = []
                try:
                    with interrupts_held_back():
                        lost = self._round(tasks, left, running, ahead, failures, finished)
                except (Exception, KeyboardInterrupt) as error:
                    failed = error
                # what is finished comes first, and is kept
                for one in finished:
                    losses = 0
                    yield one
                if failed is not None:
                    raise failed
                if lost:
                    left += running.values()
                    running.clear()
                    losses = self._replaced(losses)
        except BaseException:
            # an interrupt, an error of a task, or nobody wants the rest
            for future in running:
                future.cancel()
            self.close()
            raise

    def _round(
        self,
        tasks: Sequence[Task],
        left: list[int],
        running: dict[Future[Any], int],
        ahead: int,
        failures: tuple[type[Exception], ...],
        finished: list[tuple[int, Any]],
    ) -> bool:
        """Hand tasks on, and add what has finished in a moment to `finished`; whether workers were lost."""
        lost = False
        failed: Exception | None = None
        try:
            while left and len(running) < ahead:
                task = tasks[left[-1]]
                future = self._executor().submit(perform, task.function, task.argument, failures)
                running[future] = left.pop()
        except BrokenExecutor:
            lost = True
        for future in wait(running, MOMENT, FIRST_COMPLETED).done if running else ():
            number = running.pop(future)
            try:
                finished.append((number, future.result()))
            except BrokenExecutor:
                left.append(number)
                lost = True
            except Exception as error:
                failed = error
        if failed is not None:
            raise failed
        return lost

    def _replaced(self, losses: int) -> int:
        """Workers anew for those that were lost; how often that was."""
        if self._given is not None or losses + 1 >= _LOSSES:
            raise SweepError(
                f"workers were lost {losses + 1} times without a run finished in between (killed, or out of "
                "memory); what is finished is kept: the same command goes on from there"
            )
        self.close()
        return losses + 1
