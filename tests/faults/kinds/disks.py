"""Full disks, read-only folders, names too long, names of odd bytes: every writer is refused, or does all of it."""

from __future__ import annotations

import os
import random
import re
from collections.abc import Callable
from pathlib import Path
from typing import Final

from tests.faults import mounts
from tests.faults.bench import Bench, as_process
from tests.faults.outcomes import Done, Outcome
from tests.faults.writers import OFTEN, WRITERS, Whole, Writer, call_again, look, whole_call

NAME: Final = "disks"
SHARE: Final = 0.04
REFUSED: Final = 2
BLOCK: Final = 4096
ODD_NAMES: Final = tuple(
    os.fsdecode(name)
    for name in (
        b"\xff\xfe",
        b"a\nb",
        b"[x]",
        b"[red]x",
        b"\x1b[31mred",
        b"\x1b]0;title\x07",
        "é🔥".encode(),
        "e\u0301\u202egnp".encode(),
        b"$HOME `ls` 'x' \"y\"",
        b" spaces ",
        b"%s{}<&>",
        b"a\rb",
        b"\xc3\x28",
        b"=+@#;,",
        b".hidden",
    )
)
_ESCAPE: Final = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]")


def run(generator: random.Random, bench: Bench) -> Outcome:
    """Let a writer meet a disk, a folder or a name that cannot be, or is odd."""
    name = generator.choice(OFTEN)
    case = generator.choice((_full, _full, _read_only, _long_name, _odd_name))
    case(generator, bench, name, WRITERS[name], whole_call(name, bench.material))
    return bench.outcome


def _count(bench: Bench, done: Done) -> None:
    bench.outcome.refused += done.code == REFUSED
    bench.outcome.survived += done.code != REFUSED


def _full(generator: random.Random, bench: Bench, name: str, writer: Writer, expected: Whole) -> None:
    """A disk that is full before the writer is done, and then has room again."""
    bench.bring(writer.given)
    given = bench.files()
    n_new = sum(len(data) for file, data in expected.files.items() if given.get(file) != data)
    room = generator.randrange(0, n_new + 3 * BLOCK, 1024)
    bench.processes = as_process(generator, 0.1)
    if mounts.can_mount():
        bench.outcome.notes.append("full disks: file systems of some kilobytes")
        used = sum(-(-len(data) // BLOCK) * BLOCK + BLOCK for data in given.values()) + 4 * BLOCK
        with mounts.small_disk(bench.folder, used + room) as again:
            bench.bring(writer.given)
            done = _write(bench, writer, expected, given)
            again("size=64m")
            if done.code != expected.code:
                call_again(bench, name, writer, expected)
    else:
        bench.outcome.notes.append("full disks: a limit on the size of files, as this process may not mount")
        done = _write(bench, writer, expected, given, before=mounts.limit_files(room))
        if done.code != expected.code:
            call_again(bench, name, writer, expected)
    bench.told.append(f"{name}, {room} bytes of room for {n_new}")
    _count(bench, done)


def _write(
    bench: Bench,
    writer: Writer,
    expected: Whole,
    given: dict[str, bytes],
    *,
    before: Callable[[], object] | None = None,
) -> Done:
    done = bench.call(writer.words, codes={expected.code, REFUSED}, before=before)
    look(bench, writer, expected, given, killed=False)
    return done


def _read_only(generator: random.Random, bench: Bench, name: str, writer: Writer, expected: Whole) -> None:
    """A folder, a file system or a file without rights."""
    how = generator.choice(("folder", "file system", "input") if mounts.can_mount() else ("folder", "input"))
    bench.told.append(f"{name}, read-only {how}")
    if how == "file system":
        with mounts.small_disk(bench.folder, 1 << 24) as again:
            bench.bring(writer.given)
            again("ro")
            given = bench.files()
            _count(bench, bench.call(writer.words, codes={REFUSED}))
            bench.outcome.expect(bench.files() == given, f"{name}: something changed on a read-only file system")
        return
    bench.bring(writer.given)
    given = bench.files()
    mounts.open_way(bench.folder)
    inputs = [path for path in sorted(bench.folder.rglob("*")) if path.is_file()]
    if how == "folder" or not inputs:
        for path in [*bench.folder.rglob("*"), bench.folder]:
            if path.is_dir():
                path.chmod(0o555)
        codes = {REFUSED}
    else:
        for path in [bench.folder, *bench.folder.rglob("*")]:
            path.chmod(0o777)
        generator.choice(inputs).chmod(0)
        codes = {REFUSED, expected.code}  # it may not be needed
    done = bench.call(writer.words, codes=codes, before=mounts.be_nobody)
    for path in [bench.folder, *bench.folder.rglob("*")]:
        path.chmod(0o755)
    if how == "folder":
        bench.outcome.expect(bench.files() == given, f"{name}: something changed in a read-only folder")
    _count(bench, done)


def _long_name(generator: random.Random, bench: Bench, name: str, writer: Writer, expected: Whole) -> None:
    """Outputs whose names are as long as names can be, or longer."""
    length = generator.choice((200, 230, 240, 244, 246, 248, 250, 252, 255, 256, 300, 5000))
    _named(bench, name, writer, expected, lambda final: f"{'n' * (length - len(final))}{final}")
    bench.told.append(f"{name}, {length} letters")


def _odd_name(generator: random.Random, bench: Bench, name: str, writer: Writer, expected: Whole) -> None:
    """Inputs and outputs whose names are odd bytes."""
    odd = generator.choice(ODD_NAMES)
    done = _named(bench, name, writer, expected, lambda final: f"{odd}{final}", inputs=True)
    for text in (done.out, done.err):
        bench.outcome.expect(not _ESCAPE.search(text), f"{name}: control characters of a name: {text[-200:]!r}", "line")
    bench.told.append(f"{name}, {odd!r}")


def _named(
    bench: Bench,
    name: str,
    writer: Writer,
    expected: Whole,
    renamed: Callable[[str], str],
    *,
    inputs: bool = False,
) -> Done:
    """Call a writer with other names of its files; it makes all its outputs, or none."""
    names = {final: renamed(final) for final in writer.finals if final in writer.words}
    if inputs:
        names |= {given: renamed(given) for given in writer.given if "/" not in given and given in writer.words}
    bench.bring(
        {
            names.get(given, given): source
            for given, source in writer.given.items()
            if len(names.get(given, given)) < 200
        }
    )
    given = set(bench.files())
    words = [names.get(word, word) if isinstance(word, str) else word for word in writer.words]
    done = bench.call(words, codes={expected.code, REFUSED})
    there = {final for final in writer.finals if final in names and _exists(bench.folder / names[final])}
    old = {final for final in names if names[final] in given}
    if done.code == REFUSED:
        new = sorted(file for file in set(bench.files()) - given if not file.endswith(".partial"))
        bench.outcome.expect(there <= old and not new, f"{name}: refused, and left {[*there - old, *new]}", "half file")
    else:
        missing = [final for final in writer.finals if final in names and final not in there]
        bench.outcome.expect(not missing, f"{name}: did not make {', '.join(missing)}", "half file")
    _count(bench, done)
    return done


def _exists(path: Path) -> bool:
    try:
        return path.exists()
    except OSError:  # its name is too long
        return False
