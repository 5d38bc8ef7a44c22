"""Many worlds that the caller steps at once: the vector environment without any library."""

from __future__ import annotations

import copy
import hashlib
import io
import json
import os
import weakref
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from enum import Enum
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np

from fireworld.arguments import ArgumentError, last_step_of, seed_of, settings_of, whole_number
from fireworld.envs.history import check_held
from fireworld.envs.record import Beginning, EpisodeRecorder
from fireworld.envs.rewards import Rewards, reward_of
from fireworld.envs.view import fresh_batch, observation_of, observed
from fireworld.errors import LogError, expected
from fireworld.kernels.addresses import address_row
from fireworld.kernels.arrays import LAST_STEP, SEED, STEP, Array
from fireworld.kernels.batch import show_worlds, step_worlds
from fireworld.kernels.observation import N_ACTIONS
from fireworld.npz import read_npz
from fireworld.policy.kernel import given
from fireworld.scenario import Scenario, find_scenario
from fireworld.simulation.bound import Bound
from fireworld.simulation.built import BuiltScenario, CityCache
from fireworld.simulation.world import World
from fireworld.training.log.environment import ENVIRONMENT, Environment
from fireworld.training.seeds import EPISODES_MAX, WORKERS_MAX, Seeds

SCENARIO = str | Path | Scenario | Mapping[str, Any]
_SNAPSHOT: Final = "fireworld-worlds/1"


class Autoreset(Enum):
    """When a world that has ended begins its next episode; the names and meanings are those of Gymnasium."""

    NEXT_STEP = "NextStep"
    """In the step after its last one, which then runs nothing: its action is ignored, its reward 0."""
    SAME_STEP = "SameStep"
    """At the end of its last step; what was seen at the end of the episode is in `info`."""
    DISABLED = "Disabled"
    """When the caller says so."""


@dataclass(frozen=True)
class Stepped:
    """What a step of n worlds came to.

    Attributes:
        observation: arrays by name, of n worlds each.
        reward: (n,) float64, of each team.
        terminated: (n,) bool, nothing burns any more.
        truncated: (n,) bool, the last step is done, and something burns.
        info: arrays of n worlds: seed, episode, step, score, score_share, counts of buildings and civilians; where
            worlds were reset in the same step also `final`, what was seen at the end, and `ended`, of which worlds.
    """

    observation: dict[str, Array]
    reward: Array
    terminated: Array
    truncated: Array
    info: dict[str, Any]


