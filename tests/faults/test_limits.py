"""Inputs beyond all measure: each is refused in one line, before work, within bounded time and memory."""

from __future__ import annotations

import json
import os
import resource
import struct
import subprocess
import sys
import zipfile

import numpy as np
import pytest
import zstandard
from fireworld_recorder.chain import SCENE_PREFIX

from fireworld.city import streets
from tests.command_line import Done

CPU_SECONDS_MAX = 10
MEMORY_BYTES_MAX = 1 << 30
SCENARIO = "city: {file: city.json}\nfires: [{at: [0.5, 0.5], n_buildings: 1}]\nbrigades: {n: 1}\n"
SQUARE = [0, 0, 10_000, 0, 10_000, 10_000, 0, 10_000]


@pytest.fixture
def refused(here):
    """Call the command line as a process of bounded CPU time and data; return its only line."""

    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_CPU, (CPU_SECONDS_MAX, CPU_SECONDS_MAX))
        resource.setrlimit(resource.RLIMIT_DATA, (MEMORY_BYTES_MAX, MEMORY_BYTES_MAX))

    def call(*words: object, code: int = 2) -> str:
        command = [sys.executable, "-m", "fireworld", *map(str, words)]
        found = subprocess.run(command, capture_output=True, text=True, check=False, preexec_fn=limit, timeout=60)
        done = Done(found.returncode, found.stdout, found.stderr)
        assert done.code == code, done
        assert "Traceback" not in done.err
        return done.err

    return call


def city(here, buildings, **more):
    (here / "city.json").write_text(json.dumps({"buildings": buildings, **more}))
    (here / "a.yaml").write_text(SCENARIO)


# What is no regular file


READERS = {
    "scenario": ("run", "odd.yaml"),
    "curriculum": ("train", "odd", "-o", "team.npz"),
    "city": ("run", "a.yaml"),
    "trace": ("conformance", "good.json", "odd"),
    "trace's city": ("conformance", "odd", "odd"),
    "team": ("run", "quick", "--policy", "odd.npz"),
    "code": ("run", "quick", "--policy", "odd.py:Mine"),
    "results": ("compare", "chief", "random", "--scenarios", "quick", "--seeds", "1", "--results", "odd.parquet"),
    "log": ("info", "odd.mcap"),
}


@pytest.mark.parametrize(("kind", "make"), [
    ("a device", lambda path: path.symlink_to("/dev/zero")),
    ("a folder", lambda path: path.mkdir()),
    ("a pipe", os.mkfifo),
])  # fmt: skip
@pytest.mark.parametrize("reader", [*READERS])
def test_inputs_are_regular_files(here, fireworld, reader, kind, make):
    if (reader, kind) == ("log", "a pipe"):
        return  # logs may come from pipes
    for name in ("odd", "odd.yaml", "odd.npz", "odd.py", "odd.parquet", "odd.mcap", "city.json"):
        make(here / name)
    (here / "a.yaml").write_text(SCENARIO)
    (here / "good.json").write_text(json.dumps({"buildings": [{"id": 1, "apexes": SQUARE}]}))
    done = fireworld(*READERS[reader])
    assert done.code == 2
    assert done.err.count("\n") == 1
    assert "expected a" in done.err or "cannot be" in done.err
    assert kind in done.err or "s a directory" in done.err or "a link" in done.err, done.err


# YAML


@pytest.mark.parametrize(("text", "line"), [
    ("a: [" + "1," * 300_000 + "1]", "expected at most 100000 keys and values, got more of them"),
    ("a:\n" + "- 1\n" * 200_000, "expected at most 100000 keys and values, got more of them"),
    ("a: " + "[" * 400_000, "expected YAML, got nesting that is too deep"),
    ("- " * 400_000, "expected YAML, got nesting that is too deep"),
    ("a: &a [1, 1]\nb: [*a, *a]\n", "expected every value written out, got the anchor or alias a"),
    ("a: " + "1" * 1_000_000, "expected a scenario of at most 1000000 bytes, got 1000003 bytes"),
])  # fmt: skip
@pytest.mark.slow
def test_yaml(here, refused, text, line):
    (here / "a.yaml").write_text(text)
    assert line in refused("run", "a.yaml")


