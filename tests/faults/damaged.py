"""Logs that are damaged, altered with all checksums and hashes right, under way, or none at all."""

from __future__ import annotations

import dataclasses
import gzip
import io
import math
import random
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from fireworld_recorder.chain import Chain
from fireworld_recorder.codec import decode, encode
from fireworld_recorder.header import to_metadata
from fireworld_recorder.kind import RUN, LogKind
from fireworld_recorder.reader import raw_commits
from fireworld_recorder.recover import channels_of
from fireworld_recorder.scan import Scan, scan
from fireworld_recorder.schema import message_of
from fireworld_recorder.writer import StepFile
from mcap.writer import Writer as McapWriter

from fireworld.errors import LogError
from fireworld.records import DTYPES
from fireworld.training.log.records import TRAINING
from tests.fuzz import test_logs
from tests.fuzz.support import _edited

ODD_NUMBERS: Final = (
    0,
    1,
    -1,
    2,
    7,
    8,
    9,
    99,
    127,
    2**31 - 1,
    -(2**31),
    2**53,
    float("nan"),
    float("inf"),
    -1e300,
    1e-320,
)
ODD_TEXTS: Final = (
    "",
    "[/x]",
    "\x1b[31mred",
    "a\nb",
    "é🔥",
    "../../etc/passwd",
    "x" * 5000,
    "-1",
    "99999999999999999999",
    "nan",
    "planner:horizon=-1",
    "no_such_module:P",
    "paper-cooperative",
    "<script>alert(1)</script>",
    "\u202egnp",
)


@dataclass(frozen=True)
class Damaged:
    """A log that something was done to.

    Attributes:
        how: what was done, as in "cut".
        data: its bytes.
        values: what it says was altered, and its hashes with it.
    """

    how: str
    data: bytes
    values: bool = False


def kind_of(path: Path) -> LogKind:
    """Return what a good log is the log of."""
    try:
        scan(path, RUN)
    except LogError:
        return TRAINING
    return RUN


def cut(generator: random.Random, source: Path, _: Path) -> Damaged:
    data = source.read_bytes()
    return Damaged("cut", data[: generator.randrange(len(data))])


def flipped(generator: random.Random, source: Path, _: Path) -> Damaged:
    data = bytearray(source.read_bytes())
    for _number in range(generator.choice((1, 1, 1, 2, 5))):
        data[generator.randrange(len(data))] ^= 1 << generator.randrange(8)
    return Damaged("flipped", bytes(data))


def edited(generator: random.Random, source: Path, _: Path) -> Damaged:
    data = source.read_bytes()
    edits = [
        (
            generator.randrange(len(data)),
            generator.choice((0, 1, 4, 64, 4000)),
            generator.randbytes(generator.randrange(40)),
        )
        for _number in range(generator.choice((1, 2, 4)))
    ]
    return Damaged("edited", _edited(data, edits))


def spliced(generator: random.Random, source: Path, other: Path) -> Damaged:
    """The beginning of one log and the end of another."""
    a, b = source.read_bytes(), other.read_bytes()
    return Damaged("spliced", a[: generator.randrange(len(a))] + b[generator.randrange(len(b)) :])


def altered(generator: random.Random, source: Path, scratch: Path) -> Damaged:
    """Values that may not fit, with all hashes right."""
    found = scan(source, kind_of(source))
    parts = [[(topic, bytes(data)) for topic, data in raw] for raw in raw_commits(found)]
    first, how = found.first, "altered"
    for _ in range(generator.choice((1, 1, 2))):
        if generator.random() < 0.2:
            first = _altered_message(generator, found.kind.first_type, bytes(first))
            continue
        part = generator.choice(parts)
        if len(part) == 1:  # its only topic was taken out
            continue
        at = generator.randrange(len(part) - 1)
        types = {one.topic: one for one in found.kind.topics}
        topic, data = part[at]
        if generator.random() < 0.1:
            del part[at if at < len(part) - 1 else 0 :: len(part)]
            how = "a topic taken out"
        elif topic in types:
            part[at] = topic, _altered_message(generator, types[topic], data)
    return Damaged(how, chained(found, parts, scratch, first=bytes(first)), values=True)


