"""An episode of a training as a run: every step computed again, learning included, as the log of a run has it."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import msgspec
import numpy as np
from fireworld_recorder.writer import PARTIAL_SUFFIX, LogWriter

from fireworld.errors import LogError, TrainingError, expected
from fireworld.kernels.arrays import TOTAL, Array, Learner, Trace
from fireworld.kernels.choice import table_state
from fireworld.kernels.learning import EXPLORED, GREEDY, choose_and_learn, take_reward
from fireworld.kernels.own_reward import note_worth, own_rewards
from fireworld.policy.kernel import KernelPolicy, from_tables
from fireworld.policy.names import TEAM_ATTACHMENT
from fireworld.policy.protocol import Decision, Observation, Policy
from fireworld.policy.teams.table_team import TableTeam
from fireworld.policy.teams.team import parse_team
from fireworld.records import CityRecord, RunHeader, StepRecord, Steps
from fireworld.simulation.built import BuiltScenario
from fireworld.simulation.observer import Observer
from fireworld.simulation.state import fresh_learner
from fireworld.simulation.world import World
from fireworld.training.log.records import TERM_NAMES, Episode
from fireworld.training.method import Trainer
from fireworld.training.methods.sarsa import RULES, Sarsa, SarsaTrainer

LEARNING_ATTACHMENT: Final = "learning.json"
POLICY_NAME: Final = "learning"


class Learning(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """How a team learns in an episode; recorded with its run, beside the tables before it."""

    method: str
    scenario: str
    episode: int
    epsilon: float
    rule: str
    alpha: float
    alpha_decay: float
    gamma: float
    commit: int
    own: bool = False
    """Brigades learn from their own doing."""


class LearningPolicy(Policy):
    """Tables that brigades follow and learn into, one decision after another, as the compiled episode does.

    Attributes:
        learner: tables, visits and memory; its `td_error` is of the last update of each brigade.
    """

    def __init__(self, team: TableTeam, learning: Learning, n_brigades: int) -> None:
        tables = team.tables.copy()
        self.learner: Learner = fresh_learner(
            tables,
            n_brigades,
            rule=RULES.index(learning.rule),
            alpha=learning.alpha,
            alpha_decay=learning.alpha_decay,
            gamma=learning.gamma,
            own=learning.own,
        )._replace(visits=team.visits.copy())
        self._epsilon = learning.epsilon
        self._chooser: KernelPolicy = from_tables(tables, epsilon=learning.epsilon, commit=learning.commit)
        self._chooser.begin(None, n_brigades, 0)  # type: ignore[arg-type]  # tables need no city
        self._table_of = self._chooser.for_brigades(n_brigades).table_of

    def decide(self, observation: Observation) -> Decision:
        """Choose, then learn from the choice before."""
        decision = self._chooser.decide(observation)
        brigade, learner = observation.brigade, self.learner
        row = table_state(observation.state_index, learner.tables.shape[1])
        choose_and_learn(brigade, self._table_of[brigade], row, int(decision.action), self._epsilon, learner)
        return decision

    def keeps(self, brigade: int, last_action: int, step: int) -> bool:
        """Return whether a brigade repeats what it chose before."""
        return self._chooser.keeps(brigade, last_action, step)

    def take(self, world: World, codes_before: Array) -> None:
        """Take the reward of a step that is done; (n,) codes of the buildings when it was decided."""
        state, learner, weights = world.state, self.learner, world.constants.reward.weights
        note_worth(state.brigades, codes_before, weights, learner.own)
        own_rewards(state.brigades, state.fire.fieryness, weights, learner.own)
        take_reward(float(state.outcome.reward[TOTAL]), learner)


class LearningRun:
    """A run of a team that learns meanwhile, a `fireworld.records.Steps`: each iteration runs it from its start.

    Args:
        built: the scenario, as it is learned in.
        seed: of the run's random draws.
        team: the tables before.
        learning: how it learns.
        forked_from: see `RunHeader`.
    """

    def __init__(self, built: BuiltScenario, *, seed: int, team: TableTeam, learning: Learning) -> None:
        self._built, self._seed, self._team, self._learning = built, seed, team, learning
        carried = {TEAM_ATTACHMENT: team.to_bytes(), LEARNING_ATTACHMENT: msgspec.json.encode(learning) + b"\n"}
        digest = hashlib.sha256(team.digest.encode() + carried[LEARNING_ATTACHMENT]).hexdigest()
        header = built.header(seed=seed, policy=POLICY_NAME, policy_digest=digest, n_steps_max=built.scenario.steps)
        self.header: RunHeader = replace(header, attachments={**header.attachments, **carried})
        self.city: CityRecord = built.city_record()

    def __iter__(self) -> Iterator[StepRecord]:
        world = self._built.world(seed=self._seed)
        policy = LearningPolicy(self._team, self._learning, world.n_brigades)
        observer = Observer(world)
        yield observer.record()
        while not (world.terminated or world.truncated):
            if self._learning.own:
                world.look()  # what is lit in the step that comes burns when it is decided
            codes = world.state.fire.fieryness.copy()
            choices = world.step(policy)
            errors = policy.learner.td_error.copy()
            policy.take(world, codes)
            record = observer.record(choices)
            yield replace(record, decisions=replace(record.decisions, td_error=errors))


def recorded_learning(header: RunHeader, built: BuiltScenario) -> LearningRun:
    """Return the run of a recorded episode, to be learned again.

    Raises:
        LogError: its attachments make no sense.
    """
    try:
        learning = msgspec.json.decode(header.attachments[LEARNING_ATTACHMENT], type=Learning)
        team = parse_team(header.attachments[TEAM_ATTACHMENT], source=TEAM_ATTACHMENT)
    except (msgspec.DecodeError, KeyError, TrainingError) as error:
        raise LogError(f"recording: {LEARNING_ATTACHMENT}: {error}") from None
    if not isinstance(team, TableTeam) or learning.rule not in RULES:
        raise LogError(expected("recording", LEARNING_ATTACHMENT, "tables and a rule that learns them", learning.rule))
    return LearningRun(built, seed=header.seed, team=team, learning=learning)


def episode_run(trainer: SarsaTrainer, episode: Episode, tables: Array, visits: Array) -> LearningRun:
    """Return an episode as a run.

    Args:
        trainer: of the training; it stays as it is.
        episode: as it is recorded.
        tables: (tables, states, 4) before it.
        visits: likewise.
    """
    method: Sarsa = trainer.method
    scenario = trainer.scenario(episode.scenario)
    learning = Learning(
        method=method.name,
        scenario=scenario.name,
        episode=episode.episode,
        epsilon=episode.epsilon,
        **{name: getattr(method, name) for name in ("rule", "alpha", "alpha_decay", "gamma", "commit")},
        own=method.learns_from_own,
    )
    provenance = {**trainer.identity, "scenarios_done": episode.scenario}
    team = TableTeam(tables=tables, visits=visits, provenance=provenance)
    return LearningRun(trainer.build(scenario), seed=episode.seed, team=team, learning=learning)


@dataclass(frozen=True)
class CheckedRun:
    """The run of an episode, a `fireworld.records.Steps`; the training log decides whether its steps are right.

    Attributes:
        run: the run.
        episode: as the training log has it.
        source: what errors call that.
    """

    run: LearningRun
    episode: Episode
    source: str

    @property
    def header(self) -> RunHeader:
        """What identifies the run."""
        return self.run.header

    @property
    def city(self) -> CityRecord:
        """The city it takes place in."""
        return self.run.city

    def __iter__(self) -> Iterator[StepRecord]:
        """Yield the steps; raise LogError at the first that comes out otherwise."""
        episode, source = self.episode, self.source
        trace = episode.trace(len(self.city.brigade_tank_litres))
        n_steps = -1
        for record in self.run:
            n_steps += 1
            if n_steps > episode.n_steps:
                break
            if n_steps > 0:
                _check_step(record, trace, episode, source=source)
            yield record
        if n_steps != episode.n_steps:
            got = "more" if n_steps > episode.n_steps else str(n_steps)
            raise LogError(_differs(source, episode, n_steps, f"{episode.n_steps} steps", got))


def write_run(run: Steps, output: Path, *, force: bool) -> str:
    """Write a run whose steps are compared with what is known of them; where one is not that, nothing stays of it.

    Returns:
        The digest of the run.

    Raises:
        LogError: a step comes out otherwise.
        OutputError: the output cannot be written.
    """
    try:
        with LogWriter(output, run.header, run.city, force=force) as writer:
            for record in run:
                writer.write(record)
            return writer.digest
    except LogError:
        output.with_name(output.name + PARTIAL_SUFFIX).unlink(missing_ok=True)
        raise


def _check_step(record: StepRecord, trace: Trace, episode: Episode, *, source: str) -> None:
    """Compare a step that was computed again with what the training log has of it."""
    row, decisions = record.step - 1, record.decisions
    chose = trace.choice[:, row]
    looked = (chose == GREEDY) | (chose == EXPLORED)
    pairs: Mapping[str, tuple[Array, Array]] = {
        "states": (trace.state[looked, row], record.observations.state_index[looked]),
        "actions": (np.where(chose > 0, trace.action[:, row].astype(np.int64), -1), decisions.action),
        "explored": (chose == EXPLORED, decisions.explored.astype(bool)),
        "rewards": (trace.reward[:TOTAL, row], np.array([getattr(record.rewards, name) for name in TERM_NAMES])),
    }
    for name, (wanted, got) in pairs.items():
        if not np.array_equal(wanted, got):
            raise LogError(_differs(source, episode, record.step, f"{name} {wanted.tolist()}", f"{got.tolist()}"))


def _differs(source: str, episode: Episode, step: int, wanted: str, got: str) -> str:
    where = f"episode {episode.episode}, step {step}"
    return expected(source, where, wanted, got, f"this fireworld learns otherwise; see `fireworld verify {source}`")


@dataclass(frozen=True)
class FullEpisodes:
    """Writes every so many episodes of a training as the log of a run each, at once.

    Attributes:
        folder: the existing folder to write them into: SCENARIO-EPISODE.mcap.
        every: episodes of a scenario, from the first on.
        force: replace existing logs.
    """

    folder: Path
    every: int
    force: bool = False

    def begin(self, trainer: Trainer[Any, Any]) -> None:
        """Ask the trainer for what is needed.

        Raises:
            TrainingError: its method does not learn in episodes.
        """
        if not isinstance(trainer, SarsaTrainer):
            raise TrainingError(expected("--full-every", "", "a method that learns in episodes", trainer.method.name))
        trainer.full_every, trainer.recording = self.every, True

    def write(self, trainer: Trainer[Any, Any]) -> None:
        """Write the last episode, if it is one of them."""
        if not isinstance(trainer, SarsaTrainer) or trainer.start is None:
            return
        episode: Episode = trainer.records()[0]
        if episode.episode % self.every:
            return
        name = episode_file(trainer.scenario(episode.scenario).name, episode.episode)
        run = episode_run(trainer, episode, *trainer.start)
        write_run(CheckedRun(run, episode, "training"), self.folder / name, force=self.force)


def episode_file(scenario: str, episode: int) -> str:
    """Return the name of the log of an episode."""
    return f"{Path(scenario).name}-{episode:04d}.mcap"
