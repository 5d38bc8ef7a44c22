"""Traces of the official program as plain arrays, and their replay by the numpy engine."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Self

import numpy as np

from fireworld.city.city import AirCells, Array, Float64Array, Links
from fireworld.parameters import OFFICIAL_2013, FireParameters
from tests.reference import brigades, fire

OFFICIAL: Final = OFFICIAL_2013.brigades
TRACES: Final = Path(__file__).parents[1] / "data" / "traces"
CITIES: Final = {
    "mini": "mini",
    "mini_v1": "mini",
    "mini_v2": "mini",
    "mini_sd": "mini",
    "mini_brigades": "mini_brigades",
    "grid": "grid",
    "grid_v1": "grid",
    "grid_dry": "grid_dry",
}
"""City file of each trace."""


@dataclass(frozen=True)
class Trace:
    """One run of the official program: what went in and what came out."""

    city: dict[str, Any]  # the city file
    arrays: dict[str, Array]  # the trace file
    parameters: FireParameters

    @classmethod
    def load(cls, trace: Path, city: Path) -> Self:
        """Read a trace and its city."""
        with np.load(trace) as stored:
            arrays = dict(stored)
        return cls(json.loads(city.read_text()), arrays, fire_parameters(json.loads(str(arrays["params"]))))

    @classmethod
    def named(cls, name: str) -> Self:
        """Read one of the traces kept for the tests."""
        return cls.load(TRACES / f"{name}.npz", TRACES / f"{CITIES[name]}.json")

    @property
    def n_steps(self) -> int:
        """Number of steps."""
        return len(self.arrays["fieryness"]) - 1

    @property
    def kept_steps(self) -> Array:
        """(k,) the steps whose whole state the trace holds."""
        return self.arrays.get("steps", np.arange(self.n_steps + 1))

    def tables(self) -> fire.FireTables:
        """Prepare the city with the official links, order and air cells."""
        a = self.arrays
        return fire.FireTables.of_arrays(
            capacity=a["capacity"],
            initial_fuel=a["init_fuel"],
            ignition_point=a["ignition_point"],
            inflammable=a["inflammable"],
            wall_area_m2=a["wall_area"],
            order=a["order"],
            air=AirCells(
                origin_mm=(int(a["grid_origin"][0]), int(a["grid_origin"][1])),
                cell_mm=int(a["cell_size"][0]),
                shape=(int(a["grid_shape"][0]), int(a["grid_shape"][1])),
                ptr=a["cell_ptr"],
                x=a["cell_x"],
                y=a["cell_y"],
                percent=a["cell_pct"],
            ),
            links=Links(a["conn_ptr"], a["conn_idx"], a["conn_val"]),
            parameters=self.parameters,
        )


def fire_parameters(config: dict[str, str]) -> FireParameters:
    """Translate the official configuration."""

    def number(key: str) -> float:
        return float(config[f"resq-fire.{key}"])

    return FireParameters(
        fuel_density_wood=number("wooden_energy"),
        fuel_density_steel=number("steel_energy"),
        fuel_density_concrete=number("concrete_energy"),
        heat_capacity_wood=number("wooden_capacity"),
        heat_capacity_steel=number("steel_capacity"),
        heat_capacity_concrete=number("concrete_capacity"),
        ignition_point_wood=number("wooden_ignition"),
        ignition_point_steel=number("steel_ignition"),
        ignition_point_concrete=number("concrete_ignition"),
        burn_rate_mean=number("burn-rate-average"),
        burn_rate_sd=number("burn-rate-variance"),
        air_cell_mm=int(number("cell_size")),
        air_to_air_flow=number("air_to_air_flow"),
        air_to_building_flow=number("air_to_building_flow"),
        air_heat_capacity=number("air_cell_heat_capacity"),
        air_heat_kept=number("energy_loss"),
        radiation_coefficient=number("radiation_coefficient"),
        ray_rate_per_mm=number("ray_rate"),
        ray_range_mm=int(number("max_ray_distance")),
        water_heat_per_litre=number("water_thermal_capacity"),
        water_unburnt_share=number("gamma"),
        flush_temperature=0.0,
    )


class OfficialRates:
    """Burn rates as the official program draws them: each building goes through the same list at its own pace."""

    def __init__(self, draws: Float64Array, n_buildings: int) -> None:
        self._draws = draws
        self._used = np.zeros(n_buildings, dtype=np.int64)

    def take(self, burning: Array) -> Float64Array:
        """(n,) the rates of a step; `burning` (n,) bool are those that move on."""
        rate = self._draws[self._used]
        self._used += burning
        return rate


def official_team(city: Mapping[str, Any]) -> brigades.Brigades:
    """Place the brigades of a city file, if it has any."""
    rows = city.get("brigades", ())
    team = brigades.Brigades.with_tanks(np.array([r["id"] for r in rows]), np.array([r["water"] for r in rows]))
    move(team, city, rows)
    return team


def move(team: brigades.Brigades, city: Mapping[str, Any], rows: Iterable[Mapping[str, Any]]) -> None:
    """Put brigades where rows of a city file say."""
    refuges = {building["id"] for building in city["buildings"] if building["type"] == "refuge"}
    hydrants = {hydrant["id"] for hydrant in city.get("hydrants", ())}
    for row in rows:
        hydrant = row["pos"] if row["pos"] in hydrants else brigades.NOWHERE
        team.place(row["id"], (row["x"], row["y"]), at_refuge=row["pos"] in refuges, hydrant=hydrant)


@dataclass(frozen=True)
class Replayed:
    """The state after one step; its arrays belong to the replay and change with the next step."""

    fire: fire.FireState
    tank_litres: Array  # (n_brigades,)
    results: list[int]  # of the step's requests


def replay(trace: Trace, tables: fire.FireTables) -> Iterator[Replayed]:
    """Run a trace's inputs through the numpy engine and yield the state after every step, step 0 first."""
    city = trace.city
    state = fire.FireState.cold(tables)
    rates = OfficialRates(trace.arrays["burn_rate_draws"], len(tables.capacity))
    team = official_team(city)
    index = {building["id"]: k for k, building in enumerate(city["buildings"])}

    def due(key: str) -> list[Mapping[str, Any]]:
        return [row for row in city.get(key, ()) if row["t"] == step]

    fire.ignite(tables, state, np.array([index[b] for b in city["ignitions"]]))
    yield Replayed(state, team.tank_litres, [])
    for step in range(1, trace.n_steps + 1):
        fire.ignite(tables, state, np.array([index[row["id"]] for row in due("later_ignitions")], dtype=np.int64))
        for _, building_id, litres in (row for row in city["water"] if row[0] == step):
            fire.pour(state, index[building_id], litres)
        move(team, city, due("brigade_moves"))
        brigades.refill(team, OFFICIAL)
        results = []
        for row in due("extinguish"):
            target = index[row["target"]]
            place = (city["buildings"][target]["x"], city["buildings"][target]["y"])
            result = brigades.request(team, OFFICIAL, brigade_id=row["brigade"], target_mm=place, litres=row["litres"])
            results.append(result)
            if result == brigades.ACCEPTED:
                fire.pour(state, target, row["litres"])
        fire.advance_fire(tables, state, rates.take(fire.is_burning(tables, state)))
        yield Replayed(state, team.tank_litres, results)
