"""Find contested fires under many conditions and write them as a curriculum, `scenarios/curricula/conditions.yaml`.

    python -m benchmarks.conditions [--check]

Each stage is a condition: how many brigades there are, how much water, how many fires at a time, what kind of city.
Its fires are found as `python -m benchmarks.suites` finds those of the suites, in cities of seeds that no suite and no
other curriculum has. Where the usual rules of thumb are beaten easily, every other fire is larger than where they are
split, so that there is something left to learn.
"""

from __future__ import annotations

import argparse
import itertools
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from benchmarks.contested import FOLDER, LARGER
from benchmarks.suites import BASE, OFFICIAL_COUNTS, REFUGES, STEPS, Group, fires_of, flow, line

NAME: Final = "conditions"
DESCRIPTION: Final = "Contested fires under ten conditions: brigades, water, fires at a time, the kind of city."
MUCH_LARGER: Final = 1.5
OFFICIAL: Final[Mapping[str, Any]] = {"preset": "official-2011", "city.generated.refuges": REFUGES}


@dataclass(frozen=True)
class Condition:
    """A stage of the curriculum: its fires are found group by group."""

    groups: tuple[Group, ...]
    times: Sequence[float] = (1.0, LARGER)
    """So many times as many buildings burn as where the fire is contested: of one fire after another in turn."""


CONDITIONS: Final[Mapping[str, Condition]] = {
    "usual": Condition((Group(61000, 4, 8, range(4, 17)),), (1.0,)),
    "larger": Condition((Group(61100, 4, 8, range(4, 17)),), (LARGER,)),
    "few-brigades": Condition(
        (
            Group(62000, 2, 8, range(1, 13), {"brigades.n": 2}),
            Group(62100, 2, 8, range(2, 15), {"brigades.n": 3}),
        )
    ),
    "many-brigades": Condition(
        (
            Group(63000, 3, 5, range(6, 61, 3), {"brigades.n": 6}),
            Group(63100, 3, 5, range(6, 61, 3), {"brigades.n": 8}),
        ),
        (1.0, MUCH_LARGER),
    ),
    "little-refill": Condition((Group(64000, 4, 7, range(2, 17), {"parameters.brigades.refuge_refill_litres": 500}),)),
    "one-refuge": Condition((Group(64100, 4, 7, range(2, 17), {"city.generated.refuges": [[0.15, 0.15]]}),)),
    "official-2011": Condition((Group(64200, 4, 7, range(2, 17), {"preset": "official-2011"}),), (1.0,)),
    "two-sites": Condition((Group(65000, 6, 5, range(4, 25), n_sites=2),)),
    "three-sites": Condition((Group(66000, 16, 3, range(3, 25), n_sites=3),)),
    "official-like": Condition(
        (
            Group(
                67000,
                3,
                4,
                OFFICIAL_COUNTS,
                {**OFFICIAL, "brigades.n": 12, "city.generated.columns": 21, "city.generated.rows": 20},
            ),
            Group(
                67100,
                3,
                4,
                OFFICIAL_COUNTS,
                {
                    **OFFICIAL,
                    "brigades.n": 16,
                    "city.generated.columns": 20,
                    "city.generated.rows": 20,
                    "city.generated.block": [4, 4],
                    "city.generated.lot_m": 17.0,
                    "city.generated.street_m": 11.0,
                },
            ),
        )
    ),
}
"""The conditions by name; `few-brigades` are two and three, `many-brigades` six and eight."""


def stage_text(name: str, condition: Condition) -> Iterator[str]:
    """Yield the lines of a stage: where it has one group, its conditions stand once."""
    one = len(condition.groups) == 1
    fixed = {**STEPS, **(condition.groups[0].conditions if one else {})}
    yield f"  - name: {name}\n    cooperation: true\n    base: {BASE}\n    set: {flow(fixed)}\n    each:\n"
    for group in condition.groups:
        for (city, fire), times in zip(fires_of(group), itertools.cycle(condition.times), strict=False):
            yield line(fire, city=city, times=times, conditions=None if one else group.conditions)


def curriculum_text() -> str:
    """Write the curriculum; stage by stage, it tells how many fires there are."""
    text = f"# Made by `python -m benchmarks.conditions`, which says how.\ndescription: {DESCRIPTION!r}\nstages:\n"
    for name, condition in CONDITIONS.items():
        head, *fires = stage_text(name, condition)
        print(f"{name}: {len(fires)} fires", flush=True)
        text += head + "".join(fires)
    return text


def main() -> int:
    """Write the curriculum, or check that the file is what would be written."""
    parser = argparse.ArgumentParser(description="Find contested fires under many conditions and write them.")
    parser.add_argument("--check", action="store_true", help="write nothing; exit 1 if the file is another")
    check = parser.parse_args().check
    path, text = FOLDER / f"{NAME}.yaml", curriculum_text()
    same = path.exists() and path.read_text(encoding="utf-8") == text
    print(f"{path.name}: {'the same' if same else 'another' if check else 'written'}")
    if not check:
        path.write_text(text, encoding="utf-8")
    return 1 if check and not same else 0


if __name__ == "__main__":
    sys.exit(main())
