"""The arrays that kernels work on, grouped by concern; n buildings, m street nodes.

Named tuples of arrays, because numba compiles and caches them ahead (a jitclass is not cached across processes).
"Arrays" are fixed during an episode, "State" is what a step may change.
"""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fireworld.rewards import TERMS, Reward

Array = NDArray[Any]
Float64 = Annotated[Array, np.float64, 1]
Float64x2 = Annotated[Array, np.float64, 2]
Float64x3 = Annotated[Array, np.float64, 3]
Float32 = Annotated[Array, np.float32, 1]
Float32x2 = Annotated[Array, np.float32, 2]
Float32x3 = Annotated[Array, np.float32, 3]
Float32x4 = Annotated[Array, np.float32, 4]
Int64 = Annotated[Array, np.int64, 1]
Int64x2 = Annotated[Array, np.int64, 2]
Int64x3 = Annotated[Array, np.int64, 3]
Int32 = Annotated[Array, np.int32, 1]
Int32x2 = Annotated[Array, np.int32, 2]
Int32x3 = Annotated[Array, np.int32, 3]
UInt64 = Annotated[Array, np.uint64, 1]
UInt64x2 = Annotated[Array, np.uint64, 2]
UInt32 = Annotated[Array, np.uint32, 1]
UInt8 = Annotated[Array, np.uint8, 1]
UInt8x2 = Annotated[Array, np.uint8, 2]
UInt8x3 = Annotated[Array, np.uint8, 3]
"""Contiguous arrays by the type of their items and the number of their axes: `addresses` reads it from here."""


class BuildingArrays(NamedTuple):
    """What is fixed of each building, (n,); and the k fires that are lit later on."""

    building_id: Int64  # keys the building's random draws and breaks ties
    capacity: Float64  # energy per degree (a float32 number)
    initial_fuel: Float32  # energy
    ignition_point: Float64  # degrees above ambient
    ignition_energy: Float64  # the least energy at which it is hot enough to burn
    emission: Float64  # energy radiated a step per K^4: wall_area * coefficient * Stefan-Boltzmann
    inflammable: UInt8
    later_step: Int64  # (k,), rising: the step in which each later fire is lit
    later_building: Int64  # (k,), the building that it is lit in


class CoverArrays(NamedTuple):
    """Each building's block of air cells: rows along x, cells along y; rows padded to a multiple of four cells."""

    x0: UInt32  # (n,), first row in the padded grid
    y0: UInt32  # (n,), first cell in the padded grid
    rows: UInt32  # (n,)
    width: UInt32  # (n,), multiple of 4
    ptr: UInt32  # (n,), start in weight
    weight: Float64  # energy per degree of difference: flow * cover * cell size; 0 where not covered
    order: UInt32  # (n,), in which the exchange visits the buildings
    tile_ptr: UInt32  # (tiles+1,), which blocks reach into each tile of the padded grid, as CSR
    tile_position: UInt32  # positions of their buildings in the order of visits


class LinkArrays(NamedTuple):
    """Radiation links as CSR over the emitting buildings; lengths in millimetres."""

    ptr: UInt32  # (n+1,)
    building: UInt32
    share: Float64  # (a float32 number)
    west: Float64  # (n,), bounding box of the centroids of what is inflammable among those a building is linked to
    south: Float64  # turned inside out where there is none
    east: Float64
    north: Float64


class FireConstants(NamedTuple):
    """The scalars of the fire model; parameters.FireParameters has their meaning."""

    burn_rate_mean: float
    burn_rate_sd: float
    air_to_air_flow: float
    air_heat_kept: float
    cell_share: float  # degrees a cell loses per unit of energy it gives: 1 / (air heat capacity * cell size)
    water_heat_burning: float
    water_heat_unburnt: float
    flush_temperature: float


