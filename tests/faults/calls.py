"""Calls of the command line: in a fork of this warm process, which costs milliseconds, or in a process of its own."""

from __future__ import annotations

import mmap
import os
import random
import resource
import select
import signal
import struct
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final, NoReturn

from fireworld_recorder.writer import StepFile

from tests.faults.outcomes import CPU_SECONDS_MAX, Done

WALL_SECONDS_MAX: Final = 90.0
MORE_MEMORY_BYTES: Final = 3_000_000_000
"""Address space that a call may add: enough to be measured as too much, not enough to bring down the machine."""
FILE_BYTES_MAX: Final = 1 << 29
_WRITES: Final = frozenset({"os.rename", "os.remove", "os.mkdir", "os.rmdir", "os.link", "os.truncate", "os.chmod"})
_COUNTED: Final = struct.Struct("<qqq")
_COUNTERS = mmap.mmap(-1, _COUNTED.size)
"""What the call under way has counted: file events, commits; and the bytes that a fork had from its parent."""
_ASKED: Final = {signal.SIGINT, signal.SIGTERM}
_running: set[int] = set()


@dataclass(frozen=True)
class Moment:
    """When a call is sent which signal: just before it touches a file for the n-th time, or after some seconds."""

    number: int
    event: int | None = None
    seconds: float | None = None


def draw_moment(generator: random.Random, number: int, *, n_events: int, seconds: float) -> Moment:
    """Draw a moment within a call that touches files so often and takes so long."""
    if generator.random() < 0.6:
        return Moment(number, event=generator.randrange(n_events + 1))
    return Moment(number, seconds=generator.uniform(0.0, seconds * 1.1))


def forked(
    words: Sequence[object],
    folder: Path,
    *,
    io: Path,
    at: Moment | None = None,
    before: Callable[[], object] | None = None,
    act: Callable[[], object] | None = None,
    cpu_seconds_max: float = CPU_SECONDS_MAX,
    wall_seconds_max: float = WALL_SECONDS_MAX,
) -> Done:
    """Call `fireworld WORDS...` in a fork of this process.

    Args:
        words: of the command line.
        folder: the current folder of the call.
        io: folder for its output.
        at: when it is sent a signal.
        before: called in the child before the command.
        act: what the child does instead of the command.
        cpu_seconds_max: a call that takes more is ended.
        wall_seconds_max: the same of time that passes.
    """
    _COUNTERS[:] = bytes(_COUNTED.size)
    texts = tuple(map(str, words))
    child = _fork(texts, folder, io, at, before, act, cpu_seconds_max)
    return _taken_by_a_fork(_wait(child, texts, io, at, wall_seconds_max))


def crowd(many: Sequence[Sequence[object]], folder: Path, *, io: Path, cpu_seconds_max: float) -> list[Done]:
    """Call many commands at once, each in a fork of this process; arguments as for `forked`."""
    began = []
    _COUNTERS[:] = bytes(_COUNTED.size)
    for number, words in enumerate(many):
        texts, own = tuple(map(str, words)), io / str(number)
        own.mkdir(parents=True)
        child = _fork(texts, folder, own, None, None, None, cpu_seconds_max)
        _running.add(child)
        began.append((child, texts, own))
    done = [_wait(child, texts, own, None, WALL_SECONDS_MAX) for child, texts, own in began]
    return list(map(_taken_by_a_fork, done))


