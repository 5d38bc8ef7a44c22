"""Policies that the compiled episode follows by itself: fixed actions, random, tables, rankings and networks."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fireworld.kernels.arrays import Array, CityArrays, NetworkArrays, PolicyArrays, Seen
from fireworld.kernels.assignment import assign_target, fresh_assignment, settle
from fireworld.kernels.choice import (
    ALLOCATE,
    ASSIGN,
    FIXED,
    GIVEN,
    RANDOM,
    RANK_ALL,
    RANK_NAMED,
    TABLE,
    choose,
    explores,
    keeps_choice,
    table_state,
)
from fireworld.kernels.learning import EXPLORED, KEPT, NO_CHOICE
from fireworld.kernels.ranking import N_WEIGHTS
from fireworld.kernels.ranks import fresh_ranks, fresh_room, rank
from fireworld.kernels.sharing import allocate, fresh_shares
from fireworld.policy.protocol import Action, Decision, Observation, Policy
from fireworld.records import ACTIONS

NO_TABLES: Final = np.zeros((1, 1, 4))
NO_NETWORK: Final = NetworkArrays(np.zeros(0, dtype=np.int64), np.zeros((0, 4), dtype=np.int64), np.zeros(0))


@dataclass
class KernelPolicy(Policy):
    """A policy as data: one implementation of the choice serves single steps and whole compiled episodes.

    Brigade b behaves as entry b modulo the length of `kinds`, so a policy fits any number of brigades.
    """

    kinds: tuple[int, ...]
    actions: tuple[int, ...]
    table_of: tuple[int, ...]
    tables: Array
    """(tables, states, 4) float64, states 4320 or 270."""
    epsilon: float = 0.0
    commit: int = 1
    """Steps for which a choice is repeated."""
    rankings: Array = field(default_factory=lambda: np.zeros((1, N_WEIGHTS)))
    """(rankings, 17) float64, weights."""
    network: NetworkArrays = NO_NETWORK
    """What values targets instead of a ranking, if it has layers."""
    stateless = True
    _ready: PolicyArrays | None = field(default=None, init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Raise ValueError for what the compiled episode and single steps would not do alike."""
        if self.commit > 1 and {RANK_NAMED, RANK_ALL, ALLOCATE, ASSIGN} & set(self.kinds):
            raise ValueError("what values targets chooses in every step: commit must be 1")

    def for_brigades(self, n_brigades: int) -> PolicyArrays:
        """Return the policy's arrays for a team."""
        turn = np.arange(n_brigades) % len(self.kinds)
        return PolicyArrays(
            kind=np.array(self.kinds, dtype=np.int32)[turn],
            action=np.array(self.actions, dtype=np.int32)[turn],
            table_of=np.array(self.table_of, dtype=np.int32)[turn],
            tables=np.ascontiguousarray(self.tables, dtype=np.float64),
            rankings=np.ascontiguousarray(self.rankings, dtype=np.float64),
            network=self.network,
            epsilon=np.array([self.epsilon]),
            commit=np.array([self.commit], dtype=np.int64),
        )

    def begin(self, city: CityArrays, n_brigades: int, seed: int) -> None:
        """Prepare for a run of a team."""
        del city, seed
        self._ready = self.for_brigades(n_brigades)

    def ready(self, n_brigades: int) -> PolicyArrays:
        """Return the arrays of the run begun, or of one that begins; another thread may be in a run of another team."""
        ready = self._ready
        if ready is None or len(ready.kind) != n_brigades:
            ready = self._ready = self.for_brigades(n_brigades)
        return ready

    def decide(self, observation: Observation) -> Decision:
        """Choose as the compiled episode does."""
        ready = self.ready(len(observation.known_targets))
        brigade, seed, step = observation.brigade, observation.seed, observation.step
        if ready.kind[brigade] in (RANK_NAMED, RANK_ALL):
            return _by_rank(observation, ready)
        if ready.kind[brigade] == ASSIGN:
            return _by_assignment(observation, ready)
        if ready.kind[brigade] == ALLOCATE:
            return _by_share(observation)
        action = int(choose(brigade, observation.state_index, ready, seed, step))
        if ready.kind[brigade] != TABLE:
            return Decision(action)
        explored = bool(explores(brigade, ready, seed, step))
        row = table_state(observation.state_index, ready.tables.shape[1])
        values = tuple(ready.tables[ready.table_of[brigade], row].tolist())
        return Decision(action, q_values=values, explored=explored, epsilon=float(ready.epsilon[0]))

    def keeps(self, brigade: int, last_action: int, step: int) -> bool:
        """Return whether a brigade repeats what it chose before."""
        return bool(keeps_choice(brigade, last_action, self.commit, step))

    @property
    def digest(self) -> str:  # type: ignore[override]  # no attribute to set, as in a user's class: it follows the data
        """SHA-256 of what the policy does."""
        content = hashlib.sha256(repr((self.kinds, self.actions, self.table_of, self.epsilon, self.commit)).encode())
        content.update(repr(self.tables.shape).encode() + np.ascontiguousarray(self.tables, dtype="<f8").tobytes())
        if {RANK_NAMED, RANK_ALL, ASSIGN} & set(self.kinds):
            content.update(np.ascontiguousarray(self.rankings, dtype="<f8").tobytes())
        if len(self.network.layer):
            for array, dtype in zip(self.network, ("<i8", "<i8", "<f8"), strict=True):
                content.update(np.ascontiguousarray(array, dtype=dtype).tobytes())
        return content.hexdigest()


