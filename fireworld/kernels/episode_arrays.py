"""The arrays of an episode: a world on its way, and what its steps write on; n buildings, b brigades."""

from __future__ import annotations

from typing import NamedTuple

from fireworld.kernels.arrays import (
    CityArrays,
    Constants,
    Float64,
    Float64x2,
    Int32,
    Int64,
    Learner,
    PolicyArrays,
    Seen,
    UInt8,
    UInt8x2,
    UInt32,
    UInt64,
    WorldState,
)


class Ranks(NamedTuple):
    """What the brigades that value targets make of the burning buildings in a step, in the order of `SiteState.member`.

    n buildings, b brigades. It begins anew with every step: `fireworld.kernels.ranks.line_up`.
    """

    x: Float64  # (n,), mm
    y: Float64
    needed: Float64  # (n,), brigades that would put it out in one step
    worth: Float64  # (n,), weighted sum of what all see alike of it
    n_here: Float64  # (n,), brigades that go for it
    nearness: Float64x2  # (b, n), how near it is to what each brigade goes for, 0 to 1
    near_before: Float64  # (n,), that of the brigades before the one that chooses, added up
    near: Float64  # (n,), that of all others
    value: Float64  # (n,), of the brigade that chooses
    position: Int32  # (n,), by building: where it stands
    weighed: Int32  # (n,), the ranking of `worth`, -1 none
    summed: Int64  # (1,), the step in which the sides were summed up, -1 none
    side: UInt8  # (n,), by building: on which side of its site it is
    side_burning: Float64x2  # (n, 4), buildings that burn on each side of each site
    side_kindling: Float64x2  # (n, 4), their kindling
    side_others: Float64x2  # (n, 4), which share of the others of the brigade that chooses goes for them
    site_others: Float64  # (n,), by site: which share goes for one of its buildings
    sprays_left: Float64  # (1,), how long the brigade that chooses can spray
    around: Float64x2  # (n, 13), by building: what all see alike around it


class Warmth(NamedTuple):
    """Where heat is, or may come in a step; n buildings in blocks of 64.

    Every call of a kernel makes it anew, but for steps of worlds in a batch, whose state nobody else changes.

    How long the lists are is in `number`: `fireworld.kernels.warmth`.
    """

    number: Int64  # (NUMBERS,), named below
    n_of_code: Int64  # (9,), buildings of each code
    block: UInt32  # (blocks,), rising: blocks in which something is or may become warm, or changes its code
    visit: UInt32  # (n,), buildings over air that may be warm, in the order of visits
    block_bits: UInt64  # a bit for each block: in `block`
    visit_bits: UInt64  # a bit for each position in the order of visits: in `visit`
    is_doubtful: UInt8  # (blocks,), 1: codes in it may change without heat enough to burn
    unknown: Float64  # (n,), 0 where all that a building's heat can reach is listed; else 1
    tile: UInt8x2  # (tile rows, tiles in a row), 1: the buildings over that tile of air are listed
    waiting: UInt64  # a bit for each building: it burns, and no site has it yet; 0 but while that is found
    burning: UInt32  # (n,), scratch
    x: Float64  # (n,), scratch
    y: Float64  # (n,), scratch
    square: Float64  # (n,), scratch
    emitted: Float64  # (n,), scratch
    code: UInt8  # (n,), scratch
    row: Float64x2  # (2, pitch), scratch


N_BLOCKS, N_VISITS, N_KNOWN, ALL = 0, 1, 2, 3
"""What is where in `Warmth.number`: how long the lists are; how many buildings are known; 1 once all are listed."""
BLOCKS_CHANGED, VISITS_CHANGED, SITES_CHANGED, SITES_KNOWN, AGE, HOLDS_AFTER, NUMBERS = 4, 5, 6, 7, 8, 9, 10
"""And, 0 or 1: whether more is to be listed; whether fire sites can be others than when they were found; whether they
have been found since the lists began. Then, steps since they began; 1 + the step after which they hold, 0 if they are
to begin anew. Last, how many numbers there are."""


class Shares(NamedTuple):
    """How brigades are shared out among the fire sites; b brigades, n buildings. No rows where nobody asks."""

    joined: Int32  # (b,), place of the site that each is to fight, -1 none
    n_joined: Int32  # (n,), by site: how many those are


class Assignment(NamedTuple):
    """How brigades are assigned to places at burning buildings; b brigades, n buildings. No rows where nobody asks.

    Each building has up to b places.
    """

    ranks: Ranks  # what all see of the buildings
    brigade: Int64  # (b,), numbers of those that are assigned
    known: Int32  # (b,), what all others go for, -1 nothing
    value: Float64x2  # (b, n), of the first place of each building to those that are assigned
    building: Int32  # (n,), the kept buildings, by their place among those that may be named
    further: Float64x2  # (b, n), by place: what it counts more than the first one, 0 or less
    price: Float64  # (b,), scratch
    place_price: Float64  # (b n,), scratch
    taken_by: Int32  # (b n,), by place: which of those that are assigned has it, -1 none
    gap: Float64  # (b n,), scratch
    came_from: Int32  # (b n,), scratch
    reached: UInt8  # (b n,), scratch


class Scratch(NamedTuple):
    """What the steps of an episode write on; b brigades."""

    features: Int64  # (8,)
    action_before: Int32  # (b,)
    target_before: Int32  # (b,)
    values: Float64  # (5,)
    described: Float64x2  # (n, 7); no rows where nobody ranks or sees them
    described_at: Int64  # (n,), -1 at first
    ranks: Ranks  # of n buildings, 0 where nobody ranks
    shares: Shares
    assignment: Assignment
    warmth: Warmth
    seen: Float64x2  # (8, 30), of targets that are valued together
    work: Float64x2  # (2, 8 w), w as `widest` says of the policy's network


class Episode(NamedTuple):
    """A world on its way, and all that takes part in it."""

    city: CityArrays
    constants: Constants
    world: WorldState
    policy: PolicyArrays
    learner: Learner
    seen: Seen
    scratch: Scratch
    clock: Int64  # (3,): seed, last step done, last step to do


SEED, STEP, LAST_STEP = 0, 1, 2
"""Places in the clock."""
