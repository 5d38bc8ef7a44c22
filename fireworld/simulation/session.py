"""A world whose loop the caller owns: observe, decide, step; saved, restored and copied at will."""

from __future__ import annotations

import io
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from fireworld.arguments import ArgumentError, last_step_of, seed_of, settings_of
from fireworld.errors import LogError, expected
from fireworld.npz import read_npz
from fireworld.outcome import Outcome
from fireworld.policy.asking import begin, plain_actions
from fireworld.policy.given import Given
from fireworld.policy.names import find_policy
from fireworld.policy.protocol import Observation, Policy
from fireworld.scenario import Scenario, find_scenario
from fireworld.simulation.built import BuiltScenario, build_scenario
from fireworld.simulation.state import named_arrays, restore_snapshot

_SNAPSHOT: Final = "fireworld-snapshot/1"


@dataclass(frozen=True)
class StepResult:
    """What a step came to.

    Attributes:
        reward: of the team in this step.
        terminated: nothing burns any more.
        truncated: it was the last step of the scenario, and something burns.
    """

    reward: float
    terminated: bool
    truncated: bool


class Session:
    """A world whose loop the caller owns; made by `fireworld.world`.

    With the same decisions it does exactly what a run of the same scenario and seed does.
    """

    def __init__(self, built: BuiltScenario, *, seed: int, n_steps_max: int | None) -> None:
        self._built, self._n_steps_max = built, n_steps_max
        self._world = built.world(seed=seed, n_steps_max=n_steps_max)
        self._given: object = None
        self._policy: Policy | None = None
        """What `_given` became, once its run has begun."""

    @property
    def scenario(self) -> Scenario:
        """What is simulated."""
        return self._built.scenario

    @property
    def seed(self) -> int:
        """Seed of the random draws."""
        return self._world.seed

    @property
    def n_brigades(self) -> int:
        """Number of brigades."""
        return self._world.n_brigades

    @property
    def step_number(self) -> int:
        """Steps done so far."""
        return self._world.step_number

    @property
    def done(self) -> bool:
        """Whether nothing burns any more, or the last step is done."""
        return self._world.terminated or self._world.truncated

    @property
    def outcome(self) -> Outcome:
        """How the world stands now."""
        return self._world.outcome

    def reset(self, seed: int | None = None) -> None:
        """Begin again.

        Args:
            seed: of the random draws, from 0 to 2**32 - 1; None: the same as before.
        """
        chosen = self.seed if seed is None else seed_of(seed)
        self._world = self._built.world(seed=chosen, n_steps_max=self._n_steps_max)
        self._policy = None

    def observe(self) -> tuple[Observation | None, ...]:
        """Return what each brigade sees before anyone decides in the next step; None of one that will not decide.

        With `choices: in-turn`, a policy asked in a run also sees what the brigades before it chose in this step.
        """
        return self._world.observe()

    def step(self, actions: Sequence[Any] | Policy | Callable[[Observation], Any]) -> StepResult:
        """Run one step.

        Args:
            actions: (n_brigades,) an action for each brigade: its name, an Action, or a Decision; what is given for a
                brigade that decides nothing (it refills, it is dead, nothing burns) is ignored and may be None. Or a
                policy, or a function of the observation, which is then asked for one brigade after another.

        Raises:
            ArgumentError: the world is done, or there is not an action for each brigade.
            PolicyError: an action that there is not, or a policy that fails; the world stays as it was.
        """
        if self.done:
            raise ArgumentError(expected("step", "", "a world that is not done", "one that is", "try reset()"))
        plain = plain_actions(actions) if isinstance(actions, list | tuple) else None
        if plain is not None and len(plain) == self.n_brigades:
            self._world.act(plain)
        else:
            self._world.step(self._decider(actions))
        reward = self._world.state.outcome.reward
        return StepResult(float(reward[4]), self._world.terminated, self._world.truncated)

    def snapshot(self) -> bytes:
        """Return the state of the world, to be restored here or in another session of the same scenario."""
        head = {"format": _SNAPSHOT, "scenario": self.scenario.digest, "seed": self.seed, "step": self.step_number}
        data = io.BytesIO()
        arrays: dict[str, Any] = {"head": np.array(json.dumps(head)), **dict(named_arrays(self._world.state))}
        np.savez(data, **arrays)
        return data.getvalue()

    def restore(self, snapshot: bytes) -> None:
        """Bring the world into the state of a snapshot, its seed included; a policy begins anew.

        Raises:
            LogError: it is no snapshot, or one of another scenario.
        """
        try:
            held = read_npz(io.BytesIO(snapshot))
            head = _head(str(held["head"]))
        except (ValueError, KeyError, TypeError, RecursionError) as error:
            raise LogError(expected("snapshot", "", "the bytes of a snapshot", str(error) or "others")) from None
        if head["scenario"] != self.scenario.digest:
            wanted = f"one of this scenario ({self.scenario.digest[:12]})"
            raise LogError(expected("snapshot", "scenario", wanted, str(head["scenario"])[:12]))
        world = self._built.world(seed=int(head["seed"]), n_steps_max=self._n_steps_max)
        restore_snapshot(world.state, held)
        world.step_number = int(head["step"])
        self._world, self._policy = world, None

    def copy(self) -> Session:
        """Return a session in the same state that goes its own way."""
        copied = Session.__new__(Session)
        vars(copied).update(vars(self) | {"_world": self._world.copy(), "_policy": None})
        return copied

    def _decider(self, actions: object) -> Policy:
        """Return a policy that decides as given."""
        if isinstance(actions, str | bytes) or not isinstance(actions, Sequence | np.ndarray):
            if self._policy is None or actions is not self._given:
                policy = find_policy(actions).policy
                begin(policy, self._world.city_arrays, n_brigades=self.n_brigades, seed=self.seed)
                self._given, self._policy = actions, policy
            return self._policy
        if len(actions) != self.n_brigades:
            raise ArgumentError(expected("step", "", f"an action for each of {self.n_brigades} brigades", len(actions)))
        return Given(list(actions))

    def __repr__(self) -> str:
        state = "done" if self.done else f"step {self.step_number}"
        return f"<Session {self.scenario.name}, seed {self.seed}: {state}, {self.outcome.n_burning} buildings burn>"


def _head(text: str) -> Mapping[str, Any]:
    head = json.loads(text)
    if not isinstance(head, dict) or head.get("format") != _SNAPSHOT:
        raise ValueError("another format")
    return head


def world(
    scenario: str | Path | Scenario | Mapping[str, Any],
    *,
    seed: int = 1,
    steps: int | None = None,
    set: Mapping[str, Any] | None = None,
) -> Session:
    """Return a world whose loop the caller owns.

    Args:
        scenario: a shipped name, a YAML file, a Scenario, or the keys and values of one.
        seed: of the random draws, from 0 to 2**32 - 1.
        steps: the last step; None: the scenario's.
        set: keys of the scenario with other values, as in {"brigades.n": 7}.

    Raises:
        ScenarioError, CityError: the scenario cannot be had or built.
        ArgumentError: an argument that makes no sense.
    """
    seed = seed_of(seed)
    n_steps_max = last_step_of(steps)
    chosen = find_scenario(scenario).with_values(settings_of(set))
    return Session(build_scenario(chosen), seed=seed, n_steps_max=n_steps_max)
