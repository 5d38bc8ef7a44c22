"""A world bound to those who act in it: all arrays that a kernel takes, and the row that says where they are."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Final

import numpy as np

from fireworld.kernels.addresses import address_row
from fireworld.kernels.arrays import Array, FireState, Learner, PolicyArrays, Seen
from fireworld.kernels.assignment import fresh_assignment
from fireworld.kernels.choice import ALLOCATE, ASSIGN, RANK_ALL, RANK_NAMED
from fireworld.kernels.episode_arrays import LAST_STEP, SEED, STEP, Scratch
from fireworld.kernels.observation import N_ACTIONS, N_FEATURES
from fireworld.kernels.ranking import N_OF_BUILDING
from fireworld.kernels.ranks import fresh_ranks, fresh_room
from fireworld.kernels.sharing import fresh_shares
from fireworld.kernels.warmth import fresh_warmth
from fireworld.simulation.state import NO_LEARNER


@dataclass(frozen=True)
class Bound:
    """What kernels take of a world on its way; its arrays must outlive the row."""

    policy: PolicyArrays
    learner: Learner
    seen: Seen
    scratch: Scratch
    clock: Array  # (3,) int64: seed, last step done, last step to do
    row: Array  # (k,) int64, of an `Episode`

    def run(self, seed: int, step: int, last_step: int) -> int:
        """Run the steps after `step` up to the last one, or until nothing burns; return the last step run."""
        self.clock[SEED], self.clock[STEP], self.clock[LAST_STEP] = seed, step, last_step
        _run_episode()(self.row)
        return int(self.clock[STEP])


@cache
def _run_episode() -> Callable[[Array], None]:
    """Return the largest kernel: it is imported only where it is used, and once."""
    from fireworld.kernels.episode import run_episode

    kernel: Callable[[Array], None] = run_episode
    return kernel


def bind(
    city_row: Array,
    state_row: Array,
    fire: FireState,
    policy: PolicyArrays,
    learner: Learner = NO_LEARNER,
    seen: Seen | None = None,
    *,
    describes: bool = False,
) -> Bound:
    """Bind a world to those who act in it.

    Args:
        city_row: address row of the city and the constants.
        state_row: of the world's state.
        fire: of the world; its arrays are as long as those that kernels write on.
        policy: the team.
        learner: what learns.
        seen: where it is noted what the brigades see and choose; None: nowhere.
        describes: there is room for the features of buildings, even if the team does not rank them.
    """
    scratch, clock = fresh_scratch(policy, fire, describes=describes), np.zeros(3, dtype=np.int64)
    noted = NOTHING_SEEN if seen is None else seen
    learner_row = _NO_LEARNER_ROW if learner is NO_LEARNER else address_row(learner)
    noted_row = _NOTHING_SEEN_ROW if noted is NOTHING_SEEN else address_row(noted)
    rows = address_row(policy), learner_row, noted_row, address_row(scratch)
    clock_row = clock.__array_interface__["data"][0], len(clock)
    return Bound(policy, learner, noted, scratch, clock, np.concatenate((city_row, state_row, *rows, clock_row)))


def fresh_scratch(policy: PolicyArrays, fire: FireState, *, describes: bool) -> Scratch:
    """Return what the steps of a team write on; arguments as of `bind`."""
    n_brigades, n_buildings = len(policy.kind), len(fire.energy)
    ranks, shares, assigns = (
        bool(np.isin(policy.kind, kinds).any()) for kinds in ((RANK_NAMED, RANK_ALL), ALLOCATE, ASSIGN)
    )
    seen, work = fresh_room(policy.network)
    n_described = n_buildings if describes or ranks or assigns else 0
    return Scratch(
        features=np.zeros(N_FEATURES, dtype=np.int64),
        action_before=np.zeros(n_brigades, dtype=np.int32),
        target_before=np.zeros(n_brigades, dtype=np.int32),
        values=np.zeros(N_ACTIONS + 1),
        described=np.zeros((n_described, N_OF_BUILDING)),
        described_at=np.full(n_described, -1),
        ranks=fresh_ranks(n_brigades, n_buildings if ranks else 0),
        shares=fresh_shares(n_brigades if shares else 0, n_buildings if shares else 0),
        assignment=fresh_assignment(n_brigades if assigns else 0, n_buildings if assigns else 0),
        warmth=fresh_warmth(n_buildings, fire.air.shape),
        seen=seen,
        work=work,
    )


def fresh_seen(n_brigades: int) -> Seen:
    """Return room for what the brigades see and choose in a step; 0 brigades: nothing is noted."""
    return Seen(
        features=np.zeros((n_brigades, N_FEATURES), dtype=np.int64),
        state=np.zeros(n_brigades, dtype=np.int64),
        site=np.zeros(n_brigades, dtype=np.int32),
        choice=np.zeros(n_brigades, dtype=np.uint8),
        explored=np.zeros(n_brigades, dtype=np.uint8),
        action_values=np.zeros((n_brigades, N_ACTIONS)),
        target_value=np.zeros(n_brigades),
        valued=np.zeros(2, dtype=np.uint8),
    )


NOTHING_SEEN: Final = fresh_seen(0)
_NO_LEARNER_ROW: Final = address_row(NO_LEARNER)
_NOTHING_SEEN_ROW: Final = address_row(NOTHING_SEEN)
