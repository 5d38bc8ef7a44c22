"""A graph of streets with fewer nodes: crossings, ends, and those bends that cannot be left out."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Final

from fireworld.city.outlines import Corner

TOLERANCE_MM: Final = 1000
"""No place of a street is farther than this from what it becomes."""


def simplified(graph: Mapping[Corner, set[Corner]]) -> set[tuple[Corner, Corner]]:
    """Return the streets, each as its two ends in rising order, of a graph without bends within the tolerance.

    Crossings and ends, which have another number of neighbours than two, stay where they are. The same in any order
    in which the graph was made; exact.
    """
    streets: set[tuple[Corner, Corner]] = set()
    for chain in _chains(graph):
        kept = straightened(chain)
        streets.update((min(a, b), max(a, b)) for a, b in pairwise(kept))
    return {street for street in streets if street[0] != street[1]}


def straightened(chain: Sequence[Corner]) -> list[Corner]:
    """Leave out what is within the tolerance of the straight line between what stays: Ramer, Douglas and Peucker."""
    kept = {0, len(chain) - 1}
    open_parts = [(0, len(chain) - 1)]
    while open_parts:
        first, last = open_parts.pop()
        if last - first < 2:
            continue
        square, k = max((_square_away(chain[k], chain[first], chain[last]), -k) for k in range(first + 1, last))
        if square > TOLERANCE_MM * TOLERANCE_MM:
            kept.add(-k)
            open_parts += [(first, -k), (-k, last)]
    return [chain[k] for k in sorted(kept)]


def _square_away(point: Corner, start: Corner, end: Corner) -> float:
    """Return the square of the distance of a point from the piece of a line between two others, in mm2."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    x, y = point[0] - start[0], point[1] - start[1]
    along, length2 = x * dx + y * dy, dx * dx + dy * dy
    if along <= 0:
        return float(x * x + y * y)
    if along >= length2:
        return float((x - dx) ** 2 + (y - dy) ** 2)
    across = x * dy - y * dx
    return across * across / length2


def _chains(graph: Mapping[Corner, set[Corner]]) -> Iterator[list[Corner]]:
    """Yield the rows of places from one crossing or end to the next; each once."""
    ends = [place for place in sorted(graph) if len(graph[place]) != 2]
    visited: set[Corner] = set()
    for start in ends:
        for onward in sorted(graph[start]):
            chain = _walk(graph, start, onward)
            if (chain[-1], chain[-2]) >= (start, onward):  # the other way round it comes again
                yield chain
            visited.update(chain)
    for place in sorted(graph):  # rings without any crossing
        if place not in visited and len(graph[place]) == 2:
            chain = _walk(graph, place, min(graph[place]))
            visited.update(chain)
            yield chain


def _walk(graph: Mapping[Corner, set[Corner]], start: Corner, onward: Corner) -> list[Corner]:
    """Follow a street until it crosses another, ends, or is back where it began."""
    chain = [start, onward]
    while chain[-1] != start and len(graph[chain[-1]]) == 2:
        chain.append(next(place for place in sorted(graph[chain[-1]]) if place != chain[-2]))
    return chain
