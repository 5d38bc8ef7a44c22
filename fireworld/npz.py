"""Files of arrays (.npz) read with every claim checked before it is believed: sizes, shapes, and no objects in them."""

from __future__ import annotations

import lzma
import math
import struct
import tokenize
import warnings
import zipfile
import zlib
from collections.abc import Callable, Collection
from functools import partial
from typing import IO, Any, Final

from numpy.lib import format as npy

N_ARRAYS_MAX: Final = 10_000
HEADER_BYTES_MAX: Final = 1 << 16
UNPACKED_BYTES_FREE: Final = 256_000_000
UNPACKED_RATIO_MAX: Final = 100
"""A file of n bytes may unpack to that many bytes more than 100 n: a small file cannot fill the memory."""
UNREADABLE: Final = (
    OSError, ValueError, EOFError, LookupError, TypeError, MemoryError, OverflowError, RuntimeError, SyntaxError,
    zipfile.BadZipFile, zlib.error, lzma.LZMAError, struct.error, tokenize.TokenError,
)  # fmt: skip
"""What zipfile and numpy raise on damaged, encrypted or malicious files."""


class ArchiveError(ValueError):
    """What is wrong with a file of arrays: what was expected, and what was found.

    Attributes:
        key: the array at fault; empty for the whole file.
        wanted: what would have been right.
        got: what was found.
        detail: what was raised, if it was raised by what reads such files; else all of these.
    """

    def __init__(self, key: str, wanted: str, got: str, cause: Exception | None = None) -> None:
        whole = f"{key}: expected {wanted}, got {got}" if key else f"expected {wanted}, got {got}"
        super().__init__(whole)
        self.key, self.wanted, self.got = key, wanted, got
        self.detail = whole if cause is None else f"{type(cause).__name__}: {cause}"


def read_npz(file: IO[bytes], keys: Collection[str] | None = None) -> dict[str, Any]:
    """Return the arrays of a file by name; those of other names stay unread.

    Args:
        file: the file, which can be read in any order.
        keys: the names that are wanted; None: all.

    Raises:
        ArchiveError: it is no such file, it is damaged, or it holds more than such a file can.
    """
    size = file.seek(0, 2)
    file.seek(0)
    archive = _checked("", "a file with arrays (.npz)", lambda: zipfile.ZipFile(file))
    members = {item.filename.removesuffix(".npy"): item for item in archive.infolist()}
    if len(archive.infolist()) > N_ARRAYS_MAX:
        raise ArchiveError("", f"at most {N_ARRAYS_MAX} arrays", f"{len(members)} arrays")
    wanted = {name: item for name, item in members.items() if keys is None or name in keys}
    n_unpacked, most = sum(item.file_size for item in wanted.values()), UNPACKED_BYTES_FREE + UNPACKED_RATIO_MAX * size
    if n_unpacked > most:
        raise ArchiveError("", f"at most {most} bytes of arrays in a file of {size} bytes", f"{n_unpacked} bytes")
    what = "an array of numbers or text"
    return {name: _checked(name, what, partial(_read_member, archive, item)) for name, item in wanted.items()}


def _checked(key: str, wanted: str, read: Callable[[], Any]) -> Any:
    """Return what is read; whatever damage makes numpy and zipfile raise becomes an ArchiveError."""
    try:
        with warnings.catch_warnings(action="ignore"):  # arrays written by Python 2
            return read()
    except ArchiveError:
        raise
    except UNREADABLE as error:
        got = "objects, which may hide programs" if "Object arrays" in str(error) else "a damaged one"
        raise ArchiveError(key, wanted, got if key else "a damaged one or something else", error) from None


def _read_member(archive: zipfile.ZipFile, item: zipfile.ZipInfo) -> Any:
    """Read one array, once its header fits its size."""
    name = item.filename.removesuffix(".npy")
    with archive.open(item) as file:
        version = npy.read_magic(file)
        width, layout = (2, "<H") if version == (1, 0) else (4, "<I")
        (length,) = struct.unpack(layout, file.read(width))
        if length > HEADER_BYTES_MAX:
            raise ArchiveError(name, f"a header of at most {HEADER_BYTES_MAX} bytes", f"one of {length}")
    with archive.open(item) as file:
        npy.read_magic(file)
        read_header = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
        shape, _, dtype = read_header(file, max_header_size=HEADER_BYTES_MAX)
        n_bytes = math.prod(shape) * dtype.itemsize
        if not dtype.hasobject and n_bytes != item.file_size - file.tell():
            raise ArchiveError(name, f"the {n_bytes} bytes of an array of shape {shape}", f"{item.file_size} bytes")
    with archive.open(item) as file:
        return npy.read_array(file, allow_pickle=False, max_header_size=HEADER_BYTES_MAX)