class FireState(NamedTuple):
    """What burns: changed by every step."""

    energy: Float64  # (n,)
    fuel: Float32  # (n,)
    water: Int32  # (n,), litres lying on the building
    watered: UInt8  # (n,), 1 once water has reached it
    fieryness: UInt8  # (n,), official code
    air: Float64x2  # (nx + 2, pitch), degrees; a border of zeros around the nx * ny cells
    warm: Int64  # (4,), box of the air that may differ from zero: first row, end, first cell, end
    span: UInt64x2  # (2, nx + 2), cells of each row of the air that may differ from zero: first, end
    rate: Float64  # (n,), burn rate of the step where a building burns


class GeometryArrays(NamedTuple):
    """Where the buildings are and how big they are, (n,) float64; lengths in millimetres."""

    x: Float64  # centroid
    y: Float64
    west: Float64  # bounding box of the outline
    south: Float64
    east: Float64
    north: Float64
    center_square: Float64  # squared distance of the centroid from the city's centre
    volume: Float64  # m3
    floor_area: Float64  # m2, ground area * floors


class NearArrays(NamedTuple):
    """Which buildings belong to one fire site when both burn, as CSR; rising, in words of 64, a bit for each."""

    ptr: UInt32  # (n+1,)
    word: UInt32
    bits: UInt64  # which buildings of that word


class StreetArrays(NamedTuple):
    """The street graph; lengths in whole millimetres."""

    node_x: Float64  # (m,)
    node_y: Float64  # (m,)
    first: Int32  # (k,), first node of each street
    second: Int32  # (k,)
    length: Int64  # (k,)
    arc_ptr: Int32  # (m+1,), streets at each node, as CSR
    arc_node: Int32  # (2k,), node at the other end
    arc_street: Int32  # (2k,)
    access_street: Int32  # (n,), where each building is reached
    access_offset: Int64  # (n,), from that street's first node
    refuge: Int32  # (refuges,), buildings where tanks are refilled
    hydrant_node: Int32  # (hydrants,)


class CityArrays(NamedTuple):
    """Everything fixed of a city."""

    buildings: BuildingArrays
    cover: CoverArrays
    links: LinkArrays
    geometry: GeometryArrays
    near: NearArrays
    streets: StreetArrays


class HealthConstants(NamedTuple):
    """The scalars of the damage model; parameters.HealthParameters has their meaning."""

    slight_damage: float
    slight_below: float  # the three outcomes exclude each other: one uniform draw, cumulative bounds
    serious_damage: float
    serious_below: float
    critical_damage: float
    critical_below: float
    growth: float
    constant: float
    noise_mean: float
    noise_sd: float
    brigade_share: float
    initial_hp: int


class BrigadeConstants(NamedTuple):
    """The scalars of a brigade; lengths in millimetres."""

    tank: int
    power: int
    refuge_refill: int
    hydrant_refill: int
    range_square: float
    speed: int
    free: bool  # a brigade may name targets of any fire site, and belongs to the site of the one it goes for
    keeps: bool  # a brigade stays with its target while that burns, and chooses nothing meanwhile


class ObservationConstants(NamedTuple):
    """Thresholds of what a brigade sees; squares of millimetres, and the unit volume in m3."""

    center_low_square: float
    center_medium_square: float
    civilian_low_square: float
    civilian_medium_square: float
    unit_volume: float
    in_turn: bool  # brigades see what those before them chose in this step; if not, what all chose in the last
    volume_growth: float  # of the thresholds of the volume, one after another
    own_flags: bool  # the flags tell of the brigade itself, too
    flags: int  # what they tell: 0 the action, 1 the target, 2 the target that is sprayed
    heated: bool  # the easiest is looked for among heated buildings, too
    jump: float  # mm, how far beyond a side what frees it may lie
    edge_by_city: bool  # a side is free where the city continues beyond it
    west: float  # mm, of the centroids of all that can burn
    south: float
    east: float
    north: float


class Constants(NamedTuple):
    """All scalars of a world."""

    fire: FireConstants
    health: HealthConstants
    brigades: BrigadeConstants
    observation: ObservationConstants
    reward: Reward


class CivilianState(NamedTuple):
    """The civilians, (c,); they stay where they are."""

    building: Int32  # -1 outdoors
    x: Float64  # mm
    y: Float64  # mm
    full_hp: Int32
    hp: Int32
    damage: Float64  # health points lost per step


