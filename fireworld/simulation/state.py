"""WorldState: made fresh, copied, taken as a snapshot and put back."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Final

import numpy as np

from fireworld.city.city import City
from fireworld.city.entrances import place_of_node
from fireworld.errors import LogError
from fireworld.kernels.arrays import (
    COUNTS,
    SCORES,
    TOTAL,
    Array,
    BrigadeState,
    CityArrays,
    CivilianState,
    FireState,
    Learner,
    NetworkArrays,
    Outcome,
    SiteState,
    StreetArrays,
    TargetLearner,
    Trace,
    WorldState,
)
from fireworld.parameters import Parameters
from fireworld.policy.kernel import NO_NETWORK, NO_TABLES
from fireworld.records import Rewards, Score, filled
from fireworld.rewards import TERMS
from fireworld.simulation.city_arrays import air_shape
from fireworld.simulation.placement import Placement
from fireworld.simulation.ways import another, fresh_ways

NO_NODES: Final = np.zeros(0, dtype=np.int32)
SCRATCH = {"fire.span", "fire.rate"} | {
    f"sites.{name}" for name in SiteState._fields if name not in {"counts", "label"}
}
"""Arrays that no snapshot holds: what a step needs of them, it computes, or `restore_snapshot` makes it anew."""
WAYS: Final = "ways"
"""The group of what a world remembers of its streets: no part of a snapshot, a copy or a comparison."""
REWARDS: Final = (*(term.name for term in TERMS), "total", "sum_so_far")
"""Fields of `Rewards` in the order of the outcome's array."""
SCORE: Final = (*SCORES, *COUNTS, "water_used_litres")
"""Fields of `Score` in the order of the outcome's arrays."""


def warm_spans(warm: Array, shape: tuple[int, ...]) -> Array:
    """Return the spans of the rows of an air array of which only a box may differ from zero; see `FireState`."""
    rows, pitch = shape
    span = np.zeros((2, rows), dtype=np.uint64)
    span[0] = pitch  # a row that is cold: its span starts behind its end
    span[:, warm[0] : warm[1]] = warm[2:, None]
    return span


def fresh_fire(city: City) -> FireState:
    """Return the fire state of a cold, untouched city."""
    n = city.n_buildings
    rows, pitch = air_shape(city)
    warm = np.zeros(4, dtype=np.int64)
    return FireState(
        energy=np.zeros(n),
        fuel=city.initial_fuel.astype(np.float32),
        water=np.zeros(n, dtype=np.int32),
        watered=np.zeros(n, dtype=np.uint8),
        fieryness=np.zeros(n, dtype=np.uint8),
        air=np.zeros((rows, pitch)),
        warm=warm,
        span=warm_spans(warm, (rows, pitch)),
        rate=np.zeros(n),
    )


def brigade_places(city: City, buildings: Array, nodes: Array) -> tuple[Array, Array, Array]:
    """Return the street, the way along it (mm) and the point (mm) where each brigade starts, (b,), (b,), (b, 2).

    `buildings`: (b,) indices, at whose entrances they are; `nodes`: (b,) nodes of streets, -1 for those at a building;
    empty if all are.
    """
    buildings, streets = np.asarray(buildings, dtype=np.int64), city.streets
    street = streets.access_street[buildings].astype(np.int64)
    offset, point = streets.access_offset_mm[buildings].astype(np.int64), streets.access_mm[buildings].copy()
    outdoors = np.flatnonzero(nodes >= 0)
    if len(outdoors):
        street[outdoors], offset[outdoors] = place_of_node(streets, nodes[outdoors])
        point[outdoors] = streets.node_mm[nodes[outdoors]]
    return street, offset, point


