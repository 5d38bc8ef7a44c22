"""Find the contested fires of the suites, each under its own conditions, and write them: `scenarios/suites`.

    python -m benchmarks.suites [--check] [NAME...]

Fires are found as `python -m benchmarks.contested` finds those of the curricula, in cities of their own. No team that
learns is asked, and rules run with seeds that no comparison begins with.
"""

from __future__ import annotations

import argparse
import gzip
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import yaml

from benchmarks.contested import LARGER, contested_fires
from fireworld.maps.exporting import export_city
from fireworld.scenario import Scenario, load_scenario

FOLDER: Final = Path(__file__).parents[1] / "scenarios" / "suites"
SEEDS: Final = (2001, 2002)
BASE: Final = "test-2"
STEPS: Final = {"steps": 400}
REFUGES: Final = [[0.15, 0.15], [0.85, 0.15], [0.15, 0.85], [0.85, 0.85]]


@dataclass(frozen=True)
class Group:
    """Fires that are found under one set of conditions."""

    first_city: int
    n_cities: int
    n_fires: int
    """Of each city."""
    counts: Sequence[int]
    """Burning buildings that are tried."""
    conditions: Mapping[str, Any] = field(default_factory=dict)
    n_sites: int = 1


@dataclass(frozen=True)
class Suite:
    """A suite: its fires are found group by group."""

    description: str
    groups: tuple[Group, ...]
    times: float = 1.0
    """So many times as many buildings burn as where the fire is contested."""


CONTESTED: Final = Group(41000, 5, 4, range(4, 17))
SUITES: Final[Mapping[str, Suite]] = {
    "contested": Suite("Contested fires in five cities that nobody learned or chose in; four brigades.", (CONTESTED,)),
    "larger": Suite("The fires of contested, with a quarter more burning buildings.", (CONTESTED,), LARGER),
    "scarce-water": Suite(
        "Contested fires where water is scarce: refuges that refill 500 l a step, one refuge, the preset of 2011.",
        (
            Group(42000, 2, 4, range(2, 17), {"parameters.brigades.refuge_refill_litres": 500}),
            Group(42100, 2, 3, range(2, 17), {"city.generated.refuges": [[0.15, 0.15]]}),
            Group(42200, 2, 3, range(2, 17), {"preset": "official-2011"}),
        ),
    ),
    "two-sites": Suite(
        "Two fires at a time, contested together; four brigades.", (Group(43000, 5, 4, range(4, 25), n_sites=2),)
    ),
    "three-sites": Suite(
        "Three fires at a time, contested together; four brigades.", (Group(44000, 8, 2, range(3, 25), n_sites=3),)
    ),
    "few-brigades": Suite("Contested fires for two brigades.", (Group(45000, 5, 4, range(1, 13), {"brigades.n": 2}),)),
    "many-brigades": Suite(
        "Contested fires for six brigades, and for eight.",
        (
            Group(46000, 5, 2, range(6, 61, 3), {"brigades.n": 6}),
            Group(46100, 5, 2, range(6, 61, 3), {"brigades.n": 8}),
        ),
    ),
}
OFFICIAL: Final = "official-like"
OFFICIAL_COUNTS: Final = range(2, 60, 2)
OFFICIAL_MAPS: Final = {
    "grid": ({"columns": 21, "rows": 20, "seed": 47000}, 12),
    "blocks": ({"columns": 20, "rows": 20, "seed": 47001, "block": [4, 4], "lot_m": 17.0, "street_m": 11.0}, 16),
}
"""The generated city that each map is written of, and its number of brigades."""
N_OFFICIAL_FIRES: Final = 5


def base_of(conditions: Mapping[str, Any], city: int) -> Scenario:
    """Return the scenario that fires are found in."""
    return load_scenario(BASE).with_values({**STEPS, **conditions, "city.generated.seed": city})


def fires_of(group: Group) -> Iterator[tuple[int, Scenario]]:
    """Yield the fires of a group, and the city of each."""
    for city in range(group.first_city, group.first_city + group.n_cities):
        base = base_of(group.conditions, city)
        found = contested_fires(base, city, n=group.n_fires, counts=group.counts, seeds=SEEDS, n_sites=group.n_sites)
        for fire in found:
            yield city, fire


def flow(values: Mapping[str, Any]) -> str:
    """Write values in a line of YAML."""
    return yaml.safe_dump(dict(values), default_flow_style=True, width=1000).strip()