class BrigadeState(NamedTuple):
    """The brigades, (b,)."""

    street: Int32  # the street a brigade stands on
    offset: Int64  # mm from that street's first node
    x: Float64  # mm
    y: Float64  # mm
    tank: Int32  # litres
    refilling: UInt8  # 1 from an empty tank until it is full again
    action: Int32  # last choice, -1 none: what the others see
    target: Int32  # building, -1 none
    site: Int32  # number of the fire site, 0 none
    activity: UInt8  # index into records.ACTIVITIES
    refuge: Int32  # refuge building a brigade stands at when the step begins, -1 none
    hydrant: Int32  # hydrant it stands at when the step begins, -1 none
    inside: Int32  # building it is in, -1 on the street
    sprayed: Int32  # litres in the last step
    driven: Int64  # mm in the last step
    hp: Int32
    damage: Float64


class SiteState(NamedTuple):
    """Fire sites: connected sets of burning buildings. At most n of them; counts[0] is how many are in use."""

    counts: Int32  # (3,): sites in use, last number given, burning buildings
    label: Int32  # (n,), number of the site of each burning building, 0 none: kept from step to step
    place: Int32  # (n,), position of each burning building's site in the arrays below, -1 none
    member: UInt32  # (n,), burning buildings, site after site
    start: Int32  # (n+1,), start of each site in member
    number: Int32  # (n,)
    volume: Float64  # (n,), m3
    west: Float64  # (n,), mm, bounding box of the burning buildings
    south: Float64
    east: Float64
    north: Float64
    center_square: Float64  # (n,), nearest burning building to the city's centre
    civilian_square: Float64  # (n,), nearest burning building to an unreached civilian; inf if there is none
    free_sides: UInt8  # (n,), bits N, E, S, W
    building_civilian_square: Float64  # (n,), per burning building


class WayState(NamedTuple):
    """Shortest ways to some nodes, as far as a world has asked for them; m nodes, room for r of them. All zeros: empty.

    They follow from the streets alone; nothing but speed depends on what is kept here. A complete one has a line for
    every node, in their order, and its `line` is empty; it never changes and may be shared.
    """

    line: Int64  # (m + 1,), 1 + the line with the ways to each node, 0 none; last, how often lines were asked for
    table: Int64x2  # (r, 3 + m), a line each: what it is, below; then mm, the shortest way from every node
    heap: Int64x2  # (2, m + arcs), scratch: lengths and nodes


GOAL, KNOWN, USED, WAYS = 0, 1, 2, 3
"""Columns of a line: 1 + the node that its ways lead to, 0 none; up to which length, mm, they are final; how often any
line had been asked for when this one was; the first of its ways."""


class Outcome(NamedTuple):
    """What a step was worth, as one array each of float64; below, what is where in them."""

    reward: Float64  # (6,) the TERMS, then at TOTAL and SUM_SO_FAR their sum and the return
    stock: Float64  # (4,) the TERMS as a stock
    score: Float64  # (3,) SCORES
    counts: Int32  # (4,), COUNTS
    water: Float64  # (1,) litres sprayed so far
    draws: Float64  # (2,) DRAWS


TOTAL, SUM_SO_FAR = len(TERMS), len(TERMS) + 1
SCORES = ("score", "score_max", "score_now")
COUNTS = ("n_burning", "n_water_damaged", "n_burnt_out", "n_civilians_alive")
DRAWS = ("burn_rate_sum", "health_sum")
"""Each named as in `fireworld.records`."""
BURNING = COUNTS.index("n_burning")


class WorldState(NamedTuple):
    """Everything that a step may change; `ways` is no part of what the world is in, only of what it remembers."""

    fire: FireState
    civilians: CivilianState
    brigades: BrigadeState
    sites: SiteState
    outcome: Outcome
    ways: WayState


class NetworkArrays(NamedTuple):
    """A network that values targets, layer after layer; without layers there is none."""

    feature: Int64  # (inputs,), the place of each thing that it reads among the 30 that a brigade sees
    layer: Int64x2  # (layers, 4): inputs, outputs, activation, where its numbers begin
    number: Float64  # of each layer the biases (outputs,), then the weights (inputs, outputs)


