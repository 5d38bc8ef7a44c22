"""The bytes of an official log in order, unpacked as they are read: raw, .xz, .lzma or .gz by what is in the file."""

from __future__ import annotations

import lzma
import zlib
from collections.abc import Iterator
from typing import IO, Final

from fireworld.errors import LogError
from fireworld.recording.official_log.parts import CutOffError

PIECE_BYTES: Final = 1 << 18
"""Of the file and of what it unpacks to, at a time."""
BYTES_MAX: Final = 64 << 30
"""What a log unpacks to at most."""
MEMORY_MAX: Final = 96 << 20
"""What the unpacking of xz and lzma may take; official kernels write dictionaries of 16 MiB."""
_XZ: Final = b"\xfd7zXZ\x00"
_GZIP: Final = b"\x1f\x8b"
_HINTS: Final = {
    b"(\xb5/\xfd": "it is compressed: unpack it with zstd -d",
    b"7z\xbc\xaf": "a 7z archive cannot come from a pipe: write it to a file",
    b"BZh": "it is compressed: unpack it with bzip2 -d",
    b"PK": "it is an archive: unpack it",
    b"version ": "it is a pointer of Git LFS: fetch the file with git lfs pull",
    b"\x89MCAP": "it is a recording already: try `fireworld info`",
}


class Bytes:
    """A stream of bytes that is read once, front to back, and holds one piece in memory."""

    def __init__(self, pieces: Iterator[bytes]) -> None:
        self._pieces = pieces
        self._held = b""
        self._position = 0
        self.n_read = 0
        """Bytes that were taken so far."""

    def peek(self, n: int) -> bytes:
        """Return up to the next `n` bytes without taking them; fewer at the end."""
        while len(self._held) - self._position < n and self._more():
            pass
        return self._held[self._position : self._position + n]

    def at_end(self) -> bool:
        """Return whether nothing follows."""
        return not self.peek(1)

    def read(self, n: int) -> bytes:
        """Take the next `n` bytes.

        Raises:
            CutOffError: there are fewer.
        """
        found = self.peek(n)
        if len(found) < n:
            raise CutOffError(f"it ends at byte {self.n_read + len(found)}, within a record")
        self._position += n
        self.n_read += n
        return found

    def read_all(self) -> Iterator[bytes]:
        """Yield what is left, piece by piece."""
        while not self.at_end():
            yield self.read(len(self._held) - self._position)

    def skip(self, n: int) -> None:
        """Pass over the next `n` bytes; CutOffError if there are fewer."""
        while n:
            step = min(n, max(1, len(self._held) - self._position))
            self.read(step)
            n -= step

    def _more(self) -> bool:
        """Take the next piece to what is held; return whether there was one."""
        piece = next(self._pieces, b"")
        self._held = self._held[self._position :] + piece
        self._position = 0
        return bool(piece)


def unpacked(file: IO[bytes]) -> tuple[Bytes, str]:
    """Return the bytes that a file stands for, and how it is compressed; "" for a raw one.

    Reading them raises CutOffError where the file ends too early, LogError where it is damaged or unpacks to too much.

    Raises:
        LogError: its beginning is that of something else.
    """
    start = file.read(16)
    for begin, hint in _HINTS.items():
        if start.startswith(begin):
            raise LogError(f"expected the log of an official kernel, got a file that begins with {begin!r}; {hint}")
    if start.startswith(_GZIP):
        return Bytes(_limited(_inflate(file, start, _Gzip()))), "gzip"
    if start.startswith(_XZ):
        return Bytes(_limited(_inflate(file, start, _Lzma(lzma.FORMAT_XZ)))), "xz"
    if _is_lzma(start):
        return Bytes(_limited(_inflate(file, start, _Lzma(lzma.FORMAT_ALONE)))), "lzma"
    return Bytes(_limited(_raw(file, start))), ""


def _is_lzma(start: bytes) -> bool:
    """Return whether a file begins like the LZMA-alone container, which has no magic bytes.

    Properties below 225, a dictionary of a power of two or one and a half, and a size that is not known or sane.
    """
    if len(start) < 14 or start[0] >= 225 or start[13] != 0:
        return False
    dictionary, size = int.from_bytes(start[1:5], "little"), int.from_bytes(start[5:13], "little")
    round_size = dictionary & (dictionary - 1) == 0 or (dictionary // 3) & (dictionary // 3 - 1) == 0
    return dictionary >= 1 << 12 and round_size and (size == 2**64 - 1 or size <= BYTES_MAX)


class _Lzma:
    """Unpacks xz or lzma, piece by piece."""

    def __init__(self, form: int) -> None:
        self._decompressor = lzma.LZMADecompressor(form, memlimit=MEMORY_MAX)

    @property
    def eof(self) -> bool:
        """Whether the end of the compressed data was met."""
        return self._decompressor.eof

    @property
    def hungry(self) -> bool:
        """Whether it needs more bytes of the file."""
        return self._decompressor.needs_input

    @property
    def rest(self) -> bytes:
        """What follows the end."""
        return self._decompressor.unused_data

    def feed(self, data: bytes) -> bytes:
        """Take bytes of the file; return some of what they unpack to."""
        return self._decompressor.decompress(data, max_length=PIECE_BYTES)


class _Gzip:
    """Unpacks gzip, piece by piece."""

    def __init__(self) -> None:
        self._decompressor = zlib.decompressobj(wbits=31)

    @property
    def eof(self) -> bool:
        """Whether the end of the compressed data was met."""
        return self._decompressor.eof

    @property
    def hungry(self) -> bool:
        """Whether it needs more bytes of the file."""
        return not self._decompressor.unconsumed_tail

    @property
    def rest(self) -> bytes:
        """What follows the end."""
        return self._decompressor.unused_data

    def feed(self, data: bytes) -> bytes:
        """Take bytes of the file; return some of what they unpack to."""
        return self._decompressor.decompress(self._decompressor.unconsumed_tail + data, PIECE_BYTES)


def _inflate(file: IO[bytes], start: bytes, unpacker: _Lzma | _Gzip) -> Iterator[bytes]:
    """Yield what a compressed file unpacks to."""
    data = start
    try:
        while not unpacker.eof:
            if unpacker.hungry and not data:
                data = file.read(PIECE_BYTES)
                if not data:
                    raise CutOffError("the compressed file ends too early")
            piece = unpacker.feed(data)
            data = b""
            if piece:
                yield piece
    except (lzma.LZMAError, zlib.error) as error:
        raise LogError(f"it cannot be unpacked: {str(error).rstrip('.')}") from None
    if unpacker.rest.strip(b"\0") or file.read(1).strip(b"\0"):
        raise LogError("bytes follow the end of the compressed data")


def _raw(file: IO[bytes], start: bytes) -> Iterator[bytes]:
    data = start
    while data:
        yield data
        data = file.read(PIECE_BYTES)


def _limited(pieces: Iterator[bytes]) -> Iterator[bytes]:
    """Pass pieces on until they are more than a log can be."""
    n_bytes = 0
    for piece in pieces:
        n_bytes += len(piece)
        if n_bytes > BYTES_MAX:
            raise LogError(f"expected at most {BYTES_MAX >> 30} GiB unpacked, got more")
        yield piece
