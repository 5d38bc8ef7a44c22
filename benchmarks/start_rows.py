"""Rows of starting up: how long a command line takes before it does anything."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator, Sequence

from benchmarks.timing import Contender, Row, compare

HELP = "import sys; sys.argv = ['fireworld', '--help']; from fireworld.cli import main; main()"
SCENARIOS = "import sys; sys.argv = ['fireworld', 'scenarios', '--help']; from fireworld.cli import main; main()"


def python(*arguments: str) -> Contender:
    """Start a Python process and wait for its end."""

    def run(_: None) -> None:
        subprocess.run([sys.executable, *arguments], check=True, stdout=subprocess.DEVNULL)

    return Contender(f"python {' '.join(arguments)}", run)


def against_click(what: str, code: str, seconds: float) -> Row:
    """Compare a command with the bare import of click."""
    ours = Contender("fireworld", python("-c", code).run)
    return compare("start-up", what, "", ours, python("-c", "import click"), seconds=seconds)


def rows(*, quick: bool) -> Iterator[Row]:
    """Yield the rows of starting up."""
    commands: Sequence[tuple[str, str]] = (("fireworld --help", HELP), ("fireworld scenarios --help", SCENARIOS))
    for what, code in commands:
        yield against_click(what, code, 1.0 if quick else 5.0)
