"""Shortest ways on the streets: looked for when somebody asks, and kept for whoever asks next."""

from __future__ import annotations

import numpy as np

from fireworld.kernels.arrays import GOAL, KNOWN, USED, WAYS, StreetArrays, WayState
from fireworld.kernels.jit import inner, kernel

NOWHERE = np.int64(1) << 60
"""Length of a way that there is not, mm."""
LENGTH, NODE = 0, 1
"""Rows of the heap."""


@inner
def push(length: int, node: int, n_waiting: int, ways: WayState) -> int:
    """Put a node on the heap of those still to be spread from, the nearest on top; return how many wait there."""
    heap = ways.heap
    place = n_waiting
    while place > 0:
        above = (place - 1) // 2
        if heap[LENGTH, above] <= length:
            break
        heap[LENGTH, place], heap[NODE, place] = heap[LENGTH, above], heap[NODE, above]
        place = above
    heap[LENGTH, place], heap[NODE, place] = length, node
    return n_waiting + 1


@inner
def drop_top(n_waiting: int, ways: WayState) -> int:
    """Take the nearest node off the heap; return how many still wait there."""
    heap = ways.heap
    n_waiting -= 1
    length, node = heap[LENGTH, n_waiting], heap[NODE, n_waiting]
    place = 0
    while True:
        below = 2 * place + 1
        if below >= n_waiting:
            break
        if below + 1 < n_waiting and heap[LENGTH, below + 1] < heap[LENGTH, below]:
            below += 1
        if heap[LENGTH, below] >= length:
            break
        heap[LENGTH, place], heap[NODE, place] = heap[LENGTH, below], heap[NODE, below]
        place = below
    heap[LENGTH, place], heap[NODE, place] = length, node
    return n_waiting


@inner
def take_line(goal: int, ways: WayState) -> np.int64:
    """Give a node the line that nobody has asked for the longest time, with nothing in it yet; return the line."""
    table = ways.table
    line = np.int64(0)
    for other in range(len(table)):
        if table[other, USED] < table[line, USED]:
            line = np.int64(other)
    if table[line, GOAL] > 0:
        ways.line[table[line, GOAL] - 1] = 0
    table[line, GOAL], ways.line[goal] = goal + 1, line + 1
    table[line, KNOWN] = -1
    for k in range(WAYS, table.shape[1]):
        table[line, k] = NOWHERE
    table[line, WAYS + goal] = 0
    return line


@inner
def look_further(line: int, node: int, beyond: int, streets: StreetArrays, ways: WayState) -> None:
    """Look for the way from a node to a line's goal, and for all others up to `beyond` mm longer.

    The search goes from the goal outwards. What the line holds already is taken up: lengths up to the known one
    are final, and those from there on are of nodes that have been reached but not passed through.
    """
    distance, known = ways.table[line, WAYS:], ways.table[line, KNOWN]
    n_waiting = 0
    if known < 0:
        n_waiting = push(0, ways.table[line, GOAL] - 1, n_waiting, ways)
    else:
        for other in range(len(distance)):
            if known <= distance[other] < NOWHERE:
                n_waiting = push(distance[other], other, n_waiting, ways)
    while n_waiting > 0:
        length, here = ways.heap[LENGTH, 0], ways.heap[NODE, 0]
        if length >= distance[node] + beyond:
            ways.table[line, KNOWN] = length
            return
        n_waiting = drop_top(n_waiting, ways)
        if length > distance[here]:  # a shorter way to it was found after this one
            continue
        for k in range(streets.arc_ptr[here], streets.arc_ptr[here + 1]):
            there = np.int64(streets.arc_node[k])
            through = length + streets.length[streets.arc_street[k]]
            if through < distance[there]:
                distance[there] = through
                n_waiting = push(through, there, n_waiting, ways)
    ways.table[line, KNOWN] = NOWHERE  # all that can be reached has been


