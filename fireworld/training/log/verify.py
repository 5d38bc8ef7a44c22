"""Verify a training log: learn it all again, and compare every part."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

from fireworld_recorder.codec import encode

from fireworld.errors import LogError, TrainingError, expected
from fireworld.executors import Workers, threads
from fireworld.policy.teams.team import Team, read_team
from fireworld.scenario import Scenario
from fireworld.training.log.difference import TrainingDifference, compare_trainings
from fireworld.training.log.first_difference import Trained
from fireworld.training.log.played_difference import PlayedAgain
from fireworld.training.log.reader import AnyTraining, Part, TrainingLog, opened
from fireworld.training.log.records import TrainingHeader
from fireworld.training.method import Method, Report, Trainer
from fireworld.verified import Verified, trust_of
from fireworld.version import simulator_digest, simulator_version


class TrainedAgain:
    """A training as this fireworld does it, anew each time that its parts are asked for: a `Trained`, to be compared.

    Attributes:
        header: what identifies it.
        method: how the team learns.
        scenarios: what it learns in.

    Args:
        make: returns its trainer, before the first part.
        header: what identifies it.
        workers: who does the work, where it comes in many parts.
        n_parts: train so far; None: to the end.
    """

    def __init__(
        self,
        make: Callable[[], Trainer[Any, Any]],
        header: TrainingHeader,
        workers: Workers,
        *,
        n_parts: int | None = None,
    ) -> None:
        self._make, self._workers, self._n_parts = make, workers, n_parts
        trainer = make()
        self.header = header
        self.method: Method = trainer.method
        self.scenarios: list[Scenario] = trainer.curriculum.scenarios

    def trainer(self) -> Trainer[Any, Any]:
        """Return a trainer of it, before the first part."""
        return self._make()

    def run(self, trainer: Trainer[Any, Any]) -> Iterator[Report]:
        """Let a trainer of it train, as far as it goes; yield each report."""
        trainer.recording = True
        return islice(trainer.run(self._workers), self._n_parts)

    def parts(self) -> Iterator[Part]:
        """Train, and yield each part."""
        trainer = self.trainer()
        for _ in self.run(trainer):
            yield {type(record): record for record in trainer.records()}


@dataclass(frozen=True, repr=False, kw_only=True)
class TrainingVerification(Verified):
    """Whether a recorded training is still what this fireworld learns; true if it is."""

    team_digest: str
    """Of the team at its end; "" of what a learner played."""
    n_parts: int
    """Episodes or generations in the log."""
    unit: str
    """What a part is."""
    n_unknown: int = 0
    """Episodes of a learner that began in states that nobody knows, and were not played again."""
    difference: TrainingDifference | None = None
    """How the training differs when it is repeated, the log's values as `a`; None if it does not."""

    def to_dict(self) -> dict[str, Any]:
        """Return the result as plain values, as `fireworld verify --json` writes it."""
        known = {**self.known(), "digest": self.digest, "team_digest": self.team_digest, "unit": self.unit}
        known |= {"n_unknown": self.n_unknown} if self.n_unknown else {}
        return {**known, "n_parts": self.n_parts, **({} if self.difference is None else self.difference.to_dict())}

    def __repr__(self) -> str:
        if self.difference is None or self.difference.first is None:
            what = f"{self.n_parts} {self.unit}s, digest {self.digest}"
            if self.team_digest:
                return f"{self.name}: the same training, {what}; its team {self.team_digest}"
            left = f"; {self.n_unknown} that began in unknown states were not played again" if self.n_unknown else ""
            return f"{self.name}: played again they are the same, {what}{left}"
        how = "learned again it differs" if self.team_digest else "played again they differ"
        return f"{self.name}: {how}: {self.difference.first.sentence}"


def check_team(log: TrainingLog, team: Team, *, source: str) -> str:
    """Check that a team is what came of a training; return its digest.

    Args:
        log: the training.
        team: the team.
        source: what errors call it.

    Raises:
        TrainingError: it is another one.
    """
    digest = log.team().digest
    if team.digest != digest:
        raise TrainingError(expected(source, "", f"the team of {log.path}, digest {digest}", team.digest))
    return digest


def check_last_part(log: TrainingLog) -> None:
    """Check that a training of another simulator can be continued by this one: it learns the last part again.

    As of a verification, what counts is what comes out, not whose sources are the same; nothing is checked if they are.

    Raises:
        TrainingError: it learns something else than is recorded.
    """
    header, last = log.header, len(log) - 1
    if last < 0 or header.simulator_digest in {"", simulator_digest()}:
        return
    trainer = log.trainer_before(last)
    trainer.recording = True
    next(iter(trainer.run(threads(None))))
    again = {record.topic: encode(record) for record in trainer.records()}
    *recorded, _ = next(log.raw_parts(last))
    if again != {topic: bytes(payload) for topic, payload in recorded}:
        by = simulator_version(header.fireworld_version, header.simulator_digest)
        got = f"{simulator_version()}, with which {header.unit} {last} comes out otherwise"
        raise TrainingError(expected(str(log.path), "simulator", by, got, "begin again with --force"))


def verify_training(
    log: AnyTraining,
    *,
    team: Path | str | None = None,
    trust: str | None = None,
    jobs: int | None = None,
    on_part: Callable[[], object] = lambda: None,
) -> TrainingVerification:
    """Learn everything again that a training log holds, and compare every part.

    What somebody else's learner played is played again.

    Args:
        log: the path of a training log, or one that is open.
        team: the team file that came of it, to be compared too.
        trust: the digest that the log should have, or at least its first 12 digits, from a source you trust.
        jobs: fights at a time, where the method has many at once; None: as many as there are cores.
        on_part: called after each part.

    Raises:
        LogError: the log cannot be read.
        TrainingError: the team is not that of the log.
        ArgumentError: what is trusted is no digest.
    """
    trusted = trust_of(trust)
    training = opened(log)
    if not len(training):
        raise LogError(f"{training.path}: it holds no {training.header.unit}s; there is nothing to verify")
    digest, n_unknown = "", 0
    again: Trained
    if training.is_played and team is None:
        n_unknown = sum(not line.replayable for line in training.lines)
        again = PlayedAgain(training, threads(jobs))
    else:
        digest = (
            training.team().digest if team is None else check_team(training, read_team(Path(team))[0], source=str(team))
        )
        n_parts = None if training.done else len(training)
        again = TrainedAgain(training.trainer, training.header, threads(jobs), n_parts=n_parts)
    difference = compare_trainings(training, again, names=(str(training.path), "again"), on_part=on_part)
    return TrainingVerification(
        name=str(training.path),
        digest=training.digest,
        recorded_by=simulator_version(training.header.fireworld_version, training.header.simulator_digest),
        trust=trusted,
        team_digest=digest,
        n_parts=len(training),
        unit=training.header.unit,
        n_unknown=n_unknown,
        difference=None if difference.same else difference,
    )
