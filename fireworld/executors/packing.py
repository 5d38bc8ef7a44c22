"""Tasks on their way to workers: what is large or shared travels apart, once for each worker, by its digest.

A built scenario travels as the scenario, and is built where it arrives; a city file as its bytes; a module of a user's
as its source, with those that it brings in. A task then is what is left: a seed or two, and digests.
"""

from __future__ import annotations

import hashlib
import io
import pickle
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any, Final, NamedTuple

from fireworld.errors import described, expected
from fireworld.executors.workers import ExecutorError
from fireworld.policy.identity import LIBRARIES, NOTEBOOK, modules_brought_in
from fireworld.policy.importing import CODE_SUFFIX
from fireworld.policy.kernel import KernelPolicy
from fireworld.scenario import Scenario
from fireworld.scenario.scenario import read_city_file
from fireworld.simulation.built import BuiltScenario

APART_BYTES: Final = 1 << 13
"""Bytes that travel apart, at least."""


class SentModule(NamedTuple):
    """A module of a user's, as its source."""

    name: str
    digest: str
    path: str
    is_package: bool


class Packed(NamedTuple):
    """Tasks, packed."""

    content: bytes
    needs: tuple[str, ...]
    """Digests of what travels apart."""
    modules: tuple[SentModule, ...]
    """Modules that must be there."""


class Packer:
    """Packs tasks, and keeps what travels apart.

    Attributes:
        apart: contents by their digests.
    """

    def __init__(self) -> None:
        self.apart: dict[str, bytes] = {}
        self._digests: dict[int, tuple[Any, str]] = {}
        """Of objects by their id; with the object, so that no other one gets its id."""
        self._modules: dict[str, tuple[SentModule, ...]] = {}

    def pack(self, tasks: Sequence[Callable[[], Any]]) -> Packed:
        """Pack tasks.

        Raises:
            ExecutorError: something about them cannot be sent.
            ScenarioError: a city file cannot be read.
        """
        place = io.BytesIO()
        pickler = _Pickler(place, self)
        try:
            pickler.dump(list(tasks))
        except (pickle.PicklingError, AttributeError, TypeError, ValueError) as error:
            got = described(error)
            raise ExecutorError(expected("executor", "", "work that can be sent to other processes", got)) from None
        needs = dict.fromkeys([*pickler.needs, *(one.digest for one in pickler.modules.values())])
        return Packed(place.getvalue(), tuple(needs), tuple(pickler.modules.values()))

    def keep(self, content: bytes) -> str:
        """Keep what travels apart, and return its digest."""
        digest = hashlib.sha256(content).hexdigest()
        self.apart[digest] = content
        return digest

    def keep_object(self, thing: Any) -> str:
        """Keep an object, pickled."""
        known = self._digests.get(id(thing))
        if known is None:
            plain = replace(thing) if isinstance(thing, KernelPolicy) else thing  # without what a run has prepared
            known = self._digests[id(thing)] = thing, self.keep(pickle.dumps(plain, protocol=5))
        return known[1]

    def keep_city(self, scenario: Scenario, content: bytes | None = None) -> str:
        """Keep a scenario's city file; return its digest, "" if it has none."""
        digest = scenario.city_sha256 or ""
        if digest and digest not in self.apart:
            self.apart[digest] = read_city_file(scenario) if content is None else content
        return digest

    def modules_of(self, thing: type | FunctionType) -> tuple[SentModule, ...]:
        """Return the modules without which a class or function of a user's is not found.

        Raises:
            ExecutorError: it is defined in the script or notebook that runs, or in a module that is no Python source.
        """
        name = thing.__module__
        if name == NOTEBOOK:
            got = f"{thing.__qualname__}, which the script or notebook that runs defines"
            raise ExecutorError(expected("executor", "", "code that can be sent", got, "move it to a module"))
        if name not in self._modules:
            module = sys.modules.get(name)
            found = [] if module is None or not _is_users(module) else [module, *modules_brought_in(module)]
            self._modules[name] = tuple(self._sent_module(one) for one in found)
        return self._modules[name]

    def _sent_module(self, module: ModuleType) -> SentModule:
        path, is_package = getattr(module, "__file__", None) or "", hasattr(module, "__path__")
        source: bytes | None = None
        with suppress(OSError):
            if path.endswith(CODE_SUFFIX) or (is_package and not path):
                source = Path(path).read_bytes() if path else b""
        if source is None:
            hint = "install it on the workers as a package"
            got = f"module {module.__name__}, which is no file of Python code"
            raise ExecutorError(expected("executor", "", "code that can be sent", got, hint))
        return SentModule(module.__name__, self.keep(source), path, is_package)


def _is_users(module: ModuleType) -> bool:
    """Return whether a module is neither fireworld's, nor Python's, nor installed as a library."""
    return not str(getattr(module, "__file__", None) or "<").startswith(LIBRARIES)


class _Pickler(pickle.Pickler):
    """Pickles tasks for others; notes what they need."""

    def __init__(self, place: io.BytesIO, packer: Packer) -> None:
        super().__init__(place, protocol=5)
        self._packer = packer
        self.needs: list[str] = []
        self.modules: dict[str, SentModule] = {}

    def persistent_id(self, obj: Any) -> tuple[str, ...] | None:
        """Return what stands for an object that travels apart; None for others."""
        if isinstance(obj, BuiltScenario):
            return self._noted("built", self._packer.keep_object(obj.scenario), self._city(obj.scenario, obj.city_json))
        if isinstance(obj, Scenario):
            return self._noted("object", self._packer.keep_object(obj), self._city(obj))
        if isinstance(obj, KernelPolicy):
            return self._noted("object", self._packer.keep_object(obj))
        if isinstance(obj, bytes) and len(obj) >= APART_BYTES:
            return self._noted("bytes", self._packer.keep(obj))
        return None

    def reducer_override(self, obj: Any) -> Any:
        """Note the modules of classes and functions, which are pickled by their names."""
        if isinstance(obj, type | FunctionType):
            self.modules |= {one.name: one for one in self._packer.modules_of(obj)}
        return NotImplemented

    def _city(self, scenario: Scenario, content: bytes | None = None) -> str:
        return self._packer.keep_city(scenario, content)

    def _noted(self, kind: str, *digests: str) -> tuple[str, ...]:
        self.needs += filter(None, digests)
        return (kind, *digests)
