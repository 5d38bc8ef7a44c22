"""`fireworld report`: a recording, or two, as one HTML page."""

from __future__ import annotations

from pathlib import Path

import click

from fireworld.cli.opening import open_one_or_two, open_trainings


@click.command()
@click.argument("logs", metavar="LOG [LOG_B]", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option("-o", "--output", metavar="FILE.html", required=True, type=click.Path(path_type=Path), help="The page.")
@click.option("--force", is_flag=True, help="Replace an existing file.")
def command(*, logs: tuple[Path, ...], output: Path, force: bool) -> None:
    """Write LOG, a recording, or two of one city, as an HTML page that needs no other file.

    \b
    fireworld report run.mcap -o report.html
    fireworld report alone.mcap together.mcap -o report.html
    fireworld report training.mcap -o training.html

    The page has the outcome, maps, curves, what each brigade chose and did, notable events and how to get the same run
    again; of a training convergence, curves, the tables over the episodes, and the commands that open them. The same
    recording gives the same page, to the byte. A recording that was cut off or damaged is reported as far as it is
    good.

    Exit code: 0 written, 2 could not write, 130 interrupted (nothing is left of it).
    """
    from fireworld.files import check_output
    from fireworld.recording.pages.run_page import ENDINGS, report

    check_output(output, endings=ENDINGS, force=force)
    trainings = open_trainings(logs, doing="reporting")
    if trainings:
        from fireworld.training.log.pages.page import report_training

        report_training(trainings, output, force=force)
        click.echo(f"wrote {output}; open it in a browser")
        return
    report(open_one_or_two(logs, doing="reporting"), output, force=force)
    click.echo(f"wrote {output}; open it in a browser")
