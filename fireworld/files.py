"""Files and folders that a command or function is asked to write: checks, and nothing half-written bears a name."""

from __future__ import annotations

import errno
import os
import secrets
import shutil
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final

from fireworld.errors import OutputError, expected

SCRATCH: Final = ".fireworld-"
"""What the names of scratch folders begin with; after a kill they can be removed."""
PLACE_TRIES: Final = 100


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
        if not folder.exists() and not folder.is_symlink():
            return
        is_folder = folder.is_dir() and not folder.is_symlink()
        found = sorted(path.name for path in folder.iterdir()) if is_folder else [folder.name]
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


def write_file(path: Path, data: bytes | str) -> None:
    """Write a file, beside and renamed; a text as UTF-8, with any bytes of names in it as Python writes them.

    Raises:
        OutputError: it cannot be written.
    """
    with written_beside(path) as partial:
        partial.write_bytes(data if isinstance(data, bytes) else data.encode("utf-8", "backslashreplace"))
