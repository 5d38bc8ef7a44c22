"""Brigades: refilling, spraying and driving along the streets."""

from __future__ import annotations

import numpy as np

from fireworld.kernels.arrays import (
    WAYS,
    Array,
    BrigadeConstants,
    BrigadeState,
    FireState,
    GeometryArrays,
    StreetArrays,
    WayState,
)
from fireworld.kernels.jit import inner, kernel
from fireworld.kernels.ways import NOWHERE, lines_to, next_street, way

IDLE, DRIVING, SPRAYING, TO_REFUGE, REFILLING, DEAD = 0, 1, 2, 3, 4, 5
ACCEPTED, UNKNOWN_BRIGADE, OVER_POWER, TANK_TOO_LOW, OUT_OF_RANGE, NEGATIVE = 1, -1, -2, -3, -4, -5
NO_TARGET = np.int64(-1)


@kernel
def judge_request(litres: int, sprayed: int, tank: int, distance_square: float, constants: BrigadeConstants) -> int:
    """Return the official result code of an extinguish request of a known brigade; MODEL 2.2.

    `sprayed`: litres of its requests already accepted in this step. `distance_square`: to the building's centroid,
    mm^2.
    """
    if sprayed + litres > constants.power:
        return OVER_POWER
    if litres > tank:
        return TANK_TOO_LOW
    if distance_square > constants.range_square:
        return OUT_OF_RANGE
    return NEGATIVE if litres < 0 else ACCEPTED


@kernel
def distance_square(x: float, y: float, other_x: float, other_y: float) -> float:
    """Return the squared distance between two points, mm^2."""
    dx, dy = other_x - x, other_y - y
    return dx * dx + dy * dy


@inner
def locate(street: int, offset: int, streets: StreetArrays) -> tuple[float, float]:
    """Return the point at an offset along a street, mm."""
    first, second = streets.first[street], streets.second[street]
    part = offset / streets.length[street]
    x, y = streets.node_x[first], streets.node_y[first]
    return x + (streets.node_x[second] - x) * part, y + (streets.node_y[second] - y) * part


@inner
def end_offset(street: int, node: int, streets: StreetArrays) -> np.int64:
    """Return the offset of a street's end at a node."""
    return np.int64(0) if node == streets.first[street] else streets.length[street]


@inner
def stop_in_range(
    street: int,
    offset: int,
    goal: int,
    target: int,
    range_square: float,
    geometry: GeometryArrays,
    streets: StreetArrays,
) -> int:
    """Return the offset of the first whole millimetre from `offset` towards `goal` within range of the target.

    `goal` itself if no point on the way is within range. Works on the straight street: the root of a quadratic.
    """
    if target < 0 or goal == offset:
        return goal
    x, y = locate(street, offset, streets)
    goal_x, goal_y = locate(street, goal, streets)
    span = abs(goal - offset)
    ahead = 1 if goal > offset else -1
    ux, uy = (goal_x - x) / span, (goal_y - y) / span
    dx, dy = geometry.x[target] - x, geometry.y[target] - y
    unit = ux * ux + uy * uy  # not quite 1, because the lengths of streets are whole millimetres
    along = dx * ux + dy * uy
    rest = along * along - unit * (dx * dx + dy * dy - range_square)
    if along <= 0.0 or rest < 0.0:
        return goal
    root = np.sqrt(rest)
    nearest, farthest = int((along - root) / unit), int((along + root) / unit)
    for way_mm in range(max(1, nearest), min(farthest + 1, span)):  # the second at the latest, unless it but grazes
        x, y = locate(street, offset + ahead * way_mm, streets)
        if distance_square(x, y, geometry.x[target], geometry.y[target]) <= range_square:
            return offset + ahead * way_mm
    return goal


