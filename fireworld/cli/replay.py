"""`fireworld replay`: write episodes of a training as logs of runs."""

from __future__ import annotations

import json
from pathlib import Path

import click

from fireworld.cli.compiling import announce_compilation
from fireworld.cli.progress import bar


@click.command()
@click.argument("log", metavar="TRAINING", type=click.Path(path_type=Path))
@click.option("--scenario", metavar="NAME", help="The scenario of the episode; with --every: of all of them.")
@click.option("--world", type=click.IntRange(min=0), metavar="N", help="The world that a learner played it in.")
@click.option("--episode", type=click.IntRange(min=-1), metavar="N", help="Its number, from 0; -1 is the last.")
@click.option("--every", type=click.IntRange(min=1), metavar="N", help="Every N-th episode, into an existing folder.")
@click.option("-o", "--output", required=True, type=click.Path(path_type=Path), help="Recording, or folder, to write.")
@click.option("--force", is_flag=True, help="Replace existing files.")
@click.option("--json", "as_json", is_flag=True, help="Write what was written as JSON.")
def command(
    *,
    log: Path,
    scenario: str | None,
    world: int | None,
    episode: int | None,
    every: int | None,
    output: Path,
    force: bool,
    as_json: bool,
) -> None:
    """Write an episode of TRAINING, a training log, as the log of a run: temperatures, decisions, values and all.

    It is worked out by replay from the tables that the team had then, and compared with the training log step by step.
    `view`, `diff`, `explain`, `render`, `verify` and all the rest read it; its decisions carry the values of all
    actions, whether the brigade explored, and the TD error of its last update.

    Of what another program's learner played in environments, episodes are counted in the order in which they ended,
    in a scenario or, without --scenario, through the log; with --world they have the numbers that they had there.

    \b
    fireworld replay a.mcap --scenario train-3 --episode 41 -o ep.mcap
    fireworld replay a.mcap --every 50 -o episodes/
    fireworld replay runs/episodes-1.mcap --world 5 --episode 41 -o ep.mcap

    Exit code: 0 written, 2 could not write, or this fireworld learns otherwise.
    """
    if (every is None) == (episode is None):
        raise click.UsageError("Give either --episode or --every.")
    if world is not None and episode is None:
        raise click.UsageError("--world goes with --episode.")
    from fireworld_recorder.source import noun_of

    if noun_of(log) == "training":  # else the error is the only line
        announce_compilation()
    from fireworld.training.log.replay import replay_episode, replay_every

    if episode is not None:
        written = {output: replay_episode(log, scenario, episode, output, world=world, force=force)}
    else:
        with bar("replay", None, quiet=as_json) as advance:
            written = replay_every(log, every or 1, output, scenario=scenario, force=force, on_written=advance)
    if as_json:
        click.echo(json.dumps({str(path): digest for path, digest in written.items()}, indent=2))
        return
    for path, digest in written.items():
        click.echo(f"{path}: digest {digest}")
