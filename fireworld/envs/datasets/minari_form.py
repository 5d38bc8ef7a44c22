"""A dataset of Minari: all brigades of a team in one episode, as the environment `fireworld/Team-v0` shows them."""

from __future__ import annotations

import base64
import copy
import json
import os
import zlib
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

import numpy as np

from fireworld.arguments import ArgumentError
from fireworld.envs.datasets.loading import EpisodeFacts, StoredSteps, faults_of
from fireworld.envs.datasets.recorded import SCORE, AnyLogs, Recorded, RecordedEpisode, recorded
from fireworld.envs.datasets.rlds import Scenarios, episode_facts
from fireworld.envs.datasets.trajectory import Shape, Trajectory, shape_of, trajectory_of
from fireworld.envs.rewards import reward_of
from fireworld.envs.setup import Setup
from fireworld.errors import LibraryError, LogError, OutputError, expected
from fireworld.files import new_folder
from fireworld.kernels.arrays import Array
from fireworld.kernels.observation import N_ACTIONS
from fireworld.scenario.scenario import CITY_BYTES_MAX
from fireworld.version import __version__, simulator_digest

FORMAT: Final = "fireworld-minari/1"
KEY: Final = "fireworld"
"""Of what fireworld adds to the metadata of a dataset and of its episodes."""
DATA: Final = "data"
_METADATA: Final = "metadata.json"
_ENVIRONMENT: Final = "fireworld/Team-v0"
_STORAGE: Final = "arrow"


def export_minari(
    logs: AnyLogs,
    dataset_id: str,
    *,
    observation: str | None = None,
    reward: str | None = None,
    own_targets: int | None = None,
    force: bool = False,
    on_episode: Callable[[], object] = lambda: None,
) -> Path:
    """Write episodes as a dataset of Minari, which `minari.load_dataset` finds once it is complete.

    Of teams that are smaller than the largest one, the brigades beyond are seen as dead ones.

    Args:
        logs: as of `fireworld.envs.datasets.rlds.export_rlds`, here and below.
        dataset_id: what Minari calls it, as in "fireworld/quick/random-v0".
        observation: the same.
        reward: the same.
        own_targets: the same.
        force: the same.
        on_episode: the same.

    Returns:
        The folder of the dataset.

    Raises:
        LibraryError: Minari is not installed.
        LogError: a log cannot be read or replayed, or this fireworld computes something else.
        OutputError: there is such a dataset, or it cannot be written.
        ArgumentError: it is no name of a dataset; there is no such observation or reward.
    """
    folder = folder_of(dataset_id)
    episodes = recorded(logs)
    shape = shape_of(episodes, observation=observation, reward=reward, own_targets=own_targets)
    sizes = _sizes_of(episodes, shape)
    with _namespace(dataset_id, folder), new_folder(folder, own={DATA}, force=force) as scratch:
        _write(scratch / DATA, dataset_id, episodes, sizes, on_episode)
    return folder


def folder_of(dataset_id: str) -> Path:
    """Return the folder of a dataset of Minari, whether it is there or not.

    Raises:
        LibraryError: Minari is not installed.
        ArgumentError: it is no name of a dataset.
        OutputError: the folder of all datasets cannot be made.
    """
    _check_minari()
    from minari.dataset.minari_dataset import parse_dataset_id
    from minari.storage import get_dataset_path

    try:
        parse_dataset_id(dataset_id)
    except (TypeError, ValueError):
        wanted = "the name of a dataset, as in fireworld/quick/random-v0"
        raise ArgumentError(expected("--minari", "", wanted, dataset_id)) from None
    try:
        return Path(get_dataset_path(dataset_id))
    except OSError as error:
        raise OutputError(f"{dataset_id}: the folder of Minari's datasets cannot be made: {error}") from None


@dataclass(frozen=True)
class Sizes:
    """What the spaces of a dataset follow from.

    Attributes:
        n_brigades: of the largest team.
        n_buildings: of the largest city.
        scenarios: all that was played, each once, each by its number in `Scenarios`.
        setup: what learners are shown.
        shape: the same, as a dataset has it.
    """

    n_brigades: int
    n_buildings: int
    scenarios: Mapping[int, RecordedEpisode]
    setup: Setup
    shape: Shape

    @property
    def n_actions(self) -> int:
        """Actions of a brigade."""
        return N_ACTIONS + self.setup.own_targets