@inner
def drive(
    brigade: int,
    goal_building: int,
    target: int,
    brigades: BrigadeState,
    streets: StreetArrays,
    ways: WayState,
    geometry: GeometryArrays,
    constants: BrigadeConstants,
) -> None:
    """Drive a brigade along the shortest way to where a building is entered, one step's worth at most.

    It stops early where the target (a building, -1 for none) comes into range. Without a way it stays.
    """
    goal_street, goal_offset = np.int64(streets.access_street[goal_building]), streets.access_offset[goal_building]
    left = constants.speed
    street, offset = np.int64(brigades.street[brigade]), brigades.offset[brigade]
    to_first, to_second = lines_to(goal_street, street, streets, ways)
    while left > 0:
        length, leave, line = way(street, offset, goal_street, goal_offset, to_first, to_second, streets, ways)
        if length >= NOWHERE:
            break
        if length == 0:  # there, perhaps at a crossing that the goal's street shares
            street, offset = goal_street, goal_offset
            break
        goal = goal_offset if leave < 0 else end_offset(street, leave, streets)
        if goal == offset:  # at the node by which to leave: turn into the next street
            if ways.table[line, WAYS + leave] == 0:
                street, goal = goal_street, goal_offset
            else:
                street, node = next_street(leave, line, streets, ways)
                goal = end_offset(street, node, streets)
            offset = end_offset(street, leave, streets)
        ahead = min(left, abs(goal - offset))
        stop = offset + ahead if goal > offset else offset - ahead
        reached = stop_in_range(street, offset, stop, target, constants.range_square, geometry, streets)
        left -= abs(reached - offset)
        brigades.driven[brigade] += abs(reached - offset)
        offset = reached
        if reached != stop:
            break
        if target >= 0:
            x, y = locate(street, offset, streets)
            if distance_square(x, y, geometry.x[target], geometry.y[target]) <= constants.range_square:
                break
    brigades.street[brigade], brigades.offset[brigade] = street, offset
    brigades.x[brigade], brigades.y[brigade] = locate(street, offset, streets)


@inner
def refuge_at(street: int, offset: int, streets: StreetArrays) -> np.int64:
    """Return the refuge building that is entered from a point of a street, -1 if none."""
    for k in range(len(streets.refuge)):
        b = streets.refuge[k]
        if streets.access_street[b] == street and streets.access_offset[b] == offset:
            return np.int64(b)
    return np.int64(-1)


@inner
def nearest_refuge(street: int, offset: int, streets: StreetArrays, ways: WayState) -> np.int64:
    """Return the refuge building with the shortest way (ties: first listed), -1 if none can be reached."""
    best, best_length = np.int64(-1), NOWHERE
    for k in range(len(streets.refuge)):
        b = np.int64(streets.refuge[k])
        goal_street, goal_offset = np.int64(streets.access_street[b]), streets.access_offset[b]
        to_first, to_second = lines_to(goal_street, street, streets, ways)
        length, _, _ = way(street, offset, goal_street, goal_offset, to_first, to_second, streets, ways)
        if length < best_length:
            best, best_length = b, length
    return best


@kernel
def refill(refuge: Array, hydrant: Array, hp: Array, tank: Array, constants: BrigadeConstants) -> None:
    """Fill the tanks of the brigades at a refuge, and of the lowest one at each hydrant; MODEL 2.1.

    All (b,) int32: refuge and hydrant that a brigade stands at, -1 none; health (the dead do nothing); litres, changed.
    """
    for brigade in range(len(tank)):
        if hp[brigade] <= 0:
            continue
        if refuge[brigade] >= 0:
            tank[brigade] = min(tank[brigade] + constants.refuge_refill, constants.tank)
        elif hydrant[brigade] >= 0:
            first = True
            for other in range(brigade):
                first = first and not (hp[other] > 0 and hydrant[other] == hydrant[brigade])
            if first:
                tank[brigade] = min(tank[brigade] + constants.hydrant_refill, constants.tank)


