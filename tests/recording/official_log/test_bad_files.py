"""Files that are no official logs, or damaged: one line, and nothing is left; cut-off logs end earlier."""

import gzip
import io
import lzma
import random

import pytest

import fireworld as fw
from fireworld.errors import FireworldError, LogError, OutputError
from fireworld.recording.official_log import source
from tests.recording.official_log import writer
from tests.recording.official_log.archive import archive
from tests.recording.official_log.conftest import FORMS
from tests.recording.official_log.writer import Log, part, varint


def refused(here, data, name="bad.log"):
    """Import bytes that are to be refused; return the error."""
    (here / name).write_bytes(data)
    with pytest.raises(LogError) as error:
        fw.import_log(name, "bad.mcap")
    assert [path.name for path in here.iterdir()] == [name]
    text = str(error.value)
    assert text.startswith(f"{name}: ")
    assert "\n" not in text
    return text.removeprefix(f"{name}: ")


def framed(*messages):
    return b"".join(len(one).to_bytes(4, "big") + one for one in messages)


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "an empty file"),
        (b"hello, world\n" * 100, "a file that begins with b'hello, w'"),
        (b"PK\x03\x04" + bytes(100), "it is an archive"),
        (b"BZh9" + bytes(100), "unpack it with bzip2"),
        (b"\x89MCAP0\r\n" + bytes(100), "it is a recording already"),
        (lzma.compress(b"no log"), "a file that begins with b'no log'"),
        (b'{"buildings": []}', 'expected {"records": [...]}'),
        (b'{"records": [1]}', "record 1: JSON: expected an object"),
        (b'{"records": [{"hello": {}}]}', "record 1: record: expected one of start"),
        (b'{"records": [{"start": {}}]', "nothing"),
        (b'{"records": [{"start": }, {"start": {}}, {"start": {}}]}', "Expecting value"),
        (b"[" * 100_000, "a file that begins with"),
        (b'{"records": ' + b"[" * 100_000, "arrays in arrays"),
        (bytes(64), "a file that begins with"),
        (framed(part(1, b"")) + b"\0\0\0\0", "at least 2 bytes"),
        (framed(part(1, b""), part(8, b"x")), "got field 8"),
        (framed(part(1, b""), varint(6 << 3) + b"\1"), "wire type 0"),
        (framed(part(1, b""), part(2, b"\xff\xff")), "initial conditions"),
        (framed(part(1, b""), part(7, b"")), "initial conditions before the first step"),
        (framed(part(1, b""), part(6, b"\x08\1")), "initial conditions before the first step"),
        (b"\xe5\x42\xd5\x85" + bytes(4) + b"\0\0\0\x09" + bytes(4), "0x9 is no type of a record"),
    ],
)
def test_what_is_no_log_is_refused_in_one_line(here, data, words):
    assert words in refused(here, data)


def changed(**changes):
    """Return the town with other properties of building 2."""
    town = writer.town()
    kind, number, facts = town[4]
    town[4] = kind, number, facts | {int(key): value for key, value in changes.items()}
    return Log(town=town)


@pytest.mark.parametrize(
    ("log", "words"),
    [
        (changed(**{str(writer.EDGES): []}), "building 2: edges: expected at least 3 distinct corners, got 0"),
        (changed(**{str(writer.CODE): 7}), "building 2: building code: expected a number from 0 to 2, got 7"),
        (changed(**{str(writer.FLOORS): 0}), "building 2: floors: expected a number from 1 to 1000, got 0"),
        (changed(**{str(writer.FIERYNESS): 9}), "building 2: fieryness: expected a number from 0 to 8, got 9"),
        (changed(**{str(writer.X): None}), "building 2: x, y: expected its position, got no position"),
        (changed(**{str(writer.GROUND): None}), "building 2: building area ground"),
        (Log(town=[*writer.town(), writer.town()[3]]), "a number twice"),
        (Log(town=writer.town()[:3]), "at least one building"),
        (Log(steps=[[], [(4, 2, {writer.FIERYNESS: 99})]]), "step 2: building 2: fieryness: expected"),
        (Log(first_step=0), "updates: time: expected a step after 0, got 0"),
        (Log(town=[(99, 1, {})]), "record 2: initial conditions: 99 is the number of no entity"),
    ],
)
def test_what_makes_no_sense_is_named(here, log, words):
    assert words in refused(here, writer.protobuf(log))