class StoredMinari:
    """A dataset of Minari that fireworld wrote, a `fireworld.envs.datasets.loading.Stored`."""

    def __init__(self, folder: Path, name: str) -> None:
        from minari.dataset.minari_storage import MinariStorage

        self.name = name
        with faults_of(name):
            self._storage = MinariStorage.read(folder)
            self._facts = MinariStorage.read_raw_metadata(folder).get(KEY, {})
            if self._facts.get("format") != FORMAT:
                raise LogError(expected("metadata", "format", FORMAT, self._facts.get("format", "none")))

    @property
    def shape(self) -> Mapping[str, Any]:
        """What it holds of every episode."""
        with faults_of(self.name):
            return {name: self._facts[name] for name in ("observation", "reward", "own_targets")}

    def scenarios(self) -> list[dict[str, Any]]:
        """Return what `StoredScenario` has, scenario by scenario."""
        return [{**one, "city": _unpacked(one["city"])} for one in self._facts["scenarios"]]

    def episodes(self) -> list[dict[str, Any]]:
        """Return what `EpisodeFacts` has, episode by episode."""
        return [one[KEY] for one in self._storage.get_episode_metadata(range(self._storage.total_episodes))]

    def steps(self, number: int, facts: EpisodeFacts) -> StoredSteps:
        """Return the steps of an episode."""
        (episode,) = self._storage.get_episodes([number])
        b, seen = facts.n_brigades, episode["observations"]
        decides, action = seen["action_mask"][:-1, :b, 1] != 0, episode["actions"][:, :b]
        target = np.full(action.shape, -1)
        if "own" in seen:
            own = np.take_along_axis(seen["own"][:-1, :b], np.maximum(action - N_ACTIONS, 0)[:, :, None], axis=2)
            target = np.where(action >= N_ACTIONS, own[:, :, 0], -1)
        return StoredSteps(decides, action, target, episode["rewards"])


def data_of(name: str | os.PathLike[str]) -> Path | None:
    """Return the folder with the data of a dataset of Minari, by its name or folder; None if there is none.

    Raises:
        LibraryError: Minari is not installed.
    """
    for folder in (Path(name), Path(name) / DATA):
        if (folder / _METADATA).is_file():
            _check_minari()
            return folder
    try:
        folder = folder_of(os.fspath(name)) / DATA
    except (ArgumentError, LibraryError, OutputError):
        return None
    return folder if (folder / _METADATA).is_file() else None


def _unpacked(city: str | None) -> bytes:
    """Return the content of a city file, which is no larger than such a file can be."""
    if city is None:
        return b""
    data = zlib.decompressobj().decompress(base64.b64decode(city), CITY_BYTES_MAX + 1)
    if len(data) > CITY_BYTES_MAX:
        raise LogError(expected("city", "", f"at most {CITY_BYTES_MAX} bytes", "more"))
    return data


def _sizes_of(episodes: Recorded, shape: Shape) -> Sizes:
    known, numbers = dict[int, RecordedEpisode](), Scenarios()
    for episode in episodes:
        number, is_new = numbers.number(episode)
        if is_new:
            known[number] = episode
    setup = Setup(
        tuple(one.scenario for one in known.values()),
        observation=shape.observation,
        reward=reward_of(SCORE),
        own_targets=shape.own_targets,
        n_burning_max=1,
        steps=None,
    )
    built = [one.built for one in known.values()]
    n_brigades, n_buildings = max(one.n_brigades for one in built), max(one.city.n_buildings for one in built)
    return Sizes(n_brigades, n_buildings, known, setup, shape)


def _write(folder: Path, dataset_id: str, episodes: Recorded, sizes: Sizes, on_episode: Callable[[], object]) -> None:
    """Write the data of a dataset, an episode at a time."""
    from minari import __version__ as minari_version
    from minari.dataset.minari_storage import MinariStorage

    from fireworld.envs.spaces import team_actions, team_space

    storage = MinariStorage.new(
        folder,
        observation_space=team_space(sizes),
        action_space=team_actions(sizes),
        env_spec=_environment(sizes),
        data_format=_STORAGE,
        jpeg_encoding=False,
    )
    storage.get_size = lambda: 0.0  # else it measures all again after every episode
    storage.update_metadata({"dataset_id": dataset_id, "minari_version": minari_version})
    facts, numbers = list[dict[str, Any]](), Scenarios()

    def buffers() -> Iterator[Any]:
        for episode in episodes:
            trajectory = trajectory_of(episode, sizes.shape)
            facts.append({KEY: {"scenario": numbers.number(episode)[0], **episode_facts(trajectory)}})
            yield _buffer(trajectory, sizes)
            on_episode()

    storage.update_episodes(buffers())
    storage.update_episode_metadata(facts)
    n_bytes = sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())  # of folders too, Minari's own
    storage.update_metadata({"dataset_size": round(n_bytes / 1e6, 1), KEY: _facts(episodes, sizes)})


