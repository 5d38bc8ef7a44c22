"""Threads, or processes, that share a list of tasks and stop together."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from threading import Event
from typing import Final, TypeVar

Result = TypeVar("Result")

LOOK_EVERY_SECONDS: Final = 0.2
"""How long Ctrl-C waits at most until it is seen."""


@dataclass(frozen=True)
class Workers:
    """Threads for compiled episodes, which leave each other free to run side by side; processes for Python code.

    Attributes:
        n: threads or processes.
        stop: set it, and no further task begins; tasks that run in threads may look at it too.
        make_pool: makes n of them; what runs in processes must be picklable.
    """

    n: int
    stop: Event
    make_pool: Callable[[int], Executor] = ThreadPoolExecutor

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
                    pool.shutdown(wait=False, cancel_futures=True)
        if len(results) == len(tasks):
            return [results[number] for number in range(len(tasks))]
        for future, number in numbers.items():
            if number not in results and not future.cancelled() and future.exception() is None:
                on_result(number, future.result())  # was under way when all stopped, and got done
        return None
