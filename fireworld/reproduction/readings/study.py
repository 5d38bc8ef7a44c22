"""`reproduce_readings`: try the readings of a design, keep what comes of each at once, and say what was found."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from statistics import fmean
from threading import Event
from typing import Any, Final

import numpy as np

from fireworld.errors import OutputError, TrainingError, expected
from fireworld.evaluation.statistics import Estimate, estimate
from fireworld.executors import AnyExecutor, workers_for
from fireworld.files import write_file
from fireworld.interrupt import Interrupted, gentle_interrupt
from fireworld.kernels.arrays import Array
from fireworld.reproduction.readings.choices import SHIPPED, OpenChoice, Reading, load_choices
from fireworld.reproduction.readings.design import designed
from fireworld.reproduction.readings.effects import Effect, main_effects, permutation_p
from fireworld.reproduction.readings.trial import Trial
from fireworld.training.curriculum import load_curriculum
from fireworld.training.methods.sarsa import PAPER, Sarsa
from fireworld.training.training import check_same
from fireworld.version import __version__

FIRST_SEED: Final = 1000  # of the tests
FRESH: Final = 10_000
"""What is added to the seeds of trainings that confirm."""
N_BEST: Final = 3
"""Readings that are confirmed."""
RUNS: Final = "readings-runs.csv"
SETTINGS: Final = "readings-settings.json"
HEADS: Final = ("reading", "training", "seed", "cooperative", "non_cooperative")
Key = tuple[int, int]  # a reading and the seed of its training


@dataclass(frozen=True)
class ReadingsSize:
    """How much is tried."""

    design: str
    trainings: int
    seeds: int
    method: Sarsa = PAPER


SCREEN: Final = ReadingsSize("screen", 2, 10)
FULL: Final = ReadingsSize("full", 5, 20)
QUICK: Final = ReadingsSize("quick", 1, 2, Sarsa(n_episodes_max=6, n_episodes_unchanged=3))


@dataclass(frozen=True)
class ReadingsStudy:
    """What came of the readings.

    Attributes:
        size: how much was tried.
        choices: those that were varied.
        signs: (readings, choices), -1 ours and 1 the other level.
        readings: the readings.
        differences: of each reading, cooperative - non-cooperative, share of the greatest score: (trainings, seeds).
        levels: of each reading, the cooperative team's share.
        confirmed: the same differences of the best readings in fresh trainings, by the number of the reading.
    """

    size: ReadingsSize
    choices: Sequence[OpenChoice]
    signs: Array
    readings: Sequence[Reading]
    differences: Sequence[Array]
    levels: Sequence[Array]
    confirmed: dict[int, Array] = field(default_factory=dict)

    @property
    def estimates(self) -> list[Estimate]:
        """What cooperation adds in each reading."""
        return [estimate(values) for values in self.differences]

    @property
    def effects(self) -> list[Effect]:
        """What each choice changes in what cooperation adds."""
        return self._effects(self.differences)

    @property
    def level_effects(self) -> list[Effect]:
        """What each choice changes in the cooperative team's share."""
        return self._effects(self.levels)

    @property
    def p(self) -> float:
        """How probable effects as large are if no reading matters."""
        return permutation_p(self.signs, np.array([values.mean() for values in self.differences]))

    def named(self, number: int) -> str:
        """Return in what a reading is not ours."""
        row = zip(self.choices, self.signs[number], strict=True)
        return ", ".join(f"{one.name} {one.screen[1]}" for one, sign in row if sign > 0) or "ours"

    def _effects(self, values: Sequence[Array]) -> list[Effect]:
        names = [choice.name for choice in self.choices]
        return main_effects(names, self.signs, np.array([float(one.mean()) for one in values]))


def best_of(differences: Sequence[Array]) -> list[int]:
    """Return the numbers of the readings in which cooperation adds most, the best first."""
    return sorted(range(len(differences)), key=lambda n: (-float(differences[n].mean()), n))[:N_BEST]


