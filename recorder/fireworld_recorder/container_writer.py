"""Write an MCAP file a chunk at a time, indexes and summary included; every chunk is flushed.

The writer of the mcap library makes objects for every message and every number of an index, which takes longer than
all else about a step. So the records that come with each step are packed here, the others by the library.
"""

from __future__ import annotations

import functools
import struct
import zlib
from collections.abc import Iterable, Mapping, Sequence
from typing import IO, Final

import zstandard
from mcap import records
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode

from fireworld_recorder.codec import long_fields
from fireworld_recorder.container import MAGIC

COMPRESSION_LEVEL: Final = 3
LONG_FIELD_BYTES: Final = 6000
"""A field as long as this gets blocks of its own in the compressed chunk, and with them codes that suit its numbers:
a log of a large fire is 4 % smaller. For shorter ones that takes more time than it saves space."""
DENSE_SHARE: Final = 0.4
"""After a chunk that was compressed to a smaller share than this, no field of the next one gets blocks of its own."""

# Plain integers, because members of an enumeration are slow to pack.
_MESSAGE_OPCODE, _MESSAGE_INDEX_OPCODE, _CHUNK_OPCODE, _CHUNK_INDEX_OPCODE = (
    int(opcode) for opcode in (Opcode.MESSAGE, Opcode.MESSAGE_INDEX, Opcode.CHUNK, Opcode.CHUNK_INDEX)
)
_HEAD: Final = struct.Struct("<BQ")
_MESSAGE: Final = struct.Struct("<BQH")
_STAMP: Final = struct.Struct("<IQQ")
"""Sequence, log and publish time: what follows the channel in the record of a message, before the payload."""
_BEFORE_PAYLOAD: Final = _MESSAGE.size + _STAMP.size
_COUNTED: Final = _BEFORE_PAYLOAD - _HEAD.size
"""Bytes before the payload that count in the record's length."""
_COMPRESSION: Final = b"\x04\0\0\0zstd"
_CHUNK: Final = struct.Struct("<BQQQQI8sQ")
_MESSAGE_INDEX: Final = struct.Struct("<BQHI")
_PLACE: Final = struct.Struct("<QQ")
"""Time and position of a message."""
_SUMMARY: Final = (
    Opcode.SCHEMA,
    Opcode.CHANNEL,
    Opcode.STATISTICS,
    Opcode.CHUNK_INDEX,
    Opcode.ATTACHMENT_INDEX,
    Opcode.METADATA_INDEX,
)
"""What the summary holds, in this order."""


