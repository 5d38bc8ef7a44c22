"""The front door to training: `train` makes one team, `prepare_trainings` several with their files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

from fireworld.arguments import SEED_MAX, path_of, seed_of, settings_of, whole_number
from fireworld.errors import OutputError, TrainingError, expected
from fireworld.interrupt import Interrupted
from fireworld.policy.teams.team import Team
from fireworld.scenario import Scenario
from fireworld.simulation.built import CityCache
from fireworld.training.curriculum import Curriculum, find_curriculum
from fireworld.training.hooks.hook import Hook
from fireworld.training.log.episode_run import FullEpisodes
from fireworld.training.method import COUNT_MAX, Method
from fireworld.training.methods import find_method
from fireworld.training.training import Callback, Training, train_all

REPETITIONS_MAX: Final = 10_000
JOBS_MAX: Final = 1000
TRAINING_FILE: Final = "training.mcap"


def train(
    curriculum: str | Path | Curriculum | Scenario | None = None,
    *,
    method: str | Method = "paper",
    seed: int = 1,
    set: Mapping[str, object] | None = None,
    stages: str | Sequence[str] | None = None,
    output: str | Path | None = None,
    record: str | Path | None = None,
    full_every: int | None = None,
    log: str | Path | None = None,
    resume: bool = False,
    force: bool = False,
    callbacks: Sequence[Callback] = (),
    jobs: int | None = None,
) -> Team:
    """Train a team.

    The same curriculum, method and seed give the same team, and the same bytes of its file.

    Args:
        curriculum: a name, a YAML file or a `Curriculum`; or a scenario by name, file or object, which is a curriculum
            of that scenario alone (with cooperation if it has more than one brigade). None: the method's own.
        method: a name, as in "paper" or "search", or a `Method` with its hyperparameters.
        seed: of all random draws of the training, 0 to 2**32 - 1.
        set: hyperparameters of the method by name, as in {"alpha": 0.1}.
        stages: the curriculum's stages to train in, by name: a list, or text as in "alone,together". None: all.
        output: the team file to write. While the training is unfinished, a checkpoint stands beside it.
        record: the training log to write, with every step that is learned from; it is the checkpoint too. With
            `full_every` an existing folder.
        full_every: write every so many episodes of each scenario as the log of a run, with everything about every
            step, into the folder `record`, as train-3-0040.mcap; the training log is training.mcap there.
        log: a CSV file to write, with a line for every report.
        resume: continue from the checkpoint of `output`; or, if its training is done, return that team.
        force: replace existing files, checkpoints too.
        callbacks: each is called as `callback(training, report)` after every report, in this thread. `training` is a
            `Training` (`seed`, `n_reports`, `trainer.share_done`, `trainer.team()`); `report` is of the method, such
            as `EpisodeReport` or `Generation`: its `as_dict()` is a line of the log, its `text` is for people. A
            callback that raises `StopTraining` stops the training: `train` returns the team as it is, and leaves a
            checkpoint instead of the output. A `Hook` of `fireworld.training.hooks` keeps curves in another tool; if it
            fails while the training is under way, a warning says so, and the training continues.
        jobs: fights at a time, where the method has many at once; None: as many as there are cores.

    Returns:
        The trained team.

    Raises:
        TrainingError: no such curriculum, method, hyperparameter or stage, or a checkpoint of another training.
        ScenarioError: a scenario that makes no sense.
        OutputError: a file is in the way, or cannot be written.
        Interrupted: Ctrl-C; the part under way has been finished, and a checkpoint stands beside the output.
        ArgumentError: another kind of value than an argument may have.
    """
    jobs = None if jobs is None else whole_number("jobs", jobs, least=1, most=JOBS_MAX)
    if not isinstance(callbacks, Sequence) or not all(map(callable, callbacks)):
        raise TrainingError(expected("callbacks", "", "a list of functions of (training, report)", callbacks))
    (training,) = prepare_trainings(
        curriculum,
        method=method,
        seed=seed,
        set=set,
        stages=stages,
        output=output,
        record=record,
        full_every=full_every,
        log=log,
        resume=resume,
        force=force,
    )
    training.attach([one for one in callbacks if isinstance(one, Hook)])
    train_all([training], jobs=jobs, callbacks=[one for one in callbacks if not isinstance(one, Hook)])
    if training.team is None and not training.stopped:
        raise Interrupted(training.interruption)
    return training.team if training.team is not None else training.trainer.team()


def prepare_trainings(
    curriculum: str | Path | Curriculum | Scenario | None = None,
    *,
    repetitions: int = 1,
    method: str | Method = "paper",
    seed: int = 1,
    set: Mapping[str, object] | None = None,
    stages: str | Sequence[str] | None = None,
    output: str | Path | None = None,
    record: str | Path | None = None,
    full_every: int | None = None,
    log: str | Path | None = None,
    resume: bool = False,
    force: bool = False,
) -> list[Training]:
    """Check everything, and return trainings for `train_all`; arguments and errors are those of `train`.

    There are as many as `repetitions`, with the seeds that follow `seed`; several have numbered files, TEAM-1.npz and
    so on.
    """
    repetitions = whole_number("repetitions", repetitions, least=1, most=REPETITIONS_MAX)
    seed = seed_of(seed)
    if seed + repetitions - 1 > SEED_MAX:
        got = f"up to {seed + repetitions - 1}"
        raise TrainingError(expected("--repetitions", "", f"seeds up to {SEED_MAX}", got))
    if resume and force:
        raise TrainingError("--force and --resume exclude each other")
    if resume and output is None and record is None:
        raise TrainingError(expected("--resume", "", "an output or a record to continue from", "none"))
    folder = None if full_every is None else _full_folder(record)
    way = find_method(method) if isinstance(method, str) else method
    if not isinstance(way, Method):
        raise TrainingError(expected("--method", "", "a name or a Method", type(way).__name__))
    way = way.with_settings(settings_of(set))
    chosen = find_curriculum(way.curriculum if curriculum is None else curriculum)
    if stages is not None:
        chosen = chosen.only([name.strip() for name in stages.split(",")] if isinstance(stages, str) else stages)
    cities = CityCache()
    trainings = [
        Training(
            trainer=way.trainer(chosen, seed=seed + number - 1, cities=cities),
            path=numbered("output", output, number, repetitions),
            record=numbered("record", record if folder is None else folder / TRAINING_FILE, number, repetitions),
            full=_full_episodes(folder, full_every, number, repetitions, force=force),
            log_path=numbered("log", log, number, repetitions),
            force=force,
        )
        for number in range(1, repetitions + 1)
    ]
    if not resume:
        for training in trainings:
            training.begin()
        return trainings
    found = [training.resume() for training in trainings]  # all of them, each to be looked at
    if not any(found):
        got = f"no {trainings[0].checkpoint}"
        raise TrainingError(expected("--resume", "", "a checkpoint to continue from", got, "leave out --resume"))
    return trainings


def _full_folder(record: str | Path | None) -> Path:
    """Return the folder that whole episodes are written to."""
    folder = None if record is None else path_of("record", record)
    if folder is None or not folder.is_dir():
        got = "none" if folder is None else f"{folder}, which is none"
        raise OutputError(expected("--full-every", "", "an existing folder as --record", got, "make it first"))
    return folder


def _full_episodes(
    folder: Path | None, every: int | None, number: int, repetitions: int, *, force: bool
) -> FullEpisodes | None:
    """Return what writes whole episodes of one of several trainings; each has a folder, which is made."""
    if folder is None:
        return None
    every = whole_number("full_every", every, least=1, most=COUNT_MAX)
    if repetitions == 1:
        return FullEpisodes(folder, every, force)
    own = folder / f"episodes-{number}"
    try:
        own.mkdir(exist_ok=True)
    except OSError as error:
        raise OutputError(f"{own}: cannot be made: {error.strerror}") from None
    return FullEpisodes(own, every, force)


def numbered(name: str, path: str | Path | None, number: int, repetitions: int) -> Path | None:
    """Return the file of one of several trainings: TEAM-3.npz; TEAM.npz if it is the only one."""
    if path is None:
        return None
    whole = path_of(name, path)
    return whole if repetitions == 1 else whole.with_name(f"{whole.stem}-{number}{whole.suffix}")
