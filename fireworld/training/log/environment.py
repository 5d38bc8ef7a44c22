"""The method of a training that somebody else's learner did in environments of fireworld's: what the log has of it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Final, Literal, NoReturn

from fireworld.arguments import STEPS_MAX
from fireworld.errors import LogError, TrainingError, expected
from fireworld.executors import Workers
from fireworld.kernels.arrays import Array
from fireworld.policy.teams.team import Team
from fireworld.scenario import Scenario
from fireworld.simulation.built import BuiltScenario, CityCache
from fireworld.training.curriculum import Curriculum, CurriculumStage
from fireworld.training.log.played import Played
from fireworld.training.method import Limits, Method, Report, Trainer
from fireworld.training.methods import find_method
from fireworld.training.seeds import WORKERS_MAX

NAMED_MAX: Final = 3
OWN_TARGETS_MAX: Final = 10_000
ANOTHERS: Final = "a method of fireworld's own, not a learner that it does not know"


@dataclass(frozen=True, kw_only=True)
class Environment(Method):
    """What the learner played in, and what it was shown; nobody but the learner can train so again."""

    name: ClassVar[str] = "environment"
    curriculum: ClassVar[str] = ""

    observation: Literal["features", "targets", "graph"] = "features"
    reward: Literal["score", "stock", "change", "function"] = "score"
    """What a step is worth; "function": what a function of the learner's made of it."""
    own_targets: Annotated[int, Limits(f"a whole number from 0 to {OWN_TARGETS_MAX}", 0, OWN_TARGETS_MAX)] = 0
    """How many burning buildings a brigade may name as its own target."""
    steps: Annotated[int, Limits(f"a whole number from 0 to {STEPS_MAX}", 0, STEPS_MAX)] = 0
    """The last step; 0: each scenario's."""
    n_worlds: Annotated[int, Limits(f"a whole number from 1 to {WORKERS_MAX}", 1, WORKERS_MAX)] = 1
    first_worker: Annotated[int, Limits(f"a whole number below {WORKERS_MAX}", 0, WORKERS_MAX - 1)] = 0
    """Number of the first world."""
    test_seeds: bool = False
    """The seeds are those to test with."""
    autoreset: Literal["next-step", "same-step", "disabled"] = "next-step"

    def trainer(self, curriculum: Curriculum, *, seed: int, cities: CityCache | None = None) -> PlayedTrainer:
        """Return what goes through the episodes; see `Method.trainer`."""
        return PlayedTrainer(curriculum, self, seed=seed, cities=cities)

    def last_step(self, scenario: Scenario) -> int:
        """Return the last step of an episode."""
        return self.steps or scenario.steps


ENVIRONMENT: Final = Environment()


@dataclass(frozen=True, kw_only=True)
class PlayedReport(Report):
    """How an episode that a learner played ended."""

    scenario: str
    world: int
    episode: int
    seed: int
    n_steps: int
    terminated: bool
    truncated: bool
    total_reward: float
    score: float
    score_max: float
    n_burnt_out: int
    n_civilians_alive: int

    @property
    def text(self) -> str:
        """The episode in one line."""
        score = f"score {self.score:.2f} of {self.score_max:.0f}"
        return f"{self.scenario}, world {self.world}, episode {self.episode}: {self.n_steps} steps, {score}"


class PlayedTrainer(Trainer[Environment, PlayedReport]):
    """Goes through the episodes of a log; it trains nothing, and has no team.

    Args:
        curriculum: all that is played, in one stage.
        method: what it was played in.
        seed: the base of the worlds' seeds.
        cities: cities built before.
    """

    report_type: ClassVar[type[Report]] = PlayedReport
    unit: ClassVar[str] = "episode"
    topics: ClassVar[tuple[type[Any], ...]] = (Played,)
    plots: ClassVar[Mapping[str, str]] = {
        "learner_return": "Return, as the learner got it",
        "score": "Score, as a share of the best",
        "n_steps": "Steps",
        "n_burnt_out": "Burnt out",
        "n_civilians_alive": "Civilians alive",
    }

    def __init__(
        self, curriculum: Curriculum, method: Environment, *, seed: int, cities: CityCache | None = None
    ) -> None:
        super().__init__(curriculum, method, seed=seed)
        self._cities = cities if cities is not None else CityCache()
        self._built: dict[int, BuiltScenario] = {}
        self._scenarios = curriculum.scenarios
        self._records: list[Any] = []

    @property
    def share_done(self) -> float:
        """Nobody knows how much the learner means to do."""
        return 0.0

    def last_step(self, scenario: Scenario) -> int:
        """Return the last step of an episode in a scenario."""
        return self.method.last_step(scenario)

    def built(self, number: int) -> BuiltScenario:
        """Return a scenario of the plan, built once."""
        if number not in self._built:
            self._built[number] = self._cities.build(self._scenarios[number])
        return self._built[number]

    def take(self, played: Played) -> None:
        """Take an episode that has just been played, to be recorded."""
        self._records = [played]

    def records(self) -> list[Any]:
        """Return the last episode."""
        return self._records

    def follow(self, part: Mapping[type[Any], Any]) -> PlayedReport:
        """Go through an episode; see `Trainer.follow`."""
        played: Played | None = part.get(Played)
        if played is None or not 0 <= played.scenario < len(self._scenarios):
            raise LogError("a part holds no episode of a scenario of the plan")
        values = {name: getattr(played, name) for name in PlayedReport.columns() if name != "scenario"}
        return PlayedReport(milestone=False, scenario=self._scenarios[played.scenario].name, **values)

    def points(self, report: PlayedReport) -> Mapping[str, Mapping[str, float]]:
        """Return what is drawn of the last episode."""
        values = report.as_dict()
        values |= {"learner_return": report.total_reward, "score": report.score / (report.score_max or 1.0)}
        return {name: {"": float(values[name])} for name in self.plots}

    def run(self, workers: Workers) -> NoReturn:
        """Raise TrainingError: nobody but the learner can train."""
        del workers
        self._refuse()

    def __iter__(self) -> Iterator[PlayedReport]:
        self._refuse()

    def team(self) -> Team:
        """Raise TrainingError: what the learner has become is not known here."""
        self._refuse()

    def state(self) -> dict[str, Array]:
        """Raise TrainingError."""
        self._refuse()

    def restore(self, team: Team, state: Mapping[str, Array], *, source: str) -> None:
        """Raise TrainingError."""
        del team, state, source
        self._refuse()

    def _refuse(self) -> NoReturn:
        raise TrainingError(expected("method", "", ANOTHERS, self.method.name))


def method_named(name: str) -> Method:
    """Return a method by the name that a log has of it; errors as for `find_method`."""
    return ENVIRONMENT if name == ENVIRONMENT.name else find_method(name)


def curriculum_played(scenarios: list[Scenario]) -> Curriculum:
    """Return all that is played in as a curriculum of one stage, which bears the names of the first ones."""
    names = [*dict.fromkeys(scenario.name for scenario in scenarios)]
    name = ", ".join([*names[:NAMED_MAX], *(["..."] if len(names) > NAMED_MAX else [])])
    return Curriculum(name, (CurriculumStage("played", cooperation=True, scenarios=tuple(scenarios)),))
