"""What is recorded of a step and does not stand in the state like that: other units and types, events."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fireworld import draws, events
from fireworld.kernels.addresses import opener
from fireworld.kernels.arrays import (
    Array,
    BrigadeState,
    BuildingArrays,
    CivilianState,
    Float32,
    Float64,
    Int32,
    Int64,
    SiteState,
    UInt8,
    UInt64,
    WorldState,
)
from fireworld.kernels.brigades import REFILLING
from fireworld.kernels.draws import hash_key
from fireworld.kernels.jit import inner, kernel

fire_event, zero_against_more = inner(events.fire_event), inner(events.zero_against_more)
FIRE_EVENTS = events.FIRE_EVENTS

TEMPERATURE_STEPS = 64.0
"""Recorded temperatures are rounded to this part of a degree: noise in the last bits would not compress."""
MM_PER_M = 1000.0

# numpy's integers, because numba would compile a function anew for each plain number that it is called with.
REFILLED, TANK_EMPTY, SITE_OUT, CIVILIAN_HURT, CIVILIAN_DIED, BRIGADE_HURT, BRIGADE_DIED = (
    np.int64(kind)
    for kind in (
        events.REFILLED,
        events.TANK_EMPTY,
        events.SITE_OUT,
        events.CIVILIAN_HURT,
        events.CIVILIAN_DIED,
        events.BRIGADE_HURT,
        events.BRIGADE_DIED,
    )
)


class Before(NamedTuple):
    """What events follow from, as it was when it was last recorded; n buildings, c civilians, b brigades."""

    fieryness: UInt8  # (n,)
    civilian_hp: Int32  # (c,)
    civilian_damage: Float64  # (c,)
    brigade_hp: Int32  # (b,)
    brigade_damage: Float64  # (b,)
    tank: Int32  # (b,)
    refilling: UInt8  # (b,)


class Recorded(NamedTuple):
    """What is recorded, mostly named as in `fireworld.records`; n buildings, b brigades."""

    key: UInt64  # (1,)
    x_m: Float64  # (b,)
    y_m: Float64  # (b,)
    driven_m: Float64  # (b,)
    site: Int32  # (b,)
    free_edges: UInt8  # (b,), and so are the other features
    distance_from_center: UInt8
    distance_from_civilian: UInt8
    volume: UInt8
    others_easiest: UInt8
    others_nearest_to_civilian: UInt8
    others_nearest_to_center: UInt8
    others_nearest_to_me: UInt8
    state_index: Int32  # (b,)
    temperature: Float32  # (n,)
    fuel_share: Float32  # (n,)
    n_sites: Int64  # (1,)
    site_id: Int32  # (n,), used are as many as there are sites, here and below
    site_free_sides: UInt8
    site_n_burning: Int32
    site_volume_m3: Float64
    site_west_m: Float64
    site_south_m: Float64
    site_east_m: Float64
    site_north_m: Float64
    order: Int32  # (n,), scratch: positions of the sites by rising number
    n_left: Int32  # (n,), scratch: buildings that still burn in each site in which one burns no more, else -1


class Happened(NamedTuple):
    """The events of a step."""

    n: Int64  # (1,)
    kind: UInt8  # (e,), used are n; e as `most_events` says
    entity: Int32  # (e,)


class Watched(NamedTuple):
    """A world that is recorded."""

    buildings: BuildingArrays
    world: WorldState
    before: Before
    recorded: Recorded
    happened: Happened


opened = opener(Watched)


def most_events(n_buildings: int, n_civilians: int, n_brigades: int) -> int:
    """Return how many events a step can have: one a building and one a site, two a civilian, four a brigade."""
    return 2 * n_buildings + 2 * n_civilians + 4 * n_brigades


@kernel
def record_step(row: Array, seed: int, step: int, features: Array, state: Array, site: Array) -> None:
    """Write what is recorded of a world, and remember what the next events follow from.

    Args:
        row: (k,) int64, the address row of a `Watched`.
        seed: of the world's random draws.
        step: the last one done.
        features: (b, 8) int64, what the brigades saw in it; no rows at the start.
        state: (b,) int64, likewise.
        site: (b,) int32, likewise: the fire sites that they belonged to.
    """
    watched = opened(row)
    world, buildings, before, out = watched.world, watched.buildings, watched.before, watched.recorded
    fire, brigades = world.fire, world.brigades
    out.key[0] = hash_key(seed, draws.STEP, 0, step)
    for b in range(len(fire.energy)):
        temperature = fire.energy[b] / buildings.capacity[b]
        out.temperature[b] = np.rint(temperature * TEMPERATURE_STEPS) / TEMPERATURE_STEPS
        out.fuel_share[b] = fire.fuel[b] / buildings.initial_fuel[b]
    for brigade in range(len(brigades.x)):
        out.x_m[brigade], out.y_m[brigade] = brigades.x[brigade] / MM_PER_M, brigades.y[brigade] / MM_PER_M
        out.driven_m[brigade] = brigades.driven[brigade] / MM_PER_M
        number = site[brigade] if len(site) > 0 else brigades.site[brigade]
        out.site[brigade] = number if number > 0 else -1
    for brigade in range(len(state)):
        out.state_index[brigade] = state[brigade]
        out.free_edges[brigade] = features[brigade, 0]
        out.distance_from_center[brigade] = features[brigade, 1]
        out.distance_from_civilian[brigade] = features[brigade, 2]
        out.volume[brigade] = features[brigade, 3]
        out.others_easiest[brigade] = features[brigade, 4]
        out.others_nearest_to_civilian[brigade] = features[brigade, 5]
        out.others_nearest_to_center[brigade] = features[brigade, 6]
        out.others_nearest_to_me[brigade] = features[brigade, 7]
    record_sites(world.sites, out)
    find_events(fire.fieryness, world.civilians, brigades, world.sites, before, out, watched.happened)


@inner
def record_sites(sites: SiteState, out: Recorded) -> None:
    """Write the fire sites by rising number."""
    n = sites.counts[0]
    out.n_sites[0] = n
    for site in range(n):
        place = site
        while place > 0 and sites.number[out.order[place - 1]] > sites.number[site]:
            out.order[place] = out.order[place - 1]
            place -= 1
        out.order[place] = site
    for place in range(n):
        site = out.order[place]
        out.site_id[place], out.site_free_sides[place] = sites.number[site], sites.free_sides[site]
        out.site_n_burning[place] = sites.start[site + 1] - sites.start[site]
        out.site_volume_m3[place] = sites.volume[site]
        out.site_west_m[place], out.site_south_m[place] = sites.west[site] / MM_PER_M, sites.south[site] / MM_PER_M
        out.site_east_m[place], out.site_north_m[place] = sites.east[site] / MM_PER_M, sites.north[site] / MM_PER_M


@inner
def find_events(
    code: Array,
    civilians: CivilianState,
    brigades: BrigadeState,
    sites: SiteState,
    before: Before,
    out: Recorded,
    happened: Happened,
) -> None:
    """Write what happened, in the order of the phases, and remember what the next events follow from."""
    happened.n[0] = 0
    for brigade in range(len(brigades.tank)):
        refilled = zero_against_more(brigades.refilling[brigade], before.refilling[brigade])
        if refilled and brigades.activity[brigade] == REFILLING:
            add_event(REFILLED, brigade, happened)
        before.refilling[brigade] = brigades.refilling[brigade]
    came_to_zero(TANK_EMPTY, before.tank, brigades.tank, happened)
    find_fire_events(code, before.fieryness, sites, out.order, out.n_left, happened)
    left_zero(CIVILIAN_HURT, before.civilian_damage, civilians.damage, happened)
    came_to_zero(CIVILIAN_DIED, before.civilian_hp, civilians.hp, happened)
    left_zero(BRIGADE_HURT, before.brigade_damage, brigades.damage, happened)
    came_to_zero(BRIGADE_DIED, before.brigade_hp, brigades.hp, happened)


@inner
def add_event(kind: int, entity: int, happened: Happened) -> None:
    """Add an event."""
    place = happened.n[0]
    happened.kind[place], happened.entity[place] = kind, entity
    happened.n[0] = place + 1


@inner
def came_to_zero(kind: int, before: Array, now: Array, happened: Happened) -> None:
    """Add an event for each whose number came to zero, and remember the numbers."""
    for k in range(len(now)):
        if zero_against_more(now[k], before[k]):
            add_event(kind, k, happened)
        before[k] = now[k]


@inner
def left_zero(kind: int, before: Array, now: Array, happened: Happened) -> None:
    """Add an event for each whose number was zero and is more, and remember the numbers."""
    for k in range(len(now)):
        if zero_against_more(before[k], now[k]):
            add_event(kind, k, happened)
        before[k] = now[k]


@inner
def find_fire_events(
    code: Array, before: Array, sites: SiteState, order: Array, n_left: Array, happened: Happened
) -> None:
    """Write what happened to buildings and sites, and remember the codes; `code`, `before`: (n,) fieryness."""
    n_changed = 0
    for b in range(len(code)):
        n_changed += code[b] != before[b]
    if n_changed == 0:
        return
    for kind in FIRE_EVENTS:
        for b in range(len(code)):
            if code[b] != before[b] and fire_event(before[b], code[b]) == kind:
                add_event(kind, np.int64(b), happened)
    find_sites_out(code, before, sites, order, n_left, happened)
    for b in range(len(code)):
        before[b] = code[b]


@inner
def find_sites_out(
    code: Array, before: Array, sites: SiteState, order: Array, n_left: Array, happened: Happened
) -> None:
    """Add, by rising number, the sites in which a building burns no more, and nothing else burns."""
    for site in range(sites.counts[0]):
        n_left[site] = -1
    for b in range(len(code)):
        if sites.place[b] >= 0 and 1 <= before[b] <= 3 and not 1 <= code[b] <= 3:
            n_left[sites.place[b]] = 0
    for b in range(len(code)):
        if sites.place[b] >= 0 and 1 <= code[b] <= 3 and n_left[sites.place[b]] >= 0:
            n_left[sites.place[b]] += 1
    for k in range(sites.counts[0]):
        site = order[k]
        if n_left[site] == 0:
            add_event(SITE_OUT, np.int64(sites.number[site]), happened)
