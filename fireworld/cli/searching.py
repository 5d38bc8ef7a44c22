"""`fireworld train --method search`: find the weights of a ranking."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import click

from fireworld.cli.live_search import watched_search
from fireworld.cli.progress import BAR, DESCRIPTION, ELAPSED, bars, is_watched
from fireworld.interrupt import gentle_interrupt

if TYPE_CHECKING:
    from fireworld_viewer.rerun_view.live import Screen

    from fireworld.training.curriculum import Curriculum
    from fireworld.training.search import Generation
    from fireworld.training.searches import SearchRun


def train_by_search(
    curriculum: Curriculum,
    settings: dict[str, str],
    *,
    output: Path,
    seed: int,
    repetitions: int,
    jobs: int | None,
    resume: bool,
    force: bool,
    screen: Screen | None,
) -> bool:
    """Search for rankings, one after another, each with all cores; tell whether all were found.

    Args are those of `fireworld train`; `screen` is where to show it, None for nowhere.

    Raises:
        FireworldError: as in training.
    """
    from fireworld.simulation.built import CityCache
    from fireworld.training.checkpoint import begin_all
    from fireworld.training.search import Search, Searcher
    from fireworld.training.searches import SearchRun
    from fireworld.training.teams import numbered

    search = Search().with_settings(settings)
    cities = CityCache()
    runs = [
        SearchRun(
            Searcher(curriculum, search, seed=seed + number - 1, cities=cities),
            numbered(output, number, n_all=repetitions),
            force,
        )
        for number in range(1, repetitions + 1)
    ]
    begin_all(runs, resume=resume)
    n_threads = jobs or os.cpu_count() or 1
    with gentle_interrupt() as interrupted, _progress(runs) as report, watched_search(screen, runs) as show:

        def report_and_show(run: SearchRun, generation: Generation) -> None:
            report(run, generation)
            show(run, generation)

        for run in runs:
            if not interrupted.is_set():
                run.run(interrupted, n_threads=n_threads, report=report_and_show)
                _show(run)
    return all(run.ranking is not None for run in runs)


def _show(run: SearchRun) -> None:
    """Say what came of a search."""
    if run.ranking is not None:
        what = "own targets" if run.ranking.own_targets else "the paper's actions"
        click.echo(f"{run.path}: seed {run.searcher.seed}, a ranking of {what}, digest {run.ranking.digest}")
    elif run.checkpoint.exists():
        n = run.searcher.state.generation
        click.echo(f"interrupted after {n} generations; {run.checkpoint} is kept: go on with --resume", err=True)


@contextmanager
def _progress(runs: Sequence[SearchRun]) -> Iterator[Callable[[SearchRun, Generation], None]]:
    """Show progress: a bar where people watch, else a line for every generation."""

    def words(run: SearchRun, done: Generation) -> str:
        return (
            f"seed {run.searcher.seed}: generation {done.generation + 1} of {run.searcher.search.n_generations}, "
            f"score {done.score_mean:.3f}, of the best {done.score_best:.3f}, spread {done.spread:.2f}"
        )

    if not is_watched():
        yield lambda run, done: click.echo(words(run, done), err=True)
        return
    with bars(DESCRIPTION, BAR, ELAPSED) as progress:
        task = progress.add_task("the first generation", total=sum(run.searcher.search.n_generations for run in runs))
        yield lambda run, done: progress.update(task, advance=1, description=words(run, done))
