"""Dask: a cluster on this machine, or one that is there."""

from __future__ import annotations

import logging
import os
import signal
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Executor, Future
from contextlib import contextmanager, suppress
from functools import partial
from importlib import import_module
from threading import Event
from typing import Any, Final

from fireworld.errors import described
from fireworld.executors.workers import ExecutorError, Workers, n_cores

REACH_SECONDS: Final = 10
END_SECONDS: Final = 5
QUIET: Final = {
    "distributed.worker.profile.enabled": False,
    "distributed.admin.tick.interval": "500ms",
    "distributed.admin.system-monitor.interval": "5s",
}
"""How Dask looks at itself: as it comes a hundred times a second, which costs some percent of each core."""
AT_LEAST: Final = 4
"""Workers that a cluster is taken to have, which may have none yet and make them when there is work."""


class DaskPool(Executor):
    """A client of Dask's as an executor whose work can be left."""

    def __init__(self, client: Any, cluster: Any = None) -> None:
        self._client, self._cluster = client, cluster
        self._sent: dict[Future[Any], Any] = {}

    def submit(self, function: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Send a call."""
        future: Future[Any] = Future()
        future.set_running_or_notify_cancel()
        sent = self._sent[future] = self._client.submit(function, *args, **kwargs, pure=False)
        sent.add_done_callback(partial(self._done, future))
        return future

    def abandon(self) -> None:
        """Take back what is not done; of a cluster made for this work, end the workers, whatever they do."""
        with suppress(Exception):  # no cluster any more
            self._client.cancel([*self._sent.values()], force=True)
        self._sent.clear()
        for nanny in [*self._cluster.workers.values()] if self._cluster is not None else ():
            nanny.auto_restart = False
            with suppress(OSError, TypeError):  # ended by itself
                os.kill(nanny.pid, signal.SIGKILL)

    def _done(self, future: Future[Any], sent: Any) -> None:
        try:
            if sent.status == "finished":
                future.set_result(sent.result())
            elif sent.status == "error":
                future.set_exception(_error_of(sent.exception()))
            else:
                future.set_exception(BrokenExecutor("the cluster is gone"))
        except BaseException as error:  # noqa: BLE001 - the result did not arrive; nobody else would know
            future.set_exception(BrokenExecutor(str(error)))
        self._sent.pop(future, None)


def _error_of(error: BaseException) -> BaseException:
    """Return the error that stands for that of a task."""
    if type(error).__name__ == "KilledWorker":
        n_killed = error.args[2] + 1
        return ExecutorError(f"dask: a part of the work killed {n_killed} workers: they crashed or ran out of memory")
    return error


def dask_workers(word: str, n: int | None, *, stop: Event | None = None) -> Workers:
    """Return the workers of a cluster.

    Args:
        word: "dask": one on this machine, for this work; "dask://HOST:PORT": the address of a scheduler.
        n: workers; None: as many as there are cores, or as the cluster has. Of a cluster that is there, this is how
            many it is given work for at a time.
        stop: asks to stop.

    Raises:
        ExecutorError: Dask is not installed, or there is no scheduler.
    """
    library = _library()
    if word == "dask":
        make = partial(_local, library)
        return Workers(n or n_cores(), stop or Event(), make, elsewhere=True, name="dask")
    address = f"tcp://{word.removeprefix('dask://')}"
    if n is None:
        with _client(library, address, word) as client:
            n = max(AT_LEAST, sum(client.nthreads().values()))
    return Workers(n, stop or Event(), partial(_there, library, address, word), elsewhere=True, name=word)


def _library() -> Any:
    try:
        return import_module("distributed")
    except ImportError:
        raise ExecutorError("executor: dask is not installed; try pip install 'fireworld[dask]'") from None


@contextmanager
def _local(library: Any, n: int) -> Iterator[Executor]:
    """Make a cluster on this machine, of processes, that ends with the work."""
    with import_module("dask").config.set(QUIET):
        cluster = library.LocalCluster(
            n_workers=n,
            threads_per_worker=1,
            processes=True,
            dashboard_address=None,
            memory_limit=0,
            silence_logs=logging.CRITICAL,
        )
    with cluster, library.Client(cluster, set_as_default=False) as client:
        yield DaskPool(client, cluster)


@contextmanager
def _there(library: Any, address: str, word: str, n: int) -> Iterator[Executor]:
    del n
    with _client(library, address, word) as client:
        pool = DaskPool(client)
        try:
            yield pool
        finally:
            pool.abandon()


@contextmanager
def _client(library: Any, address: str, word: str) -> Iterator[Any]:
    """Connect to a scheduler."""
    try:
        client = library.Client(address, timeout=REACH_SECONDS, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        hint = "is its scheduler there?"
        raise ExecutorError(f"executor: {word} cannot be reached: {described(error)}; {hint}") from None
    with client:
        yield client
