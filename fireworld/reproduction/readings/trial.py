"""One reading tried once: both teams trained and tested as it says, on the same seeds."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from threading import Event
from typing import Any

import msgspec
import numpy as np

from fireworld.interrupt import Interrupted
from fireworld.policy.kernel import from_tables
from fireworld.policy.words import N_FLAG_VALUES
from fireworld.reproduction.paper import TESTS
from fireworld.reproduction.readings.choices import Reading, StudySettings
from fireworld.scenario import Scenario, load_scenario
from fireworld.scenario.document import with_kind
from fireworld.scenario.scenario import read_city_file
from fireworld.simulation.built import BuiltScenario, CityCache
from fireworld.simulation.state import NO_LEARNER, fresh_learner
from fireworld.training.curriculum import Curriculum
from fireworld.training.methods.sarsa import RULES, Progress, Sarsa, SarsaTrainer

N_DIFFERENT = 4
OTHER_TRAININGS = 100_000
"""What is added to a training's seed for each of the others that a brigade follows."""


@dataclass(frozen=True)
class Tried:
    """What came of a trial.

    Attributes:
        shares: for every seed, the share of the greatest score, mean over the tests, with and without cooperation.
        seconds: how long it took.
        computing: seconds of that in which it had a core; the rest it waited for others.
    """

    shares: list[tuple[float, float]]
    seconds: float
    computing: float


@dataclass(frozen=True)
class Setting:
    """All that the trials of a reading have in common.

    Attributes:
        curriculum: as the reading has it.
        tests: likewise.
        method: likewise.
        study: how teams are trained and tested.
        files: contents of city files by their SHA-256.
    """

    curriculum: Curriculum
    tests: Sequence[Scenario]
    method: Sarsa
    study: StudySettings
    files: Mapping[str, bytes]

    @property
    def digest(self) -> str:
        """SHA-256 of all that decides what comes of a trial, but for the version and the seeds."""
        said = [
            self.curriculum.digest,
            [test.digest for test in self.tests],
            self.method.as_dict(),
            msgspec.to_builtins(self.study),
        ]
        return hashlib.sha256(msgspec.json.encode(said, order="sorted")).hexdigest()


def setting_of(reading: Reading, curriculum: Curriculum, method: Sarsa) -> Setting:
    """Return the setting of a reading that changes the paper's curriculum, method and tests.

    Raises:
        ScenarioError: a city file that cannot be read.
        CityError: an official map that makes no city.
    """
    training, varied = reading.level.training, method.with_settings(reading.level.method)
    stages = [
        replace(stage, scenarios=tuple(_varied(one, reading).with_values(training) for one in stage.scenarios))
        for stage in curriculum.stages
    ]
    in_tests = {"choices": varied.choices}
    tests = [_varied(load_scenario(row.scenario), reading, in_tests) for row in TESTS.table_2]
    if reading.study.learn_in_tests:
        tests = [with_kind(test, varied.team_reward) for test in tests]
    files = dict[str, bytes]()
    for scenario in (*(one for stage in stages for one in stage.scenarios), *tests):
        if scenario.city_sha256 is not None and scenario.city_sha256 not in files:
            files[scenario.city_sha256] = read_city_file(scenario)
    return Setting(replace(curriculum, stages=tuple(stages)), tests, varied, reading.study, files)


def _varied(scenario: Scenario, reading: Reading, more: Mapping[str, Any] | None = None) -> Scenario:
    """Return a scenario as a reading has it, with some values more."""
    values = {**reading.level.scenario, **(more or {})}
    for place, fire in enumerate(scenario.fires):
        if reading.study.fires != 1.0 and fire.n_buildings is not None:
            values[f"fires.{place}.n_buildings"] = max(1, round(fire.n_buildings * reading.study.fires))
    return msgspec.structs.replace(scenario.with_values(values), name=scenario.name)


