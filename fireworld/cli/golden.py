"""`fireworld golden`: recordings that are kept to compare with, checked, renewed and added to."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from fireworld.cli import USER_ERROR
from fireworld.cli.compiling import announce_compilation
from fireworld.cli.options import seed_option, settings_option, steps_option
from fireworld.cli.progress import bar
from fireworld.cli.tables import print_table
from fireworld.errors import OutputError, expected
from fireworld.interrupt import gentle_interrupt

if TYPE_CHECKING:
    from fireworld.recording.golden.check import Checked

FOLDER: Final = Path("recordings/golden")
REASONS: Final = "REASONS.md"
REASONS_TITLE: Final = "# Why golden recordings changed\n\nWritten by `fireworld golden update`; the newest last.\n"
EXIT_CODES: Final = {"same": 0, "different": 1, "cannot": USER_ERROR}
_DIRECTORY = click.Path(path_type=Path, file_okay=False)


@click.group()
def command() -> None:
    """Keep recordings of runs, and see whether the same runs still give the same.

    \b
    fireworld golden add test-1 --policy mine:Policy --steps 30   keep one, and its text
    fireworld golden check                                        run all again and compare
    fireworld golden update --reason "Brigades refill earlier."   accept what changed

    A golden is two files: NAME.mcap, the recording, which says what to run, and NAME.txt, what happened in it, to be
    read in reviews. Both belong under version control.
    """


@command.command(short_help="Run all again and compare.")
@click.argument("folder", metavar="[DIR]", type=_DIRECTORY, default=FOLDER)
@click.option("--json", "as_json", is_flag=True, help="Write JSON.")
@click.option("--junit", metavar="FILE", type=click.Path(path_type=Path), help="Write JUnit XML for a CI server.")
@click.option("--keep", metavar="KEEP", type=_DIRECTORY, help="Record the new runs that differ in folder KEEP.")
@click.option("--force", is_flag=True, help="Replace existing files of --junit and --keep.")
@click.pass_context
def check(
    context: click.Context, *, folder: Path, as_json: bool, junit: Path | None, keep: Path | None, force: bool
) -> None:
    """Run every golden in DIR (recordings/golden if left out) again and compare.

    Scenario, policy and code are taken as they are now: a scenario file and a policy's module from the current folder
    or where they were when the golden was added. For each golden that differs, the first difference is named.

    Exit code: 0 all the same, 1 one is different, 2 one cannot be run or compared, or there is none.
    """
    from fireworld.cli.golden_junit import junit_xml
    from fireworld.files import check_output, write_file
    from fireworld.recording.golden.check import find_goldens, make_golden_folder, store_recording

    if keep is not None and keep.resolve() == folder.resolve():
        raise click.UsageError("--keep: expected another folder than that of the goldens.")
    paths = find_goldens(folder)
    if junit is not None:
        check_output(junit, force=force)
    if keep is not None and not force:
        for taken in (keep / path.name for path in paths if (keep / path.name).exists()):
            check_output(taken)
    results = []
    for checked in _check_all(paths, quiet=as_json):
        if keep is not None and checked.fresh is not None and checked.result == "different":
            make_golden_folder(keep)
            store_recording(keep / checked.path.name, checked.fresh)
        results.append(replace(checked, fresh=None))  # of many long runs not all are held at a time
    if junit is not None:
        write_file(junit, junit_xml(results))
    if as_json:
        _write_json(results)
    else:
        _show(results, keep=keep)
    context.exit(max(EXIT_CODES[checked.result] for checked in results))


@command.command(short_help="Record those anew that changed, with the reason.")
@click.argument("names", metavar="[NAME]...", nargs=-1)
@click.option("--reason", required=True, help="Why they changed, in a sentence; kept in DIR/REASONS.md.")
@click.option("--dir", "folder", metavar="DIR", type=_DIRECTORY, default=FOLDER, help="Folder of the goldens.")
@click.pass_context
def update(context: click.Context, *, names: tuple[str, ...], reason: str, folder: Path) -> None:
    """Record those goldens anew that changed: all in DIR (recordings/golden if left out), or those named.

    Nothing is written unless all of them can be run. Goldens that are the same stay as they are.

    Exit code: 0 done, or there was nothing to do; 2 one cannot be run.
    """
    from fireworld.files import write_file
    from fireworld.recording.golden.check import find_goldens, store_golden, store_text

    reason = " ".join(reason.split())
    if not reason:
        raise click.UsageError("--reason: expected a sentence that says why the goldens changed, got nothing.")
    results = list(_check_all(find_goldens(folder, names)))
    failed = [checked for checked in results if checked.difference is None]
    for checked in failed:
        click.echo(f"{checked.name}: {checked.error}", err=True)
    if failed:
        click.echo("nothing is updated", err=True)
        context.exit(USER_ERROR)
    changed = [checked for checked in results if checked.difference is not None and not checked.difference.same]
    names_changed = {checked.name for checked in changed}
    with gentle_interrupt():  # what is begun here is done in a moment, and belongs together
        if changed:
            write_file(folder / REASONS, _reasons(folder / REASONS, reason, changed).encode())
        for checked in results:
            if checked.name in names_changed and checked.fresh is not None:
                store_golden(checked.path, checked.fresh)
                click.echo(f"{checked.name}: {checked.sentence}")
            elif store_text(checked.path):
                click.echo(f"{checked.name}: the same; its text is renewed")
    click.echo(f"{len(changed)} changed, {len(results) - len(changed)} the same")


@command.command(short_help="Run a scenario and keep the recording.")
@click.argument("scenario")
@click.option("--policy", required=True, help="As for `fireworld run`: a name, TEAM.npz, or MODULE:CLASS.")
@seed_option
@steps_option
@settings_option
@click.option("--name", help="Name of the golden.  [default: made of scenario, policy and seed]")
@click.option("--dir", "folder", metavar="DIR", type=_DIRECTORY, default=FOLDER, help="Folder of the goldens.")
def add(
    *,
    scenario: str,
    policy: str,
    seed: int,
    steps: int | None,
    settings: tuple[str, ...],
    name: str | None,
    folder: Path,
) -> None:
    """Run SCENARIO (a shipped name or a YAML file) and keep it as a golden in DIR (recordings/golden if left out).

    \b
    fireworld golden add quick --policy chief
    fireworld golden add test-1 --policy my_policy:SpreadOut --seed 3 --steps 30 --dir tests/golden
    fireworld golden add quick --policy easiest --set brigades.n=4 --name quick-four

    Exit code: 0 done, 2 could not be done.
    """
    announce_compilation()
    from fireworld.recording.golden.check import carry_out, make_golden_folder, store_golden, text_path
    from fireworld.recording.golden.order import place_order, prepare_golden
    from fireworld.scenario import split_settings

    path = folder / f"{_checked_name(name) if name is not None else _made_up_name(scenario, policy, seed)}.mcap"
    if path.exists():
        hint = "`fireworld golden update` renews it; or try another --name"
        raise OutputError(expected(str(path), "", "a name that is free", "an existing golden", hint))
    values = split_settings(settings)
    order = place_order(folder, scenario=scenario, policy=policy, seed=seed, steps=steps, settings=values)
    fresh = carry_out(prepare_golden(order, folder))
    make_golden_folder(folder)
    with gentle_interrupt():
        store_golden(path, fresh)
    click.echo(f"{path}: {len(fresh.steps)} steps; what happened in them is in {text_path(path)}")


def _checked_name(name: str) -> str:
    if not re.fullmatch(r"[\w.+=-]+", name) or name.startswith((".", "-")):
        raise click.UsageError(f"--name: expected letters, digits and any of _ . + = -, got {name!r}")
    return name


def _made_up_name(scenario: str, policy: str, seed: int) -> str:
    """Name a golden after what it runs; after its seed too, if that is not 1."""
    parts = [Path(scenario).stem, policy.removesuffix(".npz"), *([f"seed-{seed}"] if seed != 1 else [])]
    return "-".join(re.sub(r"[^\w.+=]+", "-", part).strip("-.") for part in parts)


def _check_all(paths: Sequence[Path], *, quiet: bool = False) -> Iterator[Checked]:
    """Check goldens one after another, under a progress display where people watch."""
    announce_compilation()
    from fireworld.recording.golden.check import check_golden
    from fireworld.simulation.built import CityCache

    cities = CityCache()
    with bar("running", len(paths), quiet=quiet) as advance:
        for path in paths:
            yield check_golden(path, cities=cities)
            advance()


def _reasons(path: Path, reason: str, changed: Sequence[Checked]) -> str:
    """Return the log of reasons with one more entry: the reason, and where each golden first differs."""
    before = path.read_text(encoding="utf-8") if path.is_file() else REASONS_TITLE
    return before + "".join([f"\n* {reason}\n", *(f"  * {checked.name}: {checked.sentence}\n" for checked in changed)])


def _write_json(results: Sequence[Checked]) -> None:
    """Write results as JSON."""
    click.echo(
        json.dumps(
            [
                {
                    "name": checked.name,
                    "result": checked.result,
                    "scenario": checked.header.scenario if checked.header else None,
                    "policy": checked.header.policy if checked.header else None,
                    "seed": checked.header.seed if checked.header else None,
                    "sentence": checked.sentence,
                    **_difference(checked),
                }
                for checked in results
            ],
            indent=2,
        )
    )


def _difference(checked: Checked) -> dict[str, Any]:
    """Return what is known of a difference as plain values: first a of the golden, then b of the new run."""
    from fireworld_recorder.plain import plain

    difference = checked.difference
    if difference is None:
        return {"first": None, "header": {}, "totals": None}
    return {
        "first": plain(difference.first),
        "header": plain(difference.header),
        "totals": plain(difference.totals),
    }


def _show(results: Sequence[Checked], *, keep: Path | None) -> None:
    """Show results as a table; below it, for each that is not the same, what differs."""
    from fireworld.recording.golden.check import changes

    rows = []
    for checked in results:
        header, steps = checked.header, checked.difference.totals[0].n_steps if checked.difference else "-"
        what = (header.scenario, header.policy, str(header.seed)) if header is not None else ("-", "-", "-")
        rows.append((checked.name, *what, str(steps), checked.result))
    print_table(("golden", "scenario", "policy", "seed", "steps", "result"), rows, left=(0, 1, 2, 5), whole=(0,))
    for checked in results:
        if checked.result == "same":
            continue
        click.echo(f"\n{checked.name}: {checked.sentence}")
        for line in changes(checked.difference) if checked.difference is not None else ():
            click.echo(f"  {line}")
        if keep is not None and checked.result == "different":
            click.echo(f"  the new run: {keep / checked.path.name}")
    bad = [checked for checked in results if checked.result == "different"]
    if bad:
        place = "" if bad[0].path.parent == FOLDER else f" --dir {bad[0].path.parent}"
        click.echo(f'\nIf that is meant: fireworld golden update{place} --reason "..."')
