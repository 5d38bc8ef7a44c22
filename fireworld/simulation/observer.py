"""What is recorded of a world: its city, and what it did in a step, events included."""

from __future__ import annotations

from dataclasses import fields
from typing import Any, Final

import numpy as np

from fireworld.city.city import City
from fireworld.city.outlines import without_repeats
from fireworld.kernels.addresses import address_row, fields_of
from fireworld.kernels.arrays import Array
from fireworld.kernels.observation import N_FEATURES
from fireworld.kernels.recorded import Before, Happened, Recorded, most_events, record_step
from fireworld.parameters import Parameters
from fireworld.policy.words import FEATURES
from fireworld.records import (
    DTYPES,
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
    filled,
)
from fireworld.simulation.choices import Choices
from fireworld.simulation.placement import Placement
from fireworld.simulation.state import rewards_of, score_of, take_snapshot
from fireworld.simulation.world import World


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


NO_BYTES: Final = np.zeros(0, dtype=np.uint8)
NO_INTS: Final = np.zeros(0, dtype=np.int32)
NO_NUMBERS: Final = np.zeros(0)
NO_CHOICES: Final = Choices(
    np.zeros((0, N_FEATURES), dtype=np.int64), np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int32)
)
NOTHING_SEEN: Final = Observations(*[np.zeros(0, DTYPES[item.metadata["wire"]]) for item in fields(Observations)])
NOTHING_CHOSEN: Final = Decisions(NO_INTS, NO_INTS, NO_BYTES, NO_NUMBERS, 0.0, NO_NUMBERS, NO_NUMBERS)
NO_EVENTS: Final = Events(NO_BYTES, NO_INTS)
NO_CIVILIANS: Final = Civilians(NO_INTS, NO_NUMBERS)
OF_BRIGADES: Final = ("x_m", "y_m", "driven_m", "site", "state_index", *(feature.name for feature in FEATURES))
"""What `Recorded` has of each brigade."""


