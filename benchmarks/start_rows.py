"""Rows of starting up: how long a command line takes before it does anything."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator, Sequence

from benchmarks.timing import Contender, Row, compare

LINE = "import sys; sys.argv = ['fireworld', {}]; from fireworld.cli import main; main()"
IMPORT_CLICK, IMPORT_NUMBA = "import click", "import numba"
COMMANDS: Sequence[tuple[str, str, float]] = (
    ("--help", IMPORT_CLICK, 5.0),
    ("scenarios --help", IMPORT_CLICK, 5.0),
    ("run default", IMPORT_NUMBA, 10.0),
)
"""Command line, what it is compared with, and for how many seconds."""


def python(name: str, code: str) -> Contender:
    """Start a Python process and wait for its end."""

    def run(_: None) -> None:
        subprocess.run([sys.executable, "-c", code], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    return Contender(name, run)


def process_row(command: str, bare: str, *, seconds: float) -> Row:
    """Compare a command as a whole process with a bare import of what it cannot do without."""
    code = LINE.format(", ".join(repr(word) for word in command.split()))
    ours, baseline = python("", code), python(f'python -c "{bare}"', bare)
    return compare("start-up", f"fireworld {command}", "whole process", ours, baseline, seconds=seconds)


def rows(*, quick: bool) -> Iterator[Row]:
    """Yield the rows of starting up."""
    for command, bare, seconds in COMMANDS:
        yield process_row(command, bare, seconds=1.0 if quick else seconds)
