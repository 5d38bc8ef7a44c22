"""`fireworld run`: run a scenario, show its outcome and record it."""

from __future__ import annotations

import json
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from fireworld.cli import INTERRUPTED
from fireworld.cli.compiling import announce_compilation
from fireworld.cli.live import find_screen, view_options, watched_run
from fireworld.cli.options import POLICY_HELP, record_options, seed_option, settings_option, steps_option
from fireworld.cli.progress import BAR, ELAPSED, bars, is_watched

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from fireworld_recorder.writer import Scene
    from fireworld_viewer.rerun_view.live import Screen

    from fireworld.outcome import Outcome
    from fireworld.records import RunHeader, StepRecord, Steps

STEP: Final = "step {task.completed:.0f} of at most {task.total:.0f}"
STATE: Final = "{task.fields[burning]} burning, score {task.fields[score]:.2f}"


@click.command()
@click.argument("scenario", default="default")
@click.option("--policy", default="best", show_default=True, help=POLICY_HELP)
@seed_option
@steps_option
@record_options
@click.option(
    "--scene", type=click.Choice(["foxglove"]), help="Add to the recording what Foxglove, Lichtblick and Rerun draw."
)
@view_options
@settings_option
@click.option("--json", "as_json", is_flag=True, help="Write the outcome as JSON.")
@click.pass_context
def command(
    context: click.Context,
    *,
    scenario: str,
    policy: str,
    seed: int,
    steps: int | None,
    output: Path | None,
    force: bool,
    scene: str | None,
    view: bool,
    view_url: str | None,
    settings: tuple[str, ...],
    as_json: bool,
) -> None:
    """Run SCENARIO (a shipped name or a YAML file; `default` if left out) and show how it ended.

    \b
    fireworld run                                    the default scenario
    fireworld run test-1 --policy easiest --seed 3   another fire, policy and random draws
    fireworld run quick --set brigades.n=4           with a changed scenario
    fireworld run --record out.mcap                  and every step recorded
    fireworld run --view                             and shown while it runs

    Exit code: 0 run, 2 could not run, 130 interrupted (the recording keeps every step done).
    """
    if force and output is None:
        raise click.UsageError("--force goes with --record.")
    if scene is not None and output is None:
        raise click.UsageError("--scene goes with --record.")
    screen = find_screen(view=view, url=view_url)
    announce_compilation()
    from fireworld.policy.names import find_policy, note_on_team
    from fireworld.scenario import load_scenario, split_settings
    from fireworld.simulation.built import build_scenario
    from fireworld.simulation.prepared_run import prepare_run

    named = find_policy(policy)
    chosen = load_scenario(scenario).with_settings(split_settings(settings))
    note = note_on_team(named, chosen.brigades.n, choices=chosen.choices)
    if note:
        click.echo(note, err=True)
    run = prepare_run(build_scenario(chosen), named, seed=seed, n_steps_max=steps)
    found = play_and_watch(run, output=output, force=force, quiet=as_json, foxglove=scene is not None, screen=screen)
    if as_json:
        click.echo(json.dumps(found.as_json(), indent=2))
    else:
        found.show()
    context.exit(INTERRUPTED if found.interrupted else 0)


@dataclass(frozen=True)
class Ending:
    """How a run that a command has made ended."""

    header: RunHeader
    outcome: Outcome
    digest: str
    interrupted: bool
    output: Path | None

    def as_json(self) -> dict[str, Any]:
        """Return it as plain values; the keys are those of the outcome, but for two."""
        outcome = asdict(self.outcome)
        completed = outcome.pop("completed")
        return {
            **{key: getattr(self.header, key) for key in ("scenario", "policy", "seed")},
            "ended": "interrupted" if self.interrupted else "terminated" if completed else "truncated",
            "steps": outcome.pop("steps"),
            "time_to_complete": self.outcome.time_to_complete,
            "return": outcome.pop("total_reward"),
            **outcome,
            "digest": self.digest,
            "recording": None if self.output is None else str(self.output),
        }

    def show(self) -> None:
        """Print it as a table."""
        from rich.console import Console
        from rich.table import Table
        from rich.text import Text

        from fireworld.errors import one_line
        from fireworld.outcome import QUANTITIES

        title = one_line(self.header.title)
        table = Table(title=Text(title), show_header=False)
        table.add_column(style="bold")
        table.add_column(justify="right", overflow="fold")
        for quantity in QUANTITIES:
            table.add_row(quantity.label, quantity.text(self.outcome))
        Console(markup=False, emoji=False).print(table)
        click.echo(f"digest {self.digest}")
        if self.interrupted:
            click.echo(f"interrupted after step {self.outcome.steps}", err=True)
        if self.output is not None:
            click.echo(f"recorded to {self.output}; look at it with `fireworld view {self.output}`")


def play_and_watch(
    run: Steps,
    *,
    output: Path | None,
    force: bool,
    quiet: bool,
    foxglove: bool = False,
    screen: Screen | None = None,
) -> Ending:
    """Run a prepared run under a progress display, and shown live; errors as for `recording.record.play`.

    Args:
        run: the run.
        output: the recording to make.
        force: replace an existing one.
        quiet: show no progress.
        foxglove: add to the recording what Foxglove draws.
        screen: where to show the run while it happens.
    """
    from fireworld.outcome import outcome_of
    from fireworld.recording.record import play

    scene: Scene | None = None
    if foxglove:
        from fireworld.recording.pages.foxglove_scene import FoxgloveScene

        scene = FoxgloveScene(run.header, run.city)
    with watched_run(screen, run.header, run.city) as show, _progress(run.header, quiet=quiet) as advance:

        def on_step(record: StepRecord) -> None:
            show(record)
            advance(record)

        played = play(run, record=output, force=force, scene=scene, on_step=on_step)
    last = played.last
    ended = last.terminated or last.truncated
    return Ending(run.header, outcome_of(last, run.city), played.digest, played.interrupted and not ended, output)


@contextmanager
def _progress(header: RunHeader, *, quiet: bool) -> Iterator[Callable[[StepRecord], None]]:
    """Show progress where people watch; yield what is to be called after each step."""
    if quiet or not is_watched():
        yield lambda _: None
        return
    with bars(STEP, BAR, STATE, ELAPSED) as progress:
        task = progress.add_task("run", total=header.n_steps_max, burning=0, score=0.0)
        yield lambda record: progress.update(
            task, completed=record.step, burning=record.score.n_burning, score=record.score.score
        )
