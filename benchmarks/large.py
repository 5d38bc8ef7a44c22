"""Measure all commands that make or read a log with runs of a large city: CPU seconds and peak memory.

    python -m benchmarks.large [--columns 400] [--rows 250] [--steps 300]

Two kinds of runs, each under two policies: the small fire of the scenario `default`, and five big fires that take a
third of the city. Every command is a process of its own; its peak is that of its resident memory, and for Rerun's
viewer, which draws by software here, that of the pictures too. The table is that of docs/large-cities.md.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import Final

from benchmarks.machine import describe
from tests.viewer.headless import has_driver, headless, loaded

FIRE_SHARE: Final = 0.02
"""Of the city's buildings that burn in each of five fires at the start."""
PLACES: Final = ((0.2, 0.2), (0.8, 0.2), (0.5, 0.5), (0.2, 0.8), (0.8, 0.8))
POLICIES: Final = ("chief", "nearest-to-me")
CALL: Final = "from fireworld.cli import main; main()"
READ: Final = {
    "info": "info a.mcap",
    "verify": "verify a.mcap",
    "view --save": "view a.mcap --save one.rrd",
    "view --save, two logs": "view a.mcap b.mcap --save two.rrd",
    "view --save --air": "view a.mcap --air --save air.rrd",
    "diff": "diff a.mcap b.mcap",
    "diff --html": "diff a.mcap b.mcap --html diff.html",
    "report": "report a.mcap -o one.html",
    "report, two logs": "report a.mcap b.mcap -o two.html",
    "play": "play a.mcap -o play.html",
    "play, two logs": "play a.mcap b.mcap -o play-two.html",
    "render, a still": "render a.mcap -o still.png",
    "render, two logs": "render a.mcap b.mcap -o pair.png",
    "render, a strip of four": "render a.mcap -o strip.png --steps 0,{third},{half},last",
    "render, a film": "render a.mcap -o film.gif",
    "export --parquet": "export a.mcap --parquet tables",
    "recover": "recover a.mcap -o recovered.mcap",
    "fork, in the middle": "fork a.mcap --at {half} --policy each-another --record fork.mcap",
    "explain, 20 replays": "explain a.mcap b.mcap --budget 20",
}
"""By what the table calls it: a command; `a.mcap` and `b.mcap` are the runs under the two policies."""


@dataclass(frozen=True)
class Cost:
    """What a command took."""

    seconds: float
    """Of CPU."""
    peak_gb: float

    def __str__(self) -> str:
        return f"{self.seconds:.1f} s, {self.peak_gb:.2f} GB"


def five_fires(columns: int, rows: int, *, steps: int) -> str:
    """Write a scenario with five fires, evenly spread over a generated city."""
    n = round(FIRE_SHARE * columns * rows)
    fires = "".join(f"  - {{at: [{x}, {y}], n_buildings: {n}}}\n" for x, y in PLACES)
    return (
        f"preset: paper\ncity: {{generated: {{columns: {columns}, rows: {rows}, seed: 1}}}}\nfires:\n{fires}"
        f"civilians: {{n: 10}}\nbrigades: {{n: 4}}\nsteps: {steps}\n"
    )


def measured(words: Sequence[str], folder: Path) -> Cost:
    """Run a command of fireworld in a folder; its exit code is 0, or 1 of a comparison."""
    with (folder / "out.txt").open("wb") as out:
        process = subprocess.Popen([sys.executable, "-c", CALL, *words], cwd=folder, stdout=out, stderr=out)
        _, status, use = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode not in {0, 1}:
        sys.exit(f"{' '.join(words)}: {(folder / 'out.txt').read_text()}")
    return Cost(use.ru_utime + use.ru_stime, use.ru_maxrss / 1e6)


def viewed(path: Path, steps: int) -> float:
    """Open a Rerun file without a window, look at six of its steps, and return the viewer's peak memory in GB."""
    with tempfile.TemporaryDirectory() as home, headless(Path(home)) as (viewer, _):
        viewer.open(str(path))
        loaded(viewer)
        for step in (1, *(steps * k // 5 for k in range(1, 6))):
            viewer.set_time("step", sequence=step)
            before = b""
            while (now := viewer.take_screenshot()) != before:
                before = now
        return _peak_gb_of_viewer()


def _peak_gb_of_viewer() -> float:
    """Return the peak memory of the one viewer that is a child of this process."""
    for status in Path("/proc").glob("[0-9]*/status"):
        lines = dict(line.split(":", 1) for line in status.read_text().splitlines() if ":" in line)
        if int(lines["PPid"]) == os.getpid() and "VmHWM" in lines:
            return int(lines["VmHWM"].split()[0]) / 1e6
    raise AssertionError("the viewer runs")


def costs(scenario: Sequence[str], folder: Path, *, steps: int) -> Iterator[tuple[str, str]]:
    """Record two runs and read them with every command; yield what it is and what it took."""
    for name, policy in zip("ab", POLICIES, strict=True):
        words = ("run", *scenario, "--policy", policy, "--steps", str(steps), "--record", f"{name}.mcap")
        cost = measured(words, folder)
        if name == "a":
            yield f"run --record, {(folder / 'a.mcap').stat().st_size / 1e6:.0f} MB", str(cost)
    for what, command in READ.items():
        words = command.format(third=steps // 3, half=steps // 2).split()
        yield what, str(measured(words, folder))
    for name, what in (("one", "Rerun's viewer"), ("two", "Rerun's viewer, two logs")) if has_driver() else ():
        path = folder / f"{name}.rrd"
        with get_context("spawn").Pool(1) as pool:  # whoever loads Rerun is large, and so are its children at first
            peak_gb = pool.apply(viewed, (path, steps))
        yield f"{what}, {path.stat().st_size / 1e6:.0f} MB", f"{peak_gb:.2f} GB"


def main() -> None:
    """Measure and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name, default in (("columns", 400), ("rows", 250), ("steps", 300)):
        parser.add_argument(f"--{name}", type=int, default=default)
    given = parser.parse_args()
    size = [f"city.generated.columns={given.columns}", f"city.generated.rows={given.rows}"]
    print(", ".join(f"{name} {value}" for name, value in describe().items()))
    for kind in ("one small fire", "five big fires"):
        print(f"\n{given.columns * given.rows} buildings, {given.steps} steps, {kind}", flush=True)
        with tempfile.TemporaryDirectory(prefix="fireworld-large-") as name:
            folder = Path(name)
            scenario = ["default", *(word for one in size for word in ("--set", one))]
            if kind == "five big fires":
                (folder / "five.yaml").write_text(five_fires(given.columns, given.rows, steps=given.steps))
                scenario = ["five.yaml"]
            began = time.monotonic()
            for what, cost in costs(scenario, folder, steps=given.steps):
                print(f"| {what} | {cost} |", flush=True)
            print(f"in {time.monotonic() - began:.0f} s")


if __name__ == "__main__":
    main()
