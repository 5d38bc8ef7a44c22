"""Recordings of a reproduction, and the pictures of its report: maps of these recordings, and graphs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from fireworld_viewer.pictures.figure_files import png_bytes
from fireworld_viewer.pictures.maps import draw_record

from fireworld.policy.names import NamedPolicy
from fireworld.policy.teams.team import Team
from fireworld.recording.record import play
from fireworld.records import CityRecord, StepRecord
from fireworld.reproduction import paper
from fireworld.reproduction.convergence_figures import draw_policy_changes, draw_returns
from fireworld.reproduction.repetitions import Repetition
from fireworld.reproduction.study import ALONE, TOGETHER, Study
from fireworld.scenario import load_scenario
from fireworld.simulation.built import CityCache
from fireworld.simulation.prepared_run import prepare_run


@dataclass(frozen=True)
class RecordedRun:
    """A run that was recorded: what its maps need."""

    scenario: str
    team: str
    city: CityRecord
    first: StepRecord
    last: StepRecord


@dataclass(frozen=True, kw_only=True)
class RunToRecord:
    """A run to be recorded."""

    scenario: str
    team: str
    members: Team
    seed: int
    path: Path

    def __call__(self, cities: CityCache) -> RecordedRun:
        """Run and record.

        Raises:
            OutputError: the recording cannot be written.
        """
        policy = self.members.policy()
        named = NamedPolicy(name=self.team, digest=policy.digest, policy=policy)
        run = prepare_run(cities.build(load_scenario(self.scenario)), named, seed=self.seed)
        last = play(run, record=self.path, force=True).last
        return RecordedRun(self.scenario, self.team, run.city, next(iter(run)), last)


def runs_to_record(repetition: Repetition, *, seed: int, folder: Path) -> list[RunToRecord]:
    """Return one run of each row of the paper's tables.

    In Table 1 it is the cooperative team as it was at the end of the row's scenario; in Tables 2 and 3 it is both teams
    as they are after all of their training.
    """
    rows = [(row.scenario, TOGETHER, repetition.graduates[row.scenario]) for row in paper.TABLE_1]
    rows += [
        (row.scenario, team, repetition.teams[team])
        for row in (*paper.TABLE_2, *paper.TABLE_3)
        for team in (ALONE, TOGETHER)
    ]
    return [
        RunToRecord(scenario=name, team=team, members=members, seed=seed, path=folder / f"{name}-{team}.mcap")
        for name, team, members in rows
    ]


def pictures(study: Study, recorded: Sequence[RecordedRun]) -> dict[str, Callable[[], bytes]]:
    """Return what draws each picture of the report, as a PNG file, by its name."""
    drawn: dict[str, Callable[[], bytes]] = {
        "returns": lambda: png_bytes(draw_returns(study)),
        "policy-changes": lambda: png_bytes(draw_policy_changes(study)),
    }
    tests = {row.scenario for row in (*paper.TABLE_2, *paper.TABLE_3)}
    for run in recorded:
        if run.scenario not in tests:
            continue
        if run.team == ALONE:
            drawn[f"{run.scenario}-before"] = partial(_map, run, run.first, "before")
        drawn[f"{run.scenario}-{run.team}"] = partial(_map, run, run.last, f"{run.team}, step {run.last.step}")
    return drawn


def _map(run: RecordedRun, record: StepRecord, moment: str) -> bytes:
    title = f"{run.scenario}: {moment}, score {record.score.score:.2f} of {record.score.score_max:.0f}"
    return png_bytes(draw_record(run.city, record, title=title))
