"""Recordings, maps and graphs of a reproduction, for `fireworld reproduce`."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from fireworld_recorder.writer import LogWriter
from fireworld_viewer.pictures.figure_files import png_bytes

from fireworld.policy.names import NamedPolicy
from fireworld.policy.teams.team import Team
from fireworld.recording.pages.record_map import draw_record
from fireworld.records import CityRecord, StepRecord
from fireworld.reproduction import paper
from fireworld.reproduction.convergence_figures import draw_policy_changes, draw_returns
from fireworld.reproduction.repetitions import Repetition
from fireworld.reproduction.study import ALONE, TOGETHER, Study
from fireworld.scenario import load_scenario
from fireworld.simulation.built import CityCache
from fireworld.simulation.run import prepare_run


@dataclass(frozen=True)
class Recorded:
    """A run that was recorded: what its maps need."""

    scenario: str
    team: str
    city: CityRecord
    first: StepRecord
    last: StepRecord


@dataclass(frozen=True, kw_only=True)
class ToRecord:
    """A run to be recorded."""

    scenario: str
    team: str
    members: Team
    seed: int
    path: Path

    def __call__(self, cities: CityCache) -> Recorded:
        """Run and record.

        Raises:
            OutputError: the recording cannot be written.
        """
        policy = self.members.policy()
        named = NamedPolicy(name=self.team, digest=policy.digest, policy=policy)
        run = prepare_run(cities.build(load_scenario(self.scenario)), named, seed=self.seed)
        records: list[StepRecord] = []
        with LogWriter(self.path, run.header, run.city, force=True) as log:
            for record in run:
                log.write(record)
                records = [*records[:1], record]
        return Recorded(self.scenario, self.team, run.city, records[0], records[-1])


def runs_to_record(repetition: Repetition, *, seed: int, folder: Path) -> list[ToRecord]:
    """List one run of each row.

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
        ToRecord(scenario=name, team=team, members=members, seed=seed, path=folder / f"{name}-{team}.mcap")
        for name, team, members in rows
    ]


def draw_all(study: Study, recorded: list[Recorded]) -> Iterator[tuple[str, bytes]]:
    """Draw every image of the report: its name and its PNG file.

    Raises:
        ViewError: matplotlib is not installed.
    """
    yield "returns", png_bytes(draw_returns(study))
    yield "policy-changes", png_bytes(draw_policy_changes(study))
    tests = {row.scenario for row in (*paper.TABLE_2, *paper.TABLE_3)}
    for run in recorded:
        if run.scenario not in tests:
            continue
        if run.team == ALONE:
            yield f"{run.scenario}-before", _map(run, run.first, "before")
        yield f"{run.scenario}-{run.team}", _map(run, run.last, f"{run.team}, step {run.last.step}")


def _map(run: Recorded, record: StepRecord, moment: str) -> bytes:
    title = f"{run.scenario}: {moment}, score {record.score.score:.2f} of {record.score.score_max:.0f}"
    return draw_record(run.city, record, title=title)