@pytest.mark.parametrize("name", ["town.log", "unframed.log", "old.log", "town.json"])
def test_a_cut_off_log_is_imported_up_to_its_last_whole_step(here, name):
    whole = FORMS[name](Log())
    fw.import_log(_put(here, name, whole), "whole.mcap")
    wanted = fw.open_log("whole.mcap")
    last = []
    for n_bytes in range(len(whole) * 2 // 3, len(whole), 97):
        found = fw.import_log(_put(here, name, whole[:n_bytes]), "cut.mcap", force=True)
        assert found.damage is not None
        assert found.damage.startswith("cut off: ")
        assert found.damage.endswith(f"imported up to step {found.last_step}")
        run = found.open()
        assert run.steps.tolist() == [*range(found.last_step + 1)]
        assert run[-1].buildings.fieryness.tolist() == wanted[found.last_step].buildings.fieryness.tolist()
        assert not run[-1].truncated
        last.append(found.last_step)
    assert last == sorted(last)
    assert len({*last}) > 1


@pytest.mark.parametrize("name", ["town.log.lzma", "real.log.xz", "town.log.gz"])
def test_a_compressed_log_may_be_cut_off_too(here, name):
    data = FORMS[name](Log(perception=60_000))
    found = fw.import_log(_put(here, name, data[:-12]), "cut.mcap")
    assert "cut off" in found.damage


def test_a_log_without_its_start_holds_nothing(here):
    assert "no step is good" in refused(here, writer.protobuf(Log())[:300])


def test_a_log_whose_kernel_was_killed_says_so(here):
    found = fw.import_log(_put(here, "killed.log", writer.protobuf(Log(end=False))), "killed.mcap")
    assert found.damage == "cut off: it has no end record; imported up to step 6"


def test_what_follows_the_end_is_no_part_of_a_log(here):
    data = writer.protobuf(Log())
    assert "expected the end of the log" in refused(here, data + data)
    assert "bytes follow" in refused(here, gzip.compress(data) + b"more")


@pytest.mark.parametrize("name", FORMS)
def test_changed_bytes_end_in_one_line_or_in_a_recording(here, name):
    """Most forms have no checksums: a changed number may be read as it is, but nothing worse happens."""
    whole = FORMS[name](Log(perception=20))
    draws, outcomes = random.Random(name), []
    for _ in range(60):
        data = bytearray(whole)
        for _ in range(draws.randint(1, 3)):
            data[draws.randrange(len(data))] ^= 1 << draws.randrange(8)
        try:
            found = fw.import_log(_put(here, "flipped", bytes(data)), "flipped.mcap", force=True)
        except FireworldError as error:
            outcomes.append(str(error))
            assert not (here / "flipped.mcap").exists()
        else:
            assert len(found.open()) == found.n_steps
            (here / "flipped.mcap").unlink()
        assert [path.name for path in here.iterdir()] == ["flipped"]
    assert all("\n" not in text for text in outcomes)


def test_changed_bytes_of_real_xz_are_always_noticed(here):
    whole = FORMS["real.log.xz"](Log())
    for position in range(30, len(whole), 61):
        data = bytearray(whole)
        data[position] ^= 16
        refused(here, bytes(data), "bad.log.xz")


def test_what_unpacks_to_too_much_is_refused(here, monkeypatch):
    monkeypatch.setattr(source, "BYTES_MAX", 1 << 30)
    head = writer.protobuf(Log(end=False))
    endless = part(4, bytes(1 << 20))
    record = len(endless).to_bytes(4, "big") + endless
    out = io.BytesIO()
    with gzip.open(out, "wb", compresslevel=1) as file:
        file.write(head)
        for _ in range(1030):
            file.write(record)
    assert "expected at most 1 GiB unpacked" in refused(here, out.getvalue(), "bomb.log.gz")


def test_a_record_that_is_said_to_be_too_long_is_not_read(here):
    huge = varint(2 << 3 | 2) + varint(1 << 30)
    data = framed(part(1, b"")) + ((1 << 30) + len(huge)).to_bytes(4, "big") + huge
    assert "expected at most 134217728 bytes" in refused(here, data)


def test_a_dictionary_that_takes_too_much_memory_is_refused(here):
    filters = [{"id": lzma.FILTER_LZMA1, "dict_size": 1 << 28}]
    data = lzma.compress(writer.protobuf(Log()), format=lzma.FORMAT_ALONE, filters=filters)
    assert "cannot be unpacked: Memory usage limit" in refused(here, data)


def test_a_7z_archive_that_was_not_closed_is_refused(here):
    whole = FORMS["town.7z"](Log())
    assert "cut off" in refused(here, whole[:-20], "x.7z")
    assert "was not closed" in refused(here, whole[:8] + bytes(24) + whole[32:], "x.7z")
    assert "no official log" in refused(here, archive({}), "x.7z")
    assert "no official log" in refused(here, archive({"a.txt": b"hello"}), "x.7z")
    inner = archive({"INITIAL_CONDITIONS": b"\xff"})
    assert "INITIAL_CONDITIONS: " in refused(here, inner, "x.7z")


def test_changed_bytes_of_7z_are_always_noticed(here):
    whole = FORMS["town.7z"](Log(perception=0, steps=[]))
    for position in range(8, len(whole), 23):
        data = bytearray(whole)
        data[position] ^= 4
        (here / "bad.7z").write_bytes(data)
        try:
            found = fw.import_log("bad.7z", "bad.mcap", force=True)
        except LogError:
            continue
        else:  # bytes of an entry that is not read
            assert found.n_steps == 1


def test_outputs_are_checked_first(here):
    _put(here, "town.log", writer.protobuf(Log()))
    _put(here, "there.mcap", b"something")
    for output, words in (("town.log", "one name twice"), ("there.mcap", "--force"), ("no/x.mcap", "existing folder")):
        with pytest.raises(OutputError, match=words):
            fw.import_log("town.log", output)
    with pytest.raises(LogError, match="a folder"):
        fw.import_log(".", "x.mcap")
    with pytest.raises(LogError, match="cannot be read"):
        fw.import_log("none.log", "x.mcap")
    assert (here / "there.mcap").read_bytes() == b"something"
    fw.import_log("town.log", "there.mcap", force=True)


def test_an_import_that_fails_leaves_the_old_recording(here):
    fw.import_log(_put(here, "town.log", writer.protobuf(Log())), "town.mcap")
    before = (here / "town.mcap").read_bytes()
    _put(here, "bad.log", writer.protobuf(Log(steps=[[], [(4, 2, {writer.FIERYNESS: 99})]])))
    with pytest.raises(LogError):
        fw.import_log("bad.log", "town.mcap", force=True)
    assert (here / "town.mcap").read_bytes() == before
    assert len([*here.iterdir()]) == 3


def _put(here, name, data):
    (here / name).write_bytes(data)
    return name
