"""Episodes of a training written as logs of runs: learned again, or what a learner did in them done again."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable
from pathlib import Path

from fireworld.arguments import path_of, whole_number
from fireworld.errors import OutputError, expected
from fireworld.files import check_output
from fireworld.records import Steps
from fireworld.training.log.episode_run import CheckedRun, episode_file, episode_run, write_run
from fireworld.training.log.played_run import PlayedRun
from fireworld.training.log.reader import AnyTraining, TrainingLog, opened
from fireworld.training.method import COUNT_MAX


def replay_episode(
    log: AnyTraining,
    scenario: str | int | None,
    episode: int,
    output: str | os.PathLike[str],
    *,
    world: int | None = None,
    force: bool = False,
) -> str:
    """Write an episode of a training as the log of a run, worked out by replay and compared with the training log.

    Args:
        log: the path of a training log, or one that is open; as far as it is good.
        scenario: of the episode: its name, or its position in the plan; None: any, where a learner played it.
        episode: its number in the scenario, from 0; -1 is the last. Of what a learner played, it counts the episodes
            that are recorded.
        output: the log to write.
        world: the world that a learner played it in; then the number is that in the world.
        force: replace an existing one.

    Returns:
        The digest of the run.

    Raises:
        LogError: there is no such episode, it cannot be replayed, or this fireworld computes another one.
        OutputError: the output cannot be written.
    """
    training = opened(log, partial=True)
    number = training.position(scenario, episode, world=world)
    return write_run(run_of(training, number), path_of("output", output), force=force)


def replay_every(
    log: AnyTraining,
    every: int,
    folder: str | os.PathLike[str],
    *,
    scenario: str | None = None,
    force: bool = False,
    on_written: Callable[[], object] = lambda: None,
) -> dict[Path, str]:
    """Write every so many episodes of a training as `replay_episode` does; those that cannot be replayed are left out.

    Args:
        log: the path of a training log, or one that is open.
        every: episodes of a scenario, from its first on.
        folder: the existing folder for them: SCENARIO-EPISODE.mcap.
        scenario: of this scenario alone, by its name.
        force: replace existing logs.
        on_written: called after each.

    Returns:
        The digests of the runs by their logs.

    Raises:
        LogError: there are no such episodes, or this fireworld computes another one.
        OutputError: one cannot be written; those before are there.
    """
    training = opened(log, partial=True)
    every, place = whole_number("every", every, least=1, most=COUNT_MAX), path_of("folder", folder)
    if not place.is_dir():
        raise OutputError(expected(str(place), "", "an existing folder", "none", "make it first"))
    any_scenario = None if training.is_played else 0  # fireworld's own trainings begin in the first
    training.position(any_scenario if scenario is None else scenario, -1)
    chosen = _every(training, every, scenario, place)
    for path in chosen.values():
        check_output(path, force=force)
    written = {}
    for number, path in chosen.items():
        written[path] = write_run(run_of(training, number), path, force=force)
        on_written()
    return written


def run_of(log: TrainingLog, number: int) -> Steps:
    """Return the episode that is a part as a run, which is compared with the log as it is iterated over.

    Raises:
        LogError: there is no such episode, or it cannot be replayed.
    """
    if log.is_played:
        return PlayedRun(log.played_at(number))
    found = log.episode_at(number)
    run = episode_run(log.learner(), found.record, found.tables, found.visits)
    return CheckedRun(run, found.record, str(log.path))


def _every(log: TrainingLog, every: int, scenario: str | None, folder: Path) -> dict[int, Path]:
    """Return the chosen parts, and the files to write them to."""
    names, seen, chosen = [one.name for one in log.scenarios], Counter[str](), {}
    for number, line in enumerate(log.lines):
        name = names[line.scenario]
        count = seen[name]
        seen[name] += 1
        if count % every == 0 and scenario in (None, name) and getattr(line, "replayable", True):
            chosen[number] = folder / episode_file(name, count)
    return chosen
