"""A plausible run made of arithmetic: a few buildings, a fire that grows and is fought, every topic filled."""

import dataclasses

import numpy as np

from fireworld import records
from fireworld.records import CityRecord, RunHeader, Snapshot, StepRecord


def header(**changes) -> RunHeader:
    base = RunHeader(
        scenario="synthetic",
        scenario_digest="ab" * 32,
        seed=7,
        policy="easiest",
        policy_digest="cd" * 32,
        fireworld_version="0.1.0",
        n_steps_max=500,
        attachments={"scenario.yaml": b"name: synthetic\n", "policy.npz": bytes(range(256))},
    )
    return dataclasses.replace(base, **changes)


def city(n_buildings: int = 12, n_brigades: int = 3, n_civilians: int = 4) -> CityRecord:
    n = n_buildings
    x = np.arange(n, dtype=float) * 20.0
    corners = np.array([[0, 0], [12, 0], [12, 10], [0, 10]], float)
    outline = (np.stack([x, np.zeros(n)], axis=1)[:, None, :] + corners).reshape(-1, 2)
    int32 = np.int32
    return CityRecord(
        name="row",
        building_id=np.arange(n, dtype=int32) * 3 + 250,
        outline_ptr=np.arange(n + 1, dtype=int32) * 4,
        outline_x_m=outline[:, 0].copy(),
        outline_y_m=outline[:, 1].copy(),
        center_x_m=x + 6.0,
        center_y_m=np.full(n, 5.0),
        floors=np.ones(n, int32),
        material=(np.arange(n) % 3).astype(np.uint8),
        inflammable=np.ones(n, np.uint8),
        ground_area_m2=np.full(n, 120.0, np.float32),
        volume_m3=np.full(n, 360.0, np.float32),
        initial_fuel=np.full(n, 864000.0, np.float32),
        heat_capacity=np.full(n, 396.0, np.float32),
        ignition_point=np.full(n, 47.0, np.float32),
        wall_area_m2=np.full(n, 102.0),
        link_ptr=np.arange(n + 1, dtype=int32),
        link_building=((np.arange(n) + 1) % n).astype(int32),
        link_share=np.full(n, 0.25, np.float32),
        node_x_m=np.array([0.0, 20.0 * n]),
        node_y_m=np.array([-4.0, -4.0]),
        street_from=np.array([0], int32),
        street_to=np.array([1], int32),
        refuge_building=np.array([0], int32),
        hydrant_x_m=np.empty(0),
        hydrant_y_m=np.empty(0),
        civilian_x_m=np.arange(n_civilians, dtype=float),
        civilian_y_m=np.zeros(n_civilians),
        civilian_building=np.full(n_civilians, -1, int32),
        civilian_hp=np.full(n_civilians, 1000, int32),
        brigade_tank_litres=np.full(n_brigades, 15000, int32),
        brigade_power_litres=np.full(n_brigades, 2000, int32),
        brigade_range_m=np.full(n_brigades, 50.0),
        air_origin_x_m=0.0,
        air_origin_y_m=-4.0,
        air_cell_m=5.0,
        air_nx=int(4 * n),
        air_ny=3,
        middle_x_m=10.0 * n,
        middle_y_m=5.0,
    )


def _observations(step: int, n_brigades: int) -> records.Observations:
    n = 0 if step == 0 else n_brigades
    n_sites = 0 if step == 0 else 1 + step % 2
    features = {name: np.full(n, step % 2, np.uint8) for name in (
        "free_edges", "distance_from_center", "distance_from_civilian", "volume", "others_easiest",
        "others_nearest_to_civilian", "others_nearest_to_center", "others_nearest_to_me",
    )}  # fmt: skip
    box = np.arange(n_sites, dtype=float) * 10
    return records.Observations(
        site=np.zeros(n, np.int32),
        **features,
        state_index=(np.arange(n) * 100 + step).astype(np.int32),
        site_id=np.arange(n_sites, dtype=np.int32) + 5,
        site_free_sides=np.full(n_sites, 9, np.uint8),
        site_n_burning=np.full(n_sites, 3, np.int32),
        site_volume_m3=box + 700.0,
        site_west_m=box,
        site_south_m=box,
        site_east_m=box + 32.0,
        site_north_m=box + 10.0,
    )


def record(step: int, *, city_record: CityRecord, last: int, seed: int = 7, snapshot_every: int = 10) -> StepRecord:
    n, n_brigades, n_civilians = (
        len(getattr(city_record, name)) for name in ("building_id", "brigade_tank_litres", "civilian_hp")
    )
    acting = 0 if step == 0 else n_brigades
    generator = np.random.default_rng((seed, step))
    temperature = generator.uniform(0, 300, n)
    q_values = generator.normal(size=acting * 4)
    return StepRecord(
        step=step,
        draws=records.Draws(key=step * 0x9E3779B97F4A7C15 % 2**64, burn_rate_sum=0.15 * step, health_sum=0.0),
        observations=_observations(step, n_brigades),
        decisions=records.Decisions(
            action=(np.arange(acting) % 4).astype(np.int32),
            target=np.arange(acting, dtype=np.int32) + step % 5,
            explored=np.zeros(acting, np.uint8),
            q_values=q_values,
            epsilon=0.5,
            td_error=q_values[::4].copy(),
        ),
        brigades=records.Brigades(
            x_m=np.arange(n_brigades) * 8.0 + step,
            y_m=np.zeros(n_brigades),
            activity=np.full(n_brigades, step % 5, np.uint8),
            tank_litres=np.full(n_brigades, 15000 - 20 * step, np.int32),
            sprayed_litres=np.full(n_brigades, 500, np.int32),
            driven_m=np.full(n_brigades, 12.5),
            hp=np.full(n_brigades, 1000, np.int32),
            damage=np.zeros(n_brigades),
        ),
        buildings=records.Buildings(
            temperature=temperature.astype(np.float32),
            energy=temperature * 396.0,
            fuel_share=np.full(n, 1 - step / 4096, np.float32),
            water_litres=np.arange(n, dtype=np.int32),
            fieryness=(temperature // 80).astype(np.uint8),
        ),
        civilians=records.Civilians(hp=np.full(n_civilians, 1000 - step, np.int32), damage=np.full(n_civilians, 0.1)),
        rewards=records.Rewards(
            water_damaged=-1.0, burning=-2.0 * step, burnt_out=0.0, civilians=-4.0, total=-5.0, sum_so_far=-5.0 * step
        ),
        score=records.Score(
            score=4.5, score_max=5.0, score_now=4.0, n_burning=step % 3, n_water_damaged=1, n_burnt_out=step // 9,
            n_civilians_alive=n_civilians, water_used_litres=500.0 * step,
        ),
        events=records.Events(
            kind=np.full(step % 3, 2, np.uint8), entity=np.arange(step % 3, dtype=np.int32) + 4
        ),
        terminated=False,
        truncated=step == last,
        snapshot=Snapshot({"air": generator.normal(size=(4, 3)), "hp": np.arange(4)})
        if step and step % snapshot_every == 0
        else None,
    )  # fmt: skip


def run(n_steps: int = 30, *, seed: int = 7, city_record: CityRecord | None = None) -> list[StepRecord]:
    base = city() if city_record is None else city_record
    return [record(step, city_record=base, last=n_steps, seed=seed) for step in range(n_steps + 1)]
