"""Assignment: brigades that are yet to choose are assigned to burning buildings, the sum of their values the highest.

Every building has as many places as there are such brigades. The first counts what the ranking says of a building that
none of them goes for; each further one what the weights of `others_here` and `enough` change of that, but never more
than the place before. How near the targets of the others are counts only of those that have chosen. MODEL 7.2.
"""

from __future__ import annotations

import numpy as np

from fireworld.kernels.allocation import is_asked, named_range
from fireworld.kernels.arrays import Array
from fireworld.kernels.choice import ASSIGN
from fireworld.kernels.episode_arrays import Assignment
from fireworld.kernels.jit import inner, kernel
from fireworld.kernels.observation import N_ACTIONS, find_target
from fireworld.kernels.ranking import OWN_TARGET, Sight, is_enough
from fireworld.kernels.ranks import add_up, fresh_ranks, line_up, weigh_alike, weigh_for

NOBODY = -1


def fresh_assignment(n_brigades: int, n_buildings: int) -> Assignment:
    """Return room for an assignment; memory is taken only where it is used."""
    n_places = n_brigades * n_buildings
    return Assignment(
        ranks=fresh_ranks(n_brigades, n_buildings),
        brigade=np.zeros(n_brigades, dtype=np.int64),
        known=np.zeros(n_brigades, dtype=np.int32),
        value=np.empty((n_brigades, n_buildings)),
        building=np.empty(n_buildings, dtype=np.int32),
        further=np.empty((n_brigades, n_buildings)),
        price=np.zeros(n_brigades),
        place_price=np.empty(n_places),
        taken_by=np.empty(n_places, dtype=np.int32),
        gap=np.empty(n_places),
        came_from=np.empty(n_places, dtype=np.int32),
        reached=np.empty(n_places, dtype=np.uint8),
    )


@kernel
def settle(brigade: int, in_turn: bool, known: Array, kind: Array, sight: Sight, assignment: Assignment) -> int:
    """Write which brigades are assigned together with one, and what the others go for; return how many they are.

    They are those that are asked in this step, follow an assignment, may name the same targets and have not chosen yet:
    all from this one on; where nobody knows what others have chosen in the step, all. They go for nothing, -1.
    `known` (b,) is what the brigades go for, as far as this one knows; `kind` (b,) the policy's.
    """
    brigades, sites, constants = sight.brigades, sight.sites, sight.brigade_constants
    n = 0
    for other in range(len(known)):
        assignment.known[other] = known[other]
        if kind[other] != ASSIGN or (in_turn and other < brigade):
            continue
        if not constants.free and brigades.site[other] != brigades.site[brigade]:
            continue
        if other == brigade or is_asked(other, brigades, sites, constants):
            assignment.brigade[n] = other
            assignment.known[other] = -1
            n += 1
    return n


@inner
def value_for_all(
    n: int, first: int, end: int, step: int, weights: Array, sight: Sight, assignment: Assignment
) -> None:
    """Write what the first places of the buildings [first, end) in the row are worth to each of the first n brigades.

    `weights` (17,) are the ranking's.
    """
    ranks = assignment.ranks
    line_up(assignment.known, sight.geometry, sight.sites, ranks)
    weigh_alike(first, end, 0, weights, step, sight, ranks)
    for k in range(np.uint64(first), np.uint64(end)):
        ranks.near[k] = 0.0
    add_up(0, len(assignment.known), first, end, ranks.nearness, ranks.near)
    for i in range(n):
        weigh_for(assignment.brigade[i], first, end, weights, 0.0, sight, ranks)
        for k in range(end - first):
            assignment.value[i, k] = ranks.value[first + k]


@kernel
def keep_best(n: int, n_buildings: int, assignment: Assignment) -> int:
    """Keep the buildings that are among the n best of one of the first n brigades; return how many these are.

    No other is needed: whatever the others get, in one of a brigade's n best there is nobody. Written: `building`, the
    kept ones in their order; `value` becomes that of these.
    """
    value, kept, seen_by = assignment.value, assignment.reached, assignment.came_from
    for k in range(n_buildings):
        kept[k], seen_by[k] = 0, NOBODY
    for i in range(n):
        for _ in range(min(n, n_buildings)):
            best = NOBODY
            for k in range(n_buildings):
                if seen_by[k] != i and (best == NOBODY or value[i, k] > value[i, best]):
                    best = k
            kept[best], seen_by[best] = 1, i
    n_kept = 0
    for k in range(n_buildings):
        if kept[k] != 0:
            assignment.building[n_kept] = k
            for i in range(n):
                value[i, n_kept] = value[i, k]
            n_kept += 1
    return n_kept


