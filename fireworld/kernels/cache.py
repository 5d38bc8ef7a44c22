"""The machine code of kernels, kept from one process to the next: one sealed file for each compiled function.

Why not numba's own cache: it believes what it finds (a flipped byte is run as machine code), it fails on what it cannot
read, and where its folder cannot be written it falls back on one beside the sources, which notices edits only of the
file that defines a function. Here the name of the folder is a digest of all kernel sources; every file is sealed by a
digest of its bytes and of what they are for; and what does not fit is compiled again.
"""

from __future__ import annotations

import atexit
import contextlib
import hashlib
import os
import pickle
import re
import secrets
import shutil
import stat
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import llvmlite
import numba
from numba.core.caching import _Cache
from numba.core.compiler import CompileResult
from numba.core.serialize import dumps

from fireworld.files import without_waiting
from fireworld.interrupt import postponed

OPEN: Final = os.environ.get("FIREWORLD_OPEN_KERNELS") == "1"
"""Let Python call inner functions too. The tests do; it makes the first compilation half as long again."""
SPARE: Final = "FIREWORLD_SPARE_KERNELS"
"""Environment variable: the temporary folder of this process, for those that it starts."""
ENDING: Final = ".nbc"
N_BYTES_MAX: Final = 1 << 26
SEAL_BYTES: Final = 32
UNUSED_DAYS_MAX: Final = 30
DAY_SECONDS: Final = 86400.0

_SOURCES: Final = Path(__file__).parent
COMPILED_ELSEWHERE: Final = ("draws.py", "events.py", "records.py", "rewards.py", "scores.py")
"""Files beside the folder of kernels that have functions and constants which are compiled with them."""


