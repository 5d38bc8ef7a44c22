"""`fireworld run`: run a scenario, show its outcome and record it."""

from __future__ import annotations

import json
from contextlib import contextmanager
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

    from fireworld.records import CityRecord, RunHeader, StepRecord, Steps

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
    fireworld run test-1 --policy easiest --seed 3   another fire, policy and luck
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
    from fireworld.simulation.run import prepare_run

    named = find_policy(policy)
    chosen = load_scenario(scenario).with_settings(split_settings(settings))
    note = note_on_team(named, chosen.brigades.n, choices=chosen.choices)
    if note:
        click.echo(note, err=True)
    run = prepare_run(build_scenario(chosen), named, seed=seed, n_steps_max=steps)
    last, digest = carry_out(run, output=output, force=force, quiet=as_json, foxglove=scene is not None, screen=screen)
    outcome = outcome_of(run, last, digest=digest, output=output)
    if as_json:
        click.echo(json.dumps(outcome, indent=2))
    else:
        show_outcome(outcome)
    context.exit(INTERRUPTED if outcome["ended"] == "interrupted" else 0)


def carry_out(
    run: Steps,
    *,
    output: Path | None,
    force: bool,
    quiet: bool,
    foxglove: bool = False,
    screen: Screen | None = None,
) -> tuple[StepRecord, str]:
    """Run a prepared run under a progress display, and shown live; return its last record and its digest.

    Args:
        run: the run.
        output: the recording to make.
        force: replace an existing one.
        quiet: show no progress.
        foxglove: add to the recording what Foxglove draws.
        screen: where to show the run while it happens.

    Raises:
        PolicyError: the policy failed; the steps before are in the partial recording.
        Interrupted: a second Ctrl-C; likewise.
        OutputError: the recording cannot be written.
    """
    from fireworld.recording.record import play

    scene = make_scene(run.header, run.city) if foxglove else None
    with watched_run(screen, run.header, run.city) as show, _progress(run.header, quiet=quiet) as advance:

        def on_step(record: StepRecord) -> None:
            show(record)
            advance(record)

        played = play(run, record=output, force=force, scene=scene, on_step=on_step)
    return played.last, played.digest


def make_scene(header: RunHeader, city: CityRecord) -> Scene:
    """Make what is recorded besides for Foxglove."""
    from fireworld.recording.pages.foxglove_scene import FoxgloveScene

    return FoxgloveScene(header, city)


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


def outcome_of(run: Steps, last: StepRecord, *, digest: str, output: Path | None) -> dict[str, Any]:
    """Collect how a run ended."""
    score = last.score
    ended = "terminated" if last.terminated else "truncated" if last.truncated else "interrupted"
    return {
        "scenario": run.header.scenario,
        "policy": run.header.policy,
        "seed": run.header.seed,
        "ended": ended,
        "steps": last.step,
        "time_to_complete": last.step if last.terminated else None,
        "score": score.score,
        "score_max": score.score_max,
        "score_now": score.score_now,
        "n_buildings": len(run.city.building_id),
        "n_burning": score.n_burning,
        "n_burnt_out": score.n_burnt_out,
        "n_water_damaged": score.n_water_damaged,
        "n_civilians": len(run.city.civilian_x_m),
        "n_civilians_alive": score.n_civilians_alive,
        "return": last.rewards.sum_so_far,
        "water_used_litres": score.water_used_litres,
        "digest": digest,
        "recording": str(output) if output is not None else None,
    }


def show_outcome(outcome: dict[str, Any]) -> None:
    """Show the outcome as a table."""
    from rich.console import Console
    from rich.table import Table

    table = Table(title=f"{outcome['scenario']}, {outcome['policy']}, seed {outcome['seed']}", show_header=False)
    table.add_column(style="bold")
    table.add_column(justify="right", overflow="fold")
    complete = outcome["time_to_complete"]
    time = f"{complete} steps" if complete is not None else f"not within {outcome['steps']} steps"
    table.add_row("score", f"{outcome['score']:.3f} of {outcome['score_max']:.0f}")
    table.add_row("time to complete", time)
    table.add_row("burnt out", f"{outcome['n_burnt_out']} of {outcome['n_buildings']} buildings")
    table.add_row("still burning", str(outcome["n_burning"]))
    table.add_row("water-damaged", str(outcome["n_water_damaged"]))
    table.add_row("civilians alive", f"{outcome['n_civilians_alive']} of {outcome['n_civilians']}")
    table.add_row("return", f"{outcome['return']:,.0f}")
    table.add_row("water used", f"{outcome['water_used_litres']:,.0f} litres")
    table.add_row("digest", outcome["digest"])
    console = Console()
    console.print(table)
    if outcome["ended"] == "interrupted":
        click.echo(f"interrupted after step {outcome['steps']}", err=True)
    if outcome["recording"] is not None:
        name = outcome["recording"]
        click.echo(f"recorded to {name}; look at it with `fireworld view {name}`")
