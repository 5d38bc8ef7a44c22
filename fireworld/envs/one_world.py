"""One world whose brigades decide one after another, or one of them among others that follow a policy."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Final, Self

import numpy as np

from fireworld.envs.actions import checked_action
from fireworld.envs.autoreset import Autoreset
from fireworld.envs.many_worlds import Stepped, Worlds, again
from fireworld.envs.setup import Setup
from fireworld.kernels.batch import look_again, take_turn
from fireworld.kernels.deciding import decide_by_policy
from fireworld.kernels.observation import N_FEATURES
from fireworld.policy.asking import begin
from fireworld.policy.kernel import KernelPolicy
from fireworld.policy.protocol import Policy
from fireworld.simulation.choices import Made
from fireworld.training.seeds import Seeds

_WORLD: Final = 0


class OneWorld(Worlds):
    """One world, which begins anew when the caller says so.

    Args:
        setup: what it is made of.
        seeds: of its episodes.
        worker: who plays it, among those that share the seeds.
        others: the policy of brigades that the caller does not decide for.
    """

    def __init__(self, setup: Setup, *, seeds: Seeds, worker: int, others: Policy | None = None) -> None:
        known = others if isinstance(others, KernelPolicy) else None
        super().__init__(
            setup, 1, autoreset=Autoreset.DISABLED, threads=1, seeds=seeds, first_worker=worker, others=known
        )
        self._asked = None if known is not None else others

    @property
    def over(self) -> bool:
        """Whether it has ended, or never begun."""
        return bool(self._ended[_WORLD])

    def take_turn(self, brigade: int, action: object) -> None:
        """Let a brigade decide; the next one, and whoever looks from here on, sees what it does.

        Raises:
            ArgumentError: there is no such action, or the mask forbids it; nothing has changed then.
        """
        number = checked_action(action, self._bound.shown, brigade)
        self._bound.batch.actions[_WORLD, brigade] = number
        take_turn(self._bound.rows[_WORLD], self._bound.batch_row, _WORLD, brigade)

    def look(self, brigade: int) -> None:
        """Let a brigade see what the others have decided by now."""
        look_again(self._bound.rows[_WORLD], self._bound.batch_row, _WORLD, brigade)

    def finish_turns(self) -> Stepped:
        """Run the step in which all brigades have taken their turns."""
        return self._run(lambda which: self._bound.step(which, decided=True))

    def begin_among_others(self, brigade: int) -> None:
        """Let those decide that do so before a brigade, in the first step of an episode.

        Raises:
            PolicyError: the policy fails.
        """
        self.begin_policy()
        self._decide_before(brigade)

    def begin_policy(self) -> None:
        """Let a policy that kernels do not know prepare for an episode; PolicyError if it fails."""
        if self._asked is not None:
            world = self._bound.world(_WORLD)
            begin(self._asked, world.city_arrays, n_brigades=world.n_brigades, seed=world.seed)

    def step_among_others(self, brigade: int, action: object) -> Stepped:
        """Run a step in which a brigade does what is given, and the others what their policy says.

        Raises:
            ArgumentError: there is no such action, or the mask forbids it.
            PolicyError: the policy fails; the step can be tried again, or the world must be reset if it was run.
        """
        before = self._choices()
        self.take_turn(brigade, action)
        others = range(brigade + 1 if self._in_turn else 0, len(before.action))
        self._decide([other for other in others if other != brigade], before)
        stepped = self.finish_turns()
        try:
            self._decide_before(brigade)
        except BaseException:  # the step is done: it cannot be tried again
            self._ended[_WORLD] = True
            raise
        return stepped

    @property
    def _in_turn(self) -> bool:
        return bool(self._bound.world(_WORLD).constants.observation.in_turn)

    def _decide_before(self, brigade: int) -> None:
        """Let the brigades before one decide, and this one see it; not if nobody sees what others decide."""
        if self._in_turn and not self.over:
            self._decide(range(brigade), self._choices())
            self.look(brigade)

    def _choices(self) -> Made:
        return Made.of(self._bound.world(_WORLD).state.brigades)

    def _decide(self, brigades: Sequence[int], before: Made) -> None:
        """Let brigades decide by the policy; if it fails, all have decided what they had `before`."""
        if self._asked is None:
            chosen = np.array(brigades, dtype=np.int64)
            decide_by_policy(self._bound.rows[_WORLD], chosen, before.action, before.target)
            return
        world, features = self._bound.world(_WORLD), np.zeros(N_FEATURES, dtype=np.int64)
        world.step_number += 1
        try:
            for brigade in brigades:
                world.ask(brigade, self._asked, before.action, before.target, features)
        except BaseException:
            before.put_back(world.state.brigades)
            raise

    def __reduce__(self) -> tuple[Any, ...]:
        others = self._others if self._asked is None else self._asked
        options = {"seeds": self.seeds, "worker": self._first_worker, "others": others}
        return again, (type(self), (replace(self.setup, record=None),), options, self.snapshot())

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        copied = super().__deepcopy__(memo)
        vars(copied)["_asked"] = copy.deepcopy(self._asked, memo)  # it may remember earlier steps
        return copied
