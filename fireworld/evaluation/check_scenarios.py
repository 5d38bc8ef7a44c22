"""`check_scenarios`: is a fire contested, or lost or held whatever brigades do?"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from threading import Event
from typing import Any

from fireworld.arguments import ArgumentError, settings_of, whole_number
from fireworld.errors import ScenarioError, expected
from fireworld.evaluation.contested import FIRST_SEED, HELD_ABOVE, LOST_BELOW, N_SEEDS, Limits
from fireworld.evaluation.inputs import AnyScenarios, scenarios_of, seeds_of
from fireworld.evaluation.judge import N_POLICIES, Judge
from fireworld.evaluation.scenario_check import ScenarioChecks
from fireworld.executors import AnyExecutor, workers_for
from fireworld.interrupt import gentle_interrupt
from fireworld.scenario import Scenario, scenario_names
from fireworld.simulation.built import CityCache

COUNT_MAX = 100_000


def check_scenarios(
    scenarios: AnyScenarios | None = None,
    *,
    counts: Sequence[int] | int | None = None,
    seeds: int | Sequence[int] = N_SEEDS,
    first_seed: int = FIRST_SEED,
    lost_below: float = LOST_BELOW,
    held_above: float = HELD_ABOVE,
    set: Mapping[str, Any] | None = None,
    executor: AnyExecutor = None,
    on_run: Callable[[int, int], object] = lambda *_: None,
    stop: Event | None = None,
) -> ScenarioChecks:
    """Let rules that do not learn play scenarios, and nobody: are their fires contested?

    A scenario is worth playing if it is neither won nor lost whatever one does: the mean score of six rules is between
    two limits. The result does not depend on the executor.

    Args:
        scenarios: names, files or Scenario objects; None: all that come with fireworld.
        counts: numbers of burning buildings (`fires.0.n_buildings`) to try in each, instead of its own.
        seeds: how many seeds, or which.
        first_seed: the first, where only their number is given.
        lost_below: a mean score, as a share of the maximum, below which a fire is lost.
        held_above: the same above which it is held.
        set: values of scenario keys, as in {"brigades.n": 7}; of all scenarios.
        executor: who makes the runs; see `fireworld.compare`.
        on_run: called with the number of runs that are done, and of all.
        stop: set it, and no further run begins.

    Raises:
        ArgumentError: an argument that makes no sense.
        ScenarioError, CityError: a scenario that cannot be read or built, or comes twice.
        ExecutorError: an executor that is none.
        Interrupted: Ctrl-C, or `stop` was set.
    """
    limits, run_seeds = Limits(lost_below, held_above), seeds_of(seeds, first_seed)
    workers_for(executor)
    found = scenarios_of(scenario_names() if scenarios is None else scenarios, settings_of(set))
    cities = CityCache()
    built = [
        (name, cities.build(varied))
        for name, scenario in found.items()
        for varied in ([scenario] if counts is None else _with_counts(name, scenario, counts_of(counts)))
    ]
    n_done, n_all = 0, len(built) * N_POLICIES * len(run_seeds)

    def note() -> None:
        nonlocal n_done
        n_done += 1
        on_run(n_done, n_all)

    on_run(0, n_all)
    with gentle_interrupt(stop) as interrupted:
        judge = Judge(run_seeds, limits, workers_for(executor, stop=interrupted), cities, note)
        checks = tuple(judge.check(name, each) for name, each in built)
    return ScenarioChecks(checks, limits, run_seeds)


def counts_of(counts: Sequence[int] | int) -> list[int]:
    """Return numbers of burning buildings, rising; ArgumentError if they are none."""
    listed = list(counts) if isinstance(counts, Sequence) and not isinstance(counts, str | bytes) else [counts]
    if not listed:
        raise ArgumentError(expected("counts", "", "one number of burning buildings or more", listed))
    return sorted({whole_number("counts", count, least=1, most=COUNT_MAX) for count in listed})


def _with_counts(name: str, scenario: Scenario, counts: Sequence[int]) -> list[Scenario]:
    """Return a scenario with other numbers of buildings that burn in its first fire."""
    if scenario.fires[0].at is None:
        wanted = "`at`, around which so many buildings burn"
        hint = f"try `fireworld scenarios new -o fire.yaml --city {name}`"
        raise ScenarioError(expected(scenario.source, "fires.0", wanted, "`buildings`, which names them", hint))
    return [scenario.with_values({"fires.0.n_buildings": count}) for count in counts]
