"""Many worlds that the caller steps at once: the vector environment without any library."""

from __future__ import annotations

import copy
import hashlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, Self, Unpack

import numpy as np

from fireworld.arguments import RUN_SEED_MAX, ArgumentError, seed_of, whole_number
from fireworld.envs.actions import checked_actions
from fireworld.envs.autoreset import Autoreset, autoreset_of
from fireworld.envs.bound_worlds import BoundWorlds
from fireworld.envs.record import UNRECORDED, recorder_of
from fireworld.envs.rewards import score_share
from fireworld.envs.setup import Scenarios, Setup, SetupOptions, setup_of
from fireworld.envs.snapshots import fitting, pack, unpack, within
from fireworld.envs.views import observed
from fireworld.errors import LogError, expected
from fireworld.kernels.arrays import COUNTS, Array
from fireworld.kernels.observation import N_ACTIONS
from fireworld.policy.kernel import KernelPolicy
from fireworld.scenario import Scenario
from fireworld.simulation.built import BuiltScenario
from fireworld.simulation.world import World
from fireworld.training.seeds import EPISODES_MAX, WORKERS_MAX, Seeds

_FORM: Final = "fireworld-worlds/1"


@dataclass(frozen=True)
class Stepped:
    """What a step of n worlds came to.

    Attributes:
        observation: arrays by name, of n worlds each.
        reward: (n,) float64, of each team.
        terminated: (n,) bool, nothing burns any more.
        truncated: (n,) bool, the last step is done, and something burns.
        info: arrays of n worlds: seed, episode_number, step, score, score_share (score / maximal score), and how many
            buildings and civilians are in which state. Of worlds that were reset in this step, as after the reset.
        final_observation, final_info: where worlds were reset at the end of this step, the same before that; else None.
    """

    observation: dict[str, Array]
    reward: Array
    terminated: Array
    truncated: Array
    info: dict[str, Array]
    final_observation: dict[str, Array] | None = None
    final_info: dict[str, Array] | None = None


