"""What pages take for granted that a reader has, and an empty folder has not: `python -m tests.docs.given FILE...`."""

from __future__ import annotations

import lzma
import sys
from collections.abc import Callable
from pathlib import Path

from tests.maps.test_osm import as_pbf, town
from tests.recording.official_log import writer


def extract(path: Path) -> None:
    """Write an extract of OpenStreetMap: sixteen houses."""
    as_pbf(town().write(Path("town.osm")), path)


def official_log(path: Path) -> None:
    """Write a log of an official kernel."""
    path.write_bytes(lzma.compress(writer.protobuf(writer.Log())))


GIVEN: dict[str, Callable[[Path], None]] = {"town.osm.pbf": extract, "rescue.log.xz": official_log}

if __name__ == "__main__":
    for name in sys.argv[1:]:
        GIVEN[name](Path(name))
