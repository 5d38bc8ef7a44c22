"""Which building a brigade likes best to fight, in plain numpy: MODEL 7, feature by feature."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from fireworld.city.city import Array, Float64Array
from fireworld.parameters import BrigadeParameters
from fireworld.policy.kernel import KernelPolicy
from fireworld.records import ACTIONS
from tests.reference import fire, network, sites, team

AMONG_NAMED, AMONG_ALL = 3, 4  # kinds of policies
OWN_TARGET: Final = len(ACTIONS)
FAR_MM: Final = 300_000.0  # longer ways are all the same
UNBURNT, WATER_DAMAGED = 0, 4


class Moment(NamedTuple):
    """What all brigades choose in."""

    fire_tables: fire.FireTables
    site_tables: sites.SiteTables
    parameters: BrigadeParameters
    state: fire.FireState
    found: sites.Sites


def ranks(policy: KernelPolicy, who: int) -> bool:
    """Tell whether a brigade ranks targets."""
    return policy.kinds[who % len(policy.kinds)] in (AMONG_NAMED, AMONG_ALL)


def choose(
    policy: KernelPolicy, who: int, brigade: team.Brigade, moment: Moment, *, last_target: int, others: list[int]
) -> tuple[int, int]:
    """Return the action and the target of a brigade.

    Args:
        policy: of the team.
        who: number of the brigade.
        brigade: it.
        moment: of the choice.
        last_target: what it went for in the last step, -1 nothing.
        others: targets of the other brigades, as far as it knows, -1 none.
    """
    turn = who % len(policy.kinds)
    weights, n = policy.rankings[policy.table_of[turn]], len(ACTIONS)

    def worth(seen: Float64Array, named_by: Float64Array) -> float:
        all_seen = np.concatenate([seen, named_by])
        return network.value(policy.network, all_seen) if len(policy.network.layer) else float(all_seen @ weights)

    part = moment.found.members(moment.found.of_number(brigade.site))
    rows = features(part, brigade, moment, last_target=last_target, others=others)
    seen = dict(zip(moment.found.member[part].tolist(), rows, strict=True))
    if policy.kinds[turn] == AMONG_ALL:
        value = {b: worth(row, np.zeros(n)) for b, row in seen.items()}
        ids = moment.site_tables.building_id
        return OWN_TARGET, max(value, key=lambda b: (value[b], -ids[b]))
    named = [
        team.find_target(
            brigade,
            action,
            tables=moment.site_tables,
            found=moment.found,
            energy=moment.state.energy,
            capacity=moment.fire_tables.capacity,
        )
        for action in range(len(ACTIONS))
    ]
    liked = [worth(seen[b], np.eye(n)[action]) for action, b in enumerate(named)]
    action = int(np.argmax(liked))
    return action, named[action]


def features(
    part: slice, brigade: team.Brigade, moment: Moment, *, last_target: int, others: list[int]
) -> Float64Array:
    """(k, 13) what a brigade sees of the k burning buildings of its site; arguments as of `choose`."""
    tables, state = moment.site_tables, moment.state
    b = moment.found.member[part]
    power = max(moment.parameters.power_litres, 1)
    temperature = state.energy / moment.fire_tables.capacity
    litres = litres_needed(b, moment.fire_tables, state)
    exposure, kindling = exposed_shares(b, moment.fire_tables, state, temperature)

    range_mm = moment.parameters.range_m * 1000.0
    square = (tables.x[b] - brigade.x) ** 2 + (tables.y[b] - brigade.y) ** 2
    in_range = square <= range_mm * range_mm
    beyond = np.minimum(np.sqrt(square) - range_mm, FAR_MM) / 100_000.0

    goals = np.array([target for target in others if target >= 0], dtype=np.int64)
    apart = (tables.x[b][:, None] - tables.x[goals]) ** 2 + (tables.y[b][:, None] - tables.y[goals]) ** 2
    here = (b[:, None] == goals).sum(axis=1)
    return np.stack(
        [
            temperature[b] / 500.0,
            np.sqrt(tables.volume[b] / 1000.0),
            state.fuel[b].astype(np.float64) / moment.fire_tables.initial_fuel[b],
            np.minimum(np.sqrt(moment.found.civilian_square[part]), FAR_MM) / 100_000.0,
            exposure * 3.0,
            kindling * 5.0,
            np.sqrt(litres / power),
            in_range,
            np.where(in_range, 0.0, beyond),
            b == last_target,
            here,
            (1.0 / (1.0 + apart / 50_000.0**2)).sum(axis=1),
            (here > 0) & (here * power >= litres),
        ],
        axis=1,
    )


def litres_needed(b: Array, tables: fire.FireTables, state: fire.FireState) -> Float64Array:
    """(k,) water that would cool each of k buildings below ignition, beyond what lies on it."""
    too_hot = state.energy[b] - tables.ignition_point[b] * tables.capacity[b]
    litres: Float64Array = np.maximum(too_hot / tables.water_heat_burning - state.water[b], 0.0)
    return litres


def exposed_shares(
    b: Array, tables: fire.FireTables, state: fire.FireState, temperature: Float64Array
) -> tuple[Float64Array, Float64Array]:
    """(k,) twice: share of each one's radiation that falls on what never burned; counted by how warm that is."""
    first, end = (np.searchsorted(tables.link_from, b, side=side) for side in ("left", "right"))
    link = np.concatenate([np.arange(one, other) for one, other in zip(first.tolist(), end.tolist(), strict=True)])
    of, to = np.repeat(np.arange(len(b)), end - first), tables.link_to[link]
    can_catch = tables.inflammable[to] & np.isin(state.fieryness[to], (UNBURNT, WATER_DAMAGED))
    share = tables.link_share[link] * can_catch
    warmth = np.minimum(temperature[to] / tables.ignition_point[to], 1.0)
    return np.bincount(of, share, minlength=len(b)), np.bincount(of, share * warmth, minlength=len(b))
