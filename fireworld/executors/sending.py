"""Tasks done elsewhere: sent in chunks, sent again where workers died, collected in order."""

from __future__ import annotations

import pickle
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from typing import Any, Final, Generic

from fireworld.errors import described
from fireworld.executors.packing import Packer
from fireworld.executors.receiving import work
from fireworld.executors.self_test import self_test
from fireworld.executors.workers import LOOK_EVERY_SECONDS, ExecutorError, OnResult, Result, Unfinished, Workers
from fireworld.version import simulator_version

CHUNK_MAX: Final = 50
"""Tasks that are sent at once."""
CHUNKS_A_WORKER: Final = 8
"""Chunks that there are for each worker at least, so that all end at about the same time."""
UNDER_WAY_A_WORKER: Final = 2
"""Chunks that are sent to each worker, so that none waits for its next one."""
TRIES: Final = 3
"""Pools that may break one after another with nothing done."""
STOP_SECONDS: Final = 1.0
"""How long what is under way is waited for when all stop."""

Numbers = Sequence[int]


class Sending(Generic[Result]):
    """Tasks that workers elsewhere do; arguments are those of `Workers.run`."""

    def __init__(self, workers: Workers, tasks: Sequence[Callable[[], Result]], on_result: OnResult) -> None:
        self._workers, self._on_result = workers, on_result
        self._tasks = [*tasks]
        self._results: dict[int, Result] = {}
        size = max(1, min(CHUNK_MAX, len(tasks) // (workers.n * CHUNKS_A_WORKER)))
        self._waiting: deque[Numbers] = deque(
            range(first, min(first + size, len(tasks))) for first in range(0, len(tasks), size)
        )
        self._under_way: dict[Future[Any], Numbers] = {}
        self._packer = Packer()
        self._n_answers = 0

    def run(self) -> list[Result] | None:
        """Do all; None if stopped before."""
        n_broken = 0
        while self._waiting and not self._workers.stop.is_set():
            n_before = self._n_answers
            try:
                with self._workers.make_pool(self._workers.n) as pool:
                    self._work_in(pool)
            except BrokenExecutor:
                self._waiting.extendleft(self._under_way.values())
                self._under_way.clear()
                n_broken = 1 if self._n_answers > n_before else n_broken + 1
                if n_broken >= TRIES:
                    raise ExecutorError(_DIED.format(self._workers.name)) from None
        if len(self._results) < len(self._tasks):
            return None
        return [self._results[number] for number in range(len(self._tasks))]

    def _work_in(self, pool: Executor) -> None:
        """Send and collect until all is done; or until all stop, with what got done by then."""
        n_most = UNDER_WAY_A_WORKER * self._workers.n
        try:
            while (self._waiting or self._under_way) and not self._workers.stop.is_set():
                while self._waiting and len(self._under_way) < n_most:
                    self._send(pool, self._waiting[0])
                    self._waiting.popleft()
                self._collect(pool, LOOK_EVERY_SECONDS)
        except BrokenExecutor:
            raise
        except BaseException:
            self._workers.stop.set()
            self._leave(pool)
            raise
        if self._under_way:
            for future in self._under_way:
                future.cancel()
            wait(self._under_way, timeout=STOP_SECONDS)
            self._collect(None, 0.0)
            self._leave(pool)

    def _send(self, pool: Executor, numbers: Numbers, lacking: Sequence[str] = ()) -> None:
        packed = self._packer.pack([self._tasks[number] for number in numbers])
        order = {
            "version": simulator_version(),
            "digest": self_test(),
            "content": packed.content,
            "needs": packed.needs,
            "modules": [tuple(one) for one in packed.modules],
            "apart": {digest: self._packer.apart[digest] for digest in lacking},
        }
        self._under_way[pool.submit(work, order)] = numbers

    def _collect(self, pool: Executor | None, seconds: float) -> None:
        """Take the answers that are there; without a pool nothing is sent again."""
        done, _ = wait(self._under_way, timeout=seconds, return_when=FIRST_COMPLETED)
        for future in done:
            if future.cancelled():
                if pool is not None:
                    raise ExecutorError(f"{self._workers.name}: work was cancelled by others")
                continue
            kind, found = self._answer(future)
            numbers = self._under_way.pop(future)
            if kind == "refused":
                raise ExecutorError(found)
            if kind == "lacking":
                self._send_what_lacks(pool, numbers, found)
                continue
            self._n_answers += 1
            self._take(numbers, found)

    def _send_what_lacks(self, pool: Executor | None, numbers: Numbers, lacking: Sequence[str]) -> None:
        try:
            if pool is not None:
                self._send(pool, numbers, lacking)
        except BrokenExecutor:
            self._waiting.appendleft(numbers)
            raise

    def _answer(self, future: Future[Any]) -> tuple[str, Any]:
        try:
            kind, found = future.result()
        except (ImportError, AttributeError, pickle.UnpicklingError) as error:
            if "fireworld" not in str(error):
                raise
            hint = f"install fireworld {simulator_version()} on all of them"
            raise ExecutorError(f"{self._workers.name}: a worker cannot begin: {described(error)}; {hint}") from None
        return kind, found

    def _take(self, numbers: Numbers, results: Sequence[Any]) -> None:
        left = [*numbers[len(results) :]]
        for number, result in zip(numbers, results, strict=False):
            if isinstance(result, Unfinished):
                self._tasks[number] = result.rest
                left.insert(0, number)
            else:
                self._results[number] = result
            self._on_result(number, result)
        if left:
            self._waiting.appendleft(left)

    def _leave(self, pool: Executor) -> None:
        """Wait no longer for what is under way, where that can be done."""
        for future in self._under_way:
            future.cancel()
        abandon = getattr(pool, "abandon", None)
        if abandon is not None:
            abandon()


_DIED: Final = (
    "{}: a process that did a part of the work died, again and again; it crashed or ran out of memory, or its script "
    "starts work without `if __name__ == '__main__':`; try one job, or --on threads"
)
