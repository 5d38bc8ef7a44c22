"""The scenario of an official map as a scenario file."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

from fireworld.city.city import Plan
from fireworld.city.formats.official.folder import Imported, MapFiles
from fireworld.city.formats.official.parameters import overrides, steps, uneven_injuries
from fireworld.city.formats.official.scenario_xml import ScenarioXml
from fireworld.errors import ScenarioError, expected
from fireworld.maps.imported import WHERE, checked_scenario
from fireworld.parameters import PRESETS

PRESET: Final = "official-2013"
N_BRIGADES: Final = 4
"""Of a scenario without any."""
TRY: Final = "try --fires ID,... with ids of buildings"
LEFT_OUT: Final = {"policeforce": "police forces", "ambulanceteam": "ambulance teams"}


def scenario_text(
    files: MapFiles, imported: Imported, plan: Plan, city_text: str, *, fires: Sequence[int] | None, city: str
) -> str:
    """Return the text of a scenario file for a map; what is left out goes into the report.

    Raises:
        ScenarioError: no fires, or fires where nothing can burn; no refuge, and no brigades elsewhere.
        CityError: parameters out of bounds.
    """
    document = scenario_document(files, imported, plan, fires=fires, city={"file": city})
    return checked_scenario(document, plan, city_text)


def scenario_document(
    files: MapFiles, imported: Imported, plan: Plan, *, fires: Sequence[int] | None, city: dict[str, Any]
) -> dict[str, Any]:
    """Return the keys and values of a scenario for a map, in a city of these keys; else as `scenario_text`."""
    scenario = imported.scenario or ScenarioXml(str(files.map_file))
    document: dict[str, Any] = {
        "name": plan.name,
        "description": f"The map {plan.name}" + (f", {files.scenario_file.name}." if files.scenario_file else "."),
        "preset": PRESET,
        "parameters": overrides(imported.config, PRESETS[PRESET]),
        "city": city,
        "fires": [{"buildings": _fires(scenario, imported, plan, fires)}],
        "civilians": {"at": scenario.at["civilian"]} if scenario.at["civilian"] else {"n": 0},
        "brigades": _brigades(scenario, imported),
        "steps": steps(imported.config),
    }
    _note_left_out(scenario, imported)
    return document


def _fires(scenario: ScenarioXml, imported: Imported, plan: Plan, fires: Sequence[int] | None) -> list[int]:
    """Return the buildings that burn: those given, else those of the scenario that can."""
    if fires is not None:
        return [int(one) for one in dict.fromkeys(fires)]
    footprints = plan.footprints
    burns = dict(zip(footprints.building_id.tolist(), footprints.inflammable.tolist(), strict=True))
    found = list(dict.fromkeys(scenario.at["fire"]))
    text = "fires in buildings that cannot burn: left out"
    imported.report.note_areas("fires-left-out", text, [one for one in found if not burns[one]])
    lit = [one for one in found if burns[one]]
    if not lit:
        raise ScenarioError(expected(WHERE, "fires", "a scenario.xml with fires", f"none in {scenario.where}", TRY))
    return lit


def _brigades(scenario: ScenarioXml, imported: Imported) -> dict[str, Any]:
    """Return the team: each brigade where the scenario has it."""
    places = scenario.at["firebrigade"]
    if places:
        return {"n": len(places), "at": places}
    imported.report.note("no-brigades", f"no fire brigades in the scenario: {N_BRIGADES} start at the refuges")
    return {"n": N_BRIGADES}


def _note_left_out(scenario: ScenarioXml, imported: Imported) -> None:
    """Note what fireworld has not."""
    left = [f"{len(scenario.at[kind])} {words}" for kind, words in LEFT_OUT.items() if scenario.at[kind]]
    if scenario.n_aftershocks:
        left.append(f"{scenario.n_aftershocks} aftershocks")
    if left:
        imported.report.note("left-out", f"left out, because nothing here does what they do: {', '.join(left)}")
    uneven = uneven_injuries(imported.config)
    if uneven:
        text = (
            f"{', '.join(uneven)} injuries by fire depend on the building in the configuration: those of wood are taken"
        )
        imported.report.note("injuries", text)
