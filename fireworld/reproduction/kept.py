"""What a reproduction keeps of its work in its folder, a file for each finished piece, so that a later call goes on."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, TypeVar

import msgspec
import numpy as np
from msgspec import Struct

from fireworld.errors import TrainingError, expected
from fireworld.evaluation.runs import QUANTITIES, Outcomes, outcomes
from fireworld.files import write_file
from fireworld.policy.teams.table_team import TableTeam
from fireworld.policy.teams.team import load_team
from fireworld.reproduction.folder import SETTINGS
from fireworld.reproduction.repetitions import Repetition
from fireworld.reproduction.study import TOGETHER, Lesson
from fireworld.reproduction.trials import Tested
from fireworld.training.training import check_same

FORMAT: Final = "fireworld-reproduction/1"
_HINT: Final = "delete it and it is made anew"

Content = TypeVar("Content")


class LessonText(Struct, frozen=True, forbid_unknown_fields=True):
    """A Lesson as plain values."""

    repetition: int
    team: str
    scenario: str
    scenario_number: int
    converged: bool
    score: float
    score_max: float
    total_reward: list[float]
    n_changed: list[int]


class TrainedText(Struct, frozen=True, forbid_unknown_fields=True):
    """A Repetition as plain values; its teams are in files of their own."""

    teams: dict[str, str]
    """Digest of each team, by name."""
    graduates: dict[str, str]
    """Digest of each graduate, by scenario."""
    lessons: list[LessonText]


@dataclass(frozen=True)
class Kept:
    """What is kept in a folder."""

    folder: Path

    def repetition(self, number: int) -> Repetition | None:
        """Return what a training came to; None if it has not been done.

        Raises:
            TrainingError: a file is damaged, or gone.
        """
        path = self._training(number)
        found = self._read(path, TrainedText)
        if found is None:
            return None
        return Repetition(
            teams={name: _read_team(self._team(name, number), digest, path) for name, digest in found.teams.items()},
            graduates={
                scenario: _read_team(self._graduate(scenario, number), digest, path)
                for scenario, digest in found.graduates.items()
            },
            lessons=tuple(_lesson(lesson) for lesson in found.lessons),
        )

    def keep_repetition(self, number: int, repetition: Repetition) -> None:
        """Keep the teams of a repetition, and then how they came to be: with that it counts as done.

        Raises:
            OutputError: a file cannot be written.
        """
        teams, graduates = repetition.teams, repetition.graduates
        for name, team in teams.items():
            team.save(self._team(name, number), force=True)
        for scenario, team in graduates.items():
            team.save(self._graduate(scenario, number), force=True)
        content = TrainedText(
            {name: team.digest for name, team in teams.items()},
            {scenario: team.digest for scenario, team in graduates.items()},
            [_lesson_text(lesson) for lesson in repetition.lessons],
        )
        self._write(self._training(number), content)

    def n_trained(self, n_repetitions: int) -> int:
        """Count the repetitions that are trained."""
        return sum(self._training(number).is_file() for number in range(1, n_repetitions + 1))

    def tested(
        self, name: str, *, scenarios: Iterable[str], teams: Iterable[str], seeds: Sequence[int]
    ) -> Tested | None:
        """Return the outcomes of a repetition's tests, or of the rules'; None if there are none.

        Args:
            name: of the repetition, or "rules".
            scenarios: the tests.
            teams: who was tested.
            seeds: of the runs.

        Raises:
            TrainingError: the file is damaged.
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

    def keep_tested(self, name: str, tested: Tested) -> None:
        """Keep the outcomes of a repetition's tests, or of the rules'.

        Raises:
            OutputError: the file cannot be written.
        """
        content = {
            scenario: {
                team: {quantity: getattr(found, quantity).tolist() for quantity in QUANTITIES}
                for team, found in teams.items()
            }
            for scenario, teams in tested.items()
        }
        self._write(self._tests(name), content)

    def keep_settings(self, identity: Mapping[str, Any]) -> None:
        """Keep what the work is begun with.

        Raises:
            OutputError: the file cannot be written.
        """
        self._write(self.folder / SETTINGS, {"format": FORMAT, **identity})

    def check_settings(self, identity: Mapping[str, Any]) -> None:
        """Refuse to go on in a folder that was begun with other settings.

        Raises:
            TrainingError: it was, or the file that tells is damaged.
        """
        path = self.folder / SETTINGS
        check_same(self._read(path, dict[str, Any]) or {}, {"format": FORMAT, **identity}, path)

    def _training(self, number: int) -> Path:
        return self.folder / "kept" / f"training-{number}.json"

    def _tests(self, name: str) -> Path:
        return self.folder / "kept" / f"tests-{name}.json"

    def _team(self, name: str, number: int) -> Path:
        return self.folder / "teams" / f"{name}-{number}.npz"

    def _graduate(self, scenario: str, number: int) -> Path:
        return self.folder / "teams" / f"{TOGETHER}-{number}-after-{scenario}.npz"

    def _read(self, path: Path, kind: type[Content]) -> Content | None:
        try:
            return msgspec.json.decode(path.read_bytes(), type=kind)
        except FileNotFoundError:
            return None
        except (OSError, msgspec.DecodeError, UnicodeDecodeError) as error:
            got = f"{type(error).__name__}: {error}"
            raise TrainingError(expected(str(path), "", "what an earlier call has kept", got, _HINT)) from None

    def _write(self, path: Path, content: object) -> None:
        write_file(path, msgspec.json.encode(content))


def _read_team(path: Path, digest: str, training: Path) -> TableTeam:
    """Read a team, and see that it is the one that was kept."""
    team = load_team(path)
    if not isinstance(team, TableTeam) or team.digest != digest:
        hint = f"delete {training} and it is trained anew"
        raise TrainingError(expected(str(path), "", f"the team {digest[:12]} that was kept", team.digest[:12], hint))
    return team


def _lesson_text(lesson: Lesson) -> LessonText:
    values = {name: getattr(lesson, name) for name in LessonText.__struct_fields__}
    return LessonText(
        **{name: value.tolist() if isinstance(value, np.ndarray) else value for name, value in values.items()}
    )


def _lesson(text: LessonText) -> Lesson:
    values = msgspec.structs.asdict(text)
    arrays = {
        "total_reward": np.array(text.total_reward, dtype=np.float64),
        "n_changed": np.array(text.n_changed, dtype=np.int64),
    }
    return Lesson(**{**values, **arrays})


def _outcomes(columns: Mapping[str, list[bool | int | float]], seeds: Sequence[int], path: Path) -> Outcomes:
    if set(columns) != set(QUANTITIES) or any(len(column) != len(seeds) for column in columns.values()):
        wanted = f"{', '.join(QUANTITIES)} of {len(seeds)} runs"
        raise TrainingError(expected(str(path), "", wanted, "others", _HINT))
    return outcomes(seeds, [*zip(*(columns[quantity] for quantity in QUANTITIES), strict=True)])
