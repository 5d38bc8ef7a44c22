"""Read 7z archives as official kernels write them: each file compressed by one method, without encryption.

The layout is that of the format's public description, 7zFormat.txt. Only what is asked for is unpacked.
"""

from __future__ import annotations

import bz2
import lzma
import struct
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import IO, Any, Final

from fireworld.errors import LogError
from fireworld.recording.official_log.parts import CutOffError
from fireworld.recording.official_log.source import Bytes

MAGIC: Final = b"7z\xbc\xaf\x27\x1c"
HEADER_BYTES_MAX: Final = 128 << 20
_START: Final = struct.Struct("<6s2sIQQI")
_END, _HEADER, _STREAMS, _FILES, _PACKED, _FOLDERS, _SUBSTREAMS = 0, 1, 4, 5, 6, 7, 8
_SIZE, _CRC, _FOLDER, _UNPACKED_SIZE, _N_SUBSTREAMS, _EMPTY, _NAMES, _ENCODED = 9, 10, 11, 12, 13, 14, 17, 23
_PIECE_BYTES: Final = 1 << 16
_COMPLEX, _WITH_PROPERTIES = 0x10, 0x20


@dataclass
class Folder:
    """Files that are compressed together, one after another; kernels write one file in each."""

    method: bytes
    properties: bytes
    offset: int = 0
    """Where it begins in the archive."""
    n_packed: int = 0
    """Its bytes there."""
    n_unpacked: int = 0
    crc: int | None = None


@dataclass(frozen=True)
class ArchivedFile:
    """A file of an archive."""

    name: str
    folder: int
    offset: int
    """Where it begins in its unpacked folder."""
    n_bytes: int
    crc: int | None


class Archive:
    """An archive in a file that is open for reading.

    Raises:
        LogError: it is cut off or damaged, or uses what is not read here.
    """

    def __init__(self, file: IO[bytes]) -> None:
        self._file = file
        self._n_bytes = file.seek(0, 2)
        header = self._last_header()
        while header[:1] == bytes([_ENCODED]):
            folders, _ = _read_streams(_Header(header[1:]))
            if len(folders) != 1 or folders[0].n_unpacked > HEADER_BYTES_MAX:
                raise LogError("the header of the archive makes no sense")
            header = b"".join(self._pieces(folders[0]))
        self._folders, self.files = _read_header(_Header(header))
        self._folder, self._stream = -1, Bytes(iter(()))
        """The folder that was read last, and what is left of it."""

    def read(self, file: ArchivedFile) -> bytes:
        """Unpack a file; of one folder, files in their order are the least work."""
        if file.folder != self._folder or self._stream.n_read > file.offset:
            self._folder, self._stream = file.folder, Bytes(self._pieces(self._folders[file.folder]))
        try:
            self._stream.skip(file.offset - self._stream.n_read)
            found = self._stream.read(file.n_bytes)
        except CutOffError:
            raise LogError(f"{file.name}: it is shorter than its archive says") from None
        if self._stream.n_read == self._folders[file.folder].n_unpacked:
            self._stream.at_end()  # so that the checksum of the folder is compared
        if file.crc is not None and zlib.crc32(found) != file.crc:
            raise LogError(f"{file.name}: its checksum does not fit")
        return found

    def _last_header(self) -> bytes:
        """Return the header at the end of the archive."""
        self._file.seek(0)
        start = self._file.read(_START.size)
        if len(start) < _START.size:
            raise LogError("the archive is cut off")
        _, _, crc, offset, n_bytes, header_crc = _START.unpack(start)
        if zlib.crc32(start[12:]) != crc:
            raise LogError("the archive was not closed, or its start is damaged")
        if n_bytes > HEADER_BYTES_MAX or _START.size + offset + n_bytes > self._n_bytes:
            raise LogError("the archive is cut off")
        self._file.seek(_START.size + offset)
        header = self._file.read(n_bytes)
        if zlib.crc32(header) != header_crc:
            raise LogError("the header of the archive is damaged")
        return header

    def _pieces(self, folder: Folder) -> Iterator[bytes]:
        """Yield what a folder unpacks to, piece by piece."""
        if folder.offset + folder.n_packed > self._n_bytes:
            raise LogError("the archive is cut off")
        unpack = _unpacker(folder)
        done, crc = 0, 0
        for start in range(0, folder.n_packed, _PIECE_BYTES):
            if done == folder.n_unpacked:
                break
            self._file.seek(folder.offset + start)
            data = self._file.read(min(_PIECE_BYTES, folder.n_packed - start))
            while done < folder.n_unpacked:
                try:
                    piece = unpack(data, _PIECE_BYTES)
                except (OSError, EOFError, ValueError, lzma.LZMAError, zlib.error):
                    raise LogError("compressed data of the archive is damaged") from None
                if not piece:
                    break
                data = b""
                piece = piece[: folder.n_unpacked - done]
                done, crc = done + len(piece), zlib.crc32(piece, crc)
                if piece:
                    yield piece
        if done != folder.n_unpacked or (folder.crc is not None and crc != folder.crc):
            raise LogError("compressed data of the archive is damaged")