def sources_digest() -> str:
    """Digest all kernel sources, their data, the constants compiled into them and the version of the compiler."""
    versions = f"{numba.__version__} {llvmlite.__version__} {sys.version_info[:2]} {OPEN}"
    digest = hashlib.sha256(versions.encode())
    for path in [*sorted(_SOURCES.iterdir()), *(_SOURCES.parent / name for name in COMPILED_ELSEWHERE)]:
        if path.suffix in {".py", ".npy"}:
            digest.update(path.name.encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()[:16]


def cache_folder() -> Path:
    """Return the folder of compiled kernels: below NUMBA_CACHE_DIR, else in the user's cache folder.

    Raises:
        OSError: there is no place for it.
    """
    name = f"kernels-{DIGEST}"
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    if chosen:
        return Path(os.path.abspath(chosen)) / name  # noqa: PTH100 - without links resolved, and before any chdir
    caches = os.environ.get("XDG_CACHE_HOME")
    if caches:
        return Path(os.path.abspath(caches)) / "fireworld" / name  # noqa: PTH100 - the same
    try:
        home = Path.home()
    except RuntimeError as error:
        raise OSError(str(error)) from None
    if not home.is_dir():  # root could make it, but it is not fireworld's to make
        raise FileNotFoundError(2, "there is no such home", str(home))
    return home / ".cache" / "fireworld" / name


class Store:
    """Where sealed machine code is kept: the folder of all processes, else a temporary one of this process."""

    def __init__(self) -> None:
        self._folder: Path | None = None
        self._fault: OSError | None = None
        """Why nothing can be written to the folder."""
        self._spare: Path | None = Path(os.environ[SPARE]) if os.environ.get(SPARE) else None
        try:
            self._folder = cache_folder()
            _note_use(self._folder)
        except OSError as error:
            self._fault = error

    @property
    def folders(self) -> list[Path]:
        """Where compiled kernels may be found, the best place first."""
        return [folder for folder in (self._folder, self._spare) if folder is not None]

    def is_empty(self) -> bool:
        """Return whether nothing is compiled yet."""
        return not any(_holds_kernels(folder) for folder in self.folders)

    def read(self, name: str, purpose: bytes) -> bytes | None:
        """Return what was kept under a name; None if nothing was, or anything about it is wrong.

        Args:
            name: of the file.
            purpose: what it must have been kept for.
        """
        for folder in self.folders:
            data = _read(folder / name)
            if data is not None and data[:SEAL_BYTES] == _seal(purpose, data[SEAL_BYTES:]):
                return data[SEAL_BYTES:]
        return None

    def write(self, name: str, purpose: bytes, data: bytes) -> None:
        """Keep something under a name, if there is any place for it."""
        sealed = _seal(purpose, data) + data
        if self._folder is not None and self._fault is None:
            try:
                self._write_shared(self._folder, name, sealed)
            except OSError as error:
                self._fault = error
            else:
                return
        with contextlib.suppress(OSError):  # no place at all: this process has it in memory
            if self._spare is None:
                self._say_why()
                self._spare = _temporary_folder()
            _write(self._spare / name, sealed)

    def _write_shared(self, folder: Path, name: str, sealed: bytes) -> None:
        """Write a file to the folder of all processes, which is made if need be; old folders beside it are removed."""
        if not folder.is_dir():
            folder.mkdir(parents=True, exist_ok=True)
            _remove_unused(folder)
        _write(folder / name, sealed)

    def _say_why(self) -> None:
        from fireworld.errors import one_line

        assert self._fault is not None  # noqa: S101 - no spare folder without a fault
        where = str(self._folder or self._fault.filename or "the cache folder")
        why = self._fault.strerror or str(self._fault)
        line = f"fireworld: compiled code cannot be kept in {where}: {why}; it is kept for this process alone"
        hint = "set NUMBA_CACHE_DIR to a folder that can be written"
        with contextlib.suppress(OSError, ValueError, AttributeError):  # no error stream, or a closed one
            sys.stderr.write(one_line(f"{line}; {hint}") + "\n")


class KernelCache(_Cache):  # type: ignore[misc]  # numba is untyped
    """The compiled forms of one function, as numba's dispatcher asks for them."""

    def __init__(self, function: Callable[..., Any]) -> None:
        code = function.__code__
        self._name = f"{function.__module__.rpartition('.')[2]}.{function.__qualname__}"
        self._about = f"{DIGEST} {function.__module__}.{function.__qualname__}-{code.co_firstlineno} ".encode()

    @property
    def cache_path(self) -> str | None:
        """The folder."""
        return next(map(str, STORE.folders), None)

    def load_overload(self, sig: object, target_context: Any) -> Any:
        """Return the compiled function for a signature; None if it must be compiled.

        Raises:
            KeyboardInterrupt: Ctrl-C came while others were compiled.
        """
        postponed.let_through()
        target_context.refresh()
        name, purpose = self._place(sig, target_context.codegen())
        data = STORE.read(name, purpose)
        if data is None:
            return None
        try:
            return self.rebuilt(target_context, pickle.loads(data))  # noqa: S301 - sealed, and ours
        except Exception:  # noqa: BLE001 - whatever is wrong with it, it can be compiled again
            return None

    def save_overload(self, sig: object, data: Any) -> None:
        """Keep a compiled function."""
        if data.lifted or data.library.has_dynamic_globals:  # it holds addresses of this process
            return
        name, purpose = self._place(sig, data.codegen)
        STORE.write(name, purpose, dumps(self.reduced(data)))

    def reduced(self, result: Any) -> tuple[Any, ...]:
        """Return what is kept of a compiled function."""
        parts: tuple[Any, ...] = result._reduce()  # noqa: SLF001 - as numba's own cache does
        return parts

    def rebuilt(self, target_context: Any, parts: tuple[Any, ...]) -> Any:
        """Return the compiled function again, of what was kept of it."""
        return CompileResult._rebuild(target_context, *parts)  # noqa: SLF001 - the same

    def enable(self) -> None:
        """Do nothing: it is always on."""

    def disable(self) -> None:
        """Do nothing: it is always on."""

    def flush(self) -> None:
        """Do nothing: what is compiled anew replaces what was kept."""

    def _place(self, sig: object, codegen: Any) -> tuple[str, bytes]:
        """Return the name of a file, and what it is for: function, signature and processor."""
        purpose = self._about + repr((str(sig), codegen.magic_tuple())).encode()
        return f"{self._name}-{hashlib.sha256(purpose).hexdigest()[:24]}{ENDING}", purpose


def _seal(purpose: bytes, data: bytes) -> bytes:
    """Return the digest that says that data is whole, and what it is for."""
    digest = hashlib.sha256(len(purpose).to_bytes(8, "little") + purpose)
    digest.update(data)
    return digest.digest()


def _read(path: Path) -> bytes | None:
    """Return the bytes of a regular file of reasonable size; None for anything else."""
    with contextlib.suppress(OSError), open(path, "rb", opener=without_waiting) as file:
        status = os.fstat(file.fileno())
        if stat.S_ISREG(status.st_mode) and status.st_size <= N_BYTES_MAX:
            return file.read()
    return None


def _write(path: Path, data: bytes) -> None:
    """Write a file at once: whoever reads meanwhile, or writes the same, finds one that is whole."""
    partial = path.with_name(f".{secrets.token_hex(8)}.part")
    try:
        with partial.open("xb") as file:
            file.write(data)
        partial.replace(path)
    except BaseException:
        with contextlib.suppress(OSError):
            partial.unlink()
        raise


def _temporary_folder() -> Path:
    """Return a new folder for this process and those it starts; it is removed when this one ends."""
    folder = Path(tempfile.mkdtemp(prefix="fireworld-kernels-"))
    os.environ[SPARE] = str(folder)
    owner = os.getpid()

    def remove() -> None:
        if os.getpid() == owner:  # not in a fork
            shutil.rmtree(folder, ignore_errors=True)

    atexit.register(remove)
    return folder


def _remove_unused(folder: Path) -> None:
    """Remove the folders of other versions of the kernels that nobody has used for a month."""
    with contextlib.suppress(OSError):
        for other in folder.parent.iterdir():
            if re.fullmatch("kernels-[0-9a-f]{16}", other.name) and _age_days(other) > UNUSED_DAYS_MAX:
                shutil.rmtree(other, ignore_errors=True)


def _age_days(folder: Path) -> float:
    """Return how long ago a folder was used; 0 for what is no folder."""
    status = folder.lstat()
    return (time.time() - status.st_mtime) / DAY_SECONDS if stat.S_ISDIR(status.st_mode) else 0.0


def _holds_kernels(folder: Path) -> bool:
    """Return whether there is a compiled kernel in a folder."""
    with contextlib.suppress(OSError), os.scandir(folder) as entries:
        return any(entry.name.endswith(ENDING) for entry in entries)
    return False


def _note_use(folder: Path) -> None:
    """Note, once a day, that a folder is used: one that is not is removed after a month."""
    with contextlib.suppress(OSError):
        if _age_days(folder) > 1:
            os.utime(folder)


DIGEST: Final = sources_digest()
STORE: Final = Store()
