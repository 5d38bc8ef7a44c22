"""`fireworld diff`: compare two recordings step by step."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from fireworld.cli.difference_text import show, show_header
from fireworld.cli.installed import check_matplotlib

if TYPE_CHECKING:
    from fireworld_recorder.diff import Difference, StepRange
    from fireworld_recorder.reader import Log
    from fireworld_recorder.spread import SpreadRow

__all__ = ["command", "show", "write_json"]


@dataclass(frozen=True, kw_only=True)
class Order:
    """What is compared, by which rules."""

    paths: tuple[Path, Path]
    tolerances: dict[str, float]
    ignore: Sequence[str]
    first_step: int | None
    last_step: int | None
    any_scenario: bool
    partial: bool
    rows: list[SpreadRow] | None = field(default=None)
    """Filled with every step, if a list is given."""

    @property
    def names(self) -> tuple[str, str]:
        """What the recordings are called."""
        return str(self.paths[0]), str(self.paths[1])


@click.command()
@click.argument("first", metavar="A", type=click.Path(path_type=Path))
@click.argument("second", metavar="B", type=click.Path(path_type=Path))
@click.option(
    "--tolerance",
    "tolerances",
    multiple=True,
    metavar="FIELD=X",
    help="Let a field differ by X, as in buildings.temperature=1e-6 or hp=1. May be repeated.",
)
@click.option(
    "--ignore",
    multiple=True,
    metavar="NAME",
    help="Leave out a topic (draws), a field of one (brigades.damage) or of all (damage). May be repeated.",
)
@click.option("--from", "first_step", type=click.IntRange(min=0), metavar="STEP", help="First step to compare.")
@click.option("--to", "last_step", type=click.IntRange(min=0), metavar="STEP", help="Last step to compare.")
@click.option("--any-scenario", is_flag=True, help="Compare runs of two scenarios too, if their cities are the same.")
@click.option("--partial", is_flag=True, help="Compare a cut-off or damaged recording too, as far as it is good.")
@click.option("--json", "as_json", is_flag=True, help="Write JSON.")
@click.option("--junit", metavar="FILE", type=click.Path(path_type=Path), help="Write JUnit XML for a CI server.")
@click.option("--html", metavar="FILE", type=click.Path(path_type=Path), help="Write a page with maps and curves.")
@click.option("--force", is_flag=True, help="Replace existing files.")
@click.pass_context
def command(
    context: click.Context,
    *,
    first: Path,
    second: Path,
    tolerances: Sequence[str],
    ignore: Sequence[str],
    first_step: int | None,
    last_step: int | None,
    any_scenario: bool,
    partial: bool,
    as_json: bool,
    junit: Path | None,
    html: Path | None,
    force: bool,
) -> None:
    """Compare recording B with recording A, step by step.

    Names the first difference by step, phase, entity and field, then what both came to, when each topic came to
    differ, and how the difference spread: how many buildings, brigades and civilians it had reached at which step.
    Everything is compared exactly, unless there is a tolerance for it.

    \b
    fireworld diff golden.mcap new.mcap
    fireworld diff golden.mcap new.mcap --tolerance buildings.temperature=1e-6 --ignore draws
    fireworld diff golden.mcap new.mcap --from 10 --to 20
    fireworld diff golden.mcap new.mcap --html diff.html --junit diff.xml

    Exit code: 0 the same, 1 different, 2 could not compare (no file is written).
    """
    if first_step is not None and last_step is not None and first_step > last_step:
        raise click.UsageError(f"--from and --to: expected a range of steps, got {first_step} to {last_step}")
    outputs = [path for path in (junit, html) if path is not None]
    if force and not outputs:
        raise click.UsageError("--force goes with --junit or --html.")
    if len({path.absolute() for path in (first, second, *outputs)} - {first.absolute(), second.absolute()}) < len(
        outputs
    ):
        raise click.UsageError("--junit and --html: expected files of their own, got one name twice")
    _check_outputs(outputs, force=force, figures=html is not None)
    order = Order(
        paths=(first, second),
        tolerances=dict(_parse_tolerance(text) for text in tolerances),
        ignore=_checked_names(ignore),
        first_step=first_step,
        last_step=last_step,
        any_scenario=any_scenario,
        partial=partial,
        rows=[] if html is not None else None,
    )
    logs = _open(order)
    whole = first_step is None and last_step is None
    if logs[0].digest == logs[1].digest and whole and not as_json and not outputs:
        _tell_same(logs)
        context.exit(0)
    difference = _compare(order, logs)
    if junit is not None:  # before anything is shown: a reader of the output may leave early
        _write_junit(junit, order, difference)
    if html is not None:
        _write_page(html, order, logs, difference)
    if as_json:
        _write_recordings_json(difference, logs)
    else:
        show(difference, names=order.names)
    context.exit(0 if difference.same else 1)


def _parse_tolerance(text: str) -> tuple[str, float]:
    from fireworld_recorder.match import check_field_name

    from fireworld.errors import LogError

    name, _, number = text.partition("=")
    try:
        check_field_name("--tolerance", name)
        tolerance = float(number)
    except LogError as error:
        raise click.UsageError(str(error)) from error
    except ValueError:
        tolerance = -1.0
    if not 0 <= tolerance < float("inf"):
        raise click.UsageError(f"--tolerance: expected FIELD=X with a number X >= 0, got {text!r}")
    return name, tolerance


def _checked_names(names: Sequence[str]) -> Sequence[str]:
    if names:
        from fireworld_recorder.match import check_field_name

        from fireworld.errors import LogError

        try:
            for name in names:
                check_field_name("--ignore", name, topics=True)
        except LogError as error:
            raise click.UsageError(str(error)) from error
    return names


def _check_outputs(paths: Sequence[Path], *, force: bool, figures: bool) -> None:
    """See that the files can be written, before anything is compared.

    Raises:
        OutputError: one exists, or its folder does not.
        ViewError: matplotlib is wanted and not installed.
    """
    from fireworld.errors import OutputError, expected

    for path in paths:
        if not path.parent.is_dir():
            raise OutputError(expected(str(path), "", f"an existing folder {path.parent}", "none", "make it first"))
        if path.is_symlink() or (path.exists() and not path.is_file()):  # /dev/stdout would be replaced, not written to
            raise OutputError(expected(str(path), "", "the name of a file", "a folder, a link or a device"))
        if path.exists() and not force:
            hint = "use --force to replace it"
            raise OutputError(expected(str(path), "", "a name that is free", "an existing file", hint))
    if figures:
        check_matplotlib("diff --html")


def _open(order: Order) -> tuple[Log, Log]:
    """Open both recordings; files of the same bytes are read once.

    Raises:
        LogError: one cannot be read, or is cut off or damaged and --partial is not given.
    """
    first, second = order.paths
    log = _open_one(first, partial=order.partial)
    logs = log, log if _same_bytes(first, second) else _open_one(second, partial=order.partial)
    for found, name in zip(logs, order.names, strict=True):
        if found.damage is not None:
            click.echo(f"{name}: {found.damage}; nothing is compared beyond", err=True)
    return logs


def _open_one(path: Path, *, partial: bool) -> Log:
    from fireworld_recorder.reader import open_log

    from fireworld.errors import LogError

    log = open_log(path, partial=True)
    if log.damage is not None and not partial:
        hint = f"--partial to compare it that far, or `fireworld recover {path}`"
        raise LogError(f"{path}: {log.damage}; try {hint}")
    return log


def _same_bytes(first: Path, second: Path) -> bool:
    import filecmp

    try:
        return filecmp.cmp(first, second, shallow=False)
    except OSError:
        return False  # opening it says why


def _tell_same(logs: tuple[Log, Log]) -> None:
    """Tell of two runs of one digest; they need no comparison, and no library for tables."""
    from fireworld_recorder.comparable import header_differences

    click.echo(f"the same: {len(logs[0])} steps, digest {logs[0].digest}")
    show_header(header_differences(logs[0].header, logs[1].header))


def _compare(order: Order, logs: tuple[Log, Log]) -> Difference:
    """Compare.

    Raises:
        LogError: the scenarios or the cities are not the same, or no step is to be compared.
    """
    from fireworld_recorder.comparable import check_same_scenario
    from fireworld_recorder.diff import compare

    from fireworld.errors import LogError

    if not order.any_scenario and logs[0].digest != logs[1].digest:
        check_same_scenario(logs[0].header, logs[1].header, names=order.names)
    difference = compare(
        *logs,
        tolerances=order.tolerances,
        ignore=order.ignore,
        steps=_steps(order, logs),
        watch=order.rows.append if order.rows is not None else None,
    )
    if difference.first is not None and difference.first.step is None:
        cities = f"{logs[0].city.name} in {order.names[0]} and {logs[1].city.name} in {order.names[1]}"
        raise LogError(f"cannot compare runs in different cities, {cities}: {difference.first.sentence}")
    return difference


def _steps(order: Order, logs: tuple[Log, Log]) -> StepRange:
    """Return the steps to compare: those asked for, and none beyond the good part of a cut-off recording."""
    from fireworld_recorder.diff import StepRange

    ends = [order.last_step] if order.last_step is not None else []
    ends += [int(log.steps.max(initial=-1)) for log in logs if log.damage is not None]
    return StepRange(first=order.first_step, last=min(ends, default=None))


def _write_junit(path: Path, order: Order, difference: Difference) -> None:
    from fireworld_recorder.match import Rules

    from fireworld.cli.difference_junit import junit_xml
    from fireworld.files import write_file

    write_file(path, junit_xml(difference, Rules(order.tolerances, order.ignore), paths=order.paths))
    click.echo(f"wrote {path}", err=True)


def _write_page(path: Path, order: Order, logs: tuple[Log, Log], difference: Difference) -> None:
    from fireworld_recorder.match import Rules

    from fireworld.files import write_file
    from fireworld.recording.pages.difference_page import difference_page
    from fireworld.recording.pages.difference_pictures import draw_all

    rules = Rules(order.tolerances, order.ignore)
    images = draw_all(logs, difference, rules, order.rows or [])
    write_file(path, difference_page(logs, difference, images, names=order.names).encode())
    click.echo(f"wrote {path}; open it in a browser", err=True)


def _write_recordings_json(difference: Difference, logs: tuple[Log, Log]) -> None:
    recordings = [{"path": str(log.path), "state": log.state, "damage": log.damage} for log in logs]
    write_json(difference, digests=[log.digest for log in logs], recordings=recordings)


def write_json(difference: Difference, *, digests: Sequence[str], **more: Any) -> None:
    """Write a comparison as JSON; `more` stands before it. docs/comparing-recordings.md has every key."""
    from fireworld_recorder.plain import plain

    click.echo(json.dumps({"same": difference.same, "digests": list(digests)} | more | plain(difference), indent=2))
