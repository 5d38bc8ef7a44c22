"""What is recorded of a world: its city, and what it did in a step, events included."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from fireworld.city.city import City
from fireworld.city.outlines import without_repeats
from fireworld.draws import STEP, hash_key
from fireworld.kernels.arrays import DRAWS, Array
from fireworld.kernels.brigades import REFILLING
from fireworld.parameters import Parameters
from fireworld.policy.words import FEATURES
from fireworld.records import (
    SNAPSHOT_EVERY_STEPS,
    Brigades,
    Buildings,
    CityRecord,
    Civilians,
    Decisions,
    Draws,
    Events,
    Observations,
    Snapshot,
    StepRecord,
)
from fireworld.simulation.changes import BURNING, events_of, fire_changes, zero_against_more
from fireworld.simulation.placement import Placement
from fireworld.simulation.state import rewards_of, score_of, take_snapshot
from fireworld.simulation.world import Choices, World


def city_record(city: City, placement: Placement, parameters: Parameters) -> CityRecord:
    """Return a city, and who is in it at the start, as it is recorded once a run, in metres."""
    footprints, streets, air = city.footprints, city.streets, city.air
    middle_x, middle_y = city.middle_mm
    brigades, n_brigades = parameters.brigades, len(placement.brigade_refuge)
    outline_ptr, outline_mm = without_repeats(footprints)
    return CityRecord(
        name=city.name,
        building_id=footprints.building_id.astype(np.int32),
        outline_ptr=outline_ptr,
        **_in_metres("outline", outline_mm),
        **_in_metres("center", footprints.centroid_mm),
        floors=footprints.floors,
        material=footprints.material,
        inflammable=footprints.inflammable,
        ground_area_m2=footprints.ground_area_m2,
        volume_m3=city.volume_m3,
        initial_fuel=city.initial_fuel,
        heat_capacity=city.heat_capacity,
        ignition_point=city.ignition_point,
        wall_area_m2=city.wall_area_m2,
        link_ptr=city.links.ptr,
        link_building=city.links.building,
        link_share=city.links.share,
        **_in_metres("node", streets.node_mm),
        street_from=np.ascontiguousarray(streets.street[:, 0]),
        street_to=np.ascontiguousarray(streets.street[:, 1]),
        refuge_building=np.flatnonzero(footprints.refuge).astype(np.int32),
        **_in_metres("hydrant", streets.node_mm[streets.hydrant_node]),
        **_in_metres("civilian", placement.civilian_mm),
        civilian_building=placement.civilian_building,
        civilian_hp=np.full(len(placement.civilian_building), parameters.health.initial_hp, dtype=np.int32),
        brigade_tank_litres=np.full(n_brigades, brigades.tank_litres, dtype=np.int32),
        brigade_power_litres=np.full(n_brigades, brigades.power_litres, dtype=np.int32),
        brigade_range_m=np.full(n_brigades, brigades.range_m, dtype=np.float64),
        air_origin_x_m=air.origin_mm[0] / 1000.0,
        air_origin_y_m=air.origin_mm[1] / 1000.0,
        air_cell_m=air.cell_mm / 1000.0,
        air_nx=air.shape[0],
        air_ny=air.shape[1],
        middle_x_m=middle_x / 1000.0,
        middle_y_m=middle_y / 1000.0,
        attribution=city.attribution,
    )


def _in_metres(name: str, points_mm: Array) -> dict[str, Any]:
    """Return the fields with the coordinates of points, (n, 2) whole millimetres."""
    return {f"{name}_{axis}_m": points_mm[:, k] / 1000.0 for k, axis in enumerate("xy")}


class Observer:
    """Watches one world. Call `record` before the first step and after each one."""

    def __init__(self, world: World) -> None:
        self.world = world
        self._remember()

    def record(self, choices: Choices | None = None) -> StepRecord:
        """Return the record of the step just done, with what `World.step` returned; without that, of the start."""
        world = self.world
        events = self._events() if choices is not None else events_of([])
        snapshot_due = world.step_number % SNAPSHOT_EVERY_STEPS == 0
        record = StepRecord(
            step=world.step_number,
            draws=Draws(
                key=hash_key(world.seed, STEP, 0, world.step_number),
                **dict(zip(DRAWS, world.state.outcome.draws.tolist(), strict=True)),
            ),
            observations=self._observations(choices),
            decisions=self._decisions(choices),
            brigades=self._brigades(),
            buildings=self._buildings(),
            civilians=Civilians(hp=world.state.civilians.hp.copy(), damage=world.state.civilians.damage.copy()),
            rewards=rewards_of(world.state),
            score=score_of(world.state),
            events=events,
            terminated=world.terminated,
            truncated=world.truncated,
            snapshot=Snapshot(take_snapshot(world.state)) if snapshot_due else None,
        )
        self._remember()
        return record

    def _watched(self) -> dict[str, Array]:
        """Return the arrays that events follow from."""
        state = self.world.state
        return {
            "fieryness": state.fire.fieryness,
            "civilian_hp": state.civilians.hp,
            "civilian_damage": state.civilians.damage,
            "brigade_hp": state.brigades.hp,
            "brigade_damage": state.brigades.damage,
            "tank": state.brigades.tank,
            "refilling": state.brigades.refilling,
        }

    def _remember(self) -> None:
        self._before = {name: array.copy() for name, array in self._watched().items()}

    def _observations(self, choices: Choices | None) -> Observations:
        arrays = self.world.state
        sites, n = arrays.sites, int(arrays.sites.counts[0])
        if choices is None:
            features = np.zeros((8, 0), dtype=np.uint8)
            states, site, n = np.zeros(0, dtype=np.int32), np.zeros(0, dtype=np.int32), 0
        else:
            features = choices.features.T.astype(np.uint8, order="C")  # so that each feature lies in one piece
            states = choices.state_index.astype(np.int32)
            site = np.where(arrays.brigades.site > 0, arrays.brigades.site, np.int32(-1))
        order = sites.number[:n].argsort(kind="stable")
        return Observations(
            site=site,
            **{feature.name: column for feature, column in zip(FEATURES, features, strict=True)},
            state_index=states,
            site_id=sites.number[order],
            site_free_sides=sites.free_sides[order],
            site_n_burning=sites.start[order + 1] - sites.start[order],
            site_volume_m3=sites.volume[order],
            site_west_m=sites.west[order] / 1000.0,
            site_south_m=sites.south[order] / 1000.0,
            site_east_m=sites.east[order] / 1000.0,
            site_north_m=sites.north[order] / 1000.0,
        )

    def _decisions(self, choices: Choices | None) -> Decisions:
        if choices is None:
            empty = np.zeros(0, dtype=np.int32)
            return Decisions(empty, empty, empty.astype(np.uint8), np.zeros(0), 0.0, np.zeros(0))
        brigades = self.world.state.brigades
        decisions = choices.decisions
        known = any(decision.q_values is not None for decision in decisions)
        ranked = any(decision.value is not None for decision in decisions)
        values = [decision.q_values or (0.0, 0.0, 0.0, 0.0) for decision in decisions] if known else []
        return Decisions(
            action=brigades.action.copy(),
            target=brigades.target.copy(),
            explored=np.array([decision.explored for decision in decisions], dtype=np.uint8),
            q_values=np.array(values, dtype=np.float64).ravel(),
            epsilon=max((float(decision.epsilon) for decision in decisions), default=0.0),
            td_error=np.zeros(0),
            target_value=np.array(
                [decision.value or 0.0 for decision in decisions] if ranked else [], dtype=np.float64
            ),
        )

    def _brigades(self) -> Brigades:
        brigades = self.world.state.brigades
        return Brigades(
            x_m=brigades.x / 1000.0,
            y_m=brigades.y / 1000.0,
            activity=brigades.activity.copy(),
            tank_litres=brigades.tank.copy(),
            sprayed_litres=brigades.sprayed.copy(),
            driven_m=brigades.driven / 1000.0,
            hp=brigades.hp.copy(),
            damage=brigades.damage.copy(),
        )

    def _buildings(self) -> Buildings:
        fire = self.world.state.fire
        temperature = fire.energy / self.world.city_arrays.buildings.capacity
        return Buildings(
            temperature=(np.rint(temperature * TEMPERATURE_STEPS) / TEMPERATURE_STEPS).astype(np.float32),
            energy=fire.energy.copy(),
            fuel_share=fire.fuel / self.world.city_arrays.buildings.initial_fuel,
            water_litres=fire.water.copy(),
            fieryness=fire.fieryness.copy(),
        )

    def _events(self) -> Events:
        """Return what changed, in the order of the phases."""
        before, now = self._before, self._watched()
        refilled = zero_against_more(now["refilling"], before["refilling"])
        activity = self.world.state.brigades.activity
        return events_of(
            [
                ("refilled", [brigade for brigade in refilled if activity[brigade] == REFILLING]),
                ("tank-empty", zero_against_more(now["tank"], before["tank"])),
                *self._fire_events(),
                ("civilian-hurt", zero_against_more(before["civilian_damage"], now["civilian_damage"])),
                ("civilian-died", zero_against_more(now["civilian_hp"], before["civilian_hp"])),
                ("brigade-hurt", zero_against_more(before["brigade_damage"], now["brigade_damage"])),
                ("brigade-died", zero_against_more(now["brigade_hp"], before["brigade_hp"])),
            ]
        )

    def _fire_events(self) -> list[tuple[str, Sequence[int]]]:
        """Return what happened to buildings and sites."""
        code, site = self.world.state.fire.fieryness, self.world.state.sites.label
        found = fire_changes(self._before["fieryness"], code)
        return [*found.events, ("site-out", _sites_out(site, code, found.stopped) if found.stopped else [])]


TEMPERATURE_STEPS = 64.0
"""Recorded temperatures are rounded to this part of a degree: noise in the last bits would not compress."""


def _sites_out(site: Array, code: Array, stopped: Sequence[int]) -> list[int]:
    """List, rising, the sites that the buildings that burn no more belonged to, and in which nothing else burns."""
    touched = set(site[stopped].tolist()) - {0}
    n_burning = np.bincount(
        site[(code >= BURNING.start) & (code < BURNING.stop)], minlength=max(touched, default=0) + 1
    )
    return [number for number in sorted(touched) if n_burning[number] == 0]
