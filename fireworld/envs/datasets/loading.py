"""Datasets loaded back: the episodes in them, and the run that each of them is, bit for bit."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Final, NamedTuple, Protocol

import msgspec
import numpy as np

from fireworld.arguments import path_of, whole_number
from fireworld.envs.datasets.recorded import SAME, as_played
from fireworld.errors import FireworldError, LogError, expected, one_line
from fireworld.kernels.arrays import Array
from fireworld.recording.record import run_prepared
from fireworld.recording.run import Run
from fireworld.scenario import parse_scenario
from fireworld.simulation.built import BuiltScenario, CityCache
from fireworld.training.log.episode_run import write_run
from fireworld.training.log.played import OWN, Decided
from fireworld.training.log.played_run import PlayedRun

STEPS_FILE: Final = "steps.parquet"


class StoredScenario(msgspec.Struct, frozen=True, kw_only=True):
    """A scenario as a dataset holds it.

    Attributes:
        name, digest: of the scenario.
        yaml: its text.
        city: content of its city file, empty of a generated city.
    """

    name: str
    digest: str
    yaml: str
    city: bytes


class EpisodeFacts(msgspec.Struct, frozen=True, kw_only=True):
    """What a dataset says of an episode besides its steps; see `fireworld.envs.datasets.rlds.episode_facts`."""

    scenario: int
    episode_id: str
    world: int
    number: int
    seeds: str
    first_step: int
    n_steps: int
    n_steps_max: int
    n_brigades: int
    terminated: bool
    truncated: bool
    score: float
    digest: str
    run_digest: str


class StoredSteps(NamedTuple):
    """The steps of an episode as a dataset holds them; t steps, b brigades."""

    decides: Array  # (t, b) bool, it had something to choose
    action: Array  # (t, b) as environments take it: 0..3 as named, 4 + j the j-th own target
    target: Array  # (t, b), the building that it named, -1 none
    reward: Array  # (t,)


class Stored(Protocol):
    """A dataset of some form, as it is read."""

    @property
    def name(self) -> str:
        """What errors call it."""

    @property
    def shape(self) -> Mapping[str, Any]:
        """What it holds of every episode: observation, reward, own targets."""

    def scenarios(self) -> Sequence[Mapping[str, Any]]:
        """Return the fields of `StoredScenario`, scenario by scenario."""

    def episodes(self) -> Sequence[Mapping[str, Any]]:
        """Return the fields of `EpisodeFacts`, and others, episode by episode."""

    def steps(self, number: int, facts: EpisodeFacts) -> StoredSteps:
        """Return the steps of an episode."""


@dataclass(frozen=True)
class DatasetEpisode:
    """An episode of a dataset; t steps, b brigades.

    Attributes:
        scenario: name of its scenario.
        facts: what the dataset says of it.
        decides: (t, b) bool, whether a brigade had something to choose.
        action: (t, b) int, as environments take it.
        target: (t, b) int, the building that a brigade named itself, -1 none.
        reward: (t,) float64, of the team.
    """

    scenario: str
    facts: EpisodeFacts
    decides: Array
    action: Array
    target: Array
    reward: Array

    @property
    def decided(self) -> Decided:
        """What the brigades did, as replays take it."""
        action = np.where(self.decides, np.minimum(self.action, OWN), -1).astype(np.int32)
        return Decided(action, np.where(action == OWN, self.target, -1).astype(np.int32))


class Dataset:
    """A dataset of fireworld's, of whatever form; made by `load_dataset`. Each episode is read when it is asked for."""

    def __init__(self, stored: Stored) -> None:
        self._stored = stored
        with faults_of(stored.name):
            self._scenarios = [msgspec.convert(one, StoredScenario) for one in stored.scenarios()]
            self.facts = [msgspec.convert(one, EpisodeFacts) for one in stored.episodes()]
            """What the dataset says of its episodes."""
        self._cities, self._built = CityCache(), dict[int, BuiltScenario]()

    @property
    def name(self) -> str:
        """The folder, or the name that Minari knows it by."""
        return self._stored.name

    @property
    def shape(self) -> Mapping[str, Any]:
        """What it holds of every episode: observation, reward, own targets."""
        return self._stored.shape

    def __len__(self) -> int:
        return len(self.facts)

    def __iter__(self) -> Iterator[DatasetEpisode]:
        return (self[number] for number in range(len(self)))

    def __getitem__(self, number: int) -> DatasetEpisode:
        """Return an episode.

        Raises:
            LogError: there is no such episode, or it makes no sense.
        """
        if not len(self):
            raise LogError(expected(self.name, "", "an episode", "none"))
        number = range(len(self))[whole_number("number", number, least=-len(self), most=len(self) - 1)]
        facts = self.facts[number]
        with faults_of(f"{self.name}: episode {number}"):
            scenario = self._scenarios[facts.scenario].name
            steps = self._stored.steps(number, facts)
            shape = (facts.n_steps, facts.n_brigades)
            if any(one.shape != shape for one in steps[:3]) or steps.reward.shape != shape[:1]:
                raise LogError(expected("steps", "", f"those of {shape[1]} brigades and {shape[0]} steps", "others"))
        return DatasetEpisode(scenario, facts, *steps)

    def run(self, number: int) -> Run:
        """Return an episode as a run in memory: every step computed again, and compared with the dataset.

        Raises:
            LogError: there is no such episode, or this fireworld computes another one.
        """
        return run_prepared(self._played(number))

    def replay(self, number: int, output: str | os.PathLike[str], *, force: bool = False) -> str:
        """Write an episode as the log of a run, as `run` computes it; return its digest.

        Args:
            number: of the episode; -1 is the last.
            output: the log to write.
            force: replace an existing one.

        Raises:
            LogError: as for `run`.
            OutputError: the output cannot be written.
        """
        return write_run(self._played(number), path_of("output", output), force=force)

    def __repr__(self) -> str:
        n_steps = sum(one.n_steps for one in self.facts)
        names = ", ".join(dict.fromkeys(one.name for one in self._scenarios))
        return one_line(f"<Dataset {self.name}: {len(self)} episodes, {n_steps:,} steps in {names}>")

    def _played(self, number: int) -> PlayedRun:
        episode = self[number]
        facts, source = episode.facts, f"{self.name}: episode {number}"
        with faults_of(source):
            return PlayedRun(
                as_played(
                    self._build(facts.scenario),
                    episode.decided,
                    seeds=msgspec.json.decode(facts.seeds, type=dict[int, int]),
                    source=source,
                    **{name: getattr(facts, name) for name in (*SAME, "digest")},
                )
            )

    def _build(self, number: int) -> BuiltScenario:
        """Return a scenario, built; each once."""
        if number not in self._built:
            stored = self._scenarios[number]
            scenario = parse_scenario(stored.yaml, source=f"dataset: {stored.name}")
            if scenario.digest != stored.digest:
                raise LogError(expected(stored.name, "digest", stored.digest, scenario.digest))
            self._built[number] = self._cities.build(scenario, city_json=stored.city or None)
        return self._built[number]


