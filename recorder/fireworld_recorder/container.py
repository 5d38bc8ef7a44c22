"""Read an MCAP file that may be damaged: every length is checked before it is believed.

The readers of the mcap library trust record lengths, return nothing of a truncated file, and raise whatever a
flipped byte makes them stumble over; this reads the little of the container that a log uses. Every function raises
LogError for what is damaged, and TruncatedError where the file ends too early.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from typing import IO, Any, Final, NamedTuple

import zstandard
from mcap.opcode import Opcode

from fireworld.errors import LogError

MAGIC: Final = b"\x89MCAP0\r\n"
CHUNK_BYTES_MAX: Final = 1 << 28
"""A chunk holds a step, which is far below this even for a city of a million buildings."""

UNPACKED_BYTES_FREE: Final = 1 << 30
UNPACKED_RATIO_MAX: Final = 1000
"""A log of n bytes may unpack to that many bytes more than 1000 n: a small one cannot take minutes to unpack."""
MESSAGES_FREE: Final = 100_000
MESSAGE_BYTES_MIN: Final = 8
"""A log of n bytes may hold that many messages more than n / 8: the index alone takes more for each."""
REGISTRATIONS_MAX: Final = 1 << 17
"""Schemas and channels of one chunk: their numbers have 16 bits."""

_IN_CHUNK: Final = frozenset({int(Opcode.SCHEMA), int(Opcode.CHANNEL), int(Opcode.MESSAGE)})
_LAST: Final = frozenset({int(Opcode.DATA_END), int(Opcode.FOOTER)})
_RECORD: Final = struct.Struct("<BQ")
_MESSAGE: Final = struct.Struct("<HIQQ")
_FOOTER: Final = struct.Struct("<QQI")


class TruncatedError(LogError):
    """The file ends before its closing index: the run was killed, or is under way."""


class Record(NamedTuple):
    """A record of the file."""

    offset: int
    opcode: int
    head: bytes  # opcode and length, as in the file
    body: bytes


class ChannelRecord(NamedTuple):
    """A channel record."""

    id: int
    schema_id: int
    topic: str


class SchemaRecord(NamedTuple):
    """A schema record."""

    id: int
    name: str
    encoding: str
    data: bytes


class Fields:
    """The fields of a record body, read one after another."""

    def __init__(self, body: bytes | memoryview) -> None:
        self._body = memoryview(body)
        self._position = 0

    def numbers(self, layout: str) -> tuple[Any, ...]:
        """Read fixed-size numbers, by a struct layout."""
        raw = self._take(struct.calcsize(layout))
        return struct.unpack(layout, raw)

    def bytes(self, *, length_layout: str = "<I") -> memoryview:
        """Read bytes that follow their length."""
        (length,) = self.numbers(length_layout)
        return self._take(length)

    def text(self) -> str:
        """Read a text that follows its length."""
        try:
            return str(self.bytes(), "utf-8")
        except UnicodeDecodeError as error:
            raise LogError("a record holds text that is not UTF-8") from error

    def mapping(self) -> dict[str, str]:
        """Read a mapping of text to text that follows its length."""
        inner = Fields(self.bytes())
        pairs = {}
        while inner.left:
            key = inner.text()
            pairs[key] = inner.text()
        return pairs

    @property
    def left(self) -> int:
        """Bytes not read yet."""
        return len(self._body) - self._position

    def _take(self, length: int) -> memoryview:
        if length > self.left:
            raise LogError("a record is shorter than its fields")
        self._position += length
        return self._body[self._position - length : self._position]


def records(file: IO[bytes], size: int) -> Iterator[Record]:
    """Yield the records from the file's position on, to the end of the data section.

    Args:
        file: positioned at the start of a record.
        size: bytes of the file, or those of them to read.
    """
    offset = file.tell()
    while True:
        head = file.read(_RECORD.size)
        if len(head) < _RECORD.size:
            raise TruncatedError("the file ends without its closing index")
        opcode, length = _RECORD.unpack(head)
        if opcode == 0:
            raise LogError(f"byte {offset} is not the start of a record")
        if length > size - offset - _RECORD.size:
            _raise_overrun(file, size, offset)
        body = file.read(length)
        if len(body) < length:
            raise TruncatedError("the file ends inside a record")
        yield Record(offset, opcode, head, body)
        if opcode in _LAST:
            return
        offset += _RECORD.size + length


def _raise_overrun(file: IO[bytes], size: int, offset: int) -> None:
    """Raise for a record beyond the end: the file is cut off, or, if it has its closing bytes, a length is damaged."""
    file.seek(max(0, size - len(MAGIC)))
    if file.read(len(MAGIC)) == MAGIC:
        raise LogError(f"the record at byte {offset} has a length beyond the end of the file")
    raise TruncatedError("the file ends inside a record")


def check_tail(tail: bytes, offset: int) -> None:
    """Check all that follows the data section: index, footer, closing magic.

    Args:
        tail: the bytes after the data section.
        offset: where they begin in the file.
    """
    n_end = _RECORD.size + _FOOTER.size + len(MAGIC)
    if len(tail) < n_end or tail[-len(MAGIC) :] != MAGIC:
        raise TruncatedError("the closing index is not complete")
    opcode, length = _RECORD.unpack_from(tail, len(tail) - n_end)
    start, _, stored = _FOOTER.unpack_from(tail, len(tail) - n_end + _RECORD.size)
    checksum = zlib.crc32(tail[: -len(MAGIC) - 4])
    if (opcode, length) != (Opcode.FOOTER, _FOOTER.size) or start not in {0, offset} or stored not in {0, checksum}:
        raise LogError("the closing index is damaged")


def unpack_chunk(body: bytes, decompressor: zstandard.ZstdDecompressor) -> bytes:
    """Decompress a chunk and check its checksum.

    Args:
        body: of the chunk record.
        decompressor: used for chunk after chunk, because making one takes as long as a chunk.
    """
    fields = Fields(body)
    _, _, size, checksum = fields.numbers("<QQQI")
    compression = fields.text()
    packed = fields.bytes(length_layout="<Q")
    if size > CHUNK_BYTES_MAX:
        raise LogError(f"a chunk claims {size} bytes")
    if compression == "zstd":
        try:
            if zstandard.frame_content_size(packed) not in {size, -1}:
                raise LogError("a chunk is damaged")
            data = decompressor.decompress(packed, max_output_size=size)
        except zstandard.ZstdError as error:
            raise LogError("a chunk is damaged") from error
    elif compression == "":
        data = bytes(packed)
    else:
        raise LogError(f"expected chunks compressed with zstd, got {compression!r}")
    if len(data) != size or (checksum and zlib.crc32(data) != checksum):
        raise LogError("a chunk is damaged")
    return data


def split(block: bytes, position: int = 0) -> Iterator[tuple[int, int, memoryview]]:
    """Yield position, opcode and body of every record inside a chunk; LogError for one that does not belong there."""
    view, end = memoryview(block), len(block)
    while position < end:
        if end - position < _RECORD.size:
            raise LogError("a chunk ends inside a record")
        opcode, length = _RECORD.unpack_from(block, position)
        start = position + _RECORD.size
        if length > end - start:
            raise LogError("a chunk ends inside a record")
        if opcode not in _IN_CHUNK:  # else a few bytes could unpack to millions of useless records
            raise LogError(f"a chunk holds a record of type {opcode}")
        yield position, opcode, view[start : start + length]
        position = start + length


def read_header(body: bytes) -> tuple[str, str]:
    """Read the header record: the profile of the file and the library that wrote it."""
    fields = Fields(body)
    return fields.text(), fields.text()


def read_message(body: memoryview) -> tuple[int, memoryview]:
    """Return the channel and the payload of a message record."""
    if len(body) < _MESSAGE.size:
        raise LogError("a message is shorter than its head")
    return _MESSAGE.unpack_from(body)[0], body[_MESSAGE.size :]


def read_channel(body: memoryview) -> ChannelRecord:
    """Read a channel record."""
    fields = Fields(body)
    channel_id, schema_id = fields.numbers("<HH")
    return ChannelRecord(channel_id, schema_id, fields.text())


def read_schema(body: memoryview) -> SchemaRecord:
    """Read a schema record."""
    fields = Fields(body)
    (schema_id,) = fields.numbers("<H")
    return SchemaRecord(schema_id, fields.text(), fields.text(), bytes(fields.bytes()))


def read_attachment(body: bytes) -> tuple[str, bytes]:
    """Read an attachment record: its name and bytes."""
    fields = Fields(body)
    fields.numbers("<QQ")
    name = fields.text()
    fields.text()
    data = bytes(fields.bytes(length_layout="<Q"))
    (checksum,) = fields.numbers("<I")
    if checksum and checksum != zlib.crc32(body[:-4]):
        raise LogError(f"the attachment {name!r} is damaged")
    return name, data
