"""What is tried of the readings, and what comes of it: the trials of a design, then the best readings once more."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from threading import Event
from typing import Any, Final

import numpy as np

from fireworld.errors import TrainingError, expected
from fireworld.evaluation.statistics import mean
from fireworld.executors import AnyExecutor, Workers, workers_for
from fireworld.interrupt import Interrupted, gentle_interrupt
from fireworld.kernels.arrays import Array
from fireworld.reproduction.readings.choices import OpenChoice, Reading
from fireworld.reproduction.readings.design import designed, further
from fireworld.reproduction.readings.effects import Effect, main_effects, over_readings, over_trainings, permutation_p
from fireworld.reproduction.readings.runs import Key, Runs
from fireworld.reproduction.readings.timing import Timing
from fireworld.reproduction.readings.trial import Setting, Trial, Tried, setting_of
from fireworld.training.curriculum import load_curriculum
from fireworld.training.methods.sarsa import PAPER, Sarsa
from fireworld.version import __version__

FIRST_SEED: Final = 1000  # of the tests
FRESH: Final = 10_000
"""What is added to the seeds of trainings that confirm."""
N_BEST: Final = 3
"""Readings that are confirmed."""
OnProgress = Callable[[str, int, int], object]
"""Called with what is being done, how many parts of it are done, and how many there are."""


@dataclass(frozen=True)
class ReadingsSize:
    """How much is tried: trainings of each reading, at least so many fresh ones of the best, seeds of each test.

    `further`: levels that the design leaves out are tried beside it.
    """

    design: str
    trainings: int
    seeds: int
    method: Sarsa = PAPER
    fresh: int = 1
    further: bool = True

    @property
    def n_fresh(self) -> int:
        """Fresh trainings of each of the best readings."""
        return max(self.trainings, self.fresh)


SCREEN: Final = ReadingsSize("screen", 8, 10, fresh=20)
FULL: Final = ReadingsSize("full", 5, 20, fresh=5)
QUICK: Final = ReadingsSize("quick", 1, 2, Sarsa(n_episodes_max=6, n_episodes_unchanged=3), further=False)


@dataclass(frozen=True)
class ReadingsStudy:
    """What came of the readings.

    Attributes:
        size: how much was tried.
        choices: those that were varied.
        signs: (readings of the design, choices), -1 ours and 1 the other level.
        readings: those of the design, the first of which is ours; then those of further levels.
        differences: of each reading, cooperative - non-cooperative, share of the greatest score: (trainings, seeds).
        levels: of each reading, the cooperative team's share.
        confirmed: the same differences of the best readings in fresh trainings, by the number of the reading.
        timing: how long it took.
    """

    size: ReadingsSize
    choices: Sequence[OpenChoice]
    signs: Array
    readings: Sequence[Reading]
    differences: Sequence[Array]
    levels: Sequence[Array]
    confirmed: dict[int, Array] = field(default_factory=dict)
    timing: Timing = field(default_factory=Timing)

    @property
    def n_designed(self) -> int:
        """Readings of the design."""
        return len(self.signs)

    @property
    def estimates(self) -> list[Effect]:
        """What cooperation adds in each reading."""
        return [over_trainings(values) for values in self.differences]

    @property
    def mean(self) -> Effect:
        """What cooperation adds on the mean of the design's readings."""
        return over_readings(self.signs, self._means(self.differences))

    @property
    def effects(self) -> list[Effect]:
        """What each choice changes in what cooperation adds."""
        return self._effects(self.differences)

    @property
    def level_effects(self) -> list[Effect]:
        """What each choice changes in the cooperative team's share."""
        return self._effects(self.levels)

    @property
    def control_effects(self) -> list[Effect]:
        """What each choice changes in the share of the team without cooperation."""
        return self._effects([both - adds for both, adds in zip(self.levels, self.differences, strict=True)])

    @property
    def p(self) -> float:
        """How probable effects as large are if no reading matters."""
        return permutation_p(self.signs, self._means(self.differences))

    def named(self, number: int) -> str:
        """Return in what a reading is not ours."""
        found = ((one, self.level(number, one)) for one in self.choices)
        return ", ".join(f"{one.name} {level}" for one, level in found if level != one.ours) or "ours"

    def level(self, number: int, choice: OpenChoice) -> str:
        """Return the level of a choice in a reading."""
        return self.readings[number].levels.get(choice.name, choice.ours)

    def _effects(self, values: Sequence[Array]) -> list[Effect]:
        return main_effects([choice.name for choice in self.choices], self.signs, self._means(values))

    def _means(self, values: Sequence[Array]) -> Array:
        return np.array([mean(one) for one in values[: self.n_designed]])