@inner
def find_stations(brigades: BrigadeState, streets: StreetArrays) -> None:
    """Find the refuge and the hydrant that every brigade stands at."""
    for brigade in range(len(brigades.tank)):
        street, offset = np.int64(brigades.street[brigade]), brigades.offset[brigade]
        brigades.refuge[brigade] = refuge_at(street, offset, streets)
        brigades.hydrant[brigade] = -1
        for k in range(len(streets.hydrant_node)):
            node = streets.hydrant_node[k]
            if brigades.x[brigade] == streets.node_x[node] and brigades.y[brigade] == streets.node_y[node]:
                brigades.hydrant[brigade] = k


@kernel
def spray(brigade: int, target: int, litres: int, brigades: BrigadeState, fire: FireState) -> None:
    """Move litres from a brigade's tank onto a building."""
    brigades.tank[brigade] -= litres
    brigades.sprayed[brigade] += litres
    fire.water[target] += litres
    fire.watered[target] = 1


@inner
def fight(
    brigade: int,
    target: int,
    brigades: BrigadeState,
    fire: FireState,
    geometry: GeometryArrays,
    constants: BrigadeConstants,
) -> int:
    """Spray the target if it is in range, else set out for it; return the litres sprayed."""
    square = distance_square(brigades.x[brigade], brigades.y[brigade], geometry.x[target], geometry.y[target])
    litres = min(constants.power, brigades.tank[brigade])
    if litres > 0 and judge_request(litres, 0, brigades.tank[brigade], square, constants) == ACCEPTED:
        brigades.activity[brigade] = SPRAYING
        spray(brigade, target, litres, brigades, fire)
        return litres
    if square > constants.range_square:
        brigades.activity[brigade] = DRIVING
    return 0


@inner
def seek_water(brigade: int, brigades: BrigadeState, streets: StreetArrays, ways: WayState) -> np.int64:
    """Let a brigade fill its tank at its refuge, or return the one to drive to; -1 for none."""
    if brigades.refuge[brigade] >= 0:
        brigades.activity[brigade] = REFILLING
        return np.int64(-1)
    street, offset = np.int64(brigades.street[brigade]), brigades.offset[brigade]
    refuge = nearest_refuge(street, offset, streets, ways)
    if refuge >= 0:
        brigades.activity[brigade] = TO_REFUGE
    return refuge


@inner
def act(
    brigades: BrigadeState,
    fire: FireState,
    streets: StreetArrays,
    ways: WayState,
    geometry: GeometryArrays,
    constants: BrigadeConstants,
) -> int:
    """Let every brigade do what it chose: refill, spray, or drive; return the litres sprayed. MODEL 2.1-2.2 and 4."""
    find_stations(brigades, streets)
    refill(brigades.refuge, brigades.hydrant, brigades.hp, brigades.tank, constants)
    total = 0
    for brigade in range(len(brigades.tank)):
        brigades.sprayed[brigade] = 0
        brigades.driven[brigade] = 0
        target, goal = np.int64(brigades.target[brigade]), np.int64(-1)  # what to fight, and where to drive
        brigades.activity[brigade] = IDLE
        if brigades.hp[brigade] <= 0:
            brigades.activity[brigade] = DEAD
        elif brigades.refilling[brigade] != 0:
            target = NO_TARGET
            goal = seek_water(brigade, brigades, streets, ways)
        elif target >= 0:
            total += fight(brigade, target, brigades, fire, geometry, constants)
            if brigades.activity[brigade] == DRIVING:
                goal = target
        if goal >= 0:
            drive(brigade, goal, target, brigades, streets, ways, geometry, constants)
        if brigades.tank[brigade] == 0:
            brigades.refilling[brigade] = 1
        elif brigades.tank[brigade] == constants.tank:
            brigades.refilling[brigade] = 0
    return total


@inner
def shelter(brigades: BrigadeState) -> None:
    """Note the building each brigade is in: its refuge while it refills there, else none."""
    for brigade in range(len(brigades.tank)):
        brigades.inside[brigade] = brigades.refuge[brigade] if brigades.activity[brigade] == REFILLING else -1
