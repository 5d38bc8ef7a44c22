"""What evaluations are asked for: scenarios and suites by name, and the seeds of the runs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any, Final

from fireworld.arguments import SEED_MAX, ArgumentError, seed_of, whole_number
from fireworld.errors import ScenarioError, expected
from fireworld.evaluation.suites import Suite, digest_of, suite, suite_names
from fireworld.scenario import Scenario, load_scenario

N_SEEDS_MAX: Final = 10_000
AnyScenarios = Sequence[str | Path | Scenario] | str | Path | Scenario
"""What an argument `scenarios` may be; see `rows_of`."""


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


@dataclass(frozen=True)
class Rows:
    """Scenarios, and the rows that are shown of them: a suite has all of its own in one."""

    scenarios: Mapping[str, Scenario]
    """By the names they were asked for; those of a suite by their own."""
    within: Mapping[str, Sequence[str]]
    """The names of the scenarios of each row."""
    suites: Mapping[str, Suite]
    """Those of the rows that are suites."""

    @property
    def digests(self) -> dict[str, str]:
        """Digest of each row: of its scenario, or of the scenarios of a suite, as they are run."""
        found = {name: [self.scenarios[one].digest for one in within] for name, within in self.within.items()}
        return {name: digest_of(digests) if name in self.suites else digests[0] for name, digests in found.items()}

    def n_scenarios(self, row: str) -> int:
        """Return how many scenarios a row has."""
        return len(self.within[row])


def rows_of(scenarios: object, values: Mapping[str, Any]) -> Rows:
    """Return scenarios and suites, by the names they were asked for.

    Args:
        scenarios: names of scenarios or suites, files or Scenario objects; or one of them.
        values: of keys of all scenarios.

    Raises:
        ArgumentError: no scenarios.
        ScenarioError: one that cannot be read, or comes twice.
    """
    listed = [scenarios] if isinstance(scenarios, str | Path | Scenario) else scenarios
    if not isinstance(listed, Sequence) or not listed:
        raise ArgumentError(expected("scenarios", "", "one or more names, files or scenarios", scenarios))
    found, within, suites, seen = dict[str, Scenario](), dict[str, list[str]](), dict[str, Suite](), dict[str, str]()
    for place, given in enumerate(listed):
        row, members = _members(given, place, suites)
        for name, one in members.items():
            scenario = one.with_values(values)
            if scenario.digest in seen or name in found:
                same = f"{name}, which is the same as {seen.get(scenario.digest)}"
                got = f"{name} a second time" if name in found else same
                raise ScenarioError(expected("scenarios", "", "each scenario once", got))
            seen[scenario.digest] = name
            found[name] = scenario
        within[row] = [*members]
    return Rows(found, within, suites)


def scenarios_of(scenarios: object, values: Mapping[str, Any]) -> Mapping[str, Scenario]:
    """Return scenarios, those of suites one by one, by their names; as `rows_of` does."""
    return rows_of(scenarios, values).scenarios


def _members(given: Any, place: int, suites: dict[str, Suite]) -> tuple[str, dict[str, Scenario]]:
    """Return the name of a row and its scenarios; a suite is added to the suites."""
    if isinstance(given, Scenario):
        name = given.name or f"scenario {place}"
        return name, {name: given}
    name = str(given)
    if name not in suite_names():
        return name, {name: _scenario(given)}
    suites[name] = suite(name)
    return name, {one.name: one for one in suites[name].scenarios}


def _scenario(given: str | Path) -> Scenario:
    """Load a scenario; an error may name suites, too."""
    near = get_close_matches(str(given), suite_names(), n=1)
    try:
        return load_scenario(given)
    except ScenarioError as error:
        if near and not Path(given).suffix and not Path(given).exists():
            raise ScenarioError(
                expected("scenario", "", "the name of a scenario or suite, or a .yaml file", given, f"try {near[0]}")
            ) from error
        raise