class Worlds:
    """n worlds of one or several scenarios, each at a step and an episode of its own; made by `worlds`.

    Attributes:
        setup: what they are made of.
        n: how many there are.
        n_brigades: of the largest team.
        n_buildings: of the largest city.
        autoreset: when a world that has ended begins anew.
        seeds: of the episodes.
        episode_number: (n,) of each world, 0 at first, -1 before that.
    """

    def __init__(
        self,
        setup: Setup,
        n: int,
        *,
        autoreset: Autoreset,
        threads: int,
        seeds: Seeds,
        first_worker: int,
        others: KernelPolicy | None = None,
    ) -> None:
        """Build the scenarios; `others`: the policy of brigades that the caller does not decide for."""
        self.setup, self.n, self.autoreset, self.seeds = setup, n, autoreset, seeds
        self._threads, self._first_worker, self._others = threads, first_worker, others
        self._built = setup.build()
        self.n_brigades = max(built.n_brigades for built in self._built)
        self.n_buildings = max(built.city.n_buildings for built in self._built)
        self.episode_number = np.full(n, -1, dtype=np.int64)
        self._ended = np.ones(n, dtype=np.bool_)
        self._share: Array = np.ones(n)
        playing = [self._scenario_of(index, 0) for index in range(n)]
        self._bound = BoundWorlds(setup, self._built, playing, threads=threads, others=others)
        self._recorder = recorder_of(
            self, setup, self._bound, self.scenarios, first_worker=first_worker, seeds=seeds, autoreset=autoreset
        )

    @property
    def scenarios(self) -> tuple[Scenario, ...]:
        """What is played: worker w plays number (w + episode) modulo their number."""
        return tuple(built.scenario for built in self._built)

    @property
    def n_actions(self) -> int:
        """Actions of a brigade: the paper's four, then those of its own targets."""
        return N_ACTIONS + self.setup.own_targets

    def reset(
        self,
        *,
        seed: int | None = None,
        indices: Iterable[int] | None = None,
        world_seeds: Sequence[int] | Array | None = None,
    ) -> dict[str, Array]:
        """Begin the next episode of worlds, and return what is seen of all.

        Args:
            seed: begin with episode 0 again, and seeds that follow from this base; None: with the next episode.
            indices: of the worlds, each once; None: all.
            world_seeds: of the random draws of each of them, to play an episode again; None: those that follow.

        Raises:
            ArgumentError: an argument that makes no sense.
        """
        which = self._indices(range(self.n) if indices is None else indices)
        base = None if seed is None else Seeds(seed_of(seed), test=self.seeds.test)
        given = None if world_seeds is None else _world_seeds_of(world_seeds, len(which))
        if base is not None:
            self.seeds = base
            self.episode_number[which] = -1
        self._next_episode(which, given)
        return self.observe()

    def step(self, actions: Array | Sequence[Sequence[int]]) -> Stepped:
        """Run one step of every world.

        Args:
            actions: (n, n_brigades) whole numbers: 0 to 3 are the paper's actions, 4 + j names the j-th building
                of the brigade's `own`. Of brigades that choose nothing they are ignored.

        Raises:
            ArgumentError: another shape, dtype or number; an action that the mask forbids; a world that has ended and
                is not reset by itself.
        """
        self.check_under_way()
        self._bound.batch.actions[...] = checked_actions(actions, self._bound.shown, playing=~self._ended)
        return self._run(self._bound.step)

    def observe(self) -> dict[str, Array]:
        """Return what is seen of all worlds now: `Stepped.observation`."""
        return observed(self._bound.shown, self.setup.observation)

    def info(self) -> dict[str, Array]:
        """Return what is known of all worlds now: `Stepped.info`."""
        result = self._bound.result
        return {
            "seed": result.seed.copy(),
            "episode_number": self.episode_number.copy(),
            "step": result.step.copy(),
            "score": result.score[:, 0].copy(),
            "score_share": score_share(result),
            **{name: result.counts[:, k].copy() for k, name in enumerate(COUNTS)},
        }

    def decisions(self) -> tuple[Array, Array]:
        """Return what the brigades did in the last step.

        Returns:
            (n, b) actions, 4 a target of their own, -1 nothing; and (n, b) indices of the buildings, -1 none.
        """
        return self._bound.result.action.copy(), self._bound.result.target.copy()

    def ended(self) -> Array:
        """Return which worlds are not under way, (n,) bool: they have ended, or never begun."""
        return self._ended.copy()

    def fork(self, source: int, target: int, *, seed: int | None = None) -> None:
        """Bring world `target` into the state of world `source`; its next episode is the one it would have had.

        Args:
            source: its index.
            target: the other's.
            seed: of the random draws from here on; None: the same, so that the same actions lead to the same end.

        Raises:
            ArgumentError: there is no such world, or it has not begun.
        """
        source, target = (int(self._indices((index,))[0]) for index in (source, target))
        if self.episode_number[source] < 0:
            raise ArgumentError(expected("fork", f"world {source}", "one that has begun", "one that has not"))
        chosen = None if seed is None else seed_of(seed)
        self._bound.copy(source, target)
        if chosen is not None:
            self._bound.draw_anew(target, chosen)
        self.episode_number[target], self._ended[target] = max(self.episode_number[target], 0), self._ended[source]
        self._recorder.fork(source, target, int(self.episode_number[target]), self.seeds.base)
        self._show(np.array([target]), begun=True)

    def world(self, index: int) -> World:
        """Return a copy of a world, in the moment when its brigades look."""
        return self._bound.world(*self._indices((index,)).tolist()).copy()

    def built(self, index: int) -> BuiltScenario:
        """Return the scenario that a world is of, as it is built."""
        return self._built[int(self._bound.playing[index])]

    def digest(self) -> str:
        """Return a digest of the states of all worlds: where it is equal, the same actions lead to the same end."""
        found = hashlib.sha256()
        for index in range(self.n):
            found.update(self._bound.world(index).digest().encode())
        return found.hexdigest()

    def graph(self, number: int = 0) -> dict[str, Array]:
        """Return what never changes of a scenario's city, for "graph"; n buildings.

        Args:
            number: of the scenario.

        Returns:
            x, y (n,), from 0 to 1 over the city as of brigades; link_ptr (n + 1,), link_building, link_share: to which
            buildings each one radiates, and which share; near_ptr (n + 1,), near_building: which are near enough to
            burn as one fire site.
        """
        start = self._built[whole_number("number", number, least=0, most=len(self._built) - 1)].start
        city, frame = start.city_arrays, start.frame
        return {
            "x": ((city.geometry.x - frame[0]) / frame[2]).astype(np.float32),
            "y": ((city.geometry.y - frame[1]) / frame[3]).astype(np.float32),
            **{f"link_{name}": getattr(city.links, name).copy() for name in ("ptr", "building", "share")},
            **{f"near_{name}": getattr(start.city.near, name).astype(np.uint32) for name in ("ptr", "building")},
        }

    def snapshot(self) -> bytes:
        """Return the states of all worlds, to be restored here or in other worlds of the same scenarios."""
        head = {**self._layout(), "base": self.seeds.base, "test": self.seeds.test}
        counters = {"episode_number": self.episode_number, "ended": self._ended}
        return pack(_FORM, head, {**counters, **self._bound.arrays(), **self._recorder.held()})

    def restore(self, snapshot: bytes) -> dict[str, Array]:
        """Bring all worlds into the states of a snapshot, their seeds included, and return what is seen of them.

        Raises:
            LogError: it is no snapshot, or one of other scenarios, or of another number of worlds.
        """
        head, held = unpack(_FORM, snapshot)
        for name, wanted in self._layout().items():
            if head.get(name) != wanted:
                raise LogError(expected("snapshot", name, "those of these worlds", "others"))
        seeds = seeds_in(head)
        number = within(held, "episode_number", self.episode_number, least=-1, most=EPISODES_MAX - 1)
        ended = fitting(held, "ended", self._ended)
        self._bound.check(held)
        self._recorder.leave_for(held)
        self.seeds = seeds
        self.episode_number[:], self._ended[:] = number, ended
        self._bound.take(held)
        self._share = score_share(self._bound.result)
        self._recorder.restore(held, number, seeds.base)
        return self.observe()

    def close(self) -> None:
        """End the threads, one does the work from here on; and the log of episodes (or raise OutputError)."""
        self._bound.close()
        self._recorder.close()

    def check_under_way(self) -> None:
        """Raise ArgumentError if a world has ended, and is not reset by itself in the next step."""
        by_itself = (self.episode_number >= 0) & (self.autoreset is Autoreset.NEXT_STEP)
        stuck = np.flatnonzero(self._ended & ~by_itself)
        if len(stuck):
            raise ArgumentError(expected("step", f"world {stuck[0]}", "one under way", "one that is not", "reset it"))

    def __reduce__(self) -> tuple[Any, ...]:
        options = {
            "autoreset": self.autoreset,
            "threads": self._threads,
            "seeds": self.seeds,
            "first_worker": self._first_worker,
            "others": self._others,
        }
        return again, (type(self), (replace(self.setup, record=None), self.n), options, self.snapshot())

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        copied = memo[id(self)] = type(self).__new__(type(self))
        own = {name: getattr(self, name).copy() for name in ("episode_number", "_ended", "_share")}
        vars(copied).update(vars(self) | own | {"_bound": self._bound.another(), "_recorder": UNRECORDED})
        return copied

    def __copy__(self) -> Self:
        return copy.deepcopy(self)

    def __repr__(self) -> str:
        names = ", ".join(dict.fromkeys(scenario.name for scenario in self.scenarios))
        return f"<Worlds {self.n} of {names}: {self.n_brigades} brigades, {self.setup.observation}>"

    def _layout(self) -> dict[str, Any]:
        """Return what must be equal for a snapshot to fit."""
        return {
            "scenarios": [built.scenario.digest for built in self._built],
            "layouts": [built.start.packing.digest for built in self._built],
        }

    def _run(self, run: Callable[[Array], object]) -> Stepped:
        """Run a step of the worlds that are under way, and begin the episodes that are due."""
        begins, runs, before = np.flatnonzero(self._ended), np.flatnonzero(~self._ended), self._share
        run(runs)
        self._recorder.ran(runs)
        result, reward = self._bound.result, np.zeros(self.n)
        self._share, self._ended = score_share(result), (result.terminated | result.truncated) != 0
        if len(runs):
            reward[runs] = self.setup.reward.of(result, before)[runs]  # it may fail: the step is done all the same
        self._recorder.got(reward)
        if len(begins):
            self._next_episode(begins)
        terminated, truncated = result.terminated.astype(np.bool_), result.truncated.astype(np.bool_)
        if self.autoreset is not Autoreset.SAME_STEP or not self._ended.any():
            return Stepped(self.observe(), reward, terminated, truncated, self.info())
        final_observation, final_info = self.observe(), self.info()
        self._next_episode(np.flatnonzero(self._ended))
        now = self.observe(), reward, terminated, truncated, self.info()
        return Stepped(*now, final_observation, final_info)

    def _scenario_of(self, index: int, episode: int) -> int:
        return (self._first_worker + index + episode) % len(self._built)

    def _next_episode(self, which: Array, world_seeds: Sequence[int] | None = None) -> None:
        for place, index in enumerate(which.tolist()):
            episode = int(self.episode_number[index]) + 1
            seed = self.seeds.seed(self._first_worker + index, episode) if world_seeds is None else world_seeds[place]
            self._bound.begin(index, self._scenario_of(index, episode), seed)
            self.episode_number[index], self._ended[index] = episode, False
            self._recorder.begin(index, episode, self.seeds.base, seed_given=world_seeds is not None)
        self._show(which, begun=False)

    def _show(self, which: Array, *, begun: bool) -> None:
        self._bound.show(which, begun=begun)
        self._share[which] = score_share(self._bound.result)[which]

    def _indices(self, indices: Iterable[int]) -> Array:
        found = [whole_number("index", index, least=0, most=self.n - 1) for index in indices]
        return np.array(list(dict.fromkeys(found)), dtype=np.int64)


