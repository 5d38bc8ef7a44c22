"""A warm process that forks children which record, and kills each at a random moment.

`python -m tests.faults.nursery KIND N FOLDER`, KIND being `writer` (records made beforehand, written as fast as can
be) or `run` (`fireworld run --record`). Prints what became of each child: how many steps it knew to be safe when it
died. A fork of a warm process costs a millisecond where a new Python costs a second.
"""

from __future__ import annotations

import json
import mmap
import os
import random
import signal
import sys
import time
from collections.abc import Callable
from pathlib import Path

from fireworld_recorder.writer import LogWriter

N_STEPS = {"writer": 120, "run": 40}
"""Last step of what the children record, by kind; a step of the writer alone takes a tenth of a millisecond."""
RUN = ("run", "quick", "--policy", "chief", "--steps", str(N_STEPS["run"]), "--record")


def count_safe_steps(counter: mmap.mmap) -> None:
    """Let every writer count, where the parent sees it, the steps that it has been told are safe."""
    write = LogWriter.write

    def counted(self: LogWriter, record: object) -> None:
        write(self, record)
        counter[0] += 1

    LogWriter.write = counted


def make_writer() -> Callable[[Path], None]:
    from tests.recorder import synthetic

    city = synthetic.city()
    records = synthetic.run(N_STEPS["writer"], city_record=city)

    def record(path: Path) -> None:
        with LogWriter(path, synthetic.header(), city) as log:
            for step in records:
                log.write(step)

    return record


def make_run() -> Callable[[Path], None]:
    from fireworld.cli import main

    def record(path: Path) -> None:
        sys.argv = ["fireworld", *RUN, str(path)]
        try:
            main()
        except SystemExit as stop:
            if stop.code:
                raise

    return record


def kill_one(record: Callable[[Path], None], path: Path, counter: mmap.mmap, step: int, moment_seconds: float) -> bool:
    """Let a child record and kill it a moment after a step of its; return whether it was still alive."""
    counter[0] = 0
    child = os.fork()
    if child == 0:
        record(path)
        os._exit(0)
    while counter[0] < step and os.waitid(os.P_PID, child, os.WEXITED | os.WNOHANG | os.WNOWAIT) is None:
        os.sched_yield()  # a sleep would last longer than a step
    end = time.perf_counter() + moment_seconds
    while time.perf_counter() < end:
        pass
    os.kill(child, signal.SIGKILL)
    return os.WIFSIGNALED(os.waitpid(child, 0)[1])


def main() -> None:
    kind, n, folder = sys.argv[1], int(sys.argv[2]), Path(sys.argv[3])
    counter = mmap.mmap(-1, 8)
    count_safe_steps(counter)
    record = {"writer": make_writer, "run": make_run}[kind]()
    output, sys.stdout = sys.stdout, open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115, PTH123 - for good
    record(folder / "whole.mcap")
    generator = random.Random(1)
    for number in range(n):
        step, moment_seconds = generator.randrange(N_STEPS[kind]), generator.uniform(0, 0.0005)
        killed = kill_one(record, folder / f"{number}.mcap", counter, step, moment_seconds)
        output.write(json.dumps({"name": f"{number}.mcap", "killed": killed, "n_safe": counter[0]}) + "\n")


if __name__ == "__main__":
    main()
