"""Measure this tree against another commit, in turns: `python -m benchmarks.against COMMIT [--only TEXT] [--json]`."""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Final

import click

from benchmarks import side
from benchmarks.bench import print_table
from benchmarks.machine import describe
from benchmarks.timing import ROUNDS_MIN, Row

ROOT: Final = Path(__file__).parents[1]
CAPTION: Final = (
    "Medians of processor time. The ratio is the other commit / this tree, the median of rounds in turn, with its"
    " quartiles; below 1 where this tree is slower."
)


@contextmanager
def checked_out(commit: str, folder: Path) -> Iterator[Path]:
    """Check a commit out into a working tree of its own, for as long as it is needed."""
    git = ["git", "-C", str(ROOT), "worktree"]
    subprocess.run([*git, "add", "--quiet", "--detach", str(folder), commit], check=True)
    try:
        yield folder
    finally:
        subprocess.run([*git, "remove", "--force", str(folder)], check=True)


@contextmanager
def side_of(root: Path, folder: Path) -> Iterator[subprocess.Popen[str]]:
    """Start a process that works with the packages below `root`; it works and keeps its compiled code in `folder`."""
    folder.mkdir()
    places = [root, *(root / name for name in ("recorder", "viewer") if (root / name / f"fireworld_{name}").is_dir())]
    settings = {"PYTHONPATH": os.pathsep.join(map(str, places)), "NUMBA_CACHE_DIR": str(folder / "compiled")}
    with subprocess.Popen(
        [sys.executable, side.__file__],
        cwd=folder,
        env=os.environ | settings,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        yield process


def ask(process: subprocess.Popen[str], row: str) -> float | str:
    """Let a side do the work of a row; return the seconds it took, or why it cannot be done."""
    assert process.stdin is not None
    assert process.stdout is not None
    print(row, file=process.stdin, flush=True)
    answer = json.loads(process.stdout.readline())
    return float(answer["seconds"]) if "seconds" in answer else str(answer["skipped"])


def compared(row: str, sides: tuple[subprocess.Popen[str], ...], *, commit: str, seconds: float) -> Row:
    """Time a row on both sides, in turns, for about that long."""
    first = [ask(process, row) for process in sides]
    for name, answer in zip(("this tree", commit), first, strict=True):
        if isinstance(answer, str):
            return Row("", row, "", "", 0.0, note=f"left out, {name}: {answer}")
    times: tuple[list[float], list[float]] = ([], [])
    end = time.perf_counter() + seconds
    while len(times[0]) < ROUNDS_MIN or time.perf_counter() < end:
        turns = (0, 1) if len(times[0]) % 2 == 0 else (1, 0)
        for turn in turns:
            times[turn].append(float(ask(sides[turn], row)))
    low, middle, high = statistics.quantiles([b / a for a, b in zip(*times, strict=True)], n=4)
    ours, theirs = (statistics.median(found) for found in times)
    return Row(
        "", row, "", "", ours, commit, theirs, ratio=middle, ratio_low=low, ratio_high=high, rounds=len(times[0])
    )


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
@click.argument("commit")
@click.option("--only", multiple=True, metavar="TEXT", help="Rows whose name contains this; may be repeated.")
@click.option("--seconds", type=float, default=10.0, show_default=True, help="How long a row is measured.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON instead of a table.")
def main(commit: str, *, only: tuple[str, ...], seconds: float, as_json: bool) -> None:
    """Measure this tree and COMMIT in one run and print the ratios of their times, row by row."""
    rows = [row for row in side.ROWS if not only or any(text in row for text in only)]
    found: list[Row] = []
    with tempfile.TemporaryDirectory() as name:
        place = Path(name)
        with (
            checked_out(commit, place / "commit") as other,
            side_of(ROOT, place / "ours") as ours,
            side_of(other, place / "theirs") as theirs,
        ):
            for row in rows:
                click.echo(row, err=True)
                found.append(compared(row, (ours, theirs), commit=commit, seconds=seconds))
    machine = describe()
    if as_json:
        click.echo(json.dumps({"machine": machine, "commit": commit, "rows": [asdict(row) for row in found]}, indent=1))
    else:
        print_table(found, machine, caption=CAPTION)


if __name__ == "__main__":
    main()
