"""Everything that a training log holds: frozen records of arrays, as `fireworld.records` is for the log of a run.

Schemas, docs and exported tables are derived from the field metadata here. A field number is for ever.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, Final, Self

import numpy as np
from fireworld_recorder.kind import LogKind
from fireworld_recorder.schema import Channel, channel_of

from fireworld.arguments import RUN_SEED_MAX
from fireworld.errors import LogError
from fireworld.kernels.arrays import Trace
from fireworld.kernels.learning import EXPLORED, GREEDY, KEPT
from fireworld.kernels.ranking import N_WEIGHTS
from fireworld.policy.words import N_STATES
from fireworld.records import ACTIONS, CHOICES, Array, column, value
from fireworld.rewards import TERMS
from fireworld.simulation.state import fresh_trace
from fireworld.training.log.played import Played, check_played

FORMAT: Final = "fireworld-training/1"
PACKAGE: Final = "fireworld.training.v1"
TERM_NAMES: Final = tuple(term.name for term in TERMS)


@dataclass(frozen=True)
class TrainingHeader:
    """What identifies a training; recorded as the metadata `fireworld.training` and as attachments."""

    method: str
    curriculum: str
    curriculum_digest: str
    seed: int
    fireworld_version: str
    unit: str
    """What a part of the training is: an episode, a generation."""
    simulator_digest: str = ""
    """Of the sources of all that computes a run, "" where nobody wrote it down."""
    attachments: Mapping[str, bytes] = field(default_factory=dict)
    """curriculum.json, method.json, scenarios/NUMBER-NAME.yaml of all that is learned in, cities/SHA256.json."""


@dataclass(frozen=True)
class Plan:
    """What is learned in, scenario by scenario."""

    topic: ClassVar[str] = "/plan"
    stage: Array = column(1, "sfixed32", "number of its stage, from 0", per="scenario")
    cooperation: Array = column(2, "uint8", "1 if brigades see what the others do", per="scenario")
    n_brigades: Array = column(3, "sfixed32", "", per="scenario")
    n_steps_max: Array = column(4, "sfixed32", "its last step", per="scenario")
    digests: bytes = value(5, "bytes", "the scenarios' digests, 32 bytes each")


@dataclass(frozen=True)
class Episode:
    """An episode that tables learned from: how it went, and what each brigade saw, chose and got in every step.

    Columns over choices go brigade by brigade, and through the steps of the episode for each; where it was truncated,
    they have one entry more: the choice that would come next, which the last update takes into account. TD errors and
    the values before follow from these columns and the tables before: `fireworld.open_training` gives them.
    """

    topic: ClassVar[str] = "/episode"
    scenario: int = value(1, "sfixed32", "its scenario, a position in /plan")
    episode: int = value(2, "sfixed32", "its number in the scenario, from 0")
    seed: int = value(3, "fixed64", "of its random draws")
    epsilon: float = value(4, "double", "probability of exploring", unit="probability")
    n_steps: int = value(5, "sfixed32", "steps that it took")
    terminated: bool = value(6, "bool", "nothing burned any more; else it was truncated")
    total_reward: float = value(7, "double", "undiscounted return")
    score: float = value(8, "double", "official score of the paper's time, at the end")
    score_max: float = value(9, "double", "number of civilians + 1")
    n_burnt_out: int = value(10, "sfixed32", "buildings with code 8 at the end")
    n_civilians_alive: int = value(11, "sfixed32", "civilians with HP > 0 at the end")
    n_changed: int = value(12, "sfixed32", "states in which the greedy action of a brigade changed")
    n_unchanged: int = value(13, "sfixed32", "episodes in a row without such a change")
    n_visited: int = value(14, "sfixed32", "states visited so far, summed over the tables")
    converged: bool = value(15, "bool", "the scenario ends because the policy has settled")
    ended: bool = value(16, "bool", "the scenario ends")
    drawn: int = value(17, "sfixed32", "the table that all brigades carry on to the next scenario; -1 none is drawn")
    tables_digest: bytes = value(18, "bytes", "SHA-256 of the tables after it, before one is drawn: the team's digest")
    state: Array = column(
        19, "sfixed32", "what the brigade saw: 0..4319, the features in mixed radix; -1 it did not look", per="choice"
    )
    action: Array = column(20, "uint8", "what it did; 0 where it had no choice", per="choice", names=ACTIONS)
    choice: Array = column(
        21, "uint8", "how it came to that: 0 none, 1 greedy, 2 explored, 3 kept", per="choice", names=CHOICES
    )
    reward: Array = column(
        22,
        "double",
        f"the team's reward, term by term through all steps: {', '.join(TERM_NAMES)}; then, where brigades learn from "
        "their own doing, what each of them got",
        per="step",
    )

    @property
    def n_choices(self) -> int:
        """How many choices of each brigade are recorded."""
        return n_choices(self.n_steps, terminated=self.terminated)

    def trace(self, n_brigades: int) -> Trace:
        """Return the columns as the kernels have them.

        Raises:
            LogError: they are not of that many brigades and of this number of steps.
        """
        n, n_rows = self.n_steps, self.n_choices
        own = n >= 1 and len(self.reward) == n * (len(TERM_NAMES) + n_brigades)
        fits = own or (n >= 1 and len(self.reward) == n * len(TERM_NAMES))
        if not fits or any(len(one) != n_brigades * n_rows for one in (self.state, self.action, self.choice)):
            raise LogError(f"episode {self.episode}: its columns are not those of {n_brigades} brigades and {n} steps")
        if max(self.action, default=0) >= len(ACTIONS) or max(self.choice, default=0) >= len(CHOICES):
            raise LogError(f"episode {self.episode}: an action or a choice that there is not")
        looked = self.state[(self.choice == GREEDY) | (self.choice == EXPLORED)]
        if len(looked) and not 0 <= looked.min() <= looked.max() < N_STATES:
            raise LogError(f"episode {self.episode}: a choice in a state that there is not")
        trace = fresh_trace(n_brigades, n, own=own)
        for name in ("state", "action", "choice"):
            getattr(trace, name)[:, :n_rows] = getattr(self, name).reshape(n_brigades, n_rows)
        if ((trace.choice[:, -1] == KEPT) & ~((trace.state[:, -1] >= 0) & (trace.state[:, -1] < N_STATES))).any():
            raise LogError(f"episode {self.episode}: a choice in a state that there is not")
        trace.reward[:] = self.reward.reshape(-1, n)
        return trace


def n_choices(n_steps: int, *, terminated: bool) -> int:
    """Return how many choices a brigade makes in an episode; where it is truncated, the next one is made too."""
    return n_steps + (0 if terminated else 1)


def trace_columns(trace: Trace, n_steps: int, *, terminated: bool) -> dict[str, Array]:
    """Return a trace as the columns of an episode."""
    n_rows = n_choices(n_steps, terminated=terminated)
    columns = {name: getattr(trace, name)[:, :n_rows].ravel() for name in ("state", "action", "choice")}
    return {**columns, "reward": trace.reward[:, :n_steps].ravel()}


@dataclass(frozen=True)
class Tables:
    """The tables whole: after the last episode of every scenario, and after every 50th."""

    topic: ClassVar[str] = "/tables"
    n_tables: int = value(1, "sfixed32", "tables: one for each brigade, or one for all")
    n_states: int = value(2, "sfixed32", "states of a table: 4320, or 270 without what the others do")
    values: Array = column(3, "double", "values, table by table, state by state, action by action", per="entry")
    visits: Array = column(4, "fixed64", "how often each was learned", per="entry")

    @classmethod
    def of(cls, tables: Array, visits: Array) -> Self:
        """Make a record of tables and visits, (tables, states, 4)."""
        return cls(tables.shape[0], tables.shape[1], tables.ravel(), visits.ravel().astype(np.uint64))

    @property
    def arrays(self) -> tuple[Array, Array]:
        """(tables, states, 4) float64 values and int64 visits.

        Raises:
            LogError: they are not as many as the record says.
        """
        shape = (self.n_tables, self.n_states, len(ACTIONS))
        if min(shape) < 1 or not len(self.values) == len(self.visits) == math.prod(shape):
            raise LogError(f"tables of shape {shape} with {len(self.values)} values")
        if not np.isfinite(self.values).all() or self.visits.max() > np.iinfo(np.int64).max:
            raise LogError("tables with values that are no numbers")
        return self.values.reshape(shape).copy(), self.visits.reshape(shape).astype(np.int64)


@dataclass(frozen=True)
class Updates:
    """What an episode made of the values, update by update: in golden trainings only.

    It follows from the tables before and the episode, as long as the rule of learning is what it was; where it is not,
    this shows in which step.
    """

    topic: ClassVar[str] = "/updates"
    value_after: Array = column(
        1,
        "double",
        "the value after the update in each step, and in the update that ends the episode; nan where there was none",
        per="update",
    )

    def shaped(self, n_brigades: int, n_steps: int) -> Array:
        """Return the values as (b, steps + 1).

        Raises:
            LogError: they are not as many.
        """
        if len(self.value_after) != n_brigades * (n_steps + 1):
            raise LogError(f"{len(self.value_after)} updates of {n_brigades} brigades in {n_steps} steps")
        return self.value_after.reshape(n_brigades, n_steps + 1)


@dataclass(frozen=True)
class Tried:
    """What was tried in a generation of a search: the rankings that were tried, on which fires, and what came of it."""

    topic: ClassVar[str] = "/generation"
    generation: int = value(1, "sfixed32", "its number, from 0")
    score_mean: float = value(2, "double", "of all rankings, as a share of the maximum")
    score_best: float = value(3, "double", "of the best ones, on the fires by which they were found to be the best")
    spread_mean: float = value(4, "double", "mean standard deviation of the weights from now on")
    fire: Array = column(5, "sfixed32", "the scenario of each fire, a position in /plan", per="fire")
    seed: Array = column(6, "fixed64", "of the random draws of each fire", per="fire")
    weights: Array = column(7, "double", "of each ranking that was tried", per="candidate", width=N_WEIGHTS)
    scores: Array = column(
        8, "double", "of each ranking on each fire, ranking by ranking, as a share of the maximum", per="candidate"
    )
    best: Array = column(9, "sfixed32", "the rankings that the next are drawn around, the best first", per="axis")
    mean: Array = column(10, "double", "of the weights from now on: those of the team", per="weight")
    spread: Array = column(11, "double", "standard deviation of the weights from now on", per="weight")


@dataclass(frozen=True)
class Lesson:
    """A lesson in which a network learned to value targets: its fights, and the network after it."""

    topic: ClassVar[str] = "/lesson"
    lesson: int = value(1, "sfixed32", "its number, from 0")
    epsilon: float = value(2, "double", "probability of exploring", unit="probability")
    alpha: float = value(3, "double", "learning rate")
    score_mean: float = value(4, "double", "of its fights, exploration included, as a share of the maximum")
    error_mean: float = value(
        5, "double", "mean size of the last TD error of each brigade in each fight, in percent of the maximal score"
    )
    fire: Array = column(6, "sfixed32", "the scenario of each fight, a position in /plan", per="fire")
    seed: Array = column(7, "fixed64", "of its random draws", per="fire")
    score: Array = column(8, "double", "at its end, as a share of the maximum", per="fire")
    n_steps: Array = column(9, "sfixed32", "steps that it took", per="fire")
    numbers: Array = column(10, "double", "biases and weights of the network after it, layer by layer", per="weight")
    state_weights: Array = column(
        11, "double", "what the mean of each thing seen of the targets says of a state, after it", per="weight"
    )


@dataclass(frozen=True)
class Evolved:
    """A generation of an evolution of networks: the fights of its candidates, and what came of them.

    The candidates follow from seed, generation and the mean before it.
    """

    topic: ClassVar[str] = "/evolved"
    generation: int = value(1, "sfixed32", "its number, from 0")
    score_mean: float = value(2, "double", "of all candidates, as a share of the maximum; all conditions count equally")
    score_best: float = value(3, "double", "of the best candidate")
    score_checked: float = value(4, "double", "of the mean on all fires, when it was last checked")
    score_kept: float = value(5, "double", "the best of those: that of the team")
    fire: Array = column(6, "sfixed32", "the scenario of each fire, a position in /plan", per="fire")
    seed: Array = column(7, "fixed64", "of the random draws of each fire", per="fire")
    scores: Array = column(
        8,
        "double",
        "of each candidate on each fire, candidate by candidate, as a share of the maximum; of the first half the "
        "noise is added, of the second subtracted",
        per="candidate",
    )
    mean: Array = column(
        9, "double", "biases and weights, layer by layer, that the next candidates are drawn around", per="weight"
    )
    direction: Array = column(10, "double", "in which the mean moved", per="weight")
    kept: Array = column(11, "double", "biases and weights of the team", per="weight")


@dataclass(frozen=True)
class Improved:
    """A generation in which a network learned from rollouts: the fights in which options were tried, and what came.

    The options that were tried follow from the seeds and the network before it.
    """

    topic: ClassVar[str] = "/improved"
    generation: int = value(1, "sfixed32", "its number, from 0")
    score_mean: float = value(2, "double", "of its fights, as a share of the maximum; all conditions count equally")
    n_decisions: int = value(3, "sfixed32", "decisions whose options were tried")
    gain: float = value(
        4,
        "double",
        "how much more, on the mean, rollouts came to after what the network after it prefers than after what was done",
    )
    score_checked: float = value(5, "double", "of the team after it on all fires")
    fire: Array = column(6, "sfixed32", "the scenario of each fight, a position in /plan", per="fire")
    seed: Array = column(7, "fixed64", "of its random draws", per="fire")
    score: Array = column(8, "double", "at its end, as a share of the maximum", per="fire")
    n_tried: Array = column(9, "sfixed32", "decisions of it whose options were tried", per="fire")
    numbers: Array = column(
        10,
        "double",
        "of the networks that the team is the mean of, the newest last: biases and weights, layer by layer",
        per="weight",
    )


@dataclass(frozen=True)
class PartCommit:
    """The end of a part, an episode or a generation: without it the part does not count."""

    topic: ClassVar[str] = "/commit"
    step: int = value(1, "sfixed32", "number of the part, from 0")
    done: bool = value(2, "bool", "the training is at its end")
    hash: bytes = value(3, "bytes", "32 bytes, chained to the commit before: the digest of the training up to here")


def part_number(record: Any) -> int:
    """Return the number that the first record of a part has: of its episode, generation or lesson; else 0."""
    return int(
        next((getattr(record, name) for name in ("episode", "generation", "lesson") if hasattr(record, name)), 0)
    )


def check_places(record: Any, n_brigades: Sequence[int]) -> None:
    """Check that a record is of scenarios that the plan has, of seeds that a run can have, and of columns that fit.

    Args:
        record: of whatever type.
        n_brigades: of each scenario.

    Raises:
        LogError: it is not.
    """
    fights = ("fire", "seed")
    places = {Episode: ("scenario", "seed"), Played: ("scenario", "seed"), Tried: fights}
    places |= {Lesson: fights, Evolved: fights, Improved: fights}
    fires = places.get(type(record))
    if fires is None:
        return
    scenario, seed = (np.atleast_1d(getattr(record, name)) for name in fires)
    if len(scenario) and not 0 <= int(scenario.min()) <= int(scenario.max()) < len(n_brigades):
        raise LogError(f"{record.topic}: {fires[0]}: a scenario that the plan has not")
    if len(seed) and int(seed.max()) > RUN_SEED_MAX:
        raise LogError(f"{record.topic}: {fires[1]}: {int(seed.max())} is above {RUN_SEED_MAX}, the largest of a run")
    if isinstance(record, Played):
        check_played(record, n_brigades[record.scenario])
    if isinstance(record, Lesson) and len({*map(len, (record.fire, record.seed, record.score, record.n_steps))}) > 1:
        raise LogError(f"{record.topic}: its columns are not of the same fights")
    if isinstance(record, Improved) and len({*map(len, (record.fire, record.seed, record.score, record.n_tried))}) > 1:
        raise LogError(f"{record.topic}: its columns are not of the same fights")
    if isinstance(record, Tried) and not _fits(record):
        raise LogError(f"{record.topic}: its columns are not of the same rankings, weights and fires")
    if isinstance(record, Evolved) and not _fits_evolved(record):
        raise LogError(f"{record.topic}: its columns are not of the same networks and fires")


def _fits(tried: Tried) -> bool:
    """Return whether the columns of a generation are of the same rankings, weights and fires."""
    n_weights = len(tried.mean)
    if not n_weights or n_weights != len(tried.spread) or len(tried.weights) % n_weights:
        return False
    if len(tried.seed) != len(tried.fire):
        return False
    return len(tried.weights) // n_weights * len(tried.fire) == len(tried.scores)


def _fits_evolved(evolved: Evolved) -> bool:
    """Return whether the columns of a generation are of the same networks and fires."""
    n_fires = len(evolved.fire)
    if len({*map(len, (evolved.mean, evolved.direction, evolved.kept))}) > 1 or len(evolved.seed) != n_fires:
        return False
    return n_fires > 0 and len(evolved.scores) % (2 * n_fires) == 0


TRAINING: Final = LogKind(
    format=FORMAT,
    metadata_name="fireworld.training",
    header_type=TrainingHeader,
    commit_type=PartCommit,
    first_type=Plan,
    topics=(Plan, Episode, Tables, Updates, Tried, Lesson, Evolved, Improved, Played, PartCommit),
    unchained=frozenset({Tables.topic, Updates.topic}),
    unit="part",
    rescue="--resume to continue, or --force to begin again",
    seconds=1,
)


def channels_of(topics: tuple[type[Any], ...]) -> list[Channel]:
    """List the channels of a training log.

    Args:
        topics: the record types of a method's parts.
    """
    record_types: tuple[type[Any], ...] = (Plan, *topics, PartCommit)
    return [channel_of(record_type, PACKAGE) for record_type in record_types]
