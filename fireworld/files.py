"""Files: what is read is a regular file of bounded size; what is written is checked first, and never half-written."""

from __future__ import annotations

import errno
import json
import math
import os
import secrets
import shutil
import stat
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, Any, Final

from fireworld.errors import FireworldError, OutputError, expected

KINDS: Final = {
    stat.S_IFDIR: "a folder", stat.S_IFIFO: "a pipe", stat.S_IFSOCK: "a socket",
    stat.S_IFCHR: "a device", stat.S_IFBLK: "a device",
}  # fmt: skip
"""What is at a path, where it is no regular file."""
TEXT_BYTES_MAX: Final = 1 << 24
PIECE_BYTES: Final = 1 << 20
SCRATCH: Final = ".fireworld-"
"""What the names of scratch folders begin with; after a kill they can be removed."""
PLACE_TRIES: Final = 100


def read_input(
    path: Path,
    *,
    what: str,
    n_bytes_max: int,
    error: type[FireworldError],
    source: str = "",
    key: str = "",
    or_names: str = "",
) -> bytes:
    """Read a regular file that is not larger than such a file can be.

    Args:
        path: the file.
        what: what it should be, as in "a city file".
        n_bytes_max: its greatest size.
        error: what is raised.
        source: what names the file in errors, if not its path.
        key: the key of the source that names the file.
        or_names: what else could have been given, for the error of a file that is not there.

    Raises:
        FireworldError: of the kind given: it is no regular file, is larger, or cannot be read.
    """
    where, suffix = source or str(path), f": {path}" if key else ""
    try:
        with open(path, "rb", opener=without_waiting) as file:
            status = os.fstat(file.fileno())
            size = status.st_size
            kind = KINDS.get(stat.S_IFMT(status.st_mode))
            content = b"" if kind or size > n_bytes_max else _read_most(file, n_bytes_max)
    except (OSError, ValueError) as fault:  # a path with a null byte is a ValueError
        reason = (fault.strerror if isinstance(fault, OSError) else None) or str(fault)
        raise error(expected(where, key, or_names or what, f"{reason}{suffix}")) from None
    if kind:
        raise error(expected(where, key, f"{what}, a regular file", f"{kind}{suffix}"))
    size = max(size, len(content))
    if size > n_bytes_max:
        raise error(expected(where, key, f"{what} of at most {n_bytes_max} bytes", f"{size} bytes{suffix}"))
    return content


def irregular(path: Path) -> str:
    """Return what is at a path that is no regular file, "" for one that is; OSError if there is nothing."""
    return KINDS.get(stat.S_IFMT(path.stat().st_mode), "")


def read_text_file(path: Path, *, strict: bool = False) -> str:
    """Read a text that belongs to an output.

    Args:
        path: the file.
        strict: raise for bytes that are no UTF-8, since the text is written again; else they are replaced.

    Raises:
        OutputError: it cannot be read, or is no such text.
    """
    content = read_input(path, what="a text", n_bytes_max=TEXT_BYTES_MAX, error=OutputError)
    try:
        return content.decode("utf-8", errors="strict" if strict else "replace")
    except UnicodeDecodeError as error:
        raise OutputError(expected(str(path), "", "UTF-8 text", f"another byte at offset {error.start}")) from None


def _read_most(file: IO[bytes], n_bytes_max: int) -> bytes:
    """Read a file, or a little more of it than it may have; piece by piece, since what is asked for takes memory."""
    pieces, n_bytes = [], 0
    while n_bytes <= n_bytes_max and (piece := file.read(PIECE_BYTES)):
        pieces.append(piece)
        n_bytes += len(piece)
    return b"".join(pieces)


def without_waiting(path: str, flags: int) -> int:
    """Open a file; a pipe that nobody writes to must not hold it up."""
    return os.open(path, flags | os.O_NONBLOCK)


