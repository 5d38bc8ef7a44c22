"""`fireworld golden`: recordings to compare new runs and trainings with, checked, recorded anew and added to."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

import click

from fireworld.cli import USER_ERROR
from fireworld.cli.compiling import announce_compilation
from fireworld.cli.options import seed_option, steps_option
from fireworld.cli.progress import bar
from fireworld.cli.tables import print_table
from fireworld.errors import one_line

if TYPE_CHECKING:
    from fireworld.recording.golden.check import GoldenResult

FOLDER: Final = Path("recordings/golden")
EXIT_CODES: Final = {"same": 0, "different": 1, "cannot": USER_ERROR}
UPDATED: Final = {"recording": "{sentence}", "text": "the same; its text is written anew"}
_DIRECTORY = click.Path(path_type=Path, file_okay=False)
_folder_option = click.option(
    "--dir", "folder", metavar="DIR", type=_DIRECTORY, default=FOLDER, help="Folder of the goldens."
)


@click.group()
def command() -> None:
    """Keep recordings of runs and trainings, and check whether the same still gives the same.

    \b
    fireworld golden add test-1 --policy mine:Policy --steps 30   store a run, and its text
    fireworld golden add quick --train --set n_episodes_max=20    store a training
    fireworld golden check                                        do all again and compare
    fireworld golden update --reason "Brigades refill earlier."   accept what changed
    fireworld golden list, fireworld golden remove NAME           see what is there, remove it

    A golden is two files: NAME.mcap, the recording, which holds what to run or to train, and NAME.txt, what happened
    in it, to be read in reviews. Both belong under version control.
    """


@command.command(short_help="Run or train all again and compare.")
@click.argument("folder", metavar="[DIR]", type=_DIRECTORY, default=FOLDER)
@click.option("--json", "as_json", is_flag=True, help="Write JSON.")
@click.option("--junit", metavar="FILE", type=click.Path(path_type=Path), help="Write JUnit XML for a CI server.")
@click.option("--keep", metavar="KEEP", type=_DIRECTORY, help="Record what differs now in folder KEEP.")
@click.option("--force", is_flag=True, help="Replace existing files of --junit and --keep.")
@click.pass_context
def check(
    context: click.Context, *, folder: Path, as_json: bool, junit: Path | None, keep: Path | None, force: bool
) -> None:
    """Run every golden in DIR (recordings/golden if left out) again, or train again, and compare.

    Scenario, curriculum, policy and code are taken as they are now: files and a policy's module from the current folder
    or where they were when the golden was added. For each golden that differs, the first difference is named: of a
    training the episode, the step, the brigade and the state.

    Exit code: 0 all the same, 1 one is different, 2 one cannot be run or compared, or there is none.
    """
    announce_compilation()
    from fireworld.files import check_output, write_file
    from fireworld.recording.golden.check import check_goldens, find_goldens, goldens_junit

    if junit is not None:
        check_output(junit, force=force)
    checks = check_goldens(folder, keep=keep, force=force)
    results = []
    with bar("running", len(find_goldens(folder)), quiet=as_json) as advance:
        for result in checks:
            results.append(replace(result, fresh=None))  # of many long runs not all are held at a time
            advance()
    if junit is not None:
        write_file(junit, goldens_junit(results))
    if as_json:
        click.echo(json.dumps([result.to_dict() for result in results], indent=2))
    else:
        _show(results, keep=keep)
    context.exit(max(EXIT_CODES[result.result] for result in results))


@command.command("list", short_help="List the goldens, and what is left over beside them.")
@click.argument("folder", metavar="[DIR]", type=_DIRECTORY, default=FOLDER)
@click.option("--json", "as_json", is_flag=True, help="Write JSON.")
def list_(*, folder: Path, as_json: bool) -> None:
    """List the goldens in DIR (recordings/golden if left out) without running them.

    Below them are listed what killed commands left, and texts whose recording is gone; `fireworld golden remove
    --leftovers` removes these.

    Exit code: 0 listed, 2 there is none.
    """
    from fireworld.recording.golden.remove import leftovers_of, list_goldens

    found, leftovers = list_goldens(folder), leftovers_of(folder)
    if as_json:
        known = {"goldens": [one.to_dict() for one in found], "leftovers": [str(path) for path in leftovers]}
        click.echo(json.dumps(known, indent=2))
        return
    rows = [(one.name, one.what or "-", one.by or "-", str(one.seed), f"{one.n_bytes:,}") for one in found]
    print_table(("golden", "scenario", "policy", "seed", "bytes"), rows, left=(0, 1, 2), whole=(0,))
    for one in found:
        if one.error:
            click.echo(f"{one.name}: {one_line(one.error)}")
    for path in leftovers:
        click.echo(f"{one_line(str(path))}: left over; fireworld golden remove --leftovers")


@command.command(short_help="Remove goldens, or what is left over beside them.")
@click.argument("names", metavar="[NAME]...", nargs=-1)
@click.option("--leftovers", is_flag=True, help="Remove what killed commands left, and texts without a recording.")
@_folder_option
def remove(*, names: tuple[str, ...], leftovers: bool, folder: Path) -> None:
    """Remove the goldens named, each with its text, as after a test was renamed.

    Exit code: 0 removed, 2 there is no such golden: nothing is removed then.
    """
    from fireworld.recording.golden.remove import remove_goldens

    if not names and not leftovers:
        raise click.UsageError("Missing argument 'NAME', or --leftovers.")
    gone = remove_goldens(folder, names, leftovers=leftovers)
    for path in gone:
        click.echo(f"removed {one_line(str(path))}")
    if not gone:
        click.echo("nothing is left over")


@command.command(short_help="Record those anew that changed, with the reason.")
@click.argument("names", metavar="[NAME]...", nargs=-1)
@click.option("--reason", required=True, help="Why they changed, in a sentence; written into DIR/REASONS.md.")
@_folder_option
def update(*, names: tuple[str, ...], reason: str, folder: Path) -> None:
    """Record those goldens anew that changed: all in DIR (recordings/golden if left out), or those named.

    Nothing is written unless all of them can be run. Goldens that are the same stay as they are.

    Exit code: 0 done, or there was nothing to do; 2 one cannot be run.
    """
    announce_compilation()
    from fireworld.recording.golden.check import find_goldens
    from fireworld.recording.golden.update import update_goldens

    with bar("running", len(find_goldens(folder, names))) as advance:
        updates = update_goldens(folder, names, reason=reason, on_result=lambda _: advance())
    for golden in updates:
        if golden.done in UPDATED:
            click.echo(f"{golden.name}: {UPDATED[golden.done].format(sentence=golden.sentence)}")
    n_changed = sum(golden.done == "recording" for golden in updates)
    click.echo(f"{n_changed} changed, {len(updates) - n_changed} the same")


@command.command(short_help="Run a scenario, or train, and keep the recording.")
@click.argument("scenario")
@click.option("--policy", help="As for `fireworld run`: a name, TEAM.npz, or MODULE:CLASS.")
@click.option("--train", is_flag=True, help="Train a team, as `fireworld train` does, instead of running a policy.")
@click.option("--method", metavar="NAME", help="With --train: how to learn.  [default: paper]")
@click.option("--stages", metavar="NAME,...", help="With --train: train in these stages of the curriculum only.")
@seed_option
@steps_option
@click.option(
    "--set",
    "settings",
    metavar="KEY=VALUE",
    multiple=True,
    help="Set a key of the scenario, with --train a hyperparameter of the method; repeatable.",
)
@click.option("--name", help="Name of the golden.  [default: made of the rest]")
@_folder_option
def add(
    *,
    scenario: str,
    policy: str | None,
    train: bool,
    method: str | None,
    stages: str | None,
    seed: int,
    steps: int | None,
    settings: tuple[str, ...],
    name: str | None,
    folder: Path,
) -> None:
    """Run SCENARIO (a shipped name or a YAML file) and store it as a golden in DIR (recordings/golden if left out).

    With --train a team is trained: SCENARIO may be a curriculum, too.

    \b
    fireworld golden add quick --policy chief
    fireworld golden add test-1 --policy my_policy:SpreadOut --seed 3 --steps 30 --dir tests/golden
    fireworld golden add quick --policy easiest --set brigades.n=4 --name quick-four
    fireworld golden add my-curriculum.yaml --train --stages alone --set alpha=0.1

    Exit code: 0 done, 2 could not be done.
    """
    _check_options(policy=policy, train=train, steps=steps, method=method, stages=stages)
    announce_compilation()
    from fireworld.recording.golden.store import text_path
    from fireworld.recording.golden.update import add_golden, add_training
    from fireworld.scenario import split_settings

    if policy is not None:
        values = split_settings(settings)
        path = add_golden(scenario, policy=policy, seed=seed, steps=steps, settings=values, name=name, folder=folder)
    else:
        values = split_settings(settings, example="alpha=0.1")
        path = add_training(
            scenario, method=method or "paper", seed=seed, stages=stages, settings=values, name=name, folder=folder
        )
    click.echo(f"{path}: recorded; what happened in it is in {text_path(path)}")


def _check_options(*, policy: str | None, train: bool, **others: object) -> None:
    """Check that a golden is of a run or of a training, and has no options of the other."""
    if policy is None and not train:
        raise click.UsageError("Missing option '--policy' or '--train'.")
    if policy is not None and train:
        raise click.UsageError("--policy and --train exclude each other.")
    for option in ("steps",) if train else ("method", "stages"):
        if others[option] is not None:
            raise click.UsageError(f"--{option} is for a {'run' if train else 'training'}.")


def _show(results: Sequence[GoldenResult], *, keep: Path | None) -> None:
    """Print results as a table; below it, for each that is not the same, what differs."""
    rows = [(result.name, *result.cells, result.result) for result in results]
    print_table(("golden", "scenario", "policy", "seed", "steps", "result"), rows, left=(0, 1, 2, 5), whole=(0,))
    for result in results:
        if result.result == "same":
            continue
        click.echo(f"\n{result.name}: {result.headline}")
        for line in result.lines:
            click.echo(f"  {line}".rstrip())
        if keep is not None and result.result == "different":
            click.echo(f"  the new {result.kind}: {keep / result.path.name}")
    bad = [result for result in results if result.result == "different"]
    if bad:
        place = "" if bad[0].path.parent == FOLDER else f" --dir {bad[0].path.parent}"
        click.echo(f'\nIf that is meant: fireworld golden update{place} --reason "..."')
