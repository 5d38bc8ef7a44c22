"""Blocks of code in the pages: each page's are run in order, in one empty folder, as a reader would.

What a block is follows from its language. `sh`, or an indented block: commands. `console`: commands, and what they
print, which is compared. `python`: run in one namespace a page. `text`: shown only. Every other one is a file. A remark
before a block, which a web page does not show, says more of it:

    <!-- in my_policy.py -->         the block is that file, not run by itself
    <!-- not run: needs a map -->    it is not run, and why
    <!-- needs duckdb -->            it is run where this module is installed, as it is for .ci/run
    <!-- long: trains a team -->     it is run by .ci/run only, where whole pages are run as they are written
    <!-- given: cp ... -->           commands that are run before it: what a reader has, and an empty folder does not

Elsewhere commands of `sh` blocks that take minutes are given the options of SHORTER. Windows are not opened: `view`
writes a file instead, and `--view` is left out. `python -m tests.docs.blocks` lists all that is not run; with `--renew
[PAGE]...` it first writes anew what consoles print.
"""

from __future__ import annotations

import contextlib
import os
import re
import shlex
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, field
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from click.testing import CliRunner

from fireworld.cli import root
from tests.docs.pages import PAGES, ROOT, SILENT, page_name

COLUMNS = "80"
BLOCK = re.compile(
    r"^(?P<remarks>(?:<!-- (?:in|needs|not run:|long:|given:)(?:(?!-->).)*-->\n+)*)"
    r"(?:```(?P<language>\w*)\n(?P<fenced>.*?)^```$|(?P<indented>^    \S[^\n]*\n(?:\n*^    [^\n]+\n)*))",
    re.MULTILINE | re.DOTALL,
)
REMARK = re.compile(r"<!-- (in|needs|not run:|long:|given:) (.+?) ?-->", re.DOTALL)
AS_WRITTEN = bool(os.environ.get("FIREWORLD_PAGES_AS_WRITTEN"))
SHORTER = (
    (
        r"train .*--method (search|assignment)",
        "--set n_generations=1 --set n_candidates=4 --set n_best=2 --set n_fires=2",
    ),
    (r"golden add (?!.*n_episodes_max).*--train", "--set n_episodes_max=3"),
    (r"train (?!.*--set n_)", "--set n_episodes_max=3"),
    (r"compare (?!.*--seeds)", "--seeds 2"),
    (r"scenarios (check|new) ", "--seeds 2"),
)
"""What commands take besides, where they begin so: the first that fits."""
ANSWERS = {0, 1, 3}
"""Exit codes that are answers: yes, no, cannot tell."""
VERSION = re.compile(r"(fireworld \d+\.\d+\.\d+)\+[0-9a-f]{12}")
"""A version with the digest of the simulator's sources, which changes with them: the digest is left out."""
INSTALLS = re.compile(r"(python -m )?pip install ")
"""Commands that are not run anywhere: they would change what the tests run in."""
SHELL = re.compile(r"[|<>;$*`]|&&")


@dataclass(frozen=True)
class Block:
    """A block of code, and what is said of it."""

    page: str
    line: int
    language: str
    code: str
    file: str = ""
    reason: str = ""
    later: bool = False
    given: tuple[str, ...] = ()
    fenced: bool = True

    @property
    def where(self) -> str:
        """Page and line."""
        return f"{self.page}:{self.line}"


def blocks(page: Path) -> list[Block]:
    """Return the blocks of a page in order."""
    text = page.read_text(encoding="utf-8")
    return [_block(page_name(page), text, found) for found in BLOCK.finditer(text)]


def _block(name: str, text: str, found: re.Match[str]) -> Block:
    line = text.count("\n", 0, found.end("remarks")) + 1
    if found["indented"] is not None:
        language, code = "sh", re.sub(r"^    ", "", found["indented"], flags=re.MULTILINE)
    else:
        language, code = found["language"], found["fenced"]
    said: dict[str, list[str]] = {"in": [], "needs": [], "not run:": [], "long:": [], "given:": []}
    for kind, words in REMARK.findall(found["remarks"]):
        said[kind].append(words)
    file, reason = (said[kind][0] if said[kind] else "" for kind in ("in", "not run:"))
    lacking = [module for words in said["needs"] for module in words.split() if find_spec(module) is None]
    later = bool(lacking) or bool(said["long:"] and not AS_WRITTEN)
    return Block(name, line, language, code, file, reason, later, tuple(said["given:"]), found["indented"] is None)