class ContainerWriter:
    """An MCAP file under way. The caller closes the file, after `finish`.

    Args:
        file: a new file.
        profile: name of the content's kind, for the header.
        library: name of the writer, for the header.
    """

    def __init__(self, file: IO[bytes], *, profile: str, library: str) -> None:
        self._file = file
        self._compressor = zstandard.ZstdCompressor(level=COMPRESSION_LEVEL)
        self._dense = True  # whether the chunk before did not compress well
        self._n_bytes = 0
        self._checksum = 0
        self._registrations: list[bytes] = []  # those that no chunk holds yet
        self._summary: dict[Opcode, list[bytes]] = {opcode: [] for opcode in _SUMMARY}
        self._chunk_indexes = self._summary[Opcode.CHUNK_INDEX]
        self._n_messages: dict[int, int] = {}
        self._times: list[int] = []
        self._write(MAGIC, _packed(records.Header(profile, library)))

    def add_metadata(self, name: str, data: Mapping[str, str]) -> None:
        """Write a metadata record."""
        record = _packed(records.Metadata(name, dict(data)))
        index = records.MetadataIndex(self._n_bytes, len(record), name)
        self._summary[Opcode.METADATA_INDEX].append(_packed(index))
        self._write(record)

    def add_attachment(self, name: str, media_type: str, data: bytes) -> None:
        """Write an attachment of time 0."""
        record = _packed(records.Attachment(0, 0, name, media_type, data))
        index = records.AttachmentIndex(self._n_bytes, len(record), 0, 0, len(data), name, media_type)
        self._summary[Opcode.ATTACHMENT_INDEX].append(_packed(index))
        self._write(record)

    def register(self, topic: str, *, schema_name: str, schema: bytes, encoding: str) -> int:
        """Add a channel with its schema to the next chunk; return its number, which is from 1 on."""
        number = len(self._summary[Opcode.CHANNEL]) + 1
        pair = _registration(number, topic, schema_name, schema, encoding)
        self._registrations += pair
        for opcode, record in zip((Opcode.SCHEMA, Opcode.CHANNEL), pair, strict=True):
            self._summary[opcode].append(record)
        return number

    def write_chunk(self, messages: Iterable[tuple[int, bytes]], *, time: int, sequence: int) -> None:
        """Write messages as a chunk, and flush the file.

        Args:
            messages: channel and payload, at least one.
            time: log and publish time of all of them, nanoseconds.
            sequence: of all of them.
        """
        parts, self._registrations = self._registrations, []
        position, stamp = sum(map(len, parts)), _STAMP.pack(sequence, time, time)
        places: dict[int, bytes] = {}  # of each channel: time and position of every message
        n_messages = self._n_messages
        cuts: list[int] = []
        for channel, payload in messages:
            n_bytes = len(payload)
            parts.append(_MESSAGE.pack(_MESSAGE_OPCODE, _COUNTED + n_bytes, channel))
            parts.append(stamp)
            parts.append(payload)
            place = _PLACE.pack(time, position)
            places[channel] = places[channel] + place if channel in places else place
            n_messages[channel] = n_messages.get(channel, 0) + 1
            position += _BEFORE_PAYLOAD
            if self._dense and n_bytes > LONG_FIELD_BYTES:
                cuts += [position + edge for field in long_fields(payload, LONG_FIELD_BYTES) for edge in field]
            position += n_bytes
        block = b"".join(parts)
        packed = self._compress(block, cuts)
        self._dense = len(packed) > DENSE_SHARE * len(block)
        head = _CHUNK.pack(
            _CHUNK_OPCODE,
            _CHUNK.size - _HEAD.size + len(packed),
            time,
            time,
            len(block),
            zlib.crc32(block),
            _COMPRESSION,
            len(packed),
        )
        indexes = [_index_head(channel, len(found)) + found for channel, found in places.items()]
        self._index(places, time=time, n_bytes=len(block), n_packed=len(packed))
        self._write(head, packed, *indexes)
        self._file.flush()

    def finish(self) -> None:
        """Write the end of the data, the summary and the footer."""
        self._write(_packed(records.DataEnd(self._checksum)))
        counts = {opcode: len(found) for opcode, found in self._summary.items()}
        statistics = records.Statistics(
            attachment_count=counts[Opcode.ATTACHMENT_INDEX],
            channel_count=counts[Opcode.CHANNEL],
            channel_message_counts=self._n_messages,
            chunk_count=counts[Opcode.CHUNK_INDEX],
            message_count=sum(self._n_messages.values()),
            message_end_time=max(self._times, default=0),
            message_start_time=min(self._times, default=0),
            metadata_count=counts[Opcode.METADATA_INDEX],
            schema_count=counts[Opcode.SCHEMA],
        )
        self._summary[Opcode.STATISTICS].append(_packed(statistics))
        start = self._n_bytes
        groups, offsets, position = [], [], start
        for opcode in _SUMMARY:
            group = b"".join(self._summary[opcode])
            groups.append(group)
            offsets.append(_packed(records.SummaryOffset(opcode, position, len(group))))
            position += len(group)
        summary = b"".join(groups + offsets)
        footer = _packed(records.Footer(start, position, 0))[:-4]  # its last field is the checksum
        checksum = zlib.crc32(footer, zlib.crc32(summary))
        self._write(summary, footer, struct.pack("<I", checksum), MAGIC)
        self._file.flush()

    def _compress(self, block: bytes, cuts: Sequence[int]) -> bytes:
        """Compress a chunk to one zstd frame, in which new blocks begin at the cuts, rising positions."""
        if not cuts:
            return self._compressor.compress(block)
        frame = self._compressor.compressobj(size=len(block))
        view, start = memoryview(block), 0
        parts: list[bytes] = []
        for cut in dict.fromkeys(cuts):  # where a field ends, the next may begin
            parts += (frame.compress(view[start:cut]), frame.flush(zstandard.COMPRESSOBJ_FLUSH_BLOCK))
            start = cut
        return b"".join((*parts, frame.compress(view[start:]), frame.flush()))

    def _index(self, places: Mapping[int, bytes], *, time: int, n_bytes: int, n_packed: int) -> None:
        """Add the chunk that is written next to the index of the summary."""
        chunk_bytes = _CHUNK.size + n_packed
        first = offset = self._n_bytes + chunk_bytes
        offsets: list[int] = []
        for channel, found in places.items():
            offsets += (channel, offset)
            offset += _MESSAGE_INDEX.size + len(found)
        layout = _chunk_index(len(places))
        self._chunk_indexes.append(
            layout.pack(
                _CHUNK_INDEX_OPCODE,
                layout.size - _HEAD.size,
                time,
                time,
                self._n_bytes,
                chunk_bytes,
                10 * len(places),
                *offsets,
                offset - first,
                _COMPRESSION,
                n_packed,
                n_bytes,
            )
        )
        self._times.append(time)

    def _write(self, *parts: bytes) -> None:
        data = b"".join(parts)
        self._checksum = zlib.crc32(data, self._checksum)
        self._n_bytes += len(data)
        self._file.write(data)


def _packed(record: records.McapRecord) -> bytes:
    """Pack one record as the library does."""
    builder = RecordBuilder()
    record.write(builder)
    data: bytes = builder.end()  # type: ignore[no-untyped-call]  # the library leaves it without types
    return data


@functools.lru_cache(maxsize=1024)
def _registration(number: int, topic: str, schema_name: str, schema: bytes, encoding: str) -> tuple[bytes, bytes]:
    """Pack the records of a schema and of its channel; every log of a kind begins with the same."""
    one = records.Schema(number, schema, encoding, schema_name)
    other = records.Channel(number, topic, encoding, {}, number)
    return _packed(one), _packed(other)


@functools.cache
def _index_head(channel: int, n_bytes: int) -> bytes:
    """Return what comes before the places of a channel's messages in their index, (n_bytes) of them."""
    return _MESSAGE_INDEX.pack(_MESSAGE_INDEX_OPCODE, _MESSAGE_INDEX.size - _HEAD.size + n_bytes, channel, n_bytes)


@functools.cache
def _chunk_index(n_channels: int) -> struct.Struct:
    """Return the layout of an index of a chunk with messages of so many channels."""
    return struct.Struct(f"<BQQQQQI{'HQ' * n_channels}Q8sQQ")