def best_of(differences: Sequence[Array]) -> list[int]:
    """Return the numbers of the readings in which cooperation adds most, the best first."""
    return sorted(range(len(differences)), key=lambda n: (-mean(differences[n]), n))[:N_BEST]


def measure_readings(
    folder: Path,
    choices: Sequence[OpenChoice],
    *,
    size: ReadingsSize = SCREEN,
    curriculum: str | Path = "paper",
    resume: bool = False,
    force: bool = False,
    executor: AnyExecutor = None,
    on_progress: OnProgress = lambda *_: None,
    stop: Event | None = None,
) -> ReadingsStudy:
    """Try all readings of a design, then the best ones again in fresh trainings.

    Args:
        folder: where results are appended as they come.
        choices: what is open, and how it can be read.
        size: how much is tried.
        curriculum: name or file.
        resume: continue what an interrupted call left in the folder.
        force: replace that.
        executor: who does the work, as for `try_readings`.
        on_progress: likewise.
        stop: set it, and the work ends soon.

    Raises: as `try_readings`.
    """
    varied, signs, readings = designed(choices, kind=size.design)
    readings += further(choices) if size.further else []
    trained_in = load_curriculum(curriculum)
    if all(stage.cooperation for stage in trained_in.stages):
        names = [stage.name for stage in trained_in.stages]
        raise TrainingError(expected(str(curriculum), "stages", "one without cooperation", names))
    seeds = range(FIRST_SEED, FIRST_SEED + size.seeds)
    with gentle_interrupt(stop) as asked:
        workers = workers_for(executor, stop=asked)
        identity: dict[str, Any] = {
            "design": size.design,
            "seeds": [*seeds],
            "method": size.method.as_dict(),
            "curriculum": {"digest": trained_in.digest},
            "fireworld": __version__,
        }
        settings = [setting_of(reading, trained_in, size.method) for reading in readings]
        runs = Runs(folder, identity, [setting.digest for setting in settings])
        runs.open(resume=resume, force=force)
        trials = Trials(settings, seeds, runs, workers, on_progress)
        try:
            every = [(n, seed + 1) for seed in range(size.trainings) for n in range(len(readings))]
            tried = trials.run("trying", every)  # all readings once, then all again: what is cut short is balanced
            differences = [one[:, :, 0] - one[:, :, 1] for one in tried.values()]
            again = [(n, FRESH + seed + 1) for n in best_of(differences) for seed in range(size.n_fresh)]
            confirmed = trials.run("confirming", again)
        except KeyboardInterrupt:
            raise Interrupted(
                f"interrupted; {len(runs.found)} trials are kept in {folder}: --resume continues"
            ) from None
    runs.sort()
    return ReadingsStudy(
        size=size,
        choices=varied,
        signs=signs,
        readings=readings,
        differences=differences,
        levels=[one[:, :, 0] for one in tried.values()],
        confirmed={n: one[:, :, 0] - one[:, :, 1] for n, one in confirmed.items()},
        timing=trials.timing,
    )


class Trials:
    """The trials of a study, whoever makes them.

    Attributes:
        timing: how long those took that were made now.
    """

    def __init__(
        self, settings: Sequence[Setting], seeds: Sequence[int], runs: Runs, workers: Workers, on_progress: OnProgress
    ) -> None:
        self._settings, self._seeds, self._runs, self._workers = settings, seeds, runs, workers
        self._on_progress = on_progress
        self.timing = Timing(workers.n)

    def run(self, what: str, keys: Sequence[Key]) -> dict[int, Array]:
        """Make the trials that have not been made before; return the shares, (trainings, seeds, 2), of each reading.

        Raises:
            Interrupted: all were asked to stop.
            OutputError, ExecutorError: as for `try_readings`.
        """
        runs, workers, begun, made = self._runs, self._workers, time.perf_counter(), list[Tried]()
        left = [key for key in keys if key not in runs.found]
        trials = [Trial(self._settings[n], training, self._seeds, workers.stop) for n, training in left]
        self._on_progress(what, len(keys) - len(left), len(keys))

        def on_result(place: int, tried: Tried) -> None:
            runs.add(left[place], tried.shares)
            made.append(tried)
            self._on_progress(what, sum(key in runs.found for key in keys), len(keys))

        if workers.run(trials, on_result) is None:
            raise Interrupted("interrupted")
        elapsed = time.perf_counter() - begun
        self.timing.add([one.seconds for one in made], [one.computing for one in made], elapsed)
        found: dict[int, list[Any]] = {}
        for n, training in keys:
            found.setdefault(n, []).append(runs.found[n, training])
        return {n: np.array(shares) for n, shares in found.items()}
