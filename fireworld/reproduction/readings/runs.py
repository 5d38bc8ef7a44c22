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
HEADS: Final = ("reading", "setting", "training", "seed", "cooperative", "non_cooperative")
SHOWN: Final = 12
"""Digits of the digest of a reading's setting in the file; by them its lines are known, wherever it stands now."""
Key = tuple[int, int]  # a reading and the seed of its training


class Runs:
    """The runs of a study: a CSV file that a trial's lines are appended to once it is done.

    A study is continued with further readings, too: those that were tried are known by their settings.

    Attributes:
        found: by reading and training, the shares with and without cooperation of every seed.
    """

    def __init__(self, folder: Path, identity: dict[str, Any], settings: Sequence[str]) -> None:
        """Make them.

        Args:
            folder: where they are kept.
            identity: what all readings have in common.
            settings: the digest of the setting of each reading.
        """
        self._folder, self._identity = folder, identity
        self._settings = [digest[:SHOWN] for digest in settings]
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

    def add(self, key: Key, shares: list[tuple[float, float]]) -> None:
        """Append a trial's lines; its shares are those of the study's seeds, in their order."""
        self.found[key] = shares
        try:
            with (self._folder / RUNS).open("a", encoding="utf-8") as file:
                file.write(self._text(key))
        except OSError as error:
            raise OutputError(f"{self._folder / RUNS}: cannot be written: {error.strerror}") from None

    def sort(self) -> None:
        """Write all trials in their order: equal studies give equal bytes."""
        write_file(self._folder / RUNS, ",".join(HEADS) + "\n" + "".join(map(self._text, sorted(self.found))))

    def _text(self, key: Key) -> str:
        """Return the lines of a trial."""
        n, training = key
        seeds = zip(self._seeds, self.found[key], strict=True)
        return "".join(f"{n},{self._settings[n]},{training},{seed},{one!r},{other!r}\n" for seed, (one, other) in seeds)

    def _read(self, path: Path) -> None:
        rows: dict[tuple[str, int], dict[int, tuple[float, float]]] = {}
        text = path.read_text(encoding="utf-8")
        whole = text[: text.rfind("\n") + 1]  # a kill may leave a part of the last line
        for number, row in enumerate(csv.reader(whole.splitlines()), 1):
            if number == 1 and tuple(row) == HEADS:
                continue
            try:
                _, setting, training, seed, one, other = row
                read = int(training), int(seed), float(one), float(other)
            except ValueError:
                wanted = ",".join(HEADS)
                raise TrainingError(expected(str(path), f"line {number}", wanted, ",".join(row))) from None
            if setting not in self._settings:
                wanted = "a reading that is to be tried"
                hint = "name the readings and levels that it was begun with, or begin again with --force"
                raise TrainingError(expected(str(path), f"line {number}", wanted, f"another one, {setting}", hint))
            rows.setdefault((setting, read[0]), {})[read[1]] = read[2:]
        self.found = {
            (n, training): [*of.values()]
            for (setting, training), of in rows.items()
            if [*of] == self._seeds
            for n, one in enumerate(self._settings)
            if one == setting
        }
