"""What spreading work costs: one comparison in processes and on a Dask cluster of this machine, in turns.

`python -m benchmarks.spreading` prints the seconds of each without the start of its workers, and the ratio. The work of
`--seconds` is made of runs of a policy that is asked in every step.
"""

from __future__ import annotations

import statistics
import time
from concurrent.futures import Executor
from contextlib import nullcontext
from functools import partial
from threading import Event

import click

from fireworld.evaluation.comparison_runs import PolicyRun, runnable
from fireworld.executors import On, Workers, n_cores, workers_for
from fireworld.scenario import load_scenario
from fireworld.simulation.built import build_scenario


def seconds_of(tasks: list[PolicyRun], workers: Workers, pool: Executor) -> float:
    """Return how long tasks take in a pool that is there."""
    there = Workers(workers.n, Event(), lambda _: nullcontext(pool), elsewhere=True, name=workers.name)
    began = time.perf_counter()
    assert there.run(tasks) is not None
    return time.perf_counter() - began


@click.command(help=__doc__)
@click.option("--seconds", default=60.0, show_default=True, help="Work in each turn.")
@click.option("--turns", default=3, show_default=True, help="Turns.")
@click.option("--jobs", default=n_cores(), show_default=True, help="Workers.")
def main(*, seconds: float, turns: int, jobs: int) -> None:
    """Measure."""
    built = build_scenario(load_scenario("test-1"))
    task = partial(PolicyRun, built, "test-1", runnable("tests.policies:Near", 0).given)
    measured: dict[str, list[float]] = {"processes": [], "dask": []}
    pools = {word: workers_for(On(word, jobs)) for word in measured}
    with pools["processes"].make_pool(jobs) as here, pools["dask"].make_pool(jobs) as dask:
        made = {"processes": here, "dask": dask}
        for word, pool in made.items():  # the workers begin, and load what they need
            seconds_of([task(seed) for seed in range(4 * jobs)], pools[word], pool)
        sample = [task(seed) for seed in range(8 * jobs)]
        n = max(jobs, round(seconds / seconds_of(sample, pools["processes"], here) * len(sample)))
        for _ in range(turns):
            for word, pool in made.items():
                measured[word].append(seconds_of([task(seed) for seed in range(n)], pools[word], pool))
    for word, found in measured.items():
        click.echo(f"{word}: {', '.join(f'{one:.1f}' for one in found)} s, {n} runs, {jobs} workers")
    ratios = [b / a for a, b in zip(measured["processes"], measured["dask"], strict=True)]
    click.echo(f"dask / processes: {statistics.median(ratios):.3f} (median of {turns} turns)")


if __name__ == "__main__":
    main()