def fresh_brigades(city: City, buildings: Array, tank_litres: int, hp: int, *, nodes: Array = NO_NODES) -> BrigadeState:
    """Return healthy brigades with full tanks; `buildings` and `nodes` are as for `brigade_places`."""
    street, offset, point = brigade_places(city, buildings, nodes)
    b = len(street)
    return BrigadeState(
        street=street.astype(np.int32),
        offset=offset,
        x=point[:, 0].astype(np.float64),
        y=point[:, 1].astype(np.float64),
        tank=np.full(b, tank_litres, dtype=np.int32),
        refilling=np.zeros(b, dtype=np.uint8),
        action=np.full(b, -1, dtype=np.int32),
        target=np.full(b, -1, dtype=np.int32),
        site=np.zeros(b, dtype=np.int32),
        activity=np.zeros(b, dtype=np.uint8),
        refuge=np.full(b, -1, dtype=np.int32),
        hydrant=np.full(b, -1, dtype=np.int32),
        inside=np.full(b, -1, dtype=np.int32),
        sprayed=np.zeros(b, dtype=np.int32),
        driven=np.zeros(b, dtype=np.int64),
        hp=np.full(b, hp, dtype=np.int32),
        damage=np.zeros(b),
    )


def fresh_sites(n: int) -> SiteState:
    """Return the site state of a city of n buildings in which nothing burns."""
    zeros = {name: np.zeros(n) for name in SiteState._fields}
    return SiteState(
        **zeros
        | {
            "counts": np.zeros(3, dtype=np.int32),
            "label": np.zeros(n, dtype=np.int32),
            "place": np.full(n, -1, dtype=np.int32),
            "member": np.zeros(n, dtype=np.uint32),
            "start": np.zeros(n + 1, dtype=np.int32),
            "number": np.zeros(n, dtype=np.int32),
            "free_sides": np.zeros(n, dtype=np.uint8),
        }
    )


def fresh_target_learner(
    network: NetworkArrays, state_weight: Array, n_brigades: int, *, decay: float, commit: int
) -> TargetLearner:
    """Return the memory of a team that learns the numbers of a network and `state_weight`, (30,) float64.

    `decay` is lambda, `commit` the steps that a choice is kept for.
    """
    n_layers, n_numbers = len(network.layer), len(network.number)
    width = max(len(network.feature), 1, *network.layer[:, 1].tolist())
    return TargetLearner(
        trace=np.zeros((n_brigades, n_numbers)),
        decay=np.array([decay]),
        value=np.zeros(n_brigades),
        state_weight=state_weight,
        state_trace=np.zeros((n_brigades, len(state_weight))),
        state_seen=np.zeros(len(state_weight)),
        commit=np.array([commit], dtype=np.int64),
        gradient=np.zeros(n_numbers),
        mean_gradient=np.zeros(n_numbers),
        mean_value=np.zeros(1),
        outputs=np.zeros((n_layers + 1, width)),
        back=np.zeros((2, width)),
    )


NO_TARGETS: Final = fresh_target_learner(
    NO_NETWORK,
    np.zeros(0),
    0,
    decay=0.0,
    commit=1,
)
"""Of a team that learns no targets."""


def fresh_learner(
    tables: Array,
    n_brigades: int,
    *,
    rule: int = 0,
    alpha: float = 0.7,
    alpha_decay: float = 0.0,
    gamma: float = 0.5,
    own: bool = False,
) -> Learner:
    """Return the memory of a team that learns into `tables`, (tables, states, 4); the rates are the paper's.

    `own`: brigades learn from their own doing, not from the team's reward.
    """
    return Learner(
        learning=np.ones(1, dtype=np.uint8),
        rule=np.array([rule], dtype=np.int64),
        alpha=np.array([alpha]),
        alpha_decay=np.array([alpha_decay]),
        gamma=np.array([gamma]),
        tables=tables,
        visits=np.zeros(tables.shape, dtype=np.int64),
        state=np.full(n_brigades, -1, dtype=np.int64),
        action=np.zeros(n_brigades, dtype=np.int64),
        reward=np.zeros(n_brigades),
        discount=np.ones(n_brigades),
        own=np.zeros(n_brigades if own else 0),
        td_error=np.zeros(n_brigades),
        of_targets=NO_TARGETS,
        trace=fresh_trace(n_brigades, 0),
    )


def fresh_trace(n_brigades: int, n_steps_max: int, *, own: bool = False) -> Trace:
    """Return room for what a team leaves behind of an episode; 0 steps: no room, and nothing is left.

    `own`: also for what each brigade gets for its own doing.
    """
    n_rows = n_steps_max + 1 if n_steps_max else 0
    return Trace(
        state=np.full((n_brigades, n_rows), -1, dtype=np.int32),
        action=np.zeros((n_brigades, n_rows), dtype=np.uint8),
        choice=np.zeros((n_brigades, n_rows), dtype=np.uint8),
        reward=np.zeros((TOTAL + (n_brigades if own else 0), n_steps_max)),
    )


