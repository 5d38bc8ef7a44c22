"""Small worlds for hand-worked numbers: square buildings where one says, streets and links one by one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from fireworld.city.build import build_city, with_links
from fireworld.city.city import City, Plan
from fireworld.kernels.brigades import act as act_kernel
from fireworld.kernels.outcome import assess as assess_kernel
from fireworld.kernels.ranking import N_OF_BUILDING, Sight
from fireworld.parameters import PAPER, Parameters
from fireworld.rewards import Reward
from fireworld.scenario.observed import Observed
from fireworld.simulation.placement import Placement
from fireworld.simulation.world import World, prepare_start
from tests.city.plans import footprints, rectangle, street_map

METRE = 1000


def square(x_m: float, y_m: float, side_m: float = 10.0) -> list[tuple[int, int]]:
    """A square building by its centre."""
    half = round(side_m * METRE / 2)
    return rectangle(round(x_m * METRE) - half, round(y_m * METRE) - half, 2 * half, 2 * half)


SIDE_BY_SIDE = [square(100.0 * k, 0.0) for k in range(9)]


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
    reward: Reward | None = None,
    unit_volume_m3: float | None = None,
    observed: Observed | None = None,
    free: bool = False,
    seed: int = 1,
    n_steps_max: int = 100,
) -> World:
    """A world in it; civilians as (building, x_m, y_m), brigades by the building they start from.

    `free`: allocation is.
    """
    placement = Placement(
        ignited=np.array(ignited, dtype=np.int32),
        civilian_building=np.array([b for b, _, _ in civilians], dtype=np.int32),
        civilian_mm=np.array([(x * METRE, y * METRE) for _, x, y in civilians]).reshape(-1, 2),
        brigade_refuge=np.array(brigades, dtype=np.int32),
    )
    more = {"reward": reward, "unit_volume_m3": unit_volume_m3, "observed": observed}
    start = prepare_start(city, parameters, placement, allocation="free" if free else "fixed", **more)
    return World(start, seed=seed, n_steps_max=n_steps_max)


def assess(world: World) -> None:
    """Compute what the moment is worth."""
    state = world.state
    geometry, reward = world.city_arrays.geometry, world.constants.reward
    assess_kernel(state.fire, state.civilians, geometry, reward, state.outcome, np.zeros(9, dtype=np.int64))


def act(world: World) -> None:
    """Let the brigades do what they have chosen."""
    state, city = world.state, world.city_arrays
    water = act_kernel(state.brigades, state.fire, city.streets, state.ways, city.geometry, world.constants.brigades)
    state.outcome.water[0] += water


def put(world: World, codes: Sequence[int], hp: Sequence[int] | int | None = None) -> list[float]:
    """Set the codes and the civilians' health; return what that is worth: the terms, their total, the sum so far."""
    world.state.fire.fieryness[:] = codes
    if hp is not None:
        world.state.civilians.hp[:] = hp
    assess(world)
    reward: list[float] = world.state.outcome.reward.tolist()
    return reward


def people(n: int) -> list[tuple[int, float, float]]:
    """People in the ninth building."""
    return [(8, 0.0, 0.0)] * n


def burn(world: World, *buildings: int, code: int = 1) -> None:
    """Let these buildings burn, and no others, and look at the fire sites."""
    fieryness = world.state.fire.fieryness
    fieryness[(fieryness >= 1) & (fieryness <= 3)] = 5
    fieryness[list(buildings)] = code
    world.look()


def site_numbers(world: World) -> dict[int, int]:
    """The number of the fire site of each burning building."""
    sites = world.state.sites
    return {int(b): int(sites.number[sites.place[b]]) for b in np.flatnonzero(sites.place >= 0)}


def sight_of(world: World) -> Sight:
    """What the brigades of a world look at when they value targets; nothing is described yet."""
    city, state, constants, n = world.city_arrays, world.state, world.constants, world.city.n_buildings
    return Sight(
        city.buildings,
        city.links,
        city.geometry,
        city.streets,
        state.fire,
        state.brigades,
        state.sites,
        constants.fire,
        constants.brigades,
        np.zeros((n, N_OF_BUILDING)),
        np.full(n, -1),
    )
