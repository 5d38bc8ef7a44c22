"""What the worlds of an environment are made of: scenarios, what is seen, what is rewarded; checked before any work."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypedDict

from fireworld.arguments import ArgumentError, last_step_of, path_of, settings_of, whole_number
from fireworld.envs.rewards import Rewards, reward_of
from fireworld.envs.views import observation_of
from fireworld.errors import expected
from fireworld.scenario import Scenario, find_scenario
from fireworld.scenario.document import Choices
from fireworld.simulation.built import BuiltScenario, CityCache
from fireworld.training.curriculum import Curriculum, find_curriculum, names_curriculum

AnyScenario = str | Path | Scenario | Mapping[str, Any] | Curriculum
"""A shipped name, a YAML file, a scenario, or the keys and values of one; or a curriculum for all of its scenarios."""
Scenarios = AnyScenario | Sequence[AnyScenario]
"""One, or several that are played in turn: worker w plays number (w + episode) modulo their number."""


class SetupOptions(TypedDict, total=False):
    """Options that every environment has.

    Attributes:
        observation: "features" (as if left out), "targets" or "graph": `fireworld.envs.views.OBSERVATIONS`.
        reward: "score" (as if left out), the change of score / maximal score; "stock" or "change", the scenario's
            terms; or a function of what a step came to: `fireworld.envs.rewards`.
        own_targets: how many of the burning buildings that a brigade may name are its own targets; 0 if left out.
        n_burning_max: of "graph", how many burning buildings there is room for; 64 if left out.
        steps: the last step; None, as if left out: each scenario's.
        set: keys of the scenarios with other values, as in {"brigades.n": 7}.
        record: the log to write, NAME.mcap, with the seed and the actions of every episode, from which each can be
            replayed in full; or an existing folder for logs; None, as if left out: none. Copies do not record.
    """

    observation: str
    reward: str | Callable[..., Any]
    own_targets: int
    n_burning_max: int
    steps: int | None
    set: Mapping[str, Any] | None
    record: str | os.PathLike[str] | None


@dataclass(frozen=True)
class Setup:
    """What worlds are made of; attributes as of `SetupOptions`."""

    scenarios: tuple[Scenario, ...]
    observation: str
    reward: Rewards
    own_targets: int
    n_burning_max: int
    steps: int | None
    record: str | None = None

    def build(self) -> list[BuiltScenario]:
        """Build the scenarios' cities, each city once.

        Raises:
            ScenarioError, CityError: a scenario cannot be built.
            ArgumentError: nothing burns in it, so that no world of it would have a step.
        """
        cities = CityCache()
        found = [cities.build(self.reward.scenario(scenario)) for scenario in self.scenarios]
        for built in found:
            if built.world(seed=0).terminated:
                raise ArgumentError(expected("scenario", built.scenario.name, "one in which something burns", "none"))
        return found


def setup_of(
    scenarios: Scenarios,
    *,
    choices: Choices | None,
    observation: str = "features",
    reward: str | Callable[..., Any] = "score",
    own_targets: int = 0,
    n_burning_max: int = 64,
    steps: int | None = None,
    set: Mapping[str, Any] | None = None,
    record: str | os.PathLike[str] | None = None,
) -> Setup:
    """Return what worlds are made of.

    Args:
        scenarios: one or several.
        choices: how brigades choose, whatever the scenarios say; None: as they say.
        observation: as of `SetupOptions`, here and below.
        reward: the same.
        own_targets: the same.
        n_burning_max: the same.
        steps: the same.
        set: the same.
        record: the same.

    Raises:
        ScenarioError: a scenario cannot be had.
        ArgumentError: an argument that makes no sense.
    """
    several = scenarios if isinstance(scenarios, Sequence) and not isinstance(scenarios, str) else [scenarios]
    if not several:
        raise ArgumentError(expected("scenarios", "", "one at least", "none"))
    if record is not None:
        path_of("record", record)  # or an error; a path would lose the slash at the end of a folder
    values = settings_of(set)
    if choices is not None and values.get("choices", choices) != choices:
        other = "envs.turns" if choices == "simultaneous" else "envs.team"
        raise ArgumentError(expected("set", "choices", choices, values["choices"], f"try {other}"))
    forced = {} if choices is None else {"choices": choices}
    return Setup(
        tuple(one.with_values({**values, **forced}) for given in several for one in _scenarios_of(given)),
        observation=observation_of(observation),
        reward=reward_of(reward),
        own_targets=whole_number("own_targets", own_targets, least=0, most=10_000),
        n_burning_max=whole_number("n_burning_max", n_burning_max, least=1, most=1_000_000),
        steps=last_step_of(steps),
        record=None if record is None else os.fspath(record),
    )


def _scenarios_of(given: AnyScenario) -> list[Scenario]:
    """Return the scenario that is meant, or those of the curriculum."""
    if isinstance(given, Curriculum) or (isinstance(given, str | Path) and names_curriculum(given)):
        return find_curriculum(given).scenarios
    return [find_scenario(given)]