def worlds(
    scenarios: Scenarios,
    n: int = 1,
    *,
    autoreset: Autoreset | object = Autoreset.NEXT_STEP,
    threads: int = 1,
    seeds: Seeds | int = 0,
    first_worker: int = 0,
    **options: Unpack[SetupOptions],
) -> Worlds:
    """Return n worlds that the caller steps at once.

    Args:
        scenarios: a shipped name, a YAML file, a Scenario, or the keys and values of one; or several: world i plays
            number (first_worker + i + episode) modulo their number. All choices are simultaneous, whatever a scenario
            says: learners see what the others did in the last step.
        n: how many, from 1 to 2048.
        autoreset: when a world that has ended begins anew; or Gymnasium's AutoresetMode.
        threads: that step the worlds.
        seeds: of the episodes; or the base that they follow from.
        first_worker: number of the first world among those of several processes, so that no two share seeds.
        options: what is seen and rewarded: `fireworld.envs.setup.SetupOptions`.

    Raises:
        ScenarioError, CityError: a scenario cannot be had or built.
        ArgumentError: an argument that makes no sense.
    """
    n = whole_number("n", n, least=1, most=WORKERS_MAX)
    return Worlds(
        setup_of(scenarios, choices="simultaneous", **options),
        n,
        autoreset=autoreset_of(autoreset),
        threads=whole_number("threads", threads, least=1, most=64),
        seeds=seeds if isinstance(seeds, Seeds) else Seeds(seed_of(seeds, name="seeds")),
        first_worker=whole_number("first_worker", first_worker, least=0, most=WORKERS_MAX - n),
    )


def _world_seeds_of(given: object, n: int) -> list[int]:
    """Return n seeds; ArgumentError if they are anything else."""
    if not isinstance(given, Sequence | np.ndarray) or np.shape(given) != (n,):
        raise ArgumentError(expected("reset", "world_seeds", f"{n}, one of each world", given))
    return [whole_number("world_seeds", one, least=0, most=RUN_SEED_MAX) for one in given]


def seeds_in(head: Mapping[str, Any]) -> Seeds:
    """Return the seeds of a snapshot; LogError if they make no sense."""
    try:
        return Seeds(head.get("base"), test=head.get("test") is True)  # type: ignore[arg-type]  # checked there
    except ArgumentError as error:
        raise LogError(f"snapshot: {error}") from None


def again(make: type[Worlds], arguments: tuple[Any, ...], options: dict[str, Any], snapshot: bytes) -> Worlds:
    """Make worlds again of what a pickle holds."""
    made = make(*arguments, **options)
    made.restore(snapshot)
    return made
