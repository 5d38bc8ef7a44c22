"""Write a training to its log: every part is a commit, and a kill loses the part under way."""

from __future__ import annotations

import itertools
import json
import os
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Any, Final, Self

import numpy as np
from fireworld_recorder.chain import Chain
from fireworld_recorder.codec import decode, encode
from fireworld_recorder.header import to_metadata
from fireworld_recorder.reader import RawStep
from fireworld_recorder.writer import PARTIAL_SUFFIX, StepFile

from fireworld.arguments import path_of
from fireworld.errors import OutputError, TrainingError, expected
from fireworld.files import check_output
from fireworld.simulation.placement import CITY_ATTACHMENT, attachments
from fireworld.training.log.records import TRAINING, PartCommit, Plan, TrainingHeader, channels_of
from fireworld.training.method import Trainer
from fireworld.version import __version__, simulator_digest

CURRICULUM_ATTACHMENT = "curriculum.json"
METHOD_ATTACHMENT = "method.json"
CITY_FOLDER = "cities/"
SUFFIX: Final = ".mcap"


def header_of(trainer: Trainer[Any, Any]) -> TrainingHeader:
    """Return what identifies a training, with all that is needed to repeat it.

    Raises:
        TrainingError: trainings of its method cannot be recorded.
        ScenarioError: a city file is not what it was when the curriculum was read.
    """
    if not trainer.topics:
        raise TrainingError(expected("--record", "", "a method that declares what is recorded", trainer.method.name))
    curriculum, method = trainer.curriculum, trainer.method
    files: dict[str, bytes] = {METHOD_ATTACHMENT: _json({"name": method.name, **method.as_dict()})}
    stages, number = [], 0
    for stage in curriculum.stages:
        names = []
        for scenario in stage.scenarios:
            number += 1
            carried = attachments(scenario)
            names.append(f"scenarios/{number:03d}-{Path(scenario.name).name}.yaml")
            files[names[-1]] = scenario.to_yaml().encode()
            if CITY_ATTACHMENT in carried:
                files[f"{CITY_FOLDER}{scenario.city_sha256}.json"] = carried[CITY_ATTACHMENT]
        stages.append({"name": stage.name, "cooperation": stage.cooperation, "scenarios": names})
    files[CURRICULUM_ATTACHMENT] = _json({"name": curriculum.name, "digest": curriculum.digest, "stages": stages})
    return TrainingHeader(
        method=method.name,
        curriculum=curriculum.name,
        curriculum_digest=curriculum.digest,
        seed=trainer.seed,
        fireworld_version=__version__,
        simulator_digest=simulator_digest(),
        unit=trainer.unit,
        attachments=files,
    )


def plan_of(trainer: Trainer[Any, Any]) -> Plan:
    """Return what is learned in, as it is recorded."""
    pairs = [(k, stage, one) for k, stage in enumerate(trainer.curriculum.stages) for one in stage.scenarios]
    return Plan(
        stage=np.array([k for k, _, _ in pairs]),
        cooperation=np.array([stage.cooperation for _, stage, _ in pairs], dtype=np.uint8),
        n_brigades=np.array([one.brigades.n for _, _, one in pairs]),
        n_steps_max=np.array([trainer.last_step(one) for _, _, one in pairs]),
        digests=b"".join(bytes.fromhex(one.digest) for _, _, one in pairs),
    )


class PartChain:
    """The messages of a training part by part, with their chained hash."""

    def __init__(self, trainer: Trainer[Any, Any]) -> None:
        self.plan = encode(plan_of(trainer))
        self.n_parts = 0
        self._trainer = trainer
        self._chain = Chain(self.plan, TRAINING)

    @property
    def digest(self) -> str:
        """The digest of the training so far, 64 hexadecimal digits."""
        return self._chain.hash.hex()

    def part(self, records: Sequence[Any]) -> list[tuple[str, bytes]]:
        """Return the messages of the trainer's last part, whose records these are; /commit comes last."""
        messages = [(record.topic, encode(record)) for record in records]
        return self._sealed(messages, PartCommit(step=self.n_parts, done=self._trainer.done, hash=b""))

    def copied(self, raw: RawStep) -> list[tuple[str, bytes]]:
        """Return the messages of the next part as another log holds them."""
        messages = [(topic, bytes(payload)) for topic, payload in raw[:-1]]
        return self._sealed(messages, replace(decode(PartCommit, raw[-1][1]), hash=b""))

    def _sealed(self, messages: list[tuple[str, bytes]], commit: PartCommit) -> list[tuple[str, bytes]]:
        for topic, data in messages:
            self._chain.add(topic, data)
        self.n_parts += 1
        return [*messages, (PartCommit.topic, encode(self._chain.seal(commit)))]


