"""The runs of a study of readings: kept in its folder as they come, and found there again."""

from __future__ import annotations

import csv
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from fireworld.errors import OutputError, TrainingError, expected
from fireworld.files import write_file
from fireworld.training.training import check_same

RUNS: Final = "readings-runs.csv"
SETTINGS: Final = "readings-settings.json"
HEADS: Final = ("reading", "training", "seed", "cooperative", "non_cooperative")
Key = tuple[int, int]  # a reading and the seed of its training


class Runs:
    """The runs of a study: a CSV file that a trial's lines are appended to once it is done.

    Attributes:
        found: by reading and training, the shares with and without cooperation of every seed.
    """

    def __init__(self, folder: Path, identity: dict[str, Any]) -> None:
        self._folder, self._identity = folder, identity
        self._seeds = [int(seed) for seed in identity["seeds"]]
        self.found: dict[Key, list[tuple[float, float]]] = {}

    def open(self, *, resume: bool, force: bool) -> None:
        """Begin the file, or read what is in it; errors as for `try_readings`."""
        settings, runs = self._folder / SETTINGS, self._folder / RUNS
        try:
            if resume:
                check_same(json.loads(settings.read_bytes()), self._identity, settings)
                self._read(runs)
                self.sort()  # without what a kill has left of a trial
                return
            if not force and self._folder.exists() and any(self._folder.iterdir()):
                hint = "--resume continues it, --force replaces what is there"
                raise OutputError(
                    expected(str(self._folder), "", "a free name or an empty folder", "what is there", hint)
                )
            self._folder.mkdir(exist_ok=True)
        except (OSError, ValueError) as error:
            hint = "leave out --resume" if resume else ""
            raise OutputError(expected(str(self._folder), "", "a folder of readings", error, hint)) from None
        write_file(settings, json.dumps(self._identity) + "\n")
        self.sort()

    def add(self, key: Key, seeds: Sequence[int], shares: list[tuple[float, float]]) -> None:
        """Append a trial's lines."""
        self.found[key] = shares
        lines = [
            f"{key[0]},{key[1]},{seed},{one!r},{other!r}\n" for seed, (one, other) in zip(seeds, shares, strict=True)
        ]
        try:
            with (self._folder / RUNS).open("a", encoding="utf-8") as file:
                file.write("".join(lines))
        except OSError as error:
            raise OutputError(f"{self._folder / RUNS}: cannot be written: {error.strerror}") from None

    def sort(self) -> None:
        """Write all trials in their order: equal studies give equal bytes."""
        lines = [",".join(HEADS)]
        for (n, training), shares in sorted(self.found.items()):
            lines += [f"{n},{training},{seed},{a!r},{b!r}" for seed, (a, b) in zip(self._seeds, shares, strict=True)]
        write_file(self._folder / RUNS, "\n".join(lines) + "\n")

    def _read(self, path: Path) -> None:
        rows: dict[Key, dict[int, tuple[float, float]]] = {}
        text = path.read_text(encoding="utf-8")
        whole = text[: text.rfind("\n") + 1]  # a kill may leave a part of the last line
        for number, row in enumerate(csv.reader(whole.splitlines()), 1):
            if number == 1 and tuple(row) == HEADS:
                continue
            try:
                n, training, seed, one, other = int(row[0]), int(row[1]), int(row[2]), float(row[3]), float(row[4])
            except (ValueError, IndexError):
                wanted = ",".join(HEADS)
                raise TrainingError(expected(str(path), f"line {number}", wanted, ",".join(row))) from None
            rows.setdefault((n, training), {})[seed] = one, other
        wanted_seeds = self._seeds
        self.found = {key: [of[seed] for seed in wanted_seeds] for key, of in rows.items() if [*of] == wanted_seeds}