@dataclass
class Reader:
    """Somebody who tries all blocks of a page, one after another, in the current folder."""

    names: dict[str, Any] = field(default_factory=lambda: {"__name__": "page"})

    def tries(self, block: Block) -> str:
        """Run a block; return its text as it should be. Raises whatever goes wrong, with page and line."""
        try:
            for line in (line for commands in block.given for line in commands.splitlines()):
                run(line, as_written=False)
            return self._do(block)
        except BaseException as error:
            error.add_note(f"in the block at {block.where}")
            raise

    def _do(self, block: Block) -> str:
        if block.reason or block.later:
            pass
        elif block.file:
            Path(block.file).parent.mkdir(parents=True, exist_ok=True)
            Path(block.file).write_text(block.code, encoding="utf-8")
        elif block.language == "python":
            exec(compile(block.code, block.where, "exec"), self.names)  # noqa: S102 - what a reader would type
        elif block.language == "console":
            commands = [line for line in block.code.splitlines() if line.startswith("$ ")]
            return "".join(f"{line}\n{run(line[2:])}" for line in commands)
        elif block.language == "sh":
            for line in block.code.replace("\\\n", " ").splitlines():
                run(line, as_written=AS_WRITTEN)
        elif block.language != "text":
            raise AssertionError(f"a block of {block.language or 'no language'}: say in which file it is")
        return block.code


def run(line: str, *, as_written: bool = True) -> str:
    """Run one command and return what it prints on standard output; exit code 2 is a fault."""
    words = shlex.split(line.removesuffix(SILENT), comments=True)
    if not words or INSTALLS.match(line):
        return ""
    if "&&" in words:
        return "".join(run(part, as_written=as_written) for part in line.split("&&"))
    if words[0] != "fireworld" or SHELL.search(shlex.join(words[:1]) + line.partition("#")[0].removesuffix(SILENT)):
        return shell(line)
    called = windowless(words[1:])
    called = called if as_written else shorter(called)
    result = CliRunner().invoke(root, called, env={"COLUMNS": COLUMNS}, catch_exceptions=False)
    assert result.exit_code in ANSWERS, result.output
    shown = VERSION.sub(r"\1+...", result.stdout)
    return "" if line.endswith(SILENT) else "".join(f"{row.rstrip()}\n" for row in shown.splitlines())


def shell(commands: str) -> str:
    """Run commands of a shell and return what they print; $CHECKOUT is where fireworld's sources are."""
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    words = ["bash", "-euc", commands]
    more = {"PATH": path, "PYTHONPATH": str(ROOT), "CHECKOUT": str(ROOT), "COLUMNS": COLUMNS}
    done = subprocess.run(words, env=os.environ | more, capture_output=True, text=True, check=False)
    assert done.returncode in ANSWERS, f"{commands}\n{done.stdout}{done.stderr}"
    return done.stdout


def windowless(words: list[str]) -> list[str]:
    """Return a command that opens no window and serves no browser, and reads and computes the same."""
    kept = [word for word in words if word not in {"--view", "--web"}]
    if "--view-url" in kept:
        place = kept.index("--view-url")
        del kept[place : place + 2]
    return [*kept, "--save", "shown.rrd", "--force"] if kept[0] == "view" and "--save" not in kept else kept


def shorter(words: list[str]) -> list[str]:
    """Return a command that does less, if it is one that would take long."""
    for pattern, more in SHORTER:
        if re.match(pattern, " ".join(words) + " "):
            return [*words, *more.split()]
    return words


@contextlib.contextmanager
def empty_folder() -> Iterator[Path]:
    """Work in an empty folder; what is imported from it is forgotten again."""
    known, path, found = set(sys.modules), sys.path.copy(), os.environ.copy()
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        sys.path.insert(0, folder)
        os.environ |= {"MINARI_DATASETS_PATH": f"{folder}/minari", "MPLBACKEND": "agg"}
        try:
            yield Path(folder)
        finally:
            sys.path[:] = path
            os.environ.clear()
            os.environ |= found
            for name in set(sys.modules) - known:
                if folder in repr(getattr(sys.modules[name], "__spec__", None)):
                    del sys.modules[name]


def renewed(page: Path) -> str:
    """Run all blocks of a page and return its text, with what its console blocks print made anew."""
    text, reader = page.read_text(encoding="utf-8"), Reader()
    with empty_folder():
        for block in blocks(page):
            found = reader.tries(block)
            if block.language == "console":
                text = text.replace(f"```console\n{block.code}```", f"```console\n{found}```", 1)
    return text


if __name__ == "__main__":
    if sys.argv[1:2] == ["--renew"]:
        for one in [Path(name).resolve() for name in sys.argv[2:]] or PAGES:
            if "```console" in one.read_text(encoding="utf-8"):
                one.write_text(renewed(one), encoding="utf-8")
    for shown in (block for one in PAGES for block in blocks(one)):
        if shown.reason or INSTALLS.search(shown.code):
            print(f"{shown.where}: {shown.reason or 'pip install changes what the tests run in'}")  # noqa: T201
