"""What a worker does: check that it is a fit one, take in what it lacks, run tasks for a while.

`work` takes and returns plain values, so that a worker with another version of fireworld can still say so.
"""

from __future__ import annotations

import hashlib
import importlib
import io
import os
import pickle
import socket
import sys
import time
from collections import OrderedDict
from collections.abc import Callable, Mapping
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, SourceFileLoader
from importlib.util import spec_from_file_location
from pathlib import Path
from threading import RLock
from types import CodeType, ModuleType
from typing import Any, Final

from fireworld.errors import expected
from fireworld.executors import self_test
from fireworld.executors.packing import SentModule
from fireworld.executors.workers import ExecutorError, Unfinished
from fireworld.simulation.built import BuiltScenario, CityCache
from fireworld.version import simulator_version

SLICE_SECONDS: Final = 1.0
"""After so long no further task of a chunk begins: what is left is sent again."""
KEPT_BYTES_MAX: Final = 1 << 28
BUILT_MAX: Final = 64


class Store:
    """What a worker has been sent, and what it has built; the oldest goes first."""

    def __init__(self) -> None:
        self.lock = RLock()
        self._contents: OrderedDict[str, bytes] = OrderedDict()
        self._objects: dict[str, Any] = {}
        self._built: dict[str, BuiltScenario] = {}
        self._cities = CityCache()

    def take(self, contents: Mapping[str, bytes]) -> None:
        """Keep contents by their digests."""
        self._contents.update(contents)
        while sum(map(len, self._contents.values())) > KEPT_BYTES_MAX and len(self._contents) > len(contents):
            digest, _ = self._contents.popitem(last=False)
            self._objects.pop(digest, None)

    def lacking(self, needs: tuple[str, ...]) -> list[str]:
        """Return which of these digests are not here; the others become the newest."""
        for digest in needs:
            if digest in self._contents:
                self._contents.move_to_end(digest)
        return [digest for digest in needs if digest not in self._contents]

    def content(self, digest: str) -> bytes:
        """Return a content."""
        return self._contents[digest]

    def object(self, digest: str) -> Any:
        """Return an object, the same every time."""
        if digest not in self._objects:
            self._objects[digest] = pickle.loads(self._contents[digest])  # noqa: S301 - of the client we work for
        return self._objects[digest]

    def built(self, digest: str, city: str) -> BuiltScenario:
        """Return a scenario, built once."""
        if digest not in self._built:
            if len(self._built) >= BUILT_MAX:
                self._built, self._cities = {}, CityCache()
            content = self._contents[city] if city else None
            self._built[digest] = self._cities.build(self.object(digest), city_json=content)
        return self._built[digest]


STORE: Final = Store()
_REFUSALS: Final[dict[tuple[str, str], str]] = {}
"""Why this worker is refused, "" if it is not, by the version and the digest that were asked for."""


def work(order: dict[str, Any]) -> tuple[Any, ...]:
    """Do what a client sends.

    Args:
        order: `version` and `digest` of the client's self-test; `content`, `needs` and `modules` of the packed tasks;
            `apart`: contents by digest.

    Returns:
        ("refused", why), ("lacking", digests), or ("done", results), which are those of the first tasks.
    """
    asked = order["version"], order["digest"]
    with STORE.lock:
        if asked not in _REFUSALS:
            _REFUSALS[asked] = _refusal(*asked)
        if _REFUSALS[asked]:
            return "refused", _REFUSALS[asked]
        STORE.take(order["apart"])
        lacking = STORE.lacking(tuple(order["needs"]))
        if lacking:
            return "lacking", lacking
        _FINDER.take([SentModule(*one) for one in order["modules"]])
        tasks = _Unpickler(io.BytesIO(order["content"])).load()
    return "done", run_for_a_while(tasks)


def run_for_a_while(tasks: list[Callable[[], Any]]) -> list[Any]:
    """Return the results of the first tasks: of one at least, of others if they begin in time."""
    results: list[Any] = []
    end = time.monotonic() + SLICE_SECONDS
    for task in tasks:
        if results and time.monotonic() >= end:
            break
        results.append(task())
        if isinstance(results[-1], Unfinished):
            break
    return results


def worker_name() -> str:
    """Return what to call this worker."""
    found = sys.modules.get("distributed")
    if found is not None:
        try:
            return str(found.get_worker().address)
        except (ValueError, AttributeError):  # this is no worker of Dask's
            pass
    return f"process {os.getpid()} on {socket.gethostname()}"


def _refusal(version: str, digest: str) -> str:
    """Return why this worker is none for a client; "" if it is one."""
    where, own = f"executor: worker {worker_name()}", simulator_version()
    if own != version:
        hint = "install the same version there, and start it anew"
        return expected(where, "", f"fireworld {version}, as here", own, hint)
    found = self_test.self_test()
    if found != digest:
        hint = "it computes otherwise: give it the same versions of numba and numpy, and start it anew, or leave it out"
        return expected(where, "", f"a self-test with the digest {digest[:12]}, as here", found[:12], hint)
    return ""


class _Unpickler(pickle.Unpickler):
    """Unpickles tasks."""

    def persistent_load(self, pid: Any) -> Any:
        """Return what travelled apart."""
        kind, digest, *city = pid
        if kind == "built":
            return STORE.built(digest, *city)
        return STORE.content(digest) if kind == "bytes" else STORE.object(digest)


class _Finder(MetaPathFinder):
    """Finds the modules that were sent."""

    def __init__(self) -> None:
        self._sent: dict[str, SentModule] = {}

    def take(self, modules: list[SentModule]) -> None:
        """Let modules be found, and those be imported anew of which there is another version."""
        changed = [one for one in modules if not self._is_here(one)]
        for one in changed:
            self._sent[one.name] = one
            sys.modules.pop(one.name, None)
        if changed and self not in sys.meta_path:
            sys.meta_path.insert(0, self)
        for one in changed:
            importlib.import_module(one.name)

    def find_spec(self, fullname: str, path: Any = None, target: ModuleType | None = None) -> ModuleSpec | None:
        """Return where a module that was sent is; None for others."""
        del path, target
        sent = self._sent.get(fullname)
        if sent is None:
            return None
        place = sent.path or f"<{fullname}>"
        within = [str(Path(place).parent)] if sent.is_package else None
        loader = _Loader(fullname, place, STORE.content(sent.digest))
        return spec_from_file_location(fullname, place, loader=loader, submodule_search_locations=within)

    def _is_here(self, wanted: SentModule) -> bool:
        """Return whether a module is imported already, from the same source."""
        if wanted.name in self._sent:
            return self._sent[wanted.name].digest == wanted.digest and wanted.name in sys.modules
        loaded = sys.modules.get(wanted.name)
        if loaded is None:
            return False
        file = getattr(loaded, "__file__", None)
        try:
            source = b"" if file is None else Path(file).read_bytes()
        except OSError:
            source = b""
        if hashlib.sha256(source).hexdigest() == wanted.digest:
            return True
        hint = "give one of the two another name"
        where = f"executor: worker {worker_name()}"
        raise ExecutorError(expected(where, "", f"module {wanted.name} as here", f"another one, {file}", hint))


class _Loader(SourceFileLoader):
    """Runs the source that was sent, whatever is in the file of its name here."""

    def __init__(self, name: str, path: str, content: bytes) -> None:
        super().__init__(name, path)
        self._content = content

    def get_code(self, fullname: str) -> CodeType:
        """Compile the source."""
        code: CodeType = self.source_to_code(self._content, self.get_filename(fullname))
        return code


_FINDER: Final = _Finder()
