"""Streets of an extract as one connected graph of straight streets, and hydrants beside them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from itertools import chain, pairwise
from typing import Final

import numpy as np

from fireworld.city.city import StreetMap
from fireworld.city.formats.osm.area import Area
from fireworld.city.formats.osm.projection import projected
from fireworld.city.formats.osm.reader import OsmNode, OsmWay
from fireworld.city.formats.osm.simplify import simplified
from fireworld.city.outlines import Corner
from fireworld.city.streets import streets_of

HYDRANT_REACH_MM: Final = 50_000
"""A hydrant farther from all streets is left out."""
NEW_NODE_MM: Final = 1000
"""A hydrant closer to a crossing than this stands there; else it gets a node of its own."""

Graph = dict[Corner, set[Corner]]
"""The neighbours of each place; streets go straight between them."""


@dataclass
class StreetCounts:
    """What was done to the streets."""

    tunnels: list[str] = field(default_factory=list)
    squares: list[str] = field(default_factory=list)
    cut: list[str] = field(default_factory=list)
    """Ways that lost nodes: what is left of them are several pieces."""
    clipped: int = 0
    """Pieces that were cut at the border of the area."""
    n_parts_dropped: int = 0
    dropped_m: float = 0.0
    kept_m: float = 0.0
    n_places: int = 0
    """Nodes of the graph before it was simplified."""


def street_graph(ways: Iterable[OsmWay], area: Area) -> tuple[list[Corner], list[tuple[int, int]], StreetCounts]:
    """Return the nodes of the streets, sorted, and the streets between them, as pairs of indices, sorted.

    Ways are cut at the border of the area, joined where they have a node in common, left out where they do not lead to
    the largest connected part, and simplified: between crossings and ends only bends stay.
    """
    counts = StreetCounts()
    graph: Graph = {}
    driven = [way for way in ways if _is_drivable(way, counts)]
    counts.cut = [f"w{way.osm_id}" for way in driven if None in way.places]
    for row in projected(area.projection, chain.from_iterable(map(_rows, driven))):
        _add(graph, row, area, counts)
    _keep_largest(graph, counts)
    counts.n_places = len(graph)
    streets = simplified(graph)
    nodes = sorted({end for street in streets for end in street})
    number = {node: k for k, node in enumerate(nodes)}
    return nodes, sorted({(number[a], number[b]) for a, b in streets}), counts


def with_hydrants(
    nodes: Sequence[Corner], streets: Sequence[tuple[int, int]], hydrants: Sequence[OsmNode], area: Area
) -> tuple[StreetMap, int, int]:
    """Put hydrants on the nearest point of a street, which gets a node there if no crossing is near.

    Returns the street map, how many hydrants are too far from any street, and how many share a node with another.
    """
    places = area.projection.to_mm([one.place for one in hydrants])
    places = places[area.holds(places)] if len(places) else places
    if not len(places):
        return _street_map(nodes, streets, []), 0, 0
    found = streets_of(_street_map(nodes, streets, []), places.astype(np.int32))
    length, point = found.street_length_mm.tolist(), found.access_mm
    chosen, offset = found.access_street, found.access_offset_mm
    away = point.astype(np.int64) - places
    near = (away * away).sum(axis=1) <= HYDRANT_REACH_MM**2
    on_street: dict[int, list[tuple[int, Corner]]] = {}
    at: list[Corner] = []
    for one, way, (x, y) in zip(chosen[near].tolist(), offset[near].tolist(), point[near].tolist(), strict=True):
        first, last = (nodes[end] for end in streets[one])
        spot = (x, y)
        if way < NEW_NODE_MM:
            spot = first
        elif length[one] - way < NEW_NODE_MM:
            spot = last
        else:
            on_street.setdefault(one, []).append((way, spot))
        at.append(spot)
    pieces: set[tuple[Corner, Corner]] = set()
    for k, (first_node, last_node) in enumerate(streets):
        stops = [nodes[first_node], *(spot for _, spot in sorted(on_street.get(k, []))), nodes[last_node]]
        pieces.update((a, b) for a, b in pairwise(stops) if a != b)
    all_nodes = sorted({end for piece in pieces for end in piece})
    number = {spot: k for k, spot in enumerate(all_nodes)}
    pairs = sorted({tuple(sorted((number[a], number[b]))) for a, b in pieces})
    standing = sorted({number[spot] for spot in at})
    return _street_map(all_nodes, pairs, standing), int((~near).sum()), len(at) - len(standing)


def _street_map(nodes: Sequence[Corner], streets: Sequence[Sequence[int]], hydrants: Sequence[int]) -> StreetMap:
    return StreetMap(
        node_mm=np.array(nodes, dtype=np.int32).reshape(-1, 2),
        street=np.array(streets, dtype=np.int32).reshape(-1, 2),
        hydrant_node=np.array(hydrants, dtype=np.int32),
    )


def _is_drivable(way: OsmWay, counts: StreetCounts) -> bool:
    """Return whether a way is a line above the ground."""
    tags = way.tags
    if tags.get("area") == "yes":
        counts.squares.append(f"w{way.osm_id}")
        return False
    below = tags.get("tunnel", "no") not in {"no", "building_passage", "avalanche_protector", "covered"}
    if below or tags.get("indoor", "no") != "no" or tags.get("location") == "underground":
        counts.tunnels.append(f"w{way.osm_id}")
        return False
    return True


def _rows(way: OsmWay) -> Iterable[list[tuple[int, int]]]:
    """Yield the places of a way, in pieces where nodes are not in the file."""
    row: list[tuple[int, int]] = []
    for place in (*way.places, None):
        if place is not None:
            row.append(place)
        elif row:
            if len(row) > 1:
                yield row
            row = []


def _add(graph: Graph, row: Sequence[Corner], area: Area, counts: StreetCounts) -> None:
    """Add a row of places to the graph, as far as it is in the area."""
    for start, end in pairwise(row):
        if start == end:
            continue
        piece = area.clip(start, end)
        if piece is None:
            continue
        counts.clipped += piece != (start, end)
        a, b = piece
        graph.setdefault(a, set()).add(b)
        graph.setdefault(b, set()).add(a)


def _keep_largest(graph: Graph, counts: StreetCounts) -> None:
    """Leave only the connected part with the most metres of street."""
    parts: list[tuple[float, Corner, list[Corner]]] = []
    seen: set[Corner] = set()
    for start in sorted(graph):
        if start in seen:
            continue
        seen.add(start)
        part = [start]
        for here in part:  # grows meanwhile
            for there in graph[here]:
                if there not in seen:
                    seen.add(there)
                    part.append(there)
        parts.append((_metres(graph, sorted(part)), start, part))
    if not parts:
        return
    largest = max(parts, key=lambda one: (one[0], one[1]))
    counts.kept_m = largest[0]
    for metres, start, part in parts:
        if start == largest[1]:
            continue
        counts.n_parts_dropped += 1
        counts.dropped_m += metres
        for place in part:
            del graph[place]


def _metres(graph: Graph, part: Sequence[Corner]) -> float:
    """Return the length of all streets of a part."""
    total = 0.0
    for a in part:
        for b in sorted(graph[a]):
            if a < b:
                total += float(np.sqrt(float((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2)))
    return total / 1000.0
