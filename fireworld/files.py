"""Files that a command or function is asked to write: may they be written, and nothing half-written bears a name."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

from fireworld.errors import OutputError, expected


def check_output(path: Path, *, force: bool = False, endings: Collection[str] = ()) -> None:
    """Refuse a file that could not be written, before the work is done that makes it.

    Args:
        path: the file.
        force: an existing file is replaced.
        endings: what its name may end in, as in (".png", ".svg"); empty: anything.

    Raises:
        OutputError: it exists, it is no regular file, its ending is another, or there is no folder for it.
    """
    if endings and path.suffix.lower() not in endings:
        raise OutputError(expected(str(path), "", f"a file ending in {', '.join(endings)}", path.suffix or "no ending"))
    if not path.parent.is_dir():
        raise OutputError(expected(str(path), "", f"an existing folder {path.parent}", "none", "make it first"))
    if path.is_dir():
        raise OutputError(expected(str(path), "", "the name of a file", "a folder"))
    if path.is_symlink() or (path.exists() and not path.is_file()):
        raise OutputError(expected(str(path), "", "the name of a regular file", "a link or a device"))
    if path.exists() and not force:
        raise OutputError(
            expected(str(path), "", "a name that is free", "an existing file", "use --force to replace it")
        )


def check_outputs(paths: Sequence[Path], *, force: bool = False, inputs: Sequence[Path] = ()) -> None:
    """Refuse files that could not all be written; as `check_output`, and no file may stand for two.

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


@contextmanager
def written_beside(path: Path) -> Iterator[Path]:
    """Yield where to write what gets the name `path` once it is whole.

    Nothing is left of it after an error or an interrupt; what a kill leaves has a name of its own.

    Raises:
        OutputError: it cannot be written.
    """
    partial = path.with_name(path.name + ".partial")
    try:
        yield partial
        partial.replace(path)
    except OSError as error:
        partial.unlink(missing_ok=True)
        raise OutputError(f"{path}: cannot be written: {error.strerror or error}") from None
    except BaseException:
        partial.unlink(missing_ok=True)
        raise


def write_file(path: Path, data: bytes) -> None:
    """Write a file, beside and renamed.

    Raises:
        OutputError: it cannot be written.
    """
    with written_beside(path) as partial:
        partial.write_bytes(data)


def write_files(contents: Mapping[Path, bytes]) -> None:
    """Write several files, each beside and renamed; errors as for `write_file`."""
    for path, data in contents.items():
        write_file(path, data)