def _unpacker(folder: Folder) -> Callable[[bytes, int], bytes]:
    """Return what takes packed bytes and a limit, and returns unpacked ones; called again with none, what is left."""
    properties = folder.properties
    if folder.method == b"\0":
        return lambda data, _: data
    if folder.method == b"\4\1\x08":
        inflate = zlib.decompressobj(wbits=-15)
        return lambda data, most: inflate.decompress(inflate.unconsumed_tail + data, most)
    unpacker: Any
    if folder.method == b"\4\2\2":
        unpacker = bz2.BZ2Decompressor()
    elif folder.method == b"\3\1\1" and len(properties) == 5 and properties[0] < 225:
        number, dictionary = properties[0], int.from_bytes(properties[1:], "little")
        settings = {"lc": number % 9, "lp": number // 9 % 5, "pb": number // 45}
        unpacker = _raw_lzma({"id": lzma.FILTER_LZMA1, "dict_size": dictionary, **settings})
    elif folder.method == b"\x21" and len(properties) == 1 and properties[0] < 40:
        dictionary = (2 | properties[0] & 1) << (properties[0] // 2 + 11)
        unpacker = _raw_lzma({"id": lzma.FILTER_LZMA2, "dict_size": dictionary})
    else:
        raise LogError(f"the archive is compressed by method {folder.method.hex()}; expected bzip2, lzma or deflate")
    return lambda data, most: b"" if unpacker.eof else unpacker.decompress(data, most)


def _raw_lzma(settings: dict[str, Any]) -> lzma.LZMADecompressor:
    if settings["dict_size"] > 1 << 26:
        raise LogError("the archive takes more than 64 MiB of memory to be unpacked")
    return lzma.LZMADecompressor(lzma.FORMAT_RAW, filters=[settings])


class _Header:
    """The bytes of a header, taken front to back."""

    def __init__(self, data: bytes) -> None:
        self._data = data
        self._position = 0

    @property
    def n_left(self) -> int:
        """Bytes that are left."""
        return len(self._data) - self._position

    def take(self, n: int) -> bytes:
        """Take bytes."""
        end = self._position + n
        if end > len(self._data):
            raise LogError("the header of the archive makes no sense")
        found = self._data[self._position : end]
        self._position = end
        return found

    def number(self) -> int:
        """Take a number: as many bytes follow the first as it has leading ones, and its other bits are the highest."""
        first = self.take(1)[0]
        n_more = 8 - (first ^ 0xFF).bit_length()
        return int.from_bytes(self.take(n_more), "little") | (first & 0x7F >> n_more) << 8 * n_more

    def count(self) -> int:
        """Take how many of something follow, each with a byte at least."""
        n = self.number()
        if n > len(self._data):
            raise LogError("the header of the archive makes no sense")
        return n

    def bits(self, n: int) -> list[bool]:
        """Take a bit for each of n."""
        data = self.take((n + 7) // 8)
        return [bool(data[k // 8] & 0x80 >> k % 8) for k in range(n)]

    def checksums(self, n: int) -> list[int | None]:
        """Take the checksums of n, of which some may have none."""
        known = [True] * n if self.take(1) == b"\1" else self.bits(n)
        return [int.from_bytes(self.take(4), "little") if has else None for has in known]

    def expect(self, kind: int) -> None:
        """Take the number of a part, which must be this."""
        if self.number() != kind:
            raise LogError("the header of the archive makes no sense")


def _read_header(header: _Header) -> tuple[list[Folder], list[ArchivedFile]]:
    """Read the folders and the files of an archive."""
    header.expect(_HEADER)
    kind = header.number()
    folders: list[Folder] = []
    places: list[tuple[int, int, int, int | None]] = []
    if kind == _STREAMS:
        folders, places = _read_streams(header)
        kind = header.number()
    if kind != _FILES:
        raise LogError("the header of the archive makes no sense")
    n = header.count()
    names, empty = [""] * n, [False] * n
    while (kind := header.number()) != _END:
        body = _Header(header.take(header.number()))
        if kind == _NAMES:
            body.expect(0)
            texts = body.take(body.n_left).decode("utf-16-le", "replace").split("\0")
            names = texts[:n] if len(texts) > n else names
        elif kind == _EMPTY:
            empty = body.bits(n)
    if n - sum(empty) != len(places):
        raise LogError("the header of the archive makes no sense")
    with_data = (name for name, none in zip(names, empty, strict=True) if not none)
    return folders, [ArchivedFile(name, *place) for name, place in zip(with_data, places, strict=True)]


def _read_streams(header: _Header) -> tuple[list[Folder], list[tuple[int, int, int, int | None]]]:
    """Read the folders, and for each file in them folder, offset, size and checksum."""
    header.expect(_PACKED)
    position, n_packed = _START.size + header.number(), header.count()
    header.expect(_SIZE)
    sizes = [header.number() for _ in range(n_packed)]
    if (kind := header.number()) == _CRC:
        header.checksums(n_packed)
        kind = header.number()
    if kind != _END:
        raise LogError("the header of the archive makes no sense")
    folders = _read_folders(header)
    if len(folders) != n_packed:
        raise LogError("the archive is packed in a way that is not read here")
    for folder, size in zip(folders, sizes, strict=True):
        folder.offset, folder.n_packed = position, size
        position += size
    if (kind := header.number()) == _SUBSTREAMS:
        places = _read_substreams(header, folders)
        kind = header.number()
    else:
        places = [(k, 0, folder.n_unpacked, folder.crc) for k, folder in enumerate(folders)]
    if kind != _END:
        raise LogError("the header of the archive makes no sense")
    return folders, places


def _read_folders(header: _Header) -> list[Folder]:
    header.expect(_FOLDERS)
    header.expect(_FOLDER)
    n = header.count()
    header.expect(0)
    folders = []
    for _ in range(n):
        header.expect(1)  # one method; more are chains of filters, and encryption
        flags = header.take(1)[0]
        method = header.take(flags & 0xF)
        if flags & _COMPLEX:
            raise LogError("the archive is packed in a way that is not read here")
        folders.append(Folder(method, header.take(header.number()) if flags & _WITH_PROPERTIES else b""))
    header.expect(_UNPACKED_SIZE)
    for folder in folders:
        folder.n_unpacked = header.number()
    if (kind := header.number()) == _CRC:
        for folder, crc in zip(folders, header.checksums(n), strict=True):
            folder.crc = crc
        kind = header.number()
    if kind != _END:
        raise LogError("the header of the archive makes no sense")
    return folders


def _read_substreams(header: _Header, folders: list[Folder]) -> list[tuple[int, int, int, int | None]]:
    counts = [1] * len(folders)
    if (kind := header.number()) == _N_SUBSTREAMS:
        counts = [header.count() for _ in folders]
        kind = header.number()
    found: list[tuple[int, int, int]] = []
    for k, (folder, n) in enumerate(zip(folders, counts, strict=True)):
        offset = 0
        for index in range(n):
            last = index == n - 1
            size = folder.n_unpacked - offset if last else (header.number() if kind == _SIZE else -1)
            if size < 0:
                raise LogError("the header of the archive makes no sense")
            found.append((k, offset, size))
            offset += size
    if kind == _SIZE:
        kind = header.number()
    alone = [counts[k] == 1 and folders[k].crc is not None for k, _, _ in found]
    checksums: list[int | None] = [folders[k].crc if own else None for (k, _, _), own in zip(found, alone, strict=True)]
    if kind == _CRC:
        missing = [index for index, own in enumerate(alone) if not own]
        for index, crc in zip(missing, header.checksums(len(missing)), strict=True):
            checksums[index] = crc
        kind = header.number()
    if kind != _END:
        raise LogError("the header of the archive makes no sense")
    return [(*place, crc) for place, crc in zip(found, checksums, strict=True)]