class Worlds:
    """n worlds of one or several scenarios, each at a step and an episode of its own; made by `worlds`."""

    def __init__(
        self,
        scenarios: Sequence[Scenario],
        n: int,
        *,
        observation: str,
        reward: Rewards,
        own_targets: int,
        n_burning_max: int,
        steps: int | None,
        autoreset: Autoreset,
        threads: int,
        seeds: Seeds,
        first_worker: int,
        record: str | os.PathLike[str] | None = None,
    ) -> None:
        self.n, self.observation, self.autoreset, self.seeds = n, observation, autoreset, seeds
        self.reward, self.own_targets, self._n_burning_max = reward, own_targets, n_burning_max
        self._steps, self._threads, self._first_worker = steps, threads, first_worker
        cities = CityCache()
        self._built = [cities.build(reward.scenario(scenario)) for scenario in scenarios]
        self.n_brigades = max(built.n_brigades for built in self._built)
        self._pool = ThreadPoolExecutor(threads, "fireworld-worlds") if threads > 1 else None
        self.episode = np.full(n, -1, dtype=np.int64)
        """(n,) number of each world's episode, 0 at first."""
        self._playing = np.full(n, -1, dtype=np.int64)
        self._ended = np.ones(n, dtype=np.bool_)
        self._share: Array = np.ones(n)
        self._begin()
        self._recorder: EpisodeRecorder | None = None
        if record is not None:
            self._recorder = EpisodeRecorder(
                record, self.scenarios, self._environment(), base=seeds.base, batch=self._batch
            )
            weakref.finalize(self, self._recorder.close)

    def _begin(self) -> None:
        """Make the arrays that kernels write, and worlds in them."""
        self._batch = fresh_batch(
            self.n,
            self.n_brigades,
            observation=self.observation,
            own_targets=self.own_targets,
            n_burning_max=self._n_burning_max,
        )
        self._batch_row = address_row(self._batch)
        self._worlds: list[World] = []
        self._bound: list[Bound] = []
        self._team = given(self.n_brigades)
        for index in range(self.n):
            built = self._built[self._scenario_of(index, 0)]
            self._worlds.append(self._made(built))
            self._bound.append(self._worlds[-1].bound(self._team))
        self._rows = np.stack([bound.row for bound in self._bound])

    @property
    def scenarios(self) -> tuple[Scenario, ...]:
        """What is played: world i plays number (i + episode) modulo their number."""
        return tuple(built.scenario for built in self._built)

    @property
    def n_actions(self) -> int:
        """Actions of a brigade: the paper's four, then those of its own targets."""
        return N_ACTIONS + self.own_targets

    def reset(self, *, seed: int | None = None, indices: Iterable[int] | None = None) -> dict[str, Array]:
        """Begin the next episode of worlds, and return what is seen of all.

        Args:
            seed: begin from episode 0 again with the seeds that follow from this base; None: the next ones.
            indices: of the worlds; None: all.

        Raises:
            ArgumentError: an argument that makes no sense.
        """
        which = np.arange(self.n) if indices is None else self._indices(indices)
        if seed is not None:
            self.seeds = Seeds(seed_of(seed), test=self.seeds.test)
            self.episode[which] = -1
        self._next_episode(which)
        return observed(self._batch.shown, self.observation)

    def step(self, actions: Array | Sequence[Sequence[int]]) -> Stepped:
        """Run one step of every world.

        Args:
            actions: (n, n_brigades) whole numbers: 0 to 3 are the paper's actions, 4 + j names the j-th burning
                building of the brigade's site. Of brigades that choose nothing they are ignored.

        Raises:
            ArgumentError: another shape, dtype or number; an action that the mask forbids; with Autoreset.DISABLED, a
                world that has ended.
        """
        begins = np.flatnonzero(self._ended)
        if len(begins) and (self.autoreset is not Autoreset.NEXT_STEP or (self.episode[begins] < 0).any()):
            raise ArgumentError(expected("step", f"world {begins[0]}", "one under way", "one that is not", "reset it"))
        self._batch.actions[...] = self._checked(actions)
        runs = np.flatnonzero(~self._ended)
        if self._recorder is not None:
            self._recorder.note()
        self._in_kernel(lambda rows, batch, some: step_worlds(rows, batch, some, False), runs)
        if len(begins):
            self._next_episode(begins)
        result = self._batch.result
        reward = np.zeros(self.n)
        reward[runs] = self.reward.of(result, self._share)[runs]
        self._share = result.score[:, 0] / result.score[:, 1]
        terminated, truncated = result.terminated.astype(np.bool_), result.truncated.astype(np.bool_)
        self._ended = terminated | truncated
        info = self._info()
        ends = np.flatnonzero(self._ended)
        if self._recorder is not None:
            self._recorder.took(reward, ends)
        if len(ends) and self.autoreset is Autoreset.SAME_STEP:
            info |= {"final": observed(self._batch.shown, self.observation), "ended": self._ended.copy()}
            self._next_episode(ends)
        return Stepped(observed(self._batch.shown, self.observation), reward, terminated, truncated, info)

    def fork(self, source: int, target: int, *, seed: int | None = None) -> None:
        """Bring world `target` into the state of world `source`.

        Args:
            source: its index.
            target: the other's.
            seed: of the random draws from here on; None: the same, so that the same actions lead to the same end.
        """
        source, target = self._indices((source, target))
        built = self._built[self._playing[source]]
        self._place(target, int(self._playing[source]), self._made(built))
        one, other = self._worlds[source], self._worlds[target]
        other.memory[:] = one.memory
        self._bound[target].clock[:] = self._bound[source].clock
        if seed is not None:
            self._bound[target].clock[SEED] = seed_of(seed)
        self.episode[target], self._ended[target] = self.episode[source], self._ended[source]
        if self._recorder is not None:
            self._recorder.fork(source, target, self._beginning(target), partial(self._state_digest, target))
        self._show(np.array([target]), begun=True)

    def world(self, index: int) -> World:
        """Return a copy of a world, in the moment before its brigades look."""
        (index,) = self._indices((index,))
        copied = self._worlds[index].copy()
        clock = self._bound[index].clock
        copied.seed, copied.step_number = int(clock[SEED]), int(clock[STEP])
        return copied

    def digest(self) -> str:
        """Return a digest of the states of all worlds: equal where all that is yet to come is equal."""
        found = hashlib.sha256()
        for index in range(self.n):
            found.update(self._state_digest(index).encode())
        return found.hexdigest()

    def _state_digest(self, index: int) -> str:
        return self.world(index).digest()

    def snapshot(self) -> bytes:
        """Return the states of all worlds, to be restored here or in other worlds of the same scenarios."""
        head = {
            "format": _SNAPSHOT,
            "scenarios": [built.scenario.digest for built in self._built],
            "layouts": [built.start.packing.digest for built in self._built],
            "base": self.seeds.base,
            "test": self.seeds.test,
        }
        arrays: dict[str, Any] = {
            "head": np.array(json.dumps(head)),
            "clock": np.stack([bound.clock for bound in self._bound]),
            "episode": self.episode,
            "playing": self._playing,
            "ended": self._ended,
        }
        arrays |= {f"world{index}": world.memory for index, world in enumerate(self._worlds)}
        arrays |= self._recorder.held() if self._recorder is not None else {}
        data = io.BytesIO()
        np.savez(data, **arrays)
        return data.getvalue()

    def restore(self, snapshot: bytes) -> dict[str, Array]:
        """Bring all worlds into the states of a snapshot, their seeds included, and return what is seen of them.

        Raises:
            LogError: it is no snapshot, or one of other scenarios, or of another number of worlds.
        """
        wanted = self._snapshot_of(snapshot)
        if self._recorder is not None:
            check_held(wanted, wanted["clock"][:, STEP], self.n_brigades)
        self.seeds = Seeds(wanted["head"]["base"], test=wanted["head"]["test"])
        self.episode[:], self._ended[:] = wanted["episode"], wanted["ended"]
        for index, playing in enumerate(wanted["playing"].tolist()):
            self._place(index, playing, self._made(self._built[max(playing, 0)]))
            self._worlds[index].memory[:] = wanted[f"world{index}"]
            self._bound[index].clock[:] = wanted["clock"][index]
            if self._recorder is not None:
                self._recorder.restore(index, self._beginning(index), partial(self._state_digest, index), wanted)
        self._show(np.arange(self.n), begun=True)
        return observed(self._batch.shown, self.observation)

    def close(self) -> None:
        """End the threads, and the log of episodes.

        Raises:
            OutputError: the log cannot be written.
        """
        if self._recorder is not None:
            self._recorder.close()
        if self._pool is not None:
            self._pool.shutdown()
            self._pool = None

    def __reduce__(self) -> tuple[Any, ...]:
        given = {
            "observation": self.observation,
            "reward": self.reward,
            "own_targets": self.own_targets,
            "n_burning_max": self._n_burning_max,
            "steps": self._steps,
            "autoreset": self.autoreset,
            "threads": self._threads,
            "seeds": self.seeds,
            "first_worker": self._first_worker,
        }
        return _again, (self.scenarios, self.n, given, self.snapshot())

    def __deepcopy__(self, memo: dict[int, Any]) -> Worlds:
        make, arguments = self.__reduce__()
        copied: Worlds = make(*copy.deepcopy(arguments, memo))
        return copied

    def __repr__(self) -> str:
        names = ", ".join(dict.fromkeys(scenario.name for scenario in self.scenarios))
        return f"<Worlds {self.n} of {names}: {self.n_brigades} brigades, {self.observation}>"

    def _made(self, built: BuiltScenario) -> World:
        return built.world(seed=0, n_steps_max=self._steps)

    def _scenario_of(self, index: int, episode: int) -> int:
        return (index + episode) % len(self._built)

    def _place(self, index: int, playing: int, world: World) -> None:
        """Let a world be of another scenario, unless it is already."""
        if self._playing[index] == playing or playing < 0:
            return
        self._playing[index] = playing
        self._worlds[index] = world
        self._bound[index] = world.bound(self._team)
        self._rows[index] = self._bound[index].row

    def _beginning(self, index: int) -> Beginning:
        """Return the episode that begins in a world, for its record."""
        clock, playing, episode = self._bound[index].clock, int(self._playing[index]), int(self.episode[index])
        return Beginning(playing, episode, self.seeds.base, int(clock[SEED]), int(clock[STEP]))

    def _environment(self) -> Environment:
        """Return what is played in, for the log of episodes."""
        return ENVIRONMENT.with_settings(
            {
                "observation": self.observation,
                "reward": self.reward.kind if isinstance(self.reward.kind, str) else "function",
                "own_targets": self.own_targets,
                "steps": self._steps or 0,
                "n_worlds": self.n,
                "first_worker": self._first_worker,
                "test_seeds": self.seeds.test,
                "autoreset": self.autoreset.name.lower().replace("_", "-"),
            }
        )

    def _next_episode(self, which: Array) -> None:
        for index in which.tolist():
            self.episode[index] += 1
            worker, episode = self._first_worker + index, int(self.episode[index])
            playing = self._scenario_of(index, episode)
            built = self._built[playing]
            if self._playing[index] != playing:
                self._place(index, playing, self._made(built))
            world = self._worlds[index]
            world.memory[:] = built.start.packing.memory
            clock = self._bound[index].clock
            clock[SEED], clock[STEP], clock[LAST_STEP] = self.seeds.seed(worker, episode), 0, world.n_steps_max
            if self._recorder is not None:
                self._recorder.begin(index, self._beginning(index))
        self._ended[which] = False
        self._show(which, begun=False)

    def _show(self, which: Array, *, begun: bool) -> None:
        view = self._batch.shown
        for index in which.tolist():
            world = self._worlds[index]
            view.frame[index] = world.start.frame
            for absent in (view.state[index, world.n_brigades :], view.own[index, world.n_brigades :]):
                absent[...] = -1
            view.mask[index, world.n_brigades :] = 0
            view.mask[index, world.n_brigades :, 0] = 1
            for nothing in (view.features, view.alive, view.chooses):
                nothing[index, world.n_brigades :] = 0
        self._in_kernel(lambda rows, batch, some: show_worlds(rows, batch, some, begun), which)
        score = self._batch.result.score[which]
        self._share[which] = score[:, 0] / score[:, 1]

    def _in_kernel(self, kernel: Callable[[Array, Array, Array], object], which: Array) -> None:
        """Let a kernel work on worlds, in threads if there are any."""
        if self._pool is None or len(which) < 2 * self._threads:
            kernel(self._rows, self._batch_row, which)
            return
        parts = np.array_split(which, self._threads)
        for done in [self._pool.submit(kernel, self._rows, self._batch_row, part) for part in parts]:
            done.result()

    def _checked(self, actions: object) -> Array:
        shape, view = (self.n, self.n_brigades), self._batch.shown
        array = np.asarray(actions)
        if array.shape != shape or array.dtype.kind not in "iu":
            got = f"{array.dtype} {array.shape}"
            raise ArgumentError(expected("step", "actions", f"whole numbers {shape}", got))
        out_of_range = (array < 0) | (array >= self.n_actions)
        if out_of_range.any():
            world, brigade = np.argwhere(out_of_range)[0].tolist()
            where = f"world {world}, brigade {brigade}"
            raise ArgumentError(
                expected("step", where, f"an action from 0 to {self.n_actions - 1}", int(array[world, brigade]))
            )
        if self.own_targets:
            allowed = np.take_along_axis(view.mask, array[:, :, None].astype(np.int64), axis=2)[:, :, 0]
            forbidden = (allowed == 0) & (view.chooses != 0) & ~self._ended[:, None]
            if forbidden.any():
                world, brigade = np.argwhere(forbidden)[0].tolist()
                where = f"world {world}, brigade {brigade}"
                wanted = "an action that its action_mask allows"
                raise ArgumentError(expected("step", where, wanted, int(array[world, brigade])))
        return array

    def _indices(self, indices: Iterable[int]) -> Array:
        found = [whole_number("index", index, least=0, most=self.n - 1) for index in indices]
        return np.array(found, dtype=np.int64)

    def _info(self) -> dict[str, Any]:
        result = self._batch.result
        return {
            "seed": result.seed.copy(),
            "episode": self.episode.copy(),
            "step": result.step.copy(),
            "score": result.score[:, 0].copy(),
            "score_share": result.score[:, 0] / result.score[:, 1],
            "counts": result.counts.copy(),
        }

    def _snapshot_of(self, snapshot: bytes) -> dict[str, Any]:
        """Return the arrays and the head of a snapshot that fits these worlds."""
        try:
            held: dict[str, Any] = dict(read_npz(io.BytesIO(snapshot)))
            head = json.loads(str(held["head"]))
            Seeds(head["base"], test=bool(head["test"]))
            if head["format"] != _SNAPSHOT:
                raise ValueError("another format")  # noqa: TRY301 - what the handler is for
        except (ValueError, KeyError, TypeError, RecursionError) as error:
            raise LogError(expected("snapshot", "", "the bytes of a snapshot", str(error) or "others")) from None
        digests = [built.scenario.digest for built in self._built]
        if head.get("scenarios") != digests:
            raise LogError(expected("snapshot", "scenarios", "those of these worlds", "others"))
        if head.get("layouts") != [built.start.packing.digest for built in self._built]:
            raise LogError(expected("snapshot", "", "one of this version of fireworld", "one of another"))
        n = self.n
        shapes = {"clock": (n, 3), "episode": (n,), "playing": (n,), "ended": (n,)}
        for name, shape in shapes.items():
            if name not in held or held[name].shape != shape:
                raise LogError(expected("snapshot", name, f"{shape} numbers", getattr(held.get(name), "shape", "none")))
        playing, episode, clock = held["playing"], held["episode"], held["clock"]
        if (
            not all(array.dtype == np.int64 for array in (playing, episode, clock))
            or not ((playing >= -1) & (playing < len(digests))).all()
            or not ((episode >= -1) & (episode < EPISODES_MAX)).all()
            or not ((clock >= 0) & (clock < 1 << 32)).all()
        ):
            raise LogError(expected("snapshot", "", "numbers that fit these worlds", "others"))
        for index, number in enumerate(playing.tolist()):
            memory, wanted = held.get(f"world{index}"), self._built[max(number, 0)].start.packing.memory
            if memory is None or memory.dtype != np.uint8 or memory.shape != wanted.shape:
                raise LogError(expected("snapshot", f"world{index}", f"{wanted.nbytes} bytes", "others"))
        return {**held, "head": head}


