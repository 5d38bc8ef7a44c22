"""Official logs of the made-up town in files."""

import gzip
import lzma

import pytest

from tests.recording.official_log import writer
from tests.recording.official_log.archive import archived

FORMS = {
    "town.log": writer.protobuf,
    "town-2022.log": lambda log: writer.protobuf(log, prefixed=True),
    "unframed.log": lambda log: writer.protobuf(log, framed=False),
    "town.log.lzma": lambda log: lzma.compress(writer.protobuf(log), format=lzma.FORMAT_ALONE),
    "alone.log.xz": lambda log: lzma.compress(writer.protobuf(log, prefixed=True), format=lzma.FORMAT_ALONE),
    "real.log.xz": lambda log: lzma.compress(writer.protobuf(log, prefixed=True), format=lzma.FORMAT_XZ),
    "town.log.gz": lambda log: gzip.compress(writer.protobuf(log)),
    "old.log": writer.old,
    "old.log.xz": lambda log: lzma.compress(writer.old(log)),
    "town.7z": archived,
    "town.json": writer.as_json,
    "numbers.json": lambda log: writer.as_json(log, numbers=True),
    "town.json.lzma": lambda log: lzma.compress(writer.as_json(log), format=lzma.FORMAT_ALONE),
}
"""How a log is written, by the name of a file."""


@pytest.fixture
def here(empty_folder):
    """The current folder, without the recordings that other tests of this room begin with."""
    return empty_folder


@pytest.fixture
def written(here):
    """A function that writes a log in a form, in the current folder, and returns its name."""

    def write(name, log=None):
        (here / name).write_bytes(FORMS[name](log or writer.Log()))
        return name

    return write


@pytest.fixture
def imported(written):
    """The town, imported, as a recording."""
    import fireworld as fw

    fw.import_log(written("town.log"), "town.mcap")
    return "town.mcap"
