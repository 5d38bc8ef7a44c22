"""7z archives as official kernels write them: a file for each record, each compressed by bzip2 on its own."""

from __future__ import annotations

import bz2
import struct
import zlib
from collections.abc import Mapping

from tests.recording.official_log.writer import Log, messages

NAMES = {1: "START_OF_LOG", 2: "INITIAL_CONDITIONS", 5: "CONFIG", 7: "END_OF_LOG"}


def number(n: int) -> bytes:
    """Write a number of an archive's header."""
    for n_more in range(8):
        if n < 1 << 7 * (n_more + 1):
            first = 0xFF & ~(0xFF >> n_more) | n >> 8 * n_more
            return bytes([first]) + (n & (1 << 8 * n_more) - 1).to_bytes(n_more, "little")
    return b"\xff" + n.to_bytes(8, "little")


def archive(files: Mapping[str, bytes]) -> bytes:
    """Pack files, each into a folder of its own; empty ones have none."""
    filled = {name: data for name, data in files.items() if data}
    packed = [bz2.compress(data) for data in filled.values()]
    n = number(len(packed))
    header = b"\x01"
    if packed:
        header += b"\x04\x06\0" + n + b"\x09" + b"".join(number(len(one)) for one in packed) + b"\0"
        header += b"\x07\x0b" + n + b"\0" + b"\x01\x03\x04\x02\x02" * len(packed)
        header += b"\x0c" + b"".join(number(len(data)) for data in filled.values())
        sums = b"".join(zlib.crc32(data).to_bytes(4, "little") for data in filled.values())
        header += b"\x0a\x01" + sums + b"\0" + b"\x08\0\0"
    header += b"\x05" + number(len(files))
    if len(filled) < len(files):
        bits = "".join("0" if data else "1" for data in files.values())
        body = int(bits.ljust(-(-len(bits) // 8) * 8, "0"), 2).to_bytes(-(-len(bits) // 8), "big")
        header += b"\x0e" + number(len(body)) + body
    texts = b"\0" + b"".join(f"{name}\0".encode("utf-16-le") for name in files)
    header += b"\x11" + number(len(texts)) + texts + b"\0\0"
    data = b"".join(packed)
    end = struct.pack("<QQI", len(data), len(header), zlib.crc32(header))
    return b"7z\xbc\xaf\x27\x1c\0\x04" + zlib.crc32(end).to_bytes(4, "little") + end + data + header


def entries(log: Log) -> dict[str, bytes]:
    """Return the entries of a log's archive."""
    found: dict[str, bytes] = {}
    time = log.first_step - 1
    for message in messages(log, prefixed=True):
        kind = message[0] >> 3
        time += kind == 4  # the first record of a step
        names = {3: f"{time}/COMMANDS", 4: f"{time}/PERCEPTION/60", 6: f"{time}/UPDATES"}
        found[names.get(kind) or NAMES[kind]] = message
    return found


def archived(log: Log) -> bytes:
    return archive(entries(log))