@inner
def price_further(n: int, n_kept: int, first: int, weights: Array, assignment: Assignment) -> None:
    """Write what the n places of each kept building count more than its first one, 0 or less."""
    ranks = assignment.ranks
    for k in range(n_kept):
        at = first + np.int64(assignment.building[k])
        here, needed, before = ranks.n_here[at], ranks.needed[at], 0.0
        enough = 1.0 if is_enough(here, needed) else 0.0
        for place in range(n):
            more_enough = (1.0 if is_enough(here + place, needed) else 0.0) - enough
            before = min(before, weights[10] * place + weights[12] * more_enough)
            assignment.further[place, k] = before


@inner
def look_from(taker: int, last: int, n_buildings: int, n_places: int, assignment: Assignment) -> np.int64:
    """Write how far each place that is not reached yet is by way of a taker, who has the place `last`, -1 none.

    Returns the nearest of all that are not reached.
    """
    gap, nearest = assignment.gap, np.int64(NOBODY)
    for j in range(n_places):
        if assignment.reached[j] != 0:
            continue
        k = j % n_buildings
        worth = assignment.value[taker, k] + assignment.further[j // n_buildings, k]
        lack = assignment.price[taker] - worth + assignment.place_price[j]
        if lack < gap[j]:
            gap[j], assignment.came_from[j] = lack, last
        if nearest == NOBODY or gap[j] < gap[nearest]:
            nearest = np.int64(j)
    return nearest


@inner
def reach_free_place(new: int, n_buildings: int, n_places: int, assignment: Assignment) -> np.int64:
    """Return the nearest free place for a new taker, by way of places that others would give up for further ones."""
    price, place_price, gap, reached = assignment.price, assignment.place_price, assignment.gap, assignment.reached
    price[new] = 0.0
    for j in range(n_places):
        gap[j], reached[j], assignment.came_from[j] = np.inf, 0, NOBODY
    taker, last = np.int64(new), np.int64(NOBODY)
    while True:
        nearest = look_from(taker, last, n_buildings, n_places, assignment)
        step = gap[nearest]
        price[new] -= step
        for j in range(n_places):
            if reached[j] != 0:
                price[assignment.taken_by[j]] -= step
                place_price[j] += step
            else:
                gap[j] -= step
        if assignment.taken_by[nearest] == NOBODY:
            return nearest
        taker, last, reached[nearest] = np.int64(assignment.taken_by[nearest]), nearest, 1


@kernel
def assign(n: int, n_buildings: int, assignment: Assignment) -> None:
    """Assign the first n brigades to places of the first buildings, n each: the highest sum of values.

    The Hungarian method with prices and shortest augmenting paths (Kuhn 1955, Munkres 1957, Jonker and Volgenant 1987),
    brigade after brigade. Written: `taken_by`, place p of building k being number p * n_buildings + k.
    """
    n_places = n * n_buildings
    for j in range(n_places):
        assignment.place_price[j], assignment.taken_by[j] = 0.0, NOBODY
    for new in range(n):
        place = reach_free_place(new, n_buildings, n_places, assignment)
        while place != NOBODY:
            before = np.int64(assignment.came_from[place])
            assignment.taken_by[place] = new if before == NOBODY else assignment.taken_by[before]
            place = before


@kernel
def assign_target(
    brigade: int,
    in_turn: bool,
    step: int,
    known: Array,
    kind: Array,
    weights: Array,
    sight: Sight,
    assignment: Assignment,
    values: Array,
) -> tuple[np.int64, np.int64]:
    """Return OWN_TARGET and the building that a brigade is assigned to; -1, -1 without a site.

    Arguments as of `settle`; `weights` (17,) are of the ranking that all follow; `assignment` is scratch.
    Written: `values` (5,) float64, of the four targets that the actions name and of its own, first places all.
    """
    first, end = named_range(brigade, sight.brigades.site, sight.sites, sight.brigade_constants.free)
    if first == end:
        return np.int64(-1), np.int64(-1)
    n = settle(brigade, in_turn, known, kind, sight, assignment)
    value_for_all(n, first, end, step, weights, sight, assignment)
    row = 0
    for i in range(n):
        if assignment.brigade[i] == brigade:
            row = i
    for action in range(N_ACTIONS):
        b = find_target(brigade, action, sight.brigades, sight.buildings, sight.fire, sight.geometry, sight.sites)
        values[action] = assignment.value[row, assignment.ranks.position[b] - first]
    n_kept = keep_best(n, end - first, assignment)
    price_further(n, n_kept, first, weights, assignment)
    assign(n, n_kept, assignment)
    k = 0
    for j in range(n * n_kept):
        if assignment.taken_by[j] == row:
            k = j % n_kept
    values[N_ACTIONS] = assignment.value[row, k]
    return np.int64(OWN_TARGET), np.int64(sight.sites.member[first + assignment.building[k]])
