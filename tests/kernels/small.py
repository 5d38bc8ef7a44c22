"""Small worlds for hand-worked numbers: square buildings where one says, streets and links one by one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from fireworld.city.build import build_city, with_links
from fireworld.city.city import City, Plan
from fireworld.parameters import PAPER, Parameters
from fireworld.simulation.world import World
from tests.city.plans import footprints, rectangle, street_map

METRE = 1000


def square(x_m: float, y_m: float, side_m: float = 10.0) -> list[tuple[int, int]]:
    """A square building by its centre."""
    half = round(side_m * METRE / 2)
    return rectangle(round(x_m * METRE) - half, round(y_m * METRE) - half, 2 * half, 2 * half)


def make_city(
    *outlines: Sequence[tuple[int, int]],
    links: Mapping[int, Sequence[int]] | None = None,
    ids: Sequence[int] | None = None,
    refuges: Sequence[int] = (),
    floors: Sequence[int] | None = None,
    nodes_m: Sequence[tuple[float, float]] = ((-1000.0, -1000.0), (1000.0, -1000.0)),
    streets: Sequence[tuple[int, int]] = ((0, 1),),
    hydrants: Sequence[int] = (),
) -> City:
    """A city with the radiation links it is told and no others; each shares out its building's rays evenly."""
    drawn = footprints(*outlines, ids=ids)
    n = len(outlines)
    refuge = np.isin(np.arange(n), refuges).astype(np.uint8)
    drawn = replace(drawn, refuge=refuge, inflammable=1 - refuge)
    if floors is not None:
        drawn = replace(drawn, floors=np.array(floors, dtype=np.int32))
    nodes_mm = [(round(x * METRE), round(y * METRE)) for x, y in nodes_m]
    paths = replace(street_map(nodes_mm, streets), hydrant_node=np.array(hydrants, dtype=np.int32))
    city = build_city(Plan("small", drawn, paths), PAPER.fire, seed=1)
    rows = [sorted((links or {}).get(b, ())) for b in range(n)]
    sizes = [len(row) for row in rows]
    return with_links(
        city,
        ptr=np.cumsum([0, *sizes]),
        building=np.array([there for row in rows for there in row], dtype=np.int32),
        share=np.array([1.0 / len(row) for row in rows for _ in row], dtype=np.float32),
    )


def make_world(
    city: City,
    *,
    ignited: Sequence[int] = (),
    civilians: Sequence[tuple[int, float, float]] = (),
    brigades: Sequence[int] = (),
    parameters: Parameters = PAPER,
    reward_change: bool = False,
    unit_volume_m3: float | None = None,
    seed: int = 1,
    n_steps_max: int = 100,
) -> World:
    """A world in it; civilians as (building, x_m, y_m), brigades by the building they start from."""
    return World(
        city,
        parameters,
        ignited=np.array(ignited, dtype=np.int32),
        civilian_building=np.array([b for b, _, _ in civilians], dtype=np.int32),
        civilian_mm=np.array([(x * METRE, y * METRE) for _, x, y in civilians]).reshape(-1, 2),
        brigade_refuge=np.array(brigades, dtype=np.int32),
        seed=seed,
        n_steps_max=n_steps_max,
        reward_change=reward_change,
        unit_volume_m3=unit_volume_m3,
    )


def burn(world: World, *buildings: int, code: int = 1) -> None:
    """Let these buildings burn, and no others, and look at the fire sites."""
    fieryness = world.state.fire.fieryness
    fieryness[(fieryness >= 1) & (fieryness <= 3)] = 5
    fieryness[list(buildings)] = code
    world._look()


def site_numbers(world: World) -> dict[int, int]:
    """The number of the fire site of each burning building."""
    sites = world.state.sites
    return {int(b): int(sites.number[sites.place[b]]) for b in np.flatnonzero(sites.place >= 0)}
