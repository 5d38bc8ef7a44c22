"""A place for a case of a campaign: an empty folder, calls that are judged, and what all cases are made of."""

from __future__ import annotations

import random
import shutil
from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path

from tests.faults import calls
from tests.faults.calls import Moment
from tests.faults.outcomes import CPU_SECONDS_MAX, Done, Outcome, judge

DONE = frozenset({0})
DONE_OR_REFUSED = frozenset({0, 2})
VERDICT_OR_REFUSED = frozenset({0, 1, 2})
PROCESS_SHARE = 0.12
"""Of the cases that could be forks, how many are processes of their own."""


class Bench:
    """Where a case happens.

    Attributes:
        folder: empty, the case's own; the current folder of its calls.
        material: what `tests.faults.material` made; not to be changed.
        outcome: of the case so far; calls add what is wrong with them.
        light: leave out what takes more than some seconds.
        processes: call `python -m fireworld` rather than a fork of this process.
        told: lines that say what was called, for who repeats the case.
    """

    def __init__(self, place: Path, material: Path, *, light: bool = False) -> None:
        self.folder, self.material, self.light = place / "case", material, light
        self.processes = False
        self.outcome = Outcome()
        self.told: list[str] = []
        self._io = place / "io"
        for folder in (self.folder, self._io):
            folder.mkdir(parents=True)

    def bring(self, names: Mapping[str, str] | Sequence[str]) -> None:
        """Copy files or folders of the material, by the names they get: {"a.mcap": "run.mcap"}."""
        pairs = names.items() if isinstance(names, Mapping) else [(name, name) for name in names]
        for name, source in pairs:
            path = self.material / source
            (self.folder / name).parent.mkdir(parents=True, exist_ok=True)
            (shutil.copytree if path.is_dir() else shutil.copy)(path, self.folder / name)

    def call(
        self,
        words: Sequence[object],
        *,
        codes: Collection[int],
        at: Moment | None = None,
        before: Callable[[], object] | None = None,
        act: Callable[[], object] | None = None,
        environment: Mapping[str, str] | None = None,
        cpu_seconds_max: float = CPU_SECONDS_MAX,
        folder: Path | None = None,
    ) -> Done:
        """Call a command, or let a fork do something else, and note what is wrong with how it ended.

        Args:
            words: of the command line; of what a fork does instead, its name.
            codes: right exit codes.
            at: when to send it a signal.
            before: what the child does before.
            act: what a fork does instead.
            environment: variables that differ; the call is a process then.
            cpu_seconds_max: what it may take.
            folder: its current folder, if not the case's.
        """
        place = folder or self.folder
        if act is None and (self.processes or environment is not None):
            if at is not None and at.seconds is None:
                at = Moment(at.number, seconds=0.05 * (at.event or 0) % 1.5)
            self.outcome.n_processes += 1
            done = calls.process(
                words,
                place,
                io=self._io,
                at=at,
                before=before,
                environment=environment,
                cpu_seconds_max=cpu_seconds_max,
            )
        else:
            done = calls.forked(
                words, place, io=self._io, at=at, before=before, act=act, cpu_seconds_max=cpu_seconds_max
            )
        self._note(done, codes, cpu_seconds_max)
        return done

    def crowd(
        self, many: Sequence[Sequence[object]], *, codes: Collection[int], cpu_seconds_max: float = CPU_SECONDS_MAX
    ) -> list[Done]:
        """Call many commands at once, each in a fork; arguments as for `call`."""
        found = calls.crowd(many, self.folder, io=self._io / "crowd", cpu_seconds_max=cpu_seconds_max)
        for done in found:
            self._note(done, codes, cpu_seconds_max)
        return found

    def _note(self, done: Done, codes: Collection[int], cpu_seconds_max: float) -> None:
        self.told.append(f"{' '.join(done.words)}: {done.code}, {done.cpu_seconds:.2f} s: {done.line}")
        wrong = judge(done, codes, cpu_seconds_max=cpu_seconds_max)
        self.told += [done.err.strip()] if wrong else []
        self.outcome.failures += wrong

    def files(self) -> dict[str, bytes]:
        """Return the files of the folder, and of those in it, by their names in it."""
        return files_of(self.folder)


def files_of(folder: Path) -> dict[str, bytes]:
    """Return all files below a folder, by their paths in it."""
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


def as_process(generator: random.Random, share: float = PROCESS_SHARE) -> bool:
    """Draw whether a case calls processes."""
    return generator.random() < share