class Observer:
    """Watches one world. Call `record` before the first step and after each one."""

    def __init__(self, world: World) -> None:
        self.world = world
        self._before, self._recorded, self._happened = _before(world), _fresh_recorded(world), _no_events(world)
        own = (address_row(group) for group in (self._before, self._recorded, self._happened))
        self._row = np.concatenate((address_row(world.city_arrays.buildings), world.row(), *own))

    def record(self, choices: Choices | None = None) -> StepRecord:
        """Return the record of the step just done, with what `World.step` returned; without that, of the start."""
        world, made = self.world, self._recorded
        seen = choices if choices is not None else NO_CHOICES
        record_step(self._row, world.seed, world.step_number, seen.features, seen.state_index, seen.site)
        n_sites, n_events = made.n_sites.item(), self._happened.n.item()
        key, (burn_rate_sum, health_sum) = made.key.item(), world.state.outcome.draws.tolist()
        snapshot_due = world.step_number % SNAPSHOT_EVERY_STEPS == 0
        step = {
            "step": world.step_number,
            "draws": filled(Draws, {"key": key, "burn_rate_sum": burn_rate_sum, "health_sum": health_sum}),
            "observations": self._observations(n_sites) if choices is not None else NOTHING_SEEN,
            "decisions": self._decisions(choices) if choices is not None else NOTHING_CHOSEN,
            "brigades": self._brigades(),
            "buildings": self._buildings(),
            "civilians": self._civilians(),
            "rewards": rewards_of(world.state),
            "score": score_of(world.state),
            "events": self._events(n_events) if choices is not None and n_events else NO_EVENTS,
            "terminated": world.terminated,
            "truncated": world.truncated,
            "snapshot": Snapshot(take_snapshot(world.state)) if snapshot_due else None,
        }
        return filled(StepRecord, step)

    def _observations(self, n_sites: int) -> Observations:
        made = self._recorded
        seen = {
            "site": made.site.copy(),
            "free_edges": made.free_edges.copy(),
            "distance_from_center": made.distance_from_center.copy(),
            "distance_from_civilian": made.distance_from_civilian.copy(),
            "volume": made.volume.copy(),
            "others_easiest": made.others_easiest.copy(),
            "others_nearest_to_civilian": made.others_nearest_to_civilian.copy(),
            "others_nearest_to_center": made.others_nearest_to_center.copy(),
            "others_nearest_to_me": made.others_nearest_to_me.copy(),
            "state_index": made.state_index.copy(),
            "site_id": made.site_id[:n_sites].copy(),
            "site_free_sides": made.site_free_sides[:n_sites].copy(),
            "site_n_burning": made.site_n_burning[:n_sites].copy(),
            "site_volume_m3": made.site_volume_m3[:n_sites].copy(),
            "site_west_m": made.site_west_m[:n_sites].copy(),
            "site_south_m": made.site_south_m[:n_sites].copy(),
            "site_east_m": made.site_east_m[:n_sites].copy(),
            "site_north_m": made.site_north_m[:n_sites].copy(),
        }
        return filled(Observations, seen)

    def _decisions(self, choices: Choices) -> Decisions:
        brigades, (explored, q_values, epsilon, target_value) = self.world.state.brigades, choices.reasons
        made = {
            "action": brigades.action.copy(),
            "target": brigades.target.copy(),
            "explored": explored,
            "q_values": q_values,
            "epsilon": epsilon,
            "td_error": NO_NUMBERS,
            "target_value": target_value,
        }
        return filled(Decisions, made)

    def _brigades(self) -> Brigades:
        made, brigades = self._recorded, self.world.state.brigades
        done = {
            "x_m": made.x_m.copy(),
            "y_m": made.y_m.copy(),
            "activity": brigades.activity.copy(),
            "tank_litres": brigades.tank.copy(),
            "sprayed_litres": brigades.sprayed.copy(),
            "driven_m": made.driven_m.copy(),
            "hp": brigades.hp.copy(),
            "damage": brigades.damage.copy(),
        }
        return filled(Brigades, done)

    def _buildings(self) -> Buildings:
        made, fire = self._recorded, self.world.state.fire
        burning = {
            "temperature": made.temperature.copy(),
            "energy": fire.energy.copy(),
            "fuel_share": made.fuel_share.copy(),
            "water_litres": fire.water.copy(),
            "fieryness": fire.fieryness.copy(),
        }
        return filled(Buildings, burning)

    def _civilians(self) -> Civilians:
        civilians = self.world.state.civilians
        return filled(Civilians, vars(NO_CIVILIANS) | {"hp": civilians.hp.copy(), "damage": civilians.damage.copy()})

    def _events(self, n_events: int) -> Events:
        kind, entity = self._happened.kind[:n_events].copy(), self._happened.entity[:n_events].copy()
        return filled(Events, {"kind": kind, "entity": entity})


def _before(world: World) -> Before:
    """Return what events of the next step follow from."""
    fire, civilians, brigades = world.state.fire, world.state.civilians, world.state.brigades
    return Before(
        fieryness=fire.fieryness.copy(),
        civilian_hp=civilians.hp.copy(),
        civilian_damage=civilians.damage.copy(),
        brigade_hp=brigades.hp.copy(),
        brigade_damage=brigades.damage.copy(),
        tank=brigades.tank.copy(),
        refilling=brigades.refilling.copy(),
    )


def _fresh_recorded(world: World) -> Recorded:
    """Return room for what is recorded of a world."""
    n, b = world.city.n_buildings, world.n_brigades
    lengths = {"key": 1, "n_sites": 1} | dict.fromkeys(OF_BRIGADES, b)
    return Recorded(*(np.zeros(lengths.get(name, n), dtype) for name, (dtype, _) in fields_of(Recorded)))


def _no_events(world: World) -> Happened:
    """Return room for the events of a step."""
    n = most_events(world.city.n_buildings, len(world.state.civilians.hp), world.n_brigades)
    return Happened(np.zeros(1, dtype=np.int64), np.zeros(n, dtype=np.uint8), np.zeros(n, dtype=np.int32))