def worlds(
    scenarios: SCENARIO | Sequence[SCENARIO],
    n: int = 1,
    *,
    observation: str = "features",
    reward: str | Callable[..., Any] = "score",
    own_targets: int = 0,
    n_burning_max: int = 64,
    steps: int | None = None,
    autoreset: Autoreset | object = Autoreset.NEXT_STEP,
    threads: int = 1,
    seeds: Seeds | int = 0,
    first_worker: int = 0,
    record: str | os.PathLike[str] | None = None,
    set: Mapping[str, Any] | None = None,
) -> Worlds:
    """Return n worlds that the caller steps at once.

    Args:
        scenarios: a shipped name, a YAML file, a Scenario, or the keys and values of one; or several: world i plays
            number (i + episode) modulo their number. All choices are simultaneous, whatever a scenario says: learners
            see what the others did in the last step.
        n: how many, from 1 to 2048.
        observation: "features", "targets" or "graph": `fireworld.envs.view.OBSERVATIONS`.
        reward: "score", the change of score / maximal score; "stock" or "change", the scenario's terms; or a
            function of what the step came to, that returns (n,) numbers: see `fireworld.envs.rewards`.
        own_targets: how many burning buildings of its site a brigade may name as its own target.
        n_burning_max: of "graph", how many burning buildings there is room for.
        steps: the last step; None: each scenario's.
        autoreset: when a world that has ended begins anew; or Gymnasium's AutoresetMode.
        threads: that step the worlds.
        seeds: of the episodes; or the base that they follow from.
        first_worker: number of the first world among those of several processes, so that no two share seeds.
        record: the log to write, with the seed and the actions of every episode, from which each can be replayed in
            full; or an existing folder for logs. Copies and pickles do not record.
        set: keys of the scenarios with other values, as in {"brigades.n": 7}.

    Raises:
        ScenarioError, CityError: a scenario cannot be had or built.
        ArgumentError: an argument that makes no sense.
        OutputError: the log cannot be made.
    """
    n = whole_number("n", n, least=1, most=WORKERS_MAX)
    several = scenarios if isinstance(scenarios, Sequence) and not isinstance(scenarios, str) else [scenarios]
    if not several:
        raise ArgumentError(expected("scenarios", "", "one at least", "none"))
    values = settings_of(set)
    return Worlds(
        [find_scenario(one).with_values({**values, "choices": "simultaneous"}) for one in several],
        n,
        observation=observation_of(observation),
        reward=reward_of(reward),
        own_targets=whole_number("own_targets", own_targets, least=0, most=10_000),
        n_burning_max=whole_number("n_burning_max", n_burning_max, least=1, most=1_000_000),
        steps=last_step_of(steps),
        autoreset=_autoreset_of(autoreset),
        threads=whole_number("threads", threads, least=1, most=64),
        seeds=seeds if isinstance(seeds, Seeds) else Seeds(seed_of(seeds, name="seeds")),
        first_worker=whole_number("first_worker", first_worker, least=0, most=WORKERS_MAX - n),
        record=record,
    )


def _autoreset_of(value: object) -> Autoreset:
    """Return a mode of ours, of Gymnasium's, or by its name."""
    named = getattr(value, "value", value)
    for mode in Autoreset:
        if named in (mode.value, mode.name, mode.name.lower().replace("_", "-")):
            return mode
    wanted = ", ".join(f"Autoreset.{mode.name}" for mode in Autoreset)
    raise ArgumentError(expected("autoreset", "", f"one of {wanted}", value))


def _again(scenarios: Sequence[Scenario], n: int, given: dict[str, Any], snapshot: bytes) -> Worlds:
    """Make worlds again of what a pickle holds."""
    made = Worlds(scenarios, n, **given)
    made.restore(snapshot)
    return made