def noted_decisions(
    ready: PolicyArrays, seen: Seen, action: Array, target: Array, last_target: Array
) -> tuple[Decision, ...]:
    """Return what the brigades decided in a step that a kernel ran, as `decide` would have.

    Args:
        ready: the policy's arrays.
        seen: what the kernel noted.
        action: (b,), what they do.
        target: (b,), what they go for.
        last_target: (b,), what they went for in the step before.
    """
    decisions = []
    for brigade, choice in enumerate(seen.choice.tolist()):
        kind, act = ready.kind[brigade], int(action[brigade])
        if choice == NO_CHOICE:
            decisions.append(Decision(-1))
        elif choice == KEPT:
            decisions.append(Decision(act, target=int(last_target[brigade])))
        elif kind in (RANK_NAMED, RANK_ALL, ASSIGN):
            own = int(target[brigade]) if kind != RANK_NAMED else None
            values = tuple(seen.action_values[brigade].tolist())
            decisions.append(Decision(act, target=own, q_values=values, value=float(seen.target_value[brigade])))
        elif kind == TABLE:
            values, epsilon = tuple(seen.action_values[brigade].tolist()), float(ready.epsilon[0])
            decisions.append(Decision(act, q_values=values, explored=choice == EXPLORED, epsilon=epsilon))
        elif kind in (GIVEN, ALLOCATE) and act == Action.OWN_TARGET:
            decisions.append(Decision(act, target=int(target[brigade])))
        else:
            decisions.append(Decision(act))
    return tuple(decisions)


def _by_rank(observation: Observation, ready: PolicyArrays) -> Decision:
    """Choose the target that a brigade values most, by its ranking or network."""
    brigade, values = observation.brigade, np.zeros(len(ACTIONS) + 1)
    own = bool(ready.kind[brigade] == RANK_ALL)
    action, target = rank(
        brigade,
        own,
        observation.step,
        observation.known_targets,
        ready.rankings[ready.table_of[brigade]],
        ready.network,
        observation.sight,
        fresh_ranks(len(ready.kind), len(observation.world.fire.energy)),
        *fresh_room(ready.network),
        values,
    )
    return _valued(int(action), int(target) if own else None, values)


