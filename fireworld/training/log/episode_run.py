"""An episode of a training as a run: every step computed again, learning included, as the log of a run has it."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import msgspec
import numpy as np
from fireworld_recorder.writer import PARTIAL_SUFFIX, LogWriter

from fireworld.arguments import path_of, whole_number
from fireworld.errors import LogError, OutputError, TrainingError, expected
from fireworld.files import check_output
from fireworld.kernels.arrays import TOTAL, Array, Learner, Trace
from fireworld.kernels.choice import table_state
from fireworld.kernels.learning import EXPLORED, GREEDY, choose_and_learn, take_reward
from fireworld.policy.kernel import KernelPolicy, from_tables
from fireworld.policy.names import TEAM_ATTACHMENT
from fireworld.policy.protocol import Decision, Observation, Policy
from fireworld.policy.teams.table_team import TableTeam
from fireworld.policy.teams.team import parse_team
from fireworld.records import CityRecord, RunHeader, StepRecord
from fireworld.simulation.built import BuiltScenario
from fireworld.simulation.observer import Observer
from fireworld.simulation.state import fresh_learner
from fireworld.training.log.reader import AnyTraining, TrainingLog, opened
from fireworld.training.log.records import TERM_NAMES, Episode
from fireworld.training.method import COUNT_MAX, Trainer
from fireworld.training.methods.sarsa import RULES, Sarsa, SarsaTrainer

LEARNING_ATTACHMENT: Final = "learning.json"
POLICY_NAME: Final = "learning"


class Learning(msgspec.Struct, frozen=True, kw_only=True):
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

    def take(self, reward: float) -> None:
        """Take the reward of a step."""
        take_reward(reward, self.learner)


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
            choices = world.step(policy)
            errors = policy.learner.td_error.copy()
            policy.take(float(world.state.outcome.reward[TOTAL]))
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
    )
    provenance = {**trainer.identity, "scenarios_done": episode.scenario}
    team = TableTeam(tables=tables, visits=visits, provenance=provenance)
    return LearningRun(trainer.build(scenario), seed=episode.seed, team=team, learning=learning)


def replay_episode(
    log: AnyTraining,
    scenario: str | int,
    episode: int,
    output: str | os.PathLike[str],
    *,
    force: bool = False,
) -> str:
    """Write an episode of a training as the log of a run, worked out by replay and compared with the training log.

    Args:
        log: the path of a training log, or one that is open; as far as it is good.
        scenario: of the episode: its name, or its position in the plan.
        episode: its number in the scenario, from 0; -1 is the last.
        output: the log to write.
        force: replace an existing one.

    Returns:
        The digest of the run.

    Raises:
        LogError: there is no such episode, or this fireworld computes another one.
        OutputError: the output cannot be written.
    """
    training = opened(log, partial=True)
    return _replay(training, training.position(scenario, episode), path_of("output", output), force=force)


def replay_every(
    log: AnyTraining,
    every: int,
    folder: str | os.PathLike[str],
    *,
    scenario: str | None = None,
    force: bool = False,
    on_written: Callable[[], object] = lambda: None,
) -> dict[Path, str]:
    """Write every so many episodes of a training as `replay_episode` does.

    Args:
        log: the path of a training log, or one that is open.
        every: episodes of a scenario, from its first on.
        folder: the existing folder for them: SCENARIO-EPISODE.mcap.
        scenario: of this scenario alone, by its name.
        force: replace existing logs.
        on_written: called after each.

    Returns:
        The digests of the runs by their logs.

    Raises:
        LogError: there are no such episodes, or this fireworld computes another one.
        OutputError: one cannot be written; those before are there.
    """
    training = opened(log, partial=True)
    every, place = whole_number("every", every, least=1, most=COUNT_MAX), path_of("folder", folder)
    if not place.is_dir():
        raise OutputError(expected(str(place), "", "an existing folder", "none", "make it first"))
    names = [one.name for one in training.scenarios]
    training.position(0 if scenario is None else scenario, -1)  # every training begins in the first
    chosen = {
        number: place / episode_file(names[line.scenario], line.episode)
        for number, line in enumerate(training.lines)
        if line.episode % every == 0 and scenario in (None, names[line.scenario])
    }
    for path in chosen.values():
        check_output(path, force=force)
    written = {}
    for number, path in chosen.items():
        written[path] = _replay(training, number, path, force=force)
        on_written()
    return written


def _replay(log: TrainingLog, number: int, output: Path, *, force: bool) -> str:
    found = log.episode_at(number)
    run = episode_run(log.learner(), found.record, found.tables, found.visits)
    return _write_run(run, output, found.record, force=force, source=str(log.path))


def _write_run(run: LearningRun, output: Path, episode: Episode, *, force: bool, source: str) -> str:
    """Write an episode that is known in outline; where it comes out otherwise, nothing stays of it."""
    try:
        with LogWriter(output, run.header, run.city, force=force) as writer:
            for record in _checked(run, episode, source=source):
                writer.write(record)
            return writer.digest
    except LogError:
        output.with_name(output.name + PARTIAL_SUFFIX).unlink(missing_ok=True)
        raise


def _checked(run: LearningRun, episode: Episode, *, source: str) -> Iterator[StepRecord]:
    """Yield the steps of a run; raise LogError at the first that is not what the training log has of it."""
    trace = episode.trace(len(run.city.brigade_tank_litres))
    n_steps = -1
    for record in run:
        n_steps += 1
        if n_steps > episode.n_steps:
            break
        if n_steps > 0:
            _check_step(record, trace, episode, source=source)
        yield record
    if n_steps != episode.n_steps:
        got = "more" if n_steps > episode.n_steps else str(n_steps)
        raise LogError(_differs(source, episode, n_steps, f"{episode.n_steps} steps", got))


def _check_step(record: StepRecord, trace: Trace, episode: Episode, *, source: str) -> None:
    """Compare a step that was computed again with what the training log has of it."""
    row, decisions = record.step - 1, record.decisions
    chose = trace.choice[:, row]
    looked = (chose == GREEDY) | (chose == EXPLORED)
    pairs: Mapping[str, tuple[Array, Array]] = {
        "states": (trace.state[looked, row], record.observations.state_index[looked]),
        "actions": (np.where(chose > 0, trace.action[:, row].astype(np.int64), -1), decisions.action),
        "explored": (chose == EXPLORED, decisions.explored.astype(bool)),
        "rewards": (trace.reward[:, row], np.array([getattr(record.rewards, name) for name in TERM_NAMES])),
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
        _write_run(run, self.folder / name, episode, force=self.force, source="training")


def episode_file(scenario: str, episode: int) -> str:
    """Return the name of the log of an episode."""
    return f"{Path(scenario).name}-{episode:04d}.mcap"