@inner
def line_to(goal: int, street: int, beyond: int, streets: StreetArrays, ways: WayState) -> np.int64:
    """Return the line that leads to a goal, with the ways from both ends of a street and all up to `beyond` mm longer.

    It does not take the place of the line that was asked for just before.
    """
    line = np.int64(ways.line[goal] - 1)
    if line < 0:
        line = take_line(goal, ways)
    for node in (streets.first[street], streets.second[street]):
        if ways.table[line, KNOWN] < min(ways.table[line, WAYS + node] + beyond, NOWHERE):
            look_further(line, node, beyond, streets, ways)
    ways.line[-1] += 1
    ways.table[line, USED] = ways.line[-1]
    return line


@inner
def lines_to(goal_street: int, street: int, streets: StreetArrays, ways: WayState) -> tuple[np.int64, np.int64]:
    """Return the lines that lead to the two ends of a street, ready for the whole way there from another one.

    On the way to a point of the goal's street, no node is farther from either end than where the way begins, and the
    length of the street twice: once for the end by which it goes there, once for that by which it comes to the other.
    """
    first, second = np.int64(streets.first[goal_street]), np.int64(streets.second[goal_street])
    if len(ways.line) > 0 and street != goal_street:
        beyond = 2 * streets.length[goal_street]
        first = line_to(first, street, beyond, streets, ways)
        second = line_to(second, street, beyond, streets, ways)
    return first, second


@inner
def way(
    street: int,
    offset: int,
    goal_street: int,
    goal_offset: int,
    to_first: int,
    to_second: int,
    streets: StreetArrays,
    ways: WayState,
) -> tuple[np.int64, np.int64, np.int64]:
    """Return the shortest way to a point of another street: its length, the node to leave by, the line to follow.

    Lengths in mm; NOWHERE, node and line -1 where there is no way. On the same street: the way along it, and -1. Of
    equal ways, the one by the first nodes. `to_first` and `to_second` are what `lines_to` returned, for this street or
    one before it on the way.
    """
    if street == goal_street:
        return np.int64(abs(goal_offset - offset)), np.int64(-1), np.int64(-1)
    best, best_leave, best_line = NOWHERE, np.int64(-1), np.int64(-1)
    for end in range(2):
        leave = np.int64(streets.first[street] if end == 0 else streets.second[street])
        out = offset if end == 0 else streets.length[street] - offset
        for goal_end in range(2):
            line = np.int64(to_first if goal_end == 0 else to_second)
            between = ways.table[line, WAYS + leave]
            last = goal_offset if goal_end == 0 else streets.length[goal_street] - goal_offset
            total = out + between + last
            if total < best:
                best, best_leave, best_line = total, leave, line
    return best, best_leave, best_line


@inner
def next_street(node: int, line: int, streets: StreetArrays, ways: WayState) -> tuple[np.int64, np.int64]:
    """Return the street by which the shortest way from a node to a line's goal begins, and the node it leads to.

    Of equal ways, the one over the lowest node; of equal streets to it, the lowest. There must be a way.
    """
    best, best_street, left = NOWHERE, np.int64(-1), ways.table[line, WAYS + node]
    for k in range(streets.arc_ptr[node], streets.arc_ptr[node + 1]):
        street, other = np.int64(streets.arc_street[k]), np.int64(streets.arc_node[k])
        # What is not known yet is longer than the way from the node itself, so it cannot seem to be on it.
        if other < best and streets.length[street] + ways.table[line, WAYS + other] == left:
            best, best_street = other, street
    return best_street, best


@kernel
def find_all_ways(streets: StreetArrays, ways: WayState) -> None:
    """Look for the ways between all nodes; there must be a line for each."""
    n_nodes = len(streets.node_x)
    for goal in range(n_nodes):
        line = take_line(goal, ways)
        look_further(line, goal, NOWHERE, streets, ways)
        ways.table[line, USED] = 1
