"""`fireworld import-log`: make a recording of the log of an official kernel."""

from __future__ import annotations

import json
from pathlib import Path

import click

from fireworld.cli.progress import bar


@click.command()
@click.argument("file", metavar="FILE", type=click.Path(path_type=Path))
@click.option("-o", "--output", type=click.Path(path_type=Path), required=True, help="Recording to write.")
@click.option("--force", is_flag=True, help="Replace an existing recording.")
@click.option("--json", "as_json", is_flag=True, help="Write what was imported as JSON.")
@click.pass_context
def command(context: click.Context, *, file: Path, output: Path, force: bool, as_json: bool) -> None:
    """Make a recording of FILE, the log of an official RoboCup Rescue kernel.

    \b
    fireworld import-log rescue.log.xz -o old.mcap
    fireworld view old.mcap

    Raw logs, .xz, .lzma, .gz, .7z and JSON of all years are read, by what is in the file.
    What such a log does not have, such as fuel, choices and rewards, is absent from the recording: it can be
    shown, compared and exported, not replayed. A log that was cut off is imported up to its last whole step.

    Exit code: 0 imported, 1 imported as far as the log goes: it was cut off, 2 not an official log, or damaged.
    """
    from fireworld.recording.official_log.importer import import_log

    with bar("import", None, quiet=as_json) as advance:
        imported = import_log(file, output, force=force, on_step=lambda _: advance())
    if as_json:
        click.echo(json.dumps(imported.to_dict(), indent=2))
    else:
        for line in imported.lines():
            click.echo(line)
    if imported.damage is not None:
        click.echo(f"{file}: {imported.damage}", err=True)
        context.exit(1)
