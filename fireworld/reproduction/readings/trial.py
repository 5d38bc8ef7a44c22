"""One reading tried once: both teams trained and tested as it says, on the same seeds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from threading import Event
from typing import Any

import msgspec
import numpy as np

from fireworld.interrupt import Interrupted
from fireworld.policy.kernel import from_tables
from fireworld.policy.words import N_FLAG_VALUES
from fireworld.reproduction import paper
from fireworld.reproduction.readings.choices import Reading
from fireworld.scenario import Scenario, load_scenario
from fireworld.simulation.built import BuiltScenario, CityCache
from fireworld.simulation.state import NO_LEARNER, fresh_learner
from fireworld.training.curriculum import Curriculum
from fireworld.training.methods.sarsa import RULES, Sarsa, SarsaTrainer

N_DIFFERENT = 4
OTHER_TRAININGS = 100_000
"""What is added to a training's seed for each of the others that a brigade follows."""


@dataclass(frozen=True)
class Trial:
    """A reading and a training of it.

    Attributes:
        number: of the reading.
        reading: what is read how.
        training: seed of the training.
        curriculum: as the paper's; the reading changes it.
        method: likewise.
        seeds: of the runs of each test.
        stop: set it, and Interrupted is raised soon.
    """

    number: int
    reading: Reading
    training: int
    curriculum: Curriculum
    method: Sarsa
    seeds: Sequence[int]
    stop: Event

    def __call__(self) -> list[tuple[float, float]]:
        """Return for every seed the share of the greatest score, mean over the tests, with and without cooperation."""
        cities = CityCache()
        method = self.method.with_settings(self.reading.level.method)
        together, alone = self._train(method, cities)
        shares = np.zeros((len(self.seeds), 2))
        for row in paper.TABLE_2:
            built = cities.build(self._varied(load_scenario(row.scenario), choices=method.choices))
            for place, seed in enumerate(self.seeds):
                shares[place] += self._share(built, together, method, seed), self._share(built, alone, method, seed)
        shares /= len(paper.TABLE_2)
        return [(float(one), float(other)) for one, other in shares]

    def _train(self, method: Sarsa, cities: CityCache) -> tuple[Any, Any]:
        """Return the tables of the cooperative team, and of the one without cooperation."""
        curriculum = self._curriculum()
        flagless = [stage for stage in curriculum.stages if not stage.cooperation]
        n_alone = sum(len(stage.scenarios) for stage in flagless)
        trainer, alone = SarsaTrainer(curriculum, method, seed=self.training, cities=cities), None
        for _ in trainer:
            if self.stop.is_set():
                raise Interrupted("interrupted")
            if alone is None and trainer.progress.scenario_number == n_alone:
                alone = trainer.progress.tables[:1, ::N_FLAG_VALUES].copy()
        study = self.reading.study
        if study.alone_through_both or study.different_alone:
            n = N_DIFFERENT if study.different_alone else 1
            seeds = [self.training + OTHER_TRAININGS * k for k in range(n)]
            alone = np.concatenate([self._train_alone(curriculum, method, seed, cities) for seed in seeds])
        return trainer.team().tables, alone

    def _train_alone(self, curriculum: Curriculum, method: Sarsa, seed: int, cities: CityCache) -> Any:
        """Return the table of one brigade alone, (1, 270, 4)."""
        single = {"brigades.n": 1}
        stages = [
            replace(
                stage,
                cooperation=False,
                scenarios=tuple(scenario.with_values(single) for scenario in stage.scenarios),
            )
            for stage in curriculum.stages
            if not stage.cooperation or self.reading.study.alone_through_both
        ]
        trainer = SarsaTrainer(replace(curriculum, stages=tuple(stages)), method, seed=seed, cities=cities)
        for _ in trainer:
            if self.stop.is_set():
                raise Interrupted("interrupted")
        return trainer.team().tables

    def _curriculum(self) -> Curriculum:
        """Return the curriculum as the reading has it."""
        training = self.reading.level.training
        stages = [
            replace(stage, scenarios=tuple(self._varied(one).with_values(training) for one in stage.scenarios))
            for stage in self.curriculum.stages
        ]
        return replace(self.curriculum, stages=tuple(stages))

    def _varied(self, scenario: Scenario, *, choices: str | None = None) -> Scenario:
        """Return a scenario as the reading has it."""
        values = dict(self.reading.level.scenario)
        if choices is not None:
            values["choices"] = choices
        for place, fire in enumerate(scenario.fires):
            if self.reading.study.fires != 1.0 and fire.n_buildings is not None:
                values[f"fires.{place}.n_buildings"] = max(1, round(fire.n_buildings * self.reading.study.fires))
        return msgspec.structs.replace(scenario.with_values(values), name=scenario.name)

    def _share(self, built: BuiltScenario, tables: Any, method: Sarsa, seed: int) -> float:
        """Return the share of the greatest score that a team reaches in a test."""
        world, study, learner = built.world(seed=seed), self.reading.study, NO_LEARNER
        policy = from_tables(tables.copy(), commit=method.commit).for_brigades(built.n_brigades)
        if study.learn_in_tests:
            rates = {name: getattr(method, name) for name in ("alpha", "alpha_decay", "gamma")}
            learner = fresh_learner(policy.tables, built.n_brigades, rule=RULES.index(method.rule), **rates)
        world.run(policy, learner)
        if self.stop.is_set():
            raise Interrupted("interrupted")
        outcome = world.outcome
        if study.score == "counts":
            return (outcome.n_civilians_alive + 1.0 - outcome.n_burnt_out / outcome.n_buildings) / outcome.score_max
        return outcome.score_share
