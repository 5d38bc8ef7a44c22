"""What a team of fire brigades sees, decides and does, in plain Python: MODEL 2.1, 2.2, 4 and 5.

There are few brigades, and each does something else: loops over plain numbers are faster here than arrays.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, NamedTuple, Self

import numpy as np

from fireworld import draws
from fireworld.city.city import Array, City, Float64Array
from fireworld.parameters import BrigadeParameters
from fireworld.policy.kernel import KernelPolicy
from fireworld.records import ACTIONS, ACTIVITIES
from tests.reference import fire, sites
from tests.reference.ways import shortest_ways

IDLE, DRIVING, SPRAYING, TO_REFUGE, REFILLING, DEAD = range(len(ACTIVITIES))
EASIEST, NEAREST_TO_CIVILIAN, NEAREST_TO_CENTER, NEAREST_TO_ME = range(len(ACTIONS))
FIXED, RANDOM = 0, 1
N_STATES_WITHOUT_FLAGS: Final = 270


class Place(NamedTuple):
    """A point of a street: millimetres from the street's first node."""

    street: int
    offset_mm: int


class Way(NamedTuple):
    """A shortest way: its length and the nodes by which it leaves one street and arrives at the other."""

    length_mm: int
    leave: int
    arrive: int


@dataclass(frozen=True)
class StreetArrays:
    """The street graph as plain numbers, but for the two tables of all pairs of nodes: the kernels look for ways."""

    node_mm: list[tuple[float, float]]
    ends: list[tuple[int, int]]  # nodes of each street
    length_mm: list[int]
    distance_mm: Array  # (m, m), -1 where there is no way
    next_node: Array  # (m, m)
    street_between: dict[tuple[int, int], int]  # the shortest between two neighbours, of equal ones the lowest
    entrance: list[Place]  # of each building
    entrance_mm: list[tuple[float, float]]  # in whole millimetres
    refuge_at: dict[Place, int]  # refuges, rising
    hydrant_at: dict[tuple[float, float], int]

    @classmethod
    def of_city(cls, city: City) -> Self:
        """Prepare a city."""
        streets = city.streets
        distance_mm, next_node = shortest_ways(streets)
        node_mm = [(float(x), float(y)) for x, y in streets.node_mm.tolist()]
        ends = [(a, b) for a, b in streets.street.tolist()]
        length_mm = streets.street_length_mm.tolist()
        between: dict[tuple[int, int], int] = {}
        for street in sorted(range(len(ends)), key=lambda one: (-length_mm[one], -one)):  # the best comes last
            a, b = ends[street]
            between[a, b] = between[b, a] = street
        entrance = [
            Place(street, offset)
            for street, offset in zip(streets.access_street.tolist(), streets.access_offset_mm.tolist(), strict=True)
        ]
        refuges = np.flatnonzero(city.footprints.refuge).tolist()
        return cls(
            node_mm=node_mm,
            ends=ends,
            length_mm=length_mm,
            distance_mm=distance_mm,
            next_node=next_node,
            street_between=between,
            entrance=entrance,
            entrance_mm=[(float(x), float(y)) for x, y in streets.access_mm.tolist()],
            refuge_at={entrance[refuge]: refuge for refuge in reversed(refuges)},  # of two at one entrance the first
            hydrant_at={node_mm[node]: k for k, node in enumerate(streets.hydrant_node.tolist())},
        )

    def locate(self, place: Place) -> tuple[float, float]:
        """Return the point of a place, mm."""
        first, second = self.ends[place.street]
        part = place.offset_mm / self.length_mm[place.street]
        (x, y), (end_x, end_y) = self.node_mm[first], self.node_mm[second]
        return x + (end_x - x) * part, y + (end_y - y) * part

    def end(self, street: int, node: int) -> Place:
        """Return the place at a node of a street."""
        return Place(street, 0 if node == self.ends[street][0] else self.length_mm[street])

    def way(self, start: Place, goal: Place) -> Way | None:
        """Return the shortest way between places of two streets, None if there is none. Ties: first nodes first."""
        best = None
        for leave in self.ends[start.street]:
            out = abs(self.end(start.street, leave).offset_mm - start.offset_mm)
            for arrive in self.ends[goal.street]:
                between = self.distance_mm.item(leave, arrive)
                if between >= 0:
                    length = out + between + abs(self.end(goal.street, arrive).offset_mm - goal.offset_mm)
                    if best is None or length < best.length_mm:
                        best = Way(length, leave, arrive)
        return best

    def distance(self, start: Place, goal: Place) -> float:
        """Return the length of the way between two places; on one street it is the way along it."""
        if start.street == goal.street:
            return abs(goal.offset_mm - start.offset_mm)
        way = self.way(start, goal)
        return math.inf if way is None else way.length_mm


