"""Damaged logs, of runs and of trainings, through every command that reads logs."""

from __future__ import annotations

import random
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from fireworld_recorder.kind import RUN
from fireworld_recorder.reader import open_log

from fireworld.errors import FireworldError
from fireworld.training.log.reader import open_training
from tests.faults.bench import Bench, as_process
from tests.faults.damaged import Damaged, damaged, kind_of
from tests.faults.material import PLAYED_LOGS, RUN_LOGS, SHORT_WORDS, TRAINING_LOGS
from tests.faults.outcomes import Done, Outcome

NAME: Final = "damage"
SHARE: Final = 0.26

READS: Final = frozenset({0, 2})
JUDGES: Final = frozenset({0, 1, 2})


@dataclass(frozen=True)
class Reader:
    """A command that reads a log, a.mcap, beside good.mcap, the log before something was done to it.

    Attributes:
        words: of it.
        codes: right exit codes whatever the log is.
        whole: it takes complete logs only.
        judges: it compares with the truth: altered values never make a 0, values as they were never a 1.
        outputs: files that it writes; it writes all of them and exits 0, or none.
    """

    words: tuple[object, ...]
    codes: frozenset[int] = READS
    whole: bool = False
    judges: bool = False
    outputs: tuple[str, ...] = ()


OF_ALL: Final = (
    Reader(("info", "a.mcap"), JUDGES),
    Reader(("info", "a.mcap", "--json"), JUDGES),
    Reader(("info", "a.mcap", "--schema"), JUDGES),
    Reader(("diff", "good.mcap", "a.mcap"), JUDGES, whole=True, judges=True),
    Reader(("diff", "a.mcap", "good.mcap", "--json"), JUDGES, whole=True, judges=True),
    Reader(("diff", "a.mcap", "good.mcap", "--partial"), JUDGES),
    Reader(("verify", "a.mcap"), JUDGES, judges=True),
    Reader(("verify", "a.mcap", "--json"), JUDGES, judges=True),
    Reader(("recover", "a.mcap", "-o", "o.mcap"), outputs=("o.mcap",)),
    Reader(("export", "a.mcap", "--parquet", "o"), outputs=("o",)),
    Reader(("report", "a.mcap", "-o", "o.html"), outputs=("o.html",)),
    Reader(("play", "a.mcap", "-o", "o.html"), outputs=("o.html",)),
    Reader(("render", "a.mcap", "-o", "o.png"), outputs=("o.png",)),
    Reader(("view", "a.mcap", "--save", "o.rrd"), outputs=("o.rrd",)),
    Reader(("view", "good.mcap", "a.mcap", "--save", "o.rrd"), outputs=("o.rrd",)),
    Reader(("golden", "check", "g"), JUDGES, judges=True),
    Reader(("golden", "check", "g", "--junit", "o.xml", "--json"), JUDGES, judges=True),
    Reader(("golden", "update", "--dir", "g", "--reason", "Damage."), READS),
)
OF_RUNS: Final = (
    Reader(("diff", "good.mcap", "a.mcap", "--html", "o.html", "--junit", "o.xml"), JUDGES, whole=True, judges=True),
    Reader(("report", "good.mcap", "a.mcap", "-o", "o.html"), outputs=("o.html",)),
    Reader(("play", "good.mcap", "a.mcap", "-o", "o.html"), outputs=("o.html",)),
    Reader(("play", "a.mcap", "-o", "o.html", "--from", 2, "--every", 3), outputs=("o.html",)),
    Reader(("render", "a.mcap", "-o", "o.png", "--steps", "0,3,last"), outputs=("o.png",)),
    Reader(("render", "a.mcap", "good.mcap", "-o", "o.gif", "--every", 6), outputs=("o.gif",)),
    Reader(("view", "a.mcap", "--save", "o.rrd", "--air"), outputs=("o.rrd",)),
    Reader(("fork", "a.mcap", "--at", 4, "--record", "o.mcap"), outputs=("o.mcap",)),
    Reader(("fork", "a.mcap", "--at", 2, "--policy", "recorded", "--record", "o.mcap"), outputs=("o.mcap",)),
    Reader(("fork", "good.mcap", "--at", 2, "--swap", "a.mcap:0", "--record", "o.mcap"), outputs=("o.mcap",)),
    Reader(("export", "good.mcap", "a.mcap", "--rlds", "o"), outputs=("o",)),
    Reader(("explain", "a.mcap", "other.mcap", "--budget", 6), whole=True),
    Reader(("explain", "other.mcap", "a.mcap", "--budget", 6, "--json"), whole=True),
)
OF_TRAININGS: Final = (
    Reader(("replay", "a.mcap", "--scenario", "alone-1", "--episode", 0, "-o", "o.mcap"), outputs=("o.mcap",)),
    Reader(("replay", "a.mcap", "--every", 4, "-o", "episodes")),
    Reader(("verify", "a.mcap", "--team", "team.npz"), JUDGES),
    Reader(("policy", "show", "team.npz", 0, "--log", "a.mcap")),
    Reader(("policy", "show", "team.npz", "--log", "a.mcap", "--json")),
    Reader(("train", "tiny.yaml", *SHORT_WORDS, "--jobs", 1, "-o", "t.npz", "--record", "r.mcap", "--resume")),
)

