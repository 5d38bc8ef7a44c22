"""Threads that share a list of tasks, and stop together."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from threading import Event
from typing import Final, TypeVar

Result = TypeVar("Result")

LOOK_EVERY_SECONDS: Final = 0.2
"""How long Ctrl-C waits at most until it is seen."""


@dataclass(frozen=True)
class Workers:
    """Threads for compiled episodes, which leave each other free to run side by side.

    Attributes:
        n: threads.
        stop: set it, and no further task begins; tasks may look at it too.
    """

    n: int
    stop: Event

    def run(
        self, tasks: Sequence[Callable[[], Result]], on_result: Callable[[int, Result], object] = lambda *_: None
    ) -> list[Result] | None:
        """Run tasks and return their results in order; None if stopped before the last was done.

        Args:
            tasks: what to do.
            on_result: called on this thread as tasks are done, with their number and result.
        """
        results: dict[int, Result] = {}
        with ThreadPoolExecutor(self.n) as pool:
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
        return [results[number] for number in range(len(tasks))] if len(results) == len(tasks) else None
