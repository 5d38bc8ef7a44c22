"""The teams that docs/science.md compares: how each is made, training after training."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Final

import numpy as np

from benchmarks.learning_fires import N_THREADS, TESTS, Fires, shares
from fireworld.executors import AnyExecutor, in_this_process, threads, workers_for
from fireworld.kernels.arrays import Array
from fireworld.kernels.choice import FIXED
from fireworld.planning.planner import Planner
from fireworld.policy.asking import begin
from fireworld.policy.kernel import NO_TABLES, KernelPolicy, from_tables
from fireworld.policy.names import BUILT_IN
from fireworld.policy.protocol import Policy
from fireworld.policy.words import N_FLAG_VALUES, N_OWN, N_STATES, RADIX, features_of
from fireworld.records import ACTIONS
from fireworld.simulation.built import CityCache
from fireworld.training.curriculum import Curriculum, CurriculumStage, load_curriculum
from fireworld.training.method import Method
from fireworld.training.methods.sarsa import PAPER, Sarsa
from fireworld.training.methods.search import Search, SearchTrainer
from fireworld.training.training import Training, train_all

SEED_OF_DISTILLING: Final = 30_000
"""Above the seeds of all tests: the planner that teaches sees other random draws."""
N_BRIGADES: Final = 4
SEARCH: Final = Search()
HALF: Final = replace(SEARCH, n_candidates=36, n_best=9, n_fires=32)
"""A search with half as many fights."""


@dataclass(frozen=True)
class Size:
    """How much work the experiments are."""

    n_trainings: int = 20
    """Of the methods that claims are made about."""
    n_rivals: int = 20
    """Of those that they are compared with, where one training is like another."""
    n_trials: int = 3
    """Of the others."""
    search: Search = SEARCH
    half: Search = HALF
    n_episodes_max: int = 25
    """Of one scenario, where tables learn in many fires."""
    n_scenarios: int | None = None
    """Of the curricula, None for all."""


FULL: Final = Size()
FEW: Final = Search(n_generations=5, n_candidates=16, n_best=4, n_fires=8, n_steps_max=100)
QUICK: Final = Size(
    n_trainings=2,
    n_rivals=2,
    n_trials=1,
    search=FEW,
    half=replace(FEW, n_fires=4),
    n_episodes_max=3,
    n_scenarios=8,
)


@dataclass(frozen=True)
class Contestant:
    """A way to come by a team."""

    name: str
    what: str
    """In words, for the table."""
    n: int
    """Trainings; 1 for what does not learn."""
    make: Callable[[int, str], KernelPolicy | Policy]
    """From the number of the training, from 1, and the group of fires: the best joint assignment looks at them."""

    n_seeds: int | None = None
    """Seeds on each generated fire, None for all: fewer of what takes long."""


def contestants(
    size: Size, fires: Fires, folder: Path, cities: CityCache, executor: AnyExecutor = None
) -> list[Contestant]:
    """List all, rules first.

    Args:
        size: how much work.
        fires: by group.
        folder: where teams are kept.
        cities: cities built before.
        executor: who trains.
    """
    workshop = Workshop(size, folder, cities, executor)
    n, some, few = size.n_trainings, size.n_rivals, size.n_trials
    rules = [
        Contestant(rule, "rule", 1, lambda _, __, rule=rule: BUILT_IN[rule]())  # type: ignore[misc]  # of a lambda
        for rule in (*ACTIONS, "each-another", "random", "chief")
    ]
    rivals = [
        Contestant("paper-noncooperative", "SARSA as in the paper, 270 states", n, workshop.paper("alone")),
        Contestant("paper-cooperative", "SARSA as in the paper, 4320 states", n, workshop.paper()),
        Contestant("sarsa-fires-270", SARSA_WORDS.format(270), few, workshop.sarsa(cooperation=False)),
        Contestant("sarsa-fires-4320", SARSA_WORDS.format(4320), few, workshop.sarsa(cooperation=True)),
        Contestant("distilled-270", "the planner's values averaged in 270 states", 1, workshop.distilled(270)),
        Contestant("distilled-4320", "the planner's values averaged in 4320 states", 1, workshop.distilled(4320)),
        Contestant("linear-270", LINEAR_WORDS.format(270), few, workshop.linear(cooperation=False)),
        Contestant("linear-4320", LINEAR_WORDS.format(4320), few, workshop.linear(cooperation=True)),
        *(
            Contestant(
                f"{name}-{sight}",
                f"search with half the fights, {what}{words}",
                some,
                workshop.ranking(targets, sight, half=True),
            )
            for name, what, targets in (("named", "the paper's actions", "named"), ("own-half", "own targets", "own"))
            for sight, words in SIGHT_WORDS.items()
        ),
    ]
    return [
        *rules,
        Contestant(
            "best-joint",
            "the assignment of one action to each brigade that is best on these very fires",
            1,
            lambda _, group: best_joint(fires[group]),
        ),
        Contestant(
            "planner",
            "rollouts at run time; over `best-2026` it saves more",
            1,
            lambda _, __: Planner(),
            SEEDS_OF_PLANNER,
        ),
        *(replace(rival, n_seeds=SEEDS_OF_RIVALS) for rival in rivals),
        Contestant("own-alone", f"search, own targets{SIGHT_WORDS['alone']}", n, workshop.ranking("own", "alone")),
        Contestant(
            "own-cooperative",
            "search, own targets: how `best-2026` was made",
            n,
            workshop.ranking("own", "cooperative"),
        ),
    ]


SEEDS_OF_PLANNER: Final = 3
SEEDS_OF_RIVALS: Final = 5
SARSA_WORDS: Final = (
    "SARSA in {} states on the contested fires: reward change, one table, alpha .1, gamma .95, 4 steps a choice"
)
SIGHT_WORDS: Final = {"alone": ", nobody sees the others", "cooperative": ""}
LINEAR_WORDS: Final = "search with half the fights for a weighted sum of the paper's features: a table of {} states"


@dataclass(frozen=True)
class Trained:
    """Trains teams, several at once, and returns the policy of one; those that are trained already are read."""

    training: Callable[[int], Training]
    """From the number of the training."""
    executor: AnyExecutor
    """Who trains."""

    def __call__(self, number: int, group: str) -> KernelPolicy:
        """Return the policy of the team of a training."""
        del group
        (training,) = self.prepare([number])
        assert training.team is not None
        return training.team.policy()

    def prepare(self, numbers: Sequence[int]) -> list[Training]:
        """Train some teams, all at once, those that are not trained yet."""
        trainings = [self.training(number) for number in numbers]
        for training in trainings:
            training.resume()
        left = [training for training in trainings if training.team is None]
        if left and in_this_process(self.executor):
            train_all(left, jobs=workers_for(self.executor or N_THREADS).n)
        elif left:
            train_all(left, executor=self.executor)
        return trainings


@dataclass
class Workshop:
    """Where teams are made, or fetched if they were made before."""

    size: Size
    folder: Path
    cities: CityCache
    executor: AnyExecutor = None

    def curriculum(self, *, cooperation: bool = True) -> Curriculum:
        """Return the contested fires, both stages; without cooperation their tables have 270 states."""
        whole = load_curriculum("contested")
        stages = tuple(
            CurriculumStage(
                stage.name,
                cooperation,
                stage.scenarios[:: len(stage.scenarios) // (self.size.n_scenarios or len(stage.scenarios))],
            )
            for stage in whole.stages
        )
        return replace(whole, stages=stages)

    def ranking(self, targets: str, sight: str, *, half: bool = False) -> Trained:
        """Search as `fireworld train --method search` does."""
        name = f"{targets}-half-{sight}" if half else f"{targets}-{sight}"
        search = replace(
            self.size.half if half else self.size.search,
            own_targets=targets == "own",
            cooperation=sight == "cooperative",
        )

        curriculum = self.curriculum()
        return self._trained(name, curriculum, search)

    def paper(self, *stages: str) -> Trained:
        """Train as the paper does."""
        curriculum = load_curriculum("paper")
        curriculum = curriculum.only(stages) if stages else curriculum
        method = PAPER if self.size.n_scenarios is None else replace(PAPER, n_episodes_max=self.size.n_episodes_max)
        return self._trained("-".join(("paper", *stages)), curriculum, method)

    def sarsa(self, *, cooperation: bool) -> Trained:
        """Let SARSA learn in the contested fires, with what helped most elsewhere."""
        method = Sarsa(
            reward="change", shared_table=True, alpha=0.1, gamma=0.95, commit=4, n_episodes_max=self.size.n_episodes_max
        )
        return self._trained(
            f"sarsa-{cooperation}", self.curriculum(cooperation=cooperation).only(["contested"]), method
        )

    def _trained(self, name: str, curriculum: Curriculum, method: Method) -> Trained:
        def training(number: int) -> Training:
            trainer = method.trainer(curriculum, seed=number, cities=self.cities)
            return Training(trainer, self.folder / f"{name}-{number}.npz")

        return Trained(training, self.executor)

    def linear(self, *, cooperation: bool) -> Callable[[int, str], KernelPolicy]:
        """Search among the tables whose values are weighted sums of the paper's features."""

        def make(number: int, group: str) -> KernelPolicy:
            del group
            path = self.folder / f"linear-{cooperation}-{number}.npy"
            searcher = TableSearchTrainer(
                self.curriculum(), replace(self.size.half, cooperation=cooperation), seed=number, cities=self.cities
            )
            if not path.exists():
                for _ in searcher.run(threads(N_THREADS)):
                    pass
                np.save(path, searcher.progress.mean)
            return searcher.policy_of(np.load(path))

        return make

    def distilled(self, n_states: int) -> Callable[[int, str], KernelPolicy]:
        """Average what the planner thinks of each action, state by state; shrunk where it has seen little."""

        def make(number: int, group: str) -> KernelPolicy:
            del number, group
            path = self.folder / "planned.npy"
            if not path.exists():
                np.save(path, planned_values(self.curriculum(), self.cities))
            return from_tables(averaged(np.load(path), n_states)[np.newaxis], commit=4)

        return make


