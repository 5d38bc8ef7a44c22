"""All checks of all forms."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

from fireworld.envs.check.checks import Check
from fireworld.envs.check.libraries import checks_of_libraries
from fireworld.envs.check.logs import checks_of_logs
from fireworld.envs.check.players import PLAYERS
from fireworld.envs.check.states import check_copies, check_forks, check_seeds, check_snapshots
from fireworld.envs.check.vectors import checks_of_vectors
from fireworld.envs.views import OBSERVATIONS
from fireworld.scenario import find_scenario


def checks_of(scenario: str, *, benchmark: bool = True) -> Iterator[Check]:
    """Yield all checks.

    Args:
        scenario: what is played, a shipped name or a file.
        benchmark: PettingZoo's measurement too, which takes five seconds.

    Raises:
        ScenarioError: there is no such scenario.
    """
    found = find_scenario(scenario)
    yield from checks_of_libraries(found, benchmark=benchmark)
    yield from checks_of_vectors(found)
    yield from checks_of_logs(found)
    for form in PLAYERS:
        for kind in OBSERVATIONS:
            options = {"observation": kind, "own_targets": 6 if kind == "graph" else 0}
            yield Check(f"snapshots, {kind}", form, partial(check_snapshots, form, found, **options))
            yield Check(f"copies, {kind}", form, partial(check_copies, form, found, **options))
        yield Check("forks", form, partial(check_forks, form, found))
        yield Check("seeds", form, partial(check_seeds, form, found))
