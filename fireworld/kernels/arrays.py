"""The arrays that kernels work on, grouped by concern; n buildings, m street nodes.

Named tuples of arrays, because numba compiles and caches them ahead (a jitclass is not cached across processes).
"Arrays" are fixed during an episode, "State" is what a step may change.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from numpy.typing import NDArray

from fireworld.rewards import TERMS, Reward

Array = NDArray[Any]


class BuildingArrays(NamedTuple):
    """What is fixed of each building, (n,); and the k fires that are lit later on."""

    building_id: Array  # int64, keys the building's random draws and breaks ties
    order: Array  # uint32, in which the air exchange visits the buildings
    capacity: Array  # float64, energy per degree (a float32 number)
    initial_fuel: Array  # float32, energy
    ignition_point: Array  # float64, degrees above ambient
    emission: Array  # float64, energy radiated a step per K^4: wall_area * coefficient * Stefan-Boltzmann
    inflammable: Array  # uint8
    later_step: Array  # (k,) int64, rising: the step in which each later fire is lit
    later_building: Array  # (k,) int64, the building that it is lit in


class CoverArrays(NamedTuple):
    """Each building's block of air cells: rows along x, cells along y; rows padded to a multiple of four cells."""

    x0: Array  # (n,) uint32, first row in the padded grid
    y0: Array  # (n,) uint32, first cell in the padded grid
    rows: Array  # (n,) uint32
    width: Array  # (n,) uint32, multiple of 4
    ptr: Array  # (n,) uint32, start in weight
    weight: Array  # float64, energy per degree of difference: flow * cover * cell size; 0 where not covered


class LinkArrays(NamedTuple):
    """Radiation links as CSR over the emitting buildings."""

    ptr: Array  # (n+1,) uint32
    building: Array  # uint32
    share: Array  # float64 (a float32 number)


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

    energy: Array  # (n,) float64
    fuel: Array  # (n,) float32
    water: Array  # (n,) int32, litres lying on the building
    watered: Array  # (n,) uint8, 1 once water has reached it
    fieryness: Array  # (n,) uint8, official code
    air: Array  # (nx + 2, pitch) float64, degrees; a border of zeros around the nx * ny cells
    warm: Array  # (4,) int64, box of the air that may differ from zero: first row, end, first cell, end
    span: Array  # (2, nx + 2) uint64, cells of each row of the air that may differ from zero: first, end
    rate: Array  # (n,) float64, burn rate of the step where a building burns
    emitted: Array  # (n,) float64, scratch
    scratch: Array  # (2, pitch) float64, scratch


class GeometryArrays(NamedTuple):
    """Where the buildings are and how big they are, (n,) float64; lengths in millimetres."""

    x: Array  # centroid
    y: Array
    west: Array  # bounding box of the outline
    south: Array
    east: Array
    north: Array
    center_square: Array  # squared distance of the centroid from the city's centre
    volume: Array  # m3
    floor_area: Array  # m2, ground area * floors


class NearArrays(NamedTuple):
    """Which buildings belong to one fire site when both burn, as CSR."""

    ptr: Array  # (n+1,) uint32
    building: Array  # uint32


class StreetArrays(NamedTuple):
    """The street graph; lengths in whole millimetres."""

    node_x: Array  # (m,) float64
    node_y: Array  # (m,) float64
    first: Array  # (k,) int32, first node of each street
    second: Array  # (k,) int32
    length: Array  # (k,) int64
    arc_ptr: Array  # (m+1,) int32, streets at each node, as CSR
    arc_node: Array  # (2k,) int32, node at the other end
    arc_street: Array  # (2k,) int32
    access_street: Array  # (n,) int32, where each building is reached
    access_offset: Array  # (n,) int64, from that street's first node
    refuge: Array  # (refuges,) int32, buildings where tanks are refilled
    hydrant_node: Array  # (hydrants,) int32


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


class BrigadeConstants(NamedTuple):
    """The scalars of a brigade; lengths in millimetres."""

    tank: int
    power: int
    refuge_refill: int
    hydrant_refill: int
    range_square: float
    speed: int


class ObservationConstants(NamedTuple):
    """Thresholds of what a brigade sees; squares of millimetres, and the unit volume in m3."""

    center_low_square: float
    center_medium_square: float
    civilian_low_square: float
    civilian_medium_square: float
    unit_volume: float
    in_turn: bool  # brigades see what those before them chose in this step; if not, what all chose in the last


class Constants(NamedTuple):
    """All scalars of a world."""

    fire: FireConstants
    health: HealthConstants
    brigades: BrigadeConstants
    observation: ObservationConstants
    reward: Reward


class CivilianState(NamedTuple):
    """The civilians, (c,); they stay where they are."""

    building: Array  # int32, -1 outdoors
    x: Array  # float64, mm
    y: Array  # float64, mm
    full_hp: Array  # int32
    hp: Array  # int32
    damage: Array  # float64, health points lost per step


