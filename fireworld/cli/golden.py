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
from fireworld.cli.options import executor_of, on_option, seed_option, steps_option
from fireworld.cli.progress import BAR, COUNT, DESCRIPTION, LEFT, bar
from fireworld.cli.reporting import check_reporting, print_annotations, reporting_options
from fireworld.cli.tables import print_lines, print_table
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
    in it, to be read in reviews; or one, NAME.digest (add --digest-only). They belong under version control.
    """


@command.command(short_help="Run or train all again and compare.")
@click.argument("names", metavar="[DIR] [NAME]...", nargs=-1)
@_folder_option
@click.option("-k", "matching", metavar="EXPR", default="", help="Only names that match, as 'quick and not planner'.")
@click.option("--jobs", metavar="N", default=1, show_default=True, type=click.IntRange(1, 1000), help="Runs at a time.")
@on_option
@click.option("--json", "as_json", is_flag=True, help="Write JSON.")
@click.option("--junit", metavar="FILE", type=click.Path(path_type=Path), help="Write JUnit XML for a CI server.")
@click.option("--keep", metavar="KEEP", type=_DIRECTORY, help="Keep what differs in KEEP: recording, pages, picture.")
@reporting_options
@click.option("--force", is_flag=True, help="Replace existing files of --junit, --keep and --summary.")
@click.pass_context
def check(
    context: click.Context,
    *,
    names: tuple[str, ...],
    folder: Path,
    matching: str,
    jobs: int,
    on: str | None,
    as_json: bool,
    junit: Path | None,
    keep: Path | None,
    summary: Path | None,
    annotate: str | None,
    force: bool,
) -> None:
    """Run every golden in DIR (recordings/golden if left out), or those named, again, or train again, and compare.

    Scenario, curriculum, policy and code are taken as they are now: files and a policy's module from the current folder
    or where they were when the golden was added. For each golden that differs, what changed is named first, then the
    first difference: of a training the episode, the step, the brigade and the state.

    \b
    fireworld golden check                         all
    fireworld golden check hard -k "not slow"      by name
    fireworld golden check --dir tests/recordings --jobs 4
    fireworld golden check --keep new --summary new/summary.md --annotate github

    KEEP gets of each golden that differs the new recording, a page that plays it beside the golden, and with matplotlib
    a page of the difference and a picture. Without --keep the pictures of --summary go to a folder beside it.

    Exit code: 0 all the same, 1 one is different, 2 one cannot be run or compared, or there is none.
    """
    check_reporting(annotate=annotate, as_json=as_json)
    announce_compilation()
    from fireworld.files import check_outputs, write_file
    from fireworld.markdown import files_beside, markdown_page
    from fireworld.recording.golden.check import check_goldens, goldens_junit
    from fireworld.recording.golden.find import find_goldens

    folder, names = _folder_and_names(folder, names)
    check_outputs([path for path in (junit, summary) if path is not None], force=force)
    n_all = len(find_goldens(folder, names, matching=matching))
    place = keep or (files_beside(summary) if summary is not None else None)
    with bar("running", n_all, DESCRIPTION, BAR, COUNT, LEFT, quiet=as_json) as advance:
        checks = check_goldens(
            folder,
            names,
            matching=matching,
            keep=place,
            force=force,
            jobs=jobs,
            executor=None if on is None else executor_of(on, jobs),
            on_result=lambda _: advance(),
        )
        results = [replace(result, fresh=None) for result in checks]  # of many long runs not all are held at a time
    if junit is not None:
        write_file(junit, goldens_junit(results))
    if summary is not None:
        findings = [result.finding() for result in results]
        write_file(summary, markdown_page("golden check", findings, beside=summary.parent))
    if as_json:
        click.echo(json.dumps([result.to_dict() for result in results], indent=2))
    else:
        _show(results)
    if annotate:
        print_annotations([result.finding() for result in results])
    context.exit(max(EXIT_CODES[result.result] for result in results))


def _folder_and_names(folder: Path, names: tuple[str, ...]) -> tuple[Path, tuple[str, ...]]:
    """Take the first name for the folder where it is one: it has a slash, or is a folder and no golden."""
    from fireworld.recording.golden.digest import DIGEST_SUFFIX
    from fireworld.recording.golden.store import SUFFIX

    first = Path(names[0]) if names else None
    if first is None or folder != FOLDER:
        return folder, names
    if any((folder / f"{first.name}{suffix}").exists() for suffix in (SUFFIX, DIGEST_SUFFIX)):
        return folder, names
    is_folder = first.is_dir() or len(first.parts) > 1 or str(first) in {".", ".."}
    return (first, names[1:]) if is_folder else (folder, names)


@command.command("list", short_help="List the goldens, and what is left over beside them.")
@click.argument("given", metavar="[DIR]", required=False, type=_DIRECTORY)
@_folder_option
@click.option("--json", "as_json", is_flag=True, help="Write JSON.")
def list_(*, given: Path | None, folder: Path, as_json: bool) -> None:
    """List the goldens in DIR (recordings/golden if left out) without running them.

    Kinds are recording, digest (only) and training. Below them are listed what killed commands left, and texts whose
    recording is gone; `fireworld golden remove --leftovers` removes these.

    Exit code: 0 listed, 2 there is none.
    """
    from fireworld.recording.golden.remove import leftovers_of, list_goldens

    folder = given or folder
    found, leftovers = list_goldens(folder), leftovers_of(folder)
    if as_json:
        known = {"goldens": [one.to_dict() for one in found], "leftovers": [str(path) for path in leftovers]}
        click.echo(json.dumps(known, indent=2))
        return
    rows = [
        (one.name, one.what or "-", one.by or "-", str(one.seed), str(one.n_steps), one.kind, f"{one.n_bytes:,}")
        for one in found
    ]
    heads = ("golden", "scenario", "policy", "seed", "steps", "kind", "bytes")
    print_table(heads, rows, left=(0, 1, 2, 5), whole=(3, 4, 5, 6))
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
    from fireworld.recording.golden.find import find_goldens
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
@click.option("--digest-only", is_flag=True, help="Keep some kB of digests instead of the recording.")
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
    digest_only: bool,
    folder: Path,
) -> None:
    """Run SCENARIO (a shipped name or a YAML file) and store it as a golden in DIR (recordings/golden if left out).

    With --train a team is trained: SCENARIO may be a curriculum, too. With --digest-only a file of some kB is kept,
    with what was run, how it came out, and a code for every step. `check` still names what changed and the first
    step that differs, but the old run is not there to be looked at.

    \b
    fireworld golden add quick --policy chief
    fireworld golden add test-1 --policy my_policy:SpreadOut --seed 3 --steps 30 --dir tests/golden
    fireworld golden add quick --policy easiest --set brigades.n=4 --name quick-four
    fireworld golden add my-curriculum.yaml --train --stages alone --set alpha=0.1
    fireworld golden add test-1 --policy chief --digest-only

    Exit code: 0 done, 2 could not be done.
    """
    _check_options(policy=policy, train=train, digest_only=digest_only, steps=steps, method=method, stages=stages)
    announce_compilation()
    from fireworld.recording.golden.store import LARGE_BYTES, LARGE_HINT, text_path
    from fireworld.recording.golden.update import add_golden, add_training
    from fireworld.scenario import split_settings

    if policy is not None:
        values = split_settings(settings)
        path = add_golden(
            scenario, policy=policy, seed=seed, steps=steps, settings=values, name=name, folder=folder,
            digest_only=digest_only,
        )  # fmt: skip
    else:
        values = split_settings(settings, example="alpha=0.1")
        path = add_training(
            scenario, method=method or "paper", seed=seed, stages=stages, settings=values, name=name, folder=folder
        )
    if digest_only:
        click.echo(f"{path}: the digest of the run, {path.stat().st_size / 1000:,.1f} kB")
        return
    click.echo(f"{path}: recorded; what happened in it is in {text_path(path)}")
    if path.stat().st_size >= LARGE_BYTES:
        click.echo(f"{path.name} has {path.stat().st_size / 1e6:.1f} MB; {LARGE_HINT}", err=True)


def _check_options(*, policy: str | None, train: bool, digest_only: bool, **others: object) -> None:
    """Check that a golden is of a run or of a training, and has no options of the other."""
    if policy is None and not train:
        raise click.UsageError("Missing option '--policy' or '--train'.")
    if digest_only and train:
        raise click.UsageError("--digest-only is for a run.")
    if policy is not None and train:
        raise click.UsageError("--policy and --train exclude each other.")
    for option in ("steps",) if train else ("method", "stages"):
        if others[option] is not None:
            raise click.UsageError(f"--{option} is for a {'run' if train else 'training'}.")


def _show(results: Sequence[GoldenResult]) -> None:
    """Print results as a table; below it, for each that is not the same, what differs."""
    rows = [(result.name, *result.cells, result.result) for result in results]
    heads = ("golden", "scenario", "policy", "seed", "steps", "result")
    print_table(heads, rows, left=(0, 1, 2, 5), whole=(3, 4, 5))
    for result in results:
        if result.result == "same":
            continue
        click.echo()
        print_lines([f"{result.name}: {result.headline}", *(f"  {line}" for line in result.lines)])
        if result.kept is not None:
            click.echo(f"  the new {result.kind}: {result.kept.recording}")
            if result.kept.page is not None:
                click.echo(f"  to look at: {result.kept.page}")
    bad = [result for result in results if result.result == "different"]
    if bad:
        place = "" if bad[0].path.parent == FOLDER else f" --dir {bad[0].path.parent}"
        click.echo(f'\nIf that is meant: fireworld golden update{place} --reason "..."')
