"""Policies of a user's own: their modules imported, their classes and functions found and called."""

from __future__ import annotations

import hashlib
import importlib
import inspect
import sys
from functools import partial
from importlib.machinery import ModuleSpec, SourceFileLoader
from importlib.util import module_from_spec
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import Any, Final

from fireworld.errors import PolicyError, expected, nearest
from fireworld.files import read_input
from fireworld.policy.asking import complete, users_code
from fireworld.policy.parameter_text import Parameters, check_no_parameters, check_signature, takes
from fireworld.policy.protocol import Policy

CODE_SUFFIX: Final = ".py"
N_BYTES_MAX: Final = 1 << 24
_IMPORTED: Final[dict[Path, tuple[bytes, ModuleType]]] = {}
"""Files that were imported by their paths, and what was in them then."""


class _Loader(SourceFileLoader):
    """Runs the code that was read, not what the file or a compiled copy of it holds by now."""

    def __init__(self, name: str, path: str, content: bytes) -> None:
        super().__init__(name, path)
        self._content = content

    def get_code(self, fullname: str) -> CodeType:
        """Compile the code."""
        code: CodeType = self.source_to_code(self._content, self.get_filename(fullname))
        return code


def import_source(source: str) -> ModuleType:
    """Import a module by its name, as seen from the current folder, or a file by its path; PolicyError if it fails."""
    if source.endswith(CODE_SUFFIX):
        return _import_file(Path(source))
    _find_first_in(Path.cwd())
    importlib.invalidate_caches()
    with users_code(f"--policy: {source}", "cannot be imported"):
        return importlib.import_module(source)


def find_in(module: ModuleType, target: str, *, where: str) -> Any:
    """Return the class, function or object of that name in a module; without a name, its only policy class."""
    classes = [name for name, one in vars(module).items() if _is_policy_class(name, one, module)]
    if not target:
        if len(classes) != 1:
            hint = f"name one of them, as in :{classes[0]}" if classes else ""
            wanted = "one policy class (a class with a method decide)"
            raise PolicyError(expected(where, "", wanted, ", ".join(classes) or "none", hint))
        (target,) = classes
    found = getattr(module, target, None)
    if found is None:
        raise PolicyError(expected(where, "", "a class of that name", target, nearest(target, classes)))
    return found


def make_policy(thing: Any, parameters: Parameters, *, where: str, as_function: bool = False) -> Policy:
    """Make a policy of a class, of a function that returns one, of a function of the observation, or of an object.

    `as_function`: a function that takes an observation is a policy, even if it could be called without one.
    """
    if not (inspect.isclass(thing) or isinstance(thing, FunctionType)):
        check_no_parameters(parameters, where=where)
        return complete(thing, where=where)
    of_observation = not inspect.isclass(thing) and takes(thing, parameters, n_before=1)
    if of_observation and (as_function or not takes(thing, parameters)):
        return complete(partial(thing, **parameters) if parameters else thing)
    check_signature(thing, parameters, where=where)
    with users_code(where, "cannot be made"):
        made = thing(**parameters)
    return complete(made, where=where)


def _import_file(path: Path) -> ModuleType:
    """Import a file, once more if it has changed; as the module that it would be, unless another one has that name."""
    where = f"--policy: {path}"
    try:
        path = path.resolve()
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else str(error)
        raise PolicyError(expected(where, "", "a file of Python code", reason)) from None
    content = read_input(path, what="a file of Python code", n_bytes_max=N_BYTES_MAX, error=PolicyError, source=where)
    _find_first_in(path.parent)
    known, loaded = _IMPORTED.get(path), sys.modules.get(path.stem)
    if known is not None and known[0] == content:
        return known[1]
    name = path.stem
    if loaded is not None and getattr(loaded, "__file__", None) != str(path):
        name += f"-{hashlib.sha256(bytes(path)).hexdigest()[:8]}"
    elif loaded is not None and known is None:
        return _IMPORTED.setdefault(path, (content, loaded))[1]
    loader = _Loader(name, str(path), content)
    module = sys.modules[name] = module_from_spec(ModuleSpec(name, loader, origin=str(path)))
    module.__file__ = str(path)
    try:
        with users_code(where, "cannot be imported"):
            loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise
    _IMPORTED[path] = content, module
    return module


def _find_first_in(folder: Path) -> None:
    """Let imports look into a folder before others."""
    if str(folder) not in sys.path:
        sys.path.insert(0, str(folder))


def _is_policy_class(name: str, one: object, module: ModuleType) -> bool:
    """Return whether a name in a module is that of a policy class which is defined there."""
    own = inspect.isclass(one) and (one.__module__, one.__name__) == (module.__name__, name)
    return own and not name.startswith("_") and isinstance(one, Policy) and not inspect.isabstract(one)