@dataclass
class Brigade:
    """One fire brigade; its health is kept with that of the civilians."""

    place: Place
    x: float
    y: float
    tank_litres: int
    refilling: bool = False
    action: int = -1
    target: int = -1
    site: int = 0
    activity: int = IDLE
    refuge: int = -1  # where it stands when the step begins
    hydrant: int = -1
    sprayed_litres: int = 0
    driven_mm: int = 0

    def square_to(self, x: float, y: float) -> float:
        """Return the squared distance to a point, mm^2."""
        return (x - self.x) * (x - self.x) + (y - self.y) * (y - self.y)


def join_sites(team: list[Brigade], tables: sites.SiteTables, found: sites.Sites | None) -> None:
    """Keep every brigade with its site; it follows one that merged, and goes to the nearest fire when it is out."""
    for brigade in team:
        if found is None:
            brigade.site = 0
            continue
        if brigade.site in found.number:
            continue
        follows = found.place[found.memory_before[found.member] == brigade.site] if brigade.site > 0 else ()
        if len(follows):
            brigade.site = found.number[follows.min()]
        else:
            dx, dy = tables.x[found.member] - brigade.x, tables.y[found.member] - brigade.y
            nearest = sites.lowest_id(tables, found.member, dx * dx + dy * dy)
            brigade.site = found.number[found.place[found.member == nearest].item()]


def observe(brigade: Brigade, others: list[int], found: sites.Sites) -> int:
    """Return the state that a brigade sees: four features of its site, and which actions the others are known to do."""
    free_edges, center, civilian, volume = found.features[found.of_number(brigade.site)]
    state = ((free_edges * 3 + center) * 3 + civilian) * 6 + volume
    for action in range(len(ACTIONS)):
        state = state * 2 + (action in others)
    return state


def keeps_choice(policy: KernelPolicy, who: int, last_action: int, step: int) -> bool:
    """Tell whether a brigade goes on with its last choice: choices last some steps; brigades renew them by turns."""
    return last_action >= 0 and (step + who) % policy.commit != 0