def renamed(generator: random.Random, source: Path, scratch: Path) -> Damaged:
    """A header that says odd things, with a checksum that fits."""
    found = scan(source, kind_of(source))
    header = found.header
    items = [item.name for item in dataclasses.fields(header) if item.name != "attachments"]
    name = generator.choice([*items, "attachments", "attachments"])
    value: Any
    if name == "attachments":
        value = dict(header.attachments)
        chosen = generator.choice(sorted(value))
        if generator.random() < 0.3:
            del value[chosen]
        else:
            data = value[chosen]
            value[chosen] = generator.choice(
                (
                    b"",
                    b"{}",
                    b"\xff\xfe",
                    data[: len(data) // 2],
                    _edited(data, [(generator.randrange(len(data)), 1, b"9")]),
                )
            )
    elif isinstance(getattr(header, name), str):
        value = generator.choice(ODD_TEXTS)
    else:
        value = generator.choice((0, -1, 2**32, 10**30, 1))
    changed = dataclasses.replace(header, **{name: value})
    metadata = to_metadata(changed, found.kind)
    parts = [[(topic, bytes(data)) for topic, data in raw] for raw in raw_commits(found)]
    data = chained(found, parts, scratch, metadata=metadata, attachments=changed.attachments)
    return Damaged(f"header: {name}", data, values=True)


def foreign(generator: random.Random, source: Path, scratch: Path) -> Damaged:
    """A log of another program, or one of ours that another program has written anew."""
    file = io.BytesIO()
    writer = McapWriter(file)
    profile, library = generator.choice(
        (("", ""), ("ros2", "libmcap"), ("fireworld", "fireworld-log/9"), ("", "fireworld-log/1"))
    )
    writer.start(profile, library)
    if generator.random() < 0.5:
        found = scan(source, kind_of(source))
        writer.add_metadata(found.kind.metadata_name, found.metadata)
    schema = writer.register_schema("odd", "jsonschema", b"{}")
    for topic in generator.sample(["/odd", "/city", "/commit", "/plan", "/buildings"], 3):
        channel = writer.register_channel(topic, "json", schema)
        for number in range(generator.randrange(5)):
            writer.add_message(channel, number, generator.randbytes(generator.randrange(30)), number)
    writer.finish()
    return Damaged("foreign", file.getvalue())


def bombed(generator: random.Random, source: Path, _: Path) -> Damaged:
    """A few bytes that claim, or hold, far more."""
    data = source.read_bytes()
    at = test_logs._second_chunk(data)
    bombs: list[Callable[[], bytes]] = [
        lambda: test_logs.chunk(b"", size=2**40, compressed=test_logs._frame(2**40)),
        lambda: test_logs.chunk(b"", size=2**28, compressed=test_logs._frame(2**28)),
        lambda: test_logs.chunk(bytes(2**26)),
        lambda: test_logs.chunk(test_logs.record_of(0x81) * 2**20),
        lambda: test_logs.chunk(test_logs._channel() + test_logs._message() * 2**18),
        lambda: test_logs.record_of(generator.randrange(1, 16), generator.randbytes(40)),
    ]
    return Damaged("bombed", data[:at] + generator.choice(bombs)() + data[at:])


def no_log(generator: random.Random, source: Path, _: Path) -> Damaged:
    """Something else by the name of a log."""
    data = source.read_bytes()
    pointer = b"version https://git-lfs.github.com/spec/v1\noid sha256:" + b"0" * 64 + b"\nsize 9\n"
    others = (
        b"",
        gzip.compress(data),
        pointer,
        bytes(4096),
        b"name: quick\n",
        data[:8],
        data[8:],
        generator.randbytes(500),
    )
    return Damaged("no log", generator.choice(others))


MAKERS: Final[tuple[Callable[[random.Random, Path, Path], Damaged], ...]] = (
    cut,
    cut,
    flipped,
    flipped,
    flipped,
    edited,
    spliced,
    altered,
    altered,
    altered,
    renamed,
    foreign,
    bombed,
    no_log,
)


def damaged(generator: random.Random, source: Path, other: Path, scratch: Path) -> Damaged:
    """Do something to a log; `other` is spliced in, `scratch` a folder for files."""
    make = generator.choice(MAKERS)
    return make(generator, source, other if make is spliced else scratch)


def chained(
    found: Scan,
    parts: list[list[tuple[str, bytes]]],
    scratch: Path,
    *,
    first: bytes | None = None,
    metadata: Any = None,
    attachments: Any = None,
) -> bytes:
    """Write parts of a log, changed by whoever calls, with all hashes right; return the file's bytes."""
    first = bytes(found.first) if first is None else first
    path, commit_type = scratch / "chained.mcap", found.kind.commit_type
    chain = Chain(first, found.kind)
    with StepFile(
        path,
        metadata=metadata or found.metadata,
        attachments=found.header.attachments if attachments is None else attachments,
        channels=channels_of(found),
        city=first,
        kind=found.kind,
        force=True,
    ) as file:
        for number, part in enumerate(parts):
            *messages, (_, sealed) = part
            for topic, data in messages:
                chain.add(topic, data)
            commit = chain.seal(dataclasses.replace(decode(commit_type, sealed), hash=b""))
            file.commit(number, [*messages, (commit_type.topic, encode(commit))])
    data = path.read_bytes()
    path.unlink()
    return data


def _altered_message(generator: random.Random, record_type: type[Any], data: bytes) -> bytes:
    """Give a field of a record another value, or an array another length."""
    fields = getattr(message_of(record_type), "fields", ())
    if not fields or generator.random() < 0.15:
        return _edited(data, [(generator.randrange(len(data) + 1), generator.randrange(4), generator.randbytes(2))])
    try:
        record = decode(record_type, data)
        item = generator.choice(fields)
        value = _odd_value(generator, getattr(record, item.name), item)
        return encode(dataclasses.replace(record, **{item.name: value}))
    except (ValueError, OverflowError, TypeError, LogError):  # altered before; what cannot be written cannot be read
        return data


def _odd_value(generator: random.Random, value: Any, item: Any) -> Any:
    if item.repeated:
        return _odd_array(generator, np.array(value, np.dtype(DTYPES[item.wire])))
    if isinstance(value, bytes):
        return generator.choice((b"", b"\0" * 32, value[:-1], generator.randbytes(64)))
    if isinstance(value, str):
        return generator.choice(ODD_TEXTS)
    if isinstance(value, bool):
        return not value
    number = generator.choice(ODD_NUMBERS)
    return number if isinstance(value, float) or (math.isfinite(number) and abs(number) < 2**53) else 3


def _odd_array(generator: random.Random, array: Any) -> Any:
    """Return another length, or other numbers."""
    how, number = generator.randrange(5), generator.choice(ODD_NUMBERS)
    if how == 0:
        return array[: generator.randrange(len(array) + 1)]
    if how == 1:
        return np.concatenate([array, array[: 1 + generator.randrange(4)], np.zeros(1, array.dtype)])
    if array.dtype == np.uint8:
        number = abs(int(number)) % 128 if math.isfinite(number) else 99
    elif array.dtype.kind in "iu":
        info = np.iinfo(array.dtype)
        number = int(min(max(number, info.min // 2), info.max // 2)) if math.isfinite(number) else info.max
    with np.errstate(all="ignore"):
        odd = np.array(number).astype(array.dtype)
    if how == 2 or not len(array):
        return np.full(len(array) or 1, odd)
    array[generator.randrange(len(array))] = odd
    return array
