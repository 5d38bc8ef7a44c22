"""A dataset as Parquet files: a row for each brigade and step, as the data sets of RLDS have it for one agent."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any, Final

import numpy as np

from fireworld.envs.datasets.loading import EpisodeFacts, StoredSteps, faults_of
from fireworld.envs.datasets.recorded import AnyLogs, RecordedEpisode, recorded
from fireworld.envs.datasets.trajectory import Shape, Trajectory, shape_of, trajectory_of
from fireworld.errors import LogError, expected
from fireworld.files import new_folder
from fireworld.kernels.batch import TEAM
from fireworld.policy.words import FEATURES
from fireworld.training.log.rows_file import SUFFIX, Rows, RowsFile, check_pyarrow
from fireworld.version import __version__, simulator_digest

FORMAT: Final = "fireworld-rlds/1"
ROWS_FREE: Final = 100_000
ROW_BYTES_MIN: Final = 4
"""A file of n bytes may hold that many rows more than n / 4, but for that of the steps."""
UNPACKED_BYTES_MAX: Final = 1 << 29
GROUP_ROWS_MAX: Final = 1 << 23
FILES: Final[Mapping[str, str]] = {
    "steps": "a brigade before a step, and after the last one: what it saw, could do, did and got",
    "episodes": "an episode: where it comes from, and how it went",
    "scenarios": "a scenario, with the file of its city if it has one: all that a replay needs",
}
"""What a row of each file is."""


def export_rlds(
    logs: AnyLogs,
    folder: Path | str,
    *,
    observation: str | None = None,
    reward: str | None = None,
    own_targets: int | None = None,
    force: bool = False,
    on_episode: Callable[[], object] = lambda: None,
) -> dict[str, int]:
    """Write episodes as a folder of Parquet files: steps, episodes, scenarios. It is there only once it is complete.

    Args:
        logs: paths of logs of runs, and of what learners played in environments; or such logs.
        folder: the folder to make.
        observation: "features" or "targets"; None: as learners were shown, else features.
        reward: "score", or "scenario", the scenario's own; None: as learners got it, of runs the scenario's.
        own_targets: how many targets a brigade may name itself; None: as learners could, of runs as many as needed.
        force: replace an earlier dataset.
        on_episode: called after each episode.

    Returns:
        Rows by file.

    Raises:
        LogError: a log cannot be read or replayed, or this fireworld computes something else.
        OutputError: pyarrow is not installed, or the folder exists or cannot be written.
        ArgumentError: there is no such observation or reward.
    """
    check_pyarrow("export --rlds")
    episodes = recorded(logs)
    shape = shape_of(episodes, observation=observation, reward=reward, own_targets=own_targets)
    own = {f"{name}{SUFFIX}" for name in FILES}
    with new_folder(Path(folder), own=own, force=force) as scratch, ExitStack() as stack:
        files = {
            name: stack.enter_context(RowsFile(scratch / f"{name}{SUFFIX}", _facts(name, shape, episodes.origin)))
            for name in FILES
        }
        scenarios = Scenarios()
        for number, episode in enumerate(episodes):
            trajectory = trajectory_of(episode, shape)
            scenario, is_new = scenarios.number(episode)
            if is_new:
                files["scenarios"].add(scenario_row(scenario, episode))
            files["episodes"].add(episode_row(number, scenario, trajectory))
            files["steps"].add(step_rows(number, trajectory))
            on_episode()
        return {name: file.finish() for name, file in files.items()}


class Scenarios:
    """The scenarios that a dataset holds, each once."""

    def __init__(self) -> None:
        self._known: dict[str, int] = {}

    def number(self, episode: RecordedEpisode) -> tuple[int, bool]:
        """Return the number of an episode's scenario, and whether it is a new one."""
        key = f"{episode.scenario.digest} {episode.scenario.name}"
        is_new = key not in self._known
        return self._known.setdefault(key, len(self._known)), is_new


def scenario_row(number: int, episode: RecordedEpisode) -> Rows:
    """Return the row of a scenario."""
    scenario = episode.scenario
    values: dict[str, Any] = {
        "scenario": number,
        "name": scenario.name,
        "digest": scenario.digest,
        "yaml": scenario.to_yaml(),
        "city": episode.city or b"",
    }
    return one_row(values)


