"""What evaluations are asked for: scenarios by name, and the seeds of the runs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from fireworld.arguments import SEED_MAX, ArgumentError, seed_of, whole_number
from fireworld.errors import ScenarioError, expected
from fireworld.scenario import Scenario, load_scenario

N_SEEDS_MAX: Final = 10_000
AnyScenarios = Sequence[str | Path | Scenario] | str | Path | Scenario
"""What an argument `scenarios` may be; see `scenarios_of`."""


def seeds_of(seeds: object, first_seed: object = 1) -> Sequence[int]:
    """Return the seeds of runs.

    Args:
        seeds: how many, or which.
        first_seed: the first, where only their number is given.

    Raises:
        ArgumentError: no seeds, one of them twice, or one that is none.
    """
    if isinstance(seeds, Iterable) and not isinstance(seeds, str | bytes):
        listed = [seed_of(seed, name="seeds") for seed in seeds]
        if not listed or len({*listed}) < len(listed):
            raise ArgumentError(expected("seeds", "", "one seed or more, each of them once", listed))
        return listed
    first = seed_of(first_seed, name="first_seed")
    n = whole_number("seeds", seeds, least=1, most=N_SEEDS_MAX)
    if first + n - 1 > SEED_MAX:
        raise ArgumentError(expected("first_seed", "", f"{n} seeds up to {SEED_MAX}", first))
    return range(first, first + n)


def seeds_text(seeds: Sequence[int]) -> str:
    """Return in words which seeds they are."""
    if len(seeds) == 1:
        return f"seed {seeds[0]}"
    return f"seeds {seeds[0]} to {seeds[-1]}" if in_a_row(seeds) else f"{len(seeds)} seeds from {seeds[0]}"


def in_a_row(seeds: Sequence[int]) -> bool:
    """Return whether each seed is one more than the one before."""
    return all(seed == seeds[0] + k for k, seed in enumerate(seeds))


def scenarios_of(scenarios: object, values: Mapping[str, Any]) -> dict[str, Scenario]:
    """Return scenarios, by the names they were asked for.

    Args:
        scenarios: names, files or Scenario objects; or one of them.
        values: of keys of all scenarios.

    Raises:
        ArgumentError: no scenarios.
        ScenarioError: one that cannot be read, or comes twice.
    """
    listed = [scenarios] if isinstance(scenarios, str | Path | Scenario) else scenarios
    if not isinstance(listed, Sequence) or not listed:
        raise ArgumentError(expected("scenarios", "", "one or more names, files or scenarios", scenarios))
    found, seen = dict[str, Scenario](), dict[str, str]()
    for place, given in enumerate(listed):
        scenario = (given if isinstance(given, Scenario) else load_scenario(given)).with_values(values)
        name = (scenario.name or f"scenario {place}") if isinstance(given, Scenario) else str(given)
        if scenario.digest in seen or name in found:
            got = f"{name} a second time" if name in found else f"{name}, which is the same as {seen[scenario.digest]}"
            raise ScenarioError(expected("scenarios", "", "each scenario once", got))
        seen[scenario.digest] = name
        found[name] = scenario
    return found
