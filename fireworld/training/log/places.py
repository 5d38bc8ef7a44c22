"""Where in a training log an episode is."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fireworld.errors import LogError, expected

if TYPE_CHECKING:
    from fireworld.training.log.reader import TrainingLog


def position_of(log: TrainingLog, scenario: str | int | None, episode: int, world: int | None) -> int:
    """Return the number of the part that an episode is; arguments and errors as for `TrainingLog.position`."""
    if not log.is_played:
        log.learner()  # or else there are no episodes
        if scenario is None or world is not None:
            got = "none" if scenario is None else f"world {world}"
            raise LogError(expected(str(log.path), "scenario", "the scenario of the episode, and no world", got))
    found = _of_scenario(log, scenario)
    if world is not None:
        found = [k for k in found if log.lines[k].world == world]
        if not found:
            raise LogError(expected(str(log.path), "world", f"a world that has episodes{_in(log, scenario)}", world))
    by_count = log.is_played and world is None
    numbers = [*range(len(found))] if by_count else [log.lines[k].episode for k in found]
    number = numbers[-1] if episode == -1 else episode
    if number not in numbers:
        held = f"one from {numbers[0]} to {numbers[-1]}{_in(log, scenario)}"
        raise LogError(expected(str(log.path), "episode", held, episode))
    return found[numbers.index(number)]


def _of_scenario(log: TrainingLog, scenario: str | int | None) -> list[int]:
    """Return the parts that are episodes of a scenario, or of any."""
    names = [one.name for one in log.scenarios]
    if isinstance(scenario, str) and scenario not in names:
        raise LogError(expected(str(log.path), "scenario", f"one of {', '.join(names)}", scenario))
    wanted = [k for k, name in enumerate(names) if scenario in (None, k, name)]
    if not log.is_played:
        wanted = wanted[:1]
    found = [k for k, line in enumerate(log.lines) if line.scenario in wanted]
    if not found:
        raise LogError(expected(str(log.path), "scenario", "one that has begun", scenario))
    return found


def _in(log: TrainingLog, scenario: str | int | None) -> str:
    if scenario is None:
        return ""
    return f" of {scenario if isinstance(scenario, str) else log.scenarios[scenario].name}"