def episode_row(number: int, scenario: int, trajectory: Trajectory) -> Rows:
    """Return the row of an episode."""
    return one_row({"episode": number, "scenario": scenario, **episode_facts(trajectory)})


def episode_facts(trajectory: Trajectory) -> dict[str, Any]:
    """Return what is known of an episode besides its steps, as plain values."""
    episode = trajectory.episode
    return {
        "episode_id": episode.name,
        "scenario_name": episode.scenario.name,
        "scenario_digest": episode.scenario.digest,
        "world": episode.world,
        "number": episode.number,
        "seed": episode.seeds[0],
        "seeds": json.dumps({str(step): seed for step, seed in episode.seeds.items()}),
        "first_step": episode.first_step,
        "n_steps": trajectory.n_steps,
        "n_steps_max": episode.n_steps_max,
        "n_brigades": episode.built.n_brigades,
        "terminated": episode.terminated,
        "truncated": episode.truncated,
        "total_reward": float(sum(trajectory.reward.tolist())),
        "score": episode.score,
        "score_max": trajectory.score_max,
        "n_burnt_out": trajectory.counts["n_burnt_out"],
        "n_civilians_alive": trajectory.counts["n_civilians_alive"],
        "digest": trajectory.state_digest,
        "run_digest": episode.run_digest,
        "log_digest": episode.log_digest,
    }


def step_rows(number: int, trajectory: Trajectory) -> Rows:
    """Return the rows of the steps of an episode: brigade by brigade, to the state after the last."""
    n, b = trajectory.action.shape
    episode, seen = trajectory.episode, trajectory.seen

    def of_brigades(values: Any) -> Any:
        """Bring (n + 1, b, ...) into the order of the rows."""
        array = np.swapaxes(values, 0, 1)
        return array.reshape((b * (n + 1), -1) if array.ndim > 2 else b * (n + 1))

    def of_steps(values: Any, last: Any) -> Any:
        """Bring (n, b) or (n,) into the order of the rows, with a value of the state after the last step."""
        each = values if values.ndim == 2 else np.repeat(values[:, None], b, axis=1)
        return of_brigades(np.concatenate((each, np.full((1, b), last, dtype=each.dtype))))

    last = np.zeros((n + 1, b), dtype=np.bool_)
    first = last.copy()
    first[0], last[n] = True, True
    rows: Rows = {
        "episode": np.full(b * (n + 1), number, dtype=np.int32),
        "episode_id": np.full(b * (n + 1), episode.name),
        "digest": np.full(b * (n + 1), trajectory.state_digest),
        "seed": np.full(b * (n + 1), episode.seeds[0], dtype=np.int64),
        "step": np.tile(np.arange(n + 1, dtype=np.int32), b),
        "brigade": np.repeat(np.arange(b, dtype=np.int32), n + 1),
    }
    if "features" in seen:
        features = of_brigades(seen["features"])
        rows |= {feature.name: features[:, k] for k, feature in enumerate(FEATURES)}
    else:
        rows["targets"] = of_brigades(seen["targets"])
    team = np.tile(seen["team"], (b, 1))
    rows |= {f"team_{name}": team[:, k] for k, name in enumerate(TEAM)}
    rows |= {"alive": of_brigades(seen["alive"]), "action_mask": of_brigades(seen["action_mask"])}
    if "own" in seen:
        rows["own"] = of_brigades(seen["own"])
    return rows | {
        "decides": of_steps(trajectory.decides, last=False),
        "action": of_steps(trajectory.action, last=0),
        "target": of_steps(trajectory.target, last=-1),
        "reward": of_steps(trajectory.reward, last=0.0),
        "discount": of_brigades(np.where(last & episode.terminated, 0.0, 1.0)),
        "is_first": of_brigades(first),
        "is_last": of_brigades(last),
        "is_terminal": of_brigades(last & episode.terminated),
    }


