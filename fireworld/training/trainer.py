"""Trainer: takes a team through a curriculum, an episode at a time, so that it can stop and go on anywhere."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import msgspec
import numpy as np

from fireworld import __version__
from fireworld.draws import EPISODE, TABLE, below, hash_key
from fireworld.kernels.arrays import Array
from fireworld.policy.kernel import from_tables
from fireworld.policy.team import Team
from fireworld.policy.words import N_FLAG_VALUES, N_STATES, N_STATES_ALONE
from fireworld.records import ACTIONS
from fireworld.scenario import Scenario
from fireworld.simulation.built import BuiltScenario, CityCache
from fireworld.simulation.state import fresh_learner
from fireworld.training.curriculum import Curriculum, CurriculumStage
from fireworld.training.method import RULES, Method


@dataclass(frozen=True)
class EpisodeReport:
    """What an episode of training came to."""

    stage: str
    scenario: str
    scenario_number: int
    """Counted through the whole curriculum, from 0."""
    episode: int
    """Counted through the scenario, from 0."""
    epsilon: float
    n_steps: int
    score: float
    score_max: float
    total_reward: float
    n_burnt_out: int
    n_changed: int
    """States in which the greedy action of a brigade changed."""
    n_unchanged: int
    """Episodes in a row without such a change."""
    converged: bool
    """The scenario ends because the policy has settled."""


@dataclass
class Progress:
    """Where a training stands; all of it is in a checkpoint."""

    scenario_number: int = 0
    episode: int = 0
    n_unchanged: int = 0
    tables: Array = field(default_factory=lambda: np.zeros((1, N_STATES_ALONE, 4)))
    visits: Array = field(default_factory=lambda: np.zeros((1, N_STATES_ALONE, 4), dtype=np.int64))


class Trainer:
    """Trains one team. Iterate over it to train; between episodes `progress` can be saved and put back.

    Args:
        curriculum: what to learn in.
        method: how to learn.
        seed: of all luck of this training.
        progress: where an earlier training stopped.
        cities: cities built before, shared between trainings.
    """

    def __init__(
        self,
        curriculum: Curriculum,
        method: Method,
        *,
        seed: int,
        progress: Progress | None = None,
        cities: CityCache | None = None,
    ) -> None:
        self.curriculum = curriculum
        self.method = method
        self.seed = seed
        self._cities = cities if cities is not None else CityCache()
        self._plan = [(stage, scenario) for stage in curriculum.stages for scenario in stage.scenarios]
        self.progress = progress if progress is not None else self._begin()
        self.graduate: Team | None = None
        """The team at the end of the last scenario finished here, before one of its tables was drawn for all."""

    @property
    def done(self) -> bool:
        """Whether the curriculum is finished."""
        return self.progress.scenario_number >= len(self._plan)

    @property
    def identity(self) -> dict[str, Any]:
        """What decides the outcome of a training: equal identities, equal tables."""
        return {
            "curriculum": {"name": self.curriculum.name, "digest": self.curriculum.digest},
            "method": self.method.as_dict(),
            "seed": self.seed,
            "fireworld": __version__,
        }

    def __iter__(self) -> Iterator[EpisodeReport]:
        """Train, yielding after every episode."""
        while not self.done:
            number = self.progress.scenario_number
            stage, scenario = self._plan[number]
            ground = self._build(scenario)
            while self.progress.scenario_number == number:
                yield self._run_episode(stage, ground)

    def team(self) -> Team:
        """Return the team as it is now."""
        progress = self.progress
        provenance = {
            **self.identity,
            "curriculum": self.curriculum.as_dict(),
            "scenarios_done": progress.scenario_number,
        }
        return Team(tables=progress.tables.copy(), visits=progress.visits.copy(), provenance=provenance)

    def shape(self, scenario_number: int) -> tuple[int, int, int]:
        """Return the shape of the tables (tables, states, actions) that a scenario of the curriculum trains.

        After the last scenario the tables are those it has trained.
        """
        stage, scenario = self._plan[min(scenario_number, len(self._plan) - 1)]
        return self._n_tables(scenario), _n_states(stage), len(ACTIONS)

    def _begin(self) -> Progress:
        """Return untrained tables for the first stage."""
        shape = self.shape(0)
        return Progress(tables=np.zeros(shape), visits=np.zeros(shape, dtype=np.int64))

    def _n_tables(self, scenario: Scenario) -> int:
        return 1 if self.method.shared_table else scenario.brigades.n

    def _build(self, scenario: Scenario) -> BuiltScenario:
        varied = msgspec.structs.replace(scenario, reward=self.method.reward, choices=self.method.choices)
        return self._cities.build(varied)

    def _run_episode(self, stage: CurriculumStage, ground: BuiltScenario) -> EpisodeReport:
        method, progress = self.method, self.progress
        number, episode = progress.scenario_number, progress.episode
        n_brigades = len(ground.placement.brigade_refuge)
        epsilon = _power(method.epsilon_decay, episode)
        luck = hash_key(self.seed, EPISODE, number, 0 if method.fixed_noise else episode) >> 1
        before = progress.tables.argmax(axis=2)
        policy = from_tables(progress.tables, epsilon=epsilon, commit=method.commit).for_brigades(n_brigades)
        learner = fresh_learner(
            policy.tables,
            n_brigades,
            rule=RULES.index(method.rule),
            alpha=method.alpha,
            alpha_decay=method.alpha_decay,
            gamma=method.gamma,
        )._replace(visits=progress.visits)
        world = ground.world(seed=luck)
        n_steps = world.run(policy, learner)
        progress.tables = policy.tables
        n_changed = int((progress.tables.argmax(axis=2) != before).sum())
        progress.n_unchanged = 0 if n_changed else progress.n_unchanged + 1
        converged = progress.n_unchanged >= method.n_episodes_unchanged
        outcome = world.state.outcome
        report = EpisodeReport(
            stage=stage.name,
            scenario=ground.scenario.name,
            scenario_number=number,
            episode=episode,
            epsilon=epsilon,
            n_steps=n_steps,
            score=float(outcome.score[0]),
            score_max=float(outcome.score[1]),
            total_reward=float(outcome.reward[5]),
            n_burnt_out=int(outcome.counts[2]),
            n_changed=n_changed,
            n_unchanged=progress.n_unchanged,
            converged=converged,
        )
        progress.episode += 1
        if converged or progress.episode >= method.n_episodes_max:
            self._go_on()
        return report

    def _go_on(self) -> None:
        """Go on to the next scenario: one table, drawn at random among the brigades', for all of them."""
        progress = self.progress
        number = progress.scenario_number
        progress.scenario_number, progress.episode, progress.n_unchanged = number + 1, 0, 0
        self.graduate = self.team()
        if self.done:
            return
        n_tables, n_states, _ = self.shape(progress.scenario_number)
        drawn = below(self.seed, TABLE, number, 0, bound=len(progress.tables))
        table, visits = progress.tables[drawn], progress.visits[drawn]
        if n_states > len(table):
            table = np.repeat(table, N_FLAG_VALUES, axis=0)  # the same for all values of the cooperation flags
            visits = np.zeros(table.shape, dtype=np.int64)
        progress.tables = np.repeat(table[np.newaxis], n_tables, axis=0)
        progress.visits = np.repeat(visits[np.newaxis], n_tables, axis=0)


def _n_states(stage: CurriculumStage) -> int:
    return N_STATES if stage.cooperation else N_STATES_ALONE


def _power(base: float, exponent: int) -> float:
    """Return base ** exponent by multiplication: the same on every machine."""
    result = 1.0
    for _ in range(exponent):
        result *= base
    return result
