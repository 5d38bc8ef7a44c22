"""What `--on` and arguments `executor` may be, and the workers that they mean."""

from __future__ import annotations

import re
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import dataclass
from threading import Event
from typing import Final

from fireworld.errors import expected
from fireworld.executors.workers import ExecutorError, Workers, given, n_cores, processes, threads

WORDS: Final = ("threads", "processes", "dask", "dask://HOST:PORT", "MODULE:make_executor")
_ADDRESS: Final = re.compile(r"dask://[^/\s]+:[0-9]+")
_FUNCTION: Final = re.compile(r"[A-Za-z_][\w.]*:[A-Za-z_]\w*")


@dataclass(frozen=True)
class On:
    """An executor by its word, as `--on` names it, and how many workers it has, as `--jobs` says.

    Attributes:
        word: "threads", "processes", "dask" (a cluster on this machine, for this work), "dask://HOST:PORT" (a cluster
            that is there), or "MODULE:make_executor" (a function of the number of workers that returns an executor).
        n: workers; None: as many as there are cores, or as a cluster has.
    """

    word: str
    n: int | None = None


AnyExecutor = Executor | On | int | str | None
"""What an argument `executor` may be; see `workers_for`."""


def workers_for(executor: AnyExecutor, *, stop: Event | None = None) -> Workers:
    """Return the workers that an argument `executor` asks for.

    Args:
        executor: None: as many threads as there are cores; a number of threads; a word of `On`, or an `On`; or an
            executor of the caller's.
        stop: asks to stop.

    Raises:
        ExecutorError: it is none of these; Dask is not installed; there is no such function.
    """
    if executor is None or (isinstance(executor, int) and not isinstance(executor, bool) and executor >= 1):
        return threads(executor, stop=stop)
    if isinstance(executor, Executor):
        return given(executor, stop=stop)
    on = On(executor) if isinstance(executor, str) else executor
    if isinstance(on, On):
        if on.word == "threads":
            return threads(on.n, stop=stop)
        if on.word == "processes":
            return processes(on.n, stop=stop)
        if on.word == "dask" or _ADDRESS.fullmatch(on.word):
            from fireworld.executors.on_dask import dask_workers

            return dask_workers(on.word, on.n, stop=stop)
        if _FUNCTION.fullmatch(on.word):
            from fireworld.executors.pools import made_by

            return Workers(on.n or n_cores(), stop or Event(), made_by(on.word), elsewhere=True, name=on.word)
    words = ", ".join(f'"{word}"' for word in WORDS)
    wanted = f"{words}, a number from 1 on, or an executor of concurrent.futures"
    raise ExecutorError(expected("executor", "", wanted, on.word if isinstance(on, On) else executor))


def in_this_process(executor: AnyExecutor) -> bool:
    """Return whether an argument `executor` means threads of this process, to which nothing needs to be sent."""
    word = executor.word if isinstance(executor, On) else executor
    return word is None or word == "threads" or isinstance(word, int | ThreadPoolExecutor)
