"""The command line as a process of its own, and what it leaves in the current folder."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tests.command_line import Done


@pytest.fixture
def fireworld_process():
    """Call the command line as a process of its own, to which Ctrl-C means what it means at a terminal."""

    def call(*words: object) -> Done:
        done = subprocess.run(
            [sys.executable, "-c", "from fireworld.cli import main; main()", *map(str, words)],
            capture_output=True,
            text=True,
            check=False,
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
        )
        return Done(done.returncode, done.stdout, done.stderr)

    return call


@pytest.fixture
def files(here):
    """The files in the current folder besides the policies, by name."""

    def names() -> list[str]:
        return sorted(path.name for path in Path(here).iterdir() if path.suffix != ".py" and path.is_file())

    return names
