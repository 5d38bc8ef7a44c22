"""A scenario with its city built, ready to start any number of worlds; and the cache of the cities built so far."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

from fireworld.city.build import build_city
from fireworld.city.city import City, Plan
from fireworld.kernels.arrays import CityArrays
from fireworld.records import CityRecord, RunHeader
from fireworld.scenario import Scenario
from fireworld.scenario.document import resolve_reward
from fireworld.simulation.city_arrays import city_arrays
from fireworld.simulation.observer import city_record
from fireworld.simulation.placement import Placement, attachments, place, scenario_plan
from fireworld.simulation.world import Start, World, prepare_start
from fireworld.version import __version__, simulator_digest


@dataclass(frozen=True)
class BuiltScenario:
    """What all runs of a scenario share: built once."""

    scenario: Scenario
    city: City
    city_arrays: CityArrays
    placement: Placement
    city_json: bytes | None = None
    """Content of its city file, where that came with a recording."""

    @property
    def n_brigades(self) -> int:
        """Number of brigades."""
        return len(self.placement.brigade_refuge)

    @cached_property
    def start(self) -> Start:
        """The start of every world."""
        scenario = self.scenario
        return prepare_start(
            self.city,
            scenario.resolved_parameters,
            self.placement,
            reward=resolve_reward(scenario),
            choices=scenario.choices,
            unit_volume_m3=scenario.unit_volume_m3,
            observed=scenario.observation,
            allocation=scenario.brigades.allocation,
            targets=scenario.brigades.targets,
            arrays=self.city_arrays,
        )

    def world(self, *, seed: int, n_steps_max: int | None = None) -> World:
        """Start a world; its last step is the scenario's unless another is given."""
        return World(self.start, seed=seed, n_steps_max=self.scenario.steps if n_steps_max is None else n_steps_max)

    def city_record(self) -> CityRecord:
        """Return the city as it is recorded."""
        return self._city_record

    @cached_property
    def _city_record(self) -> CityRecord:
        return city_record(self.city, self.placement, self.scenario.resolved_parameters)

    @cached_property
    def _carried(self) -> tuple[str, dict[str, bytes]]:
        """The scenario's digest, and the files that a replay needs."""
        return self.scenario.digest, attachments(self.scenario, city_json=self.city_json)

    def header(self, *, seed: int, policy: str, policy_digest: str, n_steps_max: int) -> RunHeader:
        """Return what identifies a run of this scenario."""
        digest, files = self._carried
        return RunHeader(
            scenario=self.scenario.name,
            scenario_digest=digest,
            seed=seed,
            policy=policy,
            policy_digest=policy_digest,
            fireworld_version=__version__,
            simulator_digest=simulator_digest(),
            n_steps_max=n_steps_max,
            attachments=dict(files),
        )


class CityCache:
    """The cities built so far, by what makes them: scenarios in one city build it once.

    Args:
        files: contents of city files by their SHA-256, where scenarios come from a recording; others are read.
    """

    def __init__(self, files: Mapping[str, bytes] | None = None) -> None:
        self._files = files or {}
        self._built: dict[str, tuple[Plan, City, CityArrays]] = {}

    def build(self, scenario: Scenario, *, city_json: bytes | None = None) -> BuiltScenario:
        """Build a scenario's city, or take it from the cache, and place everybody in it.

        `city_json` is the content of its city file, where that comes from a recording and not from the disk. Raises
        ScenarioError if the city has not what the scenario asks for, CityError if it cannot be built.
        """
        fire = scenario.resolved_parameters.fire
        key = repr((scenario.city, scenario.city_sha256, fire))
        content = city_json or self._files.get(scenario.city_sha256 or "")
        if key not in self._built:
            plan = scenario_plan(scenario, city_json=content)
            city = build_city(plan, fire, seed=scenario.city.ray_seed)
            self._built[key] = plan, city, city_arrays(city, fire)
        plan, city, arrays = self._built[key]
        return BuiltScenario(scenario, city, arrays, place(scenario, plan), content)


def build_scenario(scenario: Scenario, *, city_json: bytes | None = None) -> BuiltScenario:
    """Build one scenario; as `CityCache.build` does."""
    return CityCache().build(scenario, city_json=city_json)