@pytest.mark.parametrize(("setting", "line"), [
    ("a." * 30 + "b=1", "expected a key of at most 20 parts, got 31"),
    ("fires." + "9" * 5000 + ".at=1", "expected a number from 0 to "),
    ("steps=" + "9" * 5000, "expected a whole number"),
    ("steps=" + "[" * 5000, "nesting that is too deep"),
])  # fmt: skip
def test_settings(fireworld, setting, line):
    done = fireworld("run", "quick", "--set", setting)
    assert done.code == 2
    assert line in done.err


# Cities


@pytest.mark.slow
@pytest.mark.parametrize("text", ["[" * 500_000, '{"a":' * 150_000, '{"buildings": ' + "9" * 100_000 + "}"])
def test_json(here, refused, text):
    (here / "a.yaml").write_text(SCENARIO)
    (here / "city.json").write_text(text)
    assert "expected JSON with numbers of sane size, got something larger" in refused("run", "a.yaml")


def test_corners(here, fireworld):
    comb = [number for x in range(20_000) for number in (100 * x, 50_000 + 50_000 * (x % 2))]
    city(here, [{"id": 7, "apexes": [*comb, 0, 0]}])
    assert "building 7: apexes: expected at most 4000 corners, got 20001 of them" in fireworld("run", "a.yaml").err


def test_streets_and_hydrants(here, fireworld, monkeypatch):
    monkeypatch.setattr(streets, "NODES_MAX", 200)
    spot = [{"x": number, "y": 5} for number in range(200)]
    city(here, [{"id": 1, "apexes": SQUARE}], hydrants=spot)
    assert "city.json: streets: expected at most 200 nodes, got 201" in fireworld("run", "a.yaml").err
    nodes = [[number, number] for number in range(201)]
    city(here, [{"id": 1, "apexes": SQUARE}], streets={"nodes": nodes, "edges": [[0, 1]]})
    assert "city.json: streets: expected at most 200 nodes, got 201" in fireworld("run", "a.yaml").err


def test_a_large_file_is_not_read(here, fireworld):
    (here / "a.yaml").write_text(SCENARIO)
    with (here / "city.json").open("wb") as file:
        file.truncate(1 << 40)
    wanted = "a.yaml: city.file: expected a city file of at most 268435456 bytes, got 1099511627776 bytes"
    assert wanted in fireworld("run", "a.yaml").err


def squares_on_a_spot(n: int) -> str:
    """An extract whose buildings all lie on one another."""
    nodes, ways = [], []
    for k in range(n):
        for corner, (x, y) in enumerate(((0, 0), (1, 0), (1, 1), (0, 1))):
            lat, lon = 60 + 1e-6 * k + 2e-4 * y, 24 + 2e-6 * k + 4e-4 * x
            nodes.append(f'<node id="{4 * k + corner + 1}" version="1" lat="{lat:.7f}" lon="{lon:.7f}"/>')
        refs = "".join(f'<nd ref="{4 * k + corner % 4 + 1}"/>' for corner in range(5))
        ways.append(f'<way id="{k + 1}" version="1">{refs}<tag k="building" v="yes"/></way>')
    return f'<osm version="0.6">{"".join(nodes + ways)}</osm>'


@pytest.mark.slow
def test_buildings_on_one_spot(here, refused):
    pytest.importorskip("osmium")
    (here / "spot.osm").write_text(squares_on_a_spot(2000))
    assert (here / "spot.osm").stat().st_size < 1_000_000
    line = "spot.osm: buildings: expected at most 1600000 corners in pairs that overlap, got more: w1 alone lies on "
    assert line in refused("city", "osm", "spot.osm", "-o", "town.json")


# Files of arrays


def archive(path, name, data):
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr(name, data)


def array_claiming(shape):
    head = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}\n".encode()
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(head)) + head + bytes(80)


LONG_HEADER = b"\x93NUMPY\x02\x00" + struct.pack("<I", 290_000_000) + b" " * 290_000_000


@pytest.mark.slow
@pytest.mark.parametrize(("data", "line"), [
    (LONG_HEADER, " bytes, got 290000012 bytes"),
    (LONG_HEADER[:200_000_000], "a header of at most 65536 bytes, got one of 290000000"),
    (array_claiming((1 << 40,)), "the 8796093022208 bytes of an array of shape (1099511627776,), got "),
    (array_claiming((-1,)), "the -8 bytes of an array of shape (-1,), got "),
])  # fmt: skip
def test_arrays(here, refused, data, line):
    (here / "good.json").write_text(json.dumps({"buildings": [{"id": 1, "apexes": SQUARE}]}))
    archive(here / "bad.npz", "temperature.npy", data)
    trace = refused("conformance", "good.json", "bad.npz")
    assert trace.startswith("fireworld: bad.npz: ")
    assert line in trace
    team = refused("run", "quick", "--policy", "bad.npz")
    assert team.startswith("fireworld: bad.npz: expected a team file (.npz), got ")


