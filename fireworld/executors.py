"""Who does work that comes in many parts: threads, processes, or an executor that is given, with the same results."""

from __future__ import annotations

import multiprocessing
import os
import signal
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor, wait
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field
from threading import Event
from typing import Final, TypeVar

Result = TypeVar("Result")

LOOK_EVERY_SECONDS: Final = 0.2
"""How long Ctrl-C waits at most until it is seen."""


@dataclass(frozen=True)
class Workers:
    """Workers that share a list of tasks and stop together. Made by `threads`, `processes` or `given`.

    Attributes:
        n: tasks at a time.
        stop: set it, and no further task begins; tasks that run in threads may look at it too.
        make_pool: makes the executor; what runs in processes must be picklable.
    """

    n: int
    stop: Event = field(default_factory=Event)
    make_pool: Callable[[int], AbstractContextManager[Executor]] = ThreadPoolExecutor

    def run(
        self, tasks: Sequence[Callable[[], Result]], on_result: Callable[[int, Result], object] = lambda *_: None
    ) -> list[Result] | None:
        """Run tasks and return their results in order; None if stopped before the last was done.

        Args:
            tasks: what to do.
            on_result: called on this thread as tasks are done, with their number and result; also for those that
                were under way when all stopped, if they got done.
        """
        results: dict[int, Result] = {}
        with self.make_pool(self.n) as pool:
            numbers = {pool.submit(task): number for number, task in enumerate(tasks)}
            pending: set[Future[Result]] = set(numbers)
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
        if len(results) == len(tasks):
            return [results[number] for number in range(len(tasks))]
        for future, number in numbers.items():
            if number not in results and not future.cancelled() and future.exception() is None:
                on_result(number, future.result())  # was under way when all stopped, and got done
        return None


def threads(n: int | None = None, *, stop: Event | None = None) -> Workers:
    """Return threads: for compiled episodes, which leave each other free to run side by side.

    Args:
        n: threads; None: as many as there are cores.
        stop: asks to leave off.
    """
    return Workers(n or n_cores(), stop or Event())


def processes(n: int | None = None, *, stop: Event | None = None) -> Workers:
    """Return processes, for Python code; they begin afresh (a copy of one with threads may hang).

    Args:
        n: processes; None: as many as there are cores.
        stop: asks to leave off.
    """
    return Workers(n or n_cores(), stop or Event(), _pool_of_processes)


def given(executor: Executor, *, stop: Event | None = None) -> Workers:
    """Return an executor of the caller's as workers; it is not shut down.

    Args:
        executor: of concurrent.futures, or one that behaves like it (Dask, loky, mpi4py).
        stop: asks to leave off.
    """
    return Workers(1, stop or Event(), lambda _: nullcontext(executor))


def n_cores() -> int:
    """Return how many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _pool_of_processes(n: int) -> Executor:
    """Make processes that leave Ctrl-C to this one."""
    fresh = multiprocessing.get_context("spawn")
    return ProcessPoolExecutor(n, mp_context=fresh, initializer=signal.signal, initargs=(signal.SIGINT, signal.SIG_IGN))