@dataclass(frozen=True)
class Trial:
    """A training of a reading, and its tests; it can be sent to other processes.

    Attributes:
        setting: of the reading.
        training: seed of the training.
        seeds: of the runs of each test.
        stop: set it, and Interrupted is raised soon; it stays in this process.
    """

    setting: Setting
    training: int
    seeds: Sequence[int]
    stop: Event = field(default_factory=Event)

    def __reduce__(self) -> tuple[Any, ...]:
        """Send all but what asks to stop."""
        return Trial, (self.setting, self.training, self.seeds)

    def __call__(self) -> Tried:
        """Train and test both teams."""
        begun, computed = time.perf_counter(), time.thread_time()
        cities, method = CityCache(self.setting.files), self.setting.method
        together, alone = self._train(method, cities)
        shares = np.zeros((len(self.seeds), 2))
        for test in self.setting.tests:
            built = cities.build(test)
            for place, seed in enumerate(self.seeds):
                shares[place] += self._share(built, together, method, seed), self._share(built, alone, method, seed)
        shares /= len(self.setting.tests)
        pairs = [(float(one), float(other)) for one, other in shares]
        return Tried(pairs, time.perf_counter() - begun, time.thread_time() - computed)

    def _train(self, method: Sarsa, cities: CityCache) -> tuple[Any, Any]:
        """Return the tables of the cooperative team, and of the one without cooperation."""
        curriculum, study = self.setting.curriculum, self.setting.study
        flagless = [scenario for stage in curriculum.stages if not stage.cooperation for scenario in stage.scenarios]
        trainer, alone, learned = SarsaTrainer(curriculum, method, seed=self.training, cities=cities), None, None
        for _ in trainer:
            if self.stop.is_set():
                raise Interrupted("interrupted")
            progress, graduate = trainer.progress, trainer.graduate
            if alone is None and graduate is not None and progress.scenario_number == len(flagless):
                alone = progress.tables[:1, ::N_FLAG_VALUES].copy()
                if all(scenario.brigades.n == 1 for scenario in flagless):  # who was alone need not learn that again
                    learned = replace(progress, tables=graduate.tables, visits=graduate.visits)
        if not (study.alone_through_both or study.different_alone):
            return trainer.team().tables, alone
        n = N_DIFFERENT if study.different_alone else 1
        first = self._train_alone(method, self.training, cities, learned)
        others = [self._train_alone(method, self.training + OTHER_TRAININGS * k, cities) for k in range(1, n)]
        return trainer.team().tables, np.concatenate([first, *others])

    def _train_alone(self, method: Sarsa, seed: int, cities: CityCache, learned: Progress | None = None) -> Any:
        """Return the table of one brigade alone, (1, 270, 4), which may have learned some of that before."""
        curriculum, single = self.setting.curriculum, {"brigades.n": 1}
        stages = [
            replace(
                stage,
                cooperation=False,
                scenarios=tuple(scenario.with_values(single) for scenario in stage.scenarios),
            )
            for stage in curriculum.stages
            if not stage.cooperation or self.setting.study.alone_through_both
        ]
        trained_in = replace(curriculum, stages=tuple(stages))
        trainer = SarsaTrainer(trained_in, method, seed=seed, progress=learned, cities=cities)
        for _ in trainer:
            if self.stop.is_set():
                raise Interrupted("interrupted")
        return trainer.team().tables

    def _share(self, built: BuiltScenario, tables: Any, method: Sarsa, seed: int) -> float:
        """Return the share of the greatest score that a team reaches in a test."""
        world, study, learner = built.world(seed=seed), self.setting.study, NO_LEARNER
        policy = from_tables(tables.copy(), commit=method.commit).for_brigades(built.n_brigades)
        if study.learn_in_tests:
            rates = {name: getattr(method, name) for name in ("alpha", "alpha_decay", "gamma")}
            rule, own = RULES.index(method.rule), method.learns_from_own
            learner = fresh_learner(policy.tables, built.n_brigades, rule=rule, own=own, **rates)
        world.run(policy, learner)
        if self.stop.is_set():
            raise Interrupted("interrupted")
        outcome = world.outcome
        if study.score == "counts":
            return (outcome.n_civilians_alive + 1.0 - outcome.n_burnt_out / outcome.n_buildings) / outcome.score_max
        return outcome.score_share
