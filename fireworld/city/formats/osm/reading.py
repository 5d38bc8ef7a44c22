"""From what an extract holds to the plan of a city, and what was repaired, inferred and left out on the way."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from fireworld.city.city import Int64Array, Plan, StreetMap, freeze
from fireworld.city.footpaths import footpaths
from fireworld.city.formats.official.report import Report
from fireworld.city.formats.osm.area import Area
from fireworld.city.formats.osm.keyhole import with_courtyards
from fireworld.city.formats.osm.kinds import LEVEL_HEIGHT_M, MATERIALS_BY_TAG, floors_of, material_of
from fireworld.city.formats.osm.overlaps import weed
from fireworld.city.formats.osm.reader import Extract, OsmFile
from fireworld.city.formats.osm.refuges import chosen_refuges, named_refuges, stations_of
from fireworld.city.formats.osm.rings import Losses, Shape, relation_shapes, way_shapes
from fireworld.city.formats.osm.streets import StreetCounts, street_graph, with_hydrants
from fireworld.city.outlines import Building, Corner, assemble, centroid_mm, doubled_area_mm2
from fireworld.city.streets import streets_of
from fireworld.errors import CityError, expected
from fireworld.records import MATERIALS

FAR_FROM_STREETS_MM: Final = 50_000
"""The reach of a water jet: farther away no fire can be fought."""


@dataclass(frozen=True)
class OsmCity:
    """A city made of an extract, without what it says of its source."""

    plan: Plan
    report: Report
    area: Area


def read_city(
    file: OsmFile,
    area: Area,
    *,
    name: str,
    seed: int,
    refuges: Sequence[int | str] = (),
    on_progress: Callable[[str], object] = lambda _: None,
) -> OsmCity:
    """Make a city of what is in an area of an extract.

    Args:
        file: the extract.
        area: which part of it.
        name: of the city.
        seed: of the materials that no tag names.
        refuges: buildings by number or id of OpenStreetMap; by default the fire stations.
        on_progress: called with what is done next.

    Raises:
        CityError: the file is damaged or none, or there is no building in the area.
    """
    report = Report()
    on_progress("reading")
    extract = file.read(area.window)
    on_progress("buildings")
    shapes = _shapes(extract, area, report, where=file.where)
    if not shapes:
        hint = "try a larger --radius, or another place"
        raise CityError(expected(file.where, "", "a building in the area", "none", hint))
    buildings = _buildings(shapes, seed=seed, report=report)
    on_progress("streets")
    streets, far = _streets(extract, area, buildings, report)
    refuge = _refuges(extract, shapes, area, refuges, far, report)
    footprints = assemble([_with_refuge(building) if k in refuge else building for k, building in enumerate(buildings)])
    plan = Plan(
        name=name,
        footprints=footprints,
        streets=streets,
        source_id=tuple(shape.source for shape in shapes),
    )
    return OsmCity(freeze(plan), report, area)


def _shapes(extract: Extract, area: Area, report: Report, *, where: str) -> list[Shape]:
    """Return the buildings whose middle is in the area, in their order, without those that cannot stand."""
    losses = Losses()
    shapes: list[Shape] = []
    outlines: set[int] = set()
    for relation in extract.relations:
        made, ways = relation_shapes(relation, extract.members, area.projection, losses)
        shapes += made
        outlines |= ways
    own = [way for way in extract.buildings if way.osm_id not in outlines]
    shapes += way_shapes(own, area.projection, losses)
    above = [shape for shape in shapes if not _is_below(shape.tags)]
    inside = area.holds(np.array([_middle(shape) for shape in above], dtype=np.int64).reshape(-1, 2))
    here = sorted(
        (shape for shape, within in zip(above, inside.tolist(), strict=True) if within), key=lambda s: s.order
    )
    below = len(shapes) - len(above)
    weeded = weed(here, where=where)
    report.note_areas(
        "incomplete", "buildings lose nodes or ways at the edge of the extract: left out", losses.incomplete
    )
    report.note_areas("open", "buildings are not closed: left out", losses.open)
    report.note_number("underground", "buildings are underground: left out", below)
    report.note_number(
        "outlines",
        "ways are outlines of a building that a relation draws: taken once",
        len(extract.buildings) - len(own),
    )
    report.note_areas("duplicates", "buildings have the corners of another: left out", weeded.duplicates)
    report.note_areas("slivers", "buildings are smaller than 6 m2 or thinner than 0.5 m: left out", weeded.slivers)
    report.note_areas("covered", "buildings are to 90 % or more within another: left out", weeded.covered)
    report.note_areas("overlapping", "buildings overlap another by 1 m2 or more: kept as they are", weeded.overlapping)
    report.note_number("parts", "parts of buildings (building:part) are not read", extract.n_parts)
    report.note_number("points", "buildings are drawn as points: left out", extract.n_point_buildings)
    report.note_number(
        "filled-courtyards",
        "courtyards of less than 4 m2, or beyond the 100 largest of a building, are filled",
        losses.filled_holes,
    )
    report.note_areas("lost-courtyards", "buildings have courtyards that are not closed: filled", losses.lost_holes)
    return weeded.shapes


def _is_below(tags: Mapping[str, str]) -> bool:
    """Return whether a building is below the ground."""
    return tags.get("location") == "underground" or tags.get("layer", "0").startswith("-")


def _middle(shape: Shape) -> Corner:
    """Return the centroid of an outline, or its first corner where it has no area."""
    return centroid_mm(shape.outer) if doubled_area_mm2(shape.outer) else shape.outer[0]


def _buildings(shapes: Sequence[Shape], *, seed: int, report: Report) -> list[Building]:
    """Return the buildings, numbered from 1, with courtyards cut in, floors and materials."""
    made: list[Building] = []
    floors_from = {"building:levels": 0, "height": 0, "": 0}
    drawn = [0] * len(MATERIALS)
    n_said = n_courtyards = 0
    slits_mm = 0.0
    for number, shape in enumerate(shapes, start=1):
        outline, slit_mm = with_courtyards(shape.outer, shape.holes)
        n_courtyards += len(shape.holes)
        slits_mm += slit_mm
        floors, said_by = floors_of(shape.tags)
        floors_from[said_by] += 1
        material, said = material_of(shape.tags, floors=floors, seed=seed, key=shape.draw_key)
        n_said += said
        drawn[material] += not said
        made.append(
            Building(
                building_id=number,
                corners_mm=[*outline, outline[0]],
                centroid_mm=centroid_mm(outline),
                floors=floors,
                material=material,
                ground_area_m2=abs(doubled_area_mm2(outline)) // 2_000_000,
                inflammable=True,
                refuge=False,
            )
        )
    n_with = sum(bool(shape.holes) for shape in shapes)
    text = f"courtyards in {n_with} buildings, cut in by slits of {slits_mm / 1000:.0f} m together"
    report.note_number("courtyards", text, n_courtyards)
    text = f"have floors by building:levels, {floors_from['height']} by height ({LEVEL_HEIGHT_M:g} m each)"
    report.note_number(
        "floors", f"buildings {text}, {floors_from['']} by their kind", floors_from["building:levels"], always=True
    )
    shares = ", ".join(f"{n} {name}" for n, name in zip(drawn, MATERIALS, strict=True))
    report.note_number(
        "materials", f"buildings have a material by tag; drawn for the others: {shares}", n_said, always=True
    )
    unknown = [
        shape.source for shape in shapes
        if "building:material" in shape.tags and shape.tags["building:material"].lower() not in MATERIALS_BY_TAG
    ]  # fmt: skip
    report.note_areas("unknown-materials", "buildings have a material that is in no table: drawn", unknown)
    return made


def _streets(
    extract: Extract, area: Area, buildings: Sequence[Building], report: Report
) -> tuple[StreetMap, list[int]]:
    """Return the streets with their hydrants, or footpaths where there are none, and the buildings far from them."""
    nodes, streets, counts = street_graph(extract.streets, area)
    _note_streets(counts, report, n_nodes=len(nodes))
    if not streets:
        places = area.projection.to_mm([one.place for one in extract.hydrants])
        inside = places[area.holds(places)].tolist()
        report.note("no-streets", "no streets in the area: buildings are joined by footpaths")
        return footpaths(assemble(buildings), [(x, y) for x, y in inside]), []
    made, n_far, n_shared = with_hydrants(nodes, streets, extract.hydrants, area)
    report.note_number("hydrants", "hydrants stand at the nearest point of a street", len(made.hydrant_node))
    report.note_number("far-hydrants", "hydrants are farther than 50 m from all streets: left out", n_far)
    report.note_number("shared-hydrants", "hydrants stand where another does: taken once", n_shared)
    far = _far_from_streets(made, np.array([building.centroid_mm for building in buildings], dtype=np.int64))
    text = "buildings have their middle farther than 50 m from all streets: out of the reach of most brigades"
    report.note_areas("far-buildings", text, [str(buildings[k].building_id) for k in far])
    return made, far


def _far_from_streets(streets: StreetMap, centroids: Int64Array) -> list[int]:
    """Return the buildings that no water reaches from a street, by index."""
    away = streets_of(streets, centroids.astype(np.int32)).access_mm.astype(np.int64) - centroids
    far: list[int] = np.flatnonzero((away * away).sum(axis=1) > FAR_FROM_STREETS_MM**2).tolist()
    return far


def _note_streets(counts: StreetCounts, report: Report, *, n_nodes: int) -> None:
    """Note what was done to the streets."""
    report.note_areas("cut-streets", "streets lose nodes at the edge of the extract: they end there", counts.cut)
    report.note_number("clipped-streets", "pieces of streets are cut at the border of the area", counts.clipped)
    report.note_areas("tunnels", "streets are in tunnels or indoors: left out", counts.tunnels)
    report.note_areas("squares", "streets are drawn as areas: left out", counts.squares)
    if counts.n_parts_dropped:
        share = counts.dropped_m / (counts.dropped_m + counts.kept_m)
        text = f"parts of the streets, {counts.dropped_m:.0f} m ({share:.0%}), do not lead to the largest: left out"
        report.note_number("separate-streets", text, counts.n_parts_dropped)
    if n_nodes:
        text = f"nodes of streets are left of {counts.n_places}: bends of less than 1 m are straight"
        report.note_number("nodes", text, n_nodes)
        report.note("oneway", "one-way streets are driven both ways")


def _refuges(
    extract: Extract,
    shapes: Sequence[Shape],
    area: Area,
    wanted: Sequence[int | str],
    far: Sequence[int],
    report: Report,
) -> set[int]:
    """Return the buildings that are refuges, by index: those wanted, fire stations, or a choice."""
    if wanted:
        return set(named_refuges(wanted, shapes))
    stations, n_lost = stations_of(extract, shapes, area)
    report.note_number("lost-stations", "fire stations have no building within 50 m: left out", n_lost)
    if stations:
        report.note_areas("stations", "fire stations are refuges", [str(k + 1) for k in stations])
        return set(stations)
    chosen = chosen_refuges(shapes, far)
    text = "buildings near two corners, as in generated cities, are refuges, for lack of fire stations"
    report.note_areas("no-station", text, [str(k + 1) for k in chosen])
    return set(chosen)


def _with_refuge(building: Building) -> Building:
    """Return a building as a refuge, which does not burn."""
    values: dict[str, Any] = {**vars(building), "refuge": True, "inflammable": False}
    return Building(**values)
