"""What a training log holds of an episode that somebody else's learner played in an environment of fireworld's.

A field number is for ever.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Final, NamedTuple

import numpy as np

from fireworld.arguments import RUN_SEED_MAX, SEED_MAX
from fireworld.errors import LogError
from fireworld.records import ACTION_NAMES, ACTIONS, Array, column, value
from fireworld.training.seeds import EPISODES_MAX, WORKERS_MAX

OWN: Final = len(ACTIONS)
"""The action of a brigade that names its target itself."""
NOTHING: Final = OWN + 1
"""Recorded of a brigade that had nothing to choose."""
STEP_MAX: Final = 1_000_000
DIGEST_BYTES: Final = 32


class Decided(NamedTuple):
    """What the brigades of an episode did from its start on; t steps."""

    action: Array  # (t, b) int32: 0..3 as named, 4 its own target, -1 nothing to choose
    target: Array  # (t, b) int32: the building that a brigade named itself, -1 none


@dataclass(frozen=True)
class Played:
    """An episode that somebody else's learner played: how it went, and what each brigade did in every step.

    Actions go brigade by brigade, and through the steps of the episode for each. With the scenario and the seeds they
    are all that a replay needs. An episode that began in the middle, in a fork or a snapshot of another one, has the
    actions before that, too; where nobody knows them it has the digest of the state instead, and cannot be replayed.
    """

    topic: ClassVar[str] = "/played"
    scenario: int = value(1, "sfixed32", "its scenario, a position in /plan")
    world: int = value(2, "sfixed32", "the world that it was played in, counted through all processes that learn")
    episode: int = value(3, "sfixed32", "its number among those of the world, from 0")
    base: int = value(4, "fixed64", "what the seeds of the world's episodes follow from")
    seed: int = value(5, "fixed64", "of its random draws, from the first step on")
    seed_given: bool = value(
        6, "bool", "it does not follow from the base: in forks and snapshots, and where one was given"
    )
    first_step: int = value(7, "sfixed32", "the step after which the learner began; 0: at the start")
    state: bytes = value(
        8, "bytes", "SHA-256 of the state that the learner began in, where what was done before is not known; or empty"
    )
    n_steps: int = value(9, "sfixed32", "steps that the learner played")
    terminated: bool = value(10, "bool", "nothing burned any more")
    truncated: bool = value(
        11, "bool", "the last step was done, and something burned; an episode that is neither was left by the learner"
    )
    total_reward: float = value(12, "double", "sum of the rewards of the team that the learner got")
    score: float = value(13, "double", "official score of the paper's time, at the end")
    score_max: float = value(14, "double", "number of civilians + 1")
    n_burnt_out: int = value(15, "sfixed32", "buildings with code 8 at the end")
    n_civilians_alive: int = value(16, "sfixed32", "civilians with HP > 0 at the end")
    action: Array = column(
        17,
        "uint8",
        "what it did; 4 it named a target, 5 it had nothing to choose",
        per="choice",
        names=(*ACTION_NAMES, "none"),
    )
    target: Array = column(18, "sfixed32", "the buildings that were named, in the order of the actions 4", per="choice")
    later_step: Array = column(19, "sfixed32", "steps after which a fork went on with another seed, rising", per="seed")
    later_seed: Array = column(20, "fixed64", "these seeds", per="seed")

    @property
    def left(self) -> bool:
        """Whether the learner left it before its end."""
        return not (self.terminated or self.truncated)

    @property
    def replayable(self) -> bool:
        """Whether all is known that was done from the start on."""
        return not self.state

    @property
    def last_step(self) -> int:
        """The last step that was played."""
        return self.first_step + self.n_steps

    @property
    def n_known(self) -> int:
        """How many steps are known, from the start on, or only those that the learner played."""
        return self.last_step if self.replayable else self.n_steps

    @property
    def seeds(self) -> dict[int, int]:
        """The seeds by the step after which each counts."""
        return {0: self.seed} | dict(zip(self.later_step.tolist(), self.later_seed.tolist(), strict=True))

    def decided(self, n_brigades: int) -> Decided:
        """Return what the brigades did, from the first step that is known on; it fits that many brigades."""
        n, named = self.n_known, self.action == OWN
        action, target = self.action.astype(np.int32), np.full(len(self.action), -1, dtype=np.int32)
        target[named] = self.target
        action[action == NOTHING] = -1
        return Decided(*(np.ascontiguousarray(one.reshape(n_brigades, n).T) for one in (action, target)))


def columns_of(decided: Decided) -> dict[str, Array]:
    """Return what the brigades did as the columns of an episode."""
    action, target = (one.T.ravel() for one in decided)
    return {"action": np.where(action < 0, NOTHING, action).astype(np.uint8), "target": target[action == OWN]}


def check_played(played: Played, n_brigades: int) -> None:
    """Check that an episode of so many brigades can be what is recorded of it.

    Raises:
        LogError: it cannot.
    """
    steps, seeds = played.later_step, [played.seed, *played.later_seed.tolist()]
    fits = (
        0 <= played.world < WORKERS_MAX
        and 0 <= played.episode < EPISODES_MAX
        and 0 <= played.first_step < STEP_MAX
        and 0 < played.n_steps < STEP_MAX
        and len(played.state) in {0, DIGEST_BYTES}
        and len(steps) == len(played.later_seed)
        and played.base <= SEED_MAX
        and max(seeds) <= RUN_SEED_MAX
        and (np.diff(steps, prepend=0) > 0).all()
        and max(steps, default=0) <= played.first_step
        and (played.seed_given or not (played.first_step or played.state or len(steps)))
    )
    if not fits:
        raise LogError(f"{Played.topic}: an episode that cannot have begun or ended so")
    n = played.n_known
    if len(played.action) != n_brigades * n or len(played.target) != int((played.action == OWN).sum()):
        raise LogError(f"{Played.topic}: its actions are not those of {n_brigades} brigades and {n} steps")
    if played.action.max() > NOTHING or played.target.min(initial=0) < 0:
        raise LogError(f"{Played.topic}: an action or a target that there is not")