def _buffer(trajectory: Trajectory, sizes: Sizes) -> Any:
    """Return an episode as Minari takes it."""
    from minari.data_collector.episode_buffer import EpisodeBuffer

    from fireworld.envs.spaces import in_int8

    episode, n = trajectory.episode, trajectory.n_steps
    seen = {
        name: array if name == "team" else _padded(name, array, sizes.n_brigades)
        for name, array in trajectory.seen.items()
    }
    ends = np.zeros((2, n), dtype=np.bool_)
    ends[:, n - 1] = episode.terminated, episode.truncated
    return EpisodeBuffer(
        options={"world_seed": episode.seeds[0]},
        observations=in_int8(seen),
        actions=_padded("action", trajectory.action.astype(np.int64), sizes.n_brigades),
        rewards=trajectory.reward.tolist(),
        terminations=ends[0].tolist(),
        truncations=ends[1].tolist(),
    )


def _padded(name: str, array: Array, n_brigades: int) -> Array:
    """Add the brigades that a team does not have, (t, b, ...), as environments show them."""
    missing = n_brigades - array.shape[1]
    if not missing:
        return array
    more = np.full((len(array), missing, *array.shape[2:]), -1 if name == "own" else 0, dtype=array.dtype)
    if name == "action_mask":
        more[:, :, 0] = True
    return np.concatenate((array, more), axis=1)


def _environment(sizes: Sizes) -> Any:
    """Return what Minari makes the environment again by; None where it would be another game than was recorded."""
    import gymnasium

    import fireworld.envs  # noqa: F401 - registers it

    (episode, *others) = sizes.scenarios.values()
    scenario = episode.scenario
    if others or scenario.choices != "simultaneous" or episode.city is not None:
        return None
    reward = scenario.reward if isinstance(scenario.reward, str) else scenario.reward.of
    spec = copy.deepcopy(gymnasium.spec(_ENVIRONMENT))
    spec.kwargs = {
        "scenario": scenario.resolved,
        "observation": sizes.shape.observation,
        "reward": SCORE if sizes.shape.reward == SCORE else reward,
        "own_targets": sizes.shape.own_targets,
        "steps": episode.n_steps_max,
    }
    return spec


def _facts(episodes: Recorded, sizes: Sizes) -> dict[str, Any]:
    """Return what fireworld adds to the metadata of a dataset: all that replays need besides its episodes."""
    scenarios = [
        {
            "name": one.scenario.name,
            "digest": one.scenario.digest,
            "yaml": one.scenario.to_yaml(),
            "city": base64.b64encode(zlib.compress(one.city)).decode() if one.city is not None else None,
        }
        for one in sizes.scenarios.values()
    ]
    shape, origin = asdict(sizes.shape), json.loads(json.dumps(episodes.origin))
    made = {"version": __version__, "simulator": simulator_digest()}
    return {"format": FORMAT, **shape, **made, "origin": origin, "scenarios": scenarios}


@contextmanager
def _namespace(dataset_id: str, folder: Path) -> Iterator[None]:
    """Make the folders that a dataset lies in, and name them to Minari once it is there."""
    from minari.namespace import create_namespace, list_local_namespaces

    missing = [one for one in folder.parents if not one.exists()]
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"{folder}: cannot be written: {error.strerror or error}") from None
    try:
        yield
    except BaseException:
        for one in missing:
            with suppress(OSError):
                one.rmdir()
        raise
    name = dataset_id.rpartition("/")[0]
    if name and name not in list_local_namespaces():
        create_namespace(name)


def _check_minari() -> None:
    """Raise LibraryError if Minari is not installed."""
    missing = [name for name in ("minari", "pyarrow", "PIL") if find_spec(name) is None]
    if missing:
        hint = "try pip install 'fireworld[minari]'"
        raise LibraryError(f"datasets of Minari: {missing[0]} is not installed; {hint}")