class BrigadeState(NamedTuple):
    """The brigades, (b,)."""

    street: Array  # int32, the street a brigade stands on
    offset: Array  # int64, mm from that street's first node
    x: Array  # float64, mm
    y: Array  # float64, mm
    tank: Array  # int32, litres
    refilling: Array  # uint8, 1 from an empty tank until it is full again
    action: Array  # int32, last choice, -1 none: what the others see
    target: Array  # int32, building, -1 none
    site: Array  # int32, number of the fire site, 0 none
    activity: Array  # uint8, index into records.ACTIVITIES
    refuge: Array  # int32, refuge building a brigade stands at when the step begins, -1 none
    hydrant: Array  # int32, hydrant it stands at when the step begins, -1 none
    inside: Array  # int32, building it is in, -1 on the street
    sprayed: Array  # int32, litres in the last step
    driven: Array  # int64, mm in the last step
    hp: Array  # int32
    damage: Array  # float64


class SiteState(NamedTuple):
    """Fire sites: connected sets of burning buildings. At most n of them; counts[0] is how many are in use."""

    counts: Array  # (3,) int32: sites in use, last number given, burning buildings
    label: Array  # (n,) int32, number of the site of each burning building, 0 none: kept from step to step
    place: Array  # (n,) int32, position of each burning building's site in the arrays below, -1 none
    member: Array  # (n,) uint32, burning buildings, site after site
    start: Array  # (n+1,) int32, start of each site in member
    number: Array  # (n,) int32
    volume: Array  # (n,) float64, m3
    west: Array  # (n,) float64, mm, bounding box of the burning buildings
    south: Array
    east: Array
    north: Array
    center_square: Array  # (n,) float64, nearest burning building to the city's centre
    civilian_square: Array  # (n,) float64, nearest burning building to an unreached civilian; inf if there is none
    free_sides: Array  # (n,) uint8, bits N, E, S, W
    building_civilian_square: Array  # (n,) float64, per burning building


class WayState(NamedTuple):
    """Shortest ways to some nodes, as far as a world has asked for them; m nodes, room for r of them. All zeros: empty.

    They follow from the streets alone; nothing but speed depends on what is kept here. A complete one has a line for
    every node, in their order, and its `line` is empty; it never changes and may be shared.
    """

    line: Array  # (m + 1,) int64, 1 + the line with the ways to each node, 0 none; last, how often lines were asked for
    table: Array  # (r, 3 + m) int64, a line each: what it is, below; then mm, the shortest way from every node
    heap: Array  # (2, m + arcs) int64, scratch: lengths and nodes


GOAL, KNOWN, USED, WAYS = 0, 1, 2, 3
"""Columns of a line: 1 + the node that its ways lead to, 0 none; up to which length, mm, they are final; how often any
line had been asked for when this one was; the first of its ways."""


class Outcome(NamedTuple):
    """What a step was worth, as one array each of float64; below, what is where in them."""

    reward: Array  # (6,) the TERMS, then at TOTAL and SUM_SO_FAR their sum and the return
    stock: Array  # (4,) the TERMS as a stock
    score: Array  # (3,) SCORES
    counts: Array  # (4,) int32, COUNTS
    water: Array  # (1,) litres sprayed so far
    draws: Array  # (2,) DRAWS


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

    feature: Array  # (inputs,) int64, the place of each feature that it reads among the 17 of a ranking
    layer: Array  # (layers, 4) int64: inputs, outputs, activation, where its numbers begin
    number: Array  # float64, of each layer the biases (outputs,), then the weights (inputs, outputs)


class PolicyArrays(NamedTuple):
    """A policy that the kernels can follow by themselves, per brigade."""

    kind: Array  # (b,) int32: 0 always one action, 1 random, 2 greedy in a table, 3 and 4 by what targets are worth
    action: Array  # (b,) int32, the action of kind 0
    table_of: Array  # (b,) int32, the table of kind 2, the ranking of kinds 3 and 4
    tables: Array  # (tables, states, 4) float64
    rankings: Array  # (rankings, 17) float64, weights
    network: NetworkArrays  # if it has layers, kinds 3 and 4 value targets by it instead of a ranking
    epsilon: Array  # (1,) float64, probability of a random action instead of the greedy one
    commit: Array  # (1,) int64, steps that a choice is kept for; 1: a new choice every step


class Trace(NamedTuple):
    """What a team that learns leaves behind of an episode; b brigades, k steps and one more. No rows: nothing."""

    state: Array  # (b, k + 1) int32, what a brigade saw: 0..4319, -1 where it did not look
    action: Array  # (b, k + 1) uint8, what it did; 0 where it did nothing
    choice: Array  # (b, k + 1) uint8, how it came to that: position in fireworld.records.CHOICES
    reward: Array  # (terms, k) float64, of each step


class Learner(NamedTuple):
    """What a team that learns changes and remembers; b brigades."""

    learning: Array  # (1,) uint8, 0: leave everything as it is
    rule: Array  # (1,) int64: 0 SARSA, 1 expected SARSA, 2 Q-learning
    alpha: Array  # (1,) float64, learning rate
    alpha_decay: Array  # (1,) float64: the rate of the n-th visit is alpha / (1 + alpha_decay * (n - 1))
    gamma: Array  # (1,) float64, discount
    tables: Array  # (tables, states, 4) float64, the policy's own
    visits: Array  # (tables, states, 4) int64
    state: Array  # (b,) int64, row of the last choice, -1 none
    action: Array  # (b,) int64
    reward: Array  # (b,) float64, discounted reward since
    discount: Array  # (b,) float64, discount since
    td_error: Array  # (b,) float64, error of the last update
    trace: Trace
