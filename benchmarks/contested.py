"""Find contested fires in generated cities and write them as curricula: one to learn in, one that nobody learned in.

    python -m benchmarks.contested [--check]

A fire starts at a random place, and grows building by building until it is contested, as in `fw.new_scenarios`; but
the places lie anywhere in the inner part of the city, and each rule runs twice.
"""

from __future__ import annotations

import argparse
import itertools
import math
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

import msgspec

from fireworld.draws import PLACEMENT, below, uniform
from fireworld.evaluation.growth import FirePlace, grow
from fireworld.evaluation.judge import Judge
from fireworld.executors import threads
from fireworld.scenario import Scenario, load_scenario

FOLDER: Final = Path(__file__).parents[1] / "scenarios" / "curricula"
SEEDS: Final = (11, 12)
COUNTS: Final = range(4, 17)
N_FIRES_OF_CITY: Final = 8
LARGER: Final = 1.25
APART: Final = 0.3
"""The least distance of two fires of one place, as a share of the side of the city."""
CURRICULA: Final = {
    "contested": (range(5000, 5010), "Contested fires in ten generated cities, and the same ones a quarter larger."),
    "unseen": (range(7000, 7010), "The same in ten other cities, to test in and not to learn in."),
}
"""Seeds of the cities and description, by name."""


def contested_fires(
    base: Scenario,
    city: int,
    *,
    n: int = N_FIRES_OF_CITY,
    counts: Sequence[int] = COUNTS,
    seeds: Sequence[int] = SEEDS,
    n_sites: int = 1,
) -> Iterator[Scenario]:
    """Yield the contested fires of a city, as many as are wanted, from four times as many places at most.

    Args:
        base: the scenario, but for its fires, the number of its civilians and their seed.
        city: what places and people are drawn by.
        n: fires that are wanted.
        counts: numbers of burning buildings to try, rising.
        seeds: of the runs of every rule.
        n_sites: fires at a time, far from each other.
    """
    judge = Judge(seeds, workers=threads())
    n_found = 0
    for number in range(4 * n):
        sites = tuple(_site(city, number, site) for site in range(n_sites))
        if any(math.dist(one, other) < APART for one, other in itertools.combinations(sites, 2)):
            continue
        n_civilians = 8 + below(city, PLACEMENT, number, 3, bound=4)
        people = msgspec.structs.replace(base.civilians, n=n_civilians, seed=city + 7)
        grown = grow(base, FirePlace(number + 1, sites, people), counts, judge)
        if grown.verdict == "contested" and grown.built is not None:
            yield grown.built.scenario
            n_found += 1
        if n_found == n:
            return


def fires_of_city(city: int) -> Iterator[Scenario]:
    """Yield the fires that the curricula have in a city."""
    base = load_scenario("test-2").with_values({"city.generated.seed": city, "steps": 400})
    return contested_fires(base, city)


def _site(city: int, number: int, site: int) -> tuple[float, float]:
    """Draw one of the sites of a place."""
    axes = (1, 2) if site == 0 else (2 + 2 * site, 3 + 2 * site)
    x, y = (round(0.12 + 0.76 * uniform(city, PLACEMENT, number, axis), 3) for axis in axes)
    return x, y


def settings(fire: Scenario, *, times: float = 1) -> str:
    """Write the keys of a fire, with so many times as many burning buildings."""
    generated, (x, y), n_burning = fire.city.generated, fire.fires[0].at or (0, 0), fire.fires[0].n_buildings or 0
    keys = {
        "city.generated.seed": generated.seed if generated else 0,
        "fires.0.at": f"[{x:.3f}, {y:.3f}]",
        "fires.0.n_buildings": round(times * n_burning),
        "civilians.n": fire.civilians.n,
        "civilians.seed": fire.civilians.seed,
    }
    return "{" + ", ".join(f"{key}: {value}" for key, value in keys.items()) + "}"


def curriculum_text(name: str) -> str:
    """Write a curriculum."""
    cities, description = CURRICULA[name]
    fires = [fire for city in cities for fire in fires_of_city(city)]
    lines = [f"# Made by `python -m benchmarks.contested`, which says how.\ndescription: {description}\nstages:"]
    for stage, times in (("contested", 1.0), ("larger", LARGER)):
        lines.append(f"  - name: {stage}\n    cooperation: true\n    base: test-2\n    set: {{steps: 400}}\n    each:")
        lines += [f"      - {settings(fire, times=times)}" for fire in fires]
    return "\n".join(lines) + "\n"


def main() -> int:
    """Write the curricula, or check that the files are what would be written."""
    parser = argparse.ArgumentParser(description="Find contested fires and write them as curricula.")
    parser.add_argument("--check", action="store_true", help="write nothing; exit 1 if a file is another")
    check = parser.parse_args().check
    changed = False
    for name in CURRICULA:
        path, text = FOLDER / f"{name}.yaml", curriculum_text(name)
        same = path.exists() and path.read_text(encoding="utf-8") == text
        print(f"{path.name}: {'the same' if same else 'another' if check else 'written'}")
        changed = changed or not same
        if not check:
            path.write_text(text, encoding="utf-8")
    return 1 if check and changed else 0


if __name__ == "__main__":
    sys.exit(main())