def choose(policy: KernelPolicy, who: int, state: int, *, seed: int, step: int) -> int:
    """Return the action that a brigade's policy takes in a state."""
    turn = who % len(policy.kinds)
    if policy.kinds[turn] == FIXED:
        return policy.actions[turn]
    if policy.kinds[turn] == RANDOM or (
        policy.epsilon > 0 and draws.uniform(seed, draws.EXPLORE, who, step) < policy.epsilon
    ):
        return draws.below(seed, draws.ACTION, who, step, bound=len(ACTIONS))
    table = policy.tables[policy.table_of[turn]]
    return int(np.argmax(table[state // 16 if len(table) == N_STATES_WITHOUT_FLAGS else state]))


def find_target(
    brigade: Brigade,
    action: int,
    *,
    tables: sites.SiteTables,
    found: sites.Sites,
    energy: Float64Array,
    capacity: Float64Array,
) -> int:
    """Return the burning building of a brigade's site that an action names; ties: lowest id."""
    part = found.members(found.of_number(brigade.site))
    members = found.member[part]
    if action == EASIEST:
        measure = energy[members] / capacity[members]
    elif action == NEAREST_TO_CIVILIAN:
        measure = found.civilian_square[part]
    elif action == NEAREST_TO_CENTER:
        measure = tables.extremes[4, members]
    else:
        dx, dy = tables.x[members] - brigade.x, tables.y[members] - brigade.y
        measure = dx * dx + dy * dy
    return sites.lowest_id(tables, members, measure)


def refill(team: list[Brigade], alive: list[bool], streets: StreetArrays, parameters: BrigadeParameters) -> None:
    """Fill the tanks of those at a refuge, and of the first brigade at each hydrant."""
    taken: set[int] = set()
    for brigade, lives in zip(team, alive, strict=True):
        brigade.refuge = streets.refuge_at.get(brigade.place, -1)
        brigade.hydrant = streets.hydrant_at.get((brigade.x, brigade.y), -1)
        if not lives:
            continue
        gain = 0
        if brigade.refuge >= 0:
            gain = parameters.refuge_refill_litres
        elif brigade.hydrant >= 0 and brigade.hydrant not in taken:
            gain = parameters.hydrant_refill_litres
        taken.add(brigade.hydrant)
        brigade.tank_litres = min(brigade.tank_litres + gain, parameters.tank_litres)


def act(
    team: list[Brigade],
    alive: list[bool],
    *,
    streets: StreetArrays,
    tables: sites.SiteTables,
    state: fire.FireState,
    parameters: BrigadeParameters,
) -> int:
    """Let every brigade refill, spray or drive as it has decided; return the litres sprayed."""
    refill(team, alive, streets, parameters)
    range_mm = parameters.range_m * 1000.0
    for brigade, lives in zip(team, alive, strict=True):
        brigade.sprayed_litres = brigade.driven_mm = 0
        brigade.activity = IDLE
        if not lives:
            brigade.activity = DEAD
        elif brigade.refilling:
            seek_water(brigade, streets, parameters)
        elif brigade.target >= 0:
            x, y = tables.x.item(brigade.target), tables.y.item(brigade.target)
            if brigade.square_to(x, y) > range_mm * range_mm:
                brigade.activity = DRIVING
                drive(brigade, streets, streets.entrance[brigade.target], parameters, aim=(x, y))
            elif parameters.power_litres > 0 and brigade.tank_litres > 0:
                brigade.activity = SPRAYING
                brigade.sprayed_litres = min(parameters.power_litres, brigade.tank_litres)
                brigade.tank_litres -= brigade.sprayed_litres
                fire.pour(state, brigade.target, brigade.sprayed_litres)
        brigade.refilling = brigade.tank_litres == 0 or (
            brigade.refilling and brigade.tank_litres < parameters.tank_litres
        )
    return sum(brigade.sprayed_litres for brigade in team)


def seek_water(brigade: Brigade, streets: StreetArrays, parameters: BrigadeParameters) -> None:
    """Stay at a refuge, or drive to the nearest one; ties: the first."""
    if brigade.refuge >= 0:
        brigade.activity = REFILLING
        return
    refuges = sorted(streets.refuge_at, key=streets.refuge_at.__getitem__)
    if refuges:
        nearest = min(refuges, key=lambda refuge: streets.distance(brigade.place, refuge))
        if streets.distance(brigade.place, nearest) < math.inf:
            brigade.activity = TO_REFUGE
            drive(brigade, streets, nearest, parameters, aim=None)


def drive(
    brigade: Brigade,
    streets: StreetArrays,
    goal: Place,
    parameters: BrigadeParameters,
    *,
    aim: tuple[float, float] | None,
) -> None:
    """Drive towards a place for a step, street by street; stop at the first millimetre with the aim in range."""
    left_mm = round(parameters.speed_m * 1000)
    range_mm = parameters.range_m * 1000.0
    here = brigade.place
    in_range = False
    while left_mm > 0 and not in_range:
        here, ahead = next_stretch(here, goal, streets)
        if ahead is None or here == goal:
            break
        way_mm = min(left_mm, abs(ahead.offset_mm - here.offset_mm))
        stop_mm = way_mm if aim is None else first_in_range(here, ahead, way_mm, aim, range_mm * range_mm, streets)
        in_range = stop_mm is not None and aim is not None
        driven = way_mm if stop_mm is None else stop_mm
        here = Place(here.street, here.offset_mm + (driven if ahead.offset_mm > here.offset_mm else -driven))
        left_mm -= driven
        brigade.driven_mm += driven
    brigade.place = here
    brigade.x, brigade.y = streets.locate(here)


def next_stretch(here: Place, goal: Place, streets: StreetArrays) -> tuple[Place, Place | None]:
    """Turn into the next street where one ends; return the place on it and how far to follow it, None for no way."""
    if here.street == goal.street:
        return here, goal
    way = streets.way(here, goal)
    if way is None:
        return here, None
    if way.length_mm == 0:  # a crossing that the goal's street shares
        return goal, goal
    exit_place = streets.end(here.street, way.leave)
    if here != exit_place:
        return here, exit_place
    if way.leave == way.arrive:
        return streets.end(goal.street, way.leave), goal
    node = streets.next_node.item(way.leave, way.arrive)
    street = streets.street_between[way.leave, node]
    return streets.end(street, way.leave), streets.end(street, node)


def first_in_range(
    here: Place, ahead: Place, way_mm: int, aim: tuple[float, float], range_square: float, streets: StreetArrays
) -> int | None:
    """Return the first whole millimetre, 1 to way_mm, from which the aim is in range; None if there is none.

    Solves where the straight street enters the circle around the aim, and looks around that place.
    """
    x, y = streets.locate(here)
    direction = 1 if ahead.offset_mm > here.offset_mm else -1

    def square(mm: int) -> float:
        at_x, at_y = streets.locate(Place(here.street, here.offset_mm + direction * mm))
        return (aim[0] - at_x) * (aim[0] - at_x) + (aim[1] - at_y) * (aim[1] - at_y)

    first, second = streets.ends[here.street]
    (first_x, first_y), (second_x, second_y) = streets.node_mm[first], streets.node_mm[second]
    length = streets.length_mm[here.street]
    ux, uy = direction * (second_x - first_x) / length, direction * (second_y - first_y) / length
    dx, dy = aim[0] - x, aim[1] - y
    unit = ux * ux + uy * uy  # not quite 1: lengths are whole millimetres
    along = dx * ux + dy * uy
    under_root = along * along - unit * (dx * dx + dy * dy - range_square)
    if unit > 0 and along > 0 and under_root >= 0:
        enters = int((along - math.sqrt(under_root)) / unit)
        for mm in range(max(1, enters - 1), min(enters + 3, way_mm + 1)):
            if square(mm) <= range_square:
                return mm
    return None
