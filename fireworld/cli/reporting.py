"""What commands write for CI servers: a summary in Markdown, and annotations."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

if TYPE_CHECKING:
    from fireworld.findings import Finding

Command = TypeVar("Command", bound=Callable[..., Any])


def reporting_options(command: Command) -> Command:
    """Add --summary and --annotate to a command."""
    summary = click.option(
        "--summary", metavar="FILE.md", type=click.Path(path_type=Path, dir_okay=False),
        help="Write what is different, and why, as Markdown; pictures go to FILE-files.",
    )  # fmt: skip
    annotate = click.option(
        "--annotate", type=click.Choice(["github"]), help="Print annotations for a CI server, if anything is different."
    )
    return summary(annotate(command))


def check_reporting(*, annotate: str | None, as_json: bool) -> None:
    """Check that annotations do not get into JSON."""
    if annotate and as_json:
        raise click.UsageError("--annotate and --json exclude each other.")


def print_annotations(findings: Sequence[Finding], *, cannot: str = "error") -> None:
    """Print annotations, if there is something to say.

    Args:
        findings: what was found.
        cannot: level of annotations of what is neither the same nor different.
    """
    from fireworld.annotations import annotation_lines

    for line in annotation_lines(findings, cannot=cannot):
        click.echo(line)
