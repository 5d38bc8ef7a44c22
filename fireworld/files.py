"""Files that are written beside their place and renamed: nothing half-written ever bears the name."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from fireworld.errors import OutputError, expected


def check_free(path: Path, *, force: bool = False) -> None:
    """Refuse an output that could not be written, before the work is done that makes it.

    Raises:
        OutputError: the file exists, or there is no folder for it.
    """
    if path.exists() and not force:
        raise OutputError(
            expected(str(path), "", "a name that is free", "an existing file", "use --force to replace it")
        )
    if path.is_dir() or not path.parent.is_dir():
        got = "a folder" if path.is_dir() else "no such folder"
        raise OutputError(expected(str(path), "", "a file in an existing folder", got))


@contextmanager
def written_beside(path: Path) -> Iterator[Path]:
    """Yield where to write what gets the name `path` once it is whole.

    Nothing is left of it after an error of the file system; what a kill leaves has a name of its own, in nobody's way.

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


def write_file(path: Path, data: bytes) -> None:
    """Write a file, beside and renamed.

    Raises:
        OutputError: it cannot be written.
    """
    with written_beside(path) as partial:
        partial.write_bytes(data)
