"""SARSA in tables, the paper's method, and its declared variants: a value for each action in each state."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Annotated, Any, ClassVar, Final, Literal, get_args

import msgspec
import numpy as np

from fireworld.draws import TABLE, below
from fireworld.errors import LogError, TrainingError, expected
from fireworld.executors import Workers
from fireworld.kernels.arrays import TOTAL, Array, Learner, PolicyArrays, Trace
from fireworld.kernels.learning import UNTRIED, learn_again
from fireworld.policy.kernel import from_tables
from fireworld.policy.teams.table_team import COMMIT_MAX, TableTeam, agreement, tables_digest
from fireworld.policy.teams.team import Team
from fireworld.policy.words import N_FLAG_VALUES, N_STATES, N_STATES_ALONE
from fireworld.records import ACTIONS
from fireworld.rewards import Kind
from fireworld.scenario import Scenario
from fireworld.scenario.document import with_kind
from fireworld.simulation.built import BuiltScenario, CityCache
from fireworld.simulation.state import fresh_learner, fresh_trace
from fireworld.training.curriculum import Curriculum
from fireworld.training.log.records import Episode, Tables, Updates, trace_columns
from fireworld.training.method import Count, Limits, Method, NotNegative, Play, Report, Share, Trainer
from fireworld.training.seeds import episode_seed

Rule = Literal["sarsa", "expected-sarsa", "q-learning"]
EpsilonSchedule = Literal["scenario", "compounding", "training"]
REPORTED: Final = (
    "episode", "epsilon", "n_steps", "score", "score_max", "total_reward", "n_burnt_out", "n_changed", "n_unchanged",
    "converged",
)  # fmt: skip
"""What a report shares with the record of an episode."""
TD_QUANTILES: Final = (10, 50, 90)
"""Of the sizes of an episode's TD errors, in percent: those that are drawn."""
TABLES_EVERY: Final = 50
"""Episodes after which a training log holds the tables whole."""
RULES: Final[tuple[str, ...]] = get_args(Rule)
"""In the order of the kernels' numbers."""
Commit = Annotated[int, Limits(f"a whole number from 1 to {COMMIT_MAX}", 1, COMMIT_MAX)]


