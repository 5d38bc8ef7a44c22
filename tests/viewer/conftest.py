"""Made-up recordings: a grid city in which a fire spreads in rings and brigades put some of it out."""

from __future__ import annotations

import numpy as np
import pytest

from fireworld import records
from fireworld.records import CityRecord, MemoryRecording, RunHeader, StepRecord

PITCH_M = 16.0


def make_city(nx: int, ny: int, *, n_brigades: int, n_civilians: int) -> CityRecord:
    """A grid of square buildings; the first is an L (not convex), number 1 runs clockwise, the last is a refuge."""
    n = nx * ny
    corners = []
    for index in range(n):
        west, south = (index % nx) * PITCH_M, (index // nx) * PITCH_M
        side = 9.0 + index % 4
        outline = [(0.0, 0.0), (side, 0.0), (side, side), (0.0, side)]
        if index == 0:
            outline = [(0.0, 0.0), (10.0, 0.0), (10.0, 4.0), (4.0, 4.0), (4.0, 10.0), (0.0, 10.0)]
        if index == 1:
            outline.reverse()
        corners.append([(west + x, south + y) for x, y in outline])
    flat = np.array([corner for outline in corners for corner in outline])
    center = np.array([np.mean(outline, axis=0) for outline in corners])
    people = np.arange(n_civilians) * 5 % n
    nodes = np.array([(x * PITCH_M - 2.0, y * PITCH_M - 2.0) for y in range(ny + 1) for x in range(nx + 1)])
    streets = [(y * (nx + 1) + x, y * (nx + 1) + x + 1) for y in range(ny + 1) for x in range(nx)]
    streets += [(y * (nx + 1) + x, (y + 1) * (nx + 1) + x) for y in range(ny) for x in range(nx + 1)]
    return CityRecord(
        name="grid",
        building_id=np.arange(n, dtype="<i4") + 100,
        outline_ptr=np.concatenate([[0], np.cumsum([len(outline) for outline in corners])]).astype("<i4"),
        outline_x_m=flat[:, 0],
        outline_y_m=flat[:, 1],
        center_x_m=center[:, 0],
        center_y_m=center[:, 1],
        floors=(np.arange(n, dtype="<i4") * 7 % 3) + 1,
        material=(np.arange(n) % 3).astype("u1"),
        inflammable=(np.arange(n) < n - 1).astype("u1"),
        ground_area_m2=np.full(n, 100, "<f4"),
        volume_m3=np.full(n, 600, "<f4"),
        initial_fuel=np.full(n, 1e6, "<f4"),
        heat_capacity=np.full(n, 600, "<f4"),
        ignition_point=np.full(n, 47, "<f4"),
        wall_area_m2=np.full(n, 120.0),
        link_ptr=np.zeros(n + 1, "<i4"),
        link_building=np.zeros(0, "<i4"),
        link_share=np.zeros(0, "<f4"),
        node_x_m=nodes[:, 0],
        node_y_m=nodes[:, 1],
        street_from=np.array([street[0] for street in streets], "<i4"),
        street_to=np.array([street[1] for street in streets], "<i4"),
        refuge_building=np.array([n - 1], "<i4"),
        hydrant_x_m=nodes[:1, 0],
        hydrant_y_m=nodes[:1, 1],
        civilian_x_m=center[people, 0],
        civilian_y_m=center[people, 1],
        civilian_building=people.astype("<i4"),
        civilian_hp=np.full(n_civilians, 1000, "<i4"),
        brigade_tank_litres=np.full(n_brigades, 15000, "<i4"),
        brigade_power_litres=np.full(n_brigades, 2000, "<i4"),
        brigade_range_m=np.full(n_brigades, 50.0),
        air_origin_x_m=0.0,
        air_origin_y_m=0.0,
        air_cell_m=5.0,
        air_nx=1,
        air_ny=1,
        middle_x_m=float(nx * PITCH_M / 2),
        middle_y_m=float(ny * PITCH_M / 2),
    )


def fieryness_at(city: CityRecord, step: int, center: tuple[float, float], speed_m: float) -> np.ndarray:
    """Codes of a fire that runs outward in rings; in the east the brigades put it out."""
    away = np.abs(city.center_x_m - center[0]) + np.abs(city.center_y_m - center[1])
    age = step + 1 - (away / speed_m).astype(int)
    code = np.select([age <= 0, age <= 4, age <= 9, age <= 16], [0, 1, 2, 3], 8)
    watered = (city.center_x_m > center[0] + PITCH_M) & (age > 0)
    code = np.where(watered, np.select([age <= 3, age <= 6], [1, 2], 5 + np.arange(len(code)) % 3), code)
    return np.where(city.inflammable == 1, code, 0).astype("u1")


def make_record(city: CityRecord, step: int, *, speed_m: float, fieryness_before: np.ndarray) -> StepRecord:
    n, n_brigades, n_civilians = len(city.building_id), len(city.brigade_tank_litres), len(city.civilian_hp)
    middle = (city.middle_x_m, city.middle_y_m)
    code = fieryness_at(city, step, middle, speed_m)
    burning = np.flatnonzero((code >= 1) & (code <= 3))
    brigade = np.arange(n_brigades)
    activity = np.where((step + brigade) % 9 < 3, 1, np.where((step + brigade) % 9 < 8, 2, 4)).astype("u1")
    target = burning[(brigade * 3 + step // 5) % len(burning)] if len(burning) else np.full(n_brigades, -1)
    tank = np.maximum(0, 15000 - (step * 700 + brigade * 2500) % 15000).astype("<i4")
    hp = np.where(code[city.civilian_building] > 0, np.maximum(0, 1000 - step * 30), 1000).astype("<i4")
    started = step > 0
    none, empty = np.full(n_brigades, -1, "<i4"), np.zeros(0, "<f8")
    sites = len(burning) > 0 and started
    box = [
        np.array([edge(values[burning]) + grow]) if sites else empty
        for values, edge, grow in (
            (city.center_x_m, np.min, -6),
            (city.center_y_m, np.min, -6),
            (city.center_x_m, np.max, 6),
            (city.center_y_m, np.max, 6),
        )
    ]
    ignited = np.flatnonzero((fieryness_before == 0) & (code > 0)) if started else np.zeros(0, int)
    kinds = [0] * len(ignited) + [5] * (step == 6)
    return StepRecord(
        step=step,
        draws=records.Draws(key=step, burn_rate_sum=0.0, health_sum=0.0),
        observations=records.Observations(
            *(np.zeros(n_brigades if started else 0, "u1") for _ in range(9)),
            np.zeros(n_brigades if started else 0, "<i4"),
            site_id=np.array([1] if sites else [], "<i4"),
            site_free_sides=np.array([0b0101] if sites else [], "u1"),
            site_n_burning=np.array([len(burning)] if sites else [], "<i4"),
            site_volume_m3=np.array([600.0 * len(burning)] if sites else []),
            site_west_m=box[0],
            site_south_m=box[1],
            site_east_m=box[2],
            site_north_m=box[3],
        ),
        decisions=records.Decisions(
            action=((brigade + step // 5) % 4).astype("<i4") if started else np.zeros(0, "<i4"),
            target=(target if len(burning) else none).astype("<i4") if started else np.zeros(0, "<i4"),
            explored=(brigade == step % 7).astype("u1") if started else np.zeros(0, "u1"),
            q_values=np.arange(n_brigades * 4, dtype="<f8") if started else empty,
            epsilon=0.1,
            td_error=empty,
        ),
        brigades=records.Brigades(
            x_m=city.middle_x_m - 30.0 + 16.0 * brigade,
            y_m=np.full(n_brigades, city.middle_y_m - 40.0 + (step % 12) * 2.0),
            activity=activity,
            tank_litres=tank,
            sprayed_litres=np.where((activity == 2) & started, 2000, 0).astype("<i4"),
            driven_m=np.zeros(n_brigades),
            hp=np.full(n_brigades, 1000, "<i4"),
            damage=np.zeros(n_brigades),
        ),
        buildings=records.Buildings(
            temperature=np.where((code >= 1) & (code <= 3), 200.0 + 100.0 * code + step, 3.0 * (code > 0)).astype(
                "<f4"
            ),
            energy=np.zeros(n),
            fuel_share=(1 - code / 8).astype("<f4"),
            water_litres=np.where(code >= 4, 500, 0).astype("<i4"),
            fieryness=code,
        ),
        civilians=records.Civilians(hp=hp, damage=np.zeros(n_civilians)),
        rewards=records.Rewards(
            water_damaged=-float(np.count_nonzero((code >= 4) & (code <= 7))),
            burning=-2.0 * len(burning),
            burnt_out=-3.0 * np.count_nonzero(code == 8),
            civilians=float((hp - 1000).sum()),
            total=-float(len(burning)) if started else 0.0,
            sum_so_far=-float(step),
        ),
        score=records.Score(
            score=n_civilians + 1 - 0.05 * step,
            score_max=float(n_civilians + 1),
            score_now=float(n_civilians),
            n_burning=len(burning),
            n_water_damaged=int(np.count_nonzero((code >= 4) & (code <= 7))),
            n_burnt_out=int(np.count_nonzero(code == 8)),
            n_civilians_alive=int(np.count_nonzero(hp > 0)),
            water_used_litres=2000.0 * step,
        ),
        events=records.Events(
            kind=np.array(kinds, "u1"),
            entity=np.concatenate([ignited, [0] * (step == 6)]).astype("<i4"),
        ),
        terminated=False,
        truncated=False,
    )


def make_recording(
    nx: int,
    ny: int,
    n_steps: int,
    *,
    n_brigades: int = 3,
    n_civilians: int = 6,
    speed_m: float = 8.0,
    policy: str = "easiest",
) -> MemoryRecording:
    city = make_city(nx, ny, n_brigades=n_brigades, n_civilians=n_civilians)
    steps: list[StepRecord] = []
    before = np.zeros(nx * ny, "u1")
    for step in range(n_steps + 1):
        steps.append(make_record(city, step, speed_m=speed_m, fieryness_before=before))
        before = steps[-1].buildings.fieryness
    header = RunHeader(
        scenario="grid",
        scenario_digest="0",
        seed=3,
        policy=policy,
        policy_digest="0",
        fireworld_version="0",
        n_steps_max=n_steps,
    )
    return MemoryRecording(header, city, steps)


@pytest.fixture(scope="session")
def small() -> MemoryRecording:
    """36 buildings, 40 steps."""
    return make_recording(6, 6, 40)


@pytest.fixture(scope="session")
def slower() -> MemoryRecording:
    """The same city with a slower fire and another policy; it ends ten steps earlier."""
    return make_recording(6, 6, 30, speed_m=5.0, policy="nearest-to-me")


@pytest.fixture(scope="session")
def big() -> MemoryRecording:
    """1000 buildings, 300 steps: the size that the speed is promised for."""
    return make_recording(40, 25, 300, n_brigades=4, n_civilians=12, speed_m=2.0)