# Results


@pytest.mark.slow
@pytest.mark.parametrize(("n_rows", "name", "line"), [
    (2_000_000, "quick", "2000000 rows in "),
    (90_000, "q" * 100_000, "45000000000 bytes of text, where 536870912 are the most"),
])  # fmt: skip
def test_results(here, refused, n_rows, name, line):
    import pyarrow as pa
    import pyarrow.parquet as pq

    from fireworld.evaluation.results import _schema

    zeros = pa.array(np.zeros(n_rows, np.int32))
    columns = {
        field.name: pa.DictionaryArray.from_arrays(zeros, [name])
        if field.type == pa.string()
        else pa.array(np.ones(n_rows, np.int8)).cast(field.type)
        for field in _schema()
    }
    pq.write_table(pa.table(columns), here / "r.parquet")
    assert (here / "r.parquet").stat().st_size < 2_000_000
    words = ("compare", "chief", "random", "--scenarios", "quick", "--seeds", "1", "--results", "r.parquet")
    assert line in refused(*words)


# Logs


def chunk(block: bytes) -> bytes:
    packed = zstandard.ZstdCompressor(level=3).compress(block)
    body = struct.pack("<QQQI", 0, 0, len(block), 0) + struct.pack("<I", 4) + b"zstd"
    body += struct.pack("<Q", len(packed)) + packed
    return struct.pack("<BQ", 6, len(body)) + body


def with_chunks(log: bytes, *chunks: bytes) -> bytes:
    """Put chunks before the end of a log's data."""
    position = 8
    while log[position] != 15:  # the end of the data
        position += 9 + struct.unpack_from("<Q", log, position + 1)[0]
    return log[:position] + b"".join(chunks) + log[position:]


def test_empty_messages(here, fireworld):
    from tests.recorder import synthetic

    city_record = synthetic.city()
    from fireworld_recorder.writer import LogWriter

    with LogWriter(here / "a.mcap", synthetic.header(), city_record) as log:
        for record in synthetic.run(3, city_record=city_record):
            log.write(record)
    good = (here / "a.mcap").read_bytes()
    text = f"{SCENE_PREFIX}x".encode()
    channel = struct.pack("<HHI", 99, 1, len(text)) + text + struct.pack("<III", 0, 0, 0)[:8]
    message = struct.pack("<BQ", 5, 22) + struct.pack("<HIQQ", 99, 0, 0, 0)
    block = struct.pack("<BQ", 4, len(channel)) + channel + message * 2_000_000
    bomb = chunk(block)
    assert len(bomb) < 20_000
    (here / "bomb.mcap").write_bytes(with_chunks(good, bomb))
    done = fireworld("info", "bomb.mcap")
    assert done.code == 1
    assert "messages in " in done.out + done.err

    zeros = struct.pack("<BQ", 5, (1 << 28) - 100) + struct.pack("<HIQQ", 99, 0, 0, 0) + bytes((1 << 28) - 122)
    large = chunk(struct.pack("<BQ", 4, len(channel)) + channel + zeros)
    (here / "large.mcap").write_bytes(with_chunks(good, *[large] * 20))
    done = fireworld("info", "large.mcap")
    assert done.code == 1
    assert "bytes in a log of " in done.out + done.err


@pytest.mark.parametrize(
    ("words", "what"),
    [
        (("city", "osm", "pipe.osm", "-o", "town.json"), "a file of OpenStreetMap data"),
        (("city", "import", "pipe.gml", "-o", "town.json"), "a map"),
        (("city", "show", "pipe.json", "-o", "town.png"), "a city file, a scenario or a map"),
        (("city", "export", "pipe.json", "-o", "town"), "a city file, a scenario or a map"),
        (("info", "pipe.json"), "a city file"),
    ],
)
def test_maps_from_pipes_are_refused_without_waiting(here, fireworld, words, what):
    os.mkfifo(next(word for word in words if word.startswith("pipe.")))
    done = fireworld(*words)
    assert done.code == 2
    assert f": expected {what}" in done.err
    assert done.err.endswith("got a pipe\n")