class TrainingWriter:
    """Records a training. As a context manager: an exception inside leaves the committed parts as NAME.partial.

    Args:
        path: the log to make.
        trainer: what is recorded.
        header: what identifies it; None: `header_of(trainer)`.
        force: replace an existing log.
        before: the parts of the interrupted training that is continued; they are copied first, and then the new file
            takes the place of the partial one.
        scratch_suffix: as for `StepFile`, for a log that is made anew where its making is cut short.

    Raises:
        OutputError: the log exists, its folder does not, or it cannot be written.
    """

    def __init__(
        self,
        path: Path,
        trainer: Trainer[Any, Any],
        *,
        header: TrainingHeader | None = None,
        force: bool = False,
        before: Iterable[RawStep] | None = None,
        scratch_suffix: str = "",
    ) -> None:
        header = header or header_of(trainer)
        self._trainer = trainer
        self._chain = PartChain(trainer)
        self._file = StepFile(
            path,
            metadata=to_metadata(header, TRAINING),
            attachments=header.attachments,
            channels=channels_of(trainer.topics),
            city=self._chain.plan,
            force=force,
            kind=TRAINING,
            scratch_suffix=scratch_suffix if before is None else ".resuming",
        )
        trainer.recording = True
        if before is not None:
            try:
                for raw in before:
                    self._file.commit(self._chain.n_parts, self._chain.copied(raw))
                self._file.keep_partial()
            except BaseException:
                self._file.abort()
                raise

    @property
    def path(self) -> Path:
        """The log, when it has its name."""
        return self._file.path

    @property
    def partial(self) -> Path:
        """The log while the training is not at its end."""
        return self._file.partial

    @property
    def n_parts(self) -> int:
        """Parts written so far."""
        return self._chain.n_parts

    def write(self) -> None:
        """Write the trainer's last part; when this returns a kill cannot lose it."""
        self._file.commit(self._chain.n_parts, self._chain.part(self._trainer.records()))

    def close(self) -> None:
        """Give the log its name."""
        self._file.close()

    def abort(self) -> None:
        """Stop here; the partial log stays."""
        self._file.abort()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._file.abort()


def open_writer(record: str | os.PathLike[str], trainer: Trainer[Any, Any]) -> TrainingWriter:
    """Begin the log of episodes: one of a given name, or in an existing folder one of a name that is free.

    Raises:
        OutputError: the name is taken or ends otherwise, or the log cannot be made.
        ArgumentError: it is no path.
    """
    path = path_of("record", record)
    if path.is_dir():
        return _new_in(path, trainer)
    if os.fspath(record).endswith(os.sep):
        raise OutputError(expected(str(path), "", "an existing folder", "none", "make it first"))
    if any(one.exists() for one in _names(path)):
        hint = "with a folder as record every log gets a name of its own"
        raise OutputError(expected(str(path), "", "a name that is free", "an existing file", hint))
    check_output(path, endings=(SUFFIX,))
    return TrainingWriter(path, trainer)


def _new_in(folder: Path, trainer: Trainer[Any, Any]) -> TrainingWriter:
    """Begin a log in a folder that others may begin logs in, too."""
    for number in itertools.count(1):
        path = folder / f"episodes-{number}{SUFFIX}"
        if any(one.exists() for one in _names(path)):
            continue
        try:
            writer = TrainingWriter(path, trainer)
        except OutputError:
            if any(one.exists() for one in _names(path)):
                continue
            raise
        if not path.exists():
            return writer
        writer.abort()
    raise AssertionError("numbers do not end")


def _names(path: Path) -> tuple[Path, Path]:
    """Return the names that a log has, one after the other."""
    return path.with_name(path.name + PARTIAL_SUFFIX), path


def _json(value: object) -> bytes:
    return (json.dumps(value, indent=1, sort_keys=True) + "\n").encode()
