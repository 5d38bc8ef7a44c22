"""Read 7z archives as official kernels write them: each file compressed by one method, without encryption.

The layout is that of the format's public description, 7zFormat.txt. Only what is asked for is unpacked.
"""

from __future__ import annotations

import bz2
import lzma
import struct
import zlib
from collections.abc import Callable, Iterator
from typing import IO, Any, Final

from fireworld.errors import LogError
from fireworld.recording.official_log.parts import CutOffError
from fireworld.recording.official_log.seven_zip_header import (
    START_BYTES,
    ArchivedFile,
    Folder,
    Header,
    read_header,
    read_streams,
)
from fireworld.recording.official_log.source import Bytes

MAGIC: Final = b"7z\xbc\xaf\x27\x1c"
HEADER_BYTES_MAX: Final = 128 << 20
_START: Final = struct.Struct("<6s2sIQQI")
_ENCODED: Final = 23
_PACKED_HEADERS_MAX: Final = 4
"""How often the header may be packed within another; archivers do it once."""
_PIECE_BYTES: Final = 1 << 16


class Archive:
    """An archive in a file that is open for reading.

    Raises:
        LogError: it is cut off or damaged, or uses what is not read here.
    """

    def __init__(self, file: IO[bytes]) -> None:
        self._file = file
        self._n_bytes = file.seek(0, 2)
        header = self._last_header()
        for _ in range(_PACKED_HEADERS_MAX):
            if header[:1] != bytes([_ENCODED]):
                break
            folders, _ = read_streams(Header(header[1:]))
            if len(folders) != 1 or folders[0].n_unpacked > HEADER_BYTES_MAX:
                raise LogError("the header of the archive makes no sense")
            header = b"".join(self._pieces(folders[0]))
        self._folders, self.files = read_header(Header(header))
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
        start = self._file.read(START_BYTES)
        if len(start) < START_BYTES:
            raise LogError("the archive is cut off")
        _, _, crc, offset, n_bytes, header_crc = _START.unpack(start)
        if zlib.crc32(start[12:]) != crc:
            raise LogError("the archive was not closed, or its start is damaged")
        if n_bytes > HEADER_BYTES_MAX or START_BYTES + offset + n_bytes > self._n_bytes:
            raise LogError("the archive is cut off")
        self._file.seek(START_BYTES + offset)
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