class PolicyArrays(NamedTuple):
    """A policy that the kernels can follow by themselves, per brigade."""

    kind: Int32  # (b,), as in `fireworld.kernels.choice`: from FIXED to ASSIGN
    action: Int32  # (b,), the action of kinds 0 and 5
    table_of: Int32  # (b,), the table of kind 2, the ranking of kinds 3, 4 and 7, the target of kind 5 and OWN_TARGET
    tables: Float64x3  # (tables, states, 4)
    rankings: Float64x2  # (rankings, 17), weights
    network: NetworkArrays  # if it has layers, kinds 3 and 4 value targets by it instead of a ranking
    epsilon: Float64  # (1,), probability of a random action instead of the greedy one
    commit: Int64  # (1,), steps that a choice is kept for; 1: a new choice every step


class Trace(NamedTuple):
    """What a team that learns leaves behind of an episode; b brigades, k steps and one more. No rows: nothing."""

    state: Int32x2  # (b, k + 1), what a brigade saw: 0..4319, -1 where it did not look
    action: UInt8x2  # (b, k + 1), what it did; 0 where it did nothing
    choice: UInt8x2  # (b, k + 1), how it came to that: position in fireworld.records.CHOICES
    reward: Float64x2  # (terms, k), of each step; where brigades learn from their own doing, (terms + b, k)


class TargetLearner(NamedTuple):
    """What a team that learns a network of targets remembers; b brigades, k numbers. No rows: it learns none."""

    trace: Float64x2  # (b, k), eligibility: how far each number had part in the values of what was chosen
    decay: Float64  # (1,), lambda: what is left of it from choice to choice, beside the discount
    value: Float64  # (b,), of the last choice
    state_weight: Float64  # (30,), what a state is worth: a weighted sum of the mean of what is seen of its targets
    state_trace: Float64x2  # (b, 30), as trace
    state_seen: Float64  # (30,), scratch: that mean
    commit: Int64  # (1,), steps that a choice is kept for while its target burns
    gradient: Float64  # (k,), scratch
    mean_gradient: Float64  # (k,), scratch: of all targets
    mean_value: Float64  # (1,), scratch
    outputs: Float64x2  # (layers + 1, w), scratch
    back: Float64x2  # (2, w), scratch


class Learner(NamedTuple):
    """What a team that learns changes and remembers; b brigades."""

    learning: UInt8  # (1,), 0: leave everything as it is
    rule: Int64  # (1,): 0 SARSA, 1 expected SARSA, 2 Q-learning
    alpha: Float64  # (1,), learning rate
    alpha_decay: Float64  # (1,): the rate of the n-th visit is alpha / (1 + alpha_decay * (n - 1))
    gamma: Float64  # (1,), discount
    tables: Float64x3  # (tables, states, 4), the policy's own
    visits: Int64x3  # (tables, states, 4)
    state: Int64  # (b,), row of the last choice, -1 none
    action: Int64  # (b,)
    reward: Float64  # (b,), discounted reward since
    discount: Float64  # (b,), discount since
    own: Float64  # (b,), what each gets for its own doing in the step; no rows: all get the team's reward
    td_error: Float64  # (b,), error of the last update
    of_targets: TargetLearner
    trace: Trace


class Seen(NamedTuple):
    """What the brigades saw and chose in a step; b brigades. No rows: nothing is noted."""

    features: Int64x2  # (b, 8)
    state: Int64  # (b,), -1 without a site
    site: Int32  # (b,), number of the fire site that it belonged to
    choice: UInt8  # (b,), how it came to its action: position in fireworld.records.CHOICES
    explored: UInt8  # (b,), 1 where that was a random draw
    action_values: Float64x2  # (b, 4), of the four actions, by the table, ranking or network that chose; else 0
    target_value: Float64  # (b,), of the target, where a ranking or network chose; else 0
    valued: UInt8  # (2,), whether anyone chose BY_TABLE, and BY_RANK


BY_TABLE, BY_RANK = 0, 1
"""Where a choice's values come from; places in `Seen.valued`."""
