"""The transcripts in the README: the output of every command in its console blocks.

`python -m tests.docs.transcripts` renews them.
"""

from __future__ import annotations

import contextlib
import re
import shlex
import tempfile
from collections.abc import Iterator
from pathlib import Path

from click.testing import CliRunner

from fireworld.cli import root
from tests.docs.pages import README, ROOT, SILENT

BLOCK = re.compile(r"^```console\n(.*?)^```$", re.MULTILINE | re.DOTALL)
COLUMNS = "100"


def renew(page: str) -> str:
    """Return the page with the output of every command in its console blocks made anew, in one empty folder."""
    with empty_folder():
        return BLOCK.sub(lambda block: f"```console\n{transcript(block[1])}```", page)


def transcript(block: str) -> str:
    """Run the commands of a block, the lines that begin with `$ `, and return them with what they print."""
    commands = [line for line in block.splitlines() if line.startswith("$ ")]
    return "".join(f"{line}\n{output(line)}" for line in commands)


def output(line: str) -> str:
    """Run one command and return what it prints on standard output."""
    words = shlex.split(line.removeprefix("$ fireworld ").removesuffix(SILENT))
    result = CliRunner().invoke(root, words, env={"COLUMNS": COLUMNS}, catch_exceptions=False)
    assert result.exit_code in {0, 1}, result.output
    return "" if line.endswith(SILENT) else "".join(f"{row.rstrip()}\n" for row in result.stdout.splitlines())


@contextlib.contextmanager
def empty_folder() -> Iterator[None]:
    """Work in an empty folder from which the tests' data can be reached as from the top of the checkout."""
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        Path("tests").symlink_to(ROOT / "tests")
        yield


if __name__ == "__main__":
    README.write_text(renew(README.read_text(encoding="utf-8")), encoding="utf-8")
