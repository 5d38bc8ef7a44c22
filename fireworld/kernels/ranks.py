"""Ranks: which burning building a brigade would like to fight most, by weights of what it sees of it or by a network.

All burning buildings that a brigade may name are valued at once, along a row of them. What a team sees alike is worked
out once a step; the sums of every value are in one order, whoever asks.
"""

from __future__ import annotations

import numpy as np

from fireworld.kernels.allocation import named_range
from fireworld.kernels.arrays import Array, GeometryArrays, NetworkArrays, SiteState
from fireworld.kernels.episode_arrays import Ranks
from fireworld.kernels.jit import inner, kernel
from fireworld.kernels.network import AT_ONCE, value_together, widest
from fireworld.kernels.observation import N_ACTIONS, find_target, site_place
from fireworld.kernels.ranking import (
    N_OF_BUILDING,
    N_TARGET_FEATURES,
    OWN_TARGET,
    Sight,
    beyond,
    describe_target,
    is_enough,
    know_building,
    nearness,
)
from fireworld.kernels.situation import N_AROUND, N_SEEN, describe_around, place_others, reads_around, sum_up


def fresh_ranks(n_brigades: int, n_buildings: int) -> Ranks:
    """Return room for what a team makes of targets; nothing in it yet, and memory is taken only where it is used."""
    n = n_buildings
    return Ranks(
        x=np.empty(n),
        y=np.empty(n),
        needed=np.empty(n),
        worth=np.empty(n),
        n_here=np.empty(n),
        nearness=np.empty((n_brigades, n)),
        near_before=np.empty(n),
        near=np.empty(n),
        value=np.empty(n),
        position=np.empty(n, dtype=np.int32),
        weighed=np.empty(n, dtype=np.int32),
        summed=np.full(1, -1),
        side=np.empty(n, dtype=np.uint8),
        side_burning=np.empty((n, 4)),
        side_kindling=np.empty((n, 4)),
        side_others=np.empty((n, 4)),
        site_others=np.empty(n),
        sprays_left=np.empty(1),
        around=np.empty((n, N_AROUND)),
    )


def fresh_room(network: NetworkArrays) -> tuple[Array, Array]:
    """Return room to value targets by a network: `seen` (8, 30) and `work` (2, 8 w), w as `widest` says."""
    return np.zeros((AT_ONCE, N_SEEN)), np.zeros((2, AT_ONCE * widest(network)))


@inner
def line_up(known: Array, geometry: GeometryArrays, sites: SiteState, ranks: Ranks) -> None:
    """Put the burning buildings in a row, site after site, and note who goes for them; `known` (b,), -1 nothing."""
    ranks.summed[0] = -1
    for k in range(np.uint64(sites.counts[2])):
        b = sites.member[k]
        ranks.position[b] = k
        ranks.x[k], ranks.y[k] = geometry.x[b], geometry.y[b]
        ranks.n_here[k] = ranks.near_before[k] = 0.0
        ranks.weighed[k] = -1
    for brigade in range(len(known)):
        go_for(brigade, known[brigade], geometry, sites, ranks)


@inner
def count_in(target: int, number: float, sites: SiteState, ranks: Ranks) -> None:
    """Add to the number of brigades that go for a building, if it burns; -1 for none."""
    if target >= 0 and sites.place[target] >= 0:
        ranks.n_here[ranks.position[target]] += number


@inner
def go_for(brigade: int, target: int, geometry: GeometryArrays, sites: SiteState, ranks: Ranks) -> None:
    """Note which building a brigade goes for, -1 none, and how near that is to each of those that burn.

    Without a target it is near to none: what the others add up of it is 0.
    """
    count_in(target, 1.0, sites, ranks)
    row, n_burning = ranks.nearness[brigade], np.uint64(sites.counts[2])
    if target < 0:
        for k in range(n_burning):
            row[k] = 0.0
        return
    x, y = geometry.x[target], geometry.y[target]
    for k in range(n_burning):
        row[k] = nearness(ranks.x[k] - x, ranks.y[k] - y)


@inner
def hear(brigade: int, before: int, target: int, geometry: GeometryArrays, sites: SiteState, ranks: Ranks) -> None:
    """Let the brigades to come know what one has chosen to go for, and not what it went for before; -1 nothing."""
    if target != before:
        count_in(before, -1.0, sites, ranks)
        go_for(brigade, target, geometry, sites, ranks)
    add_up(brigade, brigade + 1, 0, sites.counts[2], ranks.nearness, ranks.near_before)


