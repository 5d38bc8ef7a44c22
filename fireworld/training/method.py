"""What a method of training is: hyperparameters, a trainer that is iterated, and the reports that it yields."""

from __future__ import annotations

import re
import sys
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, fields, replace
from typing import (
    Annotated,
    Any,
    ClassVar,
    Final,
    Generic,
    Literal,
    NamedTuple,
    Self,
    TypeVar,
    get_args,
    get_origin,
    get_type_hints,
)

from fireworld.errors import TrainingError, expected
from fireworld.executors import Workers, threads
from fireworld.kernels.arrays import Array
from fireworld.policy.teams.team import Team
from fireworld.scenario import Scenario
from fireworld.simulation.built import CityCache
from fireworld.training.curriculum import Curriculum
from fireworld.version import __version__

COUNT_MAX: Final = 1_000_000


class Limits(NamedTuple):
    """What numbers a hyperparameter may be."""

    wanted: str
    """In words."""
    least: float = -sys.float_info.max
    most: float = sys.float_info.max
    above: bool = False
    """The least number itself is not allowed."""

    def allow(self, value: float) -> bool:
        """Return whether a number is within the limits; nan and infinity never are."""
        return (self.least < value if self.above else self.least <= value) and value <= self.most


Share = Annotated[float, Limits("a number from 0 to 1", 0.0, 1.0)]
NotNegative = Annotated[float, Limits("a number >= 0", 0.0)]
Positive = Annotated[float, Limits("a number > 0", 0.0, above=True)]
PositiveShare = Annotated[float, Limits("a number above 0, at most 1", 0.0, 1.0, above=True)]
Count = Annotated[int, Limits(f"a whole number from 1 to {COUNT_MAX}", 1, COUNT_MAX)]
CountOrNone = Annotated[int, Limits(f"a whole number from 0 to {COUNT_MAX}", 0, COUNT_MAX)]


@dataclass(frozen=True, kw_only=True)
class Method(ABC):
    """How a team learns: a frozen dataclass whose fields are the hyperparameters.

    A field is a bool, a `Literal` of words, or a number with `Limits`, such as `Share` or `Count`; what it may be is
    checked by its type.

    Attributes:
        name: of the method, as files have it.
        curriculum: the name of the curriculum that it trains in if none is given.
    """

    name: ClassVar[str]
    curriculum: ClassVar[str]

    def __post_init__(self) -> None:
        """Raise TrainingError if a hyperparameter is not what it may be."""
        for key, kind in _kinds(type(self)).items():
            value = getattr(self, key)
            if wanted := _fault(value, kind):
                raise TrainingError(expected("method", key, wanted, value))

    @abstractmethod
    def trainer(self, curriculum: Curriculum, *, seed: int, cities: CityCache | None = None) -> Trainer[Any, Any]:
        """Return what trains one team.

        Args:
            curriculum: what to learn in.
            seed: of all random draws of this training.
            cities: cities built before, shared between trainings.
        """

    def as_dict(self) -> dict[str, Any]:
        """Return all hyperparameters by name."""
        return asdict(self)

    def with_settings(self, settings: Mapping[str, object]) -> Self:
        """Return the method with other hyperparameters.

        Args:
            settings: values by name, plain or as text: {"alpha": 0.1, "shared_table": "true"}.

        Raises:
            TrainingError: no such hyperparameter, or not a value it can have.
        """
        kinds = _kinds(type(self))
        for key in settings:
            if key not in kinds:
                raise TrainingError(expected("--set", key, "one of " + ", ".join(kinds), key))
        return replace(self, **{key: _read(key, value, kinds[key]) for key, value in settings.items()})


@dataclass(frozen=True, kw_only=True)
class Report(ABC):
    """What a trainer yields from time to time; the fields of its subclass are the columns of the log."""

    milestone: bool
    """A part of the training is done: time for a checkpoint, and for a line on the terminal."""

    @property
    @abstractmethod
    def text(self) -> str:
        """What happened, in one line."""

    @property
    def place(self) -> str:
        """What is learned in, which viewers show as bands; "" if that never changes."""
        return ""

    @property
    def ending(self) -> str:
        """How what was learned in has ended: "settled", or another word for a mark; "" if it has not."""
        return ""

    @classmethod
    def columns(cls) -> list[str]:
        """Return the names of the columns of the log."""
        return [item.name for item in fields(cls) if item.name != "milestone"]

    def as_dict(self) -> dict[str, Any]:
        """Return the columns by name."""
        return {name: getattr(self, name) for name in self.columns()}


class Play(NamedTuple):
    """A run to be shown while a team learns."""

    title: str
    scenario: Scenario
    team: Team


AMethod = TypeVar("AMethod", bound=Method)
AReport = TypeVar("AReport", bound=Report)


