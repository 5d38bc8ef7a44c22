"""Stage: a scenario with its city built, ready to start any number of worlds in."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fireworld import __version__
from fireworld.city.build import build_city
from fireworld.city.city import City, Plan
from fireworld.city.record import city_record
from fireworld.kernels.arrays import CityTables
from fireworld.placement import Setup, attachments, place, scenario_plan
from fireworld.records import CityRecord, RunHeader
from fireworld.scenario import Scenario
from fireworld.world.tables import city_tables
from fireworld.world.world import World


@dataclass(frozen=True)
class Stage:
    """What all runs of a scenario share: built once."""

    scenario: Scenario
    city: City
    tables: CityTables
    setup: Setup

    def world(self, *, seed: int, n_steps_max: int | None = None) -> World:
        """Start a world.

        Args:
            seed: of the run's luck.
            n_steps_max: last step; None: the scenario's.
        """
        return World(
            self.city,
            self.scenario.parameters,
            ignited=self.setup.ignited,
            civilian_building=self.setup.civilian_building,
            civilian_mm=self.setup.civilian_mm,
            brigade_refuge=self.setup.brigade_refuge,
            seed=seed,
            n_steps_max=self.scenario.steps if n_steps_max is None else n_steps_max,
            reward_change=self.scenario.reward == "change",
            unit_volume_m3=self.scenario.unit_volume_m3,
            in_turn=self.scenario.choices == "in-turn",
            tables=self.tables,
        )

    def city_record(self) -> CityRecord:
        """Return the city as it is recorded."""
        parameters = self.scenario.parameters
        n_civilians = len(self.setup.civilian_building)
        return city_record(
            self.city,
            civilian_mm=self.setup.civilian_mm,
            civilian_building=self.setup.civilian_building,
            civilian_hp=np.full(n_civilians, parameters.health.initial_hp, dtype=np.int32),
            n_brigades=len(self.setup.brigade_refuge),
            brigades=parameters.brigades,
        )

    def header(
        self, *, seed: int, policy: str, policy_digest: str, n_steps_max: int, forked_from: str = ""
    ) -> RunHeader:
        """Return what identifies a run of this scenario."""
        return RunHeader(
            scenario=self.scenario.name,
            scenario_digest=self.scenario.digest,
            seed=seed,
            policy=policy,
            policy_digest=policy_digest,
            fireworld_version=__version__,
            n_steps_max=n_steps_max,
            forked_from=forked_from,
            attachments=attachments(self.scenario),
        )


@dataclass(frozen=True)
class Ground:
    """A city built, without anybody in it."""

    plan: Plan
    city: City
    tables: CityTables


def build_stage(
    scenario: Scenario, *, city_json: bytes | None = None, grounds: dict[str, Ground] | None = None
) -> Stage:
    """Build a scenario's city and place everybody in it.

    Args:
        scenario: the scenario.
        city_json: content of its city file, where it comes from a recording; None reads the file.
        grounds: cities built before, by what makes them; used and added to, so that scenarios share their city.

    Raises:
        ScenarioError: the city has not what the scenario asks for.
        CityError: the city cannot be built.
    """
    key = repr((scenario.city, scenario.city_sha256, scenario.parameters.fire))
    ground = grounds.get(key) if grounds is not None else None
    if ground is None:
        ground = build_ground(scenario, city_json=city_json)
    if grounds is not None:
        grounds[key] = ground
    return Stage(scenario=scenario, city=ground.city, tables=ground.tables, setup=place(scenario, ground.plan))


def build_ground(scenario: Scenario, *, city_json: bytes | None = None) -> Ground:
    """Build a scenario's city; arguments and errors as for `build_stage`."""
    plan = scenario_plan(scenario, city_json=city_json)
    fire = scenario.parameters.fire
    city = build_city(plan, fire, seed=scenario.city.ray_seed)
    return Ground(plan=plan, city=city, tables=city_tables(city, fire))
