"""`fireworld recover`: rescue the committed steps of a damaged recording."""

from __future__ import annotations

from pathlib import Path

import click


@click.command()
@click.argument("log", metavar="LOG", type=click.Path(path_type=Path))
@click.option("-o", "--output", type=click.Path(path_type=Path), required=True, help="Recording to write.")
@click.option("--force", is_flag=True, help="Replace an existing file.")
def command(*, log: Path, output: Path, force: bool) -> None:
    """Write the committed steps of LOG, a cut-off or damaged recording, as a recording of their own."""
    from fireworld.recording.export import recover

    recovery = recover(log, output, force=force)
    click.echo(f"{log}: {recovery.damage or 'it was complete'}")
    n, unit = recovery.n_steps, recovery.unit
    click.echo(f"{output}: {n} {unit}s, up to {unit} {recovery.last_step}, digest {recovery.digest}")
