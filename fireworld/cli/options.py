"""Options that several commands have."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypeVar

import click

from fireworld.evaluation.contested import HELD_ABOVE, LOST_BELOW
from fireworld.policy.teams import team_names

if TYPE_CHECKING:
    from fireworld.executors import AnyExecutor

POLICY_HELP: Final = (
    "easiest, nearest-to-civilian, nearest-to-center, nearest-to-me, each-another, random, chief, allocate, planner; "
    f"{', '.join(team_names())} (teams); a team file (TEAM.npz); FILE.py:CLASS or MODULE:CLASS of your own. With "
    "parameters as in planner:horizon=60,interval=2 or mine.py:Mine:k=3. `fireworld policy list` says what each does."
)
SEED_MAX: Final = 2**32 - 1
Command = TypeVar("Command", bound=Callable[..., Any])

seed_option = click.option(
    "--seed", default=1, show_default=True, type=click.IntRange(0, SEED_MAX), help="Seed of all random draws."
)
steps_option = click.option(
    "--steps", type=click.IntRange(min=1), help="Stop after this step.  [default: the scenario's]"
)
settings_option = click.option(
    "--set", "settings", metavar="KEY=VALUE", multiple=True, help="Set a key of the scenario; repeatable."
)

jobs_option = click.option(
    "--jobs", metavar="N", type=click.IntRange(1, 1000), help="Runs at a time.  [default: cores]"
)
on_option = click.option(
    "--on", metavar="WHERE",
    help="Who does the work: threads, processes, dask, dask://HOST:PORT or MODULE:make_executor.",
)  # fmt: skip


def first_seed_option(default: int) -> Callable[[Command], Command]:
    """Return the option that says from where seeds are counted."""
    return click.option(
        "--first-seed", metavar="N", default=default, show_default=True, type=click.IntRange(0, SEED_MAX),
        help="Seeds are counted from here.",
    )  # fmt: skip


def executor_of(on: str | None, jobs: int | None) -> AnyExecutor:
    """Return the executor that --on and --jobs ask for; without --on a number of threads."""
    from fireworld.executors import On

    return jobs if on is None else On(on, jobs)


def _numbers(context: click.Context, option: click.Parameter, text: str | None) -> list[int] | None:
    """Turn "8-12", or "8,10,16", into whole numbers."""
    if text is None:
        return None
    found: list[int] = []
    for part in text.split(","):
        first, dash, last = part.partition("-")
        ends = [end.strip() for end in (first, last if dash else first)]
        if not all(end.isascii() and end.isdecimal() and len(end) <= 6 for end in ends) or int(ends[0]) > int(ends[1]):
            raise click.BadParameter(f"expected numbers as 8-12 or 4,8,16, got {text!r}.", context, option)
        found += range(int(ends[0]), int(ends[1]) + 1)
    return found


counts_option = click.option(
    "--counts", metavar="A-B", callback=_numbers,
    help="Numbers of burning buildings to try, as 8-12 or 4,8,16.",
)  # fmt: skip
lost_option = click.option(
    "--lost-below", metavar="X", default=LOST_BELOW, show_default=True, type=click.FloatRange(0, 1),
    help="A mean score of the rules below it is lost.",
)  # fmt: skip
held_option = click.option(
    "--held-above", metavar="X", default=HELD_ABOVE, show_default=True, type=click.FloatRange(0, 1),
    help="A mean score of the rules above it is held.",
)  # fmt: skip


def record_options(command: Command) -> Command:
    """Add --record and --force to a command."""
    record = click.option(
        "--record", "output", metavar="FILE.mcap", type=click.Path(path_type=Path), help="Record every step to a file."
    )
    return record(click.option("--force", is_flag=True, help="Replace an existing recording.")(command))