class Trainer(ABC, Generic[AMethod, AReport]):
    """Trains one team. Iterate over it to train; between reports it can be saved and restored.

    Attributes:
        method: how the team learns.
        curriculum: what it learns in.
        seed: of all random draws.
        report_type: what it yields.
        plots: titles of what is drawn of every team, by name.
        unit: what is reported on, as in "episode".
        uses_workers: whether one training keeps all workers busy.
        topics: record types of what a training log holds of a part, declared with `fireworld.records.column` and
            `value`; the first is in every part. None: trainings of this method cannot be recorded.
        whole: the one of them that holds the whole team, after some parts at least.
        recording: somebody will ask for `records` after each report.
        detailed: these shall also hold what follows from the rest, but shows where a changed rule of learning differs.
        watched: somebody will ask for `points` after each report: what only they need is worked out.
    """

    report_type: ClassVar[type[Report]]
    plots: ClassVar[Mapping[str, str]]
    unit: ClassVar[str]
    uses_workers: ClassVar[bool] = False
    topics: ClassVar[tuple[type[Any], ...]] = ()
    whole: ClassVar[type[Any] | None] = None
    recording: bool = False
    detailed: bool = False
    watched: bool = False

    def __init__(self, curriculum: Curriculum, method: AMethod, *, seed: int) -> None:
        if not curriculum.n_scenarios:
            raise TrainingError(expected(curriculum.name, "stages", "a scenario to learn in", "none"))
        self.method, self.curriculum, self.seed = method, curriculum, seed

    @property
    def identity(self) -> dict[str, Any]:
        """What decides what comes of a training: equal identities, equal teams."""
        return {
            "curriculum": {"name": self.curriculum.name, "digest": self.curriculum.digest},
            "method": {"name": self.method.name, **self.method.as_dict()},
            "seed": self.seed,
            "fireworld": __version__,
        }

    @property
    @abstractmethod
    def share_done(self) -> float:
        """How much is done, 0 to 1; 1 at the end only."""

    @property
    def done(self) -> bool:
        """Whether the training is at its end."""
        return self.share_done >= 1.0

    @abstractmethod
    def run(self, workers: Workers) -> Iterator[AReport]:
        """Train, yielding a report after every part.

        Args:
            workers: who does the work, where it comes in many parts; when their `stop` is set, this may end between
                two reports, with the state of the last one. What comes of it does not depend on their number.
        """

    def __iter__(self) -> Iterator[AReport]:
        return self.run(threads(1))

    def last_step(self, scenario: Scenario) -> int:
        """Return the last step of an episode in a scenario."""
        return scenario.steps

    @abstractmethod
    def team(self) -> Team:
        """Return the team as it is now."""

    @abstractmethod
    def state(self) -> dict[str, Array]:
        """Return what is needed to continue, besides the team."""

    @abstractmethod
    def restore(self, team: Team, state: Mapping[str, Array], *, source: str) -> None:
        """Continue where another trainer of this identity stood.

        Args:
            team: its team.
            state: its state.
            source: what errors call the file.

        Raises:
            TrainingError: they make no sense.
        """

    def records(self) -> list[Any]:
        """Return what the training log holds of the part last reported on: of each topic one record at most."""
        return []

    def follow(self, part: Mapping[type[Any], Any]) -> AReport:
        """Go through a part that a training log holds instead of training it; return its report.

        What comes of it is what came of the training. A part that holds the whole team can be the first one.

        Args:
            part: its records, by type.

        Raises:
            LogError: the part does not fit where this trainer stands.
        """
        raise NotImplementedError

    def own_plots(self) -> Mapping[str, str]:
        """Return the titles of what is drawn of this team alone, by name."""
        return {}

    @abstractmethod
    def points(self, report: AReport) -> Mapping[str, Mapping[str, float]]:
        """Return what is drawn of the last report: by plot, then by curve; "" is a plot's only curve."""

    def numbers(self, report: AReport) -> dict[str, float]:
        """Return the numbers of the last report by name, for tools that keep curves.

        They are the columns of the log that are numbers, then what is drawn and is no column, as in "td_error/50".
        """
        columns = {key: float(value) for key, value in report.as_dict().items() if isinstance(value, int | float)}
        drawn = {
            re.sub(r"[^\w./-]+", "_", f"{plot}/{curve}" if curve else plot).strip("_"): value
            for plot, curves in self.points(report).items()
            for curve, value in curves.items()
            if plot not in columns
        }
        return {**columns, **drawn}

    def page(self) -> str:
        """Return a text about the team as it is now, in Markdown, to be read beside its own plots."""
        return ""

    def play(self, report: AReport) -> Play | None:
        """Return a run to be shown after the last report, if it is time for one."""
        del report
        return None


def _kinds(method: type[Method]) -> dict[str, Any]:
    """Return the types of the hyperparameters by name."""
    hints = get_type_hints(method, include_extras=True)
    return {item.name: hints[item.name] for item in fields(method)}


def _fault(value: object, kind: Any) -> str:
    """Return in words what a hyperparameter may be, if a value is none of that; "" if it is."""
    if kind is bool:
        return "" if isinstance(value, bool) else "true or false"
    if get_origin(kind) is Literal:
        return "" if value in get_args(kind) else "one of " + ", ".join(get_args(kind))
    number, limits = get_args(kind)
    is_number = isinstance(value, int) or (number is float and isinstance(value, float))
    return "" if is_number and not isinstance(value, bool) and limits.allow(value) else limits.wanted


def _read(key: str, given: object, kind: Any) -> object:
    """Read a hyperparameter, given as text or as a plain value."""
    if get_origin(kind) is Literal:
        return given
    if kind is bool:
        found = {"true": True, "false": False}.get(given, given) if isinstance(given, str) else given
        if not isinstance(found, bool):
            raise TrainingError(expected("--set", key, "true or false", given))
        return found
    number = get_args(kind)[0]
    try:
        if isinstance(given, str | int | number) and not isinstance(given, bool):
            return number(given)
    except (ValueError, OverflowError):
        pass
    raise TrainingError(expected("--set", key, "a whole number" if number is int else "a number", given))
