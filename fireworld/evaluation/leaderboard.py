"""`leaderboard`: policies in suites, ranked; known runs come from a results file, the others are made."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from threading import Event
from typing import Any, Final

from fireworld.arguments import ArgumentError, path_of
from fireworld.errors import OutputError, expected
from fireworld.evaluation.board import BoardSuite, Leaderboard
from fireworld.evaluation.compare import warnings_of
from fireworld.evaluation.comparison_runs import ComparisonRuns, RunnablePolicy, runnable_policies
from fireworld.evaluation.inputs import AnyScenarios, Rows, rows_of, seeds_of
from fireworld.evaluation.results import Results, open_results
from fireworld.evaluation.standings import known_policies, standings_of
from fireworld.evaluation.suites import suite_names
from fireworld.executors import AnyExecutor
from fireworld.interrupt import gentle_interrupt
from fireworld.simulation.built import CityCache
from fireworld.version import simulator_version

N_SEEDS: Final = 20


def leaderboard(
    policies: Sequence[Any] | str = (),
    *,
    suites: AnyScenarios | None = None,
    seeds: int | Sequence[int] = N_SEEDS,
    first_seed: int = 1,
    executor: AnyExecutor = None,
    results: Path | str | None = None,
    resume: bool = False,
    on_run: Callable[[int, int], object] = lambda *_: None,
    stop: Event | None = None,
) -> Leaderboard:
    """Run policies in suites with common random numbers, and rank them; those of a results file stand beside them.

    The runs are those of `fw.compare`, and so is the file.

    Args:
        policies: names, files, classes, objects, or functions of an observation; none: those of the results file.
        suites: names; scenarios by name or file stand for themselves. None: all suites.
        seeds: how many seeds, or which.
        first_seed: the first, where only their number is given.
        executor: who makes the runs, as for `fw.compare`.
        results: a file (.parquet) to take known runs from, and to add the others to. Policies in it that were measured
            by the same simulator are ranked too, by the runs that it has of these seeds.
        resume: continue what an interrupted call left in `results`, which has to be there.
        on_run: called with the number of runs that are done or known, and of all.
        stop: set it, and no further run begins.

    Raises:
        ArgumentError: an argument that makes no sense.
        PolicyError, TrainingError, ScenarioError, CityError, OutputError, ExecutorError, Interrupted: as for
            `fw.compare`.
    """
    run_seeds = seeds_of(seeds, first_seed)
    known = _results(results, resume=resume)
    given = _listed(policies, known)
    rows = rows_of(suite_names() if suites is None else suites, {})
    found = runnable_policies(given, executor, kept=known.path is not None)
    warnings = _make(found, rows, run_seeds, known, executor, on_run, stop) if found else []
    version, by_version = simulator_version(), known_policies(known, rows)
    named = {policy.key: policy.name for policy in found}
    by_version[version] = {**by_version.get(version, {}), **named}
    return Leaderboard(
        suites=tuple(_suite(rows, name, digest) for name, digest in rows.digests.items()),
        seeds=run_seeds,
        version=version,
        standings=tuple(standings_of(by_version.pop(version), rows, run_seeds, known, version)),
        apart={other: tuple(standings_of(those, rows, run_seeds, known, other)) for other, those in by_version.items()},
        warnings=tuple(warnings),
    )


def _make(
    found: Sequence[RunnablePolicy],
    rows: Rows,
    seeds: Sequence[int],
    known: Results,
    executor: AnyExecutor,
    on_run: Callable[[int, int], object],
    stop: Event | None,
) -> list[str]:
    """Make the runs that are missing; return what is to be minded of the policies."""
    cities = CityCache()
    built = {name: cities.build(one) for name, one in rows.scenarios.items()}
    runs = ComparisonRuns(found, built, seeds, known)
    with gentle_interrupt(stop) as interrupted:
        runs.make(executor, interrupted, on_run)
    return warnings_of(found, built.values())


def _results(given: Path | str | None, *, resume: bool) -> Results:
    """Open the results; ArgumentError or OutputError if there is nothing to continue."""
    path = None if given is None else path_of("results", given)
    if resume and path is None:
        raise ArgumentError(expected("resume", "", "results to continue", "none"))
    if resume and path is not None and not path.exists():
        raise OutputError(expected(str(path), "", "the results of an interrupted call", "no such file"))
    return open_results(path)


def _listed(policies: Any, known: Results) -> Sequence[Any]:
    listed = [policies] if isinstance(policies, str) else policies
    if not isinstance(listed, Sequence):
        raise ArgumentError(expected("policies", "", 'a list, as in ["chief", "best"]', policies))
    if not listed and not known.by_run:
        hint = "results that hold runs show those that were measured before"
        raise ArgumentError(expected("policies", "", "one policy or more", "none", hint))
    return listed


def _suite(rows: Rows, name: str, digest: str) -> BoardSuite:
    found: Mapping[str, Any] = rows.suites
    description = found[name].description if name in found else rows.scenarios[rows.within[name][0]].description
    return BoardSuite(name, digest, description, rows.n_scenarios(name))
