"""Read a training log: its parts, the trainer at any of them, and episodes with all that was learned in them."""

from __future__ import annotations

import os
from bisect import bisect_right
from collections.abc import Iterator, Mapping
from dataclasses import fields, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias, cast

import numpy as np
from fireworld_recorder.codec import decode
from fireworld_recorder.reader import RawStep, raw_commits
from fireworld_recorder.scan import TopicSize, scan

from fireworld.arguments import path_of
from fireworld.errors import LogError, expected, one_line
from fireworld.policy.teams.team import Team
from fireworld.scenario import Scenario
from fireworld.shown import SHOWN_MAX, Block, Shown
from fireworld.training.log.environment import Environment, PlayedTrainer
from fireworld.training.log.learned import LearnedEpisode, learned
from fireworld.training.log.played import Played
from fireworld.training.log.played_run import PlayedEpisode
from fireworld.training.log.records import TRAINING, Episode, PartCommit, Plan, TrainingHeader, check_places
from fireworld.training.log.setting import check_plan, setting_of
from fireworld.training.method import Report, Trainer
from fireworld.training.methods.sarsa import SarsaTrainer

if TYPE_CHECKING:
    import pandas
    import polars

    from fireworld.picture import Picture

Part = Mapping[type[Any], Any]
"""The records of a part by type."""
AnyTraining: TypeAlias = "str | os.PathLike[str] | TrainingLog"
"""The path of a training log, or one that is open."""


def open_training(path: str | os.PathLike[str], *, partial: bool = False) -> TrainingLog:
    """Open a training log; its hashes are checked now, its parts are read when they are asked for.

    Args:
        path: the log.
        partial: accept a log that was cut off or damaged; it ends at its last good part, and `damage` is not None.

    Raises:
        LogError: it is not the log of a training, or (unless `partial`) is cut off or damaged.
        TrainingError: its method is not known here.
        ArgumentError: it is no path.
    """
    log = TrainingLog(path_of("path", path))
    if log.damage is not None and not partial:
        raise LogError(f"{path}: {log.damage}; continue the training with --resume, or try `fireworld recover {path}`")
    return log


def opened(given: AnyTraining, *, partial: bool = False) -> TrainingLog:
    """Return a training log; open it, as `open_training` does, if its path is given."""
    return given if isinstance(given, TrainingLog) else open_training(given, partial=partial)


