"""The city against the traces of the official program: whatever it computed of a city, fireworld computes too."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from fireworld.city.air import cover_cells
from fireworld.city.build import build_city, physics_of, visiting_order, with_links, with_order
from fireworld.city.city import City
from fireworld.city.links import radiation_links
from fireworld.city.outlines import walls_of
from fireworld.conformance.city_file import load_city_file
from tests.city.plans import walls_hit
from tests.reference import traces

WITH_RAYS = ["mini", "mini_v1", "mini_v2", "mini_brigades"]


@cache
def case(name):
    trace = traces.Trace.named(name)
    return load_city_file(traces.TRACES / f"{traces.CITIES[name]}.json").plan, trace


def rays_of(name):
    if name == "grid":  # the thin trace leaves them out
        with np.load(traces.TRACES.parent / "rays" / "grid.npz") as stored:
            return stored["rays"]
    return case(name)[1].arrays["rays"]


def hits_on_others(ray_building, hit_building, n):
    """Count rays by (from, to) as a dense table."""
    counted = (hit_building >= 0) & (hit_building != ray_building)
    table = np.zeros((n, n), dtype=np.int64)
    np.add.at(table, (ray_building[counted], hit_building[counted]), 1)
    return table


def dense(ptr, building, value, n):
    table = np.zeros((n, n))
    table[np.repeat(np.arange(n), np.diff(ptr)), building] = value
    return table


@pytest.mark.parametrize("name", traces.CITIES)
def test_footprints(name):
    plan, trace = case(name)
    footprints, arrays = plan.footprints, trace.arrays
    np.testing.assert_array_equal(footprints.building_id, arrays["id"])
    np.testing.assert_array_equal(footprints.outline_ptr, arrays["apex_ptr"])
    np.testing.assert_array_equal(footprints.outline_mm, arrays["apexes"])
    np.testing.assert_array_equal(footprints.centroid_mm, np.stack([arrays["x"], arrays["y"]], axis=1))
    np.testing.assert_array_equal(footprints.floors, arrays["floors"])
    np.testing.assert_array_equal(footprints.material, arrays["code"])
    np.testing.assert_array_equal(footprints.inflammable, arrays["inflammable"])


@pytest.mark.parametrize("name", traces.CITIES)
def test_air_cells(name):
    plan, trace = case(name)
    arrays = trace.arrays
    air = cover_cells(plan.footprints, trace.parameters.air_cell_mm)
    assert air.shape == tuple(arrays["grid_shape"])
    assert air.origin_mm == tuple(arrays["grid_origin"])
    np.testing.assert_array_equal(air.ptr, arrays["cell_ptr"])
    np.testing.assert_array_equal(air.x, arrays["cell_x"])
    np.testing.assert_array_equal(air.y, arrays["cell_y"])
    np.testing.assert_array_equal(air.percent, arrays["cell_pct"])


@pytest.mark.parametrize("name", traces.CITIES)
def test_visiting_order(name):
    plan, trace = case(name)
    np.testing.assert_array_equal(visiting_order(plan.footprints.building_id), trace.arrays["order"])


@pytest.mark.parametrize("name", traces.CITIES)
def test_physics_to_the_last_bit(name):
    plan, trace = case(name)
    arrays, physics = trace.arrays, physics_of(plan.footprints, trace.parameters)
    np.testing.assert_array_equal(physics["volume_m3"], arrays["volume"])
    np.testing.assert_array_equal(physics["heat_capacity"], arrays["capacity"])
    np.testing.assert_array_equal(physics["initial_fuel"], arrays["init_fuel"])
    np.testing.assert_array_equal(physics["ignition_point"], arrays["ignition_point"])
    np.testing.assert_array_equal(physics["wall_area_m2"], arrays["wall_area"])


@pytest.mark.parametrize("name", traces.CITIES)
def test_walls_and_their_rays(name):
    plan, trace = case(name)
    walls, official = walls_of(plan.footprints), trace.arrays["walls"]
    n_rays = np.ceil(walls.length_mm * trace.parameters.ray_rate_per_mm)
    rows = [walls.building[:, None], walls.start_mm, walls.end_mm, n_rays[:, None]]
    np.testing.assert_array_equal(np.concatenate(rows, axis=1), official)
    np.testing.assert_array_equal(np.bincount(walls.building, weights=n_rays), trace.arrays["ray_base"])


@pytest.mark.parametrize("name", [*WITH_RAYS, "grid"])
def test_every_official_ray_meets_the_same_wall(name):
    plan, trace = case(name)
    rays, arrays, n = rays_of(name), trace.arrays, len(plan.footprints.building_id)
    hits = walls_hit(
        plan.footprints,
        visiting_order(plan.footprints.building_id),
        source=rays[:, 0],
        start_mm=rays[:, 1:3],
        end_mm=rays[:, 3:5],
    )
    np.testing.assert_array_equal(hits, rays[:, 5])

    owner = walls_of(plan.footprints).building
    ray_building, hit_building = owner[rays[:, 0]], np.where(hits >= 0, owner[hits], -1)
    table = hits_on_others(ray_building, hit_building, n)
    np.testing.assert_array_equal(table, dense(arrays["conn_ptr"], arrays["conn_idx"], arrays["conn_hits"], n))
    to_self = np.bincount(ray_building[ray_building == hit_building], minlength=n)
    np.testing.assert_array_equal(to_self, arrays["ray_self_hits"])
    share = (table / arrays["ray_base"][:, None]).astype(np.float32)
    np.testing.assert_array_equal(share, dense(arrays["conn_ptr"], arrays["conn_idx"], arrays["conn_val"], n))


@pytest.mark.parametrize("name", ["mini", "mini_v1", "mini_v2", "grid", "grid_v1"])
def test_own_rays_give_the_official_links_but_for_luck(name):
    plan, trace = case(name)
    arrays, n = trace.arrays, len(plan.footprints.building_id)
    order = visiting_order(plan.footprints.building_id)
    n_seeds = 20
    runs = [radiation_links(plan.footprints, order, trace.parameters, seed=seed) for seed in range(n_seeds)]
    own = sum(dense(links.ptr, links.building, links.share, n) for links in runs) / n_seeds
    official = dense(arrays["conn_ptr"], arrays["conn_idx"], arrays["conn_val"], n)
    spread = np.std([links.share.sum() for links in runs])
    assert abs(own.sum() - official.sum()) < 3 * spread
    assert spread < 0.05 * official.sum()
    n_rays = arrays["ray_base"][:, None]
    variance = own * (1 - own) / n_rays * (1 + 1 / n_seeds)
    judged = own * n_rays >= 10
    deviation = (official - own)[judged] / np.sqrt(variance[judged])
    assert judged.sum() >= 10
    assert abs(deviation.mean()) < 0.5
    assert 0.6 < deviation.std() < 1.2


def test_links_and_order_of_a_trace_can_be_put_in():
    plan, trace = case("grid")
    arrays, n = trace.arrays, len(plan.footprints.building_id)
    built = build_city(plan, trace.parameters, seed=1)
    city = with_links(built, ptr=arrays["conn_ptr"], building=arrays["conn_idx"], share=arrays["conn_val"])
    city = with_order(city, arrays["order"][::-1])
    assert isinstance(city, City)
    official = dense(arrays["conn_ptr"], arrays["conn_idx"], arrays["conn_val"], n)
    np.testing.assert_array_equal(dense(city.links.ptr, city.links.building, city.links.share, n), official)
    for first, end in zip(city.links.ptr[:-1], city.links.ptr[1:], strict=True):
        assert (np.diff(city.links.building[first:end]) > 0).all()
    np.testing.assert_array_equal(city.order, arrays["order"][::-1])
    near = dense(city.near.ptr, city.near.building, city.near.share, n)
    assert (near[official > 0] == 1).all()
    assert not city.links.share.flags.writeable
    assert not city.order.flags.writeable
    np.testing.assert_array_equal(built.order, arrays["order"])
