"""Find contested fires in generated cities and write them as curricula: one to learn in, one that nobody learned in.

    python -m benchmarks.contested [--check]

A fire starts at a random place, and grows building by building until six rules that do not learn score less than 60 %
of the maximum on the mean; it is contested if that leaves them more than 12 %: some of them hold it, some of them lose
it. No team that learns is asked.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from fireworld.draws import PLACEMENT, below, uniform
from fireworld.evaluation.runs import evaluate
from fireworld.policy.names import BUILT_IN
from fireworld.records import ACTIONS
from fireworld.scenario import load_scenario
from fireworld.simulation.built import CityCache

FOLDER: Final = Path(__file__).parents[1] / "scenarios" / "curricula"
RULES: Final = (*ACTIONS, "each-another", "random")
SEEDS: Final = (11, 12)
LOST_BELOW, HELD_ABOVE = 0.12, 0.6
SIZES: Final = range(4, 17)
N_FIRES_OF_CITY: Final = 8
LARGER: Final = 1.25
CURRICULA: Final = {
    "contested": (range(5000, 5010), "Contested fires in ten generated cities, and the same ones a quarter larger."),
    "unseen": (range(7000, 7010), "The same in ten other cities, to test in and not to learn in."),
}
"""Seeds of the cities and description, by name."""


@dataclass(frozen=True)
class Fire:
    """A fire in a generated city."""

    city: int
    at: tuple[float, float]
    n_buildings: int
    n_civilians: int

    def settings(self) -> dict[str, str]:
        """Return the keys of a scenario that make it."""
        return {
            "city.generated.seed": f"{self.city}",
            "fires.0.at": f"[{self.at[0]:.3f}, {self.at[1]:.3f}]",
            "fires.0.n_buildings": f"{self.n_buildings}",
            "civilians.n": f"{self.n_civilians}",
            "civilians.seed": f"{self.city + 7}",
        }

    def enlarged(self) -> Fire:
        """Return the fire a quarter larger."""
        return Fire(self.city, self.at, round(LARGER * self.n_buildings), self.n_civilians)


def contested_fires(city: int) -> Iterator[Fire]:
    """Yield the contested fires of a city, as many as are wanted, from four times as many places at most."""
    cities = CityCache()
    n_found = 0
    for place in range(4 * N_FIRES_OF_CITY):
        x, y = (0.12 + 0.76 * uniform(city, PLACEMENT, place, axis) for axis in (1, 2))
        n_civilians = 8 + below(city, PLACEMENT, place, 3, bound=4)
        for n_buildings in SIZES:
            fire = Fire(city, (x, y), n_buildings, n_civilians)
            share = mean_share(fire, cities)
            if share < HELD_ABOVE:
                break
        if LOST_BELOW < share < HELD_ABOVE:
            yield fire
            n_found += 1
        if n_found == N_FIRES_OF_CITY:
            return


def mean_share(fire: Fire, cities: CityCache) -> float:
    """Return the mean score of the rules, as a share of the maximum."""
    scenario = load_scenario("test-2").with_settings({**fire.settings(), "steps": "400"})
    built = cities.build(scenario)
    shares = [evaluate(built, BUILT_IN[rule](), SEEDS).score_share.mean() for rule in RULES]
    return float(sum(shares)) / len(shares)


def curriculum_text(name: str) -> str:
    """Write a curriculum."""
    cities, description = CURRICULA[name]
    fires = [fire for city in cities for fire in contested_fires(city)]
    stages = {"contested": fires, "larger": [fire.enlarged() for fire in fires]}
    lines = [f"# Made by `python -m benchmarks.contested`, which says how.\ndescription: {description}\nstages:"]
    for stage, members in stages.items():
        lines.append(f"  - name: {stage}\n    cooperation: true\n    base: test-2\n    set: {{steps: 400}}\n    each:")
        lines += ["      - {" + ", ".join(f"{k}: {v}" for k, v in fire.settings().items()) + "}" for fire in members]
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