class TableSearchTrainer(SearchTrainer):
    """Searches for a table: its values are weighted sums of indicators of the features, and of pairs of the flags."""

    def free_weights(self) -> Array:
        """Return which weights are searched for."""
        shown = indicators()
        free = np.ones((shown.shape[1], len(ACTIONS)), dtype=np.bool_)
        if not self.method.cooperation:
            free[sum(RADIX[:N_OWN]) :] = False
        return free.ravel()

    def policy_of(self, weights: Array) -> KernelPolicy:
        """Return the policy of a table, with choices kept for 4 steps."""
        return from_tables(_times(indicators(), weights.reshape(-1, len(ACTIONS)))[np.newaxis], commit=4)


def _times(a: Array, b: Array) -> Array:
    """Multiply matrices term by term: the library's product differs from machine to machine."""
    product = np.zeros((len(a), b.shape[1]))
    for k in range(len(b)):
        product += a[:, k : k + 1] * b[k]
    return product


@cache
def indicators() -> Array:
    """Return for every state which values its features have, and which pairs of flags are set, (4320, k)."""
    columns = []
    features = np.array([features_of(state) for state in range(N_STATES)])
    for place, n_values in enumerate(RADIX[:N_OWN]):
        columns += [features[:, place] == value for value in range(n_values)]
    flags = range(N_OWN, len(RADIX))
    columns += [features[:, flag] == 1 for flag in flags]
    columns += [(features[:, one] == 1) & (features[:, other] == 1) for one, other in itertools.combinations(flags, 2)]
    return np.array(columns, dtype=np.float64).T


