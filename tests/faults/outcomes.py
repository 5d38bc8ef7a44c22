"""What a call of a campaign did, what is wrong with it whatever it was asked, and what came of a case."""

from __future__ import annotations

import re
from collections.abc import Collection
from dataclasses import dataclass, field
from typing import Final

CPU_SECONDS_MAX: Final = 10.0
MEMORY_BYTES_MAX: Final = 1_000_000_000
USER_ERROR: Final = 2

FAILURES: Final = ("traceback", "exit code", "half file", "memory", "hang", "line", "other")
"""Kinds of failures; "line": a refusal that is not one clear line, "other": any other broken promise."""
_TRACEBACKS: Final = ("Traceback (most recent call last)", "internal error", "Exception ignored", "Fatal Python error")
_BEGUN: Final = re.compile(r"fireworld/(?!__main__|__init__|version)\w+")
_LINE: Final = re.compile(r"^(fireworld: .+|Error: .+|golden: .+)$")
_ESCAPES: Final = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]")


@dataclass(frozen=True)
class Failure:
    """A broken promise: its kind, one of FAILURES, and what happened."""

    kind: str
    text: str


@dataclass(frozen=True)
class Done:
    """How a call ended.

    Attributes:
        words: of the command line.
        code: the exit code; below zero the signal that ended it.
        out, err: what it wrote.
        cpu_seconds, peak_bytes: what it took, with the processes it waited for; not what a fork had from the start.
        asked: the signal that it was sent, 0 for none.
        timed_out: it was killed because it did not end.
        n_orphans: processes it left behind.
        n_events: times that it touched a file to write.
        n_commits: commits of a log that it was told are safe.
    """

    words: tuple[str, ...]
    code: int
    out: str
    err: str
    cpu_seconds: float
    peak_bytes: int
    asked: int = 0
    timed_out: bool = False
    n_orphans: int = 0
    n_events: int = 0
    n_commits: int = 0

    @property
    def line(self) -> str:
        """The last line of the error stream."""
        lines = self.err.strip().splitlines()
        return lines[-1] if lines else ""


@dataclass
class Outcome:
    """What came of a case.

    Attributes:
        n_inputs: what it tried.
        n_processes: how many of its calls were processes of their own.
        refused, survived: inputs that were refused in one clear line; that were done, or did no harm.
        failures: broken promises.
        notes: what a reader of the table should know, each once.
    """

    n_inputs: int = 1
    n_processes: int = 0
    refused: int = 0
    survived: int = 0
    failures: list[Failure] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def fail(self, kind: str, text: str) -> None:
        """Note a broken promise."""
        assert kind in FAILURES
        self.failures.append(Failure(kind, text))

    def expect(self, condition: object, text: str, kind: str = "other") -> None:
        """Note a broken promise unless it was kept."""
        if not condition:
            self.fail(kind, text)


def judge(done: Done, codes: Collection[int], *, cpu_seconds_max: float = CPU_SECONDS_MAX) -> list[Failure]:
    """Return what is wrong with a call, whatever it was asked: `codes` are the right exit codes."""
    found = []
    said = f"`{' '.join(done.words)}`"
    for sign in _TRACEBACKS:
        if sign in done.err and not came_before_fireworld(done):
            found.append(Failure("traceback", f"{said}: {_around(done.err, sign)}"))
            break
    if done.timed_out or done.cpu_seconds > cpu_seconds_max:
        end = "did not end" if done.timed_out else "ended"
        found.append(Failure("hang", f"{said}: {end}, {done.cpu_seconds:.1f} s of CPU"))
    elif done.code not in codes:
        wanted = ", ".join(map(str, sorted(codes)))
        found.append(Failure("exit code", f"{said}: expected {wanted}, got {done.code}: {done.line}"))
    if done.peak_bytes > MEMORY_BYTES_MAX:
        found.append(Failure("memory", f"{said}: {done.peak_bytes / 1e6:.0f} MB"))
    if done.n_orphans:
        found.append(Failure("other", f"{said}: left {done.n_orphans} processes behind"))
    if done.code == USER_ERROR and not done.timed_out and done.words[0] != "pytest":
        found += [Failure("line", f"{said}: {fault}") for fault in faults_of_a_refusal(done)]
    return found


def came_before_fireworld(done: Done) -> bool:
    """Return whether a signal came while Python itself began, before there was a command line to take it."""
    return not done.err or (done.line == "KeyboardInterrupt" and not _BEGUN.search(done.err))


def faults_of_a_refusal(done: Done) -> list[str]:
    """Return what is wrong with what was said with exit code 2: it is one printable line that says something."""
    lines = [line for line in done.err.splitlines() if _LINE.match(line) and " cannot be kept in " not in line]
    if done.words[:2] == ("golden", "check") and not lines:
        return [] if done.out.strip() else ["nothing was said"]  # in its table, beside those that are the same
    if len(lines) != 1:
        return [f"expected one line of complaint, got {len(lines)}: {done.err.strip()[-300:]!r}"]
    if _ESCAPES.search(lines[0]):
        return [f"control characters in the complaint: {lines[0]!r}"]
    return [] if len(lines[0].split()) > 3 else [f"expected a complaint that helps, got {lines[0]!r}"]


def _around(text: str, sign: str) -> str:
    at = text.index(sign)
    lines = text[at:].strip().splitlines()
    return " / ".join(line.strip() for line in [*lines[:1], *lines[-3:]])[:600]
