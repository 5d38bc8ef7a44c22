"""Rows of the city: building it, and its radiation rays against plain numpy."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from benchmarks.fires import CITY_SEED, LOTS, city_of, plan_of
from benchmarks.plain_rays import random_rays, walls_hit
from benchmarks.timing import Contender, Row, compare, measure
from fireworld.city import links
from fireworld.city.air import cover_cells
from fireworld.city.build import build_city, visiting_order
from fireworld.city.generator import generate_plan
from fireworld.city.near import near_relation
from fireworld.city.outlines import walls_of
from fireworld.parameters import PAPER
from fireworld.policy.kernel import each_another
from fireworld.scenario import load_scenario
from fireworld.simulation.built import build_scenario
from fireworld.simulation.world import World
from tests.city.plans import walls_hit as grid_walls_hit

RAYS_COMPARED = 20_000


def ray_row(size: int, *, seconds: float) -> Row:
    """Time the search for the first wall on some of a city's rays; both ways must find the same walls."""
    city = city_of(size)
    walls = walls_of(city.footprints)
    fire = PAPER.fire
    source, start, end = random_rays(walls, rays_per_mm=fire.ray_rate_per_mm, range_mm=fire.ray_range_mm, seed=1)
    chosen = np.sort(np.random.default_rng(1).permutation(len(source))[:RAYS_COMPARED])
    rays = {"source": source[chosen], "start_mm": start[chosen], "end_mm": end[chosen]}
    visited = np.argsort(city.order)
    rank = visited[walls.building] * len(walls.building) + np.arange(len(walls.building))

    def compiled(_: None) -> object:
        return grid_walls_hit(city.footprints, city.order, **rays)

    def in_numpy(_: None) -> object:
        return walls_hit(walls, rank, **rays)

    different = np.count_nonzero(np.asarray(compiled(None)) != np.asarray(in_numpy(None)))
    assert different <= len(chosen) // 1000, "but for rays that graze a corner, both ways find the same walls"
    label = f"{city.n_buildings} buildings, {len(chosen)} rays"
    ours, baseline = Contender("grid", compiled), Contender("numpy, all walls", in_numpy)
    return compare("city", "first wall on each ray", label, ours, baseline, seconds=seconds)


def links_row(size: int, *, seconds: float) -> Row:
    """Time all radiation links of a city."""
    city = city_of(size)
    n_rays = int(links.wall_table(city.footprints, city.order, PAPER.fire).n_rays.sum())

    def run(_: None) -> object:
        return links.radiation_links(city.footprints, city.order, PAPER.fire, seed=CITY_SEED)

    label = f"{city.n_buildings} buildings, {n_rays} rays"
    return measure("city", "radiation links", label, Contender("compiled", run), seconds=seconds)


def build_row(size: int, *, seconds: float) -> Row:
    """Time the whole construction of a city from its plan."""
    plan = plan_of(size)

    def run(_: None) -> object:
        return build_city(plan, PAPER.fire, seed=CITY_SEED)

    label = f"{city_of(size).n_buildings} buildings"
    return measure("city", "build a city", label, Contender("build_city", run), seconds=seconds)


def parts_rows(columns: int, rows: int, *, seconds: float) -> Iterator[Row]:
    """Time the parts of a city that must not grow faster than it: its plan, its air cells, its near buildings."""
    fire, plan = PAPER.fire, generate_plan(columns=columns, rows=rows, seed=CITY_SEED)
    order = visiting_order(plan.footprints.building_id)
    found = links.radiation_links(plan.footprints, order, fire, seed=CITY_SEED)
    parts: dict[str, Callable[[None], object]] = {
        "plan": lambda _: generate_plan(columns=columns, rows=rows, seed=CITY_SEED),
        "air cells": lambda _: cover_cells(plan.footprints, fire.air_cell_mm),
        "near buildings": lambda _: near_relation(plan.footprints, found),
    }
    for what, run in parts.items():
        yield measure("city", what, f"{columns * rows} buildings", Contender("linear", run), seconds=seconds)


def first_step_row(*, seconds: float) -> Row:
    """Time the way from the text of the default scenario to the end of its first step."""
    policy = each_another()

    def run(_: None) -> World:
        built = build_scenario(load_scenario("default"))
        world = built.world(seed=1)
        policy.begin(world.city_arrays, world.n_brigades, world.seed)
        world.step(policy)
        return world

    label = f"{run(None).city.n_buildings} buildings"
    return measure("city", "from YAML to the first step", label, Contender("in process", run), seconds=seconds)


def rows(*, quick: bool) -> Iterator[Row]:
    """Yield the rows of the city."""
    seconds = 0.3 if quick else 2.0
    sizes = list(LOTS)[:2] if quick else list(LOTS)
    for size in sizes[:3]:
        yield ray_row(size, seconds=seconds)
    for size in sizes:
        yield links_row(size, seconds=seconds)
    for columns, depth in ((32, 32),) if quick else ((32, 32), (160, 125), (400, 250)):
        yield from parts_rows(columns, depth, seconds=seconds)
    for size in sizes:
        yield build_row(size, seconds=seconds)
    yield first_step_row(seconds=seconds)
