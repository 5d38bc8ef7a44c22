"""Pools of processes, and executors that users make."""

from __future__ import annotations

import importlib
import multiprocessing
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import AbstractContextManager, contextmanager, suppress
from pathlib import Path
from typing import Any, Final

from fireworld.errors import described, expected
from fireworld.executors.workers import ExecutorError

PARENT_SECONDS: Final = 1.0
"""How often a process looks whether its parent is still there."""


class ProcessPool(ProcessPoolExecutor):
    """Processes that can be left alone with what they do."""

    def abandon(self) -> None:
        """End the processes, whatever they do."""
        for process in [*(self._processes or {}).values()]:
            with suppress(OSError, ValueError):  # ended by itself
                process.kill()


def pool_of_processes(n: int) -> ProcessPool:
    """Make processes that leave Ctrl-C to this one."""
    fresh = multiprocessing.get_context("spawn")
    return ProcessPool(n, mp_context=fresh, initializer=_begin_process, initargs=(os.getpid(),))


def _begin_process(parent: int) -> None:
    """Leave Ctrl-C to the parent, and end when it has ended."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(PARENT_SECONDS)
        os._exit(1)

    threading.Thread(target=watch, name="parent", daemon=True).start()


def made_by(text: str) -> Callable[[int], AbstractContextManager[Executor]]:
    """Return what makes an executor as a user's function does.

    Args:
        text: MODULE:FUNCTION; the module is looked for in the current folder too. The function takes the number of
            workers and returns an executor of concurrent.futures.

    Raises:
        ExecutorError: there is no such function; when it is called, that it failed, or returned something else.
    """
    source, _, name = text.partition(":")
    where = f"--on: {text}"
    folder = str(Path.cwd())
    if folder not in sys.path:
        sys.path.insert(0, folder)
    try:
        module = importlib.import_module(source)
    except Exception as error:  # noqa: BLE001 - a user's module may raise anything
        raise ExecutorError(f"{where}: {source} cannot be imported: {described(error)}") from None
    function = getattr(module, name, None)
    if not callable(function):
        wanted = "a function of the number of workers that returns an executor"
        raise ExecutorError(expected(where, "", wanted, "no function of that name" if function is None else function))

    @contextmanager
    def make(n: int) -> Iterator[Executor]:
        with _begun(function, n, where=where) as executor:
            yield executor

    return make


@contextmanager
def _begun(function: Callable[[int], Any], n: int, *, where: str) -> Iterator[Executor]:
    """Make a user's executor and enter its context."""
    try:
        made = function(n)
        is_executor = all(hasattr(made, name) for name in ("submit", "__enter__", "__exit__"))
        entered = made.__enter__() if is_executor else None
    except Exception as error:  # noqa: BLE001 - the same
        raise ExecutorError(f"{where}: failed: {described(error)}") from None
    if not is_executor:
        raise ExecutorError(expected(where, "", "an executor of concurrent.futures", made))
    try:
        yield made if entered is None else entered
    finally:
        made.__exit__(None, None, None)