@inner
def add_up(brigade: int, end_brigade: int, first: int, end: int, nearness: Array, near: Array) -> None:
    """Add how near some brigades' targets are to sums (n,) of the buildings [first, end) in the row.

    One brigade after another, but four at a time, so that the sums are read and written less often.
    """
    while brigade + 4 <= end_brigade:
        one, two, three, four = nearness[brigade], nearness[brigade + 1], nearness[brigade + 2], nearness[brigade + 3]
        for k in range(np.uint64(first), np.uint64(end)):
            near[k] = (((near[k] + one[k]) + two[k]) + three[k]) + four[k]
        brigade += 4
    while brigade < end_brigade:
        one = nearness[brigade]
        for k in range(np.uint64(first), np.uint64(end)):
            near[k] += one[k]
        brigade += 1


@inner
def add_up_others(brigade: int, n_brigades: int, first: int, end: int, ranks: Ranks) -> None:
    """Write how near the others' targets are to the buildings [first, end) in the row; those before have been heard."""
    for k in range(np.uint64(first), np.uint64(end)):
        ranks.near[k] = ranks.near_before[k]
    add_up(brigade + 1, n_brigades, first, end, ranks.nearness, ranks.near)


@inner
def weigh_alike(first: int, end: int, ranking: int, weights: Array, step: int, sight: Sight, ranks: Ranks) -> None:
    """Weigh what all brigades see alike of the buildings [first, end) in the row, by the weights of a ranking."""
    for k in range(np.uint64(first), np.uint64(end)):
        if ranks.weighed[k] == ranking:
            continue
        b = np.int64(sight.sites.member[k])
        know_building(b, step, sight)
        described, worth = sight.described[b], 0.0
        for feature in range(N_OF_BUILDING):
            worth += weights[feature] * described[feature]
        ranks.worth[k], ranks.needed[k], ranks.weighed[k] = worth, described[6] * described[6], ranking


@inner
def weigh_row(
    x: float, y: float, mine: int, range_square: float, first: int, end: int, weights: Array, extra: float, ranks: Ranks
) -> None:
    """Write the values of the buildings [first, end) in the row for a brigade at x, y, which goes for that at `mine`.

    By the (17,) weights of a ranking; `extra` is that of the action. What the others go for is in `ranks`.
    """
    for k in range(np.uint64(first), np.uint64(end)):
        dx, dy = ranks.x[k] - x, ranks.y[k] - y
        square, here = dx * dx + dy * dy, ranks.n_here[k]
        value = ranks.worth[k] + weights[7] * (1.0 if square <= range_square else 0.0)
        value += weights[8] * beyond(square, range_square)
        value += weights[9] * (1.0 if k == mine else 0.0)
        value += weights[10] * here + weights[11] * ranks.near[k]  # first these two: digests hang on the order
        value += weights[12] * (1.0 if is_enough(here, ranks.needed[k]) else 0.0)
        ranks.value[k] = value + extra


@inner
def weigh_for(brigade: int, first: int, end: int, weights: Array, extra: float, sight: Sight, ranks: Ranks) -> None:
    """Write the values of the buildings [first, end) in the row for a brigade, as `weigh_row` does."""
    brigades, sites = sight.brigades, sight.sites
    target, mine = brigades.target[brigade], np.uint64(end)
    if target >= 0 and sites.place[target] >= 0:
        mine = np.uint64(ranks.position[target])
    range_square = sight.brigade_constants.range_square
    weigh_row(brigades.x[brigade], brigades.y[brigade], mine, range_square, first, end, weights, extra, ranks)


@inner
def see_row(brigade: int, first: int, end: int, around: bool, sight: Sight, ranks: Ranks, seen: Array) -> None:
    """Write what a brigade sees of the buildings [first, end) in the row, (n, 30), the last 13 only if they are read.

    What the others go for is in `ranks`.
    """
    range_square = sight.brigade_constants.range_square
    for k in range(np.uint64(first), np.uint64(end)):
        b, here, near, row = np.int64(sight.sites.member[k]), ranks.n_here[k], ranks.near[k], seen[k - np.uint64(first)]
        describe_target(brigade, b, here, near, sight.described[b], sight.brigades, sight.geometry, range_square, row)
    if around:
        describe_around(brigade, first, end, sight, ranks, seen)


