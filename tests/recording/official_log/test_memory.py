"""A log of a gigabyte is read in little memory: one record is held at a time, and most are passed over."""

import subprocess
import sys
from pathlib import Path

import pytest

from tests.recording.official_log import writer
from tests.recording.official_log.writer import Log

GIGABYTE = 1 << 30
MEMORY_MAX = 300 << 20
STATUS = Path("/proc/self/status")
CHILD = """
import fireworld as fw
found = fw.import_log("big.log", "big.mcap")
assert found.damage is None and found.n_steps == 301, found
print(next(line for line in open("/proc/self/status") if line.startswith("VmHWM:")).split()[1])
"""
"""It prints the most memory that it held, in KiB; `resource` would count what its parent held when it began, too."""


def big_log(path, *, n_buildings=3000, n_steps=300, agents=40):
    """Write a raw log of a gigabyte: five sixths of it perception, as in real ones; all buildings always change."""
    town = [one for one in writer.town() if one[0] != writer.BUILDING]
    for k in range(n_buildings):
        x, y = 20_000 * (k % 60), 20_000 * (k // 60) + 50_000
        facts = {writer.X: x, writer.Y: y, writer.FLOORS: 2, writer.CODE: 0, writer.GROUND: 100, writer.TOTAL: 200}
        town.append((writer.BUILDING, 10_000 + k, facts | {writer.EDGES: writer.square(x, y, 10_000)}))
    first = Log(town=town, steps=[], end=False)
    perception = writer.part(4, writer.varint(8) + writer.varint(1) + writer.part(3, bytes(75_000)))
    changes = [
        (writer.BUILDING, 10_000 + k, {writer.TEMPERATURE: k % 900, writer.HISTORY: list(range(150))})
        for k in range(n_buildings)
    ]
    one = Log(town=[], settings=None, steps=[changes], end=False, perception=0)
    head, body = writer.part(6, b"")[:1], [*writer.messages(one)][-1]
    body = body[body.index(b"\x08\1") + 2 :]  # without the field of the message, its length and the time
    with path.open("wb") as file:
        file.write(writer.protobuf(first))
        for time in range(1, n_steps + 1):
            for _ in range(agents):
                file.write(len(perception).to_bytes(4, "big") + perception)
            inner = b"\x08" + writer.varint(time) + body
            data = head + writer.varint(len(inner)) + inner
            file.write(len(data).to_bytes(4, "big") + data)
        file.write(b"\0\0\0\2" + writer.part(7, b""))


@pytest.mark.heavy
@pytest.mark.skipif(not STATUS.exists(), reason="the system does not say how much memory a process held")
def test_a_gigabyte_is_imported_in_less_than_300_mb(here):
    path = here / "big.log"
    big_log(path)
    assert path.stat().st_size > GIGABYTE
    done = subprocess.run([sys.executable, "-c", CHILD], check=True, capture_output=True, text=True)
    path.unlink()
    assert int(done.stdout) << 10 < MEMORY_MAX
