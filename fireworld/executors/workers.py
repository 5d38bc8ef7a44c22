"""Workers: who does a list of tasks, in threads of this process or elsewhere."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ThreadPoolExecutor, wait
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field
from threading import Event
from typing import Any, Final, TypeVar

from fireworld.errors import FireworldError

Result = TypeVar("Result")
OnResult = Callable[[int, Any], object]

LOOK_EVERY_SECONDS: Final = 0.2
"""How long Ctrl-C waits at most until it is seen."""


class ExecutorError(FireworldError):
    """An executor that cannot do the work it was given."""


@dataclass(frozen=True)
class Unfinished:
    """A result of a task that is not done: `rest` is the task that continues it."""

    part: Any
    rest: Callable[[], Any]


@dataclass(frozen=True)
class Workers:
    """Workers that share a list of tasks and stop together. Made by `threads`, `processes`, `given` or `workers_for`.

    Attributes:
        n: tasks at a time.
        stop: set it, and no further task begins; tasks that run in threads may look at it too.
        make_pool: makes the executor.
        elsewhere: tasks are sent: they can be pickled, and travel as `fireworld.executors.packing` says.
        name: what errors call the executor.
    """

    n: int
    stop: Event = field(default_factory=Event)
    make_pool: Callable[[int], AbstractContextManager[Executor]] = ThreadPoolExecutor
    elsewhere: bool = False
    name: str = "executor"

    def run(
        self, tasks: Sequence[Callable[[], Result]], on_result: Callable[[int, Result], object] = lambda *_: None
    ) -> list[Result] | None:
        """Run tasks and return their results in order; None if stopped before the last was done.

        Args:
            tasks: what to do.
            on_result: called on this thread as tasks are done, with their number and result; also for those that
                were under way when all stopped, if they got done. Of a task that is done in parts, which is for
                workers elsewhere, with every part: `Unfinished`, but for the last.

        Raises:
            ExecutorError: workers died again and again, were refused, or cannot be sent the tasks.
        """
        if self.elsewhere:
            from fireworld.executors.sending import Sending

            return Sending(self, tasks, on_result).run()
        results: dict[int, Result] = {}
        with self.make_pool(self.n) as pool:
            numbers = {pool.submit(task): number for number, task in enumerate(tasks)}
            self._wait(numbers, results, on_result)
        if len(results) == len(tasks):
            return [results[number] for number in range(len(tasks))]
        for future, number in numbers.items():
            if number not in results and not future.cancelled() and future.exception() is None:
                on_result(number, future.result())  # was under way when all stopped, and got done
        return None

    def _wait(
        self,
        numbers: dict[Future[Result], int],
        results: dict[int, Result],
        on_result: Callable[[int, Result], object],
    ) -> None:
        """Collect results until all are there, one failed, or all were stopped."""
        pending = set(numbers)
        try:
            while pending and not self.stop.is_set():
                done, pending = wait(pending, timeout=LOOK_EVERY_SECONDS, return_when=FIRST_COMPLETED)
                for future in () if self.stop.is_set() else done:
                    results[numbers[future]] = future.result()
                    on_result(numbers[future], future.result())
        finally:
            if pending:
                self.stop.set()
                for future in pending:
                    future.cancel()
                wait(pending)


def threads(n: int | None = None, *, stop: Event | None = None) -> Workers:
    """Return threads: for compiled episodes, which leave each other free to run side by side.

    Args:
        n: threads; None: as many as there are cores.
        stop: asks to stop.
    """
    return Workers(n or n_cores(), stop or Event())


def processes(n: int | None = None, *, stop: Event | None = None) -> Workers:
    """Return processes, for Python code; they begin afresh (a copy of one with threads may hang).

    Args:
        n: processes; None: as many as there are cores.
        stop: asks to stop.
    """
    from fireworld.executors.pools import pool_of_processes

    return Workers(n or n_cores(), stop or Event(), pool_of_processes, elsewhere=True, name="processes")


def given(executor: Executor, *, stop: Event | None = None) -> Workers:
    """Return an executor of the caller's as workers; it is not shut down.

    Args:
        executor: of concurrent.futures, or one that behaves like it (Dask, loky, mpi4py).
        stop: asks to stop.
    """
    here = isinstance(executor, ThreadPoolExecutor)
    return Workers(n_cores(), stop or Event(), lambda _: nullcontext(executor), elsewhere=not here)


def n_cores() -> int:
    """Return how many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
