"""The header of a 7z archive: which files are where in it, by the format's public description, 7zFormat.txt."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from fireworld.errors import LogError

START_BYTES: Final = 32
"""Of what comes before all packed data."""
_END, _HEADER, _STREAMS, _FILES, _PACKED, _FOLDERS, _SUBSTREAMS = 0, 1, 4, 5, 6, 7, 8
_SIZE, _CRC, _FOLDER, _UNPACKED_SIZE, _N_SUBSTREAMS, _EMPTY, _NAMES = 9, 10, 11, 12, 13, 14, 17
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


class Header:
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


def read_header(header: Header) -> tuple[list[Folder], list[ArchivedFile]]:
    """Read the folders and the files of an archive."""
    header.expect(_HEADER)
    kind = header.number()
    folders: list[Folder] = []
    places: list[tuple[int, int, int, int | None]] = []
    if kind == _STREAMS:
        folders, places = read_streams(header)
        kind = header.number()
    if kind != _FILES:
        raise LogError("the header of the archive makes no sense")
    n = header.count()
    names, empty = [""] * n, [False] * n
    while (kind := header.number()) != _END:
        body = Header(header.take(header.number()))
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


def read_streams(header: Header) -> tuple[list[Folder], list[tuple[int, int, int, int | None]]]:
    """Read the folders, and for each file in them folder, offset, size and checksum."""
    header.expect(_PACKED)
    position, n_packed = START_BYTES + header.number(), header.count()
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


def _read_folders(header: Header) -> list[Folder]:
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


def _read_substreams(header: Header, folders: list[Folder]) -> list[tuple[int, int, int, int | None]]:
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
