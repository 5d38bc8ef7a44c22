"""Kills of every command that writes, at random moments: whole files or none, logs to recover, a second call works."""

from __future__ import annotations

import random
import signal
from pathlib import Path
from typing import Final

from fireworld_recorder.reader import open_log

from fireworld.errors import FireworldError
from tests.faults import whole
from tests.faults.bench import DONE, Bench, as_process
from tests.faults.calls import draw_moment
from tests.faults.outcomes import Outcome, came_before_fireworld
from tests.faults.writers import OFTEN, WRITERS, Whole, call_again, look, missing_files, whole_call

NAME: Final = "kills"
SHARE: Final = 0.27
"""Of the time of a campaign."""
SIGNALS: Final = (signal.SIGKILL, signal.SIGKILL, signal.SIGTERM, signal.SIGINT)
INTERRUPTED: Final = 130


def run(generator: random.Random, bench: Bench) -> Outcome:
    """Kill a writer at a random moment; look at what it left; call it again."""
    name = "reproduce" if generator.random() < 0.01 else generator.choice(OFTEN)
    writer, number = WRITERS[name], generator.choice(SIGNALS)
    expected = whole_call(name, bench.material)
    bench.processes = as_process(generator) and writer.before is None
    bench.bring(writer.given)
    given = bench.files()
    seconds = expected.seconds + 1.0 if bench.processes else expected.seconds
    moment = draw_moment(generator, number, n_events=expected.n_events, seconds=seconds)
    done = bench.call(
        writer.words,
        codes={expected.code, -number} if number == signal.SIGKILL else {expected.code, INTERRUPTED, -number},
        at=moment,
        before=writer.before,
    )
    bench.told.append(f"{name}, signal {number} at {moment}")
    if number != signal.SIGKILL and done.code == -number:
        begun = not bench.processes or not came_before_fireworld(done) or bench.files() != given
        bench.outcome.expect(not begun, f"`{' '.join(done.words)}`: ended by signal {number}: {done.line}", "exit code")
    finished = done.code == expected.code
    look(bench, writer, expected, given, killed=done.code < 0)
    if finished:
        bench.outcome.expect(
            missing_files(expected, bench) == [], f"{name} ended well without all of its files", "half file"
        )
        bench.outcome.survived += 1
        return bench.outcome
    for path in bench.folder.rglob("*.mcap.partial"):
        _recover(bench, path, expected, n_safe=done.n_commits if name.startswith("run") else 0)
    call_again(bench, name, writer, expected)
    bench.outcome.survived += not bench.outcome.failures
    return bench.outcome


def _recover(bench: Bench, partial: Path, expected: Whole, *, n_safe: int) -> None:
    """Check what a killed recording left: every step that was said to be safe, and no other."""
    try:
        log = open_log(partial, partial=True)
    except FireworldError as error:  # killed before the header was there; or the log of a training
        if "a training" not in str(error):
            bench.outcome.expect(n_safe == 0, f"{partial.name}: {n_safe} steps were safe: {error}")
        return
    final = str(partial.relative_to(bench.folder)).removesuffix(".partial")
    bench.outcome.expect(len(log) >= n_safe, f"{partial.name}: {n_safe} steps were safe, {len(log)} are there")
    if len(log) and final in expected.files:
        bench.call(("recover", str(partial), "-o", "rescued.mcap"), codes=DONE)
        whole_path = bench.folder / "whole.mcap"
        whole_path.write_bytes(expected.files[final])
        same = whole.is_beginning(bench.folder / "rescued.mcap", whole_path)
        bench.outcome.expect(same, f"{partial.name}: what is rescued is no beginning of the run")
        (bench.folder / "rescued.mcap").unlink(missing_ok=True)
        whole_path.unlink()