def check_output(path: Path, *, force: bool = False, endings: Collection[str] = ()) -> None:
    """Check that a file could be written, before the work is done that makes it.

    Args:
        path: the file.
        force: an existing file is replaced.
        endings: what its name may end in, as in (".png", ".svg"); empty: anything.

    Raises:
        OutputError: it exists, it is no regular file, its ending is another, or there is no folder for it.
    """
    with _output_errors(path):
        if endings and path.suffix.lower() not in endings:
            raise OutputError(
                expected(str(path), "", f"a file ending in {', '.join(endings)}", path.suffix or "no ending")
            )
        _check_parent(path)
        if path.is_dir():
            raise OutputError(expected(str(path), "", "the name of a file", "a folder"))
        if path.is_symlink() or (path.exists() and not path.is_file()):
            raise OutputError(expected(str(path), "", "the name of a regular file", "a link or a device"))
        if path.exists() and not force:
            raise OutputError(
                expected(str(path), "", "a name that is free", "an existing file", "use --force to replace it")
            )


def check_outputs(paths: Sequence[Path], *, force: bool = False, inputs: Sequence[Path] = ()) -> None:
    """Check that files could be written, as `check_output` does, and that no name is given twice.

    Args:
        paths: the files.
        force: existing files are replaced.
        inputs: files that are read meanwhile.

    Raises:
        OutputError: one cannot be written, or bears the name of another or of an input.
    """
    taken = {path.absolute() for path in inputs}
    for path in paths:
        if path.absolute() in taken:
            raise OutputError(expected(str(path), "", "a file of its own for every input and output", "one name twice"))
        taken.add(path.absolute())
        check_output(path, force=force)


def check_folder(folder: Path, *, own: Collection[str], force: bool = False) -> None:
    """Check that a folder of files could be written, before the work is done that makes it.

    Args:
        folder: the folder.
        own: names of the files that it can hold.
        force: an existing folder is replaced, if it holds no other files.

    Raises:
        OutputError: it exists, it is no folder, it holds something else, or there is no folder for it.
    """
    with _output_errors(folder):
        _check_parent(folder)
        is_folder = not folder.is_symlink()
        try:
            found = sorted(path.name for path in folder.iterdir()) if is_folder else [folder.name]
        except FileNotFoundError:  # there is none; or in this moment another takes its place
            return
        except NotADirectoryError:
            is_folder, found = False, [folder.name]
    foreign = [name for name in found if name not in own or not is_folder]
    if foreign:
        got = f"{foreign[0]} in it" if is_folder else "a file or a link"
        raise OutputError(expected(str(folder), "", "a name that is free, or a folder written before", got))
    if found and not force:
        hint = "use --force to replace it"
        raise OutputError(
            expected(str(folder), "", "a name that is free or an empty folder", f"{found[0]} in it", hint)
        )


def _check_parent(path: Path) -> None:
    if not path.parent.is_dir():
        raise OutputError(expected(str(path), "", f"an existing folder {path.parent}", "none", "make it first"))


@contextmanager
def _output_errors(path: Path) -> Iterator[None]:
    """Turn faults of an output into one-line errors."""
    try:
        yield
    except OSError as error:
        raise OutputError(f"{path}: cannot be written: {error.strerror or error}") from None


@contextmanager
def written_beside(path: Path) -> Iterator[Path]:
    """Yield where to write what gets the name `path` once it is whole.

    Nothing is left of it after an error or an interrupt; what a kill leaves has a name of its own.

    Raises:
        OutputError: it cannot be written.
    """
    with _output_errors(path):
        path = path.absolute()  # whoever works meanwhile may change the current folder
        scratch = path.parent / f"{SCRATCH}{secrets.token_hex(8)}"
        partial = scratch / path.name
        try:
            scratch.mkdir(0o700)  # in here, so that an interrupt right after it leaves none
            yield partial
            partial.replace(path)
        finally:
            _remove(scratch)


