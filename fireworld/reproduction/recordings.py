"""Recordings of a reproduction, and the pictures of its report: maps of these recordings, and graphs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from fireworld_viewer.pictures.curves import LearningPanel, draw_learning_curves
from fireworld_viewer.pictures.figure_files import png_bytes
from fireworld_viewer.pictures.maps import draw_record

from fireworld.kernels.arrays import Array
from fireworld.policy.names import NamedPolicy
from fireworld.policy.teams.team import Team
from fireworld.recording.record import play
from fireworld.records import CityRecord, StepRecord
from fireworld.reproduction.paper import World
from fireworld.reproduction.repetitions import Repetition
from fireworld.reproduction.study import ALONE, TOGETHER, TOGETHER_WITHOUT_FLAGS, LearningCurve, Study
from fireworld.scenario import load_scenario
from fireworld.simulation.built import CityCache
from fireworld.simulation.prepared_run import prepare_run

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class RecordedRun:
    """A run that was recorded: what its maps need."""

    scenario: str
    team: str
    city: CityRecord
    first: StepRecord
    last: StepRecord


def runs_to_record(repetition: Repetition, world: World) -> list[tuple[str, str, Team]]:
    """Return scenario, team and its members for one run of each row of the paper's tables.

    In Table 1 it is the cooperative team as it was at the end of the row's scenario; in Tables 2 and 3 it is both teams
    as they are after all of their training.
    """
    tests = [row.scenario for row in world.tests]
    return [
        *((row.scenario, TOGETHER, repetition.graduates[row.scenario]) for row in world.table_1),
        *((test, team, repetition.teams[team]) for test in tests for team in (ALONE, TOGETHER)),
    ]


def record_run(scenario: str, team: str, members: Team, *, seed: int, folder: Path, cities: CityCache) -> RecordedRun:
    """Run and record; errors as for `play`."""
    policy = members.policy()
    named = NamedPolicy(name=team, digest=policy.digest, policy=policy)
    run = prepare_run(cities.build(load_scenario(scenario)), named, seed=seed)
    last = play(run, record=folder / f"{scenario}-{team}.mcap", force=True).last
    return RecordedRun(scenario, team, run.city, next(iter(run)), last)


def pictures(study: Study, recorded: Sequence[RecordedRun]) -> dict[str, Callable[[], bytes]]:
    """Return what draws each picture of the report, as a PNG file, by its name."""
    drawn: dict[str, Callable[[], bytes]] = {
        "returns": lambda: png_bytes(draw_returns(study)),
        "policy-changes": lambda: png_bytes(draw_policy_changes(study)),
    }
    tests = {row.scenario for row in study.world.tests}
    for run in recorded:
        if run.scenario not in tests:
            continue
        if run.team == ALONE:
            drawn[f"{run.scenario}-before"] = partial(_map, run, run.first, "before")
        drawn[f"{run.scenario}-{run.team}"] = partial(_map, run, run.last, f"{run.team}, step {run.last.step}")
    return drawn


def draw_returns(study: Study) -> Figure:
    """Draw the return of every episode of Table 1's scenarios."""
    return _draw_curves(study, "return of the episode, in thousands", lambda curve: curve.total_reward / 1000.0)


def draw_policy_changes(study: Study) -> Figure:
    """Draw in how many states the greedy action changed, episode by episode of Table 1's scenarios."""
    return _draw_curves(study, "states whose best action changed", lambda curve: curve.n_changed)


def _draw_curves(study: Study, label: str, of: Callable[[LearningCurve], Array]) -> Figure:
    mark = "paper converged"
    panels = [
        LearningPanel(
            title=row.scenario,
            curves={
                team: [of(curve) for curve in study.curves_of(team, row.scenario)]
                for team in (TOGETHER, TOGETHER_WITHOUT_FLAGS)
            },
            marks={mark: row.convergence_episode},
        )
        for row in study.world.table_1
    ]
    return draw_learning_curves(panels, label=label, mark=mark)


def _map(run: RecordedRun, record: StepRecord, moment: str) -> bytes:
    title = f"{run.scenario}: {moment}, score {record.score.score:.2f} of {record.score.score_max:.0f}"
    return png_bytes(draw_record(run.city, record, title=title))
