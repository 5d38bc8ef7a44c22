"""One reading of the paper: what cooperation adds where choices are read together as one says.

`python -m benchmarks.one_reading duration=four-steps flags-of-what=target` trains and tests both teams so. Choices that
are not named are read as ours; readings.yaml has their levels. No study of readings uses the seeds of these trainings.
"""

from __future__ import annotations

from collections.abc import Sequence

import click
import numpy as np

from fireworld.executors import On, n_cores, workers_for
from fireworld.reproduction.readings.choices import load_choices, read_as
from fireworld.reproduction.readings.effects import over_trainings
from fireworld.reproduction.readings.study import FIRST_SEED, SCREEN
from fireworld.reproduction.readings.trial import Trial, setting_of
from fireworld.training.curriculum import load_curriculum


def levels_of(words: Sequence[str]) -> dict[str, str]:
    """Return the levels of choices, written as CHOICE=LEVEL; click.UsageError for what there is not."""
    choices, levels = {choice.name: choice for choice in load_choices()}, dict[str, str]()
    for word in words:
        name, _, level = word.partition("=")
        if name not in choices:
            raise click.UsageError(f"{word}: expected one of {', '.join(choices)} before =")
        if level not in choices[name].levels:
            raise click.UsageError(f"{word}: expected one of {', '.join(choices[name].levels)} after =")
        levels[name] = level
    return levels


@click.command(help=__doc__)
@click.argument("words", nargs=-1, metavar="[CHOICE=LEVEL]...")
@click.option("--trainings", type=click.IntRange(1), default=SCREEN.fresh, show_default=True)
@click.option("--first-training", default=20_001, show_default=True, help="Seed of the first one.")
@click.option("--jobs", type=click.IntRange(1), default=n_cores(), show_default=True)
def main(*, words: tuple[str, ...], trainings: int, first_training: int, jobs: int) -> None:
    """Train, test and print."""
    reading = read_as(load_choices(), levels_of(words))
    setting = setting_of(reading, load_curriculum("paper"), SCREEN.method)
    seeds, workers = range(FIRST_SEED, FIRST_SEED + SCREEN.seeds), workers_for(On("threads", jobs))
    numbers = range(first_training, first_training + trainings)
    tried = workers.run(
        [Trial(setting, number, seeds, workers.stop) for number in numbers],
        lambda place, _: click.echo(f"training {numbers[place]} is done", err=True),
    )
    if tried is None:
        raise click.Abort
    shares = np.array([one.shares for one in tried])  # (trainings, seeds, 2)
    click.echo(f"{' '.join(words) or 'ours'}: {trainings} trainings from {first_training}, {len(seeds)} seeds a test")
    for name, values in (
        ("with cooperation", shares[:, :, 0]),
        ("without", shares[:, :, 1]),
        ("what it adds", shares[:, :, 0] - shares[:, :, 1]),
    ):
        click.echo(f"{name}: {over_trainings(values).text()}")


if __name__ == "__main__":
    main()
