"""`fireworld play`: a recording, or two side by side, as a page that plays."""

from __future__ import annotations

from pathlib import Path

import click

from fireworld.cli.opening import open_one_or_two


@click.command()
@click.argument("logs", metavar="LOG [LOG_B]", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option("-o", "--output", metavar="FILE.html", required=True, type=click.Path(path_type=Path), help="The page.")
@click.option("--from", "first", type=click.IntRange(min=0), metavar="N", help="First step to show.")
@click.option("--to", "last", type=click.IntRange(min=0), metavar="N", help="Last step to show.")
@click.option("--every", type=click.IntRange(min=1), default=1, metavar="N", help="Show every N-th step.")
@click.option("--force", is_flag=True, help="Replace an existing file.")
def command(
    *, logs: tuple[Path, ...], output: Path, first: int | None, last: int | None, every: int, force: bool
) -> None:
    """Write LOG, a recording, or two of one city side by side, as a page that plays in any browser.

    \b
    fireworld play run.mcap -o play.html
    fireworld play alone.mcap together.mcap -o play.html
    fireworld play long.mcap -o play.html --from 100 --every 5

    One HTML file that needs no network, no log and no other file: the map with fire, brigades and jets of water, a
    cursor to play it, curves, events, what each brigade chose and why, the values of any building, brigade or civilian;
    of two recordings also where they first differ and which buildings then do. play.html#41 opens at step 41. The
    same recording gives the same page, to the byte. A recording that was cut off or damaged is shown as far as it is
    good. docs/play.md explains what is in it.

    Exit code: 0 written, 2 could not write, 130 interrupted (nothing is left of it).
    """
    from fireworld.files import check_outputs
    from fireworld.recording.pages.play import play

    check_outputs([output], force=force, inputs=logs)
    held = open_one_or_two(logs, doing="showing")
    play(*held, output=output, first_step=first, last_step=last, every=every, force=force)
    click.echo(f"wrote {output}, {output.stat().st_size / 1e3:,.0f} kB; open it in a browser")