def process(
    words: Sequence[object],
    folder: Path,
    *,
    io: Path,
    at: Moment | None = None,
    before: Callable[[], object] | None = None,
    environment: Mapping[str, str] | None = None,
    cpu_seconds_max: float = CPU_SECONDS_MAX,
    wall_seconds_max: float = WALL_SECONDS_MAX,
) -> Done:
    """Call `python -m fireworld WORDS...`; arguments as for `forked`."""
    texts = tuple(map(str, words))
    _COUNTERS[:] = bytes(_COUNTED.size)

    def begin() -> None:
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, signal.SIG_DFL)
        _limit(cpu_seconds_max)
        if before is not None:
            before()

    held = _resident_bytes()
    with (io / "out").open("wb") as out, (io / "err").open("wb") as err:
        child = subprocess.Popen(
            [sys.executable, "-m", "fireworld", *texts],
            cwd=folder,
            stdin=subprocess.DEVNULL,
            stdout=out,
            stderr=err,
            env={**os.environ, **(environment or {})},
            start_new_session=True,
            preexec_fn=begin,  # noqa: PLW1509 - this process has one thread
        )
        done = _wait(child.pid, texts, io, at, wall_seconds_max)
        child.returncode = done.code  # it has been waited for
    # Linux counts what a process was before it became another program: no more than that says nothing about the call.
    return done if done.peak_bytes > held else replace(done, peak_bytes=0)


def count_apart() -> None:
    """Let this process count by itself, not with the one that it is a fork of."""
    global _COUNTERS  # noqa: PLW0603 - memory that is shared with children, and with no other
    _COUNTERS = mmap.mmap(-1, _COUNTED.size)


def end_what_runs() -> None:
    """Kill the call under way, and what it started."""
    for pid in [*_running]:
        with suppress(OSError):
            os.killpg(pid, signal.SIGKILL)


def _limit(cpu_seconds_max: float) -> None:
    seconds = int(cpu_seconds_max) + 1
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 2))
    used = _pages(0) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + MORE_MEMORY_BYTES, used + MORE_MEMORY_BYTES))
    resource.setrlimit(resource.RLIMIT_FSIZE, (FILE_BYTES_MAX, FILE_BYTES_MAX))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def _taken_by_a_fork(done: Done) -> Done:
    """Leave out what a fork had from the start; files that its parent has mapped it has not, until it reads them."""
    had = _COUNTED.unpack(_COUNTERS)[2]
    return replace(done, peak_bytes=done.peak_bytes - had if had else 0)  # 0: it was killed before it could tell


def _resident_bytes() -> int:
    """Return how much memory this process has."""
    return _pages(1) * resource.getpagesize()


def _pages(column: int) -> int:
    return int(Path("/proc/self/statm").read_text().split()[column])


def _fork(texts: tuple[str, ...], folder: Path, io: Path, *how: Any) -> int:
    for name in ("out", "err"):
        (io / name).write_bytes(b"")
    before = signal.pthread_sigmask(signal.SIG_BLOCK, _ASKED)  # until the child is the command
    child = os.fork()
    if child == 0:
        _become(texts, folder, io, *how)
    signal.pthread_sigmask(signal.SIG_SETMASK, before)
    return child


def _become(
    words: tuple[str, ...],
    folder: Path,
    io: Path,
    at: Moment | None,
    before: Callable[[], object] | None,
    act: Callable[[], object] | None,
    cpu_seconds_max: float,
) -> NoReturn:
    """Be the child: end as the command line ends."""
    code: Any = 97
    try:
        _COUNTERS[16:] = struct.pack("<q", _resident_bytes())
        os.setsid()
        signal.signal(signal.SIGINT, signal.default_int_handler)
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        for number, name in ((1, "out"), (2, "err")):
            file = os.open(io / name, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
            os.dup2(file, number)
            os.close(file)
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        sys.stdout = open(1, "w", encoding="utf-8", closefd=False)  # noqa: SIM115 - until the end
        sys.stderr = open(2, "w", encoding="utf-8", errors="backslashreplace", closefd=False)  # noqa: SIM115
        os.chdir(folder)
        sys.path[0] = ""
        sys.argv = ["fireworld", *words]
        _limit(cpu_seconds_max)
        if before is not None:
            before()
        _count(at)
        code = _end_of(act)
    finally:
        for stream in (sys.stdout, sys.stderr):
            with suppress(Exception):
                stream.flush()
        os._exit(code if isinstance(code, int) else 0 if code is None else 1)


def _end_of(act: Callable[[], object] | None) -> Any:
    """Do it, and return the exit code as the interpreter would."""
    from fireworld import interrupt
    from fireworld.cli import main

    def begin() -> None:
        end_like_ctrl_c()
        signal.pthread_sigmask(signal.SIG_UNBLOCK, _ASKED)

    end_like_ctrl_c, interrupt.end_like_ctrl_c = interrupt.end_like_ctrl_c, begin
    if act is not None:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, _ASKED)
    try:
        (act or main)()
    except SystemExit as stop:
        return stop.code
    except BaseException as error:  # noqa: BLE001 - what Python itself would do at the end of a program
        import traceback

        traceback.print_exception(error, file=sys.stderr)
        return 130 if isinstance(error, KeyboardInterrupt) else 1
    return 0