def try_readings(
    folder: Path,
    *,
    file: Path | str = SHIPPED,
    size: ReadingsSize = SCREEN,
    curriculum: str | Path = "paper",
    resume: bool = False,
    force: bool = False,
    executor: AnyExecutor = None,
    on_progress: Callable[[str, int, int], object] = lambda *_: None,
    stop: Event | None = None,
) -> ReadingsStudy:
    """Try all readings of a design, then the best ones again in fresh trainings.

    Args:
        folder: where results are appended as they come.
        file: the choices, as readings.yaml has them.
        size: how much is tried.
        curriculum: name or file.
        resume: continue what an interrupted call left in the folder.
        force: replace that.
        executor: who does the work; threads.
        on_progress: called with what is being done, how many parts are done, and how many there are.
        stop: set it, and the work ends soon.

    Raises:
        TrainingError: a file that makes no sense, or other settings than those the folder was begun with.
        OutputError: something is in the folder already, or it cannot be written.
        Interrupted: Ctrl-C, or `stop` was set.
    """
    choices = load_choices(file)
    varied, signs, readings = designed(choices, kind=size.design)
    trained_in = load_curriculum(curriculum)
    seeds = range(FIRST_SEED, FIRST_SEED + size.seeds)
    with gentle_interrupt(stop) as asked:
        identity: dict[str, Any] = {
            "design": size.design,
            "trainings": size.trainings,
            "seeds": [*seeds],
            "method": size.method.as_dict(),
            "curriculum": {"digest": trained_in.digest},
            "readings": [dict(reading.levels) for reading in readings],
            "fireworld": __version__,
        }
        runs = Runs(folder, identity)
        runs.open(resume=resume, force=force)

        def measure(what: str, keys: Sequence[Key]) -> dict[int, tuple[Array, Array]]:
            left = [key for key in keys if key not in runs.found]
            trials = [Trial(n, readings[n], seed, trained_in, size.method, seeds, asked) for n, seed in left]
            on_progress(what, len(keys) - len(left), len(keys))

            def on_result(place: int, shares: list[tuple[float, float]]) -> None:
                runs.add(left[place], seeds, shares)
                on_progress(what, sum(key in runs.found for key in keys), len(keys))

            if workers_for(executor, stop=asked).run(trials, on_result) is None:
                raise Interrupted("interrupted")
            found: dict[int, list[Array]] = {}
            for n, seed in keys:
                found.setdefault(n, []).append(np.array(runs.found[n, seed]))
            return {n: (np.array([one[:, 0] - one[:, 1] for one in of]), np.array([one[:, 0] for one in of]))
                    for n, of in found.items()}  # fmt: skip

        try:
            tried = measure("trying", [(n, seed + 1) for n in range(len(readings)) for seed in range(size.trainings)])
            differences, levels = ([tried[n][part] for n in range(len(readings))] for part in (0, 1))
            again = [(n, FRESH + seed + 1) for n in best_of(differences) for seed in range(size.trainings)]
            confirmed = {n: values for n, (values, _) in measure("confirming", again).items()}
        except KeyboardInterrupt:
            raise Interrupted(
                f"interrupted; {len(runs.found)} trials are kept in {folder}: --resume continues"
            ) from None
    runs.sort()
    return ReadingsStudy(size, varied, signs, readings, differences, levels, confirmed)


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


def findings_text(study: ReadingsStudy) -> list[str]:
    """Return what was found, a sentence each, written from the numbers."""
    found = study.estimates
    n_above, n_below = sum(one.above_zero for one in found), sum(one.below_zero for one in found)
    mean = fmean(one.mean for one in found)
    said = [
        (
            f"Over {len(found)} readings cooperation adds {mean:+.2f} of the greatest score on the mean; in "
            f"{100 * n_above / len(found):.0f} % of them the interval lies above 0, in "
            f"{100 * n_below / len(found):.0f} % below. In the paper it adds +0.60."
        ),
        f"That no reading matters has p = {study.p:.3f} (main effects together, {len(study.choices)} choices).",
    ]
    sure = [one for one in study.effects if one.low > 0 or one.high < 0]
    said.append(
        "Choices that change what cooperation adds: " + "; ".join(f"{one.choice} {one.text()}" for one in sure) + "."
        if sure
        else "No choice by itself changes what cooperation adds by an amount that is off 0."
    )
    sure = [one for one in study.level_effects if one.low > 0 or one.high < 0]
    if sure:
        said.append("On the cooperative team's level: " + "; ".join(f"{one.choice} {one.text()}" for one in sure) + ".")
    for number, values in study.confirmed.items():
        again, first = estimate(values), found[number]
        word = "holds" if again.above_zero else "does not hold"
        said.append(
            f"Reading {number} ({study.named(number)}): {first.text(sign=True)} first, {again.text(sign=True)} in "
            f"fresh trainings; the claim {word} there."
        )
    if study.size.design == "quick" or study.size.trainings < 2:
        said.append("This was too little to claim anything: it shows how it looks.")
    return said