def load_dataset(name: str | os.PathLike[str]) -> Dataset:
    """Open a dataset that fireworld wrote.

    Args:
        name: its folder of Parquet files, or the name or the folder of one of Minari's.

    Raises:
        LogError: there is none, or it makes no sense.
        OutputError: pyarrow is not installed.
        LibraryError: it is one of Minari's, and that is not installed.
        ArgumentError: it is no name.
    """
    path = path_of("name", name)
    if (path / STEPS_FILE).is_file():
        from fireworld.envs.datasets.rlds import StoredParquet

        return Dataset(StoredParquet(path))
    from fireworld.envs.datasets.minari_form import StoredMinari, data_of

    folder = data_of(name)
    if folder is None:
        wanted = f"a folder with {STEPS_FILE}, or a dataset of Minari"
        raise LogError(expected(os.fspath(name), "", wanted, "neither"))
    return Dataset(StoredMinari(folder, os.fspath(name)))


@contextmanager
def faults_of(source: str) -> Iterator[None]:
    """Turn whatever libraries raise for damaged files into one line that names the source."""
    try:
        yield
    except FireworldError as error:
        text = str(error)
        raise LogError(text if text.startswith(source) else f"{source}: {text}") from None
    except Exception as error:  # noqa: BLE001 - they raise many kinds
        raise LogError(f"{source}: {one_line(' '.join(str(error).split()) or type(error).__name__)}") from None