def _count(at: Moment | None) -> None:
    """Count file events and commits where the parent sees them; at the right one, send the signal."""
    commit = StepFile.commit
    n_events = 0

    def counted(self: StepFile, step: int, messages: Any) -> None:
        commit(self, step, messages)
        _COUNTERS[8:16] = struct.pack("<q", struct.unpack("<q", _COUNTERS[8:16])[0] + 1)

    def note(event: str, arguments: tuple[Any, ...]) -> None:
        nonlocal n_events
        if event != "open" and event not in _WRITES:
            return
        if event == "open" and not (arguments[2] or 0) & (os.O_WRONLY | os.O_RDWR | os.O_CREAT):
            return
        n_events += 1
        if at is not None and at.event == n_events - 1:
            os.kill(os.getpid(), at.number)
        _COUNTERS[:8] = struct.pack("<q", n_events)

    StepFile.commit = counted  # type: ignore[method-assign]
    sys.addaudithook(note)


def _wait(child: int, words: tuple[str, ...], io: Path, at: Moment | None, wall_seconds_max: float) -> Done:
    """Wait for a call, send it its signal meanwhile, end it if it does not end."""
    _running.add(child)
    watched = os.pidfd_open(child)
    try:
        left, timed_out = wall_seconds_max, False
        if at is not None and at.seconds is not None:
            began = time.monotonic()
            if not select.select([watched], [], [], at.seconds)[0]:
                os.kill(child, at.number)
            left -= time.monotonic() - began
        if not select.select([watched], [], [], left)[0]:
            timed_out = True
            os.killpg(child, signal.SIGKILL)
        _, status, usage = os.wait4(child, 0)
        n_orphans = _end_orphans(child)
    finally:
        os.close(watched)
        _running.discard(child)
    code = os.waitstatus_to_exitcode(status)
    n_events, n_commits, _ = _COUNTED.unpack(_COUNTERS)
    return Done(
        words=words,
        code=code,
        out=(io / "out").read_text("utf-8", "replace"),
        err=(io / "err").read_text("utf-8", "replace"),
        cpu_seconds=usage.ru_utime + usage.ru_stime,
        peak_bytes=usage.ru_maxrss * 1024,
        asked=at.number if at is not None else 0,
        timed_out=timed_out or code == -signal.SIGXCPU,
        n_orphans=n_orphans,
        n_events=n_events,
        n_commits=n_commits,
    )


def _end_orphans(group: int) -> int:
    """Give what a call started three seconds to end; count and kill what has not."""
    for _ in range(60):
        if not _members(group):
            return 0
        time.sleep(0.05)
    left = len(_members(group))
    with suppress(OSError):
        os.killpg(group, signal.SIGKILL)
    return left


def _members(group: int) -> list[int]:
    """Return the living processes of a group."""
    try:
        os.killpg(group, 0)
    except OSError:
        return []
    found = []
    for folder in Path("/proc").iterdir():
        if folder.name.isdigit():
            with suppress(OSError, IndexError):
                words = (folder / "stat").read_text().rpartition(")")[2].split()
                if int(words[2]) == group and words[0] not in "ZX":
                    found.append(int(folder.name))
    return found
