"""Roads, passages and links of a city file: what cities made of official maps have, to JSON and back."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from fireworld.city.city import Footprints, Links, RoadMap
from fireworld.city.fields import Fields
from fireworld.city.outlines import Corner
from fireworld.city.roads import road_map

ROAD_KEYS: Final = ("id", "apexes", "x", "y")
LINK_KEYS: Final = ("ptr", "building", "share")
PASSAGE_NUMBERS: Final = 6
"""Two areas, then the two ends of the edge between them."""
LINKS_MAX: Final = 2**31 - 1


def read_roads(document: Fields, footprints: Footprints, *, span_mm: int, id_max: int) -> RoadMap:
    """Read the roads and the passages of a city file, which has them."""
    span = {"low": -span_mm, "high": span_mm}
    known = set(footprints.building_id.tolist())
    ids: dict[int, None] = {}
    outlines: list[list[Corner]] = []
    centroids: list[Corner] = []
    for index, value in enumerate(document.array("roads")):
        item = Fields(document.where, f"roads.{index}.", value)
        item.allow_only(*ROAD_KEYS)
        road_id = item.integer("id", low=0, high=id_max)
        if road_id in known or road_id in ids:
            item.refuse("id", "an identifier of its own", road_id)
        ids[road_id] = None
        numbers = item.integers("apexes", **span)
        if len(numbers) % 2 or not numbers:
            item.refuse("apexes", "as many y as x, at least one", f"{len(numbers)} numbers")
        outlines.append(list(zip(numbers[::2], numbers[1::2], strict=True)))
        centroids.append((item.integer("x", **span), item.integer("y", **span)))
    passages = [
        _passage(document, index, value, ids, known, span)
        for index, value in enumerate(document.array("passages", default=[]))
    ]
    return road_map(list(ids), outlines, centroids, passages)


def _passage(
    document: Fields, index: int, value: Any, roads: dict[int, None], buildings: set[int], span: dict[str, int]
) -> tuple[tuple[int, int], tuple[int, int, int, int]]:
    """Read one passage: [area, area, x1, y1, x2, y2]."""
    key = f"passages.{index}"
    numbers = Fields(document.where, "", {key: value}).integers(key, low=span["low"], high=max(span["high"], 2**31 - 1))
    if len(numbers) != PASSAGE_NUMBERS:
        document.refuse(key, f"{PASSAGE_NUMBERS} numbers: two ids, x1, y1, x2, y2", f"{len(numbers)} of them")
    one, other, *edge = numbers
    if one == other or any(area not in roads and area not in buildings for area in (one, other)):
        document.refuse(key, "ids of two areas of the city", [one, other])
    if one in buildings and other in roads:
        document.refuse(key, "the road before the building", [one, other])
    if max(map(abs, edge)) > span["high"]:
        document.refuse(key, f"whole numbers from {span['low']} to {span['high']}", edge)
    return (one, other), (edge[0], edge[1], edge[2], edge[3])


def read_links(document: Fields, n_buildings: int) -> Links | None:
    """Read the radiation links of a city file; None if it has none."""
    if "links" not in document.object():
        return None
    item = Fields(document.where, "links.", document.object()["links"])
    item.allow_only(*LINK_KEYS)
    ptr = np.array(item.integers("ptr", low=0, high=LINKS_MAX), dtype=np.int64)
    building = np.array(item.integers("building", low=0, high=n_buildings - 1), dtype=np.int64)
    share = item.array("share")
    for index, one in enumerate(share):
        if not isinstance(one, int | float) or isinstance(one, bool) or not 0 <= one <= 1:
            item.refuse(f"share.{index}", "a number from 0 to 1", one)
    links = Links(ptr=ptr.astype(np.int32), building=building.astype(np.int32), share=np.array(share, dtype=np.float32))
    fault = fault_of_links(links, n_buildings)
    if fault:
        item.refuse(*fault)
    return links


def fault_of_links(links: Links, n_buildings: int) -> tuple[str, str, str] | None:
    """Return what is wrong with links: key, what is expected, what was found; None if nothing is."""
    ptr, n_links = links.ptr, len(links.building)
    if len(ptr) != n_buildings + 1:
        return "ptr", f"{n_buildings + 1} numbers, one more than there are buildings", f"{len(ptr)} of them"
    if ptr[0] != 0 or ptr[-1] != n_links or (np.diff(ptr) < 0).any():
        return "ptr", f"rising numbers from 0 to the number of links, {n_links}", f"{ptr[0]} to {ptr[-1]}"
    if len(links.share) != n_links:
        return "share", f"{n_links} numbers, one for each link", f"{len(links.share)} of them"
    emitter = np.repeat(np.arange(n_buildings, dtype=np.int64), np.diff(ptr))
    if (emitter == links.building).any():
        at = int(np.argmax(emitter == links.building))
        return "building", "links to other buildings", f"building {emitter[at]} linked with itself"
    return None


def roads_json(roads: RoadMap) -> tuple[list[dict[str, Any]], list[list[int]]]:
    """Return the roads and the passages as a city file holds them."""
    ptr, corners = (2 * roads.outline_ptr.astype(np.int64)).tolist(), roads.outline_mm.ravel().tolist()
    columns = zip(roads.road_id.tolist(), roads.centroid_mm.tolist(), strict=True)
    items = [
        {"id": road_id, "apexes": corners[ptr[at] : ptr[at + 1]], "x": x, "y": y}
        for at, (road_id, (x, y)) in enumerate(columns)
    ]
    return items, np.concatenate([roads.passage_area, roads.passage_mm], axis=1).tolist()


def links_json(links: Links) -> dict[str, Sequence[float]]:
    """Return links as a city file holds them."""
    return {"ptr": links.ptr.tolist(), "building": links.building.tolist(), "share": links.share.tolist()}
