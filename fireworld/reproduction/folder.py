"""The folder of a reproduction: a file for each part of the work once it is done, for a later call to find."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, TypeVar

import msgspec
import numpy as np
from msgspec import Struct

from fireworld.errors import OutputError, TrainingError, expected
from fireworld.evaluation.runs import Outcomes
from fireworld.files import read_input, write_file
from fireworld.kernels.arrays import Array
from fireworld.outcome import COLUMNS
from fireworld.policy.teams.table_team import TableTeam
from fireworld.policy.teams.team import load_team
from fireworld.reproduction.csv_files import CSV_FILES
from fireworld.reproduction.repetitions import Repetition
from fireworld.reproduction.study import TEAMS, TOGETHER, LearningCurve, Tested
from fireworld.reproduction.trainings import RepetitionLogs
from fireworld.training.training import check_same

FORMAT: Final = "fireworld-reproduction/1"
REPORT: Final = "report.html"
SETTINGS: Final = "kept/settings.json"  # what the work in a folder was begun with
TRAININGS: Final = "trainings"
SUBFOLDERS: Final = ("kept", "teams", "recordings", "figures")
_HINT: Final = "delete it and it is made anew"

Content = TypeVar("Content")


class RepetitionText(Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    """A Repetition as plain values; its teams are in files of their own."""

    teams: dict[str, str]  # digests by name
    graduates: dict[str, str]  # digests by scenario
    lessons: list[LearningCurve] = []  # empty where the training logs have them
    logs: dict[str, str] = {}  # digests of the training logs by team


@dataclass(frozen=True)
class ReproductionFolder:
    """The folder of a reproduction."""

    path: Path

    def make(self, *, force: bool) -> None:
        """Make the folder; delete what an earlier reproduction left in it (`force`), or raise OutputError."""
        path = self.path
        try:
            if not force and path.exists() and (not path.is_dir() or any(path.iterdir())):
                begun = "--resume continues it, " if (path / SETTINGS).is_file() else ""
                hint = f"{begun}--force replaces what is there"
                raise OutputError(expected(str(path), "", "a free name or an empty folder", "what is there", hint))
            path.mkdir(exist_ok=True)
            self._make_subfolders()
            (path / SETTINGS).unlink(missing_ok=True)  # the first to go: nothing can continue from half of the files
            for product in self._products():
                product.unlink(missing_ok=True)
        except OSError as error:
            raise OutputError(f"{path}: cannot be made: {error.strerror or error}") from None

    def find(self) -> None:
        """Check that there is a reproduction to continue; OutputError if there is none."""
        if not (self.path / SETTINGS).is_file():
            got = f"no {self.path / SETTINGS}"
            raise OutputError(expected("resume", "", "a reproduction to continue", got, "leave out --resume"))
        try:
            self._make_subfolders()
        except OSError as error:
            raise OutputError(f"{self.path}: cannot be made: {error.strerror or error}") from None

    def write(self, name: str, content: bytes | str) -> None:
        """Write a file of the folder; errors as for `write_file`."""
        write_file(self.path / name, content)

    def repetition(self, number: int) -> Repetition | None:
        """Return a repetition that was trained before, or None; TrainingError if a file is damaged, or gone."""
        path = self._training(number)
        found = self._read(path, RepetitionText)
        if found is None:
            return None
        logs, curves = found.logs, tuple(found.lessons)
        if logs:
            logs, curves = self.logs(number).read(logs, source=path)
        return Repetition(
            teams={name: _read_team(self._team(name, number), digest, path) for name, digest in found.teams.items()},
            graduates={
                scenario: _read_team(self._graduate(scenario, number), digest, path)
                for scenario, digest in found.graduates.items()
            },
            curves=curves,
            logs=logs,
        )

    def write_repetition(self, number: int, repetition: Repetition) -> None:
        """Write the teams of a repetition, and then how they learned: with that it counts as done."""
        for name, team in repetition.teams.items():
            team.save(self._team(name, number), force=True)
        for scenario, team in repetition.graduates.items():
            team.save(self._graduate(scenario, number), force=True)
        teams, graduates = (
            {name: team.digest for name, team in saved.items()} for saved in (repetition.teams, repetition.graduates)
        )
        lessons = [] if repetition.logs else [*repetition.curves]
        self._write(self._training(number), RepetitionText(teams, graduates, lessons, dict(repetition.logs)))

    def logs(self, number: int) -> RepetitionLogs:
        """Return the training logs of a repetition, which may not be there."""
        return RepetitionLogs(self.path / TRAININGS, number)

    def make_trainings(self) -> None:
        """Make the folder of the training logs, if it is not there (OutputError)."""
        try:
            (self.path / TRAININGS).mkdir(exist_ok=True)
        except OSError as error:
            raise OutputError(f"{self.path / TRAININGS}: cannot be made: {error.strerror or error}") from None

    def n_trained(self, n_repetitions: int) -> int:
        """Return how many repetitions are trained."""
        return sum(self._training(number).is_file() for number in range(1, n_repetitions + 1))

    def tested(
        self, name: str, *, scenarios: Iterable[str], teams: Iterable[str], seeds: Sequence[int]
    ) -> Tested | None:
        """Return the outcomes of a repetition's tests, or of the "rules"; None if there are none.

        TrainingError if the file is damaged, or of other scenarios, teams or seeds.
        """
        path = self._tests(name)
        found = self._read(path, dict[str, dict[str, dict[str, list[bool | int | float]]]])
        if found is None:
            return None
        wanted = {(scenario, team) for scenario in scenarios for team in teams}
        if {(scenario, team) for scenario, tested in found.items() for team in tested} != wanted:
            raise TrainingError(expected(str(path), "", "the tests of this reproduction", "others", _HINT))
        return {
            scenario: {team: _outcomes(columns, seeds, path) for team, columns in teams.items()}
            for scenario, teams in found.items()
        }

    def write_tested(self, name: str, tested: Tested) -> None:
        """Write the outcomes of a repetition's tests, or of the "rules"; errors as for `write_file`."""
        content = {
            scenario: {
                team: dict(zip(COLUMNS, map(list, zip(*found.rows, strict=True)), strict=True))
                for team, found in teams.items()
            }
            for scenario, teams in tested.items()
        }
        self._write(self._tests(name), content)

    def write_settings(self, identity: Mapping[str, Any]) -> None:
        """Write what the work is begun with; errors as for `write_file`."""
        self._write(self.path / SETTINGS, {"format": FORMAT, **identity})

    @property
    def tests(self) -> set[str]:
        """Names of the tests that the work was begun with, none if it was not; TrainingError if they cannot be read."""
        found = self._read(self.path / SETTINGS, dict[str, Any]) or {}
        tests = found.get("tests")
        return set(tests) if isinstance(tests, dict) else set()

    def check_settings(self, identity: Mapping[str, Any]) -> None:
        """Check that the work was begun with the same settings; TrainingError if not, or if their file is damaged."""
        path = self.path / SETTINGS
        found = self._read(path, dict[str, Any]) or {}
        check_same({"record_trainings": False, **found}, {"format": FORMAT, **identity}, path)

    def _training(self, number: int) -> Path:
        return self.path / "kept" / f"training-{number}.json"

    def _tests(self, name: str) -> Path:
        return self.path / "kept" / f"tests-{name}.json"

    def _team(self, name: str, number: int) -> Path:
        return self.path / "teams" / f"{name}-{number}.npz"

    def _graduate(self, scenario: str, number: int) -> Path:
        return self.path / "teams" / f"{TOGETHER}-{number}-after-{scenario}.npz"

    def _make_subfolders(self) -> None:
        for name in SUBFOLDERS:
            (self.path / name).mkdir(exist_ok=True)

    def _products(self) -> list[Path]:
        """List what an earlier reproduction may have left, and nothing else."""
        path = self.path
        scattered = [found for name in ("training", "tests") for found in path.glob(f"kept/{name}-*.json*")]
        scattered += [found for team in TEAMS for found in path.glob(f"teams/{team}-*.npz*")]
        scattered += [found for team in TEAMS for found in path.glob(f"{TRAININGS}/{team}-*.mcap*")]
        scattered += [found for team in TEAMS for found in path.glob(f"recordings/*-{team}.mcap*")]
        return [*scattered, *path.glob("figures/*.png"), *(path / name for name in (*CSV_FILES, REPORT))]

    def _read(self, path: Path, kind: type[Content]) -> Content | None:
        try:
            if not path.exists():
                return None
            content = read_input(
                path, what="what an earlier call has written", n_bytes_max=1 << 28, error=TrainingError
            )
            return msgspec.json.decode(content, type=kind, dec_hook=_array)
        except (OSError, msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
            got = f"{type(error).__name__}: {error}"
            raise TrainingError(expected(str(path), "", "what an earlier call has written", got, _HINT)) from None

    def _write(self, path: Path, content: object) -> None:
        write_file(path, msgspec.json.encode(content, enc_hook=np.ndarray.tolist))


def _read_team(path: Path, digest: str, training: Path) -> TableTeam:
    """Read a team, and check that it is the one that was written."""
    team = load_team(path)
    if not isinstance(team, TableTeam) or team.digest != digest:
        hint = f"delete {training} and it is trained anew"
        raise TrainingError(expected(str(path), "", f"the team {digest[:12]} that was written", team.digest[:12], hint))
    return team


def _array(_: type, values: object) -> Array:
    """Return what a file has of an array."""
    return np.array(msgspec.convert(values, list[int | float]))


def _outcomes(columns: Mapping[str, list[bool | int | float]], seeds: Sequence[int], path: Path) -> Outcomes:
    if set(columns) != set(COLUMNS) or any(len(column) != len(seeds) for column in columns.values()):
        wanted = f"{', '.join(COLUMNS)} of {len(seeds)} runs"
        raise TrainingError(expected(str(path), "", wanted, "others", _HINT))
    return Outcomes(seeds, [*zip(*(columns[name] for name in COLUMNS), strict=True)])