def planned_values(curriculum: Curriculum, cities: CityCache) -> Array:
    """Let the planner fight and note what it thinks: rows of a state and the values of the four actions, (k, 5)."""
    rows = []
    for number, scenario in enumerate(curriculum.stages[0].scenarios):
        world = cities.build(scenario).world(seed=SEED_OF_DISTILLING + number)
        teacher = Planner()
        begin(teacher, world.city_arrays, n_brigades=world.n_brigades, seed=world.seed)
        while not (world.terminated or world.truncated):
            choices = world.step(teacher)
            rows += [
                (state, *decision.q_values)
                for state, decision in zip(choices.state_index, choices.decisions, strict=True)
                if decision.action >= 0 and decision.q_values is not None
            ]
    return np.array(rows)


SHRINK: Final = 20.0
"""A state that was seen so often counts half for itself, half as the coarser state it is part of."""


def averaged(planned: Array, n_states: int) -> Array:
    """Return a table of a state's mean advantages, shrunk to those of coarser states, (n_states, 4)."""
    states = planned[:, 0].astype(int)
    advantage = planned[:, 1:] - planned[:, 1:].mean(axis=1, keepdims=True)
    features = np.array([features_of(state) for state in range(N_STATES)])
    keep = [[2], [2, 3], [0, 1, 2, 3]] + ([[*range(8)]] if n_states == N_STATES else [])
    table = np.zeros((N_STATES, len(ACTIONS)))
    for places in keep:
        _, group = np.unique(features[:, places], axis=0, return_inverse=True)
        total, count = np.zeros((group.max() + 1, len(ACTIONS))), np.zeros(group.max() + 1)
        np.add.at(total, group[states], advantage)
        np.add.at(count, group[states], 1.0)
        table = (total[group] + SHRINK * table) / (count[group] + SHRINK)[:, np.newaxis]
    return table if n_states == N_STATES else table[::N_FLAG_VALUES]


JOINT_SEEDS: Final = (101,)


def best_joint(stages: Sequence) -> KernelPolicy:  # type: ignore[type-arg]  # of BuiltScenario
    """Return the best of all 256 assignments of one action to each of four brigades, on these fires."""

    def policy(assignment: tuple[int, ...]) -> KernelPolicy:
        n = len(assignment)
        return KernelPolicy((FIXED,) * n, assignment, (0,) * n, NO_TABLES)

    seeds = JOINT_SEEDS if len(stages) > len(TESTS) else (101, 102, 103, 104)
    every = itertools.product(range(len(ACTIONS)), repeat=N_BRIGADES)
    return policy(max(every, key=lambda assignment: float(shares(stages, policy(assignment), seeds).mean())))