def give_name(partial: Path, path: Path, *, free: bool) -> None:
    """Give a file its final name; if the name must be free, of many that do so at the same time one succeeds.

    Raises:
        OutputError: the name is taken.
        OSError: another fault of the output.
    """
    if not free:
        partial.replace(path)
        return
    try:
        path.hardlink_to(partial)
    except FileExistsError:
        check_output(path)
    except OSError:  # a file system without links
        check_output(path)
        partial.replace(path)
        return
    partial.unlink()


@contextmanager
def new_folder(folder: Path, *, own: Collection[str], force: bool = False) -> Iterator[Path]:
    """Yield a folder to write files in that takes the place of `folder` once all are in it.

    Nothing is left of it after an error or an interrupt, and an earlier folder stays. Arguments as for `check_folder`.

    Raises:
        OutputError: it cannot be written.
    """
    with _output_errors(folder):
        folder = folder.absolute()
        check_folder(folder, own=own, force=force)
        scratch = folder.parent / f"{SCRATCH}{secrets.token_hex(8)}"
        partial = scratch / folder.name
        try:
            scratch.mkdir(0o700)
            partial.mkdir()
            yield partial
            _take_place(partial, folder, scratch, own=own, force=force)
        finally:
            _remove(scratch)


def _take_place(partial: Path, folder: Path, scratch: Path, *, own: Collection[str], force: bool) -> None:
    """Give a folder its name; others may do the same at the same time, and the last one wins whole."""
    for number in range(PLACE_TRIES):
        replaced = scratch / f"replaced-{number}"
        try:
            check_folder(folder, own=own, force=force)
            with suppress(FileNotFoundError):
                folder.rename(replaced)
            partial.rename(folder)
        except BaseException as error:
            if replaced.exists() and not folder.exists():
                replaced.rename(folder)
            if not isinstance(error, OSError) or error.errno not in {errno.ENOTEMPTY, errno.EEXIST}:
                raise
        else:
            return
    raise OutputError(f"{folder}: cannot be written: others write it at the same time; try another name")


@contextmanager
def same_folder() -> Iterator[None]:
    """Come back to the current folder at the end, wherever users' code has gone, if it is still there."""
    try:
        before = Path.cwd()
    except OSError:
        before = None
    try:
        yield
    finally:
        with suppress(OSError):
            if before is not None and Path.cwd() != before:
                os.chdir(before)


def _remove(scratch: Path) -> None:
    """Remove a folder, all of it even if an interrupt comes meanwhile."""
    try:
        shutil.rmtree(scratch, ignore_errors=True)
    except BaseException:
        shutil.rmtree(scratch, ignore_errors=True)
        raise


def name_from(path: Path, folder: Path) -> str:
    """Name a file as a text in a folder does: relative to the folder, with slashes, the same on every machine.

    Raises:
        OutputError: there are bytes in the name that no text can hold.
    """
    name = Path(os.path.relpath(path.absolute(), folder.absolute())).as_posix()
    if name != text_of(name):
        raise OutputError(expected(text_of(name), "", "a name in UTF-8, to write it into a file", "other bytes"))
    return name


def text_of(name: str) -> str:
    """Return the name of a file as text: bytes in it that are none are written as Python writes them."""
    return name.encode("utf-8", "backslashreplace").decode()


def json_line(values: Mapping[str, Any]) -> str:
    """Return plain values as a line of JSON; null stands for what is no finite number."""
    plain = {key: None if isinstance(one, float) and not math.isfinite(one) else one for key, one in values.items()}
    return json.dumps(plain) + "\n"


def make_folder(folder: Path) -> None:
    """Make a folder, if it is not there (OutputError)."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"{folder}: cannot be made: {error.strerror or error}") from None


def write_file(path: Path, data: bytes | str) -> None:
    """Write a file, beside and renamed; a text as UTF-8, with any bytes of names in it as Python writes them.

    Raises:
        OutputError: it cannot be written.
    """
    with written_beside(path) as partial:
        partial.write_bytes(data if isinstance(data, bytes) else text_of(data).encode())