class TrainingLog(Shown):
    """A recorded training. Made by `fireworld.open_training`.

    It holds no more in memory than one part at a time, and a line of each.

    Attributes:
        path: the file.
        header: what identifies the training.
        plan: what is learned in.
        digest: of the training: the hash of its last part, 64 hexadecimal digits.
        state: complete, partial (cut off, or under way) or damaged.
        damage: what is wrong and how far the log is good; None if nothing is.
        topics: messages and bytes by topic.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.found = scan(path, TRAINING)
        self.header: TrainingHeader = self.found.header
        self.plan: Plan = decode(Plan, self.found.first)
        self.digest = self.found.hash.hex()
        self.state = self.found.state
        self.damage = self.found.damage
        self.topics: Mapping[str, TopicSize] = self.found.topics
        try:
            self.method, self.curriculum, self._cities = setting_of(self.header)
            check_plan(self.plan, self.curriculum)
        except LogError as error:
            raise LogError(f"{path}: {error}") from None
        self._topics = self.trainer().topics
        self._n_brigades = [one.brigades.n for one in self.scenarios]

    @property
    def identity(self) -> dict[str, Any]:
        """What decides what comes of the training, as `Trainer.identity` has it."""
        return {**self.trainer().identity, "fireworld": self.header.fireworld_version}

    @cached_property
    def done(self) -> bool:
        """Whether the training is at its end."""
        if not len(self):
            return False
        return decode(PartCommit, next(self.raw_parts(len(self) - 1))[-1][1]).done

    def __len__(self) -> int:
        return len(self.found.steps)

    def raw_parts(self, first: int = 0) -> Iterator[RawStep]:
        """Yield the parts as they lie in the file: topic and payload of every message, /commit last."""
        return raw_commits(self.found, first)

    def parts(self, first: int = 0) -> Iterator[Part]:
        """Yield the parts: records by type.

        Raises:
            LogError: the log changed since it was opened, or a part lacks what its method has in each, or does not fit.
        """
        for number, raw in enumerate(self.raw_parts(first), first):
            payloads = dict(raw)
            try:
                yield self._part(payloads)
            except LogError as error:
                raise LogError(f"{self.path}: part {number}: {error}") from error

    def _part(self, payloads: Mapping[str, memoryview]) -> Part:
        part = {one: decode(one, payloads[one.topic]) for one in self._topics if one.topic in payloads}
        always = self._topics[0]
        if always not in part:
            raise LogError(f"no {always.topic}, of which the method {self.method.name} has one in every part")
        for record in part.values():
            check_places(record, self._n_brigades)
        return part

    def __iter__(self) -> Iterator[Part]:
        return self.parts()

    def trainer(self) -> Trainer[Any, Any]:
        """Return a trainer of this training, before its first part."""
        return self.method.trainer(self.curriculum, seed=self.header.seed, cities=self._cities)

    def learner(self) -> SarsaTrainer:
        """Return a trainer that learns values in episodes, before its first part.

        Raises:
            LogError: the method of the training does something else.
        """
        trainer = self.trainer()
        if not isinstance(trainer, SarsaTrainer):
            raise LogError(expected(str(self.path), "method", "one that learns in episodes", self.method.name))
        return trainer

    def trainer_before(self, number: int) -> Trainer[Any, Any]:
        """Return a trainer that stands before a part; `len(log)` is behind the last.

        Raises:
            LogError: there is no such part, or the parts before do not fit each other.
        """
        if not 0 <= number <= len(self):
            raise LogError(expected(str(self.path), "part", f"one from 0 to {len(self)}", number))
        trainer = self.trainer()
        n_wholes = bisect_right(self.wholes, number - 1)
        first = self.wholes[n_wholes - 1] if n_wholes else 0
        for place, part in zip(range(first, number), self.parts(first) if first < number else (), strict=False):
            self.follow(trainer, part, place)
        return trainer

    def follow(self, trainer: Trainer[Any, Any], part: Part, number: int) -> Report:
        """Let a trainer go through a part of this log; return its report."""
        try:
            report: Report = trainer.follow(part)
        except LogError as error:
            raise LogError(f"{self.path}: part {number}: {error}") from None
        return report

    def learn(self, trainer: SarsaTrainer, part: Part, number: int) -> LearnedEpisode:
        """Let a trainer go through a part of this log that is an episode; return what was learned in it."""
        before = trainer.progress.tables, trainer.progress.visits.copy()
        found = self._learned(trainer, part[Episode], number)
        trainer.progress.tables, trainer.progress.visits = before
        self.follow(trainer, part, number)
        return found

    def _learned(self, trainer: SarsaTrainer, episode: Episode, number: int) -> LearnedEpisode:
        try:
            return learned(trainer, episode, self.scenarios[episode.scenario])
        except LogError as error:
            raise LogError(f"{self.path}: part {number}: {error}") from None

    def reports(self) -> Iterator[tuple[Trainer[Any, Any], Report]]:
        """Yield the report of every part, with the trainer as it stands after it: the same object each time."""
        trainer = self.trainer()
        for number, part in enumerate(self.parts()):
            yield trainer, self.follow(trainer, part, number)

    def team(self) -> Team:
        """Return the team as it is after the last part."""
        team: Team = self.trainer_before(len(self)).team()
        return team

    @cached_property
    def lines(self) -> list[Any]:
        """The first record of every part without its columns: `Episode` or `Tried`, say."""
        return self._index[0]

    @property
    def wholes(self) -> list[int]:
        """Numbers of the parts that hold the whole team."""
        return self._index[1]

    @cached_property
    def _index(self) -> tuple[list[Any], list[int]]:
        lines, wholes, whole = [], [], self.trainer().whole
        for number, part in enumerate(self.parts()):
            lines.append(without_columns(part[self._topics[0]]))
            if whole in part:
                wholes.append(number)
        return lines, wholes

    def to_pandas(self, table: str = "") -> pandas.DataFrame:
        """Return a table of the training as a data frame.

        Args:
            table: as `fireworld export` writes them: episodes, steps, tables; of a search generations, candidates,
                fights. "": the first of these.

        Raises:
            LogError: there is no such table.
            OutputError: pandas is not installed.
        """
        return cast("pandas.DataFrame", self._frame("pandas", table))

    def to_polars(self, table: str = "") -> polars.DataFrame:
        """Return a table of the training as a data frame of polars; as `to_pandas`."""
        return cast("polars.DataFrame", self._frame("polars", table))

    def _frame(self, library: str, table: str) -> Any:
        from fireworld_recorder.tables import import_frames

        from fireworld.training.log.export import table_arrays, tables_of

        frames = import_frames(library)
        arrays = table_arrays(self, table or tables_of(self)[0])
        return frames.DataFrame({name: one.tolist() if one.dtype == object else one for name, one in arrays.items()})

    def show(self) -> Picture:
        """Return a picture of the training, its curves over the episodes, which notebooks show.

        Raises:
            ViewError: matplotlib is not installed.
        """
        from fireworld.training.log.pages.page import course_picture

        return course_picture(self)

    def view(self, *, save: str | os.PathLike[str] | None = None, force: bool = False) -> None:
        """Open the training in Rerun, or save it for Rerun.

        Args:
            save: an .rrd file to write instead of opening a window.
            force: replace an existing file.

        Raises:
            ViewError: Rerun is not installed, or there is no display.
            OutputError: the file cannot be written.
        """
        from fireworld.training.log.pages.view import view_trainings

        view_trainings(self, save=None if save is None else path_of("save", save), force=force)

    @property
    def scenarios(self) -> list[Scenario]:
        """What is learned in, in the order of the plan."""
        return self.curriculum.scenarios

    @property
    def is_played(self) -> bool:
        """Whether somebody else's learner played it in environments."""
        return isinstance(self.method, Environment)

    def position(self, scenario: str | int | None, episode: int, *, world: int | None = None) -> int:
        """Return the number of the part that an episode is.

        Args:
            scenario: its name, or its position in the plan; None: of what a learner played, any.
            episode: its number in the scenario, from 0; -1 is the last. Of what a learner played, it counts those that
                are recorded, in the order in which they ended; with a world, it is its number in that world.
            world: the world that a learner played it in; of several forks of an episode the first that ended.

        Raises:
            LogError: there is no such episode, or the method has none.
        """
        from fireworld.training.log.places import position_of

        return position_of(self, scenario, episode, world)

    def episode(self, scenario: str | int, episode: int) -> LearnedEpisode:
        """Return an episode with all that was learned in it; arguments and errors as for `position`."""
        return self.episode_at(self.position(scenario, episode))

    def episode_at(self, number: int) -> LearnedEpisode:
        """Return the episode that is a part; errors as for `trainer_before`."""
        trainer = self.trainer_before(number)
        part = next(self.parts(number), None)
        if part is None or not isinstance(trainer, SarsaTrainer):
            raise LogError(expected(str(self.path), "part", "an episode", number))
        return self._learned(trainer, part[Episode], number)

    def played_at(self, number: int) -> PlayedEpisode:
        """Return the episode of somebody else's learner that is a part.

        Raises:
            LogError: there is none, or what is recorded of it cannot be.
        """
        player = self.player
        part = next(self.parts(number), None) if 0 <= number < len(self) else None
        if part is None:
            raise LogError(expected(str(self.path), "part", f"one from 0 to {len(self) - 1}", number))
        return PlayedEpisode.of(
            part[Played],
            player.built(part[Played].scenario),
            player.method,
            log=self.digest,
            source=f"{self.path}: part {number}",
        )

    @cached_property
    def player(self) -> PlayedTrainer:
        """What builds the scenarios of somebody else's learner, each of them once.

        Raises:
            LogError: fireworld itself trained.
        """
        trainer = self.trainer()
        if not isinstance(trainer, PlayedTrainer):
            raise LogError(
                expected(str(self.path), "method", "an environment that a learner played in", self.method.name)
            )
        return trainer

    def describe(self, *, limit: int = SHOWN_MAX) -> Iterator[Block]:
        """Yield what there is to see of the training: its header, then a table of its scenarios or generations."""
        from fireworld.training.log.summary import describe_training

        return describe_training(self, limit=limit)

    def __repr__(self) -> str:
        header = self.header
        what = f"{header.method} in {header.curriculum}, seed {header.seed}"
        return one_line(f"<TrainingLog {what}: {len(self)} {header.unit}s, {self.state}, digest {self.digest[:12]}>")


def without_columns(record: Any) -> Any:
    """Return a record with its columns left empty."""
    empty = np.zeros(0)
    return replace(record, **{item.name: empty for item in fields(record) if "per" in item.metadata})
