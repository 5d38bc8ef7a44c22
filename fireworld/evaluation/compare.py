"""`compare`: policies on the same scenarios and seeds; known runs come from a results file, the others are made."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from threading import Event
from typing import Any, Final

from fireworld.arguments import ArgumentError, path_of, settings_of
from fireworld.errors import expected
from fireworld.evaluation.comparison import ComparedPolicy, Comparison, find_metric
from fireworld.evaluation.comparison_runs import ComparisonRuns, RunnablePolicy, runnable_policies
from fireworld.evaluation.inputs import AnyScenarios, rows_of, seeds_of
from fireworld.evaluation.paired import compare_outcomes
from fireworld.evaluation.results import open_results
from fireworld.executors import AnyExecutor
from fireworld.interrupt import gentle_interrupt
from fireworld.policy.names import note_on_team
from fireworld.simulation.built import BuiltScenario, CityCache
from fireworld.version import simulator_version

TESTS: Final = ("test-1", "test-2", "test-3")
N_SEEDS: Final = 100


def compare(
    policies: Sequence[Any],
    *,
    scenarios: AnyScenarios = TESTS,
    seeds: int | Sequence[int] = N_SEEDS,
    first_seed: int = 1,
    set: Mapping[str, Any] | None = None,
    executor: AnyExecutor = None,
    results: Path | str | None = None,
    metric: str = "score",
    margin: float = 0.0,
    on_run: Callable[[int, int], object] = lambda *_: None,
    stop: Event | None = None,
) -> Comparison:
    """Compare policies with the first of them, run by run on the same scenarios and seeds.

    Every policy begins every run anew: a class is made again, an object is copied. So the runs are those of
    `fw.run(scenario, policy=..., seed=...)`, and do not depend on the executor.

    Args:
        policies: two or more: the reference (A), and those compared with it (each of them B). Names, files, classes,
            objects, or functions of an observation.
        scenarios: names of scenarios or suites, files or Scenario objects; a suite is compared as one.
        seeds: how many seeds, or which.
        first_seed: the first, where only their number is given.
        set: values of scenario keys, as in {"brigades.n": 7}; of all scenarios.
        executor: who makes the runs. None: all cores, in threads for policies that run in compiled code, in processes
            for others that processes can find again; a number: as many at a time, likewise; a word of `--on` or an `On`
            of `fireworld.executors`: all of them there; or an executor of concurrent.futures.
        results: a file (.parquet) to take known runs from, and to add the others to.
        metric: what the judgement is about: "score", "burnt-out", "time" or "civilians".
        margin: a loss that does not matter, in the metric's unit.
        on_run: called with the number of runs that are done or known, and of all: once before the first, and after
            every run.
        stop: set it, and no further run begins.

    Raises:
        ArgumentError: an argument that makes no sense.
        PolicyError, TrainingError: a policy that cannot be found, made, named in results or sent to processes; or one
            that fails in a run.
        ScenarioError, CityError: a scenario that cannot be read or built, or comes twice.
        OutputError: the results file cannot be read or written.
        ExecutorError: an executor that is none, or a process that died.
        Interrupted: Ctrl-C, or `stop` was set; what is done is in the results file.
    """
    chosen = find_metric(metric)
    if not isinstance(margin, int | float) or not (math.isfinite(margin) and margin >= 0):
        raise ArgumentError(expected("margin", "", "a number from 0 on", margin))
    run_seeds = seeds_of(seeds, first_seed)
    known = open_results(None if results is None else path_of("results", results))
    if not isinstance(policies, Sequence) or isinstance(policies, str) or len(policies) < 2:
        raise ArgumentError(expected("policies", "", 'two or more, as in ["chief", "best"]', policies))
    found = runnable_policies(policies, executor, kept=known.path is not None)
    cities, rows = CityCache(), rows_of(scenarios, settings_of(set))
    built = {name: cities.build(one) for name, one in rows.scenarios.items()}
    runs = ComparisonRuns(found, built, run_seeds, known)
    with gentle_interrupt(stop) as interrupted:
        runs.make(executor, interrupted, on_run)
    reference, *others = found
    of_reference = runs.outcomes(reference)
    compared = [ComparedPolicy(reference.name, reference.named.identity)]
    for policy in others:
        same = policy.key == reference.key
        pairings = compare_outcomes(of_reference, runs.outcomes(policy), rows=rows.within, same_policy=same)
        compared.append(ComparedPolicy(policy.name, policy.named.identity, tuple(pairings)))
    return Comparison(
        policies=tuple(compared),
        scenarios=tuple(rows.digests.items()),
        suites={name: rows.n_scenarios(name) for name in rows.suites},
        seeds=run_seeds,
        version=simulator_version(),
        metric=chosen.name,
        margin=float(margin),
        warnings=tuple(warnings_of(found, built.values())),
    )


def warnings_of(policies: Iterable[RunnablePolicy], built: Iterable[BuiltScenario]) -> list[str]:
    """Return how teams are used differently from their training, a line each."""
    found = (
        note_on_team(policy.named, each.scenario.brigades.n, choices=each.scenario.choices)
        for policy in policies
        for each in built
    )
    return list(dict.fromkeys(filter(None, found)))