@dataclass(frozen=True, kw_only=True)
class Sarsa(Method):
    """Learning of a table for each brigade; the defaults are the paper's."""

    name: ClassVar[str] = "paper"
    curriculum: ClassVar[str] = "paper"

    rule: Rule = "sarsa"
    alpha: Share = 0.7
    """Learning rate."""
    alpha_decay: NotNegative = 0.0
    """The n-th visit of a state and action learns at alpha / (1 + alpha_decay * (n - 1))."""
    gamma: Share = 0.5
    """Discount of the next step."""
    epsilon_first: Share = 1.0
    """Probability of exploring in the first episode."""
    epsilon_decay: Share = 0.9
    """Episode k explores with probability epsilon_first * epsilon_decay ** k, k from 0."""
    epsilon_schedule: EpsilonSchedule = "scenario"
    """How k counts: anew in every `scenario`, `compounding` to k (k + 1) / 2, or on through the whole `training`."""
    untried: Literal["best", "ignored"] = "best"
    """Values begin at 0, above all that was tried; or the greedy choice ignores them, and the first visit sets them."""
    n_episodes_max: Count = 130
    """Episodes of a scenario at most."""
    n_episodes_unchanged: Count = 20
    """A scenario ends when no greedy action has changed for so many episodes."""
    shared_table: bool = False
    """All brigades learn into one table."""
    fixed_noise: bool = False
    """Every episode of a scenario has the same random draws."""
    reward: Literal["stock", "change", "own"] = "stock"
    """The weighted terms at every step, as in the paper; how their sum changed; or, for each brigade its own, how what
    the building that it sprayed counts in that sum changed. The weights are the scenario's."""
    choices: Literal["in-turn", "simultaneous"] = "in-turn"
    """Whether brigades see what those before them chose in this step."""
    commit: Commit = 1
    """Steps that a choice is kept for."""
    draw_last: bool = False
    """After the last scenario, too, one table is drawn for all: brigades are tested with the same one."""

    @property
    def learns_from_own(self) -> bool:
        """Whether each brigade learns from a reward of its own."""
        return self.reward == "own"

    @property
    def team_reward(self) -> Kind:
        """What the team's reward is meanwhile."""
        return "change" if self.reward == "own" else self.reward

    def epsilon(self, episode: int, *, before: int) -> float:
        """Return the probability of exploring.

        Args:
            episode: its number in the scenario, from 0.
            before: episodes of the training before that scenario.
        """
        counts = {"scenario": episode, "compounding": episode * (episode + 1) // 2, "training": before + episode}
        return self.epsilon_first * _power(self.epsilon_decay, counts[self.epsilon_schedule])

    def trainer(self, curriculum: Curriculum, *, seed: int, cities: CityCache | None = None) -> SarsaTrainer:
        """Return what trains one team; see `Method.trainer`."""
        return SarsaTrainer(curriculum, self, seed=seed, cities=cities)


METHOD: Final = Sarsa()
PAPER: Final = METHOD


@dataclass(frozen=True, kw_only=True)
class EpisodeReport(Report):
    """How an episode of training ended."""

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

    @property
    def text(self) -> str:
        """The episode, or the scenario that it ends, in one line."""
        if not self.milestone:
            return (
                f"{self.scenario}, episode {self.episode + 1}, epsilon {self.epsilon:.3f}, "
                f"return {self.total_reward:,.0f}, {self.n_changed} changes"
            )
        return (
            f"{self.scenario}: {self.episode + 1} episodes, {self.ending}, "
            f"score {self.score:.2f} of {self.score_max:.0f}, return {self.total_reward:,.0f}"
        )

    @property
    def place(self) -> str:
        """The scenario."""
        return self.scenario

    @property
    def ending(self) -> str:
        """Whether the policy had settled when the scenario ended."""
        if not self.milestone:
            return ""
        return "settled" if self.converged else "not settled"


@dataclass
class Progress:
    """Where a training stands; all of it is in a checkpoint."""

    scenario_number: int = 0
    episode: int = 0
    n_unchanged: int = 0
    tables: Array = field(default_factory=lambda: np.zeros((1, N_STATES_ALONE, 4)))
    visits: Array = field(default_factory=lambda: np.zeros((1, N_STATES_ALONE, 4), dtype=np.int64))
    n_before: int = 0
    """Episodes of the scenarios before."""


class SarsaTrainer(Trainer[Sarsa, EpisodeReport]):
    """Trains one team through a curriculum, an episode at a time; arguments as for `Method.trainer`.

    Args:
        progress: where an earlier training stopped.
    """

    report_type: ClassVar[type[Report]] = EpisodeReport
    unit: ClassVar[str] = "episode"
    topics: ClassVar[tuple[type[Any], ...]] = (Episode, Tables, Updates)
    whole: ClassVar[type[Any] | None] = Tables
    plots: ClassVar[Mapping[str, str]] = {
        "return": "Return",
        "score": "Score, as a share of the best",
        "epsilon": "Epsilon",
        "n_changed": "States in which the greedy action changed",
        "td_error": f"Size of the TD errors, {', '.join(map(str, TD_QUANTILES))} % quantiles",
        "n_visited": "States visited, summed over the tables",
        "agreement": "Share of common states in which the tables agree",
        "n_burnt_out": "Burnt out",
        "n_steps": "Steps",
    }

    def __init__(
        self,
        curriculum: Curriculum,
        method: Sarsa,
        *,
        seed: int,
        progress: Progress | None = None,
        cities: CityCache | None = None,
    ) -> None:
        super().__init__(curriculum, method, seed=seed)
        self._cities = cities if cities is not None else CityCache()
        self._plan = [(stage, scenario) for stage in curriculum.stages for scenario in stage.scenarios]
        shape = self.shape(0)
        first_values = np.full(shape, UNTRIED if method.untried == "ignored" else 0.0)
        untrained = Progress(tables=first_values, visits=np.zeros(shape, dtype=np.int64))
        self.progress = progress if progress is not None else untrained
        self._last_built: tuple[int, BuiltScenario] | None = None
        self._records: list[Any] = []
        self.full_every = 0
        """Every so many episodes of a scenario `start` is kept; 0: never."""
        self.start: tuple[Array, Array] | None = None
        """Tables and visits before the last episode, if it is one of these."""
        self._updates: Array | None = None
        self.graduate: TableTeam | None = None
        """The team at the end of the last scenario finished here, before one of its tables was drawn for all."""

    @property
    def share_done(self) -> float:
        """How many of the scenarios are done; an episode counts as if the scenario needed all it may have."""
        progress = self.progress
        return (progress.scenario_number + progress.episode / self.method.n_episodes_max) / len(self._plan)

    def run(self, workers: Workers) -> Iterator[EpisodeReport]:
        """Train, yielding a report after every episode; all in this thread."""
        del workers
        while not self.done:
            number = self.progress.scenario_number
            built = self._built(number)
            while self.progress.scenario_number == number:
                yield self._run_episode(built)

    def team(self) -> TableTeam:
        """Return the team as it is now."""
        progress = self.progress
        provenance = {
            **self.identity,
            "curriculum": self.curriculum.as_dict(),
            "scenarios_done": progress.scenario_number,
        }
        return TableTeam(tables=progress.tables.copy(), visits=progress.visits.copy(), provenance=provenance)

    def state(self) -> dict[str, Array]:
        """Return `place`: [scenario, episode, episodes without a change, episodes of the scenarios before]."""
        progress = self.progress
        place = progress.scenario_number, progress.episode, progress.n_unchanged, progress.n_before
        return {"place": np.array(place, dtype=np.int64)}

    def restore(self, team: Team, state: Mapping[str, Array], *, source: str) -> None:
        """Continue where another trainer stood; see `Trainer.restore`."""
        place = state.get("place")
        if (
            not isinstance(team, TableTeam)
            or place is None
            or place.shape not in ((3,), (4,))
            or place.dtype != np.int64
        ):
            raise TrainingError(expected(source, "", "a checkpoint", "a team file without a place in its training"))
        number, episode, n_unchanged, n_before = (*(int(value) for value in place), 0)[:4]
        in_curriculum = 0 <= number < len(self._plan) or (number, episode) == (len(self._plan), 0)
        if not (in_curriculum and 0 <= n_unchanged <= episode < self.method.n_episodes_max and n_before >= 0):
            wanted = "[scenario, episode, episodes without a change, before] within the curriculum"
            raise TrainingError(expected(source, "place", wanted, str(place.tolist())))
        if team.tables.shape != self.shape(number):
            raise TrainingError(expected(source, "tables", f"shape {self.shape(number)}", str(team.tables.shape)))
        self.progress = Progress(number, episode, n_unchanged, team.tables, team.visits, n_before)

    def records(self) -> list[Any]:
        """Return the last episode, and the tables after the last one of a scenario and after every 50th."""
        return self._records

    def follow(self, part: Mapping[type[Any], Any]) -> EpisodeReport:
        """Go through an episode that a training log holds; see `Trainer.follow`."""
        episode: Episode | None = part.get(Episode)
        tables: Tables | None = part.get(Tables)
        progress = self.progress
        if episode is None or not 0 <= episode.scenario < len(self._plan):
            raise LogError("a part holds no episode of a scenario of the plan")
        follows = (episode.scenario, episode.episode) == (progress.scenario_number, progress.episode)
        self._updates = self.learn_from(episode) if follows else None
        if tables is not None:
            progress.scenario_number, progress.episode = episode.scenario, episode.episode
            progress.tables, progress.visits = tables.arrays
        elif not follows:
            raise LogError(f"expected episode {progress.episode} of scenario {progress.scenario_number}")
        if progress.tables.shape != self.shape(episode.scenario):
            raise LogError(f"expected tables of shape {self.shape(episode.scenario)}, got {progress.tables.shape}")
        return self._end_episode(episode)

    def learn_from(self, episode: Episode) -> Array:
        """Learn an episode from what is recorded of it, into the tables as they stand before it.

        Returns:
            (3, b, k + 1): the value that was updated in each step, the error, and the value after; the last column has
            the updates that end the episode. nan where a brigade had none.

        Raises:
            LogError: the columns of the episode are not those of an episode of its scenario.
        """
        built = self._built(episode.scenario)
        trace = episode.trace(built.n_brigades)
        if (len(trace.reward) > TOTAL) != self.method.learns_from_own:
            raise LogError(f"episode {episode.episode}: rewards that are not those of reward {self.method.reward}")
        policy, learner = self._learning(built.n_brigades, episode.epsilon, trace=trace)
        updates = np.empty((3, built.n_brigades, episode.n_steps + 1))
        learn_again(policy.table_of, episode.epsilon, learner, episode.n_steps, episode.terminated, updates)
        self.progress.tables = policy.tables
        return updates

    def points(self, report: EpisodeReport) -> Mapping[str, Mapping[str, float]]:
        """Return what is drawn of the last episode."""
        values = report.as_dict()
        values |= {"return": values["total_reward"], "score": values["score"] / (values["score_max"] or 1.0)}
        found = {name: {"": values[name]} for name in self.plots if name in values}
        if self._updates is None:
            return found
        errors = np.abs(self._updates[1])
        errors = errors[~np.isnan(errors)]
        team = self.graduate if report.milestone and self.graduate is not None else self.progress
        found["n_visited"] = {"": float(team.visits.any(axis=2).sum())}
        if len(errors):
            levels = np.quantile(errors, [share / 100 for share in TD_QUANTILES])
            found["td_error"] = {f"{share} %": float(one) for share, one in zip(TD_QUANTILES, levels, strict=True)}
        if len(team.tables) > 1:
            same, common = agreement(team.tables, team.visits)
            found["agreement"] = {"": same / common} if common else {}
        return found

    def numbers(self, report: EpisodeReport) -> dict[str, float]:
        """Return the numbers of the last episode by name; its score also as a share of the best."""
        return {**super().numbers(report), "score_share": report.score / (report.score_max or 1.0)}

    def play(self, report: EpisodeReport) -> Play | None:
        """Return the last scenario of a stage, played greedily by the team that has just finished it."""
        lasts = itertools.accumulate(len(stage.scenarios) for stage in self.curriculum.stages)
        if not report.milestone or self.progress.scenario_number not in lasts or self.graduate is None:
            return None
        stage, scenario = self._plan[self.progress.scenario_number - 1]
        as_trained = msgspec.structs.replace(scenario, choices=self.method.choices)
        return Play(f"after stage {stage.name}: {scenario.name}, seed {self.seed}", as_trained, self.graduate)

    def shape(self, scenario_number: int) -> tuple[int, int, int]:
        """Return the shape of the tables (tables, states, actions) that a scenario of the curriculum trains.

        After the last scenario the tables are those it has trained.
        """
        stage, scenario = self._plan[min(scenario_number, len(self._plan) - 1)]
        n_tables = 1 if self.method.shared_table else scenario.brigades.n
        return n_tables, N_STATES if stage.cooperation else N_STATES_ALONE, len(ACTIONS)

    def scenario(self, number: int) -> Scenario:
        """Return a scenario of the curriculum by its position."""
        return self._plan[number][1]

    def build(self, scenario: Scenario) -> BuiltScenario:
        """Build a scenario as it is learned in: with the choices and the reward of the method."""
        varied = msgspec.structs.replace(scenario, choices=self.method.choices)
        return self._cities.build(with_kind(varied, self.method.team_reward))

    def _built(self, number: int) -> BuiltScenario:
        """Build a scenario of the curriculum, unless it is the one that was built last."""
        if self._last_built is None or self._last_built[0] != number:
            self._last_built = number, self.build(self._plan[number][1])
        return self._last_built[1]

    def _learning(self, n_brigades: int, epsilon: float, *, trace: Trace) -> tuple[PolicyArrays, Learner]:
        """Return what a team follows in an episode and what it learns with; both share the tables, a copy."""
        method, progress = self.method, self.progress
        policy = from_tables(progress.tables.copy(), epsilon=epsilon, commit=method.commit).for_brigades(n_brigades)
        learner = fresh_learner(
            policy.tables,
            n_brigades,
            rule=RULES.index(method.rule),
            alpha=method.alpha,
            alpha_decay=method.alpha_decay,
            gamma=method.gamma,
            own=method.learns_from_own,
        )
        return policy, learner._replace(visits=progress.visits, trace=trace)

    def _run_episode(self, built: BuiltScenario) -> EpisodeReport:
        method, progress = self.method, self.progress
        number, episode = progress.scenario_number, progress.episode
        epsilon = method.epsilon(episode, before=progress.n_before)
        seed = episode_seed(self.seed, number, 0 if method.fixed_noise else episode)
        world = built.world(seed=seed)
        traced = self.recording or self.watched
        trace = fresh_trace(built.n_brigades, world.n_steps_max if traced else 0, own=method.learns_from_own)
        policy, learner = self._learning(built.n_brigades, epsilon, trace=trace)
        before = progress.tables.argmax(axis=2)
        keeps = self.watched or self.detailed or (self.full_every > 0 and episode % self.full_every == 0)
        self.start = (progress.tables, progress.visits.copy()) if keeps else None
        n_steps = world.run(policy, learner)
        progress.tables = policy.tables
        n_changed = int((progress.tables.argmax(axis=2) != before).sum())
        n_unchanged = 0 if n_changed else progress.n_unchanged + 1
        converged = n_unchanged >= method.n_episodes_unchanged
        ended = converged or episode + 1 >= method.n_episodes_max
        outcome = world.outcome
        record = Episode(
            scenario=number,
            episode=episode,
            seed=seed,
            epsilon=epsilon,
            n_steps=n_steps,
            terminated=world.terminated,
            total_reward=outcome.total_reward,
            score=outcome.score,
            score_max=outcome.score_max,
            n_burnt_out=outcome.n_burnt_out,
            n_civilians_alive=outcome.n_civilians_alive,
            n_changed=n_changed,
            n_unchanged=n_unchanged,
            n_visited=int(progress.visits.any(axis=2).sum()) if self.recording else 0,
            converged=converged,
            ended=ended,
            drawn=self._draw_table() if ended and (method.draw_last or number + 1 < len(self._plan)) else -1,
            tables_digest=tables_digest(progress.tables) if self.recording else b"",
            **trace_columns(trace, n_steps, terminated=world.terminated),
        )
        whole = self.recording and (ended or (episode + 1) % TABLES_EVERY == 0)
        self._records = [record, *([Tables.of(progress.tables, progress.visits)] if whole else [])]
        if (self.watched or self.detailed) and self.start is not None:
            self._updates = self._learn_again(record, *self.start)
            self._records += [Updates(self._updates[2].ravel())] if self.detailed else []
        return self._end_episode(record)

    def _learn_again(self, record: Episode, tables: Array, visits: Array) -> Array:
        """Return the updates of an episode that was learned from these tables; the team stays as it is."""
        progress = self.progress
        self.progress = replace(progress, tables=tables, visits=visits.copy())
        updates = self.learn_from(record)
        self.progress = progress
        return updates

    def _end_episode(self, record: Episode) -> EpisodeReport:
        """Continue with the next episode; return the report of this one."""
        progress, (stage, scenario) = self.progress, self._plan[record.scenario]
        progress.episode, progress.n_unchanged = record.episode + 1, record.n_unchanged
        if record.ended:
            self._next_scenario(record.drawn)
        return EpisodeReport(
            milestone=record.ended,
            stage=stage.name,
            scenario=scenario.name,
            scenario_number=record.scenario,
            **{name: getattr(record, name) for name in REPORTED},
        )

    def _draw_table(self) -> int:
        """Draw the table that all brigades take into the next scenario."""
        progress = self.progress
        return below(self.seed, TABLE, progress.scenario_number, 0, bound=len(progress.tables))

    def _next_scenario(self, drawn: int) -> None:
        """Begin the next scenario with the table that was drawn, for all brigades."""
        progress = self.progress
        progress.n_before += progress.episode
        progress.scenario_number, progress.episode, progress.n_unchanged = progress.scenario_number + 1, 0, 0
        self.graduate = self.team()
        if self.done and not self.method.draw_last:
            return
        n_tables, n_states, _ = self.shape(progress.scenario_number)
        if not 0 <= drawn < len(progress.tables):
            raise LogError(f"expected a table from 0 to {len(progress.tables) - 1}, got {drawn}")
        table, visits = progress.tables[drawn], progress.visits[drawn]
        if n_states > len(table):
            table = np.repeat(table, N_FLAG_VALUES, axis=0)  # the same for all values of the cooperation flags
            visits = np.zeros(table.shape, dtype=np.int64)
        progress.tables = np.repeat(table[np.newaxis], n_tables, axis=0)
        progress.visits = np.repeat(visits[np.newaxis], n_tables, axis=0)


def _power(base: float, exponent: int) -> float:
    """Return base ** exponent by multiplication: the same on every machine."""
    result = 1.0
    for _ in range(exponent):
        result *= base
    return result