NO_LEARNER: Final = fresh_learner(NO_TABLES, 0)._replace(learning=np.zeros(1, dtype=np.uint8))
"""Of a team that learns nothing."""


def fresh_world(city: City, streets: StreetArrays, parameters: Parameters, placement: Placement) -> WorldState:
    """Return the state before anything burns, in a city and its streets."""
    hp, n_civilians = parameters.health.initial_hp, len(placement.civilian_building)
    x, y = placement.civilian_mm.astype(np.float64).T.copy()
    return WorldState(
        fire=fresh_fire(city),
        civilians=CivilianState(
            building=placement.civilian_building.astype(np.int32),
            x=x,
            y=y,
            full_hp=np.full(n_civilians, hp, dtype=np.int32),
            hp=np.full(n_civilians, hp, dtype=np.int32),
            damage=np.zeros(n_civilians),
        ),
        brigades=fresh_brigades(
            city, placement.brigade_refuge, parameters.brigades.tank_litres, hp, nodes=placement.brigade_node
        ),
        sites=fresh_sites(city.n_buildings),
        outcome=Outcome(
            reward=np.zeros(len(REWARDS)),
            stock=np.zeros(len(TERMS)),
            score=np.zeros(3),
            counts=np.zeros(4, dtype=np.int32),
            water=np.zeros(1),
            draws=np.zeros(2),
        ),
        ways=fresh_ways(streets, len(placement.brigade_refuge)),
    )


def rewards_of(world: WorldState) -> Rewards:
    """Return what the last step was worth, as it is recorded."""
    return filled(Rewards, dict(zip(REWARDS, world.outcome.reward.tolist(), strict=True)))


def score_of(world: WorldState) -> Score:
    """Return how the world stands, as it is recorded."""
    outcome = world.outcome
    values = *outcome.score.tolist(), *outcome.counts.tolist(), outcome.water.item()
    return filled(Score, dict(zip(SCORE, values, strict=True)))


def named_arrays(world: WorldState | CityArrays) -> Iterator[tuple[str, Array]]:
    """Yield every array with its name, `group.field`, but for the ways: nothing depends on which of them are known."""
    groups: tuple[Any, ...] = world
    for group_name, group in zip(world._fields, groups, strict=True):
        if group_name != WAYS:
            for name, array in zip(group._fields, group, strict=True):
                yield f"{group_name}.{name}", array


def copy_world(world: WorldState) -> WorldState:
    """Copy all arrays; the copy looks for its own ways, so that the two can run side by side."""
    groups: dict[str, Any] = {name: group for name, group in world._asdict().items() if name != WAYS}
    copies = {name: type(group)(*(array.copy() for array in group)) for name, group in groups.items()}
    return WorldState(**copies, ways=another(world.ways))


def copy_into(world: WorldState, source: WorldState) -> None:
    """Overwrite one world's arrays with another's of the same city and team; it keeps the ways that it knows."""
    for (_, array), (_, other) in zip(named_arrays(world), named_arrays(source), strict=True):
        array[...] = other


def take_snapshot(world: WorldState) -> dict[str, Array]:
    """Copy everything that is needed to resume from here."""
    return {name: array.copy() for name, array in named_arrays(world) if name not in SCRATCH}


def restore_snapshot(world: WorldState, snapshot: Mapping[str, Array]) -> None:
    """Put a snapshot back into a world of the same city and team; LogError if an array is missing or does not fit."""
    for name, array in named_arrays(world):
        if name in SCRATCH:
            continue
        held = snapshot.get(name)
        if held is None or held.shape != array.shape or held.dtype != array.dtype:
            found = "nothing" if held is None else f"{held.dtype} {held.shape}"
            raise LogError(f"snapshot: {name}: expected {array.dtype} {array.shape}, got {found}")
        array[...] = held
    world.fire.span[...] = warm_spans(world.fire.warm, world.fire.air.shape)