@inner
def value_targets(
    brigade: int,
    action: int,
    first: int,
    end: int,
    ranking: int,
    step: int,
    known: Array,
    weights: Array,
    network: NetworkArrays,
    sight: Sight,
    ranks: Ranks,
    seen: Array,
    work: Array,
) -> None:
    """Write a brigade's values of the buildings [first, end) in the row, named by an action or by itself, -1.

    All else as for `rank_targets`.
    """
    sites = sight.sites
    weigh_alike(first, end, ranking, weights, step, sight, ranks)
    add_up_others(brigade, len(known), first, end, ranks)
    count_in(known[brigade], -1.0, sites, ranks)
    if len(network.layer) > 0:
        for k in range(AT_ONCE):
            for other in range(N_ACTIONS):
                seen[k, N_TARGET_FEATURES + other] = 1.0 if other == action else 0.0
        around = reads_around(network)
        for begin in range(first, end, AT_ONCE):
            block_end = min(begin + AT_ONCE, end)
            see_row(brigade, begin, block_end, around, sight, ranks, seen)
            value_together(network, seen, ranks.value[begin:block_end], work)
    else:
        extra = weights[N_TARGET_FEATURES + action] if action >= 0 else 0.0
        weigh_for(brigade, first, end, weights, extra, sight, ranks)
    count_in(known[brigade], 1.0, sites, ranks)


@inner
def best_in_row(first: int, end: int, building_id: Array, sites: SiteState, ranks: Ranks) -> np.int64:
    """Return which of the buildings [first, end) in the row has the highest value; ties: the lowest id."""
    best = np.int64(first)
    for k in range(first + 1, end):
        value, highest = ranks.value[k], ranks.value[best]
        if value > highest or (value == highest and building_id[sites.member[k]] < building_id[sites.member[best]]):
            best = np.int64(k)
    return best


@inner
def rank_targets(
    brigade: int,
    own: bool,
    noting: bool,
    ranking: int,
    step: int,
    known: Array,
    weights: Array,
    network: NetworkArrays,
    sight: Sight,
    ranks: Ranks,
    seen: Array,
    work: Array,
    values: Array,
) -> tuple[np.int64, np.int64]:
    """Return the action with the target that a brigade values most, and that target; -1, -1 without a site.

    The four targets that the actions name are valued, each with the weight of its action on top; where the brigade may
    name a target of its own, all that it may name are instead, and its action is OWN_TARGET. Ties: the lowest action,
    the lowest building id.

    The team has been lined up in this step, and the brigades before this one been heard. `weights` (17,) are the
    ranking's, by its number; a network with layers values targets instead of them. `known` (b,) is what the brigades
    go for, as far as this one knows, -1 nothing. Scratch is `seen` (8, 30) float64 and `work` (2, 8 w), w as `widest`
    says. Written: `values` (5,) float64, of the one chosen and of the four targets, without the weights of the actions
    where it may name its own; there only if they are noted.
    """
    best_action, best, sites = np.int64(-1), np.int64(-1), sight.sites
    site = site_place(brigade, sight.brigades.site, sites)
    if site < 0:
        return best_action, best
    if reads_around(network):
        sum_up(step, len(known), sight, ranks)
        place_others(brigade, known, sight, ranks)
    place = np.int64(-1)
    n_valued = N_ACTIONS if noting or not own else 0
    for action in range(-1 if own else 0, n_valued):
        first, end = named_range(brigade, sight.brigades.site, sites, sight.brigade_constants.free)
        if action >= 0:
            b = find_target(brigade, action, sight.brigades, sight.buildings, sight.fire, sight.geometry, sites)
            first = np.int64(ranks.position[b])
            end = first + 1
        if action < 0 or not own:
            value_targets(brigade, action, first, end, ranking, step, known, weights, network, sight, ranks, seen, work)
        if action < 0:
            best_action, place = (
                np.int64(OWN_TARGET),
                best_in_row(first, end, sight.buildings.building_id, sites, ranks),
            )
            values[N_ACTIONS] = ranks.value[place]
            continue
        values[action] = ranks.value[first]
        if best_action < 0 or (not own and values[action] > values[N_ACTIONS]):
            best_action, place = np.int64(action), first
            values[N_ACTIONS] = values[action]
    return best_action, np.int64(sites.member[place])


@inner
def line_up_before(brigade: int, known: Array, geometry: GeometryArrays, sites: SiteState, ranks: Ranks) -> None:
    """Line up as `line_up` does, in the middle of a step: the brigades before one have been heard."""
    line_up(known, geometry, sites, ranks)
    for other in range(brigade):
        hear(other, known[other], known[other], geometry, sites, ranks)


@kernel
def rank(
    brigade: int,
    own: bool,
    step: int,
    known: Array,
    weights: Array,
    network: NetworkArrays,
    sight: Sight,
    ranks: Ranks,
    seen: Array,
    work: Array,
    values: Array,
) -> tuple[np.int64, np.int64]:
    """Return what `rank_targets` does, asked alone; all arguments are named as there."""
    line_up_before(brigade, known, sight.geometry, sight.sites, ranks)
    return rank_targets(brigade, own, True, 0, step, known, weights, network, sight, ranks, seen, work, values)
