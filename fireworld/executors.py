"""Executors for work that comes in many parts: threads, processes, or one that is given, with the same results."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    Executor,
    Future,
    ProcessPoolExecutor,
    ThreadPoolExecutor,
    wait,
)
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field
from threading import Event
from typing import Final, TypeVar

from fireworld.errors import FireworldError, expected

Result = TypeVar("Result")
AnyExecutor = Executor | int | str | None
"""What an argument `executor` may be; see `workers_for`."""

LOOK_EVERY_SECONDS: Final = 0.2
PARENT_SECONDS: Final = 1.0
"""How often a process looks whether its parent is still there."""
"""How long Ctrl-C waits at most until it is seen."""


class ExecutorError(FireworldError):
    """An executor that cannot do the work it was given."""


@dataclass(frozen=True)
class Workers:
    """Workers that share a list of tasks and stop together. Made by `threads`, `processes`, `given` or `workers_for`.

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

        Raises:
            ExecutorError: a process died.
        """
        results: dict[int, Result] = {}
        try:
            with self.make_pool(self.n) as pool:
                numbers = {pool.submit(task): number for number, task in enumerate(tasks)}
                self._wait(numbers, results, on_result)
        except BrokenExecutor:
            hint = "it crashed, or its script starts work without `if __name__ == '__main__':`; try one job"
            raise ExecutorError(f"executor: a process that did a part of the work died; {hint}") from None
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
    return Workers(n or n_cores(), stop or Event(), _pool_of_processes)


def given(executor: Executor, *, stop: Event | None = None) -> Workers:
    """Return an executor of the caller's as workers; it is not shut down.

    Args:
        executor: of concurrent.futures, or one that behaves like it (Dask, loky, mpi4py).
        stop: asks to stop.
    """
    return Workers(1, stop or Event(), lambda _: nullcontext(executor))


def workers_for(executor: AnyExecutor, *, stop: Event | None = None) -> Workers:
    """Return the workers that an argument `executor` asks for.

    Args:
        executor: None, or "threads": as many threads as there are cores; a number of threads; "processes": as many
            processes as there are cores; or an executor of the caller's.
        stop: asks to stop.

    Raises:
        ExecutorError: it is none of these.
    """
    if executor is None or executor == "threads":
        return threads(stop=stop)
    if executor == "processes":
        return processes(stop=stop)
    if isinstance(executor, int) and not isinstance(executor, bool) and executor >= 1:
        return threads(executor, stop=stop)
    if isinstance(executor, Executor):
        return given(executor, stop=stop)
    wanted = '"threads", "processes", a number from 1 on, or an executor of concurrent.futures'
    raise ExecutorError(expected("executor", "", wanted, executor))


def in_processes(executor: AnyExecutor) -> bool:
    """Return whether an argument `executor` asks for processes, to which tasks must be sent."""
    return executor == "processes" or isinstance(executor, ProcessPoolExecutor)


def in_this_process(executor: AnyExecutor) -> bool:
    """Return whether an argument `executor` is known to do all work in this process."""
    return executor is None or executor == "threads" or isinstance(executor, int | ThreadPoolExecutor)


def n_cores() -> int:
    """Return how many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _pool_of_processes(n: int) -> Executor:
    """Make processes that leave Ctrl-C to this one."""
    fresh = multiprocessing.get_context("spawn")
    return ProcessPoolExecutor(n, mp_context=fresh, initializer=_begin_process, initargs=(os.getpid(),))


def _begin_process(parent: int) -> None:
    """Leave Ctrl-C to the parent, and end when it has ended."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(PARENT_SECONDS)
        os._exit(1)

    threading.Thread(target=watch, name="parent", daemon=True).start()