def line(
    fire: Scenario, *, city: int | None = None, times: float = 1.0, conditions: Mapping[str, Any] | None = None
) -> str:
    """Write the keys of a fire, with so many times as many burning buildings; its conditions, if any, before them."""
    sites = (
        f"{{at: [{fire.at[0]:.3f}, {fire.at[1]:.3f}], n_buildings: {round(times * (fire.n_buildings or 0))}}}"
        for fire in fire.fires
        if fire.at is not None
    )
    keys = {} if city is None else {"city.generated.seed": city}
    keys |= {"fires": f"[{', '.join(sites)}]", "civilians.n": fire.civilians.n, "civilians.seed": fire.civilians.seed}
    before = [flow(conditions)[1:-1]] if conditions else []
    return "      - {" + ", ".join([*before, *(f"{key}: {value}" for key, value in keys.items())]) + "}\n"


def suite_text(description: str, groups: Sequence[tuple[str, Mapping[str, Any], Sequence[str]]]) -> str:
    """Write a suite: of each group the base, what is set in all its scenarios, and the line of each."""
    text = f"# Made by `python -m benchmarks.suites`, which says how.\ndescription: {description!r}\ngroups:\n"
    for base, conditions, lines in groups:
        text += f"  - base: {base}\n    set: {flow(conditions)}\n    each:\n" + "".join(lines)
    return text


def generated_suite(suite: Suite) -> dict[str, bytes]:
    """Return the content of the suite's file."""
    groups = [
        (
            BASE,
            {**STEPS, **group.conditions},
            [line(fire, city=city, times=suite.times) for city, fire in fires_of(group)],
        )
        for group in suite.groups
    ]
    return {"": suite_text(suite.description, groups).encode()}


def official_suite() -> dict[str, bytes]:
    """Return the contents of the maps in the official format, a scenario on each, and the suite of both."""
    files, groups = dict[str, bytes](), []
    for number, (name, (generated, n_brigades)) in enumerate(OFFICIAL_MAPS.items()):
        with TemporaryDirectory() as folder:
            city = load_scenario(BASE).with_values({"city.generated": {**generated, "refuges": REFUGES}})
            made = Path(folder) / name
            export_city(city, made)
            packed = gzip.compress((made / "map.gml").read_bytes(), mtime=0)
            (made / "map.gml").unlink()
            (made / "map.gml.gz").write_bytes(packed)
            files |= {f"{OFFICIAL}/{name}/{path.name}": path.read_bytes() for path in made.iterdir()}
            document = {
                "description": f"A map in the official format, {n_brigades} brigades.",
                "preset": "official-2011",
                "city": {"official": name},
                "fires": [{"at": [0.5, 0.5], "n_buildings": 6}],
                "civilians": {"n": 11, "from_m": 65, "to_m": 150, "directions": ["N", "E", "S", "W"]},
                "brigades": {"n": n_brigades},
                "steps": 300,
            }
            base = Scenario.from_dict(document, folder=folder)
            document["city"] = {"official": name, "sha256": base.city_sha256}
            files[f"{OFFICIAL}/{name}.yaml"] = yaml.safe_dump(
                document, sort_keys=False, default_flow_style=None
            ).encode()
            pinned = Scenario.from_dict(document, folder=folder)
            fires = contested_fires(pinned, 47000 + number, n=N_OFFICIAL_FIRES, counts=OFFICIAL_COUNTS, seeds=SEEDS)
            groups.append((f"{OFFICIAL}/{name}.yaml", {}, [line(fire) for fire in fires]))
    description = "Contested fires on two maps in the official format, for 12 brigades and for 16; the preset of 2011."
    return {"": suite_text(description, groups).encode(), **files}


def main() -> int:
    """Write the suites, or check that the files are what would be written."""
    parser = argparse.ArgumentParser(description="Find the fires of the suites and write them.")
    parser.add_argument("names", nargs="*", metavar="NAME", default=[*SUITES, OFFICIAL])
    parser.add_argument("--check", action="store_true", help="write nothing; exit 1 if a file is another")
    given = parser.parse_args()
    changed = False
    for name in given.names:
        made = official_suite() if name == OFFICIAL else generated_suite(SUITES[name])
        for place, content in made.items():
            path = FOLDER / (place or f"{name}.yaml")
            same = path.exists() and path.read_bytes() == content
            print(f"{path.relative_to(FOLDER)}: {'the same' if same else 'another' if given.check else 'written'}")
            changed = changed or not same
            if not given.check:
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(content)
    return 1 if given.check and changed else 0


if __name__ == "__main__":
    sys.exit(main())
