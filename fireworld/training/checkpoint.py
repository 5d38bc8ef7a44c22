"""Checkpoint: a training that was stopped between two episodes, to go on from bit for bit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final, Protocol

import numpy as np

from fireworld.errors import OutputError, TrainingError, expected
from fireworld.kernels.arrays import Array
from fireworld.policy.team import Team, read_team, save_team
from fireworld.training.trainer import Progress, Trainer

SUFFIX: Final = ".checkpoint"
HINT: Final = "name what it was begun with, or begin again with --force"


def checkpoint_path(path: Path) -> Path:
    """Name the checkpoint of the team file that a training is to make."""
    return path.with_name(path.name + SUFFIX)


def check_no_checkpoint(path: Path, *, force: bool) -> None:
    """Refuse to begin a training anew where an unfinished one is kept.

    Raises:
        OutputError: one is, and shall not be replaced.
    """
    if path.exists() and not force:
        hint = "go on from it with --resume, or begin again with --force"
        raise OutputError(expected(str(path), "", "no checkpoint", "one of an earlier training", hint))


class Resumable(Protocol):
    """A training with files: what a command begins, or goes on with."""

    @property
    def checkpoint(self) -> Path:
        """Where it is kept while unfinished."""
        ...

    def begin(self) -> None:
        """See that nothing is in the way."""
        ...

    def resume(self) -> bool:
        """Go on where an earlier call stopped; tell whether there was something to go on from."""
        ...


def begin_all(trainings: Sequence[Resumable], *, resume: bool) -> None:
    """See that nothing is in the way, or find what there is to go on from.

    Raises:
        TrainingError: there is nothing to go on from, or a file of another training.
        OutputError: a file is in the way.
    """
    if not resume:
        for training in trainings:
            training.begin()
        return
    found = [training.resume() for training in trainings]  # all of them, each to be looked at
    if not any(found):
        got = f"no {trainings[0].checkpoint}"
        raise TrainingError(expected("--resume", "", "a checkpoint to go on from", got, "leave out --resume"))


def save_checkpoint(trainer: Trainer, path: Path, *, log: bytes = b"") -> None:
    """Write where a training stands: a team file with a place in the curriculum and the log so far.

    Raises:
        OutputError: it cannot be written.
    """
    progress = trainer.progress
    place = np.array([progress.scenario_number, progress.episode, progress.n_unchanged], dtype=np.int64)
    extra: dict[str, Array] = {"place": place, "log": np.frombuffer(log, dtype=np.uint8)}
    save_team(trainer.team(), path, force=True, extra=extra)


def restore_checkpoint(trainer: Trainer, path: Path) -> bytes:
    """Let a trainer go on where a checkpoint stands; return the log so far.

    Raises:
        TrainingError: not a checkpoint, or one of another curriculum, method, seed or version.
    """
    team, extra = read_team(path)
    check_identity(team, trainer, path)
    place, log = extra.get("place"), extra.get("log")
    if place is None or log is None or place.shape != (3,) or place.dtype != np.int64 or log.dtype != np.uint8:
        raise TrainingError(expected(str(path), "", "a checkpoint", "a team file without a place in its training"))
    trainer.progress = _progress(trainer, team, place, path)
    return log.tobytes()


def check_identity(team: Team, trainer: Trainer, path: Path) -> None:
    """Refuse a team that another training made than the one that is asked for.

    Raises:
        TrainingError: it differs in curriculum, method, seed or version.
    """
    provenance = dict(team.provenance)
    found = provenance.get("curriculum")
    if isinstance(found, dict):
        provenance["curriculum"] = {key: found.get(key) for key in ("name", "digest")}
    check_same(provenance, trainer.identity, path)


def check_same(found: Mapping[str, Any], identity: Mapping[str, Any], path: Path) -> None:
    """Refuse to go on from work that was begun with something else; name the first key that differs.

    Args:
        found: what the work was begun with, as plain values; keys that are not of the identity are of no account.
        identity: what is asked for.
        path: where it was found.

    Raises:
        TrainingError: they differ.
    """
    for key, wanted in identity.items():
        got = found.get(key)
        if got == wanted:
            continue
        if isinstance(got, dict) and isinstance(wanted, dict):
            part = next(name for name in [*wanted, *got] if got.get(name) != wanted.get(name))
            key, wanted, got = f"{key}.{part}", wanted.get(part), got.get(part)  # noqa: PLW2901 - the part at fault
        raise TrainingError(expected(str(path), key, str(wanted), got, HINT))


def _progress(trainer: Trainer, team: Team, place: Array, path: Path) -> Progress:
    """Return the progress that a checkpoint tells of."""
    number, episode, n_unchanged = (int(value) for value in place)
    n_scenarios = trainer.curriculum.n_scenarios
    in_curriculum = 0 <= number < n_scenarios or (number, episode) == (n_scenarios, 0)
    if not (in_curriculum and 0 <= n_unchanged <= episode < trainer.method.n_episodes_max):
        wanted = "[scenario, episode, episodes without a change] within the curriculum"
        raise TrainingError(expected(str(path), "place", wanted, str(place.tolist())))
    if team.tables.shape != trainer.shape(number):
        raise TrainingError(expected(str(path), "tables", f"shape {trainer.shape(number)}", str(team.tables.shape)))
    return Progress(
        scenario_number=number, episode=episode, n_unchanged=n_unchanged, tables=team.tables, visits=team.visits
    )