def _by_assignment(observation: Observation, ready: PolicyArrays) -> Decision:
    """Choose the target that a brigade is assigned to together with those that have not chosen yet."""
    brigade, values = observation.brigade, np.zeros(len(ACTIONS) + 1)
    n_brigades, n_buildings = len(ready.kind), len(observation.world.fire.energy)
    action, target = assign_target(
        brigade,
        observation.constants.observation.in_turn,
        observation.step,
        observation.known_targets,
        ready.kind,
        ready.rankings[ready.table_of[brigade]],
        observation.sight,
        fresh_assignment(n_brigades, n_buildings),
        values,
    )
    return _valued(int(action), int(target), values)


def _valued(action: int, target: int | None, values: Array) -> Decision:
    """Return a decision with the values of the four actions' targets and of its own, (5,)."""
    *of_actions, value = values.tolist()
    return Decision(action, target=target, q_values=tuple(of_actions), value=value)


def settled_targets(observation: Observation, kind: Array) -> NDArray[np.int32]:
    """Return the (b,) targets of those that are not assigned together with a brigade, -1 for all others.

    `kind` (b,) is the policy's: who follows an assignment.
    """
    assignment = fresh_assignment(len(kind), 0)
    in_turn = observation.constants.observation.in_turn
    settle(observation.brigade, in_turn, observation.known_targets, kind, observation.sight, assignment)
    known: NDArray[np.int32] = assignment.known
    return known


def _by_share(observation: Observation) -> Decision:
    """Choose the target of a brigade that is shared out with the others."""
    city, world, free = observation.city, observation.world, observation.constants.brigades.free
    where = world.brigades, city.buildings, world.fire, city.geometry, world.sites
    shares = fresh_shares(len(world.brigades.hp), len(world.fire.energy))
    target = allocate(observation.brigade, observation.known_targets, free, *where, shares)
    return Decision(Action.OWN_TARGET, target=int(target))


def always(action: int) -> KernelPolicy:
    """Return the policy that always takes one action."""
    return KernelPolicy((FIXED,), (action,), (0,), NO_TABLES)


def each_another() -> KernelPolicy:
    """Return the policy in which brigade b always takes action b modulo 4."""
    n = len(ACTIONS)
    return KernelPolicy((FIXED,) * n, tuple(range(n)), (0,) * n, NO_TABLES)


def at_random() -> KernelPolicy:
    """Return the policy that takes every action with the same probability."""
    return KernelPolicy((RANDOM,), (0,), (0,), NO_TABLES)


def allocating() -> KernelPolicy:
    """Return the policy that shares brigades out among the fire sites; each goes for a building that no other does."""
    return KernelPolicy((ALLOCATE,), (0,), (0,), NO_TABLES)


def from_tables(tables: Array, *, epsilon: float = 0.0, commit: int = 1) -> KernelPolicy:
    """Return the policy that follows one table per brigade, (tables, 4320 or 270, 4) values."""
    n = len(tables)
    return KernelPolicy((TABLE,) * n, (0,) * n, tuple(range(n)), tables, epsilon, commit)


def from_rankings(rankings: Array, *, own_targets: bool) -> KernelPolicy:
    """Return the policy that follows one ranking of targets per brigade, or one for all, (rankings, 17) weights."""
    n = len(rankings)
    kind = RANK_ALL if own_targets else RANK_NAMED
    return KernelPolicy((kind,) * n, (0,) * n, tuple(range(n)), NO_TABLES, rankings=rankings)


def from_assignment(ranking: Array) -> KernelPolicy:
    """Return the policy that assigns brigades to targets by what one ranking says of them, (17,) weights."""
    return KernelPolicy((ASSIGN,), (0,), (0,), NO_TABLES, rankings=ranking[np.newaxis])


def from_network(network: NetworkArrays, *, own_targets: bool) -> KernelPolicy:
    """Return the policy of brigades that all value targets by one network."""
    return KernelPolicy((RANK_ALL if own_targets else RANK_NAMED,), (0,), (0,), NO_TABLES, network=network)


def given(n_brigades: int) -> PolicyArrays:
    """Return the arrays of a team that does what is written into them: `action`, and `table_of` for own targets."""
    return KernelPolicy((GIVEN,), (0,), (0,), NO_TABLES).for_brigades(n_brigades)