OF_PLAYED: Final = (
    Reader(("replay", "a.mcap", "--episode", 1, "-o", "o.mcap"), outputs=("o.mcap",)),
    Reader(("replay", "a.mcap", "--world", 1, "--episode", 0, "-o", "o.mcap"), outputs=("o.mcap",)),
    Reader(("replay", "a.mcap", "--scenario", "quick", "--episode", -1, "-o", "o.mcap"), outputs=("o.mcap",)),
    Reader(("replay", "a.mcap", "--every", 2, "-o", "episodes")),
    Reader(("export", "a.mcap", "--rlds", "o"), outputs=("o",)),
    Reader(("export", "good.mcap", "a.mcap", "other.mcap", "--rlds", "o", "--observation", "targets"), outputs=("o",)),
)


def run(generator: random.Random, bench: Bench) -> Outcome:
    """Do something to a log, and let a command read it."""
    name = generator.choice((*RUN_LOGS, *RUN_LOGS, *TRAINING_LOGS))
    source = bench.material / name
    of_run = kind_of(source) == RUN
    reader = generator.choice((*OF_ALL, *_readers_of(name, of_run=of_run)))
    other = bench.material / generator.choice((*RUN_LOGS, *TRAINING_LOGS))
    found = damaged(generator, source, other, bench.folder)
    bench.processes = as_process(generator, 0.05)
    bench.bring({"good.mcap": name, "other.mcap": "other.mcap", "mine.py": "mine.py", "tiny.yaml": "tiny.yaml"})
    bench.bring({"team.npz": "ranking.npz" if name == "search.mcap" else "team.npz"})
    for path in ("a.mcap", "g/golden.mcap", "r.mcap.partial"):
        (bench.folder / path).parent.mkdir(exist_ok=True)
        (bench.folder / path).write_bytes(found.data)
    (bench.folder / "episodes").mkdir()
    before = None
    if found.how == "cut" and generator.random() < 0.4:
        bench.processes, before = False, _still_written(bench.folder / "a.mcap", source.read_bytes(), len(found.data))
    state = _state(bench.folder / "a.mcap", of_run=of_run)
    done = bench.call(reader.words, codes=reader.codes, before=before)
    bench.told.append(f"{name}, {found.how}, {state}")
    if before is None:
        _look(bench, reader, found, state, done, same=found.data == source.read_bytes())
    bench.outcome.refused += done.code == 2
    bench.outcome.survived += done.code != 2
    return bench.outcome


def _readers_of(name: str, *, of_run: bool) -> tuple[Reader, ...]:
    if of_run:
        return OF_RUNS
    return OF_PLAYED if name in PLAYED_LOGS else OF_TRAININGS


def _state(path: Path, *, of_run: bool) -> str:
    """Return complete, partial, damaged; or unreadable. An error of the wrong kind is one of the case."""
    try:
        log = (open_log if of_run else open_training)(path, partial=True)
        return log.state if len(log) else "unreadable"
    except FireworldError:
        return "unreadable"


def _look(bench: Bench, reader: Reader, found: Damaged, state: str, done: Done, *, same: bool) -> None:
    """Compare the exit code with what the log is; look for half outputs."""
    outcome, said = bench.outcome, f"`{' '.join(done.words)}` of a log that is {found.how}, {state}"
    if state == "unreadable" and reader.words[0] not in {"info", "train"} and "g" not in reader.words:
        outcome.expect(done.code != 1, f"{said}: exits 1 without a verdict: {done.line}", "exit code")
    if reader.words[0] == "info" and "--schema" not in reader.words and done.code != 2:
        outcome.expect(done.code == (state != "complete"), f"{said}: exits {done.code}", "exit code")
    if reader.whole and state in {"partial", "damaged"}:
        outcome.expect(done.code == 2, f"{said}: expected 2, got {done.code}", "exit code")
    if reader.judges and not found.values:
        outcome.expect(
            done.code != 1 or "g" in reader.words, f"{said}: a verdict 1 on values as they were", "exit code"
        )
    if reader.judges and state != "complete" and "verify" not in reader.words:
        outcome.expect(done.code != 0, f"{said}: exits 0", "exit code")
    for name in reader.outputs:
        there = (bench.folder / name).exists()
        outcome.expect(there == (done.code == 0), f"{said}: exits {done.code}, {name} is there: {there}", "half file")
    left = [
        name for name in bench.files() if (".partial" in name and name != "r.mcap.partial") or ".fireworld-" in name
    ]
    allowed = {"o.mcap.partial"} if reader.words[0] == "fork" else {"r.mcap.partial"}
    outcome.expect(set(left) <= allowed, f"{said}: left {', '.join(left)}")
    del same


def _still_written(path: Path, data: bytes, at: int) -> Callable[[], object]:
    """Let the child go on writing the log while it reads it."""

    def write() -> None:
        with path.open("ab", buffering=0) as file:
            for begin in range(at, len(data), 700):
                file.write(data[begin : begin + 700])
                time.sleep(0.002)

    return threading.Thread(target=write, daemon=True).start
