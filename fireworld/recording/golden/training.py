"""Golden trainings: what a golden training log holds about how to train again, and its text."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import msgspec

from fireworld.errors import LogError, expected
from fireworld.executors import threads
from fireworld.files import name_from
from fireworld.recording.golden.spec import SPEC_ATTACHMENT, encode_spec, hash_line, path_to, setting_texts
from fireworld.scenario import scenario_names
from fireworld.shown import block_text, text_table
from fireworld.simulation.built import CityCache
from fireworld.training.curriculum import curriculum_names, find_curriculum
from fireworld.training.log.difference import TrainingDifference
from fireworld.training.log.environment import ANOTHERS
from fireworld.training.log.reader import TrainingLog
from fireworld.training.log.records import TrainingHeader
from fireworld.training.log.verify import TrainedAgain
from fireworld.training.log.writer import TrainingWriter, header_of
from fireworld.training.methods import find_method
from fireworld.version import __version__, simulator_digest


class TrainingSpec(msgspec.Struct, frozen=True, kw_only=True):
    """What to train, by names that are looked up anew each time."""

    curriculum: str
    """The name of a shipped curriculum or scenario; the path of a file, from the folder of the golden; empty: the
    curriculum as recorded."""
    method: str = "paper"
    seed: Annotated[int, msgspec.Meta(ge=0, le=2**32 - 1)] = 1
    stages: tuple[str, ...] | None = None
    """Of the curriculum; None: all."""
    settings: dict[str, str] = {}
    """Hyperparameters of the method, as `--set` takes them."""
    test: str = ""
    """As of the spec of a run."""


def make_training_spec(
    folder: Path,
    *,
    curriculum: str | Path,
    method: str = "paper",
    seed: int = 1,
    stages: str | Sequence[str] | None = None,
    settings: Mapping[str, Any] | None = None,
    test: Path | None = None,
) -> TrainingSpec:
    """Return the spec of a golden training in `folder`; it names files by their paths from there.

    Args:
        folder: where the golden is going to be.
        curriculum: the name of a shipped curriculum or scenario, or a file of either as seen from the current folder.
        method: a name.
        seed: of all random draws.
        stages: of the curriculum, by name: a list, or text as in "alone,together". None: all.
        settings: hyperparameters by name.
        test: the file of the test that makes it.

    Raises:
        TrainingError, ScenarioError: no such curriculum or scenario.
    """
    shipped = str(curriculum) in {*curriculum_names(), *scenario_names()}
    if not shipped:
        find_curriculum(curriculum)  # the error names the path as given, not as seen from the folder
    names = [name.strip() for name in stages.split(",")] if isinstance(stages, str) else stages
    return TrainingSpec(
        curriculum=str(curriculum) if shipped else name_from(Path(curriculum), folder),
        method=method,
        seed=seed,
        stages=None if names is None else tuple(names),
        settings=setting_texts(settings),
        test="" if test is None else name_from(test, folder),
    )


def training_spec_of(header: TrainingHeader) -> TrainingSpec:
    """Return the spec that a golden was made by; for any other training log, one that trains as recorded.

    Raises:
        LogError: the attached spec is not one.
    """
    content = header.attachments.get(SPEC_ATTACHMENT)
    if content is None:
        return TrainingSpec(curriculum="", method=header.method, seed=header.seed)
    try:
        return msgspec.json.decode(content, type=TrainingSpec)
    except msgspec.DecodeError as error:
        raise LogError(f"{SPEC_ATTACHMENT}: {error}; the golden was not made by `fireworld golden`") from None


def prepare_training(
    spec: TrainingSpec, folder: Path, *, recorded: TrainingLog | None = None, cities: CityCache | None = None
) -> TrainedAgain:
    """Prepare the training of a spec, with everything as it is now; nothing is trained yet.

    Args:
        spec: what to train.
        folder: where its golden is, or is going to be.
        recorded: the golden; needed to train as recorded.
        cities: cities built before, used and added to.

    Raises:
        TrainingError, ScenarioError, CityError, LogError: what the spec names cannot be found or loaded.
    """
    workers = threads(None)
    if not spec.curriculum:
        if recorded is None:
            raise LogError(expected(SPEC_ATTACHMENT, "curriculum", "a name or a file", "none"))
        if recorded.is_played:
            hint = f"`fireworld verify {recorded.path}` plays it again"
            raise LogError(expected(str(recorded.path), "method", ANOTHERS, recorded.method.name, hint))
        header = replace(recorded.header, fireworld_version=__version__, simulator_digest=simulator_digest())
        return TrainedAgain(recorded.trainer, header, workers, n_parts=None if recorded.done else len(recorded))
    shipped = spec.curriculum in {*curriculum_names(), *scenario_names()}
    curriculum = find_curriculum(spec.curriculum if shipped else path_to(folder, spec.curriculum))
    if spec.stages is not None:
        curriculum = curriculum.only(spec.stages)
    method = find_method(spec.method).with_settings(spec.settings)
    make = partial(method.trainer, curriculum, seed=spec.seed, cities=cities or CityCache())
    header = header_of(make())
    attachments = {**header.attachments, SPEC_ATTACHMENT: encode_spec(spec)}
    return TrainedAgain(make, replace(header, attachments=attachments), workers)


def store_training(path: Path, fresh: TrainedAgain, *, free: bool, scratch_suffix: str) -> None:
    """Train, and write the training log; an error or Ctrl-C leaves nothing (OutputError).

    Args:
        path: of the log.
        fresh: what is trained.
        free: there must be no log of that name; else one is replaced.
        scratch_suffix: what its name ends in until it is complete.
    """
    trainer = fresh.trainer()
    trainer.detailed = True
    writer = TrainingWriter(path, trainer, header=fresh.header, force=not free, scratch_suffix=scratch_suffix)
    with writer:
        for _ in fresh.run(trainer):
            writer.write()
        writer.close()


def training_text(log: TrainingLog) -> str:
    """Return a training as text: what was trained, how every part of it went, and the hashes of team and training."""
    return "\n\n".join("\n".join(block) for block in (_facts(log), [*_parts(log)], _hashes(log))) + "\n"


def _facts(log: TrainingLog) -> list[str]:
    spec = training_spec_of(log.header)
    facts = {
        "curriculum": log.header.curriculum + ("" if spec.stages is None else f", stages {', '.join(spec.stages)}"),
        "scenarios": str(len(log.scenarios)),
        "method": log.method.name,
        **{f"  {key}": json.dumps(value) for key, value in log.method.as_dict().items()},
        "seed": str(log.header.seed),
        f"{log.header.unit}s": f"{len(log)}, {'to the end' if log.done else 'not to the end'}",
    }
    width = max(map(len, facts))
    return [f"{label:<{width}} {text}" for label, text in facts.items()]


def _parts(log: TrainingLog) -> Iterator[str]:
    """Yield a table with a line for every report."""
    rows = [report.as_dict() for _, report in log.reports()]
    if rows:
        align = "".join("<" if isinstance(value, str) else ">" for value in rows[0].values())
        yield text_table([*rows[0]], ([_cell(value) for value in row.values()] for row in rows), align)


def _cell(value: object) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _hashes(log: TrainingLog) -> list[str]:
    return [f"team {log.team().digest}", hash_line(log.digest)]


def training_changes(difference: TrainingDifference) -> Iterator[str]:
    """Yield what else is different: in the tables, and scenario by scenario."""
    for block in difference.spread_blocks():
        yield from block_text(block).split("\n")