class StoredParquet:
    """A dataset as a folder of Parquet files, a `fireworld.envs.datasets.loading.Stored`."""

    def __init__(self, folder: Path) -> None:
        check_pyarrow("load_dataset")
        self.name, self._folder = str(folder), folder

    @property
    def shape(self) -> Mapping[str, Any]:
        """What it holds of every episode."""
        with faults_of(self.name), self._open("steps") as file:
            facts = {key.decode(): text.decode() for key, text in file.schema_arrow.metadata.items()}
            if facts.get("fireworld.format") != FORMAT:
                raise LogError(expected("steps", "format", FORMAT, facts.get("fireworld.format", "none")))
            named = {name: facts[f"fireworld.{name}"] for name in ("observation", "reward", "own_targets")}
            return named | {"own_targets": int(named["own_targets"])}

    def scenarios(self) -> list[dict[str, Any]]:
        """Return what `StoredScenario` has, scenario by scenario."""
        return self._rows("scenarios", ("name", "digest", "yaml", "city"))

    def episodes(self) -> list[dict[str, Any]]:
        """Return what `EpisodeFacts` has, episode by episode."""
        return self._rows("episodes", EpisodeFacts.__struct_fields__)

    def steps(self, number: int, facts: EpisodeFacts) -> StoredSteps:
        """Return the steps of an episode."""
        columns = ["episode", "brigade", "step", *StoredSteps._fields]
        found: list[dict[str, Any]] = []
        with self._open("steps") as file:
            place = file.schema_arrow.names.index("episode")
            for k in range(file.num_row_groups):
                group = file.metadata.row_group(k)
                spread = group.column(place).statistics
                if spread is not None and not spread.min <= number <= spread.max:
                    continue
                if group.num_rows > GROUP_ROWS_MAX:
                    raise LogError(expected("steps", "", f"at most {GROUP_ROWS_MAX} rows in a group", group.num_rows))
                table = file.read_row_group(k, columns=columns)
                mine = table.column("episode").to_numpy() == number
                found.append({name: table.column(name).to_numpy()[mine] for name in columns})
        values = {name: np.concatenate([one[name] for one in found]) for name in columns}
        b, n = facts.n_brigades, facts.n_steps
        if len(values["step"]) != b * (n + 1):
            raise LogError(expected("steps", "rows", str(b * (n + 1)), len(values["step"])))
        order = np.lexsort((values["step"], values["brigade"]))
        decides, action, target, reward = (
            values[name][order].reshape(b, n + 1)[:, :n].T for name in StoredSteps._fields
        )
        return StoredSteps(decides, action, target, reward[:, 0])

    @contextmanager
    def _open(self, name: str) -> Iterator[Any]:
        import pyarrow.parquet as pq

        with (self._folder / f"{name}{SUFFIX}").open("rb") as file:  # pyarrow cannot open names of any bytes
            yield pq.ParquetFile(file)

    def _rows(self, name: str, columns: Sequence[str]) -> list[dict[str, Any]]:
        n_bytes = (self._folder / f"{name}{SUFFIX}").stat().st_size
        with self._open(name) as file:
            groups = [file.metadata.row_group(k) for k in range(file.num_row_groups)]
            if file.metadata.num_rows > ROWS_FREE + n_bytes // ROW_BYTES_MIN:
                raise LogError(expected(name, "rows", "as many as fit its bytes", file.metadata.num_rows))
            if sum(group.total_byte_size for group in groups) > UNPACKED_BYTES_MAX:
                raise LogError(expected(name, "", f"at most {UNPACKED_BYTES_MAX} bytes, unpacked", "more"))
            found: list[dict[str, Any]] = file.read(columns=list(columns)).to_pylist()
        return found


def one_row(values: Mapping[str, Any]) -> Rows:
    """Return a table of one row."""
    return {
        name: np.array([value], dtype=object if isinstance(value, str | bytes) else None)
        for name, value in values.items()
    }


def _facts(name: str, shape: Shape, origin: Mapping[str, Any]) -> dict[str, str]:
    """Return the metadata of a file."""
    facts = {
        "format": FORMAT,
        "table": FILES[name],
        "observation": shape.observation,
        "reward": shape.reward,
        "own_targets": str(shape.own_targets),
        "version": __version__,
        "simulator": simulator_digest(),
        "origin": json.dumps(origin),
    }
    return {f"fireworld.{key}": text for key, text in facts.items()}
